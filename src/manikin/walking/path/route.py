"""A route: walking paths one after the other, past waypoints, with turns on the spot and waits."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.numerics.spline import BSpline
from manikin.walking.path.path_plan import NEAREST, walking_path
from manikin.walking.path.walk_obstacles import Walker, WalkObstacle, clearance
from manikin.walking.path.walking_model import PROSE_ORDER, WalkObjective, to_body
from manikin.walking.path.walking_path import SAMPLING, SampledWalk, WalkingPath, WalkingTask
from manikin.walking.segmentation import PathSegments, ShoulderPaths, segment_path

SMALLEST = 1e-6
"""Least turn that counts as one [rad]."""


def spot_turn(task: WalkingTask) -> WalkingPath:
    """Turn from rest to rest, the shorter way round; obstacles are not considered.

    Without a way to go the criterion ([Truong2010]_ 5.6) is ``a0 T + a3 int u_angular^2``. The cheapest turn
    by ``D`` in the time ``T`` is the cubic ``D (3 s^2 - 2 s^3)``, for ``12 D^2 / T^3``, so that ``T^4 = 36 a3
    D^2 / a0``.
    """
    turn = float(np.angle(np.exp(1j * (task.goal[2] - task.start[2]))))
    weights = task.objective
    duration = (36.0 * weights.angular * max(abs(turn), SMALLEST) ** 2 / weights.time) ** 0.25
    cost = weights.time * duration + weights.angular * 12.0 * turn**2 / duration**3
    points = np.tile(task.start, (4, 1))
    points[2:, 2] += turn
    cubic = BSpline(3, np.repeat([0.0, 1.0], 4), points)
    return WalkingPath(task, cubic, duration, cost, "turn on the spot", 0)


OVERLOOKED = 1e-3
"""Lack of room that counts as none where the walker stands or turns on the spot [m]."""


@dataclass(frozen=True, eq=False)
class Waypoint:
    """A place that a route passes or stops at.

    Attributes:
        place: (3,) x, y [m], heading [rad].
        speed: Speed of passing it, towards the place after it [m/s]; 0 for a stop.
        wait: Time of standing there [s]; only after a stop.
    """

    place: FloatArray
    speed: float = 0.0
    wait: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "place", frozen_array(self.place, "waypoint [m, m, rad]", (3,)))
        finite_number(self.speed, "waypoint speed [m/s]", at_least=0.0)
        finite_number(self.wait, "waypoint wait [s]", at_least=0.0)
        if self.speed > 0.0 and self.wait > 0.0:
            both = f"is passed with {self.speed:g} m/s and has a wait of {self.wait:g} s"
            raise InputError(f"waypoint {both}; valid: one of them")


@dataclass(frozen=True, eq=False)
class WalkRoute(SampledWalk):
    """Walking paths joined at waypoints, continuous in place and velocity.

    Attributes:
        legs: In order; each starts where and as fast as the one before ends.
        waits: (legs + 1,) times of standing before each leg and after the last [s].
        blocked: Which obstacle comes too near where the walker stands or turns on the spot, or None.
    """

    legs: tuple[WalkingPath, ...]
    waits: tuple[float, ...]
    blocked: str | None = None

    @property
    def failure(self) -> str | None:
        """Why a leg is no solution of its task, or there is no room to stand; None for a success."""
        broken = [(i, leg.failure) for i, leg in enumerate(self.legs) if leg.failure is not None]
        return f"leg {broken[0][0] + 1} of the way: {broken[0][1]}" if broken else self.blocked

    @cached_property
    def begins(self) -> tuple[float, ...]:
        """Instants at which the legs begin [s]."""
        times = [self.waits[0]]
        for leg, wait in zip(self.legs[:-1], self.waits[1:], strict=False):
            times.append(times[-1] + leg.duration + wait)
        return tuple(times)

    @property
    def stretches(self) -> tuple[tuple[float, float], ...]:
        """Instants at which it begins to move from rest, and at which it rests again [s]."""
        rests = [not np.any(leg.task.goal_velocity) for leg in self.legs]
        ends = [begin + leg.duration for begin, leg in zip(self.begins, self.legs, strict=True)]
        starts = itertools.compress(self.begins, [True, *rests[:-1]])
        return tuple(zip(starts, itertools.compress(ends, rests), strict=True))

    @cached_property
    def duration(self) -> float:
        """Duration with all waits [s]."""
        return self.begins[-1] + self.legs[-1].duration + self.waits[-1]

    @cached_property
    def cost(self) -> float:
        """Cost of all legs and of the time of all waits [-]."""
        weights = self.legs[0].task.objective
        return float(sum(leg.cost for leg in self.legs) + weights.time * sum(self.waits))

    @cached_property
    def length(self) -> float:
        """Length of the way over the floor [m]."""
        return float(sum(leg.length for leg in self.legs))

    def place_at(self, time: ArrayLike) -> FloatArray:
        """(..., 3) x, y [m] and heading [rad] at (...) instants; before and after, those of the ends."""
        times = np.asarray(time, dtype=np.float64)
        result = np.broadcast_to(self.legs[0].place_at(0.0), (*times.shape, 3)).copy()
        for begin, leg, turns in zip(self.begins, self.legs, self._whole_turns, strict=True):
            now = times >= begin
            result[now] = leg.place_at(np.clip(times[now] - begin, 0.0, leg.duration))
            result[now, 2] += turns
        return result

    def motion_at(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """(..., 3) velocities and (..., 3) accelerations of the body at (...) instants; 0 while it stands."""
        times = np.asarray(time, dtype=np.float64)
        velocity, acceleration = np.zeros((*times.shape, 3)), np.zeros((*times.shape, 3))
        for begin, leg in zip(self.begins, self.legs, strict=True):
            now = (times >= begin) & (times <= begin + leg.duration)
            velocity[now], acceleration[now] = leg.motion_at(np.minimum(times[now] - begin, leg.duration))
        return velocity, acceleration

    def segments(self) -> PathSegments:
        """Holonomic, nonholonomic and standing stretches ([Truong2010]_ Function 1)."""
        return segment_path(ShoulderPaths.of_walk(self))

    def as_obstacle(self, name: str, radius: float) -> WalkObstacle:
        """A disc of a radius [m] that goes along this route, for others to keep away from."""
        times = np.linspace(0.0, self.duration, int(np.ceil(self.duration / 0.1)) + 1)
        return WalkObstacle.moving_disc(name, times, self.place_at(times)[:, :2], radius)

    @cached_property
    def _whole_turns(self) -> tuple[float, ...]:
        """Whole turns added to the headings of each leg to make them continuous [rad]."""
        turns = [0.0]
        for before, after in itertools.pairwise(self.legs):
            gap = before.heading[-1] - after.heading[0]
            turns.append(turns[-1] + 2.0 * np.pi * float(np.round(gap / (2.0 * np.pi))))
        return tuple(turns)


def walking_route(
    start: ArrayLike, waypoints: Sequence[Waypoint], objective: WalkObjective = PROSE_ORDER, *,
    obstacles: Sequence[WalkObstacle] = (), walker: Walker | None = None, room: float = 0.05,
    max_speed: float | None = None, wait: float = 0.0,
) -> WalkRoute:  # fmt: skip
    """Walk past waypoints: a path from each to the next, or a turn on the spot where only headings differ.

    The thesis predefines such routes (6.7.1); here legs are found one after the other by the criterion.

    Args:
        start: (3,) x, y [m], heading [rad]; at rest.
        waypoints: Places to pass or stop at; the last one is a stop.
        objective: Cost to be minimised.
        obstacles: Obstacles to keep away from; those that move do so on the clock of the route.
        walker: Extent of the body, used with obstacles only.
        room: Distance to keep from obstacles [m].
        max_speed: Limit of the speed over the floor [m/s].
        wait: Time of standing at the start [s].

    Returns:
        The route, up to the first leg that has no solution. It is ``blocked`` where moving obstacles come
        too near while the walker stands or turns on the spot.

    Raises:
        InputError: If an argument is not usable, the last waypoint is no stop, one is in an obstacle, or one
            is passed that is in the same place as its neighbour.
    """
    if not waypoints:
        raise InputError("route has no waypoint; valid: at least one")
    if waypoints[-1].speed > 0.0:
        raise InputError(f"last waypoint is passed with {waypoints[-1].speed:g} m/s; valid: a stop, speed 0")
    limit = np.inf if max_speed is None else finite_number(max_speed, "max_speed [m/s]", at_least=0.1)
    finite_number(room, "walking room [m]", at_least=0.0)
    walker = walker or Walker()
    place, velocity = frozen_array(start, "walking start [m, m, rad]", (3,)), np.zeros(3)
    clock = finite_number(wait, "walking wait [s]", at_least=0.0)
    legs: list[WalkingPath] = []
    for number, waypoint in enumerate(waypoints):
        where = "walking goal" if number == len(waypoints) - 1 else f"waypoint {number + 1}"
        if waypoint.speed > limit:
            raise InputError(f"{where} is passed with {waypoint.speed:g} m/s; valid: at most {limit:g} m/s")
        after = waypoints[number + 1].place if waypoint.speed > 0.0 else waypoint.place
        goal_velocity = _passing(waypoint, after, where)
        still = [_later(item, clock) for item in obstacles]
        lack = room - float(clearance(still, walker, place[None], np.zeros(1)).min(initial=np.inf))
        if legs and lack > OVERLOOKED:
            break
        if not legs and clock > 0.0 and lack > OVERLOOKED:
            # An obstacle came during the wait: the first leg is found without it, and the route is blocked.
            still = [item for item in still if not item.moves]
        apart = float(np.hypot(*(waypoint.place - place)[:2]))
        turn = abs(float(np.angle(np.exp(1j * (waypoint.place[2] - place[2])))))
        if apart >= NEAREST:
            try:
                leg = walking_path(
                    place, waypoint.place, objective, obstacles=still, walker=walker,
                    room=room - max(lack, 0.0) if legs else room,
                    max_speed=max_speed, start_velocity=velocity, goal_velocity=goal_velocity,
                )  # fmt: skip
            except InputError as error:
                raise InputError(str(error).replace("walking goal", where)) from None
        elif np.any(velocity != 0.0) or turn < SMALLEST:
            raise InputError(f"{where} is where the walker already is; valid: {NEAREST:g} m away, or a turn")
        else:
            goal = np.append(place[:2], waypoint.place[2])
            given = tuple(still), walker, room, max_speed, velocity, goal_velocity
            leg = spot_turn(WalkingTask(place, goal, objective, *given))
        legs.append(leg)
        if not leg.succeeded:
            break
        clock += leg.duration + waypoint.wait
        place, velocity = leg.task.goal, goal_velocity
    waits = (wait, *(item.wait for item in waypoints[: len(legs)]))
    route = WalkRoute(tuple(legs), waits)
    return replace(route, blocked=_blocked(route, obstacles, walker, room)) if route.succeeded else route


def _blocked(route: WalkRoute, obstacles: Sequence[WalkObstacle], walker: Walker, room: float) -> str | None:
    """Which obstacle first comes too near on the whole route and, as long as anything moves, after it."""
    end = max([route.duration, *(float(item.times[-1]) for item in obstacles if item.moves)])
    time = np.linspace(0.0, end, int(np.ceil(end / SAMPLING)) + 1)
    left = clearance(obstacles, walker, route.place_at(time), time)
    near = np.any(left < room - OVERLOOKED, axis=1)
    if not near.any():
        return None
    first = int(np.argmax(near))
    nearest = int(left[first].argmin())
    return (
        f"obstacle {obstacles[nearest].name!r} comes within {left[first, nearest]:.3g} m "
        f"at {time[first]:.2f} s, where {room:g} m are kept"
    )


def _passing(waypoint: Waypoint, after: FloatArray, where: str) -> FloatArray:
    """(3,) velocity of the body at a waypoint, towards the place after it."""
    if waypoint.speed == 0.0:
        return np.zeros(3)
    way = (after - waypoint.place)[:2]
    distance = float(np.hypot(*way))
    if distance < NEAREST:
        raise InputError(f"{where} is passed to a place {distance:g} m away; valid: at least {NEAREST:g} m")
    return to_body(waypoint.place[2], np.append(waypoint.speed * way / distance, 0.0))


def _later(obstacle: WalkObstacle, clock: float) -> WalkObstacle:
    """An obstacle as it moves after an instant."""
    if not obstacle.moves:
        return obstacle
    track = {"times": obstacle.times - clock, "displacements": obstacle.displacements}
    return WalkObstacle(obstacle.name, obstacle.corners, obstacle.radius, **track)
