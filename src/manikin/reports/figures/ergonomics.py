"""Scores of RULA and REBA over time, and how much of the strength of which joints is used."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from manikin.ergonomics import Assessment, Ergonomics, JointStrength
from manikin.errors import FigureError
from manikin.reports.figures.style import dress, legend_above, new_grid
from manikin.runtime.palette import COLOURS, CYCLE, readable

LEVEL_COLOURS = ("#DDEBDD", "#EFF3D2", "#FBEBC3", "#F6D2BB", "#EDB4B1")
"""Colours of the action levels, the least urgent first; RULA's four levels begin at the second."""

LEVELS = {
    "RULA": ("acceptable", "investigate", "change soon", "change now"),
    "REBA": ("negligible", "low", "medium", "high", "very high"),
}
"""Action levels, in a word."""

SHOWN_JOINTS = 5
"""Joints whose shares are drawn, those with the largest peaks."""

_RULA_ENDS, _REBA_ENDS = (2, 4, 6, 7), (1, 3, 7, 10, 15)


def ergonomics_figure(found: Ergonomics, title: str = "Ergonomics") -> Figure:
    """Draw the scores of both sides over the colours of the action levels, and the largest torque shares.

    Args:
        found: Of a motion of more than one frame.

    Raises:
        FigureError: If there is neither a score nor a torque to draw.
    """
    posture, strength = found.posture, found.strength
    rows = 2 * (posture is not None) + (strength is not None)
    if rows == 0 or len(found.time) < 2:
        raise FigureError("this figure needs scores or torques over time; valid: a motion of a human")
    figure, grid = new_grid(11.0, 0.9 + 2.3 * rows, title, rows, 1, between=0.45, left=0.6)
    panels = [figure.add_subplot(grid[row, 0]) for row in range(rows)]
    if posture is not None:
        _draw_scores(panels[0], posture.rula, _RULA_ENDS, LEVEL_COLOURS[1:])
        _draw_scores(panels[1], posture.reba, _REBA_ENDS, LEVEL_COLOURS)
    if strength is not None:
        _draw_shares(panels[-1], found, strength)
    for axes in panels:
        axes.set_xlim(float(found.time[0]), float(found.time[-1]))
        axes.tick_params(labelbottom=axes is panels[-1])
    panels[-1].set_xlabel("time [s]", fontsize=9)
    return figure


def _draw_scores(axes: Axes, one: Assessment, ends: Sequence[int], colours: Sequence[str]) -> None:
    """Both sides as steps over the bands of the action levels."""
    beginnings = (1, *(end + 1 for end in ends[:-1]))
    for first, last, colour in zip(beginnings, ends, colours, strict=True):
        axes.axhspan(first - 0.5, last + 0.5, color=colour, linewidth=0, zorder=0)
    styles = {"left": ("#0072B2", 0.06), "right": ("#D55E00", -0.06)}
    for side, (colour, aside) in styles.items():
        axes.step(one.time, one.sides[side] + aside, where="mid", color=colour, linewidth=1.3, label=side)
    dress(axes, f"{one.method} score")
    axes.grid(visible=False)
    axes.set_ylim(0.5, ends[-1] + 0.5)
    axes.set_yticks(range(1, ends[-1] + 1, 1 if ends[-1] < 10 else 2))
    lines, _ = axes.get_legend_handles_labels()
    levels = zip(colours, LEVELS[one.method], strict=True)
    legend_above(axes, [*lines, *(Patch(color=colour, label=level) for colour, level in levels)])


def _draw_shares(axes: Axes, found: Ergonomics, strength: JointStrength) -> None:
    for number, index in enumerate(strength.order[:SHOWN_JOINTS]):
        name = readable(strength.joint_names[index])
        label = f"{name} ({strength.peak[index]:.0%})"
        axes.plot(found.time, strength.share[:, index], color=CYCLE[number], linewidth=1.1, label=label)
    axes.axhline(1.0, color=COLOURS["ink"], linewidth=0.8)
    axes.axhline(strength.fraction, color=COLOURS["soft"], linewidth=0.8, linestyle=(0, (4, 3)))
    dress(axes, "torque per strength")
    axes.set_ylim(0.0, 1.05 * max(1.0, float(np.nanmax(strength.peak))))
    legend_above(axes)
