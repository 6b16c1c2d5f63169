"""Zones and levels of working postures and movements by EN 1005-4."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.ergonomics import Circumstances, assess_posture, working_postures
from manikin.ergonomics.working_postures import (
    FREQUENT,
    NOT_LONG,
    NOT_TOO_OFTEN,
    SUPPORTED,
    TABLE,
    TIMED,
    PartPostures,
    arm_zone,
    joints_at_end,
    movements,
)

from .conftest import FEET, posture, still


def both(joint, angle):
    return {f"{side}_{joint}": angle for side in ("left", "right")}


STOOPED = {
    "lumbar_flexion": 30.0, "thorax_flexion": 30.0, "neck_flexion": -40.0, **both("shoulder_flexion", 60.0)
}  # fmt: skip
"""The trunk from 20 to 60 degrees forward, arms hanging and looking ahead."""


def judged(body, motion, **given):
    circumstances = Circumstances(**given)
    found = assess_posture(body, motion, circumstances)
    return working_postures(body, motion.time, motion.q, found.angles, found.bearing, circumstances)


def held(body, duration=1.0, contacts=FEET, forces=None, given=None, **angles):
    """A posture that is held; for a second it is no static one."""
    motion = still(body, posture(body, **angles), duration=duration, contacts=contacts, forces=forces)
    return judged(body, motion, **(given or {}))


def test_levels_of_the_table_as_they_are_quoted():
    """Rows of static, rare and frequent of the zones whose levels sources give."""
    assert TABLE["trunk"].tolist() == [[1, 1, 1], [2, 1, 3], [3, 2, 3], [2, 2, 3]]
    assert TABLE["trunk_aside"].tolist() == [[1, 1, 1], [3, 2, 3]]
    assert TABLE["upper_arm"].tolist() == [[1, 1, 1], [2, 1, 2], [3, 2, 3], [3, 2, 3]]
    assert TABLE["head"].tolist() == [[1, 1, 1], [3, 2, 3]]
    for table in TABLE.values():
        assert np.all(table[0] == 1)
        assert np.all(table[:, 1] <= table[:, 2])  # frequent is never better than rare


@pytest.mark.parametrize(
    ("part", "joint", "zones"),
    [
        ("head", "neck_flexion", {-15.0: 1, -15.1: 2, 0.0: 1, 25.0: 1, 25.1: 2}),
        ("neck_aside", "neck_side_bend", {-10.0: 1, 10.0: 1, 10.1: 2, -10.1: 2}),
        ("neck_aside", "neck_rotation", {45.0: 1, 45.1: 2, -60.0: 2}),
        ("trunk_aside", "thorax_rotation", {10.0: 1, 10.1: 2, -25.0: 2}),
        ("joints", "left_knee_flexion", {0.0: 1, 134.9: 1, 135.1: 2}),
        ("joints", "right_wrist_flexion", {-62.9: 1, -63.1: 2, 72.1: 2}),
    ],
)  # fmt: skip
def test_borders_of_the_zones(body, part, joint, zones):
    """A part moves to its second zone just beyond a border, and to no other part's."""
    for angle, zone in zones.items():
        found = held(body, **{joint: angle})
        assert found.parts[part].zone[0] == zone, (joint, angle)
        others = {name for name, one in found.parts.items() if one.zone[0] > 1}
        assert others <= {part}


@pytest.mark.parametrize(
    ("angle", "zone"), [(-5.1, 4), (-4.9, 1), (0.0, 1), (19.9, 1), (20.1, 2), (59.9, 2), (60.1, 3)]
)
def test_zones_of_a_trunk_that_leans(body, angle, zone):
    """A body leant as a whole: the trunk alone, and what hangs on it."""
    q = np.array(body.zero_posture())
    q[3:7] = [0.0, np.sin(np.deg2rad(angle) / 2.0), 0.0, np.cos(np.deg2rad(angle) / 2.0)]
    assert judged(body, still(body, q)).parts["trunk"].zone[0] == zone


@pytest.mark.parametrize(
    ("raised", "ahead", "beside", "zone"),
    [(20.0, 20.0, 0.0, 1), (20.1, 0.0, 20.1, 2), (60.0, 60.0, 0.0, 2), (60.1, 60.1, 0.0, 3),
     (10.0, -10.0, 0.0, 1), (10.1, -10.1, 0.0, 4), (40.0, 38.0, -10.1, 4), (80.0, -80.0, 0.0, 3)],
)  # fmt: skip
def test_zones_of_an_upper_arm(raised, ahead, beside, zone):
    """By how far it is raised, forward or to the side; backwards or across the body where it can be seen."""
    assert arm_zone(np.array([raised]), np.array([ahead]), np.array([beside])).tolist() == [zone]


def test_a_hanging_arm_is_acceptable_however_the_trunk_leans(body):
    found = held(body, lumbar_flexion=20.0, thorax_flexion=10.0, **both("shoulder_flexion", 30.0))
    assert found.parts["trunk"].zone[0] == 1  # the line from the hips to the neck
    assert found.parts["left_arm"].zone[0] == found.parts["right_arm"].zone[0] == 1


