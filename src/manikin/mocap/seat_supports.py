"""When a recorded person sits.

Who holds still with the centre of mass beside the feet, and low, is carried by something else. The
height of the buttocks then is that of a seat, and they are on it for as long as they are no higher.
"""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.mocap.effector_places import effector_places
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_supports import Support, support_between
from manikin.mocap.runs import lasting, runs
from manikin.mocap.support_levels import CUTOFF, SHORTEST_REST, track
from manikin.spatial import FloatArray

SEAT = "buttocks"

LOW = 0.8
"""Height of the buttocks, per that in standing, below which a person may sit."""

BESIDE = 0.05
"""How far behind the heels, or before the toes, of both feet the centre of mass of a seated person is [m]."""

RISEN = 0.04
"""Height above that of rest from which the buttocks have left a seat: flesh and cushion give way [m]."""

TILTED = np.deg2rad(60.0)
"""Angle of the line from pelvis to neck with the vertical from which a person lies or crawls [rad]."""

SHORTEST_SEAT = 0.2
"""Shorter supports of a seat, and shorter interruptions, are not told from noise [s]."""


def seat_supports(
    found: Reconstruction, soles: Mapping[str, tuple[FloatArray, FloatArray]], rate: float, *,
    start: float = 0.0, cutoff: float = CUTOFF,
) -> tuple[Support, ...]:  # fmt: skip
    """Times in which a person sits, in order; none for a body without buttocks.

    Who lies does not sit (:mod:`manikin.mocap.ground_supports`).

    Args:
        found: At least four instants.
        soles: (n, 3) heel and (n, 3) toes of each foot, by its name [m].
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If the cutoff is too high.
    """
    body = found.body
    if SEAT not in body.effectors:
        return ()
    buttocks, com = _places(found, found.q)
    standing = float(_places(found, body.standing_posture()[None])[0][0, 2])
    seat = track(buttocks, rate, cutoff)
    height = seat.positions[:, 2]
    floor = np.min([end[:, 2] for both in soles.values() for end in both], axis=0)
    beside = np.min([_beyond(com, heel, toes) for heel, toes in soles.values()], axis=0)
    rests = seat.resting & (height - floor < LOW * standing) & (beside > BESIDE) & ~lying(found)
    seated = np.zeros(len(height), dtype=bool)
    for first, stop in runs(rests):
        if stop - first >= SHORTEST_REST * rate:
            # From this rest as far as the buttocks are no higher, before and after.
            near = height < float(np.median(height[first:stop])) + RISEN
            for begin, end in runs(near):
                seated[begin:end] |= begin < stop and first < end
    return tuple(
        support_between(SEAT, seat.positions, frames, rate, start)
        for frames in lasting(seated, SHORTEST_SEAT * rate)
    )


def lying(found: Reconstruction) -> NDArray[np.bool_]:
    """(n,) whether the trunk is nearer to lying than to upright, :data:`TILTED` or more."""
    pelvis, neck = effector_places(found.body, found.q, ("pelvis", "neck"))
    up = (neck - pelvis)[:, 2] / np.linalg.norm(neck - pelvis, axis=1)
    return up < np.cos(TILTED)


def _places(found: Reconstruction, postures: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, 3) buttocks and (n, 3) centre of mass [m]."""
    model = found.body.pinocchio
    data, frame = model.createData(), found.body.effector_frame(SEAT)
    places = np.empty((2, len(postures), 3))
    for number, q in enumerate(postures):
        pin.framesForwardKinematics(model, data, q)
        places[0, number] = data.oMf[frame].translation
        places[1, number] = pin.centerOfMass(model, data, q)
    return places[0], places[1]


def _beyond(com: FloatArray, heel: FloatArray, toes: FloatArray) -> FloatArray:
    """(n,) how far the centre of mass is beyond the ends of a foot, along it, level [m]; else negative."""
    way = (toes - heel)[:, :2]
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    along = np.sum((com - heel)[:, :2] * way, axis=1) / length
    return np.maximum(-along, along - length)
