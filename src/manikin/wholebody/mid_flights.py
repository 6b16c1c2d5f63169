"""Postures in the middle of the flights of soles: a foot that is lifted, not swung around.

The key postures of a contact plan lie at the changes of contact alone.  Joined by lines they drag a foot
through what it leaves, and an optimisation that pushes it out may as well swing the leg aside as bend it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart
from manikin.posture import Placement, PostureProblem, SolverSettings, generate_posture
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray
from manikin.wholebody.flights import touch_pairs
from manikin.wholebody.refine_input import KeyPath

LIFT = 0.07
"""Height of a sole over the higher end of its flight, in its middle; our choice [m]."""

COM_WEIGHT = 30.0
"""Weight of a centre of mass half way between those at both ends [1/m^2]."""

SETTINGS = SolverSettings(explain=False)
"""A flight without such a posture needs no reason."""

CLEARANCE = 0.015
"""Distance kept there from everything that is not stood on [m]."""


def with_mid_flights(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, path: KeyPath, padded: Sequence[str] = ()
) -> KeyPath:
    """Add a posture with the foot lifted in the middle of each flight of a sole that has no key inside.

    Args:
        body: The body.
        scene: The obstacles and the floor.
        schedule: Contacts in time.
        path: Key configurations at least at both ends of each flight.
        padded: Obstacles that any part of the body may lean on.

    Returns:
        The path with the postures that were found; a flight for which there is none stays as it is.
    """
    proximity = Proximity(body, scene)
    leaning = frozenset((segment.name, name) for segment in body.segments for name in padded)
    keys = dict(zip(path.time.tolist(), path.q, strict=True))
    for swing in schedule.sequence.swings():
        start, end = schedule.swing_interval(swing)
        inside = np.any((path.time > start + 1e-6) & (path.time < end - 1e-6))
        if inside or not (_is_sole(swing.start) and _is_sole(swing.end)):
            continue
        assert swing.start is not None
        assert swing.end is not None
        middle = 0.5 * (start + end)
        stance = tuple(schedule.sequence[int(schedule.phase_at(middle))].stance)
        touching = (touch_pairs(body, scene, contact) for contact in stance)
        guess = path.at(np.array([middle]))[0]
        problem = PostureProblem(
            body, stance, {swing.effector: _lifted(swing.start, swing.end)},
            com=_com_between(body, path.at(np.array([start, end]))), com_weight=COM_WEIGHT,
            proximity=proximity, clearance=CLEARANCE, ignore=leaning.union(*touching), reference=guess,
        )  # fmt: skip
        found = generate_posture(problem, guess, settings=SETTINGS)
        if found.succeeded:
            keys[middle] = found.q
    times = sorted(keys)
    return KeyPath(times, np.array([keys[time] for time in times]))


def _is_sole(contact: Contact | None) -> bool:
    return contact is not None and contact.kind is ContactKind.SOLE and contact.part is SolePart.FULL


def _lifted(start: Contact, end: Contact) -> Placement:
    """Half way from one place to the other and above both, the turn half made."""
    place = 0.5 * (start.position + end.position)
    place[2] = max(start.position[2], end.position[2]) + LIFT
    turns = Rotation.from_matrix([start.rotation_contact_to_world, end.rotation_contact_to_world])
    return Placement(place, Slerp([0.0, 1.0], turns)(0.5).as_matrix())


def _com_between(body: BodyModel, ends: FloatArray) -> FloatArray:
    com = np.mean([Configuration(body, q).com for q in ends], axis=0)
    return np.array([com[0], com[1], np.nan])
