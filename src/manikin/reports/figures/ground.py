"""Seen from above: footprints, CoM, zero moment point, and the impulses that a standing body holds."""

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from manikin.balance.zmp import ZmpPath
from manikin.contact import Contact, ContactKind, ContactSchedule
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import RunRecord
from manikin.reports.figures import style
from manikin.reports.figures.timeline import timeline
from manikin.reports.figures.views import ABOVE, distinct_contacts, draw_contact, sections
from manikin.reports.solids import finite_obstacles
from manikin.runtime.display import COLOURS, CYCLE, colours_of, readable
from manikin.scene import Scene
from manikin.simulation import PushMap
from manikin.simulation.push_map import told_apart

PLAN_HEIGHT = 5.1
"""Height of the view from above [inch]."""
DISTANCE_WIDTH = 7.4
"""Width of the panel over time [inch]."""
EDGE = "#AEB4BE"
"""Colour of support polygons."""


def zmp_figure(record: RunRecord) -> Figure:
    """Draw the ZMP over the soles, and its distance to the support polygon ([Qiu2012]_ Fig. 5.13).

    The distance is drawn firm where it decides about balance: all supports in one plane, no
    grasp. Elsewhere it is dotted, measured in the level plane at their mean height.
    """
    schedule = style.need(record.schedule, "a contact schedule")
    paths = style.need(record.zmp, "a motion of the centre of mass")
    decisive = any(np.any(path.decisive) for path in paths.values())
    style.need(decisive, "a phase that stands on one plane without grasping")
    spans = np.subtract(*_plan_box(schedule)[::-1])
    plan = float(np.clip(PLAN_HEIGHT * spans[0] / spans[1], 2.0, 6.5))
    across = style.label_room(record.effectors) + 0.15
    shown = timeline(
        record, (0.8 + plan + across + DISTANCE_WIDTH, PLAN_HEIGHT + 1.35), "Zero moment point", 1, 2,
        strip=0.07, left=0.65, top=0.85, between=0.1, across=across, width_ratios=[plan, DISTANCE_WIDTH],
    )  # fmt: skip
    name, path = next(iter(paths.items()))
    _draw_plan(shown.figure.add_subplot(shown.grid[:, 0]), schedule, name, path)
    shown.strip(1)
    axes = shown.panel(1, 1)
    axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
    for kind, item in paths.items():
        _draw_distance(axes, kind, item)
    shown.label(axes, "distance to the edge of the support polygon [mm]")
    _frame_distance(axes, list(paths.values()))
    axes.legend(fontsize=8, loc="upper left", framealpha=0.9, edgecolor="none")
    counts = sorted({min(max(len(phase.stance), 1), 3) for phase in schedule.sequence})
    named = [(style.support_colour(count), f"ZMP, {style.support_words(count)}") for count in counts]
    keys = [
        *(Line2D([], [], color=colour, label=words) for colour, words in named),
        Line2D([], [], color=COLOURS["ink"], marker="*", linestyle="", label="change of phase"),
        Line2D([], [], color=EDGE, linestyle=(0, (5, 3)), label="support polygon"),
    ]
    style.legend_in_title(shown.figure, handles=keys)
    return shown.figure


