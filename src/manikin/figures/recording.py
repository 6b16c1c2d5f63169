"""A recorded person on one sheet: postures, supports, forces, balance, height, joint scores."""

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from manikin.analysis import Analysis
from manikin.body import BodyModel
from manikin.figures.style import COLOURS, colours_of, dress, new_grid, readable
from manikin.figures.views import side_colour
from manikin.spatial import FloatArray

POSTURES = 9
"""Postures drawn, at even times."""

STEP = 1.0
"""From one posture to the next on the sheet [m]."""

WIDTH = 11.0
HEIGHTS = (2.0, 0.75, 1.35, 1.35, 1.1, 1.1)
"""Of the panels [inch]."""


def recording_figure(analysis: "Analysis") -> Figure:
    """Draw what was measured of a recording over time."""
    names = analysis.motion.contact_names
    heights = (*HEIGHTS[:1], max(0.5, 0.25 * len(names)), *HEIGHTS[2:])
    between = 0.3
    height = sum(heights) + between * (len(heights) - 1) + 0.95
    figure, grid = new_grid(
        WIDTH, height, analysis.name, len(heights), 1, left=1.05, between=between, height_ratios=heights
    )
    figure.set_dpi(80)
    panels = [figure.add_subplot(grid[row, 0]) for row in range(len(heights))]
    _postures(panels[0], analysis)
    _supports(panels[1], analysis)
    _forces(panels[2], analysis)
    _margins(panels[3], analysis)
    _heights(panels[4], analysis)
    _scores(panels[5], analysis)
    for axes in panels[1:]:
        axes.set_xlim(float(analysis.time[0]), float(analysis.time[-1]))
    for axes in panels[1:-1]:
        axes.xaxis.set_visible(False)  # ticks are what takes most of the drawing time
    for axes in panels[2:]:
        axes.locator_params(axis="y", nbins=4)
    panels[-1].set_xlabel("time [s]", fontsize=9)
    return figure


def _postures(axes: Axes, analysis: "Analysis") -> None:
    """Postures from the right side of where the person goes, or looks at first."""
    frames = np.unique(np.linspace(0, len(analysis.time) - 1, POSTURES).round().astype(int))
    turned = _turned(analysis.motion.q[frames], -_heading(analysis))
    floor = min(analysis.supports.surfaces, default=0.0)
    turned[:, :2] = 0.0
    places = [np.array([STEP * number, -floor]) for number in range(len(turned))]
    lines = [place + _bones(analysis.body, q) for place, q in zip(places, turned, strict=True)]
    colours = [side_colour(segment.name) for segment in analysis.body.segments[1:]]
    drawn = list(np.concatenate(lines))
    bones = LineCollection(drawn, colors=colours * len(lines), linewidths=3.5, capstyle="round")
    axes.add_collection(bones, autolim=False)
    for number in range(len(turned)):
        axes.text(STEP * number, -0.16, f"{analysis.time[frames[number]]:.2f} s", ha="center", fontsize=7.5)
    axes.axhline(0.0, color=COLOURS["soft"], linewidth=0.8)
    axes.set_aspect("equal")
    axes.set_xlim(-0.7, STEP * (len(frames) - 1) + 0.7)
    top = float(np.max(turned[:, 2])) - floor + 0.55 * (analysis.body.stature or 1.75)
    axes.set_ylim(-0.25, top)
    axes.axis("off")


def _bones(body: BodyModel, q: FloatArray) -> FloatArray:
    """(k, 2, 2) lines from the origin of each segment's parent to its own, seen from the right [m]."""
    model, data = body.pinocchio, body.pinocchio.createData()
    pin.framesForwardKinematics(model, data, q)
    places = {one.name: data.oMf[body.segment_frame(one.name)].translation[[0, 2]] for one in body.segments}
    return np.array([[places[one.parent or ""], places[one.name]] for one in body.segments[1:]])


def _heading(analysis: "Analysis") -> float:
    """Where the pelvis goes, or faces in the middle of the recording where it stays [rad]."""
    q = analysis.motion.q
    way = q[-1, :2] - q[0, :2]
    if float(np.linalg.norm(way)) > 0.5:
        return float(np.arctan2(way[1], way[0]))
    x, y, z, w = q[len(q) // 2, 3:7]
    return float(np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z)))


def _turned(q: FloatArray, angle: float) -> FloatArray:
    """(n, nq) postures turned about the vertical."""
    turned = np.array(q)
    about = pin.Quaternion(np.array([0.0, 0.0, np.sin(0.5 * angle), np.cos(0.5 * angle)]))
    turned[:, 3:7] = [(about * pin.Quaternion(one)).coeffs() for one in q[:, 3:7]]
    return turned


def _supports(axes: Axes, analysis: "Analysis") -> None:
    names = analysis.motion.contact_names
    colours = colours_of(names)
    for row, name in enumerate(names):
        spans = [(one.start, one.duration) for one in analysis.supports.of(name)]
        axes.broken_barh(spans, (-row - 0.4, 0.8), color=colours[name])
    dress(axes)
    axes.set_yticks([-row for row in range(len(names))], [readable(name) for name in names], fontsize=8)
    axes.set_ylim(-max(len(names), 1) + 0.4, 0.6)
    axes.grid(False)


def _forces(axes: Axes, analysis: "Analysis") -> None:
    weight = analysis.weight
    axes.plot(analysis.time, analysis.vertical_force / weight, color=COLOURS["recorded"], label="from motion")
    if analysis.plates is not None:
        measured = np.where(analysis.plates.compared, analysis.plates.vertical_force, np.nan)
        axes.plot(analysis.time, measured / weight, color=COLOURS["ink"], linewidth=1.0, label="force plates")
    dress(axes, "vertical force\n[body weight]")
    _name_curves(axes)


def _margins(axes: Axes, analysis: "Analysis") -> None:
    axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.8)
    axes.plot(
        analysis.time, analysis.point_mass_margin, color=COLOURS["soft"], linewidth=1.0, label="point mass"
    )
    axes.plot(analysis.time, analysis.motion.margin, color=COLOURS["recorded"], label="whole body")
    known = analysis.motion.margin[np.isfinite(analysis.motion.margin)]
    if known.size:
        low, high = min(0.0, float(np.quantile(known, 0.01))), float(known.max())
        axes.set_ylim(low - 0.1 * (high - low) - 1.0, high + 0.1 * (high - low) + 1.0)
    dress(axes, "margin\n[N.m]")
    _name_curves(axes)


def _heights(axes: Axes, analysis: "Analysis") -> None:
    axes.plot(analysis.time, analysis.com_height, color=COLOURS["recorded"])
    dress(axes, "centre of mass\n[m]")


def _scores(axes: Axes, analysis: "Analysis") -> None:
    posture = analysis.ergonomics.posture
    if posture is not None:
        for one, colour in ((posture.rula, COLOURS["planned"]), (posture.reba, COLOURS["executed"])):
            axes.step(analysis.time, one.score, where="post", color=colour, label=one.method)
        _name_curves(axes)
    axes.set_ylim(0.0, 15.5)
    dress(axes, "score")


def _name_curves(axes: Axes) -> None:
    """Names of the curves in their colours above the right end, which takes a tenth of a legend's time."""
    right = 1.0
    for line in reversed([one for one in axes.lines if not str(one.get_label()).startswith("_")]):
        name = str(line.get_label())
        axes.text(
            right, 1.03, name, transform=axes.transAxes, ha="right", fontsize=8.5, color=line.get_color()
        )
        right -= 0.009 * len(name) + 0.015
