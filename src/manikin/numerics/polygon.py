"""Convex polygons in a horizontal plane: hulls, intersections of half-planes, signed distances."""

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray

MERGE = 1e-9
"""Distance below which vertices are merged [m]."""

_FAR = 1e4


def convex_polygon(points: ArrayLike) -> FloatArray:
    """Hull of points (n, 2) in the plane (monotone chain).

    Returns:
        (k, 2) vertices counter-clockwise; k is 0, 1 or 2 for empty and flat hulls.
    """
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if len(p) < 2:
        return p.copy()
    p = p[np.lexsort((p[:, 1], p[:, 0]))]
    chain = [*_half_hull(p)[:-1], *_half_hull(p[::-1])[:-1]]
    return _without_twins(np.array(chain))


def polygon_of_halfplanes(A: ArrayLike, b: ArrayLike) -> FloatArray:
    """Bounded polygon ``{x : A x <= b}`` of (m, 2) and (m,) rows, by clipping a square of 20 km.

    Returns:
        (k, 2) vertices counter-clockwise; none when no point satisfies all rows.

    Raises:
        InputError: If the intersection reaches the square: it is unbounded.
    """
    rows, offsets = np.asarray(A, dtype=np.float64), np.asarray(b, dtype=np.float64)
    polygon = _FAR * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for row, offset in zip(rows, offsets, strict=True):
        polygon = _clipped(polygon, row, offset)
    if len(polygon) and np.abs(polygon).max() > 0.999 * _FAR:
        raise InputError("half-planes leave an unbounded polygon; valid: rows that bound it on every side")
    return _without_twins(polygon)


def fewer_corners(polygon: FloatArray, most: int) -> FloatArray:
    """A convex polygon (k, 2) with at most so many corners, without those that cut off least."""
    corners = polygon
    while len(corners) > most:
        before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
        cut = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
        corners = np.delete(corners, int(np.argmin(cut)), axis=0)
    return corners


def chord(polygon: FloatArray, x: float) -> tuple[float, float] | None:
    """Lowest and highest y of a convex polygon (k, 2) at a given x, or None beside it."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    crosses = (np.minimum(start[:, 0], end[:, 0]) <= x) & (x <= np.maximum(start[:, 0], end[:, 0]))
    if not crosses.any():
        return None
    start, way = start[crosses], (end - start)[crosses]
    level = way[:, 0] == 0.0
    share = (x - start[:, 0]) / np.where(level, 1.0, way[:, 0])
    y = np.concatenate([start[:, 1] + np.where(level, 0.0, share) * way[:, 1], (start + way)[level, 1]])
    return float(y.min()), float(y.max())


def inset_polygon(polygon: FloatArray, distance: float) -> FloatArray:
    """(k, 2) what of a convex polygon, counter-clockwise, is at least a distance inside its edges."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    out = np.column_stack([edge[:, 1], -edge[:, 0]]) / np.linalg.norm(edge, axis=1)[:, None]
    return polygon_of_halfplanes(out, np.einsum("ei,ei->e", out, polygon) - distance)


def signed_distance(points: ArrayLike, polygon: ArrayLike) -> FloatArray:
    """(...) distance to the boundary of a convex polygon, positive inside, negative outside [m].

    Args:
        points: (..., 2).
        polygon: (k, 2) counter-clockwise; a point or a segment has no inside, an empty one is infinitely far.
    """
    p, corners = np.asarray(points, dtype=np.float64), np.asarray(polygon, dtype=np.float64)
    if len(corners) == 0:
        return np.full(p.shape[:-1], -np.inf)
    edges = np.roll(corners, -1, axis=0) - corners
    to_point = p[..., None, :] - corners
    squared = np.maximum((edges**2).sum(axis=-1), 1e-300)
    along = np.clip((to_point * edges).sum(axis=-1) / squared, 0.0, 1.0)
    distance = np.linalg.norm(to_point - along[..., None] * edges, axis=-1).min(axis=-1)
    left = edges[:, 0] * to_point[..., 1] - edges[:, 1] * to_point[..., 0]
    inside = np.all(left >= 0, axis=-1) & (len(corners) > 2)
    return np.where(inside, distance, -distance)


def _half_hull(points: FloatArray) -> list[FloatArray]:
    chain: list[FloatArray] = []
    for point in points:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _clipped(polygon: FloatArray, row: FloatArray, offset: float) -> FloatArray:
    if len(polygon) == 0:
        return polygon
    outside = polygon @ row - offset
    if outside.max() <= 0:
        return polygon
    after = np.roll(polygon, -1, axis=0)
    out_after = np.roll(outside, -1)
    kept: list[FloatArray] = []
    for p, q, at_p, at_q in zip(polygon, after, outside, out_after, strict=True):
        if at_p <= 0:
            kept.append(p)
        if (at_p < 0 < at_q) or (at_q < 0 < at_p):
            kept.append(p + (q - p) * (at_p / (at_p - at_q)))
    return np.array(kept).reshape(-1, 2)


def _without_twins(polygon: FloatArray) -> FloatArray:
    if len(polygon) < 2:
        return polygon
    apart = np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1) > MERGE
    return polygon[apart] if np.any(apart) else polygon[:1]
