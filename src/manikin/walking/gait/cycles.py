"""Walking cycles in a recorded motion: when feet touch the floor, and from which toe-off to which to cut.

Skeletons leave the tilt of the pelvis and the level of the feet open; both are settled in the same way for
every cycle. The reference body is wider than some people: limbs are spread until they are clear of it. Blends
of several people need the habits of each taken out.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.kinematics.leg_kinematics import LegKinematics
from manikin.numerics.signals import SHARES, fourier_basis, low_passed, mask_runs, shifted
from manikin.numerics.spatial import FloatArray, quaternions, rotations
from manikin.recordings.readers.marker_sets import SIDES
from manikin.walking.gait.motion_library import ROOT, MotionLibrary
from manikin.walking.gait.stance_foot import FootPlacement, Sole

SLOW, SLOW_SHARE = 0.3, 0.15
"""A point slower than this [m/s], or than this share of its fastest [-], may stand on the floor."""

SHORTEST_GAP, SHORTEST_CONTACT, SHORTEST_CYCLE, LONGEST_CYCLE = 0.08, 0.06, 0.45, 2.0
"""Shortest swing and stance of a foot, and accepted durations of cycles [s]."""


@dataclass(frozen=True, eq=False)
class FootEvents:
    """Instants of toe-off and of landing of a foot, in order [s]."""

    off: FloatArray
    on: FloatArray


@dataclass(frozen=True)
class CycleCut:
    """A cycle in a recording.

    Attributes:
        start: Toe-off of ``foot``, ``"left"`` or ``"right"`` [s]; ``end`` is its next one, ``landing`` its
            landing between them.
        other_off: Toe-off of the other foot [s].
        other_landing: Landing of the other foot before that [s]; before the start in walks, after it in runs.
    """

    start: float
    end: float
    foot: str
    landing: float
    other_off: float
    other_landing: float

    @property
    def period(self) -> float:
        """Duration of the cycle [s]."""
        return self.end - self.start


def foot_events(body: BodyModel, q: FloatArray, rate: float) -> dict[str, FootEvents]:
    """Toe-offs and landings of both feet of a human in (n, nq) postures at a rate [Hz].

    A foot stands while its heel or the ball of the foot is slow and low.
    """
    events = {}
    for side, (heel, ball) in sole_points(body, q).items():
        contact = _stands(heel, rate) | _stands(ball, rate)
        contact = _without_short(contact, False, round(SHORTEST_GAP * rate))
        contact = _without_short(contact, True, round(SHORTEST_CONTACT * rate))
        change = np.diff(contact.astype(np.int8))
        events[side] = FootEvents(*((np.flatnonzero(change == sign) + 1) / rate for sign in (-1, 1)))
    return events


def sole_points(body: BodyModel, q: FloatArray) -> dict[str, tuple[FloatArray, FloatArray]]:
    """(n, 3) positions of each foot's heel and ball, on the sole [m], by side."""
    pelvis, sole = Rotation.from_quat(q[:, 3:7]).as_matrix(), Sole.of_body(body)
    points = {}
    for side, foot, ankle in zip(SIDES, *LegKinematics(body).feet(pelvis, q[:, :3], q[:, 7:]), strict=True):
        below = ankle - sole.depth * foot[:, :, 2]
        points[side] = (below + sole.heel * foot[:, :, 0], below + sole.ball * foot[:, :, 0])
    return points


def cycle_cuts(events: Mapping[str, FootEvents], begin: float, end: float) -> list[CycleCut]:
    """Cycles of either foot of which at least half lies in a window from ``begin`` to ``end`` [s].

    Of a window shorter than the cycle, half must be covered. Where a foot makes one step only, as in a single
    sidestep, the cycle ends when the other foot has followed.
    """
    return [
        cut
        for foot in SIDES
        for cut in (*_whole(events, foot), *_single(events, foot))
        if SHORTEST_CYCLE <= cut.period <= LONGEST_CYCLE
        and min(cut.end, end) - max(cut.start, begin) >= 0.5 * min(cut.period, end - begin)
    ]


def _whole(events: Mapping[str, FootEvents], foot: str) -> Iterator[CycleCut]:
    """From one toe-off to the next, with one toe-off of the other foot between."""
    this, other = events[foot], events[SIDES[1 - SIDES.index(foot)]]
    for start, end in pairwise(this.off):
        landings = this.on[(this.on > start) & (this.on < end)]
        offs = other.off[(other.off > start) & (other.off < end)]
        if len(landings) and len(offs) == 1:
            yield _cut(start, end, foot, landings[-1], offs[0], other)


