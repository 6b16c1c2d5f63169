"""The line or circle that a walker's root follows over one cycle, and what is left: a periodic error."""

from dataclasses import dataclass

import numpy as np

from manikin.spatial import FloatArray, rotation_from_yaw

STRAIGHT = 1e-6
"""Turn [rad] below which a circle is a line."""


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """Constant forward, left and angular velocity, around which a root oscillates.

    Attributes:
        velocity: (3,) forward, left [m/s], angular [rad/s].
        start: (3,) x, y [m], heading [rad] at the cycle's begin.
        error: (n, 3) ahead, to the left [m] and in yaw [rad], in the axes of the moving heading; of zero
            mean and, at the end of the cycle, as at its begin.
    """

    velocity: FloatArray
    start: FloatArray
    error: FloatArray


def travelled(velocity: FloatArray, time: FloatArray) -> FloatArray:
    """(..., 3) x, y, heading reached from the origin with constant velocities after times.

    Args:
        velocity: (..., 3) forward, left [m/s], angular [rad/s].
        time: (...) [s].
    """
    turn = velocity[..., 2] * time
    # sin(a)/a and (1 - cos a)/a, as series where a is small.
    small = np.abs(turn) < STRAIGHT
    safe = np.where(small, 1.0, turn)
    along = np.where(small, 1.0 - turn**2 / 6.0, np.sin(turn) / safe)
    aside = np.where(small, 0.5 * turn, (1.0 - np.cos(turn)) / safe)
    forward, left = velocity[..., 0] * time, velocity[..., 1] * time
    return np.stack([along * forward - aside * left, aside * forward + along * left, turn], axis=-1)


def steady_motion(place: FloatArray, period: float) -> SteadyMotion:
    """Line or circle of one cycle ([Truong2010]_ 6.4.3) together with the periodic error around it (6.4.4).

    Least squares on the place alone would take a part of the oscillation for velocity: a sine of
    amplitude A over one period T has the slope ``6 A / (pi T)``, some 3 % of a walk's speed. Asked instead is
    that the error have no mean and be the same at both ends: four linear equations for start and velocity.

    Args:
        place: (n, 3) x, y [m], heading [rad] at even instants from begin to end of the cycle, both included.
        period: Of the cycle [s].
    """
    share = np.linspace(0.0, 1.0, len(place))
    mean = np.full(len(place), 1.0 / (len(place) - 1))
    mean[[0, -1]] *= 0.5
    turn = place[-1, 2] - place[0, 2]
    start = float(mean @ (place[:, 2] - turn * share))
    heading = start + turn * share
    back = rotation_from_yaw(0.0)[None, :2, :2] * np.cos(heading)[:, None, None]
    back = back + np.array([[0.0, 1.0], [-1.0, 0.0]]) * np.sin(heading)[:, None, None]
    # Places reached per unit of forward and of left velocity, from the start and its heading.
    units = [np.array([*unit, turn / period]) for unit in ((1.0, 0.0), (0.0, 1.0))]
    reached = np.stack([travelled(unit, period * share)[:, :2] for unit in units], axis=-1)
    reached = rotation_from_yaw(start)[:2, :2] @ reached
    local = np.einsum("nij,nj->ni", back, place[:, :2])
    moved = back @ reached
    system = np.block([
        [np.einsum("n,nij->ij", mean, back), np.einsum("n,nij->ij", mean, moved)],
        [back[-1] - back[0], moved[-1] - moved[0]],
    ])  # fmt: skip
    wanted = np.concatenate([mean @ local, local[-1] - local[0]])
    solution = np.linalg.solve(system, wanted)
    error = local - back @ solution[:2] - moved @ solution[2:]
    return SteadyMotion(
        velocity=np.array([solution[2], solution[3], turn / period]),
        start=np.array([solution[0], solution[1], start]),
        error=np.column_stack([error, place[:, 2] - heading]),
    )
