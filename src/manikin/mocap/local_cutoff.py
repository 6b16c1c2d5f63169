"""Smoothing without delay whose cutoff rises for a moment at each touch-down.

A foot that lands stops within a few hundredths of a second, the rest of a step is slow. One cutoff for all of
it smears the impact over the end of the single support before, or lets the noise of the markers through
where nothing happens. Here the cutoff is a function of time: the smooth values ``x`` minimise

    ``sum |x - y|^2 + sum lambda_k |x_(k-1) - 2 x_k + x_(k+1)|^2``,

which for one ``lambda`` is the filter of second order run forward and backward (the amplitude is halved at
the cutoff), and one banded system of equations for any other (Eilers, "A perfect smoother", Anal. Chem. 75,
2003).
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solveh_banded

from manikin.spatial import FloatArray

TOUCH_DOWN_CUTOFF = 8.0
"""Cutoff at a touch-down [Hz]."""

TOUCH_DOWN_WIDTH = 0.08
"""Time from a touch-down in which the cutoff falls to 1/e of its rise [s]."""


def local_cutoff(
    time: FloatArray,
    touch_downs: Sequence[float],
    cutoff: float,
    peak: float = TOUCH_DOWN_CUTOFF,
    width: float = TOUCH_DOWN_WIDTH,
) -> FloatArray:
    """(n,) cutoff at each instant [Hz]: a bell over each touch-down, the highest where they overlap.

    Args:
        time: (n,) instants [s].
        touch_downs: Instants [s].
        cutoff: Away from them [Hz].
        peak: At one [Hz]; none below ``cutoff``.
        width: Of the bell [s].
    """
    found = np.full(len(time), cutoff)
    for instant in touch_downs:
        found = np.maximum(found, cutoff + (peak - cutoff) * np.exp(-(((time - instant) / width) ** 2)))
    return found


def smooth(values: FloatArray, rate: float, cutoff: FloatArray) -> FloatArray:
    """(n, k) columns without what is faster than the cutoff of each instant.

    Both ends are continued as point reflections while smoothing, so that a straight line stays as it is.

    Args:
        values: (n, k), at least two instants at an even rate.
        rate: Of the instants [Hz].
        cutoff: (n,) frequency at which the amplitude is halved, below half the rate [Hz].
    """
    pad = min(len(values) - 1, int(np.ceil(2.0 * rate / float(cutoff.min()))))
    first, last = 2.0 * values[0] - values[pad:0:-1], 2.0 * values[-1] - values[-2 : -pad - 2 : -1]
    known = np.vstack([first, values, last])
    weight = (2.0 * np.sin(np.pi * np.pad(cutoff, pad, mode="edge")[1:-1] / rate)) ** -4.0
    second = np.array([1.0, -2.0, 1.0])
    bands = np.zeros((3, len(known)))
    bands[2] = 1.0
    for row in range(3):
        for column in range(row, 3):
            end = len(known) - 2 + column
            bands[2 + row - column, column:end] += weight * second[row] * second[column]
    smoothed = np.asarray(solveh_banded(bands, known), dtype=np.float64)
    return smoothed[pad : pad + len(values)]
