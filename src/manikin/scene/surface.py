"""Planar faces of the scene that an effector can be put on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh

from manikin.numerics.spatial import FloatArray, axes_of_normal, frozen_array
from manikin.scene.mesh import Mesh, as_trimesh
from manikin.scene.obstacle import Box, Cylinder, HalfSpace, Obstacle, Plane

ENDLESS_HALF_SIZE = 1000.0
"""Half the side of the square polygon of an endless plane [m]."""
_CAP_CORNERS = 32
_SMALLEST_AREA = 1e-4  # [m^2]; smaller mesh facets hold no contact


@dataclass(frozen=True, eq=False)
class Surface:
    """A flat polygon of an obstacle, seen from its free side.

    Attributes:
        obstacle: Name of the obstacle.
        polygon: (k, 3) corners in the world [m], counter-clockwise about the normal;
            not necessarily convex.
        normal: (3,) unit normal, out of the obstacle.
    """

    obstacle: str
    polygon: FloatArray
    normal: FloatArray

    @cached_property
    def rotation(self) -> FloatArray:
        """(3, 3) surface-to-world rotation with z along the normal."""
        rotation = axes_of_normal(self.normal)
        rotation.setflags(write=False)
        return rotation

    @property
    def area(self) -> float:
        """[m^2]."""
        flat = self._flat(self.polygon)
        following = np.roll(flat, -1, axis=0)
        return float(0.5 * np.sum(flat[:, 0] * following[:, 1] - following[:, 0] * flat[:, 1]))

    @property
    def centre(self) -> FloatArray:
        """(3,) mean of the corners [m]."""
        return self.polygon.mean(axis=0)

    def height(self, points: FloatArray) -> FloatArray:
        """(k,) signed distance of (k, 3) points to the surface's plane, positive on its free side [m]."""
        return (points - self.polygon[0]) @ self.normal

    def outside(self, points: FloatArray) -> FloatArray:
        """(k,) distance in the plane from each projected point to the polygon [m]; 0 inside."""
        corners, flat = self._flat(self.polygon), self._flat(points)
        edge = np.roll(corners, -1, axis=0) - corners
        to_point = flat[:, None] - corners
        along = np.einsum("kei,ei->ke", to_point, edge) / np.einsum("ei,ei->e", edge, edge)
        nearest = to_point - np.clip(along, 0.0, 1.0)[..., None] * edge
        gap = np.sqrt(np.einsum("kei,kei->ke", nearest, nearest).min(axis=1))
        return np.where(self._inside(flat, corners), 0.0, gap)

    def distance(self, points: FloatArray) -> FloatArray:
        """(k,) distance of (k, 3) points to the polygon in space [m]."""
        return np.hypot(self.height(points), self.outside(points))

    def _flat(self, points: FloatArray) -> FloatArray:
        return (np.asarray(points) - self.polygon[0]) @ self.rotation[:, :2]

    @staticmethod
    def _inside(points: FloatArray, corners: FloatArray) -> np.ndarray:
        """Even-odd rule."""
        following = np.roll(corners, -1, axis=0)
        x, y = points[:, :1], points[:, 1:]
        straddles = (corners[:, 1] > y) != (following[:, 1] > y)
        rise = following[:, 1] - corners[:, 1]
        rise = np.where(rise == 0.0, 1.0, rise)
        crossing = corners[:, 0] + (y - corners[:, 1]) / rise * (following[:, 0] - corners[:, 0])
        return np.sum(straddles & (x < crossing), axis=1) % 2 == 1


def surfaces_of(obstacle: Obstacle) -> tuple[Surface, ...]:
    """Flat faces of an obstacle: box faces, cylinder caps, planes, coplanar mesh facets."""
    shape = obstacle.shape
    if isinstance(shape, Box):
        return _box_faces(obstacle, shape)
    if isinstance(shape, Cylinder):
        return _caps(obstacle, shape)
    if isinstance(shape, (Plane, HalfSpace)):
        return _endless(obstacle, shape)
    if isinstance(shape, Mesh):
        return _facets(obstacle, shape)
    return ()


