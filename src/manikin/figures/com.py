"""Position, velocity and acceleration of the centre of mass in time."""

import numpy as np
from matplotlib.figure import Figure

from manikin.figures.style import (
    STYLES,
    draw_contact_strip,
    draw_phases,
    dress,
    end_of,
    label_room,
    legend_in_title,
    need,
    new_grid,
)
from manikin.record import RunRecord
from manikin.spatial import FloatArray

QUANTITIES = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"))


def com_figure(record: RunRecord) -> Figure:
    """Draw the CoM along each axis, planned and executed ([Qiu2012]_ Fig. 5.12, 5.22, 6.9, 7.8, 7.14).

    Args:
        record: With a planned CoM, or at least one motion.

    Raises:
        FigureError: If it has neither.
    """
    tracks = need(record.tracks, "a motion of the centre of mass")
    phases = need(record.phases, "phases")
    end = end_of(record)
    figure, grid = new_grid(
        14.0, 7.0, "Centre of mass", 4, 3, left=label_room(record.effectors), top=0.75, between=0.22,
        across=0.75, height_ratios=[0.14 * max(len(record.effectors), 2), 1, 1, 1],
    )  # fmt: skip
    for column, (quantity, unit) in enumerate(QUANTITIES):
        strip = figure.add_subplot(grid[0, column])
        draw_contact_strip(strip, phases, end)
        strip.set_title(quantity.capitalize(), fontsize=10, loc="left", pad=12)
        if column > 0:
            strip.set_yticklabels([])
        for row, axis in enumerate("xyz"):
            axes = figure.add_subplot(grid[row + 1, column])
            draw_phases(axes, phases, end)
            shown = []
            for name, track in tracks.items():
                values = getattr(track, quantity)[:, row]
                axes.plot(track.time, values, label=name, **STYLES[name])
                shown.append(values)
            if quantity == "acceleration":
                axes.set_ylim(_without_spikes(np.concatenate(shown)))
            dress(axes, f"{axis} [{unit}]", "time [s]" if row == 2 else "")
            axes.tick_params(labelbottom=row == 2)
    legend_in_title(figure, axes)
    return figure


def _without_spikes(values: FloatArray) -> tuple[float, float]:
    """Limits that hold all but the impacts of some milliseconds."""
    low, high = (float(v) for v in np.percentile(values, (0.5, 99.5)))
    room = 0.15 * max(high - low, 0.02)
    return max(low - room, float(values.min()) - room), min(high + room, float(values.max()) + room)
