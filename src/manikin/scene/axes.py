"""Exact distances between the capsules and balls of a body, for many pairs at once.

They only tell which pairs are worth measuring: normals and nearest points are Coal's.
"""

from collections.abc import Sequence
from typing import NamedTuple

import coal
import numpy as np
from numpy.typing import NDArray

from manikin.spatial import FloatArray

_PARALLEL = 1e-12
"""Squared sine of the angle below which two axes count as parallel."""


class ShapeAxes(NamedTuple):
    """The axes of capsules, and of balls as capsules without length.

    Attributes:
        round: (shapes,) whether a shape is a capsule or a ball; the others have no axis.
        half: (shapes,) half the length of the axis, which lies along the shape's own z [m].
        radius: (shapes,) [m].
    """

    round: NDArray[np.bool_]
    half: FloatArray
    radius: FloatArray

    @classmethod
    def of(cls, geometries: Sequence[coal.CollisionGeometry]) -> "ShapeAxes":
        """Axes of Coal geometries."""
        rows = [_axis(item) for item in geometries]
        half, radius = np.array(rows, dtype=np.float64).reshape(-1, 2).T
        return cls(radius > 0.0, half, radius)

    def distances(
        self, first: NDArray[np.int64], second: NDArray[np.int64], places: tuple[FloatArray, ...]
    ) -> FloatArray:
        """(k,) distances [m] of round shapes, negative where the axes are closer than the radii.

        Args:
            first: (k,) index of a shape.
            second: (k,) index of another.
            places: Axes' directions and centres of the first shapes, then of the second, (k, 3) each.
        """
        direction, centre, other_direction, other_centre = places
        a, b = self.half[first, None] * direction, self.half[second, None] * other_direction
        return segment_distances(centre, a, other_centre, b) - self.radius[first] - self.radius[second]


def segment_distances(
    first: FloatArray, first_half: FloatArray, second: FloatArray, second_half: FloatArray
) -> FloatArray:
    """(k,) distances of segments, each from its centre minus to its centre plus its half (k, 3) [m].

    The nearest points of the lines, cut to the segments one after the other ([Ericson2005]_ 5.1.9).
    """
    apart = first - second
    aa, bb, ab = (_dot(u, v) for u, v in ((first_half, first_half), (second_half, second_half),
                                          (first_half, second_half)))  # fmt: skip
    along_first, along_second = _dot(first_half, apart), _dot(second_half, apart)
    skewness = aa * bb - ab**2
    on_first = _cut(ab * along_second - along_first * bb, skewness, _PARALLEL * aa * bb)
    on_second = _cut(ab * on_first + along_second, bb)
    on_first = _cut(ab * on_second - along_first, aa)
    between = apart + on_first[:, None] * first_half - on_second[:, None] * second_half
    return np.sqrt(_dot(between, between))


def _axis(geometry: coal.CollisionGeometry) -> tuple[float, float]:
    """Half length and radius; zeros for a shape that is not round."""
    if isinstance(geometry, coal.Capsule):
        return geometry.halfLength, geometry.radius
    return (0.0, geometry.radius) if isinstance(geometry, coal.Sphere) else (0.0, 0.0)


def _dot(u: FloatArray, v: FloatArray) -> FloatArray:
    return np.einsum("ki,ki->k", u, v)


def _cut(numerator: FloatArray, denominator: FloatArray, least: FloatArray | float = 0.0) -> FloatArray:
    """Quotient within [-1, 1]; zero where the denominator is not above ``least``."""
    safe = denominator > least
    return np.clip(np.where(safe, numerator, 0.0) / np.where(safe, denominator, 1.0), -1.0, 1.0)
