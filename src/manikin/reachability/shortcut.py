"""From a polygonal way to a short, smooth path ([Tonneau2015]_ 6.3.2).

1. Pruning (Algorithm 6, read "if l(P_i, P_j) then remove").
2. Approximation by a B-spline whose control poses lie on the way, more of them until the condition
   holds along the whole spline; they are spread by the time the way takes.
3. Shortcuts: a stretch of control poses is replaced by the straight way between its ends where that
   takes less time and the condition still holds.  Only the spans that change are checked.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.reachability.pose import angles_between, between
from manikin.reachability.root_path import RootLimits, RootPath
from manikin.reachability.steering import LocalPlanner
from manikin.spatial import FloatArray, finite_number

_MOST_CONTROL_POSES = 300
_SMALL_TURN = 0.2  # [rad]; the speed of a blended turn is then even within 0.4 %


@dataclass(frozen=True)
class ShortcutSettings:
    """The numbers that 6.3.2 leaves to its user; all are our choice.

    Attributes:
        shortcuts: N, random shortcuts tried.
        spacing: Time between control poses of the first approximation [s].
        degree: Degree of the spline.
    """

    shortcuts: int = 150
    spacing: float = 0.25
    degree: int = 3

    def __post_init__(self) -> None:
        finite_number(self.shortcuts, "shortcut shortcuts", at_least=0)
        finite_number(self.spacing, "shortcut spacing [s]", above=0.0)
        finite_number(self.degree, "shortcut degree", at_least=1, at_most=5)


def prune(poses: FloatArray, planner: LocalPlanner) -> FloatArray:
    """Leave out what a straight way skips (Algorithm 6).

    Args:
        poses: (n, 7) joined by straight ways.
        planner: Decides about straight ways.

    Returns:
        (k, 7), k <= n, with the same ends.
    """
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
    angle = (turns[:-1].inv() * turns[1:]).as_rotvec()
    change = np.hstack([np.diff(poses[:, :3], axis=0), angle])
    return np.concatenate([[0.0], np.cumsum((np.abs(change) / limits.both).max(axis=1))])


def approximate(
    poses: FloatArray,
    planner: LocalPlanner,
    limits: RootLimits,
    rng: np.random.Generator,
    settings: ShortcutSettings | None = None,
) -> RootPath:
    """Spline close to a polygonal way; with many control poses it becomes the way itself.

    Args:
        poses: (n, 7) joined by straight ways along which the condition holds.
        planner: Decides about poses.
        limits: Speed limits.
        rng: Places the control poses.
        settings: How many there are at first.

    Returns:
        A path along which the condition holds; of degree 1 where no spline was found.
    """
    wanted = settings or ShortcutSettings()
    poses = _without_repeats(poses)
    times = traverse_times(poses, limits)
    count = max(wanted.degree + 1, len(poses), int(np.ceil(times[-1] / wanted.spacing)) + 1)
    while times[-1] > 0.0 and count <= _MOST_CONTROL_POSES:
        path = RootPath.through(_spread(poses, times, count, rng), limits, wanted.degree)
        if path_holds(path, planner):
            return path
        count = int(np.ceil(1.5 * count))
    return RootPath.through(_with_small_turns(poses), limits, degree=1)


def path_holds(path: RootPath, planner: LocalPlanner, low: float = 0.0, high: float = 1.0) -> bool:
    """Whether the condition holds along a path between two values of its parameter.

    The poses asked are as close as the bounds of the path's motion demand.
    """
    borders, ways, angles = path.span_bounds
    pieces = [
        np.linspace(a, b, planner.checker.steps(way, angle), endpoint=False)
        for a, b, way, angle in zip(borders[:-1], borders[1:], ways, angles, strict=True)
        if b > low and a < high
    ]
    shares = np.append(np.concatenate(pieces), min(high, 1.0))
    return planner.poses_hold(path.poses(shares))


def shorten(
    path: RootPath,
    planner: LocalPlanner,
    rng: np.random.Generator,
    settings: ShortcutSettings | None = None,
) -> RootPath:
    """Try random shortcuts; each one that is kept makes the way along the control poses quicker.

    Args:
        path: A path along which the condition holds.
        planner: Decides about poses.
        rng: Chooses the stretches.
        settings: How many are tried.
    """
    wanted = settings or ShortcutSettings()
    if path.degree < 2 or len(path.control_points) < 4:
        return path
    for _ in range(wanted.shortcuts):
        first, last = sorted(rng.choice(len(path.control_points), 2, replace=False).tolist())
        if last - first >= 2:
            path = _tried(path, first, last, planner)
    return path


def _tried(path: RootPath, first: int, last: int, planner: LocalPlanner) -> RootPath:
    """The path with the control poses between two replaced by a straight way, if that is better."""
    points = path.control_points
    straight = between(points[first], points[last], np.arange(last - first + 1) / (last - first))
    shorter = np.vstack([points[:first], straight, points[last + 1 :]])
    before = traverse_times(points, path.limits)[-1]
    if traverse_times(shorter, path.limits)[-1] > before * (1.0 - 1e-6):
        return path
    candidate = RootPath(path.degree, path.knots, shorter, path.limits)
    low, high = path.knots[first + 1], path.knots[last + path.degree]
    return candidate if path_holds(candidate, planner, float(low), float(high)) else path


def _spread(poses: FloatArray, times: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
    """(count, 7) poses on the way, one at a random place of each of equal stretches of time."""
    inner = (np.arange(1, count - 1) + rng.uniform(-0.5, 0.5, count - 2)) / (count - 1)
    wanted = np.concatenate([[0.0], inner, [1.0]]) * times[-1]
    leg = np.clip(np.searchsorted(times, wanted, side="right") - 1, 0, len(times) - 2)
    shares = (wanted - times[leg]) / (times[leg + 1] - times[leg])
    return np.vstack([between(poses[k], poses[k + 1], shares[leg == k]) for k in range(len(poses) - 1)])


def _with_small_turns(poses: FloatArray) -> FloatArray:
    """The same way with poses in between, so that none is turned far from the one before."""
    pieces = [poses[:1]]
    for first, second in itertools.pairwise(poses):
        count = max(1, int(np.ceil(float(angles_between(first, second)) / _SMALL_TURN)))
        pieces.append(between(first, second, np.arange(1, count + 1) / count))
    return np.vstack(pieces)


def _without_repeats(poses: FloatArray) -> FloatArray:
    """Poses without those that equal the one before; two at least."""
    new = np.any(np.abs(np.diff(poses, axis=0)) > 1e-12, axis=1)
    kept = poses[np.concatenate([[True], new])]
    return kept if len(kept) > 1 else np.stack([poses[0], poses[-1]])
