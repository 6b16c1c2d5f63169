"""Centre of mass: in time and on the coordinate planes; of several motions its path, height and supports."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from manikin.errors import FigureError
from manikin.numerics.signals import Spread
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.recordings.statistics.clip_statistics import GroupStatistics
from manikin.recordings.statistics.clips import RecordedClip
from manikin.recordings.statistics.passages import LIMIT, Origin, support_distances
from manikin.recordings.statistics.phases import published_heights
from manikin.reports.figures import style
from manikin.reports.figures.timeline import timeline
from manikin.reports.figures.views import VIEWS, View, distinct_contacts, draw_contact, draw_obstacles
from manikin.runtime.display import COLOURS, colours_of, readable


def planes_figure(record: RunRecord) -> Figure:
    """Draw the CoM's path with supports and obstacles on xy, xz and yz ([Qiu2012]_ Fig. 5.16, 7.8, 7.18)."""
    tracks = style.need(record.tracks, "a motion of the centre of mass")
    phases = style.need(record.phases, "phases")
    contacts = [] if record.schedule is None else distinct_contacts(record.schedule)
    colours = colours_of(contact.effector for contact in contacts)
    seen = np.vstack([t.position for t in tracks.values()] + [c.points_in_world for c in contacts])
    low, high = seen.min(axis=0) - 0.12, seen.max(axis=0) + 0.12
    figure, panels = planes("Centre of mass on the coordinate planes", high - low)
    first = next(iter(tracks.values()))
    for view, axes in panels:
        if record.scene is not None:
            draw_obstacles(axes, record.scene, view, low, high)
        for contact in contacts:
            draw_contact(axes, contact, view, colours[contact.effector])
        draw_paths(axes, view, tracks, style.STYLES)
        for name, colour in colours.items():
            axes.plot([], [], color=colour, linewidth=5, alpha=0.6, label=readable(name))
        frame_plane(axes, view, low, high)
        mark_instants(style.Labels(axes), axes, view, first.at(phases.instants), COLOURS["ink"])
    style.legend_in_title(figure, axes)
    return figure


def planes(title: str, spans: FloatArray) -> tuple[Figure, list[tuple[View, Axes]]]:
    """Figure with each view and its panel, to one scale if legible; ``spans`` are (3,) along the axes [m]."""
    widths = [max(float(view(spans)[0]), 0.3 * float(spans.max())) for view in VIEWS]
    heights = [float(view(spans)[1]) for view in VIEWS]
    height = float(np.clip(max(heights) * 12.8 / sum(widths), 2.5, 6.0))
    figure, grid = style.new_grid(15.0, height + 1.4, title, 1, 3, left=0.75, top=0.85, width_ratios=widths)
    return figure, [(view, figure.add_subplot(grid[column])) for column, view in enumerate(VIEWS)]


def frame_plane(axes: Axes, view: View, low: FloatArray, high: FloatArray) -> None:
    """Show the box from ``low`` to ``high``, (3,) each [m], to scale, with the names of the axes."""
    (left, bottom), (right, top) = view(low), view(high)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.set_aspect("equal", adjustable="box", anchor="SW")
    horizontal, vertical = view.labels
    style.dress(axes, vertical, horizontal, f"{view.name[0]}-{view.name[1]}, {view.words}")


def draw_paths(
    axes: Axes, view: View, tracks: Mapping[str, ComTrack], styles: Mapping[str, Mapping[str, Any]]
) -> None:
    """Draw the projected path of each track in its own style."""
    for name, track in tracks.items():
        axes.plot(*view(track.position).T, label=f"centre of mass, {name}", **styles[name])


def mark_instants(labels: style.Labels, axes: Axes, view: View, places: FloatArray, colour: str) -> None:
    """Mark (n, 3) places of the key instants, numbered from 0 where there is room."""
    points = view(places)
    axes.plot(*points.T, "o", color=colour, markersize=3.5, zorder=6)
    for number, (right, up) in enumerate(points):
        labels.write(f"{number}", (right, up), (4, 2), color=colour, zorder=7)


