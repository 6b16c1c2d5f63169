"""The nonlinear programme of a walking path, written once per structure; numbers are its parameters.

x, y and heading are flat outputs of the model (:func:`manikin.walking.path.walking_model.body_motion`), so
the programme has no dynamics: its unknowns are the inner control points of one spline through place and
heading, over normalised time, and the logarithm of the end time. The ends of the spline hold start and goal
exactly, the integrals of (5.6) are Gauss sums within each piece. This transcription is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, reduce
from typing import Any

import casadi as ca
import numpy as np

from manikin.numerics.spatial import FloatArray
from manikin.numerics.spline import BSpline, basis_matrix
from manikin.walking.path.path_cost import (
    DEGREE,
    PathEnds,
    gauss_points,
    path_cost,
    path_knots,
    term_rates,
)
from manikin.walking.path.walk_obstacles import clearance
from manikin.walking.path.walking_model import to_world
from manikin.walking.path.walking_path import TOLERANCE, WalkingPath, WalkingTask


@dataclass(frozen=True)
class PathStructure:
    """What the programme's expressions depend on; numbers are its parameters.

    Of each obstacle these are the numbers of corners and of instants, of the walker that of discs.
    ``further`` says whether there are terms beyond those of (5.6).
    """

    pieces: int
    obstacles: tuple[tuple[int, int], ...] = ()
    discs: int = 1
    limited_speed: bool = False
    further: bool = False

    @property
    def free(self) -> bool:
        """Whether nothing constrains the path but its ends."""
        return not self.obstacles and not self.limited_speed

    @property
    def knots(self) -> FloatArray:
        """(n,) knots of the spline over [0, 1]."""
        return path_knots(self.pieces)

    @property
    def sample_shares(self) -> FloatArray:
        """Shares of the duration at which obstacles and speed are checked, three per piece."""
        return np.linspace(0.0, 1.0, 3 * self.pieces + 1)[1:]


@dataclass(frozen=True, eq=False)
class PathProgram:
    """The compiled programme.

    Attributes:
        structure: What its expressions depend on.
        symbols: CasADi's ``x``, ``p``, ``f`` and ``g``.
        parameters: Names and shapes of the parameters, in order.
        rows: Number of rows of each group of constraints, in order: one group per obstacle, then the speed.
    """

    structure: PathStructure
    symbols: dict[str, Any]
    parameters: tuple[tuple[str, tuple[int, int]], ...]
    rows: tuple[int, ...]

    @cached_property
    def solver(self) -> ca.Function:
        """IPOPT on the programme."""
        quiet = dict.fromkeys(("print_time", "error_on_fail", "calc_lam_p", "show_eval_warnings"), False)
        ipopt = {"print_level": 0, "sb": "yes", "tol": 1e-6, "max_iter": 100, "bound_relax_factor": 0.0}
        ipopt |= {"mu_strategy": "adaptive", "linear_solver": "mumps"}
        problem = {name: self.symbols[name] for name in ("x", "p", "f", "g")}
        return ca.nlpsol("walking_path", "ipopt", problem, quiet | {"ipopt": ipopt})

    def pack_parameters(self, values: dict[str, Any]) -> FloatArray:
        """Parameter vector from arrays by name."""
        return np.concatenate([
            np.asarray(values[name], dtype=np.float64).reshape(shape).ravel(order="F")
            for name, shape in self.parameters
        ])  # fmt: skip

    def pack(self, points: FloatArray, duration: float) -> FloatArray:
        """Unknowns of all (n, 3) control points, of which the inner ones are used, and the duration [s]."""
        return np.append(points[2:-2].ravel(order="F"), np.log(duration))

    def unpack(self, unknowns: FloatArray, values: dict[str, Any]) -> tuple[BSpline, float]:
        """Spline over [0, 1] through place and heading, and duration [s]."""
        duration = float(np.exp(unknowns[-1]))
        ends = PathEnds(*(np.asarray(values[name]) for name in ("start", "goal", "start_rate", "goal_rate")))
        return spline_of(self.structure, ends, np.append(unknowns[:-1], duration)), duration


class _Parameters(dict[str, ca.SX]):
    """Parameters by name, collected while the programme is written."""

    def __call__(self, name: str, rows: int, columns: int = 1) -> ca.SX:
        self[name] = ca.SX.sym(name, rows, columns)
        return self[name]


@lru_cache(maxsize=32)
def transcribe(structure: PathStructure) -> PathProgram:
    """Write the programme of a structure; cached."""
    parameter = _Parameters()
    # Two control points at either end follow from place and velocity.
    inner = ca.SX.sym("C", structure.pieces + DEGREE - 4, 3)
    log_duration = ca.SX.sym("log_T")
    duration = ca.exp(log_duration)
    start, goal = parameter("start", 1, 3), parameter("goal", 1, 3)
    start_rate, goal_rate = parameter("start_rate", 1, 3), parameter("goal_rate", 1, 3)
    step = duration / (DEGREE * structure.pieces)
    points = ca.vertcat(start, start + step * start_rate, inner, goal - step * goal_rate, goal)
    terms = _terms(structure, points, duration, goal, parameter("fade", 1))
    objective = ca.dot(parameter("weights", terms.numel()), terms)
    rows = _obstacle_rows(structure, points, duration, parameter)
    if structure.limited_speed:
        # Room below the speed limit, as a difference of squares over the limit [m/s].
        limit = parameter("max_speed", 1)
        rate = _basis(structure, structure.sample_shares, 1) @ points[:, :2] / duration
        rows.append(limit - ca.sum2(rate**2) / limit)
    unknowns, packed = ca.vertcat(ca.vec(inner), log_duration), ca.vertcat(*map(ca.vec, parameter.values()))
    symbols = {"x": unknowns, "p": packed, "f": objective, "g": ca.vertcat(*rows)}
    shapes = tuple((name, p.shape) for name, p in parameter.items())
    return PathProgram(structure, symbols, shapes, tuple(row.numel() for row in rows))


def _basis(structure: PathStructure, shares: FloatArray, derivative: int = 0) -> ca.DM:
    matrix = basis_matrix(DEGREE, structure.knots, shares, derivative)
    matrix[np.abs(matrix) < 1e-13] = 0.0
    return ca.sparsify(ca.DM(matrix))


def _terms(structure: PathStructure, points: ca.SX, duration: ca.SX, goal: ca.SX, fade: ca.SX) -> ca.SX:
    """(k, 1) integrals of the terms without their weights, by three Gauss points per piece."""
    shares, parts = gauss_points(structure.pieces)
    orders = [
        ca.horzsplit(_basis(structure, shares, order) @ points / duration**order)
        for order in range(4 if structure.further else 3)
    ]
    third = orders[3] if structure.further else None
    rates = term_rates(orders[0], orders[1], orders[2], third, goal, fade)
    return ca.vertcat(*(duration * ca.dot(ca.DM(parts), rate) for rate in rates))


def _obstacle_rows(
    structure: PathStructure, points: ca.SX, duration: ca.SX, parameter: _Parameters
) -> list[ca.SX]:
    """Distances of the walker's discs to each obstacle, less what they must be [m]."""
    if not structure.obstacles:
        return []
    shares = structure.sample_shares
    place = _basis(structure, shares) @ points
    time = duration * ca.DM(shares)
    offsets, room = parameter("offsets", structure.discs), parameter("room", len(structure.obstacles))
    rows = []
    for index, (corners, instants) in enumerate(structure.obstacles):
        corner, radius = parameter(f"corners{index}", corners, 2), parameter(f"radius{index}", 1)
        times, changes = parameter(f"times{index}", instants), parameter(f"changes{index}", instants, 2)
        moved = [
            sum(changes[k, i] * ca.fmax(time - times[k], 0.0) for k in range(instants)) for i in range(2)
        ]
        for disc in range(structure.discs):
            x = place[:, 0] - offsets[disc] * ca.sin(place[:, 2]) - moved[0]
            y = place[:, 1] + offsets[disc] * ca.cos(place[:, 2]) - moved[1]
            rows.append(_distance(x, y, corner) - radius - room[index])
    return rows


