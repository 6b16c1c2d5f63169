"""A recorded motion as a strip: postures from the side, heights of effectors, and which of them support."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import ConnectionPatch

from manikin.body import BodyModel
from manikin.errors import FigureError
from manikin.numerics.spatial import FloatArray, rotation_from_yaw, turned_root
from manikin.recordings import Reconstruction, RecordedSupports
from manikin.recordings.supports.support_levels import effector_places
from manikin.reports.figures.style import dress, label_room, new_grid
from manikin.reports.figures.views import ALONG_Y, View, draw_body
from manikin.runtime.display import COLOURS, colours_of, readable

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
        q = turned[sample]
        view: View = ALONG_Y.moved(pitch * number - float(q[0]), 0.0)
        box = np.array([q[:3], q[:3]]) + 0.5 * pitch * np.array([[-1.0], [1.0]])
        box[:, 2] = low, high
        draw_body(axes, None, found.body, q, view, (box[0], box[1]))
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