@dataclass(frozen=True)
class LowestPoints:
    """Lowest centres of mass of one group of motions.

    Attributes:
        com: Lowest heights of the centre of mass above the floor, of each motion or passage [m].
        overhead: Height of what was passed; None where nothing was or it is not known [m].
        rooms: From the highest part of the body to it; empty where not known [m].
    """

    group: str
    com: tuple[float, ...]
    overhead: float | None = None
    rooms: tuple[float, ...] = ()

    @classmethod
    def of(cls, group: GroupStatistics, overhead: float | None = None) -> "LowestPoints":
        """Lowest points of the passages of a group, or of its whole motions where none are known."""
        if not group.under:
            return cls(group.group, tuple(item.com_lowest for item in group.whole.values()))
        rooms = tuple(item.room for _, item in group.under if item.room is not None)
        return cls(group.group, tuple(item.com_lowest for _, item in group.under), overhead, rooms)


def published_lowest() -> tuple[LowestPoints, ...]:
    """Lowest points quoted for each beam in the thesis."""
    known = published_heights()
    return tuple(LowestPoints(beam, (low,), known.beams[beam]) for beam, low in known.lowest.items())


def com_heights_figure(groups: Sequence[LowestPoints], standing: float | None = None) -> Figure:
    """Draw lowest centres of mass by group, and the height up to what was passed ([Qiu2012]_ 3.13, 3.14).

    The height of the centre of mass in ``standing`` is drawn as a line [m].
    """
    shown = style.need([item for item in groups if item.com], "a height of the centre of mass")
    figure, grid = style.new_grid(9.6, 4.4, "Lowest centre of mass", 1, 2, top=0.8, across=0.9)
    left, right = (figure.add_subplot(grid[column]) for column in range(2))
    colours = style.group_colours(item.group for item in shown)
    for number, item in enumerate(shown):
        colour = colours[item.group]
        _dots(left, number, item.com, colour)
        if item.overhead is not None:
            _dots(right, number, [item.overhead - low for low in item.com], colour)
            if item.rooms:
                right.plot([number + 0.25] * len(item.rooms), item.rooms, "_", color=COLOURS["ink"])
    if standing is not None:
        left.axhline(standing, color=COLOURS["soft"], linewidth=1.0, linestyle=(0, (5, 3)))
        left.annotate("standing", (0.0, standing), (2, 2), textcoords="offset points", fontsize=8,
                      xycoords=("axes fraction", "data"), color=COLOURS["soft"])  # fmt: skip
    style.dress(left, "height above the floor [m]", title="Lowest centre of mass")
    style.dress(right, "up to what is passed [m]", title="Room above it (dots) and the body (dashes)")
    for axes in (left, right):
        style.name_groups(axes, [item.group for item in shown])
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.grid(False, axis="x")
    if all(item.overhead is None for item in shown):
        right.annotate("nothing overhead is known", (0.5, 0.5), xycoords="axes fraction", ha="center",
                       fontsize=9, color=COLOURS["soft"])  # fmt: skip
    return figure


def _dots(axes: Axes, number: int, values: Sequence[float], colour: str) -> None:
    mean = sum(values) / len(values)
    axes.bar(number, mean, width=0.6, color=colour, alpha=0.35)
    axes.plot([number] * len(values), values, "o", color=colour, markersize=4)
    style.note(axes, f"{mean:.2f}", (number, 0.0), fontsize=7.5)


