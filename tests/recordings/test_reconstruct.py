"""Recorded skeletons as motions of our human."""

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from manikin.body import human, insect
from manikin.errors import BodyError, InputError
from manikin.kinematics import PointTargets
from manikin.recordings import Recording, read_bvh, read_recording, reconstruct
from manikin.recordings.reconstruction.proportions import (
    CENTRES,
    analytic_ik,
    hanging_arms,
    joint_centres,
    segment_lengths,
    trunk_axes,
)

CLIPS = (
    "accad_male1_bvh/Male1_B3_Walk.bvh",
    "accad_male1_bvh/Male1_A7_Crouch.bvh",
    "accad_male1_bvh/Male1_A11_CrawlForward.bvh",
    "cmu_asf_amc/02_01.amc",
    "cmu_asf_amc/02_03.amc",
)


def recorded(body, q):
    """Postures (n, nq) of our body as a recording of its own skeleton."""
    names = tuple(segment.name for segment in body.segments)
    parents = np.array([-1 if s.parent is None else names.index(s.parent) for s in body.segments])
    data, world = body.pinocchio.createData(), np.empty((len(q), len(names), 3, 3))
    for frame, posture in enumerate(q):
        pin.framesForwardKinematics(body.pinocchio, data, posture)
        world[frame] = [data.oMf[body.segment_frame(name)].rotation for name in names]
    turns = world.copy()
    for joint, parent in enumerate(parents[1:], start=1):
        turns[:, joint] = world[:, parent].transpose(0, 2, 1) @ world[:, joint]
    ends = {
        "head": body.effector("head").translation,
        **{f"{side}_hand": np.array([0.0, 0.0, -0.15]) for side in ("left", "right")},
    }
    offsets = np.array([s.origin for s in body.segments])
    return Recording("ours", names, parents, offsets, ends, turns, q[:, :3], 30.0)


def places(body, q):
    """(n, 12, 3) joint centres of postures."""
    data, found = body.pinocchio.createData(), []
    for posture in q:
        pin.framesForwardKinematics(body.pinocchio, data, posture)
        found.append(np.array([data.oMf[body.segment_frame(name)].translation for name in CENTRES]))
    return np.array(found)


def within_limits(body, q):
    return bool(np.all((q[:, 7:] >= body.lower) & (q[:, 7:] <= body.upper)))


def wandering(body, seed, between=12):
    """From standing through two random postures within the limits, tumbling on the way."""
    rng = np.random.default_rng(seed)
    keys = np.vstack([body.standing_posture()[7:], rng.uniform(body.lower, body.upper, (2, body.nv - 6))])
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, between, endpoint=False))[:, None]
    angles = np.vstack([first + share * (last - first) for first, last in pairwise(keys)])
    n = len(angles)
    q = np.tile(body.zero_posture(), (n, 1))
    q[:, :3] = np.linspace(0.0, 1.0, n)[:, None] * rng.standard_normal(3)
    q[:, 3:7] = Rotation.from_rotvec(np.linspace(0.0, 1.0, n)[:, None] * rng.standard_normal(3)).as_quat()
    q[:, 7:] = angles
    return q


@pytest.fixture(scope="module")
def person():
    """Somebody whose proportions are not the tables'."""
    lengths = {"thigh": 0.40, "shank": 0.45, "trunk": 0.50, "upper_arm": 0.31, "forearm": 0.25}
    return human(1.75, 70.0, lengths=lengths | {"hips": 0.19, "shoulders": 0.40})


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_our_own_motion_comes_back(person, seed):
    """Every joint within a millimetre, by residuals that forward kinematics confirms; limits kept."""
    q = wandering(person, seed)
    found = reconstruct(recorded(person, q), person)
    assert found.worst < 1e-3
    away = np.linalg.norm(places(person, found.q) - places(person, q), axis=2)
    np.testing.assert_allclose(found.residual, away, atol=1e-12)
    assert within_limits(person, found.q)
    np.testing.assert_allclose(np.linalg.norm(found.q[:, 3:7], axis=1), 1.0, atol=1e-9)


def test_lengths_of_a_person_are_measured(person):
    q = np.tile(person.standing_posture(), (3, 1))
    recording = recorded(person, q)
    found = segment_lengths(joint_centres(recording))
    assert found == pytest.approx(dict(person.lengths), abs=1e-9)
    # The stature is told by legs and trunk: 1.35 m of 1.387 m at 1.75 m.
    body = reconstruct(recording).body
    usual = human()
    height = sum(
        abs(usual.segment(name).origin[2])
        for name in ("left_leg", "left_foot", "lumbar", "thorax", "left_upper_arm")
    )
    assert body.stature == pytest.approx(1.75 * 1.35 / height, abs=1e-9)
    assert dict(body.lengths) == pytest.approx(dict(person.lengths), abs=1e-9)


def test_raised_arms_do_not_lengthen_the_trunk(person):
    """Instants with a raised arm are left out, unless there are no others."""
    standing = person.standing_posture()
    raised = standing.copy()
    raised[7 + person.joint_index("left_shoulder_flexion")] = np.deg2rad(150.0)
    centres = joint_centres(recorded(person, np.array([standing, raised, standing])))
    assert list(hanging_arms(centres)) == [0, 2]
    assert list(hanging_arms(joint_centres(recorded(person, np.array([raised, raised]))))) == [0, 1]
    # A girdle that lifts both shoulders by 6 cm with the raised arm.
    lifted = {name: np.array(places) for name, places in centres.items()}
    for side in ("left", "right"):
        lifted[f"{side}_upper_arm"][1, 2] += 0.06
    assert segment_lengths(lifted)["trunk"] == pytest.approx(person.lengths["trunk"], abs=1e-9)


