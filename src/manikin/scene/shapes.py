"""Shapes of obstacles, each in its own frame: plain sizes, checked once.

Solids have an inside; a plane has none. Long shapes lie along their local z axis.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import SceneError
from manikin.scene.mesh import Mesh
from manikin.spatial import FloatArray, finite_number, frozen_array

LARGEST_SIZE = 1000.0
"""Sizes beyond this [m] are taken for a mistaken unit."""


@dataclass(frozen=True, eq=False)
class Box:
    """A rectangular box centred on its frame.

    Attributes:
        size: (3,) full side lengths [m], > 0.
    """

    size: FloatArray

    def __init__(self, size: ArrayLike) -> None:
        lengths = frozen_array(size, "box size [m]", (3,), SceneError)
        for axis, length in zip("xyz", lengths, strict=True):
            _length(length, f"box size along {axis}")
        object.__setattr__(self, "size", lengths)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball centred on its frame.

    Attributes:
        radius: [m], > 0.
    """

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(self.radius, "sphere radius"))


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A solid cylinder along z, centred on its frame.

    Attributes:
        radius: [m], > 0.
        length: Along z [m], > 0.
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(self.radius, "cylinder radius"))
        object.__setattr__(self, "length", _length(self.length, "cylinder length"))


@dataclass(frozen=True, eq=False)
class Capsule:
    """A cylinder along z closed by two half balls, centred on its frame.

    Attributes:
        radius: [m], > 0.
        length: Of the cylindrical part [m], > 0; the whole is ``length + 2 radius`` long.
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(self.radius, "capsule radius"))
        object.__setattr__(self, "length", _length(self.length, "capsule length"))


@dataclass(frozen=True, eq=False)
class Plane:
    """The two-sided surface ``normal . x = offset``, without thickness or inside.

    Attributes:
        normal: (3,) unit vector (normalised on construction).
        offset: Along the unit normal [m].
    """

    normal: FloatArray
    offset: float

    def __init__(self, normal: ArrayLike, offset: float = 0.0) -> None:
        object.__setattr__(self, "normal", _unit(normal, "plane normal"))
        object.__setattr__(self, "offset", _offset(offset, "plane offset"))


@dataclass(frozen=True, eq=False)
class HalfSpace:
    """Everything with ``normal . x <= offset``: a floor, a wall, the ground.

    Attributes:
        normal: (3,) unit vector out of the solid (normalised on construction).
        offset: Along the unit normal [m].
    """

    normal: FloatArray
    offset: float

    def __init__(self, normal: ArrayLike, offset: float = 0.0) -> None:
        object.__setattr__(self, "normal", _unit(normal, "half-space normal"))
        object.__setattr__(self, "offset", _offset(offset, "half-space offset"))


Shape = Box | Sphere | Cylinder | Capsule | Plane | HalfSpace | Mesh


def local_bounds(shape: Shape) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of the shape in its own frame; infinite for planes and half-spaces."""
    if isinstance(shape, Mesh):
        return shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    if isinstance(shape, (Plane, HalfSpace)):
        return np.full(3, -np.inf), np.full(3, np.inf)
    half = _half_size(shape)
    return -half, half


def _half_size(shape: Box | Sphere | Cylinder | Capsule) -> FloatArray:
    if isinstance(shape, Box):
        return shape.size / 2
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius)
    ends = shape.radius if isinstance(shape, Capsule) else 0.0
    return np.array([shape.radius, shape.radius, shape.length / 2 + ends])


def _length(value: object, name: str) -> float:
    return finite_number(value, f"{name} [m]", above=0.0, at_most=LARGEST_SIZE, error=SceneError)


def _offset(value: object, name: str) -> float:
    return finite_number(value, f"{name} [m]", error=SceneError)


def _unit(vector: ArrayLike, name: str) -> FloatArray:
    direction = frozen_array(vector, name, (3,), SceneError)
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise SceneError(f"{name} is {direction.tolist()}; valid: a direction that is not zero")
    if abs(length - 1.0) <= 4e-16:
        return direction  # unit to rounding already: a shape built from its own values is the same shape
    return frozen_array(direction / length, name, (3,), SceneError)