def _draw_plan(axes: Axes, schedule: ContactSchedule, name: str, path: ZmpPath) -> None:
    contacts = distinct_contacts(schedule)
    colours = colours_of(contact.effector for contact in contacts)
    for contact in contacts:
        draw_contact(axes, contact, ABOVE, colours[contact.effector])
    for plane in path.planes:
        if plane is not None and len(plane.polygon) > 1:
            axes.fill(*plane.in_world(plane.polygon)[:, :2].T, fill=False, edgecolor=EDGE, linewidth=0.8,
                      linestyle=(0, (5, 3)), zorder=1)  # fmt: skip
    counts = [len(phase.stance) for phase in schedule.sequence]
    for part in sections(path.phase):
        count = counts[path.phase[part.start]]
        axes.plot(*path.point[part, :2].T, color=style.support_colour(count), linewidth=1.6, zorder=4)
    low, high = _plan_box(schedule)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal", adjustable="box", anchor="NW")
    labels = style.Labels(axes)
    for number, instant in enumerate(schedule.instants[1:-1]):
        sample = min(int(np.searchsorted(path.time, instant)), len(path.time) - 1)
        x, y = path.point[sample, :2]
        if np.isfinite(x) and np.isfinite(y):
            axes.plot(x, y, "*", color=COLOURS["ink"], markersize=8, zorder=6)
            labels.write(f"{number}|{number + 1}", (x, y), (5, 4), zorder=7)
    style.dress(axes, "y [m]", "x [m]", f"{name.capitalize()}, from above")


def _plan_box(schedule: ContactSchedule) -> tuple[FloatArray, FloatArray]:
    """Corners (2,) of what is seen from above [m]."""
    points = np.vstack([contact.points_in_world[:, :2] for contact in distinct_contacts(schedule)])
    return points.min(axis=0) - 0.15, points.max(axis=0) + 0.15


def _draw_distance(axes: Axes, name: str, path: ZmpPath) -> None:
    millimetres = 1000.0 * path.distance
    firm = np.where(path.decisive, millimetres, np.nan)
    least = int(np.nanargmin(firm)) if np.any(path.decisive) else None
    label = name if least is None else f"{name} (least {firm[least]:.1f} mm, {path.time[least]:.2f} s)"
    axes.plot(path.time, firm, label=label, **style.STYLES[name])
    if np.any(~path.decisive & np.isfinite(millimetres)):
        dotted = {**style.STYLES[name], "linestyle": (0, (1, 2)), "linewidth": 1.0}
        loose = np.where(path.decisive, np.nan, millimetres)
        axes.plot(path.time, loose, label=f"{name}, no criterion: several planes or a grasp", **dotted)


def _frame_distance(axes: Axes, paths: list[ZmpPath]) -> None:
    values = np.concatenate([1000.0 * path.distance[np.isfinite(path.distance)] for path in paths])
    low, high = (float(v) for v in np.percentile(values, (0.2, 100.0)))
    decisive = [1000.0 * float(p.distance[p.decisive].min()) for p in paths if np.any(p.decisive)]
    low = min([low, 0.0, *(max(value, -200.0) for value in decisive)])
    room = 0.08 * (high - low)
    axes.set_ylim(low - room, high + 3.0 * room)  # with room for the legend


OVERHEAD = 1.0
"""An obstacle that begins above this height [m] is something to walk under."""
NARROW = 0.75
"""A way this much narrower than long has its legend beside it."""
LEVEL = 0.3
"""Contacts whose normal has a smaller vertical part are on a wall."""


