"""The directory of a partition into words: slices are kept as soon as they are solved, and not solved again.

::

    DIR/words.json           what is asked, what is known of it: counts and shares by word, residuals
    DIR/slices/150.npz       paths of the slice of 150 deg: turns, shapes, lengths, costs
    DIR/figures/*.png        drawn from the slices

Each file is written atomically.

Also here. The directory of push maps: every direction is kept as soon as it is known, and need not be
searched again. The directory that ``manikin statistics --out`` writes.

::

    DIR/map.json               the map asked for, and those it is compared with
    DIR/map.csv                one row per map and direction
    DIR/figures/push_map.png   drawn from the maps

Each file is written atomically.

::

    DIR/statistics.json             all that was measured
    DIR/phases.csv                  one row per motion and phase
    DIR/figures/phase_durations.png, placements.png, com_paths.png, com_heights.png, com_distances.png

Figures without content are left out.
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from matplotlib.figure import Figure

from manikin.errors import FigureError, InputError, MotionFileError
from manikin.recordings.statistics.clip_statistics import GroupStatistics, StatisticsSettings
from manikin.recordings.statistics.clips import RecordedClip
from manikin.recordings.statistics.phases import (
    By,
    PhaseSequence,
    published_distances,
    published_heights,
    published_phases,
)
from manikin.reports.figures import (
    LowestPoints,
    com_distances_figure,
    com_heights_figure,
    com_paths_figure,
    phase_durations_figure,
    placements_figure,
    published_lowest,
)
from manikin.reports.figures.write_figures import save_figure
from manikin.runtime.files import (
    FIGURES,
    ResultDirectory,
    atomic_path,
    make_directory,
    to_json,
    write_result,
    writing,
)
from manikin.runtime.version import __version__
from manikin.simulation import PushMap
from manikin.walking.words import HEADINGS, THESIS_WORDS, WordGrid, WordSlice, count_words, shares

MAP = "map.json"
TABLE = "map.csv"

RESULTS = ("impulse_Ns", "beyond_Ns", "trials", "bound_Ns")
"""Keys of a map that are found or computed; all others say what was asked."""


def maps_as_dict(maps: Sequence[PushMap]) -> dict[str, Any]:
    """Content of ``map.json``: the first map, the others under ``compared``."""
    first, *others = maps
    return {
        "manikin": __version__, "complete": not any(one.missing for one in maps), **first.as_dict(),
        "compared": [one.as_dict() for one in others],
    }  # fmt: skip


class MapDirectory(ResultDirectory):
    """Reads and writes the files of some maps.

    Attributes:
        maps: As far as they are known.
    """

    kind, marks = "map", (MAP,)

    def __init__(self, path: str | Path, asked: Sequence[PushMap]) -> None:
        """Create the directory, or go on with what an earlier run has found there.

        Args:
            path: The directory.
            asked: Empty maps of what is asked for.

        Raises:
            MotionFileError: If it cannot be written, or holds something that is no map.
            InputError: If it holds maps of something else.
        """
        super().__init__(path)
        self.maps = tuple(asked)
        if (self.path / MAP).exists():
            self.maps = self._taken_over(_map_directory_read(self.path / MAP))

    def keep(self, maps: Sequence[PushMap]) -> None:
        """Write what is known by now.

        Raises:
            MotionFileError: If it cannot be written.
        """
        self.maps = tuple(maps)
        self.write(TABLE, _table(self.maps))
        self.write(MAP, maps_as_dict(self.maps))

    def _taken_over(self, data: Mapping[str, Any]) -> tuple[PushMap, ...]:
        """Maps of an earlier run.

        Raises:
            InputError: If they are about something else.
        """
        asked = _asked(maps_as_dict(self.maps))
        kept = _asked(data)
        for key in dict.fromkeys((*asked, *kept)):
            if asked.get(key) != kept.get(key):
                there, now = (json.dumps(one.get(key)) for one in (kept, asked))
                what = "other maps are compared there" if key == "compared" else (
                    f"{key} is {there} there and {now} now")  # fmt: skip
                raise InputError(f"{self.path / MAP}: {what}; valid: the same settings, or another directory")
        rest = {key: value for key, value in data.items() if key not in ("manikin", "complete", "compared")}
        try:
            return tuple(PushMap.from_dict(one) for one in (rest, *data["compared"]))
        except (KeyError, TypeError, ValueError):
            raise _map_directory_damaged(self.path / MAP) from None


def _asked(data: Mapping[str, Any]) -> dict[str, Any]:
    """What a file of maps is about, without what was found; as JSON holds it."""
    one = {key: value for key, value in data.items() if key not in (*RESULTS, "complete", "compared")}
    others = data.get("compared")
    if isinstance(others, list):
        one["compared"] = [_asked(other) for other in others if isinstance(other, Mapping)]
    return json.loads(to_json(one))


def _map_directory_read(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise _map_directory_damaged(path) from None
    if not isinstance(data, dict):
        raise _map_directory_damaged(path)
    return data


def _map_directory_damaged(path: Path) -> MotionFileError:
    return MotionFileError(f"{path}: is damaged; valid: as written by manikin push --map")


def _table(maps: Sequence[PushMap]) -> str:
    """One row per map and direction; what is not known is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["map", "direction_deg", "impulse_Ns", "beyond_Ns", "bound_Ns"])
    for number, one in enumerate(maps):
        bounds = one.bound or (None,) * len(one.directions)
        for direction, found, bound in zip(one.directions, one.found, bounds, strict=True):
            row = (None, None, bound) if found is None else (found.held, found.beyond, bound)
            writer.writerow([number, direction, *("" if value is None else value for value in row)])
    return text.getvalue()


