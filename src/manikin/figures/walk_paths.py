"""The ways of a walking run seen from above: who is where, when, and goes how."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from manikin.figures.style import dress, need, new_figure
from manikin.figures.walking import KINDS, draw_obstacle
from manikin.locomotion import HOLONOMIC, NONHOLONOMIC, ShoulderPaths, Walker, floor_plan, segment_path
from manikin.palette import COLOURS
from manikin.record import RunRecord
from manikin.spatial import FloatArray

EVERY = 0.5
"""Time between the shoulders drawn along a way [s]."""

SECONDS = 1.0
"""Time between the instants written beside a way, where several people walk [s]."""

BESIDE = 0.7
"""Room shown beside the ways [m]."""


def walk_paths_figure(record: RunRecord) -> Figure:
    """Draw the ways of all who walk, with shoulders every half second, and what stands in the way.

    Args:
        record: Of a run in which somebody walks.

    Raises:
        FigureError: If nobody walks.
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
    for kind, colour in KINDS.items():
        axes.plot([], [], color=colour, label=kind)
    axes.plot([], [], color=COLOURS["soft"], linewidth=1.0, label="shoulders, and standing")
    places = np.vstack([way[:, 1:3] for way in walks.values()])
    low, high = places.min(axis=0) - BESIDE, places.max(axis=0) + BESIDE
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal", adjustable="box")
    dress(axes, "y [m]", "x [m]")
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside lower right", ncols=3, fontsize=8.5, frameon=False
    )
    return figure


def _draw_way(axes: Axes, way: FloatArray) -> None:
    time, place = way[:, 0], way[:, 1:]
    rate = (len(time) - 1) / float(time[-1] - time[0])
    labels = segment_path(ShoulderPaths.of_places(place, rate)).labels
    colours = {HOLONOMIC: KINDS["holonomic"], NONHOLONOMIC: KINDS["nonholonomic"]}
    lines = np.stack([place[:-1, :2], place[1:, :2]], axis=1)
    axes.add_collection(
        LineCollection(
            list(lines),
            colors=[colours.get(str(one), COLOURS["soft"]) for one in labels[:-1]],
            linewidths=1.8,
        )
    )
    rows = np.searchsorted(time, np.arange(time[0], time[-1] + EVERY, EVERY)).clip(max=len(time) - 1)
    half = Walker().width / 2
    left = half * np.column_stack([-np.sin(place[rows, 2]), np.cos(place[rows, 2])])
    bars = np.stack([place[rows, :2] + left, place[rows, :2] - left], axis=1)
    axes.add_collection(LineCollection(list(bars), colors=COLOURS["soft"], linewidths=0.8, zorder=1.5))
    tip = place[-1, :2] + 0.3 * np.array([np.cos(place[-1, 2]), np.sin(place[-1, 2])])
    arrow = {"arrowstyle": "-|>", "color": COLOURS["ink"], "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tuple(tip), tuple(place[-1, :2]), arrowprops=arrow, zorder=5)
    axes.plot(*place[0, :2], "o", color=COLOURS["ink"], markersize=4, zorder=6)


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
