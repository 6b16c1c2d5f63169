"""Recordings are read with the right axes, units and rotations; broken files are refused in one line."""

import csv
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import uniform_filter1d

from manikin.body import Configuration, human, random_configuration
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.recordings import read_amc, read_asf, read_bvh, read_marker_map, read_recording
from manikin.reports.formats.bvh import rest_rotations, to_bvh

CMU = 0.0254 / 0.45


def test_bvh_by_hand(bvh_file):
    """X left, Y up, Z forward; channels from left to right; the root's OFFSET is not added."""
    found = read_bvh(bvh_file)
    assert found.joint_names == ("hips", "spine", "leg")
    assert found.rate == pytest.approx(50.0)
    assert found.duration == pytest.approx(0.02)
    np.testing.assert_allclose(found.time, [0.0, 0.02])
    np.testing.assert_allclose(found.positions[0], [[0.02, 0.01, 1.0], [0.02, 0.01, 2.0], [0.02, 0.11, 1.0]])
    # Hips turned by 90 degrees about Y (up): what pointed left points backward.
    np.testing.assert_allclose(found.positions[1, 2], [0.02 - 0.1, 0.01, 1.0], atol=1e-12)
    # Leg turned by -90 degrees about X (left): from down to forward, which is now left.
    end = found.world_rotations[1, 2] @ found.ends["leg"]
    np.testing.assert_allclose(end, [0.0, 0.9, 0.0], atol=1e-12)
    # Rz Rx of the spine: X takes up to forward, Z leaves that; forward of the hips is now left.
    end = found.world_rotations[1, 1] @ found.ends["spine"]
    np.testing.assert_allclose(end, [0.0, 0.8, 0.0], atol=1e-12)


def test_unit_of_bvh_is_told_from_the_size_unless_given(bvh_file, tmp_path):
    assert read_bvh(bvh_file, metres_per_unit=0.5).offsets[1] == pytest.approx([0.0, 0.0, 50.0])
    wrong = tmp_path / "tiny.bvh"
    wrong.write_text(
        bvh_file.read_text().replace("100.0", "0.01").replace("90.0", "0.1").replace("80.0", "0")
    )
    with pytest.raises(InputError, match="metres_per_unit"):
        read_bvh(wrong)


def test_amc_by_hand(amc_file):
    """A bone turns about its own axes, fixed in the rest pose, x before z; lengths are inches / 0.45."""
    found = read_amc(amc_file)
    assert found.joint_names == ("root", "hip", "thigh")
    assert found.rate == 120.0
    assert len(found) == 3
    root = CMU * np.array([3.0, 1.0, 2.0])
    np.testing.assert_allclose(found.positions[:, 0], [root] * 3)
    np.testing.assert_allclose(found.positions[0, 2] - root, [0.0, 2 * CMU, 0.0], atol=1e-12)
    # Root turned by 90 degrees about Y (up): left becomes backward.
    np.testing.assert_allclose(found.positions[1, 2] - root, [-2 * CMU, 0.0, 0.0], atol=1e-12)
    # The thigh's x axis is the rest pose's Y (C = 90 degrees about Z): it only twists.
    np.testing.assert_allclose(found.ends["thigh"], [0.0, 0.0, -4 * CMU], atol=1e-12)
    end = found.rotations[1, 2] @ found.ends["thigh"]
    np.testing.assert_allclose(end, [0.0, 0.0, -4 * CMU], atol=1e-12)
    # Rz Ry Rx in its axes: the twist comes first, then 90 degrees about Z (forward): down becomes left.
    end = found.rotations[2, 2] @ found.ends["thigh"]
    np.testing.assert_allclose(end, [0.0, 4 * CMU, 0.0], atol=1e-12)


def test_skeleton_beside_or_given(amc_file, tmp_path):
    skeleton = read_asf(tmp_path / "person.asf")
    other = amc_file.rename(tmp_path / "other.amc")
    np.testing.assert_array_equal(
        read_amc(other, skeleton).positions, read_amc(other, skeleton, 60).positions
    )
    with pytest.raises(InputError, match=r"no skeleton 'other\.asf' beside it"):
        read_amc(other)
    with pytest.raises(InputError, match="no reader"):
        read_recording(tmp_path / "motion.xyz")


