"""How closely the execution follows the plan."""

import numpy as np
from matplotlib.figure import Figure

from manikin.figures.style import legend_above, need
from manikin.figures.timeline import timeline
from manikin.palette import COLOURS, colours_of, readable
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
    paths = need(record.effector_paths, "a body")
    shown = timeline(record, (11.0, 6.0), "Tracking errors of the execution", 2)
    shown.strip()
    axes = shown.panel(1)
    error = 1000.0 * (executed.com - interpolated(executed.time, planned.time, planned.com))
    for index, axis in enumerate("xyz"):
        axes.plot(executed.time, error[:, index], color=_AXIS_COLOURS[index], linewidth=1.0, label=axis)
    size = np.linalg.norm(error, axis=1)
    root_mean_square = float(np.sqrt(np.mean(size**2)))
    label = f"distance (RMS {root_mean_square:.2g} mm, largest {size.max():.2g} mm)"
    axes.plot(executed.time, size, color=COLOURS["ink"], linewidth=1.4, label=label)
    shown.label(axes, "centre of mass [mm]")
    legend_above(axes)
    feet = shown.panel(2)
    wanted, found = paths["planned"], paths["executed"]
    colours = colours_of(found)
    for name in found:
        plan = interpolated(executed.time, planned.time, wanted[name])
        gap = 1000.0 * np.linalg.norm(found[name] - plan, axis=1)
        label = f"{readable(name)} (largest {gap.max():.2g} mm)"
        feet.plot(executed.time, gap, color=colours[name], linewidth=1.2, label=label)
    shown.label(feet, "effectors [mm]")
    legend_above(feet)
    return shown.figure


def interpolated(times: FloatArray, known_times: FloatArray, values: FloatArray) -> FloatArray:
    """(n, 3) values interpolated at other times; held before the first and after the last."""
    return np.column_stack([np.interp(times, known_times, column) for column in values.T])
