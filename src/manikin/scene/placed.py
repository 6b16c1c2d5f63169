"""The shapes of a body along a motion, and what is known of their distances from before."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.lib.stride_tricks import as_strided

from manikin.errors import SceneError
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

    The transforms lie one after the other, so that one view of each part reads all of them at once.

    Args:
        buffer: Transforms of a ``pin.Data`` or ``pin.GeometryData``, kept alive by their owner.
        chosen: Indices of the transforms to read; all when omitted.
    """

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
