"""Obstacles as plain solids: signed distances of points, and the flat pieces that can carry a contact.

Everything is computed from the obstacles' own sizes by elementary formulas; nothing is shared with the
distances that planning uses, so that an error there is found here. Formulas for single features are after
Ericson, Real-Time Collision Detection (2005), chapter 5, the winding number after van Oosterom (1983).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np

from manikin.numerics.spatial import FloatArray, dot
from manikin.scene.mesh import Mesh
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Obstacle, Plane, Sphere

NORMAL_LIMIT = 1e-4
"""Difference of distances up to which triangles are equally near [m]."""

LYING = float(np.sin(np.deg2rad(5.0)))
"""Largest cosine of the angle between the axis of a round bar and the normal of what stands on it."""

_CHUNK = 400_000
"""Pairs that are measured at once."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles of a mesh in the world.

    Attributes:
        corners: (m, 3, 3) corners, counter-clockwise seen from outside [m].
        piece: (m,) number of the connected piece of each.
        closed: (m,) whether that piece has an inside.
    """

    corners: FloatArray
    piece: np.ndarray
    closed: np.ndarray

    @cached_property
    def normals(self) -> FloatArray:
        """(m, 3) unit normals."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        normals = np.cross(b - a, c - a)
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    @cached_property
    def _boxes(self) -> tuple[FloatArray, FloatArray]:
        return self.corners.min(axis=1), self.corners.max(axis=1)

    def overlapping(self, low: FloatArray, high: FloatArray) -> np.ndarray:
        """Indices of the triangles whose boxes overlap the one from ``low`` (3,) to ``high`` (3,) [m]."""
        lowest, highest = self._boxes
        return np.flatnonzero(np.all((lowest <= high) & (highest >= low), axis=1))


