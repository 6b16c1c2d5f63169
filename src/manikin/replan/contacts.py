"""Stances and surfaces of a recorded person as a planned body can use them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from manikin.body import BodyModel
from manikin.body.limb import hanging_segment, hinge_line
from manikin.contact import Contact, ContactKind, ContactSchedule, Phase, SolePart, Stance, StanceSequence
from manikin.contact.contact import sole
from manikin.mocap.seat_supports import SEAT
from manikin.replan.placements import effector_placements, toe_hinge
from manikin.scene import Box, Obstacle, Scene
from manikin.spatial import GRAVITY, FloatArray, frozen_array

RAISED = 0.02
"""A contact this far above the floor has a block under it [m]."""

SAME_SEAT = 0.15
"""Seats nearer to each other are one [m]."""

ROLLED = 0.02
"""Way of the hinge of the toes from which a foot counts as rolling over their tips [m]."""

SHORTEST = 0.04
"""What is left at least of a phase whose foot leaves earlier [s]."""

TOE_LOAD = 1.4
"""Load of a foot on its toes: above the second peak of a brisk walk's vertical force [body weights]."""

ROOM = 0.03
"""How far a block reaches beyond its contact [m]."""

THICKNESS = 0.05
"""Of a block: legs pass below a seat [m]."""


def landing_flat(schedule: ContactSchedule, body: BodyModel) -> ContactSchedule:
    """The same with the whole sole where only the heel touches.

    A recorded heel rolls down within some sixty milliseconds, on a round edge and a soft shoe; a stiff
    sole lands flat. Phases that do not differ any more are one.
    """
    phases: list[Phase] = []
    instants = [float(schedule.instants[0])]
    for phase, end in zip(schedule.sequence, schedule.instants[1:], strict=True):
        stance = Stance([_whole(contact, body) for contact in phase.stance], phase.stance.normal_force_cap)
        if phases and _alike(phases[-1].stance, stance):
            phases.pop()
            instants.pop()
        duration = float(end) - instants[-1]
        phases.append(Phase(stance, duration, duration))
        instants.append(float(end))
    return ContactSchedule(StanceSequence(phases), instants)


def leaving_with_the_hinge(
    schedule: ContactSchedule, body: BodyModel, time: FloatArray, q: FloatArray
) -> ContactSchedule:
    """The same with every foot that leaves from its toes off as soon as their hinge has moved away.

    A recorded foot rolls over the tips of its toes in the last hundredths of a second, hardly loaded; a stiff
    toe segment lies flat up to the end, and would hold the leg back.

    Args:
        schedule: Contacts in time.
        body: Whose.
        time: (n,) [s], on the schedule's clock.
        q: (n, nq) recorded postures then.
    """
    instants = np.array(schedule.instants)
    phases = list(schedule.sequence)
    for name in schedule.sequence.effectors:
        hinge = toe_hinge(body, name)
        if hinge is None:
            continue
        position, rotation = effector_placements(body, q, name)
        path = position + rotation @ hinge
        for index in range(len(phases) - 1):
            stance = phases[index].stance
            following = set(phases[index + 1].stance.effectors)
            # Nothing that lands at the same instant shall land earlier.
            if name not in stance or not following <= set(stance.effectors) - {name}:
                continue
            contact = stance[name]
            place = contact.position + contact.rotation_contact_to_world @ hinge
            rows = np.flatnonzero((time > instants[index]) & (time < instants[index + 1]))
            near = rows[np.linalg.norm(path[rows] - place, axis=1) <= ROLLED]
            left = instants[index] if len(near) == 0 else time[near[-1]]
            if contact.part is SolePart.TOES and left < instants[index + 1]:
                shortest = min(max(SHORTEST, time[1] - time[0]), instants[index + 1] - instants[index])
                instants[index + 1] = max(left, instants[index] + shortest)
    timed = [
        replace(phase, min_duration=float(duration), max_duration=float(duration))
        for phase, duration in zip(phases, np.diff(instants), strict=True)
    ]
    return ContactSchedule(StanceSequence(timed), instants)


