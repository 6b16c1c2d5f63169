"""Treadmills: the velocity of the belt by the feet, and a recording seen from the belt.

A foot that carries moves with the belt. Seen from a belt of constant speed, a walk on a treadmill is a walk
over the ground: the laws of mechanics are the same there. So postures and forces are moved along with the
belt, and everything that measures walks measures them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manikin.numerics.spatial import FloatArray, cross
from manikin.recordings.readers.markers import ForcePlate
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.support_levels import track
from manikin.recordings.supports.supports import sole_points

LOW, LOWEST = 0.02, 0.05
"""Height above its own lowest heights up to which a heel or toes may carry [m], and share of them."""

ALIKE = 0.3
"""Difference between the velocities of carrying feet [m/s]."""

SLOWEST_BELT, STAYS = 0.3, 0.25
"""Speed below which a belt is none [m/s], and speed of the pelvis per that of the belt up to which the person
stays on it."""

CUTOFF, MOST_SAMPLES = 12.0, 1500
"""Low-pass of the places of heels and toes [Hz], and velocities that are compared with each other."""


def belt_velocity(found: Reconstruction) -> FloatArray | None:
    """(2,) horizontal velocity of the belt under a person in world x and y [m/s]; None without one.

    Low heels and toes have the velocity of what they are on more often than any other. It is taken for a
    belt's if the pelvis does not go along.
    """
    velocities = []
    for ends in sole_points(found).values():
        for end in ends:
            path = track(end, found.rate, min(CUTOFF, 0.4 * found.rate)).positions
            low = path[:, 2] < np.quantile(path[:, 2], LOWEST) + LOW
            velocities.append(np.gradient(path[:, :2], 1.0 / found.rate, axis=0)[low])
    every = np.vstack(velocities)
    every = every[:: max(len(every) // MOST_SAMPLES, 1)]
    near = np.linalg.norm(every[:, None] - every, axis=2) < ALIKE
    common = every[near[np.argmax(near.sum(axis=1))]]
    velocity = np.median(common, axis=0)
    speed = float(np.linalg.norm(velocity))
    way = (found.q[-1, :2] - found.q[0, :2]) / (found.time[-1] - found.time[0])
    stays = float(np.linalg.norm(way)) < STAYS * speed
    return velocity if speed > SLOWEST_BELT and stays else None


def from_the_belt(found: Reconstruction, velocity: FloatArray) -> Reconstruction:
    """The same motion seen from a belt of a velocity (2,) [m/s]; both agree in the first frame."""
    way = -velocity * (found.time - found.time[0])[:, None]
    q, positions = np.array(found.q), np.array(found.targets.positions)
    q[:, :2] += way
    positions[..., :2] += way[:, None]
    return replace(found, q=q, targets=replace(found.targets, positions=positions))


def plates_from_the_belt(
    plates: Sequence[ForcePlate], velocity: FloatArray, start: float
) -> tuple[ForcePlate, ...]:
    """Plates under a belt, seen from it, at one place with it at the instant ``start`` [s].

    They move along, so that their corners are not known.
    """
    moved = []
    for plate in plates:
        way = np.zeros((len(plate), 3))
        way[:, :2] = -velocity * (plate.time - start)[:, None]
        wrenches = np.array(plate.wrenches)
        wrenches[:, 3:] += cross(way, wrenches[:, :3])
        moved.append(replace(plate, wrenches=wrenches, corners=None))
    return tuple(moved)
