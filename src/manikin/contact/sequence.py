"""A sequence of stances with the bounds of their durations."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from manikin.contact.contact import Contact
from manikin.contact.stance import Stance
from manikin.display import Displayed
from manikin.errors import ContactError
from manikin.spatial import finite_number


@dataclass(frozen=True, eq=False)
class Phase:
    """A stance and how long it may last.

    Attributes:
        stance: The contacts held during the phase.
        min_duration: Lower bound [s], > 0.
        max_duration: Upper bound [s], or None.
    """

    stance: Stance
    min_duration: float = 0.1
    max_duration: float | None = None

    def __post_init__(self) -> None:
        finite_number(self.min_duration, "phase min_duration [s]", above=0.0, error=ContactError)
        if self.max_duration is not None:
            finite_number(
                self.max_duration, "phase max_duration [s]", at_least=self.min_duration, error=ContactError
            )


@dataclass(frozen=True, eq=False)
class Swing:
    """One flight of an effector from a contact it leaves to the one it makes.

    Attributes:
        effector: Name of the flying effector.
        first_phase: Index of the first phase in which it flies.
        last_phase: Index of the last one (inclusive).
        start: Contact left, or None when it was free from the beginning.
        end: Contact made, or None when it stays free to the end.
    """

    effector: str
    first_phase: int
    last_phase: int
    start: Contact | None
    end: Contact | None


@dataclass(frozen=True, eq=False, repr=False)
class StanceSequence(Displayed):
    """Stances in order; consecutive ones share what the motion holds on to.

    Attributes:
        phases: At least one phase.
    """

    phases: tuple[Phase, ...]

    def __init__(self, phases: Sequence[Phase]) -> None:
        if not phases:
            raise ContactError("stance sequence is empty; valid: at least one phase")
        for number, (before, after) in enumerate(itertools.pairwise(phases)):
            for contact in after.stance:
                name = contact.effector
                if name in before.stance and not contact.same_place(before.stance[name]):
                    raise ContactError(
                        f"effector {name!r} slides between phases {number} and {number + 1}; "
                        "valid: a phase without its contact in between"
                    )
        object.__setattr__(self, "phases", tuple(phases))

    def __len__(self) -> int:
        return len(self.phases)

    def __iter__(self) -> Iterator[Phase]:
        return iter(self.phases)

    def __getitem__(self, index: int) -> Phase:
        return self.phases[index]

    @property
    def effectors(self) -> tuple[str, ...]:
        """Every effector that is ever in contact, in order of first use."""
        return tuple(dict.fromkeys(name for phase in self.phases for name in phase.stance.effectors))

    def swings(self) -> tuple[Swing, ...]:
        """Every flight of every effector, ordered by its first phase."""
        found: list[Swing] = []
        for effector in self.effectors:
            found.extend(self._swings_of(effector))
        return tuple(sorted(found, key=lambda swing: (swing.first_phase, swing.effector)))

    def _swings_of(self, effector: str) -> Iterator[Swing]:
        held = [effector in phase.stance for phase in self.phases]
        index = 0
        while index < len(held):
            if held[index]:
                index += 1
                continue
            last = index
            while last + 1 < len(held) and not held[last + 1]:
                last += 1
            start = self.phases[index - 1].stance[effector] if index > 0 else None
            end = self.phases[last + 1].stance[effector] if last + 1 < len(held) else None
            yield Swing(effector, index, last, start, end)
            index = last + 1
