"""Feet that roll: each support of a foot as heel, full sole and toes ([Qiu2012]_ 7.4.2, left open there).

The expansion is our own. A foot lands on the edge of its heel while the other one still stands
on its full sole, and rises onto its toes when the other one already does: the admissible wrenches
of such a phase contain those of the full sole alone, so rolling never costs margin against
single support.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from manikin.contact.contact import Contact, ContactKind, SolePart, sole_part
from manikin.contact.sequence import Phase, StanceSequence
from manikin.contact.stance import Stance
from manikin.errors import ContactError
from manikin.spatial import finite_number


@dataclass(frozen=True)
class Rolling:
    """How feet roll.

    Attributes:
        heel: Least time on the heel's edge after landing [s].
        toes: Least time on the toes before lift-off [s].
        flat: Least time in between during which both feet lie flat [s].
        stretch: The phases on heel or toes last at most this many times their least time.
    """

    heel: float = 0.08
    toes: float = 0.14
    flat: float = 0.04
    stretch: float = 1.5

    def __post_init__(self) -> None:
        for name in ("heel", "toes", "flat"):
            finite_number(getattr(self, name), f"rolling {name} [s]", above=0.0, error=ContactError)
        finite_number(self.stretch, "rolling stretch", at_least=1.0, error=ContactError)


def roll_feet(sequence: StanceSequence, hinge: float, rolling: Rolling | None = None) -> StanceSequence:
    """Split every phase in which a foot lands or leaves beside another full contact.

    The phases of a foot keep its place; the parts' shares are taken from the split phase's least
    duration, which is never shortened.

    Args:
        sequence: Stances with full soles.
        hinge: Where the hinge of the toes crosses a sole's x axis [m].
        rolling: Least durations of the parts.
    """
    rolling = rolling or Rolling()
    phases: list[Phase] = []
    for index in range(len(sequence)):
        phases.extend(_split(sequence, index, hinge, rolling))
    return StanceSequence(phases)


def _split(sequence: StanceSequence, index: int, hinge: float, rolling: Rolling) -> Iterator[Phase]:
    phase = sequence[index]
    landing = _changing(phase.stance, sequence[index - 1].stance) if index > 0 else ()
    leaving = _changing(phase.stance, sequence[index + 1].stance) if index + 1 < len(sequence) else ()
    taken = (rolling.heel if landing else 0.0) + (rolling.toes if leaving else 0.0)
    if landing:
        stance = _with_part(phase.stance, landing, SolePart.HEEL, hinge)
        yield Phase(stance, rolling.heel, rolling.stretch * rolling.heel)
    if landing or leaving:
        least = max(phase.min_duration - taken, rolling.flat)
        most = None if phase.max_duration is None else max(phase.max_duration - taken, least)
        yield replace(phase, min_duration=least, max_duration=most)
    else:
        yield phase
    if leaving:
        stance = _with_part(phase.stance, leaving, SolePart.TOES, hinge)
        yield Phase(stance, rolling.toes, rolling.stretch * rolling.toes)


def _changing(stance: Stance, other: Stance) -> tuple[str, ...]:
    """Soles that ``other`` lacks; none when nothing else would be left to stand on."""
    changing = tuple(
        contact.effector
        for contact in stance
        if contact.kind is ContactKind.SOLE and contact.effector not in other
    )
    staying = [contact for contact in stance if contact.effector not in changing]
    return changing if any(contact.kind is ContactKind.SOLE for contact in staying) else ()


def _with_part(stance: Stance, effectors: tuple[str, ...], part: SolePart, hinge: float) -> Stance:
    contacts: list[Contact] = [
        sole_part(contact, part, hinge) if contact.effector in effectors else contact for contact in stance
    ]
    return stance.with_contacts(contacts)
