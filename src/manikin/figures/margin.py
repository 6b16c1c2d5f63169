"""The stability margin in time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from manikin.figures.style import (
    COLOURS,
    STYLES,
    draw_contact_strip,
    draw_phases,
    dress,
    end_of,
    legend_in_title,
    new_figure,
)
from manikin.motion import Motion
from manikin.motion.derived import PhaseTable, phases_of
from manikin.motion.file import MotionFile


def margin_figure(content: MotionFile) -> Figure:
    """Draw the margin, planned and executed, with the minimum of each phase and of the whole.

    Args:
        content: At least one motion.
    """
    phases = phases_of(next(iter(content.motions.values())), content.schedule)
    end = end_of(content, phases)
    figure = new_figure(11.0, 4.8, "Stability margin")
    grid = figure.add_gridspec(2, 1, height_ratios=[0.16, 1])
    draw_contact_strip(figure.add_subplot(grid[0]), phases, end)
    axes = figure.add_subplot(grid[1])
    draw_phases(axes, phases, end)
    axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
    for number, (name, motion) in enumerate(content.motions.items()):
        axes.plot(motion.time, motion.margin, label=f"{name} ({_lowest(motion, phases)})", **STYLES[name])
        _mark_minima(axes, motion, phases, name, below=number > 0)
    dress(axes, "margin [N.m]", "time [s]")
    low = min(0.0, *(float(motion.margin.min()) for motion in content.motions.values()))
    high = max(float(motion.margin.max()) for motion in content.motions.values())
    axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    legend_in_title(figure, axes)
    return figure


def _lowest(motion: Motion, phases: PhaseTable) -> str:
    index = int(np.argmin(motion.margin))
    phase = int(phases.phase_at(motion.time[index : index + 1])[0])
    where = f"in phase {phase}" if motion.time[index] <= phases.instants[-1] else "at rest"
    return f"lowest {motion.margin[index]:.1f} N.m {where}, {motion.time[index]:.2f} s"


def _mark_minima(axes: Axes, motion: Motion, phases: PhaseTable, name: str, *, below: bool) -> None:
    inside = phases.phase_at(motion.time)
    for phase in range(len(phases)):
        samples = np.flatnonzero(inside == phase)
        if not len(samples):
            continue
        index = samples[np.argmin(motion.margin[samples])]
        time, margin = float(motion.time[index]), float(motion.margin[index])
        axes.plot(time, margin, "o", markersize=3.5, color=COLOURS[name], zorder=5)
        axes.annotate(
            f"{margin:.0f}", (time, margin), (0, -11 if below else 5), textcoords="offset points", fontsize=7,
            ha=_alignment(time, phases), color=COLOURS[name], zorder=6,
        )  # fmt: skip
    index = int(np.argmin(motion.margin))
    axes.plot(
        motion.time[index], motion.margin[index], "o", markersize=9, markerfacecolor="none",
        markeredgecolor=COLOURS[name], markeredgewidth=1.4, zorder=6,
    )  # fmt: skip


def _alignment(time: float, phases: PhaseTable) -> str:
    """Alignment of a label that keeps it inside the axes."""
    first, last = float(phases.instants[0]), float(phases.instants[-1])
    edge = 0.01 * (last - first)
    return "left" if time < first + edge else "right" if time > last - edge else "center"
