"""Position and velocity of the centre of mass in time."""

from matplotlib.figure import Figure

from manikin.figures.style import (
    STYLES,
    draw_contact_strip,
    draw_phases,
    dress,
    end_of,
    legend_in_title,
    new_figure,
)
from manikin.motion.derived import com_velocity, phases_of
from manikin.motion.file import MotionFile


def com_figure(content: MotionFile) -> Figure:
    """Draw the CoM's position and velocity along each axis, planned and executed.

    Args:
        content: At least one motion.
    """
    phases = phases_of(next(iter(content.motions.values())), content.schedule)
    end = end_of(content, phases)
    figure = new_figure(11.0, 7.0, "Centre of mass")
    grid = figure.add_gridspec(4, 2, height_ratios=[0.28, 1, 1, 1])
    for column, (quantity, unit) in enumerate((("position", "m"), ("velocity", "m/s"))):
        strip = figure.add_subplot(grid[0, column])
        draw_contact_strip(strip, phases, end)
        strip.set_title(quantity.capitalize(), fontsize=10, loc="left", pad=12)
        for row, axis in enumerate("xyz"):
            axes = figure.add_subplot(grid[row + 1, column])
            draw_phases(axes, phases, end)
            for name, motion in content.motions.items():
                values = motion.com if quantity == "position" else com_velocity(motion)
                axes.plot(motion.time, values[:, row], label=name, **STYLES[name])
            dress(axes, f"{axis} [{unit}]", "time [s]" if row == 2 else "")
            axes.tick_params(labelbottom=row == 2)
    legend_in_title(figure, axes)
    return figure