def com_distances_figure(
    clips: Sequence[RecordedClip], *, limit: float = LIMIT, published: Mapping[str, Spread] | None = None
) -> Figure:
    """Draw the distance from the centre of mass to each support against time ([Qiu2012]_ 3.2.3, Table 3.5).

    A panel for each effector; on the right the largest one of each motion, with mean and range of published
    ones as a band.

    Args:
        clips: Recorded motions; a colour for each group. None are needed where there are published ones.
        limit: Drawn as a dashed line [m].
        published: Largest distances by effector, such as those of
            :func:`~manikin.recordings.statistics.phases.published_distances`.
    """
    known = published or {}
    result = [(clip, support_distances(clip)) for clip in clips]
    used = {item.effector for _, distances in result for item in distances}
    effectors = style.need(sorted({*known, *used}), "a support")
    colours = style.group_colours(clip.group for clip in clips)
    figure, grid = style.new_grid(
        9.6, 1.2 + 2.6 * len(effectors), "Centre of mass to its supports", len(effectors), 2,
        width_ratios=[3.0, 1.0], top=1.0, between=0.85, across=0.5,
    )  # fmt: skip
    for row, effector in enumerate(effectors):
        axes = figure.add_subplot(grid[row, 0])
        most = figure.add_subplot(grid[row, 1], sharey=axes)
        largest: dict[str, list[float]] = {group: [] for group in colours}
        for clip, distances in result:
            own = [item for item in distances if item.effector == effector]
            for item in own:
                axes.plot(item.time - item.time[0], item.distance, color=colours[clip.group], linewidth=1.0,
                          alpha=0.8)  # fmt: skip
            if own:
                largest[clip.group].append(max(float(item.distance.max()) for item in own))
        for number, (group, values) in enumerate(largest.items()):
            most.plot([number] * len(values), values, "o", color=colours[group], markersize=4)
        if effector in known:
            spread = known[effector]
            most.axhspan(spread.smallest, spread.largest, color=COLOURS["shade"], zorder=0)
            most.axhline(spread.mean, color=COLOURS["soft"], linewidth=1.0, zorder=1)
        for panel in (axes, most):
            panel.axhline(limit, color=COLOURS["ink"], linewidth=1.0, linestyle=(0, (5, 3)))
        begin = "time from touch-down, or from the beginning [s]"
        style.dress(axes, "distance [m]", begin, readable(effector))
        style.dress(most, title="largest of each motion")
        style.name_groups(most, list(colours))
        most.tick_params(labelleft=False)
    keys = [Line2D([], [], color=colour, label=group) for group, colour in colours.items()]
    keys.append(Line2D([], [], color=COLOURS["ink"], linestyle=(0, (5, 3)), label=f"limit, {limit:g} m"))
    if known:
        keys.append(Line2D([], [], color=COLOURS["soft"], label="published mean and range", linewidth=3))
    style.legend_below_title(figure, keys)
    return figure


def com_paths_figure(
    clips: Sequence[RecordedClip], origins: Sequence[Origin], *, overhead: float | None = None
) -> Figure:
    """Draw the ways of the centres of mass over their supports ([Qiu2012]_ Fig. 3.12).

    The lowest points are marked. Dotted, from the side, is the way of the head's highest point.

    Args:
        clips: At least one; a colour for each group.
        origins: Of each motion, from where it is seen.
        overhead: Height of what they pass under, drawn as a line; None for nothing [m].
    """
    motions = list(style.need(list(clips), "a recorded motion"))
    if len(motions) != len(origins):
        raise FigureError(f"{len(origins)} origins of {len(motions)} motions; valid: one for each")
    margins, title = {"top": 0.8, "between": 0.7}, "Ways of the centre of mass"
    figure, grid = style.new_grid(9.6, 7.4, title, 2, 1, height_ratios=[1.25, 1.0], **margins)
    side, above = (figure.add_subplot(grid[row]) for row in range(2))
    colours = style.group_colours(clip.group for clip in motions)
    for clip, origin in zip(motions, origins, strict=True):
        _draw(side, above, clip, origin, colours[clip.group])
    side.axhline(0.0, color=COLOURS["soft"], linewidth=1.0)
    if overhead is not None:
        side.axhline(overhead, color=COLOURS["ink"], linewidth=1.4, linestyle=(0, (6, 2)))
    style.dress(side, "height above the floor [m]", "along the way [m]")
    style.dress(above, "aside [m]", "along the way [m]", "From above, with the supports")
    above.set_aspect("equal", adjustable="datalim")
    above.sharex(side)
    keys = [Line2D([], [], color=colour, label=group) for group, colour in colours.items()]
    keys.append(Line2D([], [], color=COLOURS["ink"], marker="v", linestyle="", label="lowest"))
    if any("head" in clip.tops for clip in motions):
        keys.append(Line2D([], [], color=COLOURS["soft"], linestyle=":", label="top of the head"))
    if overhead is not None:
        label = f"overhead, {overhead:g} m"
        keys.append(Line2D([], [], color=COLOURS["ink"], linestyle=(0, (6, 2)), label=label))
    style.legend_below_title(figure, keys)
    return figure


