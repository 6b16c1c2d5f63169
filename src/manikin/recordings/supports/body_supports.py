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

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import ceil

import numpy as np
from numpy.typing import NDArray

from manikin.body.segments import HANDS
from manikin.errors import InputError
from manikin.numerics.signals import lasting, mask_runs, switch
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.support_levels import (
    JOINTS,
    SHORTEST_REST,
    Track,
    com_path,
    effector_places,
    track,
)
from manikin.runtime.display import Displayed

SMALL, MEDIAN_STEPS = 1e-4, 60
"""Distances much below this one count by their squares in a median place [m], which makes it unique; steps
towards it, always as many, so that equal motions give equal places."""


def median_place(positions: FloatArray) -> FloatArray:
    """(3,) median of (n, 3) positions that does not depend on where x and y point [m].

    In the horizontal plane it is the spatial median (Weiszfeld's steps), in height the ordinary median.
    """
    level = positions[:, :2] - positions[0, :2]
    place = level.mean(axis=0)
    for _ in range(MEDIAN_STEPS):
        weight = 1.0 / np.sqrt(np.sum((level - place) ** 2, axis=1) + SMALL**2)
        place = weight @ level / weight.sum()
    return np.append(positions[0, :2] + place, np.median(positions[:, 2]))


@dataclass(frozen=True, eq=False)
class Support:
    """One effector on a surface from an instant to another.

    Attributes:
        start: Touch-down, or the first instant of the recording [s].
        end: Lift-off, or the last instant of the recording [s].
        place: (3,) where the effector is, a :func:`median_place`; of a foot, at its surface's height [m].
        first_contact: (3,) heel or toes, whichever touched down, or the effector, then [m].
        last_contact: (3,) heel or toes, whichever lifted off, or the effector, then [m].
        start_seen: Whether the touch-down is in the recording; ``end_seen`` of the lift-off.
    """

    effector: str
    start: float
    end: float
    place: FloatArray
    first_contact: FloatArray
    last_contact: FloatArray
    start_seen: bool
    end_seen: bool

    def __post_init__(self) -> None:
        where = f"support of {self.effector}"
        if self.end < self.start:
            raise InputError(f"{where} from {self.start:g} to {self.end:g} s; valid: an end behind")
        for name in ("place", "first_contact", "last_contact"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"{where} {name}", (3,)))

    @property
    def duration(self) -> float:
        """[s]."""
        return self.end - self.start

    def frames(self, start: float, rate: float, count: int) -> tuple[int, int]:
        """First frame and the one after the last, of ``count`` at a rate [Hz] from an instant on [s]."""
        first, stop = (ceil((instant - start) * rate - _SAME) for instant in (self.start, self.end))
        return first, stop if self.end_seen else count


Places = tuple[FloatArray, FloatArray, FloatArray]

_SAME = 1e-6
"""Share of a frame within which an instant is that of a frame."""


def support_in(
    effector: str, frames: tuple[int, int], count: int, rate: float, start: float, places: Places
) -> Support:
    """Support for a run of ``count`` frames at a rate [Hz] from an instant on [s], with its three places.

    It begins and ends half-way between a frame in which it is seen and one in which it is not.
    """
    first, stop = frames
    begin, end = first - 0.5 if first > 0 else 0.0, stop - 0.5 if stop < count else count - 1.0
    instants = start + begin / rate, start + end / rate
    return Support(effector, *instants, *places, first > 0, stop < count)


def support_between(effector: str, point: Track, frames: tuple[int, int], start: float) -> Support:
    """Support of one point for a run of frames: first frame and the one after its last."""
    during = point.positions[slice(*frames)]
    places = median_place(during), during[0], during[-1]
    return support_in(effector, frames, len(point.positions), point.rate, start, places)


@dataclass(frozen=True)
class SupportPhase:
    """A time [s] in which the same effectors support, none in flight."""

    start: float
    end: float
    effectors: tuple[str, ...]

    @property
    def duration(self) -> float:
        """[s]."""
        return self.end - self.start


