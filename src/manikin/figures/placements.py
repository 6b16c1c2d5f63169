"""Where several people put their feet and hands, seen from above."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse

from manikin.figures.labels import Labels
from manikin.figures.style import dress, need, new_grid
from manikin.mocap.support_placements import Placement
from manikin.palette import COLOURS, colours_of, readable

SHARE = 0.5
"""Of the places in an ellipse, were they normal."""

FEWEST = 3
"""Places of which an ellipse is drawn: two make a line."""


def placements_figure(groups: Mapping[str, Sequence[Placement]]) -> Figure:
    """Draw the places of the supports of each group, with means and ellipses ([Qiu2012]_ Fig. 3.9).

    Args:
        groups: Placements by group, one panel each; the origin of the frame is the cross.

    Raises:
        FigureError: If there is no placement.
    """
    shown = need({name: found for name, found in groups.items() if found}, "a placement")
    everywhere = np.vstack([one.places for found in shown.values() for one in found])
    low, high = everywhere.min(axis=0) - 0.25, everywhere.max(axis=0) + 0.25
    wide = 9.6
    panel = float(np.clip((wide - 0.9) * (high[1] - low[1]) / (high[0] - low[0]), 1.3, 5.0))
    figure, grid = new_grid(
        wide, 0.9 + (panel + 0.7) * len(shown), f"Supports (crosses: means; ellipses: {SHARE:.0%})",
        len(shown), 1, between=0.7, top=0.8, bottom=0.5,
    )  # fmt: skip
    colours = colours_of(one.effector for found in shown.values() for one in found)
    for row, (name, found) in enumerate(shown.items()):
        axes = figure.add_subplot(grid[row])
        motions = len({clip for one in found for clip in one.clips})
        dress(axes, "y [m]", "x [m]", f"{name}, {motions} motions")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_aspect("equal", adjustable="box", anchor="W")
        axes.plot(0.0, 0.0, "+", color=COLOURS["ink"], markersize=10, zorder=2)
        _draw(axes, found, colours)
    keys = [
        Line2D([], [], marker="o", linestyle="", color=colour, label=readable(effector))
        for effector, colour in colours.items()
    ]
    figure.legend(handles=keys, loc="upper right", ncols=len(keys), fontsize=8.5, frameon=False,
                  borderaxespad=0.3)  # fmt: skip
    return figure


def _draw(axes: Axes, found: Sequence[Placement], colours: Mapping[str, str]) -> None:
    for one in found:
        colour = colours[one.effector]
        axes.plot(*one.places.T, "o", color=colour, markersize=3.5, alpha=0.6, zorder=3)
        axes.plot(*one.mean, "x", color=colour, markersize=6, zorder=5)
        if len(one.places) >= FEWEST:
            (long, short), turn = one.ellipse(SHARE)
            ellipse = Ellipse(
                (float(one.mean[0]), float(one.mean[1])), 2 * long, 2 * short, angle=float(np.degrees(turn)),
                fill=False, edgecolor=colour, linewidth=1.2, zorder=4,
            )  # fmt: skip
            axes.add_patch(ellipse)
    labels = Labels(axes)
    for one in sorted(found, key=lambda each: -len(each.places)):
        mean = (float(one.mean[0]), float(one.mean[1]))
        labels.write(f"{one.number}", mean, (0.0, 6.0), ha="center", color=colours[one.effector], zorder=6)
