"""Rotations of many frames at once."""

import numpy as np

from manikin.spatial import FloatArray


def rotations(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(n, 3, 3) ``Rz(yaw) Ry(pitch) Rx(roll)`` of (n,) angles [rad]."""
    cy, sy, cp, sp, cr, sr = (f(angle) for angle in (yaw, pitch, roll) for f in (np.cos, np.sin))
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
