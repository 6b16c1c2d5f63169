"""What a recorded person does, recognised by simple measures of the motion.

The measures are those of :class:`ActivityMeasures`. The first rule that holds names the activity:

1. *crawling*: hands and knees carry for more than :data:`MOSTLY` of the time and the person moves on;
   *lying*: the trunk is on the ground for more than :data:`OFTEN` of the time;
2. *sitting*: a seat carries; *sit-to-stand* or *stand-to-sit* where it is left, or taken;
3. *running*: two flights or more, on the way at more than :data:`RUNS`; *jumping*: a flight of at least
   :data:`JUMPS` otherwise;
4. *climbing*: hands carry, and feet or the body gain or lose height by more than :data:`CLIMBS`;
5. *stairs up* or *stairs down*: two steps or more that are higher, or lower, than the one before by
   :data:`STAIR`, and none the other way; *uneven ground* where both occur;
6. *carrying*: a walk with both palms held at an even distance in front, elbows bent; *walking*: two steps or
   more, on the way;
7. *crouching*: the centre of mass sinks by :data:`DEEP` of the stature; *lifting* or *lowering*: both palms
   are low, and higher later, or were higher before, by :data:`REACHES` of the stature; *crouching* again from
   :data:`SINKS` on;
8. *stepping*: steps on the spot; *standing* otherwise.

Loads are not seen in positions: who lifts an empty hand from the floor is said to lift.
"""

from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from manikin.body.segments import FEET, HANDS
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import SEAT, TRUNK, RecordedSupports, Support
from manikin.recordings.supports.support_levels import JOINTS, com_path, effector_places

MOSTLY, OFTEN = 0.6, 0.3
"""Shares of the time from which hands and knees carry a crawl, and the trunk lies."""

WALKS, WAY, RUNS = 0.3, 0.6, 1.2
"""Mean speed [m/s] and way [m] from which a person is on the way; speed of a run with flights [m/s]."""

FLIGHT, JUMPS = 0.03, 0.2
"""Shortest flight that counts, and that of a jump [s]."""

CLIMBS, STAIR = 0.3, 0.08
"""Change of height from which hands make a climb, and between steps that makes a stair [m]."""

REACHES, LOW_HANDS, SINKS, DEEP = 0.2, 0.33, 0.1, 0.25
"""Rise of the palms, height from which they rise, and sinking of the centre of mass, per stature; a centre of
mass that sinks by the last one belongs to who squats, whatever the hands do."""

EVEN, BENT = 0.02, np.deg2rad(45.0)
"""Standard deviation of the distance between palms that carry one thing [m], and bend of the elbows [rad]."""

GAITS = ("walking", "carrying", "running", "stairs up", "stairs down", "uneven ground")
"""Activities with gait cycles."""


@dataclass(frozen=True)
class ActivityMeasures:
    """What the rules look at.

    Attributes:
        speed: Way of the pelvis over the ground per time [m/s].
        way: Sum of its ways from touch-down to touch-down of the feet, from first to last frame [m].
        steps: Touch-downs of feet seen.
        flights: Times of at least :data:`FLIGHT` between two supports without any; the longest one [s].
        stairs_up: Steps at least :data:`STAIR` higher than the one before; ``stairs_down`` lower.
        hands: Share of the time in which a hand carries; likewise knees, seat and trunk.
        seat_left: Whether a seat is left for good; ``seat_taken`` whether it is taken from standing.
        rise: Last minus first height of the centre of mass [m].
        sinking: How far the centre of mass is below that of standing at its lowest, per stature.
        palms_lowest: Height of the palms above the lowest surface at their lowest, per stature.
        palms_rise_after: From then to their highest later, per stature; ``palms_rise_before`` to earlier.
        palms_distance_sd: Of the distance between both palms [m]; None if hands or arms were not recorded.
        elbows: Median of the smaller bend of both elbows [rad].
    """

    speed: float
    way: float
    steps: int
    flights: int
    longest_flight: float
    stairs_up: int
    stairs_down: int
    hands: float
    knees: float
    seat: float
    trunk: float
    seat_left: bool
    seat_taken: bool
    rise: float
    sinking: float
    palms_lowest: float
    palms_rise_after: float
    palms_rise_before: float
    palms_distance_sd: float | None
    elbows: float


