"""Result directories of push maps, statistics of recordings and partitions into words.

Directions of a map and slices of a partition are kept as soon as they are known, so that an interrupted
search can be continued. Figures without content are left out.

::

    DIR/map.json               the map asked for, and those it is compared with
    DIR/map.csv                one row per map and direction
    DIR/figures/push_map.png   drawn from the maps

    DIR/statistics.json        all that was measured
    DIR/phases.csv             one row per motion and phase
    DIR/figures/phase_durations.png, placements.png, com_paths.png, com_heights.png, com_distances.png

    DIR/words.json             what is asked, what is known of it: counts and shares by word, residuals
    DIR/slices/150.npz         paths of the slice of 150 deg: turns, shapes, lengths, costs
    DIR/figures/*.png          drawn from the slices
"""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from matplotlib.figure import Figure

from manikin.errors import FigureError, InputError
from manikin.recordings.statistics import phases
from manikin.recordings.statistics.clip_statistics import GroupStatistics, StatisticsSettings
from manikin.recordings.statistics.clips import RecordedClip
from manikin.recordings.statistics.phases import By, PhaseSequence
from manikin.reports import figures
from manikin.reports.figures import save_figure
from manikin.runtime import __version__
from manikin.runtime.files import ResultDirectory, atomic_path, csv_text, to_json, writing
from manikin.simulation import PushMap, PushTrials
from manikin.walking import words
from manikin.walking.words import WordGrid, WordSlice

MAP = "map.json"
TABLE = "map.csv"
RESULTS = ("impulse_Ns", "beyond_Ns", "trials", "bound_Ns")
"""Keys of a map that are found or computed; all others say what was asked."""


def maps_as_dict(maps: Sequence[PushMap]) -> dict[str, Any]:
    """Content of ``map.json``: the first map, the others under ``compared``."""
    first, *others = maps
    return {
        "manikin": __version__, "complete": not any(item.missing for item in maps), **first.as_dict(),
        "compared": [item.as_dict() for item in others],
    }  # fmt: skip


class MapDirectory(ResultDirectory):
    """Directory of push maps.

    Attributes:
        maps: As far as they are known.
    """

    kind, marks, writer = "map", (MAP,), "manikin push --map"

    def __init__(self, path: str | Path, asked: Sequence[PushMap]) -> None:
        """Create the directory, or continue the maps of an earlier run.

        Raises:
            MotionFileError: If it cannot be written, or holds something that is no map.
            InputError: If it holds maps of something else.
        """
        super().__init__(path)
        self.maps = tuple(asked)
        if (self.path / MAP).exists():
            self.maps = self._continued(self.read(MAP))

    def keep(self, maps: Sequence[PushMap]) -> None:
        """Write what is known by now."""
        self.maps = tuple(maps)
        self.write(TABLE, _table(self.maps))
        self.write(MAP, maps_as_dict(self.maps))

    def draw(self, trials: PushTrials) -> None:
        """Draw the maps around the soles of the body in ``trials``.

        Raises:
            FigureError: If no impulse was held.
        """
        save_figure(figures.push_map_figure(self.maps, trials.soles()), self.figures / "push_map.png")

    def _continued(self, data: Mapping[str, Any]) -> tuple[PushMap, ...]:
        """Maps of an earlier run, which must be about the same."""
        asked, kept = _asked(maps_as_dict(self.maps)), _asked(data)
        for key in dict.fromkeys((*asked, *kept)):
            if asked.get(key) != kept.get(key):
                known, now = (json.dumps(values.get(key)) for values in (kept, asked))
                what = f"{key} is {known} there and {now} now"
                what = "other maps are compared there" if key == "compared" else what
                raise InputError(f"{self.path / MAP}: {what}; valid: the same settings, or another directory")
        rest = {key: value for key, value in data.items() if key not in ("manikin", "complete", "compared")}
        try:
            return tuple(PushMap.from_dict(values) for values in (rest, *data["compared"]))
        except (KeyError, TypeError, ValueError):
            raise self.damaged(self.path / MAP) from None


def _asked(data: Mapping[str, Any]) -> dict[str, Any]:
    """Conditions of a file of maps, without its results; as JSON holds them."""
    asked = {key: value for key, value in data.items() if key not in (*RESULTS, "complete", "compared")}
    others = data.get("compared")
    if isinstance(others, list):
        asked["compared"] = [_asked(other) for other in others if isinstance(other, Mapping)]
    return json.loads(to_json(asked))


def _table(maps: Sequence[PushMap]) -> str:
    """One row per map and direction; what is not known is empty."""
    rows = []
    for number, item in enumerate(maps):
        bounds = item.bound or (None,) * len(item.directions)
        for direction, result, bound in zip(item.directions, item.found, bounds, strict=True):
            known = (None, None) if result is None else (result.held, result.beyond)
            rows.append([number, direction, *known, bound])
    return csv_text(("map", "direction_deg", "impulse_Ns", "beyond_Ns", "bound_Ns"), rows)


