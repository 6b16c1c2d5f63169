"""Markers followed by our human: synthetic people with known joints, and real recordings."""

from dataclasses import astuple, replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.errors import BodyError, InputError
from manikin.recordings import (
    MarkerRecording,
    Subject,
    motion_of,
    person_of,
    read_recording,
    reconstruct,
    smoothed,
)
from manikin.recordings.readers.marker_sets import marker_set
from manikin.recordings.reconstruction.marker_reconstruction import (
    hip_centres,
    landmarks,
    marker_centres,
    pelvis_axes,
    sides_exchanged,
)

PELVIS = {"ASI": (0.10, 0.125, 0.09), "PSI": (-0.09, 0.05, 0.10)}
"""Markers on the person's left, in the pelvis' frame [m]."""


def markers_of(body):
    """Segment and local place of a full Plug-in Gait set with medial markers, both sides."""
    found = {}
    lengths = body.lengths
    for letter, side, sign in (("L", "left", 1.0), ("R", "right", -1.0)):
        across = np.array([1.0, sign, 1.0])
        for name, place in PELVIS.items():
            found[letter + name] = ("pelvis", across * place)
        shoulder = np.array(body.segment(f"{side}_upper_arm").origin)
        depth = 0.17 * lengths["shoulders"]
        thigh, shank, arm, fore = (lengths[n] for n in ("thigh", "shank", "upper_arm", "forearm"))
        found |= {
            letter + "HJC": ("pelvis", np.array(body.segment(f"{side}_thigh").origin)),
            letter + "SHO": ("thorax", shoulder + depth * np.eye(3)[2]),
            letter + "THI": (f"{side}_thigh", np.array([0.02, 0.08 * sign, -0.6 * thigh])),
            letter + "KNE": (f"{side}_thigh", np.array([0.0, 0.057 * sign, -thigh])),
            letter + "KNEM": (f"{side}_thigh", np.array([0.0, -0.057 * sign, -thigh])),
            letter + "TIB": (f"{side}_leg", np.array([0.02, 0.06 * sign, -0.5 * shank])),
            letter + "ANK": (f"{side}_leg", np.array([0.0, 0.042 * sign, -shank])),
            letter + "ANKM": (f"{side}_leg", np.array([0.0, -0.042 * sign, -shank])),
            letter + "HEE": (f"{side}_foot", np.array([-0.05, 0.0, -0.04])),
            letter + "TOE": (f"{side}_foot", np.array([0.14, 0.0, -0.04])),
            letter + "ELB": (f"{side}_upper_arm", np.array([0.0, 0.047 * sign, -arm])),
            letter + "ELBM": (f"{side}_upper_arm", np.array([0.0, -0.047 * sign, -arm])),
            letter + "WRA": (f"{side}_forearm", np.array([0.03, 0.0, -fore])),
            letter + "WRB": (f"{side}_forearm", np.array([-0.03, 0.0, -fore])),
            letter + "FHD": ("neck", np.array([0.10, 0.07 * sign, 0.17])),
            letter + "BHD": ("neck", np.array([-0.08, 0.07 * sign, 0.17])),
        }
    top = np.array(body.segment("left_upper_arm").origin)[2]
    found |= {
        "C7": ("thorax", np.array([-0.06, 0.0, top + 0.06])),
        "CLAV": ("thorax", np.array([0.07, 0.0, top])),
        "STRN": ("thorax", np.array([0.10, 0.0, top - 0.15])),
    }
    return found


def recorded(body, q, rate=50.0, name="walk"):
    """Postures of our body as its markers."""
    placed, data = markers_of(body), body.pinocchio.createData()
    positions = np.empty((len(q), len(placed), 3))
    for frame, posture in enumerate(q):
        pin.framesForwardKinematics(body.pinocchio, data, posture)
        for k, (segment, place) in enumerate(placed.values()):
            positions[frame, k] = data.oMf[body.segment_frame(segment)].act(place)
    return MarkerRecording(name, tuple(placed), positions, rate)


def walking(body, frames=40, rate=50.0):
    """Something like a walk: one stride per second, 1.2 m/s along x; upright at the middle of it."""
    time, q = np.arange(frames) / rate, np.tile(body.standing_posture(), (frames, 1))
    swing = np.sin(2.0 * np.pi * time)
    q[:, 0] += 1.2 * time

    def add(joint, values):
        q[:, 7 + body.joint_index(joint)] += values

    for side, sign in (("left", 1.0), ("right", -1.0)):
        add(f"{side}_hip_flexion", 0.4 * sign * swing)
        add(f"{side}_knee_flexion", 0.4 * (1.0 - np.cos(2.0 * np.pi * time + sign)))
        add(f"{side}_shoulder_flexion", -0.3 * sign * swing)
        add(f"{side}_elbow_flexion", 0.2 + 0.1 * sign * swing)
    return q


