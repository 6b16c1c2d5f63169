"""The way of a foot that steps: polynomials from where it is to a goal that may still move."""

from dataclasses import dataclass

import numpy as np

from manikin.control.reference import EffectorReference
from manikin.spatial import FloatArray

PRESSING = 0.15
"""Speed with which a foot that has come to its goal without touching goes on down [m/s]."""


@dataclass
class SwingFoot:
    """A foot on its way; its goal can be moved while it flies.

    Attributes:
        foot: Effector.
        rotation: (3, 3) sole to world, kept all the way.
        start: Time of the lift-off [s].
        duration: Until the landing [s].
        goal: (3,) of the middle of the sole on landing [m].
        clearance: Height half way [m].
    """

    foot: str
    rotation: FloatArray
    start: float
    duration: float
    goal: FloatArray
    clearance: float
    _time: float
    _level: FloatArray
    """(3, 2) position, velocity and acceleration along the ground at ``_time``."""
    _ground: float

    @classmethod
    def begin(
        cls, foot: str, rotation: FloatArray, position: FloatArray, goal: FloatArray, start: float,
        duration: float, clearance: float,
    ) -> "SwingFoot":  # fmt: skip
        """Lift a foot off at a position (3,) [m]."""
        level = np.zeros((3, 2))
        level[0] = position[:2]
        return cls(foot, rotation, start, duration, goal.copy(), clearance, start, level, float(position[2]))

    def share(self, time: float) -> float:
        """Share of the way in time, in [0, 1]."""
        return float(np.clip((time - self.start) / self.duration, 0.0, 1.0))

    def sample(self, time: float) -> EffectorReference:
        """Go on to a time [s], not before the last one, and return where the foot should be."""
        self._level = _ahead(
            self._level, self.goal[:2], self.start + self.duration - self._time, time - self._time
        )
        self._time = time
        height, climb, lift = self._height(time)
        twist, acceleration = np.zeros(6), np.zeros(6)
        twist[:3], acceleration[:3] = [*self._level[1], climb], [*self._level[2], lift]
        return EffectorReference(self.rotation, np.array([*self._level[0], height]), twist, acceleration)

    def _height(self, time: float) -> tuple[float, float, float]:
        """Height [m] and its two derivatives: up and down with a level start, end and top."""
        end = self.start + self.duration
        if time >= end:
            return self.goal[2] - PRESSING * (time - end), -PRESSING, 0.0
        x = self.share(time)
        bump, slope, bend = (
            16.0 * x**2 * (1.0 - x) ** 2,
            32.0 * x * (1.0 - x) * (1.0 - 2.0 * x),
            32.0 * (1.0 - 6.0 * x + 6.0 * x**2),
        )
        rise = self.goal[2] - self._ground
        ramp = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        ramp_slope, ramp_bend = 30.0 * x**2 * (1.0 - x) ** 2, 60.0 * x * (1.0 - 3.0 * x + 2.0 * x**2)
        return (
            self._ground + self.clearance * bump + rise * ramp,
            (self.clearance * slope + rise * ramp_slope) / self.duration,
            (self.clearance * bend + rise * ramp_bend) / self.duration**2,
        )


def _ahead(state: FloatArray, goal: FloatArray, remaining: float, time: float) -> FloatArray:
    """State (3, 2) after a time on the fifth-degree polynomial that comes to rest at a goal.

    Args:
        state: Position, velocity and acceleration.
        goal: (2,) [m].
        remaining: Time to the goal [s].
        time: Time to go on [s].
    """
    if remaining <= time + 1e-9:
        return np.array([goal, np.zeros(2), np.zeros(2)])
    position, velocity, acceleration = state
    t = remaining
    missing = goal - position - velocity * t - 0.5 * acceleration * t**2
    known = np.array([missing, -velocity - acceleration * t, -acceleration])
    powers = np.array([[t**3, t**4, t**5], [3 * t**2, 4 * t**3, 5 * t**4], [6 * t, 12 * t**2, 20 * t**3]])
    third, fourth, fifth = np.linalg.solve(powers, known)
    x = time
    return np.array([
        position + velocity * x + 0.5 * acceleration * x**2 + third * x**3 + fourth * x**4 + fifth * x**5,
        velocity + acceleration * x + 3 * third * x**2 + 4 * fourth * x**3 + 5 * fifth * x**4,
        acceleration + 6 * third * x + 12 * fourth * x**2 + 20 * fifth * x**3,
    ])  # fmt: skip
