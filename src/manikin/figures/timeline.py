"""Panels over time below a strip that shows which contacts are held."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from manikin.figures.labels import Labels
from manikin.figures.style import dress, end_of, label_room, need, new_grid
from manikin.motion.derived import PhaseTable
from manikin.palette import COLOURS, colours_of, readable
from manikin.record import RunRecord


@dataclass(frozen=True, eq=False)
class Timeline:
    """A figure whose first row shows the contacts and whose other rows are panels over time.

    Attributes:
        figure: The figure.
        grid: Its grid; the strips stand in row 0.
        phases: The phases, shaded in every panel.
        end: Last instant that is shown [s].
    """

    figure: Figure
    grid: GridSpec
    phases: PhaseTable
    end: float

    def strip(self, column: int = 0, title: str = "", *, named: bool = True) -> None:
        """Draw the contacts over the panels of a column, with the names of the effectors beside them."""
        axes = self.figure.add_subplot(self.grid[0, column])
        draw_contact_strip(axes, self.phases, self.end)
        if title:
            axes.set_title(title, fontsize=10, loc="left", pad=15)
        if not named:
            axes.set_yticklabels([])

    def panel(self, row: int, column: int = 0) -> Axes:
        """Axes over time with the phases shaded; ``row`` counts from 1, below the strip."""
        axes = self.figure.add_subplot(self.grid[row, column])
        draw_phases(axes, self.phases, self.end)
        return axes

    def label(self, axes: Axes, ylabel: str) -> None:
        """Dress a panel; only the lowest one of its column has times below it."""
        place = axes.get_subplotspec()
        lowest = place is not None and place.is_last_row()
        dress(axes, ylabel, "time [s]" if lowest else "")
        axes.tick_params(labelbottom=lowest)


def timeline(
    record: RunRecord,
    size: tuple[float, float],
    title: str,
    panels: int,
    columns: int = 1,
    *,
    strip: float = 0.1,
    **margins: Any,
) -> Timeline:
    """Make the figure and its grid; the strips and panels are drawn when asked for.

    Args:
        record: With phases.
        size: Width and height of the figure [inch].
        title: Of the figure.
        panels: Rows of panels below the strip.
        columns: Of strips and panels.
        strip: Height of the strip for each effector, relative to that of a panel.
        margins: Of :func:`manikin.figures.style.new_grid`.

    Raises:
        FigureError: If the record has no phases.
    """
    phases = need(record.phases, "phases")
    heights = [strip * max(len(record.effectors), 2)] + [1.0] * panels
    margins = {"left": label_room(record.effectors), **margins}
    figure, grid = new_grid(*size, title, 1 + panels, columns, height_ratios=heights, **margins)
    return Timeline(figure, grid, phases, end_of(record))


def draw_phases(axes: Axes, phases: PhaseTable, end: float) -> None:
    """Shade single supports and draw a line at every key instant; time runs to ``end`` [s]."""
    for start, stop, supports in _spans(phases, end):
        if len(supports) <= 1:
            axes.axvspan(start, stop, color=COLOURS["shade"], zorder=0, linewidth=0)
    for instant in phases.instants:
        axes.axvline(float(instant), color="#B9BEC6", linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
    axes.set_xlim(float(phases.instants[0]), end)


def draw_contact_strip(axes: Axes, phases: PhaseTable, end: float) -> None:
    """One bar per effector while it is in contact, and the numbers of the phases, from 0, above."""
    effectors = list(dict.fromkeys(name for supports in phases.supports for name in supports))
    colours = colours_of(effectors)
    for row, effector in enumerate(effectors):
        bars = [(start, stop - start) for start, stop, on in _spans(phases, end) if effector in on]
        axes.broken_barh(bars, (row + 0.15, 0.7), facecolors=colours[effector], alpha=0.85)
    axes.set_yticks(np.arange(len(effectors)) + 0.5, [readable(name) for name in effectors], fontsize=8)
    axes.set_ylim(len(effectors) + 0.05, 0.0)
    axes.set_xlim(float(phases.instants[0]), end)
    axes.tick_params(length=0, labelbottom=False)
    axes.set_xticks([])
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)
    _number_phases(axes, phases, end)


def _number_phases(axes: Axes, phases: PhaseTable, end: float) -> None:
    """Number the phases above a strip where there is room, the long ones first."""
    labels = Labels(axes)
    order = np.argsort(-np.diff(phases.instants), kind="stable")
    for number in order:
        middle = float(phases.instants[number : number + 2].mean())
        labels.write(f"{number}", (middle, 0.0), (0.0, 2.0), size=8, ha="center", color=COLOURS["ink"])
    if end > phases.instants[-1] + 0.2:
        middle = (float(phases.instants[-1]) + end) / 2
        labels.write("rest", (middle, 0.0), (0.0, 2.0), size=8, ha="center", color=COLOURS["soft"])


def _spans(phases: PhaseTable, end: float) -> list[tuple[float, float, tuple[str, ...]]]:
    """Start, end and supports of each phase; the last one lasts until ``end``."""
    stops = [*(float(t) for t in phases.instants[1:-1]), max(end, float(phases.instants[-1]))]
    starts = [float(t) for t in phases.instants[:-1]]
    return list(zip(starts, stops, phases.supports, strict=True))