def footprint_figure(record: RunRecord) -> Figure:
    """Draw the soles in their order, the ZMP path and the CoM's projection ([Qiu2012]_ Fig. 5.13, 5.19)."""
    tracks = style.need(record.tracks, "a motion of the centre of mass")
    contacts = [] if record.schedule is None else distinct_contacts(record.schedule)
    on_walls = contacts and all(abs(contact.normal[2]) < LEVEL for contact in contacts)
    style.need(not on_walls, "a contact that is not on a wall")
    figure = style.new_figure(8.6, 8.2, "Footprints, zero moment point and centre of mass from above")
    axes = figure.add_subplot()
    colours = colours_of(contact.effector for contact in contacts)
    for number, contact in enumerate(contacts, 1):
        _draw_contact(axes, contact, number, colours[contact.effector])
    com = next(iter(tracks.values())).position
    everything = np.vstack([com[:, :2], *(contact.points_in_world[:, :2] for contact in contacts)])
    for name, track in tracks.items():
        if name in record.zmp:
            axes.plot(*record.zmp[name].point[:, :2].T, label=f"ZMP, {name}", **style.STYLES[name])
        dotted = {**style.STYLES[name], "linestyle": (0, (1.2, 1.6)), "linewidth": 1.6}
        axes.plot(*track.position[:, :2].T, label=f"centre of mass, {name}", **dotted)
    for point, text, marker in ((com[0], "start", "o"), (com[-1], "goal", "D")):
        axes.plot(point[0], point[1], marker, color=COLOURS["ink"], markersize=5, zorder=7)
        look = {"fontsize": 8, "color": COLOURS["ink"], "zorder": 8, "path_effects": [style.white_edge()]}
        axes.annotate(text, point[:2], (7, 4), textcoords="offset points", **look)
    low, high = everything.min(axis=0) - 0.18, everything.max(axis=0) + 0.18
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    if record.scene is not None:
        _draw_obstacles(axes, record.scene)
    style.dress(axes, "y [m]", "x [m]")
    narrow = high[0] - low[0] < NARROW * (high[1] - low[1])
    beside = {"bbox_to_anchor": (1.02, 1.0)} if narrow else {}
    axes.legend(fontsize=8, loc="upper left", framealpha=0.9, edgecolor="none", **beside)
    return figure


def _draw_contact(axes: Axes, contact: Contact, number: int, colour: str) -> None:
    draw_contact(axes, contact, ABOVE, colour)
    if contact.kind is ContactKind.SOLE:
        toes = contact.points_in_world[:2, :2]  # the first two corners are the front ones
        axes.plot(toes[:, 0], toes[:, 1], color=colour, linewidth=3.2, solid_capstyle="butt", zorder=2)
    heel = contact.position - contact.rotation_contact_to_world[:, 0] * (contact.length / 2 + 0.03)
    z = contact.position[2]
    height = f"\nz = {z:.3g} m" if z else ""
    axes.text(
        heel[0], heel[1], f"{number}: {readable(contact.effector)}{height}", fontsize=7.5, ha="center",
        va="center", color=colour, zorder=8, path_effects=[style.white_edge()],
    )  # fmt: skip


