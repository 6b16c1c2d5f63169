"""Holonomic, nonholonomic, holonomic: which weights make walks begin and end as those of people do."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking import (
    LITERAL_ORDER,
    PROSE_ORDER,
    RECORDED_TURNS,
    RECORDED_WALKS,
    START,
    ShoulderPaths,
    category_goals,
    category_of,
    segment_path,
    walking_path,
)
from manikin.walking.path.walking_model import goal_direction

PAGE = Path(__file__).resolve().parents[2] / "docs" / "inverse.md"
PRESETS = (PROSE_ORDER, LITERAL_ORDER, RECORDED_WALKS, RECORDED_TURNS)


@cache
def walked(objective, distance):
    """Walks to the goals of the nine categories."""
    return [walking_path(START, goal, objective) for _, goal in category_goals(distance)]


def pattern(path):
    return segment_path(ShoulderPaths.of_walk(path)).pattern


def share(objective, distance):
    return np.mean([pattern(path) == "H-N-H" for path in walked(objective, distance)])


def test_goals_of_the_categories_are_theirs():
    goals = category_goals(2.0)
    assert len(goals) == 21
    assert all(category_of(goal) == name for name, goal in goals)
    assert [np.hypot(*goal[:2]) for _, goal in goals] == pytest.approx([2.0] * 21)
    with pytest.raises(
        InputError, match=r"distance of the goals \[m\] is 0.1; valid: a finite number >= 0.5"
    ):
        category_goals(0.1)


def test_recorded_weights_are_those_of_the_identification():
    """To two digits, as the page of the identification has them."""
    text = PAGE.read_text(encoding="utf-8")
    for name, preset in (("**identified**", RECORDED_WALKS), ("identified from turns", RECORDED_TURNS)):
        row = next(line for line in text.splitlines() if line.startswith(f"| {name} |"))
        found = [float(re.match(r"[\d.]+", cell.strip())[0]) for cell in row.split("|")[3:7]]
        assert preset.weights[1:].tolist() == found


def test_with_the_weights_of_turning_people_most_walks_begin_and_end_holonomically():
    """14 of 21 at 2 m; of the thesis' weights, none (``docs/patterns.md``)."""
    assert share(RECORDED_TURNS, 2.0) > 0.5
    assert share(PROSE_ORDER, 2.0) < 0.1


@pytest.mark.parametrize("objective", PRESETS)
def test_half_a_metre_aside_is_one_holonomic_step(objective):
    assert [pattern(walking_path(START, (x, 0.0, START[2]), objective)) for x in (-0.5, 0.5)] == ["H", "H"]


def test_mirrored_goals_have_mirrored_walks():
    """From two goals; on the axis of symmetry either of two walks may be found."""
    for _, goal in category_goals(2.0)[:6:3]:
        mirrored = (-goal[0], goal[1], np.pi - goal[2])
        there, back = (walking_path(START, one, RECORDED_TURNS) for one in (goal, mirrored))
        assert back.cost == pytest.approx(there.cost, rel=1e-6)
        assert pattern(back) == pattern(there)


@pytest.mark.parametrize("objective", [PROSE_ORDER, RECORDED_TURNS])
def test_near_the_goal_its_direction_is_that_of_the_motion(objective):
    """Into rest, the way left and the velocity are along the last acceleration, to first order."""
    for path in walked(objective, 2.0):
        left = np.array([0.01, 0.001]) * path.duration
        place, (velocity, _) = path.place_at(path.duration - left), path.motion_at(path.duration - left)
        motion = np.arctan2(velocity[:, 1], velocity[:, 0])
        apart = np.angle(np.exp(1j * (motion - goal_direction(place, path.task.goal))))
        assert np.all(np.abs(apart) < [0.03, 0.003])