def places(body, q, names):
    data, found = body.pinocchio.createData(), []
    for posture in q:
        pin.framesForwardKinematics(body.pinocchio, data, posture)
        found.append([data.oMf[body.segment_frame(name)].translation.copy() for name in names])
    return np.array(found)


@pytest.fixture(scope="module")
def person():
    lengths = {"thigh": 0.40, "shank": 0.43, "trunk": 0.50, "upper_arm": 0.30, "forearm": 0.26}
    return human(1.75, 70.0, lengths=lengths | {"hips": 0.17, "shoulders": 0.36})


@pytest.fixture(scope="module")
def walk(person):
    return recorded(person, walking(person))


@pytest.fixture(scope="module")
def followed(walk):
    return reconstruct(walk)


def with_positions(recording, change):
    positions = np.array(recording.positions)
    change(positions)
    return replace(recording, positions=positions)


def test_our_own_walk_comes_back(person, followed):
    """Lengths to 2 mm, markers to 3 mm, joints to 1 cm and hinges of the legs to 3 degrees."""
    for name, length in person.lengths.items():
        assert followed.body.lengths[name] == pytest.approx(length, abs=0.002), name
    assert followed.median < 0.002
    assert followed.worst < 0.01
    names = [f"{s}_{p}" for s in ("left", "right") for p in ("thigh", "leg", "foot", "forearm", "hand")]
    away = places(followed.body, followed.q, names) - places(person, walking(person), names)
    assert np.linalg.norm(away, axis=2).max() < 0.01
    knees = [7 + person.joint_index(f"{side}_knee_flexion") for side in ("left", "right")]
    assert np.abs(followed.q[:, knees] - walking(person)[:, knees]).max() < np.deg2rad(3.0)
    assert np.all((followed.q[:, 7:] >= followed.body.lower) & (followed.q[:, 7:] <= followed.body.upper))
    assert not followed.others
    assert {"left_toes", "right_toes"} <= set(followed.neutral)
    assert "left_forearm" not in followed.neutral


def test_residuals_are_distances_of_the_markers(followed):
    data, body, targets = followed.body.pinocchio.createData(), followed.body, followed.targets
    for frame in (0, 20):
        pin.framesForwardKinematics(body.pinocchio, data, followed.q[frame])
        for k, (segment, point) in enumerate(zip(targets.segments, targets.points, strict=True)):
            there = data.oMf[body.segment_frame(segment)].act(point)
            away = np.linalg.norm(there - targets.positions[frame, k])
            assert followed.residual[frame, k] == pytest.approx(away, abs=1e-9)


def test_a_marker_moved_away_is_left_out_and_listed(walk):
    """Ten centimetres on one marker in one frame: without it the posture is that of the clean recording."""
    frame, marker = 20, walk.marker_index("LTHI")

    def move(positions):
        positions[frame, marker, 2] += 0.1

    found = reconstruct(with_positions(walk, move))
    k = found.joints.index("LTHI")
    assert np.isnan(found.residual[frame, k])
    assert np.nanmedian(found.residual[frame]) < 0.02
    assert found.residual[frame + 5, k] < 0.01
    (repair,) = found.repairs
    assert (repair.marker, repair.first, repair.stop) == ("LTHI", frame, frame + 1)
    assert repair.distance == pytest.approx(0.1, abs=0.01)


def test_gaps_short_long_and_at_the_ends(walk, followed):
    """A frame that is not seen has no residual; the posture goes on; ends without markers are cut."""

    def hide(positions):
        positions[10:13, walk.marker_index("LKNE")] = np.nan
        positions[15:27, walk.marker_index("RANK")] = np.nan
        positions[:4] = np.nan
        positions[37:, :30] = np.nan

    found = reconstruct(with_positions(walk, hide))
    assert found.first_frame == 4
    assert len(found.time) == 33
    assert found.time[0] == 0.0
    residual = {name: found.residual[:, k] for k, name in enumerate(found.joints)}
    assert list(np.flatnonzero(np.isnan(residual["LKNE"])) + 4) == [10, 11, 12]
    assert list(np.flatnonzero(np.isnan(residual["RANK"])) + 4) == list(range(15, 27))
    both = slice(4, 37)
    away = places(found.body, found.q, ["right_foot"]) - places(
        followed.body, followed.q[both], ["right_foot"]
    )
    assert np.linalg.norm(away, axis=2).max() < 0.02
    assert np.isfinite(found.median)


