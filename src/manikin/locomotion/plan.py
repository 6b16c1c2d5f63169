"""Finding walking paths: the criterion minimised from several guesses, around obstacles as well."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.locomotion.guesses import detours, guess_duration, guess_path, kinds_of_guesses, turned_between
from manikin.locomotion.objective import PROSE_ORDER, WalkObjective
from manikin.locomotion.obstacles import Walker, WalkObstacle, clearance
from manikin.locomotion.path import WalkingPath, WalkingTask
from manikin.locomotion.solve import Guess, bent, cheapest, lacking, programme_of, sharpened, solve
from manikin.locomotion.ways import Grid
from manikin.spatial import FloatArray, PlanarTransform, finite_number, frozen_array
from manikin.spline import BSpline
from manikin.worker import side_by_side

GRID, GOAL_GRID = 6, 9
"""Decimals of the obstacles that ways are sought around [m], as exact as floor plans; and of their goal."""

NEAREST, FARTHEST = 0.01, 100.0
"""Distances from start to goal that can be asked [m]; at none, the direction of the goal has no value."""


def walking_path(
    start: ArrayLike,
    goal: ArrayLike,
    objective: WalkObjective = PROSE_ORDER,
    *,
    obstacles: Sequence[WalkObstacle] = (),
    walker: Walker | None = None,
    room: float = 0.05,
    max_speed: float | None = None,
    start_velocity: ArrayLike = (0.0, 0.0, 0.0),
    goal_velocity: ArrayLike = (0.0, 0.0, 0.0),
    like: WalkingPath | None = None,
) -> WalkingPath:
    """The way a person walks from one place and heading to another ([Truong2010]_ 5.5-5.8).

    Every initial guess is optimised and the cheapest path is returned, whose heading may end whole turns from
    the goal's. Obstacles, which the thesis leaves open (5.6), are constraints under the same cost: if the
    path without them is in their way, ways between them from a grid and detours on both sides are optimised
    and the cheapest is returned. All are local optima; a cheaper one elsewhere cannot be excluded.

    Args:
        start: (3,) x, y [m], heading [rad], counter-clockwise from x.
        goal: (3,) x, y [m], heading [rad], 0.01 to 100 m from the start.
        objective: The cost; :data:`LITERAL_ORDER` is the other reading of (5.8).
        obstacles: To be kept away from, at rest or moving.
        walker: The body's extent, used with obstacles only.
        room: Distance to keep from obstacles [m].
        max_speed: Limit of the speed over the floor [m/s]. Without one, far goals are run to: the cost of
            the thesis grows with accelerations, not with speeds.
        start_velocity: (3,) forward, left [m/s], angular velocity [rad/s]; at rest, as in the thesis' data.
        goal_velocity: (3,) the same at the goal.
        like: A path to start from instead of the guesses, such as that of a neighbouring goal.

    Returns:
        The path. If there is none it says so in ``failure`` and holds the nearest attempt.

    Raises:
        InputError: If an argument is not usable, or start or goal are in an obstacle.
    """
    task = WalkingTask(
        start=frozen_array(start, "walking start [m, m, rad]", (3,)),
        goal=frozen_array(goal, "walking goal [m, m, rad]", (3,)),
        objective=objective,
        obstacles=tuple(obstacles),
        walker=Walker() if walker is None else walker,
        room=finite_number(room, "walking room [m]", at_least=0.0),
        max_speed=None if max_speed is None else finite_number(max_speed, "max_speed [m/s]", at_least=0.1),
        start_velocity=frozen_array(start_velocity, "walking start_velocity [m/s, m/s, rad/s]", (3,)),
        goal_velocity=frozen_array(goal_velocity, "walking goal_velocity [m/s, m/s, rad/s]", (3,)),
    )
    _check(task)
    guesses = _guesses(task) if like is None else [Guess("like another", *bent(like, task))]
    free = cheapest([solve(replace(task, obstacles=()), guess) for guess in guesses])
    return sharpened(_around(task, free) if task.obstacles else free)


def walking_paths(
    start: ArrayLike,
    goals: Sequence[ArrayLike],
    objective: WalkObjective = PROSE_ORDER,
    *,
    workers: int = 1,
    **options: Any,
) -> list[WalkingPath]:
    """Paths from one start to many goals, as :func:`walking_path` finds each.

    Args:
        start: (3,) x, y [m], heading [rad].
        goals: (k, 3) of the same.
        objective: The cost.
        workers: Processes. They are started afresh, which takes longer than a hundred goals without obstacles
            do; and a script must ask for more than one under ``if __name__ == "__main__"``.
        options: Of :func:`walking_path`.

    Raises:
        InputError: As :func:`walking_path`, before anything is computed where that is possible.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError(f"workers is {workers!r}; valid: an integer >= 1")
    wanted = [frozen_array(goal, f"walking goal {i} [m, m, rad]", (3,)) for i, goal in enumerate(goals)]
    one = partial(_one, start, objective, options)
    found = dict(side_by_side(one, wanted, workers, "walking paths"))
    return [found[number] for number in range(len(wanted))]


