"""Motions at another sampling rate."""

from typing import Any

import numpy as np

from manikin.motion import Motion
from manikin.spatial import FloatArray, finite_number


def resample(motion: Motion, rate: float | None) -> Motion:
    """Return the motion at a constant rate, from its first instant on.

    Positions and rates are interpolated linearly, the pelvis' quaternion along the great
    arc, supports by the sample before.  At instants that the motion has, its own samples
    are returned exactly.

    Args:
        motion: The motion.
        rate: Samples per second [Hz], or None to leave it as it is.

    Raises:
        InputError: If the rate is not between 1 and 100,000 Hz.
    """
    if rate is None:
        return motion
    rate = finite_number(rate, "rate [Hz]", at_least=1.0, at_most=1e5)
    count = int(np.floor(motion.duration * rate + 1e-9)) + 1
    wanted = motion.time[0] + np.arange(count) / rate
    before, share = _places(motion.time, wanted)
    arrays: dict[str, Any] = {
        name: _linear(array, before, share) if array.dtype != np.bool_ else array[before]
        for name, array in motion.arrays().items()
    }
    arrays["time"] = wanted
    arrays["q"][:, 3:7] = _great_arc(motion.q[:, 3:7], before, share)
    return Motion(**arrays, contact_names=motion.contact_names, joint_names=motion.joint_names)


def _places(time: FloatArray, wanted: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Index of the sample before each instant and how far it is to the next (0 to 1)."""
    if len(time) == 1:
        return np.zeros(len(wanted), dtype=np.int64), np.zeros(len(wanted))
    before = np.clip(np.searchsorted(time, wanted + 1e-9, side="right") - 1, 0, len(time) - 2)
    share = np.clip((wanted - time[before]) / (time[before + 1] - time[before]), 0.0, 1.0)
    share = np.where(share < 1e-6, 0.0, np.where(share > 1.0 - 1e-6, 1.0, share))
    return before + (share == 1.0), np.where(share == 1.0, 0.0, share)


def _linear(array: FloatArray, before: np.ndarray, share: FloatArray) -> FloatArray:
    after = np.minimum(before + 1, len(array) - 1)
    weight = share.reshape(-1, *(1,) * (array.ndim - 1))
    return np.where(weight == 0.0, array[before], (1.0 - weight) * array[before] + weight * array[after])


def _great_arc(quaternion: FloatArray, before: np.ndarray, share: FloatArray) -> FloatArray:
    first, second = quaternion[before], quaternion[np.minimum(before + 1, len(quaternion) - 1)]
    cosine = np.sum(first * second, axis=1)
    second = np.where(cosine[:, None] < 0.0, -second, second)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.sin(angle)
    near = sine < 1e-9  # neighbours of a sampled motion are close: the chord is the arc
    sine = np.where(near, 1.0, sine)
    a = np.where(near, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    b = np.where(near, share, np.sin(share * angle) / sine)
    blended = a[:, None] * first + b[:, None] * second
    blended /= np.linalg.norm(blended, axis=1, keepdims=True)
    return np.where(share[:, None] == 0.0, first, blended)
