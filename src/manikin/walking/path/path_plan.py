"""Finding walking paths: the criterion minimised from several guesses, around obstacles as well.

Guesses are straight, turned, or go around what is in the way. Ways between resting obstacles are searched on
a grid, to guess paths from or to tell that there is none.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, PlanarTransform, finite_number, frozen_array
from manikin.numerics.spline import BSpline
from manikin.walking.path.path_program import (
    DEGREE,
    Guess,
    bent,
    cheapest,
    free_optimum,
    lacking,
    sharpened,
    solve,
    structure_of,
)
from manikin.walking.path.path_table import EXPECTED, shipped_table
from manikin.walking.path.walk_obstacles import Walker, WalkObstacle, clearance
from manikin.walking.path.walking_model import PROSE_ORDER, WalkObjective
from manikin.walking.path.walking_path import WalkingPath, WalkingTask

GUESSES = ("straight", "turning", "other first turn", "other last turn")
"""Guesses without obstacles: the heading turns evenly; or to the goal, along, and to its end; or so with one
of the turns the other way round, where that turn is nearly half a turn."""

_HALF_TURN = np.radians(150.0)
"""Least turn for which the other way round is tried as well [rad]."""


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def kinds_of_guesses(start: FloatArray, goal: FloatArray) -> list[str]:
    """Those of :data:`GUESSES` that are worth trying between two places (3,) x, y [m], heading [rad]."""
    turns = zip(GUESSES[2:], _turns(start, goal), strict=True)
    return [*GUESSES[:2], *(kind for kind, turn in turns if abs(turn) >= _HALF_TURN)]


def guess_path(task: WalkingTask, kind: str, via: Sequence[FloatArray] = ()) -> FloatArray:
    """(n, 3) control points of a guess of one of :data:`GUESSES`, past places ``via`` (2,) in order [m].

    The last one's heading may differ from the goal's by whole turns.
    """
    knots, start, goal = structure_of(task).knots, task.start, task.goal
    shares = np.array([knots[i + 1 : i + DEGREE + 1].mean() for i in range(len(knots) - DEGREE - 1)])
    corners = np.vstack([start[:2], *via, goal[:2]])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = lengths[-1] * _smooth(shares)
    xy = np.column_stack([np.interp(at, lengths, corners[:, i]) for i in range(2)])
    if kind == "straight":
        heading = start[2] + _smooth(shares) * wrap(goal[2] - start[2])
    else:
        first, last = _turns(start, goal)
        first = _other_way(first) if kind == GUESSES[2] else first
        last = _other_way(last) if kind == GUESSES[3] else last
        heading = start[2] + first * _smooth(shares / 0.4) + last * _smooth((shares - 0.6) / 0.4)
    return np.column_stack([xy, heading])


def detours(
    obstacles: Sequence[WalkObstacle], times: Sequence[float], walker: Walker, start: FloatArray,
    goal: FloatArray,
) -> Iterator[list[FloatArray]]:  # fmt: skip
    """Ways around obstacles, each a list of places to pass in order [m].

    Of more than two obstacles, all are passed on the same side. ``times`` are the instants at which the
    walker is nearest to each [s].
    """
    along = (goal[:2] - start[:2]) / np.hypot(*(goal[:2] - start[:2]))
    left = np.array([-along[1], along[0]])
    pairs = zip(obstacles, times, strict=True)
    centres = [item.corners.mean(axis=0) + item.displacement(t) for item, t in pairs]
    order = np.argsort([centre @ along for centre in centres])
    count = len(obstacles)
    resting = [item for item in obstacles if not item.moves]
    both = (1.0, -1.0)
    for choice in itertools.product(both, repeat=count) if count <= 2 else [(s,) * count for s in both]:
        # A detour leaves 0.1 m beside an obstacle.
        via = [centres[i] + choice[i] * (obstacles[i].reach + walker.width / 2 + 0.1) * left for i in order]
        points, now = np.array(via)[:, None, :], np.zeros(count)
        if not any(np.any(item.distance(points, now) < walker.depth / 2) for item in resting):
            yield via


def _turns(start: FloatArray, goal: FloatArray) -> tuple[float, float]:
    """Turns from the start's heading to the goal's direction, and from there to the goal's heading [rad]."""
    ahead = np.arctan2(*(goal[:2] - start[:2])[::-1])
    return wrap(ahead - start[2]), wrap(goal[2] - ahead)


