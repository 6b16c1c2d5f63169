"""Initial guesses of a walking path: straight, turned, and around what is in the way."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from manikin.locomotion.objective import WalkObjective
from manikin.locomotion.obstacles import Walker, WalkObstacle
from manikin.locomotion.programme import DEGREE, Structure
from manikin.spatial import FloatArray

GUESSES = ("straight", "turning", "other first turn", "other last turn")
"""Guesses without obstacles: the heading turns evenly; or first to the goal, then along, then to its end; or
so with one of the turns the other way round, where that turn is nearly half a turn."""

_HALF_TURN = np.radians(150.0)
"""Turns from which the other way round is tried as well [rad]."""

_ASIDE = 0.1
"""Room that a detour leaves beside an obstacle [m]."""

_MANY = 2
"""Of more obstacles in the way than this, all are passed on one side or all on the other."""


def wrap(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def kinds_of_guesses(start: FloatArray, goal: FloatArray) -> list[str]:
    """Those of :data:`GUESSES` that make sense between two places (3,) x, y [m], heading [rad]."""
    turns = zip(GUESSES[2:], _turns(start, goal), strict=True)
    return [*GUESSES[:2], *(kind for kind, turn in turns if abs(turn) >= _HALF_TURN)]


def guess_path(
    structure: Structure, kind: str, start: FloatArray, goal: FloatArray, via: Sequence[FloatArray] = ()
) -> FloatArray:
    """Control points of a guess; the last one's heading may differ from the goal's by whole turns.

    Args:
        structure: Of the programme.
        kind: One of :data:`GUESSES`.
        start: (3,) x, y [m], heading [rad].
        goal: (3,) x, y [m], heading [rad].
        via: (2,) places to pass, in order [m].

    Returns:
        (n, 3).
    """
    knots = structure.knots
    shares = np.array([knots[i + 1 : i + DEGREE + 1].mean() for i in range(structure.pieces + DEGREE)])
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


def guess_duration(objective: WalkObjective, start: FloatArray, goal: FloatArray) -> float:
    """A duration somewhat above that of a straight walk [s]."""
    return 1.3 * objective.straight_duration(max(float(np.hypot(*(goal[:2] - start[:2]))), 0.3))


def detours(
    obstacles: Sequence[WalkObstacle],
    times: Sequence[float],
    walker: Walker,
    start: FloatArray,
    goal: FloatArray,
) -> Iterator[list[FloatArray]]:
    """Ways around obstacles, each a list of places to pass in order [m].

    Args:
        obstacles: Those in the way.
        times: When the walker is nearest to each [s].
        walker: Who must fit beside them.
        start: (3,) x, y [m], heading [rad].
        goal: (3,) x, y [m], heading [rad].
    """
    along = (goal[:2] - start[:2]) / np.hypot(*(goal[:2] - start[:2]))
    left = np.array([-along[1], along[0]])
    centres = [
        one.corners.mean(axis=0) + one.displacement(t) for one, t in zip(obstacles, times, strict=True)
    ]
    order = np.argsort([centre @ along for centre in centres])
    count = len(obstacles)
    sides = (
        itertools.product((1.0, -1.0), repeat=count)
        if count <= _MANY
        else ((s,) * count for s in (1.0, -1.0))
    )
    for choice in sides:
        via = [
            centres[i] + choice[i] * (obstacles[i].reach + walker.width / 2 + _ASIDE) * left for i in order
        ]
        if not _blocked(via, obstacles, walker):
            yield via


def turned_between(points: FloatArray, turn: float) -> FloatArray:
    """(n, 3) control points whose headings differ by ``turn`` [rad] on the way, to pass between obstacles."""
    share = np.linspace(0.0, 1.0, len(points))
    turned = points.copy()
    turned[:, 2] += turn * _smooth(share / 0.3) * _smooth((1.0 - share) / 0.3)
    return turned


def _turns(start: FloatArray, goal: FloatArray) -> tuple[float, float]:
    """Turns from the start's heading to the goal's direction, and from there to the goal's heading [rad]."""
    ahead = np.arctan2(*(goal[:2] - start[:2])[::-1])
    return wrap(ahead - start[2]), wrap(goal[2] - ahead)


def _other_way(turn: float) -> float:
    return turn - 2.0 * np.pi if turn > 0.0 else turn + 2.0 * np.pi


def _blocked(via: Sequence[FloatArray], obstacles: Sequence[WalkObstacle], walker: Walker) -> bool:
    """Whether a place to pass is in an obstacle that rests."""
    resting = [one for one in obstacles if not one.moves]
    points = np.array(via)[:, None, :]
    return any(bool(np.any(one.distance(points, np.zeros(len(via))) < walker.depth / 2)) for one in resting)


def _smooth(share: FloatArray) -> FloatArray:
    """``3 s^2 - 2 s^3``, from 0 to 1 and at rest at both ends."""
    s = np.clip(share, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)
