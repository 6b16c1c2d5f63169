"""Content of a C3D file in memory: header, parameters, frames of points and channels.

Little-endian, all data as single-precision reals, as the format's user guide lays them out (c3d.org).
"""

import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.c3d_layout import BLOCK

MOST_FRAMES = 65_535
"""Frames that the header can count."""

Groups = Mapping[str, Mapping[str, Any]]
"""Parameters by group and name: texts, or arrays of whole or real numbers."""


def c3d_content(points: FloatArray, channels: FloatArray, rate: float, groups: Groups) -> bytes:
    """A C3D file.

    Args:
        points: (n, m, 3) places, in the unit that the parameters declare.
        channels: (n, c) analog channels, one sample for each frame.
        rate: Frames per second [Hz].
        groups: Parameters besides those that follow from the data.

    Raises:
        InputError: If there are more frames than the format can count.
    """
    frames, count = points.shape[:2]
    if frames > MOST_FRAMES:
        raise InputError(f"motion has {frames} frames; valid for c3d: at most {MOST_FRAMES}, by a lower rate")
    used = channels.shape[1]
    section = b""
    for _ in range(2):  # the place of the data is known when the parameters have their length
        start = 2 + _blocks(section)
        section = b"".join(
            _group(number, name, parameters)
            for number, (name, parameters) in enumerate(
                _complete(groups, count, frames, used, rate, start).items(), start=1
            )
        )
    head = struct.pack(
        "<BBHHHHHfHHf", 2, 0x50, count, used, 1, frames, 0, -1.0, 2 + _blocks(section), min(used, 1), rate
    )
    with_residuals = np.concatenate([points, np.zeros((frames, count, 1))], axis=2).reshape(frames, -1)
    data = np.hstack([with_residuals, channels]).astype("<f4").tobytes()
    parameters = struct.pack("<BBBB", 1, 0x50, _blocks(section), 84) + section
    return head.ljust(BLOCK, b"\0") + parameters.ljust(BLOCK * _blocks(section), b"\0") + data


def _blocks(section: bytes) -> int:
    return (len(section) + 5) // BLOCK + 1


def _complete(
    groups: Groups, count: int, frames: int, channels: int, rate: float, start: int
) -> dict[str, Mapping[str, Any]]:
    """Parameters with those that follow from the data."""
    sizes = {
        "POINT": {"USED": np.int16(count), "FRAMES": np.uint16(frames), "SCALE": -1.0, "RATE": rate,
                  "DATA_START": np.int16(start)},
        "ANALOG": {"USED": np.int16(channels), "RATE": rate, "GEN_SCALE": 1.0,
                   "SCALE": np.ones(channels), "OFFSET": np.zeros(channels, dtype=np.int16)},
    }  # fmt: skip
    return {name: sizes.get(name, {}) | dict(groups.get(name, {})) for name in (*sizes, *groups)}


def _group(number: int, name: str, parameters: Mapping[str, Any]) -> bytes:
    head = struct.pack("<bb", len(name), -number) + name.encode() + struct.pack("<hB", 3, 0)
    return head + b"".join(_parameter(number, key, value) for key, value in parameters.items())


def _parameter(group: int, name: str, value: Any) -> bytes:
    kind, dimensions, raw = _encoded(value)
    body = struct.pack("<bB", kind, len(dimensions)) + bytes(dimensions) + raw + b"\0"
    return struct.pack("<bb", len(name), group) + name.encode() + struct.pack("<h", len(body) + 2) + body


def _encoded(value: Any) -> tuple[int, Sequence[int], bytes]:
    """Type, dimensions and bytes of a parameter; the first dimension runs fastest."""
    if isinstance(value, (list, tuple)) and all(isinstance(item, str) for item in value):
        words = [item.encode("latin-1", "replace") for item in value]
        width = max(map(len, words), default=1)
        return -1, (width, len(words)), b"".join(word.ljust(width) for word in words)
    array = np.asarray(value)
    whole = np.issubdtype(array.dtype, np.integer)
    raw = array.astype("<u2" if whole else "<f4").tobytes(order="F")
    return (2 if whole else 4), array.shape, raw
