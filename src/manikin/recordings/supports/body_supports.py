"""Supports of a recorded person other than the feet: seat, hands, knees, elbows and trunk.

**Seat**: a person who rests with a low centre of mass beside the feet is carried by something else. The
buttocks are then at the height of a seat, and on it for as long as they are no higher.

**Knees, elbows and trunk** (kneeling, crawling, lying) support while they are slow and near the surface under
the feet. Speeds are compared with those between two rests, as of feet.

**Hands** rest while they are slow compared with their own swings. A resting hand supports

* on the ground, or on the seat while the person sits down, holds it or gets up;
* anywhere else, on a rail, a bar or the furniture, if the body moves past it.

A hand that hangs at the side or lies on the person's own knee rests only while the body does, or is beside
the body; a hand that carries a load moves with the body. Neither supports.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from manikin.numerics.signals import lasting, mask_runs, switch
from manikin.numerics.spatial import FloatArray
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.recorded_supports import Support, support_between
from manikin.recordings.supports.support_levels import (
    CUTOFF,
    JOINTS,
    SHORTEST_REST,
    Track,
    com_path,
    effector_places,
    track,
)

TRUNK = "pelvis"
"""Effector that stands for the whole trunk."""
ROLLS = 0.20
"""Speed up to which a knee, an elbow or a palm may stay: what the body turns about is not one point [m/s]."""

LEAVES = 0.25
"""Speed above which it may leave [m/s]."""

SLIDE_WAY = 0.15
"""Longest way along which they slide between two rests, in contrast to a swing [m]."""

LOW_LYING = 0.13
"""Height above the ground within which a knee or an elbow comes to rest on it [m]."""

AWAY = 0.18
"""Height from which it has left the ground: limbs of a model are not as thick as flesh and floor mats [m]."""

LYING = 0.12
"""Height of the middle of the hips above the ground, per stature, within which the trunk lies on it."""

SHORTEST = 0.12
"""Shorter supports, and shorter interruptions, are noise [s]."""


def ground_supports(
    found: Reconstruction, floor: FloatArray, rate: float, *, start: float = 0.0, cutoff: float = CUTOFF
) -> tuple[Support, ...]:
    """Supports of knees, elbows and the pelvis on the ground; none for a body that is not a human.

    The pelvis stands for the trunk: it supports where it is low and nearer to lying than to upright.
    The names are those of :func:`manikin.body.limbs.with_knees_and_elbows`, and ``pelvis``. Arguments are
    those of :func:`hand_supports`.
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
            touching = switch(slow & (height < LOW_LYING), fast | (height > AWAY))
        supports += [
            support_between(name, one.positions, frames, rate, start)
            for frames in lasting(touching, SHORTEST * rate)
        ]
    return tuple(supports)


def stays(one: Track) -> list[tuple[int, int]]:
    """Runs of frames in which a point rests: first frame and the one after the last."""
    return lasting(switch(*slow_and_leaving(one)), SHORTEST * one.rate)


def slow_and_leaving(one: Track) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) whether a point that may roll is slow enough to rest, and (n,) fast enough to leave."""
    slow, fast = one.slow_and_fast(ROLLS, SLIDE_WAY)
    return slow | (one.speed < ROLLS), fast & (one.speed > LEAVES)


HANDS = ("left_hand", "right_hand")
OWN = ("left_thigh", "left_leg", "right_thigh", "right_leg")
"""Segments at whose origins, hips and knees, a hand may rest on the own body."""

PASSED = 0.12
"""Way of the shoulder while a hand rests from which the body moves past it [m]."""

STAYS = 0.45
"""Share of the shoulder's way within which a hand that holds something stays."""

SLIDES = 0.40
"""Median speed up to which a hand holds on to something, sliding along it; else it swings [m/s]."""

BESIDE_HAND = 0.30
"""Distance of a palm from the nearest hip or knee up to which it rests on the own body, or hangs [m]."""

SHORTEST_HOLD = 0.25
"""A hand that swings back stays for less while the body runs past it [s]."""

SEAT_NEAR = 0.08
"""Difference between the heights of a palm and a seat up to which it rests on it [m]."""

SEAT_SOON = 0.5
"""Time before a seat is taken, and after it is left, for which hands may hold it [s]."""