def within_toe_strength(schedule: ContactSchedule, body: BodyModel) -> ContactSchedule:
    """The same with toes that carry no farther from their hinge than their strength allows.

    Whoever stands on the toes of one foot has the centre of pressure at most the toes' torque limit over the
    load ahead of the hinge; the rest of their length is no support.
    """
    return _with_contacts(schedule, lambda contact: _strong_part(contact, body))


def on_one_seat(schedule: ContactSchedule) -> ContactSchedule:
    """The same with all contacts of a seat that lie near each other at one place: chairs do not move."""
    seats = [
        (index, contact)
        for index, phase in enumerate(schedule.sequence)
        for contact in phase.stance
        if contact.effector == SEAT
    ]
    changed: dict[int, Contact] = {}
    while seats:
        near = [one for one in seats if np.linalg.norm(one[1].position - seats[0][1].position) < SAME_SEAT]
        place = frozen_array(np.median([contact.position for _, contact in near], axis=0), "seat place [m]")
        turn = seats[0][1].rotation_contact_to_world
        for index, contact in near:
            changed[index] = replace(contact, position=place, rotation_contact_to_world=turn)
        seats = [one for one in seats if one[0] not in changed]
    phases = [
        replace(phase, stance=Stance(
            [changed[index] if contact.effector == SEAT else contact for contact in phase.stance],
            phase.stance.normal_force_cap,
        ))
        for index, phase in enumerate(schedule.sequence)
    ]  # fmt: skip
    return ContactSchedule(StanceSequence(phases), schedule.instants)


def scene_under(schedule: ContactSchedule, floor: float) -> Scene:
    """A floor, and a block under every contact above it; grasps hold on to nothing that is in the way.

    Args:
        schedule: The contacts.
        floor: Height of the floor [m].
    """
    blocks: list[Obstacle] = []
    known: set[tuple[float, ...]] = set()
    for phase in schedule.sequence:
        for contact in phase.stance:
            place = tuple(np.round(contact.position, 6).tolist())
            if contact.position[2] - floor < RAISED or place in known:
                continue
            known.add(place)
            blocks.append(_block(contact, f"{contact.effector} {len(blocks) + 1}"))
    return Scene(blocks, floor_height=floor)


def _with_contacts(schedule: ContactSchedule, change: Callable[[Contact], Contact]) -> ContactSchedule:
    phases = [
        replace(phase, stance=Stance(list(map(change, phase.stance)), phase.stance.normal_force_cap))
        for phase in schedule.sequence
    ]
    return ContactSchedule(StanceSequence(phases), schedule.instants)


def _strong_part(contact: Contact, body: BodyModel) -> Contact:
    toes = hanging_segment(body, body.effector(contact.effector).segment)
    line = hinge_line(body, contact.effector)
    if contact.kind is not ContactKind.SOLE or contact.part is SolePart.HEEL or toes is None or line is None:
        return contact
    strength = float(body.torque_limit[body.joint_index(toes.hinges[0].name)])
    reach = line + strength / (TOE_LOAD * body.mass * GRAVITY)
    points = np.array(contact.points)
    points[:, 0] = np.minimum(points[:, 0], reach)
    return replace(contact, points=frozen_array(points, "toe points", (None, 3)))


def _whole(contact: Contact, body: BodyModel) -> Contact:
    if contact.part is not SolePart.HEEL:
        return contact
    size = body.sole_length or contact.length, body.sole_width or contact.width
    flat = sole(
        contact.effector, contact.position, contact.yaw, length=size[0], width=size[1],
        friction=contact.friction,
    )  # fmt: skip
    return replace(flat, normal_force_cap=contact.normal_force_cap)


def _alike(first: Stance, second: Stance) -> bool:
    if set(first.effectors) != set(second.effectors):
        return False
    return all(
        first[name].part is second[name].part and np.array_equal(first[name].position, second[name].position)
        for name in first.effectors
    )


def _block(contact: Contact, name: str) -> Obstacle:
    size = [contact.length + 2.0 * ROOM, contact.width + 2.0 * ROOM, THICKNESS]
    if contact.kind is not ContactKind.SOLE:
        size[:2] = [2.0 * ROOM] * 2
    centre = contact.position - 0.5 * THICKNESS * contact.normal
    return Obstacle(name, Box(size), contact.rotation_contact_to_world, centre)
