"""Contacts of a recorded person, from the supports and the postures.

A foot is a rectangular sole of the body's size, flat on its surface where the foot lies flattest, for as long
as it supports. A recorded foot rolls, though: while its heel is lifted only the part before the hinge of the
toes carries, while its toes are lifted only the heel. :func:`recorded_schedule` can split phases there, by
the height of both ends of a stiff sole above their height in flat stance. A seat carries a rectangle under
the hips, the ground one under a lying trunk. A hand, knee or elbow on the ground is a point; a hand anywhere
else is a grasp, as the recording does not show the surface.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body.anthropometry import TOE_HINGE_FROM_HEEL
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import Contact, ContactSchedule, SolePart, grasp, point, sole, sole_part
from manikin.contact.from_motion import schedule_of_support
from manikin.errors import InputError
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array, rotation_from_yaw
from manikin.recordings.reconstruction.proportions import Reconstruction, level_heading
from manikin.recordings.supports.body_supports import SEAT, TRUNK, RecordedSupports, Support, median_place
from manikin.recordings.supports.support_levels import REST
from manikin.recordings.supports.supports import sole_points

FRICTION = 0.8
"""Coefficient of friction of shoes and seats."""

STRONGEST = 4.0
"""Largest sum of normal forces, per body weight: above what walking, sitting down and running reach."""

HAND_FORCE = 100.0
"""Largest force of a hand along each axis of the world ([Qiu2012]_ 7.2) [N]."""

ON_GROUND = 0.2
"""Height above a surface up to which a hand, knee or elbow rests on it, and does not hold something [m]."""

TRUNK_LENGTH = 0.29
"""From the hips to the shoulders, per stature: what of the trunk lies on the ground."""

LIFTED = 0.025
"""Height above that in flat stance from which an end of a sole has lifted [m]."""

LOWEST = 0.005
"""Height of the middle of a sole above its lowest quarter up to which it lies flat [m]."""

HEEL_SHARE = 0.25
"""Share of a sole's length that touches while the toes are lifted: a heel is round, and gives way."""

SHORTEST_PART = 0.04
"""Shorter changes between heel, full sole and toes are noise [s]."""

_FULL, _HEEL, _TOES = 1, 2, 3  # what of an effector touches in one frame; 0 for nothing


def recorded_schedule(
    found: Reconstruction, supports: RecordedSupports, *, friction: float = FRICTION, rolling: bool = False
) -> ContactSchedule:
    """Stances of a recording with the durations of its phases; a flight has a stance without contacts.

    Args:
        found: The postures, best smoothed; their first instant is the start of the supports.
        friction: Coefficient of feet and seat.
        rolling: Whether phases are split where only the heel or the toes of a foot touch.

    Raises:
        InputError: If the body has no feet with soles, or there are no two instants.
    """
    if len(found.time) < 2:
        raise InputError("stances of a reconstruction of one instant; valid: at least two")
    soles, rate = sole_points(found), found.rate
    contacts: list[Contact] = []
    table = np.zeros((len(found.time), len(supports.supports)), dtype=np.int8)
    for column, support in enumerate(supports.supports):
        frames = slice(*support.frames(supports.start, rate, len(table)))
        table[frames, column] = _FULL
        length, width = found.body.sole_length, found.body.sole_width
        if support.effector in soles and length and width:
            ends = _SoleEnds(*soles[support.effector], frames, rate)
            contacts.append(ends.contact(support, length, width, friction))
            if rolling:
                table[frames, column] = ends.parts()
        else:
            contacts.append(_other_contact(found, support, frames, friction, supports.surfaces))
    hinge = (TOE_HINGE_FROM_HEEL - 0.5) * (found.body.sole_length or 0.0)
    return schedule_of_support(
        supports.start + found.time, table,
        lambda column, row: _part(contacts[column], int(table[row, column]), hinge),
        STRONGEST * found.body.mass * GRAVITY,
    )  # fmt: skip


