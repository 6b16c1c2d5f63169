"""Text files of motion capture: decoding, numbers, units, axes, and rotations of three angles."""

from pathlib import Path

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray

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


LARGEST = 1e12
"""Largest number that is read: beyond it nothing is measured, and sums and products could overflow."""


def read_text(path: str | Path, kind: str) -> str:
    """Text of a file.

    Args:
        kind: What it should be, for the message (``"BVH"``).

    Raises:
        InputError: If it is missing, unreadable, empty or no text.
    """
    file = Path(path)
    try:
        text = file.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; valid: a {kind} file") from None
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no text; valid: a {kind} file") from None
    if not text.strip():
        raise InputError(f"{file}: is empty; valid: a {kind} file")
    if "\0" in text:
        raise InputError(f"{file}: is no text; valid: a {kind} file")
    return text


def numbers(words: list[str], where: str, gaps: bool = False) -> FloatArray:
    """(n,) finite numbers, none beyond :data:`LARGEST`.

    Args:
        where: File and line or key, for the message.
        gaps: Whether ``nan`` may stand where there is no number.

    Raises:
        InputError: If a word is no such number.
    """
    try:
        values = np.array(list(map(float, words)), dtype=np.float64)
    except ValueError:
        wrong = next(word for word in words if not _is_number(word))
        raise InputError(f"{where}: {wrong[:40]!r} is no number; valid: finite numbers") from None
    good = np.abs(values) <= LARGEST
    if gaps:
        good |= np.isnan(values)
    if not np.all(good):
        wrong = words[int(np.argmin(good))]
        raise InputError(f"{where}: is {wrong[:40]!r}; valid: finite numbers up to {LARGEST:g}")
    return values


def whole_number(word: str, where: str) -> int:
    """A whole number of at least 0.

    Raises:
        InputError: If the word is none.
    """
    if not (word.isascii() and word.isdigit()) or len(word) > 12:
        raise InputError(f"{where}: {word[:40]!r} is no frame count or number; valid: a whole number >= 0")
    return int(word)


def check_even(time: FloatArray, rate: float, where: str) -> None:
    """Refuse instants that are not at an even rate, to half a frame.

    Args:
        time: (n,) [s].
        rate: Per second [Hz].
        where: File, for the message.

    Raises:
        InputError: If an instant is elsewhere.
    """
    off = np.abs((time - time[0]) * rate - np.arange(len(time)))
    if not np.all(off < 0.5):
        row = int(np.argmin(off < 0.5)) + 1
        raise InputError(f"{where}: row {row} is not at an even {rate:g} Hz; valid: no row missing")


def rotations_of(angles: FloatArray, axes: str) -> FloatArray:
    """Product of turns about coordinate axes, the first leftmost.

    Args:
        angles: (n, k) [rad], one column per turn.
        axes: k letters of ``XYZ``.

    Returns:
        (n, 3, 3).
    """
    total = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for column, axis in enumerate(axes):
        total = total @ _turns(angles[:, column], "XYZ".index(axis))
    return np.array(total)


def fixed_turns(angles: FloatArray, order: str) -> FloatArray:
    """(n, 3, 3) turns by (n, 3) angles [rad] about the fixed X, Y and Z, in the order of happening."""
    reverse = order[::-1]
    return rotations_of(angles[:, ["XYZ".index(axis) for axis in reverse]], reverse)


def _turns(angle: FloatArray, axis: int) -> FloatArray:
    """(n, 3, 3) turns about one coordinate axis."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1.0
    turn[:, first, first] = turn[:, second, second] = np.cos(angle)
    turn[:, second, first] = np.sin(angle)
    turn[:, first, second] = -turn[:, second, first]
    return turn


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
