"""Nine categories of goals, and how walks to them begin, end and differ ([Truong2010]_ 4.4, 4.5.1).

Walks to one goal are compared by their deviation from the mean and the lengths of their holonomic ends (4.4,
4.5); goals near the start that are reached without a nonholonomic part make up a zone (4.6).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.walking.path.walking_model import START
from manikin.walking.segmentation import (
    HOLONOMIC,
    NONHOLONOMIC,
    THESIS_RULE,
    PathSegments,
    ShoulderPaths,
    segment_path,
)


@dataclass(frozen=True)
class HolonomicEnds:
    """Lengths of the way before and after the nonholonomic part ([Truong2010]_ 4.9).

    Attributes:
        from_origin: PLO, from the origin to the end of the first holonomic part [m].
        to_goal: PLG, from the beginning of the last holonomic part to the goal [m].
    """

    from_origin: float
    to_goal: float
    length: float


def holonomic_ends(walk: PathSegments) -> HolonomicEnds:
    """Integrate the speed of the shoulders' middle up to the first nonholonomic frame, and from the last one.

    The print's sum (4.10) counts its points otherwise than its step; this is the trapezoidal rule between all
    instants. Standing before and after the walk belongs to its ends. Without any nonholonomic frame, both
    lengths are that of the whole way; a single one ends the first part, so walks are better cut off-line.
    """
    step = 1.0 / walk.paths.rate
    rates = np.asarray(np.gradient(walk.paths.middle, step, axis=0))
    speed = np.hypot(rates[:, 0], rates[:, 1])
    ahead = np.flatnonzero(walk.labels == NONHOLONOMIC)
    first, after = len(speed) - 1, 0
    if ahead.size:
        first, after = int(ahead[0]), min(int(ahead[-1]) + 1, len(speed) - 1)
    parts = speed[: first + 1], speed[after:], speed
    return HolonomicEnds(*(float(np.trapezoid(part, dx=step)) for part in parts))


@dataclass(frozen=True, eq=False)
class PathDeviation:
    """Several walks about their mean, at equal shares of their durations.

    Attributes:
        time: (n,) instants of the shortest walk [s].
        mean: (n, 2) mean path of the shoulders' middle [m] ([Truong2010]_ 4.7).
        deviation: (n,) TD, root mean square of the distances to the mean [m] ([Truong2010]_ 4.8).
    """

    time: FloatArray
    mean: FloatArray
    deviation: FloatArray

    @property
    def average(self) -> float:
        """ATD, mean of TD over time [m]."""
        return float(np.mean(self.deviation))

    @property
    def largest(self) -> float:
        """MTD, maximum of TD over time [m]."""
        return float(np.max(self.deviation))


def path_deviation(walks: Sequence[ShoulderPaths]) -> PathDeviation:
    """Mean path of two or more walks to one goal and how far they are from it ([Truong2010]_ 4.4).

    All are rescaled in time to the shortest one and interpolated linearly at as many instants as it has.
    The thesis calls TD a sum of distances; its formula, used here, is their root mean square.
    """
    if len(walks) < 2:
        raise InputError(f"deviation of {len(walks)} walks; valid: at least 2")
    shortest = min(walks, key=lambda walk: walk.time[-1])
    share = shortest.time / shortest.time[-1]
    lines = [[np.interp(share, w.time / w.time[-1], line) for line in w.middle.T] for w in walks]
    resampled = np.array(lines).transpose(0, 2, 1)
    mean = frozen_array(np.mean(resampled, axis=0), "mean path [m]")
    deviation = np.sqrt(np.mean(np.sum((resampled - mean) ** 2, axis=2), axis=0))
    return PathDeviation(shortest.time, mean, frozen_array(deviation, "deviation [m]"))


THESIS_RADIUS, HALF_EIGHTH = THESIS_RULE.diagonal_step, float(np.radians(22.5))
"""Radius of the zone that the thesis proposes from its recordings [m] ([Truong2010]_ Fig. 4.23), and half of
the angle between two of the eight final headings [rad]."""


@dataclass(frozen=True, eq=False)
class HolonomicZone:
    """k goals and how holonomic the walks to them are.

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
        """(k,) distances from the start [m]."""
        return np.hypot(self.goals[:, 0], self.goals[:, 1])

    @property
    def whole(self) -> NDArray[np.bool_]:
        """(k,) whether a walk is holonomic from its beginning to its end."""
        return self.shares >= 1.0

    @property
    def radius(self) -> float:
        """Distance up to which all goals that count are reached holonomically throughout [m], or 0."""
        return self.radius_towards(0.0, np.inf)

    @property
    def farthest(self) -> float:
        """Distance of the farthest goal that counts and is reached holonomically throughout [m], or 0."""
        return float(np.max(self.distances[self.considered & self.whole], initial=0.0))

    def radius_towards(self, low: float, high: float) -> float:
        """Radius for the goals between two angles to either side of straight ahead [rad], in metres."""
        aside = np.abs(np.arctan2(self.goals[:, 1], self.goals[:, 0]))
        chosen = self.considered & (aside >= low) & (aside <= high)
        beyond = np.min(self.distances[chosen & ~self.whole], initial=np.inf)
        inside = chosen & self.whole & (self.distances < beyond - 1e-9)
        return float(np.max(self.distances[inside], initial=0.0))


