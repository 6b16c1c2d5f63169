"""Markers in TRC and force plates in MOT files: axes, units, what moments are about, damaged copies."""

import csv
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.recordings import read_mot, read_recording, read_trc

TRC = """PathFileType\t4\t(X/Y/Z)\twalk.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
100\t100\t3\t2\tmm\t100\t1\t3
Frame#\tTime\tR.Heel\t\t\tL.Heel\t\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.50\t100\t50\t200\t100\t50\t-200
2\t0.51\t110\t50\t200\t\t\t\t
3\t0.52\t120\t50\t200\t0\t0\t0
"""


def mot(rows, names=None, head="nRows={rows}\nnColumns={columns}\n"):
    names = names or ["time"] + [f"ground_force_1_{k}{axis}" for k in "vpm" for axis in "xyz"]
    lines = ["forces", head.format(rows=len(rows), columns=len(names)) + "inDegrees=yes", "endheader"]
    lines += ["\t".join(names)] + ["\t".join(f"{value:.9g}" for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def pressing(count=30, about=None):
    """A force that wanders over a plate, y up, with a free moment of 5 N.m; moments about it or ``about``."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    force = np.array([-60.0, 700.0, 20.0]) + share * [120.0, 50.0, -30.0]
    point = np.array([0.1, 0.006, -0.2]) + share * [0.25, 0.0, 0.03]
    moment = np.tile([0.0, 5.0, 0.0], (count, 1))
    if about is not None:
        moment = moment + np.cross(point - about, force)
    return np.hstack([0.5 + 0.01 * np.arange(count)[:, None], force, point, moment])


@pytest.fixture
def trc_file(tmp_path):
    file = tmp_path / "walk.trc"
    file.write_text(TRC)
    return file


def test_trc_by_hand(trc_file):
    """Millimetres, y up: forward stays x, what is right (z) becomes -y. Empty and zero are gaps."""
    found = read_trc(trc_file)
    assert found.marker_names == ("R.Heel", "L.Heel")
    assert (found.rate, found.start, found.plates) == (100.0, 0.5, ())
    np.testing.assert_allclose(found.marker("R.Heel")[1], [0.11, -0.2, 0.05])
    np.testing.assert_allclose(found.marker("L.Heel")[0], [0.1, 0.2, 0.05])
    assert [(gap.marker, gap.first, gap.stop) for gap in found.gaps] == [("L.Heel", 1, 3)]
    np.testing.assert_allclose(read_trc(trc_file, up="z").marker("R.Heel")[1], [0.11, 0.05, 0.2])


@pytest.mark.parametrize("between", [",", ";"])
def test_plates_in_a_csv_file_are_those_of_the_mot_file(tmp_path, trc_file, between):
    """The same columns, parted by commas; a file that begins with the markers' name is read along."""
    text = mot(pressing())
    (tmp_path / "plates.mot").write_text(text)
    table = text.split("endheader\n")[1].replace("\t", between)
    trc_file.with_name("walk plates.csv").write_text(table)
    trc_file.with_name("walk notes.csv").write_text("what,vx\nnothing,1\n")
    recording = read_trc(trc_file)
    (plate,), (wanted,) = recording.plates, read_mot(tmp_path / "plates.mot")
    np.testing.assert_array_equal(plate.wrenches, wanted.wrenches)
    assert (plate.rate, plate.start) == (wanted.rate, wanted.start)
    assert "force plates are those of walk plates.csv" in recording.remarks


def test_plates_beside_the_markers_are_read_with_them(trc_file):
    beside = trc_file.with_name("walk_grf.mot")
    beside.write_text(mot(pressing()))
    (plate,) = read_recording(trc_file).plates
    assert plate.start == pytest.approx(0.5)
    assert plate.rate == pytest.approx(100.0)
    assert read_trc(trc_file, forces=()).plates == ()
    assert len(read_recording(trc_file, frames=(1, 3)).plates[0]) == 2
    other = beside.rename(trc_file.with_name("other.sto"))
    np.testing.assert_array_equal(read_trc(trc_file, forces=other).plates[0].wrenches, plate.wrenches)
    for part in (other, trc_file.with_name("x.asf")):
        with pytest.raises(InputError, match="part of a recording only"):
            read_recording(part)
    with pytest.raises(InputError, match="frames 2 to 4; valid: within 0 to 3"):
        read_recording(trc_file, frames=(2, 4))


@pytest.mark.parametrize("about", [None, [0.0, 0.0, 0.0], [1.12, 0.006, 0.3]])
def test_what_the_moments_are_about_is_told(tmp_path, about):
    """The same wrench from moments about the point, the world's origin or a plate's own middle."""
    file = tmp_path / "forces.mot"
    file.write_text(mot(pressing(about=about)))
    (plate,) = read_mot(file)
    rows = pressing()
    force, point = rows[:, [1, 3, 2]] * [1.0, -1.0, 1.0], rows[:, [4, 6, 5]] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(plate.force, force, atol=1e-6)
    np.testing.assert_allclose(plate.cop, point, atol=1e-6)
    free = plate.wrenches[:, 3:] - np.cross(point, force)
    np.testing.assert_allclose(free, np.tile([0.0, 0.0, 5.0], (len(free), 1)), atol=1e-4)
    if about is not None:
        world = np.array(about)[[0, 2, 1]] * [1.0, -1.0, 1.0]
        np.testing.assert_allclose(read_mot(file, moments_about=world)[0].cop, point, atol=1e-6)


@pytest.mark.parametrize("names", ["ground_force_v ground_force_p ground_torque_", "1_f_v 1_f_p 1_f_m"])
def test_other_names_of_columns_and_an_older_header(tmp_path, names):
    file = tmp_path / "forces.mot"
    columns = ["time", *(f"{stem}{axis}" for stem in names.split() for axis in "xyz")]
    file.write_text(mot(pressing(), columns, "datarows {rows}\ndatacolumns {columns}\n"))
    assert np.all(read_mot(file)[0].pressed)


def test_nowhere_is_allowed_without_a_force(tmp_path):
    rows = pressing()
    rows[:5, 1:4], rows[:5, 4:] = 0.0, np.nan
    file = tmp_path / "forces.mot"
    file.write_text(mot(rows))
    (plate,) = read_mot(file)
    assert np.all(plate.wrenches[:5] == 0.0)
    assert np.all(np.isnan(plate.cop[:5]))
    rows[7, 4] = np.nan
    file.write_text(mot(rows))
    with pytest.raises(InputError, match="acts nowhere"):
        read_mot(file)


# --- broken files -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("PathFileType", "Path"),
        ("NumMarkers", "Markers"),
        ("100\t100\t3\t2\tmm", "0\t100\t3\t2\tmm"),
        ("100\t100\t3\t2\tmm", "nan\t100\t3\t2\tmm"),
        ("100\t100\t3\t2\tmm", "100\t100\t3\t2\tyards"),
        ("100\t100\t3\t2\tmm", "100\t100\t3"),
        ("Frame#", "#"),
        ("120\t50", "12o\t50"),
        ("120\t50", "inf\t50"),
        ("120\t50", "1e300\t50"),
        ("120\t50\t200\t0\t0\t0", "120\t50\t200\t0"),
        ("3\t0.52", "4\t0.52"),
        ("3\t0.52", "3\t0.62"),
        ("3\t0.52", "3\t"),
        ("2\t0.51\t110\t50\t200\t\t\t\t\n", ""),
    ],
)
def test_broken_trc_is_refused_in_one_line(trc_file, old, new):
    assert old in TRC
    trc_file.write_text(TRC.replace(old, new, 1))
    with pytest.raises(InputError, match=r"walk\.trc.*; valid: ") as error:
        read_recording(trc_file)
    assert "\n" not in str(error.value)


