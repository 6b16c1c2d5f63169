"""Signals: low-pass filter, Fourier series of periodic ones, least jerk, runs of frames, spread."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray

Share = TypeVar("Share", float, FloatArray)
HARMONICS = 8
"""Harmonics of a walking cycle; the rest of recorded cycles is 0.4 deg RMS in the median, 1.0 at most."""


def fourier_basis(phase: ArrayLike, harmonics: int = HARMONICS) -> FloatArray:
    """(..., 2 harmonics + 1) ``1, cos 2 pi k p, ..., sin 2 pi k p, ...`` ([Truong2010]_ 6.1, period T).

    The thesis prints ``k pi t / T``, of period 2 T. Phases are ``p = t / T`` (...), k is up to ``harmonics``.
    """
    angle = 2.0 * np.pi * np.asarray(phase, dtype=np.float64)[..., None] * np.arange(1, harmonics + 1)
    return np.concatenate([np.ones((*angle.shape[:-1], 1)), np.cos(angle), np.sin(angle)], axis=-1)


def fourier_coefficients(samples: FloatArray, harmonics: int = HARMONICS) -> FloatArray:
    """(2 harmonics + 1, s) mean, cosines, sines of signals (n, s) at n > 2 harmonics even phases from 0."""
    spectrum = np.fft.rfft(samples, axis=0)[: harmonics + 1] / len(samples)
    return np.concatenate([spectrum[:1].real, 2.0 * spectrum[1:].real, -2.0 * spectrum[1:].imag])


def shifted(coefficients: FloatArray, phase: float) -> FloatArray:
    """(..., 2 harmonics + 1, s) coefficients of the same signals with their phase 0 at ``phase``."""
    harmonics = (coefficients.shape[-2] - 1) // 2
    angle = 2.0 * np.pi * phase * np.arange(1, harmonics + 1)[:, None]
    mean, cosine, sine = np.split(coefficients, [1, harmonics + 1], axis=-2)
    c, s = np.cos(angle), np.sin(angle)
    return np.concatenate([mean, cosine * c + sine * s, sine * c - cosine * s], axis=-2)


def least_jerk(s: Share) -> tuple[Share, Share, Share]:
    """Share of a way from rest to rest that is done at a share of its time, and the first two derivatives.

    With the least jerk: ``10 s^3 - 15 s^4 + 6 s^5`` (Flash and Hogan 1985, J Neurosci 5:1688); of one share
    in [0, 1], or of each of several.
    """
    return (
        s**3 * (10.0 - 15.0 * s + 6.0 * s**2),
        30.0 * s**2 * (1.0 - s) ** 2,
        60.0 * s * (1.0 - 3.0 * s + 2.0 * s**2),
    )


def mask_runs(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First frame and the one after the last of each run of True in a mask (n,), in order."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    return [(int(first), int(stop)) for first, stop in edges.reshape(-1, 2)]


def switch(closes: NDArray[np.bool_], opens: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) whether a switch, at first open, is closed; where it both closes and opens, it closes."""
    state, states = False, np.zeros(len(closes), dtype=bool)
    for frame in range(len(states)):
        state = bool(closes[frame]) or (state and not opens[frame])
        states[frame] = state
    return states


def lasting(
    holds: NDArray[np.bool_], shortest: float, shortest_cut: float | None = None
) -> list[tuple[int, int]]:
    """Runs of at least ``shortest`` frames in a mask (n,), shorter interruptions ignored.

    Args:
        holds: The mask; what is missing before its first frame and behind its last is no interruption.
        shortest: Frames.
        shortest_cut: Least frames of a run that the begin or the end of the mask cuts; ``shortest`` if None.
    """
    held, last = holds.copy(), len(holds)
    for first, stop in mask_runs(~holds):
        if stop - first < shortest and first > 0 and stop < last:
            held[first:stop] = True
    cut = shortest if shortest_cut is None else shortest_cut
    return [
        (first, stop)
        for first, stop in mask_runs(held)
        if stop - first >= (cut if first == 0 or stop == last else shortest)
    ]


@dataclass(frozen=True)
class Spread:
    """Number, mean, range and ``deviation`` of values, as a sample: with count - 1, NaN for one value."""

    count: int
    mean: float
    deviation: float
    smallest: float
    largest: float

    @classmethod
    def of(cls, values: Iterable[float]) -> "Spread":
        """Spread of values.

        Raises:
            InputError: If there is none.
        """
        known = np.array(list(values), dtype=np.float64)
        if not known.size:
            raise InputError("spread of no value; valid: at least one")
        deviation = float(known.std(ddof=1)) if known.size > 1 else float("nan")
        return cls(known.size, float(known.mean()), deviation, float(known.min()), float(known.max()))

    @property
    def variation(self) -> float:
        """Coefficient of variation: deviation per mean."""
        return self.deviation / self.mean if self.mean else float("nan")

    def as_dict(self, unit: str) -> dict[str, float | int]:
        """For JSON, with the unit in the keys."""
        return {
            "count": self.count, f"mean_{unit}": self.mean, f"deviation_{unit}": self.deviation,
            "variation": self.variation, f"min_{unit}": self.smallest, f"max_{unit}": self.largest,
        }  # fmt: skip


SHARES = 2.0
"""Rate of :func:`low_passed` with which the cutoff is a share of half the actual rate."""


def low_passed(values: FloatArray, cutoff: float, rate: float, padding: int | None = None) -> FloatArray:
    """Values without fast changes and without delay ([Qiu2012]_ 3.2.1).

    Args:
        values: (n, ...), at least two, at an even rate.
        cutoff: Where each of the two passes halves the power [Hz]; above 0 and below half the rate.
        rate: Per second [Hz], or :data:`SHARES`.
        padding: Most values by which each end is continued, mirrored; None for two periods of the cutoff.
    """
    from scipy.signal import sosfiltfilt  # loaded when it is wanted: it takes 0.3 s

    wanted = int(np.ceil(2.0 * rate / cutoff)) if padding is None else padding
    sections = _sections(float(cutoff), float(rate))
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=min(wanted, len(values) - 1)))


@lru_cache(maxsize=16)
def _sections(cutoff: float, rate: float) -> FloatArray:
    """The same for every signal of a recording."""
    from scipy.signal import butter

    return np.asarray(butter(2, cutoff, fs=rate, output="sos"), dtype=np.float64)
