"""Routes: continuous at waypoints, on one clock with what moves, and clear of it where they stand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.walking import (
    LITERAL_ORDER,
    PROSE_ORDER,
    START,
    Walker,
    WalkObstacle,
    WalkRoute,
    Waypoint,
    walk_along,
    walking_path,
    walking_route,
)
from manikin.walking.path.walk_obstacles import clearance

REST = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def passing():
    """Past one place, with a stop and a wait at the next, on to a third."""
    stops = [
        Waypoint((1.5, 0.0, 0.0), speed=0.7), Waypoint((2.5, 1.5, np.pi / 2), wait=0.8),
        Waypoint((2.5, 4.0, np.pi / 2)),
    ]  # fmt: skip
    return walking_route(REST, stops, max_speed=1.6, wait=0.5)


def world_velocity(route, time):
    """(..., 2) velocity over the floor [m/s], from that of the body."""
    heading, (velocity, _) = route.place_at(time)[..., 2], route.motion_at(time)
    c, s = np.cos(heading), np.sin(heading)
    return np.stack(
        [c * velocity[..., 0] - s * velocity[..., 1], s * velocity[..., 0] + c * velocity[..., 1]], -1
    )


def test_place_and_velocity_go_on_through_the_waypoints(passing):
    assert passing.succeeded
    assert len(passing.legs) == 3
    for begin in passing.begins:
        near = np.array([begin - 1e-6, begin + 1e-6])
        before, after = passing.place_at(near)
        assert np.abs(after - before).max() < 1e-5
        before, after = world_velocity(passing, near)
        assert np.abs(after - before).max() < 1e-3
    dense = np.linspace(0.0, passing.duration, 20001)
    places, step = passing.place_at(dense), dense[1]
    # Central differences of the places are the velocities: errors of second order, but where a walk sets
    # off and its acceleration jumps.
    rates = (places[2:, :2] - places[:-2, :2]) / (2 * step)
    assert np.abs(rates - world_velocity(passing, dense[1:-1])).max() < 5e-3
    # The sum of the legs' durations is rounded.
    ends = passing.place_at([0.0, passing.duration])
    np.testing.assert_allclose(passing.place_at([-1.0, 1e3]), ends, rtol=0, atol=1e-12)


def test_waypoints_are_passed_as_asked(passing):
    at = passing.begins[1]
    assert np.allclose(passing.place_at(at), [1.5, 0.0, 0.0], atol=1e-4)
    # Its speed is towards the place after it.
    way = np.array([1.0, 1.5]) / np.hypot(1.0, 1.5)
    assert np.allclose(world_velocity(passing, np.array(at)), 0.7 * way, atol=1e-3)
    assert np.hypot(*passing.velocity[:, :2].T).max() <= 1.6 + 1e-4


def test_it_stands_while_it_waits(passing):
    assert passing.begins[0] == 0.5
    assert passing.duration == pytest.approx(sum(leg.duration for leg in passing.legs) + 0.5 + 0.8)
    stops = passing.begins[2] - 0.8
    for first, last, place in ((0.0, 0.5, REST), (stops, stops + 0.8, (2.5, 1.5, np.pi / 2))):
        times = np.linspace(first + 1e-9, last - 1e-9, 50)
        assert np.abs(passing.place_at(times) - place).max() < 1e-4
        assert np.abs(passing.motion_at(times)[0]).max() < 1e-4


def test_time_of_waits_is_paid_for_like_that_of_walks(passing):
    legs = sum(leg.cost for leg in passing.legs)
    assert passing.cost == pytest.approx(legs + 1.3 * PROSE_ORDER.time)
    assert passing.length == pytest.approx(sum(leg.length for leg in passing.legs))


def test_a_route_of_one_leg_is_the_path():
    goal = (2.0, 1.0, np.pi / 2)
    route, path = walking_route(REST, [Waypoint(goal)]), walking_path(REST, goal)
    assert route.cost == pytest.approx(path.cost)
    assert np.allclose(route.place, path.place, atol=1e-9)
    assert np.allclose(route.velocity, path.velocity, atol=1e-9)
    assert len(walk_along(route).time) == len(walk_along(path).time)


@settings(max_examples=5)
@given(st.floats(-np.pi, np.pi), st.floats(0.05, np.pi), st.sampled_from([-1, 1]))
def test_a_turn_on_the_spot_is_the_optimum_of_the_criterion(heading, angle, side):
    """``a0 T + a3 int u^2`` is least for the cubic that takes ``T^4 = 36 a3 D^2 / a0``."""
    turn = side * angle
    start = np.array([0.3, -0.2, heading])
    for weights in (PROSE_ORDER, LITERAL_ORDER):
        route = walking_route(start, [Waypoint((0.3, -0.2, heading + turn))], weights)
        leg = route.legs[0]
        assert leg.duration**4 == pytest.approx(36 * weights.angular * angle**2 / weights.time)
        cost = weights.time * leg.duration + 12 * weights.angular * angle**2 / leg.duration**3
        assert route.cost == pytest.approx(cost)
        assert leg.residuals().within(1e-6)
        assert leg.residuals().cost < 1e-6
        assert abs(route.heading[-1] - route.heading[0]) == pytest.approx(angle, abs=1e-9)
        assert np.abs(route.place[:, :2] - start[:2]).max() < 1e-12
        # Any other duration of the same shape costs more.
        for factor in (0.9, 1.1):
            other = weights.time * factor * leg.duration
            assert other + 12 * weights.angular * angle**2 / (factor * leg.duration) ** 3 > cost


def test_headings_are_continuous_over_whole_turns():
    """Round a square and a half to the left: 540 degrees in all, though every goal is within half a turn."""
    corners = [(2, 0), (2, 2), (0, 2), (0, 0), (2, 0), (2, 2)]
    headings = [90, 180, -90, 0, 90, 180]
    stops = [Waypoint((*at, np.radians(turned))) for at, turned in zip(corners, headings, strict=True)]
    route = walking_route(REST, stops)
    assert route.succeeded
    assert np.abs(np.diff(route.heading)).max() < 0.1
    assert route.heading[-1] == pytest.approx(3 * np.pi, abs=1e-3)
    assert np.exp(1j * route.heading[-1]) == pytest.approx(-1.0, abs=1e-3)


def test_what_moves_does_so_on_the_clock_of_the_route():
    """Somebody crosses the second leg just when the walker would: the way without them would meet them."""
    stops = [Waypoint((2.0, 0.0, 0.0), wait=1.0), Waypoint((6.0, 0.0, 0.0))]
    alone = walking_route(REST, stops, max_speed=1.6)
    meeting = alone.begins[1] + 0.5 * alone.legs[1].duration
    middle = alone.place_at(meeting)[:2]
    crossing = WalkObstacle.moving_disc(
        "other", [meeting - 3.0, meeting + 3.0], middle + np.array([[0.0, -3.0], [0.0, 3.0]]), 0.25
    )
    dense = np.arange(0.0, alone.duration, 1e-3)
    assert clearance([crossing], Walker(), alone.place_at(dense), dense).min() < -0.1
    route = walking_route(REST, stops, obstacles=[crossing], max_speed=1.6, room=0.1)
    assert route.succeeded
    # Legs before the meeting are left alone; the certificate is that of the whole clock.
    assert route.legs[0].duration == pytest.approx(alone.legs[0].duration, rel=1e-6)
    dense = np.arange(0.0, route.duration, 1e-3)
    assert clearance([crossing], Walker(), route.place_at(dense), dense).min() >= 0.1 - 1e-3
    assert route.cost > alone.cost


def test_a_route_is_an_obstacle_for_others_where_it_is_when(passing):
    disc = passing.as_obstacle("first", 0.25)
    times = np.linspace(0.0, passing.duration + 2.0, 777)
    where = disc.corners[0] + disc.displacement(times)
    # Uniform motion in pieces of 0.1 s: off by an eighth of the acceleration, 2 m/s^2 at most, times that
    # squared.
    assert np.abs(where - passing.place_at(times)[:, :2]).max() < 3e-3
    assert disc.radius == 0.25


@pytest.mark.parametrize("duration", [0.3, 0.6, 0.7])
def test_routes_of_any_duration_are_obstacles(duration):
    """Also of tenths of a second, of which sums are not exact."""
    route = walking_route(REST, [Waypoint((0.5, 0.0, 0.0))])
    waits = (0.0, np.ceil(route.duration) + duration - route.duration)
    assert len(WalkRoute(route.legs, waits).as_obstacle("o", 0.2).times) > 2


@pytest.mark.parametrize(
    ("stops", "options", "when"),
    [
        ([Waypoint((2.0, 0.0, 0.0), wait=5.0), Waypoint((4.0, 0.0, 0.0))], {}, (3.0, 9.0)),
        ([Waypoint((2.0, 0.0, 0.0))], {}, (4.0, 9.0)),
        ([Waypoint((4.0, 0.0, 0.0))], {"wait": 6.0, "start": (2.0, 0.0, 0.0)}, (4.0, 6.0)),
    ],
    ids=["while it waits", "after it has come", "while it waits at the start"],
)
def test_who_walks_into_a_standing_walker_blocks_its_route(stops, options, when):
    rammed = WalkObstacle.moving_disc("rammer", [4.0, 8.0], [(2.0, 5.0), (2.0, -5.0)], 0.25)
    route = walking_route(options.pop("start", REST), stops, obstacles=[rammed], **options)
    assert not route.succeeded
    assert "'rammer' comes within" in route.failure
    moment = float(route.failure.split(" at ")[1].split(" s")[0])
    assert when[0] < moment < when[1]
    # The disc touches the room of 0.05 m about the walker for the first time.
    there = clearance([rammed], Walker(), route.place_at([moment]), np.array([moment]))
    assert there == pytest.approx(0.05, abs=0.03)


def test_a_turn_on_the_spot_needs_room_for_the_shoulders():
    walls = [
        WalkObstacle(name, [(-3, y - 0.05), (3, y - 0.05), (3, y + 0.05), (-3, y + 0.05)])
        for name, y in (("left", 0.27), ("right", -0.27))
    ]
    # Along the gap of 0.44 m there is no room for shoulders of 0.5 m, across it there is for the chest.
    across = (0.0, 0.0, 0.0)
    along = (0.0, 0.0, np.pi / 2)
    blocked = walking_route(along, [Waypoint(across)], obstacles=walls, room=0.02)
    assert not blocked.succeeded
    assert "comes within" in blocked.failure
    assert walking_route(along, [Waypoint((0.0, 0.0, np.pi / 2 + 0.1))], obstacles=walls, room=0.02).succeeded


def test_an_unreachable_waypoint_ends_the_route_with_a_reason():
    ring = [
        WalkObstacle(str(i), np.add(corners, [3.0, 0.0]))
        for i, corners in enumerate([
            [(-1, -1), (-0.9, -1), (-0.9, 1), (-1, 1)], [(0.9, -1), (1, -1), (1, 1), (0.9, 1)],
            [(-1, 0.9), (1, 0.9), (1, 1), (-1, 1)], [(-1, -1), (1, -1), (1, -0.9), (-1, -0.9)],
        ])
    ]  # fmt: skip
    stops = [Waypoint((1.0, 0.0, 0.0)), Waypoint((3.0, 0.0, 0.0)), Waypoint((6.0, 0.0, 0.0))]
    route = walking_route(REST, stops, obstacles=ring)
    assert len(route.legs) == 2
    assert not route.succeeded
    assert route.failure.startswith("leg 2 of the way: ")
    with pytest.raises(InputError, match="path to walk is none"):
        walk_along(route)


POST = WalkObstacle.disc("post", (1.0, 0.0), 0.3)


@pytest.mark.parametrize(
    ("stops", "options", "says"),
    [
        ([], {}, "no waypoint"),
        ([Waypoint(REST)], {}, "walking goal is where the walker already is"),
        ([Waypoint((2, 0, 0), speed=0.5)], {}, "last waypoint is passed with 0.5"),
        ([Waypoint((1, 0, 0), speed=2.0), Waypoint((2, 0, 0))], {"max_speed": 1.6}, "waypoint 1 .*most 1.6"),
        ([Waypoint((1, 0, 0), speed=0.5), Waypoint((1, 0, 1))], {}, "1 is passed to a place 0 m away"),
        ([Waypoint((1, 0, 0)), Waypoint((2, 0, 0))], {"obstacles": [POST]}, "waypoint 1 leaves .*'post'"),
        ([Waypoint((1.1, 0, 0))], {"obstacles": [POST]}, "walking goal leaves .*'post'"),
        ([Waypoint((500, 0, 0))], {}, "walking goal is 500 m from the start"),
        ([Waypoint((1, 0, 0))], {"max_speed": np.nan}, "max_speed"),
        ([Waypoint((0, 0, 1))], {"max_speed": -1.0}, "max_speed"),
        ([Waypoint((0, 0, 1))], {"room": np.nan}, "room"),
        ([Waypoint((1, 0, 0))], {"room": -0.1}, "room"),
        ([Waypoint((1, 0, 0))], {"wait": -1.0}, "wait"),
        ([Waypoint((1, 0, 0))], {"wait": np.inf}, "wait"),
    ],
)  # fmt: skip
def test_routes_in_vain_are_refused_in_one_line(stops, options, says):
    with pytest.raises(InputError, match=says) as refused:
        walking_route(REST, stops, **options)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "values",
    [((np.nan, 0, 0),), ((0, 0),), ((0, 0, 0), -1.0), ((0, 0, 0), np.nan), ((0, 0, 0), 0.0, -1.0),
     ((0, 0, 0), 0.5, 1.0)],
)  # fmt: skip
def test_waypoints_that_are_none_are_refused(values):
    with pytest.raises(InputError, match="waypoint"):
        Waypoint(*values)


def test_segments_of_a_turn_and_a_walk():
    route = walking_route(START, [Waypoint((0.0, 3.0, np.pi / 2))])
    kinds = [one.kind for one in route.segments().segments]
    assert kinds == ["standing", "nonholonomic", "standing"]
