"""Recordings of any format that is known, told by the ending of the file's name."""

from pathlib import Path

from manikin.errors import InputError
from manikin.mocap.amc import read_amc
from manikin.mocap.bvh import read_bvh
from manikin.mocap.recording import Recording

READERS = {".bvh": read_bvh, ".amc": read_amc}
"""Readers with their defaults, by ending."""


def read_recording(path: str | Path) -> Recording:
    """Read a recording with the reader of its ending; options are those of the readers themselves.

    Raises:
        InputError: If the ending is unknown or the file cannot be read.
    """
    reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise InputError(f"{path}: no reader for {Path(path).suffix!r}; valid: {', '.join(READERS)}")
    return reader(path)
