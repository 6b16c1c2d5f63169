"""Flights over the platform's threshold: smooth curves, and the Bi-RRT where they fail."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.planning.com import plan_com
from manikin.planning.whole_body import swing_planner
from manikin.planning.whole_body.swing import SwingLimits, check_swing
from manikin.planning.whole_body.swing_planner import FlightPlanner
from manikin.scenarios import load_scenario


@pytest.fixture(scope="module")
def planner():
    scenario = load_scenario("platform")
    body, scene = scenario.build_body(), scenario.build_scene()
    trajectory = plan_com(scenario.build_centroidal_problem()).trajectory
    assert trajectory is not None
    standing = body.standing_posture()
    return FlightPlanner(body, scene, trajectory, SwingLimits(), np.random.default_rng(0), lambda _: standing)


def test_every_step_of_the_platform_has_a_smooth_curve_that_keeps_clear(planner):
    for swing in planner.flights():
        found = planner.plan(swing)
        assert found.method == "smooth"
        assert found.failure is None
        np.testing.assert_allclose(found.curve.start.position, swing.start.position, atol=1e-12)
        np.testing.assert_allclose(found.curve.end.position, swing.end.position, atol=1e-12)
        # Measured again at 1 ms, four times as dense as planned.
        dense = check_swing(found.curve, planner._clearance(swing), replace(SwingLimits(), time_step=1e-3))
        assert dense.slack > -1.5e-3
        assert dense.curve.peak_speed <= SwingLimits().speed


@pytest.mark.parametrize("number", [0, 2])
def test_the_bi_rrt_takes_over_where_no_smooth_curve_is_found(planner, monkeypatch, number):
    """With the smooth family made to fail, a step of the platform is searched instead."""
    swing = planner.flights()[number]
    real = swing_planner.plan_swing

    def fails(*args, **kwargs):
        return replace(real(*args, **kwargs), failure="made to fail")

    monkeypatch.setattr(swing_planner, "plan_swing", fails)
    found = planner.plan(swing)
    assert found.method == "bi-rrt", found.failure
    check = check_swing(found.curve, planner._clearance(swing), SwingLimits())
    # The search checks at its own instants; between them 2 mm may be lost.
    assert check.slack > -2e-3


def test_a_trailing_foot_points_its_toes_down_and_a_leading_one_does_not(planner):
    first, trailing, _ = planner.flights()
    starts = [planner.schedule.swing_interval(swing)[0] for swing in (first, trailing)]
    assert planner._pitch(first, starts[0]) == pytest.approx(0.0)
    assert 0.2 < planner._pitch(trailing, starts[1]) <= 0.9


def test_a_foot_does_not_pass_round_the_far_side_of_the_one_that_stands(planner):
    """Legs that did would cross. The last step of the platform ends before the foot that stands."""
    for swing in planner.flights()[:2]:
        sides = {np.sign(lateral) for lateral in planner._laterals(swing)}
        assert sides == ({0.0, 1.0} if swing.effector == "left_foot" else {0.0, -1.0})