def test_our_own_bvh_comes_back(tmp_path):
    """What is exported is read again: every segment where it was, to the digits in the file."""
    body, rng = human(), np.random.default_rng(5)
    q = np.array([random_configuration(body, rng) for _ in range(4)])
    n, zero = len(q), np.zeros((len(q), body.nv))
    motion = Motion(
        time=np.arange(n) * 0.01, q=q, v=zero, a=zero, tau=zero, com=np.zeros((n, 3)),
        angular_momentum=np.zeros((n, 3)), margin=np.zeros(n), support=np.zeros((n, 1), dtype=bool),
        contact_force=np.zeros((n, 1, 6)), contact_names=("left_foot",), joint_names=body.joint_names,
    )  # fmt: skip
    file = tmp_path / "ours.bvh"
    file.write_text(to_bvh(body, motion))
    found = read_bvh(file)
    for frame in range(n):
        state = Configuration(body, q[frame])
        for segment in body.segments:
            joint = found.joint_names.index(segment.name)
            rotation, position = state.segment_placement(segment.name)
            np.testing.assert_allclose(found.positions[frame, joint], position, atol=1e-7)
            turned = found.world_rotations[frame, joint] @ rest_rotations(body)[segment.name]
            np.testing.assert_allclose(turned, rotation, atol=1e-7)


# --- broken files -------------------------------------------------------------------------------


def one_line(error):
    text = str(error.value)
    return "\n" not in text and "valid: " in text


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("HIERARCHY", "HIERARCH"),
        ("MOTION", "MOTI"),
        ("ROOT hips", "JOINT hips"),
        ("JOINT leg", "JOINT spine"),
        ("OFFSET 10.0", "OFFSET nan"),
        ("OFFSET 10.0", "OFFSET ten"),
        ("CHANNELS 1 Xrotation", "CHANNELS 1 Wrotation"),
        ("CHANNELS 1 Xrotation", "CHANNELS 99999999 Xrotation"),
        ("CHANNELS 1 Xrotation", "CHANNELS -1"),
        ("CHANNELS 1 Xrotation", "CHANNELS 3 Xposition Yposition Zposition"),
        ("    CHANNELS 1 Xrotation\n", ""),
        ("Frames: 2", "Frames: 3"),
        ("Frames: 2", "Frames: 0"),
        ("Frames: 2", "Frames: two"),
        ("Frames: 2", "Frames: 999999999999999999"),
        ("Frame Time: 0.02", "Frame Time: 0"),
        ("Frame Time: 0.02", "Frame Time: inf"),
        ("90  -90", "90  NaN"),
        ("90  -90", "90  -90 4"),
        ("90  -90", "90  -9o"),
    ],
)
def test_broken_bvh_is_refused_in_one_line(bvh_file, old, new):
    text = bvh_file.read_text()
    assert old in text
    bvh_file.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=r"small\.bvh") as error:
        read_bvh(bvh_file)
    assert one_line(error)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("person.asf", ":hierarchy", ":hier"),
        ("person.asf", "length 0.45", "length 0"),
        ("person.asf", "angle deg", "angle grad"),
        ("person.asf", "order TX TY TZ RX RY RZ", "order TX TY"),
        ("person.asf", "position 0 0 0", "position 0 0 1"),
        ("person.asf", "direction 1 0 0", "direction 0 0 0"),
        ("person.asf", "direction 1 0 0", "direction 1 0"),
        ("person.asf", "length 2", "length nan"),
        ("person.asf", "name hip", "name"),
        ("person.asf", "name hip", "name thigh"),
        ("person.asf", "dof rx rz", "dof rx tz"),
        ("person.asf", "axis 0 0 90 XYZ", "axis 0 0 90 XXZ"),
        ("person.asf", "root hip", "root foot"),
        ("person.asf", "    hip thigh\n", ""),
        ("person.asf", "  end\n:hierarchy", ":hierarchy"),
        ("person_1.amc", "thigh 90 90", "thigh 90"),
        ("person_1.amc", "thigh 90 90", "thigh 90 inf"),
        ("person_1.amc", "thigh 90 90", "thigh 90 x"),
        ("person_1.amc", "thigh 90 90\n", ""),
        ("person_1.amc", "thigh 90 90", "shank 90 90"),
        ("person_1.amc", "\n9\n", "\n10\n"),
        ("person_1.amc", "\n9\n", "\n"),
        ("person_1.amc", "\n7\n", "\n"),
    ],
)
def test_broken_amc_is_refused_in_one_line(amc_file, name, old, new):
    file = amc_file.with_name(name)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=r"person(_1\.amc|\.asf)") as error:
        read_amc(amc_file)
    assert one_line(error)