def _draw(side: Axes, above: Axes, clip: RecordedClip, origin: Origin, colour: str) -> None:
    com = _seen(clip, origin, clip.com)
    side.plot(com[:, 0], com[:, 2], color=colour, linewidth=1.3, alpha=0.85)
    above.plot(com[:, 0], com[:, 1], color=colour, linewidth=1.3, alpha=0.85)
    if "head" in clip.tops:
        head = _seen(clip, origin, clip.tops["head"])
        side.plot(head[:, 0], head[:, 2], color=colour, linewidth=0.9, linestyle=":", alpha=0.7)
    x, y, z = com[int(np.argmin(com[:, 2]))]
    for axes, height in ((side, z), (above, y)):
        axes.plot(x, height, "v", color=colour, markeredgecolor=COLOURS["ink"], zorder=5)
    colours = colours_of(item.effector for item in clip.supports.supports)
    for item in clip.supports.supports:
        x, y, z = _seen(clip, origin, item.place[None])[0]
        look = {"color": colours[item.effector], "zorder": 1}
        above.plot(x, y, "s", markersize=4, alpha=0.45, **look)
        side.plot(x, z, "|", markersize=7, alpha=0.7, **look)


def _seen(clip: RecordedClip, origin: Origin, places: FloatArray) -> FloatArray:
    """(n, 3) in the frame of the origin, heights above the floor [m]."""
    return np.column_stack([origin.seen(places), places[:, 2] - clip.floor])


QUANTITIES = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"))
LEAST_SPAN = 4e-3
"""Height of a panel at the least, in its unit."""


def com_figure(record: RunRecord) -> Figure:
    """Draw the CoM along each axis, planned and executed ([Qiu2012]_ Fig. 5.12, 5.22, 6.9, 7.8, 7.14)."""
    tracks = style.need(record.tracks, "a motion of the centre of mass")
    margins = {"strip": 0.14, "top": 0.75, "between": 0.22, "across": 0.75}
    shown = timeline(record, (14.0, 7.0), "Centre of mass", 3, len(QUANTITIES), **margins)
    for column, (quantity, unit) in enumerate(QUANTITIES):
        shown.strip(column, quantity.capitalize(), named=column == 0)
        for row, axis in enumerate("xyz"):
            axes = shown.panel(row + 1, column)
            drawn = []
            for name, track in tracks.items():
                values = getattr(track, quantity)[:, row]
                axes.plot(track.time, values, label=name, **style.STYLES[name])
                drawn.append(values)
            if quantity == "acceleration":
                axes.set_ylim(_without_spikes(np.concatenate(drawn)))
            style.span_at_least(axes, LEAST_SPAN)
            shown.label(axes, f"{axis} [{unit}]")
    style.legend_in_title(shown.figure, axes)
    return shown.figure


def _without_spikes(values: FloatArray) -> tuple[float, float]:
    """Limits that hold all but the impacts of some milliseconds."""
    low, high = (float(v) for v in np.percentile(values, (0.5, 99.5)))
    room = 0.15 * max(high - low, 0.02)
    return max(low - room, float(values.min()) - room), min(high + room, float(values.max()) + room)
