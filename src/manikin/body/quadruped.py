"""A four-legged body: trunk, head and four legs of three hinges, as dogs and walking robots have them.

Proportions, ranges, speeds and strengths are our own choice, near those of walking robots that climb stairs:
legs as long as three quarters of the trunk, knees behind the feet as elbows are, torques of up to a third of
weight times length.
"""

import numpy as np

from manikin.body.further_bodies import mirrored_hinges, rod_inertia
from manikin.body.model import BodyModel
from manikin.body.segments import Effector, Limb, Segment, Shape, ShapeKind
from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number

_HIP = {"front": 0.38, "rear": -0.38}
"""Place of the hips along the trunk, as a share of its length."""
_HIP_Y = 0.15
_TRUNK_RADIUS = 0.12
_HEAD = {"radius": 0.10, "at": (0.54, 0.0, 0.10)}
_PARTS = {"thigh": (0.37, 0.050, 0.040), "shank": (0.37, 0.032, 0.015)}
"""Length and radius as shares of the trunk's length, mass as a share of the body's."""
_HEAD_SHARE = 0.06
_TIP_FREE = 0.4
"""Distance of the shank's shape to the tip in radii, so that a shank may lean by 45 degrees."""
_HINGES = {
    # Segment: name, axis of the left leg, range [deg], strength in units of weight times length.
    "thigh": (("roll", (1.0, 0.0, 0.0), -45.0, 45.0, 0.3), ("pitch", (0.0, 1.0, 0.0), -50.0, 130.0, 0.35)),
    "shank": (("knee", (0.0, -1.0, 0.0), 5.0, 155.0, 0.35),),
}
_STANDING_DEG = {"pitch": 38.0, "knee": 76.0}


def quadruped(length: float = 0.8, mass: float = 32.0) -> BodyModel:
    """Make a quadruped of a trunk length [m] > 0 and a mass [kg] > 0 with four legs of three hinges each.

    Segment frames are parallel to the world in the zero posture, in which all legs hang straight down. A hip
    rolls the leg outward and pitches it backward; a knee bends the shank forward. Effectors
    ``left_front_tip`` ... ``right_rear_tip`` are the ends of the shanks, their z axes up in the standing
    posture; limbs are ``left_front_leg`` ... ``right_rear_leg``, and touch in points.
    """
    length = finite_number(length, "quadruped length [m]", above=0.0, error=BodyError)
    mass = finite_number(mass, "quadruped mass [kg]", above=0.0, error=BodyError)
    legs = [(f"{side}_{pair}", pair, side) for pair in _HIP for side in ("left", "right")]
    segments = [_trunk(length, mass)]
    for name, pair, side in legs:
        segments += _leg(name, pair, 1.0 if side == "left" else -1.0, length, mass)
    return BodyModel(
        name="quadruped",
        segments=tuple(segments),
        effectors={f"{name}_tip": _tip(name, length) for name, _, _ in legs},
        standing_angles={
            f"{name}_{joint}": float(np.deg2rad(angle))
            for name, _, _ in legs
            for joint, angle in _STANDING_DEG.items()
        },
        limbs=tuple(_limb(name, pair, side) for name, pair, side in legs),
    )


def _trunk(length: float, mass: float) -> Segment:
    """Trunk and head in one, the head a point mass."""
    own = mass * (1.0 - _HEAD_SHARE - 4.0 * sum(share for *_, share in _PARTS.values()))
    head, at = _HEAD_SHARE * mass, np.array(_HEAD["at"]) * length
    radius = _TRUNK_RADIUS * length
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    shapes = (
        Shape("trunk", ShapeKind.CAPSULE, (radius, length - 2.0 * radius), rotation=turn),
        Shape("head", ShapeKind.SPHERE, (_HEAD["radius"] * length,), at),
    )
    middle = head * at / (own + head)
    inertia = rod_inertia(own, radius, length, axis=0) + _point(own, middle) + _point(head, at - middle)
    return Segment("trunk", None, np.zeros(3), (), own + head, middle, inertia, shapes)


def _point(mass: float, at: FloatArray) -> FloatArray:
    """Inertia (3, 3) of a point mass about the origin."""
    return mass * (float(at @ at) * np.eye(3) - np.outer(at, at))


def _leg(name: str, pair: str, sign: float, length: float, mass: float) -> list[Segment]:
    """Thigh and shank, each along -z in the zero posture."""
    origin, parent = np.array([_HIP[pair] * length, sign * _HIP_Y * length, 0.0]), "trunk"
    parts = []
    for part, (share, thick, mass_share) in _PARTS.items():
        reach, radius = np.array([0.0, 0.0, -share * length]), thick * length
        free = radius * (1.0 + (_TIP_FREE if part == "shank" else 0.0))
        shape = Shape(
            part,
            ShapeKind.CAPSULE,
            (radius, share * length - free),
            0.5 * (reach + np.array([0.0, 0.0, free])),
        )
        part_mass = mass_share * mass
        parts.append(
            Segment(
                f"{name}_{part}", parent, origin,
                mirrored_hinges(name, sign, 9.81 * mass * length, _HINGES[part]), part_mass,
                0.5 * reach, rod_inertia(part_mass, radius, share * length, axis=2), (shape,),
            )
        )  # fmt: skip
        parent, origin = f"{name}_{part}", reach
    return parts


def _tip(name: str, length: float) -> Effector:
    """End of a shank; turned back by the angle at which the shank stands."""
    lean = np.deg2rad(_STANDING_DEG["knee"] - _STANDING_DEG["pitch"])
    cos, sin = np.cos(lean), np.sin(lean)
    turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return Effector(f"{name}_tip", f"{name}_shank", np.array([0.0, 0.0, -_PARTS["shank"][0] * length]), turn)


def _limb(name: str, pair: str, side: str) -> Limb:
    other = "right" if side == "left" else "left"
    chain = tuple(f"{name}_{part}" for part in _PARTS)
    return Limb(f"{name}_leg", f"{name}_tip", chain, ContactKind.POINT, f"{other}_{pair}_leg")