def _single(events: Mapping[str, FootEvents], foot: str) -> Iterator[CycleCut]:
    """One step of this foot from rest, followed by one of the other; the next would begin at once."""
    this, other = events[foot], events[SIDES[1 - SIDES.index(foot)]]
    if len(this.off) != 1 or not len(other.off):
        return
    landings = this.on[this.on > this.off[0]]
    offs = other.off[other.off > this.off[0]]
    if len(landings) and len(offs):
        ends = other.on[(other.on > offs[0]) & (other.on > landings[0])]
        if len(ends):
            yield _cut(this.off[0], ends[0], foot, landings[0], offs[0], other)


def _cut(
    start: float, end: float, foot: str, landing: float, other_off: float, other: FootEvents
) -> CycleCut:
    before = other.on[(other.on < other_off) & (other.on > other_off - (end - start))]
    # A recording that begins in the other foot's stance: both feet are taken to swing equally long.
    landed = before[-1] if len(before) else landing + other_off - end
    return CycleCut(float(start), float(end), foot, float(landing), float(other_off), float(landed))


def _stands(point: FloatArray, rate: float) -> NDArray[np.bool_]:
    smooth = low_passed(point, min(10.0 / (0.5 * rate), 0.95), SHARES, padding=9)
    speed = np.linalg.norm(np.gradient(smooth, 1.0 / rate, axis=0), axis=1)
    slow = speed < max(SLOW, SLOW_SHARE * float(np.percentile(speed, 95)))
    return slow & (smooth[:, 2] < np.percentile(smooth[:, 2], 5) + 0.06)


def _without_short(values: NDArray[np.bool_], kind: bool, least: int) -> NDArray[np.bool_]:
    """Runs of ``kind`` shorter than this many frames, apart from those at the ends, become the other kind."""
    kept = values.copy()
    for first, last in mask_runs(values == kind):
        if last - first < least and first > 0 and last < len(values):
            kept[first:last] = not kind
    return kept


INSTANTS = 24
"""Instants of a cycle at which limbs may touch."""

ARM_STEP, LEG_STEP = np.deg2rad(2.5), np.deg2rad(0.75)
ARMS, LEGS = 3 * ARM_STEP, 2 * LEG_STEP
"""Step by which limbs are spread, and spread of every cycle, so that neighbours differ the less [rad]."""

_ARMS, _LEGS = ("upper_arm", "forearm", "hand"), ("thigh", "leg", "foot", "toes")


def spread(body: BodyModel, coefficients: FloatArray) -> FloatArray:
    """Cycle (2 k + 1, s) with arms and legs abducted until they touch neither the body nor each other.

    By equal angles on both sides and the same throughout the cycle: 7.5 to 20 degrees for arms, 1.5 to 5.25
    for legs. Legs that cross in a turn may still touch.
    """
    coefficients = np.array(coefficients)
    shoulders, hips = (
        [len(ROOT) + body.joint_index(f"{side}_{name}_abduction") for side in SIDES]
        for name in ("shoulder", "hip")
    )
    coefficients[0, shoulders] += ARMS
    coefficients[0, hips] += LEGS
    names = [shape.name.split("/")[0] for shape in body.geometry.geometryObjects]
    pairs = [(names[pair.first], names[pair.second]) for pair in body.geometry.collisionPairs]
    armed = np.array([any(name.endswith(_ARMS) for name in pair) for pair in pairs])
    legged = np.array([all(name.endswith(_LEGS) for name in pair) for pair in pairs]) & ~armed
    data, geometry = body.pinocchio.createData(), pin.GeometryData(body.geometry)
    for _ in range(5):
        touching = _touching(body, coefficients, data, geometry)
        arms, legs = np.any(touching[armed]), np.any(touching[legged])
        if not arms and not legs:
            break
        coefficients[0, shoulders] += ARM_STEP * arms
        coefficients[0, hips] += LEG_STEP * legs
    return coefficients


