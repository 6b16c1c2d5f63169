"""Cheap bounds of distances along a motion, from covering spheres and from the axes of capsules and balls.

They only tell which pairs are worth measuring: normals and nearest points are Coal's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import coal
import numpy as np
import pinocchio as pin
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray, dot
from manikin.scene.collision import CollisionPart, local_box, shape_of
from manikin.scene.covering import cover
from manikin.scene.triangles import IntArray

_PARALLEL = 1e-12
"""Squared sine of the angle below which two axes count as parallel."""


def segment_distances(
    first: FloatArray, first_half: FloatArray, second: FloatArray, second_half: FloatArray
) -> FloatArray:
    """(k,) distances of segments, each from its centre minus to its centre plus its half (k, 3) [m].

    The nearest points of the lines, cut to the segments one after the other ([Ericson2005]_ 5.1.9).
    """
    apart = first - second
    aa, bb, ab = dot(first_half, first_half), dot(second_half, second_half), dot(first_half, second_half)
    along_first, along_second = dot(first_half, apart), dot(second_half, apart)
    skewness = aa * bb - ab**2
    on_first = _cut(ab * along_second - along_first * bb, skewness, _PARALLEL * aa * bb)
    on_second = _cut(ab * on_first + along_second, bb)
    on_first = _cut(ab * on_second - along_first, aa)
    between = apart + on_first[:, None] * first_half - on_second[:, None] * second_half
    return np.sqrt(dot(between, between))


def _axis(geometry: coal.CollisionGeometry) -> tuple[float, float]:
    """Half length of the axis, along z, and radius of a capsule or a ball; zeros for any other shape."""
    if isinstance(geometry, coal.Capsule):
        return geometry.halfLength, geometry.radius
    return (0.0, geometry.radius) if isinstance(geometry, coal.Sphere) else (0.0, 0.0)


def _cut(numerator: FloatArray, denominator: FloatArray, least: FloatArray | float = 0.0) -> FloatArray:
    """Quotient within [-1, 1]; zero where the denominator is not above ``least``."""
    safe = denominator > least
    return np.clip(np.where(safe, numerator, 0.0) / np.where(safe, denominator, 1.0), -1.0, 1.0)


SPHERES_PER_SHAPE = 3
_BLOCK = 200_000  # numbers per block of samples: keeps temporary arrays in the cache
_NEARLY_PARALLEL = 1e-5  # [m], more than the distance of axes taken for parallel may be wrong by
_ROUNDING = 1e-6  # [m], covers the cancellation in |a|^2 + |b|^2 - 2 a.b


class PairBounds:
    """Lower bounds of the distance of each (body shape, part or body shape) pair.

    ``first`` (pairs,) are indices of body shapes, ``second`` likewise or their number + index of the part.
    """

    def __init__(
        self, shapes: pin.GeometryModel, parts: Sequence[CollisionPart], first: IntArray, second: IntArray
    ) -> None:
        objects = list(shapes.geometryObjects)
        self._count = len(objects)
        covers = [_few_spheres(item.geometry) for item in objects]
        # Spheres are stored sphere-major: all first spheres, then all second ones, ...
        self._centres = np.array([centres for centres, _ in covers]).reshape(-1, SPHERES_PER_SHAPE, 3)
        self._radii = np.array([radii for _, radii in covers]).reshape(-1, SPHERES_PER_SHAPE).T.ravel()
        self._both_radii = self._radii[:, None] + self._radii[None, :] + _ROUNDING
        self._corners = np.array([box_corners(item.geometry) for item in objects]).reshape(-1, 8, 3)
        self.first, self.second = first, second
        self._cells = first * (self._count + len(parts)) + second  # of the pairs in the flat table
        self._self_pair = second < self._count
        self._axes = np.array([_axis(item.geometry) for item in objects], dtype=np.float64).reshape(-1, 2)
        has_axis = np.append(self._axes[:, 1] > 0.0, np.zeros(len(parts), dtype=bool))
        self._round = has_axis[first] & has_axis[second]
        axes = np.array([part.rotation for part in parts]).reshape(-1, 3, 3)
        origins = np.array([part.rotation.T @ part.translation for part in parts]).reshape(-1, 3)
        self._part_axes = axes.transpose(1, 0, 2).reshape(3, -1)
        self._part_low = origins + np.array([part.low for part in parts]).reshape(-1, 3)
        self._part_high = origins + np.array([part.high for part in parts]).reshape(-1, 3)

    def lower(self, rotations: FloatArray, translations: FloatArray) -> FloatArray:
        """(n, pairs) lower bounds [m], which only say "may touch" where not positive, of placed shapes.

        Their rotations are (n, shapes, 3, 3) shape-to-world, their translations (n, shapes, 3) [m].
        """
        out = np.empty((len(rotations), len(self.first)))
        others = self._count + len(self._part_low)
        block = max(1, _BLOCK // max(1, len(self._radii) * max(others, len(self._radii))))
        for start in range(0, len(rotations), block):
            rows = slice(start, start + block)
            out[rows] = self._lower_block(rotations[rows], translations[rows])
        return out

    def _lower_block(self, rotations: FloatArray, translations: FloatArray) -> FloatArray:
        placed = self._centres @ np.swapaxes(rotations, -1, -2) + translations[:, :, None]
        centres = np.swapaxes(placed, 1, 2).reshape(len(placed), -1, 3)
        table = np.empty((len(placed), self._count, self._count + len(self._part_low)))
        if self._self_pair.any():
            table[:, :, : self._count] = self._to_shapes(centres)
        if len(self._part_low):
            table[:, :, self._count :] = self._to_parts(centres)
        return table.reshape(len(placed), -1).take(self._cells, axis=1)

    def corners(self, rotations: FloatArray, translations: FloatArray) -> FloatArray:
        """(n, shapes, 8, 3) corners of the boxes around the shapes in the world [m], see :meth:`lower`."""
        return self._corners @ np.swapaxes(rotations, -1, -2) + translations[:, :, None]

    def moved(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """(n, pairs) largest change of a pair's distance when its shapes' :meth:`corners` move [m]."""
        path = np.zeros((len(before), self._count + len(self._part_low)))
        steps = after - before
        path[:, : self._count] = np.sqrt(np.einsum("nsci,nsci->nsc", steps, steps).max(axis=2))
        return path[:, self.first] + path[:, self.second]

    def tighten(
        self, lower: FloatArray, wanted: NDArray[np.bool_], rotations: FloatArray, translations: FloatArray
    ) -> None:
        """Raise lower bounds (n, pairs) [m] of pairs of capsules and balls of the body to their distances.

        Those ``wanted`` (n, pairs) are changed in place; placements as of :meth:`lower`.
        """
        sample, pair = np.nonzero(wanted & self._round)
        shapes = self.first[pair], self.second[pair]
        (half, radius), (other_half, other_radius) = (self._axes[shape].T for shape in shapes)
        (along, centre), (other_along, other_centre) = (
            (rotations[sample, shape, :, 2], translations[sample, shape]) for shape in shapes
        )
        a, b = half[:, None] * along, other_half[:, None] * other_along
        apart = segment_distances(centre, a, other_centre, b) - radius - other_radius
        lower[sample, pair] = apart - _NEARLY_PARALLEL

    def path(self, pair: int, rotations: FloatArray, translations: FloatArray) -> FloatArray:
        """(n, 8, 3) corners of the box around the pair's first shape, as the second one sees them [m].

        The pair's distance changes by no more than the corners move. A rigid displacement is largest at a
        corner of the box around the shape, because its length is convex in the point.
        """
        shape, other = self.first[pair], self.second[pair]
        corners = self._corners[shape] @ np.swapaxes(rotations[:, shape], -1, -2)
        corners = corners + translations[:, shape, None]
        if other < self._count:
            corners = (corners - translations[:, other, None]) @ rotations[:, other]
        return np.asarray(corners)

    def _to_parts(self, centres: FloatArray) -> FloatArray:
        """(n, shapes, parts): least over the spheres of the distance to the part's own box."""
        local = (centres @ self._part_axes).reshape(*centres.shape[:2], -1, 3)
        beyond = np.maximum(self._part_low - local, local - self._part_high)
        np.maximum(beyond, 0.0, out=beyond)
        gap = np.sqrt(np.einsum("nspi,nspi->nsp", beyond, beyond)) - self._radii[:, None]
        return _least_over_spheres(gap, axis=1, shapes=self._count)

    def _to_shapes(self, centres: FloatArray) -> FloatArray:
        """(n, shapes, shapes): least over pairs of spheres."""
        squared = np.einsum("nsi,nsi->ns", centres, centres)
        gap = squared[:, :, None] + squared[:, None, :] - 2.0 * centres @ np.swapaxes(centres, -1, -2)
        np.sqrt(np.maximum(gap, 0.0, out=gap), out=gap)
        gap -= self._both_radii
        return _least_over_spheres(_least_over_spheres(gap, 1, self._count), 2, self._count)


