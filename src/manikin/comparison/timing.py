"""Key instants and supports of two runs ([Qiu2012]_ Table 7.7)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from manikin.comparison.alignment import PhasePair
from manikin.contact import ContactSchedule


@dataclass(frozen=True)
class PhaseTime:
    """When one phase is held.

    Attributes:
        index: Of the phase.
        start_s: [s].
        end_s: [s].
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
        return {
            "phase": self.index, "start_s": self.start_s, "end_s": self.end_s, "duration_s": self.duration_s,
        }  # fmt: skip


@dataclass(frozen=True)
class TimingRow:
    """A phase of both runs, or of one that the other does not have.

    Attributes:
        supports: Effectors in contact.
        first: In the first run, or None.
        second: In the second run, or None.
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


def timing_rows(
    pairs: Sequence[PhasePair], first: ContactSchedule, second: ContactSchedule
) -> tuple[TimingRow, ...]:
    """Key instants of aligned phases.

    Args:
        pairs: Alignment of the phases.
        first: Schedule of the first run.
        second: Schedule of the second run.
    """
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