@dataclass(frozen=True)
class Activity:
    """What a person does, and by which measures."""

    kind: str
    measures: ActivityMeasures

    @property
    def is_gait(self) -> bool:
        """Whether there are gait cycles."""
        return self.kind in GAITS

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready, SI."""
        return {"kind": self.kind, **asdict(self.measures)}


def recognise(found: Reconstruction, supports: RecordedSupports, motion: Motion) -> Activity:
    """Name what a person does.

    Args:
        found: The person, seen from the ground that is walked on.
        supports: Those of the recording.
        motion: The smoothed motion at the same instants.
    """
    measures = _measures(found, supports, motion)
    return Activity(_kind(measures), measures)


def _kind(one: ActivityMeasures) -> str:
    on_the_way = one.speed > WALKS and one.way > WAY
    if min(one.hands, one.knees) > MOSTLY and one.way > WAY:
        return "crawling"
    if one.trunk > OFTEN:
        return "lying"
    if one.seat > 0.0:
        return "sit-to-stand" if one.seat_left else "stand-to-sit" if one.seat_taken else "sitting"
    if one.flights >= 2 and one.speed > RUNS:
        return "running"
    if one.longest_flight >= JUMPS:
        return "jumping"
    if one.hands > 0.0 and (abs(one.rise) > CLIMBS or one.stairs_up + one.stairs_down > 2):
        return "climbing"
    if max(one.stairs_up, one.stairs_down) >= 2:
        if one.stairs_up and one.stairs_down:
            return "uneven ground"
        return "stairs up" if one.stairs_up else "stairs down"
    if one.steps >= 2 and on_the_way:
        even = one.palms_distance_sd is not None and one.palms_distance_sd < EVEN
        return "carrying" if even and one.elbows > BENT else "walking"
    if one.sinking > DEEP:
        return "crouching"
    if one.palms_lowest < LOW_HANDS and max(one.palms_rise_after, one.palms_rise_before) > REACHES:
        return "lifting" if one.palms_rise_after >= one.palms_rise_before else "lowering"
    if one.sinking > SINKS:
        return "crouching"
    return "stepping" if one.steps >= 2 else "standing"


def _measures(found: Reconstruction, supports: RecordedSupports, motion: Motion) -> ActivityMeasures:
    body, q = found.body, motion.q
    stature, duration = body.stature or 1.7, supports.end - supports.start
    feet = sorted((*supports.of("left_foot"), *supports.of("right_foot")), key=lambda one: one.start)
    instants = [0.0, *(one.start - supports.start for one in feet if one.start_seen), duration]
    path = np.stack([np.interp(instants, motion.time, q[:, axis]) for axis in range(2)], axis=1)
    way = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    heights = [float(b.place[2] - a.place[2]) for a, b in pairwise(feet) if a.effector != b.effector]
    flights = [
        one.duration
        for one in supports.phases[1:-1]
        if not one.effectors and one.duration >= FLIGHT
    ]  # fmt: skip
    seats = supports.of(SEAT)
    standing = float(_com_height(found))
    floor = min(supports.surfaces, default=float(motion.com[:, 2].min()) - standing)
    com = motion.com[:, 2] - floor
    palms, distance, elbows = _palms(found, q, floor)
    lowest = int(np.argmin(palms))
    return ActivityMeasures(
        speed=way / max(duration, 1e-9), way=way, steps=sum(one.start_seen for one in feet),
        flights=len(flights), longest_flight=max(flights, default=0.0),
        stairs_up=sum(one > STAIR for one in heights), stairs_down=sum(one < -STAIR for one in heights),
        hands=_share(supports, HANDS), knees=_share(supports, JOINTS[:2]), seat=_share(supports, (SEAT,)),
        trunk=_share(supports, (TRUNK,)),
        seat_left=any(one.end_seen for one in seats), seat_taken=any(one.start_seen for one in seats),
        rise=float(com[-1] - com[0]), sinking=(standing - float(com.min())) / stature,
        palms_lowest=float(palms[lowest]) / stature,
        palms_rise_after=float(palms[lowest:].max() - palms[lowest]) / stature,
        palms_rise_before=float(palms[: lowest + 1].max() - palms[lowest]) / stature,
        palms_distance_sd=distance, elbows=elbows,
    )  # fmt: skip


def _com_height(found: Reconstruction) -> float:
    """Height of the centre of mass above the soles in standing [m]."""
    posture = found.body.standing_posture()[None]
    soles = effector_places(found.body, posture, FEET)[:, 0, 2]
    return float(com_path(found.body, posture)[0, 2] - soles.min())


def _palms(found: Reconstruction, q: FloatArray, floor: float) -> tuple[FloatArray, float | None, float]:
    """(n,) height of the lower palm [m], deviation of the palms' distance [m], bend of the elbows [rad]."""
    if not set(HANDS) <= set(found.body.effectors) or {"left_forearm", "right_forearm"} & set(found.neutral):
        return np.full(len(q), found.body.stature or 1.7), None, 0.0
    left, right = effector_places(found.body, q, HANDS)
    names = list(found.body.joint_names)
    bends = [q[:, 7 + names.index(f"{side}_elbow_flexion")] for side in ("left", "right")]
    apart = np.linalg.norm(left - right, axis=1)
    height = np.maximum(left[:, 2], right[:, 2]) - floor  # both are low
    return height, float(apart.std()), float(np.median(np.minimum(*bends)))


def _share(supports: RecordedSupports, names: tuple[str, ...]) -> float:
    """Share of the time in which any of the effectors carries."""
    held: list[Support] = [one for one in supports.supports if one.effector in names]
    if not held:
        return 0.0
    instants = np.linspace(supports.start, supports.end, 400)
    carried: NDArray[np.bool_] = np.any([(instants >= s.start) & (instants <= s.end) for s in held], axis=0)
    return float(carried.mean())
