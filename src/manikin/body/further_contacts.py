"""Knees, elbows and the pelvis as further contacts of a human ([Tonneau2015]_ 5.4.1, left open there).

The places are on the segments that exist: the knee in front of the origin of the lower leg, the
elbow behind that of the forearm, each on the thickest shape that meets there. Their z axes, the
normals of contacts, point through the joint, backwards and forwards. What a human sits on, the
effector ``buttocks``, belongs to the root: no joint moves it, so its limb has none and goes with the root.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.body.limbs import limbs_of
from manikin.body.model import BodyModel
from manikin.body.segments import Effector, Limb, ShapeKind
from manikin.contact import ContactKind
from manikin.errors import BodyError

_BACKWARD = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
_FORWARD = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
_JOINTS = (
    # Contact, the segments of the limb, where the contact is seen from the joint.
    ("knee", ("thigh", "leg"), 1.0),
    ("elbow", ("upper_arm", "forearm"), -1.0),
)

FURTHER = ("knees", "elbows", "pelvis")
"""Kinds of further contacts."""


def with_further_contacts(body: BodyModel, kinds: Collection[str] = FURTHER) -> BodyModel:
    """Give a human further limbs.

    Args:
        body: Like that of :func:`manikin.body.human`.
        kinds: Of :data:`FURTHER`: ``left_knee`` and ``right_knee``, ``left_elbow`` and ``right_elbow``,
            ``pelvis``.

    Raises:
        BodyError: If a kind is not known, or the body lacks the parts.
    """
    unknown = sorted(set(kinds) - set(FURTHER))
    if unknown:
        raise BodyError(f"further contact is {unknown[0]!r}; valid: {', '.join(FURTHER)}")
    effectors, limbs = dict(body.effectors), list(limbs_of(body))
    for joint, parts, ahead in _JOINTS:
        if f"{joint}s" not in kinds:
            continue
        for side, other in (("left", "right"), ("right", "left")):
            chain = tuple(f"{side}_{part}" for part in parts)
            name = f"{side}_{joint}"
            effectors[name] = _effector(body, name, chain, ahead)
            limbs.append(Limb(name, name, chain, ContactKind.POINT, f"{other}_{joint}"))
    if "pelvis" in kinds:
        limbs.append(_pelvis(body))
    return replace(body, effectors=effectors, limbs=tuple(limbs))


def with_knees_and_elbows(body: BodyModel) -> BodyModel:
    """Give a human the effectors and limbs ``left_knee``, ``right_knee``, ``left_elbow``, ``right_elbow``.

    Raises:
        BodyError: If the body has no arms and legs like those of :func:`manikin.body.human`.
    """
    return with_further_contacts(body, ("knees", "elbows"))


def _pelvis(body: BodyModel) -> Limb:
    """What presses on a seat: a patch of the root, with no joint between."""
    if body.stature is None or "buttocks" not in body.effectors:
        raise BodyError(f"body {body.name!r} has no buttocks; valid: a human")
    segment = body.effector("buttocks").segment
    patch = (SEAT_LENGTH * body.stature, SEAT_WIDTH * body.stature)
    return Limb("pelvis", "buttocks", (segment,), ContactKind.SOLE, patch=patch)


def _effector(body: BodyModel, name: str, chain: tuple[str, ...], ahead: float) -> Effector:
    shapes = [shape for part in chain for shape in body.segment(part).shapes]
    radii = [float(shape.size[0]) for shape in shapes if shape.kind is ShapeKind.CAPSULE]
    if not radii:
        raise BodyError(f"{name} has no round shape around it; valid: a body with capsules for limbs")
    turn = _BACKWARD if ahead > 0.0 else _FORWARD
    return Effector(name, chain[-1], np.array([ahead * max(radii), 0.0, 0.0]), turn)
