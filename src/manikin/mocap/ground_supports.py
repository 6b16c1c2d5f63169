"""Knees, elbows and the trunk of a recorded person who kneels, crawls or lies on the ground.

Each is a support while it is slow and near the surface under the feet. Speeds are compared with those
between two rests, as of feet.
"""

import numpy as np
from numpy.typing import NDArray

from manikin.mocap.effector_places import JOINTS, effector_places
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_supports import Support, support_between
from manikin.mocap.runs import lasting, switch
from manikin.mocap.seat_supports import lying
from manikin.mocap.support_levels import CUTOFF, Track, track
from manikin.spatial import FloatArray

TRUNK = "pelvis"
"""Effector that stands for the whole trunk."""
ROLLS = 0.20
"""Speed up to which a knee, an elbow or a palm may stay: what the body turns about is not one point [m/s]."""

LEAVES = 0.25
"""Speed above which it may leave [m/s]."""

SLIDE_WAY = 0.15
"""Longest way along which they slide between two rests, in contrast to a swing [m]."""

LOW = 0.13
"""Height above the ground within which a knee or an elbow comes to rest on it [m]."""

AWAY = 0.18
"""Height from which it has left the ground: limbs of a model are not as thick as flesh and floor mats [m]."""

LYING = 0.12
"""Height of the middle of the hips above the ground, per stature, within which the trunk lies on it."""

SHORTEST = 0.12
"""Shorter supports, and shorter interruptions, are not told from noise [s]."""


def ground_supports(
    found: Reconstruction, floor: FloatArray, rate: float, *, start: float = 0.0, cutoff: float = CUTOFF
) -> tuple[Support, ...]:
    """Supports of knees, elbows and the pelvis on the ground; none for a body that is not a human.

    The pelvis stands for the trunk: it supports where it is low and nearer to lying than to upright.
    The supports are named after the effectors ``left_knee`` ... of
    :func:`manikin.body.further_contacts.with_knees_and_elbows`, and ``pelvis``.

    Args:
        found: At least four instants.
        floor: (n,) height of the surface under the feet [m].
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If the cutoff is too high.
    """
    stature = found.body.stature
    if stature is None:
        return ()
    names = (*JOINTS, TRUNK)
    supports: list[Support] = []
    for name, positions in zip(names, effector_places(found.body, found.q, names), strict=True):
        one = track(positions, rate, cutoff)
        height = one.positions[:, 2] - floor
        slow, fast = slow_and_leaving(one)
        if name == TRUNK:
            low = (height < LYING * stature) & lying(found)
            touching = switch(slow & low, fast | ~low)
        else:
            touching = switch(slow & (height < LOW), fast | (height > AWAY))
        supports += [
            support_between(name, one.positions, frames, rate, start)
            for frames in lasting(touching, SHORTEST * rate)
        ]
    return tuple(supports)


def stays(one: Track) -> list[tuple[int, int]]:
    """First frame and the one after the last of each time in which a point stays, wherever it is."""
    return lasting(switch(*slow_and_leaving(one)), SHORTEST * one.rate)


def slow_and_leaving(one: Track) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) whether a point is slow enough to stay, and fast enough to leave, other than a foot may roll."""
    slow, fast = one.slow_and_fast(ROLLS, SLIDE_WAY)
    return slow | (one.speed < ROLLS), fast & (one.speed > LEAVES)
