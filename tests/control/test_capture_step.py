"""Capture steps: a pendulum on two feet, pushed off its plan, is caught by moved steps."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.control.capture_step import ShiftedPlan
from manikin.control.reference import EffectorReference, ReferenceSample
from manikin.control.settings import ShiftSettings
from manikin.control.supports import SupportMode, SupportState, support_intervals
from manikin.numerics.spatial import GRAVITY

PERIOD, HEIGHT, MASS = 0.005, 0.9, 75.0
BOTH, SINGLE, STEP, HALF = 0.1, 0.4, 0.5, 0.07
FREQUENCY = np.sqrt(GRAVITY / HEIGHT)
FEET = ("left_foot", "right_foot")


def walk(count=8):
    """Schedule of a walk of ``count`` steps along x, the left foot first."""
    at = dict(zip(FEET, ([0.0, HALF], [0.0, -HALF]), strict=True))
    phases, durations = [], []

    def add(names, seconds):
        stance = [
            sole(n, (*at[n], 0.0), 0.0, length=0.28, width=0.12, friction=0.8, normal_force_cap=2000.0)
            for n in names
        ]
        phases.append(Phase(Stance(stance), seconds, seconds))
        durations.append(seconds)

    add(FEET, 0.5)
    for number in range(count):
        swing, stance = FEET[number % 2], FEET[(number + 1) % 2]
        add([stance], SINGLE)
        at[swing] = [at[stance][0] + (STEP if number < count - 1 else 0.0), at[swing][1]]
        add(FEET, BOTH if number < count - 1 else 1.5)
    return ContactSchedule(StanceSequence(phases), np.concatenate([[0.0], np.cumsum(durations)]))


def reference():
    """A plan whose centre of mass stands still: only deviations from it count."""
    none = np.zeros(3)
    feet = {name: EffectorReference(np.eye(3), np.zeros(3), np.zeros(6), np.zeros(6)) for name in FEET}
    com = np.array([0.0, 0.0, HEIGHT])
    return ReferenceSample(np.zeros(7), np.zeros(6), np.zeros(6), com, none, none, none, none, feet)


def pushed(impulse, at, settings, schedule):
    """Deviations (n, 2) of the true pendulum, those of the moved plan, of each foot, and the shift.

    The ZMP of the true one is that of the plan, moved with the feet that stand and against the deviation by
    as much as an ankle can; both feet share the load evenly in time between steps.
    """
    shift, plan = ShiftedPlan(schedule, settings, PERIOD), reference()
    place, speed, true, planned, feet = np.zeros(2), np.zeros(2), [], [], {name: [] for name in FEET}
    intervals = {name: support_intervals(schedule, name, 0.0) for name in FEET}
    for number in range(round((schedule.instants[-1] - 1.2) / PERIOD)):
        time = number * PERIOD
        if abs(time - at) < 0.5 * PERIOD:
            speed = speed + np.array(impulse) / MASS
        held = {n: next((i for i in intervals[n] if i.start <= time < i.end), None) for n in FEET}
        supports = {
            n: SupportState(n, SupportMode.SWING, None) if i is None
            else SupportState(n, SupportMode.STANCE, i.contact) for n, i in held.items()
        }  # fmt: skip
        momentum = np.append(MASS * speed, np.zeros(4))
        state = SimpleNamespace(com=plan.com + np.append(place, 0.0), momentum=momentum, mass=MASS)
        moved = shift.moved(time, state, plan, supports)
        true.append(place)
        planned.append(moved.com[:2])
        for name in FEET:
            feet[name].append(moved.effectors[name].position[:2])
        standing = [n for n in FEET if held[n] is not None]
        pivot = shift.feet[standing[0]]
        if len(standing) == 1 and shift.active:
            off = 1.3 * (place + speed / FREQUENCY) - pivot
            most = np.array([settings.ankle, settings.ankle_across])
            pivot = pivot + off / max(1.0, np.max(np.abs(off) / most))
        if len(standing) == 2:
            first, last = sorted(FEET, key=lambda n: held[n].start)
            share = np.clip((time - held[last].start) / (held[first].end - held[last].start), 0.0, 1.0)
            share = share if np.isfinite(share) else 0.5
            pivot = (1.0 - share) * shift.feet[first] + share * shift.feet[last]
        speed = speed + PERIOD * FREQUENCY**2 * (place - pivot)
        place = place + PERIOD * speed
    return np.array(true), np.array(planned), {name: np.array(way) for name, way in feet.items()}, shift


@pytest.mark.parametrize("impulse", [(15.0, 0.0), (-15.0, 0.0), (0.0, 15.0), (0.0, -10.0)])
@pytest.mark.parametrize("at", [1.05, 1.2, 1.6])
def test_a_pushed_pendulum_is_caught_by_its_next_steps(impulse, at):
    """Unmoved, 6 cm of its capture point would be metres after eight steps."""
    true, planned, _, shift = pushed(impulse, at, ShiftSettings(threshold=0.02), walk())
    assert shift.active
    assert np.hypot(*true.T).max() < 0.6
    # It decays with 0.3 w = 1 / s where a foot allows; a landing that would cross the other takes longer.
    assert np.hypot(*planned[-1]) < 0.5 * np.hypot(*planned.T).max()
    crosses = (impulse, at) == ((0.0, 15.0), 1.05)
    assert crosses or np.hypot(*planned[-1]) < 0.05
    # What is left below the threshold is not taken over, and grows until it is.
    assert np.hypot(*(true - planned)[-1]) < 0.1
    fallen, _, _, still = pushed(impulse, at, ShiftSettings(threshold=1e9), walk())
    assert not still.active
    assert np.hypot(*fallen[-1]) > 1.0


def test_moved_feet_come_no_nearer_to_each_other_than_allowed():
    settings, schedule = ShiftSettings(threshold=0.02), walk()
    _, _, _, shift = pushed((0.0, 25.0), 1.2, settings, schedule)
    left, right = (
        (support_intervals(schedule, name, 0.0)[-1].contact.position[:2] + shift.feet[name])[1]
        for name in FEET
    )
    assert settings.narrowest - 1e-6 <= left - right <= settings.widest + 1e-6


def test_a_foot_passes_the_other_no_nearer_than_planned():
    """Pushed to the right on the left foot: the left foot goes to the right as well, round the right one."""
    schedule = walk()
    _, planned, feet, shift = pushed((0.0, -15.0), 1.2, ShiftSettings(threshold=0.02), schedule)
    assert shift.active
    apart, passes = feet[FEET[0]][:, 1] - feet[FEET[1]][:, 1], []
    for phase, (begin, end) in zip(schedule.sequence, pairwise(schedule.instants), strict=True):
        middle = round(0.5 * (begin + end) / PERIOD)
        if len(phase.stance) == 1 and middle < len(planned):
            passes.append(apart[middle])
    assert len(passes) >= 6
    # A landing that is still sought as the foot passes moves its way by some millimetres.
    assert min(passes) > -0.01


def test_a_moved_foot_keeps_away_from_what_stands_there():
    """A wall on the right: a foot lands no nearer to it than asked for; without a look at it it would."""

    class Wall:
        def beside(self, _before, after):
            return np.maximum(after[:, 1] + HALF + 0.06, 0.0)

    settings, schedule = ShiftSettings(threshold=0.02, room=Wall(), nearest=0.05), walk()
    _, _, free, _ = pushed((0.0, -6.0), 1.05, ShiftSettings(threshold=0.02), schedule)
    true, _, kept, shift = pushed((0.0, -6.0), 1.05, settings, schedule)
    assert shift.active
    assert free["right_foot"][:, 1].min() < -0.015
    assert kept["right_foot"][:, 1].min() >= -0.01 - 1e-4
    assert np.hypot(*true[-1]) < 0.02


def test_a_body_on_its_plan_is_never_moved():
    true, planned, _, shift = pushed((0.0, 0.0), 1.0, ShiftSettings(threshold=0.02), walk())
    assert not shift.active
    np.testing.assert_array_equal(planned, 0.0)
    np.testing.assert_array_equal(true, 0.0)
