"""One walking path from one guess: the programme solved, tightened and checked."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.numerics.spatial import FloatArray
from manikin.walking.path.path_program import PathProgram, PathStructure, obstacle_parameters, transcribe
from manikin.walking.path.walk_obstacles import clearance
from manikin.walking.path.walking_model import to_world
from manikin.walking.path.walking_path import TOLERANCE, WalkingPath, WalkingTask


@dataclass(frozen=True, eq=False)
class Guess:
    """A named starting point of the solver: (n, 3) control points [m, m, rad] and a duration [s]."""

    name: str
    points: FloatArray
    duration: float


def programme_of(task: WalkingTask, finer: int = 1) -> PathProgram:
    """The compiled programme of a task, shared by all tasks of the same structure.

    It has 20 pieces up to 10 m and 40 beyond, times ``finer``.
    """
    distance = float(np.hypot(*(task.goal - task.start)[:2]))
    return transcribe(
        PathStructure(
            pieces=finer * (20 if distance <= 10.0 else 40),
            obstacles=tuple((len(item.corners), len(item.times)) for item in task.obstacles),
            discs=len(task.walker.offsets) if task.obstacles else 1,
            limited_speed=task.max_speed is not None,
        )
    )


def parameters_of(task: WalkingTask, tightening: FloatArray, turned_goal: FloatArray) -> dict[str, Any]:
    """Parameters of the programme by name.

    Args:
        task: Task of the path.
        tightening: (obstacles + 1,) further distance to keep at the samples [m], and further below the speed
            limit [m/s].
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
        "room": task.walker.depth / 2 + task.room + tightening[:-1],
        "max_speed": (task.max_speed or 0.0) - tightening[-1],
    }
    for index, obstacle in enumerate(task.obstacles):
        values |= obstacle_parameters(index, obstacle)
    return values


def solve(task: WalkingTask, guess: Guess, finer: int = 1) -> WalkingPath:
    """Optimise from one guess, again with more room where the path between the samples had too little.

    Args:
        task: Task of the path.
        guess: Start of the solver, with as many control points as the programme has.
        finer: Factor of the number of pieces.

    Returns:
        The last iterate; ``failure`` says if that is not a solution.
    """
    programme = programme_of(task, finer)
    tightening = np.zeros(len(task.obstacles) + 1)
    unknowns = programme.pack(guess.points, guess.duration)
    for _ in range(4):
        values = parameters_of(task, tightening, guess.points[-1])
        parameters, bounds = programme.pack_parameters(values), np.zeros(sum(programme.rows))
        solution = programme.solver(x0=unknowns, p=parameters, lbg=bounds)
        stats = programme.solver.stats()
        unknowns = np.asarray(solution["x"], dtype=np.float64).ravel()
        spline, duration = programme.unpack(unknowns, values)
        failure = None if stats["success"] else f"the solver ended with {stats['return_status']}"
        path = WalkingPath(
            task, spline, duration, float(solution["f"]), guess.name, int(stats["iter_count"]), failure
        )
        short = lacking(path)
        if failure is not None or np.all(short <= 0.5 * TOLERANCE):
            break
        tightening = tightening + 1.2 * np.maximum(short, 0.0) + 1e-5
    return path if np.all(short <= TOLERANCE) else _refused(path, short)


def sharpened(path: WalkingPath) -> WalkingPath:
    """The same path, or one of finer pieces if its cost is not what a denser sum says it is.

    Pieces are too coarse where much happens on little of the way: goals a few centimetres away, long walks
    whose goal term fades late, extreme weights.
    """
    for finer in (3, 9):
        dense = float(path.task.objective.weights @ path.term_integrals(600))
        if not path.succeeded or abs(dense / path.cost - 1.0) <= 1e-3:
            break
        guess = Guess(path.guess, *bent(path, path.task, finer))
        path = replace(solve(path.task, guess, finer), others=path.others)
    return path


def bent(path: WalkingPath, task: WalkingTask, finer: int = 1) -> tuple[FloatArray, float]:
    """Control points and duration of a path, its ends moved to those of another task."""
    structure = programme_of(replace(task, obstacles=()), finer).structure
    share = np.linspace(0.0, 1.0, structure.pieces + 4)[:, None]
    points = path.spline.control_points
    if len(points) != len(share):
        points = path.spline(share[:, 0])
    goal = task.goal.copy()
    goal[2] += 2.0 * np.pi * np.round((points[-1, 2] - goal[2]) / (2.0 * np.pi))
    moved = points + (1.0 - share) * (task.start - points[0]) + share * (goal - points[-1])
    return moved, path.duration


def lacking(path: WalkingPath) -> FloatArray:
    """(obstacles + 1,) room that a path lacks beside each [m], and speed beyond the limit [m/s]."""
    task = path.task
    short = np.full(len(task.obstacles) + 1, -np.inf)
    if not task.obstacles and task.max_speed is None:
        return short
    time = np.linspace(0.0, path.duration, 1001)
    if task.obstacles:
        short[:-1] = task.room - clearance(task.obstacles, task.walker, path.place_at(time), time).min(axis=0)
    if task.max_speed is not None:
        short[-1] = float(np.hypot(*path.motion_at(time)[0][:, :2].T).max()) - task.max_speed
    return short


def cheapest(paths: Sequence[WalkingPath]) -> WalkingPath:
    """The cheapest of those that are solutions, or else the one that is nearest to a solution."""
    solutions = [path for path in paths if path.succeeded]
    if solutions:
        best = min(solutions, key=lambda path: path.cost)
    else:
        best = min(paths, key=lambda path: lacking(path).max())
    return replace(best, others={path.guess: path.cost for path in solutions})


def _refused(path: WalkingPath, short: FloatArray) -> WalkingPath:
    worst = int(np.argmax(short))
    if worst == len(path.task.obstacles):
        return replace(path, failure=f"the speed limit is exceeded by {short[worst]:.3g} m/s")
    name = path.task.obstacles[worst].name
    reason = f"no way around obstacle {name!r} was found; the nearest attempt lacks {short[worst]:.3g} m"
    return replace(path, failure=reason)
