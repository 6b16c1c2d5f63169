"""Where the two shoulders of a walker go over the floor: the body's heading and each shoulder's direction."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.locomotion.path import WalkingPath
from manikin.low_pass import SHARES, low_passed
from manikin.mocap.anatomy import SIDES, segment_joint
from manikin.mocap.recording import Recording
from manikin.spatial import FloatArray, finite_number, frozen_array

BREADTH = 0.36
"""Between the shoulder joints of a walker who has a path only [m]."""

STILL = 1e-9
"""Speed below which nothing is said about a direction [m/s]."""

LEAST_DISTANCE = 1e-3
"""Between the shoulders, seen from above; below it the body has no heading [m]."""


@dataclass(frozen=True, eq=False)
class ShoulderPaths:
    """Both shoulders on the ground plane, at an even rate; in the world, y is to the left of x.

    Attributes:
        left: (n, 2) left shoulder [m].
        right: (n, 2) right shoulder [m].
        rate: Frames per second [Hz].

    Raises:
        InputError: If there are fewer than three frames, the paths differ in length, or the shoulders meet.
    """

    left: FloatArray
    right: FloatArray
    rate: float

    def __post_init__(self) -> None:
        finite_number(self.rate, "shoulder paths rate [Hz]", above=0.0)
        left = frozen_array(self.left, "left shoulder [m]", (None, 2))
        right = frozen_array(self.right, "right shoulder [m]", (len(left), 2))
        if len(left) < 3:
            raise InputError(f"shoulder paths have {len(left)} frames; valid: at least 3")
        close = np.flatnonzero(np.hypot(*(left - right).T) < LEAST_DISTANCE)
        if close.size:
            raise InputError(
                f"shoulders meet at frame {close[0]}; "
                f"valid: at least {LEAST_DISTANCE} m apart, seen from above"
            )
        object.__setattr__(self, "left", left)
        object.__setattr__(self, "right", right)

    @classmethod
    def of_recording(cls, recording: Recording) -> Self:
        """Joints of the upper arms of a recorded person.

        Raises:
            InputError: If the recording has no such joints, or fewer than three frames.
        """
        left, right = (
            recording.positions[:, segment_joint(recording, f"{side}_upper_arm"), :2] for side in SIDES
        )
        return cls(left, right, recording.rate)

    @classmethod
    def of_walk(cls, path: WalkingPath, breadth: float = BREADTH) -> Self:
        """Shoulders on the left and on the right of a path.

        Args:
            path: A walk.
            breadth: Between the shoulders [m].

        Raises:
            InputError: If the breadth is not positive.
        """
        return cls.of_places(path.place, (len(path.time) - 1) / path.duration, breadth)

    @classmethod
    def of_places(cls, place: ArrayLike, rate: float, breadth: float = BREADTH) -> Self:
        """Shoulders on the left and on the right of places.

        Args:
            place: (n, 3) x, y [m], heading [rad].
            rate: Places per second [Hz].
            breadth: Between the shoulders [m].

        Raises:
            InputError: If the breadth is not positive, or there are fewer than three places.
        """
        half = finite_number(breadth, "breadth of the shoulders [m]", at_least=LEAST_DISTANCE) / 2
        places = frozen_array(place, "places [m, m, rad]", (None, 3))
        left = half * np.column_stack([-np.sin(places[:, 2]), np.cos(places[:, 2])])
        return cls(places[:, :2] + left, places[:, :2] - left, rate)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.left)

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants, 0 at the first frame [s]."""
        return frozen_array(np.arange(len(self)) / self.rate, "time")

    @cached_property
    def middle(self) -> FloatArray:
        """(n, 2) midpoint of the shoulders [m] ([Truong2010]_ 4.4 and 4.5)."""
        return frozen_array((self.left + self.right) / 2, "middle of the shoulders")

    @cached_property
    def heading(self) -> FloatArray:
        """(n,) direction in which the body looks, continuous [rad] ([Truong2010]_ 4.2 and 4.3)."""
        return frozen_array(np.unwrap(heading_of(self.points)), "heading")

    @property
    def points(self) -> FloatArray:
        """(n, 2, 2) left and right shoulder [m]."""
        return np.stack([self.left, self.right], axis=1)

    def velocities(self, frames: int = 1) -> FloatArray:
        """(n, 2, 2) of the left and the right shoulder, by central differences [m/s] ([Truong2010]_ 4.6).

        Args:
            frames: From a frame to either neighbour. Near the ends the missing neighbour is the end itself.
        """
        index = np.arange(len(self))
        before, after = np.maximum(index - frames, 0), np.minimum(index + frames, len(self) - 1)
        return (self.points[after] - self.points[before]) * (self.rate / (after - before))[:, None, None]

    def low_passed(self, cutoff: float) -> "ShoulderPaths":
        """The same without fast changes: Butterworth of second order, forward and backward.

        [Truong2010]_ 4.3.4 filters with a "normalized cutoff frequency 0.5 Hz"; read as a share of the
        Nyquist frequency, 25 Hz at its 100 Hz. The order is not given there.

        Args:
            cutoff: As a share of half the rate, between 0 and 1 [-].
        """
        padding = max(9, int(np.ceil(2.0 / cutoff)))
        left, right = (low_passed(path, cutoff, SHARES, padding) for path in (self.left, self.right))
        return ShoulderPaths(left, right, self.rate)


def heading_of(points: FloatArray) -> FloatArray:
    """(...) direction square to the line of the (..., 2, 2) shoulders, forward, in (-pi/2, 3 pi/2] [rad].

    [Truong2010]_ 4.2 and 4.3, with the arctangent of two arguments that the print leaves out.
    """
    across = points[..., 1, :] - points[..., 0, :]
    return np.arctan2(across[..., 1], across[..., 0]) + np.pi / 2


def deviations(points: FloatArray, velocities: FloatArray) -> FloatArray:
    """(..., 2) body heading less direction of each shoulder's motion, within pi of zero [rad]; NaN at rest.

    Args:
        points: (..., 2, 2) left and right shoulder [m].
        velocities: (..., 2, 2) of both [m/s].
    """
    tangent = np.arctan2(velocities[..., 1], velocities[..., 0])
    difference = heading_of(points)[..., None] - tangent
    wrapped = np.arctan2(np.sin(difference), np.cos(difference))
    return np.where(np.hypot(velocities[..., 0], velocities[..., 1]) > STILL, wrapped, np.nan)