def test_legs_alone_leave_the_rest_neutral(walk, person):
    names = [
        n for n in walk.marker_names if n[1:4] in ("ASI", "PSI", "THI", "KNE", "TIB", "ANK", "HEE", "TOE")
    ]
    found = reconstruct(walk.chosen(names))
    assert {"lumbar", "thorax", "neck", "left_upper_arm", "right_hand"} <= set(found.neutral)
    standing = found.body.standing_posture()
    # Trunk, neck and upper arms are upright in the world, see test_recorded_dynamics.
    for joint in ("thorax_flexion", "left_elbow_flexion", "neck_rotation", "left_wrist_flexion"):
        index = 7 + person.joint_index(joint)
        np.testing.assert_allclose(found.q[:, index], standing[index], atol=1e-6)
    assert found.median < 0.005
    assert set(found.body.lengths) == {"hips", "thigh", "shank"}


def test_what_the_file_says_of_the_person_is_used(walk):
    told = replace(walk, subject=Subject(mass=61.0, stature=1.71))
    assert reconstruct(told).body.mass == pytest.approx(61.0)
    assert reconstruct(told).body.stature == pytest.approx(1.71)
    assert reconstruct(told, mass=90.0).body.mass == pytest.approx(90.0)
    with pytest.raises(InputError, match="subject mass"):
        Subject(mass=-1.0)


def test_lengths_from_several_recordings(walk, person):
    """Arms seen in one clip and legs in the other make one person."""
    legs = walk.chosen([n for n in walk.marker_names if n[1:4] not in ("ELB", "WRA", "WRB", "SHO")])
    body = person_of([legs, walk])
    for name, length in person.lengths.items():
        assert body.lengths[name] == pytest.approx(length, abs=0.002), name
    assert "forearm" not in person_of([legs]).lengths
    with pytest.raises(InputError, match="no recording"):
        person_of([])


@pytest.mark.parametrize(
    ("name", "role", "segment"),
    [
        ("LASI", "left_asis", "pelvis"),
        ("Anna:RKNE", "right_knee_lateral", "right_thigh"),
        ("R_Knee_Lat", "right_knee_lateral", "right_thigh"),
        ("r_knee", "right_knee_lateral", "right_thigh"),
        ("LMMAL", "left_ankle_medial", "left_leg"),
        ("L.ASIS", "left_asis", "pelvis"),
        ("RKNE_2", "right_knee_medial", "right_thigh"),
        ("V.Sacral", "sacrum", "pelvis"),
        ("L_wrist_ulna", "left_wrist_ulna", "left_forearm"),
        ("ASIS_L", "left_asis", "pelvis"),
        ("R.Shank.Upper", "", "right_leg"),
        ("R.Acromium", "right_shoulder", "thorax"),
        ("LFHD", "", "head"),
        ("CLAV", "notch", "thorax"),
        ("*7", None, None),
        ("CentreOfMass", None, None),
        ("marker_3", None, None),
    ],
)
def test_names(name, role, segment):
    found = marker_set(MarkerRecording("one", (name,), np.zeros((1, 1, 3)), 100.0))
    assert found.segments.get(name) == segment
    assert found.roles == ({role: name} if role else {})
    assert found.others == (() if segment else (name,))


def test_computed_points_are_no_markers():
    """LTIO, LTIA, LTIL, LTIP are axes; LTIB beside them is a marker, and so is LFOO alone."""
    names = ("LTIB", "LTIO", "LTIA", "LTIL", "LTIP", "LFOO")
    found = marker_set(MarkerRecording("some", names, np.zeros((1, 6, 3)), 100.0))
    assert set(found.segments) == {"LTIB", "LFOO"}


def test_hips_by_regression():
    """Harrington's equations at a distance of 0.24 m and a depth of 0.16 m, by hand."""
    marks = {
        "left_asis": [0.0, 0.12, 0.0], "right_asis": [0.0, -0.12, 0.0], "sacrum": [-0.16, 0.0, 0.0],
    }  # fmt: skip
    marks = {name: np.array([place]) for name, place in marks.items()}
    found = hip_centres(marks, pelvis_axes(marks, "here"), "here")
    np.testing.assert_allclose(found["left_thigh"], [[-0.0483, 0.0865, -0.0829]], atol=1e-9)
    np.testing.assert_allclose(found["right_thigh"], [[-0.0483, -0.0865, -0.0829]], atol=1e-9)


