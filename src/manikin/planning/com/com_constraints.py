"""Geometric constraints on the CoM: smooth ones for numbers and CasADi symbols, and planes at key instants.

Where the body would reach below an overhead obstacle, its CoM must not be higher than the body can fold to;
away from there the bound rises smoothly to a height that no posture reaches. [Qiu2012]_ 5.29 drew such a
surface by hand and left its construction open (8.2.2); this is our own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array


@dataclass(frozen=True, eq=False)
class KeyPlane:
    """Constraint that keeps the CoM behind a plane at one key instant: ``normal . p(T_key) <= offset``.

    It is linear in the last Bezier point of a phase and met exactly. With a lead it is kept of ``p + lead
    v``, where its velocity would carry the CoM: that bounds its speed. It is ours; [Qiu2012]_ 7.2.3 only
    says that "some constraints" are modified.

    Attributes:
        key: Index of the key instant; 1 is the end of the first phase.
        normal: (3,) unit vector out of the permitted half-space.
        offset: Distance of the plane from the world origin along the normal [m].
        lead: Time for which the velocity carries the CoM on before it is compared [s].
    """

    key: int
    normal: FloatArray
    offset: float
    lead: float = 0.0

    def __init__(self, key: int, normal: ArrayLike, offset: float, lead: float = 0.0) -> None:
        """Normalise the normal, and the offset with it."""
        vector = frozen_array(normal, "key plane normal", (3,))
        if (length := float(np.linalg.norm(vector))) < 1e-9:
            raise InputError(f"key plane normal is {vector.tolist()}; valid: not zero")
        if isinstance(key, bool) or not isinstance(key, (int, np.integer)) or key < 1:
            raise InputError(f"key plane is at key instant {key!r}; valid: an integer >= 1")
        unit = frozen_array(vector / length, "key plane normal", (3,))
        away = finite_number(offset, "key plane offset [m]") / length
        ahead = finite_number(lead, "key plane lead [s]", at_least=0.0)
        vars(self).update(key=int(key), normal=unit, offset=away, lead=ahead)

    @classmethod
    def towards(cls, key: int, start: ArrayLike, goal: ArrayLike, beyond: float = 0.0) -> "KeyPlane":
        """The plane through ``goal`` that cuts off ``start``, moved on by ``beyond`` [m]."""
        from_here, to_there = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
        normal = from_here - to_there
        if (length := float(np.linalg.norm(normal))) < 1e-9:
            raise InputError(f"key plane is through its start {from_here.tolist()}; valid: another goal")
        return cls(key, normal / length, float(normal @ to_there) / length - beyond)

    def violation(self, position: FloatArray) -> FloatArray:
        """(...) how far (..., 3) positions are beyond the plane [m]; negative is room."""
        return np.asarray(position @ self.normal - self.offset, dtype=np.float64)


CoordinateFunction = Callable[[Any, Any, Any], Any]
"""A smooth function of x, y, z [m], given as numbers, numpy arrays or CasADi symbols."""


@dataclass(frozen=True)
class GeometricConstraint:
    """A smooth constraint ``function(x, y, z) <= 0`` on the CoM position ([Qiu2012]_ 5.4.1, f_nl).

    Attributes:
        name: How messages call it, such as ``"height above the lower surface"``.
        function: Violation [m] of the three coordinates [m], numpy arrays or CasADi symbols, element-wise.
        impassable: Why no position on the far side can be reached, for a failure; empty when one can.
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
class _Height:
    surface: CoordinateFunction
    above: bool

    def __call__(self, x: Any, y: Any, z: Any) -> Any:
        height = self.surface(x, y, z)
        return height - z if self.above else z - height


def height_band(
    lower: CoordinateFunction, upper: CoordinateFunction
) -> tuple[GeometricConstraint, GeometricConstraint]:
    """Constraints that keep the CoM between two heights [m] at (x, y, z) ([Qiu2012]_ 5.29)."""
    return (
        GeometricConstraint("height above the lower surface", _Height(lower, above=True)),
        GeometricConstraint("height below the upper surface", _Height(upper, above=False)),
    )


_PARALLEL = 1e-9
"""Sine of the angle up to which two edges count as parallel."""


