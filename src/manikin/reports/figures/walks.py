"""Walking paths seen from above with the heading, where they are holonomic, and cells of one word."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from scipy.spatial.distance import cdist

from manikin import walking
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import RunRecord
from manikin.reports.figures.style import draw_heading, dress, legend_in_title, need, new_figure, new_grid
from manikin.runtime.display import COLOURS
from manikin.walking import CategoryStatistics, HolonomicZone, WalkingPath, WalkObstacle
from manikin.walking.goal_categories import THESIS_RADIUS
from manikin.walking.words import STRAIGHT, THESIS_WORDS, EqualPaths, WordPath, WordSlice

EVERY = 0.5
"""Time between the shoulders drawn along a way [s]."""
SECONDS = 1.0
"""Time between the instants written beside a way, where several people walk [s]."""
BESIDE = 0.7
"""Room shown beside the ways [m]."""


def walk_paths_figure(record: RunRecord) -> Figure:
    """Draw the ways of all who walk, with shoulders every half second, and what stands in the way."""
    walks = need(dict(record.walks), "a way over the floor")
    figure = new_figure(8.6, 6.4, "Ways over the floor, from above")
    axes = figure.add_subplot()
    if record.scene is not None and record.body is not None:
        for obstacle in walking.floor_plan(record.scene, record.body.stature or 0.0):
            draw_obstacle(axes, obstacle)
    for name, way in walks.items():
        _draw_way(axes, way)
        if len(walks) > 1:
            _write_times(axes, way, name)
    places = np.vstack([way[:, 1:3] for way in walks.values()])
    low, high = places.min(axis=0) - BESIDE, places.max(axis=0) + BESIDE
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    dress(axes, "y [m]", "x [m]")
    keys = _kind_keys("shoulders, and standing", 1.0)
    figure.legend(handles=keys, loc="outside lower right", ncols=3, fontsize=8.5, frameon=False)
    return figure


def _draw_way(axes: Axes, way: FloatArray) -> None:
    """Draw a way (n, 4), coloured by how the body goes along it."""
    time, place = way[:, 0], way[:, 1:]
    rate = (len(time) - 1) / float(time[-1] - time[0])
    labels = walking.segment_path(walking.ShoulderPaths.of_places(place, rate)).labels
    kinds = {walking.HOLONOMIC: KINDS["holonomic"], walking.NONHOLONOMIC: KINDS["nonholonomic"]}
    colours = [kinds.get(str(label), COLOURS["soft"]) for label in labels[:-1]]
    rows = np.searchsorted(time, np.arange(time[0], time[-1] + EVERY, EVERY)).clip(max=len(time) - 1)
    _draw_places(axes, place, colours, place[rows], walking.Walker().width / 2, (1.8, 0.8))
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
    look, last = {"textcoords": "offset points", "fontsize": 7, "color": COLOURS["ink"]}, None
    for instant in np.arange(time[0], time[-1], SECONDS):
        here = place[min(int(np.searchsorted(time, instant)), len(time) - 1)]
        if last is None or np.hypot(*(here - last)) > 0.3:
            text = f"{name}, {instant:g} s" if last is None else f"{instant:g}"
            axes.annotate(text, tuple(here), (3, 5), **look)
            last = here


_BARS = {"mean": "#4D4D4D", "average deviation": "#56B4E9", "largest deviation": "#E69F00"}


def holonomic_zone_figure(zones: Mapping[str, HolonomicZone]) -> Figure:
    """Draw goals around the start, which looks up ([Truong2010]_ Fig. 4.23).

    Filled marks are goals reached wholly holonomically, open ones others; drawn are goals that count.
    """
    shown = {name: zone for name, zone in zones.items() if np.any(zone.considered)}
    need(shown, "a goal aside or ahead of a start that counts", "a zone")
    far = max(float(zone.distances[zone.considered].max()) for zone in shown.values()) + 0.15
    title, count = "Goals reached wholly holonomically", len(shown)
    figure, grid = new_grid(0.8 + 4.3 * count, 4.1, title, 1, count, top=0.75, bottom=0.95)
    circle = np.linspace(0.0, np.pi, 91)
    for number, (name, zone) in enumerate(shown.items()):
        axes = figure.add_subplot(grid[0, number])
        goals, wholly = zone.goals[zone.considered], zone.whole[zone.considered]
        for chosen, edge, face, label in (
            (goals[wholly], KINDS["holonomic"], KINDS["holonomic"], "holonomic from start to goal"),
            (goals[~wholly], KINDS["nonholonomic"], "none", "with a nonholonomic part"),
        ):
            axes.plot(
                -chosen[:, 1], chosen[:, 0], "o", markersize=4.5, markeredgecolor=edge, markerfacecolor=face,
                label=label,
            )  # fmt: skip
        radii = {"radius of the zone": (zone.radius, "-"), "of the thesis": (THESIS_RADIUS, "--")}
        for label, (radius, line) in radii.items():
            x, y = radius * np.cos(circle), radius * np.sin(circle)
            axes.plot(x, y, line, color=COLOURS["ink"], linewidth=1.0, label=label)
        axes.plot(0.0, 0.0, "^", color=COLOURS["ink"], markersize=7)
        dress(axes, "ahead [m]" if number == 0 else "", "to the right [m]", f"{name}: {zone.radius:.2f} m")
        axes.set(xlim=(-far, far), ylim=(-0.15, far), aspect="equal")
    keys = figure.axes[0].get_legend_handles_labels()
    figure.legend(*keys, loc="lower center", ncols=4, fontsize=8.5, frameon=False)
    return figure


def holonomic_ends_figure(statistics: Mapping[str, CategoryStatistics]) -> Figure:
    """Draw PLO and PLG by category as bars: mean, AD and MD ([Truong2010]_ Fig. 4.20, 4.21)."""
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


def walking_paths_figure(groups: Mapping[str, Sequence[WalkingPath]], title: str = "Walking paths") -> Figure:
    """Draw paths from above, one panel for each group.

    Short bars are shoulders every half second; colours tell where the body goes ahead and where it does not.
    """
    shown = need({name: paths for name, paths in groups.items() if paths}, "a walking path", "a group")
    points = np.vstack([path.place[:, :2] for paths in shown.values() for path in paths])
    low, high = points.min(axis=0) - 0.6, points.max(axis=0) + 0.6  # room beside the paths [m]
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
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
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
        dashed = index == last and obstacle.moves
        line, face = ("--", "none") if dashed else ("-", COLOURS["obstacle"])
        look = {"facecolor": face, "edgecolor": COLOURS["soft"], "linestyle": line, "linewidth": 0.9}
        axes.add_patch(Polygon(outline + obstacle.displacements[index], zorder=1, **look))


WORD_COLOURS = {
    "IDI": "#56B4E9", "DID": "#E69F00", "IDID": "#0072B2", "DIDI": "#D55E00", "IDIDI": "#6A51A3",
    "DIDID": "#8C564B", "ID": "#009E73", "DI": "#CC79A7", STRAIGHT: "#222222",
}  # fmt: skip
"""Blue begins with I, orange with D; two arcs are green and pink."""
_OTHER = "#8A8A8A"


def words_figure(slices: Sequence[WordSlice]) -> Figure:
    """Draw the cells of slices, and one path to a goal within every cell ([Truong2010]_ Fig. 3.6).

    On the left, places are squares; black lines run between neighbours whose paths do not bend into each
    other. On the right are paths to the marked goals, farthest inside the places of each word; points on
    them are switching points.
    """
    need(slices, "a slice of words", "a partition")
    figure, grid = new_grid(
        9.6, 0.9 + 5.6 * len(slices), "Words of the best paths, by final heading", len(slices), 2,
        width_ratios=[1.0, 1.25], top=0.8, between=0.75, across=0.7,
    )  # fmt: skip
    shown = sorted({str(word) for item in slices for word in item.words.ravel()}, key=_order)
    for row, item in enumerate(slices):
        chosen = _representatives(item)
        cells, ways = (figure.add_subplot(grid[row, column]) for column in range(2))
        _draw_cells(cells, item, chosen)
        for place in chosen:
            _draw_word_path(ways, item.path(*place), _colour(str(item.words[place])))
        _dress_ways(ways, "A path to each cell")
    keys: list[Artist] = [Patch(facecolor=_colour(word), label=word) for word in shown]
    keys.append(Line2D([], [], color=COLOURS["ink"], linewidth=1.6, label="two best paths"))
    legend_in_title(figure, handles=keys, handlelength=1.2)
    return figure


def equal_paths_figure(pairs: Sequence[EqualPaths]) -> Figure:
    """Draw two paths to one goal that cost the same, and their curvatures ([Truong2010]_ Fig. 3.7)."""
    need(pairs, "a pair of paths of equal cost", "a partition")
    figure, grid = new_grid(
        9.6, 0.8 + 4.6 * len(pairs), "Two best paths to one goal", len(pairs), 2, width_ratios=[1.0, 1.25],
        top=0.75, between=0.75, across=0.7,
    )  # fmt: skip
    for row, pair in enumerate(pairs):
        ways, curvatures = (figure.add_subplot(grid[row, column]) for column in range(2))
        for path, name in zip((pair.first, pair.second), ("first run", "second run"), strict=True):
            _draw_word_path(ways, path, COLOURS[name])
            share = np.linspace(0.0, 1.0, 501)
            label = f"{path.word}, {path.length:.2f} m"
            curvatures.plot(share * path.length, path.curvature(share), color=COLOURS[name], label=label)
            at = path.switches
            curvatures.plot(at, path.curvature(at / path.length), "o", markersize=4, color=COLOURS[name])
        x, y, heading = pair.first.goal
        goal = f"to ({x:.2f}, {y:.2f}) m, {np.degrees(heading) % 360.0:.0f}°"
        _dress_ways(ways, f"{goal}: cost {pair.first.cost:.3f} m")
        dress(curvatures, "curvature [1/m]", "along the path [m]", "Curvature; points: switching points")
        curvatures.legend(fontsize=8.5, frameon=False)
    return figure


def _order(word: str) -> tuple[int, str]:
    return (THESIS_WORDS.index(word) if word in THESIS_WORDS else len(THESIS_WORDS) + len(word), word)


def _colour(word: str) -> str:
    return WORD_COLOURS.get(word, _OTHER)


def _draw_cells(axes: Axes, one: WordSlice, chosen: Sequence[tuple[int, int]]) -> None:
    known = sorted(set(one.words.ravel().tolist()), key=_order)
    index = np.vectorize(known.index)(one.words)
    x, y, half = one.grid.columns, one.grid.rows, one.grid.step / 2
    axes.imshow(
        index, origin="lower", aspect="equal", interpolation="nearest", vmin=-0.5, vmax=len(known) - 0.5,
        cmap=ListedColormap([_colour(word) for word in known]), alpha=0.75,
        extent=(x[0] - half, x[-1] + half, y[0] - half, y[-1] + half),
    )  # fmt: skip
    for row, column in chosen:
        axes.plot(x[column], y[row], "o", color=COLOURS["ink"], markersize=4)
    for a, b in one.jumps():
        (ax, ay), (bx, by) = ((x[column], y[row]) for row, column in (a, b))
        middle, across = np.array([ax + bx, ay + by]) / 2, np.array([by - ay, bx - ax]) / 2
        axes.plot(*np.transpose([middle - across, middle + across]), color=COLOURS["ink"], linewidth=1.6)
    dress(axes, "y [m]", "x [m]", f"Goals with a final heading of {one.heading_deg:.0f}°")
    axes.grid(False)


def _draw_word_path(axes: Axes, path: WordPath, colour: str) -> None:
    places, at = path.states()[:, :2].T, path.switches / path.length
    axes.plot(*places, color=colour, linewidth=1.6)
    along = np.linspace(0.0, 1.0, places.shape[1])
    axes.plot(*(np.interp(at, along, values) for values in places), "o", color=colour, markersize=3.8)
    draw_heading(axes, path.goal, 0.45)
    axes.plot(*path.start[:2], "o", color=COLOURS["ink"], markersize=4, zorder=6)


def _dress_ways(axes: Axes, title: str) -> None:
    dress(axes, "y [m]", "x [m]", title)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)


def _representatives(one: WordSlice) -> list[tuple[int, int]]:
    """Place of each word that is farthest from places of other words and from the edge of the grid."""
    places = np.argwhere(np.ones(one.grid.shape))
    labels = one.words.ravel()
    edge = np.minimum(places, np.array(one.grid.shape) - 1 - places).min(axis=1)
    chosen = []
    for word in sorted(set(labels.tolist()), key=_order):
        own, other = labels == word, places[labels != word]
        room = edge[own] + 1.0
        if len(other):
            room = np.minimum(room, cdist(places[own], other).min(axis=1))
        row, column = places[own][int(np.argmax(room))]
        chosen.append((int(row), int(column)))
    return chosen
