"""The largest impulse that a standing body holds, by direction, as curves around its soles."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from manikin.errors import FigureError
from manikin.numerics.spatial import FloatArray
from manikin.reports.figures.style import new_figure
from manikin.runtime.palette import COLOURS, CYCLE, colours_of
from manikin.simulation import PushMap
from manikin.simulation.push_map import told_apart

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

    Raises:
        FigureError: If there is nothing to draw.
    """
    if not any(np.any(np.isfinite(item.held)) for item in maps):
        raise FigureError("this figure needs an impulse that was held; valid: a map with one")
    common, names = told_apart([item.conditions for item in maps])
    figure = new_figure(7.4, 7.9, "Largest impulse held, by direction of the push")
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
