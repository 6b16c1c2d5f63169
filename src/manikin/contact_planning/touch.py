"""The contact that an effector makes where it has been put."""

import math
from dataclasses import dataclass, replace

import numpy as np

from manikin.body import BodyModel, Limb
from manikin.contact import Contact, ContactKind, grasp, point, sole
from manikin.errors import ContactError
from manikin.spatial import FloatArray, frozen_array, skew

_RECTANGLE = np.array([[1, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])


@dataclass(frozen=True)
class ContactRules:
    """What contacts can carry.

    Attributes:
        friction: Coulomb coefficient of soles and points.
        grasp_force: Largest force of a grasp along each world axis [N].
        grasp_moment: Largest moment of a grasp along each world axis [N.m].
        patch: Part of a foot's sole that has to touch, as its start and end along the sole's x axis and its
            width [m]; the whole sole when None. A climber stands on the front of the feet.
    """

    friction: float = 0.7
    grasp_force: float = 400.0
    grasp_moment: float = 10.0
    patch: tuple[float, float, float] | None = None


def footprint(
    body: BodyModel, limb: Limb, kind: ContactKind, rules: ContactRules | None = None
) -> FloatArray:
    """(c, 3) points of the effector's frame that must lie on the surface [m].

    Args:
        body: The body.
        limb: Its limb, whose own patch goes before the body's soles.
        kind: How it touches.
        rules: Which part of a sole has to touch; all of it when omitted.

    Raises:
        ContactError: If a sole is asked for of a body without soles.
    """
    if kind is not ContactKind.SOLE:
        return np.zeros((1, 3))
    if limb.patch is not None:
        return _RECTANGLE * 0.5 * np.array([*limb.patch, 0.0])
    if body.sole_length is None or body.sole_width is None:
        raise ContactError(f"body {body.name!r} has no soles; valid: a contact of kind point or grasp")
    if rules is not None and rules.patch is not None:
        start, end, width = rules.patch
        side = 0.5 * width
        return np.array([[end, side, 0.0], [end, -side, 0.0], [start, -side, 0.0], [start, side, 0.0]])
    return _RECTANGLE * 0.5 * np.array([body.sole_length, body.sole_width, 0.0])


def make_contact(
    body: BodyModel,
    limb: Limb,
    kind: ContactKind,
    position: FloatArray,
    rotation: FloatArray,
    rules: ContactRules,
) -> Contact:
    """Contact of a limb's effector.

    Args:
        body: The body.
        limb: The limb.
        kind: How it touches.
        position: (3,) in the world [m].
        rotation: (3, 3) effector-to-world; its z column is the normal.
        rules: Friction and strengths.

    Raises:
        ContactError: If a value is out of its range, or a sole is asked for of a body without.
    """
    if kind is ContactKind.GRASP:
        return grasp(
            limb.effector, position, max_force=rules.grasp_force, max_moment=rules.grasp_moment,
            rotation=rotation,
        )  # fmt: skip
    if kind is ContactKind.POINT:
        return point(limb.effector, position, friction=rules.friction, rotation=rotation)
    length, width = 2.0 * footprint(body, limb, kind)[0, :2]
    whole = sole(
        limb.effector, position, length=length, width=width, friction=rules.friction, rotation=rotation
    )
    if rules.patch is None or limb.patch is not None:
        return whole
    return replace(whole, points=frozen_array(footprint(body, limb, kind, rules), "sole's patch [m]", (4, 3)))


def onto_normal(rotation: FloatArray, normal: FloatArray) -> FloatArray:
    """(3, 3) the rotation turned by the shortest way so that its z axis is the unit normal exactly."""
    across = skew(normal) @ rotation[:, 0]
    length = math.sqrt(across @ across)
    if length < 1e-9:
        across, length = np.array(rotation[:, 1]), 1.0
    y = across / length
    turned = np.empty((3, 3))
    turned[:, 0], turned[:, 1], turned[:, 2] = skew(y) @ normal, y, normal
    return turned
