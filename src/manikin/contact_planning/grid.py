"""A spatial index of points that answers which of them are near a plane polygon."""

import numpy as np
from numpy.typing import NDArray

from manikin.spatial import FloatArray

POINTS_PER_CELL = 12
"""Points of a cell on average: fewer make more cells to test, more make more points to test."""

IntArray = NDArray[np.int64]


class SampleGrid:
    """Points sorted into cubic cells, of which each non-empty one keeps a tight box and ball.

    A slab around a surface crosses few cells, and the points of a cell lie next to each other in
    memory; an octree would find the same points.

    Attributes:
        order: (n,) indices of the points, cell by cell.
        starts: (c + 1,) where each cell begins in :attr:`order`.
        centres: (c, 3) middles of both [m].
        halves: (c, 3) half sides of the tight boxes around them [m].
        radii: (c,) [m].
    """

    def __init__(self, points: FloatArray) -> None:
        low = points.min(axis=0)
        # A reach fills about half of the cube around it.
        across = max(int(np.cbrt(2.0 * len(points) / POINTS_PER_CELL)), 1)
        side = max(float(np.ptp(points, axis=0).max()) / across, 1e-9)
        cells = np.minimum(((points - low) / side).astype(np.int64), across - 1)
        keys = (cells[:, 0] * across + cells[:, 1]) * across + cells[:, 2]
        self.order: IntArray = np.argsort(keys, kind="stable")
        sorted_keys = keys[self.order]
        firsts = np.flatnonzero(np.diff(sorted_keys, prepend=-1))
        self.starts: IntArray = np.append(firsts, len(points))
        ordered = points[self.order]
        lowest = np.minimum.reduceat(ordered, firsts, axis=0)
        highest = np.maximum.reduceat(ordered, firsts, axis=0)
        self.centres: FloatArray = 0.5 * (lowest + highest)
        self.halves: FloatArray = 0.5 * (highest - lowest)
        self.radii: FloatArray = np.linalg.norm(self.halves, axis=1)

    def points_of(self, cells: IntArray) -> tuple[IntArray, IntArray]:
        """Points of cells that may occur repeatedly.

        Args:
            cells: (m,) numbers of cells.

        Returns:
            Indices of the points, and for each the position of its cell in ``cells``.
        """
        counts = self.starts[cells + 1] - self.starts[cells]
        owner = np.repeat(np.arange(len(cells)), counts)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.order[self.starts[cells][owner] + within], owner
