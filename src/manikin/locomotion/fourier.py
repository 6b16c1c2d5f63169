"""Periodic signals as truncated Fourier series over a phase of period 1."""

import numpy as np
from numpy.typing import ArrayLike

from manikin.spatial import FloatArray

HARMONICS = 8
"""Of a walking cycle; they leave out 0.4 degrees RMS of the recorded cycles in the median, 1.0 at most."""


def fourier_basis(phase: ArrayLike, harmonics: int = HARMONICS) -> FloatArray:
    """Values of ``1, cos 2 pi k p, ..., sin 2 pi k p, ...`` ([Truong2010]_ 6.1 with the period T).

    The thesis prints ``k pi t / T``, which has the period 2 T; a cycle of duration T is ``2 k pi t / T``
    with ``p = t / T``.

    Args:
        phase: (...) phases p, 1 a whole cycle.
        harmonics: Largest k.

    Returns:
        (..., 2 harmonics + 1).
    """
    angle = 2.0 * np.pi * np.asarray(phase, dtype=np.float64)[..., None] * np.arange(1, harmonics + 1)
    return np.concatenate([np.ones((*angle.shape[:-1], 1)), np.cos(angle), np.sin(angle)], axis=-1)


def fourier_coefficients(samples: FloatArray, harmonics: int = HARMONICS) -> FloatArray:
    """Coefficients of signals sampled at n even phases from 0, the last before 1.

    Args:
        samples: (n, s) of s signals, n > 2 harmonics.
        harmonics: Largest k kept.

    Returns:
        (2 harmonics + 1, s): mean, cosines, sines.
    """
    spectrum = np.fft.rfft(samples, axis=0)[: harmonics + 1] / len(samples)
    return np.concatenate([spectrum[:1].real, 2.0 * spectrum[1:].real, -2.0 * spectrum[1:].imag])


def shifted(coefficients: FloatArray, phase: float) -> FloatArray:
    """Coefficients of the same signals when what was at ``phase`` is at 0.

    Args:
        coefficients: (..., 2 harmonics + 1, s).
        phase: New zero.
    """
    harmonics = (coefficients.shape[-2] - 1) // 2
    angle = 2.0 * np.pi * phase * np.arange(1, harmonics + 1)[:, None]
    mean, cosine, sine = np.split(coefficients, [1, harmonics + 1], axis=-2)
    return np.concatenate([
        mean,
        cosine * np.cos(angle) + sine * np.sin(angle),
        sine * np.cos(angle) - cosine * np.sin(angle),
    ], axis=-2)  # fmt: skip