def test_hinges_with_an_outer_marker_only(walk, person):
    """Without medial markers bent knees and elbows are found to 1.5 cm by their width."""
    outer = walk.chosen([n for n in walk.marker_names if n[-1] != "M"])
    marks = landmarks(outer, marker_set(outer))
    centres = marker_centres(marks, pelvis_axes(marks, "here"), outer.subject, "here")
    names = ["left_leg", "right_leg", "left_forearm", "right_forearm", "left_foot"]
    true = places(person, walking(person), names)
    for k, name in enumerate(names):
        assert np.linalg.norm(centres[name] - true[:, k], axis=1).max() < 0.015, name


def test_bad_recordings_are_refused_in_one_line(walk):
    def swap(*stems):
        names = list(walk.marker_names)
        return replace(
            walk,
            marker_names=tuple({"L": "R", "R": "L"}[n[0]] + n[1:] if n[1:] in stems else n for n in names),
        )

    everything = {n[1:] for n in walk.marker_names if n not in ("C7", "CLAV", "STRN")}
    cases = (
        (walk.cut(0, 1), "has 1 frame"),
        (replace(walk, positions=np.full_like(walk.positions, np.nan)), "sees no marker"),
        (replace(walk, positions=10.0 * walk.positions), r"ASIS 2\.5 m apart.*unit"),
        (replace(walk, positions=0.001 * walk.positions), "ASIS 0.00025 m apart"),
        (swap("KNE", "KNEM"), "left and right knee swapped"),
        (swap(*everything), "left and right of the pelvis swapped"),
        (walk.chosen(["C7", "LKNE"]), "no marker that is known as the left ASIS"),
        (walk.chosen(["LASI", "RASI", "LKNE"]), "no marker on the back of the pelvis"),
    )
    for recording, message in cases:
        with pytest.raises(InputError, match=message) as caught:
            reconstruct(recording)
        assert "\n" not in str(caught.value)


def test_exchanged_names_of_all_sides_are_exchanged_back(walk, followed):
    """The names do not say where markers are, so postures are those of the recording with the right names."""
    other = {"L": "R", "R": "L"}
    names = tuple(
        name if name in ("C7", "CLAV", "STRN") else other[name[0]] + name[1:] for name in walk.marker_names
    )
    found = sides_exchanged(replace(walk, marker_names=names))
    assert joints_apart(reconstruct(found), followed) < 1e-9
    assert "exchanged" in found.remarks[-1]
    assert sides_exchanged(walk) is walk


def test_a_mirrored_axis_gives_the_mirrored_person(walk, followed):
    """Of a walk along x with y mirrored: the left knee does what the right one did.

    Markers are placed by an iteration; 0.1 degree is far below what a marker's error makes.
    """
    found = reconstruct(sides_exchanged(replace(walk, positions=walk.positions * [1.0, -1.0, 1.0])))
    np.testing.assert_allclose(found.q[:, :3], followed.q[:, :3] * [1.0, -1.0, 1.0], atol=1e-3)
    left, right = (7 + found.body.joint_index(f"{side}_knee_flexion") for side in ("left", "right"))
    np.testing.assert_allclose(found.q[:, left], followed.q[:, right], atol=np.deg2rad(0.1))


def test_a_marker_farther_away_than_any_laboratory_is_refused_by_its_name(walk):
    """One wrong cell in one frame."""
    positions = np.array(walk.positions)
    positions[7, 3, 1] = 9e11
    with pytest.raises(InputError, match=rf"marker '{walk.marker_names[3]}' at 9e\+11 m in frame 7"):
        replace(walk, positions=positions)

    def apart(positions):
        positions[::2, walk.marker_index("LASI")] = np.nan
        positions[1::2, walk.marker_index("RASI")] = np.nan

    with pytest.raises(InputError, match="never sees the markers of the pelvis at once"):
        reconstruct(with_positions(replace(walk, rate=1.0), apart))

    def stretch(positions):
        positions[:, walk.marker_index("LKNE")] -= [0.0, 0.0, 2.0]

    with pytest.raises(BodyError, match=r"stature \[m\]"):
        reconstruct(with_positions(walk, stretch))


