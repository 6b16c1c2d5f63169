"""Obstacles: their distances, and paths around them under the same cost."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.numerics.spatial import PlanarTransform
from manikin.walking import START, Walker, WalkObstacle, walking_path
from manikin.walking.path.path_program import _distance
from manikin.walking.path.walk_obstacles import clearance

AHEAD = (0.0, 3.0, np.pi / 2)
SQUARE = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
coordinates = st.floats(-4.0, 4.0)


def outline(obstacle, count=4000):
    """Points on the edges of the corners."""
    following = np.roll(obstacle.corners, -1, axis=0)
    share = np.linspace(0.0, 1.0, count)[:, None]
    return np.vstack([a + share * (b - a) for a, b in zip(obstacle.corners, following, strict=True)])


def measured_room(path):
    """Room of a path by brute force: centres of the walker's discs, outlines of points."""
    task, rooms = path.task, []
    for t, place in zip(path.time, path.place, strict=True):
        side = np.array([-np.sin(place[2]), np.cos(place[2])])
        for offset in task.walker.offsets:
            centre = place[:2] + offset * side
            for one in task.obstacles:
                points = outline(one, 400) + one.displacement(t)
                rooms.append(
                    np.linalg.norm(points - centre, axis=1).min() - one.radius - task.walker.depth / 2
                )
    return min(rooms)


@given(coordinates, coordinates)
def test_distance_to_a_polygon_is_that_to_its_outline_with_the_sign_of_the_inside(x, y):
    hexagon = WalkObstacle("h", [(2 * np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 7)[:-1]])
    found = hexagon.distance(np.array([[[x, y]]]), np.zeros(1))[0, 0]
    # The outline is sampled every 0.5 mm.
    assert abs(found) == pytest.approx(np.linalg.norm(outline(hexagon) - [x, y], axis=1).min(), abs=5e-4)
    if (x / 2) ** 2 + y**2 >= 1.0:
        assert found > -1e-12
    if (x / 2) ** 2 + y**2 < 0.74:  # the ellipse that touches the edges from inside is 0.75
        assert found < 0.0


@given(coordinates, coordinates, st.sampled_from([SQUARE, SQUARE[:3], SQUARE[:1]]))
def test_the_programmes_distance_is_the_measured_one(x, y, corners):
    obstacle = WalkObstacle("o", corners)
    symbolic = _distance(ca.SX(x), ca.SX(y), ca.SX(ca.DM(obstacle.corners)))
    measured = obstacle.distance(np.array([[[x, y]]]), np.zeros(1))[0, 0]
    assert float(ca.evalf(symbolic)) == pytest.approx(measured, abs=1e-5)


def test_corners_are_ordered_and_inner_ones_dropped():
    shuffled = WalkObstacle("o", [*SQUARE[::2], (0.0, 0.0), *SQUARE[1::2]])
    assert {tuple(corner) for corner in shuffled.corners} == set(SQUARE)
    assert shuffled.distance(np.zeros((1, 1, 2)), np.zeros(1))[0, 0] == pytest.approx(-1.0)


def test_a_moving_disc_is_where_its_track_says():
    disc = WalkObstacle.moving_disc("p", (1.0, 2.0, 4.0), [(0.0, 0.0), (1.0, 0.0), (1.0, 4.0)], 0.2)
    assert disc.displacement([0.0, 1.5, 3.0, 9.0]).tolist() == [[0, 0], [0.5, 0], [1, 2], [1, 4]]
    assert disc.moves
    assert not WalkObstacle.disc("d", (0.0, 0.0), 0.2).moves


def test_walker_is_three_discs_across():
    post = WalkObstacle.disc("post", (0.0, 1.0), 0.1)
    along, across = np.array([[0.0, 0.0, np.pi / 2]]), np.array([[0.0, 0.0, 0.0]])
    assert clearance([post], Walker(0.3, 0.5), along, np.zeros(1))[0, 0] == pytest.approx(0.75)
    # The left shoulder's disc is centred 0.1 m to the left, towards the post.
    assert clearance([post], Walker(0.3, 0.5), across, np.zeros(1))[0, 0] == pytest.approx(0.65)


@pytest.mark.parametrize(
    "obstacle",
    [
        WalkObstacle.disc("pillar aside", (0.1, 1.2), 0.4),
        WalkObstacle("box", [(-0.4, 1.0), (0.2, 1.0), (0.2, 1.6), (-0.4, 1.6)]),
        WalkObstacle.moving_disc("crossing", (0.0, 4.0), [(-1.5, 1.5), (1.5, 1.5)], 0.3),
        WalkObstacle.moving_disc("towards", (0.0, 4.0), [(0.05, 3.5), (0.05, -0.5)], 0.3),
    ],
    ids=lambda one: one.name,
)
def test_a_path_keeps_its_room_at_more_cost(obstacle):
    free, path = walking_path(START, AHEAD), walking_path(START, AHEAD, obstacles=[obstacle])
    assert path.succeeded
    assert path.residuals().within()
    assert free.cost < path.cost < 2.0 * free.cost
    # What binds is touched: the room is the one asked for, measured by brute force.
    assert measured_room(path) == pytest.approx(path.task.room, abs=2e-3)


