"""The common look of the figures: colours, axes, phase bands."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from manikin.motion.derived import PhaseTable
from manikin.motion.file import MotionFile

COLOURS = {
    "planned": "#0072B2",
    "executed": "#D55E00",
    "left_foot": "#009E73",
    "right_foot": "#CC79A7",
    "left_hand": "#56B4E9",
    "right_hand": "#E69F00",
    "ink": "#222222",
    "soft": "#8A8A8A",
    "shade": "#EEF1F5",
    "obstacle": "#C9CED6",
}
"""Okabe and Ito's palette, which colour-blind readers can tell apart."""

STYLES: dict[str, dict[str, Any]] = {
    "planned": {"color": COLOURS["planned"], "linewidth": 1.6, "zorder": 3},
    "executed": {"color": COLOURS["executed"], "linewidth": 1.1, "zorder": 4},
}
DPI = 150


def new_figure(width: float, height: float, title: str) -> Figure:
    """Figure of the given size [inch] with its own canvas, no window and no global state."""
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=12, fontweight="bold", color=COLOURS["ink"], x=0.01, ha="left")
    return figure


def dress(axes: Axes, ylabel: str = "", xlabel: str = "", title: str = "") -> None:
    """Give axes their labels and a quiet frame."""
    axes.set_ylabel(ylabel, fontsize=9)
    axes.set_xlabel(xlabel, fontsize=9)
    if title:
        axes.set_title(title, fontsize=10, loc="left", color=COLOURS["ink"])
    axes.tick_params(labelsize=8, color=COLOURS["soft"])
    axes.grid(True, color="#E3E3E3", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(COLOURS["soft"])


def readable(effector: str) -> str:
    """Name of an effector for people."""
    return effector.replace("_", " ")


def end_of(content: MotionFile, phases: PhaseTable) -> float:
    """Last instant that a motion or a phase reaches [s]."""
    return max(float(phases.instants[-1]), *(float(motion.time[-1]) for motion in content.motions.values()))


def draw_phases(axes: Axes, phases: PhaseTable, end: float) -> None:
    """Shade single supports and draw a line at every key instant; time runs to ``end`` [s]."""
    for start, stop, supports in _spans(phases, end):
        if len(supports) <= 1:
            axes.axvspan(start, stop, color=COLOURS["shade"], zorder=0, linewidth=0)
    for instant in phases.instants:
        axes.axvline(float(instant), color="#B9BEC6", linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
    axes.set_xlim(float(phases.instants[0]), end)


def draw_contact_strip(axes: Axes, phases: PhaseTable, end: float) -> None:
    """One bar per effector while it is in contact, and the number of each phase, from 0, above."""
    effectors = list(dict.fromkeys(name for supports in phases.supports for name in supports))
    for row, effector in enumerate(effectors):
        bars = [(start, stop - start) for start, stop, on in _spans(phases, end) if effector in on]
        colour = COLOURS.get(effector, COLOURS["soft"])
        axes.broken_barh(bars, (row + 0.15, 0.7), facecolors=colour, alpha=0.85)
    for number, (start, stop) in enumerate(zip(phases.instants, phases.instants[1:], strict=False)):
        axes.text(
            (float(start) + float(stop)) / 2, -0.08, f"{number}", ha="center", va="bottom", fontsize=8,
            color=COLOURS["ink"],
        )  # fmt: skip
    if end > phases.instants[-1] + 0.2:
        middle = (float(phases.instants[-1]) + end) / 2
        axes.text(middle, -0.08, "rest", ha="center", va="bottom", fontsize=8, color=COLOURS["soft"])
    axes.set_yticks(np.arange(len(effectors)) + 0.5, [readable(name) for name in effectors], fontsize=8)
    axes.set_ylim(len(effectors) + 0.05, 0.0)
    axes.set_xlim(float(phases.instants[0]), end)
    axes.tick_params(length=0, labelbottom=False)
    axes.set_xticks([])
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)


def white_edge() -> withStroke:
    """Path effect that keeps a text readable on top of lines."""
    return withStroke(linewidth=2.5, foreground="white")


def legend_above(axes: Axes) -> None:
    """A legend in one row above the right end of the axes, where it hides nothing."""
    axes.legend(
        fontsize=8,
        frameon=False,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1,
        ncols=len(axes.get_legend_handles_labels()[0]),
        handlelength=1.6,
        columnspacing=1.4,
    )


def legend_in_title(figure: Figure, axes: Axes) -> None:
    """A legend of ``axes`` in one row at the height of the figure's title."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, fontsize=8.5, frameon=False, loc="upper right", ncols=len(labels), borderaxespad=0.3
    )


def _spans(phases: PhaseTable, end: float) -> list[tuple[float, float, tuple[str, ...]]]:
    """Start, end and supports of each phase; the last one lasts until ``end``."""
    stops = [*(float(t) for t in phases.instants[1:-1]), max(end, float(phases.instants[-1]))]
    starts = [float(t) for t in phases.instants[:-1]]
    return list(zip(starts, stops, phases.supports, strict=True))
