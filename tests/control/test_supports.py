from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule, Phase, SolePart, Stance, StanceSequence, point, roll_feet
from manikin.control import SupportMode, SupportSettings
from manikin.control.supports import EARLY_SHARE, LONG_FLIGHT, SupportSwitch, support_intervals

LIFT, LAND, END = 1.0, 1.6, 2.6


@pytest.fixture
def stepping(contacts):
    """Both feet, left only, both feet."""
    both = Phase(Stance(contacts))
    sequence = StanceSequence([both, Phase(Stance(contacts[:1])), both])
    return ContactSchedule(sequence, [0.0, LIFT, LAND, END])


def right(switch, time, touching=None):
    felt = None if touching is None else {"right_foot": touching}
    return switch.update(time, felt)["right_foot"]


def test_schedule_alone_switches_supports(stepping):
    """Without feeling, a support begins and ends at its planned instants."""
    switch = SupportSwitch(stepping, SupportSettings())
    modes = [right(switch, t).mode for t in (0.0, 0.995, 1.0, 1.595, 1.6, 2.6, 5.0)]
    stance, swing = SupportMode.STANCE, SupportMode.SWING
    assert modes == [stance, stance, swing, swing, stance, stance, stance]


def test_load_ramps_up_and_down(stepping):
    """Limits fall over the unloading time before lift-off and rise after touch-down."""
    switch = SupportSwitch(stepping, SupportSettings(unload_time=0.05, load_time=0.04))
    assert right(switch, 0.9).unload_share == 1.0
    assert right(switch, 0.975).unload_share == pytest.approx(0.5)
    assert right(switch, 0.995).unload_share == pytest.approx(0.1)
    right(switch, LAND - 0.2)
    shares = [right(switch, LAND + d).load_share for d in (0.0, 0.02, 0.04, 0.1)]
    assert shares == pytest.approx([0.05, 0.5, 1.0, 1.0])


def test_late_touch_down_presses_on_and_then_loads_from_the_touch(stepping):
    """A foot in the air at its landing time goes on down and carries nothing until it touches."""
    settings = SupportSettings(press_speed=0.1, press_time=0.04, press_depth=0.03, hover=0.002)
    switch = SupportSwitch(stepping, settings)
    right(switch, LAND - 0.005, False)
    late = right(switch, LAND + 0.1, False)
    assert late.mode is SupportMode.LANDING
    # It was at the contact at its landing time, as fast as it gets: 0.1 s at 0.1 m/s.
    assert late.press == pytest.approx(0.1 * 0.1)
    assert late.press_rate == pytest.approx(0.1)
    assert right(switch, LAND + 0.9, False).press == settings.press_depth
    touched = right(switch, LAND + 0.905, True)
    assert touched.mode is SupportMode.STANCE
    assert touched.load_share == pytest.approx(0.05)


def test_a_foot_goes_down_to_its_support_without_a_jump():
    """Its way is the integral of its speed, which starts from zero and rises to the final one."""
    settings = SupportSettings(press_speed=0.05, press_time=0.03)
    times = np.linspace(0.0, 0.1, 2001)
    way, speed = np.array([settings.descent(None, float(time)) for time in times]).T
    np.testing.assert_allclose(np.gradient(way, times)[1:-1], speed[1:-1], atol=0.05 / 2000 * 2)
    assert speed[0] == way[0] == 0.0
    assert speed[-1] == pytest.approx(0.05)


@pytest.mark.parametrize("hover", [0.0004, 0.0015])
def test_a_flight_ends_at_its_support_on_time(stepping, contacts, hover):
    """The lift grows smoothly, and falls to nothing by the landing time, where the landing goes on."""
    h, settings = 1e-6, SupportSettings(hover=hover, early_window=0.1)

    def lift(time):
        return right(SupportSwitch(stepping, settings), time, False)

    up = contacts[1].normal
    np.testing.assert_allclose(lift(LAND - 0.1 + 1e-9).lift, 0.0, atol=1e-12)
    assert 0.8 * hover < max(lift(LAND - d).lift @ up for d in np.linspace(0.0, 0.1, 101)[1:]) <= hover
    for time in (LAND - 0.09, LAND - 0.07, LAND - 0.043, LAND - 0.03, LAND - 0.01):
        numeric = (lift(time + h).lift - lift(time - h).lift) / (2 * h)
        np.testing.assert_allclose(lift(time).lift_rate, numeric, atol=1e-5)
    before, after = lift(LAND - 1e-7), lift(LAND)
    # 0.1 us at no more than 0.05 m/s.
    np.testing.assert_allclose(before.lift, 0.0, atol=1e-8)
    assert after.press == pytest.approx(0.0, abs=1e-8)
    assert after.press_rate == pytest.approx(-before.lift_rate @ up, abs=1e-5)


def test_a_foot_sets_out_in_time_for_its_height(contacts):
    """The way of the time that a foot takes down from a height is that height."""
    settings = SupportSettings(press_speed=0.05, press_time=0.03)
    contact = contacts[0]
    for height in (0.0, 1e-4, 7.5e-4, 1.5e-3, 0.01):
        assert settings.descent(contact, settings.lead(contact, height))[0] == pytest.approx(
            height, abs=1e-12
        )