def test_a_symmetric_detour_costs_the_same_on_both_sides():
    path = walking_path(START, AHEAD, obstacles=[WalkObstacle.disc("pillar", (0.0, 1.5), 0.3)])
    assert path.others["detour 0"] == pytest.approx(path.others["detour 1"], rel=1e-5)


def test_the_shorter_side_is_taken():
    for x in (0.2, -0.2):
        path = walking_path(START, AHEAD, obstacles=[WalkObstacle.disc("pillar", (x, 1.5), 0.3)])
        middle = path.x[len(path.time) // 2]
        assert np.sign(middle) == -np.sign(x)


def test_an_obstacle_out_of_the_way_changes_nothing():
    free = walking_path(START, AHEAD)
    path = walking_path(START, AHEAD, obstacles=[WalkObstacle.disc("far", (3.0, 1.5), 0.3)])
    assert np.array_equal(free.place, path.place)
    assert path.residuals().penetration < 0.0


def test_someone_who_has_passed_before_is_not_in_the_way():
    """The same track in time or too early: only where it is while the walker is there counts."""
    free = walking_path(START, AHEAD)
    early = WalkObstacle.moving_disc("early", (0.0, 1.0), [(0.0, 1.5), (3.0, 1.5)], 0.3)
    assert walking_path(START, AHEAD, obstacles=[early]).cost == pytest.approx(free.cost)


def test_a_closed_ring_is_told_from_an_open_one():
    ring = [
        WalkObstacle("front wall", [(-1.5, 1.5), (1.5, 1.5), (1.5, 1.6), (-1.5, 1.6)]),
        WalkObstacle("left wall", [(-1.5, -1.5), (-1.4, -1.5), (-1.4, 1.6), (-1.5, 1.6)]),
        WalkObstacle("right wall", [(1.5, -1.5), (1.4, -1.5), (1.4, 1.6), (1.5, 1.6)]),
        WalkObstacle("back wall", [(-1.5, -1.5), (1.5, -1.5), (1.5, -1.4), (-1.5, -1.4)]),
    ]
    path = walking_path(START, (0.3, 3.0, 0.0), obstacles=ring)
    assert not path.succeeded
    assert path.failure == "the obstacles leave no way to the goal"
    assert not path.residuals().within()
    # One wall less, and there is a way: out at the back.
    opened = walking_path(START, (0.3, -3.0, 0.0), obstacles=ring[:3])
    assert opened.succeeded
    assert opened.residuals().within()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: WalkObstacle.disc("d", (0, 0), 0.0),
            "obstacle 'd' radius [m] is 0; valid: a finite number > 0",
        ),
        (
            lambda: WalkObstacle("p", [(0, 0), (1, 1), (2, 2)]),
            "obstacle 'p' has 3 corners without area; valid: one, or a polygon",
        ),
        (
            lambda: WalkObstacle("p", [(0, 0), (1, 1)]),
            "obstacle 'p' has 2 corners without area; valid: one, or a polygon",
        ),
        (
            lambda: WalkObstacle.moving_disc("m", (1.0, 0.5), [(0, 0), (1, 1)], 0.2),
            "obstacle 'm' times are [1.0, 0.5]; valid: at least one, increasing",
        ),
        (lambda: Walker(0.5, 0.3), "walker width [m] is 0.3; valid: a finite number >= 0.5"),
        (
            lambda: walking_path(START, AHEAD, obstacles=[WalkObstacle.disc("d", (0, 0.2), 0.1)]),
            "walking start leaves -0.05 m to obstacle 'd'; valid: at least 0.05 m",
        ),
        (
            lambda: walking_path(START, AHEAD, obstacles=[WalkObstacle.disc("d", (0, 3), 0.1)]),
            "walking goal leaves -0.25 m to obstacle 'd'; valid: at least 0.05 m",
        ),
    ],
)
def test_bad_obstacles_are_refused_in_one_line(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value) == message


@pytest.mark.long
def test_a_path_around_obstacles_does_not_depend_on_where_the_scene_stands():
    """Ways are sought on a grid: with other axes they, and the local optimum they lead to, would differ."""
    transform = PlanarTransform(10.0, -7.0, 37.0)
    wall = WalkObstacle("wall", [[1.5, 0.0], [1.6, 0.0], [1.6, 3.0], [1.5, 3.0]])
    talking = WalkObstacle.moving_disc("talking", (0.0, 3.0), [(2.5, 1.0), (2.5, 0.2)], 0.2)
    obstacles = [wall, talking]
    moved = [one.moved(transform, 12) for one in obstacles]
    ends = [
        np.append(transform.points(x[:2]), x[2] + transform.yaw) for x in (START, np.array([3.0, 0.5, 0.4]))
    ]
    here = walking_path(START, (3.0, 0.5, 0.4), obstacles=obstacles)
    there = walking_path(*ends, obstacles=moved)
    assert here.succeeded
    assert there.succeeded
    assert there.cost == pytest.approx(here.cost, rel=1e-9)
    assert there.duration == pytest.approx(here.duration, rel=1e-9)
    np.testing.assert_allclose(there.place[:, :2], transform.points(here.place[:, :2]), atol=1e-8)
    assert clearance(moved, Walker(), there.place, there.time).min() >= 0.05 - 1e-4
