"""Which phase of one run is which phase of another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.contact import Stance

_SAME_PLACE = 1e-3
"""Preference of a pair whose contacts are nearer, small against that of one more pair."""


@dataclass(frozen=True)
class PhasePair:
    """One row of an alignment.

    Attributes:
        first: Phase of the first run, or None when it has none like it.
        second: Phase of the second run, or None.
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