@dataclass(frozen=True, eq=False)
class Zone:
    """A convex polygon of the ground with soft edges.

    Attributes:
        normals: (k, 2) unit outward normals of the edges.
        offsets: (k,) the polygon is ``normals @ p <= offsets`` [m].
        onset: Distance from an edge at which the zone is no longer felt [m].
    """

    normals: FloatArray
    offsets: FloatArray
    onset: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "normals", frozen_array(self.normals, "zone normals", (None, 2)))
        object.__setattr__(self, "offsets", frozen_array(self.offsets, "zone offsets", (len(self.normals),)))
        finite_number(self.onset, "zone onset [m]", above=0.0)

    @classmethod
    def below(cls, outline: ArrayLike, footprints: Sequence[FloatArray], onset: float) -> "Zone":
        """CoM positions at which a body reaches below an obstacle: their Minkowski sum, the body mirrored.

        Args:
            outline: (n, 2) points whose convex hull is the obstacle seen from above [m].
            footprints: (m, 2) corners of the convex region that the body covers, relative to the CoM in
                world axes; one for each heading, of which the widest counts [m]. May be none.
            onset: See :class:`Zone`.
        """
        points = frozen_array(outline, "overhead outline [m]", (None, 2))
        edges = [ConvexHull(corners).equations[:, :2] for corners in (points, *(-f for f in footprints))]
        kept: list[FloatArray] = []
        for normal in np.vstack(edges):
            if all(normal @ other < 1.0 - _PARALLEL for other in kept):
                kept.append(normal)
        normals = np.array(kept)
        reach = np.max([(-f @ normals.T).max(axis=0) for f in footprints] or [np.zeros(len(normals))], axis=0)
        return cls(normals, (points @ normals.T).max(axis=0) + reach, onset)

    def share(self, x: Any, y: Any) -> Any:
        """Share of the zone at (x, y) [m]: 1 inside, 0 beyond the onset of any edge, smooth between (C2).

        The product of ``6 u^5 - 15 u^4 + 10 u^3`` over the edges, of floats, arrays or CasADi symbols.
        """
        share = 1.0
        for normal, offset in zip(self.normals, self.offsets, strict=True):
            beyond = (normal[0] * x + normal[1] * y - offset) / self.onset
            u = 1.0 - np.fmin(np.fmax(beyond, 0.0), 1.0)
            share = share * (u**3 * (u * (6.0 * u - 15.0) + 10.0))
        return share

    def crosses(self, start: ArrayLike, goal: ArrayLike) -> bool:
        """Whether the straight line between two points (2,) meets the polygon itself."""
        a, b = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
        enter, leave = 0.0, 1.0
        ends = self.normals @ a - self.offsets, self.normals @ b - self.offsets
        for before, after in zip(*ends, strict=True):
            if before > 0.0 and after > 0.0:
                return False
            if before > 0.0:
                enter = max(enter, before / (before - after))
            elif after > 0.0:
                leave = min(leave, before / (before - after))
        return enter <= leave


@dataclass(frozen=True, eq=False)
class CeilingHeight:
    """Greatest height of the CoM near one overhead obstacle.

    Attributes:
        zone: Where the body is below it.
        free: Height far from it, out of reach of the body [m].
        low: Height in the zone [m].
    """

    zone: Zone
    free: float
    low: float

    def __post_init__(self) -> None:
        if not self.low <= self.free:
            raise InputError(
                f"height below an obstacle is {self.low} m and {self.free} m away from it; "
                "valid: not higher below it"
            )

    def __call__(self, x: Any, y: Any, z: Any = 0.0) -> Any:  # noqa: ARG002
        """Height at (x, y) [m], for numbers, arrays and CasADi symbols."""
        return self.free - (self.free - self.low) * self.zone.share(x, y)


@dataclass(frozen=True)
class _Outside:
    zone: Zone

    def __call__(self, x: Any, y: Any, z: Any) -> Any:  # noqa: ARG002
        return self.zone.onset * (self.zone.share(x, y) - 0.5)


def height_below(name: str, surface: CeilingHeight) -> GeometricConstraint:
    """Constraint that keeps the CoM below the greatest height that a named overhead obstacle allows."""
    return GeometricConstraint(f"height below '{name}'", _Height(surface, above=False))


def keep_out(name: str, zone: Zone, reason: str) -> GeometricConstraint:
    """Constraint that keeps the CoM out of the zone below a named obstacle; half its onset counts as inside.

    The reason says why nothing passes, for the explanation of a failure.
    """
    return GeometricConstraint(f"way around '{name}'", _Outside(zone), reason)