STATISTICS = "statistics.json"
PHASES = "phases.csv"
HEAD = ("group", "motion", "phase", "effectors", "start_s", "end_s", "duration_s", "whole")


def write_statistics(
    directory: str | Path, content: Mapping[str, Any], sequences: Sequence[PhaseSequence],
    pictures: Mapping[str, Figure],
) -> list[Path]:  # fmt: skip
    """Write what was measured, and return the files; others in the directory are left alone.

    Raises:
        MotionFileError: If the directory cannot be written to.
    """
    folder = ResultDirectory(directory, "statistics")
    files = [folder.write(STATISTICS, content), folder.write(PHASES, phase_table(sequences))]
    for name, figure in pictures.items():
        files.append(folder.figures / f"{name}.png")
        save_figure(figure, files[-1])
    return files


def clip_figures(
    clips: Sequence[RecordedClip], found: Mapping[str, GroupStatistics], settings: StatisticsSettings,
    by: By = "kind",
) -> dict[str, Figure]:  # fmt: skip
    """All figures of recorded motions that have content, by name."""
    height = None if settings.overhead is None else settings.overhead.height
    placed = [clip for clip in clips if clip.name not in found[clip.group].unplaced]
    standing = [clip.standing_com for clip in clips if clip.standing_com is not None]
    stood = sum(standing) / len(standing) if standing else None
    sequences = [settings.phases_of(clip) for clip in clips]
    origins = [settings.origin_of(clip) for clip in placed]
    places = {group: item.placements for group, item in found.items()}
    lowest = [figures.LowestPoints.of(item, height) for item in found.values()]
    known = phases.published_distances()
    drawn = {
        "phase_durations": lambda: figures.phase_durations_figure(sequences, by),
        "placements": lambda: figures.placements_figure(places),
        "com_paths": lambda: figures.com_paths_figure(placed, origins, overhead=height),
        "com_heights": lambda: figures.com_heights_figure(lowest, stood),
        "com_distances": lambda: figures.com_distances_figure(clips, limit=settings.limit, published=known),
    }
    result = {}
    for name, draw in drawn.items():
        with suppress(FigureError):  # nothing to show
            result[name] = draw()
    return result


def published_figures() -> dict[str, Figure]:
    """Figures of the published motions, by name; those of the means quoted in the thesis."""
    standing = phases.published_heights().standing
    quoted = [item for item in phases.published_phases("left_foot") if not item.group.endswith("C3")]
    return {
        "phase_durations": figures.phase_durations_figure(quoted),
        "com_heights": figures.com_heights_figure(figures.published_lowest(), standing),
        "com_distances": figures.com_distances_figure([], published=phases.published_distances()),
    }


def phase_table(sequences: Sequence[PhaseSequence]) -> str:
    """One row per motion and phase, as CSV."""
    rows = []
    for item in sequences:
        for label, phase, whole in zip(item.labels, item.phases, item.whole, strict=True):
            times = (f"{value:.4f}" for value in (phase.start, phase.end, phase.duration))
            rows.append([item.group, item.name, label, " ".join(phase.effectors), *times, int(whole)])
    return csv_text(HEAD, rows)


WORDS = "words.json"
SLICES = "slices"
SHOWN_SLICES = (340, 150)
"""Headings of the slices that are drawn if they are there, those of [Truong2010]_ Fig. 3.6 [deg]."""
_ARRAYS = ("turns", "shapes", "lengths", "costs")
_REACHED = 1e-6
"""Largest distance of a path's end from its goal [m]; a changed byte exceeds it."""


def partition_as_dict(
    grid: WordGrid, headings: Sequence[int], slices: Mapping[int, WordSlice]
) -> dict[str, Any]:
    """Content of ``words.json``: ``headings`` that are asked for, and slices known by theirs [deg]."""
    known = [slices[heading] for heading in headings if heading in slices]
    counts, missed = words.count_words(known), [item.residuals() for item in known]
    names = {"position": "position_m", "heading": "heading_rad", "curvature": "curvature_per_m",
             "adjoint": "adjoint", "hamiltonian": "hamiltonian"}  # fmt: skip
    largest = {
        key: max((float(getattr(item, name).max()) for item in missed), default=None)
        for name, key in names.items()
    }
    return {
        "manikin": __version__, "complete": len(known) == len(headings), "grid": grid.as_dict(),
        "headings_deg": list(headings), "problems": len(headings) * int(np.prod(grid.shape)),
        "solved": sum(counts.values()), "counts": counts, "shares": words.shares(counts),
        "others": [word for word in counts if word not in words.THESIS_WORDS], "max_residuals": largest,
        "slices": {str(round(item.heading_deg)): words.count_words([item]) for item in known},
    }  # fmt: skip


