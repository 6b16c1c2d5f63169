"""A named, placed shape."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from manikin.display import Displayed
from manikin.errors import SceneError
from manikin.scene.mesh import Convexity, Mesh, as_trimesh, load_mesh
from manikin.scene.shapes import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Plane,
    Shape,
    Sphere,
    local_bounds,
)
from manikin.spatial import FloatArray, check_rotation, frozen_array

DRAWN_HALF_SIZE = 10.0
"""Half the side of the square that stands for an endless plane when drawn [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Obstacle(Displayed):
    """A shape of the scene at a fixed place.

    Attributes:
        name: Unique in its scene.
        shape: Box, sphere, cylinder, capsule, plane, half-space or mesh.
        rotation: (3, 3) shape-to-world rotation.
        translation: (3,) origin of the shape's frame in the world [m].
    """

    name: str
    shape: Shape
    rotation: FloatArray
    translation: FloatArray

    def __init__(
        self,
        name: str,
        shape: Shape,
        rotation: ArrayLike | None = None,
        translation: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if not isinstance(name, str) or not name or "/" in name:
            raise SceneError(f"obstacle name is {name!r}; valid: a non-empty text without '/'")
        if not isinstance(shape, Shape):
            raise SceneError(
                f"obstacle {name!r} shape is {shape!r}; valid: Box, Sphere, Cylinder, Capsule, Plane, "
                "HalfSpace or Mesh"
            )
        where = f"obstacle {name!r}"
        matrix = np.eye(3) if rotation is None else rotation
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "rotation", check_rotation(matrix, f"{where} rotation", SceneError))
        object.__setattr__(
            self, "translation", frozen_array(translation, f"{where} translation [m]", (3,), SceneError)
        )

    @classmethod
    def from_file(
        cls,
        name: str,
        path: str | Path,
        *,
        unit: str | None = None,
        up: str | None = None,
        scale: float = 1.0,
        convex: Convexity = "no",
        rotation: ArrayLike | None = None,
        translation: ArrayLike = (0.0, 0.0, 0.0),
    ) -> "Obstacle":
        """Make an obstacle from a mesh file; arguments as for :func:`manikin.scene.load_mesh`.

        Raises:
            SceneError: If the file or the placement is not usable.
        """
        mesh = load_mesh(path, unit=unit, up=up, scale=scale, convex=convex)
        return cls(name, mesh, rotation, translation)

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the axis-aligned box around it in the world [m]."""
        if isinstance(self.shape, Mesh):
            placed = self.to_world(self.shape.vertices)
            return placed.min(axis=0), placed.max(axis=0)
        if isinstance(self.shape, (Plane, HalfSpace)):
            return local_bounds(self.shape)
        if isinstance(self.shape, Sphere):
            reach = np.full(3, self.shape.radius)
        elif isinstance(self.shape, Box):
            reach = np.abs(self.rotation) @ (self.shape.size / 2)
        else:
            reach = self._round_reach(self.shape)
        return self.translation - reach, self.translation + reach

    def to_world(self, points: ArrayLike) -> FloatArray:
        """Map (..., 3) points of the shape's frame to the world."""
        return np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation

    @property
    def world_plane(self) -> tuple[FloatArray, float]:
        """Unit normal and offset in the world of a plane or half-space.

        Raises:
            SceneError: If the shape is neither.
        """
        if not isinstance(self.shape, (Plane, HalfSpace)):
            raise SceneError(f"obstacle {self.name!r} has no plane; valid: a Plane or HalfSpace shape")
        normal = self.rotation @ self.shape.normal
        return normal, float(self.shape.offset + normal @ self.translation)

    def to_trimesh(self) -> trimesh.Trimesh:
        """Triangles in the world, for drawing and export; endless shapes become a large square."""
        local = _triangles(self.shape)
        return as_trimesh(self.to_world(local.vertices), np.asarray(local.faces, dtype=np.int64))

    def _round_reach(self, shape: Cylinder | Capsule) -> FloatArray:
        axis = np.abs(self.rotation[:, 2])
        across = 1.0 if isinstance(shape, Capsule) else np.sqrt(np.maximum(1.0 - axis**2, 0.0))
        return shape.length / 2 * axis + shape.radius * across


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
    return _square(shape)


def _square(shape: Plane | HalfSpace) -> trimesh.Trimesh:
    across = np.eye(3)[int(np.argmin(np.abs(shape.normal)))]
    first = np.cross(shape.normal, across)
    first /= np.linalg.norm(first)
    second = np.cross(shape.normal, first)
    corners = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    corner_offsets = [DRAWN_HALF_SIZE * (a * first + b * second) for a, b in corners]
    vertices: FloatArray = np.array(corner_offsets, dtype=np.float64) + shape.normal * shape.offset
    return as_trimesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int64))
