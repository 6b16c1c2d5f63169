"""Poses of the root: seven numbers each, their distance and the straight way between two.

A pose is ``[position (3), quaternion xyzw (4)]``, the first seven entries of a body's configuration. The
three Euler angles of [Tonneau2015]_ are singular for a trunk that lies horizontally.
"""

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, check_rotation, frozen_array

_NEARLY_ALIGNED = 1.0 - 1e-12  # cosine above which the two quaternions are blended linearly


def root_pose(position: ArrayLike, rotation: ArrayLike | None = None) -> FloatArray:
    """Make a pose (7,) of a position in the world (3,) [m] and a rotation root-to-world (3, 3), or upright.

    Raises:
        InputError: If a part is not finite or not a rotation.
    """
    place = frozen_array(position, "root position [m]", (3,))
    turn = np.eye(3) if rotation is None else check_rotation(rotation, "root rotation")
    return frozen_array(np.concatenate([place, Rotation.from_matrix(turn).as_quat()]), "root pose", (7,))


def checked_pose(pose: ArrayLike, name: str) -> FloatArray:
    """Copy a pose (7,), its quaternion made unit.

    Raises:
        InputError: If it is not seven finite numbers, or the quaternion is not near unit length.
    """
    values = np.array(frozen_array(pose, name, (7,)))
    length = float(np.linalg.norm(values[3:]))
    if abs(length - 1.0) > 1e-3:
        raise InputError(f"{name} has a quaternion of length {length:g}; valid: a unit quaternion xyzw")
    values[3:] /= length
    return frozen_array(values, name, (7,))


def angles_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angle of the shortest turn between poses (..., 7) and (..., 7) [rad]."""
    dot = np.abs(np.sum(first[..., 3:] * second[..., 3:], axis=-1))
    return 2.0 * np.arccos(np.minimum(dot, 1.0))


def distance(first: FloatArray, second: FloatArray, share: float = 0.5) -> FloatArray:
    """Scaled Euclidean distance ``sqrt(s |dp|^2 + (1 - s) angle^2)`` ([Tonneau2015]_ 6.3).

    The print has ``|d|`` in place of the squares, unlike its text. It is a metric, so A* with it as estimate
    finds shortest paths. Poses are (..., 7), and the share s in [0, 1] is the weight of the positions.
    """
    way = np.sum((first[..., :3] - second[..., :3]) ** 2, axis=-1)
    return np.sqrt(share * way + (1.0 - share) * angles_between(first, second) ** 2)


def between(first: FloatArray, second: FloatArray, shares: FloatArray) -> FloatArray:
    """Poses (n, 7) at (n,) shares in [0, 1] of the straight way from one pose (7,) to another."""
    t, start, end = shares[:, None], first[3:], second[3:]
    cosine = float(start @ end)
    if cosine < 0.0:
        end, cosine = -end, -cosine
    if cosine > _NEARLY_ALIGNED:
        blend = (1.0 - t) * start + t * end
    else:
        angle = np.arccos(cosine)
        blend = (np.sin((1.0 - t) * angle) * start + np.sin(t * angle) * end) / np.sin(angle)
    turned = blend / np.linalg.norm(blend, axis=1, keepdims=True)
    return np.hstack([(1.0 - t) * first[:3] + t * second[:3], turned])


def tilt(pose: FloatArray) -> float:
    """Angle between the root's z axis and the vertical, of a pose (7,) [rad]."""
    x, y = float(pose[3]), float(pose[4])
    return math.acos(min(1.0, max(-1.0, 1.0 - 2.0 * (x * x + y * y))))
