"""Joint axes, ranges, speeds and strengths of the human body.

Ranges follow the normal values of the American Academy of Orthopaedic Surgeons ("Joint Motion:
Method of Measuring and Recording", 1965), Boone and Azen (J. Bone Joint Surg. 61-A, 1979) and,
for the spine, Kapandji ("The Physiology of the Joints", vol. 3). They were widened where a deep
squat needs more than a clinician's passive test of a lying subject (our choice): knee flexion
150 deg, ankle dorsiflexion 40 deg under body weight.

Torque limits are our choice: one symmetric number per hinge, rounded up from the isometric
strength of the stronger direction in young men (of the order of 0.16 m g H for knee and hip
extension and 0.1-0.13 m g H for plantar flexion when normalised by body weight and stature as in
Anderson, Madigan and Nussbaum, J. Biomech. 40, 2007), given for 79 kg and 1.75 m and scaled
with mass times stature. There is no factor for sex, age or joint angle.

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

from dataclasses import dataclass

import numpy as np

from manikin.body.segments import Hinge

REFERENCE_STRENGTH = 79.0 * 1.75
"""Mass times stature for which the torques below are given [kg.m]."""

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
    """One hinge of the human for 79 kg and 1.75 m, in degrees as published.

    Attributes:
        name: Name without the side.
        axis: Unit axis of the left or middle hinge, segment frame.
        lower_deg: Smallest angle [deg].
        upper_deg: Largest angle [deg].
        speed: Velocity limit [rad/s].
        torque: Torque limit [N.m].
    """

    name: str
    axis: tuple[float, float, float]
    lower_deg: float
    upper_deg: float
    speed: float
    torque: float


HUMAN_HINGES: dict[str, tuple[HingeRange, ...]] = {
    "lumbar": (
        HingeRange("lumbar_flexion", _FORWARD_DOWN, -25, 60, 6, 350),
        HingeRange("lumbar_side_bend", _OUTWARD, -25, 25, 6, 250),
        HingeRange("lumbar_rotation", _TURN_LEFT, -10, 10, 6, 150),
    ),
    "thorax": (
        HingeRange("thorax_flexion", _FORWARD_DOWN, -20, 40, 6, 250),
        HingeRange("thorax_side_bend", _OUTWARD, -20, 20, 6, 180),
        HingeRange("thorax_rotation", _TURN_LEFT, -35, 35, 6, 120),
    ),
    "neck": (
        HingeRange("neck_flexion", _FORWARD_DOWN, -60, 50, 8, 60),
        HingeRange("neck_side_bend", _OUTWARD, -45, 45, 8, 50),
        HingeRange("neck_rotation", _TURN_LEFT, -75, 75, 8, 30),
    ),
    "upper_arm": (
        HingeRange("shoulder_flexion", _SHOULDER_LIFT, -60, 180, 12, 110),
        HingeRange("shoulder_abduction", _SHOULDER_SPREAD, -75, 80, 12, 100),
        HingeRange("shoulder_rotation", _TURN_IN, -90, 80, 15, 60),
    ),
    "forearm": (
        HingeRange("elbow_flexion", _FORWARD_UP, 0, 145, 15, 80),
        HingeRange("forearm_pronation", _TURN_IN, -80, 80, 15, 20),
    ),
    "hand": (
        HingeRange("wrist_flexion", _INWARD, -70, 80, 15, 20),
        HingeRange("wrist_radial_deviation", _FORWARD_UP, -30, 20, 15, 20),
    ),
    "thigh": (
        HingeRange("hip_flexion", _FORWARD_UP, -25, 130, 10, 260),
        HingeRange("hip_abduction", _OUTWARD, -30, 45, 10, 200),
        HingeRange("hip_rotation", _TURN_IN, -45, 45, 10, 100),
    ),
    "leg": (
        HingeRange("knee_flexion", _FORWARD_DOWN, 0, 150, 14, 260),
        HingeRange("knee_rotation", _TURN_IN, -30, 20, 10, 80),
    ),
    "foot": (
        HingeRange("ankle_dorsiflexion", _FORWARD_UP, -50, 40, 12, 200),
        HingeRange("ankle_inversion", _INWARD, -20, 35, 10, 80),
    ),
    "toes": (HingeRange("toe_extension", _FORWARD_UP, -30, 70, 12, 50),),
}
"""Hinges of each segment to its parent, in order; sides share one entry."""


def human_hinges(segment: str, side: str, strength: float) -> tuple[Hinge, ...]:
    """Hinges of one segment of the human.

    Args:
        segment: Key of :data:`HUMAN_HINGES`.
        side: ``"left"``, ``"right"`` or ``""`` for the trunk.
        strength: Mass times stature [kg.m], which scales the torques.
    """
    scale = strength / REFERENCE_STRENGTH
    prefix = f"{side}_" if side else ""
    return tuple(
        Hinge(
            name=prefix + entry.name,
            axis=_mirrored(entry.axis) if side == "right" else np.array(entry.axis),
            lower=float(np.deg2rad(entry.lower_deg)),
            upper=float(np.deg2rad(entry.upper_deg)),
            velocity_limit=entry.speed,
            torque_limit=entry.torque * scale,
        )
        for entry in HUMAN_HINGES[segment]
    )


def _mirrored(axis: tuple[float, float, float]) -> np.ndarray:
    """Rotation axis reflected in the sagittal plane (an axial vector keeps its y)."""
    return np.array([-axis[0], axis[1], -axis[2]])
