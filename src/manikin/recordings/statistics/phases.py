"""Phases of motions, recorded or published: their names, durations and sequences ([Qiu2012]_ chapter 3).

The published numbers are those of Tables 3.2, 3.4 and 3.5 and of the text. Table 3.4 gives the phases between
changes of the feet up to the last landing, without the last double support. A motion with three steps begins
with the left foot, one with four with the right foot: Table 3.2 says so of 01_TR_H1C1L_1; for 01_TR_H2C3L_1,
which is not in that table, it is inferred.
"""

import json
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib import resources
from itertools import accumulate, pairwise
from types import MappingProxyType
from typing import Any, Literal

from manikin.body.segments import FEET
from manikin.errors import InputError
from manikin.numerics.signals import Spread
from manikin.recordings.supports.body_supports import SupportPhase

FLIGHT = "flight"

STANCES = ("", "SS", "DS")
"""Nothing, single and double support, by the number of feet."""


@dataclass(frozen=True)
class PhaseSequence:
    """Phases of one motion of a group, each beginning where the one before it ends.

    Attributes:
        end_seen: Whether the last phase ends with a change of the supports, not with the recording. The first
            one begins with it.
    """

    name: str
    group: str
    phases: tuple[SupportPhase, ...]
    end_seen: bool = False

    def of_effectors(self, active: Collection[str]) -> "PhaseSequence":
        """The phases of the supports of some effectors only; equal neighbours become one.

        Hands that could be left out are passive supports; the feet define the phases ([Qiu2012]_ 3.2.1).
        """
        kept = (
            SupportPhase(one.start, one.end, tuple(name for name in one.effectors if name in active))
            for one in self.phases
        )
        return replace(self, phases=_merged(kept))

    def without_short(self, shortest: float) -> "PhaseSequence":
        """Sequence without phases shorter than ``shortest`` [s], whose time goes to the one before."""
        kept = list(self.phases[:1])
        for phase in self.phases[1:]:
            if phase.duration < shortest:
                kept[-1] = replace(kept[-1], end=phase.end)
            else:
                kept.append(phase)
        return replace(self, phases=_merged(kept))

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each phase, see :func:`kind_of`."""
        return tuple(kind_of(phase.effectors) for phase in self.phases)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Kind and number of each phase: DS-1, SS-1, DS-2 and so on ([Qiu2012]_ Fig. 3.8)."""
        return tuple(f"{kind}-{self.kinds[:end].count(kind)}" for end, kind in enumerate(self.kinds, start=1))

    @property
    def whole(self) -> tuple[bool, ...]:
        """Whether each phase is seen from its beginning to its end."""
        last = len(self.phases) - 1
        return tuple(number > 0 and (number < last or self.end_seen) for number in range(len(self.phases)))

    @property
    def first_step(self) -> str | None:
        """The effector that touches down first; None if none does."""
        pairs = pairwise(phase.effectors for phase in self.phases)
        return next((name for before, after in pairs for name in after if name not in before), None)


def kind_of(effectors: Iterable[str]) -> str:
    """Name of the kind of a phase: ``DS`` or ``SS`` by the feet, the others after a plus, or ``flight``."""
    names = list(effectors)
    parts = [STANCES[sum(name in FEET for name in names)], *(name for name in names if name not in FEET)]
    return "+".join(part for part in parts if part) or FLIGHT


def mirrored(effector: str) -> str:
    """Name of the effector on the other side; the same in the middle of the body."""
    for side, other in (("left_", "right_"), ("right_", "left_")):
        if effector.startswith(side):
            return other + effector.removeprefix(side)
    return effector


def _merged(phases: Iterable[SupportPhase]) -> tuple[SupportPhase, ...]:
    kept: list[SupportPhase] = []
    for phase in phases:
        if kept and set(kept[-1].effectors) == set(phase.effectors):
            kept[-1] = replace(kept[-1], end=phase.end)
        else:
            kept.append(phase)
    return tuple(kept)


By = Literal["number", "kind", "effectors"]
"""``number``: DS-1, SS-1, DS-2, for motions that begin alike; ``kind``: DS, SS; ``effectors``: by name."""

BYS: tuple[By, ...] = ("number", "kind", "effectors")


def phase_durations(sequences: Sequence[PhaseSequence], by: By = "number") -> dict[str, Spread]:
    """Durations of the phases of the same name over all motions ([Qiu2012]_ Table 3.4, Fig. 3.11) [s].

    Names, by a rule of :data:`BYS`, are in the order in which they appear. Phases that begin or end with the
    recording do not count.
    """
    if by not in BYS:
        raise InputError(f"phases by {by!r}; valid: {', '.join(BYS)}")
    values: dict[str, list[float]] = {}
    for one in sequences:
        for name, phase, whole in zip(names_of(one, by), one.phases, one.whole, strict=True):
            if whole:
                values.setdefault(name, []).append(phase.duration)
    return {name: Spread.of(durations) for name, durations in values.items()}


def names_of(one: PhaseSequence, by: By) -> tuple[str, ...]:
    """Name of each phase of a motion."""
    if by == "effectors":
        return tuple("+".join(phase.effectors) or FLIGHT for phase in one.phases)
    return one.labels if by == "number" else one.kinds


def by_group(sequences: Sequence[PhaseSequence]) -> dict[str, tuple[PhaseSequence, ...]]:
    """The motions of each group, in the order in which groups appear."""
    groups: dict[str, list[PhaseSequence]] = {}
    for one in sequences:
        groups.setdefault(one.group, []).append(one)
    return {group: tuple(members) for group, members in groups.items()}


