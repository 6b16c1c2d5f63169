"""Depth-first search with backtracking over changes of contact: the repair step of [Tonneau2015]_ 7.2.

A plan grows by one change at a time.  Each change is proposed, and accepted where its postures exist;
where none is accepted, the change before is taken back and the next one is tried in its place.  What a
body can do, and when it has arrived, is said by its :class:`Moves`, see
:mod:`manikin.planning.contacts.follow_guide`.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.planning.contacts.best_first import Extension, heading_of
from manikin.planning.contacts.contact_plan import ContactPlan, Stage
from manikin.planning.contacts.posture_finder import PostureFinder


@dataclass(frozen=True, eq=False)
class PartialPlan:
    """Contacts along a guide as far as they are planned.

    Attributes:
        stages: From the start on; at least that.
        along: How far along the guide the contact of each limb is, by effector or limb [m].
    """

    stages: tuple[Stage, ...]
    along: Mapping[str, float]

    @property
    def last(self) -> Stage:
        """The stage that it has come to."""
        return self.stages[-1]

    @property
    def here(self) -> float:
        """How far along the guide the root is: the mean of the contacts that are held [m]."""
        held = [self.along[name] for name in self.last.contacts]
        return float(np.mean(held)) if held else 0.0


TURN_LENGTH = 0.35
"""Way that a turn by one radian counts as [m]: turning on the spot takes steps, too."""


@dataclass(frozen=True, eq=False)
class GuideLine:
    """A guide: poses of the root with the length of the way to each.

    Attributes:
        poses: (n, 7) positions and quaternions xyzw.
        lengths: (n,) from the first one, with turns about the vertical counted [m].
    """

    poses: FloatArray
    lengths: FloatArray

    @classmethod
    def through(cls, poses: FloatArray) -> "GuideLine":
        """Line through (n, 7) poses that lie close together."""
        line = frozen_array(poses, "guide poses", (None, 7))
        headings = np.unwrap([heading_of(pose) for pose in line])
        way = np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1) + TURN_LENGTH * np.abs(np.diff(headings))
        return cls(line, frozen_array(np.concatenate([[0.0], np.cumsum(way)]), "guide lengths"))

    @property
    def length(self) -> float:
        """Length of the whole way [m]."""
        return float(self.lengths[-1])

    def at(self, length: float) -> FloatArray:
        """(7,) pose after a length of the way [m], held between zero and all of it."""
        where = float(np.clip(length, 0.0, self.length))
        last = min(max(int(np.searchsorted(self.lengths, where)), 1), len(self.lengths) - 1)
        span = self.lengths[last] - self.lengths[last - 1]
        share = 1.0 if span <= 0.0 else (where - self.lengths[last - 1]) / span
        pair = self.poses[last - 1 : last + 1]
        turn = Slerp([0.0, 1.0], Rotation.from_quat(pair[:, 3:]))(share).as_quat()
        return np.concatenate([(1.0 - share) * pair[0, :3] + share * pair[1, :3], turn])


Change = TypeVar("Change")


class Moves(Protocol[Change]):
    """The changes of contact of a body along a guide."""

    def proposals(self, partial: PartialPlan) -> Iterator[Change]:
        """Changes that may come next, the one to try first first."""
        ...

    def accepted(self, partial: PartialPlan, change: Change) -> PartialPlan | None:
        """The plan with one change more, or None where a posture is missing."""
        ...

    def finished(self, partial: PartialPlan) -> ContactPlan | None:
        """The whole plan where it has come to its goal, else None."""
        ...


class SearchLog:
    """Cost of a search, and why changes were refused."""

    def __init__(self, poser: PostureFinder, most: int) -> None:
        """Begin to count the postures that ``poser`` looks for, ``most`` at most."""
        self._poser, self._before, self._most = poser, poser.searches, most
        self._reasons: Counter[str] = Counter()

    @property
    def searches(self) -> int:
        """Postures looked for so far."""
        return self._poser.searches - self._before

    @property
    def is_spent(self) -> bool:
        """Whether no more may be looked for."""
        return self.searches >= self._most

    def refuse(self, reason: str) -> None:
        """Note why something could not be done."""
        self._reasons[reason] += 1

    def failure(self, what: str, length: float, farthest: float = 0.0, backtracks: int = 0) -> Extension:
        """A search without a plan, with its commonest reason.

        Args:
            what: What could not be done.
            length: Length of the guide [m].
            farthest: How far along it the root came [m].
            backtracks: Changes taken back.
        """
        reached = farthest / length if length > 0.0 else 0.0
        most = self._reasons.most_common(1)
        why = f"; most often: {most[0][0]}" if most else ""
        text = f"{what} beyond {100.0 * reached:.0f} % of it ({farthest:.2f} m){why}"
        return Extension(None, self.searches, backtracks, text, reached)


def search_depth_first(first: PartialPlan, moves: Moves[Change], log: SearchLog, length: float) -> Extension:
    """Grow a plan along a guide of a length [m] until it is done, nothing is left, or the search is spent.

    The log bounds and records the search; the moves refuse in it.
    """
    grown = [(first, _followers(first, moves, log))]
    backtracks, farthest = 0, 0.0
    while grown:
        partial, followers = grown[-1]
        farthest = max(farthest, partial.here)
        plan = moves.finished(partial)
        if plan is not None:
            return Extension(plan, log.searches, backtracks)
        following = None if log.is_spent else next(followers, None)
        if following is not None:
            grown.append((following, _followers(following, moves, log)))
        elif log.is_spent:
            what = f"no contacts after {log.searches} postures"
            return log.failure(what, length, farthest, backtracks)
        else:
            grown.pop()
            backtracks += 1
    return log.failure("no contacts follow the guide", length, farthest, backtracks)


def _followers(partial: PartialPlan, moves: Moves[Change], log: SearchLog) -> Iterator[PartialPlan]:
    """The plan with each accepted change, as long as the search is not spent."""
    for change in moves.proposals(partial):
        following = moves.accepted(partial, change)
        if following is not None:
            yield following
        if log.is_spent:
            return
