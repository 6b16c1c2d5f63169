"""How alike several walks to one goal are, and how long their holonomic ends are ([Truong2010]_ 4.4, 4.5)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.errors import InputError
from manikin.locomotion.segmentation import NONHOLONOMIC, PathSegments
from manikin.locomotion.shoulders import ShoulderPaths
from manikin.spatial import FloatArray, frozen_array


@dataclass(frozen=True)
class HolonomicEnds:
    """Lengths of the way before and after what is nonholonomic ([Truong2010]_ 4.9).

    Attributes:
        from_origin: PLO, from the origin to the end of the first holonomic part [m].
        to_goal: PLG, from the beginning of the last holonomic part to the goal [m].
        length: Of the whole way [m].
    """

    from_origin: float
    to_goal: float
    length: float


def holonomic_ends(found: PathSegments) -> HolonomicEnds:
    """Integrate the speed of the shoulders' middle up to the first nonholonomic frame, and from the last one.

    The print's sum (4.10) counts its points otherwise than its step; this is the trapezoidal rule between all
    instants. Standing before and after the walk belongs to its ends. Without any nonholonomic frame, both
    lengths are that of the whole way.

    Args:
        found: A segmented walk, better off-line: a single nonholonomic frame ends the first part.
    """
    paths = found.paths
    rates = np.asarray(np.gradient(paths.middle, 1.0 / paths.rate, axis=0))
    speed = np.hypot(rates[:, 0], rates[:, 1])
    ahead = np.flatnonzero(found.labels == NONHOLONOMIC)
    if ahead.size:
        first, after = int(ahead[0]), min(int(ahead[-1]) + 1, len(speed) - 1)
    else:
        first, after = len(speed) - 1, 0
    whole, begin, end = (
        float(np.trapezoid(part, dx=1.0 / paths.rate)) for part in (speed, speed[: first + 1], speed[after:])
    )
    return HolonomicEnds(begin, end, whole)


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
    """Mean path of several walks and how far they are from it ([Truong2010]_ 4.4).

    All are rescaled in time to the shortest one and interpolated linearly at as many instants as it has.
    The thesis calls TD a sum of distances; its formula, used here, is their root mean square.

    Args:
        walks: At least two, from the same start to the same goal.

    Raises:
        InputError: If there are fewer than two walks.
    """
    if len(walks) < 2:
        raise InputError(f"deviation of {len(walks)} walks; valid: at least 2")
    shortest = min(walks, key=lambda walk: walk.time[-1])
    share = shortest.time / shortest.time[-1]
    resampled = np.array(
        [[np.interp(share, w.time / w.time[-1], line) for line in w.middle.T] for w in walks]
    ).transpose(0, 2, 1)
    mean = np.mean(resampled, axis=0)
    deviation = np.sqrt(np.mean(np.sum((resampled - mean) ** 2, axis=2), axis=0))
    return PathDeviation(
        shortest.time, frozen_array(mean, "mean path [m]"), frozen_array(deviation, "deviation [m]")
    )
