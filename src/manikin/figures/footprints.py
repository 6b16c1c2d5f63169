"""Footprints, zero moment point and projected centre of mass seen from above."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from manikin.contact import Contact, ContactKind
from manikin.figures.style import STYLES, dress, need, new_figure, white_edge
from manikin.figures.views import ABOVE, distinct_contacts, draw_contact
from manikin.palette import COLOURS, colours_of, readable
from manikin.record import RunRecord
from manikin.scene import HalfSpace, Plane, Scene

OVERHEAD = 1.0
"""An obstacle that begins above this height [m] is something to walk under."""

NARROW = 0.75
"""A way this much narrower than long has its legend beside it."""

LEVEL = 0.3
"""Contacts whose normal has a smaller vertical part are on a wall."""


def footprint_figure(record: RunRecord) -> Figure:
    """Draw the soles in their order, the ZMP path and the CoM's projection ([Qiu2012]_ Fig. 5.13, 5.19).

    Args:
        record: With a planned CoM, or at least one motion, and something to stand on.

    Raises:
        FigureError: If nothing moves, or all contacts are on walls.
    """
    tracks = need(record.tracks, "a motion of the centre of mass")
    contacts = [] if record.schedule is None else distinct_contacts(record.schedule)
    if contacts and all(abs(contact.normal[2]) < LEVEL for contact in contacts):
        need(None, "a contact that is not on a wall")
    figure = new_figure(8.6, 8.2, "Footprints, zero moment point and centre of mass from above")
    axes = figure.add_subplot()
    colours = colours_of(contact.effector for contact in contacts)
    for number, contact in enumerate(contacts):
        _draw_contact(axes, contact, number + 1, colours[contact.effector])
    seen = [next(iter(tracks.values())).position[:, :2], *(c.points_in_world[:, :2] for c in contacts)]
    for name, track in tracks.items():
        if name in record.zmp:
            point = record.zmp[name].point
            axes.plot(point[:, 0], point[:, 1], label=f"ZMP, {name}", **STYLES[name])
        dotted = {**STYLES[name], "linestyle": (0, (1.2, 1.6)), "linewidth": 1.6}
        axes.plot(*track.position[:, :2].T, label=f"centre of mass, {name}", **dotted)
    _mark_ends(axes, next(iter(tracks.values())).position)
    everything = np.vstack(seen)
    low, high = everything.min(axis=0) - 0.18, everything.max(axis=0) + 0.18
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    if record.scene is not None:
        _draw_obstacles(axes, record.scene)
    dress(axes, "y [m]", "x [m]")
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
