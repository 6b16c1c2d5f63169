"""Best free paths over the space of goals, to start Newton's method from: a path in some milliseconds.

A goal seen from the start has a distance, a bearing and a turn; mirrored goals have mirrored paths. At the
nodes of a grid over these three the best paths from all guesses are kept, two where a second way to go costs
nearly as much. A path to another goal starts from the mean of those of the nodes around it that go the same
way, weighted linearly, and is refined to the optimum; of several ways the cheapest counts.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.walking.path.path_cost import DEGREE
from manikin.walking.path.path_program import Guess
from manikin.walking.path.walking_model import WalkObjective
from manikin.walking.path.walking_path import WalkingPath, WalkingTask

PIECES = 20
"""Of the splines in a table."""

_SHARES = np.linspace(0.0, 1.0, PIECES + DEGREE)

_CORNERS = np.array(list(np.ndindex(2, 2, 2)))

SAME_WAY = 0.6
"""Largest difference of two paths to one goal that go the same way, of places as a share of the distance."""

KEPT, NEARLY = 1.15, 1.06
"""Costs of ways that are kept in a table, and of those that are tried, as a multiple of the least."""

EXPECTED = 1.04
"""Cost of a path from the table beyond which all guesses are tried too, as a multiple of the expected one."""

WAYS = 2
"""Ways kept at a node."""

STEP = 4e-4
"""Resolution of the files [-], [rad]."""


@dataclass(frozen=True)
class GoalGrid:
    """Nodes over the goals: distances [m], and even bearings in [0, pi] and turns in [-pi, pi) [rad]."""

    distances: tuple[float, ...]
    bearings: int
    turns: int

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of nodes."""
        return len(self.distances), self.bearings, self.turns

    def goal(self, index: tuple[int, ...]) -> FloatArray:
        """(3,) x, y [m], heading [rad] of a node, seen from the start."""
        distance, bearing = self.distances[index[0]], np.pi * index[1] / (self.bearings - 1)
        turn = 2.0 * np.pi * index[2] / self.turns - np.pi
        return np.array([distance * np.cos(bearing), distance * np.sin(bearing), turn])

    def around(
        self, distance: float, bearing: float, turn: float
    ) -> tuple[tuple[NDArray[np.intp], ...], FloatArray]:
        """Indices of the eight nodes around a goal, and (8,) their weights, whose sum is 1."""
        at = np.array([
            np.interp(np.log(distance), np.log(self.distances), np.arange(len(self.distances))),
            bearing / np.pi * (self.bearings - 1),
            ((turn + np.pi) / (2.0 * np.pi) % 1.0) * self.turns,
        ])  # fmt: skip
        low = np.minimum(at.astype(int), np.array(self.shape) - [2, 2, 1])
        weights = np.prod(np.where(_CORNERS, at - low, 1.0 - at + low), axis=1)
        return tuple(((low + _CORNERS) % self.shape).T), weights


SHIPPED = GoalGrid(tuple(np.geomspace(0.2, 10.0, 11).tolist()), 13, 24)
"""The grid of the table in the package."""


