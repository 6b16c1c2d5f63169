"""Depth of a body shape inside a closed mesh that is not convex."""

import math

import coal
import numpy as np

from manikin.scene.bounds import shape_of
from manikin.scene.collision import ClosedSurface, CollisionPart
from manikin.scene.pair import Measured, Meter, PairMeter, pair_meter
from manikin.scene.shapes import Capsule, Sphere, local_bounds
from manikin.spatial import FloatArray

_SPACING = 0.02
"""Largest spacing of the points that stand for a shape [m]."""


class ClosedMeshMeter:
    """Signed distance between a body shape and a closed mesh that is not convex.

    Coal's triangle meshes are hollow: they report a positive distance inside and, where
    surfaces cross, the depth of one triangle. Where a shape touches or is inside the
    surface, this takes the deepest of sampled points instead: a capsule's or ball's axis
    points widened by the radius, a grid of a box.
    """

    def __init__(self, geometry: coal.CollisionGeometry, surface: ClosedSurface) -> None:
        self._outside = PairMeter(geometry, surface.geometry)
        self._surface = surface
        self._low, self._high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        self._points, self._radius = _sample(geometry)

    def __call__(
        self, place: coal.Transform3s, other: coal.Transform3s, within: float = math.inf
    ) -> Measured:
        """Distance, normal and nearest points; see :class:`PairMeter`."""
        del within
        outside = self._outside(place, other)
        rotation, translation = other.getRotation(), other.getTranslation()
        points = self._points @ place.getRotation().T + place.getTranslation()
        points = (points - translation) @ rotation
        if outside[0] > 0.0 and not self._may_be_inside(points[0]):
            return outside
        return self._deepest(points, rotation, translation, outside)

    def _may_be_inside(self, point: FloatArray) -> bool:
        within = np.all((point >= self._low) & (point <= self._high))
        return bool(within) and self._surface.signed(point)[0] < 0.0

    def _deepest(
        self, points: FloatArray, rotation: FloatArray, translation: FloatArray, outside: Measured
    ) -> Measured:
        measured = [self._surface.signed(point) for point in points]
        lowest = int(np.argmin([height for height, _ in measured]))
        height, nearest = measured[lowest]
        if abs(height) < 1e-9 or height - self._radius > 0.0:
            return (min(outside[0], 0.0), *outside[1:])
        normal = rotation @ ((nearest - points[lowest]) / height)
        point = rotation @ points[lowest] + translation
        on_surface = rotation @ nearest + translation
        return height - self._radius, normal, point + self._radius * normal, on_surface


def part_meter(geometry: coal.CollisionGeometry, part: CollisionPart) -> Meter:
    """Measuring function of a body shape and a part of an obstacle."""
    if part.surface is None:
        return pair_meter(geometry, part.geometry)
    return ClosedMeshMeter(geometry, part.surface)


def _sample(geometry: coal.CollisionGeometry) -> tuple[FloatArray, float]:
    """(k, 3) points, the middle one first, and the radius by which they are widened [m]."""
    shape, centre = shape_of(geometry)
    if isinstance(shape, Sphere):
        return centre[None], shape.radius
    if isinstance(shape, Capsule):
        heights = _spread(shape.length)
        axis = np.column_stack([np.zeros((len(heights), 2)), heights])
        return axis + centre, shape.radius
    size = 2 * local_bounds(shape)[1]
    axes = np.meshgrid(*(_spread(side, most=7) for side in size), indexing="ij")
    grid = np.stack(axes, axis=-1).reshape(-1, 3)
    return grid[np.argsort(np.linalg.norm(grid, axis=1), kind="stable")] + centre, 0.0


def _spread(length: float, most: int = 41) -> FloatArray:
    """Odd number of points over ``[-length/2, length/2]``, the middle one first."""
    number = int(min(most, 2 * np.ceil(length / _SPACING / 2) + 1))
    points = np.linspace(-length / 2, length / 2, number)
    return points[np.argsort(np.abs(points), kind="stable")]
