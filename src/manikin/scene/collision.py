"""Obstacles as Coal geometries: exact primitives, convex pieces, triangle pieces."""

from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
import trimesh

import manikin.runtime.coal_workarounds  # noqa: F401  (before the first distance)
from manikin.numerics.spatial import FloatArray, axes_of_normal
from manikin.scene.mesh import IntArray, Mesh, MeshPiece
from manikin.scene.obstacle import (
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    Obstacle,
    Plane,
    Sphere,
    local_bounds,
)


@dataclass(frozen=True, eq=False)
class CollisionPart:
    """One Coal geometry of an obstacle.

    A convex mesh piece has a signed distance as exact as a primitive's. A closed piece
    that is not convex carries ``surface`` so that depth differs from clearance; an
    open piece is a surface without inside.

    Attributes:
        obstacle: Name of the obstacle.
        geometry: Coal geometry in the part's frame.
        rotation: (3, 3) part-to-world rotation.
        translation: (3,) [m].
        low: (3,) lower corner in the part's frame [m], infinite where endless.
        high: (3,) upper corner.
        surface: The closed, non-convex surface, or None.
    """

    obstacle: str
    geometry: coal.CollisionGeometry
    rotation: FloatArray
    translation: FloatArray
    low: FloatArray
    high: FloatArray
    surface: "ClosedSurface | None" = None


def collision_parts(obstacle: Obstacle) -> tuple[CollisionPart, ...]:
    """Split an obstacle into Coal geometries: one per primitive, one per connected mesh piece."""
    shape = obstacle.shape
    if isinstance(shape, Mesh):
        return tuple(_mesh_part(obstacle, piece) for piece in _merged_open_pieces(shape))
    if isinstance(shape, (Plane, HalfSpace)):
        return (_endless_part(obstacle, shape),)
    low, high = local_bounds(shape)
    return (
        CollisionPart(obstacle.name, _primitive(shape), obstacle.rotation, obstacle.translation, low, high),
    )


def _primitive(shape: Box | Sphere | Cylinder | Capsule) -> coal.CollisionGeometry:
    """Coal geometry of a primitive in its own frame."""
    if isinstance(shape, Box):
        return coal.Box(*shape.size)
    if isinstance(shape, Sphere):
        return coal.Sphere(shape.radius)
    kind = coal.Cylinder if isinstance(shape, Cylinder) else coal.Capsule
    return kind(shape.radius, shape.length)


