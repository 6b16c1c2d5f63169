"""A guide that a person would take: no more detours, sinking and leaning than the scene asks for.

The refinement of [Tonneau2015]_ 6.3.2 makes a guide quick, and where a low trunk is as quick as an
upright one it stays low.  Here spans of the guide are straightened seen from above, and height and
pitch along them are chosen by dynamic programming, as near as possible to those of start and goal.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.numerics.spatial import FloatArray
from manikin.planning.guide.checker import ReachabilityChecker
from manikin.planning.guide.steering import LocalPlanner

_Z, _YAW, _PITCH = 2, 3, 4
_SEEN_FROM_ABOVE = [0, 1, 3, 5]  # x, y, yaw, roll


@dataclass(frozen=True)
class ComfortSettings:
    """Settings of the search for a comfortable guide; the values are our choice.

    Attributes:
        spacing: Between the poses that are looked at [m].
        spans: Spans that are straightened where that is possible: the whole, its parts, and random ones.
        lowest: How far below the line from start to goal the root may sink [m].
        height_step: Between heights that are tried [m].
        pitches: Pitches that are tried [rad].
        sinking: Depth that costs as much as a pitch of ``leaning`` [m].
        leaning: That pitch [rad].
        change: Cost of one height step or pitch step from one pose to the next.
    """

    spacing: float = 0.06
    spans: int = 14
    lowest: float = 0.65
    height_step: float = 0.065
    pitches: tuple[float, ...] = tuple(np.deg2rad((0.0, 15.0, 30.0, 45.0, 60.0)))
    sinking: float = 0.10
    leaning: float = float(np.deg2rad(20.0))
    change: float = 0.3


def relax(
    poses: FloatArray,
    planner: LocalPlanner,
    rng: np.random.Generator,
    settings: ComfortSettings | None = None,
) -> FloatArray:
    """Make a guide comfortable: (m, 7) poses that satisfy the condition, ``spacing`` apart or less.

    The given poses (n, 7) are close together; the ends stay.
    """
    settings = settings or ComfortSettings()
    line = _resampled(_coordinates(poses), settings.spacing)
    fractions = [(0.0, 1.0), (0.0, 0.5), (0.5, 1.0), (0.25, 0.75)]
    fractions += [tuple(sorted(pair)) for pair in rng.random((settings.spans - len(fractions), 2))]
    for number, (low, high) in enumerate(fractions):
        last = len(line) - 1
        line = _straightened(line, round(low * last), round(high * last), planner, settings)
        if number == 0 and len(line) != last + 1:
            break  # as short as it can be
    raised = _raised(line, planner, settings)
    return _poses(_smoothed(line if raised is None else raised, planner))


def nearest_fit(
    pose: FloatArray, checker: ReachabilityChecker, settings: ComfortSettings | None = None
) -> FloatArray | None:
    """The pose near a (7,) one, above the same place, that holds with least sinking and leaning, or None.

    A body may bend its back where the guide's stiff trunk has to sink or lean.
    """
    if checker.holds(pose):
        return pose
    settings = settings or ComfortSettings()
    depth, pitch = _choices(settings)
    line = np.repeat(_coordinates(pose[None]), len(depth), axis=0)
    line[:, _Z] -= depth
    line[:, _PITCH] += pitch
    poses = _poses(line)
    order = np.argsort(_comfort(depth, pitch, settings), kind="stable")
    return next((poses[row] for row in order if checker.holds(poses[row])), None)


def _choices(settings: ComfortSettings) -> tuple[FloatArray, FloatArray]:
    """Depths and pitches that are tried, each with each."""
    sunk = np.arange(0.0, settings.lowest + 1e-9, settings.height_step)
    depth, pitch = np.meshgrid(sunk, settings.pitches, indexing="ij")
    return depth.ravel(), pitch.ravel()


def _comfort(depth: FloatArray, pitch: FloatArray, settings: ComfortSettings) -> FloatArray:
    return (depth / settings.sinking) ** 2 + (pitch / settings.leaning) ** 2


def _coordinates(poses: FloatArray) -> FloatArray:
    """(n, 6) position and unwrapped yaw, pitch and roll."""
    angles = np.unwrap(Rotation.from_quat(poses[:, 3:]).as_euler("ZYX"), axis=0)
    return np.hstack([poses[:, :3], angles])


def _poses(line: FloatArray) -> FloatArray:
    return np.hstack([line[:, :3], Rotation.from_euler("ZYX", line[:, 3:]).as_quat()])


def _resampled(line: FloatArray, spacing: float) -> FloatArray:
    steps = np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1) + 0.3 * np.abs(np.diff(line[:, _YAW]))
    way = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(2, int(np.ceil(way[-1] / spacing)) + 1)
    at = np.linspace(0.0, way[-1], count)
    return np.column_stack([np.interp(at, way, column) for column in line.T])


def _straightened(
    line: FloatArray, low: int, high: int, planner: LocalPlanner, settings: ComfortSettings
) -> FloatArray:
    """The line with one span straight as seen from above, where a choice of heights and pitches holds."""
    if high - low < 2:
        return line
    share = np.linspace(0.0, 1.0, high - low + 1)[:, None]
    tried = (1.0 - share) * line[low] + share * line[high]
    if _way(tried) > _way(line[low : high + 1]) - 1e-6:
        return line
    tried = _raised(_resampled(tried, settings.spacing), planner, settings)
    return line if tried is None else np.vstack([line[:low], tried, line[high + 1 :]])


def _way(line: FloatArray) -> float:
    """Length of a line as seen from above, turns included [m]."""
    moves = np.diff(line[:, _SEEN_FROM_ABOVE], axis=0)
    return float(np.linalg.norm(moves[:, :2], axis=1).sum() + 0.3 * np.abs(moves[:, 2:]).sum())


def _raised(line: FloatArray, planner: LocalPlanner, settings: ComfortSettings) -> FloatArray | None:
    """The line with the heights and pitches that cost least, unchanged from above; None where none holds.

    The ends stay as they are.
    """
    ideal = np.linspace(line[0, _Z], line[-1, _Z], len(line))
    depth, pitch = _choices(settings)
    comfort = _comfort(depth, pitch, settings)
    moves = ((depth[:, None] - depth) / settings.height_step) ** 2
    moves += ((pitch[:, None] - pitch) / max(float(np.ptp(settings.pitches)), 1e-6) * 4.0) ** 2
    upright = int(np.argmin(comfort))
    total = np.full(len(depth), np.inf)
    total[upright] = 0.0
    came_from = []
    for row in range(1, len(line) - 1):
        tried = np.repeat(line[row : row + 1], len(depth), axis=0)
        tried[:, _Z], tried[:, _PITCH] = ideal[row] - depth, pitch
        allowed = np.array([planner.holds(pose) for pose in _poses(tried)])
        if not allowed.any():
            return None
        through = total[:, None] + settings.change * moves
        came_from.append(np.argmin(through, axis=0))
        total = np.where(allowed, through.min(axis=0) + comfort, np.inf)
    chosen = [int(np.argmin(total + settings.change * moves[upright]))]
    for back in reversed(came_from[1:]):
        chosen.append(int(back[chosen[-1]]))
    raised = line.copy()
    if len(line) > 2:
        raised[1:-1, _Z] = ideal[1:-1] - depth[chosen[::-1]]
        raised[1:-1, _PITCH] = pitch[chosen[::-1]]
    return raised


def _smoothed(line: FloatArray, planner: LocalPlanner) -> FloatArray:
    """Means over neighbours, where they hold."""
    line = line.copy()
    for _ in range(2):
        mean = line.copy()
        mean[1:-1] = (line[:-2] + 2.0 * line[1:-1] + line[2:]) / 4.0
        for row in range(1, len(line) - 1):
            if planner.holds(_poses(mean[row : row + 1])[0]):
                line[row] = mean[row]
    return line
