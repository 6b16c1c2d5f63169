"""Frames in which a marker was not seen: finding them, and filling the short ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from manikin.mocap.runs import runs
from manikin.spatial import FloatArray

LONGEST_GAP = 0.1
"""Longest gap that is filled when nothing else is said [s]: feet stay within about a centimetre."""

NEIGHBOURS = 6
"""Frames on either side of a gap that its filling looks at."""


@dataclass(frozen=True)
class Gap:
    """One run of frames without a marker.

    Attributes:
        marker: Its name.
        first: First frame without it.
        stop: First frame with it again, or the number of frames.
    """

    marker: str
    first: int
    stop: int

    def __len__(self) -> int:
        """Number of frames without the marker."""
        return self.stop - self.first


def gaps_of(seen: NDArray[np.bool_], names: Sequence[str]) -> tuple[Gap, ...]:
    """Gaps, marker by marker.

    Args:
        seen: (n, m) whether each marker was seen.
        names: (m,) of the markers.
    """
    return tuple(
        Gap(names[marker], first, stop)
        for marker in np.flatnonzero(~seen.all(axis=0)).tolist()
        for first, stop in runs(~seen[:, marker])
    )


def filled(positions: FloatArray, longest: int) -> FloatArray:
    """Positions with the gaps of up to ``longest`` frames filled.

    A gap is filled by the cubic spline through the :data:`NEIGHBOURS` frames nearest to it on either side
    in which the marker was seen. One with fewer than two such frames on a side, as at the ends of the
    recording, stays.

    Args:
        positions: (n, m, 3) [m], NaN in gaps.
        longest: Frames of the longest gap to be filled.

    Returns:
        (n, m, 3) [m].
    """
    found = np.array(positions)
    for marker in range(positions.shape[1]):
        seen = ~np.isnan(positions[:, marker, 0])
        frames = np.flatnonzero(seen)
        for first, stop in runs(~seen):
            after = int(np.searchsorted(frames, first))
            used = frames[max(after - NEIGHBOURS, 0) : after + NEIGHBOURS]
            if stop - first <= longest and 2 <= after <= len(frames) - 2:
                found[first:stop, marker] = CubicSpline(used, positions[used, marker])(np.arange(first, stop))
    return found
