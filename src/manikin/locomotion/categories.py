"""Nine categories of goals, and how walks to them begin, end and differ ([Truong2010]_ 4.4, 4.5.1)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.locomotion.deviation import holonomic_ends, path_deviation
from manikin.locomotion.segmentation import (
    HOLONOMIC,
    NONHOLONOMIC,
    THESIS_RULE,
    SegmentationRule,
    segment_path,
)
from manikin.locomotion.shoulders import ShoulderPaths
from manikin.locomotion.targets import START
from manikin.spatial import FloatArray, finite_number, frozen_array

HEADINGS_DEG = {
    "LCF": 45, "MCF": 90, "HCF": 135, "LCS": 0, "MCS": 90, "HCS": 270, "LCB": 315, "MCB": 270, "HCB": 225,
}  # fmt: skip
"""Final heading by category where the start looks along y and the goal is to the right [deg]."""

_BEARINGS_DEG = {"F": (30.0, 45.0, 60.0), "S": (90.0,), "B": (120.0, 135.0, 150.0)}

BESIDE = 0.25
"""Goals less far ahead or behind are at the side [m]: half of the distance to the next row of goals."""

NEAR_HEADING = float(np.radians(22.5))
"""Final headings less far from that of a category belong to it [rad]: half of the angle between two."""


def seen_from(goals: ArrayLike, start: ArrayLike = START) -> FloatArray:
    """Goals in the frame of a start: x ahead, y to the left.

    Args:
        goals: (k, 3) x, y [m], heading [rad] in the world.
        start: (3,) the same.

    Returns:
        (k, 3) ahead, left [m], turn in (-pi, pi] [rad].
    """
    begin = frozen_array(start, "start [m, m, rad]", (3,))
    ends = frozen_array(goals, "goals [m, m, rad]", (None, 3))
    way, (sine, cosine) = ends[:, :2] - begin[:2], (np.sin(begin[2]), np.cos(begin[2]))
    turn = np.pi - np.mod(np.pi - (ends[:, 2] - begin[2]), 2.0 * np.pi)
    return np.column_stack([way @ [cosine, sine], way @ [-sine, cosine], turn])


def category_of(goal: ArrayLike, start: ArrayLike = START) -> str | None:
    """Category of a goal, or None if its heading is that of no category of its zone.

    F is in front, S at the side, B behind. LC, MC, HC are low, medium and high curvature of the way: it is
    bent least by a final heading in its own direction. The thesis gives the headings once, which makes sense
    for goals to the right; for goals to the left they are mirrored here. Goals straight ahead or behind count
    as being to the right.

    Args:
        goal: (3,) x, y [m], heading [rad].
        start: (3,) the same.
    """
    ahead, left, turn = seen_from([frozen_array(goal, "goal [m, m, rad]", (3,))], start)[0].tolist()
    zone = "F" if ahead >= BESIDE else "B" if ahead <= -BESIDE else "S"
    heading = np.pi / 2 + (-turn if left > 1e-9 else turn)
    for name, degrees in HEADINGS_DEG.items():
        if name[2] == zone and abs(np.angle(np.exp(1j * (heading - np.radians(degrees))))) < NEAR_HEADING:
            return name
    return None


def category_goals(distance: float) -> list[tuple[str, FloatArray]]:
    """Goals of the nine categories at one distance to the right of :data:`START`; mirrored ones are alike.

    The thesis shows the places of its goals in a drawing only (Fig. 4.14). Here they are 30, 45 and 60
    degrees from straight ahead, aside, and 30, 45 and 60 degrees from straight behind.

    Args:
        distance: From the start [m], at least 0.5.

    Returns:
        21 names of categories with goals, (3,) x, y [m], heading [rad].
    """
    radius = finite_number(distance, "distance of the goals [m]", at_least=2.0 * BESIDE)
    goals = []
    for name, degrees in HEADINGS_DEG.items():
        for bearing in np.radians(_BEARINGS_DEG[name[2]]):
            place = (START[0] + radius * np.sin(bearing), START[1] + radius * np.cos(bearing))
            goals.append((name, np.array([*place, np.radians(degrees)])))
    return goals


@dataclass(frozen=True)
class Spread:
    """Of lengths of several walks.

    Attributes:
        mean: [m].
        average_deviation: AD, mean distance from the mean [m].
        largest_deviation: MD, largest distance from the mean [m].
    """

    mean: float
    average_deviation: float
    largest_deviation: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "Spread":
        """Of at least one value."""
        away = np.abs(np.asarray(values) - np.mean(values))
        return cls(float(np.mean(values)), float(np.mean(away)), float(np.max(away)))


@dataclass(frozen=True)
class CategoryStatistics:
    """Walks to the goals of one category.

    Attributes:
        goals: Number of goals.
        walks: Number of walks.
        from_origin: PLO.
        to_goal: PLG.
        patterned: Share of the walks that are holonomic, then nonholonomic, then holonomic [-].
        holonomic: Mean share of the moving frames that are holonomic [-].
        average_deviation: ATD, the mean of the goals with several walks [m]; None if there is none.
        largest_deviation: MTD, the largest of these goals [m]; None if there is none.
    """

    goals: int
    walks: int
    from_origin: Spread
    to_goal: Spread
    patterned: float
    holonomic: float
    average_deviation: float | None
    largest_deviation: float | None


def category_statistics(
    walks: Iterable[tuple[ArrayLike, Sequence[ShoulderPaths]]],
    start: ArrayLike = START,
    rule: SegmentationRule = THESIS_RULE,
) -> dict[str, CategoryStatistics]:
    """Statistics by category of walks from one start; goals of no category are left out.

    Args:
        walks: Every goal, (3,) x, y [m], heading [rad], with the walks to it.
        start: (3,) of all walks.
        rule: By which the walks are cut into segments, off-line.

    Returns:
        Statistics by the names of :data:`HEADINGS_DEG`, in their order, of the categories that occur.

    Raises:
        InputError: If a goal has no walk.
    """
    groups: dict[str, list[Sequence[ShoulderPaths]]] = {name: [] for name in HEADINGS_DEG}
    for goal, found in walks:
        if not found:
            raise InputError(f"goal {np.asarray(goal).tolist()} has no walk; valid: at least one")
        name = category_of(goal, start)
        if name is not None:
            groups[name].append(found)
    return {name: _statistics(group, rule) for name, group in groups.items() if group}


def _statistics(group: Sequence[Sequence[ShoulderPaths]], rule: SegmentationRule) -> CategoryStatistics:
    segmented = [segment_path(walk, rule) for walks in group for walk in walks]
    ends = [holonomic_ends(one) for one in segmented]
    shares = [
        one.share(HOLONOMIC) / max(1e-9, one.share(HOLONOMIC) + one.share(NONHOLONOMIC)) for one in segmented
    ]
    spreads = [path_deviation(walks) for walks in group if len(walks) > 1]
    return CategoryStatistics(
        goals=len(group),
        walks=len(segmented),
        from_origin=Spread.of([one.from_origin for one in ends]),
        to_goal=Spread.of([one.to_goal for one in ends]),
        patterned=float(np.mean([one.pattern == "H-N-H" for one in segmented])),
        holonomic=float(np.mean(shares)),
        average_deviation=float(np.mean([one.average for one in spreads])) if spreads else None,
        largest_deviation=max(one.largest for one in spreads) if spreads else None,
    )
