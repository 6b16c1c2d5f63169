"""Where feet and hands are in time, planned and executed.

Also here. How closely the execution follows the plan. The paths of feet and hands between their contacts, in
space. A recorded motion as a strip: postures from the side, heights of effectors, and which of them support.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch
from mpl_toolkits.mplot3d.axes3d import Axes3D

from manikin.body import BodyModel
from manikin.contact import ContactSchedule, Swing
from manikin.errors import FigureError
from manikin.numerics.spatial import FloatArray, rotation_from_yaw, turned_root
from manikin.pipeline.run_directory import RunRecord
from manikin.recordings import Reconstruction, RecordedSupports
from manikin.recordings.supports.support_levels import effector_places
from manikin.reports.figures.scene import draw_scene, draw_soles, frame
from manikin.reports.figures.style import (
    STYLES,
    dress,
    label_room,
    legend_above,
    legend_in_title,
    need,
    new_figure,
    new_grid,
    span_at_least,
)
from manikin.reports.figures.timeline import timeline
from manikin.reports.figures.views import ALONG_Y, View, draw_body
from manikin.runtime.palette import COLOURS, colours_of, readable

_AXIS_COLOURS = ("#0072B2", "#009E73", "#E69F00")


def tracking_figure(record: RunRecord) -> Figure:
    """Draw the errors of the CoM, the feet and the hands in contact [mm] ([Qiu2012]_ Fig. 6.9, 6.10).

    Args:
        record: With both motions, and the body.

    Raises:
        FigureError: If one of them is missing.
    """
    planned = need(record.motions.get("planned"), "a planned motion")
    executed = need(record.motions.get("executed"), "an executed motion")
    paths = need(record.effector_paths, "a body")
    shown = timeline(record, (11.0, 6.0), "Tracking errors of the execution", 2)
    shown.strip()
    axes = shown.panel(1)
    error = 1000.0 * (executed.com - interpolated(executed.time, planned.time, planned.com))
    for index, axis in enumerate("xyz"):
        axes.plot(executed.time, error[:, index], color=_AXIS_COLOURS[index], linewidth=1.0, label=axis)
    size = np.linalg.norm(error, axis=1)
    root_mean_square = float(np.sqrt(np.mean(size**2)))
    label = f"distance (RMS {root_mean_square:.2g} mm, largest {size.max():.2g} mm)"
    axes.plot(executed.time, size, color=COLOURS["ink"], linewidth=1.4, label=label)
    shown.label(axes, "centre of mass [mm]")
    legend_above(axes)
    feet = shown.panel(2)
    wanted, found = paths["planned"], paths["executed"]
    colours = colours_of(found)
    for name in found:
        plan = interpolated(executed.time, planned.time, wanted[name])
        gap = 1000.0 * np.linalg.norm(found[name] - plan, axis=1)
        label = f"{readable(name)} (largest {gap.max():.2g} mm)"
        feet.plot(executed.time, gap, color=colours[name], linewidth=1.2, label=label)
    shown.label(feet, "effectors [mm]")
    legend_above(feet)
    return shown.figure


def interpolated(times: FloatArray, known_times: FloatArray, values: FloatArray) -> FloatArray:
    """(n, 3) values interpolated at other times; held before the first and after the last."""
    return np.column_stack([np.interp(times, known_times, column) for column in values.T])


def flights_figure(record: RunRecord) -> Figure:
    """Draw each flight of an effector in the scene, and its height in time ([Qiu2012]_ Fig. 6.7, 7.11).

    The points drawn are the origins of the contact frames (the middle of the sole), not the
    ankles as in the thesis. Solid: planned by a smooth curve; dashed: by the search.

    Args:
        record: With a planned motion, the body and a schedule.

    Raises:
        FigureError: If one is missing, or nothing leaves its contact.
    """
    schedule = need(record.schedule, "a contact schedule")
    planned = need(record.motions.get("planned"), "a planned whole-body motion")
    paths = need(record.effector_paths, "a body")["planned"]
    swings = [swing for swing in schedule.sequence.swings() if swing.effector in paths]
    need(swings, "an effector that leaves or makes a contact")
    colours = colours_of(record.effectors)
    figure = new_figure(13.0, 6.6, "Flights of feet and hands as planned")
    grid = figure.add_gridspec(1, 2, width_ratios=[1.25, 1])
    space: Axes3D = figure.add_subplot(grid[0], projection="3d", computed_zorder=False)
    height = figure.add_subplot(grid[1])
    corners = draw_scene(space, record.scene) if record.scene is not None else np.zeros((0, 3))
    seen = [draw_soles(space, schedule)]
    for swing, method in zip(swings, _methods(record, swings), strict=True):
        time, path = _part(schedule, swing, planned.time, paths[swing.effector])
        colour, dash = colours[swing.effector], "solid" if method != "bi-rrt" else (0, (4, 1.5))
        first, last = swing.first_phase, swing.last_phase
        where = f"phase {first}" if first == last else f"phases {first}–{last}"
        label = f"{readable(swing.effector)}, {where}" + (f", {method}" if method else "")
        space.plot(*path.T, color=colour, linestyle=dash, linewidth=2.2, zorder=8)
        height.plot(time, path[:, 2], color=colour, linestyle=dash, linewidth=1.8, label=label)
        _add_executed(record, height, schedule, swing)
        seen.append(path)
    frame(space, np.vstack(seen), corners)
    space.view_init(18.0, -62.0)
    if "executed" in record.effector_paths:
        height.plot([], [], **_EXECUTED, label="executed")
    dress(height, "height [m]", "time [s]")
    height.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure


_EXECUTED = {**STYLES["executed"], "linestyle": (0, (1, 1.5))}


def _add_executed(record: RunRecord, axes: Axes, schedule: ContactSchedule, swing: Swing) -> None:
    if "executed" in record.effector_paths:
        time = record.motions["executed"].time
        path = record.effector_paths["executed"][swing.effector]
        time, path = _part(schedule, swing, time, path)
        axes.plot(time, path[:, 2], **_EXECUTED)


def _methods(record: RunRecord, swings: list[Swing]) -> list[str]:
    """How each flight was planned, as far as the summary says; nothing of what just follows the body."""
    block = record.summary.get("wholebody") or {}
    told: dict[str, list[str]] = {}
    for item in block.get("swings") or ():
        if isinstance(item, dict):
            told.setdefault(str(item.get("effector")), []).append(str(item.get("method", "")))
    counts = Counter(swing.effector for swing in swings)
    left = {name: iter(told.get(name, ())) for name in counts if len(told.get(name, ())) == counts[name]}
    return [next(left.get(swing.effector, iter(())), "") for swing in swings]


def _part(
    schedule: ContactSchedule, swing: Swing, time: FloatArray, path: FloatArray
) -> tuple[FloatArray, FloatArray]:
    start, end = schedule.swing_interval(swing)
    inside = (time >= start - 1e-9) & (time <= end + 1e-9)
    return time[inside], path[inside]


MOST = 14
"""Postures drawn at the most."""

ALWAYS = ("left_foot", "right_foot", "left_hand", "right_hand")
"""Effectors whose heights are drawn though they support nothing."""

ORDER = ("left_knee", "right_knee", "left_elbow", "right_elbow", "pelvis", "buttocks")
"""Of the other effectors, below those."""

GAP = 0.1
"""Between two postures [m]."""


def support_strip_figure(
    found: Reconstruction,
    supports: RecordedSupports,
    title: str,
    window: tuple[float, float] | None = None,
    width: float = 15.0,
) -> Figure:
    """Draw postures in the middle of phases above the heights of effectors and a bar for each support.

    The eye stands beside the way of the body, or beside the body where that stays in place. A dot marks
    an effector that supports in the posture; a height is drawn thick while its effector supports; a line
    leads from each posture to its instant. The horizontal lines are the surfaces found.

    Args:
        found: The reconstruction of the recording, from its first instant.
        supports: Found in it.
        title: Of the figure.
        window: First and last instant drawn, on the clock of the supports [s]; None for all.
        width: Of the figure [inch].

    Raises:
        FigureError: If no instant lies in the window.
    """
    begin, end = window or (supports.start, supports.end)
    time = found.time - found.time[0] + supports.start
    if not np.any((time >= begin) & (time <= end)):
        raise FigureError(
            f"no instant from {begin:g} to {end:g} s; valid: from {supports.start:g} to {supports.end:g} s"
        )
    seen = {one.effector for one in supports.supports}
    names = (*ALWAYS, *(name for name in ORDER if name in seen), *sorted(seen - {*ALWAYS, *ORDER}))
    places = effector_places(found.body, found.q, names)
    samples = _samples(supports, time, begin, end)
    turned = _seen_from_the_side(found, places)
    across, low, high = _frame(found.body, turned[samples])
    pitch = max(across + GAP, 0.9)
    room = label_room(names)
    tall = (high - low) * (width - room - 0.15) / (pitch * len(samples))
    bars = 0.17 * len(names)
    figure, grid = new_grid(
        width, tall + 1.6 + bars + 1.5, title, 3, 1, left=room, between=0.3,
        height_ratios=[tall, 1.6, bars],
    )  # fmt: skip
    figures, heights, strip = (figure.add_subplot(grid[row, 0]) for row in range(3))
    for axes in (heights, strip):
        axes.patch.set_visible(False)
    colours = colours_of(names)
    _draw_postures(figures, found, supports, turned, names, samples, time, (pitch, low, high))
    _draw_heights(heights, supports, places, names, time, colours)
    _draw_bars(strip, supports, names, colours)
    for axes in (heights, strip):
        axes.set_xlim(begin, end)
    for number, sample in enumerate(samples):
        at = (pitch * number, low)
        figure.add_artist(ConnectionPatch(
            at, (float(time[sample]), 0.0), "data", strip.get_xaxis_transform(), axesA=figures, axesB=strip,
            color="#B9BEC6", linewidth=0.6, zorder=0,
        ))  # fmt: skip
    return figure


def _samples(supports: RecordedSupports, time: FloatArray, begin: float, end: float) -> list[int]:
    """Frames in the middle of phases, evenly chosen where there are many."""
    middles = [
        0.5 * (max(one.start, begin) + min(one.end, end))
        for one in supports.phases
        if one.end > begin and one.start < end
    ]
    if len(middles) > MOST or len(middles) < MOST // 2:
        middles = list(np.linspace(begin, end, MOST))
    return sorted({int(np.argmin(np.abs(time - middle))) for middle in middles})


def _seen_from_the_side(found: Reconstruction, places: FloatArray) -> FloatArray:
    """(n, nq) postures turned about the vertical until most of what happens is along x."""
    spots = places[..., :2].reshape(-1, 2)
    _, _, ways = np.linalg.svd(spots - spots.mean(axis=0), full_matrices=False)
    way = ways[0]
    moved = found.q[-1, :2] - found.q[0, :2]
    facing = np.array([pin.Quaternion(q[3:7]).toRotationMatrix()[:2, 0] for q in found.q]).mean(axis=0)
    if way @ (moved if np.linalg.norm(moved) > 1.0 else facing) < 0.0:
        way = -way
    yaw = -float(np.arctan2(way[1], way[0]))
    q = turned_root(found.q, yaw)
    q[:, :3] = q[:, :3] @ rotation_from_yaw(yaw).T
    return q


def _frame(body: BodyModel, q: FloatArray) -> tuple[float, float, float]:
    """Width of the widest posture, and the lowest and highest point of all [m]."""
    names = [segment.name for segment in body.segments] + list(body.effectors)
    places = effector_places(body, q, names)
    across = 2.0 * float(np.abs(places[..., 0] - q[:, 0]).max()) + 0.1
    return across, float(places[..., 2].min()) - 0.1, float(places[..., 2].max()) + 0.04


def _draw_postures(
    axes: Axes, found: Reconstruction, supports: RecordedSupports, turned: FloatArray, names: Sequence[str],
    samples: Sequence[int], time: FloatArray, frame: tuple[float, float, float],
) -> None:  # fmt: skip
    pitch, low, high = frame
    colours = colours_of(names)
    for number, sample in enumerate(samples):
        view: View = ALONG_Y.moved(pitch * number - float(turned[sample, 0]), 0.0)
        draw_body(axes, found.body, turned[sample], view)
        on = [
            one.effector
            for one in supports.supports
            if one.start <= time[sample] + 1e-9 and time[sample] <= one.end
        ]
        if on:
            for name, place in zip(on, effector_places(found.body, turned[[sample]], on)[:, 0], strict=True):
                axes.plot(
                    *view(place), "o", color=colours[name], markersize=6, markeredgecolor="black", zorder=6
                )
        axes.annotate(f"{time[sample]:.2f} s", (pitch * number, high), fontsize=8, ha="center", va="bottom")
    for height in supports.surfaces:
        axes.axhline(height, color=COLOURS["soft"], linewidth=0.7, zorder=0.5)
    axes.set(xlim=(-0.5 * pitch, pitch * (len(samples) - 0.5)), ylim=(low, high))
    axes.set_aspect("equal")
    axes.axis("off")


def _draw_heights(
    axes: Axes, supports: RecordedSupports, places: FloatArray, names: Sequence[str], time: FloatArray,
    colours: dict[str, str],
) -> None:  # fmt: skip
    for name, track in zip(names, places, strict=True):
        axes.plot(time, track[:, 2], color=colours[name], linewidth=0.8)
        for one in supports.of(name):
            on = (time >= one.start) & (time <= one.end)
            axes.plot(time[on], track[on, 2], color=colours[name], linewidth=2.6)
    for height in supports.surfaces:
        axes.axhline(height, color=COLOURS["soft"], linewidth=0.7, zorder=0.5)
    dress(axes, "height [m]")
    axes.tick_params(labelbottom=False)


def _draw_bars(axes: Axes, supports: RecordedSupports, names: Sequence[str], colours: dict[str, str]) -> None:
    for row, name in enumerate(names):
        bars = [(one.start, one.duration) for one in supports.of(name)]
        axes.broken_barh(bars, (row + 0.12, 0.76), facecolors=colours[name], alpha=0.85)
    dress(axes, "", "time [s]")
    axes.set_yticks(np.arange(len(names)) + 0.5, [readable(name) for name in names], fontsize=8)
    axes.set_ylim(len(names), 0.0)


LEAST_SPAN = 0.02
"""Height of a panel at the least [m]."""


def effectors_figure(record: RunRecord) -> Figure:
    """Draw the coordinates of every foot and hand in contact ([Qiu2012]_ Fig. 6.10, 7.15).

    Args:
        record: With a motion and the body; the largest error is named when there are both motions.

    Raises:
        FigureError: If there is no whole-body motion.
    """
    paths = need(record.effector_paths, "a whole-body motion and the body")
    names = list(next(iter(paths.values())))
    need(names, "an effector in contact")
    size = max(4.4 * len(names), 7.0), 7.0
    shown = timeline(
        record, size, "Feet and hands", 3, len(names), strip=0.14, top=0.75, between=0.22, across=0.5
    )
    for column, name in enumerate(names):
        shown.strip(column, _title(record, name), named=column == 0)
        for row, axis in enumerate("xyz"):
            axes = shown.panel(row + 1, column)
            for kind, found in paths.items():
                axes.plot(record.motions[kind].time, found[name][:, row], label=kind, **STYLES[kind])
            shown.label(axes, f"{axis} [m]" if column == 0 else "")
            span_at_least(axes, LEAST_SPAN)
    legend_in_title(shown.figure, axes)
    return shown.figure


def _title(record: RunRecord, name: str) -> str:
    title = readable(name).capitalize()
    if len(record.effector_paths) < 2:
        return title
    planned, executed = record.motions["planned"], record.motions["executed"]
    plan = interpolated(executed.time, planned.time, record.effector_paths["planned"][name])
    error = np.linalg.norm(record.effector_paths["executed"][name] - plan, axis=1)
    return f"{title} (largest error {1000.0 * error.max():.2g} mm)"