@dataclass(frozen=True, eq=False, repr=False)
class RecordedSupports(Displayed):
    """The supports of a recorded motion.

    Attributes:
        supports: In the order of their starts.
        start: First instant looked at [s]; ``end`` is the last one.
        surfaces: Heights of the surfaces found on which feet stand, lowest first [m].
    """

    supports: tuple[Support, ...]
    start: float
    end: float
    surfaces: tuple[float, ...]

    def of(self, effector: str) -> tuple[Support, ...]:
        """Supports of one effector, in order."""
        return tuple(support for support in self.supports if support.effector == effector)

    def only(self, *effectors: str) -> "RecordedSupports":
        """These effectors' supports alone, as if nothing else could support: the feet of a walk, say."""
        return replace(self, supports=tuple(one for one in self.supports if one.effector in effectors))

    @cached_property
    def key_frames(self) -> tuple[float, ...]:
        """Instants at which supports change, with the first and the last instant ([Qiu2012]_ 3.2.2) [s]."""
        inner = {instant for one in self.supports for instant in (one.start, one.end)}
        return tuple(sorted(inner | {self.start, self.end}))

    @cached_property
    def phases(self) -> tuple[SupportPhase, ...]:
        """From each key frame to the next."""
        return tuple(
            SupportPhase(start, end, tuple(sorted({
                one.effector for one in self.supports if one.start <= start and end <= one.end
            })))
            for start, end in pairwise(self.key_frames)
        )  # fmt: skip

    @property
    def sequence(self) -> tuple[str, ...]:
        """Effectors in the order in which they touch down during the recording."""
        return tuple(support.effector for support in self.supports if support.start_seen)


TRUNK = "pelvis"
"""Effector that stands for the whole trunk."""

ROLLS, LEAVES = 0.20, 0.25
"""Speed up to which a knee, an elbow or a palm may stay, for what the body turns about is not one point, and
from which it may leave [m/s]."""

SLIDE_WAY = 0.15
"""Longest way along which they slide between two rests, in contrast to a swing [m]."""

LOW_LYING, AWAY = 0.13, 0.18
"""Height above the ground within which a knee or an elbow comes to rest on it, and from which it has left it:
limbs of a model are not as thick as flesh and floor mats [m]."""

LYING = 0.12
"""Height of the middle of the hips above the ground, per stature, within which the trunk lies on it."""

SHORTEST = 0.12
"""Shorter supports, and shorter interruptions, are noise [s]."""


def ground_supports(found: Reconstruction, floor: FloatArray, start: float) -> Iterator[Support]:
    """Supports of knees, elbows and the pelvis on the ground; none for a body that is not a human.

    The pelvis stands for the trunk: it supports where it is low and nearer to lying than to upright.
    The names are those of :func:`manikin.body.limbs.with_knees_and_elbows`, and ``pelvis``. Arguments are
    those of :func:`hand_supports`.
    """
    stature, names = found.body.stature, (*JOINTS, TRUNK)
    if stature is None:
        return
    for name, positions in zip(names, effector_places(found.body, found.q, names), strict=True):
        one = track(positions, found.rate)
        height = one.positions[:, 2] - floor
        slow, fast = slow_and_leaving(one)
        low, high = height < LOW_LYING, height > AWAY
        if name == TRUNK:
            low = (height < LYING * stature) & lying(found)
            high = ~low
        for frames in lasting(switch(slow & low, fast | high), SHORTEST * one.rate):
            yield support_between(name, one, frames, start)