def _distance(x: ca.SX, y: ca.SX, corners: ca.SX) -> ca.SX:
    """Signed distance of points to a convex polygon with counter-clockwise corners."""
    count, squares, depth = corners.shape[0], [], []
    for i in range(count):
        dx, dy = x - corners[i, 0], y - corners[i, 1]
        if count == 1:
            return ca.sqrt(dx**2 + dy**2 + 1e-12)
        ex, ey = (corners[(i + 1) % count, axis] - corners[i, axis] for axis in range(2))
        along = ca.fmin(ca.fmax((dx * ex + dy * ey) / (ex**2 + ey**2), 0.0), 1.0)
        squares.append((dx - along * ex) ** 2 + (dy - along * ey) ** 2)
        depth.append((dx * ey - dy * ex) / ca.sqrt(ex**2 + ey**2))
    outside, inside = reduce(ca.fmin, squares), reduce(ca.fmax, depth)
    return ca.SX(ca.if_else(inside < 0.0, inside, ca.sqrt(outside + 1e-12)))


@dataclass(frozen=True, eq=False)
class Guess:
    """A named starting point of the solver: (n, 3) control points [m, m, rad] and a duration [s]."""

    name: str
    points: FloatArray
    duration: float


def structure_of(task: WalkingTask, finer: int = 1) -> PathStructure:
    """The structure of a task's programme, with 20 pieces up to 10 m and 40 beyond, times ``finer``."""
    distance = float(np.hypot(*(task.goal - task.start)[:2]))
    obstacles = tuple((len(item.corners), len(item.times)) for item in task.obstacles)
    discs, pieces = len(task.walker.offsets) if obstacles else 1, finer * (20 if distance <= 10.0 else 40)
    return PathStructure(pieces, obstacles, discs, task.max_speed is not None, task.objective.further)


def programme_of(task: WalkingTask, finer: int = 1) -> PathProgram:
    """The compiled programme of a task, shared by all tasks of the same structure."""
    return transcribe(structure_of(task, finer))


