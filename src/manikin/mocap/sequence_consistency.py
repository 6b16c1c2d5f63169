"""How many people do it in the same order."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from manikin.mocap.phase_sequence import PhaseSequence, mirrored
from manikin.mocap.recorded_supports import SupportPhase

Supporting = tuple[frozenset[str], ...]
"""The effectors that support in each phase, one after the other."""

SHORTEST = 0.03
"""A phase shorter than this is not told from an error of touch-downs and lift-offs [s]."""


@dataclass(frozen=True)
class SequenceConsistency:
    """Sequences of supports of several motions ([Qiu2012]_ Table 3.2).

    Attributes:
        counts: Motions of each sequence, the most frequent first.
        first_steps: Motions in which each effector touched down first; those without any are left out.
    """

    counts: Mapping[Supporting, int]
    first_steps: Mapping[str, int]

    @property
    def motions(self) -> int:
        """How many there are."""
        return sum(self.counts.values())

    @property
    def modal(self) -> Supporting:
        """The most frequent sequence; empty without motions."""
        return next(iter(self.counts), ())

    @property
    def modal_share(self) -> float:
        """Share of the motions that have it."""
        return self.counts[self.modal] / self.motions if self.counts else 0.0

    @property
    def mirrored_counts(self) -> Mapping[Supporting, int]:
        """As ``counts``, with a sequence and its mirror image counted as one, the more frequent of both."""
        merged: Counter[Supporting] = Counter()
        for sequence, count in self.counts.items():
            image = mirror_image(sequence)
            merged[image if image in merged else sequence] += count
        return dict(merged.most_common())

    @property
    def mirrored_share(self) -> float:
        """Share of the motions with the most frequent sequence or its mirror image."""
        return max(self.mirrored_counts.values(), default=0) / max(self.motions, 1)

    @property
    def first_step_share(self) -> float:
        """Share of the motions with a step whose first one is made by the most frequent effector."""
        total = sum(self.first_steps.values())
        return max(self.first_steps.values()) / total if total else 0.0


def sequence_consistency(
    motions: Sequence[PhaseSequence],
    *,
    phases: int | None = None,
    shortest: float = SHORTEST,
    start: str | None = None,
) -> SequenceConsistency:
    """Count the sequences of supports and the first steps.

    Args:
        motions: Those of one group, or all.
        phases: How many phases are looked at; None for all. Recordings that end anywhere differ in their
            length and not in their order.
        shortest: Phases shorter than this are passed over [s].
        start: Kind of the phase from which on they are looked at, such as ``DS``, for recordings that begin
            anywhere: the first one that is seen from its beginning. None for the first phase of all.
    """
    lasting = [one.without_short(shortest) for one in motions]
    sequences = Counter(
        tuple(frozenset(phase.effectors) for phase in _from(one, start)[:phases]) for one in lasting
    )
    steps = Counter(one.first_step for one in lasting if one.first_step is not None)
    return SequenceConsistency(dict(sequences.most_common()), dict(steps.most_common()))


def mirror_image(sequence: Supporting) -> Supporting:
    """The sequence with left and right exchanged."""
    return tuple(frozenset(mirrored(name) for name in effectors) for effectors in sequence)


def initials(sequence: Supporting) -> str:
    """A sequence in short: ``LR R LR L``, hands in small letters, others by name, ``-`` in flight."""
    return " ".join("".join(sorted(map(_initial, one), key=_feet_first)) or "-" for one in sequence)


def _from(one: PhaseSequence, kind: str | None) -> tuple[SupportPhase, ...]:
    if kind is None:
        return one.phases
    first = 0 if one.start_seen else 1
    begins = (number for number in range(first, len(one.phases)) if one.kinds[number] == kind)
    return one.phases[next(begins, len(one.phases)) :]


def _initial(effector: str) -> str:
    side, _, part = effector.partition("_")
    if side not in ("left", "right") or part not in ("foot", "hand"):
        return f"({effector.replace('_', ' ')})"
    return side[0].upper() if part == "foot" else side[0]


def _feet_first(initial: str) -> tuple[int, str]:
    return (0 if initial.isupper() else 1, initial)