def slow_and_leaving(one: Track) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) whether a point that may roll is slow enough to rest, and (n,) fast enough to leave."""
    slow, fast = one.slow_and_fast(ROLLS, SLIDE_WAY)
    return slow | (one.speed < ROLLS), fast & (one.speed > LEAVES)


OWN = ("left_thigh", "left_leg", "right_thigh", "right_leg")
"""Segments at whose origins, hips and knees, a hand may rest on the own body."""

PASSED, STAYS = 0.12, 0.45
"""Way of the shoulder while a hand rests from which the body moves past it [m], and share of that way within
which a hand that holds something stays."""

SLIDES, SHORTEST_HOLD = 0.40, 0.25
"""Median speed up to which a hand holds on to something, sliding along it; else it swings [m/s]. One that
swings back stays for less than the second while the body runs past it [s]."""

BESIDE_HAND = 0.30
"""Distance of a palm from the nearest hip or knee up to which it rests on the own body, or hangs [m]."""

SEAT_NEAR, SEAT_REACH, SEAT_SOON = 0.08, 0.5, 0.5
"""Difference between the heights of a palm and a seat, and level distance from the middle of the buttocks, up
to which a hand may hold the seat [m]; time for which it may before it is taken and after it is left [s]."""


def hand_supports(
    found: Reconstruction, floor: FloatArray, seats: Sequence[Support], start: float
) -> Iterator[Support]:
    """Supports of the hands, by hand and in order; none for a body without hands.

    The floor is the (n,) height of the surface under the feet [m], the first of at least four frames is at
    ``start`` [s].
    """
    if not set(HANDS) <= set(found.body.effectors):
        return
    for name in sorted(set(HANDS) - set(found.neutral)):
        places = effector_places(found.body, found.q, (name, name.replace("hand", "upper_arm"), *OWN))
        hand, shoulder = (track(one, found.rate) for one in places[:2])
        beside = np.linalg.norm(places[2:] - places[0], axis=2).min(axis=0)
        for frames in lasting(switch(*slow_and_leaving(hand)), SHORTEST * hand.rate):
            one, during = support_between(name, hand, frames, start), slice(*frames)
            own, way = (float(np.linalg.norm(np.ptp(p.positions[during], axis=0))) for p in (hand, shoulder))
            on_ground = float(np.median(hand.positions[during, 2] - floor[during])) < AWAY
            apart = float(np.median(beside[during])) > BESIDE_HAND or _on_seat(one, seats)
            slow = float(np.median(hand.speed[during])) < SLIDES
            held = one.duration > SHORTEST_HOLD and way > PASSED and own < STAYS * way and slow and apart
            if on_ground or held:
                yield one


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

LOW, BESIDE = 0.8, 0.05
"""Height of the buttocks, per that in standing, below which a person may sit, and how far the centre of mass
is then behind the heels, or before the toes, of both feet [m]."""

RISEN = 0.04
"""Height above that of rest from which the buttocks have left a seat: flesh and cushion give way [m]."""

TILTED = np.deg2rad(60.0)
"""Angle of the line from pelvis to neck with the vertical from which a person lies or crawls [rad]."""

SHORTEST_SEAT = 0.2
"""Shorter supports of a seat, and shorter interruptions, are noise [s]."""


def seat_supports(
    found: Reconstruction, soles: Mapping[str, tuple[FloatArray, FloatArray]], start: float
) -> tuple[Support, ...]:
    """Supports of the seat, in order; none for a body without buttocks, or while the person lies.

    Of each foot there are (n, 3) heel and toes [m]; the first of at least four frames is at ``start`` [s].
    """
    body = found.body
    if SEAT not in body.effectors:
        return ()
    com, (buttocks,) = com_path(body, found.q), effector_places(body, found.q, (SEAT,))
    standing = float(effector_places(body, body.standing_posture()[None], (SEAT,))[0, 0, 2])
    seat = track(buttocks, found.rate)
    height = seat.positions[:, 2]
    low = height - lowest_points(soles) < LOW * standing
    beside = np.min([_beyond(com, heel, toes) for heel, toes in soles.values()], axis=0)
    rests = seat.resting & low & (beside > BESIDE) & ~lying(found)
    seated = np.zeros(len(height), dtype=bool)
    for first, stop in mask_runs(rests):
        if stop - first >= SHORTEST_REST * seat.rate:
            # From this rest as far as the buttocks are no higher, before and after.
            near = height < float(np.median(height[first:stop])) + RISEN
            for begin, end in mask_runs(near):
                seated[begin:end] |= begin < stop and first < end
    runs = lasting(seated, SHORTEST_SEAT * seat.rate)
    return tuple(support_between(SEAT, seat, frames, start) for frames in runs)


def lowest_points(soles: Mapping[str, tuple[FloatArray, FloatArray]]) -> FloatArray:
    """(n,) height of the lower end of the lower sole, by (n, 3) heel and toes of each foot [m]."""
    return np.min([end[:, 2] for both in soles.values() for end in both], axis=0)


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