def holonomic_zone(
    goals: ArrayLike, walks: Sequence[PathSegments], *, largest_turn: float = HALF_EIGHTH
) -> HolonomicZone:
    """The zone around a start in which goals are reached holonomically, from segmented walks.

    As in the thesis, goals behind the start are not considered, nor those within :data:`HALF_EIGHTH` of
    straight ahead, to which people just walk. The thesis says that large turns prevent a single step, but
    not from which on.

    Args:
        goals: (k, 3) x, y [m], heading [rad] of every walk's goal.
        walks: (k) segmented walks from :data:`START`, better off-line; InputError if not as many as goals.
        largest_turn: Goals with a larger turn are left out [rad].
    """
    seen = frozen_array(seen_from(goals), "goals of the zone")
    if len(seen) != len(walks):
        raise InputError(f"{len(seen)} goals of {len(walks)} walks; valid: one goal of each walk")
    shares = frozen_array([_holonomic_share(walk) for walk in walks], "shares of the zone")
    angle = np.abs(np.arctan2(seen[:, 1], seen[:, 0]))
    considered = (angle >= HALF_EIGHTH - 1e-9) & (angle <= np.pi / 2 + 1e-9)
    return HolonomicZone(seen, shares, considered & (np.abs(seen[:, 2]) <= largest_turn))


def _holonomic_share(walk: PathSegments) -> float:
    """Holonomic share of the moving frames [-]."""
    aside, ahead = walk.share(HOLONOMIC), walk.share(NONHOLONOMIC)
    return aside / max(1e-9, aside + ahead)


HEADINGS_DEG = {
    "LCF": 45, "MCF": 90, "HCF": 135, "LCS": 0, "MCS": 90, "HCS": 270, "LCB": 315, "MCB": 270, "HCB": 225,
}  # fmt: skip
"""Final heading by category where the start looks along y and the goal is to the right [deg]."""

_BEARINGS_DEG = {"F": (30.0, 45.0, 60.0), "S": (90.0,), "B": (120.0, 135.0, 150.0)}

BESIDE = 0.25
"""Goals less far ahead or behind are at the side [m]: half of the distance to the next row of goals."""


def seen_from(goals: ArrayLike, start: ArrayLike = START) -> FloatArray:
    """(k, 3) ahead, left [m], turn in (-pi, pi] [rad] from a start to goals, x, y [m], heading [rad]."""
    begin = frozen_array(start, "start [m, m, rad]", (3,))
    ends = frozen_array(goals, "goals [m, m, rad]", (None, 3))
    way, (sine, cosine) = ends[:, :2] - begin[:2], (np.sin(begin[2]), np.cos(begin[2]))
    turn = np.pi - np.mod(np.pi - (ends[:, 2] - begin[2]), 2.0 * np.pi)
    return np.column_stack([way @ [cosine, sine], way @ [-sine, cosine], turn])