def _surface(obstacle: Obstacle, polygon: FloatArray, normal: FloatArray) -> Surface:
    world_normal = obstacle.rotation @ normal
    return Surface(
        obstacle.name,
        frozen_array(obstacle.to_world(polygon), "polygon", (None, 3)),
        frozen_array(world_normal / np.linalg.norm(world_normal), "normal", (3,)),
    )


def _box_faces(obstacle: Obstacle, box: Box) -> tuple[Surface, ...]:
    half = box.size / 2
    faces = []
    for axis in (2, 0, 1):
        first, second = np.eye(3)[(axis + 1) % 3] * half, np.eye(3)[(axis + 2) % 3] * half
        for sign in (1.0, -1.0):
            normal = sign * np.eye(3)[axis]
            corners = [first + second, sign * (second - first), -first - second, sign * (first - second)]
            faces.append(_surface(obstacle, normal * half + np.array(corners), normal))
    return tuple(faces)


def _caps(obstacle: Obstacle, cylinder: Cylinder) -> tuple[Surface, ...]:
    angle = np.arange(_CAP_CORNERS) * 2 * np.pi / _CAP_CORNERS
    ring = cylinder.radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_CAP_CORNERS)])
    up = np.array([0.0, 0.0, 1.0])
    top = _surface(obstacle, ring + up * cylinder.length / 2, up)
    bottom = _surface(obstacle, ring[::-1] - up * cylinder.length / 2, -up)
    return top, bottom


def _endless(obstacle: Obstacle, shape: Plane | HalfSpace) -> tuple[Surface, ...]:
    normal = shape.normal
    first = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    first *= ENDLESS_HALF_SIZE / np.linalg.norm(first)
    second = np.cross(normal, first)
    corners = normal * shape.offset + np.array(
        [first + second, second - first, -first - second, first - second]
    )
    front = _surface(obstacle, corners, normal)
    if isinstance(shape, HalfSpace):
        return (front,)
    return front, _surface(obstacle, corners[::-1], -normal)


def _facets(obstacle: Obstacle, mesh: Mesh) -> tuple[Surface, ...]:
    """Coplanar triangles that touch, each group as the polygons of its outline.

    A facet with a hole gives its outer outline only; an outline that touches itself is
    skipped. Open pieces are seen from the side their triangles turn to.
    """
    surfaces = []
    for piece in mesh.pieces:
        whole = as_trimesh(piece.vertices, piece.faces)
        groups = [np.asarray(group) for group in whole.facets]
        grouped = np.concatenate(groups) if groups else np.zeros(0, dtype=np.int64)
        groups += [np.array([face]) for face in np.setdiff1d(np.arange(len(piece.faces)), grouped)]
        for group in groups:
            if whole.area_faces[group].sum() >= _SMALLEST_AREA:
                normal = np.einsum("i,ij->j", whole.area_faces[group], whole.face_normals[group])
                outline = _outline(whole, group, normal / np.linalg.norm(normal))
                if outline is not None:
                    surfaces.append(_surface(obstacle, outline, normal / np.linalg.norm(normal)))
    return tuple(surfaces)


def _outline(mesh: trimesh.Trimesh, group: np.ndarray, normal: FloatArray) -> FloatArray | None:
    """Corners of the longest boundary loop of a group of triangles."""
    directed = mesh.faces[group][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = {(int(a), int(b)) for a, b in directed}
    following = {a: b for a, b in edges if (b, a) not in edges}
    loops: list[list[int]] = []
    while following:
        loop = [min(following)]
        while loop[-1] in following:
            loop.append(following.pop(loop[-1]))
        loops.append(loop[:-1])
    polygons = [mesh.vertices[loop] for loop in loops if len(loop) >= 3]
    if not polygons:
        return None
    return max(polygons, key=lambda polygon: _doubled_area(polygon, normal))


def _doubled_area(polygon: FloatArray, normal: FloatArray) -> float:
    centred = polygon - polygon[0]
    return float(np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0) @ normal)
