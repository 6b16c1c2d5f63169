"""An insect of six legs, to try creatures other than the human.

The thesis prints 4 degrees of freedom per leg and 33 in all in one place and 5 per leg in another;
33 fits neither with a free root. We take the insect of the results: six legs of five hinges and a
free root, 36 degrees of freedom ([Tonneau2015]_ Fig. 8.1). It prints no dimension, so proportions,
ranges, speeds and strengths are our own choice.
"""

import numpy as np

from manikin.body.model import BodyModel
from manikin.body.segments import Effector, Hinge, Limb, Segment, Shape, ShapeKind
from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.spatial import FloatArray, finite_number

_PAIRS = ("front", "middle", "rear")
_HIP_X = {"front": 0.24, "middle": 0.0, "rear": -0.24}
"""Place of the hips along the trunk, as a share of its length."""
_HEADING_DEG = {"front": 40.0, "middle": 0.0, "rear": -40.0}
"""Direction in which a leg stands, forward of straight sideways [deg]."""
_HIP_Y = 0.13
_LENGTHS = {"femur": 0.34, "tibia": 0.42, "tarsus": 0.14}
_RADII = {"femur": 0.035, "tibia": 0.025, "tarsus": 0.012}
_TIP_FREE = 0.4
"""Distance of the tarsus' shape to its tip in radii, so that a tip may lean by 45 degrees where it stands."""
_MASS_SHARES = {"femur": 0.025, "tibia": 0.015, "tarsus": 0.005}
_TRUNK_RADIUS = 0.11
_SPEED = 12.0
_HINGES = {
    # Segment: name, axis of the left leg, range [deg], strength in units of weight times length.
    "femur": (
        ("sweep", (0.0, 0.0, 1.0), -75.0, 75.0, 0.3),
        ("lift", (1.0, 0.0, 0.0), -45.0, 90.0, 0.5),
        ("twist", (0.0, 1.0, 0.0), -40.0, 40.0, 0.2),
    ),
    "tibia": (("knee", (-1.0, 0.0, 0.0), 0.0, 150.0, 0.4),),
    "tarsus": (("ankle", (-1.0, 0.0, 0.0), -70.0, 70.0, 0.1),),
}
_STANDING_DEG = {"lift": 25.0, "knee": 105.0, "ankle": 10.0}


def insect(length: float = 0.4, mass: float = 2.0) -> BodyModel:
    """Make an insect: a trunk and six legs of five hinges each.

    Segment frames are parallel to the world in the zero posture, in which all legs point straight
    to the side. A hip sweeps backward, lifts and twists about the leg; knee and ankle bend
    down. Effectors ``left_front_tip`` ... ``right_rear_tip`` are the ends of the tarsi, their z
    axes along the tarsus towards the body; limbs are ``left_front_leg`` ... ``right_rear_leg``.

    Args:
        length: Of the trunk [m], > 0.
        mass: Of the whole insect [kg], > 0.

    Raises:
        BodyError: If a value is not positive.
    """
    length = finite_number(length, "insect length [m]", above=0.0, error=BodyError)
    mass = finite_number(mass, "insect mass [kg]", above=0.0, error=BodyError)
    legs = [(f"{side}_{pair}", pair, side) for pair in _PAIRS for side in ("left", "right")]
    segments = [_trunk(length, mass)]
    for name, pair, side in legs:
        segments += _leg(name, pair, 1.0 if side == "left" else -1.0, length, mass)
    return BodyModel(
        name="insect",
        segments=tuple(segments),
        effectors={f"{name}_tip": _tip(name, side, length) for name, _, side in legs},
        standing_angles={key: angle for name, pair, _ in legs for key, angle in _standing(name, pair)},
        limbs=tuple(_limb(name, pair, side) for name, pair, side in legs),
    )


def _trunk(length: float, mass: float) -> Segment:
    share = 1.0 - 6.0 * sum(_MASS_SHARES.values())
    radius = _TRUNK_RADIUS * length
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    shape = Shape("trunk", ShapeKind.CAPSULE, (radius, length - 2.0 * radius), rotation=turn)
    inertia = _rod(share * mass, radius, length, axis=0)
    return Segment("trunk", None, np.zeros(3), (), share * mass, np.zeros(3), inertia, (shape,))


def _leg(name: str, pair: str, sign: float, length: float, mass: float) -> list[Segment]:
    """Femur, tibia and tarsus, each along y in the zero posture."""
    origin = np.array([_HIP_X[pair] * length, sign * _HIP_Y * length, 0.0])
    parent, found = "trunk", []
    for part, share in _LENGTHS.items():
        reach = np.array([0.0, sign * share * length, 0.0])
        part_mass, radius = _MASS_SHARES[part] * mass, _RADII[part] * length
        found.append(
            Segment(
                f"{name}_{part}", parent, origin, _hinges(name, part, sign, 9.81 * mass * length),
                part_mass, 0.5 * reach, _rod(part_mass, radius, share * length, axis=1),
                (_rod_shape(part, radius, reach),),
            )
        )  # fmt: skip
        parent, origin = f"{name}_{part}", reach
    return found


def _hinges(name: str, part: str, sign: float, strength: float) -> tuple[Hinge, ...]:
    """Hinges of one segment; those of the right side are the reflection of the left ones."""
    reflection = np.ones(3) if sign > 0.0 else np.array([-1.0, 1.0, -1.0])
    return tuple(
        Hinge(
            f"{name}_{joint}", reflection * np.array(axis), float(np.deg2rad(lower)),
            float(np.deg2rad(upper)), _SPEED, -torque * strength, torque * strength,
        )
        for joint, axis, lower, upper, torque in _HINGES[part]
    )  # fmt: skip


def _rod_shape(part: str, radius: float, reach: FloatArray) -> Shape:
    """Capsule from the joint to the next, ending at it; a tarsus ends a little before its tip."""
    span = float(np.abs(reach[1])) - radius * (1.0 + (_TIP_FREE if part == "tarsus" else 0.0))
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    centre = 0.5 * span * np.sign(reach)
    return Shape(part, ShapeKind.CAPSULE, (radius, span), centre, turn)


def _rod(mass: float, radius: float, length: float, axis: int) -> FloatArray:
    """Inertia (3, 3) of a solid cylinder along one axis about its centre."""
    moments = np.full(3, mass * (3.0 * radius**2 + length**2) / 12.0)
    moments[axis] = 0.5 * mass * radius**2
    return np.diag(moments)


def _tip(name: str, side: str, length: float) -> Effector:
    sign = 1.0 if side == "left" else -1.0
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, -sign, 0.0])
    turn = np.column_stack([x, np.cross(z, x), z])
    return Effector(
        f"{name}_tip", f"{name}_tarsus", np.array([0.0, sign * _LENGTHS["tarsus"] * length, 0.0]), turn
    )


def _standing(name: str, pair: str) -> list[tuple[str, float]]:
    angles = {"sweep": -_HEADING_DEG[pair], **_STANDING_DEG}
    return [(f"{name}_{joint}", float(np.deg2rad(value))) for joint, value in angles.items()]


def _limb(name: str, pair: str, side: str) -> Limb:
    other = "right" if side == "left" else "left"
    chain = tuple(f"{name}_{part}" for part in _LENGTHS)
    return Limb(f"{name}_leg", f"{name}_tip", chain, ContactKind.POINT, f"{other}_{pair}_leg")
