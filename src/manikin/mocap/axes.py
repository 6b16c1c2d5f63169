"""Units and axes of marker files: lengths to metres, the axis that points up to z."""

import numpy as np

from manikin.errors import InputError
from manikin.spatial import FloatArray

LENGTHS = {
    "m": 1.0, "meters": 1.0, "metres": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001,
    "in": 0.0254, "inch": 0.0254, "inches": 0.0254, "ft": 0.3048,
}  # fmt: skip
"""Units of length that files declare [m], in lower case."""

UP_TO_Z = {
    "+x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)), "-x": ((0, -1, 0), (0, 0, 1), (-1, 0, 0)),
    "+y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)), "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "+z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)), "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
}  # fmt: skip
"""Rotation from a file's axes to the world's, by the file's axis that points up.

The file's x axis stays x where it is not the one that points up: OpenSim's forward is ours."""


def metres_per(unit: str, where: str) -> float:
    """A declared unit of length [m].

    Raises:
        InputError: If it is not among :data:`LENGTHS`.
    """
    metres = LENGTHS.get(unit.strip().lower())
    if metres is None:
        raise InputError(f"{where}: unit of length is {unit[:40]!r}; valid: {', '.join(LENGTHS)}")
    return metres


def rotation_to_z_up(up: str, where: str) -> FloatArray:
    """(3, 3) rotation from the file's axes to the world's.

    Args:
        up: The file's axis that points up, ``"y"``, ``"+Z"``, ``"-x"``...
        where: File or key, for the message.

    Raises:
        InputError: If it is no axis.
    """
    axis = up.strip().lower()
    rotation = UP_TO_Z.get(axis if axis[:1] in ("+", "-") else f"+{axis}")
    if rotation is None:
        raise InputError(f"{where}: axis that points up is {up[:40]!r}; valid: x, y, z, -x, -y, -z")
    return np.array(rotation, dtype=np.float64)
