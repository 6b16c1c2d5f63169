"""A recorded person on one sheet: postures, supports, forces, balance, height, scores.

All curves are drawn in one pair of axes, band above band: a page of axes takes three times as long, and there
is a sheet for every recording of a folder.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from manikin.body import BodyModel
from manikin.figures.style import COLOURS, colours_of, new_grid, readable
from manikin.figures.views import side_colour
from manikin.spatial import FloatArray

if TYPE_CHECKING:
    from manikin.analysis import Analysis

POSTURES = 7
"""Postures drawn, at even times."""

STEP = 1.3
"""From one posture to the next on the sheet [m]."""

WIDTH = 11.0
STRIP, ROW, BAND, GAP = 2.0, 0.25, 1.15, 0.42
"""Heights of the postures, a row of supports, a band of curves, and between bands [inch]."""

Curves = Mapping[str, tuple[FloatArray, str]]


@dataclass(frozen=True)
class _Band:
    """Curves over time on a common scale.

    Attributes:
        title: What they are, with the unit.
        curves: Values (n,) and colour by name; the first is drawn last.
        low: Lower end of the scale.
        high: Upper end.
    """

    title: str
    curves: Curves
    low: float
    high: float


def recording_figure(analysis: "Analysis") -> Figure:
    """Draw what was measured of a recording over time."""
    names, bands = analysis.motion.contact_names, _bands(analysis)
    rows = ROW * max(len(names), 1)
    height = rows + sum(GAP + BAND for _ in bands)
    figure, grid = new_grid(
        WIDTH,
        STRIP + height + 1.2,
        analysis.name,
        2,
        1,
        left=0.95,
        between=0.25,
        height_ratios=(STRIP, height),
    )
    figure.set_dpi(75)
    _postures(figure.add_subplot(grid[0, 0]), analysis)
    axes = figure.add_subplot(grid[1, 0])
    axes.set_xlim(float(analysis.time[0]), float(analysis.time[-1]))
    axes.set_ylim(0.0, height)
    axes.yaxis.set_visible(False)
    for side in ("top", "left", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8)
    axes.set_xlabel("time [s]", fontsize=9)
    _supports(axes, analysis, height)
    for number, band in enumerate(bands):
        _draw(axes, analysis.time, band, height - rows - number * (GAP + BAND) - GAP - BAND)
    return figure


def _bands(analysis: "Analysis") -> list[_Band]:
    ink, ours, soft = COLOURS["ink"], COLOURS["recorded"], COLOURS["soft"]
    forces = {"from motion": (analysis.vertical_force / analysis.weight, ours)}
    if analysis.plates is not None:
        measured = np.where(analysis.plates.compared, analysis.plates.vertical_force, np.nan)
        forces["force plates"] = (measured / analysis.weight, ink)
    margins = {"whole body": (analysis.motion.margin, ours), "point mass": (analysis.point_mass_margin, soft)}
    bands = [
        _scaled("vertical force [body weight]", forces, 0.0),
        _scaled("margin [N.m]", margins, 0.0, 0.01),
        _scaled("height of the centre of mass [m]", {"": (analysis.com_height, ours)}),
    ]
    posture = analysis.ergonomics.posture
    if posture is not None:
        scores = {
            one.method: (one.score.astype(np.float64), COLOURS[colour])
            for one, colour in ((posture.rula, "planned"), (posture.reba, "executed"))
        }
        bands.append(_Band("scores", scores, 0.0, 15.0))
    return bands


def _scaled(title: str, curves: Curves, least: float | None = None, cut: float = 0.0) -> _Band:
    """A band that shows all values but the share ``cut`` that is lowest, and the value ``least``."""
    known = np.concatenate([values[np.isfinite(values)] for values, _ in curves.values()])
    low, high = (float(np.quantile(known, cut)), float(known.max())) if known.size else (0.0, 1.0)
    low = low if least is None else min(low, least)
    room = 0.05 * max(high - low, 0.05)
    return _Band(title, curves, low - room, high + room)


def _draw(axes: Axes, time: FloatArray, band: _Band, bottom: float) -> None:
    def placed(values: FloatArray) -> FloatArray:
        shares = (values - band.low) / (band.high - band.low)
        return bottom + BAND * np.where(np.abs(shares - 0.5) <= 0.5, shares, np.nan)

    ticks = np.asarray(MaxNLocator(nbins=3).tick_values(band.low, band.high))
    ticks = ticks[(ticks >= band.low) & (ticks <= band.high)]
    beside = axes.get_yaxis_transform()
    for tick, level in zip(ticks, placed(ticks), strict=True):
        axes.text(-0.008, level, f"{tick:g}", transform=beside, ha="right", va="center", fontsize=8)
    axes.hlines(placed(ticks), time[0], time[-1], color="#E3E3E3", linewidth=0.6, zorder=0.5)
    axes.text(0.0, bottom + BAND + 0.06, band.title, transform=beside, fontsize=9, color=COLOURS["ink"])
    right = 1.0
    for name, (values, colour) in reversed(list(band.curves.items())):
        axes.plot(time, placed(values), color=colour, linewidth=1.2)
        axes.text(right, bottom + BAND + 0.06, name, transform=beside, ha="right", fontsize=8.5, color=colour)
        right -= 0.009 * len(name) + 0.015


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
    for number, frame in enumerate(frames):
        axes.text(STEP * number, -0.16, f"{analysis.time[frame]:.2f} s", ha="center", fontsize=7.5)
    axes.axhline(0.0, color=COLOURS["soft"], linewidth=0.8)
    axes.set_aspect("equal")
    axes.set_xlim(-0.7, STEP * (len(frames) - 1) + 0.7)
    axes.set_ylim(-0.25, float(np.max(turned[:, 2])) - floor + 0.55 * (analysis.body.stature or 1.75))
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


def _supports(axes: Axes, analysis: "Analysis", top: float) -> None:
    """A row of bars for each effector, from the top."""
    names = analysis.motion.contact_names
    colours, beside = colours_of(names), axes.get_yaxis_transform()
    for row, name in enumerate(names):
        bottom = top - ROW * (row + 1)
        spans = [(one.start, one.duration) for one in analysis.supports.of(name)]
        axes.broken_barh(spans, (bottom + 0.1 * ROW, 0.8 * ROW), color=colours[name])
        axes.text(
            -0.008, bottom + 0.5 * ROW, readable(name), transform=beside, ha="right", va="center", fontsize=8
        )