SEAT_REACH = 0.5
"""Level distance of a hand from the middle of the buttocks up to which it may hold their seat [m]."""


def hand_supports(
    found: Reconstruction, floor: FloatArray, seats: Sequence[Support], rate: float, *,
    start: float = 0.0, cutoff: float = CUTOFF,
) -> tuple[Support, ...]:  # fmt: skip
    """Supports of the hands, by hand and in order; none for a body without hands.

    Args:
        found: At least four instants.
        floor: (n,) height of the surface under the feet [m].
        seats: Supports of the seat.
        rate: Frames per second [Hz].
        start: Instant of the first frame [s].
        cutoff: Of the low-pass filter [Hz].

    Raises:
        InputError: If the cutoff is too high.
    """
    if not set(HANDS) <= set(found.body.effectors):
        return ()
    supports: list[Support] = []
    for name in HANDS:
        if name in found.neutral:
            continue
        places = effector_places(found.body, found.q, (name, name.replace("hand", "upper_arm"), *OWN))
        hand, shoulder = (track(one, rate, cutoff) for one in places[:2])
        beside = np.linalg.norm(places[2:] - places[0], axis=2).min(axis=0)
        for frames in stays(hand):
            one = support_between(name, hand.positions, frames, rate, start)
            during = slice(*frames)
            own, way = (float(np.linalg.norm(np.ptp(p.positions[during], axis=0))) for p in (hand, shoulder))
            on_ground = float(np.median(hand.positions[during, 2] - floor[during])) < AWAY
            apart = float(np.median(beside[during])) > BESIDE_HAND or _on_seat(one, seats)
            slow = float(np.median(hand.speed[during])) < SLIDES
            held = one.duration > SHORTEST_HOLD and way > PASSED and own < STAYS * way and slow and apart
            if on_ground or held:
                supports.append(one)
    return tuple(supports)


def _on_seat(hand: Support, seats: Sequence[Support]) -> bool:
    """Whether a resting hand is beside a seat that the person takes, holds or leaves then."""
    return any(
        seat.start - SEAT_SOON < hand.end
        and hand.start < seat.end + SEAT_SOON
        and abs(float(hand.place[2] - seat.place[2])) < SEAT_NEAR
        and float(np.linalg.norm((hand.place - seat.place)[:2])) < SEAT_REACH
        for seat in seats
    )


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
"""Shorter supports of a seat, and shorter interruptions, are noise [s]."""


def seat_supports(
    found: Reconstruction, soles: Mapping[str, tuple[FloatArray, FloatArray]], rate: float, *,
    start: float = 0.0, cutoff: float = CUTOFF,
) -> tuple[Support, ...]:  # fmt: skip
    """Supports of the seat, in order; none for a body without buttocks, or while the person lies.

    Args:
        found: At least four instants.
        soles: (n, 3) heel and (n, 3) toes of each foot, by its name [m].
        rate: As of :func:`hand_supports`, and so are ``start`` and ``cutoff``.
    """
    body = found.body
    if SEAT not in body.effectors:
        return ()
    com, (buttocks,) = com_path(body, found.q), effector_places(body, found.q, (SEAT,))
    standing = float(effector_places(body, body.standing_posture()[None], (SEAT,))[0, 0, 2])
    seat = track(buttocks, rate, cutoff)
    height = seat.positions[:, 2]
    floor = np.min([end[:, 2] for both in soles.values() for end in both], axis=0)
    beside = np.min([_beyond(com, heel, toes) for heel, toes in soles.values()], axis=0)
    rests = seat.resting & (height - floor < LOW * standing) & (beside > BESIDE) & ~lying(found)
    seated = np.zeros(len(height), dtype=bool)
    for first, stop in mask_runs(rests):
        if stop - first >= SHORTEST_REST * rate:
            # From this rest as far as the buttocks are no higher, before and after.
            near = height < float(np.median(height[first:stop])) + RISEN
            for begin, end in mask_runs(near):
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


def _beyond(com: FloatArray, heel: FloatArray, toes: FloatArray) -> FloatArray:
    """(n,) how far the centre of mass is beyond the ends of a foot, along it, level [m]; else negative."""
    way = (toes - heel)[:, :2]
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    along = np.sum((com - heel)[:, :2] * way, axis=1) / length
    return np.maximum(-along, along - length)