def _least_over_spheres(gap: FloatArray, axis: int, shapes: int) -> FloatArray:
    """Reduce an axis of (sphere, shape) pairs to shapes; slices are faster than a strided minimum."""
    by_sphere = np.moveaxis(gap, axis, 0)
    least = np.minimum(by_sphere[:shapes], by_sphere[shapes : 2 * shapes])
    for start in range(2 * shapes, len(by_sphere), shapes):
        np.minimum(least, by_sphere[start : start + shapes], out=least)
    return np.moveaxis(least, 0, axis)


def box_corners(geometry: coal.CollisionGeometry) -> FloatArray:
    """(8, 3) corners of the box around a Coal geometry in its own frame."""
    low, high = local_box(geometry)
    signs = np.array(list(product((0.0, 1.0), repeat=3)))
    return low + signs * (high - low)


def _few_spheres(geometry: coal.CollisionGeometry) -> tuple[FloatArray, FloatArray]:
    """Exactly ``SPHERES_PER_SHAPE`` covering spheres, repeated where fewer do."""
    shape, centre = shape_of(geometry)
    spheres = cover(shape, count=SPHERES_PER_SHAPE)
    repeated = np.arange(SPHERES_PER_SHAPE) % len(spheres)
    return spheres.centres[repeated] + centre, spheres.radii[repeated]


