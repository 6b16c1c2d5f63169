"""Rotations of many frames at once; also of a single one, without the overhead of general classes."""

import numpy as np

from manikin.spatial import FloatArray


def matrix(rows: list[list[FloatArray]]) -> FloatArray:
    """(..., 3, 3) of nine (...) entries."""
    found = np.empty((*rows[0][0].shape, 3, 3))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            found[..., i, j] = entry
    return found


def rotations(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(..., 3, 3) ``Rz(yaw) Ry(pitch) Rx(roll)`` of (...) angles [rad]."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    return matrix([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip


def quaternions(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(..., 4) the same as xyzw quaternions, continuous in the angles."""
    cy, sy, cp, sp = np.cos(0.5 * yaw), np.sin(0.5 * yaw), np.cos(0.5 * pitch), np.sin(0.5 * pitch)
    cr, sr = np.cos(0.5 * roll), np.sin(0.5 * roll)
    found = np.empty((*cy.shape, 4))
    found[..., 0] = cy * cp * sr - sy * sp * cr
    found[..., 1] = cy * sp * cr + sy * cp * sr
    found[..., 2] = sy * cp * cr - cy * sp * sr
    found[..., 3] = cy * cp * cr + sy * sp * sr
    return found


def dot(first: FloatArray, second: FloatArray) -> FloatArray:
    """(...) products of (..., 3) vectors."""
    return np.einsum("...i,...i->...", first, second)
