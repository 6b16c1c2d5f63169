"""Shapes, inertias, axes and limbs that the parts of human bodies have in common."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from manikin.body.segments import Limb, Shape, ShapeKind
from manikin.contact import ContactKind
from manikin.spatial import FloatArray

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


def upright_capsule(name: str, radius: float, start: ArrayLike, end: ArrayLike) -> Shape:
    """Upright capsule between two points on one vertical."""
    first, last = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    return Shape(name, ShapeKind.CAPSULE, (radius, abs(last[2] - first[2])), 0.5 * (first + last))


def cylinder_inertia(mass: float, radius: float, length: float) -> FloatArray:
    """Inertia of an upright solid cylinder about its centre."""
    across_axis = mass * (3.0 * radius**2 + length**2) / 12.0
    return np.diag([across_axis, across_axis, 0.5 * mass * radius**2])


def cuboid_inertia(mass: float, extents: FloatArray) -> FloatArray:
    """Inertia of a solid cuboid about its centre."""
    squares = extents**2
    return np.diag(mass / 12.0 * (squares.sum() - squares))


def arms_and_legs(arm: Sequence[str], leg: Sequence[str]) -> tuple[Limb, ...]:
    """Limbs of both sides; a hand presses with its palm, unless a grasp is asked for.

    Args:
        arm: Segments of an arm from the trunk outward, without their side.
        leg: Of a leg.
    """
    chains = (("arm", "hand", arm, ContactKind.POINT), ("leg", "foot", leg, ContactKind.SOLE))
    return tuple(
        Limb(
            f"{side}_{name}", f"{side}_{effector}", tuple(f"{side}_{part}" for part in parts), kind,
            f"{other}_{name}",
        )
        for name, effector, parts, kind in chains
        for side, other in (("left", "right"), ("right", "left"))
    )  # fmt: skip
