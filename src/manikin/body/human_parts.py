"""Shapes, inertias, axes, ranges and limbs that the parts of human bodies have in common.

De Leva's table places each segment's mass on the line from joint to joint. Measured in three dimensions, the
masses of thighs, shanks, trunk and head are a little behind that line, which moves the centre of mass of the
whole body back by a good centimetre. Source of these offsets: Dumas, Chèze and Verriest, "Adjustments to
McConville et al. and Young et al. body segment inertial parameters", J. Biomech. 40(3), 2007, Table 2, the
anterior and lateral parts only. Arms, hands and feet have none: theirs move the body by less than a
millimetre. The reference lines of the trunk end at the lumbosacral joint and at C7/T1, ours at the hips and
at C7; the pelvis, whose offset is given from the lumbosacral joint alone, has none.

Ranges follow the normal values of the American Academy of Orthopaedic Surgeons ("Joint Motion: Method of
Measuring and Recording", 1965), Boone and Azen (J. Bone Joint Surg. 61-A, 1979) and, for the spine, Kapandji
("The Physiology of the Joints", vol. 3). They were widened where a deep squat needs more than a clinician's
passive test of a lying subject (our choice): knee flexion 150 deg, ankle dorsiflexion 40 deg under body
weight. Speed limits are our choice: round numbers above those of brisk everyday movement, below sprinting.

Axes are those of the **left** side and of the trunk, in the segment frame (x forward, y left, z up); the
right side is the mirror image, so equal angles mean mirrored postures. The order of a joint's hinges keeps
the middle angle of every ball joint away from 90 degrees:

* hip, neck and spine: flexion, then abduction or side bend, then rotation;
* shoulder: the same, but the axes of flexion and abduction are turned by 30 degrees about the vertical:
  positive flexion lifts the arm forward and 30 degrees outward (near the plane of the scapula). The first and
  the third axis then coincide sideways-backwards and across the chest, at the ends of the reach.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from manikin.body.anthropometry import Anthropometry, Sex
from manikin.body.segments import Hinge, Limb, Shape, ShapeKind
from manikin.contact import ContactKind
from manikin.numerics.spatial import FloatArray

TORSO_LENGTH = {Sex.FEMALE: 0.429 / 1.61, Sex.MALE: 0.477 / 1.77}
"""Lumbosacral joint to C7/T1 in the sample, per stature."""

HEAD_LENGTH = {Sex.FEMALE: 0.243 / 1.61, Sex.MALE: 0.277 / 1.77}
"""C7/T1 to vertex, per stature."""

OFFSETS: Mapping[Sex, Mapping[str, tuple[float, float]]] = MappingProxyType({
    Sex.FEMALE: {"torso": (-0.016, 0.0), "head_and_neck": (-0.070, 0.0),
                 "thigh": (-0.077, 0.009), "shank": (-0.049, 0.031)},
    Sex.MALE: {"torso": (-0.036, 0.0), "head_and_neck": (-0.062, 0.0),
               "thigh": (-0.041, 0.033), "shank": (-0.048, 0.007)},
})  # fmt: skip
"""Forward and away from the body's middle, per length of the segment: Dumas et al. (2007), Table 2."""

_TRUNK = ("middle_trunk", "upper_trunk")


