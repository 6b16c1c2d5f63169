"""Creatures that walk on the tips of jointed legs: an insect with six, a quadruped with four.

:func:`insect`: [Tonneau2015]_ prints 4 degrees of freedom per leg and 33 in all in one place and 5 per leg in
another; 33 fits neither with a free root. We take the insect of the results: six legs of five hinges and a
free root, 36 degrees of freedom (Fig. 8.1).

:func:`quadruped`: trunk, head and four legs of three hinges, near walking robots that climb stairs: legs as
long as three quarters of the trunk, knees behind the feet, torques of up to a third of weight times length.
Shanks end in thin feet: a body is planned to touch with its tips, and touches with its shapes, which have to
be near them at any lean.

Proportions, ranges, speeds and strengths of both are our own choice.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body.human_parts import ALONG_X, ALONG_Y, cylinder_inertia
from manikin.body.model import BodyModel
from manikin.body.segments import Effector, Hinge, Limb, Segment, Shape, ShapeKind
from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number

_SPEED = 12.0

_HingeEntry = tuple[str, tuple[float, float, float], float, float, float]


@dataclass(frozen=True, eq=False)
class _LegPlan:
    """Legs of a creature, lengths as shares of the trunk's, masses as shares of the body's.

    Attributes:
        hips: Place of each pair along the trunk; ``aside`` is their distance from its middle.
        axis: Axis along which all parts point in the zero posture.
        parts: Length, radius and mass of each part, from the hip to the tip.
        hinges: Of each part: name, axis of the left leg, range [deg], strength [weight times length].
        standing_deg: Angles of each pair in standing [deg].
        tip_free: Distance of the last part's shape to the tip in radii.
    """

    hips: Mapping[str, float]
    aside: float
    axis: int
    parts: Mapping[str, tuple[float, float, float]]
    hinges: Mapping[str, Sequence[_HingeEntry]]
    standing_deg: Mapping[str, Mapping[str, float]]
    tip_free: float

    def direction(self, sign: float) -> FloatArray:
        """(3,) unit vector along a leg in the zero posture: to its side, or down."""
        return np.array([0.0, sign, 0.0] if self.axis == 1 else [0.0, 0.0, -1.0])


_INSECT = _LegPlan(
    {"front": 0.24, "middle": 0.0, "rear": -0.24},
    0.13,
    1,
    {"femur": (0.34, 0.035, 0.025), "tibia": (0.42, 0.025, 0.015), "tarsus": (0.14, 0.012, 0.005)},
    {
        "femur": (
            ("sweep", (0.0, 0.0, 1.0), -75.0, 75.0, 0.3),
            ("lift", (1.0, 0.0, 0.0), -45.0, 90.0, 0.5),
            ("twist", (0.0, 1.0, 0.0), -40.0, 40.0, 0.2),
        ),
        "tibia": (("knee", (-1.0, 0.0, 0.0), 0.0, 150.0, 0.4),),
        "tarsus": (("ankle", (-1.0, 0.0, 0.0), -70.0, 70.0, 0.1),),
    },
    {
        pair: {"sweep": -forward, "lift": 25.0, "knee": 105.0, "ankle": 10.0}
        for pair, forward in (("front", 40.0), ("middle", 0.0), ("rear", -40.0))
    },
    tip_free=0.4,  # it may lean by 45 degrees
)
_QUADRUPED = _LegPlan(
    {"front": 0.38, "rear": -0.38},
    0.15,
    2,
    {"thigh": (0.37, 0.050, 0.040), "shank": (0.333, 0.032, 0.0145), "foot": (0.037, 0.003, 0.0005)},
    {
        "thigh": (
            ("roll", (1.0, 0.0, 0.0), -45.0, 45.0, 0.3),
            ("pitch", (0.0, 1.0, 0.0), -50.0, 130.0, 0.35),
        ),
        "shank": (("knee", (0.0, -1.0, 0.0), 5.0, 155.0, 0.35),),
        "foot": (),
    },
    {pair: {"pitch": 38.0, "knee": 76.0} for pair in ("front", "rear")},
    tip_free=0.2,
)
_INSECT_RADIUS, _QUADRUPED_RADIUS = 0.11, 0.12
_HEAD_SHARE, _HEAD_RADIUS, _HEAD_AT = 0.06, 0.10, (0.54, 0.0, 0.10)


def insect(length: float = 0.4, mass: float = 2.0) -> BodyModel:
    """Make an insect of a trunk length [m] > 0 and a mass [kg] > 0 with six legs of five hinges each.

    Segment frames are parallel to the world in the zero posture, in which all legs point straight
    to the side. A hip sweeps backward, lifts and twists about the leg; knee and ankle bend
    down. Effectors ``left_front_tip`` ... ``right_rear_tip`` are the ends of the tarsi, their z
    axes along the tarsus towards the body; limbs are ``left_front_leg`` ... ``right_rear_leg``.
    """
    length, mass = _size("insect", length, mass)
    own = mass * (1.0 - 6.0 * sum(share for *_, share in _INSECT.parts.values()))
    radius = _INSECT_RADIUS * length
    shape = Shape("trunk", ShapeKind.CAPSULE, (radius, length - 2.0 * radius), rotation=ALONG_X)
    inertia = cylinder_inertia(own, radius, length, axis=0)
    trunk = Segment("trunk", None, np.zeros(3), (), own, np.zeros(3), inertia, (shape,))
    x = np.array([1.0, 0.0, 0.0])
    turns = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        z = np.array([0.0, -sign, 0.0])
        turns[side] = np.column_stack([x, np.cross(z, x), z])
    return _legged("insect", _INSECT, length, mass, trunk, turns)


def quadruped(length: float = 0.8, mass: float = 32.0) -> BodyModel:
    """Make a quadruped of a trunk length [m] > 0 and a mass [kg] > 0 with four legs of three hinges each.

    Segment frames are parallel to the world in the zero posture, in which all legs hang straight down. A hip
    rolls the leg outward and pitches it backward; a knee bends the shank, with the foot on it, forward.
    Effectors ``left_front_tip`` ... ``right_rear_tip`` are the ends of the feet, their z axes up in the
    standing posture; limbs are ``left_front_leg`` ... ``right_rear_leg``, and touch in points.
    """
    length, mass = _size("quadruped", length, mass)
    own = mass * (1.0 - _HEAD_SHARE - 4.0 * sum(share for *_, share in _QUADRUPED.parts.values()))
    head, at = _HEAD_SHARE * mass, np.array(_HEAD_AT) * length
    radius = _QUADRUPED_RADIUS * length
    shapes = (
        Shape("trunk", ShapeKind.CAPSULE, (radius, length - 2.0 * radius), rotation=ALONG_X),
        Shape("head", ShapeKind.SPHERE, (_HEAD_RADIUS * length,), at),
    )
    middle = head * at / (own + head)
    inertia = cylinder_inertia(own, radius, length, axis=0) + _point(own, middle) + _point(head, at - middle)
    trunk = Segment("trunk", None, np.zeros(3), (), own + head, middle, inertia, shapes)
    standing = _QUADRUPED.standing_deg["front"]
    lean = np.deg2rad(standing["knee"] - standing["pitch"])  # the shank stands at that angle
    cos, sin = np.cos(lean), np.sin(lean)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return _legged("quadruped", _QUADRUPED, length, mass, trunk, {"left": turn, "right": turn})


def _size(name: str, length: float, mass: float) -> tuple[float, float]:
    return (
        finite_number(length, f"{name} length [m]", above=0.0, error=BodyError),
        finite_number(mass, f"{name} mass [kg]", above=0.0, error=BodyError),
    )


def _legged(
    name: str, plan: _LegPlan, length: float, mass: float, trunk: Segment, turns: Mapping[str, FloatArray]
) -> BodyModel:
    """The body of a trunk with legs; ``turns`` are the axes of the tips on both sides."""
    segments, effectors, angles, limbs = [trunk], {}, {}, []
    for pair in plan.hips:
        for side, other, sign in (("left", "right", 1.0), ("right", "left", -1.0)):
            leg = f"{side}_{pair}"
            parts = _leg(plan, leg, pair, sign, length, mass)
            end = plan.direction(sign) * (list(plan.parts.values())[-1][0] * length)
            effectors[f"{leg}_tip"] = Effector(f"{leg}_tip", parts[-1].name, end, turns[side])
            angles |= {f"{leg}_{k}": float(np.deg2rad(a)) for k, a in plan.standing_deg[pair].items()}
            chain = tuple(part.name for part in parts)
            limbs.append(Limb(f"{leg}_leg", f"{leg}_tip", chain, ContactKind.POINT, f"{other}_{pair}_leg"))
            segments += parts
    return BodyModel(name, tuple(segments), effectors, angles, limbs=tuple(limbs))


def _leg(plan: _LegPlan, leg: str, pair: str, sign: float, length: float, mass: float) -> list[Segment]:
    """Parts of a leg from the hip to the tip; a shape ends at the next joint, the last one before its tip.

    Right hinges reflect the left ones.
    """
    origin, parent = np.array([plan.hips[pair] * length, sign * plan.aside * length, 0.0]), "trunk"
    direction, parts = plan.direction(sign), []
    reflection, strength = np.array([sign, 1.0, sign]), 9.81 * mass * length
    for part, (share, thick, mass_share) in plan.parts.items():
        reach, radius, part_mass = direction * (share * length), thick * length, mass_share * mass
        span = share * length - radius * (1.0 + (plan.tip_free if part == list(plan.parts)[-1] else 0.0))
        turn = ALONG_Y if plan.axis == 1 else None
        shape = Shape(part, ShapeKind.CAPSULE, (radius, span), direction * (0.5 * span), turn)
        hinges = tuple(
            Hinge(
                f"{leg}_{joint}", reflection * np.array(axis), float(np.deg2rad(lower)),
                float(np.deg2rad(upper)), _SPEED, -torque * strength, torque * strength,
            )
            for joint, axis, lower, upper, torque in plan.hinges[part]
        )  # fmt: skip
        inertia = cylinder_inertia(part_mass, radius, share * length, plan.axis)
        name = f"{leg}_{part}"
        parts.append(Segment(name, parent, origin, hinges, part_mass, 0.5 * reach, inertia, (shape,)))
        parent, origin = name, reach
    return parts


def _point(mass: float, at: FloatArray) -> FloatArray:
    """Inertia (3, 3) of a point mass about the origin."""
    return mass * (float(at @ at) * np.eye(3) - np.outer(at, at))
