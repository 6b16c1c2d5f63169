"""Room of feet beside what stands on the floor: of a sole where it stands, and on its way there."""

from collections.abc import Sequence

import numpy as np
import shapely

from manikin.numerics.spatial import FloatArray
from manikin.walking.path.walk_obstacles import WalkObstacle

FOOT_ROOM = 0.04
"""Least distance of a foot from what stands on the floor, also on its way [m]: half of it is for the swing,
which is no straight line, and the execution."""

_FLIGHT = np.linspace(0.0, 1.0, 5)
_CORNERS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
_ROUND = 16


class FootRoom:
    """Distances of soles from the outlines of obstacles at rest, and of what they sweep in a straight step.

    What moves is no obstacle to feet: the path of the body keeps away from it.
    """

    def __init__(self, obstacles: Sequence[WalkObstacle], length: float, width: float) -> None:
        """Take the outlines.

        Args:
            obstacles: Seen from above.
            length: Of the soles [m].
            width: Of the soles [m].
        """
        outlines = [
            shapely.MultiPoint(item.corners + item.displacements[0]).convex_hull.buffer(
                item.radius, quad_segs=_ROUND
            )
            for item in obstacles
            if not item.moves
        ]
        self._outlines = shapely.union_all(outlines) if outlines else None
        self._sole = _CORNERS * [length, width]

    def at(self, place: FloatArray) -> float:
        """Distance of a foot that stands at a place (3,) x, y [m], yaw [rad], as :meth:`beside` gives it."""
        return float(self.beside(place, place[None])[0])

    def beside(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """(n,) least distances of a foot that goes straight from a place to each of others [m].

        Args:
            before: (3,) x, y [m], yaw [rad] where the sole leaves.
            after: (n, 3) where it lands.

        Returns:
            0 where it would meet an obstacle; infinite without obstacles.
        """
        if self._outlines is None:
            return np.full(len(after), np.inf)
        turn = np.angle(np.exp(1j * (after[:, 2] - before[2])))
        way = np.column_stack([after[:, :2] - before[:2], turn])
        place = before + _FLIGHT[None, :, None] * way[:, None, :]
        cosine, sine = np.cos(place[..., 2, None]), np.sin(place[..., 2, None])
        x, y = self._sole.T
        corners = place[..., None, :2] + np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
        swept = shapely.convex_hull(shapely.multipoints(corners.reshape(len(after), -1, 2)))
        return np.asarray(shapely.distance(swept, self._outlines), dtype=np.float64)
