"""Walks from footprints to the executed motion."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.locomotion import walking_path
from manikin.locomotion.stepper import place_footprints
from manikin.pipeline import run
from manikin.scenarios import load_scenario
from manikin.scenarios.walked import walk_before, walking_supports


def check(result):
    """Every stage kept its requirements, on its own certificate (metres, newton metres)."""
    summary = result.summary
    assert summary["succeeded"], summary["failure"]
    com, body, executed = summary["centroidal"], summary["wholebody"], summary["execution"]
    assert com["min_margin"] >= 14.9
    assert body["min_margin"] > 0.0
    assert body["max_support_error_m"] <= 1e-3
    assert body["max_com_error_m"] <= 2e-3
    assert body["min_clearance_m"] >= 0.01
    assert body["max_joint_limit_violation_rad"] <= 1e-9
    assert body["max_torque_share"] <= 1.0
    assert body["max_velocity_share"] <= 1.0
    assert not executed["fell"]
    assert executed["com_max_error_m"] <= 0.01
    assert executed["max_foot_error_m"] <= 0.01
    assert executed["min_margin"] > 0.0


def gaps(body, motion):
    """Largest gaps of q [m], [rad] and of v [m/s], [rad/s] from one sample to the next one.

    What is left of the step of q after the mean velocity, and of the step of v after the mean acceleration:
    errors of third order in the time step where the motion is continuous, the jump where it is not.
    """
    step = np.diff(motion.time)[:, None]
    moved = np.array(
        [pin.difference(body.pinocchio, a, b) for a, b in zip(motion.q[:-1], motion.q[1:], strict=True)]
    )
    in_q = np.abs(moved - step * (motion.v[:-1] + motion.v[1:]) / 2)
    in_v = np.abs(np.diff(motion.v, axis=0) - step * (motion.a[:-1] + motion.a[1:]) / 2)
    return in_q.max(), in_v.max()


@pytest.mark.slow
def test_a_walk_around_is_executed():
    goal = (2.0, 2.0, np.pi / 2)
    path = walking_path((0, 0, 0), goal, max_speed=0.6)
    scenario = walking_supports(place_footprints(path), load_scenario("walk"))
    result = run(scenario)
    check(result)
    assert np.allclose(result.executed.com[-1, :2], goal[:2], atol=0.01)


@pytest.mark.slow
def test_a_walk_to_the_side_is_executed(aside):
    result = run(walking_supports(place_footprints(aside), load_scenario("walk")))
    check(result)
    moved = result.executed.com[-1, :2] - result.executed.com[0, :2]
    assert np.allclose(moved, [0.0, 1.2], atol=0.01)


@pytest.mark.slow
def test_a_walk_to_the_platform_goes_on_with_its_plan():
    """4 m to the first stance of the platform, and up: one motion, continuous in q and v, and executed."""
    path = walking_path((0, -4, np.pi / 2), (0, 0, np.pi / 2), max_speed=0.6)
    scenario = walk_before(place_footprints(path, first="right_foot"), load_scenario("platform"))
    result = run(scenario)
    check(result)
    in_q, in_v = gaps(scenario.build_body(), result.planned)
    assert in_q < 1e-6
    assert in_v < 1e-4
    assert np.allclose(result.executed.com[-1], scenario.goal_com, atol=0.01)