def test_early_touch_down_counts_within_its_window(stepping):
    """A touch shortly before the planned landing is the landing; one in mid-flight is not."""
    switch = SupportSwitch(stepping, SupportSettings(early_window=0.1))
    assert right(switch, LIFT + 0.1, True).mode is SupportMode.SWING
    early = right(switch, LAND - 0.05, True)
    assert early.mode is SupportMode.STANCE
    assert early.load_share == pytest.approx(0.05)
    assert right(switch, LAND, True).load_share == pytest.approx(0.05)
    assert right(switch, LAND + 0.04, True).load_share == pytest.approx(1.0)


def test_lost_contact_is_landed_anew(stepping):
    """A support may bounce for the release time; then it is a landing again."""
    switch = SupportSwitch(stepping, SupportSettings(release_time=0.03))
    right(switch, 0.0, True)
    assert right(switch, 0.03, False).mode is SupportMode.STANCE
    assert right(switch, 0.04, False).mode is SupportMode.LANDING
    assert right(switch, 0.05, True).mode is SupportMode.STANCE


def test_intervals_cover_the_schedule(stepping):
    """First and last supports are open-ended; early touches never reach into take-off."""
    first, second = support_intervals(stepping, "right_foot", 10.0)
    assert (first.start, first.end) == (-np.inf, LIFT)
    assert (second.start, second.end) == (LAND, np.inf)
    assert second.early == pytest.approx(LAND - (LAND - LIFT) / 3)
    assert len(support_intervals(stepping, "left_foot", 0.1)) == 1


def test_a_long_flight_rises_and_comes_down_slowly(contacts):
    """A touch counts as landing, or as not yet left, for a share of a flight of over a second."""

    def windows(flight):
        both = Phase(Stance(contacts))
        sequence = StanceSequence([both, Phase(Stance(contacts[:1])), both])
        schedule = ContactSchedule(sequence, [0.0, LIFT, LIFT + flight, LIFT + flight + 1.0])
        first, second = support_intervals(schedule, "right_foot", 0.1)
        return first.late - first.end, second.start - second.early

    assert windows(LONG_FLIGHT - 0.01) == pytest.approx((0.1, 0.1))
    assert windows(4.0) == pytest.approx((4.0 * EARLY_SHARE, 4.0 * EARLY_SHARE))


@pytest.fixture
def rolling(contacts):
    """The right foot leaves over its toes and lands on its heel."""
    both = Phase(Stance(contacts))
    sequence = roll_feet(StanceSequence([both, Phase(Stance(contacts[:1])), both]), 0.06)
    return ContactSchedule(sequence, [0.0, 0.8, LIFT, LAND, 1.7, END])


def test_a_rolling_support_is_one_support_of_changing_parts(rolling):
    """Heel, sole and toes are one support: no landing in between, other points in each."""
    first, second = support_intervals(rolling, "right_foot", 0.1)
    assert (first.start, first.end, second.start, second.end) == (-np.inf, LIFT, LAND, np.inf)
    switch = SupportSwitch(rolling, SupportSettings())
    parts = [right(switch, t).contact.part for t in (0.5, 0.9, LAND, 1.65, 2.0)]
    assert parts == [SolePart.FULL, SolePart.TOES, SolePart.HEEL, SolePart.HEEL, SolePart.FULL]


def test_load_moves_gradually_to_the_part_that_stays(rolling):
    """Points that cease to touch are unloaded before, points that begin to are loaded after a change."""
    settings = SupportSettings()
    switch = SupportSwitch(rolling, settings)
    before = right(switch, 0.8 - 0.5 * settings.unload_time)
    assert before.fades == ((SolePart.TOES, pytest.approx(0.5)),)
    assert right(switch, 0.9).fades == ()
    after = right(switch, 1.7 + 0.5 * settings.rolling_load_time)
    assert after.fades == ((SolePart.HEEL, pytest.approx(0.25)),)
    assert right(switch, 2.5).fades == ()


def test_a_support_made_at_speed_is_not_waited_for_above_it(stepping, contacts):
    """It has to press at its time: no hovering before it, and the way down begins at the plan."""
    seat = replace(contacts[1], settle=0.3)
    phases = [Phase(Stance(contacts)), Phase(Stance(contacts[:1])), Phase(Stance([contacts[0], seat]))]
    switch = SupportSwitch(ContactSchedule(StanceSequence(phases), stepping.instants), SupportSettings())
    assert np.all(right(switch, LAND - 0.005, False).lift == 0.0)
    landing = right(switch, LAND, False)
    assert (landing.mode, landing.press, landing.settling) == (SupportMode.LANDING, 0.0, True)


def test_a_tip_that_bounces_off_is_landed_anew_at_once():
    """Within two control periods; a foot counts as touching for its release time."""
    tips = [
        point(name, [x, 0.0, 0.0], friction=0.7) for name, x in (("left_foot", 0.2), ("right_foot", -0.2))
    ]
    both = Phase(Stance(tips))
    schedule = ContactSchedule(StanceSequence([both, Phase(Stance(tips[:1])), both]), [0.0, LIFT, LAND, END])
    switch = SupportSwitch(schedule, SupportSettings())
    right(switch, LAND - 0.2, False)
    assert right(switch, LAND, True).mode is SupportMode.STANCE
    assert right(switch, LAND + 0.005, False).mode is SupportMode.STANCE
    assert right(switch, LAND + 0.01, False).mode is SupportMode.LANDING
