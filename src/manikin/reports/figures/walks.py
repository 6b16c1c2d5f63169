"""Walking paths seen from above with the body's heading, and where they are holonomic."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import RunRecord
from manikin.reports.figures.style import draw_heading, dress, legend_in_title, need, new_figure, new_grid
from manikin.runtime.palette import COLOURS
from manikin.walking import (
    HOLONOMIC,
    NONHOLONOMIC,
    CategoryStatistics,
    HolonomicZone,
    ShoulderPaths,
    Walker,
    WalkingPath,
    WalkObstacle,
    floor_plan,
    segment_path,
)
from manikin.walking.segments.goal_categories import THESIS_RADIUS

EVERY = 0.5
"""Time between the shoulders drawn along a way [s]."""

SECONDS = 1.0
"""Time between the instants written beside a way, where several people walk [s]."""

BESIDE = 0.7
"""Room shown beside the ways [m]."""


def walk_paths_figure(record: RunRecord) -> Figure:
    """Draw the ways of all who walk, with shoulders every half second, and what stands in the way.

    Args:
        record: Of a run with a walk.

    Raises:
        FigureError: If there is no walk.
    """
    walks = need(dict(record.walks), "a way over the floor")
    figure = new_figure(8.6, 6.4, "Ways over the floor, from above")
    axes = figure.add_subplot()
    if record.scene is not None and record.body is not None:
        for obstacle in floor_plan(record.scene, record.body.stature or 0.0):
            draw_obstacle(axes, obstacle)
    for name, way in walks.items():
        _draw_way(axes, way)
        if len(walks) > 1:
            _write_times(axes, way, name)
    places = np.vstack([way[:, 1:3] for way in walks.values()])
    low, high = places.min(axis=0) - BESIDE, places.max(axis=0) + BESIDE
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal", adjustable="box")
    dress(axes, "y [m]", "x [m]")
    keys = _kind_keys("shoulders, and standing", 1.0)
    figure.legend(handles=keys, loc="outside lower right", ncols=3, fontsize=8.5, frameon=False)
    return figure


def _draw_way(axes: Axes, way: FloatArray) -> None:
    """Draw a way (n, 4), coloured by how the body goes along it."""
    time, place = way[:, 0], way[:, 1:]
    rate = (len(time) - 1) / float(time[-1] - time[0])
    labels = segment_path(ShoulderPaths.of_places(place, rate)).labels
    kinds = {HOLONOMIC: KINDS["holonomic"], NONHOLONOMIC: KINDS["nonholonomic"]}
    colours = [kinds.get(str(label), COLOURS["soft"]) for label in labels[:-1]]
    rows = np.searchsorted(time, np.arange(time[0], time[-1] + EVERY, EVERY)).clip(max=len(time) - 1)
    _draw_places(axes, place, colours, place[rows], Walker().width / 2, (1.8, 0.8))
    draw_heading(axes, place[-1], 0.3)
    axes.plot(*place[0, :2], "o", color=COLOURS["ink"], markersize=4, zorder=6)


def _draw_places(
    axes: Axes, place: FloatArray, colours: Sequence[str], shown: FloatArray, half: float,
    widths: tuple[float, float],
) -> None:  # fmt: skip
    """Draw a line through places (n, 3) in n - 1 colours, and shoulders of a half width [m] at some."""
    lines = np.stack([place[:-1, :2], place[1:, :2]], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=list(colours), linewidths=widths[0]))
    left = half * np.column_stack([-np.sin(shown[:, 2]), np.cos(shown[:, 2])])
    bars = np.stack([shown[:, :2] + left, shown[:, :2] - left], axis=1)
    axes.add_collection(LineCollection(list(bars), colors=COLOURS["soft"], linewidths=widths[1], zorder=1.5))


def _kind_keys(shoulders: str, width: float) -> list[Line2D]:
    """Entries of a legend: how the body goes, and its shoulders."""
    keys = [Line2D([], [], color=colour, label=kind) for kind, colour in KINDS.items()]
    return [*keys, Line2D([], [], color=COLOURS["soft"], linewidth=width, label=shoulders)]


def _write_times(axes: Axes, way: FloatArray, name: str) -> None:
    """Instants beside a way where it has moved on since the one before, and who walks."""
    time, place = way[:, 0], way[:, 1:3]
    last = None
    for instant in np.arange(time[0], time[-1], SECONDS):
        here = place[min(int(np.searchsorted(time, instant)), len(time) - 1)]
        if last is None or np.hypot(*(here - last)) > 0.3:
            text = f"{name}, {instant:g} s" if last is None else f"{instant:g}"
            axes.annotate(
                text, tuple(here), (3, 5), textcoords="offset points", fontsize=7, color=COLOURS["ink"]
            )
            last = here


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
    need(shown, "a goal aside or ahead of a start that counts", "a zone")
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
    need(statistics, "a walk of a category", "statistics")
    figure = new_figure(8.4, 5.2, "Holonomic ends of walks by category")
    places = np.arange(len(statistics))
    ends = {"from origin (PLO) [m]": "from_origin", "to goal (PLG) [m]": "to_goal"}
    for row, (label, name) in enumerate(ends.items()):
        axes = figure.add_subplot(2, 1, row + 1)
        for number, (kind, colour) in enumerate(_BARS.items()):
            spreads = [getattr(item, name) for item in statistics.values()]
            heights = [getattr(item, kind.replace(" ", "_")) for item in spreads]
            axes.bar(places + 0.27 * (number - 1), heights, 0.25, color=colour, label=kind)
        axes.set_xticks(places, list(statistics))
        dress(axes, label)
    legend_in_title(figure, figure.axes[0])
    return figure


KINDS = {"holonomic": COLOURS["executed"], "nonholonomic": COLOURS["planned"]}

_PANEL = 3.4
"""Width of a panel [inch]."""

_BESIDE = 0.6
"""Room shown beside the paths [m]."""


def walking_paths_figure(groups: Mapping[str, Sequence[WalkingPath]], title: str = "Walking paths") -> Figure:
    """Draw paths from above, one panel for each group.

    Short bars are shoulders every half second; colours tell where the body goes ahead and where it does not.

    Args:
        groups: Paths by the title of their panel.

    Raises:
        FigureError: If there is no path.
    """
    shown = {name: paths for name, paths in groups.items() if paths}
    need(shown, "a walking path", "a group")
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
        first, last = number % columns == 0, number // columns == rows - 1
        dress(axes, "y [m]" if first else "", "x [m]" if last else "", name)
        axes.set_aspect("equal", adjustable="box")
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    legend_in_title(figure, handles=_kind_keys("shoulders, half width", 0.8))
    return figure


def _draw_path(axes: Axes, path: WalkingPath) -> None:
    colours = [KINDS["holonomic" if flag else "nonholonomic"] for flag in path.holonomic[:-1]]
    times = np.append(np.arange(0.0, path.duration, EVERY), path.duration)
    half = path.task.walker.width / 4  # half size, so that neighbours do not hide each other
    _draw_places(axes, path.place, colours, path.place_at(times), half, (1.3, 0.6))
    draw_heading(axes, path.task.goal, 0.28)
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
