"""Stances and surfaces of a recorded person as a planned body can use them."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment, hinge_line, toe_hinge
from manikin.contact import Contact, ContactKind, ContactSchedule, Phase, SolePart, Stance, StanceSequence
from manikin.contact.contact import sole
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array
from manikin.recordings.supports.body_supports import SEAT
from manikin.scene import Box, Obstacle, Scene


def effector_placements(body: BodyModel, q: FloatArray, name: str) -> tuple[FloatArray, FloatArray]:
    """(n, 3) positions [m] and (n, 3, 3) rotations of an effector in the world, in postures (n, nq)."""
    data, frame = body.pinocchio.createData(), body.effector_frame(name)
    position, rotation = np.empty((len(q), 3)), np.empty((len(q), 3, 3))
    for row, one in enumerate(q):
        pin.framesForwardKinematics(body.pinocchio, data, one)
        position[row], rotation[row] = data.oMf[frame].translation, data.oMf[frame].rotation
    return position, rotation


RAISED = 0.02
"""A contact this far above the floor has a block under it [m]."""

RISEN, SAME_SEAT = 0.015, 0.15
"""Height of the buttocks over a seat from which it carries nothing, distance of seats that are one [m]."""

ROLLED, EARLY = 0.02, 0.1
"""Way of the hinge of the toes from which a foot counts as rolling over their tips [m]; time by which it
leaves earlier than recorded at most: one whose hinge has moved for longer carries, as a stealthy walker's
does for most of a second [s]."""

SHORTEST = 0.06
"""What is left at least of a phase whose foot or seat is left earlier: the controller takes some 40 ms to
load a foot [s]."""

REMNANT = 0.08
"""A part of a contact at a clip's end that lasts less is none of its own: a foot's tilt takes as long to set
in [s]."""

TOE_LOAD = 1.4
"""Load of a foot on its toes: above the second peak of a brisk walk's vertical force [body weights]."""

ROOM, THICKNESS = 0.03, 0.05
"""Reach of a block beyond its contact, and its thickness: legs pass below a seat [m]."""


def landing_flat(schedule: ContactSchedule, body: BodyModel) -> ContactSchedule:
    """Stances with the whole sole where only the heel touches.

    A recorded heel rolls down within some sixty milliseconds, on a round edge and a soft shoe; a stiff
    sole lands flat. Phases that do not differ any more are one.
    """
    flat = schedule.with_contacts(lambda contact: _whole(contact, body))
    return _joined(list(flat.sequence), flat.instants)


def without_remnants(schedule: ContactSchedule) -> ContactSchedule:
    """Stances with no part of a foot at either end that a clip cuts to an instant.

    A heel that lifts 40 ms after a clip begins is almost up by then: the foot stands as it does next to it.
    Phases that do not differ any more are one.
    """
    phases, durations = list(schedule.sequence), np.array(schedule.durations)
    for lasting in (durations, durations[::-1]):
        _without_first_remnants(phases, lasting)
        phases.reverse()
    return _joined(phases, schedule.instants)


def leaving_with_the_hinge(
    schedule: ContactSchedule, body: BodyModel, time: FloatArray, q: FloatArray
) -> ContactSchedule:
    """Stances with every foot that leaves from its toes off as soon as their hinge has moved away.

    A recorded foot rolls over the tips of its toes in the last hundredths of a second, hardly loaded; a stiff
    toe segment lies flat up to the end, and would hold the leg back. Recorded are postures (n, nq) at times
    (n,) on the schedule's clock [s].
    """
    instants, phases = np.array(schedule.instants), list(schedule.sequence)
    for name in schedule.sequence.effectors:
        hinge = toe_hinge(body, name)
        if hinge is None:
            continue
        position, rotation = effector_placements(body, q, name)
        path = position + rotation @ hinge
        for index, (stance, after) in enumerate(pairwise(phase.stance for phase in phases)):
            # Nothing that lands at the same instant shall land earlier.
            if name not in stance or not set(after.effectors) <= set(stance.effectors) - {name}:
                continue
            contact, (start, end) = stance[name], instants[index : index + 2].tolist()
            place = contact.position + contact.rotation_contact_to_world @ hinge
            rows = np.flatnonzero((time > start) & (time < end))
            near = rows[np.linalg.norm(path[rows] - place, axis=1) <= ROLLED]
            left = start if len(near) == 0 else time[near[-1]]
            if contact.part is SolePart.TOES and left < end:
                shortest = min(max(SHORTEST, time[1] - time[0]), end - start)
                instants[index + 1] = max(left, start + shortest, end - EARLY)
    return _timed(phases, instants)


def rising_at_once(
    schedule: ContactSchedule, body: BodyModel, time: FloatArray, q: FloatArray
) -> ContactSchedule:
    """Stances with a seat that is left as soon as the buttocks have risen from it.

    Flesh and cushion follow a person up by some centimetres; a stiff seat does not, and would hold the
    pelvis back while the rest of the body rises. The seat is at one place; recorded postures are as for
    :func:`leaving_with_the_hinge`.
    """
    if SEAT not in schedule.sequence.effectors:
        return schedule
    height = effector_placements(body, q, SEAT)[0][:, 2]
    instants, phases = np.array(schedule.instants), list(schedule.sequence)
    for index, (stance, after) in enumerate(pairwise(phase.stance for phase in phases)):
        if set(stance.effectors) != {*after.effectors, SEAT} or SEAT in after:
            continue
        start, end = instants[index : index + 2]
        seated = (time > start) & (time < end)
        low = height[seated] < stance[SEAT].position[2] + RISEN
        if np.any(low) and not low[-1]:
            instants[index + 1] = min(max(float(time[seated][low][-1]), start + SHORTEST), end)
    return _timed(phases, instants)