CORTEX = """[Force Data]
NumberOfForcePlates=1
SampleRate=100.000000
NumberOfSamples=3
#Sample\tFX1\tFY1\tFZ1\tX1\tY1\tZ1\tMZ1
1\t10\t20\t700\t100\t50\t0\t3000
2\t10\t20\t700\t100\t50\t0\t3000
3\t10\t20\t700\t100\t50\t0\t3000
"""


def test_a_person_who_stands_along_z_and_cortex_plates_share_their_axes(tmp_path):
    """A TRC file declares no axis; its plates, read with the same one, are level and press upwards."""
    places = {"L.ASIS": (0, 100, 950), "R.ASIS": (0, -100, 950), "L.Heel": (-80, 90, 30),
              "R.Heel": (-80, -90, 30), "L.Toe": (120, 90, 30), "R.Toe": (120, -90, 30)}  # fmt: skip
    names = "Frame#\tTime\t" + "".join(f"{name}\t\t\t" for name in places)
    cells = "\t".join(str(value) for place in places.values() for value in place)
    head = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n100\t3\t6\tmm\n"
    rows = "".join(f"{k + 1}\t{k / 100}\t{cells}\n" for k in range(3))
    (tmp_path / "walk.trc").write_text(f"{head}{names}\n\n{rows}")
    (tmp_path / "walk.forces").write_text(CORTEX)
    found = read_trc(tmp_path / "walk.trc")
    assert found.marker("L.ASIS")[0] == pytest.approx([0.0, 0.1, 0.95])
    plate = found.plates[0]
    assert plate.normal == pytest.approx([0.0, 0.0, 1.0])
    # Force at (0.1, 0.05, 0) m with a free moment of 3 N.m: its moment about the origin by hand.
    assert plate.wrenches[0] == pytest.approx([10.0, 20.0, 700.0, 35.0, -70.0, 2.0 - 0.5 + 3.0])
    assert any("another axis" in remark for remark in found.remarks)


