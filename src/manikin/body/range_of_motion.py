"""Joint axes, ranges and speeds of the human body.

Ranges follow the normal values of the American Academy of Orthopaedic Surgeons ("Joint Motion:
Method of Measuring and Recording", 1965), Boone and Azen (J. Bone Joint Surg. 61-A, 1979) and,
for the spine, Kapandji ("The Physiology of the Joints", vol. 3). They were widened where a deep
squat needs more than a clinician's passive test of a lying subject (our choice): knee flexion
150 deg, ankle dorsiflexion 40 deg under body weight.

Strengths: :mod:`manikin.body.strength`.

Speed limits are our choice: round numbers above those of brisk everyday movement, below sprinting.

Axes are those of the **left** side and of the trunk, in the segment frame (x forward, y left,
z up); the right side is the mirror image, so equal angles mean mirrored postures. The order of a
joint's hinges keeps the middle angle of every ball joint away from 90 degrees:

* hip, neck and spine: flexion, then abduction or side bend, then rotation;
* shoulder: the same, but the axes of flexion and abduction are turned by 30 degrees about the
  vertical: positive flexion lifts the arm forward and 30 degrees outward (near the plane of the
  scapula), and abduction then moves it sideways and backwards. The two directions in which the
  first and the third axis coincide are then sideways-backwards and across the chest, at the ends
  of the reach, instead of straight to the side or forward.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from manikin.body.segments import Hinge

HingeStrength = Callable[[str], tuple[float, float]]
"""Largest torques of a hinge against and along its positive direction, as sizes [N.m]."""

_SCAPULAR = np.deg2rad(30.0)
_FORWARD_UP = (0.0, -1.0, 0.0)
_FORWARD_DOWN = (0.0, 1.0, 0.0)
_OUTWARD = (1.0, 0.0, 0.0)
_INWARD = (-1.0, 0.0, 0.0)
_TURN_IN = (0.0, 0.0, -1.0)
_TURN_LEFT = (0.0, 0.0, 1.0)
_SHOULDER_LIFT = (float(np.sin(_SCAPULAR)), -float(np.cos(_SCAPULAR)), 0.0)
_SHOULDER_SPREAD = (float(np.cos(_SCAPULAR)), float(np.sin(_SCAPULAR)), 0.0)


@dataclass(frozen=True)
class HingeRange:
    """One hinge of the human, in degrees as published.

    Attributes:
        name: Name without the side.
        axis: Unit axis of the left or middle hinge, segment frame.
        lower_deg: Smallest angle [deg].
        upper_deg: Largest angle [deg].
        speed: Velocity limit [rad/s].
    """

    name: str
    axis: tuple[float, float, float]
    lower_deg: float
    upper_deg: float
    speed: float


HUMAN_HINGES: dict[str, tuple[HingeRange, ...]] = {
    "lumbar": (
        HingeRange("lumbar_flexion", _FORWARD_DOWN, -25, 60, 6),
        HingeRange("lumbar_side_bend", _OUTWARD, -25, 25, 6),
        HingeRange("lumbar_rotation", _TURN_LEFT, -10, 10, 6),
    ),
    "thorax": (
        HingeRange("thorax_flexion", _FORWARD_DOWN, -20, 40, 6),
        HingeRange("thorax_side_bend", _OUTWARD, -20, 20, 6),
        HingeRange("thorax_rotation", _TURN_LEFT, -35, 35, 6),
    ),
    "neck": (
        HingeRange("neck_flexion", _FORWARD_DOWN, -60, 50, 8),
        HingeRange("neck_side_bend", _OUTWARD, -45, 45, 8),
        HingeRange("neck_rotation", _TURN_LEFT, -75, 75, 8),
    ),
    "upper_arm": (
        HingeRange("shoulder_flexion", _SHOULDER_LIFT, -60, 180, 12),
        HingeRange("shoulder_abduction", _SHOULDER_SPREAD, -75, 80, 12),
        HingeRange("shoulder_rotation", _TURN_IN, -90, 80, 15),
    ),
    "forearm": (
        HingeRange("elbow_flexion", _FORWARD_UP, 0, 145, 15),
        HingeRange("forearm_pronation", _TURN_IN, -80, 80, 15),
    ),
    "hand": (
        HingeRange("wrist_flexion", _INWARD, -70, 80, 15),
        HingeRange("wrist_radial_deviation", _FORWARD_UP, -30, 20, 15),
    ),
    "thigh": (
        HingeRange("hip_flexion", _FORWARD_UP, -25, 130, 10),
        HingeRange("hip_abduction", _OUTWARD, -30, 45, 10),
        HingeRange("hip_rotation", _TURN_IN, -45, 45, 10),
    ),
    "leg": (
        HingeRange("knee_flexion", _FORWARD_DOWN, 0, 150, 14),
        HingeRange("knee_rotation", _TURN_IN, -30, 20, 10),
    ),
    "foot": (
        HingeRange("ankle_dorsiflexion", _FORWARD_UP, -50, 40, 12),
        HingeRange("ankle_inversion", _INWARD, -20, 35, 10),
    ),
    "toes": (HingeRange("toe_extension", _FORWARD_UP, -30, 70, 12),),
}
"""Hinges of each segment to its parent, in order; sides share one entry."""


def human_hinges(segment: str, side: str, strength: HingeStrength) -> tuple[Hinge, ...]:
    """Hinges of one segment of the human.

    Args:
        segment: Key of :data:`HUMAN_HINGES`.
        side: ``"left"``, ``"right"`` or ``""`` for the trunk.
        strength: Largest torques against and along the positive direction of a hinge [N.m], both as sizes,
            of its name without the side.
    """
    prefix = f"{side}_" if side else ""
    torques = [strength(entry.name) for entry in HUMAN_HINGES[segment]]
    return tuple(
        Hinge(
            name=prefix + entry.name,
            axis=_mirrored(entry.axis) if side == "right" else np.array(entry.axis),
            lower=float(np.deg2rad(entry.lower_deg)),
            upper=float(np.deg2rad(entry.upper_deg)),
            velocity_limit=entry.speed,
            torque_lower=-against,
            torque_upper=along,
        )
        for entry, (against, along) in zip(HUMAN_HINGES[segment], torques, strict=True)
    )


def _mirrored(axis: tuple[float, float, float]) -> np.ndarray:
    """Rotation axis reflected in the sagittal plane (an axial vector keeps its y)."""
    return np.array([-axis[0], axis[1], -axis[2]])