@pytest.mark.parametrize(
    "content", [b"", b"  \n", b"\xff\xfe\x00\x01", b"a\0b", b"MOTION", b"HIERARCHY MOTION"]
)
@pytest.mark.parametrize("name", ["x.bvh", "x.amc", "x.asf"])
def test_what_is_no_recording_is_refused_in_one_line(amc_file, content, name):
    file = amc_file.with_name(name)
    file.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_asf(file) if name.endswith("asf") else read_recording(file)
    assert one_line(error)
    for missing in (file.with_name("none.bvh"), file.parent / "folder.bvh"):
        (file.parent / "folder.bvh").mkdir(exist_ok=True)
        with pytest.raises(InputError) as error:
            read_bvh(missing)
        assert one_line(error)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names")
@pytest.mark.parametrize("name", ["x.bvh", "person_2.amc", "x.c3d", "x.trc", "map.yaml"])
def test_what_is_no_file_is_refused_and_not_waited_for(amc_file, name):
    """Nobody writes to this pipe: opening it would wait for ever."""
    file = amc_file.with_name(name)
    os.mkfifo(file)
    with pytest.raises(InputError, match="is no regular file; valid: a"):
        read_marker_map(file) if name.endswith("yaml") else read_recording(file)


def test_a_file_larger_than_memory_should_hold_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "x.bvh").open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(InputError, match=r"x.bvh: has 1000000000000 bytes; valid: at most"):
        read_recording(tmp_path / "x.bvh")


@given(st.integers(0, 10**6), st.binary(max_size=4))
def test_a_damaged_file_is_read_or_refused(bvh_file, amc_file, place, junk):
    """Bytes replaced anywhere, or the file cut short there: never another exception."""
    for file, read in (
        (bvh_file, read_bvh),
        (amc_file, read_amc),
        (amc_file.with_name("person.asf"), lambda _: read_amc(amc_file)),
    ):
        whole = file.read_bytes()
        at = place % len(whole)
        file.write_bytes(whole[:at] + (junk + whole[at + len(junk) :] if junk else b""))
        message = ""
        try:
            assert np.all(np.isfinite(read(file).positions))
        except InputError as error:
            message = str(error)
        assert "\n" not in message
        file.write_bytes(whole)


# --- real recordings ----------------------------------------------------------------------------


def table(folder, name):
    with (folder.parent / name).open() as file:
        return list(csv.DictReader(file))


def head_and_end(found):
    name = "head" if "head" in found.joint_names else "Head"
    joint = found.joint_names.index(name)
    end = found.positions[:, joint] + found.world_rotations[:, joint] @ found.ends[name]
    return found.positions[:, joint], end


@pytest.mark.slow
@pytest.mark.parametrize("every", [6, pytest.param(1, marks=pytest.mark.long)])
def test_every_real_recording_is_read(recordings_folder, every):
    """Joints stay above the floor, within a person's height or what was climbed."""
    files = sorted([*recordings_folder.glob("*/*.bvh"), *recordings_folder.glob("*/*.amc")])
    assert len(files) > 100
    for file in files[::every]:
        found = read_recording(file)
        low, high = found.positions[..., 2].min(), found.positions[..., 2].max()
        assert -0.15 < low < 0.4, file.name
        assert 0.2 < high - low < 2.6, file.name


