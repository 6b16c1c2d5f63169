"""Flights of a foot: smooth curves, the Bi-RRT with a cheap check and with whole-body postures."""

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import sole
from manikin.kinematics import PostureProblem, com_target, touching_pairs
from manikin.numerics.spatial import rotation_from_yaw
from manikin.planning.whole_body.birrt import plan_flight
from manikin.planning.whole_body.swing import SwingLimits, plan_swing
from manikin.planning.whole_body.swing_curve import SwingCurve
from manikin.planning.whole_body.swing_path import EffectorClearance, Pose
from manikin.planning.whole_body.swing_search import ClearFlight, PostureCheck, search_swing, smooth_path
from manikin.scene import Box, Obstacle, Proximity, Scene

BODY = human()
BOXES = {"threshold": ((0.05, 1.5, 0.3), (0.35, 0.75, 0.15)), "platform": ((1.1, 1.5, 0.2), (0.9, 0.75, 0.1))}
SCENE = Scene([Obstacle(name, Box(size), translation=place) for name, (size, place) in BOXES.items()])
FACING_Y = rotation_from_yaw(np.pi / 2)
START, GOAL = Pose(np.array([0.2, 0.4, 0.0]), FACING_Y), Pose(np.array([0.5, 0.65, 0.2]), FACING_Y)
LIMITS = SwingLimits(speed=2.0, angular_speed=5.0)
ENDS = Pose(np.zeros(3), np.eye(3)), Pose(np.array([1.0, 0.0, 0.0]), np.eye(3))
STANDING = sole("right_foot", (0.7, 0.65, 0.2), np.pi / 2, length=0.28, width=0.12, friction=0.7)
COM = np.array([0.66, 0.6, 0.84])
CLEARANCE = EffectorClearance(BODY, SCENE, "left_foot", [STANDING], lambda _contact, _time: COM)


def over_a_wall(pose, _time, _hint):
    x, y, z = pose.position
    return None if (0.4 < x < 0.6 and z < 0.35 and abs(y) < 1.0) or z < 0 else True


def test_plan_swing_over_the_threshold(benchmark):
    """Family and optimisation."""
    assert benchmark(plan_swing, START, GOAL, 0.0, 0.8, CLEARANCE).succeeded


def test_evaluate_a_swing_at_1_khz(benchmark):
    """Pose, velocity and acceleration at 800 instants."""
    curve = SwingCurve.lift(START, GOAL, 0.0, 0.8, height=0.2)
    benchmark(curve.evaluate, np.linspace(0.0, 0.8, 800))


@pytest.mark.parametrize("seed", range(3))
def test_bi_rrt_with_a_cheap_check(benchmark, seed):
    """The search itself, over a wall."""
    result = benchmark(
        lambda: plan_flight(*ENDS, 0.0, 2.0, over_a_wall, np.random.default_rng(seed), limits=LIMITS)
    )
    assert result.path is not None


def test_smooth_a_path(benchmark):
    """A hundred shortcuts."""
    found = plan_flight(*ENDS, 0.0, 2.0, over_a_wall, np.random.default_rng(0), limits=LIMITS)
    assert found.path is not None
    benchmark(lambda: smooth_path(found.path, over_a_wall, np.random.default_rng(0), limits=LIMITS))


@pytest.mark.parametrize("seed", range(2))
def test_bi_rrt_with_whole_body_postures(benchmark, seed):
    """The step over the threshold with CHECK-PG; the thesis needed 3 to 10 minutes for two steps."""
    touching = [("right_foot", "platform"), ("left_foot", "floor"), ("left_foot", "platform")]
    base = PostureProblem(
        BODY,
        (STANDING,),
        com=com_target(*COM),
        proximity=Proximity(BODY, SCENE),
        ignore=touching_pairs(BODY, touching),
    )

    def check(extra):
        screen = ClearFlight(CLEARANCE, (START, GOAL), (0.0, 0.8), SwingLimits(), extra)
        return PostureCheck("left_foot", lambda _time: base, screen, rotation_weight=0.05)

    def search():
        return search_swing(
            START, GOAL, 0.0, 0.8, check(0.0), np.random.default_rng(seed), roomy=check(0.02),
            limits=SwingLimits(speed=4.0, angular_speed=8.0),
        )  # fmt: skip

    assert benchmark.pedantic(search, rounds=1).curve is not None