Supporting = tuple[frozenset[str], ...]
"""The effectors that support in each phase, one after the other."""

SHORTEST = 0.03
"""A phase shorter than this may be an error of touch-downs and lift-offs [s]."""


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
    def mirrored_share(self) -> float:
        """Share of the motions with the most frequent sequence or its mirror image."""
        merged: Counter[Supporting] = Counter()
        for sequence, count in self.counts.items():
            image = mirror_image(sequence)
            merged[image if image in merged else sequence] += count
        return max(merged.values(), default=0) / max(self.motions, 1)


def sequence_consistency(
    motions: Sequence[PhaseSequence], *, phases: int | None = None, start: str | None = None
) -> SequenceConsistency:
    """Count the sequences of supports, of phases of :data:`SHORTEST` at least, and the first steps.

    Args:
        phases: How many phases are compared; None for all.
        start: Kind of the first compared phase, such as ``DS``, for recordings that begin anywhere: the first
            one that is seen from its beginning. None for the first phase of all.
    """
    lasting = [one.without_short(SHORTEST) for one in motions]
    compared = (_from(one, start)[:phases] for one in lasting)
    sequences = Counter(tuple(frozenset(phase.effectors) for phase in part) for part in compared)
    steps = Counter(one.first_step for one in lasting if one.first_step is not None)
    return SequenceConsistency(dict(sequences.most_common()), dict(steps.most_common()))


def mirror_image(sequence: Supporting) -> Supporting:
    """The sequence with left and right exchanged."""
    return tuple(frozenset(mirrored(name) for name in effectors) for effectors in sequence)


def initials(sequence: Supporting) -> str:
    """A sequence in short: ``LR R LR L``, hands in small letters, others by name, ``-`` in flight."""
    each = (sorted(map(_initial, one), key=lambda letter: (not letter.isupper(), letter)) for one in sequence)
    return " ".join("".join(letters) or "-" for letters in each)


def _from(one: PhaseSequence, kind: str | None) -> tuple[SupportPhase, ...]:
    if kind is None:
        return one.phases
    begins = (number for number in range(1, len(one.phases)) if one.kinds[number] == kind)
    return one.phases[next(begins, len(one.phases)) :]


def _initial(effector: str) -> str:
    side, _, part = effector.partition("_")
    if side not in ("left", "right") or part not in ("foot", "hand"):
        return f"({effector.replace('_', ' ')})"
    return side[0].upper() if part == "foot" else side[0]


MOTIONS = 30
"""All that were made by the person, and all that Table 3.5 is about."""

_FEET = {"LR": FEET, "L": FEET[:1], "R": FEET[1:]}


@dataclass(frozen=True)
class PublishedHeights:
    """Heights quoted in [Qiu2012]_ 3.2.3 ("about"), of the beams H1, H2 and H3 [m].

    Of the centre of mass they are ``standing`` before the motion, and ``lowest`` under each beam.
    """

    standing: float
    lowest: Mapping[str, float]
    beams: Mapping[str, float]


def published_phases(first_step: str | None = None) -> tuple[PhaseSequence, ...]:
    """The 30 motions of Table 3.4, grouped by beam and configuration such as H1C1.

    Times are those of the thesis: frames begin at 1 and a hundred of them are a second. A first step of
    ``left_foot`` or ``right_foot`` chooses the motions that begin with it. The means quoted in the thesis are
    those of ``left_foot`` in C1 and C2.
    """
    found = (_sequence(name, frames) for name, frames, *_ in _published()["table_3_4"])
    return tuple(one for one in found if first_step is None or one.first_step == first_step)


def published_consistency() -> SequenceConsistency:
    """Table 3.2: 24 motions of three people with free strategy in C1 and C2."""
    counts, steps = {}, {}
    for row in _published()["table_3_2"]:
        sequence = tuple(frozenset(_FEET[feet]) for feet in row["phases"])
        (first,) = sequence[0] - sequence[1]
        counts[sequence] = steps[first] = row["motions"]
    return SequenceConsistency(counts, steps)


def published_distances() -> dict[str, Spread]:
    """Table 3.5: largest distance from the centre of mass to each foot's contact in a motion [m]."""
    return {
        foot: Spread(MOTIONS, row["mean"], row["deviation"], row["min"], row["max"])
        for foot, row in _published()["table_3_5"].items()
    }


def published_heights() -> PublishedHeights:
    """Heights of the centre of mass and of the beams."""
    com, beams = _published()["com_m"], _published()["beam_heights_m"]
    return PublishedHeights(com["standing"], MappingProxyType(com["lowest"]), MappingProxyType(beams))


@cache
def _published() -> dict[str, Any]:
    file = resources.files("manikin.recordings") / "data" / "qiu_2012_chapter_3.json"
    return json.loads(file.read_text(encoding="utf-8"))


def _sequence(name: str, frames: Sequence[int]) -> PhaseSequence:
    data = _published()
    last = data["end_frames"].get(name)
    ends = [*accumulate(frames, initial=1), *([] if last is None else [last])]
    shorter, *_, longer = sorted((row["phases"] for row in data["table_3_2"]), key=len)
    feet = shorter if len(frames) < len(shorter) else longer
    phases = tuple(
        SupportPhase(start * data["frame_s"], end * data["frame_s"], _FEET[one])
        for (start, end), one in zip(pairwise(ends), feet, strict=False)
    )
    return PhaseSequence(name, name.removeprefix("01_TR_")[:4], phases, end_seen=last is None)
