"""Nine categories, mirrored for the left, and what is counted by them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.walking import START, ShoulderPaths, category_of, category_statistics, experiment_targets
from manikin.walking.goal_categories import HEADINGS_DEG, CategorySpread, seen_from

RATE = 100.0
ZONES = {"F": 1.0, "S": 0.0, "B": -1.0}


def walk(*parts):
    """A walker who looks along +y all the way: parts of direction [deg] and length [m], at 1 m/s."""
    steps = [np.tile([np.cos(a), np.sin(a)], (round(length * RATE), 1)) for a, length in
             ((np.radians(degrees), length) for degrees, length in parts)]  # fmt: skip
    place = np.cumsum(np.vstack([np.zeros((1, 2)), *steps]), axis=0) / RATE
    side = np.array([-0.18, 0.0])
    return ShoulderPaths(place + side, place - side, RATE)


@pytest.mark.parametrize("name", HEADINGS_DEG)
def test_categories_of_the_thesis(name):
    """Headings of 4.4 for goals to the right, mirrored to the left, from any start."""
    y, heading = ZONES[name[2]], np.radians(HEADINGS_DEG[name])
    assert category_of((1.5, y, heading)) == name
    assert category_of((-1.5, y, np.pi - heading)) == name
    assert category_of((1.5, y, heading + 2 * np.pi)) == name
    angle = 1.1
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = [*(rotation @ [1.5, y] + [3.0, 4.0]), heading + angle]
    assert category_of(moved, (3.0, 4.0, START[2] + angle)) == name


def test_low_curvature_bends_the_way_least():
    """Of the goals ahead to the right, LC goes on in the direction of the way, HC turns back."""
    way = np.arctan2(1.0, 1.0)
    away = [
        abs(np.angle(np.exp(1j * (np.radians(HEADINGS_DEG[f"{kind}F"]) - way))))
        for kind in ("LC", "MC", "HC")
    ]
    assert away == sorted(away)


@pytest.mark.parametrize(
    "goal", [(1, 1, 0), (1, 1, np.pi), (1, 0, np.pi), (1, -1, np.pi / 2), (1, 1, np.radians(20))]
)
def test_other_headings_have_no_category(goal):
    assert category_of(goal) is None


def test_experiment_targets_are_of_every_category_on_both_sides():
    targets = experiment_targets()
    for side in (1.0, -1.0):
        assert {category_of(goal) for goal in targets if goal[0] * side > 0} == {*HEADINGS_DEG, None}


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-7, 7), st.floats(-7, 7))
def test_goals_seen_from_a_start(x, y, heading, turned):
    """What is seen leads back to the goal."""
    ahead, left, turn = seen_from([(x, y, heading)], (0.5, -0.2, turned))[0]
    forward, side = np.array([np.cos(turned), np.sin(turned)]), np.array([-np.sin(turned), np.cos(turned)])
    assert np.allclose([0.5, -0.2] + ahead * forward + left * side, [x, y])
    assert np.isclose(np.exp(1j * (turned + turn)), np.exp(1j * heading))
    assert -np.pi < turn <= np.pi


def test_spread():
    assert CategorySpread.of([1.0, 2.0, 6.0]) == CategorySpread(3.0, 2.0, 3.0)


def test_statistics_of_known_walks():
    """Lengths known to a frame at each corner, 1 cm; two parallel walks are 5 cm from their mean."""
    goal = (0.5, 2.0, np.pi / 2)
    one, other = walk((0, 0.3), (90, 2.0), (0, 0.2)), walk((0, 0.4), (90, 2.0), (0, 0.1))
    shifted = ShoulderPaths(one.left + np.array([0.0, 0.1]), one.right + np.array([0.0, 0.1]), RATE)
    found = category_statistics(
        [(goal, [one, shifted]), ((-1.0, 1.0, np.pi / 2), [other]), ((1.0, 0.0, np.pi / 2), [walk((0, 1.0))]),
         ((1.0, 1.0, np.pi), [one])]
    )  # fmt: skip
    assert list(found) == ["MCF", "MCS"]
    front, side = found["MCF"], found["MCS"]
    assert (front.goals, front.walks, front.patterned) == (2, 3, 1.0)
    assert front.from_origin.mean == pytest.approx(1.0 / 3.0, abs=0.03)
    assert front.from_origin.largest_deviation == pytest.approx(0.2 / 3.0, abs=0.03)
    assert front.to_goal.mean == pytest.approx(0.5 / 3.0, abs=0.03)
    assert front.holonomic == pytest.approx(0.2, abs=0.02)
    assert front.average_deviation == pytest.approx(0.05)
    assert front.largest_deviation == pytest.approx(0.05)
    assert (side.patterned, side.holonomic, side.average_deviation) == (0.0, 1.0, None)
    assert side.from_origin.mean == side.to_goal.mean == pytest.approx(1.0, abs=1e-6)


def test_a_goal_without_a_walk_is_refused():
    with pytest.raises(InputError, match="has no walk"):
        category_statistics([((1.0, 1.0, 0.0), [])])
