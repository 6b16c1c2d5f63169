"""Which hands support a recorded person.

A hand rests while it is slow beside its own swings. That it carries something is told by where it rests:

* on the ground, or on the seat while the person sits down, holds it or gets up;
* anywhere else, on a rail, a bar or the furniture, where the body moves past it while it stays.

A hand that hangs at the side or lies on the own knee stays only as long as the body does, or is beside the
body; a hand that carries moves with the body. Neither is a support.
"""

from collections.abc import Sequence

import numpy as np

from manikin.mocap.effector_places import effector_places
from manikin.mocap.ground_supports import AWAY, stays
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.recorded_supports import Support, support_between
from manikin.mocap.support_levels import CUTOFF, track
from manikin.spatial import FloatArray

HANDS = ("left_hand", "right_hand")
OWN = ("left_thigh", "left_leg", "right_thigh", "right_leg")
"""Segments at whose origins, hips and knees, a hand may rest on the own body."""

PASSED = 0.12
"""Way of the shoulder while a hand rests from which the body moves past it [m]."""

STAYS = 0.45
"""Share of the shoulder's way within which a hand that holds something stays."""

SLIDES = 0.40
"""Median speed up to which a hand holds on to something, sliding along it; else it swings [m/s]."""

BESIDE = 0.30
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
    """Times in which hands support, by hand and in order; none for a body without hands.

    Args:
        found: At least four instants.
        floor: (n,) height of the surface under the feet [m].
        seats: Times in which the person sits.
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
            apart = float(np.median(beside[during])) > BESIDE or _on_seat(one, seats)
            slow = float(np.median(hand.speed[during])) < SLIDES
            held = one.duration > SHORTEST_HOLD and way > PASSED and own < STAYS * way and slow and apart
            if on_ground or held:
                supports.append(one)
    return tuple(supports)


def _on_seat(hand: Support, seats: Sequence[Support]) -> bool:
    """Whether a resting hand is at the height of the seat that the person takes or leaves then."""
    return any(
        seat.start - SEAT_SOON < hand.end
        and hand.start < seat.end + SEAT_SOON
        and abs(float(hand.place[2] - seat.place[2])) < SEAT_NEAR
        and float(np.linalg.norm((hand.place - seat.place)[:2])) < SEAT_REACH
        for seat in seats
    )
