"""What recorded skeletons leave open, settled in the same way for every cycle: pelvis tilt and level feet.

Also here. Limbs of recorded cycles kept out of the reference body, which is wider than some recorded people.
Cycles of several people as if one had walked them all: each one's habits are taken out.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.kinematics.leg_kinematics import LegKinematics
from manikin.numerics.signals import fourier_basis, shifted
from manikin.numerics.spatial import FloatArray, quaternions, rotations
from manikin.recordings.reconstruction.anatomy import SIDES
from manikin.walking.gait.motion_library import ROOT, MotionLibrary
from manikin.walking.gait.stance_foot import FootPlacement, Sole

INSTANTS = 24
"""Of a cycle that are looked at."""

ARM_STEP, LEG_STEP = np.deg2rad(2.5), np.deg2rad(0.75)
"""By how much limbs are spread at a time [rad]."""

MOST_STEPS = 5

ARMS, LEGS = 3 * ARM_STEP, 2 * LEG_STEP
"""By how much they are spread in every cycle, so that neighbours differ the less in it [rad]."""

_ARMS, _LEGS = ("upper_arm", "forearm", "hand"), ("thigh", "leg", "foot", "toes")


def spread(body: BodyModel, coefficients: FloatArray) -> FloatArray:
    """Coefficients with both arms, and both legs, abducted until they touch neither the body nor each other.

    By equal angles on both sides and the same throughout the cycle: 7.5 to 20 degrees for arms, 1.5 to 5.25
    for legs. Legs that cross in a turn may still touch.

    Args:
        body: The reference body.
        coefficients: (2 k + 1, s) of one cycle.
    """
    found = np.array(coefficients)
    data, geometry = body.pinocchio.createData(), pin.GeometryData(body.geometry)
    shoulders, hips = (
        [len(ROOT) + body.joint_index(f"{side}_{name}_abduction") for side in SIDES]
        for name in ("shoulder", "hip")
    )
    found[0, shoulders] += ARMS
    found[0, hips] += LEGS
    pairs = _pairs(body)
    for _ in range(MOST_STEPS):
        touching = _touching(body, found, data, geometry)
        arms, legs = (bool(np.any(touching[chosen])) for chosen in pairs)
        if not arms and not legs:
            break
        found[0, shoulders] += ARM_STEP * arms
        found[0, hips] += LEG_STEP * legs
    return found


def _pairs(body: BodyModel) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Pairs of shapes with an arm, and pairs of legs."""
    names = [shape.name.split("/")[0] for shape in body.geometry.geometryObjects]
    both = [(names[pair.first], names[pair.second]) for pair in body.geometry.collisionPairs]
    arms = np.array([any(name.endswith(_ARMS) for name in pair) for pair in both])
    legs = np.array([all(name.endswith(_LEGS) for name in pair) for pair in both])
    return arms, legs & ~arms


