"""The zone of goals near the start that are walked to without a nonholonomic part ([Truong2010]_ 4.6)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.errors import InputError
from manikin.locomotion.categories import seen_from
from manikin.locomotion.segmentation import HOLONOMIC, NONHOLONOMIC, THESIS_RULE, PathSegments
from manikin.locomotion.targets import START
from manikin.spatial import FloatArray, frozen_array

THESIS_RADIUS = THESIS_RULE.diagonal_step
"""Of the zone that the thesis proposes from its recordings [m] ([Truong2010]_ Fig. 4.23)."""

STRAIGHT = float(np.radians(22.5))
"""Goals less far from straight ahead are left out [rad]: people walk to them straight."""

LARGEST_TURN = float(np.radians(22.5))
"""Goals with a larger turn are left out [rad]: to them one of the other seven headings is nearer."""


@dataclass(frozen=True, eq=False)
class HolonomicZone:
    """Goals and how holonomic the walks to them are.

    Attributes:
        goals: (k, 3) ahead, left [m], turn in (-pi, pi] [rad], in the frame of the start.
        shares: (k,) holonomic share of the moving frames of each walk [-].
        considered: (k,) whether a goal counts: neither behind, nor straight ahead, nor with a large turn.
    """

    goals: FloatArray
    shares: FloatArray
    considered: NDArray[np.bool_]

    @property
    def distances(self) -> FloatArray:
        """(k,) from the start [m]."""
        return np.hypot(self.goals[:, 0], self.goals[:, 1])

    @property
    def whole(self) -> NDArray[np.bool_]:
        """(k,) whether a walk is holonomic from its beginning to its end."""
        return self.shares >= 1.0

    @property
    def radius(self) -> float:
        """Distance up to which all goals that count are reached holonomically throughout [m], or 0."""
        return self._radius(self.considered)

    @property
    def farthest(self) -> float:
        """Distance of the farthest goal that counts and is reached holonomically throughout [m], or 0."""
        return float(np.max(self.distances[self.considered & self.whole], initial=0.0))

    def radius_towards(self, low: float, high: float) -> float:
        """Radius for the goals of a sector.

        Args:
            low: Smallest angle of the sector to either side of straight ahead [rad].
            high: Largest angle [rad].
        """
        aside = np.abs(np.arctan2(self.goals[:, 1], self.goals[:, 0]))
        return self._radius(self.considered & (aside >= low) & (aside <= high))

    def _radius(self, chosen: NDArray[np.bool_]) -> float:
        beyond = np.min(self.distances[chosen & ~self.whole], initial=np.inf)
        inside = chosen & self.whole & (self.distances < beyond - 1e-9)
        return float(np.max(self.distances[inside], initial=0.0))


def holonomic_zone(
    goals: ArrayLike,
    walks: Sequence[PathSegments],
    start: ArrayLike = START,
    *,
    largest_turn: float = LARGEST_TURN,
) -> HolonomicZone:
    """The zone around a start in which goals are reached holonomically, from segmented walks.

    As in the thesis, goals behind the start are not considered, nor those straight ahead, to which people
    just walk. The thesis says that large turns prevent a single step, but not from which on.

    Args:
        goals: (k, 3) x, y [m], heading [rad] of every walk's goal.
        walks: (k) segmented walks, better off-line.
        start: (3,) of all walks.
        largest_turn: Goals with a larger turn are left out [rad].

    Raises:
        InputError: If there are not as many goals as walks.
    """
    begin = frozen_array(start, "start [m, m, rad]", (3,))
    seen = seen_from(goals, begin)
    if len(seen) != len(walks):
        raise InputError(f"{len(seen)} goals of {len(walks)} walks; valid: one goal of each walk")
    shares = []
    for walk in walks:
        aside, ahead = walk.share(HOLONOMIC), walk.share(NONHOLONOMIC)
        shares.append(1.0 if ahead == 0.0 and aside > 0.0 else aside / max(1e-9, aside + ahead))
    angle = np.abs(np.arctan2(seen[:, 1], seen[:, 0]))
    considered = (
        (angle >= STRAIGHT - 1e-9) & (angle <= np.pi / 2 + 1e-9) & (np.abs(seen[:, 2]) <= largest_turn)
    )
    return HolonomicZone(
        frozen_array(seen, "goals of the zone"), frozen_array(shares, "shares of the zone"), considered
    )
