"""The surfaces of a scene as arrays: which are near, and what projects into their polygons."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from manikin.numerics.spatial import FloatArray
from manikin.scene.surface import Surface, walls_of
from manikin.scene.triangles import IntArray


class SurfaceTable:
    """The surfaces of a scene as arrays, so that all are tested at once.

    Attributes:
        normals: (m, 3) their unit normals.
        offsets: (m,) of their planes along the normals [m].
        group: (m,) number of the direction that a surface has for its normal.
        frames: (g, 3, 3) of each direction the normal and two axes in its planes.
        extents: (m, 3, 2) least and largest coordinates of the polygons along the axes of their frames [m].
        side_low: (m, 2) smallest coordinates of the polygons along these axes [m].
        side_high: (m, 2) largest ones.
        filled: (m,) whether a polygon is all of the rectangle between them, as the faces of boxes are.
    """

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        self.surfaces = tuple(surfaces)
        self.normals = np.array([item.normal for item in surfaces]).reshape(-1, 3)
        self.offsets = np.array([item.polygon[0] @ item.normal for item in surfaces])
        self._low = np.array([item.polygon.min(axis=0) for item in surfaces]).reshape(-1, 3)
        self._high = np.array([item.polygon.max(axis=0) for item in surfaces]).reshape(-1, 3)
        self._convex, self._walls, self._wall_offsets = walls_of(surfaces)
        # Of normals the faces of boxes have few; sideways the surfaces are bounded.
        _, first, group = np.unique(np.round(self.normals, 9), axis=0, return_index=True, return_inverse=True)
        self.group: IntArray = group.ravel()
        sides = np.array([self.surfaces[number].rotation[:, :2].T for number in first]).reshape(-1, 2, 3)
        self.frames = np.concatenate([self.normals[first][:, None], sides], axis=1)
        shadows = [
            item.polygon @ sides[number].T for item, number in zip(self.surfaces, self.group, strict=True)
        ]
        self.side_low = np.array([item.min(axis=0) for item in shadows]).reshape(-1, 2)
        self.side_high = np.array([item.max(axis=0) for item in shadows]).reshape(-1, 2)
        level = np.repeat(self.offsets[:, None, None], 2, axis=2)
        sideways = np.stack([self.side_low, self.side_high], axis=2)
        self.extents = np.concatenate([level, sideways], axis=1)
        areas = np.array([item.area for item in self.surfaces])
        self.filled: NDArray[np.bool_] = areas >= np.prod(self.side_high - self.side_low, axis=1) * (1 - 1e-9)

    def within_reach(
        self, rotation: FloatArray, origin: FloatArray, hull: FloatArray, radius: float, tolerance: float
    ) -> IntArray:
        """Surfaces that may meet a convex body, give or take a tolerance [m]; none is missed.

        The box of the polygon must meet the ball around the body, and, along the normal and the sides of
        the polygon, the extents of its hull.

        Args:
            rotation: (3, 3) from the body's frame to the world's.
            origin: (3,) of that frame in the world, the middle of the ball [m].
            hull: (c, 3) corners of the body in its frame [m].
            radius: Of the ball [m].
        """
        away = np.clip(origin, self._low, self._high) - origin
        near = np.flatnonzero(np.einsum("mi,mi->m", away, away) <= (radius + tolerance) ** 2)
        # Extents of the hull along the normals, then the sides, of their directions, from the origin.
        for axis in range(3):
            along = self.frames[self.group[near], axis]
            extents, offset = (along @ rotation) @ hull.T, along @ origin
            low, high = self.extents[near, axis].T - offset
            near = near[(high >= extents.min(axis=1) - tolerance) & (low <= extents.max(axis=1) + tolerance)]
        return near

    def over(self, points: FloatArray, numbers: IntArray) -> NDArray[np.bool_]:
        """(n,) whether world points (n, 3) [m] project into the polygons of their surfaces, (n,) indices."""
        beyond = np.einsum("nei,ni->ne", self._walls[numbers], points) - self._wall_offsets[numbers]
        inside = (beyond <= 0.0).all(axis=1)
        loose = np.flatnonzero(~self._convex[numbers])
        for number in set(numbers[loose].tolist()):
            mine = loose[numbers[loose] == number]
            inside[mine] = self.surfaces[number].holds(points[mine])
        return inside

    def carries(
        self, points: FloatArray, turns: FloatArray, numbers: IntArray, footprint: FloatArray
    ) -> NDArray[np.bool_]:
        """(n,) whether the whole footprint (c, 3) [m] of placed effectors projects into their polygons.

        The effectors are at points (n, 3) of the world [m], turned by (n, 3, 3), on surfaces of (n,) indices.
        """
        if self.filled[numbers].all():
            sides = self.frames[self.group[numbers], 1:]
            places = (sides @ points[..., None]) + (sides @ turns) @ footprint.T
            inside = places >= self.side_low[numbers][..., None]
            inside &= places <= self.side_high[numbers][..., None]
            return np.logical_and.reduce(inside.reshape(len(points), 2 * len(footprint)), axis=1)
        corners = points[:, None] + footprint @ turns.transpose(0, 2, 1)
        each = self.over(corners.reshape(-1, 3), np.repeat(numbers, len(footprint)))
        return np.logical_and.reduce(each.reshape(len(points), len(footprint)), axis=1)

    def carries_one(self, corners: FloatArray, number: int) -> bool:
        """Whether all (c, 3) corners of one footprint in the world project into a polygon [m]."""
        if self._convex[number]:
            return bool((corners @ self._walls[number].T <= self._wall_offsets[number]).all())
        return bool(self.surfaces[number].holds(corners).all())