@pytest.mark.parametrize("counts", ["4\t2", "2\t2", "999999999999\t2", "3\t999999999", "3\t1"])
def test_a_trc_header_that_counts_wrongly_is_read_as_the_data_are(trc_file, counts):
    trc_file.write_text(TRC.replace("100\t100\t3\t2\tmm", f"100\t100\t{counts}\tmm", 1))
    found = read_trc(trc_file)
    assert found.positions.shape == (3, 2, 3)
    assert any("declares" in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("endheader", "end"),
        ("nRows=30", "nRows=many"),
        ("time\t", "frame\t"),
        ("_1_vy", "_1_vx"),
        ("_1_pz", "_1_qz"),
        ("_1_v", "_1_f"),
        ("\n0.52\t", "\n0.55\t"),
        ("\n0.52\t", "\nnan\t"),
        ("\n0.52\t", "\n0.52\tx"),
        ("\n0.52\t", "\n0.52 7\t"),
        ("\n0.5\t-60", "\n0.5\tnan"),
        ("\n0.5\t-60", "\n0.5\tinf"),
    ],
)
def test_broken_mot_is_refused_in_one_line(tmp_path, old, new):
    file, text = tmp_path / "forces.mot", mot(pressing())
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=r"forces\.mot.*; valid: ") as error:
        read_mot(file)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize(
    "content", [b"", b" \n", b"\xff\xfe\x00\x01", b"a\0b", b"endheader", b"PathFileType"]
)
def test_what_is_neither_is_refused_in_one_line(tmp_path, content):
    for name, read in (("x.trc", read_recording), ("x.mot", read_mot)):
        file = tmp_path / name
        with pytest.raises(InputError, match="No such file"):
            read(file)
        file.write_bytes(content)
        with pytest.raises(InputError, match=r"x\..*; valid: "):
            read(file)


@given(st.integers(0, 10**6), st.binary(max_size=4))
def test_a_damaged_file_is_read_or_refused(trc_file, place, junk):
    """Bytes replaced anywhere, or the file cut short there: never another exception."""
    forces = trc_file.with_name("walk_grf.mot")
    forces.write_text(mot(pressing(12)))
    for file, read, frames in ((trc_file, read_trc, 3), (forces, lambda file: read_mot(file)[0], 12)):
        whole = file.read_bytes()
        at = place % len(whole)
        file.write_bytes(whole[:at] + (junk + whole[at + len(junk) :] if junk else b""))
        message = ""
        try:
            found = read(file)
            # A file cut short between two rows is read as it is; a recording says so.
            assert len(found) == frames or junk or file is forces or found.remarks
        except InputError as refusal:
            message = str(refusal)
        assert "\n" not in message
        file.write_bytes(whole)


# --- real recordings ----------------------------------------------------------------------------

