"""A path of the root: a clamped B-spline of poses and the time it takes within speed limits.

Positions and quaternions are blended by the same basis functions and the quaternion is made unit afterwards,
so that a control pose acts on its neighbourhood only.

A polygonal way becomes a short, smooth path in three steps ([Tonneau2015]_ 6.3.2).

1. Pruning (Algorithm 6, read "if l(P_i, P_j) then remove").
2. Approximation by a B-spline whose control poses lie on the way, spread by the time it takes, more of them
   until the condition holds along the whole spline.
3. Shortcuts: a stretch of control poses is replaced by the straight way between its ends where that
   takes less time and the condition still holds. Only the spans that change are checked.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.numerics.spline import check_clamped, clamped_knots, derivative_matrix
from manikin.planning.guide.root_pose import angles_between, between
from manikin.planning.guide.steering import LocalPlanner

CELLS = 20
"""Cells of the time law per span of the spline."""

_SAFETY = 1.01  # speeds are known at three instants of each cell, this covers what lies between


@dataclass(frozen=True, eq=False)
class RootLimits:
    """Largest speeds of the root, (3,) along the world axes [m/s] and (3,) about its own axes [rad/s]."""

    linear: FloatArray
    angular: FloatArray

    def __init__(self, linear: ArrayLike = 0.8, angular: ArrayLike = 1.0) -> None:
        """Take limits; one number stands for all three axes. The defaults are our choice."""
        for name, value, unit in (("linear", linear, "m/s"), ("angular", angular, "rad/s")):
            called = f"root limits {name} [{unit}]"
            numbers = frozen_array(np.broadcast_to(np.asarray(value, dtype=np.float64), (3,)), called)
            finite_number(numbers.min(), called, above=0.0)
            object.__setattr__(self, name, numbers)

    @property
    def both(self) -> FloatArray:
        """(6,) linear, then angular limits."""
        return np.concatenate([self.linear, self.angular])


@dataclass(frozen=True, eq=False)
class RootPath:
    """Pose of the root as a function of a share of the path and of time.

    Attributes:
        degree: Degree of the spline; 1 for straight ways with turns.
        knots: (n + degree + 1,) clamped knots from 0 to 1.
        control_points: (n, 7) positions [m] and unit quaternions xyzw, neighbours in one hemisphere.
        limits: Speed limits that the time law keeps.
    """

    degree: int
    knots: FloatArray
    control_points: FloatArray
    limits: RootLimits

    def __init__(
        self, degree: int, knots: ArrayLike, control_points: ArrayLike, limits: RootLimits | None = None
    ) -> None:
        points = np.array(frozen_array(control_points, "root path control_points", (None, 7)))
        times = check_clamped(degree, knots, len(points))
        if times[0] != 0.0 or times[-1] != 1.0:
            raise InputError(f"root path knots span {times[0]:g} to {times[-1]:g}; valid: 0 to 1")
        # Unit quaternions, neighbours less than half a turn apart.
        unit = points[:, 3:] / np.linalg.norm(points[:, 3:], axis=1, keepdims=True)
        flips = np.where(np.sum(unit[1:] * unit[:-1], axis=1) < 0.0, -1.0, 1.0)
        unit[1:] *= np.cumprod(flips)[:, None]
        points[:, 3:] = unit
        poses = frozen_array(points, "root path control_points")
        vars(self).update(degree=degree, knots=frozen_array(times, "root path knots"), control_points=poses)
        vars(self).update(limits=limits or RootLimits())

    @classmethod
    def through(
        cls, control_points: ArrayLike, limits: RootLimits | None = None, degree: int = 3
    ) -> "RootPath":
        """Spline with evenly spaced knots from the first to the last of (n, 7) points, n >= 2.

        The degree is lowered to n - 1 where there are fewer points.
        """
        points = np.asarray(control_points, dtype=np.float64)
        degree = min(degree, len(points) - 1)
        knots = clamped_knots(degree, np.linspace(0.0, 1.0, len(points) - degree + 1))
        return cls(degree, knots, points, limits)

    @property
    def start(self) -> FloatArray:
        """(7,) first pose."""
        return self.control_points[0]

    @property
    def goal(self) -> FloatArray:
        """(7,) last pose."""
        return self.control_points[-1]

    @property
    def duration(self) -> float:
        """Time of the whole path within the speed limits [s]."""
        return float(self._law[1][-1])

    def poses(self, shares: ArrayLike) -> FloatArray:
        """(n, 7) poses at (n,) shares of the spline's parameter in [0, 1]."""
        raw = self._spline(np.clip(np.atleast_1d(np.asarray(shares, dtype=np.float64)), 0.0, 1.0))
        raw[:, 3:] /= np.linalg.norm(raw[:, 3:], axis=1, keepdims=True)
        return raw

    def at_times(self, times: ArrayLike) -> FloatArray:
        """(n, 7) poses at (n,) times [s], held before the start and after the end."""
        return self.poses(self.share_of(times))

    def share_of(self, times: ArrayLike) -> FloatArray:
        """(n,) parameter in [0, 1] at (n,) times [s]."""
        shares, law = self._law
        return np.interp(np.atleast_1d(np.asarray(times, dtype=np.float64)), law, shares)

    def velocities(self, times: ArrayLike) -> FloatArray:
        """(n, 6) speed along the world axes [m/s] and about the root's axes [rad/s] at (n,) times [s].

        The time law is straight between its nodes; at a node it is the speed before it.
        """
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
        shares, law = self._law
        cell = np.clip(np.searchsorted(law, wanted, side="left") - 1, 0, len(law) - 2)
        pace = np.diff(shares)[cell] / np.diff(law)[cell]
        moving = (wanted >= 0.0) & (wanted <= law[-1])
        return self.rates(self.share_of(wanted)) * (pace * moving)[:, None]

    def rates(self, shares: ArrayLike) -> FloatArray:
        """(n, 6) linear (world axes) and angular (root axes) rates per unit of the parameter."""
        s = np.clip(np.atleast_1d(np.asarray(shares, dtype=np.float64)), 0.0, 1.0)
        raw, change = self._spline(s), self._derivative(s)
        x, w, dx, dw = raw[:, 3:6], raw[:, 6:], change[:, 3:6], change[:, 6:]
        turn = w * dx - dw * x - np.cross(x, dx)
        return np.hstack([change[:, :3], 2.0 * turn / (raw[:, 3:] ** 2).sum(axis=1, keepdims=True)])

    @cached_property
    def span_bounds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Spans of the parameter and upper bounds of the motion within each.

        A blended quaternion is no shorter than the root of the smallest product of two that it blends.

        Returns:
            (spans + 1,) borders; (spans,) path length of the origin [m]; (spans,) angle turned [rad].
        """
        borders = np.unique(self.knots)
        change = derivative_matrix(self.degree, self.knots, 1) @ self.control_points
        way, turn = (np.linalg.norm(part, axis=1) for part in (change[:, :3], change[:, 3:]))
        bounds = []
        for low, high in itertools.pairwise(borders):
            span = int(np.searchsorted(self.knots, low, side="right")) - 1
            rows = slice(span - self.degree, span)
            blended = self.control_points[rows.start : span + 1, 3:]
            least = float(np.sqrt(max((blended @ blended.T).min(), 1e-4)))
            bounds.append(((high - low) * way[rows].max(), (high - low) * 2.0 * turn[rows].max() / least))
        lengths, angles = np.array(bounds).T
        return borders, lengths, angles

    @cached_property
    def _spline(self) -> BSpline:
        return BSpline(self.knots, self.control_points, self.degree)

    @cached_property
    def _derivative(self) -> BSpline:
        return self._spline.derivative()

    @cached_property
    def _law(self) -> tuple[FloatArray, FloatArray]:
        """Nodes of the time law: parameter and time ([Tonneau2015]_ 6.3.2.2 with |dq| / v_max).

        The print integrates the coordinates themselves instead of their change.
        """
        borders = np.unique(self.knots)
        inner = borders[:-1, None] + np.diff(borders)[:, None] * np.arange(CELLS) / CELLS
        grid = np.append(inner.ravel(), 1.0)
        # Just inside each cell, because a spline of degree 1 has corners at its knots.
        inside = np.array([1e-9, 0.5, 1.0 - 1e-9])
        asked = (grid[:-1, None] + np.diff(grid)[:, None] * inside).ravel()
        need = np.abs(self.rates(asked)) / self.limits.both
        slowest = need.max(axis=1).reshape(-1, 3).max(axis=1)
        steps = np.maximum(_SAFETY * slowest * np.diff(grid), 1e-12)
        return grid, np.concatenate([[0.0], np.cumsum(steps)])


_MOST_CONTROL_POSES = 300
_SMALL_TURN = 0.2  # [rad]; the speed of a blended turn is then even within 0.4 %

SHORTCUTS = 150
"""N, random shortcuts tried; our choice, as the other numbers that 6.3.2 leaves open."""

SPACING = 0.25
"""Time between control poses of the first approximation [s]."""

DEGREE = 3
"""Degree of the spline."""


def prune(poses: FloatArray, planner: LocalPlanner) -> FloatArray:
    """Leave out of (n, 7) poses, joined by straight ways, what a straight way skips (Algorithm 6)."""
    kept, here, last = [0], 0, len(poses) - 1
    while here < last:
        ahead = range(last, here + 1, -1)
        here = next((there for there in ahead if planner.straight(poses[here], poses[there])), here + 1)
        kept.append(here)
    return poses[kept]


def traverse_times(poses: FloatArray, limits: RootLimits) -> FloatArray:
    """(n,) times at (n, 7) poses joined by straight ways: sums of ``max |dq| / v_max`` [s].

    The print has ``sqrt(P_i^2 - P_{i-1}^2) / v_max`` ([Tonneau2015]_ 4.4.2), which is no duration.
    """
    turns = Rotation.from_quat(poses[:, 3:])
    change = np.hstack([np.diff(poses[:, :3], axis=0), (turns[:-1].inv() * turns[1:]).as_rotvec()])
    return np.concatenate([[0.0], np.cumsum((np.abs(change) / limits.both).max(axis=1))])


def approximate(
    poses: FloatArray, planner: LocalPlanner, limits: RootLimits, rng: np.random.Generator
) -> RootPath:
    """Spline close to a way of (n, 7) poses joined by straight ways; of degree 1 where no other was found."""
    # Without those that equal the one before; two at least.
    new = np.any(np.abs(np.diff(poses, axis=0)) > 1e-12, axis=1)
    poses = poses[np.append(True, new)] if new.any() else poses[[0, -1]]
    times = traverse_times(poses, limits)
    count = max(DEGREE + 1, len(poses), int(np.ceil(times[-1] / SPACING)) + 1)
    while times[-1] > 0.0 and count <= _MOST_CONTROL_POSES:
        path = RootPath.through(_spread(poses, times, count, rng), limits, DEGREE)
        if path_holds(path, planner):
            return path
        count = int(np.ceil(1.5 * count))
    return RootPath.through(_with_small_turns(poses), limits, degree=1)


def path_holds(path: RootPath, planner: LocalPlanner, low: float = 0.0, high: float = 1.0) -> bool:
    """Whether the condition holds along a path between two values of its parameter."""
    borders, ways, angles = path.span_bounds
    pieces = [
        np.linspace(a, b, planner.checker.steps(way, angle), endpoint=False)
        for a, b, way, angle in zip(borders[:-1], borders[1:], ways, angles, strict=True)
        if b > low and a < high
    ]
    shares = np.append(np.concatenate(pieces), min(high, 1.0))
    return planner.poses_hold(path.poses(shares))


def shorten(path: RootPath, planner: LocalPlanner, rng: np.random.Generator) -> RootPath:
    """Try random shortcuts; each one that is kept makes the way along the control poses quicker."""
    if path.degree < 2 or len(path.control_points) < 4:
        return path
    for _ in range(SHORTCUTS):
        points = path.control_points
        first, last = sorted(rng.choice(len(points), 2, replace=False).tolist())
        if last - first < 2:
            continue
        straight = between(points[first], points[last], np.arange(last - first + 1) / (last - first))
        shorter = np.vstack([points[:first], straight, points[last + 1 :]])
        before = traverse_times(points, path.limits)[-1]
        if traverse_times(shorter, path.limits)[-1] > before * (1.0 - 1e-6):
            continue
        candidate = RootPath(path.degree, path.knots, shorter, path.limits)
        low, high = path.knots[first + 1], path.knots[last + path.degree]
        if path_holds(candidate, planner, float(low), float(high)):
            path = candidate
    return path


def _spread(poses: FloatArray, times: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """(count, 7) poses on the way, one at a random place of each of equal stretches of time."""
    inner = (np.arange(1, count - 1) + rng.uniform(-0.5, 0.5, count - 2)) / (count - 1)
    wanted = np.concatenate([[0.0], inner, [1.0]]) * times[-1]
    leg = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(times) - 2)
    shares = (wanted - times[leg]) / (times[leg + 1] - times[leg])
    return np.vstack([between(poses[k], poses[k + 1], shares[leg == k]) for k in range(len(poses) - 1)])


def _with_small_turns(poses: FloatArray) -> FloatArray:
    """The way with poses added in between, so that none is turned far from the one before."""
    pieces = [poses[:1]]
    for first, second in itertools.pairwise(poses):
        count = max(1, int(np.ceil(float(angles_between(first, second)) / _SMALL_TURN)))
        pieces.append(between(first, second, np.arange(1, count + 1) / count))
    return np.vstack(pieces)
