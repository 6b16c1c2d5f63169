"""Obstacles as plain solids: signed distances of points, and the flat pieces that can carry a contact.

Everything is computed from the obstacles' own sizes by elementary formulas; nothing is shared with the
distances that planning uses, so that an error there is found here.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.numerics.spatial import FloatArray
from manikin.scene.mesh import Mesh
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Obstacle, Plane, Sphere
from manikin.verification.triangles import NORMAL_LIMIT, Triangles, distance_to_triangles, winding_numbers

REACH = 0.25
"""Distance beyond which obstacles are not measured any more [m]."""


@dataclass(frozen=True, eq=False)
class Solid:
    """An obstacle with what is needed to measure distances to it.

    Attributes:
        obstacle: The obstacle.
        padded: Whether any part of the body may lean on it.
    """

    obstacle: Obstacle
    padded: bool = False

    @property
    def name(self) -> str:
        """Name of the obstacle."""
        return self.obstacle.name

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of a box around it with the world's axes [m]; infinite where endless."""
        shape, place = self.obstacle.shape, self.obstacle
        if isinstance(shape, Mesh):
            corners = self.triangles.corners.reshape(-1, 3)
            return corners.min(axis=0), corners.max(axis=0)
        if isinstance(shape, (Plane, HalfSpace)):
            return np.full(3, -np.inf), np.full(3, np.inf)
        half = np.abs(place.rotation) @ _half_size(shape)
        return place.translation - half, place.translation + half

    @cached_property
    def triangles(self) -> Triangles:
        """Triangles of a mesh in the world.

        Raises:
            TypeError: If the obstacle is no mesh.
        """
        shape, place = self.obstacle.shape, self.obstacle
        if not isinstance(shape, Mesh):
            raise TypeError(f"obstacle {self.name!r} is no mesh")
        parts = [place.to_world(piece.vertices)[piece.faces] for piece in shape.pieces]
        counts = [len(part) for part in parts]
        closed = np.repeat([piece.closed for piece in shape.pieces], counts)
        return Triangles(np.concatenate(parts), np.repeat(np.arange(len(parts)), counts), closed)

    def distance(self, points: FloatArray) -> FloatArray:
        """(n,) signed distance of points (n, 3) [m]: negative inside; of a mesh infinite beyond the reach."""
        shape, place = self.obstacle.shape, self.obstacle
        if isinstance(shape, (Plane, HalfSpace)):
            normal, offset = place.world_plane
            height = points @ normal - offset
            return np.abs(height) if isinstance(shape, Plane) else height
        if isinstance(shape, Mesh):
            return self._distance_to_mesh(points)
        local = (points - place.translation) @ place.rotation
        if isinstance(shape, Sphere):
            return np.linalg.norm(local, axis=-1) - shape.radius
        if isinstance(shape, Capsule):
            along = np.clip(local[..., 2], -0.5 * shape.length, 0.5 * shape.length)
            local[..., 2] -= along
            return np.linalg.norm(local, axis=-1) - shape.radius
        if isinstance(shape, Cylinder):
            across = np.hypot(local[..., 0], local[..., 1]) - shape.radius
            beyond = np.stack([across, np.abs(local[..., 2]) - 0.5 * shape.length], axis=-1)
        else:
            beyond = np.abs(local) - 0.5 * shape.size
        return box_distance(beyond)

    def _distance_to_mesh(self, points: FloatArray) -> FloatArray:
        low, high = points.min(axis=0) - REACH, points.max(axis=0) + REACH
        near = self.triangles.overlapping(low, high)
        if not len(near):
            return np.full(len(points), np.inf)
        distance = distance_to_triangles(points, self.triangles.corners[near]).min(axis=1)
        return np.where(self.inside(points), -distance, np.where(distance <= REACH, distance, np.inf))

    def inside(self, points: FloatArray) -> np.ndarray:
        """(n,) whether points (n, 3) are inside a closed piece of a mesh."""
        result = np.zeros(len(points), dtype=bool)
        for piece in np.unique(self.triangles.piece[self.triangles.closed]):
            corners = self.triangles.corners[self.triangles.piece == piece]
            low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
            asked = np.flatnonzero(np.all((points >= low) & (points <= high), axis=1) & ~result)
            if len(asked):
                result[asked] = np.abs(winding_numbers(points[asked], corners)) > 0.5
        return result

    def support(
        self, points: FloatArray, normal: FloatArray, max_angle: float
    ) -> tuple[FloatArray, FloatArray]:
        """Distance (n,) [m] of points (n, 3) to the flat pieces that face a direction, and their angle (n,).

        Args:
            normal: (3,) unit direction from the surface into the body.
            max_angle: Largest angle between it and a piece's outward normal [rad].

        Returns:
            Distances, infinite where nothing faces there, and angles of the nearest piece [rad]; of pieces
            that are equally near (to 0.1 mm) the one with the smallest angle.
        """
        best, angle = np.full(len(points), np.inf), np.full(len(points), np.pi)
        for distance, facing in self._pieces(points, normal, float(np.cos(max_angle))):
            off = np.arccos(np.clip(facing, -1.0, 1.0))
            nearer = (distance < best - 1e-4) | ((distance < best + 1e-4) & (off < angle))
            best, angle = np.minimum(best, distance), np.where(nearer, off, angle)
        return best, angle

    def _pieces(
        self, points: FloatArray, normal: FloatArray, least: float
    ) -> Iterable[tuple[FloatArray, FloatArray]]:
        """Distance (n,) to each flat piece (or to the nearest triangle) and cosine (n,) of its angle."""
        shape, place = self.obstacle.shape, self.obstacle
        every = np.ones(len(points))
        if isinstance(shape, (Plane, HalfSpace)):
            own, offset = place.world_plane
            for sign in (1.0, -1.0) if isinstance(shape, Plane) else (1.0,):
                if sign * (own @ normal) >= least:
                    yield np.abs(points @ own - offset), sign * (own @ normal) * every
        elif isinstance(shape, Mesh):
            triangles = self.triangles
            low, high = points.min(axis=0) - REACH, points.max(axis=0) + REACH
            near = triangles.overlapping(low, high)
            near = near[triangles.normals[near] @ normal >= least]
            if len(near):
                table, facing = (
                    distance_to_triangles(points, triangles.corners[near]),
                    triangles.normals[near] @ normal,
                )
                # Of triangles that are equally near, as along a shared edge, the one that faces best.
                close = table <= table.min(axis=1, keepdims=True) + NORMAL_LIMIT
                yield table.min(axis=1), np.where(close, facing, -1.0).max(axis=1)
        elif isinstance(shape, (Box, Cylinder)):
            local = (points - place.translation) @ place.rotation
            for axis in range(3) if isinstance(shape, Box) else (2,):
                for sign in (1.0, -1.0):
                    facing = sign * float(place.rotation[:, axis] @ normal)
                    if facing >= least:
                        yield _to_face(shape, local, axis, sign), facing * every


def _half_size(shape: Box | Sphere | Cylinder | Capsule) -> FloatArray:
    if isinstance(shape, Box):
        return 0.5 * shape.size
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius)
    ends = shape.radius if isinstance(shape, Capsule) else 0.0
    return np.array([shape.radius, shape.radius, 0.5 * shape.length + ends])


def box_distance(beyond: FloatArray) -> FloatArray:
    """(...) signed distance to a box from how far (..., d) points are beyond its faces [m]."""
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return outside + np.minimum(beyond.max(axis=-1), 0.0)


def _to_face(shape: Box | Cylinder, local: FloatArray, axis: int, sign: float) -> FloatArray:
    """(n,) distance of points in the shape's frame to one flat face of it."""
    if isinstance(shape, Cylinder):
        height = local[:, 2] - sign * 0.5 * shape.length
        beside = np.maximum(np.hypot(local[:, 0], local[:, 1]) - shape.radius, 0.0)
        return np.hypot(height, beside)
    half = 0.5 * shape.size
    off = np.maximum(np.abs(local) - half, 0.0)
    off[:, axis] = local[:, axis] - sign * half[axis]
    return np.linalg.norm(off, axis=1)
