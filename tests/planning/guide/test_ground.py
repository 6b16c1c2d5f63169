"""Ways over the ground for a column, and what is left of them."""

import numpy as np
import pytest

from manikin.planning.guide.ground import CELL, LOW_STEP, STEP, Ground, GroundField, low_way
from manikin.scene import Box, Obstacle, Scene

STEEPEST = np.radians(30.0)
ENDS = np.array([[0.0, 0.1, 0.0], [0.0, -0.1, 0.0], [3.0, 0.1, 0.0], [3.0, -0.1, 0.0]])
COLUMN, STRIDE, HIGHEST = (0.12, 0.5, 1.4), 0.4, (0.5, 0.8, 0.8)
FLOOR = Scene()


def box(name, low, high):
    low, high = np.array(low), np.array(high)
    return Obstacle(name, Box(tuple(high - low)), translation=0.5 * (low + high))


def field(scene):
    return GroundField(scene, Ground(scene, STEEPEST), ENDS, 0.0, COLUMN, STRIDE, HIGHEST)


def test_the_ground_has_the_heights_of_its_surfaces():
    """Both of the floor and of what is above it; a place beside has the floor alone."""
    ground = Ground(Scene([box("block", (1.0, -0.5, 0.25), (2.0, 0.5, 0.3))]), STEEPEST)
    rows, heights = ground.levels(np.array([[1.5, 0.0], [0.5, 0.0]]))
    assert sorted(heights[rows == 0].round(6)) == [0.0, 0.3]
    assert heights[rows == 1].tolist() == [0.0]
    assert ground.below(np.array([1.5, 0.0, 0.3])) == ("block",)
    assert ground.below(np.array([1.5, 0.0, 0.6])) == ()


def test_a_level_way_costs_its_length_in_steps():
    """A straight way along the cells, at the cost of a short step for three quarters of a stride."""
    far, near = field(FLOOR).costs(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), np.zeros(2))
    assert far - near == pytest.approx(2.0 * STEP / (0.75 * STRIDE), rel=0.02)


def test_a_turn_costs_and_a_wall_is_gone_round():
    place = np.array([[0.0, 0.0, 0.0]])
    straight, back = (field(FLOOR).costs(place, np.array([yaw]))[0] for yaw in (0.0, np.pi))
    assert back > straight
    wall = Scene([box("wall", (1.4, -1.0, 0.0), (1.6, 1.0, 2.0))])
    way = field(wall).way(place[0])
    assert np.abs(way[:, 1]).max() >= 1.0
    assert field(wall).costs(place, np.zeros(1))[0] > straight


def test_what_walls_the_goal_off_is_told():
    step = Scene([box("ledge", (1.5, -9.0, 0.0), (9.0, 9.0, 1.2))])
    ends = ENDS + np.array([[0.0], [0.0], [1.2], [1.2]]) * [0.0, 0.0, 1.0]
    high = GroundField(step, Ground(step, STEEPEST), ends, 0.0, COLUMN, STRIDE, HIGHEST)
    assert high.way(ENDS[0]) is None
    assert "a step of 1.20 m (ledge)" in high.walled_off(ENDS[0])


def test_who_crawls_goes_straight_and_is_told_where_walking_ends():
    """Places a hand apart from feet to feet; under the low roof the body cannot walk."""
    roof = Scene([box("roof", (1.0, -2.0, 0.7), (2.0, 2.0, 0.8))])
    places, walks = low_way(roof, Ground(roof, STEEPEST), ENDS, (0.2, 0.05, 0.45), COLUMN)
    np.testing.assert_allclose(places[[0, -1]], [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]], atol=1e-9)
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= LOW_STEP + 1e-9
    assert np.abs(places[:, 1]).max() <= CELL
    under = (places[:, 0] > 1.0) & (places[:, 0] < 2.0)
    assert not walks[under].any()
    assert walks[np.abs(places[:, 0] - 1.5) > 0.5 + COLUMN[0] + CELL].all()
