"""Which parts of which recordings a motion library is built from."""

import csv
from dataclasses import dataclass
from pathlib import Path

from manikin.errors import InputError
from manikin.locomotion.library import STAND

TABLE = "clips_locomotion.csv"
"""Names the windows to use: columns class, file, first_frame0, end_frame0, in the folder of recordings."""

IDLE = "idle"
"""Class of the windows in which a person stands."""


@dataclass(frozen=True)
class Window:
    """A part of a recording to take a cycle from.

    Attributes:
        kind: Its class.
        file: The recording, below the folder.
        first: Frame.
        last: Frame after the last one.
    """

    kind: str
    file: str
    first: int
    last: int


def read_windows(folder: Path) -> list[Window]:
    """Windows named by a folder's table.

    Raises:
        InputError: If it has none, or a row cannot be read.
    """
    table = folder / TABLE
    if not table.is_file():
        raise InputError(f"{folder} has no {TABLE}; valid: a folder with this table and the recordings")
    try:
        rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{table} cannot be read: {error}; valid: a table in UTF-8") from None
    found = []
    for number, row in enumerate(rows, 2):
        try:
            found.append(_window(row))
        except (KeyError, TypeError, ValueError, AttributeError):
            raise InputError(
                f"{table} line {number} is not usable; valid: class, file, first_frame0, end_frame0"
            ) from None
    return found


def _window(row: dict[str, str]) -> Window:
    kind = row["class"].split("(")[0].strip().removesuffix(" core")
    first, last = int(row["first_frame0"]), int(row["end_frame0"])
    if not 0 <= first < last:
        raise ValueError
    return Window(STAND if kind == IDLE else kind, row["file"], first, last)
