"""Where segments of a body are in many postures at once, and how its joints move them.

Instants are the last axis of every array here, so that one call of numpy runs over all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Placements:
    """Of s segments at n instants, in the axes of the world.

    Attributes:
        roots: (3, n) origins of the root [m].
        turns: (s, 3, 3, n) from the axes of each segment to the world's.
        shifts: (s, 3, n) origins of the segments, from that of the root [m].
        columns: (nv, 6, n) linear velocity at the root's origin and angular velocity of what each joint
            carries, when that joint moves at speed 1.
    """

    roots: FloatArray
    turns: FloatArray
    shifts: FloatArray
    columns: FloatArray


class SegmentPlacements:
    """Forward kinematics of some segments of a body."""

    def __init__(self, body: BodyModel, segments: Sequence[str]) -> None:
        """Prepare a body and the names of its segments."""
        self._model = body.pinocchio
        self._data = self._model.createData()
        data: Any = self._data
        frames = [data.oMf[body.segment_frame(name)] for name in segments]
        # Views of Pinocchio's memory: they follow whatever is computed in these data.
        self._turns, self._shifts = [each.rotation for each in frames], [each.translation for each in frames]

    def of(self, q: FloatArray) -> Placements:
        """Placements of (n, nq) postures."""
        n, count, model, data = len(q), len(self._turns), self._model, self._data
        turns, shifts = np.empty((n, count, 3, 3)), np.empty((n, count, 3))
        columns = np.empty((n, model.nv, 6))
        here = np.array(q)
        here[:, :3] = 0.0
        for frame, posture in enumerate(here):
            caused: Any = pin.computeJointJacobians(model, data, posture)
            pin.updateFramePlacements(model, data)
            turns[frame], shifts[frame], columns[frame] = self._turns, self._shifts, caused.T
        return Placements(
            q[:, :3].T,
            np.ascontiguousarray(turns.transpose(1, 2, 3, 0)),
            np.ascontiguousarray(shifts.transpose(1, 2, 0)),
            np.ascontiguousarray(columns.transpose(1, 2, 0)),
        )