@pytest.mark.parametrize("seed", range(8))
def test_however_little_is_seen_the_answer_is_a_motion_or_one_line(walk, seed):
    """Random markers, a third to nearly all of their places hidden."""
    rng = np.random.default_rng(seed)
    part = walk.cut(0, 12)
    hidden = rng.random(part.positions.shape[:2]) < rng.uniform(0.3, 0.85)
    part = with_positions(part, lambda positions: positions.__setitem__(hidden, np.nan))
    names = [n for n in part.marker_names if "SI" in n or rng.random() < 0.7]
    refusal, found = "", None
    try:
        found = reconstruct(part.chosen(names))
    except InputError as error:
        refusal = str(error)
    assert "\n" not in refusal
    assert (found is None) == bool(refusal)
    if found is None:
        return
    assert np.all(np.isfinite(found.q))
    assert found.median < 0.02
    assert np.all(np.isnan(found.residual) == np.isnan(found.targets.positions[..., 0]))


# --- smoothing and motions ---------------------------------------------------------------------


def test_smoothing_takes_noise_and_leaves_the_walk(person, walk, followed):
    rng = np.random.default_rng(0)
    noisy = replace(walk, positions=walk.positions + rng.normal(scale=0.004, size=walk.positions.shape))
    found = reconstruct(noisy, followed.body)
    calm = smoothed(found, 6.0)
    inner = slice(8, -8)
    legs = [7 + person.joint_index(f"left_{joint}") for joint in ("hip_flexion", "knee_flexion")]
    before, after = (np.std((one.q - followed.q)[inner, legs]) for one in (found, calm))
    assert after < 0.7 * before
    np.testing.assert_allclose(np.linalg.norm(calm.q[:, 3:7], axis=1), 1.0, atol=1e-12)
    assert calm.median < 0.015  # the noise itself has a mean length of 6.4 mm


def test_a_motion_has_the_velocities_of_its_postures(person, followed):
    """Knee rates and the pelvis' speed as those of the synthetic walk; one step of v leads to the next q."""
    motion = motion_of(followed, None)
    knee = person.joint_index("left_knee_flexion")
    time = motion.time
    rate = 0.4 * 2.0 * np.pi * np.sin(2.0 * np.pi * time + 1.0)
    inner = slice(3, -3)
    assert np.abs(motion.v[inner, 6 + knee] - rate[inner]).max() < 0.15
    np.testing.assert_allclose(motion.v[inner, 0], 1.2, atol=0.05)
    model = followed.body.pinocchio
    for (q, v), (then, v_then) in pairwise(zip(motion.q[inner], motion.v[inner], strict=True)):
        there = pin.integrate(model, q, 0.5 * (v + v_then) * (time[1] - time[0]))
        assert np.abs(pin.difference(model, there, then)).max() < 0.02
    assert np.all(np.isnan(motion.margin))
    assert motion.support.shape == (len(time), 0)
    np.testing.assert_allclose(np.gradient(motion.com[:, 0], time)[inner].mean(), 1.2, atol=0.05)
    with pytest.raises(InputError, match="below half the rate"):
        motion_of(followed, 25.0)


# --- real recordings ---------------------------------------------------------------------------

FULL_BODY = (
    ("btkdata/PiG_Motion-FlatFoot-One.c3d", {"LFEO": "left_leg", "RFEO": "right_leg", "LTIO": "left_foot"}),
    ("btkdata/Gait.c3d", {}),
    ("nimble_opencap_s4/STS1.trc", {"L_HJC": "left_thigh"}),
    ("nimble_opencap_s4/walking1.trc", {"R_HJC": "right_thigh"}),
)


@pytest.mark.parametrize(("file", "joints"), FULL_BODY)
def test_recorded_people(recordings_folder, file, joints):
    """Markers within 2 cm as a median (1 cm here); joints that other programs computed within 3 cm."""
    whole = read_recording(recordings_folder / "grf" / file)
    step = len(whole) // 20
    recording = replace(whole, positions=whole.positions[::step], rate=whole.rate / step)
    found = reconstruct(recording)
    assert found.median < 0.01
    assert np.nanmedian(np.sqrt(np.nanmean(found.residual**2, axis=1))) < 0.02
    for name, segment in joints.items():
        ours = places(found.body, found.q, [segment])[:, 0]
        theirs = recording.marker(name)[found.first_frame :][: len(ours)]
        assert np.nanmedian(np.linalg.norm(ours - theirs, axis=1)) < 0.03, name