def category_of(goal: ArrayLike, start: ArrayLike = START) -> str | None:
    """Category of a goal (3,) seen from a start (3,), or None if its heading is that of none of its zone.

    F is in front, S at the side, B behind. LC, MC, HC are low, medium and high curvature of the way: it is
    bent least by a final heading in its own direction. The headings of the thesis make sense for goals to the
    right, as goals straight ahead or behind count; for goals to the left they are mirrored here.
    """
    ahead, left, turn = seen_from([frozen_array(goal, "goal [m, m, rad]", (3,))], start)[0].tolist()
    zone = "F" if ahead >= BESIDE else "B" if ahead <= -BESIDE else "S"
    heading = np.pi / 2 + (-turn if left > 1e-9 else turn)
    for name, degrees in HEADINGS_DEG.items():
        if name[2] == zone and abs(np.angle(np.exp(1j * (heading - np.radians(degrees))))) < HALF_EIGHTH:
            return name
    return None


def category_goals(distance: float) -> list[tuple[str, FloatArray]]:
    """21 goals, (3,) x, y [m], heading [rad], of the nine categories at one distance [m], at least 0.5.

    They are to the right of :data:`START`; mirrored ones are alike. The thesis shows their places in a
    drawing only (Fig. 4.14). Here they are 30, 45 and 60 degrees from straight ahead, aside, and 30, 45 and
    60 degrees from straight behind.
    """
    radius = finite_number(distance, "distance of the goals [m]", at_least=2.0 * BESIDE)
    return [
        (name, np.array([START[0] + radius * np.sin(b), START[1] + radius * np.cos(b), np.radians(degrees)]))
        for name, degrees in HEADINGS_DEG.items()
        for b in np.radians(_BEARINGS_DEG[name[2]])
    ]


@dataclass(frozen=True)
class CategorySpread:
    """Spread of a length over several walks [m].

    Attributes:
        average_deviation: AD, mean distance from the mean.
        largest_deviation: MD, largest distance from the mean.
    """

    mean: float
    average_deviation: float
    largest_deviation: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "CategorySpread":
        """Spread of at least one value [m]."""
        away = np.abs(np.asarray(values) - np.mean(values))
        return cls(float(np.mean(values)), float(np.mean(away)), float(np.max(away)))


@dataclass(frozen=True)
class CategoryStatistics:
    """Statistics of a number of walks to a number of goals of one category.

    Attributes:
        from_origin: Spread of PLO; ``to_goal`` is that of PLG.
        patterned: Share of the walks that are holonomic, then nonholonomic, then holonomic [-].
        holonomic: Mean share of the moving frames that are holonomic [-].
        average_deviation: ATD, the mean of the goals with several walks [m]; None if there is none.
        largest_deviation: MTD, the largest of these goals [m]; None if there is none.
    """

    goals: int
    walks: int
    from_origin: CategorySpread
    to_goal: CategorySpread
    patterned: float
    holonomic: float
    average_deviation: float | None
    largest_deviation: float | None


def category_statistics(
    walks: Iterable[tuple[ArrayLike, Sequence[ShoulderPaths]]],
) -> dict[str, CategoryStatistics]:
    """Statistics of walks from :data:`START` by the names of :data:`HEADINGS_DEG` that occur, in order.

    Given is every goal, (3,) x, y [m], heading [rad], with the walks to it, at least one; goals of no
    category are left out.
    """
    groups: dict[str, list[Sequence[ShoulderPaths]]] = {name: [] for name in HEADINGS_DEG}
    for goal, several in walks:
        if not several:
            raise InputError(f"goal {np.asarray(goal).tolist()} has no walk; valid: at least one")
        name = category_of(goal)
        if name is not None:
            groups[name].append(several)
    return {name: _statistics(group) for name, group in groups.items() if group}


def _statistics(group: Sequence[Sequence[ShoulderPaths]]) -> CategoryStatistics:
    segmented = [segment_path(walk) for walks in group for walk in walks]
    ends = [holonomic_ends(walk) for walk in segmented]
    spreads = [path_deviation(walks) for walks in group if len(walks) > 1]
    return CategoryStatistics(
        len(group), len(segmented),
        CategorySpread.of([item.from_origin for item in ends]),
        CategorySpread.of([item.to_goal for item in ends]),
        patterned=float(np.mean([walk.pattern == "H-N-H" for walk in segmented])),
        holonomic=float(np.mean([_holonomic_share(walk) for walk in segmented])),
        average_deviation=float(np.mean([item.average for item in spreads])) if spreads else None,
        largest_deviation=max((item.largest for item in spreads), default=None),
    )  # fmt: skip
