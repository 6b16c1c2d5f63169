"""How closely the execution follows the plan."""

import numpy as np
from matplotlib.figure import Figure

from manikin.figures.style import (
    COLOURS,
    colours_of,
    draw_contact_strip,
    draw_phases,
    dress,
    end_of,
    label_room,
    legend_above,
    need,
    new_grid,
    readable,
)
from manikin.record import RunRecord
from manikin.spatial import FloatArray

_AXIS_COLOURS = ("#0072B2", "#009E73", "#E69F00")


def tracking_figure(record: RunRecord) -> Figure:
    """Draw the errors of the CoM, the feet and the hands in contact [mm] ([Qiu2012]_ Fig. 6.9, 6.10).

    Args:
        record: With both motions, and the body.

    Raises:
        FigureError: If one of them is missing.
    """
    planned = need(record.motions.get("planned"), "a planned motion")
    executed = need(record.motions.get("executed"), "an executed motion")
    phases = need(record.phases, "phases")
    paths = need(record.effector_paths, "a body")
    end = end_of(record)
    figure, grid = new_grid(
        11.0, 6.0, "Tracking errors of the execution", 3, 1, left=label_room(record.effectors),
        height_ratios=[0.1 * max(len(record.effectors), 2), 1, 1],
    )  # fmt: skip
    draw_contact_strip(figure.add_subplot(grid[0]), phases, end)
    axes = figure.add_subplot(grid[1])
    draw_phases(axes, phases, end)
    error = 1000.0 * (executed.com - interpolated(executed.time, planned.time, planned.com))
    for index, axis in enumerate("xyz"):
        axes.plot(executed.time, error[:, index], color=_AXIS_COLOURS[index], linewidth=1.0, label=axis)
    size = np.linalg.norm(error, axis=1)
    root_mean_square = float(np.sqrt(np.mean(size**2)))
    label = f"distance (RMS {root_mean_square:.2g} mm, largest {size.max():.2g} mm)"
    axes.plot(executed.time, size, color=COLOURS["ink"], linewidth=1.4, label=label)
    dress(axes, "centre of mass [mm]")
    axes.tick_params(labelbottom=False)
    legend_above(axes)
    feet = figure.add_subplot(grid[2])
    draw_phases(feet, phases, end)
    wanted, found = paths["planned"], paths["executed"]
    colours = colours_of(found)
    for name in found:
        plan = interpolated(executed.time, planned.time, wanted[name])
        gap = 1000.0 * np.linalg.norm(found[name] - plan, axis=1)
        label = f"{readable(name)} (largest {gap.max():.2g} mm)"
        feet.plot(executed.time, gap, color=colours[name], linewidth=1.2, label=label)
    dress(feet, "effectors [mm]", "time [s]")
    legend_above(feet)
    return figure


def interpolated(times: FloatArray, known_times: FloatArray, values: FloatArray) -> FloatArray:
    """(n, 3) values interpolated at other times; held before the first and after the last."""
    return np.column_stack([np.interp(times, known_times, column) for column in values.T])
