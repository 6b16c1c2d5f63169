"""The low-pass filter of recorded signals: Butterworth of second order, forward and backward.

Also here. Periodic signals as truncated Fourier series over a phase of period 1. Runs of frames in which
something holds. Mean, deviation and range of a measure over several motions.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import butter, sosfiltfilt

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray

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


def mask_runs(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First frame and the one after the last of each run, in order.

    Args:
        holds: (n,) whether it holds in each frame.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    return [(int(first), int(stop)) for first, stop in edges.reshape(-1, 2)]


def switch(closes: NDArray[np.bool_], opens: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) state of a switch that is open before the first frame; where both hold, it closes.

    Args:
        closes: (n,) whether it closes in each frame.
        opens: (n,) whether it opens.
    """
    state, states = False, np.zeros(len(closes), dtype=bool)
    for frame in range(len(states)):
        state = bool(closes[frame]) or (state and not opens[frame])
        states[frame] = state
    return states


def lasting(
    holds: NDArray[np.bool_], shortest: float, shortest_cut: float | None = None
) -> list[tuple[int, int]]:
    """Runs of at least ``shortest`` frames, interruptions of less ignored.

    Args:
        holds: (n,) whether it holds in each frame.
        shortest: Frames; what is missing before the first frame and behind the last is no interruption.
        shortest_cut: Frames of a run that begins with the first frame or ends with the last, of which a
            part is missing; as many as of any other if None.
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
    """How a measure is spread.

    Attributes:
        count: Of the values.
        mean: Of the values.
        deviation: Standard deviation of a sample, with count - 1; NaN for one value.
        smallest: Of the values.
        largest: Of the values.
    """

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
