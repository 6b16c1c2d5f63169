"""Postures held for long."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from manikin.spatial import FloatArray

LONG = 60.0
"""A posture held for longer than this is static [s] ([McAtamney1993]_, [Hignett2000]_)."""

STILL = np.deg2rad(10.0)
"""A posture is held as long as no angle leaves a band of this width [rad]; ours."""

RATE = 5.0
"""Rate at which postures are compared [Hz]."""


def held(
    time: FloatArray, angles: FloatArray, duration: float = LONG, band: float = STILL
) -> NDArray[np.bool_] | None:
    """Whether each frame belongs to a posture that is held for long.

    Args:
        time: (n,) increasing [s].
        angles: (n, k) [rad].
        duration: Shortest time that counts [s].
        band: Width of the band that every angle stays in [rad].

    Returns:
        (n,), or None of a motion that is too short to tell.
    """
    if time[-1] - time[0] < duration:
        return None
    even = np.arange(time[0], time[-1] + 0.5 / RATE, 1.0 / RATE)
    even_angles = np.column_stack([np.interp(even, time, column) for column in angles.T])
    size = round(duration * RATE) + 1  # samples of a window that begins and ends on one
    if size > len(even):
        return None
    middle = slice(size // 2, size // 2 + len(even) - size + 1)
    spread = maximum_filter1d(even_angles, size, axis=0) - minimum_filter1d(even_angles, size, axis=0)
    starts = np.flatnonzero(np.all(spread[middle] <= band, axis=1))
    steps = np.zeros(len(even) + 1)
    np.add.at(steps, starts, 1.0)
    np.add.at(steps, starts + size, -1.0)
    inside = np.cumsum(steps[:-1]) > 0
    return inside[np.clip(np.rint((time - even[0]) * RATE).astype(int), 0, len(even) - 1)]