def _check(task: WalkingTask) -> None:
    distance = float(np.hypot(*(task.goal - task.start)[:2]))
    if not NEAREST <= distance <= FARTHEST:
        raise InputError(
            f"walking goal is {distance:g} m from the start; valid: {NEAREST:g} to {FARTHEST:g} m"
        )
    resting = [one for one in task.obstacles if not one.moves]
    for name, place, there in (("start", task.start, task.obstacles), ("goal", task.goal, resting)):
        for one, left in zip(there, clearance(there, task.walker, place[None], np.zeros(1))[0], strict=True):
            if left < task.room:
                raise InputError(
                    f"walking {name} leaves {left:.3g} m to obstacle {one.name!r}; "
                    f"valid: at least {task.room:g} m"
                )


def _guesses(task: WalkingTask) -> Iterator[Guess]:
    structure = programme_of(replace(task, obstacles=())).structure
    duration = guess_duration(task.objective, task.start, task.goal)
    for kind in kinds_of_guesses(task.start, task.goal):
        yield Guess(kind, guess_path(structure, kind, task.start, task.goal), duration)


def _around(task: WalkingTask, free: WalkingPath) -> WalkingPath:
    """The free path if it has room, else the best of the detours around what is in its way."""
    kept = replace(free, task=task)
    short = lacking(kept)
    if free.succeeded and np.all(short <= 0.0):
        return kept
    # Ways over a grid depend on its axes: with those of the start, a scene elsewhere has the same ones.
    x, y, heading = task.start.tolist()
    transform_start_to_world = PlanarTransform(x, y, math.degrees(heading))
    transform_world_to_start = transform_start_to_world.inverse
    from_start = _from_start(task, transform_world_to_start)
    blocking = [one for one, lack in zip(from_start.obstacles, short, strict=False) if lack > 0.0]
    found = _on_ways(from_start, _in_frame(kept, from_start, transform_world_to_start, GRID), blocking)
    return _in_frame(found, task, transform_start_to_world)


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


def _from_start(task: WalkingTask, transform_world_to_start: PlanarTransform) -> WalkingTask:
    """The task in the frame of its start, its places on a grid that leaves no trace of where that is."""
    goal = transform_world_to_start.points(task.goal[:2])
    return replace(
        task,
        start=np.zeros(3),
        goal=np.append(goal, task.goal[2] - task.start[2]).round(GOAL_GRID),
        obstacles=tuple(one.moved(transform_world_to_start, GRID) for one in task.obstacles),
    )


def _in_frame(
    path: WalkingPath, task: WalkingTask, transform: PlanarTransform, decimals: int | None = None
) -> WalkingPath:
    """A path in the frame of another task, whose places are those of its own after a transform."""
    points = path.spline.control_points
    moved = np.column_stack([transform.points(points[:, :2]), points[:, 2] + transform.yaw])
    duration = path.duration
    if decimals is not None:
        moved, duration = moved.round(decimals), round(duration, decimals)
    spline = BSpline(path.spline.degree, path.spline.knots, moved)
    return replace(path, task=task, spline=spline, duration=duration)


def _way_guesses(task: WalkingTask, free: WalkingPath, ways: Mapping[str, FloatArray]) -> Iterator[Guess]:
    """Along ways over the grid; along the narrow one, where the shoulders may not fit, turned aside too."""
    structure = programme_of(task).structure
    for name, way in ways.items():
        points = guess_path(structure, "turning", task.start, task.goal, list(way))
        yield Guess(name, points, 1.2 * free.duration)
        if name == "narrow way":
            for side, turn in (("left", -np.pi / 2), ("right", np.pi / 2)):
                turned = turned_between(points, turn)
                yield Guess(f"{name}, {side} shoulder first", turned, 1.2 * free.duration)


def _detour_guesses(
    task: WalkingTask, free: WalkingPath, blocking: Sequence[WalkObstacle]
) -> Iterator[Guess]:
    """Past what is in the way on either side; straight on, sooner or later where something moves."""
    if not blocking:
        return
    structure = programme_of(task).structure
    times = np.linspace(0.0, free.duration, 201)
    room = clearance(blocking, task.walker, free.place_at(times), times)
    nearest = [float(times[i]) for i in room.argmin(axis=0)]
    for number, via in enumerate(detours(blocking, nearest, task.walker, task.start, task.goal)):
        way = guess_path(structure, "turning", task.start, task.goal, via)
        yield Guess(f"detour {number}", way, 1.2 * free.duration)
    if any(one.moves for one in blocking):
        for name, factor in (("straight on", 1.0), ("sooner", 0.7), ("later", 1.6)):
            yield Guess(name, free.spline.control_points, factor * free.duration)


def _one(
    start: ArrayLike, objective: WalkObjective, options: dict[str, Any], goal: FloatArray
) -> WalkingPath:
    return walking_path(start, goal, objective, **options)