def test_heights_of_real_recordings_are_those_of_the_table(recordings_folder):
    """Hips and head of clips in a table made independently, to its two digits."""
    rows = table(recordings_folder, "clips_cluttered.csv")[::4]
    assert rows
    for row in rows:
        found = read_recording(recordings_folder / row["file"])
        assert len(found) == int(row["frames"])
        assert found.rate == pytest.approx(float(row["fps"]), rel=1e-4)
        height = found.root_positions[:, 2]
        head, end = head_and_end(found)
        top = head if row["source"] == "ACCAD" else end
        measured = [height.min(), height.max(), top[:, 2].min()]
        wanted = [float(row[key]) for key in ("hip_min_m", "hip_max_m", "head_min_m")]
        np.testing.assert_allclose(measured, wanted, atol=0.0051)


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.long)])
def test_velocities_of_real_recordings_are_those_of_the_table(recordings_folder, every):
    """Mean velocity of the shoulders' middle along and across them, and of their turning, in all windows.

    The table was made independently, of shoulders smoothed by a mean over a quarter of a second, the ends
    held; so done, what is left is its rounding. Idle windows, made in another way, are left out.
    """
    rows = [row for row in table(recordings_folder, "clips_locomotion.csv") if row["class"] != "idle"]
    assert len(rows) > 80
    for row in rows[::every]:
        window = (int(row["first_frame0"]), int(row["end_frame0"]))
        found = read_recording(recordings_folder / row["file"])
        width = round(0.25 * found.rate) | 1
        left, right = (
            uniform_filter1d(_shoulder(found, side)[:, :2], width, axis=0, mode="nearest")
            for side in ("left", "right")
        )
        across = (left - right) / np.linalg.norm(left - right, axis=1)[:, None]
        forward = np.column_stack([across[:, 1], -across[:, 0]])
        velocity = np.gradient(0.5 * (left + right), 1.0 / found.rate, axis=0)
        turning = np.gradient(np.unwrap(np.arctan2(forward[:, 1], forward[:, 0])), 1.0 / found.rate)
        measured = [
            np.mean(values[slice(*window)])
            for values in (np.sum(velocity * forward, axis=1), np.sum(velocity * across, axis=1), turning)
        ]
        wanted = [float(row[key]) for key in ("v_forward_mps", "v_lateral_left_mps", "yaw_rate_dps")]
        np.testing.assert_allclose(measured[:2], wanted[:2], atol=0.0065, err_msg=str(row))
        np.testing.assert_allclose(np.rad2deg(measured[2]), wanted[2], atol=0.1, err_msg=str(row))


STANDING = {"accad_male1_bvh/Male1_A1_Stand.bvh": "Head", "accad_male1_bvh/Male1_B3_Walk.bvh": "Head"} | {
    f"cmu_asf_amc/{clip}.amc": "head" for clip in ("02_01", "05_01", "07_01", "08_04", "16_15", "49_01")
}
"""Clips of people upright throughout, and the joint that carries the top of the skeleton."""


@pytest.mark.parametrize("clip", STANDING)
def test_people_who_stand_are_as_tall_as_people(recordings_folder, clip):
    """From the lowest joint to the end of the head's bone: a wrong unit would be off by far more."""
    found = read_recording(recordings_folder / clip)
    joint = found.joint_names.index(STANDING[clip])
    top = found.positions[:, joint] + found.world_rotations[:, joint] @ found.ends[STANDING[clip]]
    tall = top[:, 2] - found.positions[..., 2].min(axis=1)
    assert 1.4 < np.median(tall) < 2.1


def _shoulder(found, side):
    names = {
        "left": ("lhumerus", "LeftArm", "LeftShoulder"),
        "right": ("rhumerus", "RightArm", "RightShoulder"),
    }
    return found.positions[:, found.joint_names.index(next(n for n in names[side] if n in found.joint_names))]
