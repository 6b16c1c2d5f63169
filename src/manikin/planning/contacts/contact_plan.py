"""A sequence of contacts with a posture for every change, as the searches find it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from manikin.balance.capturability import Momentum
from manikin.body import BodyModel, Configuration, Limb
from manikin.contact import (
    Contact,
    ContactKind,
    ContactModel,
    ContactSchedule,
    Phase,
    Stance,
    StanceSequence,
    grasp,
    point,
    sole,
)
from manikin.errors import ContactError
from manikin.numerics.spatial import FloatArray, frozen_array

Contacts = Mapping[str, Contact]
"""Contacts by their effectors."""

_RECTANGLE = np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])


@dataclass(frozen=True)
class ContactRules:
    """Friction of contacts and the strength of grasps.

    Attributes:
        friction: Coulomb coefficient of soles and points.
        grasp_force: Largest force of a grasp along each world axis [N].
        grasp_moment: Largest moment of a grasp along each world axis [N.m].
        patch: Part of a foot's sole that has to touch, as its start and end along the sole's x axis and its
            width [m]; the whole sole when None. A climber stands on the front of the feet.
        stiff: Place on the sole's x axis up to which a foot does not bend, and may stand on a rung [m]; None
            where it stands on none.
    """

    friction: float = 0.7
    grasp_force: float = 400.0
    grasp_moment: float = 10.0
    patch: tuple[float, float, float] | None = None
    stiff: float | None = None


def footprint(
    body: BodyModel, limb: Limb, kind: ContactKind, rules: ContactRules | None = None
) -> FloatArray:
    """(c, 3) points of the effector's frame that must lie on the surface [m].

    The limb's own patch goes before the body's soles, of which the rules may ask for a part only.

    Raises:
        ContactError: If a sole is asked for of a body without soles.
    """
    if kind is not ContactKind.SOLE:
        return np.zeros((1, 3))
    if limb.patch is not None:
        return _RECTANGLE * 0.5 * np.array([*limb.patch, 0.0])
    if body.sole_length is None or body.sole_width is None:
        raise ContactError(f"body {body.name!r} has no soles; valid: a contact of kind point or grasp")
    if rules is not None and rules.patch is not None:
        start, end, side = *rules.patch[:2], 0.5 * rules.patch[2]
        return np.array([[end, side, 0.0], [end, -side, 0.0], [start, -side, 0.0], [start, side, 0.0]])
    return _RECTANGLE * 0.5 * np.array([body.sole_length, body.sole_width, 0.0])


def make_contact(
    body: BodyModel, limb: Limb, kind: ContactKind, position: FloatArray, rotation: FloatArray,
    rules: ContactRules,
) -> Contact:  # fmt: skip
    """Contact of a limb's effector at (3,) [m], turned by (3, 3) effector-to-world, whose z is the normal.

    Raises:
        ContactError: If a value is out of its range, or a sole is asked for of a body without.
    """
    name = limb.effector
    if kind is ContactKind.GRASP:
        force, moment = rules.grasp_force, rules.grasp_moment
        return grasp(name, position, max_force=force, max_moment=moment, rotation=rotation)
    if kind is ContactKind.POINT:
        return point(name, position, friction=rules.friction, rotation=rotation)
    length, width = 2.0 * footprint(body, limb, kind)[0, :2]
    whole = sole(name, position, length=length, width=width, friction=rules.friction, rotation=rotation)
    if rules.patch is None or limb.patch is not None:
        return whole
    return replace(whole, points=frozen_array(footprint(body, limb, kind, rules), "sole's patch [m]", (4, 3)))


TILTING = 0.35  # share of a phase in which a foot that leaves or lands on its toes tilts; our choice
COM_ROOM = (0.06, 0.06, 0.03)  # way of the centre of mass off its posture when a phase begins [m]; our choice
HINGE_PACE, COM_PACE = 1.3, 0.4  # see Paces; our choice


@dataclass(frozen=True)
class Paces:
    """How fast contacts follow one another; the values are our choice.

    Attributes:
        swing_duration: Shortest flight of a limb [s].
        swing_speed: Its mean speed on longer ways [m/s].
        shift_duration: Shortest time between two flights [s].
        hinge_pace: Mean speed of the hinge that turns most [rad/s].
        com_pace: Mean speed of the centre of mass between two postures [m/s].
        com_acceleration: Largest acceleration of the centre of mass from rest to rest [m/s^2].
    """

    swing_duration: float = 0.7
    swing_speed: float = 0.7
    shift_duration: float = 0.35
    hinge_pace: float = HINGE_PACE
    com_pace: float = COM_PACE
    com_acceleration: float = math.inf

    def flight(self, before: Contact, after: Contact) -> float:
        """Duration of a limb's flight from one contact to another [s]."""
        way = float(np.linalg.norm(after.position - before.position))
        return max(self.swing_duration, way / self.swing_speed)