def _touching(body: BodyModel, coefficients: FloatArray, data: Any, geometry: Any) -> NDArray[np.bool_]:
    """(pairs,) whether shapes touch at any instant."""
    signals, angles = _signals(body, coefficients, np.arange(INSTANTS) / INSTANTS)
    turns = quaternions(signals[:, 5], signals[:, 4], signals[:, 3])
    touching = np.zeros(len(body.geometry.collisionPairs), dtype=np.bool_)
    for posture in np.hstack([np.zeros((INSTANTS, 3)), turns, angles]):
        pin.computeCollisions(body.pinocchio, data, body.geometry, geometry, posture, False)
        touching |= [result.isCollision() for result in geometry.collisionResults]
    return touching


def _signals(body: BodyModel, coefficients: FloatArray, phase: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, s) signals of a cycle at phases, and (n, h) angles of the hinges within their ranges [rad]."""
    signals = fourier_basis(phase, (len(coefficients) - 1) // 2) @ coefficients
    return signals, np.clip(signals[:, len(ROOT) :], body.lower, body.upper)


RUNNING, RUNNING_WIDTH = 2.05, 0.15
"""Speed of the preferred transition of adults from walks to runs, and width of the change [m/s]."""

DOUBT, TREND_DOUBT = 0.05, 0.01
"""Squared differences [rad^2] over offsets [rad^2]: how readily offsets, and trends, are believed."""

_FIRST = ROOT.index("roll")


def as_one_person(
    body: BodyModel, cycles: Sequence[MotionLibrary], persons: Sequence[str]
) -> list[MotionLibrary]:
    """Libraries of one cycle each with the mean postures of the person who has most, equal on both sides.

    People hold arms, back and head in their own ways, and skeletons are fitted to them in different ways;
    blends of neighbouring cycles of two people would change with the speed from one habit to another. The
    mean angle of a hinge in a cycle is taken as a function of the velocity, the same for all, plus an offset
    of the person. What is equal on both sides is an even function of lateral and angular
    velocity, what is opposite an odd one; each is fitted by linear least squares. Only offsets are taken
    out, and only of mean angles; the movement stays that of the person.
    """
    everyone = sorted(set(persons))
    main = Counter(persons).most_common(1)[0][0]
    means = np.concatenate([cycle.coefficients[:, 0] for cycle in cycles])
    reflected = np.concatenate([cycle.mirrored(body).coefficients[:, 0] for cycle in cycles])
    even, odd = _trends(np.concatenate([cycle.velocities for cycle in cycles]))
    equal = _offsets(even, persons, [name for name in everyone if name != main], 0.5 * (means + reflected))
    opposite = _offsets(odd, persons, everyone, 0.5 * (means - reflected))
    alike = []
    for cycle, person in zip(cycles, persons, strict=True):
        coefficients = np.array(cycle.coefficients)
        coefficients[:, 0, _FIRST:] -= (equal.get(person, 0.0) + opposite[person])[_FIRST:]
        alike.append(replace(cycle, coefficients=coefficients))
    return alike


def _offsets(
    trend: FloatArray, persons: Sequence[str], chosen: Sequence[str], means: FloatArray
) -> dict[str, FloatArray]:
    """(s,) offsets of the chosen persons from what the trend explains of (n, s) means."""
    who = np.array([[float(person == name) for name in chosen] for person in persons])
    table = np.hstack([trend, who.reshape(len(persons), len(chosen))])
    doubt = np.full(table.shape[1], DOUBT)
    doubt[: trend.shape[1]] = TREND_DOUBT
    solution = np.linalg.solve(table.T @ table + np.diag(doubt), table.T @ means)
    return dict(zip(chosen, solution[trend.shape[1] :], strict=True))


def _trends(velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Even (n, 9) and odd (n, 3) functions of (n, 3) velocities."""
    forward, left, angular = velocities.T
    speed = np.hypot(forward, left)
    running = 0.5 * (1.0 + np.tanh((speed - RUNNING) / (2.0 * RUNNING_WIDTH)))
    even = np.column_stack([
        np.ones_like(speed), forward, speed, forward**2, left**2, angular**2, np.abs(angular), np.abs(left),
        running,
    ])  # fmt: skip
    return even, np.column_stack([left, angular, angular * speed])


TILT, TILT_SHARE = np.deg2rad(10.0), 0.5
"""Mean forward tilt of the pelvis under an upright trunk [rad], and its share of the trunk's lean."""

MIDDLE = (0.3, 0.7)
"""Part of a stance in which the sole lies flat."""

MOST_LEVELLED, LIFTED = np.deg2rad(15.0), 0.02
"""A sole with more pitch does not lie flat [rad]; one whose lower end is higher is off the floor [m]."""

