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
    """A declared unit of length, of :data:`LENGTHS` [m]; else an InputError that begins with ``where``."""
    metres = LENGTHS.get(unit.strip().lower())
    if metres is None:
        raise InputError(f"{where}: unit of length is {unit[:40]!r}; valid: {', '.join(LENGTHS)}")
    return metres


def rotation_to_z_up(up: str, where: str) -> FloatArray:
    """(3, 3) rotation to the world's axes of a file whose axis ``up`` (``"y"``, ``"-X"``) points up.

    If that is no axis, an InputError begins with ``where``.
    """
    axis = up.strip().lower()
    rotation = UP_TO_Z.get(axis if axis[:1] in ("+", "-") else f"+{axis}")
    if rotation is None:
        raise InputError(f"{where}: axis that points up is {up[:40]!r}; valid: x, y, z, -x, -y, -z")
    return np.array(rotation, dtype=np.float64)


LARGEST = 1e12
"""Largest number that is read: beyond it nothing is measured, and sums and products could overflow."""


MOST_BYTES = 400_000_000
"""Largest file that is read [bytes]: an hour of sixty markers at 100 Hz in a C3D file of reals."""

MOST_TEXT = 200_000_000
"""Largest text that is read [bytes]: its numbers take several times as much memory."""


def read_content(path: str | Path, kind: str, most: int = MOST_BYTES) -> bytes:
    """Content of a regular file of a ``kind``; InputError if it is missing, unreadable or too large."""
    file = Path(path)
    try:
        if file.exists() and not file.is_file():
            raise InputError(f"{file}: is no regular file; valid: a {kind} file")
        if (size := file.stat().st_size) > most:
            raise InputError(f"{file}: has {size} bytes; valid: at most {most}")
        return file.read_bytes()
    except OSError as error:
        raise InputError(f"{file}: {error.strerror or error}; valid: a {kind} file") from None


def read_text(path: str | Path, kind: str) -> str:
    """Text of a file of a ``kind`` such as ``"BVH"``; InputError as of :func:`read_content`, or if none."""
    file = Path(path)
    try:
        text = read_content(file, kind, MOST_TEXT).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no text; valid: a {kind} file") from None
    if not text.strip() or "\0" in text:
        raise InputError(f"{file}: is {'no text' if text.strip() else 'empty'}; valid: a {kind} file")
    return text


def numbers(words: list[str], where: str, gaps: bool = False) -> FloatArray:
    """(n,) finite numbers, none beyond :data:`LARGEST`; with ``gaps``, ``nan`` may stand where there is none.

    If a word is no such number, an InputError begins with ``where``.
    """
    found = []
    try:
        for word in words:
            found.append(float(word))
    except ValueError:
        wrong = words[len(found)]
        raise InputError(f"{where}: {wrong[:40]!r} is no number; valid: finite numbers") from None
    values = np.array(found, dtype=np.float64)
    good = (np.abs(values) <= LARGEST) | (np.isnan(values) & gaps)
    if not np.all(good):
        wrong = words[int(np.argmin(good))]
        raise InputError(f"{where}: is {wrong[:40]!r}; valid: finite numbers up to {LARGEST:g}")
    return values


def whole_number(word: str, where: str) -> int:
    """A whole number of at least 0; InputError if the word is none."""
    if not (word.isascii() and word.isdigit()) or len(word) > 12:
        raise InputError(f"{where}: {word[:40]!r} is no frame count or number; valid: a whole number >= 0")
    return int(word)


def check_even(time: FloatArray, rate: float, where: str) -> None:
    """Refuse instants (n,) [s] not at an even rate [Hz] to half a frame, by an InputError of ``where``."""
    even = np.abs((time - time[0]) * rate - np.arange(len(time))) < 0.5
    if not np.all(even):
        row = int(np.argmin(even)) + 1
        raise InputError(f"{where}: row {row} is not at an even {rate:g} Hz; valid: no row missing")


def rotations_of(angles: FloatArray, axes: str) -> FloatArray:
    """(n, 3, 3) product of turns by angles (n, k) [rad] about k of the axes ``XYZ``, the first leftmost."""
    total = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for column, axis in enumerate(axes):
        total = total @ _turns(angles[:, column], "XYZ".index(axis))
    return np.array(total)


def fixed_turns(angles: FloatArray, order: str) -> FloatArray:
    """(n, 3, 3) turns by (n, 3) angles [rad] about the fixed X, Y and Z, in the order of happening."""
    return rotations_of(angles[:, ["XYZ".index(axis) for axis in order[::-1]]], order[::-1])


def _turns(angle: FloatArray, axis: int) -> FloatArray:
    """(n, 3, 3) turns about one coordinate axis."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angle), 3, 3))
    turn[:, axis, axis] = 1.0
    turn[:, first, first] = turn[:, second, second] = np.cos(angle)
    turn[:, second, first] = np.sin(angle)
    turn[:, first, second] = -turn[:, second, first]
    return turn
