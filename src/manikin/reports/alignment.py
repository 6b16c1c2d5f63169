"""Alignment of the phases of two runs by their contacts, with their key instants ([Qiu2012]_ Table 7.7)."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from manikin.contact import ContactSchedule, Stance

_SAME_PLACE = 1e-3
"""Preference of a pair whose contacts are nearer, small against that of one more pair."""


def align_phases(first: Sequence[Stance], second: Sequence[Stance]) -> list[tuple[int | None, int | None]]:
    """Every phase of two runs once, in order, with as many pairs as possible; None for one without a partner.

    Two phases can be paired when the same effectors are in contact, wherever; among alignments with equally
    many pairs the one whose contacts are nearest to each other is taken.
    """
    gain = np.array([[_likeness(a, b) for b in second] for a in first]).reshape(len(first), len(second))
    best = np.zeros((len(first) + 1, len(second) + 1))
    for i in range(len(first) - 1, -1, -1):
        for j in range(len(second) - 1, -1, -1):
            best[i, j] = max(best[i + 1, j], best[i, j + 1], gain[i, j] + best[i + 1, j + 1])
    rows: list[tuple[int | None, int | None]] = []
    i, j = 0, 0
    while i < len(first) or j < len(second):
        if i < len(first) and j < len(second) and best[i, j] == gain[i, j] + best[i + 1, j + 1]:
            rows.append((i, j))
            i, j = i + 1, j + 1
        elif j == len(second) or (i < len(first) and best[i, j] == best[i + 1, j]):
            rows.append((i, None))
            i += 1
        else:
            rows.append((None, j))
            j += 1
    return rows


def _likeness(a: Stance, b: Stance) -> float:
    """1 and a little more for near contacts; minus infinity for other effectors."""
    if set(a.effectors) != set(b.effectors):
        return -np.inf
    gaps = [float(np.linalg.norm(contact.position - b[contact.effector].position)) for contact in a]
    return 1.0 + _SAME_PLACE / (1.0 + float(np.mean(gaps)) if gaps else 1.0)


@dataclass(frozen=True)
class PhaseTime:
    """When a phase, by its index, is held: start and end are key instants [s]."""

    phase: int
    start_s: float
    end_s: float
    duration_s: float

    @classmethod
    def of(cls, schedule: ContactSchedule, phase: int | None) -> "PhaseTime | None":
        """Key instants of a phase of a schedule; None of no phase."""
        if phase is None:
            return None
        start, end = (float(instant) for instant in schedule.instants[phase : phase + 2])
        return cls(phase, start, end, end - start)


@dataclass(frozen=True)
class TimingRow:
    """A phase of both runs, or of one that the other does not have, with the effectors in contact."""

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
        difference = self.duration_difference_s
        return asdict(self) | {"supports": list(self.supports), "duration_difference_s": difference}


def matched(rows: Sequence[TimingRow]) -> list[tuple[PhaseTime, PhaseTime]]:
    """Phases of both runs, where both have one."""
    return [(row.first, row.second) for row in rows if row.first is not None and row.second is not None]


def timing_rows(first: ContactSchedule, second: ContactSchedule) -> tuple[TimingRow, ...]:
    """Aligned phases of two schedules with their key instants."""
    stances = [[phase.stance for phase in schedule.sequence] for schedule in (first, second)]
    rows = []
    for i, j in align_phases(*stances):
        stance = stances[0][i] if i is not None else stances[1][j or 0]
        rows.append(TimingRow(stance.effectors, PhaseTime.of(first, i), PhaseTime.of(second, j)))
    return tuple(rows)
