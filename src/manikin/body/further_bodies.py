"""Bodies beside the human: Kudoh's 15 segments, a point mass.

:func:`kudoh` is the person of 15 rigid segments and 34 joint angles of [Kudoh2002]_ 2.2. Masses, lengths and
the widths of shoulders and hips are printed ([Kudoh2002]_ Table 3.1 and 3.2), and so is which joints are pins
and which are balls. All else is ours: inertias are those of cylinders of the density of water (3.2 says
"approximation cylinder" and no radius), the foot stands on a sole as long as itself, and axes, ranges and
speeds are those of :mod:`manikin.body.human_parts`, carried by the joints that this body has: the waist bends
as far as lumbar and thorax together, the wrist turns as the forearm does, and the ankle as the shank. The
thesis prints no torque limits (2.31-2.33 name them only); :data:`TORQUES` are ours, symmetric, and larger
than people's, so that its printed pushes can be held.

:func:`point_mass`: a body without limbs, all its mass in one small ball, on feet that weigh nothing
([Qiu2012]_ 5.4.4). It can be planned for, but has no joints to move and nothing to execute. Its feet are
where the contact schedule has them, see :func:`manikin.motion.motion.foot_positions`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from manikin.body.anthropometry import ANKLE_FROM_HEEL
from manikin.body.human import standing_angles
from manikin.body.human_parts import (
    ALONG_X,
    across,
    arms_and_legs,
    cylinder_inertia,
    human_hinges,
    palm_rotation,
    upright_capsule,
)
from manikin.body.model import BodyModel
from manikin.body.segments import Effector, Hinge, Segment, Shape, ShapeKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number

RADIUS = 0.1
"""Radius of the ball that stands for the point [m]."""


def point_mass(mass: float) -> BodyModel:
    """Make a point mass [kg] > 0."""
    mass = finite_number(mass, "mass [kg]", above=0.0, error=BodyError)
    ball = Shape("ball", ShapeKind.SPHERE, np.array([RADIUS]), np.zeros(3), np.eye(3))
    inertia = 0.4 * mass * RADIUS**2 * np.eye(3)
    root = Segment("body", None, np.zeros(3), (), mass, np.zeros(3), inertia, (ball,))
    return BodyModel(name="point mass", segments=(root,), effectors={}, nominal_mass=mass)


@dataclass(frozen=True)
class PartSize:
    """One row of [Kudoh2002]_ Table 3.1: mass [kg] and length [m]."""

    mass: float
    length: float

    @property
    def radius(self) -> float:
        """Radius of the cylinder of the density of water [m]; ours."""
        return float(np.sqrt(self.mass / (1000.0 * np.pi * self.length)))

    @property
    def inertia(self) -> FloatArray:
        """(3, 3) about the centre of the upright cylinder [kg.m^2]."""
        return cylinder_inertia(self.mass, self.radius, self.length)


PARTS: Mapping[str, PartSize] = MappingProxyType({
    "head": PartSize(4.90, 0.25), "chest": PartSize(18.06, 0.40), "loins": PartSize(12.04, 0.20),
    "upper_arm": PartSize(2.52, 0.25), "forearm": PartSize(1.54, 0.25), "hand": PartSize(0.49, 0.10),
    "thigh": PartSize(7.98, 0.40), "shank": PartSize(3.71, 0.40), "foot": PartSize(1.26, 0.25),
})  # fmt: skip
"""Mass and length of each rigid part, limbs of one side ([Kudoh2002]_ Table 3.1)."""

SHOULDER_WIDTH, HIP_WIDTH = 0.40, 0.30
"""Distances between the shoulder joints and between the hip joints [m] ([Kudoh2002]_ 3.2)."""
MASS = 70.0
"""Mass of the whole body [kg]."""
ANKLE_HEIGHT, SOLE_WIDTH = 0.07, 0.10
"""Height of the ankle above the sole and width of the sole [m]; ours, the thesis has neither."""

STATURE = sum(PARTS[name].length for name in ("head", "chest", "loins", "thigh", "shank")) + ANKLE_HEIGHT
"""Sole to vertex [m]."""

_ARMS = ("upper_arm", "forearm", "hand")
_LEGS = ("thigh", "shank", "foot")
_SIDES = (("left", 1.0), ("right", -1.0))

TORQUES: Mapping[str, float] = MappingProxyType({
    "lumbar_flexion": 350, "lumbar_side_bend": 250, "lumbar_rotation": 150,
    "thorax_flexion": 250, "thorax_side_bend": 180, "thorax_rotation": 120,
    "neck_flexion": 60, "neck_side_bend": 50, "neck_rotation": 30,
    "shoulder_flexion": 110, "shoulder_abduction": 100, "shoulder_rotation": 60,
    "elbow_flexion": 80, "forearm_pronation": 20, "wrist_flexion": 20, "wrist_radial_deviation": 20,
    "hip_flexion": 260, "hip_abduction": 200, "hip_rotation": 100,
    "knee_flexion": 260, "knee_rotation": 80, "ankle_dorsiflexion": 200, "ankle_inversion": 80,
})  # fmt: skip
"""Largest torque of each hinge of the human either way for :data:`TORQUES_FOR` [N.m]; ours."""

TORQUES_FOR = 79.0 * 1.75
"""Mass times stature for which :data:`TORQUES` are given; they scale with it [kg.m]."""


def kudoh() -> BodyModel:
    """Make the body of [Kudoh2002]_: 15 segments, 34 joint angles and the free loins, 70 kg.

    Neck, waist, shoulders, wrists, hips and ankles are balls of three hinges, elbows and knees pins. Frames,
    postures and effectors (feet, hands, ``head`` and ``pelvis``, the loins) are as in
    :func:`manikin.body.human`.
    """
    limbs = [part for make in (_arm, _leg) for side, sign in _SIDES for part in make(side, sign)]
    return BodyModel(
        name="kudoh",
        segments=(*_trunk(), *limbs),
        effectors={effector.name: effector for effector in _effectors()},
        standing_angles=standing_angles(),
        stature=STATURE,
        sole_length=PARTS["foot"].length,
        sole_width=SOLE_WIDTH,
        nominal_mass=MASS,
        limbs=arms_and_legs(_ARMS, _LEGS),
    )


def _hinges(segment: str, side: str = "") -> tuple[Hinge, ...]:
    """Hinges of the human's segment at this body's strength."""
    return human_hinges(segment, side, _torques)


def _torques(hinge: str) -> tuple[float, float]:
    torque = TORQUES[hinge] * MASS * STATURE / TORQUES_FOR
    return torque, torque


def _waist() -> tuple[Hinge, ...]:
    """One ball for two: ranges of lumbar and thorax added."""
    return tuple(
        replace(
            low, name=low.name.replace("lumbar", "waist"), lower=low.lower + high.lower,
            upper=low.upper + high.upper,
        )
        for low, high in zip(_hinges("lumbar"), _hinges("thorax"), strict=True)
    )  # fmt: skip


def _joint(segment: str, side: str) -> tuple[Hinge, ...]:
    """Hinges of a limb's segment to its parent: 3, 1 and 3 of an arm or a leg."""
    elbow, forearm_turn = _hinges("forearm", side)
    knee, shank_turn = _hinges("leg", side)
    return {
        "upper_arm": _hinges("upper_arm", side),
        "forearm": (elbow,),
        "hand": (replace(forearm_turn, name=f"{side}_wrist_rotation"), *_hinges("hand", side)),
        "thigh": _hinges("thigh", side),
        "shank": (knee,),
        "foot": (*_hinges("foot", side), replace(shank_turn, name=f"{side}_ankle_rotation")),
    }[segment]