@dataclass(frozen=True, eq=False)
class ClosedSurface:
    """A watertight triangle surface that can tell inside from outside.

    Attributes:
        vertices: (n, 3) [m].
        faces: (m, 3).
        geometry: The same as a Coal triangle mesh.
    """

    vertices: FloatArray
    faces: IntArray
    geometry: coal.CollisionGeometry

    def signed(self, point: FloatArray) -> tuple[float, FloatArray]:
        """Signed distance of a point [m], negative inside, and the nearest surface point.

        The sign is that of the angle-weighted normal of the nearest face, edge or vertex,
        which is exact on a closed surface (Baerentzen and Aanaes 2005).
        """
        result = coal.DistanceResult()
        place = coal.Transform3s(np.eye(3), point)
        # The mesh comes first: in the other order Coal loses the triangle's index.
        coal.distance(self.geometry, _HERE, _POINT, place, _REQUEST, result)
        nearest = result.getNearestPoint1()
        away = point - nearest
        distance = float(np.linalg.norm(away))
        return (distance if away @ self._normal_at(int(result.b1), nearest) >= 0.0 else -distance), nearest

    def _normal_at(self, face: int, point: FloatArray) -> FloatArray:
        """Angle-weighted normal of the face, its edge or its corner on which a point lies."""
        a, b, c = self.vertices[self.faces[face]]
        first, second, away = b - a, c - a, point - a
        gram = np.array([[first @ first, first @ second], [first @ second, second @ second]])
        weights = np.linalg.solve(gram, np.array([away @ first, away @ second]))
        shares = np.array([1.0 - weights.sum(), *weights])
        zero = shares < 1e-6
        if not zero.any():
            return self._face_normals[face]
        if zero.sum() == 1:
            return self._edge_normals[face, int(np.argmax(zero))]
        return self._vertex_normals[self.faces[face, int(np.argmax(shares))]]

    @cached_property
    def _face_normals(self) -> FloatArray:
        corners = self.vertices[self.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    @cached_property
    def _edge_normals(self) -> FloatArray:
        """(m, 3, 3): sum of the two faces' normals at the edge opposite to each corner."""
        edges = np.sort(self.faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        _, index = np.unique(edges, axis=0, return_inverse=True)
        sums = np.zeros((index.max() + 1, 3))
        np.add.at(sums, index.reshape(-1), np.repeat(self._face_normals, 3, axis=0))
        return sums[index.reshape(-1)].reshape(-1, 3, 3)

    @cached_property
    def _vertex_normals(self) -> FloatArray:
        corners = self.vertices[self.faces]
        ahead = np.roll(corners, -1, axis=1) - corners
        back = np.roll(corners, 1, axis=1) - corners
        cosine = np.einsum("fki,fki->fk", ahead, back)
        angle = np.arccos(
            np.clip(cosine / (np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)), -1.0, 1.0)
        )
        sums = np.zeros_like(self.vertices)
        np.add.at(sums, self.faces, angle[..., None] * self._face_normals[:, None])
        return sums


_REQUEST = coal.DistanceRequest()
_POINT = coal.Sphere(1e-9)
_HERE = coal.Transform3s.Identity()


def triangle_geometry(vertices: FloatArray, faces: IntArray) -> coal.CollisionGeometry:
    """Coal bounding-volume hierarchy over triangles."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(vertices))
    model.addSubModel(_coal_vertices(vertices), _coal_triangles(faces))
    model.endModel()
    model.computeLocalAABB()
    return model


def convex_geometry(vertices: FloatArray) -> coal.CollisionGeometry:
    """Coal convex polytope: the hull of the vertices."""
    hull = trimesh.convex.convex_hull(vertices)
    geometry = coal.Convex(_coal_vertices(hull.vertices), _coal_triangles(np.asarray(hull.faces)))
    geometry.computeLocalAABB()
    return geometry


def _endless_part(obstacle: Obstacle, shape: Plane | HalfSpace) -> CollisionPart:
    """Part whose frame has z along the normal, so that its bounds are tight."""
    normal = shape.normal
    endless = np.full(2, np.inf)
    up = np.array([0.0, 0.0, 1.0])
    solid = isinstance(shape, HalfSpace)
    return CollisionPart(
        obstacle=obstacle.name,
        geometry=coal.Halfspace(up, 0.0) if solid else coal.Plane(up, 0.0),
        rotation=obstacle.rotation @ axes_of_normal(normal),
        translation=obstacle.translation + obstacle.rotation @ (normal * shape.offset),
        low=np.append(-endless, -np.inf if solid else 0.0),
        high=np.append(endless, 0.0),
    )


def _mesh_part(obstacle: Obstacle, piece: MeshPiece) -> CollisionPart:
    surface = None
    if piece.convex:
        geometry = convex_geometry(piece.vertices)
    else:
        geometry = triangle_geometry(piece.vertices, piece.faces)
        surface = ClosedSurface(piece.vertices, piece.faces, geometry) if piece.closed else None
    low, high = piece.vertices.min(axis=0), piece.vertices.max(axis=0)
    return CollisionPart(obstacle.name, geometry, obstacle.rotation, obstacle.translation, low, high, surface)


def _merged_open_pieces(mesh: Mesh) -> list[MeshPiece]:
    """All closed pieces, and the open ones as one surface: fewer geometries, same distance."""
    closed = [piece for piece in mesh.pieces if piece.closed]
    loose = [piece for piece in mesh.pieces if not piece.closed]
    if not loose:
        return closed
    starts = np.cumsum([0, *(len(piece.vertices) for piece in loose[:-1])])
    vertices = np.vstack([piece.vertices for piece in loose])
    faces = np.vstack([piece.faces + start for piece, start in zip(loose, starts, strict=True)])
    return [*closed, MeshPiece(vertices, faces, closed=False, convex=False)]


def _coal_vertices(vertices: FloatArray) -> coal.StdVec_Vec3s:
    out = coal.StdVec_Vec3s()
    out.extend([np.asarray(vertex, dtype=np.float64) for vertex in vertices])
    return out


def _coal_triangles(faces: IntArray) -> coal.StdVec_Triangle:
    out = coal.StdVec_Triangle()
    out.extend([coal.Triangle(int(a), int(b), int(c)) for a, b, c in faces])
    return out
