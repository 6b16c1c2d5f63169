"""Smooth geometric constraints on the CoM, written once for numbers and for CasADi symbols."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.spatial import FloatArray

CoordinateFunction = Callable[[Any, Any, Any], Any]
"""A smooth function of x, y, z [m], given as numbers, numpy arrays or CasADi symbols."""


@dataclass(frozen=True)
class GeometricConstraint:
    """A smooth constraint ``function(x, y, z) <= 0`` on the CoM position ([Qiu2012]_ 5.4.1, f_nl).

    Attributes:
        name: How messages call it, such as ``"height above the lower surface"``.
        function: Takes the three coordinates [m] as numpy arrays or as CasADi symbols and
            returns the violation [m], element-wise; numpy's elementary functions work on both.
        impassable: Why no position on the far side can be reached through the constraint; empty
            when it can be met everywhere. It is what a failure then names.
    """

    name: str
    function: CoordinateFunction
    impassable: str = ""

    def violation(self, position: FloatArray) -> FloatArray:
        """(n,) value of the function at (n, 3) positions; positive means violated [m]."""
        values = self.function(position[..., 0], position[..., 1], position[..., 2])
        return np.broadcast_to(np.asarray(values, dtype=np.float64), position.shape[:-1])


@dataclass(frozen=True)
class BentSurface:
    """A horizontal surface that changes height along x ([Qiu2012]_ 5.29).

    ``height(x) = middle - drop / pi * arctan(steepness (x - centre))``.

    Attributes:
        middle: Height at the bend [m].
        drop: Height lost from far before to far behind the bend [m]; negative climbs.
        steepness: Sharpness of the bend [1/m].
        centre: Where it bends [m].
    """

    middle: float
    drop: float
    steepness: float
    centre: float

    def __call__(self, x: Any, y: Any = 0.0, z: Any = 0.0) -> Any:  # noqa: ARG002
        """Height at ``x`` [m], for numbers, arrays and CasADi symbols."""
        return self.middle - self.drop / np.pi * np.arctan(self.steepness * (x - self.centre))


@dataclass(frozen=True)
class _Above:
    surface: CoordinateFunction

    def __call__(self, x: Any, y: Any, z: Any) -> Any:
        return self.surface(x, y, z) - z


@dataclass(frozen=True)
class _Below:
    surface: CoordinateFunction

    def __call__(self, x: Any, y: Any, z: Any) -> Any:
        return z - self.surface(x, y, z)


def height_band(
    lower: CoordinateFunction, upper: CoordinateFunction
) -> tuple[GeometricConstraint, GeometricConstraint]:
    """The CoM between two surfaces ([Qiu2012]_ 5.29).

    Args:
        lower: Least height [m] at (x, y, z), such as a :class:`BentSurface`.
        upper: Greatest height [m] at (x, y, z).
    """
    return (
        GeometricConstraint("height above the lower surface", _Above(lower)),
        GeometricConstraint("height below the upper surface", _Below(upper)),
    )