def _trunk() -> tuple[Segment, ...]:
    loins, chest, head = (PARTS[name] for name in ("loins", "chest", "head"))
    ribs = chest.radius
    return (
        _upright("loins", None, 0.0, (), across("hips", 0.10, HIP_WIDTH, 0.5 * loins.length)),
        _upright("chest", "loins", loins.length, _waist(),
                 upright_capsule("chest", ribs, ribs, chest.length - ribs)),
        _upright("head", "chest", chest.length, _hinges("neck"),
                 upright_capsule("head", head.radius, head.radius, head.length - head.radius)),
    )  # fmt: skip


def _upright(
    name: str, parent: str | None, height: float, hinges: tuple[Hinge, ...], shape: Shape
) -> Segment:
    """Part of the trunk that stands on its joint."""
    part = PARTS[name]
    origin, com = np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 0.5 * part.length])
    return Segment(name, parent, origin, hinges, part.mass, com, part.inertia, (shape,))


def _arm(side: str, sign: float) -> list[Segment]:
    shoulder = np.array([0.0, 0.5 * sign * SHOULDER_WIDTH, PARTS["chest"].length])
    upper = _hanging(side, "upper_arm", "chest", shoulder)
    fore = _hanging(side, "forearm", f"{side}_upper_arm", _below("upper_arm"))
    return [upper, fore, _hanging(side, "hand", f"{side}_forearm", _below("forearm"))]


