"""The low-pass filter of recorded signals: Butterworth of second order, forward and backward."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from manikin.spatial import FloatArray

SHARES = 2.0
"""The rate to give for a cutoff that is a share of half the rate."""


def low_passed(
    values: NDArray[np.float64], cutoff: float, rate: float, padding: int | None = None
) -> FloatArray:
    """Values without fast changes and without delay ([Qiu2012]_ 3.2.1).

    Args:
        values: (n, ...), at least two, at an even rate.
        cutoff: Where each of the two passes halves the power [Hz]; above 0 and below half the rate.
        rate: Per second [Hz], or :data:`SHARES`.
        padding: Values by which each end is continued at most, by its mirror image about the last one; None
            for those of two periods of the cutoff.

    Returns:
        Of the same shape.
    """
    wanted = int(np.ceil(2.0 * rate / cutoff)) if padding is None else padding
    sections = _sections(float(cutoff), float(rate))
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=min(wanted, len(values) - 1)))


@lru_cache(maxsize=16)
def _sections(cutoff: float, rate: float) -> FloatArray:
    """The same for every signal of a recording."""
    return np.asarray(butter(2, cutoff, fs=rate, output="sos"), dtype=np.float64)