def within_toe_strength(schedule: ContactSchedule, body: BodyModel) -> ContactSchedule:
    """Stances with toes that carry no farther from their hinge, and no more, than their strength allows.

    Whoever stands on the toes of one foot has the centre of pressure at most the toes' torque limit over the
    load ahead of the hinge; the rest of their length is no support. A foot on its toes alone carries no more
    than that load (:data:`TOE_LOAD`): the ankle that pushes off with it is about as strong.
    """
    return schedule.with_contacts(lambda contact: _strong_part(contact, body))


def on_one_seat(schedule: ContactSchedule) -> ContactSchedule:
    """Stances with all contacts of a seat that lie near each other at one place: chairs do not move."""
    seats = [item for phase in schedule.sequence for item in phase.stance if item.effector == SEAT]
    changed: dict[Contact, Contact] = {}
    while seats:
        near = [item for item in seats if np.linalg.norm(item.position - seats[0].position) < SAME_SEAT]
        place = frozen_array(np.median([item.position for item in near], axis=0), "seat place [m]")
        turn = seats[0].rotation_contact_to_world
        changed |= {item: replace(item, position=place, rotation_contact_to_world=turn) for item in near}
        seats = [item for item in seats if item not in changed]
    return schedule.with_contacts(lambda contact: changed.get(contact, contact))


def scene_under(schedule: ContactSchedule, floor: float) -> Scene:
    """A floor at a height [m], and a block under every contact above it; grasps hold on to nothing."""
    blocks: dict[tuple[float, ...], Obstacle] = {}
    for contact in (contact for phase in schedule.sequence for contact in phase.stance):
        place = tuple(np.round(contact.position, 6).tolist())
        if contact.position[2] - floor >= RAISED and place not in blocks:
            blocks[place] = _block(contact, f"{contact.effector} {len(blocks) + 1}")
    return Scene(list(blocks.values()), floor_height=floor)


def _without_first_remnants(phases: list[Phase], durations: FloatArray) -> None:
    """Replace what is cut by the beginning of a clip, or by the end of one whose phases come last first."""
    for first in phases[0].stance:
        name = first.effector
        held = next((k for k, phase in enumerate(phases) if name not in phase.stance), len(phases))
        parts = [phase.stance[name] for phase in phases[:held]]
        count = next((k for k, part in enumerate(parts) if part.part is not first.part), None)
        if count is None or durations[:count].sum() >= REMNANT:
            continue
        for index, phase in enumerate(phases[:count]):
            contacts = [parts[count] if c.effector == name else c for c in phase.stance]
            phases[index] = replace(phase, stance=phase.stance.with_contacts(contacts))


def _timed(phases: Sequence[Phase], instants: FloatArray) -> ContactSchedule:
    durations = np.diff(instants).tolist()
    timed = [replace(p, min_duration=d, max_duration=d) for p, d in zip(phases, durations, strict=True)]
    return ContactSchedule(StanceSequence(timed), instants)


def _joined(phases: Sequence[Phase], ends: FloatArray) -> ContactSchedule:
    """A schedule of phases between instants (phases + 1,), those that do not differ as one."""
    joined, instants = list[Phase](), [float(ends[0])]
    for phase, end in zip(phases, ends[1:].tolist(), strict=True):
        if joined and _alike(joined[-1].stance, phase.stance):
            joined.pop()
            instants.pop()
        duration = end - instants[-1]
        joined.append(Phase(phase.stance, duration, duration))
        instants.append(end)
    return ContactSchedule(StanceSequence(joined), instants)


def _strong_part(contact: Contact, body: BodyModel) -> Contact:
    toes = hanging_segment(body, body.effector(contact.effector).segment)
    line = hinge_line(body, contact.effector)
    if contact.kind is not ContactKind.SOLE or contact.part is SolePart.HEEL or toes is None or line is None:
        return contact
    strength = -float(body.torque_lower[body.joint_index(toes.hinges[0].name)])
    load = TOE_LOAD * body.mass * GRAVITY
    reach = line + strength / load
    points = np.array(contact.points)
    points[:, 0] = np.minimum(points[:, 0], reach)
    strong = replace(contact, points=frozen_array(points, "toe points", (None, 3)))
    if contact.part is SolePart.FULL:
        return strong
    return replace(strong, normal_force_cap=min(contact.normal_force_cap or np.inf, load))


def _whole(contact: Contact, body: BodyModel) -> Contact:
    if contact.part is not SolePart.HEEL:
        return contact
    length, width = body.sole_length or contact.length, body.sole_width or contact.width
    name, place, yaw, friction = contact.effector, contact.position, contact.yaw, contact.friction
    flat = sole(name, place, yaw, length=length, width=width, friction=friction)
    return replace(flat, normal_force_cap=contact.normal_force_cap)


def _alike(first: Stance, second: Stance) -> bool:
    return set(first.effectors) == set(second.effectors) and all(
        first[name].part is second[name].part and np.array_equal(first[name].position, second[name].position)
        for name in first.effectors
    )


def _block(contact: Contact, name: str) -> Obstacle:
    size = [2.0 * ROOM, 2.0 * ROOM, THICKNESS]
    if contact.kind is ContactKind.SOLE:
        size[:2] = contact.length + 2.0 * ROOM, contact.width + 2.0 * ROOM
    centre = contact.position - 0.5 * THICKNESS * contact.normal
    return Obstacle(name, Box(size), contact.rotation_contact_to_world, centre)