def _draw_obstacles(axes: Axes, scene: Scene) -> None:
    """Outlines; what hangs above is dashed. Names stand in a column below the first corner in view."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    column: dict[tuple[int, int], list[Any]] = {}
    seen = np.array([left, bottom, -np.inf]), np.array([right, top, np.inf])
    for obstacle in finite_obstacles(scene, *seen):
        low, high = obstacle.bounds
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        overhead = low[2] > OVERHEAD
        if not overhead:
            axes.add_patch(Polygon(corners, facecolor=COLOURS["obstacle"], alpha=0.22, zorder=0.5))
        line = (0, (5, 3)) if overhead else "solid"
        look = {"edgecolor": COLOURS["soft"], "linewidth": 0.9, "linestyle": line, "zorder": 0.6}
        axes.add_patch(Polygon(corners, fill=False, **look))
        corner = max(low[0], left), max(low[1], bottom)
        near = round(corner[0] / 0.1), round(corner[1] / 0.1)
        column.setdefault(near, [corner, 0])[1] += 1
        corner, row = column[near]
        text = f"{obstacle.name}, {'from' if overhead else 'up to'} z = {low[2] if overhead else high[2]:g} m"
        axes.annotate(text, corner, (3, -11 * row), textcoords="offset points", fontsize=7.5, color="#666C77")


SOLES = 0.3
"""Part of the radius that the soles reach to."""
CURVES = ("#0072B2", "#D55E00", *CYCLE)
"""Colours of the maps."""
MARKERS = "osD^vP*X"
BOUND = "bound without a step"


def push_map_figure(maps: Sequence[PushMap], soles: Sequence[FloatArray] = ()) -> Figure:
    """Draw the largest impulse held by direction, of one map or several.

    Ahead is up and left is left; a point stands where the force of the push leads. The soles are drawn in the
    middle for orientation, about the centre of mass and to a scale of their own. A direction that is not
    known, or in which the body does not stand by itself, is a gap. Dashed is the upper bound of what each
    holds without a step, where there is one.

    Args:
        maps: At least one with a known direction.
        soles: (k, 2) corners of each, from the centre of mass [m].
    """
    style.need(any(np.any(np.isfinite(item.held)) for item in maps), "an impulse that was held", "a map")
    common, names = told_apart([item.conditions for item in maps])
    figure = style.new_figure(7.4, 7.9, "Largest impulse held, by direction of the push")
    axes = figure.add_subplot(projection="polar")
    axes.set_title(fill(common, 96), fontsize=8.5, color=COLOURS["soft"], pad=8)
    top = 1.08 * max(float(np.nanmax([*item.held, *(item.bound or ())], initial=0.0)) for item in maps) or 1.0
    _dress(axes, top)
    _draw_soles(axes, soles, SOLES * top)
    for number, (item, name) in enumerate(zip(maps, names, strict=True)):
        _draw_curve(axes, item, name or "held", number)
    if any(item.bound for item in maps):
        axes.plot([], [], "--", linewidth=0.9, color=COLOURS["soft"], label=BOUND)
    if len(axes.get_legend_handles_labels()[1]) > 1:
        axes.legend(fontsize=8.5, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=2)
    return figure


def _draw_curve(axes: Axes, one: PushMap, name: str, number: int) -> None:
    """One closed curve; a gap stays where a direction is not known."""
    colour = CURVES[number % len(CURVES)]
    angle = np.radians([*one.directions, one.directions[0]])
    held = np.append(one.held, one.held[0])
    if one.bound:
        axes.plot(angle, [*one.bound, one.bound[0]], "--", linewidth=0.9, color=colour, zorder=3.5)
    axes.plot(
        angle, held, marker=MARKERS[number % len(MARKERS)], markersize=3.8, linewidth=1.6, color=colour,
        label=name, zorder=4 - 0.1 * number,
    )  # fmt: skip


def _draw_soles(axes: Axes, soles: Sequence[FloatArray], radius: float) -> None:
    if not len(soles):
        return
    scale = radius / max(float(np.linalg.norm(corners, axis=1).max()) for corners in soles)
    sides = ["left_foot" if corners[:, 1].mean() > 0.0 else "right_foot" for corners in soles]
    colours = colours_of(sides)
    for side, corners in zip(sides, soles, strict=True):
        closed = scale * np.vstack([corners, corners[:1]])
        angle, distance = np.arctan2(closed[:, 1], closed[:, 0]), np.linalg.norm(closed, axis=1)
        axes.fill(angle, distance, facecolor=colours[side], alpha=0.25, edgecolor=colours[side], zorder=2)
    axes.plot(0.0, 0.0, "+", color=COLOURS["ink"], markersize=7, zorder=3)


def _dress(axes: Axes, top: float) -> None:
    axes.set_theta_zero_location("N")  # type: ignore[attr-defined]
    axes.set_ylim(0.0, top)
    axes.set_rlabel_position(202.5)  # type: ignore[attr-defined]
    axes.set_thetagrids(  # type: ignore[attr-defined]
        range(0, 360, 45), ["ahead", "45°", "left\n90°", "135°", "back, 180°", "225°", "right\n270°", "315°"]
    )
    axes.tick_params(labelsize=8, colors=COLOURS["soft"])
    axes.tick_params(axis="x", pad=10)
    ticks = np.array(MaxNLocator(5).tick_values(0.0, top))
    axes.set_yticks(ticks[(ticks > 0.0) & (ticks < top)])
    axes.grid(True, color="#E3E3E3", linewidth=0.6)
    axes.yaxis.set_major_formatter("{x:g} N.s")
    axes.spines["polar"].set_color(COLOURS["soft"])
    axes.set_axisbelow(True)
