"""The holonomic zone of made-up walks, and of predicted ones."""

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking import START, ShoulderPaths, holonomic_zone, segment_path, walking_path

RATE = 100.0
FORWARD = np.pi / 2


def walked_to(goal, border):
    """Sidling in a straight line up to ``border`` from the start, then ahead along y at 1 m/s."""
    way = np.array(goal[:2], dtype=float)
    distance = np.hypot(*way)
    sidled = min(distance, border)
    aside = np.linspace(0.0, sidled, max(3, round(sidled * RATE)))[:, None] * way / distance
    ahead = np.arange(1, round((distance - sidled) * RATE) + 1)[:, None] / RATE * np.array([0.0, 1.0])
    place = np.vstack([aside, aside[-1] + ahead])
    side = np.array([-0.18, 0.0])
    return segment_path(ShoulderPaths(place + side, place - side, RATE), online=True)


def goals_around(radii, degrees, turn=0.0):
    return [(r * np.sin(a), r * np.cos(a), FORWARD + turn) for r in radii for a in np.radians(degrees)]


def test_radius_of_a_known_zone():
    goals = goals_around(np.arange(0.2, 1.25, 0.1), (-90, -60, -30, 30, 60, 90))
    zone = holonomic_zone(goals, [walked_to(goal, 0.75) for goal in goals])
    assert zone.radius == pytest.approx(0.7)
    assert zone.farthest == pytest.approx(0.7)
    assert np.array_equal(zone.whole, zone.distances < 0.75)
    assert zone.considered.all()


def test_the_nearest_goal_with_a_nonholonomic_part_bounds_the_zone():
    """To one side people sidle 0.8 m far, ahead only 0.4 m."""
    goals = goals_around(np.arange(0.2, 1.25, 0.1), (30, 90))
    zone = holonomic_zone(goals, [walked_to(goal, 0.85 if goal[1] < 0.01 else 0.45) for goal in goals])
    assert zone.radius == pytest.approx(0.4)
    assert zone.farthest == pytest.approx(0.8)
    assert zone.radius_towards(np.radians(80), np.radians(100)) == pytest.approx(0.8)
    assert zone.radius_towards(np.radians(20), np.radians(40)) == pytest.approx(0.4)
    assert zone.radius_towards(np.radians(40), np.radians(50)) == 0.0


def test_goals_ahead_behind_and_turned_do_not_count():
    goals = [*goals_around([0.5], (0, 10, 60, 120, 180)), *goals_around([0.5], (60,), turn=1.0)]
    walks = [walked_to(goal, 1.0) for goal in goals]
    assert holonomic_zone(goals, walks).considered.tolist() == [False, False, True, False, False, False]
    assert holonomic_zone(goals, walks, largest_turn=1.5).considered.tolist()[-1]


def test_predicted_walks_half_a_metre_aside_are_in_the_zone_and_far_ones_are_not():
    """The thesis: wholly holonomic 0.5 m to either side ([Truong2010]_ 4.6)."""
    goals = [(0.5, 0.0, FORWARD), (-0.5, 0.0, FORWARD), (2.0, 2.0, FORWARD)]
    walks = [segment_path(ShoulderPaths.of_walk(walking_path(START, goal))) for goal in goals]
    zone = holonomic_zone(goals, walks)
    assert zone.whole.tolist() == [True, True, False]
    assert zone.radius == pytest.approx(0.5)


def test_goals_and_walks_must_agree_in_number():
    with pytest.raises(InputError, match="2 goals of 1 walks"):
        holonomic_zone(goals_around([0.5], (30, 60)), [walked_to((0.5, 0.0), 1.0)])
