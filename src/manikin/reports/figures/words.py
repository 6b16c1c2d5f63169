"""Cells of one word on slices of one final heading, and two paths that cost the same."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from manikin.reports.figures.style import draw_heading, dress, legend_in_title, need, new_grid
from manikin.runtime.palette import COLOURS
from manikin.walking.words import STRAIGHT, THESIS_WORDS, EqualPaths, WordPath, WordSlice

WORD_COLOURS = {
    "IDI": "#56B4E9", "DID": "#E69F00", "IDID": "#0072B2", "DIDI": "#D55E00", "IDIDI": "#6A51A3",
    "DIDID": "#8C564B", "ID": "#009E73", "DI": "#CC79A7", STRAIGHT: "#222222",
}  # fmt: skip
"""Blue begins with I, orange with D; two arcs are green and pink."""

_OTHER = "#8A8A8A"
_BESIDE = 0.5


def words_figure(slices: Sequence[WordSlice]) -> Figure:
    """Draw the cells of slices, and one path to a goal within every cell ([Truong2010]_ Fig. 3.6).

    On the left, places are squares; black lines run between neighbours whose paths do not bend into each
    other. On the right are paths to the marked goals, farthest inside the places of each word; points on
    them are switching points.

    Raises:
        FigureError: If there is no slice.
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
            _draw_path(ways, item.path(*place), _colour(str(item.words[place])))
        _dress_ways(ways, "A path to each cell")
    keys: list[Artist] = [Patch(facecolor=_colour(word), label=word) for word in shown]
    keys.append(Line2D([], [], color=COLOURS["ink"], linewidth=1.6, label="two best paths"))
    legend_in_title(figure, handles=keys, handlelength=1.2)
    return figure


def equal_paths_figure(pairs: Sequence[EqualPaths]) -> Figure:
    """Draw two paths to one goal that cost the same, and their curvatures ([Truong2010]_ Fig. 3.7).

    Args:
        pairs: One row of the figure each.

    Raises:
        FigureError: If there is no pair.
    """
    need(pairs, "a pair of paths of equal cost", "a partition")
    figure, grid = new_grid(
        9.6, 0.8 + 4.6 * len(pairs), "Two best paths to one goal", len(pairs), 2, width_ratios=[1.0, 1.25],
        top=0.75, between=0.75, across=0.7,
    )  # fmt: skip
    for row, pair in enumerate(pairs):
        ways, curvatures = (figure.add_subplot(grid[row, column]) for column in range(2))
        for path, name in zip((pair.first, pair.second), ("first run", "second run"), strict=True):
            _draw_path(ways, path, COLOURS[name])
            share = np.linspace(0.0, 1.0, 501)
            label = f"{path.word}, {path.length:.2f} m"
            curvatures.plot(share * path.length, path.curvature(share), color=COLOURS[name], label=label)
            at = path.switches
            curvatures.plot(at, path.curvature(at / path.length), "o", markersize=4, color=COLOURS[name])
        x, y, heading = pair.first.goal
        _dress_ways(
            ways, f"to ({x:.2f}, {y:.2f}) m, {np.degrees(heading) % 360.0:.0f}°: cost {pair.first.cost:.3f} m"
        )
        dress(curvatures, "curvature [1/m]", "along the path [m]", "Curvature; points: switching points")
        curvatures.legend(fontsize=8.5, frameon=False)
    return figure


def _order(word: str) -> tuple[int, str]:
    return (THESIS_WORDS.index(word) if word in THESIS_WORDS else len(THESIS_WORDS) + len(word), word)


def _colour(word: str) -> str:
    return WORD_COLOURS.get(word, _OTHER)


def _draw_cells(axes: Axes, one: WordSlice, chosen: Sequence[tuple[int, int]]) -> None:
    known = sorted({str(word) for word in one.words.ravel()}, key=_order)
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


def _draw_path(axes: Axes, path: WordPath, colour: str) -> None:
    states = path.states()
    axes.plot(states[:, 0], states[:, 1], color=colour, linewidth=1.6)
    at = path.switches / path.length
    along = np.linspace(0.0, 1.0, len(states))
    axes.plot(
        *(np.interp(at, along, states[:, column]) for column in range(2)), "o", color=colour, markersize=3.8
    )
    draw_heading(axes, path.goal, 0.45)
    axes.plot(*path.start[:2], "o", color=COLOURS["ink"], markersize=4, zorder=6)


def _dress_ways(axes: Axes, title: str) -> None:
    dress(axes, "y [m]", "x [m]", title)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)


def _representatives(one: WordSlice) -> list[tuple[int, int]]:
    """Place of each word that is farthest from places of other words and from the edge of the grid."""
    rows, columns = np.indices(one.grid.shape)
    places = np.column_stack([rows.ravel(), columns.ravel()])
    labels = one.words.ravel()
    edge = np.minimum.reduce(
        [
            places[:, 0],
            one.grid.shape[0] - 1 - places[:, 0],
            places[:, 1],
            one.grid.shape[1] - 1 - places[:, 1],
        ]
    )
    chosen = []
    for word in sorted(set(labels.tolist()), key=_order):
        own, other = labels == word, places[labels != word]
        room = edge[own] + 1.0
        if len(other):
            apart = np.hypot(*(places[own][:, None] - other[None]).transpose(2, 0, 1)).min(axis=1)
            room = np.minimum(room, apart)
        row, column = places[own][int(np.argmax(room))]
        chosen.append((int(row), int(column)))
    return chosen
