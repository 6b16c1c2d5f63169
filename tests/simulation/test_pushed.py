"""Pushed while moving: what a push does, how the plan waits, and how the body comes back on it."""

import numpy as np
import pytest

from manikin.control import ControlSettings, ReturnSettings
from manikin.control.plan_return import Deviation, PlanClock
from manikin.control.recovery.standing import SupportArea
from manikin.control.reference import Reference
from manikin.errors import InputError
from manikin.pipeline.stages import ExecutionRequirements
from manikin.scene import Scene
from manikin.simulation import Push, execute, push_impulse, push_on_the_way

READY = ControlSettings(returning=ReturnSettings())
HOLD = 0.5
"""Time of standing after a motion [s]."""
SQUARE = SupportArea(np.array([[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]), 0.0)


def pushed(plan, impulse, direction, at, settings=READY, **options):
    push = push_on_the_way(plan.motion, 10.0 * impulse, direction, at, 0.1)
    return execute(
        plan.body, Scene(), plan.motion, plan.schedule, pushes=[push], settings=settings, **options
    )


@pytest.fixture(scope="module")
def stepping(step):
    """A slow step forward."""
    return step(shift=1.0, swing=0.6, stride=(0.1, 0.0, 0.0))


@pytest.fixture(scope="module")
def beginning(stepping, cut):
    """The first 0.4 s of the step."""
    return cut(stepping, 0.4)


@pytest.fixture(scope="module")
def begun(beginning):
    """They without a push."""
    return execute(beginning.body, Scene(), beginning.motion, beginning.schedule, settings=READY, hold=0.0)


@pytest.fixture(scope="module")
def waiting(stepping):
    """Pushed from the front while the weight goes over the standing foot."""
    return pushed(stepping, 20.0, 180.0, 0.3, hold=HOLD)


def test_without_a_push_being_ready_for_one_changes_no_bit(beginning, begun):
    plain = execute(beginning.body, Scene(), beginning.motion, beginning.schedule, hold=0.0)
    for name in ("time", "q", "v", "tau", "margin"):
        np.testing.assert_array_equal(getattr(begun.motion, name), getattr(plain.motion, name))
    assert begun.push is None
    assert begun.schedule is None
    assert begun.summary()["push"] is None


def test_a_short_push_changes_the_momentum_by_its_impulse(beginning, begun):
    """10 N.s within 10 ms, less what the ground takes meanwhile, which is read from two samples (0.5 N.s)."""
    push = Push("thorax", np.array([1000.0, 0.0, 0.0]), 0.3, 0.01)
    assert push_impulse(push) == pytest.approx(10.0)
    hit = execute(
        beginning.body, Scene(), beginning.motion, beginning.schedule, pushes=[push], settings=READY,
        hold=0.0,
    ).motion  # fmt: skip
    free = begun.motion
    sample = int(np.searchsorted(free.time, 0.31 - 1e-6))
    np.testing.assert_array_equal(hit.q[: sample - 2], free.q[: sample - 2])
    dynamics = [_momentum(beginning.body, motion, sample) for motion in (hit, free)]
    gained = dynamics[0] - dynamics[1]
    ground = sum(_ground(motion, sample) * sign for motion, sign in ((hit, 1.0), (free, -1.0)))
    assert gained[0] == pytest.approx(10.0 + ground, abs=0.5)
    assert gained[0] > 5.0


def test_the_plan_waits_and_the_body_comes_back_on_it(stepping, waiting):
    outcome = waiting.push
    assert waiting.succeeded, waiting.failure
    assert ExecutionRequirements().table(waiting).held
    assert outcome.recovered
    assert outcome.impulse_Ns == pytest.approx(20.0)
    assert 0.1 < outcome.waited_s < 2.0
    assert outcome.max_deviation_m > 0.01
    assert 0.0 < outcome.return_s < 2.0
    assert waiting.final_com_error_m < 1e-3
    late = waiting.motion.time[-1] - HOLD - stepping.motion.time[-1]
    assert late == pytest.approx(outcome.waited_s, abs=0.006)
    planned, due = stepping.schedule.instants, waiting.schedule.instants
    assert due[0] == planned[0]
    assert due[-1] - planned[-1] == pytest.approx(outcome.waited_s)
    assert np.all(np.diff(due - planned) >= 0.0)


def test_the_foot_is_lifted_when_the_waiting_is_over(stepping, waiting):
    """The foot that steps presses until the delayed lift-off, and has left the ground soon after."""
    foot = waiting.motion.contact_names.index("right_foot")
    due = waiting.schedule.instants[1]
    force = waiting.motion.contact_force[:, foot, 2]
    time = waiting.motion.time
    assert due > stepping.schedule.instants[1] + 0.1
    assert np.all(force[(time > stepping.schedule.instants[1]) & (time < due - 0.1)] > 0.0)
    assert np.all(force[(time > due + 0.1) & (time < due + 0.3)] == 0.0)


@pytest.mark.long
def test_a_plan_that_waits_saves_what_one_that_goes_on_does_not(stepping):
    """The same push is held by the one and not by the other."""
    outcomes = [
        pushed(stepping, 36.0, 270.0, 0.3, settings, hold=HOLD) for settings in (READY, ControlSettings())
    ]
    assert [result.succeeded for result in outcomes] == [True, False]


def test_too_strong_a_push_is_a_failure(stepping):
    result = pushed(stepping, 90.0, 0.0, 0.6, hold=0.5)
    assert not result.succeeded
    assert not result.push.recovered
    assert result.push.return_s is None
    assert result.push.max_deviation_m > 0.05


def test_the_direction_is_counted_from_where_the_body_faces(stepping):
    np.testing.assert_allclose(
        push_on_the_way(stepping.motion, 50.0, 90.0, 0.0, 0.1).force, [0.0, 50.0, 0.0], atol=1e-9
    )


@pytest.mark.parametrize(("duration", "impulse"), [(0.5, 1.0), (1.0, 2.0), (0.25, 0.5), (1.25, 2.5)])
def test_the_impulse_of_a_sine_counts_both_ways(duration, impulse):
    """The integral of ``|pi sin(2 pi t)|`` is 1 over each half wave."""
    push = Push("thorax", np.array([0.0, np.pi, 0.0]), 0.0, duration, frequency=1.0)
    assert push_impulse(push) == pytest.approx(impulse)


def test_a_sine_is_one_in_an_execution_too(stand):
    """A full wave within 20 ms leaves hardly any momentum, a constant force of that size up to 2 N.s."""
    plan = stand(0.3)
    speed = {}
    for frequency in (0.0, 50.0):
        push = push_on_the_way(plan.motion, 100.0, 0.0, 0.1, 0.02, frequency)
        moved = execute(plan.body, Scene(), plan.motion, plan.schedule, pushes=[push], hold=0.0).motion
        sample = int(np.searchsorted(moved.time, 0.12 - 1e-6))
        speed[frequency] = _momentum(plan.body, moved, sample)[0]
    assert 0.5 < speed[0.0] < 2.1
    assert abs(speed[50.0]) < 0.2 * speed[0.0]


def test_a_plan_at_another_rate_has_its_velocities_and_what_slowing_down_takes(stepping):
    """At the rate r all velocities are r times as large; from r to s within a hold, a = (s v' - r v) / T."""
    frames = {"pelvis": stepping.body.effector_frame("pelvis")}
    reference = Reference(stepping.body, stepping.motion, frames, 0.005, 0.05)
    full, then = reference.sample(0.5), reference.sample(0.5 + 0.25 * 0.005)
    slow = reference.sample(0.5, 0.5, 0.25)
    np.testing.assert_array_equal(slow.com, full.com)
    np.testing.assert_allclose(slow.com_velocity, 0.5 * full.com_velocity)
    np.testing.assert_allclose(slow.v, 0.5 * full.v)
    np.testing.assert_allclose(slow.effectors["pelvis"].twist, 0.5 * full.effectors["pelvis"].twist)
    expected = (0.25 * then.com_velocity - 0.5 * full.com_velocity) / 0.005
    np.testing.assert_allclose(slow.com_acceleration, expected, atol=1e-9)
    still = reference.sample(0.5, 0.0, 0.0)
    for rates in (still.v, still.a, still.com_velocity, still.com_acceleration):
        assert not np.any(rates)


# --- the clock -----------------------------------------------------------------------------------


def deviation(size, planned=(0.0, 0.0), **changes):
    error, place = np.array([size, 0.0]), np.array(planned)
    values = {"ahead": 0.0, "speed": 0.1, "grounded": True, **changes}
    return Deviation(error, place + error, place, SQUARE, 3.2, **values)


def waited(course, settings=None):
    clock = PlanClock(0.005, settings or ReturnSettings())
    rates = []
    for item in course:
        clock.advance(clock.next_rate(item))
        rates.append(clock.rate)
    return clock.waited, np.array(rates)


def test_the_clock_stops_gently_and_goes_on_when_the_error_is_small():
    """0.15 s to stop, on until below 1 cm, 0.15 s to start: 0.5 s of standing and half of the ramps."""
    course = (
        [deviation(0.02)] * 20 + [deviation(0.05)] * 65 + [deviation(0.02)] * 65 + [deviation(0.005)] * 100
    )
    total, rates = waited(course)
    assert np.all(rates[:20] == 1.0)
    assert np.all(rates[50:150] == 0.0)
    assert np.all(rates[-60:] == 1.0)
    assert np.abs(np.diff(rates)).max() == pytest.approx(0.005 / 0.15)
    assert total == pytest.approx(130 * 0.005, abs=0.006)


@pytest.mark.parametrize(
    "still",
    [
        deviation(0.02), deviation(0.05, grounded=False), deviation(0.05, ahead=0.9),
        deviation(0.05, speed=0.6), deviation(0.05, planned=(0.07, 0.0)), deviation(0.15), None,
    ],
)  # fmt: skip
def test_the_clock_goes_on_where_the_plan_cannot_be_stopped_or_need_not(still):
    total, rates = waited([still] * 100)
    assert total == 0.0
    assert np.all(rates == 1.0)


def test_the_plan_does_not_wait_for_ever():
    total, rates = waited([deviation(0.05)] * 4000, ReturnSettings(longest_wait=3.0))
    assert 3.0 <= total < 3.2
    assert rates[-1] > 0.0


@pytest.mark.parametrize(
    ("change", "says"),
    [({"large": 0.005}, "'large' is 0.005"), ({"rate": 0.0}, "'rate'"), ({"turning": np.nan}, "'turning'")],
)
def test_settings_that_mean_nothing_are_refused(change, says):
    with pytest.raises(InputError, match=says):
        ReturnSettings(**change)


def _momentum(body, motion, sample):
    import pinocchio as pin

    data = body.pinocchio.createData()
    return pin.computeCentroidalMomentum(body.pinocchio, data, motion.q[sample], motion.v[sample]).linear


def _ground(motion, sample):
    """Impulse of the ground along x over the 10 ms before a sample [N.s], from two samples."""
    return 0.005 * motion.contact_force[sample - 2 : sample, :, 0].sum()
