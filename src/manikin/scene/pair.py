"""Signed distance of one pair of Coal geometries."""

import coal
import numpy as np

from manikin.spatial import FloatArray

Measured = tuple[float, FloatArray, FloatArray, FloatArray]
"""Distance [m], unit normal from the first to the second, nearest point on each."""

_FINE = 1e-8
_SAFE = 1e-6
_FAILED = 1e6  # [m]; Coal leaves the largest number where its iteration breaks down


class PairMeter:
    """Measures one pair; answers depend only on the two placements.

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

    def __call__(self, place: coal.Transform3s, other: coal.Transform3s) -> Measured:
        """Measure at the two geometry-to-world placements.

        Returns:
            Distance, negative in penetration; normal; nearest points.
        """
        result = self._result
        result.clear()
        distance = self._compute(place, other, self._request, result)
        if not abs(distance) < _FAILED:
            result.clear()
            distance = self._compute(place, other, _request(_SAFE), result)
        normal = result.normal
        if not np.isfinite(normal[0]):
            normal = _fallback_normal(place, other)
        return distance, normal, result.getNearestPoint1(), result.getNearestPoint2()


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
