"""Normal equations of points on segments that should be at their targets, at many instants at once.

A point at ``x`` from the root moves with ``v + w x x`` when the joints' velocities add up to ``v`` and ``w``
there. The matrix of the weighted squares is therefore the inertia matrix of a body whose only masses are the
weights at the points, and is put together as that one is: from mass, first and second moments of what each
joint carries (Featherstone, "Rigid Body Dynamics Algorithms", 2008, 6.2).
"""

from itertools import product

import numpy as np

from manikin.body import BodyModel
from manikin.mocap.segment_placements import Placements, SegmentPlacements
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray, skew


class PointEquations:
    """Which velocities move which points, and the equations that follow.

    Attributes:
        told: Numbers of the hinges that move a point.
        weights: (k,) of the points.
    """

    def __init__(self, body: BodyModel, targets: Targets) -> None:
        """Prepare the points of a body's segments."""
        marked = tuple(dict.fromkeys(targets.segments))
        self._placements = SegmentPlacements(body, marked)
        self._carriers = np.array([marked.index(name) for name in targets.segments])
        self._local, self.weights = np.array(targets.points), np.array(targets.weights)
        names = [segment.name for segment in body.segments]
        below = np.eye(len(names), dtype=bool)
        for number in range(len(names) - 1, 0, -1):
            below[names.index(body.segments[number].parent or "")] |= below[number]
        carried = below[:, [names.index(name) for name in targets.segments]]
        owners = np.repeat(np.arange(len(names)), [len(segment.hinges) for segment in body.segments])
        self.told = np.flatnonzero(carried[owners].any(axis=1))
        moved = np.concatenate([np.zeros(6, dtype=np.int64), owners[self.told]])
        self._velocities = np.concatenate([np.arange(6), 6 + self.told])
        loaded, self._load = np.unique(moved, return_inverse=True)
        self._carried = carried[loaded].astype(np.float64)
        self._coupled = np.tril(below[moved[None], moved[:, None]])
        self._table = _table()

    def placed(self, q: FloatArray) -> tuple[Placements, FloatArray]:
        """The segments with points in (n, nq) postures, and the points (k, 3, n) from the root [m]."""
        placed = self._placements.of(q)
        turned = np.einsum("kijn,kj->kin", placed.turns[self._carriers], self._local)
        return placed, placed.shifts[self._carriers] + turned

    def assembled(
        self, columns: FloatArray, x: FloatArray, error: FloatArray, weights: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Half the gradient and the Gauss-Newton matrix of the weighted sum of squares.

        Velocities are those of the root, linear and angular in its own axes, and of the hinges that are
        :attr:`told`.

        Args:
            columns: (nv, 6, n), see :class:`manikin.mocap.segment_placements.Placements`.
            x: (k, 3, n) points from the root [m].
            error: (k, 3, n) of the points from their targets [m].
            weights: (k, n).

        Returns:
            (n, d) and (n, d, d), of which only the lower triangle is filled.
        """
        w, columns = weights[:, None], columns[self._velocities]
        wx, force = w * x, w * error
        squares, turning = ((one[:, :, None] * x[:, None]).reshape(len(x), 9, -1) for one in (wx, force))
        moments = np.concatenate([w, wx, squares, force, turning], axis=1)
        sums = (self._carried @ moments.reshape(len(x), -1)).reshape(-1, *moments.shape[1:])
        loads = (self._table @ sums).reshape(len(sums), 7, 6, -1)[self._load]
        gradient = np.einsum("din,din->nd", columns, loads[:, 6])
        pushed = np.einsum("dijn,djn->nid", loads[:, :6], columns).transpose(0, 2, 1)
        return gradient, (pushed @ np.ascontiguousarray(columns.transpose(2, 1, 0))) * self._coupled


def _table() -> FloatArray:
    """(42, 25) from ``w, w x, w x x^T, f, f x^T`` of a point to its inertia (6, 6), force and moment."""
    axes, inertia, force = np.eye(3), np.zeros((6, 6, 25)), np.zeros((6, 25))
    inertia[:3, :3, 0] = np.eye(3)
    for a in range(3):
        inertia[3:, :3, 1 + a], inertia[:3, 3:, 1 + a] = skew(axes[a]), -skew(axes[a])
        force[a, 13 + a] = 1.0
    for place, (a, b) in enumerate(product(range(3), range(3))):
        inertia[3:, 3:, 4 + place] = -skew(axes[a]) @ skew(axes[b])
        force[3:, 16 + place] = np.cross(axes[b], axes[a])
    return np.concatenate([inertia.reshape(36, 25), force])
