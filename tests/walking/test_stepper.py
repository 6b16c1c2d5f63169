"""Footprints along walking paths."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.contact import sole, soles_overlap
from manikin.errors import InputError
from manikin.numerics.spline import BSpline
from manikin.walking import walking_path
from manikin.walking.footprints import FEET
from manikin.walking.path.route import Waypoint, walking_route
from manikin.walking.stepper import LEAD, SIDE, StepRule, step_along

ROUNDING = 1e-9


def landings(footprints):
    """Each landing footprint with the one of the other foot, which stands then."""
    for step in footprints.steps[2:]:
        (other,) = (
            each
            for each in footprints.steps
            if each.effector != step.effector and each.lands < step.lands < each.leaves
        )
        yield step, other


def beside(step, other):
    """Where a foot is from the other one: ahead, outwards [m] and turned outwards [rad]."""
    side, mean = SIDE[step.effector], (step.yaw + other.yaw) / 2
    x, y = (step.position - other.position)[:2]
    ahead = np.cos(mean) * x + np.sin(mean) * y
    left = -np.sin(mean) * x + np.cos(mean) * y
    return ahead, side * left, side * (step.yaw - other.yaw)


def check(footprints, path, rule):
    ends = ((path.place[0], footprints.first()), (path.place[-1], footprints.last()))
    for foot, (place, held) in itertools.product(FEET, ends):
        step = held[foot]
        x, y, heading = place
        half = SIDE[foot] * rule.standing_width / 2
        heading_of_foot = heading + SIDE[foot] * rule.splay
        there = [x - np.sin(heading) * half, y + np.cos(heading) * half, 0.0]
        assert np.allclose(step.position, there, atol=1e-5)
        assert step.yaw == pytest.approx(heading_of_foot, abs=1e-5)
    for step, other in landings(footprints):
        ahead, outwards, turned = beside(step, other)
        assert abs(ahead) <= rule.longest + ROUNDING
        assert rule.narrowest - ROUNDING <= outwards <= rule.widest + ROUNDING
        assert -rule.toes_in - ROUNDING <= turned <= rule.toes_out + ROUNDING
        shapes = [
            sole(s.effector, s.position, s.yaw, length=0.28, width=0.12, friction=0.7) for s in (step, other)
        ]
        assert not soles_overlap(*shapes)
    inner = list(footprints.phases())[1:-1]
    for held, seconds in inner:
        assert seconds >= (rule.single if len(held) == 1 else rule.double) - ROUNDING


@settings(max_examples=12)
@given(st.floats(0.5, 4.0), st.floats(-np.pi, np.pi), st.floats(-np.pi, np.pi))
def test_feet_reach_every_goal_within_the_limits_of_the_hips(distance, direction, heading):
    """Whatever way the path goes, feet neither cross nor overlap nor turn beyond their limits."""
    goal = (distance * np.cos(direction), distance * np.sin(direction), heading)
    path, rule = walking_path((0, 0, 0), goal), StepRule()
    check(step_along(path, rule).footprints, path, rule)


def test_steps_of_a_straight_walk_have_the_walk_ratio_and_peoples_double_support():
    """In the steady middle, length over frequency is the walk ratio, but for the whole number of steps."""
    path, rule = walking_path((0, 0, 0), (8, 0, 0), max_speed=1.0), StepRule()
    footprints = step_along(path, rule).footprints
    middle = footprints.steps[6:11]
    lengths = np.diff([step.position[0] for step in middle])
    periods = np.diff([step.lands for step in middle])
    # 8 m are some 14 steps; making their number whole changes it by at most one of them.
    assert np.allclose(lengths, lengths[0], rtol=0.02)
    assert np.allclose(lengths * periods, rule.walk_ratio, rtol=0.15)
    assert np.allclose(lengths / periods, 1.0, rtol=0.02)
    both = [a.leaves - b.lands for a, b in itertools.pairwise(middle)]
    share = rule.double_share - rule.double_fall
    assert np.allclose(both / periods, share, rtol=0.05)


def test_fast_walks_have_no_longer_steps_but_more():
    rule = StepRule()
    speeds = np.zeros((2, 3))
    speeds[:, 0] = (3.0, 4.0)
    assert np.allclose(speeds[:, 0] / rule.frequency(speeds), rule.longest_step)


def test_the_body_passes_each_foot_in_its_support_and_waits_for_its_feet():
    """The path on the clock of the feet goes through the same places, not faster than steps allow."""
    path = walking_path((0, 0, 0), (-1.0, 1.0, np.radians(150.0)))
    stepped = step_along(path)
    assert stepped.duration > path.duration + 2.0 * LEAD
    np.testing.assert_allclose(stepped.place_at(0.0), path.place_at(0.0), atol=1e-9)
    np.testing.assert_allclose(stepped.place_at(stepped.duration), path.place_at(path.duration), atol=1e-9)
    steps = stepped.footprints.steps[2:]
    assert all(a.effector != b.effector for a, b in itertools.pairwise(steps))
    for step in steps[:-2]:
        middle = 0.5 * (step.lands + step.leaves)
        assert np.hypot(*(stepped.place_at(middle) - step.position)[:2]) < 0.3
    time = np.linspace(0.0, stepped.duration, 2001)
    velocity, place = stepped.motion_at(time)[0], stepped.place_at(time)
    moved = np.hypot(*np.gradient(place[:, :2], time, axis=0).T)
    np.testing.assert_allclose(np.hypot(*velocity[:, :2].T)[1:-1], moved[1:-1], atol=5e-3)


def test_both_feet_stand_while_a_route_waits():
    """Where a route stops, feet come side by side, for the wait at least."""
    stops = [Waypoint(np.array([1.0, 0.0, 0.0]), wait=1.5), Waypoint(np.array([1.0, 0.0, np.pi / 2]))]
    stepped = step_along(walking_route((0, 0, 0), stops))
    longest = max(seconds for held, seconds in list(stepped.footprints.phases())[1:-1] if len(held) == 2)
    assert longest > 1.5
    middle = next(held for held, seconds in stepped.footprints.phases() if seconds == longest)
    places = [step.position[:2] for step in middle.values()]
    np.testing.assert_allclose(np.mean(places, axis=0), [1.0, 0.0], atol=1e-3)
    assert np.hypot(*(places[1] - places[0])) == pytest.approx(StepRule().standing_width, abs=1e-3)


@pytest.mark.parametrize("mirrored", [False, True])
def test_moves_to_the_side_close_and_open(aside, mirrored):
    """The foot on the side of the move goes first; the other one closes up to it, no further."""
    path, rule = aside, StepRule()
    if mirrored:
        spline = path.spline
        points = spline.control_points * [1.0, -1.0, -1.0]
        path = replace(path, spline=BSpline(spline.degree, spline.knots, points))
    footprints = step_along(path, rule).footprints
    check(footprints, path, rule)
    leading, closing = FEET[::-1] if mirrored else FEET
    assert footprints.steps[2].effector == leading
    widths = {leading: [], closing: []}
    for step, other in landings(footprints):
        widths[step.effector].append(beside(step, other)[1])
    closed = rule.narrowest + rule.sole_length * np.sin(rule.splay)
    assert np.allclose(widths[closing][:-1], closed, atol=1e-6)
    assert min(widths[leading][1:-1]) > rule.narrowest + 0.1


def test_turns_on_the_spot_open_and_close():
    path, rule = walking_path((0, 0, 0), (0.02, 0, np.pi), max_speed=0.6), StepRule()
    footprints = step_along(path, rule).footprints
    check(footprints, path, rule)
    assert footprints.count >= np.pi / (rule.toes_out + rule.toes_in) * 2


def test_taller_people_take_longer_and_slower_steps():
    """At speeds that grow with the square root of the stature, as of pendulums, all lengths grow with it."""
    short, tall = StepRule(), StepRule().scaled(2.0 * 1.75)
    speed = np.array([0.8, 0.0, 0.0])
    slow, quick = tall.frequency(np.sqrt(2.0) * speed), short.frequency(speed)
    assert quick / slow == pytest.approx(np.sqrt(2.0))
    assert tall.width == pytest.approx(2.0 * short.width)


def test_unusable_arguments_are_named():
    with pytest.raises(InputError, match="width"):
        StepRule(width=0.1)
    with pytest.raises(InputError, match="keeps the feet from the goal"):
        step_along(walking_path((0, 0, 0), (4, 0, 0)), StepRule(longest=0.02))
