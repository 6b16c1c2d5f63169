"""OWAS codes and categories, and static postures by the limits of ISO 11226."""

import numpy as np
import pytest

from manikin.ergonomics import Circumstances, assess_posture
from manikin.ergonomics.owas import TABLE, owas_category, owas_load, owas_of
from manikin.ergonomics.static_postures import LIMITS, holds, static_postures
from manikin.errors import InputError

from .conftest import posture, still


@pytest.mark.parametrize(
    ("code", "category"),
    [("1121", 1), ("1123", 1), ("2121", 2), ("2141", 3), ("2151", 3), ("2163", 2), ("1343", 3), ("3151", 4),
     ("3323", 1), ("4111", 2), ("4171", 2), ("4343", 4), ("2353", 4), ("2371", 2), ("4123", 3)],
)  # fmt: skip
def test_categories_of_the_published_table(code, category):
    """Entries of the action category table (Karhu et al. 1977; the corners and rows that differ most)."""
    assert owas_category(*map(int, code)) == category


def test_table_never_gets_better_with_a_heavier_load_or_a_worse_back():
    assert TABLE.shape == (4, 3, 7, 3)
    assert np.all(np.diff(TABLE, axis=3) >= 0)
    assert np.all(TABLE[3] >= TABLE[1] - 1)  # bent and twisted against bent: at most the same but for legs 2
    assert np.all(TABLE[1] >= TABLE[0])
    with pytest.raises(InputError, match="legs score is 8"):
        owas_category(1, 1, 8, 1)
    assert [owas_load(kg) for kg in (0.0, 10.0, 10.1, 20.0, 20.1)] == [1, 1, 2, 2, 3]


def code_of(body, motion, load=0.0):
    found = assess_posture(body, motion)
    return owas_of(body, motion, found.angles, found.bearing, load).code(0)


BOTH = {"left": 1.0, "right": 1.0}


def sides(joint, angle):
    return {f"{side}_{joint}": angle for side in ("left", "right")}


@pytest.mark.parametrize(
    ("angles", "contacts", "load", "code"),
    [
        ({}, ("left_foot", "right_foot"), 0.0, "1121"),
        ({"lumbar_flexion": 30.0, "thorax_flexion": 30.0}, ("left_foot", "right_foot"), 15.0, "2122"),
        ({"lumbar_side_bend": 25.0, "thorax_side_bend": 20.0}, ("left_foot", "right_foot"), 25.0, "3123"),
        ({"lumbar_flexion": 40.0, "thorax_flexion": 20.0, "lumbar_side_bend": 25.0, "thorax_side_bend": 25.0},
         ("left_foot", "right_foot"), 0.0, "4121"),
        ({"left_shoulder_flexion": 120.0}, ("left_foot", "right_foot"), 0.0, "1221"),
        (sides("shoulder_flexion", 120.0), ("left_foot", "right_foot"), 0.0, "1321"),
        (sides("knee_flexion", 60.0), ("left_foot", "right_foot"), 0.0, "1141"),
        ({}, ("left_foot",), 0.0, "1131"),
        ({"left_knee_flexion": 60.0, "right_knee_flexion": 60.0}, ("left_foot",), 0.0, "1151"),
        (sides("knee_flexion", 90.0), ("left_foot", "right_foot", "buttocks"), 0.0, "1111"),
        (sides("knee_flexion", 90.0), ("left_knee", "right_knee"), 0.0, "1161"),
    ],
)  # fmt: skip
def test_codes_of_postures(body, angles, contacts, load, code):
    """Back, arms, legs and load of postures that leave no doubt."""
    motion = still(body, posture(body, **angles), duration=0.0, rate=1.0, contacts=contacts)
    assert code_of(body, motion, load) == code


def test_a_walk_is_a_seven(body):
    motion = still(body, posture(body))
    from dataclasses import replace

    com = np.array(motion.com)
    com[:, 0] = motion.time
    assert code_of(body, replace(motion, com=com)) == "1171"


def test_holding_times_are_those_of_the_standard():
    """Trunk 4 min at 20 degrees to 1 min at 60, head 8 min at 25 to 1 min at 85, upper arm 3 min to 1 min."""
    for part, angle, time in (
        ("trunk", 20.0, np.inf), ("trunk", 20.01, 240.0), ("trunk", 40.0, 150.0), ("trunk", 60.0, 60.0),
        ("trunk", 61.0, 0.0), ("trunk", -1.0, 0.0), ("head", 55.0, 270.0), ("head", 85.0, 60.0),
        ("upper_arm", 40.0, 120.0), ("upper_arm", 60.0, 60.0), ("upper_arm", 90.0, 0.0),
    ):  # fmt: skip
        assert LIMITS[part].time(np.array([angle]))[0] == pytest.approx(time, abs=0.1)


def judged(body, angles, duration):
    motion = still(body, posture(body, **angles), duration=duration, rate=5.0)
    found = assess_posture(body, motion, Circumstances())
    return static_postures(motion.time, found.angles)


@pytest.mark.parametrize(
    ("angles", "duration", "part", "level"),
    [
        ({}, 3.0, "trunk", 0), ({}, 10.0, "trunk", 1),
        (sides("shoulder_flexion", 40.0), 100.0, "left_arm", 1),
        (sides("shoulder_flexion", 40.0), 140.0, "left_arm", 2),
        (sides("shoulder_flexion", 80.0), 10.0, "right_arm", 3),
        ({"lumbar_side_bend": 20.0, "thorax_side_bend": 15.0}, 10.0, "trunk", 3),
        ({"neck_flexion": 40.0}, 10.0, "head", 1),
    ],
)  # fmt: skip
def test_verdicts_of_held_postures(body, angles, duration, part, level):
    """Moving, acceptable, held for too long, not recommended."""
    assert judged(body, angles, duration).parts[part].max() == level


def test_holds_end_where_the_angle_leaves_its_band():
    time = np.linspace(0.0, 30.0, 301)
    angle = np.where(time < 10.0, 0.0, np.where(time < 20.0, 30.0, 33.0))
    assert [(one.start, one.stop) for one in holds(time, angle)] == [(0, 100), (100, 301)]
