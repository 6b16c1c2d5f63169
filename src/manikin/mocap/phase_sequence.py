"""The phases of one motion, recorded or published, and their names."""

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

from manikin.mocap.recorded_supports import RecordedSupports, SupportPhase
from manikin.mocap.supports import FEET

FLIGHT = "flight"

STANCES = ("", "SS", "DS")
"""Nothing, single and double support, by the number of feet."""


@dataclass(frozen=True)
class PhaseSequence:
    """Phases of one motion, each beginning where the one before it ends.

    Attributes:
        name: Of the motion.
        group: What it is compared with: a person, a condition.
        phases: In their order.
        start_seen: Whether the first phase begins with a change of the supports, not with the recording.
        end_seen: Whether the last phase ends with a change of the supports.
    """

    name: str
    group: str
    phases: tuple[SupportPhase, ...]
    start_seen: bool = False
    end_seen: bool = False

    @classmethod
    def of(cls, name: str, group: str, supports: RecordedSupports) -> "PhaseSequence":
        """Phases of a recording, of which the first and the last are cut off by it."""
        return cls(name, group, supports.phases)

    def of_effectors(self, active: Collection[str]) -> "PhaseSequence":
        """The same with the supports of some effectors only: phases that then are alike become one.

        Hands that could be left out are passive supports, and phases are told by the feet
        ([Qiu2012]_ 3.2.1).
        """
        kept = (
            SupportPhase(one.start, one.end, tuple(name for name in one.effectors if name in active))
            for one in self.phases
        )
        return replace(self, phases=_merged(kept))

    def without_short(self, shortest: float) -> "PhaseSequence":
        """The same without phases shorter than ``shortest`` [s], whose time goes to the one before."""
        kept = list(self.phases[:1])
        for phase in self.phases[1:]:
            if phase.duration < shortest:
                kept[-1] = replace(kept[-1], end=phase.end)
            else:
                kept.append(phase)
        return replace(self, phases=_merged(kept))

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Of each phase, see :func:`kind_of`."""
        return tuple(kind_of(phase.effectors) for phase in self.phases)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Kind and number of each phase: DS-1, SS-1, DS-2 and so on ([Qiu2012]_ Fig. 3.8)."""
        seen: Counter[str] = Counter()
        labels = []
        for kind in self.kinds:
            seen[kind] += 1
            labels.append(f"{kind}-{seen[kind]}")
        return tuple(labels)

    @property
    def whole(self) -> tuple[bool, ...]:
        """Whether each phase is seen from its beginning to its end."""
        last = len(self.phases) - 1
        return tuple(
            (number > 0 or self.start_seen) and (number < last or self.end_seen)
            for number in range(len(self.phases))
        )

    @property
    def first_step(self) -> str | None:
        """The effector that touches down first; None if none does."""
        for before, after in pairwise(self.phases):
            for name in after.effectors:
                if name not in before.effectors:
                    return name
        return None


def kind_of(effectors: Iterable[str]) -> str:
    """Name of the kind of a phase: ``DS`` or ``SS`` by the feet, the others after a plus, or ``flight``."""
    names = list(effectors)
    feet = sum(name in FEET for name in names)
    parts = [STANCES[feet], *(name for name in names if name not in FEET)]
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
