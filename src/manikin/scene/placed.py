"""The shapes of a body along a motion, and what is known of their distances from before."""

from dataclasses import dataclass

import pinocchio as pin

from manikin.scene.bounds import PairBounds
from manikin.spatial import FloatArray


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
    """Copies transforms out of Pinocchio's buffers.

    A reference to each transform is taken once, because making one takes longer than reading it.

    Args:
        buffer: Transforms of a ``pin.Data`` or ``pin.GeometryData``, kept alive by their owner.
    """

    def __init__(self, buffer: "pin.StdVec_SE3 | list[pin.SE3]") -> None:
        self._references = list(buffer)

    def read(self, out: FloatArray) -> None:
        """Write the transforms as they are now into ``out`` (k, 4, 4)."""
        for row, reference in zip(out, self._references, strict=True):
            row[...] = reference.homogeneous


class KnownDistances:
    """Lower bounds of distances along a motion that is measured again after a change.

    A distance that was measured, or bounded, differs from its value after the change by no more than
    its two shapes have moved.  Only what may be near then has to be measured again; the result is the
    same as without this knowledge.
    """

    def __init__(self) -> None:
        self._corners: FloatArray | None = None
        self._lower: FloatArray | None = None

    def lower(self, bounds: PairBounds, corners: FloatArray) -> FloatArray | None:
        """(n, pairs) lower bounds [m] with shapes at ``corners`` (n, shapes, 8, 3), or None."""
        if self._corners is None or self._lower is None or len(corners) != len(self._corners):
            return None
        return self._lower - bounds.moved(self._corners, corners)

    def keep(self, corners: FloatArray, lower: FloatArray) -> None:
        """Remember bounds (n, pairs) for shapes at ``corners``."""
        self._corners, self._lower = corners, lower
