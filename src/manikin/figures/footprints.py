"""Footprints, centre of pressure and projected centre of mass seen from above."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from manikin.contact import Contact, ContactKind, ContactSchedule
from manikin.figures.style import COLOURS, STYLES, dress, new_figure, readable, white_edge
from manikin.motion.derived import centre_of_pressure
from manikin.motion.file import MotionFile
from manikin.scene import HalfSpace, Plane, Scene

OVERHEAD = 1.0
"""An obstacle that begins above this height [m] is something to walk under."""


def footprint_figure(content: MotionFile) -> Figure:
    """Draw the soles in their order, the ZMP path and the CoM's projection.

    Args:
        content: At least one motion, and the body.
    """
    figure = new_figure(8.6, 8.2, "Footprints, zero moment point and centre of mass from above")
    axes = figure.add_subplot()
    seen = next(iter(content.motions.values())).com[:, :2]
    if content.schedule is not None:
        corners = _draw_contacts(axes, content.schedule)
        seen = np.vstack([seen, corners])
    for name, motion in content.motions.items():
        if content.body is not None:
            pressure = centre_of_pressure(content.body, motion)
            axes.plot(pressure[:, 0], pressure[:, 1], label=f"ZMP, {name}", **STYLES[name])
        dotted = {**STYLES[name], "linestyle": (0, (1.2, 1.6)), "linewidth": 1.6}
        axes.plot(motion.com[:, 0], motion.com[:, 1], label=f"centre of mass, {name}", **dotted)
    _mark_ends(axes, next(iter(content.motions.values())).com)
    low, high = seen.min(axis=0) - 0.18, seen.max(axis=0) + 0.18
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    if content.scene is not None:
        _draw_obstacles(axes, content.scene)
    dress(axes, "y [m]", "x [m]")
    axes.legend(fontsize=8, loc="upper left", framealpha=0.9, edgecolor="none")
    return figure


def _draw_contacts(axes: Axes, schedule: ContactSchedule) -> np.ndarray:
    """Draw each contact once, numbered in the order it is made; return every corner."""
    drawn: list[Contact] = []
    for phase in schedule.sequence:
        for contact in phase.stance:
            if any(contact.same_place(other) for other in drawn):
                continue
            drawn.append(contact)
            _draw_contact(axes, contact, len(drawn))
    return np.vstack([contact.points_in_world[:, :2] for contact in drawn])


def _draw_contact(axes: Axes, contact: Contact, number: int) -> None:
    colour = COLOURS.get(contact.effector, COLOURS["soft"])
    x, y, z = contact.position
    if contact.kind is ContactKind.SOLE:
        axes.add_patch(Polygon(contact.points_in_world[:, :2], facecolor=colour, alpha=0.18, zorder=1.5))
        axes.add_patch(
            Polygon(contact.points_in_world[:, :2], fill=False, edgecolor=colour, linewidth=1.3, zorder=2)
        )
        toes = contact.points_in_world[:2, :2]  # the first two corners are the front ones
        axes.plot(toes[:, 0], toes[:, 1], color=colour, linewidth=3.2, solid_capstyle="butt", zorder=2)
    else:
        axes.plot(x, y, "s", color=colour, markersize=7, zorder=2)
    heel = contact.position - contact.rotation_contact_to_world[:, 0] * (contact.length / 2 + 0.03)
    height = f"\nz = {z:g} m" if z else ""
    axes.text(
        heel[0], heel[1], f"{number}: {readable(contact.effector)}{height}", fontsize=7.5, ha="center",
        va="center", color=colour, zorder=8, path_effects=[white_edge()],
    )  # fmt: skip


def _draw_obstacles(axes: Axes, scene: Scene) -> None:
    """Outlines; what hangs above is dashed. Names stand in a column below the first corner in view."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    column: dict[tuple[int, int], list[Any]] = {}
    for obstacle in scene:
        low, high = obstacle.bounds
        outside = low[0] > right or high[0] < left or low[1] > top or high[1] < bottom
        if isinstance(obstacle.shape, (HalfSpace, Plane)) or outside:
            continue
        corners = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
        overhead = low[2] > OVERHEAD
        if not overhead:
            axes.add_patch(Polygon(corners, facecolor=COLOURS["obstacle"], alpha=0.22, zorder=0.5))
        line = (0, (5, 3)) if overhead else "solid"
        outline = Polygon(corners, fill=False, edgecolor=COLOURS["soft"], linewidth=0.9, linestyle=line)
        outline.set_zorder(0.6)
        axes.add_patch(outline)
        corner = max(low[0], left), max(low[1], bottom)
        near = round(corner[0] / 0.1), round(corner[1] / 0.1)
        column.setdefault(near, [corner, 0])[1] += 1
        corner, row = column[near]
        text = f"{obstacle.name}, {'from' if overhead else 'up to'} z = {low[2] if overhead else high[2]:g} m"
        axes.annotate(text, corner, (3, -11 * row), textcoords="offset points", fontsize=7.5, color="#666C77")


def _mark_ends(axes: Axes, com: np.ndarray) -> None:
    for point, text, marker in ((com[0], "start", "o"), (com[-1], "goal", "D")):
        axes.plot(point[0], point[1], marker, color=COLOURS["ink"], markersize=5, zorder=7)
        axes.annotate(
            text,
            point[:2],
            (7, 4),
            textcoords="offset points",
            fontsize=8,
            color=COLOURS["ink"],
            zorder=8,
            path_effects=[white_edge()],
        )
