"""Three hinges through one point as a ball joint: rotations to angles."""

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import BodyError
from manikin.spatial import FloatArray


def ball_rotation(axes: ArrayLike, angles: ArrayLike) -> FloatArray:
    """Rotation of a segment to its parent: the product of its hinges, the first leftmost.

    Args:
        axes: (3, 3) unit axes, one a row.
        angles: (..., 3) [rad].

    Returns:
        (..., 3, 3).
    """
    q = np.asarray(angles, dtype=np.float64)
    total = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
    for number, (x, y, z) in enumerate(np.asarray(axes, dtype=np.float64)):
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        sine, cosine = np.sin(q[..., number])[..., None, None], np.cos(q[..., number])[..., None, None]
        total = total @ (np.eye(3) + sine * cross + (1.0 - cosine) * cross @ cross)
    return np.array(total)


def ball_angles(axes: ArrayLike, rotations: ArrayLike, middle: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Angles of three hinges that give rotations; the inverse of :func:`ball_rotation`.

    The second angle is within 90 degrees of 0. At its ends only the sum or the difference of the
    others is defined, and nearby they are sensitive.

    Args:
        axes: (3, 3) unit axes, one a row, each perpendicular to the next.
        rotations: (..., 3, 3).
        middle: (3,) the first and the third angle are within half a turn of these [rad].

    Returns:
        (..., 3) [rad].

    Raises:
        BodyError: If the axes are not perpendicular.
    """
    first, second, third = np.asarray(axes, dtype=np.float64)
    basis = np.column_stack([first, second, np.cross(first, second)])
    sign = float(third @ basis[:, 2])
    if abs(first @ second) > 1e-9 or abs(abs(sign) - 1.0) > 1e-9:
        raise BodyError("hinges of a ball joint are oblique; valid: three perpendicular unit axes")
    turn = basis.T @ np.asarray(rotations, dtype=np.float64) @ basis
    angles = np.stack([
        np.arctan2(-turn[..., 1, 2], turn[..., 2, 2]),
        np.arcsin(np.clip(turn[..., 0, 2], -1.0, 1.0)),
        sign * np.arctan2(-turn[..., 0, 1], turn[..., 0, 0]),
    ], axis=-1)  # fmt: skip
    centre = np.asarray(middle, dtype=np.float64)
    return centre + (angles - centre + np.pi) % (2.0 * np.pi) - np.pi
