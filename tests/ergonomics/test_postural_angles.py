"""Angles of postures that are set by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human, insect, kudoh, random_configuration
from manikin.ergonomics import postural_angles, upright_neck
from manikin.errors import BodyError
from manikin.numerics.spatial import rotation_from_rpy

from .conftest import mirrored, posture

HUMAN = human()


def turned_by(q, rotation):
    """(nq,) with the root turned."""
    import pinocchio as pin

    found = np.array(q)
    found[3:7] = pin.Quaternion(rotation).coeffs()
    return found


def measured(body, q):
    """Every angle that is not 0 [deg]."""
    columns = postural_angles(body, q[None]).columns_deg()
    return {name.removesuffix("_deg"): float(v[0]) for name, v in columns.items() if abs(v[0]) > 1e-6}


@pytest.mark.parametrize("body", [human(), kudoh()], ids=lambda body: body.name)
@pytest.mark.parametrize(
    ("joint", "angle", "found"),
    [
        ("neck_flexion", 20.0, "neck_flexion"),
        ("neck_flexion", -30.0, "neck_flexion"),
        ("neck_rotation", 40.0, "neck_twist"),
        ("left_elbow_flexion", 80.0, "left_arm_elbow"),
        ("right_wrist_flexion", 25.0, "right_arm_wrist_flexion"),
        ("left_wrist_flexion", -40.0, "left_arm_wrist_flexion"),
        ("right_wrist_radial_deviation", 15.0, "right_arm_wrist_deviation"),
        ("left_knee_flexion", 70.0, "left_knee_flexion"),
    ],
)
def test_one_hinge_is_one_angle(body, joint, angle, found):
    others = {"left_arm_elbow": "left_arm_outward", "neck_flexion": "head_inclination"}.get(found, "")
    result = measured(body, posture(body, **{joint: angle}))
    assert result.pop(found) == pytest.approx(angle, abs=1e-6)
    assert set(result) <= {others}
    assert result.get("head_inclination", angle) == pytest.approx(angle, abs=1e-6)


def test_pronation_of_either_body_is_a_twist_of_the_forearm():
    """Our human turns its forearm, Kudoh's body its wrist; a bent wrist on top changes nothing."""
    for body, hinge in ((HUMAN, "forearm_pronation"), (kudoh(), "wrist_rotation")):
        for side in ("left", "right"):
            angles = {f"{side}_{hinge}": 50.0, f"{side}_wrist_flexion": 30.0, f"{side}_elbow_flexion": 60.0}
            arm = postural_angles(body, posture(body, **angles)[None]).arms[side]
            assert np.rad2deg(arm.wrist_twist[0]) == pytest.approx(50.0, abs=1e-6)
            assert np.rad2deg(arm.wrist_flexion[0]) == pytest.approx(30.0, abs=1e-6)


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
@pytest.mark.parametrize("lean", [-20.0, 35.0, 90.0, 110.0])
def test_a_stiff_body_leans_as_it_is_turned(heading, lean):
    """Wherever it faces, the trunk leans by the pitch of the body and the arms keep to the trunk."""
    rotation = rotation_from_rpy(0.0, np.deg2rad(lean), heading)
    result = measured(HUMAN, turned_by(HUMAN.zero_posture(), rotation))
    assert result.pop("trunk_flexion") == pytest.approx(lean, abs=1e-6)
    assert result.pop("head_inclination") == pytest.approx(lean, abs=1e-6)
    assert set(result) == {
        f"{side}_arm_{name}" for side in ("left", "right") for name in ("from_vertical", "ahead")
    }
    assert result["left_arm_from_vertical"] == pytest.approx(abs(lean), abs=1e-6)
    assert np.sin(np.deg2rad(result["left_arm_ahead"])) == pytest.approx(-np.sin(np.deg2rad(lean)), abs=1e-9)


