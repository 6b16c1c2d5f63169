"""The path of the centre of mass on the three coordinate planes, with the supports."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from manikin.figures.labels import Labels
from manikin.figures.style import STYLES, dress, legend_in_title, need, new_grid
from manikin.figures.views import VIEWS, View, distinct_contacts, draw_contact, draw_obstacles
from manikin.palette import COLOURS, colours_of, readable
from manikin.record import ComTrack, RunRecord
from manikin.spatial import FloatArray


def planes_figure(record: RunRecord) -> Figure:
    """Draw the CoM's path with supports and obstacles on xy, xz and yz ([Qiu2012]_ Fig. 5.16, 7.8, 7.18).

    Args:
        record: With a planned CoM, or at least one motion.

    Raises:
        FigureError: If it has neither.
    """
    tracks = need(record.tracks, "a motion of the centre of mass")
    phases = need(record.phases, "phases")
    contacts = [] if record.schedule is None else distinct_contacts(record.schedule)
    colours = colours_of(contact.effector for contact in contacts)
    seen = np.vstack([t.position for t in tracks.values()] + [c.points_in_world for c in contacts])
    low, high = seen.min(axis=0) - 0.12, seen.max(axis=0) + 0.12
    figure, grid = planes_grid("Centre of mass on the coordinate planes", high - low)
    first = next(iter(tracks.values()))
    for column, view in enumerate(VIEWS):
        axes = figure.add_subplot(grid[column])
        if record.scene is not None:
            draw_obstacles(axes, record.scene, view, low, high)
        for contact in contacts:
            draw_contact(axes, contact, view, colours[contact.effector])
        draw_paths(axes, view, tracks, STYLES)
        for name, colour in colours.items():
            axes.plot([], [], color=colour, linewidth=5, alpha=0.6, label=readable(name))
        frame_plane(axes, view, low, high)
        mark_instants(Labels(axes), axes, view, first.at(phases.instants), COLOURS["ink"])
    legend_in_title(figure, axes)
    return figure


def planes_grid(title: str, spans: FloatArray) -> tuple[Figure, GridSpec]:
    """Figure with a panel for each view, all to one scale as far as that is legible.

    Args:
        title: Of the figure.
        spans: (3,) what is shown along each axis [m].
    """
    widths = [max(float(view(spans)[0]), 0.3 * float(spans.max())) for view in VIEWS]
    heights = [float(view(spans)[1]) for view in VIEWS]
    height = float(np.clip(max(heights) * 12.8 / sum(widths), 2.5, 6.0))
    return new_grid(15.0, height + 1.4, title, 1, 3, left=0.75, top=0.85, width_ratios=widths)


def frame_plane(axes: Axes, view: View, low: FloatArray, high: FloatArray) -> None:
    """Show the box from ``low`` to ``high``, (3,) each [m], to scale, with the names of the axes."""
    (left, bottom), (right, top) = view(low), view(high)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.set_aspect("equal", adjustable="box", anchor="SW")
    horizontal, vertical = view.labels
    dress(axes, vertical, horizontal, f"{view.name[0]}-{view.name[1]}, {view.words}")


def draw_paths(
    axes: Axes, view: View, tracks: Mapping[str, ComTrack], styles: Mapping[str, Mapping[str, Any]]
) -> None:
    """Draw the projected path of each track in its own style."""
    for name, track in tracks.items():
        axes.plot(*view(track.position).T, label=f"centre of mass, {name}", **styles[name])


def mark_instants(labels: Labels, axes: Axes, view: View, places: FloatArray, colour: str) -> None:
    """Mark (n, 3) places of the key instants, numbered from 0 where there is room."""
    points = view(places)
    axes.plot(*points.T, "o", color=colour, markersize=3.5, zorder=6)
    for number, (right, up) in enumerate(points):
        labels.write(f"{number}", (right, up), (4, 2), color=colour, zorder=7)
