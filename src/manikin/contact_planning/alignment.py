"""Bringing effectors exactly onto surfaces: inverse kinematics of a limb ([Tonneau2015]_ 5.3.2)."""

from dataclasses import dataclass

import numpy as np

from manikin.body import EffectorPlacements, LimbKinematics
from manikin.spatial import FloatArray

POSITION_TOLERANCE = 1e-5
"""How far the effector may be from the surface point [m]."""
TILT_TOLERANCE = 1e-4
"""Angle between the effector's z axis and the normal that counts as aligned [rad]."""
STEPS = 7
"""Steps for position and normal, and again for the position alone."""
_STALLED = 0.9  # a row that comes no nearer than this share of its distance is left alone
_DAMPING = 1e-3
_LARGEST_STEP = 0.4  # [rad]
_LEVER = 0.3  # [m], what one radian of tilt weighs beside one metre


@dataclass(frozen=True, eq=False)
class Alignment:
    """Limbs put onto points, one row each.

    Attributes:
        angles: (n, k) [rad], within the joint ranges.
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
        error: (n,) distance of the effector to its point [m].
        tilt: (n,) angle between the effector's z axis and the normal [rad].
    """

    angles: FloatArray
    rotations: FloatArray
    error: FloatArray
    tilt: FloatArray


def align(
    chain: LimbKinematics,
    angles: FloatArray,
    points: FloatArray,
    normals: FloatArray,
    max_tilt: float = TILT_TOLERANCE,
) -> Alignment:
    """Move effectors to points, their z axes along normals, by damped least squares within the joint ranges.

    All rows are moved at once. Where a tilt is allowed, the position comes first: rows that are not
    upright after some steps make the last ones for the position alone. Joints at the end of their
    range that would leave it are held there.

    Args:
        chain: The limb.
        angles: (n, k) to begin with [rad].
        points: (n, 3) in the limb's frame [m].
        normals: (n, 3) unit vectors in the limb's frame.
        max_tilt: Angle between z axis and normal that the caller will accept [rad].
    """
    q = _descend(chain, np.array(angles), points, normals, level=True)
    found = _measured(chain, q, points, normals)
    rest = np.flatnonzero(found.error > POSITION_TOLERANCE)
    if max_tilt <= TILT_TOLERANCE or not len(rest):
        return found
    q[rest] = _descend(chain, q[rest], points[rest], normals[rest], level=False)
    return _measured(chain, q, points, normals)


def _descend(
    chain: LimbKinematics, q: FloatArray, points: FloatArray, normals: FloatArray, *, level: bool
) -> FloatArray:
    """Angles after several steps, until every row has arrived or gets no nearer."""
    last = np.full(len(q), np.inf)
    resting = np.zeros(len(q), dtype=bool)
    for _ in range(STEPS):
        placed = chain.place(q)
        missing = _missing(placed, points, normals)
        error, tilt = _length(missing[:, :3]), _length(missing[:, 3:])
        left = error + _LEVER * tilt if level else error
        resting |= (left > _STALLED * last) | (
            (error <= POSITION_TOLERANCE) & ((tilt <= TILT_TOLERANCE) | (not level))
        )
        if resting.all():
            break
        last = left
        jacobian = placed.jacobians
        if level:
            jacobian = np.concatenate([jacobian, _LEVER * _across(placed)], axis=1)
            missing[:, 3:] *= _LEVER
        missing[resting] = 0.0
        q = _moved(chain, q, jacobian, missing[:, : jacobian.shape[1]])
    return q


def _measured(chain: LimbKinematics, q: FloatArray, points: FloatArray, normals: FloatArray) -> Alignment:
    placed = chain.place(q)
    missing = _missing(placed, points, normals)
    return Alignment(q, placed.rotations, _length(missing[:, :3]), _length(missing[:, 3:]))


def _missing(placed: EffectorPlacements, points: FloatArray, normals: FloatArray) -> FloatArray:
    """(n, 6) what is missing in position [m] and, as a rotation vector, in tilt [rad]."""
    z = placed.rotations[:, :, 2]
    out = np.empty((len(z), 6))
    out[:, :3] = points - placed.positions
    turn = out[:, 3:]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turn[:, i] = z[:, j] * normals[:, k] - z[:, k] * normals[:, j]
    sine = _length(turn)
    angle = np.arctan2(sine, np.einsum("ni,ni->n", z, normals))
    # At half a turn every axis across does, and the effector's x axis is one.
    opposite = (sine < 1e-9) & (angle > 1.0)
    if opposite.any():
        turn[opposite], sine[opposite] = placed.rotations[opposite, :, 0], 1.0
    turn *= (angle / np.maximum(sine, 1e-12))[:, None]
    return out


def _across(placed: EffectorPlacements) -> FloatArray:
    """(n, 3, k) angular velocity of the effector without its part about its own z axis."""
    z = placed.rotations[:, :, 2]
    return placed.axes - z[:, :, None] * (z[:, None] @ placed.axes)


def _moved(chain: LimbKinematics, q: FloatArray, jacobian: FloatArray, missing: FloatArray) -> FloatArray:
    """Angles after one damped step."""
    pull = (missing[:, None] @ jacobian)[:, 0]
    held = ((q <= chain.lower) & (pull < 0.0)) | ((q >= chain.upper) & (pull > 0.0))
    free = jacobian * ~held[:, None]
    turned = free.transpose(0, 2, 1)
    square = free @ turned + _DAMPING**2 * np.eye(free.shape[1])
    move = (turned @ np.linalg.solve(square, missing[..., None]))[..., 0]
    return np.clip(q + np.clip(move, -_LARGEST_STEP, _LARGEST_STEP), chain.lower, chain.upper)


def _length(vectors: FloatArray) -> FloatArray:
    """(n,) lengths of (n, 3), quicker than ``np.linalg.norm`` for few."""
    return np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