@dataclass(frozen=True, eq=False)
class PathTable:
    """Paths at the nodes of a grid under one objective.

    Attributes:
        points: (d, b, t, 2, n, 3) control points of the two best ways: places in the frame of the start
            turned to the goal, as shares of the distance, and heading [rad]; nan without a second way.
        durations: (d, b, t, 2) [s]; nan without a second way.
        costs: (d, b, t, 2) [-]; nan without a second way.
    """

    objective: WalkObjective
    grid: GoalGrid
    points: NDArray[np.float32]
    durations: NDArray[np.float32]
    costs: NDArray[np.float32]

    @classmethod
    def of(
        cls, objective: WalkObjective, grid: GoalGrid, optima: Callable[[FloatArray], Sequence[WalkingPath]]
    ) -> "PathTable":
        """Fill the nodes with the paths from rest to rest that a function finds to their goals."""
        points = np.full((*grid.shape, WAYS, len(_SHARES), 3), np.nan, dtype=np.float32)
        numbers = np.full((2, *grid.shape, WAYS), np.nan, dtype=np.float32)
        for index in itertools.product(*map(range, grid.shape)):
            goal = grid.goal(index)
            direction, distance = np.arctan2(goal[1], goal[0]), np.hypot(*goal[:2])
            for way, path in enumerate(_different(sorted(optima(goal), key=lambda one: one.cost))):
                places = path.spline.control_points
                turned = _turned(places[:, :2], -direction) / distance
                points[index][way] = np.column_stack([turned, places[:, 2]])
                numbers[(slice(None), *index, way)] = path.duration, path.cost
        return cls(objective, grid, points, *numbers)

    def save(self, file: Path) -> None:
        """Write a compressed file with numbers of 16 bits, in steps of :data:`STEP`."""
        known = np.flatnonzero(~np.isnan(self.durations))
        steps = np.round(self.points.reshape(-1, *self.points.shape[-2:])[known] / STEP)
        if np.abs(steps).max() > np.iinfo(np.int16).max:
            raise InputError(f"path in the table goes {np.abs(steps).max() * STEP:g}; valid: up to 13.1")
        # Differences along a path are small numbers, which compress well.
        np.savez_compressed(
            file, known=known, steps=np.diff(steps, axis=1, prepend=0.0).astype(np.int16),
            durations=self.durations.ravel()[known], costs=self.costs.ravel()[known],
            distances=self.grid.distances, counts=self.grid.shape[1:],
            objective=list(vars(self.objective).values()),
        )  # fmt: skip

    @classmethod
    def load(cls, file: Path) -> "PathTable":
        """Read what :meth:`save` wrote."""
        with np.load(file) as data:
            objective = WalkObjective(*data["objective"].tolist())
            grid = GoalGrid(tuple(data["distances"].tolist()), *data["counts"].tolist())
            size = int(np.prod(grid.shape)) * WAYS
            points = np.full((size, len(_SHARES), 3), np.nan, dtype=np.float32)
            points[data["known"]] = STEP * np.cumsum(data["steps"], axis=1, dtype=np.int32)
            numbers = np.full((2, size), np.nan, dtype=np.float32)
            numbers[:, data["known"]] = data["durations"], data["costs"]
        shape = (*grid.shape, WAYS)
        return cls(objective, grid, points.reshape(*shape, -1, 3), *numbers.reshape(2, *shape))

    def covers(self, task: WalkingTask) -> bool:
        """Whether it has guesses: its objective, a distance within the grid, rest at both ends."""
        distance = float(np.hypot(*(task.goal - task.start)[:2]))
        resting = not (np.any(task.start_velocity) or np.any(task.goal_velocity))
        near = self.grid.distances[0] <= distance <= self.grid.distances[-1]
        return resting and near and task.objective == self.objective

    def guesses(self, task: WalkingTask) -> tuple[list[Guess], float]:
        """A guess for each way to go that may be the best, and the expected cost."""
        way = task.goal[:2] - task.start[:2]
        distance, direction = float(np.hypot(*way)), float(np.arctan2(way[1], way[0]))
        bearing, turn = (_wrap(angle - task.start[2]) for angle in (direction, float(task.goal[2])))
        mirror = -1.0 if bearing < 0.0 else 1.0
        kept = self._ways(distance, abs(bearing), mirror * turn)
        found = []
        for number, (points, duration, _) in enumerate(kept):
            places = task.start[:2] + distance * _turned(points[:, :2] * [1.0, mirror], direction)
            whole = np.column_stack([places, task.start[2] + mirror * points[:, 2]])
            whole[0], whole[-1, :2] = task.start, task.goal[:2]
            whole[-1, 2] += _wrap(float(task.goal[2] - whole[-1, 2]))
            found.append(Guess(f"table {number}", whole, duration))
        return found, min(cost for _, _, cost in kept)

    def _ways(self, distance: float, bearing: float, turn: float) -> list[tuple[FloatArray, float, float]]:
        """Mean control points, duration and cost of each way to a goal to the left that may be the best."""
        nodes, weights = self.grid.around(distance, bearing, turn)
        known = (self.costs[nodes] > 0.0) & (weights > 1e-9)[:, None]
        weight = np.broadcast_to(weights[:, None], known.shape)[known]
        numbers = np.log([self.durations[nodes][known], self.costs[nodes][known]])
        bent = self.points[nodes][known].astype(np.float64)
        bent[:, :, 2] += _SHARES * ((turn - bent[:, -1:, 2] + np.pi) % (2.0 * np.pi) - np.pi)
        ways, left = [], np.ones(len(bent), dtype=bool)
        while left.any():
            same = left & (np.abs(bent - bent[np.argmax(left)]).max(axis=(1, 2)) < SAME_WAY)
            share = weight[same] / weight[same].sum()
            ways.append((np.tensordot(share, bent[same], axes=1), *np.exp(numbers[:, same] @ share).tolist()))
            left &= ~same
        least = min(cost for _, _, cost in ways)
        return [way for way in ways if way[2] <= NEARLY * least]


def _different(paths: Sequence[WalkingPath]) -> list[WalkingPath]:
    """The cheapest ways among paths in the order of their costs."""
    kept: list[WalkingPath] = []
    for path in paths:
        near = [np.abs(one.spline.control_points - path.spline.control_points).max() < 1e-3 for one in kept]
        if path.cost <= KEPT * paths[0].cost and not any(near) and len(kept) < WAYS:
            kept.append(path)
    return kept


def _turned(points: FloatArray, angle: float) -> FloatArray:
    cos, sin = np.cos(angle), np.sin(angle)
    return points @ np.array([[cos, sin], [-sin, cos]])


def _wrap(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


@cache
def shipped_table() -> PathTable | None:
    """The table in the package, for the default objective; None where the package has no such file."""
    with as_file(files("manikin.walking").joinpath("data", "walking_paths.npz")) as file:
        return PathTable.load(file) if file.exists() else None
