"""Alignment of the phases of two runs by their contacts, with their key instants ([Qiu2012]_ Table 7.7)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.contact import ContactSchedule, Stance

_SAME_PLACE = 1e-3
"""Preference of a pair whose contacts are nearer, small against that of one more pair."""


@dataclass(frozen=True)
class PhasePair:
    """One row of an alignment.

    Attributes:
        first, second: Phase of each run, or None when it has none like that of the other.
    """

    first: int | None
    second: int | None

    @property
    def matched(self) -> bool:
        """Whether both runs have this phase."""
        return self.first is not None and self.second is not None


def align_phases(first: Sequence[Stance], second: Sequence[Stance]) -> tuple[PhasePair, ...]:
    """Align two sequences of stances, in order, so that as many phases as possible are paired.

    Two phases can be paired when the same effectors are in contact, wherever; among alignments
    with equally many pairs the one whose contacts are nearest to each other is taken.

    Returns:
        Every phase of both runs once, in order.
    """
    gain = np.array([[_likeness(a, b) for b in second] for a in first]).reshape(len(first), len(second))
    best = np.zeros((len(first) + 1, len(second) + 1))
    for i in range(len(first) - 1, -1, -1):
        for j in range(len(second) - 1, -1, -1):
            best[i, j] = max(best[i + 1, j], best[i, j + 1], gain[i, j] + best[i + 1, j + 1])
    rows, i, j = [], 0, 0
    while i < len(first) or j < len(second):
        if i < len(first) and j < len(second) and best[i, j] == gain[i, j] + best[i + 1, j + 1]:
            rows.append(PhasePair(i, j))
            i, j = i + 1, j + 1
        elif j == len(second) or (i < len(first) and best[i, j] == best[i + 1, j]):
            rows.append(PhasePair(i, None))
            i += 1
        else:
            rows.append(PhasePair(None, j))
            j += 1
    return tuple(rows)


def _likeness(a: Stance, b: Stance) -> float:
    """1 and a little more for near contacts; minus infinity for other effectors."""
    if set(a.effectors) != set(b.effectors):
        return -np.inf
    gaps = [float(np.linalg.norm(contact.position - b[contact.effector].position)) for contact in a]
    return 1.0 + _SAME_PLACE / (1.0 + float(np.mean(gaps)) if gaps else 1.0)


@dataclass(frozen=True)
class PhaseTime:
    """When one phase is held.

    Attributes:
        index: Of the phase.
        start_s, end_s: Key instants [s].
    """

    index: int
    start_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        """[s]."""
        return self.end_s - self.start_s

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        times = {"start_s": self.start_s, "end_s": self.end_s, "duration_s": self.duration_s}
        return {"phase": self.index, **times}


@dataclass(frozen=True)
class TimingRow:
    """A phase of both runs, or of one that the other does not have.

    Attributes:
        supports: Effectors in contact.
        first, second: In each run, or None.
    """

    supports: tuple[str, ...]
    first: PhaseTime | None
    second: PhaseTime | None

    @property
    def duration_difference_s(self) -> float | None:
        """Duration in the second run less that in the first [s]."""
        if self.first is None or self.second is None:
            return None
        return self.second.duration_s - self.first.duration_s

    def as_dict(self) -> dict[str, Any]:
        """The row as in the JSON of the command line."""
        return {
            "supports": list(self.supports),
            "first": None if self.first is None else self.first.as_dict(),
            "second": None if self.second is None else self.second.as_dict(),
            "duration_difference_s": self.duration_difference_s,
        }


def matched(rows: Sequence[TimingRow]) -> list[tuple[PhaseTime, PhaseTime]]:
    """Phases of both runs, where both have one."""
    return [(row.first, row.second) for row in rows if row.first is not None and row.second is not None]


def timing_rows(
    pairs: Sequence[PhasePair], first: ContactSchedule, second: ContactSchedule
) -> tuple[TimingRow, ...]:
    """Key instants of aligned phases of two schedules."""
    return tuple(
        TimingRow(_supports(pair, first, second), _time(first, pair.first), _time(second, pair.second))
        for pair in pairs
    )


def _supports(pair: PhasePair, first: ContactSchedule, second: ContactSchedule) -> tuple[str, ...]:
    if pair.first is not None:
        return first.sequence[pair.first].stance.effectors
    return second.sequence[pair.second or 0].stance.effectors


def _time(schedule: ContactSchedule, phase: int | None) -> PhaseTime | None:
    if phase is None:
        return None
    start, end = (float(instant) for instant in schedule.instants[phase : phase + 2])
    return PhaseTime(phase, start, end)