FEET = {
    "C3D": ("HEE", "TOE", "ANK", "CAL", "MT1", "MT2", "MAL", "LFOO", "RFOO"),
    "TRC+MOT": ("_calc", "_toe", "5meta", "_ankle", "Heel", "Toe", "Ankle"),
}


def trials(folder):
    with (folder.parent / "trials_grf.csv").open() as file:
        return [(row, read_recording(folder / "grf" / row["file"])) for row in csv.DictReader(file)]


def loaded(found, plate, least=100.0):
    """Frames with at least this force, and of these the centres of pressure [m] and the forces [N]."""
    samples = np.arange(len(found)) * round(plate.rate / found.rate)
    frames = np.flatnonzero(plate.force[samples, 2] > least)
    return frames, plate.cop[samples[frames]], plate.force[samples[frames]]


def test_every_trial_with_force_plates_is_that_of_the_table(recordings_folder):
    """Frames, rates, plates; heads, trunks or hips of a standing or walking person at their heights."""
    for row, found in trials(recordings_folder):
        assert len(found) == int(row["frames"]), row
        assert found.rate == pytest.approx(float(row["marker_fps"])), row
        used = [plate for plate in found.plates if plate.pressed.any()]
        assert len(used) == int(row["plates"].split()[0]), row
        assert used[0].rate == pytest.approx(float(row["force_hz"])), row
        top = np.nanpercentile(found.positions[..., 2], 99.5)
        assert 0.9 < top < (2.4 if "jump" in row["motion"] else 2.1), row


def test_walkers_carry_about_their_weight_where_their_feet_are(recordings_folder):
    """Peaks of the vertical force are an adult's weight to a half more, horizontal forces a third of that.

    Centres of pressure are near markers of a foot, half a foot's length at most.
    """
    for row, found in trials(recordings_folder):
        if "walk" not in row["motion"].lower():
            continue
        feet = [k for k, n in enumerate(found.marker_names) if any(part in n for part in FEET[row["format"]])]
        for plate in found.plates:
            frames, cop, force = loaded(found, plate)
            if not len(frames):
                continue
            assert 450.0 < force[:, 2].max() < 1300.0, (row, plate.name)
            assert np.abs(force[:, :2]).max() < 0.35 * force[:, 2].max(), (row, plate.name)
            apart = np.linalg.norm((found.positions[frames][:, feet] - cop[:, None])[..., :2], axis=2)
            assert np.median(np.nanmin(apart, axis=1)) < 0.085, (row, plate.name)


def test_walking_speeds_are_those_of_the_table(recordings_folder):
    """Mean horizontal velocity of the front of the pelvis, to the table's two digits and how it was taken."""
    checked = 0
    for row, found in trials(recordings_folder):
        words = row["motion"].split()
        if "m/s" not in row["motion"]:
            continue
        speed = float(next(word for word in words if word.replace(".", "").isdigit()))
        pelvis = [k for k, n in enumerate(found.marker_names) if n in ("LASI", "RASI", "L.ASIS", "R.ASIS")]
        places = found.positions[:, pelvis].mean(axis=1)[:, :2]
        seen = np.flatnonzero(~np.isnan(places[:, 0]))
        way = places[seen[-1]] - places[seen[0]]
        measured = np.linalg.norm(way) * found.rate / (seen[-1] - seen[0])
        assert measured == pytest.approx(speed, abs=0.03), row
        checked += 1
    assert checked >= 8


def test_standing_up_from_a_chair_is_carried_by_two_plates(recordings_folder):
    """Sit-to-stand: the feet carry most of the weight standing, less sitting; heights of head markers."""
    found = read_recording(recordings_folder / "grf" / "nimble_opencap_s4" / "STS1.trc")
    total = sum(plate.force[:, 2] for plate in found.plates)
    neck = found.marker("C7")[:, 2]
    assert neck.max() - neck.min() > 0.3
    standing = total[neck > neck.max() - 0.02]
    sitting = total[neck < neck.min() + 0.15]
    assert 500.0 < np.median(standing) < 900.0
    assert np.median(sitting) < 0.5 * np.median(standing)


def test_a_pipe_beside_a_recording_is_no_force_plate(tmp_path):
    os.mkfifo(tmp_path / "walk.mot")
    (tmp_path / "walk.trc").write_text(TRC)
    assert read_recording(tmp_path / "walk.trc").plates == ()
