"""What recorded skeletons leave open, settled in the same way for every cycle: pelvis tilt and level feet."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.locomotion.foot_placement import FootPlacement, Sole
from manikin.locomotion.fourier import fourier_basis, shifted
from manikin.locomotion.leg_kinematics import LegKinematics
from manikin.locomotion.library import ROOT
from manikin.locomotion.turns import rotations
from manikin.mocap.anatomy import SIDES
from manikin.spatial import FloatArray

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
        events: (3,) phases as of :class:`manikin.locomotion.library.MotionLibrary`.
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
