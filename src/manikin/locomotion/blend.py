"""Which cycles make up a walk of given velocities, and with what weights."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import Delaunay, QhullError

from manikin.errors import InputError
from manikin.locomotion.library import MotionLibrary
from manikin.spatial import FloatArray

TURN_RADIUS = 0.5
"""In the control space an angular velocity counts as the speed at this distance [m]."""

INSIDE = 1e-9
"""A velocity that misses the hull of the library by less than this belongs to it [m/s]."""

MIRRORED = " mirrored"

_REFLECTED = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Blend:
    """Weights of cycles at n instants.

    Attributes:
        cycles: (n, k) places of the cycles in the library.
        weights: (n, k) that add up to 1.
        velocity: (n, 3) forward, left [m/s], angular [rad/s] that the blend walks with.
        outside: (n,) whether other velocities were asked for, beyond those of the library.
    """

    cycles: NDArray[np.int64]
    weights: FloatArray
    velocity: FloatArray
    outside: NDArray[np.bool_]


class ControlSpace:
    """Cycles by velocity, as vertices of tetrahedra ([Truong2010]_ 6.5, eq. 6.2).

    The coordinates are the forward, left and angular velocities. The thesis' first one is the total speed,
    of which the lateral velocity is a component: points with it larger do not exist, and walking backward
    and forward are the same. The forward velocity has neither fault, and blends of velocities are then
    exactly those of the blended motion.

    Tetrahedra of a library that contains mirror images need not be mirror images. The weights are therefore
    the mean of those found for the velocity and those found for its reflection, reflected: a directive
    straight ahead gives a symmetric walk.
    """

    def __init__(self, library: MotionLibrary, radius: float = TURN_RADIUS) -> None:
        """Build the tetrahedra.

        Args:
            library: Its cycles.
            radius: See :data:`TURN_RADIUS`.

        Raises:
            InputError: If the velocities of the library span no volume.
        """
        self.library = library
        self.scale = np.array([1.0, 1.0, radius])
        self._points = library.velocities * self.scale
        try:
            self._cells = Delaunay(self._points)
        except (QhullError, ValueError):
            raise InputError(
                f"the {len(library)} velocities of the motion library span no volume; "
                "valid: at least 4 cycles, forward, sideways and turning"
            ) from None
        self._partners = _partners(library)

    @cached_property
    def on_hull(self) -> NDArray[np.bool_]:
        """(c,) whether a cycle is at the border of what the library reaches."""
        found = np.zeros(len(self.library), dtype=np.bool_)
        found[self._cells.convex_hull.ravel()] = True
        return found

    def blend(self, velocity: ArrayLike) -> Blend:
        """Weights for velocities; beyond the library, for the nearest ones that it reaches.

        Args:
            velocity: (n, 3) forward, left [m/s], angular [rad/s].
        """
        wanted = np.asarray(velocity, dtype=np.float64) * self.scale
        if self._partners is None:
            cycles, weights, reached, outside = self._located(wanted)
            return Blend(cycles, weights, reached / self.scale, outside)
        n = len(wanted)
        cycles, weights, reached, outside = self._located(np.concatenate([wanted, wanted * _REFLECTED]))
        return Blend(
            np.hstack([cycles[:n], self._partners[cycles[n:]]]), 0.5 * np.hstack([weights[:n], weights[n:]]),
            0.5 * (reached[:n] + reached[n:] * _REFLECTED) / self.scale, outside[:n],
        )  # fmt: skip

    def _located(
        self, points: FloatArray
    ) -> tuple[NDArray[np.int64], FloatArray, FloatArray, NDArray[np.bool_]]:
        """Vertices (n, 4), weights (n, 4), the points or the nearest ones (n, 3), and which are outside."""
        cell = self._cells.find_simplex(points)
        transform = self._cells.transform[cell]
        first = np.einsum("nij,nj->ni", transform[:, :3], points - transform[:, 3])
        weights = np.column_stack([first, 1.0 - first.sum(axis=1)])
        cycles = self._cells.simplices[cell].astype(np.int64)
        missed = (cell < 0) | ~np.isfinite(weights).all(axis=1)
        outside = missed.copy()
        reached = points
        if missed.any():
            corners, shares = self._on_faces(points[missed])
            cycles[missed], weights[missed] = corners, shares
            nearest = np.einsum("nk,nki->ni", shares, self._points[corners])
            outside[missed] = np.linalg.norm(nearest - points[missed], axis=1) > INSIDE
            reached = points.copy()
            reached[missed] = nearest
        weights = np.clip(weights, 0.0, 1.0)
        return cycles, weights / weights.sum(axis=1, keepdims=True), reached, outside

    def _on_faces(self, points: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Corners (n, 4) and weights (n, 4) of the nearest points on the triangles of the hull."""
        faces = self._cells.convex_hull
        shares = _nearest_on_triangles(points, self._points[faces])
        places = np.einsum("nfk,fki->nfi", shares, self._points[faces])
        best = np.linalg.norm(places - points[:, None], axis=2).argmin(axis=1)
        corners = faces[best][:, [0, 1, 2, 2]].astype(np.int64)
        return corners, np.hstack([shares[np.arange(len(best)), best], np.zeros((len(best), 1))])


@lru_cache(maxsize=4)
def control_space(library: MotionLibrary) -> ControlSpace:
    """The control space of a library, built once."""
    return ControlSpace(library)


def _nearest_on_triangles(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """(n, f, 3) weights of the corners that give the point of each triangle nearest to each of n points."""
    a, b, c = (triangles[None, :, k] for k in range(3))
    p = points[:, None]
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (np.sum(x * y, axis=-1) for x, y in ((u, u), (u, v), (v, v)))
    wu, wv = np.sum(w * u, axis=-1), np.sum(w * v, axis=-1)
    area = np.maximum(uu * vv - uv**2, 1e-300)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    found = np.stack([1.0 - s - t, s, t], axis=-1)
    best = np.where((found >= 0.0).all(axis=-1), 0.0, np.inf)
    for first, second, one, two in ((0, 1, a, b), (1, 2, b, c), (2, 0, c, a)):
        edge = two - one
        share = np.sum((p - one) * edge, axis=-1) / np.maximum(np.sum(edge * edge, axis=-1), 1e-300)
        share = np.clip(share, 0.0, 1.0)
        away = np.linalg.norm(one + share[..., None] * edge - p, axis=-1)
        weights = np.zeros_like(found)
        weights[..., first], weights[..., second] = 1.0 - share, share
        nearer = away < best
        found = np.where(nearer[..., None], weights, found)
        best = np.where(nearer, away, best)
    return found


def _partners(library: MotionLibrary) -> NDArray[np.int64] | None:
    """(c,) place of each cycle's mirror image, itself for a symmetric one; None if one has none."""
    places = {name: number for number, name in enumerate(library.names)}
    found = np.empty(len(library), dtype=np.int64)
    for number, name in enumerate(library.names):
        other = name.removesuffix(MIRRORED) if name.endswith(MIRRORED) else name + MIRRORED
        found[number] = places.get(other, number)
    reflected = library.velocities[found] * _REFLECTED
    return found if np.allclose(reflected, library.velocities, rtol=0.0, atol=1e-9) else None
