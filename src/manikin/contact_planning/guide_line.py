"""A guide of the root by the length of its way."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from manikin.spatial import FloatArray, frozen_array

TURN_LENGTH = 0.35
"""Way that a turn by one radian counts as [m]: turning on the spot takes steps, too."""


@dataclass(frozen=True, eq=False)
class GuideLine:
    """Poses of the root with the length of the way to each.

    Attributes:
        poses: (n, 7) positions and quaternions xyzw.
        lengths: (n,) from the first one, with turns about the vertical counted [m].
    """

    poses: FloatArray
    lengths: FloatArray

    @classmethod
    def through(cls, poses: FloatArray) -> "GuideLine":
        """Line through (n, 7) poses that lie close together."""
        line = frozen_array(poses, "guide poses", (None, 7))
        headings = np.unwrap([heading_of(pose) for pose in line])
        way = np.linalg.norm(np.diff(line[:, :3], axis=0), axis=1) + TURN_LENGTH * np.abs(np.diff(headings))
        return cls(line, frozen_array(np.concatenate([[0.0], np.cumsum(way)]), "guide lengths"))

    @property
    def length(self) -> float:
        """Length of the whole way [m]."""
        return float(self.lengths[-1])

    def at(self, length: float) -> FloatArray:
        """(7,) pose after a length of the way [m], held between zero and all of it."""
        where = float(np.clip(length, 0.0, self.length))
        last = min(max(int(np.searchsorted(self.lengths, where)), 1), len(self.lengths) - 1)
        span = self.lengths[last] - self.lengths[last - 1]
        share = 1.0 if span <= 0.0 else (where - self.lengths[last - 1]) / span
        pair = self.poses[last - 1 : last + 1]
        turn = Slerp([0.0, 1.0], Rotation.from_quat(pair[:, 3:]))(share).as_quat()
        return np.concatenate([(1.0 - share) * pair[0, :3] + share * pair[1, :3], turn])


def heading_of(pose: FloatArray) -> float:
    """Heading of a (7,) pose: direction of its x axis seen from above [rad]."""
    forward = Rotation.from_quat(pose[3:]).as_matrix()[:, 0]
    return float(np.arctan2(forward[1], forward[0]))
