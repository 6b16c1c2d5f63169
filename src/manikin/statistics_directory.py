"""The directory that ``manikin statistics --out`` writes.

::

    DIR/statistics.json             all that was measured
    DIR/phases.csv                  one row per motion and phase
    DIR/figures/phase_durations.png, placements.png, com_paths.png, com_heights.png, com_distances.png

Figures without content are left out.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from manikin.errors import FigureError, MotionFileError
from manikin.figures import (
    LowestPoints,
    com_distances_figure,
    com_heights_figure,
    com_paths_figure,
    phase_durations_figure,
    placements_figure,
    published_lowest,
)
from manikin.figures.write import save_figure
from manikin.mocap.phase_durations import By
from manikin.mocap.phase_sequence import PhaseSequence
from manikin.mocap.published_phases import published_distances, published_heights, published_phases
from manikin.mocap.recorded_clip import RecordedClip
from manikin.mocap.statistics import GroupStatistics, StatisticsSettings
from manikin.result_directory import FIGURES, make_directory, write_result

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
