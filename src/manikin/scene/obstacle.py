"""Obstacles: named shapes with a placement.

Shapes are plain, checked sizes in their own frames; long ones lie along their local z axis.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray, axes_of_normal, check_rotation, finite_number, frozen_array
from manikin.runtime.display import Displayed
from manikin.scene.mesh import Mesh, as_trimesh

LARGEST_SIZE = 1000.0
"""Sizes beyond this [m] are taken for a mistaken unit."""


@dataclass(frozen=True, eq=False)
class Box:
    """A rectangular box centred on its frame, of full side lengths ``size`` (3,) [m] > 0."""

    size: FloatArray

    def __init__(self, size: ArrayLike) -> None:
        lengths = frozen_array(size, "box size [m]", (3,), SceneError)
        for axis, length in zip("xyz", lengths, strict=True):
            _length(length, f"box size along {axis}")
        object.__setattr__(self, "size", lengths)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ball centred on its frame, of ``radius`` [m] > 0."""

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(self.radius, "sphere radius"))


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A solid cylinder along z, centred on its frame, of ``radius`` and ``length`` [m] > 0."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(self.radius, "cylinder radius"))
        object.__setattr__(self, "length", _length(self.length, "cylinder length"))


@dataclass(frozen=True, eq=False)
class Capsule:
    """A cylinder of ``radius`` and ``length`` [m] > 0 along z, with half balls on both ends, centred."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", _length(self.radius, "capsule radius"))
        object.__setattr__(self, "length", _length(self.length, "capsule length"))


@dataclass(frozen=True, eq=False)
class _Endless:
    normal: FloatArray
    offset: float

    def __init__(self, normal: ArrayLike, offset: float = 0.0) -> None:
        kind = "plane" if isinstance(self, Plane) else "half-space"
        object.__setattr__(self, "normal", _unit(normal, f"{kind} normal"))
        object.__setattr__(self, "offset", finite_number(offset, f"{kind} offset [m]", error=SceneError))


class Plane(_Endless):
    """The two-sided surface ``normal . x = offset`` [m] of a unit normal (3,), without inside."""


class HalfSpace(_Endless):
    """Everything with ``normal . x <= offset`` [m] of a unit normal (3,): a floor, a wall, the ground."""


Shape = Box | Sphere | Cylinder | Capsule | Plane | HalfSpace | Mesh


def extents(shape: Shape) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner of the shape in its own frame; infinite for planes and half-spaces."""
    if isinstance(shape, Mesh):
        return shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    if isinstance(shape, (Plane, HalfSpace)):
        return np.full(3, -np.inf), np.full(3, np.inf)
    half = _reach(shape, np.eye(3))
    return -half, half


def _reach(shape: Box | Sphere | Cylinder | Capsule, rotation: FloatArray) -> FloatArray:
    """(3,) half size of the axis-aligned box around a shape that is turned [m]."""
    if isinstance(shape, Box):
        return np.abs(rotation) @ (shape.size / 2)
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius)
    axis = np.abs(rotation[:, 2])
    across = 1.0 if isinstance(shape, Capsule) else np.sqrt(np.maximum(1.0 - axis**2, 0.0))
    return shape.length / 2 * axis + shape.radius * across


def _length(value: object, name: str) -> float:
    return finite_number(value, f"{name} [m]", above=0.0, at_most=LARGEST_SIZE, error=SceneError)


def _unit(vector: ArrayLike, name: str) -> FloatArray:
    direction = frozen_array(vector, name, (3,), SceneError)
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        raise SceneError(f"{name} is {direction.tolist()}; valid: a direction that is not zero")
    if abs(length - 1.0) <= 4e-16:
        return direction  # unit to rounding already: a shape built from its own values is the same shape
    return frozen_array(direction / length, name, (3,), SceneError)


DRAWN_HALF_SIZE = 10.0
"""Half the side of the square that stands for an endless plane when drawn [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Obstacle(Displayed):
    """A shape at a fixed placement in the scene, in which its name is unique.

    Its rotation (3, 3) is shape-to-world, its translation (3,) the origin of the shape's frame there [m].
    """

    name: str
    shape: Shape
    rotation: FloatArray
    translation: FloatArray

    def __init__(
        self, name: str, shape: Shape, rotation: ArrayLike | None = None,
        translation: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:  # fmt: skip
        if not isinstance(name, str) or not name or "/" in name:
            raise SceneError(f"obstacle name is {name!r}; valid: a non-empty text without '/'")
        where = f"obstacle {name!r}"
        if not isinstance(shape, Shape):
            valid = "Box, Sphere, Cylinder, Capsule, Plane, HalfSpace or Mesh"
            raise SceneError(f"{where} shape is {shape!r}; valid: {valid}")
        turn = check_rotation(np.eye(3) if rotation is None else rotation, f"{where} rotation", SceneError)
        place = frozen_array(translation, f"{where} translation [m]", (3,), SceneError)
        values = {"name": name, "shape": shape, "rotation": turn, "translation": place}
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the axis-aligned box around it in the world [m]."""
        if isinstance(self.shape, Mesh):
            placed = self.to_world(self.shape.vertices)
            return placed.min(axis=0), placed.max(axis=0)
        if isinstance(self.shape, (Plane, HalfSpace)):
            return extents(self.shape)
        reach = _reach(self.shape, self.rotation)
        return self.translation - reach, self.translation + reach

    def to_world(self, points: ArrayLike) -> FloatArray:
        """Map (..., 3) points of the shape's frame to the world."""
        return np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation

    @property
    def world_plane(self) -> tuple[FloatArray, float]:
        """Unit normal and offset in the world of a plane or half-space; SceneError of another shape."""
        if not isinstance(self.shape, (Plane, HalfSpace)):
            raise SceneError(f"obstacle {self.name!r} has no plane; valid: a Plane or HalfSpace shape")
        normal = self.rotation @ self.shape.normal
        return normal, float(self.shape.offset + normal @ self.translation)

    def to_trimesh(self) -> trimesh.Trimesh:
        """Triangles in the world, for drawing and export; endless shapes become a large square."""
        local = _triangles(self.shape)
        return as_trimesh(self.to_world(local.vertices), np.asarray(local.faces, dtype=np.int64))


def _triangles(shape: Shape) -> trimesh.Trimesh:
    if isinstance(shape, Mesh):
        return as_trimesh(shape.vertices, shape.faces)
    if isinstance(shape, Box):
        return trimesh.creation.box(shape.size)
    if isinstance(shape, Sphere):
        return trimesh.creation.icosphere(subdivisions=3, radius=shape.radius)
    if isinstance(shape, Cylinder):
        return trimesh.creation.cylinder(shape.radius, shape.length)
    if isinstance(shape, Capsule):
        capsule = trimesh.creation.capsule(height=shape.length, radius=shape.radius)
        capsule.apply_translation([0.0, 0.0, -capsule.bounds.mean(axis=0)[2]])
        return capsule
    axes = DRAWN_HALF_SIZE * axes_of_normal(shape.normal)[:, :2].T
    corners = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int64)
    return as_trimesh(corners @ axes + shape.normal * shape.offset, faces)