def _other_way(turn: float) -> float:
    return turn - 2.0 * np.pi if turn > 0.0 else turn + 2.0 * np.pi


def _smooth(share: FloatArray) -> FloatArray:
    """``3 s^2 - 2 s^3``, from 0 to 1 and at rest at both ends."""
    s = np.clip(share, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


class Grid:
    """The floor around start, goal and resting obstacles in square cells.

    Cells have sides of 5 cm, or a 160th of the longer side of the grid if that is more; ways are searched up
    to 1 m beyond everything.
    """

    def __init__(self, obstacles: Sequence[WalkObstacle], start: FloatArray, goal: FloatArray) -> None:
        """Lay out the cells from the resting ones of the obstacles and (3,) x, y [m], heading [rad]."""
        resting, ends = [item for item in obstacles if not item.moves], np.vstack([start[:2], goal[:2]])
        corners = [x.corners + x.displacements[0] + sign * x.radius for x in resting for sign in (-1, 1)]
        points = np.vstack([ends, *corners])
        self._low, high = points.min(axis=0) - 1.0, points.max(axis=0) + 1.0
        self._cell = max(0.05, float((high - self._low).max()) / 160)
        self._shape = tuple(np.ceil((high - self._low) / self._cell).astype(int) + 1)
        rows, columns = np.indices(self._shape)
        self._centres = self._low + self._cell * np.column_stack([rows.ravel(), columns.ravel()])
        rooms = [item.distance(self._centres[:, None], np.zeros(1))[:, 0] for item in resting]
        self._room = np.min(rooms, axis=0) if rooms else np.full(len(self._centres), np.inf)
        self._ends = [int(np.argmin(np.linalg.norm(self._centres - end, axis=1))) for end in ends]

    @property
    def tolerance(self) -> float:
        """A way with this much less room than a cell's centre shows may still exist beside it [m]."""
        return self._cell * np.sqrt(0.5)

    def way(self, room: float) -> FloatArray | None:
        """(k, 2) centres of the cells of the shortest way with this much room [m]; None if there is none.

        Start and goal, which are left out, may have less.
        """
        free = self._room >= room
        free[self._ends] = True
        index = np.arange(free.size).reshape(self._shape)
        edges = []
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            a = index[: self._shape[0] - dx, max(0, -dy) : self._shape[1] - max(0, dy)].ravel()
            b = a + dx * self._shape[1] + dy
            both = free[a] & free[b]
            edges.append(np.stack([a[both], b[both], np.full(int(both.sum()), np.hypot(dx, dy))]))
        first, second, length = np.concatenate(edges, axis=1)
        graph = coo_matrix((length, (first, second)), shape=(free.size, free.size)).tocsr()
        _, before = dijkstra(graph, directed=False, indices=self._ends[0], return_predecessors=True)
        cells = [self._ends[1]]
        while cells[-1] != self._ends[0]:
            if before[cells[-1]] < 0:
                return None
            cells.append(int(before[cells[-1]]))
        return self._centres[cells[-2:0:-1]]


GRID, GOAL_GRID = 6, 9
"""Decimals to which coordinates of obstacles [m], as exact as floor plans, and of goals are rounded."""

NEAREST, FARTHEST = 0.01, 100.0
"""Distances from start to goal that can be asked [m]; at none, the direction of the goal has no value."""


def walking_path(
    start: ArrayLike, goal: ArrayLike, objective: WalkObjective = PROSE_ORDER, *,
    obstacles: Sequence[WalkObstacle] = (), walker: Walker | None = None, room: float = 0.05,
    max_speed: float | None = None, start_velocity: ArrayLike = (0.0, 0.0, 0.0),
    goal_velocity: ArrayLike = (0.0, 0.0, 0.0), like: WalkingPath | None = None,
) -> WalkingPath:  # fmt: skip
    """The way a person walks from one place and heading to another ([Truong2010]_ 5.5-5.8).

    Every initial guess is optimised and the cheapest path is returned, whose heading may end whole turns from
    the goal's. Obstacles, which the thesis leaves open (5.6), are constraints under the same cost: if the
    path without them is in their way, ways between them from a grid and detours on both sides are optimised
    and the cheapest is returned. All are local optima; a cheaper one elsewhere cannot be excluded.

    Args:
        start: (3,) x, y [m], heading [rad], counter-clockwise from x.
        goal: (3,) x, y [m], heading [rad], 0.01 to 100 m from the start.
        objective: Cost to be minimised; :data:`LITERAL_ORDER` is the other reading of (5.8).
        obstacles: Obstacles to keep away from, at rest or moving.
        walker: Extent of the body, used with obstacles only.
        room: Distance to keep from obstacles [m].
        max_speed: Limit of the speed over the floor [m/s]. Without one, far goals are run to: the cost of
            the thesis grows with accelerations, not with speeds.
        start_velocity: (3,) forward, left [m/s], angular velocity [rad/s]; at rest, as in the thesis' data.
        goal_velocity: (3,) the same at the goal.
        like: A path to start from instead of the guesses, such as that of a neighbouring goal.

    Returns:
        The path, or the nearest attempt with its ``failure``.

    Raises:
        InputError: If an argument is not usable, or start or goal are in an obstacle.
    """
    task = WalkingTask(
        frozen_array(start, "walking start [m, m, rad]", (3,)),
        frozen_array(goal, "walking goal [m, m, rad]", (3,)),
        objective, tuple(obstacles), walker or Walker(),
        finite_number(room, "walking room [m]", at_least=0.0),
        None if max_speed is None else finite_number(max_speed, "max_speed [m/s]", at_least=0.1),
        frozen_array(start_velocity, "walking start_velocity [m/s, m/s, rad/s]", (3,)),
        frozen_array(goal_velocity, "walking goal_velocity [m/s, m/s, rad/s]", (3,)),
    )  # fmt: skip
    _check(task)
    free = _free(replace(task, obstacles=()), like)
    return sharpened(_around(task, free) if task.obstacles else free)


def _free(task: WalkingTask, like: WalkingPath | None) -> WalkingPath:
    """The cheapest path without obstacles; the speed limit only matters where the best path exceeds it."""
    unlimited = replace(task, max_speed=None)
    path = _from_table(unlimited) if like is None else None
    path = replace(path or _cheapest_free(unlimited, like), task=task)
    return path if path.succeeded and lacking(path).max() <= 0.0 else _cheapest_free(task, like)


def _cheapest_free(task: WalkingTask, like: WalkingPath | None) -> WalkingPath:
    """The cheapest path from all guesses, or from a path like it."""
    guesses = initial_guesses(task) if like is None else [Guess("like another", *bent(like, task))]
    return cheapest([solve(task, guess) for guess in guesses])


def _from_table(task: WalkingTask) -> WalkingPath | None:
    """The best path from the guesses of the table, or None if it has none or the path is not as expected."""
    table = shipped_table()
    if table is None or not table.covers(task):
        return None
    guesses, expected = table.guesses(task)
    found = [path for guess in guesses if (path := free_optimum(task, guess)) is not None]
    return cheapest(found) if found and min(path.cost for path in found) <= EXPECTED * expected else None


def _check(task: WalkingTask) -> None:
    distance = float(np.hypot(*(task.goal - task.start)[:2]))
    if not NEAREST <= distance <= FARTHEST:
        valid = f"{NEAREST:g} to {FARTHEST:g} m"
        raise InputError(f"walking goal is {distance:g} m from the start; valid: {valid}")
    resting = [item for item in task.obstacles if not item.moves]
    for name, place, obstacles in (("start", task.start, task.obstacles), ("goal", task.goal, resting)):
        distances = clearance(obstacles, task.walker, place[None], np.zeros(1))[0]
        for obstacle, left in zip(obstacles, distances, strict=True):
            if left < task.room:
                room = f"{left:.3g} m to obstacle {obstacle.name!r}"
                raise InputError(f"walking {name} leaves {room}; valid: at least {task.room:g} m")


def initial_guesses(task: WalkingTask) -> Iterator[Guess]:
    """Guesses of the path without obstacles, those of :data:`GUESSES` that are worth trying."""
    # Somewhat above that of a straight walk.
    distance = float(np.hypot(*(task.goal[:2] - task.start[:2])))
    duration = 1.3 * task.objective.straight_duration(max(distance, 0.3))
    for kind in kinds_of_guesses(task.start, task.goal):
        yield Guess(kind, guess_path(task, kind), duration)


def _around(task: WalkingTask, free: WalkingPath) -> WalkingPath:
    """The free path if it has room, else the best of the detours around what is in its way."""
    kept = replace(free, task=task)
    short = lacking(kept)
    if free.succeeded and np.all(short <= 0.0):
        return kept
    # Ways over a grid depend on its axes: with those of the start, a scene elsewhere has the same ones. The
    # places are rounded, so that they leave no trace of where the start is.
    x, y, heading = task.start.tolist()
    transform_start_to_world = PlanarTransform(x, y, math.degrees(heading))
    transform_world_to_start = transform_start_to_world.inverse
    goal = np.append(transform_world_to_start.points(task.goal[:2]), task.goal[2] - task.start[2])
    moved = tuple(item.moved(transform_world_to_start, GRID) for item in task.obstacles)
    from_start = replace(task, start=np.zeros(3), goal=goal.round(GOAL_GRID), obstacles=moved)
    blocking = [item for item, lack in zip(from_start.obstacles, short, strict=False) if lack > 0.0]
    best = _on_ways(from_start, _in_frame(kept, from_start, transform_world_to_start, GRID), blocking)
    return _in_frame(best, task, transform_start_to_world)


def _on_ways(task: WalkingTask, free: WalkingPath, blocking: Sequence[WalkObstacle]) -> WalkingPath:
    """The best of the ways between all obstacles and of the detours around those that are in the way."""
    grid = Grid(task.obstacles, task.start, task.goal)
    narrow = grid.way(task.walker.depth / 2 + task.room - grid.tolerance)
    if narrow is None:
        return replace(free, failure="the obstacles leave no way to the goal", others={})
    wide = grid.way(task.walker.width / 2 + task.room)
    ways = {"narrow way": narrow} | ({} if wide is None else {"wide way": wide})
    guesses = (*_way_guesses(task, free, ways), *_detour_guesses(task, free, blocking))
    return cheapest([solve(task, guess) for guess in guesses])


def _in_frame(
    path: WalkingPath, task: WalkingTask, transform: PlanarTransform, decimals: int | None = None
) -> WalkingPath:
    """A path in the frame of another task, whose places are moved by a transform."""
    points, duration = path.spline.control_points, path.duration
    moved = np.column_stack([transform.points(points[:, :2]), points[:, 2] + transform.yaw])
    if decimals is not None:
        moved, duration = moved.round(decimals), round(duration, decimals)
    spline = BSpline(path.spline.degree, path.spline.knots, moved)
    return replace(path, task=task, spline=spline, duration=duration)


def _way_guesses(task: WalkingTask, free: WalkingPath, ways: Mapping[str, FloatArray]) -> Iterator[Guess]:
    """Along ways over the grid; along the narrow one, where the shoulders may not fit, turned aside too."""
    for name, way in ways.items():
        points = guess_path(task, "turning", list(way))
        yield Guess(name, points, 1.2 * free.duration)
        if name == "narrow way":
            share = np.linspace(0.0, 1.0, len(points))
            for side, turn in (("left", -np.pi / 2), ("right", np.pi / 2)):
                turned = points.copy()
                turned[:, 2] += turn * _smooth(share / 0.3) * _smooth((1.0 - share) / 0.3)
                yield Guess(f"{name}, {side} shoulder first", turned, 1.2 * free.duration)


def _detour_guesses(
    task: WalkingTask, free: WalkingPath, blocking: Sequence[WalkObstacle]
) -> Iterator[Guess]:
    """Past what is in the way on either side; straight on, sooner or later where something moves."""
    if not blocking:
        return
    times = np.linspace(0.0, free.duration, 201)
    room = clearance(blocking, task.walker, free.place_at(times), times)
    nearest = [float(times[i]) for i in room.argmin(axis=0)]
    for number, via in enumerate(detours(blocking, nearest, task.walker, task.start, task.goal)):
        yield Guess(f"detour {number}", guess_path(task, "turning", via), 1.2 * free.duration)
    if any(item.moves for item in blocking):
        for name, factor in (("straight on", 1.0), ("sooner", 0.7), ("later", 1.6)):
            yield Guess(name, free.spline.control_points, factor * free.duration)
