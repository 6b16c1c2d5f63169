"""Turning on the spot: what the criterion gives where the goal is where the walker stands."""

import numpy as np

from manikin.locomotion.path import WalkingPath, WalkingTask
from manikin.spatial import FloatArray
from manikin.spline import BSpline

SMALLEST = 1e-6
"""Turns by less are none [rad]."""


def spot_turn(task: WalkingTask) -> WalkingPath:
    """Turn from rest to rest, the shorter way round.

    Without a way to go the criterion ([Truong2010]_ 5.6) is ``a0 T + a3 int u_angular^2``. The cheapest turn
    by ``D`` in the time ``T`` is the cubic ``D (3 s^2 - 2 s^3)``, for ``12 D^2 / T^3``, so that ``T^4 = 36 a3
    D^2 / a0``. Obstacles are not looked at.

    Args:
        task: Its goal is where it starts, but for the heading.
    """
    turn = float(np.angle(np.exp(1j * (task.goal[2] - task.start[2]))))
    weights = task.objective
    duration = (36.0 * weights.angular * max(abs(turn), SMALLEST) ** 2 / weights.time) ** 0.25
    cost = weights.time * duration + weights.angular * 12.0 * turn**2 / duration**3
    return WalkingPath(task, _cubic(task.start, turn), duration, cost, "turn on the spot", 0)


def _cubic(start: FloatArray, turn: float) -> BSpline:
    """x, y and heading over the share of the duration, as a single piece of third degree."""
    points = np.tile(start, (4, 1))
    points[2:, 2] += turn
    return BSpline(3, np.repeat([0.0, 1.0], 4), points)