def distance_to_triangles(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(n, m) distances of points (n, 3) to triangles (m, 3, 3) [m]."""
    rows = max(1, _CHUNK // max(len(corners), 1))
    parts = [point_triangle(points[k : k + rows, None], corners[None]) for k in range(0, len(points), rows)]
    return np.concatenate(parts) if parts else np.zeros((0, len(corners)))


def point_triangle(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(...) distances of points (..., 3) to triangles (..., 3, 3) [m]."""
    a, b, c = np.moveaxis(corners, -2, 0)
    normal, sides = np.cross(b - a, c - a), ((a, b), (b, c), (c, a))
    height = np.abs(dot(points - a, normal)) / np.linalg.norm(normal, axis=-1)
    above = np.ones(height.shape, dtype=bool)
    for start, end in sides:
        above &= dot(np.cross(normal, end - start), points - start) >= 0.0
    edges = (point_segment(points, start, end) for start, end in sides)
    return np.where(above, height, reduce(np.minimum, edges))


def point_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(...) distances of points (..., 3) to segments [m]."""
    along = end - start
    share = np.clip(dot(points - start, along) / np.maximum(dot(along, along), 1e-30), 0.0, 1.0)
    return np.linalg.norm(points - start - share[..., None] * along, axis=-1)


def segment_segment(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(...) distances of segments from ``a`` to ``b`` to segments from ``c`` to ``d``, (..., 3) each [m]."""
    first, second, between = b - a, d - c, a - c
    aa, bb, ab = dot(first, first), dot(second, second), dot(first, second)
    ar, br = dot(first, between), dot(second, between)
    spread = aa * bb - ab * ab
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.clip((ab * br - ar * bb) / spread, 0.0, 1.0)
    share = np.where(spread > 1e-12 * np.maximum(aa * bb, 1e-30), crossing, 0.0)
    other = np.clip((ab * share + br) / np.maximum(bb, 1e-30), 0.0, 1.0)
    share = np.clip((ab * other - ar) / np.maximum(aa, 1e-30), 0.0, 1.0)
    inner = np.linalg.norm(between + share[..., None] * first - other[..., None] * second, axis=-1)
    ends = point_segment(a, c, d), point_segment(b, c, d), point_segment(c, a, b), point_segment(d, a, b)
    return np.minimum(inner, np.min(np.stack(np.broadcast_arrays(*ends)), axis=0))


def segment_triangle(start: FloatArray, end: FloatArray, corners: FloatArray) -> FloatArray:
    """(...) distances of segments, (..., 3) each, to triangles (..., 3, 3) [m]; 0 where they cross."""
    a, b, c = np.moveaxis(corners, -2, 0)
    nearest = np.minimum(point_triangle(start, corners), point_triangle(end, corners))
    normal, sides = np.cross(b - a, c - a), ((a, b), (b, c), (c, a))
    for first, second in sides:
        nearest = np.minimum(nearest, segment_segment(start, end, first, second))
    from_start, from_end = dot(start - a, normal), dot(end - a, normal)
    drop = from_start - from_end
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(drop != 0.0, from_start / drop, -1.0)
    crossing = start + share[..., None] * (end - start)
    inside = (share >= 0.0) & (share <= 1.0)
    for first, second in sides:
        inside &= dot(np.cross(normal, second - first), crossing - first) >= 0.0
    return np.where(inside, 0.0, nearest)


def winding_numbers(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(n,) how often a closed surface of triangles (m, 3, 3) goes round points (n, 3); 0 outside."""
    result = np.zeros(len(points))
    for number, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = dot(a, np.cross(b, c))
        base = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
        result[number] = np.arctan2(volume, base).sum() / (2.0 * np.pi)
    return result


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
            near = self._near(points)
            if not len(near):
                return np.full(len(points), np.inf)
            distance = distance_to_triangles(points, self.triangles.corners[near]).min(axis=1)
            return np.where(self.inside(points), -distance, np.where(distance <= REACH, distance, np.inf))
        local = (points - place.translation) @ place.rotation
        if isinstance(shape, Sphere):
            return np.linalg.norm(local, axis=-1) - shape.radius
        if isinstance(shape, Capsule):
            local[..., 2] -= np.clip(local[..., 2], -0.5 * shape.length, 0.5 * shape.length)
            return np.linalg.norm(local, axis=-1) - shape.radius
        if isinstance(shape, Cylinder):
            across = np.hypot(local[..., 0], local[..., 1]) - shape.radius
            beyond = np.stack([across, np.abs(local[..., 2]) - 0.5 * shape.length], axis=-1)
        else:
            beyond = np.abs(local) - 0.5 * shape.size
        return box_distance(beyond)

    def _near(self, points: FloatArray) -> np.ndarray:
        """Indices of the triangles within the reach of points (n, 3), by their boxes."""
        return self.triangles.overlapping(points.min(axis=0) - REACH, points.max(axis=0) + REACH)

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
        """Distance (n,) of points (n, 3) to the flat pieces that face a direction, and their angle (n,).

        Args:
            normal: (3,) unit direction from the surface into the body.
            max_angle: Largest angle between it and a piece's outward normal [rad].

        Returns:
            Distances [m], infinite where nothing faces there, and angles [rad]; of pieces that are equally
            near (to 0.1 mm) the one with the smallest angle counts.
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
            triangles, near = self.triangles, self._near(points)
            near = near[triangles.normals[near] @ normal >= least]
            if len(near):
                table = distance_to_triangles(points, triangles.corners[near])
                facing = triangles.normals[near] @ normal
                # Of triangles that are equally near, as along a shared edge, the one that faces best.
                close = table <= table.min(axis=1, keepdims=True) + NORMAL_LIMIT
                yield table.min(axis=1), np.where(close, facing, -1.0).max(axis=1)
        elif isinstance(shape, (Box, Cylinder, Capsule)):
            if not isinstance(shape, Box) and abs(float(place.rotation[:, 2] @ normal)) <= LYING:
                yield np.abs(self.distance(points)), self._outward(points) @ normal
            if isinstance(shape, Capsule):
                return
            local = (points - place.translation) @ place.rotation
            for axis in range(3) if isinstance(shape, Box) else (2,):
                for sign in (1.0, -1.0):
                    facing = sign * float(place.rotation[:, axis] @ normal)
                    if facing >= least:
                        yield _to_face(shape, local, axis, sign), facing * every

    def _outward(self, points: FloatArray) -> FloatArray:
        """(n, 3) directions from the axis of a cylinder or capsule to points (n, 3)."""
        axis, away = self.obstacle.rotation[:, 2], points - self.obstacle.translation
        out = away - (away @ axis)[:, None] * axis
        return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)


def _half_size(shape: Box | Sphere | Cylinder | Capsule) -> FloatArray:
    if isinstance(shape, Box):
        return 0.5 * shape.size
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius)
    ends = shape.radius if isinstance(shape, Capsule) else 0.0
    return np.array([shape.radius, shape.radius, 0.5 * shape.length + ends])


def box_distance(beyond: FloatArray) -> FloatArray:
    """(...) signed distance to a box from how far (..., d) points are beyond its faces [m]."""
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + np.minimum(beyond.max(axis=-1), 0.0)


def _to_face(shape: Box | Cylinder, local: FloatArray, axis: int, sign: float) -> FloatArray:
    """(n,) distance of points in the shape's frame to one flat face of it."""
    if isinstance(shape, Cylinder):
        height = local[:, 2] - sign * 0.5 * shape.length
        return np.hypot(height, np.maximum(np.hypot(local[:, 0], local[:, 1]) - shape.radius, 0.0))
    half = 0.5 * shape.size
    off = np.maximum(np.abs(local) - half, 0.0)
    off[:, axis] = local[:, axis] - sign * half[axis]
    return np.linalg.norm(off, axis=1)
