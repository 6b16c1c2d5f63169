"""The paths of feet and hands between their contacts, in space."""

from collections import Counter

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from manikin.contact import ContactSchedule, Swing
from manikin.figures.scene import draw_scene, draw_soles, frame
from manikin.figures.style import STYLES, dress, need, new_figure
from manikin.palette import colours_of, readable
from manikin.record import RunRecord
from manikin.spatial import FloatArray


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
