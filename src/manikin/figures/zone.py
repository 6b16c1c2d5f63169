"""The holonomic zone around a start, seen from above, and the lengths of holonomic ends by category."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from manikin.errors import FigureError
from manikin.figures.style import dress, legend_in_title, new_figure, new_grid
from manikin.figures.walking import KINDS
from manikin.locomotion import CategoryStatistics, HolonomicZone
from manikin.locomotion.zone import THESIS_RADIUS
from manikin.palette import COLOURS

_BARS = {"mean": "#4D4D4D", "average deviation": "#56B4E9", "largest deviation": "#E69F00"}


def holonomic_zone_figure(zones: Mapping[str, HolonomicZone]) -> Figure:
    """Draw goals around the start, which looks up ([Truong2010]_ Fig. 4.23).

    Filled marks are goals reached wholly holonomically, open ones others; drawn are goals that count.

    Args:
        zones: By the title of their panel.

    Raises:
        FigureError: If no goal counts.
    """
    shown = {name: zone for name, zone in zones.items() if np.any(zone.considered)}
    if not shown:
        raise FigureError(
            "this figure needs goals around a start, and none counts; valid: goals aside and ahead"
        )
    far = max(float(zone.distances[zone.considered].max()) for zone in shown.values()) + 0.15
    figure, grid = new_grid(
        0.8 + 4.3 * len(shown),
        4.1,
        "Goals reached wholly holonomically",
        1,
        len(shown),
        top=0.75,
        bottom=0.95,
    )
    circle = np.linspace(0.0, np.pi, 91)
    for number, (name, zone) in enumerate(shown.items()):
        axes = figure.add_subplot(grid[0, number])
        for whole, colour in ((True, KINDS["holonomic"]), (False, KINDS["nonholonomic"])):
            chosen = zone.goals[zone.considered & (zone.whole == whole)]
            axes.plot(
                -chosen[:, 1], chosen[:, 0], "o", markersize=4.5, markeredgecolor=colour, linestyle="none",
                markerfacecolor=colour if whole else "none",
                label="holonomic from start to goal" if whole else "with a nonholonomic part",
            )  # fmt: skip
        radii = {"radius of the zone": (zone.radius, "-"), "of the thesis": (THESIS_RADIUS, "--")}
        for label, (radius, line) in radii.items():
            x, y = radius * np.cos(circle), radius * np.sin(circle)
            axes.plot(x, y, line, color=COLOURS["ink"], linewidth=1.0, label=label)
        axes.plot(0.0, 0.0, "^", color=COLOURS["ink"], markersize=7)
        dress(axes, "ahead [m]" if number == 0 else "", "to the right [m]", f"{name}: {zone.radius:.2f} m")
        axes.set_aspect("equal")
        axes.set_xlim(-far, far)
        axes.set_ylim(-0.15, far)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(), loc="lower center", ncols=4, fontsize=8.5, frameon=False
    )
    return figure


def holonomic_ends_figure(statistics: Mapping[str, CategoryStatistics]) -> Figure:
    """Draw PLO and PLG by category as bars: mean, AD and MD ([Truong2010]_ Fig. 4.20, 4.21).

    Args:
        statistics: By category.

    Raises:
        FigureError: If there is no category.
    """
    if not statistics:
        raise FigureError("this figure needs walks of a category, and there are none; valid: at least one")
    figure = new_figure(8.4, 5.2, "Holonomic ends of walks by category")
    places = np.arange(len(statistics))
    ends = {"from origin (PLO) [m]": "from_origin", "to goal (PLG) [m]": "to_goal"}
    for row, (label, name) in enumerate(ends.items()):
        axes = figure.add_subplot(2, 1, row + 1)
        for number, (kind, colour) in enumerate(_BARS.items()):
            spreads = [getattr(one, name) for one in statistics.values()]
            heights = [getattr(one, kind.replace(" ", "_")) for one in spreads]
            axes.bar(places + 0.27 * (number - 1), heights, 0.25, color=colour, label=kind)
        axes.set_xticks(places, list(statistics))
        dress(axes, label)
    legend_in_title(figure, figure.axes[0])
    return figure
