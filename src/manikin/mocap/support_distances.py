"""How far the centre of mass is from what supports it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.mocap.recorded_clip import RecordedClip
from manikin.mocap.spread import Spread
from manikin.spatial import FloatArray, frozen_array

LIMIT = 1.08
"""Distance from the centre of mass to a foot within which motions are planned ([Qiu2012]_ Table 7.5) [m]."""


@dataclass(frozen=True, eq=False)
class SupportDistance:
    """Distance from the centre of mass to the place of one support while it supports.

    Attributes:
        clip: Name of the motion.
        effector: Which one.
        time: (k,) instants, at least one [s].
        distance: (k,) [m].
    """

    clip: str
    effector: str
    time: FloatArray
    distance: FloatArray

    def __post_init__(self) -> None:
        for name in ("time", "distance"):
            value = frozen_array(getattr(self, name), f"support distance {name}", (len(self.time),))
            object.__setattr__(self, name, value)

    @property
    def spread(self) -> Spread:
        """Over the instants [m]."""
        return Spread.of(self.distance)

    def share_within(self, limit: float = LIMIT) -> float:
        """Share of the instants at which the distance is not above a limit [m]."""
        return float(np.mean(self.distance <= limit))


def support_distances(clip: RecordedClip) -> tuple[SupportDistance, ...]:
    """Of each support, in their order; those too short for any instant are left out.

    The place of a foot's support is the middle of its sole on the ground, as in the thesis the projection of
    the foot's centre of mass ([Qiu2012]_ 3.2.3).
    """
    found = []
    for one in clip.supports.supports:
        within = (clip.time >= one.start - 1e-9) & (clip.time <= one.end + 1e-9)
        if within.any():
            distance = np.linalg.norm(clip.com[within] - one.place, axis=1)
            found.append(SupportDistance(clip.name, one.effector, clip.time[within], distance))
    return tuple(found)


def largest_distances(clips: Sequence[RecordedClip]) -> dict[str, Spread]:
    """The largest distance of each motion, by effector, over all motions ([Qiu2012]_ Table 3.5) [m]."""
    largest: dict[str, list[float]] = {}
    for clip in clips:
        own: dict[str, float] = {}
        for one in support_distances(clip):
            own[one.effector] = max(own.get(one.effector, 0.0), float(one.distance.max()))
        for effector, value in own.items():
            largest.setdefault(effector, []).append(value)
    return {effector: Spread.of(values) for effector, values in sorted(largest.items())}


def shares_within(clips: Sequence[RecordedClip], limit: float = LIMIT) -> dict[str, float]:
    """Share of all instants of all motions at which the distance is not above a limit, by effector."""
    every: dict[str, list[FloatArray]] = {}
    for clip in clips:
        for one in support_distances(clip):
            every.setdefault(one.effector, []).append(one.distance)
    return {name: float(np.mean(np.concatenate(each) <= limit)) for name, each in sorted(every.items())}
