"""The margins of two runs against the phases they share."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from manikin.comparison import RunComparison, TimingRow
from manikin.comparison.compare import STAGES, tracks_of
from manikin.figures.compare_timing import RUN_COLOURS
from manikin.figures.style import dress, legend_in_title, named_below, need, new_grid
from manikin.palette import COLOURS
from manikin.record import ComTrack


def compare_margin_figure(comparison: RunComparison) -> Figure:
    """Draw the margins of each stage over matched phases, each phase drawn equally wide.

    Raises:
        FigureError: If no stage with the same unit of margin is there in both runs, or no phase matches.
    """
    rows = [row for row in comparison.rows if row.first is not None and row.second is not None]
    need(rows, "a phase that both runs have")
    first, second = tracks_of(comparison.first), tracks_of(comparison.second)
    stages = [
        stage for stage in STAGES
        if stage in first and stage in second and first[stage].margin_unit == second[stage].margin_unit
    ]  # fmt: skip
    need(stages, "a margin of both runs in the same unit")
    most = max(len(row.supports) for row in rows)
    figure, grid = new_grid(
        max(9.0, 1.3 * len(rows)), 1.2 + 2.2 * len(stages) + 0.14 * most, "Margins of two runs",
        len(stages), 1, top=0.55, bottom=0.4 + 0.14 * most,
    )  # fmt: skip
    for number, stage in enumerate(stages):
        axes = figure.add_subplot(grid[number])
        for which, (name, track) in enumerate(
            zip(comparison.names, (first[stage], second[stage]), strict=True)
        ):
            _draw(axes, rows, track, which, name)
        axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
        unit = first[stage].margin_unit
        last = number == len(stages) - 1
        dress(axes, f"{stage} [{unit}]", "supports of the phase" if last else "")
        axes.set_xticks(np.arange(len(rows)) + 0.5)
        axes.set_xticklabels([named_below(row.supports) for row in rows] if last else [])
        axes.tick_params(axis="x", labelsize=7, length=0)
        axes.grid(False, axis="x")
        for edge in range(1, len(rows)):
            axes.axvline(edge, color="#B9BEC6", linewidth=0.7, linestyle=(0, (4, 3)))
        axes.set_xlim(0.0, len(rows))
    legend_in_title(figure, axes)
    return figure


def _draw(axes: Axes, rows: list[TimingRow], track: ComTrack, which: int, name: str) -> None:
    for column, row in enumerate(rows):
        phase = row.second if which else row.first
        if phase is None:
            continue
        inside = (track.time >= phase.start_s) & (track.time < phase.end_s)
        share = (track.time[inside] - phase.start_s) / phase.duration_s
        axes.plot(
            column + share, track.margin[inside], color=RUN_COLOURS[which], zorder=3 + which,
            linewidth=1.0 if which else 2.2, label=name if column == 0 else None,
        )  # fmt: skip
