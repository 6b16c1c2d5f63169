"""Convex polytopes ``{x : H x <= h}`` with unit rows, and hulls that may be flat.

A flat (lower-dimensional) hull carries each equality ``n x = c`` as the pair of rows
``n x <= c`` and ``-n x <= -c``, both loosened by :data:`FLATNESS` times the size of the
hull, so that the margin of a point on the flat is zero (to that rounding), never negative.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection, QhullError

from manikin.errors import PolytopeError
from manikin.spatial import FloatArray

FLATNESS = 1e-12
"""Half thickness of a flat polytope, relative to its extent."""

RANK_TOLERANCE = 1e-10
"""Singular values below this fraction of the largest are a flat direction of a hull."""

_BLOCK = 2048


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
        rows, offsets = _unit_rows(H, h)
        object.__setattr__(self, "H", rows)
        object.__setattr__(self, "h", offsets)

    @classmethod
    def from_vertices(cls, points: ArrayLike) -> Self:
        """Hull of points; it may be flat.

        Args:
            points: (n, d), at least one.

        Raises:
            PolytopeError: If there is no point or a coordinate is not finite.
        """
        return cls(*convex_hull(points))

    @property
    def dimension(self) -> int:
        """Dimension d of the space."""
        return self.H.shape[1]

    def __len__(self) -> int:
        return len(self.h)

    def distances(self, points: ArrayLike) -> FloatArray:
        """Signed distances ``h - H x`` to every facet's plane ([Qiu2012]_ Algorithm 3, corrected).

        Args:
            points: (..., d).

        Returns:
            (..., m), positive inside.
        """
        return self.h - np.asarray(points, dtype=np.float64) @ self.H.T

    def margin(self, points: ArrayLike) -> FloatArray:
        """Smallest signed facet distance, ``min_i h_i - H_i x``; inside it is the residual radius.

        Args:
            points: (..., d).

        Returns:
            (...), negative outside.
        """
        x = np.asarray(points, dtype=np.float64)
        if x.shape[-1:] != (self.dimension,):
            raise PolytopeError(f"points have shape {x.shape}; valid: (..., {self.dimension})")
        flat = np.ascontiguousarray(x.reshape(-1, self.dimension).T)
        margins = np.empty(flat.shape[1])
        for start in range(0, flat.shape[1], _BLOCK):
            block = slice(start, start + _BLOCK)
            excess = self.H @ flat[:, block]
            excess -= self.h[:, None]
            np.negative(excess.max(axis=0, initial=-np.inf), out=margins[block])
        return margins.reshape(x.shape[:-1])

    def residual_radius(self, point: ArrayLike) -> FloatArray:
        """Radius of the largest ball about ``point`` inside the polytope, 0 outside."""
        return np.maximum(self.margin(point), 0.0)

    def contains(self, points: ArrayLike, tolerance: float = 0.0) -> FloatArray:
        """Whether each point is inside, give or take ``tolerance``."""
        return self.margin(points) >= -tolerance

    def inscribed_ball(self) -> tuple[FloatArray, float]:
        """Centre (d,) and radius of the largest ball inside ([Qiu2012]_ 2.25).

        Raises:
            PolytopeError: If the polytope is empty or holds balls of any size.
        """
        centre, radius = self._largest_ball(None)
        if radius < -_tolerance(self.h):
            raise PolytopeError("polytope is empty; valid: a polytope with at least one point")
        return centre, max(radius, 0.0)

    @property
    def is_empty(self) -> bool:
        """Whether no point satisfies all rows."""
        return self._largest_ball(1.0)[1] < -_tolerance(self.h)

    def intersection(self, other: "Polytope") -> "Polytope":
        """Points of both polytopes (rows of both, none removed)."""
        return Polytope(np.vstack([self.H, other.H]), np.concatenate([self.h, other.h]))

    def preimage(self, matrix: ArrayLike, offset: ArrayLike = 0.0) -> "Polytope":
        """Points ``y`` whose image ``matrix @ y + offset`` is inside (a slice of the polytope).

        Args:
            matrix: (d, k).
            offset: (d,) or 0.
        """
        m = np.asarray(matrix, dtype=np.float64)
        return Polytope(self.H @ m, self.h - self.H @ np.broadcast_to(offset, (self.dimension,)))

    def vertices(self) -> FloatArray:
        """(n, d) vertices.

        Raises:
            PolytopeError: If the polytope is empty, flat or unbounded.
        """
        centre, radius = self.inscribed_ball()
        if radius <= _tolerance(self.h):
            raise PolytopeError("polytope is flat; valid: one with a ball inside")
        found = HalfspaceIntersection(np.column_stack([self.H, -self.h]), centre).intersections
        if not np.all(np.isfinite(found)):
            raise PolytopeError("polytope is unbounded; valid: a bounded one")
        return np.unique(found.round(12), axis=0)

    def _largest_ball(self, largest: float | None) -> tuple[FloatArray, float]:
        d = self.dimension
        cost = np.zeros(d + 1)
        cost[-1] = -1.0
        lifted = np.column_stack([self.H, np.linalg.norm(self.H, axis=1)])
        scale = max(1.0, float(np.abs(self.h).max(initial=0.0)))
        answer = linprog(
            cost,
            A_ub=lifted,
            b_ub=self.h / scale,
            bounds=[(None, None)] * d + [(None, None if largest is None else largest / scale)],
            method="highs",
        )
        if answer.status == 3:
            raise PolytopeError("polytope holds balls of any size; valid: a bounded polytope")
        if answer.x is None:
            return np.full(d, np.nan), -np.inf
        return answer.x[:-1] * scale, float(answer.x[-1]) * scale


def convex_hull(points: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Facets of the hull of points, each facet once, flat hulls included.

    The hull is found in whitened coordinates of the points' affine hull, as the dual of a
    halfspace intersection: Qhull then merges coplanar simplices into whole facets.

    Args:
        points: (n, d).

    Returns:
        H (m, d) with unit rows and h (m,).

    Raises:
        PolytopeError: If there is no point, or a coordinate is not finite.
    """
    v = np.asarray(points, dtype=np.float64)
    if v.ndim != 2 or len(v) == 0 or not np.all(np.isfinite(v)):
        raise PolytopeError(f"hull of points of shape {v.shape}; valid: (n, d) finite points, n >= 1")
    centre = v.mean(axis=0)
    _, spread, axes = np.linalg.svd(v - centre, full_matrices=True)
    rank = int(np.sum(spread > max(RANK_TOLERANCE * spread[0], 1e-300))) if len(spread) else 0
    across = axes[rank:]
    flat_h = across @ centre
    slack = FLATNESS * max(1.0, float(np.abs(v).max()))
    H, h = [across, -across], [flat_h + slack, slack - flat_h]
    if rank:
        to_white = axes[:rank] / spread[:rank, None]
        normals = _facet_normals((v - centre) @ to_white.T) @ to_white
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        H.insert(0, normals)
        h.insert(0, (normals @ v.T).max(axis=1))
    return np.vstack(H), np.concatenate(h)


def _facet_normals(white: FloatArray) -> FloatArray:
    """Normals of a full-dimensional hull about the origin, each facet once."""
    if white.shape[1] == 1:
        return np.array([[1.0], [-1.0]])
    white = white * np.sqrt(len(white))
    try:
        hull = HalfspaceIntersection(np.column_stack([white, -np.ones(len(white))]), np.zeros(white.shape[1]))
    except QhullError as error:
        raise PolytopeError(
            f"hull of {white.shape} points failed in Qhull: {str(error).splitlines()[0]}"
        ) from None
    return _distinct(hull.dual_equations[:, :-1])


def _distinct(rows: FloatArray) -> FloatArray:
    _, first = np.unique(rows.round(9), axis=0, return_index=True)
    return rows[np.sort(first)]


def _unit_rows(H: ArrayLike, h: ArrayLike) -> tuple[FloatArray, FloatArray]:
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
        rows[zero] = 0.0
        length[zero] = 1.0
    rows /= length[:, None]
    offsets /= length
    rows.setflags(write=False)
    offsets.setflags(write=False)
    return rows, offsets


def _tolerance(offsets: FloatArray) -> float:
    return 1e-9 * max(1.0, float(np.abs(offsets).max(initial=0.0)))
