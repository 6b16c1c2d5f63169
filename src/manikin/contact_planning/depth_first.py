"""Depth-first search with backtracking over changes of contact: the repair step of [Tonneau2015]_ 7.2.

A plan grows by one change at a time.  Each change is proposed, and accepted where its postures exist;
where none is accepted, the change before is taken back and the next one is tried in its place.  What a
body can do, and when it has arrived, is said by its :class:`Moves`: feet that step
(:mod:`manikin.contact_planning.extend`), or any limbs (:mod:`manikin.contact_planning.limb_extend`).
"""

from collections import Counter
from collections.abc import Iterator
from typing import Protocol, TypeVar

from manikin.contact_planning.extension import Extension, PartialPlan
from manikin.contact_planning.stage import ContactPlan

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


class Counted(Protocol):
    """What counts the postures it looks for, such as a :class:`~manikin.contact_planning.poser.Poser`."""

    searches: int


class SearchLog:
    """What a search has cost, and why changes were refused."""

    def __init__(self, poser: Counted, most: int) -> None:
        """Begin to count.

        Args:
            poser: Looks for postures, perhaps after other searches.
            most: Postures that may be looked for.
        """
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
            what: Could not be done.
            length: Of the guide [m].
            farthest: How far along it the root came [m].
            backtracks: Changes taken back.
        """
        reached = farthest / length if length > 0.0 else 0.0
        most = self._reasons.most_common(1)
        why = f"; most often: {most[0][0]}" if most else ""
        text = f"{what} beyond {100.0 * reached:.0f} % of it ({farthest:.2f} m){why}"
        return Extension(None, self.searches, backtracks, text, reached)


def search_depth_first(first: PartialPlan, moves: Moves[Change], log: SearchLog, length: float) -> Extension:
    """Grow a plan until it is finished, nothing is left to try, or the search is spent.

    Args:
        first: Where it begins.
        moves: What may change.
        log: Bounds and records the search; the moves refuse in it.
        length: Of the guide [m].
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