MOST_TRIMMED = 0.25
"""Share of a stance by which either end is moved at most."""

_HEIGHT = ROOT.index("height")


def tilted(body: BodyModel, q: FloatArray, within: NDArray[np.bool_] | None = None) -> FloatArray:
    """(n, nq) postures with the mean pelvis tilt that goes with the trunk's lean; trunk and legs stay.

    Joint centres of a skeleton tell the pelvis' tilt loosely: recordings differ by 15 degrees. The first
    hinges of hips and lumbar spine are parallel to the axis of the tilt and undo it. The mean is over the
    postures ``within`` (n,), all if omitted.
    """
    pelvis, tilted_q = Rotation.from_quat(q[:, 3:7]), q.copy()
    lumbar, thorax = (7 + body.joint_index(f"{name}_flexion") for name in ("lumbar", "thorax"))
    counted = np.ones(len(q), dtype=np.bool_) if within is None else within
    pitch = pelvis.as_euler("ZYX")[counted, 1].mean()
    lean = pitch + (q[:, lumbar] + q[:, thorax])[counted].mean()
    turn = TILT + TILT_SHARE * lean - pitch
    tilted_q[:, 3:7] = (pelvis * Rotation.from_rotvec([0.0, turn, 0.0])).as_quat()
    tilted_q[:, lumbar] -= turn
    for side in SIDES:
        tilted_q[:, 7 + body.joint_index(f"{side}_hip_flexion")] += turn
    return tilted_q


def levelled(body: BodyModel, coefficients: FloatArray, events: FloatArray) -> FloatArray:
    """Cycle (2 k + 1, s) with soles that are flat in mid-stance and, in the median, on the floor.

    Joint angles of a person with other proportions put the feet of the reference body a little higher or
    lower, and at other angles; the means of ankle and height make up for it. Events are (3,) phases as of
    :class:`manikin.walking.gait.motion_library.MotionLibrary`.
    """
    level, (landing, off, other) = np.array(coefficients), events
    spans = ((landing, 1.0), (other, off))
    for number, (first, last) in enumerate(spans):
        middle = first + np.linspace(*MIDDLE, 16) * (last - first)
        pitch = float(np.median(_feet(body, level, middle).pitch[number]))
        slot = len(ROOT) + body.joint_index(f"{SIDES[number]}_ankle_dorsiflexion")
        level[0, slot] += np.clip(pitch, -MOST_LEVELLED, MOST_LEVELLED)
    stances = [_feet(body, level, np.linspace(*ends, 64)).clearance[k] for k, ends in enumerate(spans)]
    level[0, _HEIGHT] -= np.median(np.concatenate(stances))
    return level


def on_the_floor(
    body: BodyModel, coefficients: FloatArray, events: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Levelled cycle (2 k + 1, s) and events (3,) whose stances begin and end with the sole on the floor.

    The recorded toes leave the floor later than the ball of the foot, over which ours rolls. The cycle begins
    where the left sole leaves the floor.
    """
    landing, off, other = events
    phases = np.linspace(landing, 1.0, 257), np.linspace(other, off, 257)
    (left_on, left_off), (right_on, right_off) = (
        _standing(_feet(body, coefficients, phase).clearance[number], phase)
        for number, phase in enumerate(phases)
    )
    earlier = 1.0 - left_off
    return shifted(coefficients, -earlier), np.array([left_on, right_off, right_on]) + earlier


def _standing(clearance: FloatArray, phase: FloatArray) -> tuple[float, float]:
    """First and last phase of a stance with the sole on the floor."""
    low, n = np.flatnonzero(clearance < LIFTED), len(phase)
    most = int(MOST_TRIMMED * n)
    first, last = (low[0], low[-1]) if low.size else (0, n - 1)
    return float(phase[min(first, most)]), float(phase[max(last, n - 1 - most)])


def _feet(body: BodyModel, coefficients: FloatArray, phase: FloatArray) -> FootPlacement:
    """(2, n) feet of a cycle at phases, as if the walker were on the spot."""
    signals, angles = _signals(body, coefficients, phase)
    place = np.zeros((len(phase), 3))
    place[:, 2] = signals[:, _HEIGHT]
    pelvis = rotations(signals[:, 5], signals[:, 4], signals[:, 3])
    return FootPlacement.of_foot(Sole.of_body(body), *LegKinematics(body).feet(pelvis, place, angles))
