"""The directory of a partition into words: slices are kept as soon as they are solved, and not solved again.

::

    DIR/words.json           what is asked, what is known of it: counts and shares by word, residuals
    DIR/slices/150.npz       paths of the slice of 150 deg: turns, shapes, lengths, costs
    DIR/figures/*.png        drawn from the slices

Each file is written atomically.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from manikin.atomic import atomic_path
from manikin.errors import InputError, MotionFileError
from manikin.locomotion.words import HEADINGS, THESIS_WORDS, WordGrid, WordSlice, count_words, shares
from manikin.result_directory import ResultDirectory, to_json, writing
from manikin.version import __version__

WORDS = "words.json"
SLICES = "slices"

_ARRAYS = ("turns", "shapes", "lengths", "costs")
_REACHED = 1e-6
"""How far from its goal a path of a file may end [m]: what a changed byte exceeds."""


def partition_as_dict(
    grid: WordGrid, headings: Sequence[int], slices: Mapping[int, WordSlice]
) -> dict[str, Any]:
    """Content of ``words.json``.

    Args:
        grid: Of the places.
        headings: Of the slices that are asked for [deg].
        slices: Those that are known, by their heading [deg].
    """
    known = [slices[heading] for heading in headings if heading in slices]
    counts = count_words(known)
    missed = [one.residuals() for one in known]
    names = {"position": "position_m", "heading": "heading_rad", "curvature": "curvature_per_m",
             "adjoint": "adjoint", "hamiltonian": "hamiltonian"}  # fmt: skip
    return {
        "manikin": __version__, "complete": len(known) == len(headings), "grid": grid.as_dict(),
        "headings_deg": list(headings), "problems": len(headings) * int(np.prod(grid.shape)),
        "solved": sum(counts.values()), "counts": counts, "shares": shares(counts),
        "others": [word for word in counts if word not in THESIS_WORDS],
        "max_residuals": {
            key: max((float(getattr(one, name).max()) for one in missed), default=None)
            for name, key in names.items()
        },
        "slices": {str(round(one.heading_deg)): count_words([one]) for one in known},
    }  # fmt: skip


class WordsDirectory(ResultDirectory):
    """Reads and writes the slices of a partition.

    Attributes:
        grid: Of the places.
        slices: Those that are known, by their heading [deg].
    """

    kind, marks = "partition", (WORDS,)

    def __init__(self, path: str | Path, grid: WordGrid) -> None:
        """Create the directory, or go on with what an earlier run has solved there.

        Args:
            path: The directory.
            grid: That is asked for.

        Raises:
            MotionFileError: If it cannot be written, or holds something that is no partition.
            InputError: If it holds a partition of another grid.
        """
        super().__init__(path)
        self.grid = grid
        if (self.path / WORDS).exists():
            self._check_grid()
        files = {heading: self._file(heading) for heading in HEADINGS}
        self.slices = {
            heading: _read(file, grid, heading) for heading, file in files.items() if file.exists()
        }

    def begin(self, headings: Sequence[int]) -> None:
        """Say which slices are asked for, before any is solved.

        Raises:
            MotionFileError: If it cannot be written.
        """
        self.write(WORDS, {"manikin": __version__, "complete": False, "grid": self.grid.as_dict(),
                           "headings_deg": list(headings)})  # fmt: skip

    def keep(self, one: WordSlice) -> None:
        """Write a slice.

        Raises:
            MotionFileError: If it cannot be written.
        """
        heading = round(one.heading_deg)
        self.slices[heading] = one
        file = self._file(heading)
        with writing(file), atomic_path(file) as temporary, temporary.open("wb") as opened:
            np.savez_compressed(opened, **{name: getattr(one, name) for name in _ARRAYS})

    def finish(self, headings: Sequence[int]) -> dict[str, Any]:
        """Write and return the summary of the slices that are asked for.

        Raises:
            MotionFileError: If it cannot be written.
        """
        summary = partition_as_dict(self.grid, headings, self.slices)
        self.write(WORDS, summary)
        return summary

    def _file(self, heading: int) -> Path:
        return self.folder(SLICES) / f"{heading:03d}.npz"

    def _check_grid(self) -> None:
        file = self.path / WORDS
        try:
            there = json.loads(file.read_text(encoding="utf-8"))["grid"]
        except (OSError, ValueError, KeyError, TypeError):
            raise _damaged(file) from None
        if there != json.loads(to_json(self.grid.as_dict())):
            raise InputError(
                f"{file}: is of another grid, {json.dumps(there)}; valid: the same, or another directory"
            )


def _read(file: Path, grid: WordGrid, heading: int) -> WordSlice:
    """Slice of a file, whose paths must reach their goals.

    Raises:
        MotionFileError: If it is damaged.
    """
    try:
        with np.load(file, allow_pickle=False) as data:
            arrays = {name: np.asarray(data[name], dtype=np.float64) for name in _ARRAYS}
        found = WordSlice(grid, float(heading), **arrays)
        missed = found.missed()
    except (OSError, ValueError, KeyError, EOFError, BadZipFile, InputError):
        raise _damaged(file) from None
    if not missed < _REACHED:
        raise _damaged(file)
    return found


def _damaged(file: Path) -> MotionFileError:
    return MotionFileError(
        f"{file}: is damaged; valid: as written by manikin words; remove it to solve it again"
    )
