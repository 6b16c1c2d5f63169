"""Convex polytopes ``{x : H x <= h}`` with unit rows, and hulls that may be flat.

A flat (lower-dimensional) hull carries each equality ``n x = c`` as the pair of rows ``n x <= c`` and
``-n x <= -c`` at the end, both loosened by a trillionth of the size of the hull: the margin of a point on the
flat is zero (to that rounding), off it at most its negative distance to the flat.

Convex polygons in a horizontal plane have hulls, intersections of half-planes and signed distances.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection, QhullError

from manikin.errors import InputError, PolytopeError
from manikin.numerics.facet_enumeration import fan_of_generators
from manikin.numerics.spatial import FloatArray

_THIN = 1e-6
"""Thickness, relative to the offsets, below which two opposite rows are an equality."""

_BLOCK = 400_000
"""Distances looked at together: they stay in the processor's cache."""


@dataclass(frozen=True, eq=False)
class Polytope:
    """The set ``{x : H x <= h}`` ([Qiu2012]_ 2.21), its rows scaled to unit length.

    Attributes:
        H: (m, d) unit outward normals.
        h: (m,) offsets, so that ``h - H x`` are signed distances to the facets' planes.
    """

    H: FloatArray
    h: FloatArray

    def __init__(self, H: ArrayLike, h: ArrayLike) -> None:
        rows, offsets = np.array(H, dtype=np.float64), np.array(h, dtype=np.float64)
        if rows.ndim != 2 or offsets.shape != rows.shape[:1]:
            raise PolytopeError(f"H has shape {rows.shape} and h {offsets.shape}; valid: (m, d) and (m,)")
        if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(offsets))):
            raise PolytopeError("H or h holds a number that is not finite; valid: finite numbers")
        length = np.linalg.norm(rows, axis=1)
        zero = length < 1e-12
        if np.any(zero):
            keep = ~zero | (offsets < -_tolerance(offsets))
            rows, offsets, length, zero = rows[keep], offsets[keep], length[keep], zero[keep]
            rows[zero], length[zero] = 0.0, 1.0
        rows /= length[:, None]
        offsets /= length
        for name, values in (("H", rows), ("h", offsets)):
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    @property
    def dimension(self) -> int:
        """Dimension d of the space."""
        return self.H.shape[1]

    def __len__(self) -> int:
        return len(self.h)

    def distances(self, points: ArrayLike) -> FloatArray:
        """(..., m) signed distances ``h - H x`` of (..., d) points to every facet's plane, positive inside.

        [Qiu2012]_ Algorithm 3, corrected.
        """
        return self.h - np.asarray(points, dtype=np.float64) @ self.H.T

    def margin(self, points: ArrayLike) -> FloatArray:
        """(...) smallest signed facet distance of (..., d) points, ``min_i h_i - H_i x``, negative outside.

        Inside it is the residual radius, that of the largest ball about the point within the polytope. Off a
        flat polytope the distance to the flat takes the place of those to its pairs of rows.
        """
        x = np.asarray(points, dtype=np.float64)
        if x.shape[-1:] != (self.dimension,):
            raise PolytopeError(f"points have shape {x.shape}; valid: (..., {self.dimension})")
        flat, lifted = x.reshape(-1, self.dimension), np.column_stack([self.H, -self.h])
        step = max(1, _BLOCK // max(1, len(self.h)))
        margins, excess = np.empty(len(flat)), np.empty((len(self.h), step))
        for start in range(0, len(flat), step):
            part = flat[start : start + step]
            columns = np.ones((self.dimension + 1, len(part)))
            columns[:-1] = part.T
            block = np.matmul(lifted, columns, out=excess[:, : len(part)] if len(part) == step else None)
            margins[start : start + step] = block.max(axis=0, initial=-np.inf)
        np.negative(margins, out=margins)
        off, residual = self.off_flat(flat)
        if len(off):
            facets = (self.h - flat[off] @ self.H.T)[:, : -2 * residual.shape[1]].min(axis=1, initial=np.inf)
            margins[off] = np.minimum(facets, -least_change(self.equalities[0], residual))
        return margins.reshape(x.shape[:-1])

    @cached_property
    def equalities(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rows (e, d), offsets (e,) and half thickness (e,) of the equalities ``n x = c``."""
        for count in range(min(self.dimension, len(self) // 2), 0, -1):
            rows, opposite = self.H[-2 * count :].reshape(2, count, -1)
            above, below = self.h[-2 * count :].reshape(2, count)
            thickness = 0.5 * (above + below)
            thin = _THIN * max(1.0, float(np.abs(self.h).max()))
            if np.array_equal(rows, -opposite) and np.all(np.abs(thickness) < thin):
                return rows, 0.5 * (above - below), thickness
        return self.H[:0], self.h[:0], self.h[:0]

    def off_flat(self, points: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Indices of points (n, d) off two or more equalities' flat, and their residuals (k, e) there."""
        rows, offsets, thickness = self.equalities
        if len(offsets) < 2:  # of a single one the pair of rows measures the distance
            return np.zeros(0, dtype=np.int64), np.zeros((0, len(offsets)))
        residual = points @ rows.T - offsets
        off = np.flatnonzero(np.any(np.abs(residual) > thickness, axis=1))
        return off, residual[off]

    def inscribed_ball(self) -> tuple[FloatArray, float]:
        """Centre (d,) and radius of the largest ball inside ([Qiu2012]_ 2.25).

        Raises:
            PolytopeError: If the polytope is empty or holds balls of any size.
        """
        cost = np.append(np.zeros(self.dimension), -1.0)
        lifted = np.column_stack([self.H, np.linalg.norm(self.H, axis=1)])
        scale = max(1.0, float(np.abs(self.h).max(initial=0.0)))
        answer = linprog(cost, A_ub=lifted, b_ub=self.h / scale, bounds=(None, None), method="highs")
        if answer.status == 3:
            raise PolytopeError("polytope holds balls of any size; valid: a bounded polytope")
        if answer.x is None or answer.x[-1] * scale < -_tolerance(self.h):
            raise PolytopeError("polytope is empty; valid: a polytope with at least one point")
        return answer.x[:-1] * scale, max(float(answer.x[-1]) * scale, 0.0)

    def intersection(self, other: "Polytope") -> "Polytope":
        """Points of both polytopes (rows of both, none removed)."""
        return Polytope(np.vstack([self.H, other.H]), np.concatenate([self.h, other.h]))

    def preimage(self, matrix: ArrayLike, offset: ArrayLike = 0.0) -> "Polytope":
        """Points ``y`` (k,) with ``matrix (d, k) @ y + offset (d,)`` inside: a slice of the polytope."""
        m = np.asarray(matrix, dtype=np.float64)
        return Polytope(self.H @ m, self.h - self.H @ np.broadcast_to(offset, (self.dimension,)))


def convex_hull(points: ArrayLike, segments: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
    """Facets of the hull of points (plus segments ``[-s, s]``), each once, flat hulls included.

    Args:
        points: (n, d), at least one.
        segments: (q, d) half segments; with a single point the hull is a zonotope.

    Returns:
        H (m, d) with unit rows and h (m,).

    Raises:
        PolytopeError: If there is no point, or a number is not finite.
    """
    v = np.asarray(points, dtype=np.float64)
    if v.ndim != 2 or len(v) == 0 or not np.all(np.isfinite(v)):
        raise PolytopeError(f"hull of points of shape {v.shape}; valid: (n, d) finite points, n >= 1")
    s = np.zeros((0, v.shape[1])) if segments is None else np.asarray(segments, dtype=np.float64)
    if s.ndim != 2 or s.shape[1] != v.shape[1] or not np.all(np.isfinite(s)):
        raise PolytopeError(f"segments have shape {s.shape}; valid: (q, {v.shape[1]}) finite half segments")
    centre = v.mean(axis=0)
    fan = fan_of_generators(v - centre, np.ones((len(v), 1)), np.array([False])).plus_segments(s)
    H, h, _ = fan.facet_rows(max(1.0, float(np.abs(v).max())))
    return H, h + H @ centre


def least_change(rows: FloatArray, residual: FloatArray) -> FloatArray:
    """(n,) length of the least change ``c`` with ``rows c = residual``; infinite where there is none.

    Rows are (e, d) or (n, e, d), residuals (n, e).
    """
    wanted = residual[..., None]
    change = np.linalg.pinv(rows, rcond=1e-9) @ wanted
    missing = np.linalg.norm(rows @ change - wanted, axis=(-2, -1))
    reached = missing <= 1e-6 * np.linalg.norm(residual, axis=-1)
    return np.where(reached, np.linalg.norm(change, axis=(-2, -1)), np.inf)


def vertices_around(H: FloatArray, h: FloatArray, interior: FloatArray) -> FloatArray:
    """(n, d) vertices of ``H x <= h`` around a point strictly inside.

    Raises:
        PolytopeError: If the polytope is unbounded.
    """
    try:
        with np.errstate(divide="ignore", invalid="ignore"):
            vertices = HalfspaceIntersection(np.column_stack([H, -h]), interior).intersections
    except QhullError:
        vertices = np.full((1, H.shape[1]), np.inf)
    if not np.all(np.abs(vertices) < 1e12 * (1.0 + np.abs(h).max())):
        raise PolytopeError("polytope has no vertices; valid: a bounded one of dimension 2 or more")
    return vertices


def _tolerance(offsets: FloatArray) -> float:
    return 1e-9 * max(1.0, float(np.abs(offsets).max(initial=0.0)))


MERGE = 1e-9
"""Distance below which vertices are merged [m]."""

_FAR = 1e4


def convex_polygon(points: ArrayLike) -> FloatArray:
    """(k, 2) hull of points (n, 2) in the plane, counter-clockwise; k is below 3 for empty and flat ones."""
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if len(p) < 2:
        return p.copy()
    p = p[np.lexsort((p[:, 1], p[:, 0]))]
    return _without_twins(np.array([*_half_hull(p)[:-1], *_half_hull(p[::-1])[:-1]]))


def polygon_area(corners: ArrayLike) -> float:
    """Area of a polygon of (k, 2) corners, positive counter-clockwise."""
    x, y = np.asarray(corners).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def polygon_of_halfplanes(A: ArrayLike, b: ArrayLike) -> FloatArray:
    """(k, 2) bounded polygon ``{x : A x <= b}``, counter-clockwise, of rows (m, 2), from a square of 20 km.

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


def walls(polygon: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit outward normals (k, 2) and offsets (k,) of the edges of a polygon (k, 2), counter-clockwise."""
    edge = np.roll(polygon, -1, axis=0) - polygon
    out = np.column_stack([edge[:, 1], -edge[:, 0]]) / np.linalg.norm(edge, axis=1)[:, None]
    return out, np.einsum("ei,ei->e", out, polygon)


def inset_polygon(polygon: FloatArray, distance: float) -> FloatArray:
    """(k, 2) what of a convex polygon, counter-clockwise, is at least a distance inside its edges."""
    out, offsets = walls(polygon)
    return polygon_of_halfplanes(out, offsets - distance)


def rectangles_apart(
    ahead: FloatArray, aside: FloatArray, turned: FloatArray, size: tuple[float, float]
) -> FloatArray:
    """(k,) widest gap between two rectangles of a size along the edges of one of them [m]; negative: overlap.

    The middle of the second one is ahead and aside (k,) of that of the first [m], and turned (k,) [rad].
    """
    c, s = np.cos(turned), np.sin(turned)
    half, width = 0.5 * size[0], 0.5 * size[1]
    along, across = half * np.abs(c) + width * np.abs(s), half * np.abs(s) + width * np.abs(c)
    ways = np.abs(np.array([ahead, aside, c * ahead + s * aside, c * aside - s * ahead]))
    reach = np.array([half + along, width + across, along + half, across + width])
    return np.asarray((ways - reach).max(axis=0))


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
    return np.where(np.all(left >= 0, axis=-1) & (len(corners) > 2), distance, -distance)


def _half_hull(points: FloatArray) -> list[FloatArray]:
    chain: list[FloatArray] = []
    for point in points:
        while len(chain) > 1:
            a, b = chain[-2:]
            if (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0:
                break
            chain.pop()
        chain.append(point)
    return chain


def _clipped(polygon: FloatArray, row: FloatArray, offset: float) -> FloatArray:
    if len(polygon) == 0:
        return polygon
    outside = polygon @ row - offset
    if outside.max() <= 0:
        return polygon
    after, kept = np.roll(polygon, -1, axis=0), []
    for p, q, at_p, at_q in zip(polygon, after, outside, np.roll(outside, -1), strict=True):
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