class _SoleEnds:
    """Heel and toes of a foot during one of its supports."""

    def __init__(self, heel: FloatArray, toes: FloatArray, frames: slice, rate: float) -> None:
        rates = (np.gradient(end, 1.0 / rate, axis=0)[frames] for end in (heel, toes))
        speed = np.max([np.linalg.norm(each, axis=1) for each in rates], axis=0)
        self.heel, self.toes, self.rate = heel[frames], toes[frames], rate
        # Frames in which both rest (the slowest tenth where there is none) and their middle is lowest.
        slow = speed <= max(REST, float(np.quantile(speed, 0.1)))
        height = 0.5 * (self.heel + self.toes)[:, 2]
        self.flat = slow & (height <= float(np.quantile(height[slow], 0.25)) + LOWEST)

    def contact(self, support: Support, length: float, width: float, friction: float) -> Contact:
        """The full sole where the foot lies flat."""
        heading = np.mean((self.toes - self.heel)[self.flat], axis=0)
        place = median_place(0.5 * (self.heel + self.toes)[self.flat])
        place[2], yaw = support.place[2], float(np.arctan2(heading[1], heading[0]))
        return sole(support.effector, place, yaw, length=length, width=width, friction=friction)

    def parts(self) -> NDArray[np.int8]:
        """What touches in each frame."""
        heel, toes = (end[:, 2] - np.median(end[self.flat, 2]) for end in (self.heel, self.toes))
        parts = np.full(len(heel), _FULL, dtype=np.int8)
        parts[(heel > LIFTED) & (heel > toes)] = _TOES
        parts[(toes > LIFTED) & (toes > heel)] = _HEEL
        for part in (_HEEL, _TOES, _FULL):
            for first, stop in mask_runs(parts == part):
                if stop - first < SHORTEST_PART * self.rate:
                    parts[first:stop] = parts[first - 1] if first else parts[min(stop, len(parts) - 1)]
        return parts


def _other_contact(
    found: Reconstruction, support: Support, frames: slice, friction: float, surfaces: Sequence[float]
) -> Contact:
    """Contact of a seat, of the trunk or a limb on the ground, or else of a hand that holds something."""
    name, place, stature = support.effector, support.place, found.body.stature
    below = [height for height in surfaces if abs(place[2] - height) < ON_GROUND]
    if below:
        place = np.array([place[0], place[1], below[0]])
    if stature is None or (name != SEAT and not below):
        return grasp(name, place, max_force=HAND_FORCE)
    if name not in (SEAT, TRUNK):
        rotation = rotation_from_yaw(level_heading(found.q[frames]))
        return point(name, place, rotation=rotation, friction=friction)
    # A seated person looks along x of the pelvis; a lying one has the shoulders along its z.
    length, axis = (SEAT_LENGTH, [1.0, 0.0, 0.0]) if name == SEAT else (TRUNK_LENGTH, [0.0, 0.0, 1.0])
    ahead = Rotation.from_quat(found.q[frames, 3:7]).apply(axis).mean(axis=0)
    if name == TRUNK:
        level = ahead[:2] / max(float(np.linalg.norm(ahead[:2])), 1e-9)
        place = place + 0.5 * TRUNK_LENGTH * stature * np.append(level, 0.0)
    length, width, yaw = length * stature, SEAT_WIDTH * stature, float(np.arctan2(ahead[1], ahead[0]))
    return sole(name, place, yaw, length=length, width=width, friction=friction)


def _part(contact: Contact, part: int, hinge: float) -> Contact:
    if part == _TOES:
        return sole_part(contact, SolePart.TOES, hinge)
    if part == _HEEL:
        rear, half = -0.5 * contact.length, 0.5 * contact.width
        front = rear + HEEL_SHARE * contact.length
        points = [[front, half, 0.0], [front, -half, 0.0], [rear, -half, 0.0], [rear, half, 0.0]]
        return replace(contact, points=frozen_array(points, "heel points"), part=SolePart.HEEL)
    return contact
