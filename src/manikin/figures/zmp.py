"""The zero moment point in the support polygons, and how far it stays inside."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from manikin.balance.zmp_path import ZmpPath
from manikin.contact import ContactSchedule
from manikin.figures.labels import Labels
from manikin.figures.style import STYLES, dress, label_room, need, support_colour, support_words
from manikin.figures.timeline import timeline
from manikin.figures.views import ABOVE, distinct_contacts, draw_contact, sections
from manikin.palette import COLOURS, colours_of
from manikin.record import RunRecord
from manikin.spatial import FloatArray

PLAN_HEIGHT = 5.1
"""Of the view from above [inch]."""

DISTANCE_WIDTH = 7.4
"""Of the panel over time [inch]."""

EDGE = "#AEB4BE"
"""Colour of support polygons."""


def zmp_figure(record: RunRecord) -> Figure:
    """Draw the ZMP over the soles, and its distance to the support polygon ([Qiu2012]_ Fig. 5.13).

    The distance is drawn firm where it decides about balance: all supports in one plane, no
    grasp. Elsewhere it is dotted, measured in the level plane at their mean height.

    Args:
        record: With a schedule and a motion or a planned CoM.

    Raises:
        FigureError: If there is no phase in which the ZMP decides about balance.
    """
    schedule = need(record.schedule, "a contact schedule")
    paths = need(record.zmp, "a motion of the centre of mass")
    if not any(np.any(path.decisive) for path in paths.values()):
        need(None, "a phase that stands on one plane without grasping")
    plan = _plan_width(schedule)
    across = label_room(record.effectors) + 0.15
    shown = timeline(
        record, (0.8 + plan + across + DISTANCE_WIDTH, PLAN_HEIGHT + 1.35), "Zero moment point", 1, 2,
        strip=0.07, left=0.65, top=0.85, between=0.1, across=across, width_ratios=[plan, DISTANCE_WIDTH],
    )  # fmt: skip
    name, path = next(iter(paths.items()))
    _draw_plan(shown.figure.add_subplot(shown.grid[:, 0]), schedule, name, path)
    shown.strip(1)
    axes = shown.panel(1, 1)
    axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
    for kind, one in paths.items():
        _draw_distance(axes, kind, one)
    shown.label(axes, "distance to the edge of the support polygon [mm]")
    _frame_distance(axes, list(paths.values()))
    axes.legend(fontsize=8, loc="upper left", framealpha=0.9, edgecolor="none")
    _legend_of_plan(shown.figure, schedule)
    return shown.figure


def _draw_plan(axes: Axes, schedule: ContactSchedule, name: str, path: ZmpPath) -> None:
    contacts = distinct_contacts(schedule)
    colours = colours_of(contact.effector for contact in contacts)
    for contact in contacts:
        draw_contact(axes, contact, ABOVE, colours[contact.effector])
    for plane in path.planes:
        if plane is not None and len(plane.polygon) > 1:
            axes.fill(*plane.corners_in_world[:, :2].T, fill=False, edgecolor=EDGE, linewidth=0.8,
                      linestyle=(0, (5, 3)), zorder=1)  # fmt: skip
    counts = [len(phase.stance) for phase in schedule.sequence]
    for part in sections(path.phase):
        count = counts[path.phase[part.start]]
        axes.plot(*path.point[part, :2].T, color=support_colour(count), linewidth=1.6, zorder=4)
    low, high = _plan_box(schedule)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal", adjustable="box", anchor="NW")
    labels = Labels(axes)
    for number, instant in enumerate(schedule.instants[1:-1]):
        sample = min(int(np.searchsorted(path.time, instant)), len(path.time) - 1)
        x, y = path.point[sample, :2]
        if np.isfinite(x) and np.isfinite(y):
            axes.plot(x, y, "*", color=COLOURS["ink"], markersize=8, zorder=6)
            labels.write(f"{number}|{number + 1}", (x, y), (5, 4), zorder=7)
    dress(axes, "y [m]", "x [m]", f"{name.capitalize()}, from above")


def _plan_box(schedule: ContactSchedule) -> tuple[FloatArray, FloatArray]:
    """Corners (2,) of what is seen from above [m]."""
    points = np.vstack([contact.points_in_world[:, :2] for contact in distinct_contacts(schedule)])
    return points.min(axis=0) - 0.15, points.max(axis=0) + 0.15


def _plan_width(schedule: ContactSchedule) -> float:
    """Width that the plan takes at its height [inch]."""
    low, high = _plan_box(schedule)
    return float(np.clip(PLAN_HEIGHT * (high - low)[0] / (high - low)[1], 2.0, 6.5))


def _legend_of_plan(figure: Figure, schedule: ContactSchedule) -> None:
    """A legend in one row at the height of the figure's title."""
    shown = sorted({min(max(len(phase.stance), 1), 3) for phase in schedule.sequence})
    handles = [Line2D([], [], color=support_colour(c), label=f"ZMP, {support_words(c)}") for c in shown]
    handles.append(Line2D([], [], color=COLOURS["ink"], marker="*", linestyle="", label="change of phase"))
    handles.append(Line2D([], [], color=EDGE, linestyle=(0, (5, 3)), label="support polygon"))
    figure.legend(handles=handles, fontsize=8.5, frameon=False, loc="upper right", ncols=len(handles))


def _draw_distance(axes: Axes, name: str, path: ZmpPath) -> None:
    millimetres = 1000.0 * path.distance
    firm = np.where(path.decisive, millimetres, np.nan)
    least = int(np.nanargmin(firm)) if np.any(path.decisive) else None
    label = name if least is None else f"{name} (least {firm[least]:.1f} mm, {path.time[least]:.2f} s)"
    axes.plot(path.time, firm, label=label, **STYLES[name])
    if np.any(~path.decisive & np.isfinite(millimetres)):
        dotted = {**STYLES[name], "linestyle": (0, (1, 2)), "linewidth": 1.0}
        loose = np.where(path.decisive, np.nan, millimetres)
        axes.plot(path.time, loose, label=f"{name}, no criterion: several planes or a grasp", **dotted)


def _frame_distance(axes: Axes, paths: list[ZmpPath]) -> None:
    values = np.concatenate([1000.0 * path.distance[np.isfinite(path.distance)] for path in paths])
    low, high = (float(v) for v in np.percentile(values, (0.2, 100.0)))
    decisive = [1000.0 * float(p.distance[p.decisive].min()) for p in paths if np.any(p.decisive)]
    low = min([low, 0.0, *(max(value, -200.0) for value in decisive)])
    room = 0.08 * (high - low)
    axes.set_ylim(low - room, high + 3.0 * room)  # with room for the legend
