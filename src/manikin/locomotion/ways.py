"""Ways between resting obstacles, searched on a grid to guess paths from, or to tell that there is none."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from manikin.locomotion.obstacles import WalkObstacle
from manikin.spatial import FloatArray

_CELL = 0.05
"""Side of a cell [m], where that makes no more than :data:`_CELLS` along the longer side."""

_CELLS = 160

_BESIDE = 1.0
"""Room around everything in which ways are searched [m]."""

_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1))


class Grid:
    """The floor around start, goal and resting obstacles in square cells.

    Args:
        obstacles: Those that do not move are taken.
        start: (3,) x, y [m], heading [rad].
        goal: (3,) x, y [m], heading [rad].
    """

    def __init__(self, obstacles: Sequence[WalkObstacle], start: FloatArray, goal: FloatArray) -> None:
        resting = [one for one in obstacles if not one.moves]
        ends = np.vstack([start[:2], goal[:2]])
        corners = [
            one.corners + one.displacements[0] + sign * one.radius for one in resting for sign in (-1, 1)
        ]
        points = np.vstack([ends, *corners])
        self._low, high = points.min(axis=0) - _BESIDE, points.max(axis=0) + _BESIDE
        self._cell = max(_CELL, float((high - self._low).max()) / _CELLS)
        self._shape = tuple(np.ceil((high - self._low) / self._cell).astype(int) + 1)
        rows, columns = np.indices(self._shape)
        self._centres = self._low + self._cell * np.column_stack([rows.ravel(), columns.ravel()])
        rooms = [one.distance(self._centres[:, None], np.zeros(1))[:, 0] for one in resting]
        self._room = np.min(rooms, axis=0) if rooms else np.full(len(self._centres), np.inf)
        self._ends = [int(np.argmin(np.linalg.norm(self._centres - end, axis=1))) for end in ends]

    @property
    def tolerance(self) -> float:
        """A way with this much less room than a cell's centre shows may still exist beside it [m]."""
        return self._cell * np.sqrt(0.5)

    def way(self, room: float) -> FloatArray | None:
        """The shortest way whose cells keep their centres this far from all obstacles.

        Args:
            room: [m]; start and goal themselves may have less.

        Returns:
            (k, 2) centres of its cells between start and goal [m], or None if there is no way.
        """
        free = self._room >= room
        free[self._ends] = True
        index = np.arange(free.size).reshape(self._shape)
        firsts, seconds, lengths = [], [], []
        for dx, dy in _STEPS:
            a = index[: self._shape[0] - dx, max(0, -dy) : self._shape[1] - max(0, dy)].ravel()
            b = a + dx * self._shape[1] + dy
            both = free[a] & free[b]
            firsts.append(a[both])
            seconds.append(b[both])
            lengths.append(np.full(int(both.sum()), np.hypot(dx, dy)))
        edges = (np.concatenate(lengths), (np.concatenate(firsts), np.concatenate(seconds)))
        graph = coo_matrix(edges, shape=(free.size, free.size)).tocsr()
        _, before = dijkstra(graph, directed=False, indices=self._ends[0], return_predecessors=True)
        cells = [self._ends[1]]
        while cells[-1] != self._ends[0]:
            if before[cells[-1]] < 0:
                return None
            cells.append(int(before[cells[-1]]))
        return self._centres[cells[-2:0:-1]]
