"""A walk as a motion with its supports, forces and margins."""

import itertools
import math

import numpy as np
import pinocchio as pin

from manikin.balance import wrench_polytopes
from manikin.contact import (
    Contact,
    ContactSchedule,
    Phase,
    Stance,
    StanceSequence,
    default_normal_force_cap,
    sole,
)
from manikin.errors import BodyError
from manikin.locomotion import Walk
from manikin.low_pass import low_passed
from manikin.mocap.recorded_motion import CUTOFF
from manikin.motion import Motion
from manikin.wholebody.full_motion import full_motion

FRICTION = 0.8
"""Of the soles of one who walks."""


def walked_motion(walk: Walk, height: float) -> tuple[ContactSchedule, Motion]:
    """Supports of a walk in time, and its motion with what the ground has to do for it.

    The motion is that of recorded people, carried over to another body, so that its margin may be negative
    and its torques may leave a rest on the pelvis: both say how far this body is from walking like that.
    Velocities are low-passed as those of recordings are, since accelerations follow from them.

    Args:
        walk: Of a body along a path.
        height: Of the floor [m].
    """
    schedule, motion = walked_schedule(walk, height), walk.motion
    polytopes = wrench_polytopes([phase.stance for phase in schedule.sequence])
    rate = (len(motion.time) - 1) / motion.duration
    v = low_passed(motion.v, CUTOFF, rate, padding=9)
    a = np.gradient(v, 1.0 / rate, axis=0)
    full, _ = full_motion(walk.body, schedule, polytopes, motion.time, motion.q, v, a)
    return schedule, full


def walked_schedule(walk: Walk, height: float) -> ContactSchedule:
    """Whole soles where the feet are in the middle of each support, level on a floor of a height [m]."""
    held = [_contacts(walk, foot, height) for foot in range(walk.support.shape[1])]
    cap = default_normal_force_cap(walk.body.mass)
    changes = 1 + np.flatnonzero(np.any(np.diff(walk.support[:-1], axis=0), axis=1))
    rows = [0, *changes.tolist(), len(walk.time) - 1]
    phases = [
        Phase(Stance([contacts[row] for contacts in held if row in contacts], cap), end - start, end - start)
        for row, (start, end) in zip(rows, itertools.pairwise(walk.time[rows].tolist()), strict=False)
    ]
    return ContactSchedule(StanceSequence(phases), walk.time[rows])


def _contacts(walk: Walk, foot: int, height: float) -> dict[int, Contact]:
    """The contact of a foot by the frames in which it stands; one and the same in each support."""
    body, name = walk.body, walk.feet[foot]
    if body.sole_length is None or body.sole_width is None:
        raise BodyError(f"body {body.name!r} has no soles; valid: a human")
    data, frame = body.pinocchio.createData(), body.effector_frame(name)
    standing = np.flatnonzero(walk.support[:, foot])
    contacts: dict[int, Contact] = {}
    for rows in np.split(standing, 1 + np.flatnonzero(np.diff(standing) > 1)):
        pin.forwardKinematics(body.pinocchio, data, walk.q[rows[len(rows) // 2]])
        place = pin.updateFramePlacement(body.pinocchio, data, frame)
        made = sole(
            name, [*place.translation[:2], height], math.atan2(place.rotation[1, 0], place.rotation[0, 0]),
            length=body.sole_length, width=body.sole_width, friction=FRICTION,
        )  # fmt: skip
        contacts |= dict.fromkeys(rows.tolist(), made)
    return contacts