@dataclass(frozen=True, eq=False)
class Stage:
    """The contacts of one phase and the posture with which it begins.

    Attributes:
        contacts: By effector.
        q: (nq,) posture that holds the contacts of this phase and of the one before.
        com: (3,) its centre of mass [m].
        min_duration: Shortest time that the phase should last [s].
        com_room: How far from there the centre of mass of a motion may be, along x, y and z [m].
        via: (nq,) posture in the middle of the phase, in which the limb that moves is off everything; None
            where the plan has none.
        momentum: Motion with which the phase begins, where its contacts could not carry the body at rest;
            None where they can.
        tilted: Contacts that end or begin with the phase, with the parts that touch in its first posture: of
            feet on their toes.
    """

    contacts: Contacts
    q: FloatArray
    com: FloatArray
    min_duration: float
    com_room: tuple[float, float, float] = COM_ROOM
    via: FloatArray | None = None
    momentum: Momentum | None = None
    tilted: tuple[Contact, ...] = ()

    @classmethod
    def of(
        cls, body: BodyModel, contacts: Contacts, q: FloatArray, min_duration: float,
        com_room: tuple[float, float, float] = COM_ROOM, via: FloatArray | None = None,
        momentum: Momentum | None = None, tilted: tuple[Contact, ...] = (),
    ) -> "Stage":  # fmt: skip
        """Stage with the centre of mass of its posture."""
        com = frozen_array(Configuration(body, q).com, "com [m]", (3,))
        kept = MappingProxyType(dict(contacts))
        between = None if via is None else frozen_array(via, "posture between", (body.nq,))
        posture = frozen_array(q, "posture", (body.nq,))
        return cls(kept, posture, com, min_duration, com_room, between, momentum, tilted)


@dataclass(frozen=True, eq=False)
class ContactPlan:
    """Plan of contacts: stages from the start to the goal.

    Attributes:
        stages: At least one; one contact is made or broken from each to the next.
        goal: (nq,) posture with which the last one ends.
        goal_com: (3,) its centre of mass [m].
    """

    stages: tuple[Stage, ...]
    goal: FloatArray
    goal_com: FloatArray

    @classmethod
    def of(
        cls, body: BodyModel, stages: Sequence[Stage], goal: FloatArray, paces: Paces | None = None
    ) -> "ContactPlan":
        """Plan that ends with a posture (nq,), with time for each change at an unhurried pace."""
        com = frozen_array(Configuration(body, goal).com, "goal com [m]", (3,))
        ends = [(stage.q, stage.com) for stage in stages[1:]] + [(goal, com)]
        timed = [
            replace(
                stage, min_duration=max(stage.min_duration, _least_time(stage, q, there, paces or Paces()))
            )
            for stage, (q, there) in zip(stages, ends, strict=True)
        ]
        return cls(tuple(timed), frozen_array(goal, "goal posture", (body.nq,)), com)

    def schedule(self, model: ContactModel) -> ContactSchedule:
        """The stances with a contact model in time, each as short as it may be, from zero on.

        A foot that leaves or lands on its toes tilts in a share of the stage before or after.
        """
        phases = [
            Phase(
                Stance([part.get(name, held) for name, held in stage.contacts.items()], model=model), time,
                continues=number > 0,
            )
            for stage, parts in zip(self.stages, self._parts(), strict=True)
            for number, (part, time) in enumerate(parts)
        ]  # fmt: skip
        ends = np.cumsum([phase.min_duration for phase in phases])
        return ContactSchedule(StanceSequence(phases), np.concatenate([[0.0], ends]))

    def _parts(self) -> Iterator[list[tuple[Contacts, float]]]:
        """Parts of each stage with their durations [s]: what touches on its toes as it begins, and ends."""
        for stage, tilted in zip(self.stages, [*(s.tilted for s in self.stages[1:]), ()], strict=True):
            landed, leaving = (
                {item.effector: item for item in items if item.effector in stage.contacts}
                for items in (stage.tilted, tilted)
            )
            flat = 1.0 - TILTING * (bool(landed) + bool(leaving))
            parts = ((landed, TILTING * bool(landed)), ({}, flat), (leaving, TILTING * bool(leaving)))
            yield [(part, share * stage.min_duration) for part, share in parts if share > 0.0]

    def keys(self, schedule: ContactSchedule) -> tuple[FloatArray, FloatArray]:
        """Key times (k,) [s] and configurations (k, nq): where stages begin and, if any, in between."""
        instants = schedule.instants[[*schedule.sequence.begins, -1]]
        times, keys = [float(instants[0])], [self.stages[0].q]
        spans = pairwise(instants.tolist())
        for stage, end, (begin, stop) in zip(self.stages, self.postures[1:], spans, strict=True):
            if stage.via is not None:
                times.append(0.5 * (begin + stop))
                keys.append(stage.via)
            times.append(stop)
            keys.append(end)
        return np.array(times), np.array(keys)

    @property
    def postures(self) -> FloatArray:
        """(n + 1, nq) the posture at every change and at the goal."""
        return np.array([*(stage.q for stage in self.stages), self.goal])

    @property
    def steps(self) -> int:
        """Number of contacts made."""
        return sum(len(set(after.contacts) - set(before.contacts)) for before, after in pairwise(self.stages))


def _least_time(stage: Stage, q: FloatArray, com: FloatArray, paces: Paces) -> float:
    """Time that the change to the next posture takes at an unhurried pace [s].

    From rest to rest over a way ``d`` in a time ``T``, the smoothest motion accelerates by ``10 d / (sqrt(3)
    T^2)`` (minimum jerk: Flash and Hogan 1985, J Neurosci 5:1688).
    """
    between = stage.q[None] if stage.via is None else np.array([stage.q, stage.via])
    turn = float(np.abs(np.diff([*between[:, 7:], q[7:]], axis=0)).max(axis=1, initial=0.0).sum())
    way = float(np.linalg.norm(com - stage.com))
    accelerating = math.sqrt(10.0 / math.sqrt(3.0) * way / paces.com_acceleration)
    return max(turn / paces.hinge_pace, way / paces.com_pace, accelerating)
