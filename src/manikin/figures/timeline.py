"""Panels over time below a strip that shows which contacts are held."""

from dataclasses import dataclass
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from manikin.figures.style import draw_contact_strip, draw_phases, dress, end_of, label_room, need, new_grid
from manikin.motion.derived import PhaseTable
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
            axes.set_title(title, fontsize=10, loc="left", pad=12)
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