STATISTICS = "statistics.json"
PHASES = "phases.csv"
HEAD = ("group", "motion", "phase", "effectors", "start_s", "end_s", "duration_s", "whole")


def write_statistics(
    directory: str | Path, content: Mapping[str, Any], sequences: Sequence[PhaseSequence],
    figures: Mapping[str, Figure],
) -> list[Path]:  # fmt: skip
    """Write what was measured; other files in the directory are left alone.

    Returns:
        The files written.

    Raises:
        MotionFileError: If the directory cannot be written to.
    """
    folder = Path(directory)
    if folder.exists() and not folder.is_dir():
        raise MotionFileError(f"{folder}: is a file; valid: a directory for the statistics")
    make_directory(folder / FIGURES)
    files = [
        write_result(folder / STATISTICS, content),
        write_result(folder / PHASES, phase_table(sequences)),
    ]
    for name, figure in figures.items():
        files.append(folder / FIGURES / f"{name}.png")
        save_figure(figure, files[-1])
    return files


def clip_figures(
    clips: Sequence[RecordedClip],
    found: Mapping[str, GroupStatistics],
    settings: StatisticsSettings,
    by: By = "kind",
) -> dict[str, Figure]:
    """All figures of recorded motions that have content, by name."""
    height = None if settings.overhead is None else settings.overhead.height
    placed = [clip for clip in clips if clip.name not in found[clip.group].unplaced]
    standing = [clip.standing_com for clip in clips if clip.standing_com is not None]
    drawn = {
        "phase_durations": lambda: phase_durations_figure([settings.phases_of(clip) for clip in clips], by),
        "placements": lambda: placements_figure({group: one.placements for group, one in found.items()}),
        "com_paths": lambda: com_paths_figure(
            placed, [settings.origin_of(clip) for clip in placed], overhead=height
        ),
        "com_heights": lambda: com_heights_figure(
            [LowestPoints.of(one, height) for one in found.values()],
            sum(standing) / len(standing) if standing else None,
        ),
        "com_distances": lambda: com_distances_figure(
            clips, limit=settings.limit, published=published_distances()
        ),
    }
    figures = {}
    for name, draw in drawn.items():
        try:
            figures[name] = draw()
        except FigureError:
            continue  # nothing to show
    return figures


def published_figures() -> dict[str, Figure]:
    """Figures of the published motions, by name; those of the means quoted in the thesis."""
    quoted = [one for one in published_phases("left_foot") if not one.group.endswith("C3")]
    return {
        "phase_durations": phase_durations_figure(quoted),
        "com_heights": com_heights_figure(published_lowest(), published_heights().standing),
        "com_distances": com_distances_figure([], published=published_distances()),
    }


def phase_table(sequences: Sequence[PhaseSequence]) -> str:
    """One row per motion and phase, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEAD)
    for one in sequences:
        for label, phase, whole in zip(one.labels, one.phases, one.whole, strict=True):
            times = (f"{value:.4f}" for value in (phase.start, phase.end, phase.duration))
            writer.writerow([one.group, one.name, label, " ".join(phase.effectors), *times, int(whole)])
    return text.getvalue()


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
