"""A path of one effector in configuration-time space: a polyline of timed poses."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.spatial import FloatArray, check_rotation, finite_number, frozen_array


class Pose(NamedTuple):
    """Placement of an effector frame in the world.

    Attributes:
        position: (3,) origin [m].
        rotation: (3, 3) effector-to-world rotation.
    """

    position: FloatArray
    rotation: FloatArray


def make_pose(position: ArrayLike, rotation: ArrayLike | None = None, name: str = "pose") -> Pose:
    """Check and freeze a pose; the identity rotation when omitted.

    Raises:
        InputError: If the position is not three finite numbers or the rotation is not one.
    """
    frame = np.eye(3) if rotation is None else rotation
    return Pose(
        frozen_array(position, f"{name} position [m]", (3,)), check_rotation(frame, f"{name} rotation")
    )


@dataclass(frozen=True)
class Metric:
    """Distance in configuration-time space ([Qiu2012]_ 6.6, with R(theta_1, theta_2)).

    ``d^2 = |p1 - p2|^2 + lambda1 |log R12|^2 + lambda2 (t1 - t2)^2``.  The values of the
    weights are not published; the defaults make 1 rad worth 0.3 m and 1 s worth 1 m.

    Attributes:
        rotation_weight: lambda1 [m^2/rad^2].
        time_weight: lambda2 [m^2/s^2].
    """

    rotation_weight: float = 0.09
    time_weight: float = 1.0

    def __post_init__(self) -> None:
        finite_number(self.rotation_weight, "metric rotation_weight", at_least=0.0)
        finite_number(self.time_weight, "metric time_weight", at_least=0.0)

    def combine(self, translation: ArrayLike, rotation: ArrayLike, time: ArrayLike) -> FloatArray:
        """Distance from its three parts [m, rad, s], elementwise."""
        return np.sqrt(
            np.square(translation)
            + self.rotation_weight * np.square(rotation)
            + self.time_weight * np.square(time)
        )


@dataclass(frozen=True, eq=False)
class EffectorPath:
    """Timed poses joined by straight lines and shortest rotations.

    Attributes:
        time: (n,) strictly increasing [s], n >= 2.
        position: (n, 3) [m].
        rotation: (n, 3, 3) effector-to-world.
    """

    time: FloatArray
    position: FloatArray
    rotation: FloatArray

    def __init__(self, time: ArrayLike, position: ArrayLike, rotation: ArrayLike | None = None) -> None:
        times = frozen_array(time, "path time [s]", (None,))
        n = len(times)
        if n < 2 or not np.all(np.diff(times) > 0):
            raise InputError(f"path time is {times.tolist()}; valid: two or more increasing instants")
        frames = np.broadcast_to(np.eye(3), (n, 3, 3)) if rotation is None else rotation
        object.__setattr__(self, "time", times)
        object.__setattr__(self, "position", frozen_array(position, "path position [m]", (n, 3)))
        object.__setattr__(self, "rotation", frozen_array(frames, "path rotation", (n, 3, 3)))

    def __len__(self) -> int:
        return len(self.time)

    @property
    def duration(self) -> float:
        """Time from the first to the last node [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def turns(self) -> FloatArray:
        """(n-1, 3) rotation vectors between neighbouring nodes, in the frame of the earlier one [rad]."""
        relative = np.swapaxes(self.rotation[:-1], 1, 2) @ self.rotation[1:]
        return Rotation.from_matrix(relative).as_rotvec()

    @property
    def speeds(self) -> FloatArray:
        """(n-1,) average speed of each segment [m/s] ([Qiu2012]_ 6.7)."""
        return np.linalg.norm(np.diff(self.position, axis=0), axis=1) / np.diff(self.time)

    @property
    def angular_speeds(self) -> FloatArray:
        """(n-1,) average angular speed of each segment [rad/s] ([Qiu2012]_ 6.8)."""
        return np.linalg.norm(self.turns, axis=1) / np.diff(self.time)

    def length(self, metric: Metric) -> float:
        """Sum of the metric lengths of the segments."""
        steps = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return float(metric.combine(steps, np.linalg.norm(self.turns, axis=1), np.diff(self.time)).sum())

    def sample(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Positions (k, 3) and rotations (k, 3, 3) at the given times; held constant outside."""
        times = np.clip(np.atleast_1d(np.asarray(time, dtype=np.float64)), self.time[0], self.time[-1])
        index = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, len(self) - 2)
        share = ((times - self.time[index]) / np.diff(self.time)[index])[:, None]
        position = (1.0 - share) * self.position[index] + share * self.position[index + 1]
        rotation = self.rotation[index] @ Rotation.from_rotvec(share * self.turns[index]).as_matrix()
        return position, rotation

    def at(self, time: float) -> Pose:
        """Pose at one time [s]."""
        position, rotation = self.sample(time)
        return Pose(position[0], rotation[0])