def parameters_of(task: WalkingTask, tightening: FloatArray, turned_goal: FloatArray) -> dict[str, Any]:
    """Parameters of the programme by name, with the goal (3,) turned by whole turns as the guess arrives.

    ``tightening`` (obstacles + 1,) is further distance to keep at the samples [m], and further speed below
    the limit [m/s].
    """
    values: dict[str, Any] = {
        "start": task.start, "start_rate": to_world(task.start[2], task.start_velocity),
        "goal": turned_goal, "goal_rate": to_world(task.goal[2], task.goal_velocity),
        "fade": task.objective.goal_fade, "weights": task.objective.weights, "offsets": task.walker.offsets,
        "room": task.walker.depth / 2 + task.room + tightening[:-1],
        "max_speed": (task.max_speed or 0.0) - tightening[-1],
    }  # fmt: skip
    for index, item in enumerate(task.obstacles):
        # A track is a place, first a velocity of zero, and changes of velocity.
        velocity = np.diff(item.displacements, axis=0) / np.diff(item.times)[:, None]
        values |= {
            f"corners{index}": item.corners + item.displacements[0], f"radius{index}": [item.radius],
            f"times{index}": item.times,
            f"changes{index}": np.diff(np.pad(velocity, ((1, 1), (0, 0))), axis=0),
        }  # fmt: skip
    return values


def solve(task: WalkingTask, guess: Guess, finer: int = 1) -> WalkingPath:
    """Optimise from one guess, again with more room where the path between the samples had too little.

    The result is the last iterate, whose ``failure`` says if it is no solution. Its pieces, and the guess's,
    are ``finer`` times as many as usual. Without constraints Newton's method is enough
    (:meth:`~manikin.walking.path.path_cost.PathCost.minimum`), and IPOPT is asked where that does not end.
    """
    free = free_optimum(task, guess, finer) if structure_of(task, finer).free else None
    if free is not None:
        return free
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
    if np.all(short <= TOLERANCE):
        return path
    worst = int(np.argmax(short))
    reason = f"the speed limit is exceeded by {short[worst]:.3g} m/s"
    if worst < len(task.obstacles):
        name = task.obstacles[worst].name
        reason = f"no way around obstacle {name!r} was found; the nearest attempt lacks {short[worst]:.3g} m"
    return replace(path, failure=reason)


def free_optimum(task: WalkingTask, guess: Guess, finer: int = 1) -> WalkingPath | None:
    """The optimum without constraints that Newton's method reaches from a guess, or None."""
    structure, goal = structure_of(task, finer), guess.points[-1]
    cost = path_cost(structure.pieces, structure.further)
    begin = np.append(guess.points[2:-2].ravel(order="F"), guess.duration)
    found, value, iterations, converged = cost.minimum(
        begin, ends_of(task, goal), task.objective.goal_fade, task.objective.weights
    )
    if not converged:
        return None
    spline = spline_of(structure, ends_of(task, goal), found)
    return WalkingPath(task, spline, float(found[-1]), value, guess.name, iterations)


def ends_of(task: WalkingTask, turned_goal: FloatArray) -> PathEnds:
    """The ends of a task's paths, the goal (3,) turned by whole turns as a guess arrives."""
    rates = to_world(task.start[2], task.start_velocity), to_world(task.goal[2], task.goal_velocity)
    return PathEnds(task.start, turned_goal, *rates)


def spline_of(structure: PathStructure, ends: PathEnds, unknowns: FloatArray) -> BSpline:
    """Spline over [0, 1] through place and heading, of (k, 3) inner control points and a duration [s]."""
    step = float(unknowns[-1]) / (DEGREE * structure.pieces)
    second, last_but_one = ends.start + step * ends.start_rate, ends.goal - step * ends.goal_rate
    inner = unknowns[:-1].reshape(3, -1).T
    points = np.vstack([ends.start, second, inner, last_but_one, ends.goal])
    return BSpline(DEGREE, structure.knots, points)


def sharpened(path: WalkingPath) -> WalkingPath:
    """The same path, or one of finer pieces if its cost is not what a denser sum says it is."""
    for finer in (3, 9):
        dense = float(path.task.objective.weights @ path.term_integrals(600))
        if not path.succeeded or abs(dense / path.cost - 1.0) <= 1e-3:
            break
        guess = Guess(path.guess, *bent(path, path.task, finer))
        path = replace(solve(path.task, guess, finer), others=path.others)
    return path


def bent(path: WalkingPath, task: WalkingTask, finer: int = 1) -> tuple[FloatArray, float]:
    """Control points and duration of a path, its ends moved to those of another task."""
    share = np.linspace(0.0, 1.0, structure_of(task, finer).pieces + 4)[:, None]
    points = path.spline.control_points
    points = points if len(points) == len(share) else path.spline(share[:, 0])
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
    best = min(solutions, key=lambda path: path.cost, default=None)
    best = best or min(paths, key=lambda path: lacking(path).max())
    return replace(best, others={path.guess: path.cost for path in solutions})
