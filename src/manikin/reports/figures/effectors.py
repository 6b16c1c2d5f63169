"""Feet and hands, planned and executed: in time, their errors, and their paths between contacts."""

from collections import Counter

import numpy as np
from matplotlib.figure import Figure

from manikin.contact import ContactSchedule, Swing
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import RunRecord
from manikin.reports.figures import style
from manikin.reports.figures.space import Space
from manikin.reports.figures.timeline import timeline
from manikin.reports.figures.views import distinct_contacts
from manikin.runtime.display import COLOURS, colours_of, readable

_AXIS_COLOURS = ("#0072B2", "#009E73", "#E69F00")


def tracking_figure(record: RunRecord) -> Figure:
    """Draw the errors of the CoM, the feet and the hands in contact [mm] ([Qiu2012]_ Fig. 6.9, 6.10)."""
    style.need(record.motions.get("planned"), "a planned motion")
    executed = style.need(record.motions.get("executed"), "an executed motion")
    paths = style.need(record.effector_paths, "a body")
    shown = timeline(record, (11.0, 6.0), "Tracking errors of the execution", 2)
    shown.strip()
    axes = shown.panel(1)
    error = 1000.0 * (executed.com - record.tracks["planned"].at(executed.time))
    for axis, values, colour in zip("xyz", error.T, _AXIS_COLOURS, strict=True):
        axes.plot(executed.time, values, color=colour, linewidth=1.0, label=axis)
    size = np.linalg.norm(error, axis=1)
    label = f"distance (RMS {np.sqrt(np.mean(size**2)):.2g} mm, largest {size.max():.2g} mm)"
    axes.plot(executed.time, size, color=COLOURS["ink"], linewidth=1.4, label=label)
    shown.label(axes, "centre of mass [mm]")
    style.legend_above(axes)
    feet = shown.panel(2)
    for name, colour in colours_of(paths["executed"]).items():
        gap = _errors(record, name)
        label = f"{readable(name)} (largest {gap.max():.2g} mm)"
        feet.plot(executed.time, gap, color=colour, linewidth=1.2, label=label)
    shown.label(feet, "effectors [mm]")
    style.legend_above(feet)
    return shown.figure


def _errors(record: RunRecord, name: str) -> FloatArray:
    """(n,) distances of an effector in the execution from its plan [mm]."""
    wanted, known = (record.motions[kind].time for kind in ("executed", "planned"))
    plan, executed = (record.effector_paths[kind][name] for kind in ("planned", "executed"))
    plan = np.column_stack([np.interp(wanted, known, column) for column in plan.T])
    return 1000.0 * np.linalg.norm(executed - plan, axis=1)


def flights_figure(record: RunRecord) -> Figure:
    """Draw each flight of an effector in the scene, and its height in time ([Qiu2012]_ Fig. 6.7, 7.11).

    The points drawn are the origins of the contact frames (the middle of the sole), not the
    ankles as in the thesis. Solid: planned by a smooth curve; dashed: by the search.
    """
    schedule = style.need(record.schedule, "a contact schedule")
    planned = style.need(record.motions.get("planned"), "a planned whole-body motion")
    paths = style.need(record.effector_paths, "a body")["planned"]
    swings = [swing for swing in schedule.sequence.swings() if swing.effector in paths]
    style.need(swings, "an effector that leaves or makes a contact")
    colours = colours_of(record.effectors)
    parts = [_part(schedule, swing, planned.time, paths[swing.effector]) for swing in swings]
    space = Space.of(record.scene, [path for _, path in parts], contacts=distinct_contacts(schedule))
    figure = style.new_figure(13.0, 6.6, "Flights of feet and hands as planned")
    grid = figure.add_gridspec(1, 2, width_ratios=[1.25, 1])
    place, height = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    space.draw(place)
    space.draw_points(place)
    for swing, (time, path), method in zip(swings, parts, _methods(record, swings), strict=True):
        colour, dash = colours[swing.effector], "solid" if method != "bi-rrt" else (0, (4, 1.5))
        first, last = swing.first_phase, swing.last_phase
        where = f"phase {first}" if first == last else f"phases {first}–{last}"
        label = ", ".join(filter(None, (readable(swing.effector), where, method)))
        space.plot(place, path, color=colour, linestyle=dash, linewidth=2.2, zorder=8)
        height.plot(time, path[:, 2], color=colour, linestyle=dash, linewidth=1.8, label=label)
        if executed := record.effector_paths.get("executed"):
            motion = record.motions["executed"]
            time, path = _part(schedule, swing, motion.time, executed[swing.effector])
            height.plot(time, path[:, 2], **_EXECUTED)
    space.name_obstacles(style.Labels(place))
    if "executed" in record.effector_paths:
        height.plot([], [], **_EXECUTED, label="executed")
    style.dress(height, "height [m]", "time [s]")
    height.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure


_EXECUTED = {**style.STYLES["executed"], "linestyle": (0, (1, 1.5))}


def _methods(record: RunRecord, swings: list[Swing]) -> list[str]:
    """Method that planned each flight, as far as the summary says; empty if it just follows the body."""
    known: dict[str, list[str]] = {swing.effector: [] for swing in swings}
    for item in (record.summary.get("wholebody") or {}).get("swings") or ():
        if isinstance(item, dict):
            known.setdefault(str(item.get("effector")), []).append(str(item.get("method", "")))
    counts = Counter(swing.effector for swing in swings)
    left = {name: iter(known[name] if len(known[name]) == count else ()) for name, count in counts.items()}
    return [next(left[swing.effector], "") for swing in swings]


def _part(
    schedule: ContactSchedule, swing: Swing, time: FloatArray, path: FloatArray
) -> tuple[FloatArray, FloatArray]:
    start, end = schedule.swing_interval(swing)
    inside = (time >= start - 1e-9) & (time <= end + 1e-9)
    return time[inside], path[inside]


LEAST_SPAN = 0.02
"""Height of a panel at the least [m]."""


def effectors_figure(record: RunRecord) -> Figure:
    """Draw the coordinates of every foot and hand in contact ([Qiu2012]_ Fig. 6.10, 7.15)."""
    paths = style.need(record.effector_paths, "a whole-body motion and the body")
    names = style.need(list(next(iter(paths.values()))), "an effector in contact")
    size, margins = (max(4.4 * len(names), 7.0), 7.0), {"top": 0.75, "between": 0.22, "across": 0.5}
    shown = timeline(record, size, "Feet and hands", 3, len(names), strip=0.14, **margins)
    for column, name in enumerate(names):
        shown.strip(column, _title(record, name), named=column == 0)
        for row, axis in enumerate("xyz"):
            axes = shown.panel(row + 1, column)
            for kind, result in paths.items():
                axes.plot(record.motions[kind].time, result[name][:, row], label=kind, **style.STYLES[kind])
            shown.label(axes, f"{axis} [m]" if column == 0 else "")
            style.span_at_least(axes, LEAST_SPAN)
    style.legend_in_title(shown.figure, axes)
    return shown.figure


def _title(record: RunRecord, name: str) -> str:
    title = readable(name).capitalize()
    if len(record.effector_paths) < 2:
        return title
    return f"{title} (largest error {_errors(record, name).max():.2g} mm)"
