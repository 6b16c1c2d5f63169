"""Bringing effectors exactly onto surfaces: inverse kinematics of a limb ([Tonneau2015]_ 5.3.2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.body import EffectorPlacements, LimbKinematics
from manikin.spatial import FloatArray

POSITION_TOLERANCE = 1e-5
"""How far the effector may be from the surface point [m]."""
TILT_TOLERANCE = 1e-4
"""Angle between the effector's z axis and the normal that counts as aligned [rad]."""
STEPS = 8
"""Steps for position and normal, and at most as many again for the position alone."""
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


def align(chain: LimbKinematics, angles: FloatArray, points: FloatArray, normals: FloatArray) -> Alignment:
    """Move effectors to points, their z axes along normals, by damped least squares within the joint ranges.

    All rows are moved at once. The position comes first, the normal second: where both cannot be had, the
    last steps are those of the position alone. Joints at the end of their range that would leave
    it are held there.

    Args:
        chain: The limb.
        angles: (n, k) to begin with [rad].
        points: (n, 3) in the limb's frame [m].
        normals: (n, 3) unit vectors in the limb's frame.
    """
    q = np.array(angles)
    for step in range(2 * STEPS):
        placed = chain.place(q)
        missing = _missing(placed, points, normals)
        error, tilt = (np.linalg.norm(part, axis=1) for part in (missing[:, :3], missing[:, 3:]))
        level = (tilt <= TILT_TOLERANCE) | (step >= STEPS)
        if ((error <= POSITION_TOLERANCE) & level).all():
            break
        moving = np.flatnonzero((error > POSITION_TOLERANCE) | ~level)
        if step >= STEPS:
            missing[:, 3:] = 0.0
        q[moving] = _step(chain, q[moving], placed, moving, missing[moving], step < STEPS)
    placed = chain.place(q)
    missing = _missing(placed, points, normals)
    error, tilt = (np.linalg.norm(part, axis=1) for part in (missing[:, :3], missing[:, 3:]))
    return Alignment(q, placed.rotations, error, tilt)


def _missing(placed: EffectorPlacements, points: FloatArray, normals: FloatArray) -> FloatArray:
    """(n, 6) what is missing in position [m] and, as a rotation vector, in tilt [rad]."""
    z = placed.rotations[:, :, 2]
    turn = np.empty_like(z)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turn[:, i] = z[:, j] * normals[:, k] - z[:, k] * normals[:, j]
    sine = np.linalg.norm(turn, axis=1)
    angle = np.arctan2(sine, np.einsum("ni,ni->n", z, normals))
    # At half a turn every axis across does, and the effector's x axis is one.
    opposite = (sine < 1e-9) & (angle > 1.0)
    turn[opposite], sine[opposite] = placed.rotations[opposite, :, 0], 1.0
    turn *= (angle / np.maximum(sine, 1e-12))[:, None]
    return np.hstack([points - placed.positions, turn])


def _step(
    chain: LimbKinematics,
    q: FloatArray,
    placed: EffectorPlacements,
    rows: NDArray[np.int64],
    missing: FloatArray,
    level: bool,
) -> FloatArray:
    """Angles after one damped step; a turn about the normal itself is free."""
    jacobian = placed.jacobians[rows]
    if level:
        axes, z = placed.axes[rows], placed.rotations[rows, :, 2]
        across = axes - z[:, :, None] * np.einsum("ni,nik->nk", z, axes)[:, None]
        jacobian = np.concatenate([jacobian, _LEVER * across], axis=1)
        missing = missing * np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
    else:
        missing = missing[:, :3]
    move = _damped(jacobian, missing)
    held = ((q <= chain.lower) & (move < 0.0)) | ((q >= chain.upper) & (move > 0.0))
    if held.any():
        jacobian = jacobian * ~held[:, None]
        move = _damped(jacobian, missing)
    return np.clip(q + np.clip(move, -_LARGEST_STEP, _LARGEST_STEP), chain.lower, chain.upper)


def _damped(jacobian: FloatArray, missing: FloatArray) -> FloatArray:
    turned = jacobian.transpose(0, 2, 1)
    square = jacobian @ turned + _DAMPING**2 * np.eye(jacobian.shape[1])
    return (turned @ np.linalg.solve(square, missing[..., None]))[..., 0]
