"""Facets of polytopes given by generators, found as extreme rays of the polar cone.

A polytope ``W = {sum_j l_j g_j : l_j >= 0, sum_j l_j L_j <= 1}`` (several levels, some of them ``==``) is a
slice of the cone over the rays ``(g_j, L_j)``; every facet of ``W`` is the slice of a facet of that cone (the
Cayley construction, which keeps Minkowski sums of many summands as small as their parts). Adding a segment
``[-s, s]`` refines the cone's polar by the hyperplane ``a s = 0``: its rays stay, and each of its edges that
crosses the hyperplane gives a new ray, one step of the double description method.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection, QhullError

from manikin.errors import PolytopeError
from manikin.numerics.spatial import FloatArray

BoolArray = NDArray[np.bool_]

RANK_TOLERANCE = 1e-9
"""Directions with less than this fraction of the largest singular value count as flat."""

INCIDENCE_TOLERANCE = 1e-9
"""A ray lies on a facet when the cosine between them is below this."""

QHULL_OPTIONS = ("Qx", "Qx C-1e-10", "Qx C-1e-8", "Qx Q12 C-1e-10", "Qx Q12 C-1e-8", "Qx Q12 C-1e-7")
"""Tried in turn: merge coplanar facets; merge ever less coplanar ones; allow wide merges.

Wide merges alone ("Qx Q12") lose facets, or cut off points, without a word."""

HULL_TOLERANCE = 1e-6
"""A hull that leaves a point out by more than this, in units of the points' spread, is wrong."""

FLATNESS = 1e-12
"""Half thickness of a flat polytope, relative to its extent."""

_CHUNK = 4_000_000
"""Entries of one adjacency table (pairs x rays)."""


