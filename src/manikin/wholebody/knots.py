"""Where the knots and the samples of a whole-body spline lie in time."""

import itertools
from collections.abc import Sequence

import numpy as np

from manikin.contact import ContactSchedule
from manikin.spatial import FloatArray

SUDDEN_KNOTS = np.array([-0.09, -0.06, -0.035, -0.015, 0.015, 0.035, 0.06, 0.09, 0.13])
"""Further knots around a touch-down at speed, from it [s]."""

CLOSEST_KNOTS = 4.0e-3
"""Knots closer than this are one [s]."""

NEAR_INSTANT = 0.1
"""Distance from a key instant up to which refined knots lie closer [s]."""


def touch_downs_at_speed(schedule: ContactSchedule) -> FloatArray:
    """(k,) times at which a contact is made that still has to settle [s]."""
    found = [
        float(start)
        for number, (phase, start) in enumerate(zip(schedule.sequence, schedule.instants, strict=False))
        if any(
            item.settle > 0.0 and (number == 0 or item.effector not in schedule.sequence[number - 1].stance)
            for item in phase.stance
        )
    ]
    return np.array(found)


def phase_knots(
    instants: FloatArray, spacing: float, degree: int, sudden: FloatArray | Sequence[float] = ()
) -> FloatArray:
    """Clamped knots with every key instant among them and at most ``spacing`` [s] apart.

    Args:
        instants: (phases + 1,) key instants [s].
        spacing: Largest distance of two knots [s].
        degree: Of the spline.
        sudden: Times around which the knots lie closer, because the motion changes suddenly [s].
    """
    fine = np.concatenate([np.zeros(0), *(time + SUDDEN_KNOTS for time in sudden)])
    breaks = np.unique(np.concatenate([instants, fine[(fine > instants[0]) & (fine < instants[-1])]]))
    breaks = breaks[np.append(True, np.diff(breaks) > CLOSEST_KNOTS)]
    inner: list[float] = []
    for start, end in itertools.pairwise(breaks):
        count = max(1, int(np.ceil((end - start) / spacing)))
        inner.extend(np.linspace(start, end, count, endpoint=False))
    ends = np.full(degree, instants[0]), np.full(degree + 1, instants[-1])
    return np.concatenate([ends[0], inner, ends[1]])


def refined(knots: FloatArray, instants: FloatArray, degree: int, within: float = NEAR_INSTANT) -> FloatArray:
    """Clamped knots with every span that is near a key instant split in two.

    Args:
        knots: Clamped knots of a spline of ``degree`` [s].
        instants: Key instants [s].
        degree: Of the spline.
        within: Distance up to which a span's middle is near [s].
    """
    breaks = np.unique(knots)
    middle = 0.5 * (breaks[:-1] + breaks[1:])
    near = np.abs(middle[:, None] - instants).min(axis=1) < within
    inner = np.sort(np.concatenate([breaks, middle[near & (np.diff(breaks) > 2.0 * CLOSEST_KNOTS)]]))
    return np.concatenate([np.full(degree, breaks[0]), inner, np.full(degree, breaks[-1])])


def sample_times(knots: FloatArray, per_span: int) -> FloatArray:
    """Times that split every knot span into equal parts, both ends included."""
    breaks = np.unique(knots)
    spans = [np.linspace(a, b, per_span, endpoint=False) for a, b in itertools.pairwise(breaks)]
    return np.append(np.concatenate(spans), breaks[-1])
