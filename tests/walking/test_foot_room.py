"""Feet beside obstacles: what a sole sweeps, and steps that keep away from it."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.walking import WalkObstacle, step_along
from manikin.walking.foot_room import FOOT_ROOM, FootRoom
from manikin.walking.footprints import FEET
from manikin.walking.path.steady_walk import SteadyWalk

LENGTH, WIDTH = 0.28, 0.12
coordinates, angles = st.floats(-1.0, 1.0), st.floats(-np.pi, np.pi)


def sole_points(place):
    """Points of a sole at (3,) x, y [m], yaw [rad], on a grid."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 15) * LENGTH, np.linspace(-0.5, 0.5, 9) * WIDTH)
    cosine, sine = np.cos(place[2]), np.sin(place[2])
    return place[:2] + np.column_stack([
        (cosine * x - sine * y).ravel(), (sine * x + cosine * y).ravel()
    ])  # fmt: skip


def least_room(footprints, obstacle):
    """Least distance of any foot from an obstacle, standing or on its straight way, by brute force [m]."""
    rooms = []
    for foot in FEET:
        for before, after in itertools.pairwise(footprints.of(foot)):
            a, b = (np.array([*step.position[:2], step.yaw]) for step in (before, after))
            turn = np.angle(np.exp(1j * (b[2] - a[2])))
            for share in np.linspace(0.0, 1.0, 21):
                points = sole_points(a + share * np.array([*(b - a)[:2], turn]))
                rooms.append(obstacle.distance(points[:, None], np.zeros(len(points))).min())
    return min(rooms)


@settings(max_examples=40)
@given(coordinates, coordinates, angles)
def test_room_of_a_standing_foot_is_the_distance_of_its_outline(x, y, yaw):
    box = WalkObstacle("box", [(0.9, 0.1), (1.5, -0.2), (1.7, 0.4)], 0.05)
    place = np.array([x, y, yaw])
    points = sole_points(place)
    left = box.distance(points[:, None], np.zeros(len(points))).min()
    # The grid of points is 20 mm wide; the round edge of the obstacle is a polygon of 16 sides in a quarter.
    assert FootRoom([box], LENGTH, WIDTH).at(place) == pytest.approx(max(left, 0.0), abs=0.012)


def test_a_foot_meets_what_stands_between_two_places_of_it():
    post = WalkObstacle.disc("post", (0.5, 0.0), 0.05)
    room, start = FootRoom([post], LENGTH, WIDTH), np.zeros(3)
    over, beside = np.array([1.0, 0.0, 0.0]), np.array([1.0, 0.4, 0.0])
    assert room.at(start) > FOOT_ROOM
    assert room.at(over) > FOOT_ROOM
    assert room.beside(start, np.array([over, beside]))[0] == 0.0
    assert np.isinf(FootRoom([], LENGTH, WIDTH).at(start))


@pytest.mark.parametrize("turn", [0.9, -0.9])
def test_feet_keep_away_from_what_the_body_goes_round(turn):
    """Round a post, long steps would cut the corner with the inner foot; shorter ones do not."""
    path = SteadyWalk(np.array([0.9, 0.0, turn]), hold=1.5, ramp=0.8)
    middle = path.place_at(0.5 * path.duration)
    side = np.sign(turn) * np.array([-np.sin(middle[2]), np.cos(middle[2])])
    post = WalkObstacle.disc("post", middle[:2] + 0.40 * side, 0.2)
    free, kept = step_along(path).footprints, step_along(path, obstacles=[post]).footprints
    assert least_room(free, post) < FOOT_ROOM - 0.005
    assert least_room(kept, post) >= FOOT_ROOM - 1e-3
    for foot in FEET:
        np.testing.assert_allclose(kept.last()[foot].position, free.last()[foot].position, atol=1e-6)


def test_steps_with_room_are_as_without_obstacles():
    path = SteadyWalk(np.array([0.9, 0.0, 0.3]), hold=1.0, ramp=0.8)
    far = WalkObstacle.disc("far", (0.5, 3.0), 0.5)
    plain, beside = step_along(path).footprints, step_along(path, obstacles=[far]).footprints
    for a, b in zip(plain.steps, beside.steps, strict=True):
        np.testing.assert_array_equal(a.position, b.position)
        assert (a.yaw, a.lands, a.leaves) == (b.yaw, b.lands, b.leaves)


def test_feet_that_have_to_stand_near_something_make_no_more_steps():
    """The goal is beside a wall: steps to it have no more room than the feet there."""
    path = SteadyWalk(np.array([0.9, 0.0, 0.0]), hold=1.0, ramp=0.8)
    x, y = path.place_at(path.duration)[:2]
    wall = WalkObstacle(
        "wall", [(x + 0.16, y - 1.0), (x + 0.3, y - 1.0), (x + 0.3, y + 1.0), (x + 0.16, y + 1.0)]
    )
    assert step_along(path, obstacles=[wall]).footprints.count == step_along(path).footprints.count
