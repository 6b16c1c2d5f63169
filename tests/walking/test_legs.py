"""Legs in closed form, feet on the floor."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human, insect, random_configuration
from manikin.errors import BodyError
from manikin.kinematics.leg_kinematics import HINGES, LegKinematics
from manikin.walking.gait.stance_foot import FootPlacement, Sole

BODY = human()
LEGS, SOLE = LegKinematics(BODY), Sole.of_body(BODY)


def placed(q):
    """Pelvis (n, 3, 3), feet (2, n, 3, 3) and ankles (2, n, 3) by Pinocchio."""
    data, pelvis, feet, ankles = BODY.pinocchio.createData(), [], [], []
    for posture in q:
        pin.framesForwardKinematics(BODY.pinocchio, data, posture)
        both = [data.oMf[BODY.segment_frame(f"{side}_foot")] for side in ("left", "right")]
        pelvis.append(data.oMf[BODY.segment_frame("pelvis")].rotation.copy())
        feet.append([one.rotation.copy() for one in both])
        ankles.append([one.translation.copy() for one in both])
    return np.array(pelvis), np.array(feet).swapaxes(0, 1), np.array(ankles).swapaxes(0, 1)


def walking_postures(n=200, seed=3):
    """Random within the ranges of walking."""
    rng = np.random.default_rng(seed)
    q = np.array([random_configuration(BODY, rng) for _ in range(n)])
    ranges = [(-20, 60), (-15, 20), (-20, 20), (6, 110), (-10, 10), (-30, 25), (-15, 15)]
    for side in range(2):
        for slot, (low, high) in zip(LEGS.slots[side], ranges, strict=True):
            q[:, 7 + slot] = np.deg2rad(rng.uniform(low, high, n))
    return q


def test_forward_kinematics():
    q = np.array([random_configuration(BODY, np.random.default_rng(s)) for s in range(50)])
    pelvis, feet, ankles = placed(q)
    turn, place = LEGS.feet(pelvis, q[:, :3], q[:, 7:])
    np.testing.assert_allclose(turn, feet, atol=1e-12)
    np.testing.assert_allclose(place, ankles, atol=1e-12)


def test_feet_are_put_where_they_shall_be():
    """The closed form finds the very angles, the knee's rotation being given."""
    q = walking_postures()
    pelvis, feet, ankles = placed(q)
    start = q[:, 7:].copy()
    for side in range(2):
        others = [
            slot for slot, name in zip(LEGS.slots[side], HINGES, strict=True) if name != "knee_rotation"
        ]
        start[:, others] = 0.3
    found = LEGS.angles(pelvis, q[:, :3], feet, ankles, start)
    np.testing.assert_allclose(found[:, LEGS.slots], q[:, 7:][:, LEGS.slots], atol=1e-7)


def test_a_foot_out_of_reach_is_pointed_at():
    q = BODY.standing_posture()[None]
    pelvis, feet, ankles = placed(q)
    ankles[0, 0, 0] += 1.0
    found = LEGS.angles(pelvis, q[:, :3], feet, ankles, q[:, 7:])
    _, place = LEGS.feet(pelvis, q[:, :3], found)
    hip = LEGS.hips(pelvis, q[:, :3])
    reach = place - hip
    assert np.linalg.norm(reach[0, 0]) == pytest.approx(LEGS.length)
    wanted = ankles - hip
    np.testing.assert_allclose(np.cross(reach[0, 0], wanted[0, 0]), 0.0, atol=1e-9)
    np.testing.assert_allclose(place[1], ankles[1], atol=1e-9)


def test_placement_and_back():
    _, feet, ankles = placed(walking_postures(seed=9))
    placement = FootPlacement.of_foot(SOLE, feet, ankles)
    turn, place = placement.to_foot(SOLE)
    np.testing.assert_allclose(turn, feet, atol=1e-9)
    np.testing.assert_allclose(place, ankles, atol=1e-9)


def test_a_rolling_foot_stays():
    """Toes up about the heel, heel up about the ball: one point on the floor, nothing below it."""
    pitch = np.deg2rad(np.linspace(-30.0, 50.0, 33))
    n = len(pitch)
    rolling = FootPlacement(np.tile([0.4, -0.2], (n, 1)), np.full(n, 0.7), pitch, np.zeros(n), np.zeros(n))
    foot, ankle = rolling.to_foot(SOLE)
    below = ankle - SOLE.depth * foot[..., 2]
    heel, ball = (below + end * foot[..., 0] for end in (SOLE.heel, SOLE.ball))
    assert min(heel[:, 2].min(), ball[:, 2].min()) > -1e-12
    up = pitch >= 0.0
    assert np.ptp(heel[~up], axis=0).max() < 1e-12
    assert np.ptp(ball[up], axis=0).max() < 1e-12
    np.testing.assert_allclose(FootPlacement.of_foot(SOLE, foot, ankle).point, rolling.point, atol=1e-12)


def test_other_bodies_are_refused():
    with pytest.raises(BodyError):
        LegKinematics(insect())
    with pytest.raises(BodyError, match="soles"):
        Sole.of_body(insect())
