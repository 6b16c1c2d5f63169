"""Where feet and hands are in time, planned and executed."""

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
    readable,
)
from manikin.figures.tracking import interpolated
from manikin.record import RunRecord


def effectors_figure(record: RunRecord) -> Figure:
    """Draw the coordinates of every foot and hand in contact ([Qiu2012]_ Fig. 6.10, 7.15).

    Args:
        record: With a motion and the body; the largest error is named when there are both motions.

    Raises:
        FigureError: If there is no whole-body motion.
    """
    paths = need(record.effector_paths, "a whole-body motion and the body")
    names = list(next(iter(paths.values())))
    need(names, "an effector in contact")
    phases = need(record.phases, "phases")
    end = end_of(record)
    figure, grid = new_grid(
        max(4.4 * len(names), 7.0), 7.0, "Feet and hands", 4, len(names), left=label_room(names), top=0.75,
        between=0.22, across=0.5, height_ratios=[0.14 * max(len(names), 2), 1, 1, 1],
    )  # fmt: skip
    for column, name in enumerate(names):
        strip = figure.add_subplot(grid[0, column])
        draw_contact_strip(strip, phases, end)
        strip.set_title(_title(record, name), fontsize=10, loc="left", pad=12)
        if column > 0:
            strip.set_yticklabels([])
        for row, axis in enumerate("xyz"):
            axes = figure.add_subplot(grid[row + 1, column])
            draw_phases(axes, phases, end)
            for kind, found in paths.items():
                axes.plot(record.motions[kind].time, found[name][:, row], label=kind, **STYLES[kind])
            dress(axes, f"{axis} [m]" if column == 0 else "", "time [s]" if row == 2 else "")
            axes.tick_params(labelbottom=row == 2)
            low, high = axes.get_ylim()
            if high - low < 0.02:  # what hardly moves is not magnified
                axes.set_ylim((low + high) / 2 - 0.01, (low + high) / 2 + 0.01)
    legend_in_title(figure, axes)
    return figure


def _title(record: RunRecord, name: str) -> str:
    title = readable(name).capitalize()
    if len(record.effector_paths) < 2:
        return title
    planned, executed = record.motions["planned"], record.motions["executed"]
    plan = interpolated(executed.time, planned.time, record.effector_paths["planned"][name])
    error = np.linalg.norm(record.effector_paths["executed"][name] - plan, axis=1)
    return f"{title} (largest error {1000.0 * error.max():.2g} mm)"
