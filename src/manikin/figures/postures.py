"""The postures at the key instants, side by side."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from manikin.figures.style import dress, need, new_grid
from manikin.figures.views import (
    ALONG_X,
    ALONG_Y,
    View,
    draw_body,
    draw_contact,
    draw_obstacles,
    panel_ticks,
)
from manikin.motion import Motion
from manikin.palette import COLOURS, side_colour
from manikin.record import RunRecord
from manikin.spatial import FloatArray

MOST = 9
"""With more key instants than this some are left out, evenly."""

GAP = 0.12
"""Between two panels [m]."""


def postures_figure(record: RunRecord) -> Figure:
    """Draw the body at the key instants, seen along y and along x ([Qiu2012]_ Fig. 5.14, 6.8, 7.10, 7.13).

    A motion in one stance has no key instants; it is drawn where much happens. The executed motion is drawn,
    or else the planned one; grey, the path of the CoM.

    Args:
        record: With a whole-body motion and the body.

    Raises:
        FigureError: If one is missing.
    """
    motions = need(record.motions, "a whole-body motion")
    need(record.body, "a body")
    phases = need(record.phases, "phases")
    name, motion = list(motions.items())[-1]
    instants = chosen_instants(phases.instants)
    if len(instants) == 2:
        instants = eventful_instants(motion)
    samples = [int(np.argmin(np.abs(motion.time - instant))) for instant in instants]
    low, high = _frame(record, motion.com)
    spans = high - low
    widths = np.array([spans[0], spans[1]])
    scale = 1.85 / widths.max()
    figure, grid = new_grid(
        (widths.max() + GAP) * scale * len(samples) + 0.75, 2.0 * spans[2] * scale + 1.7,
        f"Postures at the key instants ({name})", 2, 1, top=0.65, between=0.5,
    )  # fmt: skip
    for row, view in enumerate((ALONG_Y, ALONG_X)):
        axes = figure.add_subplot(grid[row, 0])
        left, right = view(np.array([low, high]))[:, 0]
        offsets = [(widths.max() + GAP) * column for column in range(len(samples))]
        for offset, sample, instant in zip(offsets, samples, instants, strict=True):
            _draw_posture(axes, record, view.moved(offset, 0.0), name, sample, (low, high))
            if row == 0:
                middle, top = offset + (left + right) / 2, high[2]
                axes.annotate(f"{instant:.2f} s", (middle, top), (0, 4),
                              textcoords="offset points", ha="center", fontsize=9)  # fmt: skip
        horizontal, vertical = view.labels
        dress(axes, vertical, f"{horizontal}, seen {view.words}, each panel")
        frame_panels(axes, (left, right), (low[2], high[2]), offsets)
    return figure


def _draw_posture(
    axes: Axes, record: RunRecord, view: View, name: str, sample: int, box: tuple[FloatArray, FloatArray]
) -> None:
    motion = record.motions[name]
    draw_moment(axes, record, motion, sample, view, box)
    if record.schedule is not None:
        end = float(record.schedule.instants[-1])
        for contact in record.schedule.stance_at(min(float(motion.time[sample]), end)):
            draw_contact(axes, contact, view, side_colour(contact.effector))
    axes.plot(*view(motion.com).T, color=COLOURS["soft"], linewidth=0.8, zorder=4)


def draw_moment(
    axes: Axes, record: RunRecord, motion: Motion, sample: int, view: View, box: tuple[FloatArray, FloatArray]
) -> None:
    """Draw the body among the obstacles at one sample of a motion, with its CoM.

    Args:
        axes: Where to draw.
        record: Of the run.
        motion: One of its motions.
        sample: Index of the sample.
        view: The plane that is seen, moved to the panel.
        box: Lower and upper corner of what is shown [m].
    """
    if record.scene is not None:
        draw_obstacles(axes, record.scene, view, *box)
    if record.body is not None:
        draw_body(axes, record.body, motion.q[sample], view)
    axes.plot(*view(motion.com[sample]), "o", color=COLOURS["ink"], markersize=4, zorder=5)


def frame_panels(
    axes: Axes, across: tuple[float, float], upwards: tuple[float, float], offsets: Sequence[float]
) -> None:
    """Set ticks and limits of panels side by side in one pair of axes, to one scale.

    Args:
        axes: With the panels.
        across: Both ends of the first panel [m].
        upwards: Both ends of all [m].
        offsets: Where the zero of each panel is drawn [m].
    """
    left, right = across
    axes.grid(False, axis="x")
    axes.set_xticks(*panel_ticks(left, right, offsets))
    axes.set(xlim=(left, right + offsets[-1]), ylim=upwards)
    axes.set_aspect("equal", adjustable="box", anchor="W")


def chosen_instants(instants: FloatArray) -> FloatArray:
    """At most :data:`MOST` of the key instants, the first and the last among them."""
    if len(instants) <= MOST:
        return instants
    return instants[np.unique(np.linspace(0, len(instants) - 1, MOST).round().astype(int))]


def eventful_instants(motion: Motion) -> FloatArray:
    """At most :data:`MOST` instants between which the joints turn equally far, from begin to end [s]."""
    travel = np.abs(np.diff(motion.q[:, 7:], axis=0)).sum(axis=1)
    turned = np.concatenate(([0.0], np.cumsum(travel + 1e-9)))
    return np.interp(np.linspace(0.0, turned[-1], min(MOST, len(turned))), turned, motion.time)


def _frame(record: RunRecord, com: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corners of a box around the body during the whole motion [m]."""
    reach = np.array([0.55, 0.55, 1.05])
    low, high = com.min(axis=0) - reach, com.max(axis=0) + reach
    if record.schedule is not None:
        soles = np.vstack([c.points_in_world for phase in record.schedule.sequence for c in phase.stance])
        low = np.minimum(low, soles.min(axis=0) - 0.05)
        low[2] = min(float(soles[:, 2].min()) - 0.05, float(com[:, 2].min()) - 0.3)
        high = np.maximum(high, soles.max(axis=0) + 0.05)
    return low, high
