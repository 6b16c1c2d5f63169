"""Force and moment on a force plate from the channels that a C3D file keeps of it (c3d.org, user guide).

In a plate's own axes x points from its second corner to the first one, y from the fourth to the first, and
z at right angles to both, into the ground of most plates. Its origin is the middle of the surface seen from
that of its sensors, which lie deeper; some programs write the opposite, told by its sign.
"""

import numpy as np

from manikin.spatial import FloatArray


def plate_load(
    kind: int, channels: FloatArray, corners: FloatArray, origin: FloatArray, calibration: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Force and moment about the middle of the corners, in the axes in which the corners are told.

    Args:
        kind: Type of the plate: 1 force, centre of pressure and free moment; 2 force and moment; 3 eight
            forces of four sensors; 4 as 2 with a calibration matrix.
        channels: (c, n) its channels.
        corners: (4, 3).
        origin: (3,).
        calibration: (6, 6), used by type 4 only.

    Returns:
        (n, 3) and (n, 3), in the units of the channels.
    """
    axes, origin = _axes(corners), -origin if origin[2] > 0.0 else origin
    if kind == 1:
        force, zero = channels[:3].T, np.zeros(channels.shape[1])
        place, free = np.stack([*channels[3:5], zero], axis=1), np.stack([zero, zero, channels[5]], axis=1)
        return force @ axes.T, (np.cross(place, force) + free) @ axes.T
    if kind == 3:
        x12, x34, y14, y23, z1, z2, z3, z4 = channels[:8]
        force = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=1)
        a, b, depth = origin
        moment = np.stack(
            [b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4), b * (x34 - x12) + a * (y14 - y23)], axis=1
        )
        return force @ axes.T, (moment + np.cross(force, [0.0, 0.0, depth])) @ axes.T
    load = channels[:6] if kind == 2 or calibration is None else calibration @ channels[:6]
    force, moment = load[:3].T, load[3:].T
    return force @ axes.T, (moment + np.cross(force, origin)) @ axes.T


def _axes(corners: FloatArray) -> FloatArray:
    """(3, 3) with columns x, y, z; NaN where the corners enclose no surface."""
    x, y = corners[0] - corners[1], corners[0] - corners[3]
    z = np.cross(x, y)
    columns = np.stack([x, np.cross(z, x), z], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return columns / np.linalg.norm(columns, axis=0)