def _leg(side: str, sign: float) -> list[Segment]:
    thigh = _hanging(side, "thigh", "loins", np.array([0.0, 0.5 * sign * HIP_WIDTH, 0.0]))
    return [thigh, _hanging(side, "shank", f"{side}_thigh", _below("thigh")), _foot(side)]


def _below(name: str) -> FloatArray:
    """(3,) next joint of a hanging part, in its frame [m]."""
    return np.array([0.0, 0.0, -PARTS[name].length])


def _hanging(side: str, name: str, parent: str, origin: FloatArray) -> Segment:
    """Part of a limb that hangs on its joint; its shape stops short of what it carries."""
    part = PARTS[name]
    radius = min(part.radius, 0.49 * part.length)
    start = -radius if name == "hand" else 0.0
    shape = upright_capsule(name, radius, start, radius - part.length)
    hinges, com = _joint(name, side), 0.5 * _below(name)
    return Segment(f"{side}_{name}", parent, origin, hinges, part.mass, com, part.inertia, (shape,))


def _foot(side: str) -> Segment:
    """A cylinder that lies along the sole, whose middle is that of the sole."""
    part = PARTS["foot"]
    middle = np.array([(0.5 - ANKLE_FROM_HEEL) * part.length, 0.0, -0.5 * ANKLE_HEIGHT])
    box = np.array([part.length, SOLE_WIDTH, 0.75 * ANKLE_HEIGHT])
    sole = Shape("sole", ShapeKind.BOX, box, (middle[0], 0.0, 0.5 * box[2] - ANKLE_HEIGHT))
    inertia, hinges = ALONG_X @ part.inertia @ ALONG_X.T, _joint("foot", side)
    name, parent = f"{side}_foot", f"{side}_shank"
    return Segment(name, parent, _below("shank"), hinges, part.mass, middle, inertia, (sole,))


def _effectors() -> list[Effector]:
    effectors = [
        Effector("pelvis", "loins", np.zeros(3)),
        Effector("head", "head", np.array([0.0, 0.0, PARTS["head"].length])),
    ]
    hand = PARTS["hand"]
    for side, sign in _SIDES:
        sole = np.array([(0.5 - ANKLE_FROM_HEEL) * PARTS["foot"].length, 0.0, -ANKLE_HEIGHT])
        palm = np.array([0.0, -sign * hand.radius, -0.5 * hand.length])
        effectors.append(Effector(f"{side}_foot", f"{side}_foot", sole))
        effectors.append(Effector(f"{side}_hand", f"{side}_hand", palm, palm_rotation(sign)))
    return effectors
