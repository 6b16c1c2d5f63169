"""Local planners: whether a simple way joins two poses ([Tonneau2015]_ 6.2.3).

Along the whole way the condition must hold. The two ends of a task may satisfy it without the margins that
planning keeps elsewhere, so near them the plain condition counts, checked at closer poses.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.planning.guide.checker import NO_MARGINS, ReachabilityChecker
from manikin.planning.guide.root_pose import angles_between, between

NEAR_WAY = 0.3
"""Distance from an end of the task within which the plain condition is enough [m]; our choice."""

NEAR_ANGLE = 0.5
"""Turn away from that end within which it is [rad]; our choice."""

FINER = 8
"""Checked poses per step where only the plain condition holds."""


@dataclass(frozen=True)
class Way:
    """Way that joins two poses: the share at which the root turns on the spot, or None when straight."""

    turn_at: float | None

    def reversed(self) -> "Way":
        """The way seen from its other end."""
        return self if self.turn_at is None else Way(1.0 - self.turn_at)


class LocalPlanner:
    """Straight and rotate-at-s ways between poses; near the ends of a task the plain condition is enough."""

    def __init__(self, checker: ReachabilityChecker, ends: Sequence[FloatArray] = ()) -> None:
        """Take a checker whose margins say how densely a way is checked.

        Raises:
            InputError: If a margin is zero.
        """
        if min(checker.margins.trunk, checker.margins.reach) <= 0.0:
            raise InputError(f"local planner has {checker.margins}; valid: margins > 0")
        self.checker, self.ends = checker, tuple(ends)

    @cached_property
    def plain(self) -> ReachabilityChecker:
        """Checker of the condition without margins."""
        kept = self.checker
        return ReachabilityChecker(kept.abstraction, kept.scene, kept.condition, NO_MARGINS)

    def holds(self, pose: FloatArray) -> bool:
        """Whether a pose (7,) satisfies the condition, near an end of the task the plain one."""
        return self.checker.holds(pose) or (self.near_end(pose) and self.plain.holds(pose))

    def near_end(self, pose: FloatArray) -> bool:
        """Whether a pose is so near an end of the task that the plain condition is enough."""
        return any(
            np.linalg.norm(pose[:3] - end[:3]) <= NEAR_WAY and angles_between(pose, end) <= NEAR_ANGLE
            for end in self.ends
        )

    def straight(self, first: FloatArray, second: FloatArray) -> bool:
        """Whether the condition holds along the straight way between poses that satisfy it, either way."""
        if tuple(first) > tuple(second):
            first, second = second, first
        way = float(np.linalg.norm(second[:3] - first[:3]))
        count = self.checker.steps(way, float(angles_between(first, second)))
        poses = between(first, second, np.arange(count + 1) / count)
        return self.poses_hold(poses, ends_hold=True)

    def poses_hold(self, poses: FloatArray, *, ends_hold: bool = False) -> bool:
        """Whether the condition holds along a densely sampled motion, asked near its middle first.

        Args:
            poses: (n, 7), as close to each other as :meth:`ReachabilityChecker.steps` tells.
            ends_hold: Whether the first and the last are known to satisfy it.
        """
        last = len(poses) - 1
        plain_only = []
        for index in _middle_first(len(poses)):
            known = ends_hold and not self.ends and index in (0, last)
            if known or self.checker.holds(poses[index]):
                continue
            if not (self.near_end(poses[index]) and self.plain.holds(poses[index])):
                return False
            plain_only.append(index)
        shares = np.arange(1, FINER) / FINER
        return all(
            self.plain.holds(pose)
            for index in plain_only
            for neighbour in (index - 1, index + 1)
            if 0 <= neighbour <= last
            for pose in between(poses[index], poses[neighbour], shares)
        )

    def waypoints(self, first: FloatArray, second: FloatArray, turn_at: float | None) -> FloatArray:
        """(2, 7) or (4, 7) poses that straight ways join from one pose (7,) to another.

        ``turn_at`` is the share of the way at which the root turns on the spot, or None for the straight way.
        """
        if turn_at is None:
            return np.stack([first, second])
        before = np.concatenate([(1.0 - turn_at) * first[:3] + turn_at * second[:3], first[3:]])
        after = np.concatenate([before[:3], second[3:]])
        return np.stack([first, before, after, second])

    def rotate_at(self, first: FloatArray, second: FloatArray, turn_at: float) -> bool:
        """Whether the condition holds along the rotate-at-s way, its turn on the spot included.

        From the other end the same way has ``1 - turn_at``.
        """
        points = self.waypoints(first, second, turn_at)
        if not (self.holds(points[1]) and self.holds(points[2])):
            return False
        return all(self.straight(a, b) for a, b in itertools.pairwise(points))

    def connect(self, first: FloatArray, second: FloatArray, turn_at: float) -> Way | None:
        """SIMPLEPATH: the straight way, else rotate-at-s at ``turn_at`` in (0, 1), else None.

        Both poses (7,) satisfy the condition.
        """
        if self.straight(first, second):
            return Way(None)
        if angles_between(first, second) > 1e-9 and self.rotate_at(first, second, turn_at):
            return Way(turn_at)
        return None


@cache
def _middle_first(count: int) -> list[int]:
    """0 ... count - 1 in an order that halves the gaps again and again."""
    order, intervals = [0, count - 1] if count > 1 else [0], [(0, count - 1)]
    for low, high in intervals:
        if high - low > 1:
            middle = (low + high) // 2
            order.append(middle)
            intervals += [(low, middle), (middle, high)]
    return order
