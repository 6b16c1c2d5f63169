"""Distances of points and segments to triangles, and whether points are inside closed surfaces.

Formulas for single features after Ericson, Real-Time Collision Detection (2005), chapter 5; the winding
number by solid angles after van Oosterom and Strackee (1983).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.numerics.spatial import FloatArray

NORMAL_LIMIT = 1e-4
"""Difference of distances up to which triangles are equally near [m]."""

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
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    normal = np.cross(b - a, c - a)
    size = np.linalg.norm(normal, axis=-1)
    height = np.abs(_dot(points - a, normal)) / size
    above = np.ones(height.shape, dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        above &= _dot(np.cross(normal, end - start), points - start) >= 0.0
    edges = [point_segment(points, start, end) for start, end in ((a, b), (b, c), (c, a))]
    return np.where(above, height, np.minimum(np.minimum(edges[0], edges[1]), edges[2]))


def point_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(...) distances of points (..., 3) to segments [m]."""
    along = end - start
    share = np.clip(_dot(points - start, along) / np.maximum(_dot(along, along), 1e-30), 0.0, 1.0)
    return np.linalg.norm(points - start - share[..., None] * along, axis=-1)


def segment_segment(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(...) distances of segments from ``a`` to ``b`` to segments from ``c`` to ``d``, (..., 3) each [m]."""
    first, second, between = b - a, d - c, a - c
    aa, bb, ab = _dot(first, first), _dot(second, second), _dot(first, second)
    ar, br = _dot(first, between), _dot(second, between)
    spread = aa * bb - ab * ab
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = np.clip((ab * br - ar * bb) / spread, 0.0, 1.0)
    share = np.where(spread > 1e-12 * np.maximum(aa * bb, 1e-30), crossing, 0.0)
    other = np.clip((ab * share + br) / np.maximum(bb, 1e-30), 0.0, 1.0)
    share = np.clip((ab * other - ar) / np.maximum(aa, 1e-30), 0.0, 1.0)
    inner = np.linalg.norm(between + share[..., None] * first - other[..., None] * second, axis=-1)
    ends = (
        point_segment(a, c, d), point_segment(b, c, d), point_segment(c, a, b), point_segment(d, a, b),
    )  # fmt: skip
    return np.minimum(inner, np.min(np.stack(np.broadcast_arrays(*ends)), axis=0))


def segment_triangle(start: FloatArray, end: FloatArray, corners: FloatArray) -> FloatArray:
    """(...) distances of segments, (..., 3) each, to triangles (..., 3, 3) [m]; 0 where they cross."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    nearest = np.minimum(point_triangle(start, corners), point_triangle(end, corners))
    for first, second in ((a, b), (b, c), (c, a)):
        nearest = np.minimum(nearest, segment_segment(start, end, first, second))
    normal = np.cross(b - a, c - a)
    from_start, from_end = _dot(start - a, normal), _dot(end - a, normal)
    drop = from_start - from_end
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(drop != 0.0, from_start / drop, -1.0)
    crossing = start + share[..., None] * (end - start)
    inside = (share >= 0.0) & (share <= 1.0)
    for first, second in ((a, b), (b, c), (c, a)):
        inside &= _dot(np.cross(normal, second - first), crossing - first) >= 0.0
    return np.where(inside, 0.0, nearest)


def winding_numbers(points: FloatArray, corners: FloatArray) -> FloatArray:
    """(n,) how often a closed surface of triangles (m, 3, 3) goes round points (n, 3); 0 outside."""
    result = np.zeros(len(points))
    for number, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = _dot(a, np.cross(b, c))
        base = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
        result[number] = np.arctan2(volume, base).sum() / (2.0 * np.pi)
    return result


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.einsum("...i,...i->...", first, second)