def test_the_closed_form_is_exact_on_a_straight_trunk(person):
    """Hips, shoulders, knees and elbows of one posture in any orientation, without search."""
    sides = {"hip_flexion": 0.8, "hip_abduction": 0.3, "hip_rotation": -0.2, "knee_flexion": 1.0}
    arms = {
        "shoulder_flexion": 0.9,
        "shoulder_abduction": 0.4,
        "shoulder_rotation": 0.3,
        "elbow_flexion": 1.1,
    }
    q = person.posture({f"{side}_{k}": v for side in ("left", "right") for k, v in (sides | arms).items()})
    q[:3], q[3:7] = [1.0, -2.0, 0.7], Rotation.from_rotvec([0.7, -1.1, 2.0]).as_quat()
    centres = joint_centres(recorded(person, q[None]))
    pelvis, thorax = trunk_axes(centres, "thigh"), trunk_axes(centres, "upper_arm")
    found = analytic_ik(person, centres, pelvis, thorax)
    np.testing.assert_allclose(found[:, 7:], q[None, 7:], atol=1e-9)
    np.testing.assert_allclose(places(person, found), places(person, q[None]), atol=1e-9)


def test_limits_hold_where_the_recording_breaks_them(person):
    """A knee bent forward by 40 degrees cannot be followed: straight legs, and the residual says so."""
    q = np.tile(person.posture({"left_knee_flexion": np.deg2rad(-40.0), "left_elbow_flexion": 0.5}), (4, 1))
    found = reconstruct(recorded(person, q), person)
    assert within_limits(person, found.q)
    # Hip, knee and ankle on a bend of 40 deg are 7 cm off a line; three points share that.
    leg = [found.joints.index(name) for name in ("left_thigh", "left_leg", "left_foot")]
    assert 0.02 < found.residual[:, leg].max() < 0.15


def test_a_standing_foot_is_level_whatever_its_bone(person):
    """Toe joints recorded 3 cm higher in the foot: the ankles still stand as they did."""
    q = np.tile(person.standing_posture(), (3, 1))
    ours = recorded(person, q)
    offsets = np.array(ours.offsets)
    offsets[[ours.joint_names.index(f"{side}_toes") for side in ("left", "right")], 2] += 0.03
    other = Recording(
        "other feet", ours.joint_names, ours.parents, offsets, ours.ends, ours.rotations,
        ours.root_positions, ours.rate,
    )  # fmt: skip
    found = reconstruct(other, person)
    for side in ("left", "right"):
        slot = 7 + person.joint_index(f"{side}_ankle_dorsiflexion")
        np.testing.assert_allclose(found.q[:, slot], q[:, slot], atol=np.deg2rad(0.5))


@pytest.mark.parametrize("clip", CLIPS)
def test_real_clips(recordings_folder, clip):
    """Median of all joints and frames within 2 cm, limits kept, one third of the frames per second."""
    file = recordings_folder / clip
    if not file.is_file():
        pytest.skip(f"{clip} is not there")
    whole = read_recording(file)
    step = 10
    recording = Recording(
        whole.name, whole.joint_names, whole.parents, whole.offsets, whole.ends, whole.rotations[::step],
        whole.root_positions[::step], whole.rate / step,
    )  # fmt: skip
    found = reconstruct(recording)
    assert found.median <= 0.02
    assert within_limits(found.body, found.q)
    np.testing.assert_allclose(found.time, recording.time)
    wanted = np.stack([joint_centres(recording)[name] for name in found.joints], axis=1)
    away = np.linalg.norm(places(found.body, found.q) - wanted, axis=2)
    np.testing.assert_allclose(found.residual, away, atol=1e-12)


def test_what_cannot_be_reconstructed_is_said(person, bvh_file):
    recording = recorded(person, np.tile(person.standing_posture(), (3, 1)))
    with pytest.raises(InputError, match="has 1 frame; valid: at least 2"):
        reconstruct(recording.cut(0, 1))
    with pytest.raises(InputError, match="no joint for 'left_thigh'"):
        reconstruct(read_bvh(bvh_file, 0.01))
    with pytest.raises(InputError, match="reconstruction of a list"):
        reconstruct([1])  # type: ignore[arg-type]
    with pytest.raises(BodyError, match="no segment"):
        reconstruct(recording, insect())
    gap = np.array(recording.root_positions)
    gap[1, 2] = np.nan
    with pytest.raises(InputError, match="root_positions"):
        Recording(
            "gap", recording.joint_names, recording.parents, recording.offsets, {}, recording.rotations, gap,
            30.0,
        )  # fmt: skip
    small = Recording(
        "doll", recording.joint_names, recording.parents, 0.2 * recording.offsets, {},
        recording.rotations, recording.root_positions, 30.0,
    )  # fmt: skip
    with pytest.raises(BodyError, match=r"stature \[m\] is 0\.349"):
        reconstruct(small)


def test_targets_are_checked():
    points, seen, one = np.zeros((1, 3)), np.zeros((2, 1, 3)), np.ones(1)
    gap = seen.copy()
    gap[1, 0, 2] = np.nan
    assert np.all(np.isnan(PointTargets(("a",), ("pelvis",), points, gap, one).positions[1]))
    gap[0, 0, 0] = np.nan
    with pytest.raises(InputError, match="'a' is never seen"):
        PointTargets(("a",), ("pelvis",), points, gap, one)
    with pytest.raises(InputError, match="a segment for each"):
        PointTargets(("a",), (), points, seen, one)
    with pytest.raises(InputError, match="weighs nothing"):
        PointTargets(("a",), ("pelvis",), points, seen, 0.0 * one)
