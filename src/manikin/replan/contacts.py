"""Stances and surfaces of a recorded person as a planned body can use them."""

from dataclasses import replace

import numpy as np

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind, ContactSchedule, Phase, SolePart, Stance, StanceSequence
from manikin.contact.contact import sole
from manikin.mocap.seat_supports import SEAT
from manikin.scene import Box, Obstacle, Scene
from manikin.spatial import frozen_array

RAISED = 0.02
"""A contact this far above the floor has a block under it [m]."""

SAME_SEAT = 0.15
"""Seats nearer to each other are one [m]."""

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
