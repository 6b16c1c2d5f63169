"""Centre of mass and margins of two runs, phase by phase."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from manikin.comparison.timing import PhaseTime, TimingRow
from manikin.record import ComTrack
from manikin.spatial import FloatArray

SAMPLES = 101
"""Instants of each phase at which two centres of mass are compared."""


def matched_times(rows: Sequence[TimingRow]) -> tuple[FloatArray, FloatArray]:
    """(n,) instants of both runs at the same share of each phase that both have [s]."""
    share = np.linspace(0.0, 1.0, SAMPLES)
    pairs = [(row.first, row.second) for row in rows if row.first is not None and row.second is not None]
    first = [a.start_s + share * a.duration_s for a, _ in pairs]
    second = [b.start_s + share * b.duration_s for _, b in pairs]
    empty = np.zeros(0)
    return np.concatenate([empty, *first]), np.concatenate([empty, *second])


def com_difference(rows: Sequence[TimingRow], first: ComTrack, second: ComTrack) -> dict[str, Any] | None:
    """How two centres of mass differ; second less first, at equal shares of the matched phases.

    Returns:
        The ``com`` block of the JSON; None when no phase matches.
    """
    times_first, times_second = matched_times(rows)
    if not len(times_first):
        return None
    gap = second.at(times_second) - first.at(times_first)
    distance = np.linalg.norm(gap, axis=1)
    worst = int(np.argmax(distance))
    return {
        "max_distance_m": float(distance[worst]),
        "max_at_first_s": float(times_first[worst]),
        "max_at_second_s": float(times_second[worst]),
        "rms_distance_m": float(np.sqrt(np.mean(distance**2))),
        "mean_difference_m": gap.mean(axis=0).tolist(),
        "first": com_numbers(first),
        "second": com_numbers(second),
    }


def com_numbers(track: ComTrack) -> dict[str, Any]:
    """Size of one CoM motion."""
    steps = np.linalg.norm(np.diff(track.position, axis=0), axis=1)
    return {
        "path_length_m": float(steps.sum()),
        "height_min_m": float(track.position[:, 2].min()),
        "height_max_m": float(track.position[:, 2].max()),
        "speed_max_mps": float(np.linalg.norm(track.velocity, axis=1).max()),
    }


def margin_difference(rows: Sequence[TimingRow], first: ComTrack, second: ComTrack) -> dict[str, Any]:
    """Smallest margins of two runs in each phase; second less first.

    Returns:
        One entry of the ``margins`` block of the JSON. Differences are None where a run does not
        have the phase, or the two margins have different units.
    """
    comparable = first.margin_unit == second.margin_unit
    phases = []
    for row in rows:
        least = _least(first, row.first), _least(second, row.second)
        phases.append(
            {"first": least[0], "second": least[1], "difference": _difference(*least) if comparable else None}
        )
    whole = float(first.margin.min()), float(second.margin.min())
    return {
        "unit": first.margin_unit if comparable else None,
        "first_unit": first.margin_unit,
        "second_unit": second.margin_unit,
        "min_first": whole[0],
        "min_second": whole[1],
        "min_difference": whole[1] - whole[0] if comparable else None,
        "phases": phases,
    }


def _least(track: ComTrack, phase: PhaseTime | None) -> float | None:
    if phase is None:
        return None
    inside = (track.time >= phase.start_s - 1e-9) & (track.time < phase.end_s - 1e-9)
    return float(track.margin[inside].min()) if np.any(inside) else None


def _difference(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else second - first
