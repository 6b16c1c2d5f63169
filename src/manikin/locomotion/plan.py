"""Finding walking paths: the criterion minimised from several guesses, around obstacles as well."""

import multiprocessing
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.locomotion.guesses import detours, guess_duration, guess_path, kinds_of_guesses, turned_between
from manikin.locomotion.model import to_world
from manikin.locomotion.objective import PROSE_ORDER, WalkObjective
from manikin.locomotion.obstacles import Walker, WalkObstacle, clearance
from manikin.locomotion.path import TOLERANCE, WalkingPath, WalkingTask
from manikin.locomotion.programme import Programme, Structure, obstacle_parameters, transcribe
from manikin.locomotion.ways import Grid
from manikin.spatial import FloatArray, finite_number, frozen_array

NEAREST, FARTHEST = 0.01, 100.0
"""Distances from start to goal that can be asked [m]; at none, the direction of the goal has no value."""

_ROUNDS = 4
"""Solutions whose room between the samples of the programme is made up for."""

_SPEED_SHARE = 0.999
"""Part of the speed limit that is used, because the speed between the samples is a little higher."""

_SHORT = 10.0
"""Distance up to which twenty pieces are enough [m]."""


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
    guesses = _guesses(task) if like is None else [_Guess("like another", *_bent(like, task))]
    free = _cheapest([_solve(replace(task, obstacles=()), guess) for guess in guesses])
    if not task.obstacles:
        return free
    return _around(task, free)


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
        workers: Processes; more than one pay off from about a hundred goals. They are started afresh, so a
            script must ask for them under ``if __name__ == "__main__"``.
        options: Of :func:`walking_path`.

    Raises:
        InputError: As :func:`walking_path`, before anything is computed where that is possible.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError(f"workers is {workers!r}; valid: an integer >= 1")
    wanted = [frozen_array(goal, f"walking goal {i} [m, m, rad]", (3,)) for i, goal in enumerate(goals)]
    one = partial(_one, start, objective, options)
    if workers == 1 or len(wanted) < 2:
        return [one(goal) for goal in wanted]
    # Fresh processes: copies of this one would share the threads and locks of its libraries.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(wanted)), context) as pool:
        return list(pool.map(one, wanted, chunksize=max(1, len(wanted) // (4 * workers))))


def programme_of(task: WalkingTask) -> Programme:
    """The compiled programme of a task, shared by all tasks of the same structure."""
    distance = float(np.hypot(*(task.goal - task.start)[:2]))
    return transcribe(
        Structure(
            pieces=20 if distance <= _SHORT else 40,
            obstacles=tuple((len(one.corners), len(one.times)) for one in task.obstacles),
            discs=len(task.walker.offsets) if task.obstacles else 1,
            limited_speed=task.max_speed is not None,
        )
    )


def parameters_of(task: WalkingTask, tightening: FloatArray, turned_goal: FloatArray) -> dict[str, Any]:
    """Parameters of the programme by name.

    Args:
        task: What is asked.
        tightening: (obstacles,) further distance to keep at the samples [m].
        turned_goal: (3,) the goal, its heading by whole turns as the guess arrives.
    """
    values: dict[str, Any] = {
        "start": task.start,
        "goal": turned_goal,
        "start_rate": to_world(task.start[2], task.start_velocity),
        "goal_rate": to_world(task.goal[2], task.goal_velocity),
        "fade": task.objective.goal_fade,
        "weights": task.objective.weights,
        "offsets": task.walker.offsets,
        "room": task.walker.depth / 2 + task.room + tightening,
        "max_speed": _SPEED_SHARE * (task.max_speed or 0.0),
    }
    for index, obstacle in enumerate(task.obstacles):
        values |= obstacle_parameters(index, obstacle)
    return values


@dataclass(frozen=True, eq=False)
class _Guess:
    """Where the solver starts: its name, (n, 3) control points and duration [s]."""

    name: str
    points: FloatArray
    duration: float


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


def _guesses(task: WalkingTask) -> Iterator[_Guess]:
    structure = programme_of(replace(task, obstacles=())).structure
    duration = guess_duration(task.objective, task.start, task.goal)
    for kind in kinds_of_guesses(task.start, task.goal):
        yield _Guess(kind, guess_path(structure, kind, task.start, task.goal), duration)


def _bent(path: WalkingPath, task: WalkingTask) -> tuple[FloatArray, float]:
    """Control points and duration of a path, its ends moved to those of another task."""
    structure = programme_of(replace(task, obstacles=())).structure
    share = np.linspace(0.0, 1.0, structure.pieces + 4)[:, None]
    points = (
        path.spline(share[:, 0])
        if len(path.spline.control_points) != len(share)
        else path.spline.control_points
    )
    goal = task.goal.copy()
    goal[2] += 2.0 * np.pi * np.round((points[-1, 2] - goal[2]) / (2.0 * np.pi))
    moved = points + (1.0 - share) * (task.start - points[0]) + share * (goal - points[-1])
    return moved, path.duration


def _solve(task: WalkingTask, guess: _Guess) -> WalkingPath:
    """Optimise from one guess, again with more room where the path between the samples had too little."""
    programme = programme_of(task)
    tightening = np.zeros(len(task.obstacles))
    unknowns = programme.pack(guess.points, guess.duration)
    for _ in range(_ROUNDS):
        values = parameters_of(task, tightening, guess.points[-1])
        solution = programme.solver(
            x0=unknowns, p=programme.pack_parameters(values), lbg=np.zeros(sum(programme.rows))
        )
        stats = programme.solver.stats()
        unknowns = np.asarray(solution["x"], dtype=np.float64).ravel()
        spline, duration = programme.unpack(unknowns, values)
        failure = None if stats["success"] else f"the solver ended with {stats['return_status']}"
        path = WalkingPath(
            task, spline, duration, float(solution["f"]), guess.name, int(stats["iter_count"]), failure
        )  # fmt: skip
        lacking = _lacking(path)
        if failure is not None or np.all(lacking <= 0.5 * TOLERANCE):
            break
        tightening = tightening + 1.2 * np.maximum(lacking, 0.0) + 1e-5
    return path if np.all(lacking <= TOLERANCE) else _refused(path, lacking)


def _lacking(path: WalkingPath) -> FloatArray:
    """(obstacles,) room that a path lacks beside each, measured every few millimetres [m]."""
    if not path.task.obstacles:
        return np.zeros(0)
    time = np.linspace(0.0, path.duration, 1001)
    room = clearance(path.task.obstacles, path.task.walker, path.place_at(time), time)
    return path.task.room - room.min(axis=0)


def _refused(path: WalkingPath, lacking: FloatArray) -> WalkingPath:
    worst = int(np.argmax(lacking))
    name = path.task.obstacles[worst].name
    reason = f"no way around obstacle {name!r} was found; the nearest attempt lacks {lacking[worst]:.3g} m"
    return replace(path, failure=reason)


def _cheapest(paths: Sequence[WalkingPath]) -> WalkingPath:
    """The cheapest of those that are solutions, or else any that is nearest to one."""
    found = [path for path in paths if path.succeeded]
    best = min(found, key=lambda path: path.cost) if found else min(paths, key=_shortfall)
    return replace(best, others={path.guess: path.cost for path in found})


def _shortfall(path: WalkingPath) -> float:
    return float(max(_lacking(path).max(initial=0.0), 0.0))


def _around(task: WalkingTask, free: WalkingPath) -> WalkingPath:
    """The free path if it has room, else the best of the detours around what is in its way."""
    kept = replace(free, task=task)
    lacking = _lacking(kept)
    if free.succeeded and np.all(lacking <= 0.0):
        return kept
    grid = Grid(task.obstacles, task.start, task.goal)
    narrow = grid.way(task.walker.depth / 2 + task.room - grid.tolerance)
    if narrow is None:
        return replace(kept, failure="the obstacles leave no way to the goal", others={})
    wide = grid.way(task.walker.width / 2 + task.room)
    ways = {"narrow way": narrow} | ({} if wide is None else {"wide way": wide})
    blocking = [one for one, lack in zip(task.obstacles, lacking, strict=True) if lack > 0.0]
    guesses = (*_way_guesses(task, free, ways), *_detour_guesses(task, free, blocking))
    return _cheapest([_solve(task, guess) for guess in guesses])


def _way_guesses(task: WalkingTask, free: WalkingPath, ways: Mapping[str, FloatArray]) -> Iterator[_Guess]:
    """Along ways over the grid; along the narrow one, where the shoulders may not fit, turned aside too."""
    structure = programme_of(task).structure
    for name, way in ways.items():
        points = guess_path(structure, "turning", task.start, task.goal, list(way))
        yield _Guess(name, points, 1.2 * free.duration)
        if name == "narrow way":
            for side, turn in (("left", -np.pi / 2), ("right", np.pi / 2)):
                turned = turned_between(points, turn)
                yield _Guess(f"{name}, {side} shoulder first", turned, 1.2 * free.duration)


def _detour_guesses(
    task: WalkingTask, free: WalkingPath, blocking: Sequence[WalkObstacle]
) -> Iterator[_Guess]:
    """Past what is in the way on either side; straight on, sooner or later where something moves."""
    structure = programme_of(task).structure
    times = np.linspace(0.0, free.duration, 201)
    room = clearance(blocking, task.walker, free.place_at(times), times)
    nearest = [float(times[i]) for i in room.argmin(axis=0)]
    for number, via in enumerate(detours(blocking, nearest, task.walker, task.start, task.goal)):
        way = guess_path(structure, "turning", task.start, task.goal, via)
        yield _Guess(f"detour {number}", way, 1.2 * free.duration)
    if any(one.moves for one in blocking):
        for name, factor in (("straight on", 1.0), ("sooner", 0.7), ("later", 1.6)):
            yield _Guess(name, free.spline.control_points, factor * free.duration)


def _one(
    start: ArrayLike, objective: WalkObjective, options: dict[str, Any], goal: FloatArray
) -> WalkingPath:
    return walking_path(start, goal, objective, **options)
