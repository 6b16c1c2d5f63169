"""A walk at one velocity from standing to standing: on a line, a circle, or on the spot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.numerics.signals import least_jerk
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.walking.gait.blend import travelled
from manikin.walking.path.walking_model import to_world
from manikin.walking.path.walking_path import SampledWalk


@dataclass(frozen=True, eq=False)
class SteadyWalk(SampledWalk):
    """One velocity that is held for some time, reached and left by least jerk.

    Attributes:
        held: (3,) velocity forward, left [m/s], angular [rad/s].
        hold: Time for which it is held [s].
        ramp: Time in which it is reached, and left again [s].
        start: (3,) x, y [m], heading [rad] at the beginning.
    """

    held: FloatArray
    hold: float
    ramp: float = 1.0
    start: FloatArray = (0.0, 0.0, 0.0)  # type: ignore[assignment]
    failure: str | None = None

    def __post_init__(self) -> None:
        held = frozen_array(self.held, "steady velocity [m/s, m/s, rad/s]", (3,))
        start = frozen_array(self.start, "start of a steady walk [m, m, rad]", (3,))
        finite_number(self.hold, "hold [s]", at_least=0.0)
        finite_number(self.ramp, "ramp [s]", above=0.0)
        vars(self).update(held=held, start=start)

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Duration from rest to rest [s]."""
        return self.hold + 2.0 * self.ramp

    def place_at(self, time: ArrayLike) -> FloatArray:
        """(..., 3) x, y [m] and heading [rad] at (...) instants [s]."""
        t = np.clip(np.asarray(time, dtype=np.float64), 0.0, self.duration)
        rises, falls = (np.clip(x / self.ramp, 0.0, 1.0) for x in (t, self.duration - t))
        # Integral of the least jerk share from 0: s^4 (2.5 - 3 s + s^2).
        up, down = (self.ramp * s**4 * (2.5 - 3.0 * s + s**2) for s in (rises, falls))
        middle = np.clip(t - self.ramp, 0.0, self.hold)
        passed = up + middle + np.where(t > self.ramp + self.hold, 0.5 * self.ramp - down, 0.0)
        return self.start + to_world(self.start[2], travelled(self.held, passed))

    def motion_at(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """(..., 3) velocities and (..., 3) accelerations of the body at (...) instants [s]."""
        t = np.clip(np.asarray(time, dtype=np.float64), 0.0, self.duration)
        rises, falls = (np.clip(x / self.ramp, 0.0, 1.0) for x in (t, self.duration - t))
        share, slope, _ = least_jerk(np.minimum(rises, falls))
        rate = np.where(rises < 1.0, slope, np.where(falls < 1.0, -slope, 0.0)) / self.ramp
        return share[..., None] * self.held, rate[..., None] * self.held
