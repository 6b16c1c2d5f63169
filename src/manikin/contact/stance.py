"""Stances, their sequences and schedules, and the rolling of feet over heel, full sole and toes.

Rolling feet are left open in [Qiu2012]_ 7.4.2; the expansion is our own. A foot lands on the edge of its heel
while the other one still stands on its full sole, and rises onto its toes when the other one already does: so
rolling never costs margin against single support.
"""

import itertools
from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.contact.contact import (
    Contact,
    ContactKind,
    ContactModel,
    FrictionModel,
    SolePart,
    default_normal_force_cap,
    sole_part,
)
from manikin.errors import ContactError
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, PlanarTransform, finite_number, frozen_array
from manikin.runtime.display import Displayed


@dataclass(frozen=True, eq=False, repr=False)
class Stance(Displayed):
    """A set of simultaneous contacts, one per effector.

    Attributes:
        contacts: The contacts, in a stable order.
        model: Friction cone and shared normal-force cap, which every stage and measurement obeys.
    """

    contacts: tuple[Contact, ...]
    model: ContactModel

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        cap = "none" if self.normal_force_cap is None else f"{self.normal_force_cap:.0f} N"
        contacts = " ".join(self.effectors)
        return {"contacts": contacts, "friction_model": self.friction_model, "normal_force_cap": cap}

    def __init__(
        self, contacts: Sequence[Contact], normal_force_cap: float | None = None,
        friction_model: FrictionModel = "outer", *, model: ContactModel | None = None,
    ) -> None:  # fmt: skip
        """Make a stance of one contact per effector (ContactError) with a contact model or its two values."""
        for item in contacts:
            if not isinstance(item, Contact):
                raise ContactError(f"stance contains {item!r}; valid: contacts made by sole, point or grasp")
        names = [contact.effector for contact in contacts]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ContactError(f"stance holds effector {twice[0]!r} twice; valid: one contact per effector")
        object.__setattr__(self, "contacts", tuple(contacts))
        object.__setattr__(self, "model", model or ContactModel(friction_model, normal_force_cap))

    def __len__(self) -> int:
        return len(self.contacts)

    def __iter__(self) -> Iterator[Contact]:
        return iter(self.contacts)

    def __contains__(self, effector: object) -> bool:
        return any(contact.effector == effector for contact in self.contacts)

    def __getitem__(self, effector: str) -> Contact:
        if effector not in self:
            raise KeyError(f"no contact of {effector!r}; this stance has {list(self.effectors)}")
        return next(contact for contact in self.contacts if contact.effector == effector)

    @property
    def effectors(self) -> tuple[str, ...]:
        """Names of the effectors in contact, in order."""
        return tuple(contact.effector for contact in self.contacts)

    @property
    def normal_force_cap(self) -> float | None:
        """Largest sum of the normal forces of all soles and points [N]; None leaves it to the contacts."""
        return self.model.normal_force_cap

    @property
    def friction_model(self) -> FrictionModel:
        """Friction model of all its soles and points."""
        return self.model.friction

    def with_contacts(self, contacts: Iterable[Contact]) -> "Stance":
        """Other contacts under the same contact model."""
        return Stance(tuple(contacts), model=self.model)

    def bounded(self, mass: float) -> "Stance":
        """The stance itself, with the default cap of a body's mass [kg] where a normal force has none."""
        if self.normal_force_cap is not None or all(
            contact.kind is ContactKind.GRASP or contact.normal_force_cap is not None for contact in self
        ):
            return self
        cap = default_normal_force_cap(mass)
        return Stance(self.contacts, model=replace(self.model, normal_force_cap=cap))


@dataclass(frozen=True, eq=False)
class CarriedLoad:
    """Point masses that effectors carry during a phase, rigidly held at the origins of their frames.

    Attributes:
        masses: [kg] by the name of the effector.
        offset: (3,) estimate of the masses' common centre from the body's CoM, world axes [m].
    """

    masses: Mapping[str, float]
    offset: FloatArray

    @property
    def mass(self) -> float:
        """Of all effectors [kg]."""
        return float(sum(self.masses.values()))


@dataclass(frozen=True, eq=False)
class ExertedForce:
    """What the hands do to an object of the scene during a phase.

    Attributes:
        kind: ``"push"`` or ``"pull"``.
        direction: (3,) unit, where the force on the object points, world axes.
    """

    kind: str
    direction: FloatArray


