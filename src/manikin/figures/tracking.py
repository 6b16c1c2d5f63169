"""How closely the execution follows the plan."""

import numpy as np
from matplotlib.figure import Figure

from manikin.errors import MotionFileError
from manikin.figures.style import (
    COLOURS,
    draw_contact_strip,
    draw_phases,
    dress,
    end_of,
    legend_above,
    new_figure,
    readable,
)
from manikin.motion.derived import effector_positions, phases_of
from manikin.motion.file import MotionFile
from manikin.spatial import FloatArray

_AXIS_COLOURS = ("#0072B2", "#009E73", "#E69F00")
_FEET = ("left_foot", "right_foot")


def tracking_figure(content: MotionFile) -> Figure:
    """Draw the errors of the CoM and of the feet [mm].

    Args:
        content: Both motions, and the body.

    Raises:
        MotionFileError: If one of them is missing.
    """
    planned, executed, body = content.planned, content.executed, content.body
    if planned is None or executed is None or body is None:
        raise MotionFileError(
            "tracking needs a planned and an executed motion and the body; valid: all three"
        )
    phases = phases_of(planned, content.schedule)
    end = end_of(content, phases)
    figure = new_figure(11.0, 6.0, "Tracking errors of the execution")
    grid = figure.add_gridspec(3, 1, height_ratios=[0.22, 1, 1])
    draw_contact_strip(figure.add_subplot(grid[0]), phases, end)
    axes = figure.add_subplot(grid[1])
    draw_phases(axes, phases, end)
    error = 1000.0 * (executed.com - _at(executed.time, planned.time, planned.com))
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
    names = tuple(name for name in _FEET if name in body.effectors)
    wanted, found = effector_positions(body, planned, names), effector_positions(body, executed, names)
    for name in names:
        gap = 1000.0 * np.linalg.norm(found[name] - _at(executed.time, planned.time, wanted[name]), axis=1)
        label = f"{readable(name)} (largest {gap.max():.2g} mm)"
        feet.plot(executed.time, gap, color=COLOURS[name], linewidth=1.2, label=label)
    dress(feet, "feet [mm]", "time [s]")
    legend_above(feet)
    return figure


def _at(times: FloatArray, known_times: FloatArray, values: FloatArray) -> FloatArray:
    """(n, 3) values interpolated at other times; held before the first and after the last."""
    return np.column_stack([np.interp(times, known_times, column) for column in values.T])