class WordsDirectory(ResultDirectory):
    """Directory of a partition into words.

    Attributes:
        grid: Of the places.
        slices: Those that are known, by their heading [deg].
    """

    kind, marks, writer = "partition", (WORDS,), "manikin words"

    def __init__(self, path: str | Path, grid: WordGrid) -> None:
        """Create the directory, or continue the partition of an earlier run.

        Raises:
            MotionFileError: If it cannot be written, or holds something that is no partition.
            InputError: If it holds a partition of another grid.
        """
        super().__init__(path)
        self.grid, file = grid, self.path / WORDS
        if file.exists():
            known = self.read(WORDS).get("grid")
            if known is None:
                raise self.damaged(file)
            if known != json.loads(to_json(grid.as_dict())):
                valid = "valid: the same, or another directory"
                raise InputError(f"{file}: is of another grid, {json.dumps(known)}; {valid}")
        kept = [heading for heading in words.HEADINGS if self._file(heading).exists()]
        self.slices = {heading: self._slice(self._file(heading), heading) for heading in kept}

    def begin(self, headings: Sequence[int]) -> None:
        """Say which slices are asked for, before any is solved."""
        self.write(WORDS, {"manikin": __version__, "complete": False, "grid": self.grid.as_dict(),
                           "headings_deg": list(headings)})  # fmt: skip

    def keep(self, solved: WordSlice) -> None:
        """Write a slice."""
        heading = round(solved.heading_deg)
        self.slices[heading] = solved
        file = self._file(heading)
        with writing(file), atomic_path(file) as temporary, temporary.open("wb") as opened:
            np.savez_compressed(opened, **{name: getattr(solved, name) for name in _ARRAYS})

    def finish(self, headings: Sequence[int]) -> dict[str, Any]:
        """Write and return the summary of the slices that are asked for."""
        summary = partition_as_dict(self.grid, headings, self.slices)
        self.write(WORDS, summary)
        return summary

    def draw(self, headings: Sequence[int]) -> None:
        """Draw slices, and two paths of equal cost on a border of theirs if they have one.

        Drawn are those of :data:`SHOWN_SLICES` among the ``headings`` asked for [deg], else the first two.
        """
        chosen = [heading for heading in SHOWN_SLICES if heading in headings] or list(headings[:2])
        slices = [self.slices[heading] for heading in chosen]
        save_figure(figures.words_figure(slices), self.figures / "words.png")
        borders = [(item, jumps[0]) for item in slices if (jumps := item.jumps())]
        if pairs := [words.equal_paths(*(item.path(*place) for place in border)) for item, border in borders]:
            save_figure(figures.equal_paths_figure(pairs), self.figures / "equal_paths.png")

    def _file(self, heading: int) -> Path:
        return self.folder(SLICES) / f"{heading:03d}.npz"

    def _slice(self, file: Path, heading: int) -> WordSlice:
        """Slice of a file, whose paths must reach their goals."""
        try:
            with np.load(file, allow_pickle=False) as data:
                arrays = {name: np.asarray(data[name], dtype=np.float64) for name in _ARRAYS}
            known = WordSlice(self.grid, float(heading), **arrays)
            if known.missed() < _REACHED:
                return known
        except (OSError, ValueError, KeyError, EOFError, BadZipFile, InputError):
            pass
        raise self.damaged(file, "; remove it to solve it again")


def solve_partition(
    headings: Sequence[int], grid: WordGrid, path: Path | None, *, jobs: int, draw: bool,
    progress: Callable[[str, float, str], None],
) -> dict[str, Any]:  # fmt: skip
    """Solve the slices of a partition that are not known yet, keep and draw them; return the summary.

    Args:
        headings: Of the slices [deg].
        path: Directory of the partition, or None to keep nothing.
        jobs: Processes.
        progress: Told the stage, the share that is done and a remark after each slice.
    """
    directory = None if path is None else WordsDirectory(path, grid)
    known = {} if directory is None else directory.slices
    if directory is not None:
        directory.begin(headings)
    waiting = [heading for heading in headings if heading not in known]
    count, total = len(headings) - len(waiting), len(headings)
    progress("words", count / total, f"{count} of {total} slices")
    for done, solved in enumerate(words.solve_slices(waiting, grid, jobs=jobs), count + 1):
        known[round(solved.heading_deg)] = solved
        if directory is not None:
            directory.keep(solved)
        progress("words", done / total, f"{done} of {total} slices")
    if directory is None:
        return partition_as_dict(grid, headings, known)
    summary = directory.finish(headings)
    if draw:
        directory.draw(headings)
    return summary
