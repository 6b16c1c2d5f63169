"""Best-first search for contacts with whole postures along the best way only; what feet and limbs share.

A cheap search finds the best way through nodes, which are contacts that are held.  Whole postures are looked
for along it; where one is missing, the move is closed or made dearer, and the cheap search finds the next
best way.  A move that a later stage refuses is treated in the same way.
"""

from abc import ABC, abstractmethod
from collections import Counter
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.contact_plan import ContactPlan
from manikin.planning.contacts.posture_finder import PostureFinder

Node = TypeVar("Node")
Move = TypeVar("Move")


@dataclass(frozen=True, eq=False)
class Extension:
    """A contact plan, or why there is none.

    Attributes:
        searches: Postures that were looked for.
        backtracks: Ways of which a posture was missing, or changes taken back.
    """

    plan: ContactPlan | None
    searches: int
    backtracks: int
    failure: str | None = None


@dataclass(frozen=True)
class Refused:
    """Moves that were refused, by (n, 3) places of each [m], which others are like up to a distance [m]."""

    within: float
    places: list[FloatArray] = field(default_factory=list)

    def alike(self, places: FloatArray) -> int:
        """How many refused moves one is like that has places (n, 3) [m]."""
        away = np.linalg.norm(np.reshape(self.places, (-1, *places.shape)) - places, axis=2)
        return int((away < self.within).all(axis=1).sum())


class PosedSearch(ABC, Generic[Node, Move]):
    """Search for the best way whose postures exist; it can be asked again with more moves refused.

    Attributes:
        poser: Finds postures.
        reasons: Why postures are missing, and how often.
        replanned: Ways of which a posture was missing.
    """

    def __init__(self, poser: PostureFinder, most: int) -> None:
        """Begin to count the postures that ``poser`` looks for, ``most`` at most."""
        self.poser, self._before, self._most = poser, poser.searches, most
        self.reasons: Counter[str] = Counter()
        self.replanned = 0
        self._moves: list[Move | None] = []

    def run(self) -> Extension:
        """The best way whose postures exist, or why there is none."""
        while self._searches < self._most:
            way = self._best()
            if isinstance(way, str):
                return self._failed(way)
            plan = self._planned(way)
            if plan is not None:
                return Extension(plan, self._searches, self.replanned)
            self.replanned += 1
        return self._failed(f"no contacts after {self._searches} postures")

    def refuse(self, phase: int) -> bool:
        """Close the move of a phase of the last plan, and what is much like it; False where it has none."""
        move = self._moves[phase] if phase < len(self._moves) else None
        if move is None:
            return False
        self._close(move)
        return True

    @property
    def _searches(self) -> int:
        return self.poser.searches - self._before

    def _failed(self, what: str) -> Extension:
        often = "".join(f"; most often: {reason}" for reason, _ in self.reasons.most_common(1))
        return Extension(None, self._searches, self.replanned, f"{what}{self._farthest()}{often}")

    @abstractmethod
    def _best(self) -> list[Node] | str:
        """The best way, or why there is none."""

    @abstractmethod
    def _planned(self, way: list[Node]) -> ContactPlan | None:
        """Plan of a way; None where a posture is missing, whose move is closed then."""

    @abstractmethod
    def _close(self, move: Move) -> None:
        """Close a move, and what is much like it."""

    @abstractmethod
    def _farthest(self) -> str:
        """How far the search came, in words that follow what it did not find."""


def heading_of(pose: FloatArray) -> float:
    """Heading of a (7,) pose: direction of its x axis seen from above [rad]."""
    ahead, aside, _ = Rotation.from_quat(pose[3:]).as_matrix()[:, 0]
    return float(np.arctan2(aside, ahead))