def test_a_c3d_file_tells_of_its_person(recordings_folder):
    """PROCESSING of Plug-in Gait, in millimetres: both knees 110 and 120, the shoulder's offset 50."""
    folder = recordings_folder / "grf" / "btkdata"
    found = read_recording(folder / "PiG_Motion-FlatFoot-One.c3d").subject
    assert found.marker_radius is None
    assert astuple(found)[:6] == pytest.approx((66.5, 1.79, 0.115, 0.07, 0.08, 0.05))
    assert read_recording(folder / "Gait.c3d").subject == Subject()


# --- markers that are not where their names say ------------------------------------------------

JOINTS_FOLLOWED = [f"{s}_{p}" for s in ("left", "right") for p in ("thigh", "leg", "foot", "forearm", "hand")]


def joints_apart(one, other):
    """Largest distance of joints of two reconstructions [m]."""
    both = [places(found.body, found.q, JOINTS_FOLLOWED) for found in (one, other)]
    return np.linalg.norm(both[0] - both[1], axis=2).max()


def test_a_clean_recording_needs_no_repair(followed):
    assert followed.repairs == ()


@pytest.mark.parametrize(
    ("marker", "off", "frames"),
    [
        ("RANK", (0.0, 3.0, 4.0), (20, 21)),
        ("LASI", (0.3, 0.0, 0.4), (11, 13)),
        ("C7", (0.05, 0.0, 0.0), (7, 8)),
    ],
)
def test_spikes_are_taken_out_and_filled(walk, followed, marker, off, frames):
    """The filling is a cubic spline: joints come back to 3 mm, and nothing else is repaired."""
    place = walk.marker_names.index(marker)

    def spike(positions):
        positions[slice(*frames), place] += off

    found = reconstruct(with_positions(walk, spike))
    (repair,) = found.repairs
    assert (repair.marker, repair.kind, repair.outcome) == (marker, "spike", "filled")
    assert (repair.first, repair.stop) == frames
    assert repair.distance == pytest.approx(np.linalg.norm(off), abs=0.01)
    assert joints_apart(found, followed) < 0.003


@pytest.mark.parametrize(
    ("pair", "frames"),
    [(("LKNE", "LANK"), (12, 30)), (("LASI", "RASI"), (25, 40)), (("RHEE", "LTOE"), (5, 9))],
)
def test_swapped_markers_are_exchanged(walk, followed, pair, frames):
    """Once exchanged the recording is the clean one, so that postures are the same."""
    one, other = (walk.marker_names.index(name) for name in pair)

    def swap(positions):
        positions[slice(*frames), [one, other]] = positions[slice(*frames), [other, one]]

    found = reconstruct(with_positions(walk, swap))
    (repair,) = found.repairs
    assert {repair.marker, repair.other} == set(pair)
    assert (repair.kind, repair.outcome, repair.first, repair.stop) == ("swap", "exchanged", *frames)
    assert joints_apart(found, followed) < 1e-9


@pytest.mark.parametrize("kind", ["frozen", "displaced"])
def test_a_marker_that_is_off_for_longer_does_not_count(walk, followed, kind):
    """The other markers of both legs hold the posture to a centimetre."""
    place, frames = walk.marker_names.index("LKNE"), slice(15, 27)

    def off(positions):
        positions[frames, place] = (
            positions[14, place] if kind == "frozen" else positions[frames, place] + 0.12
        )

    found = reconstruct(with_positions(walk, off))
    (repair,) = found.repairs
    assert (repair.marker, repair.kind, repair.outcome) == ("LKNE", kind, "left out")
    assert (repair.first, repair.stop) == (15, 27)
    assert joints_apart(found, followed) < 0.01


def test_gaps_are_listed_with_what_became_of_them(walk):
    place = walk.marker_names.index("RTIB")

    def unseen(positions):
        positions[10:13, place] = np.nan
        positions[20:30, place] = np.nan

    gaps = reconstruct(with_positions(walk, unseen)).repairs
    assert [(one.kind, one.first, one.stop, one.outcome) for one in gaps] == [
        ("gap", 10, 13, "filled"), ("gap", 20, 30, "left out"),
    ]  # fmt: skip


def test_most_markers_that_jump_away_for_long_are_refused_with_their_frames(walk):
    def away(positions):
        positions[10:20] += 20.0

    with pytest.raises(InputError, match="markers jump away in frames 10 to 19; valid: frames without"):
        reconstruct(with_positions(walk, away))