def _touching(body: BodyModel, coefficients: FloatArray, data: Any, geometry: Any) -> NDArray[np.bool_]:
    """(pairs,) whether they touch at any instant."""
    phase = np.arange(INSTANTS) / INSTANTS
    signals = fourier_basis(phase, (len(coefficients) - 1) // 2) @ coefficients
    turns = quaternions(signals[:, 5], signals[:, 4], signals[:, 3])
    angles = np.clip(signals[:, len(ROOT) :], body.lower, body.upper)
    found = np.zeros(len(body.geometry.collisionPairs), dtype=np.bool_)
    for posture in np.hstack([np.zeros((INSTANTS, 3)), turns, angles]):
        pin.computeCollisions(body.pinocchio, data, body.geometry, geometry, posture, False)
        found |= [result.isCollision() for result in geometry.collisionResults]
    return found


RUNNING, RUNNING_WIDTH = 2.05, 0.15
"""Speed between walks and runs [m/s], and the width of the change; of the preferred transition in adults."""

DOUBT, TREND_DOUBT = 0.05, 0.01
"""Squared differences [rad^2] over offsets [rad^2]: how readily offsets, and trends, are believed."""

_FIRST = ROOT.index("roll")


def as_one_person(
    body: BodyModel, cycles: Sequence[MotionLibrary], persons: Sequence[str]
) -> list[MotionLibrary]:
    """Cycles with the mean postures of the person who has most of them, equal on both sides.

    People hold arms, back and head in their own ways, and skeletons are fitted to them in different ways;
    blends of neighbouring cycles of two people would change with the speed from one habit to another. The
    mean angle of a hinge in a cycle is taken as a function of the velocity, the same for all, plus an offset
    of the person. What is equal on both sides is an even function of lateral and angular
    velocity, what is opposite an odd one; each is fitted by linear least squares. Only offsets are taken
    out, and only of mean angles; the movement stays the person's own.

    Args:
        body: The reference body.
        cycles: One cycle each.
        persons: Who made it.
    """
    everyone = sorted(set(persons))
    main = Counter(persons).most_common(1)[0][0]
    velocities = np.concatenate([cycle.velocities for cycle in cycles])
    means = np.concatenate([cycle.coefficients[:, 0] for cycle in cycles])
    reflected = np.concatenate([cycle.mirrored(body).coefficients[:, 0] for cycle in cycles])
    even, odd = _trends(velocities)
    equal = _offsets(even, persons, [one for one in everyone if one != main], 0.5 * (means + reflected))
    opposite = _offsets(odd, persons, everyone, 0.5 * (means - reflected))
    found = []
    for cycle, person in zip(cycles, persons, strict=True):
        coefficients = np.array(cycle.coefficients)
        offset = equal.get(person, 0.0) + opposite[person]
        coefficients[:, 0, _FIRST:] -= offset[_FIRST:]
        found.append(replace(cycle, coefficients=coefficients))
    return found


def _offsets(
    trend: FloatArray, persons: Sequence[str], chosen: Sequence[str], means: FloatArray
) -> dict[str, FloatArray]:
    """(s,) offsets of the chosen persons from what the trend explains of (n, s) means."""
    who = np.array([[float(person == one) for one in chosen] for person in persons])
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

MOST_LEVELLED = np.deg2rad(15.0)
"""A sole with more pitch than this does not lie flat [rad]."""

SAMPLES = 64

LIFTED = 0.02
"""A sole whose lower end is higher than this has left the floor, or not yet landed [m]."""

MOST_TRIMMED = 0.25
"""Share of a stance by which either end is moved at most."""

_HEIGHT = ROOT.index("height")


def tilted(body: BodyModel, q: FloatArray, within: NDArray[np.bool_] | None = None) -> FloatArray:
    """Postures with the mean pelvis tilt that goes with the trunk's lean; trunk and legs stay as they are.

    Joint centres of a skeleton tell the pelvis' tilt loosely: recordings differ by 15 degrees. The first
    hinges of hips and lumbar spine are parallel to the axis of the tilt and undo it.

    Args:
        body: A human.
        q: (n, nq) postures.
        within: (n,) those of the cycle whose mean counts; all if omitted.
    """
    pelvis = Rotation.from_quat(q[:, 3:7])
    lumbar, thorax = (7 + body.joint_index(f"{name}_flexion") for name in ("lumbar", "thorax"))
    counted = np.ones(len(q), dtype=np.bool_) if within is None else within
    pitch = pelvis.as_euler("ZYX")[counted, 1].mean()
    lean = pitch + (q[:, lumbar] + q[:, thorax])[counted].mean()
    turn = TILT + TILT_SHARE * lean - pitch
    found = q.copy()
    found[:, 3:7] = (pelvis * Rotation.from_rotvec([0.0, turn, 0.0])).as_quat()
    found[:, lumbar] -= turn
    for side in SIDES:
        found[:, 7 + body.joint_index(f"{side}_hip_flexion")] += turn
    return found


def levelled(body: BodyModel, coefficients: FloatArray, events: FloatArray) -> FloatArray:
    """Coefficients with soles that are flat in the middle of the stance and, in the median, on the floor.

    Joint angles of a person with other proportions put the feet of the reference body a little higher or
    lower, and at other angles; the means of ankle and height make up for it.

    Args:
        body: The reference body.
        coefficients: (2 k + 1, s) of one cycle.
        events: (3,) phases as of :class:`manikin.walking.gait.motion_library.MotionLibrary`.
    """
    found = np.array(coefficients)
    landing, off, other = events
    spans = {"left": (landing, 1.0), "right": (other, off)}
    for number, side in enumerate(SIDES):
        first, last = spans[side]
        middle = first + np.linspace(MIDDLE[0], MIDDLE[1], 16) * (last - first)
        pitch = float(np.median(_feet(body, found, middle).pitch[number]))
        slot = len(ROOT) + body.joint_index(f"{side}_ankle_dorsiflexion")
        found[0, slot] += np.clip(pitch, -MOST_LEVELLED, MOST_LEVELLED)
    stances = [
        _feet(body, found, np.linspace(spans[side][0], spans[side][1], SAMPLES)).clearance[number]
        for number, side in enumerate(SIDES)
    ]
    found[0, _HEIGHT] -= np.median(np.concatenate(stances))
    return found


def on_the_floor(
    body: BodyModel, coefficients: FloatArray, events: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Cycle and events whose stances begin and end with the sole on the floor.

    The recorded toes leave the floor later than the ball of the foot, over which ours rolls.

    Args:
        body: The reference body.
        coefficients: (2 k + 1, s) of one cycle, levelled.
        events: (3,) phases.

    Returns:
        Coefficients that begin where the left sole leaves the floor, and (3,) phases.
    """
    landing, off, other = events
    (left_on, left_off), (right_on, right_off) = (
        _standing(_feet(body, coefficients, phase).clearance[number], phase)
        for number, phase in enumerate(
            np.linspace(first, last, 4 * SAMPLES + 1) for first, last in ((landing, 1.0), (other, off))
        )
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
    signals = fourier_basis(phase, (len(coefficients) - 1) // 2) @ coefficients
    place = np.zeros((len(phase), 3))
    place[:, 2] = signals[:, _HEIGHT]
    pelvis = rotations(signals[:, 5], signals[:, 4], signals[:, 3])
    angles = np.clip(signals[:, len(ROOT) :], body.lower, body.upper)
    return FootPlacement.of_foot(Sole.of_body(body), *LegKinematics(body).feet(pelvis, place, angles))
