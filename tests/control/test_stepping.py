"""Where a step goes, how the foot gets there, and what is held without one."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from manikin.body import kudoh
from manikin.control.recovery import BalanceRecovery, RecoverySettings, Standing, edge_limits, held_impulse
from manikin.control.recovery.recovery_controller import held_posture
from manikin.control.recovery.standing import SupportArea
from manikin.control.recovery.turning import Turning, _swayed
from manikin.control.stepping import StepSettings, SwingFoot, capture_after, step_goals
from manikin.errors import InputError
from manikin.numerics.polytope import convex_polygon, signed_distance
from manikin.numerics.spatial import GRAVITY

KUDOH = kudoh()
SOLES = Standing.of(KUDOH, KUDOH.standing_posture(), ("left_foot", "right_foot"), 0.7).soles
FREQUENCY = 3.2
LIMITS = StepSettings()


# --- places -----------------------------------------------------------------------------------


@given(x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0), inset=st.floats(0.0, 0.03))
def test_the_closest_point_of_an_area_is_in_it_and_none_is_closer(x, y, inset):
    area = SupportArea.of(SOLES)
    point = np.array([x, y])
    found = area.closest(point, inset)
    assert area.inside(found) >= inset - 1e-9
    grid = np.stack(np.meshgrid(*(np.linspace(-0.4, 0.4, 161),) * 2), axis=-1).reshape(-1, 2)
    others = grid[area.inside(grid) >= inset]
    assert np.linalg.norm(others - point, axis=1).min() >= np.linalg.norm(found - point) - 1e-9


def test_the_capture_point_runs_away_as_that_of_a_pendulum():
    area = SupportArea.of(SOLES[:1])
    com, velocity = np.array([0.1, 0.15]), np.array([0.6, 0.0])
    capture = com + velocity / FREQUENCY
    zmp = area.closest(capture, 0.01)
    path = solve_ivp(
        lambda _, s: np.concatenate((s[2:], FREQUENCY**2 * (s[:2] - zmp))), (0.0, 0.3), [*com, *velocity],
        rtol=1e-10, atol=1e-12,
    ).y[:, -1]  # fmt: skip
    expected = path[:2] + path[2:] / FREQUENCY
    np.testing.assert_allclose(capture_after(capture, area, FREQUENCY, 0.3, 0.01), expected, atol=1e-8)


@given(ahead=st.floats(0.0, 0.2), angle=st.floats(-np.pi, np.pi), steps=st.integers(1, 2))
def test_steps_capture_within_the_limits(ahead, angle, steps):
    """Checked with the hull of the corners instead of the half planes that the search has."""
    area = SupportArea.of(SOLES)
    direction = np.array([np.cos(angle), np.sin(angle)])
    edge = min(o / (n @ direction) for n, o in zip(*area.half_planes(), strict=True) if n @ direction > 1e-6)
    capture = (edge + ahead) * direction
    first, second = SOLES
    for number, goal in enumerate(step_goals((first, second), capture, FREQUENCY, LIMITS, steps)):
        if number == 20:
            break
        stays, moving = (second, first) if goal.foot == first.effector else (first, second)
        new = replace(moving, position=goal.position, rotation_contact_to_world=goal.rotation)
        corners = np.concatenate((stays.points_in_world, new.points_in_world))[:, :2]
        room = float(signed_distance(goal.capture, convex_polygon(corners)))
        after = SupportArea.of([stays])
        expected = capture_after(capture, after, FREQUENCY, goal.duration, LIMITS.inset)
        np.testing.assert_allclose(goal.capture, expected, atol=1e-9)
        if room < LIMITS.inside - 1e-6:
            assert steps == 2
            soles = (new, stays) if moving is first else (stays, new)
            assert next(step_goals(soles, goal.capture, FREQUENCY, LIMITS, 1), None) is not None
        between = goal.position - stays.position
        sideways = between[1] if moving is first else -between[1]
        assert sideways >= LIMITS.apart - 1e-9
        assert np.linalg.norm(between) <= LIMITS.reach + 1e-9
        assert np.linalg.norm(goal.position - moving.position) <= LIMITS.speed * goal.duration + 1e-9


def test_the_first_steps_offered_are_the_quickest():
    goals = list(step_goals(SOLES, np.array([0.25, 0.0]), FREQUENCY, LIMITS, 1))
    durations = [goal.duration for goal in goals]
    assert durations == sorted(durations)
    assert durations[0] == pytest.approx(LIMITS.shortest)


# --- the way of the foot ------------------------------------------------------------------------


@given(x=st.floats(-0.6, 0.6), y=st.floats(-0.3, 0.3), moved=st.floats(-0.1, 0.1), at=st.floats(0.05, 0.2))
def test_a_foot_comes_to_rest_at_a_goal_that_moves(x, y, moved, at):
    start, duration, tick = np.array([0.02, 0.15, 0.0]), 0.3, 0.005
    goal, other = start + np.array([x, y, 0.0]), start + np.array([x + moved, y, 0.0])
    foot = SwingFoot("left_foot", np.eye(3), start, goal, 1.0, duration, 0.06)
    places, speeds = [], []
    for number in range(1, round(duration / tick)):
        time = 1.0 + number * tick
        if time - 1.0 >= at:
            foot.goal = other
        sample = foot.sample(time)
        places.append(sample.position)
        speeds.append(sample.twist[:3])
    # A polynomial of the fifth degree: central differences are off by its third derivative, below
    # 60 (0.7 m) / (0.1 s)^3 for a goal moved 0.1 s before the end, times tick^2 / 6.
    numeric = (np.array(places)[2:] - np.array(places)[:-2]) / (2 * tick)
    assert np.abs(numeric - np.array(speeds)[1:-1]).max() < 0.18
    assert np.max(np.array(places)[:, 2]) == pytest.approx(0.06, rel=0.01)
    end = foot.sample(1.0 + duration)
    np.testing.assert_allclose(end.position, other, atol=1e-9)
    np.testing.assert_allclose(end.twist[:2], 0.0, atol=1e-9)


# --- what is held without a step ------------------------------------------------------------------


@given(
    moment=st.floats(50.0, 400.0), momentum=st.floats(5.0, 100.0), reach=st.floats(0.5, 20.0),
)  # fmt: skip
def test_the_excess_is_brought_back_and_no_more(moment, momentum, reach):
    """A flywheel on a pendulum, simulated with many schedules: the best one ends at the edge."""
    weight = 70.0 * GRAVITY
    excess = Turning(moment, momentum, reach).excess(weight, FREQUENCY)
    schedules = []
    for time in np.linspace(0.0, min(momentum / moment, np.sqrt(reach / moment)), 120)[1:]:
        for coast in np.linspace(0.0, min((reach - moment * time**2) / (moment * time), 2.0), 5):
            schedules.append(((time, moment), (coast, 0.0), (time, -moment)))

    def end(start, schedule):
        """Capture point after a schedule, discounted to its beginning."""
        c, total = start, 0.0
        for lasting, turning in schedule:
            grown = np.exp(FREQUENCY * lasting)
            c, total = c * grown - turning / weight * (grown - 1.0), total + lasting
        return c * np.exp(-FREQUENCY * total)

    ends = [end(excess, schedule) for schedule in schedules]
    assert min(ends) >= -1e-9
    assert min(ends) < 0.002  # the grid's: a 120th of the time, at up to some 0.3 m/s


@given(share=st.floats(0.0, 3.0), pull=st.floats(-5.0, 5.0), time=st.floats(0.01, 0.3))
def test_a_pendulum_on_springy_ankles_sways_as_integrated(share, pull, time):
    expected = solve_ivp(
        lambda _, s: [s[1], FREQUENCY**2 * (1.0 - share) * s[0] + pull], (0.0, time), [0.02, 0.3],
        rtol=1e-10, atol=1e-12,
    ).y[:, -1]  # fmt: skip
    np.testing.assert_allclose(
        _swayed(np.array([0.02, 0.3]), FREQUENCY, share, pull, time), expected, atol=1e-7
    )


@cache
def limits(body=KUDOH, **options):
    controller = BalanceRecovery(body, body.standing_posture(), RecoverySettings(**options))
    return edge_limits(controller, body.standing_posture(), 0.1)


def test_experiments_1_and_2_lie_beyond_the_bound():
    """With the delay of the thesis and without a step; 3 and 4 do not ([Kudoh2002]_ 3.2, K-5)."""
    found = limits()
    assert held_impulse(found, 0.0) < 50.0
    assert held_impulse(found, np.pi) < 30.0
    assert held_impulse(found, np.pi / 2) > 20.0


def test_less_to_turn_and_a_later_reaction_hold_less():
    free, late = limits(delay=0.0), limits()
    arms, hips = limits(locked=("arms",)), limits(locked=("hips",))
    for direction in np.radians([0.0, 90.0, 180.0]):
        assert held_impulse(free, direction) > held_impulse(late, direction)
        assert held_impulse(late, direction) > held_impulse(arms, direction)
        assert held_impulse(late, direction) > held_impulse(hips, direction)


def test_a_pendulum_that_cannot_turn_is_held_to_the_edge_of_its_sole():
    """Closed form: reacting at once, the impulse puts the capture point of a push at the edge."""
    controller = BalanceRecovery(KUDOH, KUDOH.standing_posture(), RecoverySettings(delay=0.0))
    found = edge_limits(controller, KUDOH.standing_posture(), 1e-4)
    for limit in found:
        room = (
            max(corner @ limit.normal for corner in controller.standing.area.corners)
            - controller.standing.com[:2] @ limit.normal
        )
        frequency = np.sqrt(GRAVITY / controller.standing.height)
        expected = KUDOH.mass * frequency * (room + limit.excess)
        assert limit.impulse == pytest.approx(expected, rel=1e-3)


# --- standing and muscles ---------------------------------------------------------------------------


def test_muscles_at_rest_keep_their_torques():
    controller = BalanceRecovery(KUDOH, KUDOH.standing_posture())
    state = controller.evaluate(KUDOH.standing_posture(), np.zeros(KUDOH.nv))
    resting = np.linspace(-5.0, 5.0, KUDOH.nv - 6)
    found = held_posture(state, controller.standing, controller.groups, RecoverySettings(), resting)
    np.testing.assert_allclose(found, resting, atol=1e-9)


def test_a_body_stands_on_feet_that_it_has():
    with pytest.raises(InputError, match="left_foot, right_foot"):
        BalanceRecovery(KUDOH, KUDOH.standing_posture(), support=("left_hand",))
    with pytest.raises(InputError, match="one foot or two"):
        Standing.of(KUDOH, KUDOH.standing_posture(), (), 0.7)