def off_axis(size: Anthropometry, name: str, side: str = "") -> FloatArray:
    """(3,) offset of the centre of mass of a part in the frame of its segment, x forward, y left [m].

    Args:
        name: A row of de Leva's table; those without an offset have none.
        side: ``"left"`` or ``"right"`` of a limb, empty for the trunk.
    """
    row = "torso" if name in _TRUNK else name
    if row not in OFFSETS[size.sex]:
        return np.zeros(3)
    forward, outward = OFFSETS[size.sex][row]
    sign = {"left": 1.0, "right": -1.0, "": 0.0}[side]
    per_stature = {"torso": TORSO_LENGTH, "head_and_neck": HEAD_LENGTH}.get(row)
    length = size.length(row) if per_stature is None else per_stature[size.sex] * size.stature
    return length * np.array([forward, sign * outward, 0.0])


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
    "lumbar": (HingeRange("lumbar_flexion", _FORWARD_DOWN, -25, 60, 6),
               HingeRange("lumbar_side_bend", _OUTWARD, -25, 25, 6),
               HingeRange("lumbar_rotation", _TURN_LEFT, -10, 10, 6)),
    "thorax": (HingeRange("thorax_flexion", _FORWARD_DOWN, -20, 40, 6),
               HingeRange("thorax_side_bend", _OUTWARD, -20, 20, 6),
               HingeRange("thorax_rotation", _TURN_LEFT, -35, 35, 6)),
    "neck": (HingeRange("neck_flexion", _FORWARD_DOWN, -60, 50, 8),
             HingeRange("neck_side_bend", _OUTWARD, -45, 45, 8),
             HingeRange("neck_rotation", _TURN_LEFT, -75, 75, 8)),
    "upper_arm": (HingeRange("shoulder_flexion", _SHOULDER_LIFT, -60, 180, 12),
                  HingeRange("shoulder_abduction", _SHOULDER_SPREAD, -75, 80, 12),
                  HingeRange("shoulder_rotation", _TURN_IN, -90, 80, 15)),
    "forearm": (HingeRange("elbow_flexion", _FORWARD_UP, 0, 145, 15),
                HingeRange("forearm_pronation", _TURN_IN, -80, 80, 15)),
    "hand": (HingeRange("wrist_flexion", _INWARD, -70, 80, 15),
             HingeRange("wrist_radial_deviation", _FORWARD_UP, -30, 20, 15)),
    "thigh": (HingeRange("hip_flexion", _FORWARD_UP, -25, 130, 10),
              HingeRange("hip_abduction", _OUTWARD, -30, 45, 10),
              HingeRange("hip_rotation", _TURN_IN, -45, 45, 10)),
    "leg": (HingeRange("knee_flexion", _FORWARD_DOWN, 0, 150, 14),
            HingeRange("knee_rotation", _TURN_IN, -30, 20, 10)),
    "foot": (HingeRange("ankle_dorsiflexion", _FORWARD_UP, -50, 40, 12),
             HingeRange("ankle_inversion", _INWARD, -20, 35, 10)),
    "toes": (HingeRange("toe_extension", _FORWARD_UP, -30, 70, 12),),
}  # fmt: skip
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
    # An axis of rotation reflected in the sagittal plane keeps its y.
    reflection = np.array([-1.0, 1.0, -1.0]) if side == "right" else np.ones(3)
    hinges = []
    for entry in HUMAN_HINGES[segment]:
        lower, upper = float(np.deg2rad(entry.lower_deg)), float(np.deg2rad(entry.upper_deg))
        against, along = strength(entry.name)
        axis = reflection * entry.axis
        hinges.append(Hinge(prefix + entry.name, axis, lower, upper, entry.speed, -against, along))
    return tuple(hinges)


ALONG_Y = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Turns a capsule's own z axis into the segment's y axis."""
ALONG_X = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Turns a capsule's own z axis into the segment's x axis."""


def palm_rotation(sign: float) -> FloatArray:
    """Axes of the palm in the hanging hand: x to the fingers, z out of the back of the hand."""
    x, z = np.array([0.0, 0.0, -1.0]), np.array([0.0, sign, 0.0])
    return np.column_stack([x, np.cross(z, x), z])


def across(name: str, radius: float, breadth: float, height: float) -> Shape:
    """Capsule from left to right."""
    length = max(breadth - 2.0 * radius, 1e-3)
    return Shape(name, ShapeKind.CAPSULE, (radius, length), (0.0, 0.0, height), ALONG_Y)


def upright_capsule(name: str, radius: float, start: float, end: float) -> Shape:
    """Upright capsule through the origin between two heights [m]."""
    return Shape(name, ShapeKind.CAPSULE, (radius, abs(end - start)), (0.0, 0.0, 0.5 * (start + end)))


def cylinder_inertia(mass: float, radius: float, length: float, axis: int = 2) -> FloatArray:
    """Inertia (3, 3) of a solid cylinder along one axis about its centre."""
    moments = np.full(3, mass * (3.0 * radius**2 + length**2) / 12.0)
    moments[axis] = 0.5 * mass * radius**2
    return np.diag(moments)


def cuboid_inertia(mass: float, extents: FloatArray) -> FloatArray:
    """Inertia of a solid cuboid about its centre."""
    squares = extents**2
    return np.diag(mass / 12.0 * (squares.sum() - squares))


def arms_and_legs(arm: Sequence[str], leg: Sequence[str]) -> tuple[Limb, ...]:
    """Limbs of both sides, of segments from the trunk outward without their side; palms press."""
    chains = (("arm", "hand", arm, ContactKind.POINT), ("leg", "foot", leg, ContactKind.SOLE))
    return tuple(
        Limb(
            f"{side}_{name}", f"{side}_{effector}", tuple(f"{side}_{part}" for part in parts), kind,
            f"{other}_{name}",
        )
        for name, effector, parts, kind in chains
        for side, other in (("left", "right"), ("right", "left"))
    )  # fmt: skip