@pytest.mark.parametrize(
    ("angles", "duration", "levels", "condition"),
    [
        ({}, 1.0, (1, 1), ""),
        ({}, 10.0, (1, 1), ""),
        (both("shoulder_flexion", 40.0), 1.0, (1, 2), NOT_TOO_OFTEN),
        (both("shoulder_flexion", 40.0), 10.0, (2, 2), TIMED),
        (both("shoulder_flexion", 80.0), 1.0, (2, 3), NOT_LONG),
        (both("shoulder_flexion", 80.0), 10.0, (3, 3), ""),
        (STOOPED, 1.0, (1, 3), ""),
        ({"thorax_rotation": 20.0}, 1.0, (2, 3), NOT_LONG),
        ({"thorax_rotation": 20.0}, 10.0, (3, 3), ""),
    ],
)  # fmt: skip
def test_levels_of_movements_and_of_what_is_held(body, angles, duration, levels, condition):
    """Beyond four seconds the static column counts, however often it is done."""
    found = held(body, duration, **angles)
    assert (found.rare.max(), found.frequent.max()) == levels
    report = found.as_dict(np.ones(len(found.time)))
    assert report["frequent" if levels[1] == 2 else "rare"]["condition"] == condition


def test_a_support_makes_static_postures_acceptable(body):
    """Of a seated trunk that is said to be supported, and of an arm whose hand carries it."""
    seated = {"duration": 10.0, "contacts": (*FEET, "buttocks")}
    alone, supported = (
        held(body, **seated, given={"trunk_supported": given}, **STOOPED).parts["trunk"]
        for given in (False, True)
    )
    assert alone.rare.max() == 2
    assert alone.condition(0, frequent=False) == TIMED
    assert supported.rare.max() == 1
    weight = 0.5 * body.mass * 9.81
    forces = {"left_foot": weight, "right_foot": weight, "left_hand": 40.0}
    arms = held(body, 10.0, (*FEET, "left_hand"), forces, **both("shoulder_flexion", 40.0)).parts
    assert arms["left_arm"].rare.max() == 1
    assert arms["right_arm"].rare.max() == 2
    backwards = PartPostures("trunk", np.array([4]), np.array([True]), np.array([False]), 0, None)
    assert backwards.condition(0, frequent=True) == SUPPORTED


def raised_often(body, times, period):
    """Arms that go up to 90 degrees and back, so many times, one every so many seconds."""
    time = np.arange(0.0, times * period + 1e-9, 0.1)
    angle = 45.0 * (1.0 - np.cos(2.0 * np.pi * time / period))
    frames = [posture(body, **both("shoulder_flexion", value)) for value in angle]
    motion = still(body, np.array(frames), duration=times * period, rate=10.0)
    return replace(motion, time=time)


def test_how_often_a_part_moves_is_counted_and_asked(body):
    """A short motion shows movements and no rate; a minute of it, or what is said, does."""
    once = judged(body, raised_often(body, 1, 6.0))
    assert once.parts["left_arm"].movements == 1
    assert once.parts["left_arm"].rate is None
    assert once.level is None
    assert once.as_dict(np.ones(len(once.time)))["known"] is None
    for cycles, level in ((1.9, 2), (FREQUENT, 3)):
        told = judged(body, raised_often(body, 1, 6.0), cycles_per_minute=cycles)
        assert told.parts["left_arm"].rate == pytest.approx(cycles)
        assert told.level.max() == level
        assert told.as_dict(np.ones(len(told.time)))["known"]["max"] == level
    long = judged(body, raised_often(body, 10, 6.0))
    assert long.parts["right_arm"].rate == pytest.approx(10.0)
    assert long.level.max() == 3


def test_a_moderately_raised_arm_is_acceptable_below_ten_movements_a_minute():
    part = PartPostures("upper_arm", np.array([2, 1]), np.zeros(2, bool), np.zeros(2, bool), 1, 9.9)
    assert part.level.tolist() == [2, 1]
    assert replace(part, rate=10.0).level.tolist() == [3, 1]
    assert replace(part, rate=1.0).level.tolist() == [1, 1]


def test_movements_are_apart_by_half_a_second():
    time = np.arange(0.0, 4.0, 0.1)
    out = (time > 0.95) & (time < 1.35) | (time > 1.55) & (time < 1.75) | (time > 3.0)
    assert movements(time, out) == 2
    assert movements(time, np.zeros(len(time), dtype=bool)) == 0
    assert movements(time, np.ones(len(time), dtype=bool)) == 1


def test_joints_that_no_source_gives_do_not_count(body):
    """A knee near the end of its range is told with its name, and leaves the level of the posture."""
    found = held(body, **both("knee_flexion", 145.0), **both("hip_flexion", 100.0))
    assert found.parts["joints"].rare.max() == 2
    assert found.parts["joints"].joint in {"left_knee_flexion", "right_knee_flexion"}
    assert found.rare.max() == 1
    assert "joints" not in found.counted
    standing = joints_at_end(body, body.standing_posture()[None])
    assert not any(flags.any() for flags in standing.values())
    assert not {"neck_flexion", "left_shoulder_flexion", "left_toe_extension"} & set(standing)


def test_shares_of_time_and_series_are_of_the_same_frames(body):
    """A quarter of the time in the third zone of both arms."""
    angles = np.repeat([0.0, 90.0], [3, 1])
    motion = still(
        body, np.array([posture(body, **both("shoulder_flexion", x)) for x in angles]), duration=3.0, rate=1.0
    )
    report = judged(body, motion).as_dict(np.ones(4))
    assert report["rare"]["share_of_time"] == {"1": 0.75, "2": 0.25, "3": 0.0}
    assert report["frequent"]["share_of_time"] == {"1": 0.75, "2": 0.0, "3": 0.25}
    assert report["frequent"]["max_at_s"] == 3.0
    assert report["frequent"]["part"] in ("left_arm", "right_arm")
    assert report["parts"]["left_arm"]["zone_share_of_time"] == {"1": 0.75, "2": 0.0, "3": 0.25, "4": 0.0}
