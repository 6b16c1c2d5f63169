"""Force limits by EN 1005-3, as a function and of what a motion exerts."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.contact import ContactSchedule, ExertedForce, Phase, Stance, StanceSequence, point, sole
from manikin.ergonomics import (
    BASIC_FORCES,
    Circumstances,
    ForceMultipliers,
    ergonomics_of,
    exerted_by,
    force_limit,
    force_multipliers,
)
from manikin.ergonomics.load_report import ergonomics_in_short, load_lines
from manikin.errors import InputError
from manikin.motion.description import describe_schedule, schedule_from

from .conftest import FEET, still


def test_basic_forces_as_they_are_quoted():
    """The 26 values of the table (EN 1005-3, as Ergonomiesite prints it); at home less is asked, always."""
    assert BASIC_FORCES["hand_grip"] == (250.0, 184.0)
    assert [BASIC_FORCES[f"arm_{way}"] for way in ("up", "down", "outward", "inward")] == [
        (50.0, 31.0), (75.0, 44.0), (55.0, 31.0), (75.0, 49.0),
    ]  # fmt: skip
    assert [BASIC_FORCES[f"arm_{way}"] for way in ("push_supported", "push", "pull_supported", "pull")] == [
        (275.0, 186.0), (62.0, 30.0), (225.0, 169.0), (55.0, 28.0),
    ]  # fmt: skip
    assert BASIC_FORCES["body_push"] == (200.0, 119.0)
    assert BASIC_FORCES["body_pull"] == (145.0, 96.0)
    assert BASIC_FORCES["pedal_ankle"] == (250.0, 154.0)
    assert BASIC_FORCES["pedal_leg"] == (475.0, 308.0)
    assert all(home < work for work, home in BASIC_FORCES.values())


@pytest.mark.parametrize(
    ("force", "zone"), [(0.0, 1), (100.0, 1), (100.1, 2), (140.0, 2), (140.1, 3), (200.0, 3), (400.0, 3)]
)
def test_zones_of_the_risk(force, zone):
    """Recommended up to half of what is left of the force, to be avoided beyond 0.7."""
    found = force_limit(force, "body_push")
    assert found.zone == zone
    assert found.risk == pytest.approx(force / 200.0)
    assert found.recommended == 100.0


def test_the_limit_is_the_product():
    """A pull at home, moving, brief, six times a minute, for 90 minutes."""
    multipliers = force_multipliers(moving=True, action_time=2.0, per_minute=6.0, hours=1.5)
    assert multipliers == ForceMultipliers(0.8, 0.5, 0.8, checked=False)
    found = force_limit(20.0, "body_pull", domestic=True, multipliers=multipliers)
    assert found.limit == pytest.approx(96.0 * 0.8 * 0.5 * 0.8)
    assert found.as_dict()["verdict"] == "not recommended"
    assert found.unverified == ("basic force", "multipliers")
    given = force_limit(20.0, "body_pull", multipliers=ForceMultipliers(0.9, 0.8, 0.7))
    assert given.limit == pytest.approx(145.0 * 0.9 * 0.8 * 0.7)
    assert given.unverified == ("basic force",)


@pytest.mark.parametrize(
    ("name", "values"),
    [("moving", (False, True)), ("action_time", (1.0, 3.0, 3.1)), ("per_minute", (0.2, 0.21, 2.1, 20.0)),
     ("hours", (1.0, 1.1, 2.1, 8.0))],
)  # fmt: skip
def test_multipliers_never_rise(name, values):
    """With movement, the time of an action, how often and for how long it is done; 1 at best."""
    best = {"moving": False, "action_time": 1.0, "per_minute": 0.1, "hours": 0.5}
    assert force_multipliers(**best).product == 1.0
    products = [force_multipliers(**(best | {name: value})).product for value in values]
    assert products == sorted(products, reverse=True)
    assert products[-1] < products[0]


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match="done 21 times a minute"):
        force_multipliers(moving=False, action_time=3.1, per_minute=21.0, hours=1.0)
    assert force_multipliers(moving=False, action_time=3.0, per_minute=21.0, hours=1.0).frequency == 0.3
    with pytest.raises(InputError, match="hours"):
        force_multipliers(moving=False, action_time=1.0, per_minute=1.0, hours=9.0)
    with pytest.raises(InputError, match="valid: hand_grip, "):
        force_limit(10.0, "arm_sideways")
    with pytest.raises(InputError, match="multiplier of the velocity"):
        ForceMultipliers(velocity=0.0)


HANDS = ("left_hand", "right_hand")


def pushing(body, size, kind="push", direction=(1.0, 0.0, 0.0)):
    """A body that stands for two seconds, and then exerts a force with both hands for two; its contacts."""
    way = np.array(direction)
    motion = still(body, body.standing_posture(), duration=4.0, rate=10.0, contacts=(*FEET, *HANDS))
    force = np.array(motion.contact_force)
    force[20:, 2:, :3] = -0.5 * size * way  # of the object on each hand
    soles = [
        sole(name, (0.0, y, 0.0), length=0.25, width=0.1, friction=0.7)
        for name, y in zip(FEET, (0.1, -0.1), strict=True)
    ]
    palms = [point(name, (0.5, y, 1.2), friction=0.7) for name, y in zip(HANDS, (0.2, -0.2), strict=True)]
    phases = [Phase(Stance(soles)), Phase(Stance([*soles, *palms]), exerts=ExertedForce(kind, way))]
    return replace(motion, contact_force=force), ContactSchedule(StanceSequence(phases), [0.0, 2.0, 4.0])


@pytest.mark.parametrize(
    ("kind", "direction", "domestic", "basic"),
    [("push", (1.0, 0.0, 0.0), False, 200.0), ("push", (0.0, 1.0, 0.0), True, 119.0),
     ("pull", (-1.0, 0.0, 0.0), False, 145.0)],
)  # fmt: skip
def test_what_the_hands_exert_against_its_limit(body, kind, direction, domestic, basic):
    """120 N, in the phase that acts, whichever way it points; what was not said is named."""
    motion, schedule = pushing(body, 120.0, kind, direction)
    found = exerted_by(motion, schedule, Circumstances(domestic=domestic))
    assert found.limit.force == pytest.approx(120.0)
    assert found.limit.basic == basic
    assert found.limit.risk == pytest.approx(120.0 / basic)
    assert found.time == pytest.approx(2.0)
    assert found.action_time == pytest.approx(2.0, abs=0.11)
    longer = replace(motion, time=motion.time * 1.5)  # what lasts beyond the planned contacts does not count
    assert exerted_by(longer, schedule, Circumstances()).action_time == pytest.approx(1.0, abs=0.16)
    assert np.isnan(found.force[:20]).all()
    assert found.assumed == ("frequency", "duration")
    told = exerted_by(motion, schedule, Circumstances(cycles_per_minute=1.0, job_hours=4.0))
    assert told.limit.multipliers == ForceMultipliers(1.0, 0.8, 0.5, checked=False)
    assert told.assumed == ()


def test_hands_that_only_hold_on_exert_nothing_for_the_standard(body):
    motion, schedule = pushing(body, 120.0)
    rail = ContactSchedule(
        StanceSequence([replace(phase, exerts=None) for phase in schedule.sequence]), schedule.instants
    )
    assert exerted_by(motion, rail, Circumstances()) is None
    assert exerted_by(motion, None, Circumstances()) is None


def test_a_phase_keeps_what_it_exerts_in_a_file(body):
    _, schedule = pushing(body, 120.0, "pull", (0.0, -1.0, 0.0))
    first, second = schedule_from(describe_schedule(schedule)).sequence
    assert first.exerts is None
    assert second.exerts.kind == "pull"
    np.testing.assert_array_equal(second.exerts.direction, [0.0, -1.0, 0.0])


def test_reports_tell_both_standards(body):
    """In the report, the series, the lines, and what a run keeps; unknown forces are a reason."""
    motion, schedule = pushing(body, 120.0)
    found = ergonomics_of(body, motion, schedule=schedule)
    report = found.as_dict()
    assert report["force"]["verdict"] == "not recommended"
    assert report["force"]["assumed"] == ["frequency", "duration"]
    lines = load_lines(report)
    assert lines["force of the hands"] == (
        "push of 120 N, not recommended (risk 0.60); recommended up to 100 N, "
        "done at most 0.2 times a minute and for an hour at most"
    )
    assert lines["working postures"] == "acceptable"
    series = found.series()
    assert np.nanmax(series["exerted_force_N"]) == pytest.approx(120.0)
    assert set(series["trunk_zone"]) == {1}
    short = ergonomics_in_short(body, motion, schedule)
    assert short["working_postures"] == {"rare": "acceptable", "frequent": "acceptable"}
    assert short["force_risk"] == pytest.approx(0.6)
    assert short["force_verdict"] == "not recommended"
    unknown = replace(motion, contact_force=np.full_like(motion.contact_force, np.nan))
    missing = ergonomics_of(body, unknown, schedule=schedule)
    assert missing.loads.force is None
    assert missing.missing["force"] == "the forces of the hands are not known"