@dataclass(frozen=True, eq=False)
class Phase:
    """A stance and how long it may last.

    Attributes:
        stance: The contacts held during the phase.
        min_duration: Lower bound [s], > 0.
        max_duration: Upper bound [s], or None.
        load: What is carried during the phase and is no part of the body, or None.
        continues: Whether it is a further part of the phase before, which a rolling foot divides.
        exerts: What the hands push or pull during the phase, or None.
    """

    stance: Stance
    min_duration: float = 0.1
    max_duration: float | None = None
    load: CarriedLoad | None = None
    continues: bool = False
    exerts: ExertedForce | None = None

    def __post_init__(self) -> None:
        least, most = self.min_duration, self.max_duration
        finite_number(least, "phase min_duration [s]", above=0.0, error=ContactError)
        if most is not None:
            finite_number(most, "phase max_duration [s]", at_least=least, error=ContactError)


@dataclass(frozen=True, eq=False)
class Swing:
    """One flight of an effector from a contact it leaves to the one it makes.

    Attributes:
        effector: Name of the flying effector.
        first_phase, last_phase: Indices of the first and the last phase in which it flies.
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
    """At least one phase in order; consecutive stances share what the motion holds on to."""

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

    @property
    def begins(self) -> tuple[int, ...]:
        """Indices of the phases that are no further parts of those before: rolling feet divide some."""
        return tuple(number for number, phase in enumerate(self.phases) if not phase.continues)

    def swings(self) -> tuple[Swing, ...]:
        """Every flight of every effector, ordered by its first phase."""
        swings = (swing for effector in self.effectors for swing in self._swings_of(effector))
        return tuple(sorted(swings, key=lambda swing: (swing.first_phase, swing.effector)))

    def _swings_of(self, effector: str) -> Iterator[Swing]:
        free = np.array([effector not in phase.stance for phase in self.phases])
        for first, stop in mask_runs(free):
            start = self.phases[first - 1].stance[effector] if first > 0 else None
            end = self.phases[stop].stance[effector] if stop < len(free) else None
            yield Swing(effector, first, stop - 1, start, end)


@dataclass(frozen=True, eq=False, repr=False)
class ContactSchedule(Displayed):
    """A stance sequence with its key instants.

    Attributes:
        sequence: The stances, one per phase.
        instants: (phases + 1,) start of each phase and end of the last [s], increasing.
    """

    sequence: StanceSequence
    instants: FloatArray

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        return {"phases": str(len(self.sequence)), "end": f"{self.instants[-1]:.2f} s"}

    def __init__(self, sequence: StanceSequence, instants: ArrayLike) -> None:
        times = frozen_array(instants, "schedule instants [s]", (len(sequence) + 1,), ContactError)
        if not np.all(np.diff(times) > 0):
            raise ContactError(f"schedule instants are {times.tolist()}; valid: strictly increasing seconds")
        object.__setattr__(self, "sequence", sequence)
        object.__setattr__(self, "instants", times)

    @property
    def durations(self) -> FloatArray:
        """(phases,) duration of each phase [s]."""
        return np.diff(self.instants)

    @property
    def duration(self) -> float:
        """Duration of all phases [s]."""
        return float(self.instants[-1] - self.instants[0])

    def with_contacts(self, change: Callable[[Contact], Contact]) -> "ContactSchedule":
        """The schedule with every contact of every phase changed."""
        phases = [
            replace(phase, stance=phase.stance.with_contacts(map(change, phase.stance)))
            for phase in self.sequence
        ]
        return ContactSchedule(StanceSequence(phases), self.instants)

    def moved(self, transform: PlanarTransform) -> "ContactSchedule":
        """The schedule as seen from another frame; a contact that several phases hold stays one."""
        if transform.is_identity:
            return self
        placed = self.with_contacts(cache(lambda contact: contact.moved(transform)))
        phases = [_turned(phase, transform) for phase in placed.sequence]
        return ContactSchedule(StanceSequence(phases), self.instants)

    def phase_at(self, time: ArrayLike) -> NDArray[np.int64]:
        """Index of the phase ``[start, end)`` at each time [s]; outside, that of the first or the last."""
        return np.searchsorted(self.instants[1:-1], time, side="right")

    def phase_held(self, time: float) -> Phase:
        """The phase at one time [s], as of :meth:`phase_at`."""
        return self.sequence[bisect_right(self._changes, time)]

    def stance_at(self, time: float) -> Stance:
        """Return the stance held at ``time`` [s]."""
        return self.phase_held(time).stance

    @cached_property
    def _changes(self) -> list[float]:
        """Instants between the phases [s]."""
        return self.instants[1:-1].tolist()

    def support(self, time: ArrayLike, effectors: tuple[str, ...]) -> NDArray[np.bool_]:
        """(n, effectors) whether each effector is in contact at each time."""
        table = np.array([[name in phase.stance for name in effectors] for phase in self.sequence])
        return table[self.phase_at(np.atleast_1d(time))]

    def settling(self, time: ArrayLike, effector: str) -> NDArray[np.bool_]:
        """(n,) whether the contact of an effector may still slide to its place at each time."""
        times = np.atleast_1d(np.asarray(time, dtype=np.float64))
        settling, held = np.zeros(len(times), dtype=bool), False
        for phase, start in zip(self.sequence, self.instants, strict=False):
            if effector in phase.stance and not held:
                settling |= (times >= start) & (times < start + phase.stance[effector].settle)
            held = effector in phase.stance
        return settling

    def swing_interval(self, swing: Swing) -> tuple[float, float]:
        """Lift-off and landing time of a swing [s]."""
        return float(self.instants[swing.first_phase]), float(self.instants[swing.last_phase + 1])


ON_HEEL, FLAT, ON_TOES, ON_BALL = 0.08, 0.04, 0.14, 0.2
"""Least times of a rolling foot on the heel's edge, with both feet flat, on its toes before it leaves, and on
the ball of the foot after it has landed there [s]. A phase too brief for the first three has no flat part."""

STRETCH = 1.5
"""The phases on heel or toes last at most this many times their least time."""


BACK, STEP = 0.02, 0.05
"""Way behind, and above or below, its last place from which on a foot lands flat [m]; our choice."""

BALL_STEP = 0.25
"""Depth below the other one from which on a foot lands on its ball [m]; our choice."""


def roll_feet(sequence: StanceSequence, hinge: float, like: StanceSequence | None = None) -> StanceSequence:
    """Split every phase in which a foot lands or leaves beside another full contact.

    The parts' shares are taken from the split phase's least duration, which is never shortened. Soles are
    full, and the hinge of the toes crosses their x axes at ``hinge`` [m]. A foot that goes back leaves and
    lands flat; one that goes onto a step lands flat, and deep below the other one on its ball, which is
    reached with the other knee bent less. One that is left above the other rises onto its toes as soon as
    that has landed: flat, its ankle would have to bend farther than it can. Soles that hang over an edge land
    flat, and leave flat where their toes have nothing below them, in these stances or in those ``like`` them
    with soles of another size.
    """
    pairs = zip(sequence, sequence if like is None else like, strict=True)
    back = {(swing.first_phase - 1, swing.effector) for swing in sequence.swings() if _goes_back(swing)}
    rises = [
        {
            name
            for name in one.stance.effectors
            if (number, name) not in back and all(x.stance[name].rises_on_toes(hinge) for x in (one, other))
        }
        for number, (one, other) in enumerate(pairs)
    ]
    flat = {(swing.last_phase + 1, swing.effector) for swing in sequence.swings() if _lands_flat(swing)}
    parts = (_split(sequence, index, hinge, flat, rises[index]) for index in range(len(sequence)))
    return StanceSequence([
        replace(phase, continues=number > 0) for split in parts for number, phase in enumerate(split)
    ])  # fmt: skip


def _way(swing: Swing) -> FloatArray:
    """(3,) way of a foot, on the axes of the contact in which it ends; zero of one that is free at an end."""
    if swing.start is None or swing.end is None:
        return np.zeros(3)
    return (swing.end.position - swing.start.position) @ swing.end.rotation_contact_to_world


def _goes_back(swing: Swing) -> bool:
    """Whether a foot lands behind where it left, as it heads then."""
    return float(_way(swing)[0]) < -BACK


def _lands_flat(swing: Swing) -> bool:
    """Whether a foot lands behind where it left, or higher or lower."""
    return _goes_back(swing) or abs(float(_way(swing)[2])) > STEP


def _split(
    sequence: StanceSequence, index: int, hinge: float, flat: Collection[tuple[int, str]],
    rises: Collection[str],
) -> Iterator[Phase]:  # fmt: skip
    phase = sequence[index]
    stance = phase.stance
    landing = _changing(stance, sequence[index - 1].stance) if index > 0 else ()
    balls = tuple(name for name in landing if name in rises)
    landing = tuple(name for name in landing if (index, name) not in flat and not stance[name].hangs_over)
    leaving = _changing(stance, sequence[index + 1].stance) if index + 1 < len(sequence) else ()
    leaving = tuple(name for name in leaving if name in rises)
    if balls and not landing and _depth(stance, balls) > BALL_STEP:
        yield _on_part(phase, balls, SolePart.TOES, hinge, ON_BALL)
        least = max(phase.min_duration - ON_BALL, ON_TOES)
        most = None if phase.max_duration is None else max(phase.max_duration - ON_BALL, least)
        phase = replace(phase, min_duration=least, max_duration=most)
    if leaving and not landing and _height(stance, leaving) > STEP:
        toes = _on_part(phase, leaving, SolePart.TOES, hinge, ON_TOES)
        yield replace(phase, stance=toes.stance)
        return
    if landing and leaving and phase.min_duration < ON_HEEL + FLAT + ON_TOES:
        # In a brief one the heel that leaves rises as soon as the other foot has come down.
        yield _on_part(phase, landing, SolePart.HEEL, hinge, ON_HEEL)
        toes = _on_part(phase, leaving, SolePart.TOES, hinge, ON_TOES)
        least = max(phase.min_duration - ON_HEEL, FLAT)
        most = None if phase.max_duration is None else max(phase.max_duration - ON_HEEL, least)
        yield replace(toes, min_duration=least, max_duration=most)
        return
    # Without a landing on the heel there is more time for a rise onto the toes.
    rise = ON_TOES if landing else min(max(phase.min_duration - FLAT, ON_TOES), ON_TOES + ON_HEEL)
    taken = (ON_HEEL if landing else 0.0) + (rise if leaving else 0.0)
    if landing:
        yield _on_part(phase, landing, SolePart.HEEL, hinge, ON_HEEL)
    if landing or leaving:
        least = max(phase.min_duration - taken, FLAT)
        most = None if phase.max_duration is None else max(phase.max_duration - taken, least)
        yield replace(phase, min_duration=least, max_duration=most)
    else:
        yield phase
    if leaving:
        yield _on_part(phase, leaving, SolePart.TOES, hinge, rise)


def _depth(stance: Stance, feet: Sequence[str]) -> float:
    """How far the highest of some feet is below the lowest other contact [m]."""
    others = [other.position[2] for other in stance if other.effector not in feet]
    return float(min(others) - max(stance[name].position[2] for name in feet))


def _height(stance: Stance, feet: Sequence[str]) -> float:
    """How far the lowest of some feet is above the highest other contact [m]."""
    others = [other.position[2] for other in stance if other.effector not in feet]
    return float(min(stance[name].position[2] for name in feet) - max(others))


def _turned(phase: Phase, transform: PlanarTransform) -> Phase:
    """A phase with the directions of what it carries and exerts as seen from another frame."""
    load, force = phase.load, phase.exerts
    if load is not None:
        load = replace(load, offset=transform.directions(load.offset))
    if force is not None:
        force = replace(force, direction=transform.directions(force.direction))
    return replace(phase, load=load, exerts=force)


def _changing(stance: Stance, other: Stance) -> tuple[str, ...]:
    """Full soles that ``other`` lacks; none when nothing else would be left to stand on."""
    changing = tuple(
        item.effector
        for item in stance
        if item.kind is ContactKind.SOLE and item.part is SolePart.FULL and item.effector not in other
    )
    staying = [contact for contact in stance if contact.effector not in changing]
    return changing if any(contact.kind is ContactKind.SOLE for contact in staying) else ()


def _on_part(phase: Phase, effectors: Sequence[str], part: SolePart, hinge: float, least: float) -> Phase:
    contacts = [
        sole_part(contact, part, hinge) if contact.effector in effectors else contact
        for contact in phase.stance
    ]
    return Phase(phase.stance.with_contacts(contacts), least, STRETCH * least, phase.load)
