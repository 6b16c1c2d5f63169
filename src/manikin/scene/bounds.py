"""Cheap lower bounds of distances, from spheres that cover the body's shapes."""

from collections.abc import Sequence
from itertools import product

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.scene.axes import ShapeAxes
from manikin.scene.collision import CollisionPart
from manikin.scene.covering import cover
from manikin.scene.shapes import Box, Capsule, Cylinder, Shape, Sphere
from manikin.spatial import FloatArray

SPHERES_PER_SHAPE = 3
_BLOCK = 200_000  # numbers per block of samples: keeps temporary arrays in the cache
_NEARLY_PARALLEL = 1e-5  # [m], more than the distance of axes taken for parallel may be wrong by
_ROUNDING = 1e-6  # [m], covers the cancellation in |a|^2 + |b|^2 - 2 a.b


class PairBounds:
    """Lower bounds of the distance of each (body shape, part or body shape) pair.

    Attributes:
        first: (pairs,) index of the body shape.
        second: (pairs,) index of the body shape, or number of body shapes + index of the part.
    """

    def __init__(
        self,
        shapes: pin.GeometryModel,
        parts: Sequence[CollisionPart],
        first: NDArray[np.int64],
        second: NDArray[np.int64],
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
        self._axes = ShapeAxes.of([item.geometry for item in objects])
        has_axis = np.append(self._axes.round, np.zeros(len(parts), dtype=bool))
        self._round = has_axis[first] & has_axis[second]
        axes = np.array([part.rotation for part in parts]).reshape(-1, 3, 3)
        origins = np.array([part.rotation.T @ part.translation for part in parts]).reshape(-1, 3)
        self._part_axes = axes.transpose(1, 0, 2).reshape(3, -1)
        self._part_low = origins + np.array([part.low for part in parts]).reshape(-1, 3)
        self._part_high = origins + np.array([part.high for part in parts]).reshape(-1, 3)

    def lower(self, rotations: FloatArray, translations: FloatArray) -> FloatArray:
        """(n, pairs) lower bounds [m]; where not positive, they only say "may touch".

        Args:
            rotations: (n, shapes, 3, 3) shape-to-world.
            translations: (n, shapes, 3) [m].
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
        """(n, shapes, 8, 3) corners of the boxes around the shapes in the world [m].

        Args:
            rotations: (n, shapes, 3, 3) shape-to-world rotations.
            translations: (n, shapes, 3) [m].
        """
        return self._corners @ np.swapaxes(rotations, -1, -2) + translations[:, :, None]

    def moved(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """(n, pairs) by how much a pair's distance may change when its shapes move [m].

        Args:
            before: (n, shapes, 8, 3) their :meth:`corners`.
            after: The same after the movement.
        """
        path = np.zeros((len(before), self._count + len(self._part_low)))
        steps = after - before
        path[:, : self._count] = np.sqrt(np.einsum("nsci,nsci->nsc", steps, steps).max(axis=2))
        return path[:, self.first] + path[:, self.second]

    def tighten(
        self, lower: FloatArray, wanted: NDArray[np.bool_], rotations: FloatArray, translations: FloatArray
    ) -> None:
        """Raise the lower bounds of pairs of capsules and balls of the body to their distances.

        Args:
            lower: (n, pairs) lower bounds, changed in place [m].
            wanted: (n, pairs) which of them matter.
            rotations: (n, shapes, 3, 3) shape-to-world.
            translations: (n, shapes, 3) [m].
        """
        sample, pair = np.nonzero(wanted & self._round)
        first, second = self.first[pair], self.second[pair]
        places = (
            rotations[sample, first, :, 2], translations[sample, first],
            rotations[sample, second, :, 2], translations[sample, second],
        )  # fmt: skip
        lower[sample, pair] = self._axes.distances(first, second, places) - _NEARLY_PARALLEL

    def displacement(
        self, pair: int, sample: int, rotations: FloatArray, translations: FloatArray
    ) -> FloatArray:
        """(n,) how far the pair's shape has moved, relative to the other, since ``sample`` [m].

        The distance of the pair differs from that at ``sample`` by no more. A rigid
        displacement is largest at a corner of the box around the shape, because its
        length is convex in the point.
        """
        shape, other = self.first[pair], self.second[pair]
        corners = self._corners[shape] @ np.swapaxes(rotations[:, shape], -1, -2)
        corners = corners + translations[:, shape, None]
        if other < self._count:
            corners = (corners - translations[:, other, None]) @ rotations[:, other]
        return np.sqrt(((corners - corners[sample]) ** 2).sum(axis=2).max(axis=1))

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


def shape_of(geometry: coal.CollisionGeometry) -> tuple[Shape, FloatArray]:
    """Shape (or the box around it) of a Coal geometry and its (3,) centre in the geometry's frame."""
    centre = np.zeros(3)
    if isinstance(geometry, coal.Sphere):
        return Sphere(geometry.radius), centre
    if isinstance(geometry, coal.Capsule):
        return Capsule(geometry.radius, 2 * geometry.halfLength), centre
    if isinstance(geometry, coal.Cylinder):
        return Cylinder(geometry.radius, 2 * geometry.halfLength), centre
    if isinstance(geometry, coal.Box):
        return Box(2 * geometry.halfSide), centre
    geometry.computeLocalAABB()
    low, high = geometry.aabb_local.min_, geometry.aabb_local.max_
    return Box(np.maximum(high - low, 1e-6)), (low + high) / 2


def box_corners(geometry: coal.CollisionGeometry) -> FloatArray:
    """(8, 3) corners of the box around a Coal geometry in its own frame."""
    geometry.computeLocalAABB()
    low, high = geometry.aabb_local.min_, geometry.aabb_local.max_
    signs = np.array(list(product((0.0, 1.0), repeat=3)))
    return low + signs * (high - low)


def _few_spheres(geometry: coal.CollisionGeometry) -> tuple[FloatArray, FloatArray]:
    """Exactly ``SPHERES_PER_SHAPE`` covering spheres, repeated where fewer do."""
    shape, centre = shape_of(geometry)
    found = cover(shape, count=SPHERES_PER_SHAPE)
    repeated = np.arange(SPHERES_PER_SHAPE) % len(found)
    return found.centres[repeated] + centre, found.radii[repeated]
