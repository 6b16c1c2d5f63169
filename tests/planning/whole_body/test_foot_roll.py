"""A rolling foot turns about its toes' hinge and its heel's edge, which stay where they are."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import human
from manikin.contact import ContactSchedule, SolePart, Stance, StanceSequence, roll_feet
from manikin.contact.stance import ON_TOES
from manikin.planning.whole_body.foot_roll import (
    BALL_PITCH,
    HEEL_STRIKE_PITCH,
    HIGHEST_PITCH,
    PUSH_OFF_PITCH,
    foot_roll,
)
from manikin.planning.whole_body.swing_curve import SwingCurve

from .conftest import step_sequence

HINGE = 0.0644


@pytest.fixture(scope="module")
def rolled():
    """Roll and curve of the left foot's flight in a short step."""
    body = human(1.75, 79.0, "male", sole_length=0.28, sole_width=0.12)
    sequence = roll_feet(step_sequence(), HINGE)
    schedule = ContactSchedule(sequence, np.cumsum([0.0, *(phase.min_duration for phase in sequence)]))
    (swing,) = sequence.swings()
    roll = foot_roll(body, schedule, swing)
    assert roll is not None
    assert (swing.start.part, swing.end.part) == (SolePart.TOES, SolePart.HEEL)
    curve = SwingCurve.lift(*roll.pivots, *schedule.swing_interval(swing), height=0.06)
    return roll, curve


def placed(roll, curve, time, local):
    state = curve.evaluate(time)
    position, rotation = roll.pose(state.position, state.rotation, time)
    return position + rotation @ local


@pytest.mark.parametrize("height", [0.0, 0.15, 0.6])
def test_a_heel_rises_more_where_the_other_foot_is_higher_or_lower(height):
    """Up or down a step alike: by what the step is over 0.22 of the stature, up to 48 degrees."""
    body, pitches = human(1.75, 79.0, "male"), []
    for z in (height, -height):
        phases = [
            replace(phase, stance=Stance([
                replace(contact, position=contact.position + np.array([0.0, 0.0, z]))
                if contact.effector == "right_foot" else contact for contact in phase.stance
            ], 1500.0))
            for phase in roll_feet(step_sequence(), HINGE)
        ]  # fmt: skip
        sequence = StanceSequence(phases)
        schedule = ContactSchedule(sequence, np.cumsum([0.0, *(phase.min_duration for phase in phases)]))
        pitches.append(foot_roll(body, schedule, sequence.swings()[0]).push_off)
    share = min(height / (0.22 * 1.75), 1.0)
    assert pitches == pytest.approx([PUSH_OFF_PITCH + share * (HIGHEST_PITCH - PUSH_OFF_PITCH)] * 2)


def test_the_pivot_rests_while_the_foot_turns(rolled):
    """Rotation about the edge does not move the edge, to rounding."""
    roll, curve = rolled
    up, off, land, flat = roll.instants
    for start, end, pivot in ((up, off, roll.hinge), (land, flat, roll.heel)):
        track = placed(roll, curve, np.linspace(start, end, 50), pivot)
        assert np.ptp(track, axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_the_foot_lies_flat_before_and_after(rolled):
    """Pitch, pitch rate and place agree with the contacts at both ends."""
    roll, curve = rolled
    ends = roll.instants[[0, 3]]
    assert roll.pitch(ends) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert roll.pitch(ends + np.array([1e-4, -1e-4])) == pytest.approx([0.0, 0.0], abs=1e-6)
    origins = placed(roll, curve, ends, np.zeros(3))
    assert origins[0] == pytest.approx(roll.start.position, abs=1e-12)
    assert origins[1] == pytest.approx(roll.end.position, abs=1e-12)


def test_heel_rises_before_lift_off_and_leads_at_landing(rolled):
    roll, _ = rolled
    assert roll.pitch(roll.instants[1:3]) == pytest.approx([PUSH_OFF_PITCH, -HEEL_STRIKE_PITCH])


def test_toes_stay_flat_until_lift_off(rolled):
    """The hinge opens by as much as the foot pitches; landing finds the toes straight."""
    roll, _ = rolled
    time = np.linspace(roll.instants[0], roll.instants[1], 20)
    assert roll.toe_extension(time) == pytest.approx(roll.pitch(time))
    assert roll.toe_extension(roll.instants[2:]) == pytest.approx([0.0, 0.0])


def test_the_motion_has_no_jump_in_speed(rolled):
    """Second differences of the heel's and the tip's path are those of a smooth curve everywhere."""
    roll, curve = rolled
    time = np.linspace(roll.instants[0], roll.instants[3], 4001)
    for local in (roll.heel, np.array([0.14, 0.0, 0.0])):
        acceleration = np.diff(placed(roll, curve, time, local), 2, axis=0) / (time[1] - time[0]) ** 2
        assert np.abs(np.diff(acceleration, axis=0)).max() < 0.1 * np.abs(acceleration).max()


def test_a_foot_that_lands_on_its_ball_keeps_its_toes_flat_there(rolled):
    """After landing the hinge rests and the toes are level; in flight their angle has no jump.

    Of 2000 samples of a quintic the largest step is 0.2 degrees in 1.1 ms: 3.5 rad/s.
    """
    roll = replace(rolled[0], touch=BALL_PITCH)
    _, off, land, flat = roll.instants
    curve = SwingCurve.lift(*roll.pivots, off, land, height=0.06)
    time = np.linspace(land, flat, 50)
    assert np.ptp(placed(roll, curve, time, roll.hinge), axis=0) == pytest.approx([0.0] * 3, abs=1e-12)
    assert roll.toe_extension(time) == pytest.approx(roll.pitch(time))
    assert roll.pitch(roll.instants[2:]) == pytest.approx([BALL_PITCH, 0.0])
    flight = roll.toe_extension(np.linspace(off, flat, 2000))
    assert np.abs(np.diff(flight)).max() < np.deg2rad(0.5)


@pytest.mark.parametrize("flight", [0.4, 0.6, 1.1, 2.0])
def test_toes_keep_their_range_in_long_flights(rolled, flight):
    """The foot tilts on after lift-off, but its toes keep within 70 degrees however long it flies."""
    up, off = 0.0, ON_TOES
    instants = np.array([up, off, off + flight, off + flight])
    steep = replace(rolled[0], instants=instants, push_off=HIGHEST_PITCH)
    times = np.linspace(up, off + flight, 400)
    body = human(1.75, 79.0, "male")
    limit = body.pinocchio.upperPositionLimit[7 + body.joint_index("left_toe_extension")]
    assert HIGHEST_PITCH < steep.toe_extension(times).max() < limit
