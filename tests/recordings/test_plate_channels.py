"""Channels of force plates: one load, told by plates of every type."""

import numpy as np
import pytest

from manikin.recordings.readers.c3d_layout import plate_load

CORNERS = np.array([[1.4, 2.6, 0.0], [1.4, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.6, 0.0]])
"""x of the plate is y of the world, y is x, z points down [m]."""

TURN = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
DEPTH = 0.04
FORCE, PLACE = np.array([30.0, -20.0, 700.0]), np.array([0.12, -0.05, 0.0])


def six_channels(free):
    """Force and moment about the sensors' origin, which is :data:`DEPTH` below the surface."""
    from_sensors = PLACE - [0.0, 0.0, DEPTH]
    return np.concatenate([FORCE, np.cross(from_sensors, FORCE) + free * np.eye(3)[2]])


def eight_channels(a, b):
    """Forces of sensors at (+-a, +-b), shared as a rigid plate on equal springs shares them."""
    moment = np.cross(PLACE - [0.0, 0.0, DEPTH], FORCE)
    signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    upward = 0.25 * (FORCE[2] + signs[:, 1] * moment[0] / b - signs[:, 0] * moment[1] / a)
    twist = moment[2] / b
    x, y = [0.5 * (FORCE[0] - twist), 0.5 * (FORCE[0] + twist)], [0.5 * FORCE[1]] * 2
    return np.concatenate([x, y, upward])


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_one_load_on_plates_of_every_type(kind, sign):
    """Force, and moment ``r x F`` about the middle of the corners, whichever way the origin is written."""
    origin, calibration, free = np.array([0.0, 0.0, -sign * DEPTH]), None, 0.0
    if kind == 1:
        free = 5.0
        channels = np.array([*FORCE, *PLACE[:2], free])
    elif kind == 3:
        channels, origin = eight_channels(0.2, 0.1), sign * np.array([0.2, 0.1, -DEPTH])
    else:
        free, calibration = 5.0, np.diag([1.0, 2.0, 4.0, 1.0, 0.5, 1.0])
        channels = six_channels(free)
        channels = np.linalg.solve(calibration, channels) if kind == 4 else channels
    force, moment = plate_load(kind, np.tile(channels, (3, 1)).T, CORNERS, origin, calibration)
    np.testing.assert_allclose(force, [TURN @ FORCE] * 3, atol=1e-9)
    wanted = TURN @ (np.cross(PLACE, FORCE) + free * np.eye(3)[2])
    np.testing.assert_allclose(moment, [wanted] * 3, atol=1e-9)