@dataclass(frozen=True, eq=False)
class NormalFan:
    """Extreme rays of the polar cone of a polytope around the origin.

    Attributes:
        basis: (d, r) directions of the polytope; ``x = basis @ y``.
        inverse: (r, d) pseudo-inverse of ``basis``.
        rays: (n, r + k) generators and slacks ``(y, levels)`` of the cone.
        normals: (m, r + k) rays ``(a, alpha)`` of its polar: ``a y + alpha levels <= 0``.
        on_generator: (m, n) whether generator (or slack) j lies on facet i.
        segments: (q, d) half segments added so far.
        side: (m, q) sign (-1, 0, 1) of each ray against each segment.
        thickness: How far generators and segments stick out of the span of ``basis``.
    """

    basis: FloatArray
    inverse: FloatArray
    rays: FloatArray
    normals: FloatArray
    on_generator: BoolArray
    segments: FloatArray
    side: NDArray[np.int8]
    thickness: float = 0.0

    @property
    def rank(self) -> int:
        """Dimension r of the polytope."""
        return self.basis.shape[1]

    def facet_rows(self, extent: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Unit rows ``H x <= h`` of the polytope, each facet once, equalities as loosened pairs at the end.

        Args:
            extent: Size of the polytope, by which :data:`FLATNESS` is measured.

        Returns:
            H (m, d), h (m,) and the part of each offset that each level pays for (m, k), zero for equalities.
        """
        normals = self.normals[self._real_facets()]
        H = normals[:, : self.rank] @ self.inverse
        length = np.linalg.norm(H, axis=1)
        H /= length[:, None]
        multipliers = self._tight_multipliers(normals) / length[:, None]
        h = multipliers.sum(axis=1) + np.abs(H @ self.segments.T).sum(axis=1)
        if self._coupled:  # the slices of two facets of the cone may coincide
            once = _first_of_each(np.column_stack([H, h / (1.0 + np.abs(h))]))
            H, h, multipliers = H[once], h[once], multipliers[once]
        across = np.linalg.svd(self.basis)[0][:, self.rank :].T
        slack = np.full(2 * len(across), max(FLATNESS * extent, self.thickness))
        multipliers = np.vstack([multipliers, np.zeros((len(slack), multipliers.shape[1]))])
        return np.vstack([H, across, -across]), np.concatenate([h, slack]), multipliers

    def _tight_multipliers(self, normals: FloatArray) -> FloatArray:
        """(m, k) level multipliers ``-alpha``, tightened to the generators' exact support."""
        r, multipliers = self.rank, -normals[:, self.rank :]
        if not self._coupled:
            values = normals[:, :r] @ self.rays[:, :r].T
            for level, counted in enumerate(self.rays[:, r:].T > 0):
                multipliers[:, level] = values[:, counted].max(axis=1)
        return multipliers

    @property
    def _coupled(self) -> bool:
        """Whether a generator counts towards two levels."""
        return bool(np.any(np.count_nonzero(self.rays[:, self.rank :], axis=1) > 1))

    def _real_facets(self) -> BoolArray:
        """Rays whose slice is a facet: it reaches every level, and it is of dimension r - 1."""
        r, levels, size = self.rank, self.rays[:, self.rank :], np.linalg.norm(self.normals, axis=1)
        real = np.linalg.norm(self.normals[:, :r], axis=1) > INCIDENCE_TOLERANCE * size
        real &= np.all(self.on_generator.astype(np.float32) @ (levels > 0) > 0, axis=1)
        if not self._coupled:
            return real
        kinds, kind_of = np.unique(levels.round(12), axis=0, return_inverse=True)
        present = self.on_generator.astype(np.float32) @ np.eye(len(kinds), dtype=np.float32)[kind_of] > 0
        patterns, pattern_of = np.unique(present, axis=0, return_inverse=True)
        used = np.array([_usable(kinds, pattern) for pattern in patterns])
        for i in map(int, np.flatnonzero(real)):
            live = used[pattern_of[i]]
            real[i] = bool(np.any(live)) and self._face_dimension(i, live[kind_of], kinds[live]) == r - 1
        return real

    def _face_dimension(self, facet: int, live: BoolArray, kinds: FloatArray) -> int:
        across = self.segments[self.side[facet] == 0] @ self.inverse.T
        across = np.hstack([across, np.zeros((len(across), self.rays.shape[1] - self.rank))])
        return int(_rank(np.vstack([self.rays[self.on_generator[facet] & live], across])) - _rank(kinds))

    def plus_segments(self, segments: FloatArray) -> "NormalFan":
        """Fan of the Minkowski sum with ``[-s, s]`` for each row s of ``segments`` (q, d)."""
        fan = self
        remaining = [s for s in segments if np.linalg.norm(s) > 0]
        while (index := fan._most_independent(remaining)) is not None:
            fan = fan._prism(remaining.pop(index))
        outside = np.linalg.norm(fan._off_span(np.array(remaining).reshape(-1, segments.shape[1])), axis=1)
        fan = replace(fan, thickness=fan.thickness + float(outside.sum()))
        for s in remaining:
            fan = fan._refined(s)
        return fan

    def _off_span(self, vectors: FloatArray) -> FloatArray:
        if self.rank == self.basis.shape[0]:
            return np.zeros_like(vectors)
        return vectors - vectors @ self.inverse.T @ self.basis.T

    def _most_independent(self, segments: list[FloatArray]) -> int | None:
        if not segments or self.rank == self.basis.shape[0]:
            return None
        directions = np.array(segments) / np.linalg.norm(segments, axis=1)[:, None]
        distance = np.linalg.norm(self._off_span(directions), axis=1)
        best = int(np.argmax(distance))
        return best if distance[best] > RANK_TOLERANCE else None

    def _prism(self, segment: FloatArray) -> "NormalFan":
        """Sum with a segment that leaves the span: two new facets, the old ones extended."""
        r, (m, n) = self.rank, self.on_generator.shape
        normals = np.insert(self.normals, r, 0.0, axis=1)
        ends = np.zeros((2, normals.shape[1]))
        ends[:, r] = 1.0, -1.0
        side = np.zeros((m + 2, len(self.segments) + 1), dtype=np.int8)
        side[:m, :-1] = self.side
        side[m:, -1] = 1, -1
        basis = np.column_stack([self.basis, segment])
        return NormalFan(
            basis, np.asarray(np.linalg.pinv(basis), dtype=np.float64), np.insert(self.rays, r, 0.0, axis=1),
            np.vstack([normals, ends]), np.vstack([self.on_generator, np.ones((2, n), dtype=np.bool_)]),
            np.vstack([self.segments, segment]), side, self.thickness,
        )  # fmt: skip

    def _refined(self, segment: FloatArray) -> "NormalFan":
        """Sum with a segment of the span: cut the fan by the hyperplane across it."""
        y = self.inverse @ segment
        along = self.normals[:, : self.rank] @ (y / np.linalg.norm(y))
        sign = np.sign(np.where(np.abs(along) > INCIDENCE_TOLERANCE, along, 0.0)).astype(np.int8)
        p, q = self._crossing_edges(np.flatnonzero(sign > 0), np.flatnonzero(sign < 0))
        new = along[p, None] * self.normals[q] - along[q, None] * self.normals[p]
        new /= np.linalg.norm(new, axis=1)[:, None]
        inherited = np.where(self.side[p] != 0, self.side[p], self.side[q])
        across = np.concatenate([sign, np.zeros(len(p), dtype=np.int8)])
        return replace(
            self, normals=np.vstack([self.normals, new]), segments=np.vstack([self.segments, segment]),
            on_generator=np.vstack([self.on_generator, self.on_generator[p] & self.on_generator[q]]),
            side=np.column_stack([np.vstack([self.side, inherited]), across]),
        )  # fmt: skip

    def _crossing_edges(self, plus: NDArray, minus: NDArray) -> tuple[NDArray, NDArray]:
        """Pairs (one of ``plus``, one of ``minus``) that span an edge of one cell of the fan."""
        tight = np.column_stack([self.on_generator, self.side == 0]).astype(np.float32)
        up, down = (self.side > 0).astype(np.float32), (self.side < 0).astype(np.float32)
        shared = tight[plus] @ tight[minus].T
        if len(self.segments):
            shared[(up[plus] @ down[minus].T + down[plus] @ up[minus].T) > 0] = -1.0
        i, j = np.nonzero(shared >= self.normals.shape[1] - 2)
        p, q = plus[i], minus[j]
        closed = np.column_stack([self.on_generator, self.side >= 0, self.side <= 0])
        columns = np.ascontiguousarray(closed.T.astype(np.float32))
        keep = np.empty(len(p), dtype=np.bool_)
        step = max(1, _CHUNK // max(1, len(closed)))
        for start in range(0, len(p), step):
            chunk = slice(start, start + step)
            common = closed[p[chunk]] & closed[q[chunk]]
            inside = common.astype(np.float32) @ columns == common.sum(axis=1, dtype=np.float32)[:, None]
            keep[chunk] = inside.sum(axis=1) == 2
        return p[keep], q[keep]


def fan_of_generators(generators: FloatArray, levels: FloatArray, bounded_above: BoolArray) -> NormalFan:
    """Normal fan of ``{sum_j l_j g_j : l >= 0, levels.T l <= 1 (or == 1)}``.

    Args:
        generators: (n, d); their span must be the polytope's affine hull (it holds 0).
        levels: (n, k) not negative, each row with a positive entry.
        bounded_above: (k,) True for ``<= 1`` (a slack is appended), False for ``== 1``.

    Raises:
        PolytopeError: If Qhull fails.
    """
    (n, d), k = generators.shape, levels.shape[1]
    y, basis, inverse, thickness = _white_coordinates(generators)
    r, slack = basis.shape[1], np.eye(k)[bounded_above]
    rays = np.vstack([np.hstack([y, levels]), np.hstack([np.zeros((len(slack), r)), slack])])
    cap = y.T @ levels[:, 0] / n if k == 1 and bounded_above[0] and r else None
    if cap is not None and np.abs(y @ cap - levels[:, 0]).max() < INCIDENCE_TOLERANCE:
        # A pyramid with its apex in the origin: one dimension less for Qhull.
        sides = polar_rays(y, cap)
        normals = np.vstack([np.column_stack([sides, np.zeros(len(sides))]), np.append(cap, -1.0)])
    else:
        normals = polar_rays(rays, np.append(np.zeros(r), np.ones(k)))
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    on_generator = normals @ (rays / np.linalg.norm(rays, axis=1)[:, None]).T > -INCIDENCE_TOLERANCE
    once = _without_splinters(on_generator)
    side = np.zeros((len(once), 0), dtype=np.int8)
    return NormalFan(
        basis, inverse, rays, normals[once], on_generator[once], np.zeros((0, d)), side, max(k, 1) * thickness
    )


def polar_rays(rays: FloatArray, section: FloatArray) -> FloatArray:
    """Extreme rays of ``{a : rays @ a <= 0}``: the facets of the cone over ``rays``.

    Qhull works on whitened points of a section of the cone, as the dual of a halfspace
    intersection, because it then returns whole facets instead of their simplices.

    Args:
        rays: (n, d) spanning all d dimensions.
        section: (d,) with ``rays @ section > 0``.
    """
    d = rays.shape[1]
    if d <= 1:
        return -np.sign(section).reshape(d, d)
    points = rays / (rays @ section)[:, None]
    centre = points.mean(axis=0)
    _, s, vt = np.linalg.svd(points - centre, full_matrices=False)
    to_white = vt[: d - 1].T * (np.sqrt(len(points)) / s[: d - 1])
    equations = _hull_equations((points - centre) @ to_white)
    a = equations[:, :-1] @ to_white.T
    return a + (equations[:, -1] - a @ centre)[:, None] * section


def _white_coordinates(generators: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Coordinates y (n, r) of unit covariance with ``generators = y @ basis.T + rest``.

    Also basis (d, r), its pseudo-inverse (r, d), and a bound on the length of the rest.
    """
    n, d = generators.shape
    if n == 0:
        return np.zeros((0, 0)), np.zeros((d, 0)), np.zeros((0, d)), 0.0
    u, s, vt = np.linalg.svd(generators, full_matrices=False)
    r = int(np.sum(s > RANK_TOLERANCE * s[0])) if s[0] > 0 else 0
    thickness = float(np.linalg.norm(s[r:]))
    scale = s[:r] / np.sqrt(n)
    return u[:, :r] * np.sqrt(n), vt[:r].T * scale, vt[:r] / scale[:, None], thickness


def _hull_equations(points: FloatArray) -> FloatArray:
    """(m, d + 1) rows ``[normal, offset]``, ``normal x + offset <= 0``, of a hull around 0."""
    if points.shape[1] == 1:
        return np.array([[1.0, -points.max()], [-1.0, points.min()]])
    halfspaces = np.column_stack([points, -np.ones(len(points))])
    reason = ""
    for options in QHULL_OPTIONS:
        try:
            hull = HalfspaceIntersection(halfspaces, np.zeros(points.shape[1]), qhull_options=options)
        except QhullError as error:
            reason = str(error).strip().splitlines()[0]
            continue
        equations = hull.dual_equations
        outside = float((points @ equations[:, :-1].T + equations[:, -1]).max())
        if outside < HULL_TOLERANCE:
            return equations
        reason = f"its hull leaves a point out by {outside:.1e}"
    raise PolytopeError(f"Qhull failed on points of shape {points.shape}: {reason}")


def _usable(kinds: FloatArray, present: BoolArray) -> BoolArray:
    """Which level rows of ``present`` can be positive in ``sum_i l_i kinds_i = 1``."""
    index = np.flatnonzero(present)
    n, k = len(index), kinds.shape[1]
    answer = linprog(
        np.concatenate([np.zeros(n), -np.ones(n)]), A_eq=np.hstack([kinds[index].T, np.zeros((k, n))]),
        b_eq=np.ones(k), A_ub=np.hstack([-np.eye(n), np.eye(n)]), b_ub=np.zeros(n),
        bounds=[(0, None)] * n + [(0, 1e-3)] * n, method="highs",
    )  # fmt: skip
    used = np.zeros(len(kinds), dtype=np.bool_)
    if answer.status == 0:
        used[index] = answer.x[n:] > 1e-7
    return used


def _rank(rows: FloatArray) -> int:
    return int(np.linalg.matrix_rank(rows, tol=1e-8 * max(1.0, float(np.abs(rows).max(initial=0.0)))))


def _without_splinters(on_generator: BoolArray) -> NDArray[np.intp]:
    """Indices of the facets left when splinters are dropped.

    Rounding makes Qhull split a facet, or put a sliver of any direction along a ridge, where generators are
    coplanar but for their last digits. A splinter has no generator beside those of another facet; left in, it
    would pass for the neighbour across that ridge and hide the facets that a segment adds there.
    """
    order = np.argsort(-on_generator.sum(axis=1), kind="stable")
    tight = on_generator[order].astype(np.float32)
    count = tight.sum(axis=1)
    keep = np.ones(len(order), dtype=np.bool_)
    step = max(1, _CHUNK // max(1, len(order)))
    for start in range(0, len(order), step):
        rows = slice(start, start + step)
        i, j = np.nonzero(tight[rows] @ tight.T == count[rows, None])
        i += start
        keep[i[j < i]] = False
    return np.sort(order[keep])


def _first_of_each(rows: FloatArray) -> NDArray[np.intp]:
    """Indices of distinct rows (to 1e-9), in their order."""
    key = rows @ np.cos(1.0 + np.arange(rows.shape[1]))
    order = np.argsort(key, kind="stable")
    close = np.flatnonzero(np.diff(key[order]) < 1e-9)
    twin = np.abs(rows[order[close]] - rows[order[close + 1]]).max(axis=1, initial=0.0) < 1e-9
    return np.sort(np.delete(order, close[twin] + 1))
