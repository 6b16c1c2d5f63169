"""Walking paths seen from above, with the body's heading along them."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from manikin.errors import FigureError
from manikin.figures.style import dress, new_grid
from manikin.locomotion import WalkingPath, WalkObstacle
from manikin.palette import COLOURS

KINDS = {"holonomic": COLOURS["executed"], "nonholonomic": COLOURS["planned"]}

_HEADING_EVERY = 0.5
"""Time between the bodies drawn along a path [s]."""

_PANEL = 3.4
"""Width of a panel [inch]."""

_BESIDE = 0.6
"""Room shown beside the paths [m]."""


def walking_paths_figure(groups: Mapping[str, Sequence[WalkingPath]], title: str = "Walking paths") -> Figure:
    """Draw paths from above, one panel for each group.

    Short bars are shoulders every half second; colours tell where the body goes ahead and where it does not.

    Args:
        groups: Paths by the title of their panel.
        title: Of the figure.

    Raises:
        FigureError: If there is no path.
    """
    shown = {name: paths for name, paths in groups.items() if paths}
    if not shown:
        raise FigureError("this figure needs a walking path, and there is none; valid: at least one")
    points = np.vstack([path.place[:, :2] for paths in shown.values() for path in paths])
    low, high = points.min(axis=0) - _BESIDE, points.max(axis=0) + _BESIDE
    columns = min(4, len(shown))
    rows = -(-len(shown) // columns)
    tall = _PANEL * (high[1] - low[1]) / (high[0] - low[0])
    width, height = columns * (_PANEL + 0.45) + 0.6, rows * (tall + 0.65) + 0.7
    figure, grid = new_grid(width, height, title, rows, columns, between=0.65, across=0.45, top=0.7)
    for number, (name, paths) in enumerate(shown.items()):
        axes = figure.add_subplot(grid[number // columns, number % columns])
        for path in paths:
            _draw_path(axes, path)
        for obstacle in paths[0].task.obstacles:
            draw_obstacle(axes, obstacle)
        dress(
            axes,
            "y [m]" if number % columns == 0 else "",
            "x [m]" if number // columns == rows - 1 else "",
            name,
        )
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    _legend(figure)
    return figure


def _draw_path(axes: Axes, path: WalkingPath) -> None:
    place = path.place
    segments = np.stack([place[:-1, :2], place[1:, :2]], axis=1)
    kinds = ["holonomic" if flag else "nonholonomic" for flag in path.holonomic[:-1]]
    axes.add_collection(
        LineCollection(list(segments), colors=[KINDS[kind] for kind in kinds], linewidths=1.3)
    )
    times = np.append(np.arange(0.0, path.duration, _HEADING_EVERY), path.duration)
    half = path.task.walker.width / 4  # half size, so that neighbours do not hide each other
    at = path.place_at(times)
    across = half * np.column_stack([-np.sin(at[:, 2]), np.cos(at[:, 2])])
    bars = np.stack([at[:, :2] - across, at[:, :2] + across], axis=1)
    axes.add_collection(LineCollection(list(bars), colors=COLOURS["soft"], linewidths=0.6, zorder=1.5))
    goal = path.task.goal
    step = 0.28 * np.array([np.cos(goal[2]), np.sin(goal[2])])
    arrow = {"arrowstyle": "-|>", "color": COLOURS["ink"], "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    tip, foot = (goal[:2] + step).tolist(), goal[:2].tolist()
    axes.annotate("", (tip[0], tip[1]), (foot[0], foot[1]), arrowprops=arrow, zorder=5)
    axes.plot(*path.task.start[:2], "o", color=COLOURS["ink"], markersize=3.5, zorder=6)


def draw_obstacle(axes: Axes, obstacle: WalkObstacle) -> None:
    """Outline where it begins, and dashed where it ends if it moves."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24 * len(obstacle.corners), endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    corners = obstacle.corners[np.argmax(circle @ obstacle.corners.T, axis=1)]
    outline = corners + obstacle.radius * circle
    last = len(obstacle.times) - 1
    for index in sorted({0, last}):
        moved = outline + obstacle.displacements[index]
        dashed = index == last and obstacle.moves
        axes.add_patch(
            Polygon(
                moved, facecolor="none" if dashed else COLOURS["obstacle"], edgecolor=COLOURS["soft"],
                linestyle="--" if dashed else "-", linewidth=0.9, zorder=1,
            )
        )  # fmt: skip


def _legend(figure: Figure) -> None:
    axes = figure.axes[0]
    for kind, colour in KINDS.items():
        axes.plot([], [], color=colour, label=kind)
    axes.plot([], [], color=COLOURS["soft"], linewidth=0.8, label="shoulders, half width")
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="upper right",
        ncols=3,
        fontsize=8.5,
        frameon=False,
        borderaxespad=0.3,
    )