def test_a_head_is_measured_in_the_world_whatever_the_spine_does():
    """Spine and neck add up where all bend in one plane; the line from the hips to the neck leans less."""
    angles = postural_angles(
        HUMAN, posture(HUMAN, lumbar_flexion=30.0, thorax_flexion=30.0, neck_flexion=-20.0)[None]
    )
    assert np.rad2deg(angles.head_inclination[0]) == pytest.approx(40.0, abs=1e-6)
    assert np.rad2deg(angles.trunk_flexion[0]) < 50.0
    upright = postural_angles(HUMAN, HUMAN.standing_posture()[None], np.deg2rad(15.0))
    assert np.rad2deg(upright.head_inclination[0]) == pytest.approx(-15.0, abs=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
def test_an_arm_ahead_of_or_beside_its_shoulder(side):
    """Outward is positive on both sides; a bent trunk leaves a hanging arm where it hangs."""
    sign = 1.0 if side == "left" else -1.0
    for wanted, ahead, beside in (((1.0, 0.0, 0.0), 90.0, 0.0), ((0.0, sign, 0.0), 0.0, 90.0),
                                  ((-0.5, 0.0, -np.sqrt(0.75)), -30.0, 0.0)):  # fmt: skip
        arm = postural_angles(HUMAN, arm_along(side, np.array(wanted))[None]).arms[side]
        assert np.rad2deg(arm.ahead[0]) == pytest.approx(ahead, abs=0.05)
        assert np.rad2deg(arm.beside[0]) == pytest.approx(beside, abs=0.05)
    q = arm_along(side, np.array([0.5, 0.0, -np.sqrt(0.75)]))
    q[7 + HUMAN.joint_index("thorax_flexion")] = np.deg2rad(30.0)
    bent = postural_angles(HUMAN, q[None])
    assert np.rad2deg(bent.arms[side].ahead[0]) == pytest.approx(0.0, abs=0.05)


def test_a_stiff_body_that_falls_to_the_left_bends_to_the_left():
    rotation = rotation_from_rpy(np.deg2rad(-25.0), 0.0, 0.7)
    assert measured(HUMAN, turned_by(HUMAN.zero_posture(), rotation))["trunk_side_bend"] == pytest.approx(
        25.0
    )


def test_a_twisted_spine_adds_up():
    result = measured(HUMAN, posture(HUMAN, lumbar_rotation=8.0, thorax_rotation=20.0))
    assert result == pytest.approx({"trunk_twist": 28.0})


@pytest.mark.parametrize("side", ["left", "right"])
def test_arms_are_measured_against_the_chest(side):
    """Lifted by the hinges until the elbow is straight ahead, to the side, or behind: known directions."""
    sign = 1.0 if side == "left" else -1.0
    for wanted, flexion, abduction in (
        ((1.0, 0.0, 0.0), 90.0, 0.0),
        ((0.0, sign, 0.0), None, 90.0),
        ((-0.5, 0.0, -np.sqrt(0.75)), -30.0, 0.0),
    ):
        q = arm_along(side, np.array(wanted))
        arm = postural_angles(HUMAN, q[None]).arms[side]
        if flexion is not None:
            assert np.rad2deg(arm.flexion[0]) == pytest.approx(flexion, abs=0.01)
            assert arm.raised[0] == pytest.approx(arm.flexion[0])
        else:
            assert np.rad2deg(arm.raised[0]) == pytest.approx(90.0, abs=0.01)
        assert np.rad2deg(arm.abduction[0]) == pytest.approx(abduction, abs=0.01)


def arm_along(side, direction):
    """(nq,) the upper arm along a direction, by search over the shoulder's two first hinges."""
    from scipy.optimize import least_squares

    from manikin.kinematics.point_targets import SegmentPlacements

    upper_arm = SegmentPlacements(HUMAN, [f"{side}_upper_arm"])
    names = [f"{side}_shoulder_flexion", f"{side}_shoulder_abduction"]

    def gap(x):
        q = HUMAN.posture(dict(zip(names, x, strict=True)))
        return -upper_arm.of(q[None]).turns[0, :, 2, 0] - direction

    found = least_squares(gap, [0.5, 0.5])
    assert found.cost < 1e-12
    return HUMAN.posture(dict(zip(names, found.x, strict=True)))


def test_a_hand_before_the_other_shoulder_is_across_the_midline():
    inwards = {"right_shoulder_rotation": 70.0, "right_elbow_flexion": 90.0}
    across, plain = (
        postural_angles(HUMAN, posture(HUMAN, **angles)[None]).arms["right"]
        for angles in (inwards, {"right_elbow_flexion": 90.0})
    )
    assert across.aside[0] < 0.0 < plain.aside[0]
    assert np.rad2deg(across.outward[0]) == pytest.approx(-70.0, abs=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_the_mirror_image_has_the_angles_of_the_other_side(seed):
    rng = np.random.default_rng(seed)
    q = random_configuration(HUMAN, rng)[None]
    one, other = postural_angles(HUMAN, q), postural_angles(HUMAN, mirrored(HUMAN, q))
    for name in ("trunk_flexion", "neck_flexion"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-9)
    for name in ("trunk_side_bend", "trunk_twist", "neck_side_bend", "neck_twist"):
        np.testing.assert_allclose(getattr(one, name), -getattr(other, name), atol=1e-9)
    np.testing.assert_allclose(one.arm("left"), other.arm("right"), atol=1e-9)
    np.testing.assert_allclose(one.knees["right"], other.knees["left"], atol=1e-9)


def test_rotations_are_those_of_pinocchio():
    """Trunk line and forearm from the kinematics of the engine, at random postures (rounding only)."""
    import pinocchio as pin

    rng = np.random.default_rng(3)
    q = np.array([random_configuration(HUMAN, rng) for _ in range(20)])
    found = postural_angles(HUMAN, q)
    data = HUMAN.pinocchio.createData()
    for row, one in enumerate(q):
        pin.framesForwardKinematics(HUMAN.pinocchio, data, one)
        place = {name: data.oMf[HUMAN.segment_frame(name)] for name in ("pelvis", "thorax", "neck")}
        line = place["neck"].translation - place["pelvis"].translation
        tilt = np.arccos(line[2] / np.linalg.norm(line))
        both = np.cos(found.trunk_flexion[row]) * np.cos(found.trunk_side_bend[row])
        assert np.arccos(both) == pytest.approx(tilt, abs=1e-7)
        hand = data.oMf[HUMAN.segment_frame("left_hand")].translation
        aside = (place["thorax"].rotation.T @ (hand - place["thorax"].translation))[1]
        assert found.arms["left"].aside[row] == pytest.approx(aside, abs=1e-12)


def test_an_upright_neck_is_found_in_upright_frames_only():
    frames = [posture(HUMAN, neck_flexion=21.0)] * 3 + [
        posture(HUMAN, lumbar_flexion=50.0, neck_flexion=-30.0)
    ]
    zero = upright_neck(HUMAN, np.array(frames))
    assert np.rad2deg(zero) == pytest.approx(21.0)
    assert postural_angles(HUMAN, np.array(frames), zero).neck_flexion[0] == pytest.approx(0.0)
    assert upright_neck(HUMAN, np.array(frames[3:])) is None


def test_what_is_no_human_is_refused():
    with pytest.raises(BodyError, match="no limb 'left_arm'"):
        postural_angles(insect(), insect().zero_posture()[None])
    with pytest.raises(BodyError, match=r"valid: \(n, 46\)"):
        postural_angles(HUMAN, np.zeros((3, 7)))
