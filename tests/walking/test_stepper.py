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
from manikin.walking.stepper import SIDE, StepRule, place_footprints

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
        there = [x - np.sin(heading) * half, y + np.cos(heading) * half, 0.0]
        assert np.allclose(step.position, there, atol=1e-5)
        assert step.yaw == pytest.approx(heading, abs=1e-5)
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
@given(
    st.floats(0.5, 4.0), st.floats(-np.pi, np.pi), st.floats(-np.pi, np.pi), st.sampled_from((None, *FEET))
)
def test_feet_reach_every_goal_within_the_limits_of_the_hips(distance, direction, heading, first):
    """Whatever way the path goes, feet neither cross nor overlap nor turn beyond their limits."""
    goal = (distance * np.cos(direction), distance * np.sin(direction), heading)
    path, rule = walking_path((0, 0, 0), goal, max_speed=0.6), StepRule()
    check(place_footprints(path, rule, first=first), path, rule)


def test_steps_of_a_straight_walk_have_the_walk_ratio():
    """In the steady middle, length over frequency is the walk ratio, but for the whole number of steps."""
    path, rule = walking_path((0, 0, 0), (8, 0, 0), max_speed=0.5), StepRule()
    footprints = place_footprints(path, rule)
    middle = footprints.steps[7:13]
    lengths = np.diff([step.position[0] for step in middle])
    periods = np.diff([step.lands for step in middle])
    # 8 m are some 18 steps; making their number whole changes it by at most one of them.
    assert np.allclose(lengths, lengths[0], rtol=0.02)
    assert np.allclose(lengths * periods, rule.walk_ratio, rtol=0.15)
    assert np.allclose(lengths / periods, 0.5, rtol=0.02)


def test_fast_walks_have_no_longer_steps_but_more():
    rule = StepRule()
    speeds = np.zeros((3, 3))
    speeds[:, 0] = (0.5, 1.0, 1.5)
    lengths = speeds[:, 0] / rule.frequency(speeds)
    assert lengths[0] < rule.longest_step
    assert np.allclose(lengths[1:], rule.longest_step)
    footprints = place_footprints(walking_path((0, 0, 0), (4, 0, 0)))
    assert max(abs(beside(*pair)[0]) for pair in landings(footprints)) <= rule.longest_step + ROUNDING


def test_feet_alternate_and_the_body_passes_each_in_its_support():
    path = walking_path((0, 0, 0), (4, 0, 0), max_speed=0.6)
    footprints = place_footprints(path)
    steps = footprints.steps[2:]
    assert all(a.effector != b.effector for a, b in itertools.pairwise(steps))
    for step in steps[:-2]:
        body = path.place_at(np.clip((step.lands + step.leaves) / 2, 0.0, path.duration))
        assert abs(body[0] - step.position[0]) < 0.1


@pytest.mark.parametrize("mirrored", [False, True])
def test_moves_to_the_side_close_and_open(aside, mirrored):
    """The foot on the side of the move goes first; the other one closes up to it, no further."""
    path, rule = aside, StepRule()
    if mirrored:
        spline = path.spline
        points = spline.control_points * [1.0, -1.0, -1.0]
        path = replace(path, spline=BSpline(spline.degree, spline.knots, points))
    footprints = place_footprints(path, rule)
    check(footprints, path, rule)
    leading, closing = FEET[::-1] if mirrored else FEET
    assert footprints.steps[2].effector == leading
    widths = {leading: [], closing: []}
    for step, other in landings(footprints):
        widths[step.effector].append(beside(step, other)[1])
    assert np.allclose(widths[closing][:-1], rule.narrowest, atol=1e-6)
    assert min(widths[leading][1:-1]) > rule.narrowest + 0.1


def test_turns_on_the_spot_open_and_close():
    path, rule = walking_path((0, 0, 0), (0.02, 0, np.pi), max_speed=0.6), StepRule()
    footprints = place_footprints(path, rule)
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
    path = walking_path((0, 0, 0), (1, 0, 0))
    with pytest.raises(InputError, match="left_foot, right_foot"):
        place_footprints(path, first="left")
    with pytest.raises(InputError, match="width"):
        StepRule(width=0.1)
    with pytest.raises(InputError, match="keeps the feet from the goal"):
        place_footprints(walking_path((0, 0, 0), (4, 0, 0)), StepRule(longest=0.02))
