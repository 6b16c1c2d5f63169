"""Postures within the learnt volumes of hips and shoulders."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, human, insect, integrate
from manikin.body.natural_range import learnt_joints
from manikin.contact import sole
from manikin.errors import InputError
from manikin.kinematics import Placement, PostureProblem, generate_posture
from manikin.kinematics.posture_problem import LearntRangeTerm

BODY = human()
JOINTS = learnt_joints(BODY)


def learnt_distance(body, q):
    """(n,) distance of the worst hip or shoulder to the surface of its volume, negative outside [rad]."""
    angles = np.asarray(q)[:, 7:]
    return np.min([j.range.volume.distance(angles[:, j.hinges]) for j in learnt_joints(body)], axis=0)


def test_a_human_has_two_shoulders_and_two_hips_that_were_learnt():
    assert {joint.segment for joint in JOINTS} == {
        "left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh"
    }  # fmt: skip
    names = [BODY.joint_names[joint.hinges.start : joint.hinges.stop] for joint in JOINTS]
    assert all("flexion" in three[0] and "rotation" in three[2] for three in names)
    assert learnt_joints(insect()) == ()


@given(st.integers(0, 10_000))
def test_the_term_has_the_derivative_of_its_residual(seed):
    """Central differences inside cells of the volumes' grids, where the distance is smooth."""
    rng = np.random.default_rng(seed)
    term = LearntRangeTerm(BODY, 0.05)
    q = np.array(BODY.standing_posture())
    q[7:] = rng.uniform(BODY.lower, BODY.upper)
    for joint in JOINTS:
        volume, own = joint.range.volume, slice(7 + joint.hinges.start, 7 + joint.hinges.stop)
        cell = np.floor((q[own] - volume.origin) / volume.step)
        q[own] = volume.origin + (cell + rng.uniform(0.1, 0.9, 3)) * volume.step
    found = term.evaluate(Configuration(BODY, q))
    step, v = 1e-6, rng.uniform(-1.0, 1.0, BODY.nv)
    after, before = (
        term.evaluate(Configuration(BODY, integrate(BODY, q, sign * step * v))).residual
        for sign in (1.0, -1.0)
    )
    assert (found.residual <= 0.0).all()
    settled = np.abs(found.residual) > 1e-5  # where the residual has just become zero, it has a kink
    slope = (after - before) / (2.0 * step)
    assert np.allclose((found.jacobian @ v)[settled], slope[settled], atol=1e-5)


def test_an_arm_that_would_leave_its_learnt_range_takes_another_way_to_its_place():
    """A hand behind the back of one who stands: the shoulder alone goes 27 deg beyond, the body need not."""
    q = BODY.standing_posture()
    state = Configuration(BODY, q)
    feet = tuple(
        sole(name, state.effector_placement(name)[1], length=0.28, width=0.12, friction=0.7)
        for name in ("left_foot", "right_foot")
    )
    place = state.segment_placement("head")[1] + np.array([-0.3, -0.1, -0.4])
    com = np.array([state.com[0], 0.0, np.nan])
    problem = PostureProblem(BODY, feet, {"left_hand": Placement(place)}, com)
    freely, kept = generate_posture(problem), generate_posture(replace(problem, learnt_margin=0.0))
    assert freely.succeeded
    assert learnt_distance(BODY, freely.q[None])[0] < -0.1
    assert kept.succeeded, kept.failure
    assert learnt_distance(BODY, kept.q[None])[0] >= -1e-6  # the tolerance of requirements
    hand = Configuration(BODY, kept.q).effector_placement("left_hand")[1]
    assert np.allclose(hand, place, atol=1e-6)


def test_what_is_out_of_the_learnt_range_is_told_in_degrees():
    residual = np.array([0.0, -np.deg2rad(3.0), 0.0, 0.0])
    text = LearntRangeTerm(BODY).describe(residual)
    assert text == f"'{JOINTS[1].segment}' is 3.0 deg beyond its learnt range"
    with pytest.raises(InputError, match="learnt_margin"):
        PostureProblem(BODY, learnt_margin=-0.1)