@dataclass(frozen=True, eq=False)
class PlacedShapes:
    """Collision shapes of many configurations.

    Attributes:
        placements: (n, shapes, 4, 4) shape-to-world transforms, in the order of the body's geometry.
        jacobians: (n, 6, nv) joint Jacobians in the world: column by column the linear velocity at
            the world origin and the angular velocity that a unit joint velocity gives.
    """

    placements: FloatArray
    jacobians: FloatArray


class PlacementReader:
    """Copies some or all transforms, which lie one after the other, out of a buffer of Pinocchio's data."""

    def __init__(self, buffer: "pin.StdVec_SE3", chosen: Sequence[int] | None = None) -> None:
        self._items = list(buffer)  # keeps alive what the views look into
        self._rotations = _stacked([item.rotation for item in self._items], (3, 3))
        self._translations = _stacked([item.translation for item in self._items], (3,))
        self._chosen = slice(None) if chosen is None else np.array(chosen, dtype=np.int64)

    def read(self, out: FloatArray) -> None:
        """Write the transforms as they are now into ``out`` (k, 4, 4)."""
        out[:, :3, :3] = self._rotations[self._chosen]
        out[:, :3, 3] = self._translations[self._chosen]
        out[:, 3] = (0.0, 0.0, 0.0, 1.0)


def _stacked(views: list[FloatArray], shape: tuple[int, ...]) -> FloatArray:
    """One view of equally large arrays that lie in memory at equal distances."""
    if not views:
        return np.zeros((0, *shape))
    addresses = np.array([view.__array_interface__["data"][0] for view in views])
    apart = int(addresses[1] - addresses[0]) if len(views) > 1 else 0
    if np.any(np.diff(addresses) != apart) or any(view.shape != shape for view in views):
        raise SceneError("transforms do not lie one after the other; valid: a buffer of Pinocchio")
    return as_strided(views[0], (len(views), *shape), (apart, *views[0].strides), writeable=False)


class KnownDistances:
    """Lower bounds of distances along a motion that is measured again after a change.

    A distance that was measured, or bounded, differs from its value after the change by no more than its two
    shapes have moved. Only pairs that may be near then are measured again; the result is the same.
    """

    def __init__(self) -> None:
        self._kept: tuple[FloatArray, FloatArray] | None = None

    def lower(self, bounds: PairBounds, corners: FloatArray) -> FloatArray | None:
        """(n, pairs) lower bounds [m] with shapes at ``corners`` (n, shapes, 8, 3), or None."""
        if self._kept is None or len(corners) != len(self._kept[0]):
            return None
        before, lower = self._kept
        return lower - bounds.moved(before, corners)

    def keep(self, corners: FloatArray, lower: FloatArray) -> None:
        """Remember bounds (n, pairs) for shapes at ``corners``."""
        self._kept = corners, lower
