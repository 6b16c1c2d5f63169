"""Signed distance of one pair of Coal geometries, also of a shape inside a closed mesh that is not convex."""

import math
from typing import Protocol

import coal
import numpy as np

from manikin.numerics.spatial import FloatArray
from manikin.scene.collision import ClosedSurface, CollisionPart
from manikin.scene.distance_bounds import shape_of
from manikin.scene.obstacle import Capsule, Sphere, local_bounds

Measured = tuple[float, FloatArray, FloatArray, FloatArray]
"""Distance [m], unit normal from the first to the second, nearest point on each."""

_BEYOND: FloatArray = np.full(3, np.nan)
_BEYOND.setflags(write=False)


class Meter(Protocol):
    """Measures one pair at the placements of both."""

    def __call__(
        self, place: coal.Transform3s, other: coal.Transform3s, within: float = math.inf
    ) -> Measured:
        """Distance, normal and nearest points; see :class:`PairMeter`."""
        ...


_FINE = 1e-8
_SAFE = 1e-6
_FAILED = 1e6  # [m]; Coal leaves the largest number where its iteration breaks down


class PairMeter:
    """Measures one pair with Coal; answers depend only on the two placements.

    Coal's own tolerance of 1e-6 m makes distances that are too rough to differentiate, so
    1e-8 is asked for first. On cylinders that makes the iteration fail now and then, so
    they, and whatever fails, keep Coal's own.
    """

    def __init__(self, first: coal.CollisionGeometry, second: coal.CollisionGeometry) -> None:
        self._geometries = first, second  # Coal's functor does not keep them alive
        self._compute = coal.ComputeDistance(first, second)
        round_edged = any(isinstance(item, coal.Cylinder) for item in (first, second))
        self._request = _request(_SAFE if round_edged else _FINE)
        self._result = coal.DistanceResult()

    def __call__(
        self, place: coal.Transform3s, other: coal.Transform3s, within: float = math.inf
    ) -> Measured:
        """Measure at the two geometry-to-world placements.

        Returns:
            Distance, negative in penetration; normal; nearest points. From a distance of ``within`` [m] on
            the vectors are NaN, as reading them takes longer than many a distance.
        """
        result = self._result
        result.clear()
        distance = self._compute(place, other, self._request, result)
        if not abs(distance) < _FAILED:
            result.clear()
            distance = self._compute(place, other, _request(_SAFE), result)
        if distance >= within:
            return distance, _BEYOND, _BEYOND, _BEYOND
        normal = result.normal
        if not math.isfinite(normal[0]):
            normal = _fallback_normal(place, other)
        return distance, normal, result.getNearestPoint1(), result.getNearestPoint2()


class BallCylinderMeter:
    """A ball and a cylinder, in closed form.

    Coal always pushes a ball whose centre is inside the cylinder out through the side, even
    just below a cap, so its depth is too large and jumps at the cap.
    """

    def __init__(self, ball: coal.Sphere, cylinder: coal.Cylinder) -> None:
        self._ball_radius = float(ball.radius)
        self._radius, self._half_length = float(cylinder.radius), float(cylinder.halfLength)

    def __call__(
        self, place: coal.Transform3s, other: coal.Transform3s, within: float = math.inf
    ) -> Measured:
        """Distance, normal and nearest points; see :class:`PairMeter`."""
        del within
        rotation, origin = other.getRotation(), other.getTranslation()
        centre = place.getTranslation()
        nearest, outward, height = self._nearest(rotation.T @ (centre - origin))
        normal = -(rotation @ outward)
        on_ball, on_cylinder = centre + self._ball_radius * normal, rotation @ nearest + origin
        return height - self._ball_radius, normal, on_ball, on_cylinder

    def _nearest(self, point: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Surface point nearest to a point, unit vector from it outward, and signed distance."""
        across = float(np.hypot(point[0], point[1]))
        radial = np.array([point[0], point[1], 0.0]) / across if across > 1e-12 else np.array([1.0, 0.0, 0.0])
        axial = np.array([0.0, 0.0, 1.0 if point[2] >= 0.0 else -1.0])
        beyond_side, beyond_cap = across - self._radius, abs(point[2]) - self._half_length
        if max(beyond_side, beyond_cap) <= 0.0:
            outward = radial if beyond_side >= beyond_cap else axial
            height = max(beyond_side, beyond_cap)
            return point - height * outward, outward, height
        gap = max(beyond_side, 0.0) * radial + max(beyond_cap, 0.0) * axial
        height = float(np.linalg.norm(gap))
        return point - gap, gap / height, height


class _Swapped:
    """A meter of the same pair in the other order."""

    def __init__(self, meter: Meter) -> None:
        self._meter = meter

    def __call__(
        self, place: coal.Transform3s, other: coal.Transform3s, within: float = math.inf
    ) -> Measured:
        distance, normal, on_second, on_first = self._meter(other, place, within)
        return distance, -normal, on_first, on_second


def pair_meter(first: coal.CollisionGeometry, second: coal.CollisionGeometry) -> Meter:
    """Measuring function of two geometries."""
    if isinstance(first, coal.Sphere) and isinstance(second, coal.Cylinder):
        return BallCylinderMeter(first, second)
    if isinstance(first, coal.Cylinder) and isinstance(second, coal.Sphere):
        return _Swapped(BallCylinderMeter(second, first))
    return PairMeter(first, second)


def _request(tolerance: float) -> coal.DistanceRequest:
    request = coal.DistanceRequest()
    request.gjk_tolerance = tolerance
    request.epa_tolerance = tolerance
    request.gjk_max_iterations = 512
    request.epa_max_iterations = 512
    return request


def _fallback_normal(place: coal.Transform3s, other: coal.Transform3s) -> FloatArray:
    """Direction between the centres, or up where they coincide."""
    between = other.getTranslation() - place.getTranslation()
    length = float(np.linalg.norm(between))
    return between / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])


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
