"""How long each phase lasts, and when the supports are really loaded."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from manikin.contact import ContactSchedule
from manikin.figures.style import (
    dress,
    end_of,
    label_room,
    named_below,
    need,
    new_grid,
    support_colour,
    support_keys,
)
from manikin.figures.timeline import draw_phases
from manikin.motion import Motion
from manikin.palette import COLOURS, colours_of, readable
from manikin.record import RunRecord

AT_LIMIT = 1e-3
"""A duration this close to its bound is at it [s]."""

_NAME_SIZE = 6.5
"""Font of the names below the bars [points]."""


def timing_figure(record: RunRecord) -> Figure:
    """Draw the durations of the phases with their bounds, and the supports in time ([Qiu2012]_ Fig. 5.16).

    Args:
        record: With a schedule; loaded contacts are drawn when there is an execution.

    Raises:
        FigureError: If there is no schedule.
    """
    schedule = need(record.schedule, "a contact schedule")
    phases = need(record.phases, "phases")
    executed = record.motions.get("executed")
    rows = 0.4 * len(record.effectors)
    most = max(len(phase.stance) for phase in schedule.sequence)
    figure, grid = new_grid(
        _width(schedule), 4.0 + 0.13 * most + rows, "Timing of the phases", 2, 1,
        left=label_room(record.effectors), top=0.7, between=0.6 + 0.13 * most, height_ratios=[2.2, rows],
    )  # fmt: skip
    _draw_durations(figure.add_subplot(grid[0]), schedule)
    axes = figure.add_subplot(grid[1])
    end = end_of(record)
    draw_phases(axes, phases, end)
    colours = colours_of(record.effectors)
    for row, name in enumerate(record.effectors):
        bars = _bars(schedule, name, end)
        axes.broken_barh(bars, (row + 0.12, 0.40), facecolors=colours[name], alpha=0.9)
        if executed is not None and name in executed.contact_names:
            axes.broken_barh(
                _loaded(executed, name), (row + 0.56, 0.26), facecolors=COLOURS["ink"], alpha=0.75
            )
    axes.set_yticks(np.arange(len(record.effectors)) + 0.5, [readable(n) for n in record.effectors])
    axes.set_ylim(len(record.effectors), 0.0)
    note = "planned supports (wide bars) and loaded contacts of the execution (narrow bars)"
    dress(axes, "", "time [s]", note if executed is not None else "planned supports")
    axes.grid(False)
    return figure


def _draw_durations(axes: Axes, schedule: ContactSchedule) -> None:
    durations = schedule.durations
    for number, (phase, duration) in enumerate(zip(schedule.sequence, durations, strict=True)):
        least, most = phase.min_duration, phase.max_duration
        at_limit = duration <= least + AT_LIMIT
        axes.bar(number, duration, width=0.62, color=support_colour(len(phase.stance)), alpha=0.8,
                 hatch="///" if at_limit else None, edgecolor="white", linewidth=0.0)  # fmt: skip
        for bound, style in ((least, "solid"), (most, "dotted")):
            if bound is not None and bound < 3.0 * float(durations.max()):
                axes.hlines(bound, number - 0.38, number + 0.38, color=COLOURS["ink"], linewidth=1.2,
                            linestyle=style, zorder=4)  # fmt: skip
        axes.annotate(f"{duration:.2f}", (number, max(duration, least)), (0, 3), textcoords="offset points",
                      ha="center", fontsize=8)  # fmt: skip
    named = [f"{n}\n{named_below(phase.stance.effectors)}" for n, phase in enumerate(schedule.sequence)]
    axes.set_xticks(range(len(durations)), named)
    dress(axes, "duration [s]", "", f"total {float(durations.sum()):.2f} s")
    axes.tick_params(axis="x", labelsize=_NAME_SIZE)
    axes.set_xlim(-0.6, len(durations) - 0.4)
    axes.set_ylim(0.0, 1.14 * max(float(durations.max()), max(p.min_duration for p in schedule.sequence)))
    axes.grid(False, axis="x")
    axes.legend(handles=_keys(schedule), fontsize=8, frameon=False, loc="lower right",
                bbox_to_anchor=(1.0, 1.0), ncols=6, borderaxespad=0.1)  # fmt: skip


def _keys(schedule: ContactSchedule) -> list[Patch | Line2D]:
    keys = support_keys(len(phase.stance) for phase in schedule.sequence)
    shortest = Patch(facecolor=COLOURS["soft"], hatch="///", edgecolor="white", label="as short as allowed")
    ink = COLOURS["ink"]
    bounds = [Line2D([], [], color=ink, linewidth=1.2, label="shortest allowed")]
    if any(phase.max_duration is not None for phase in schedule.sequence):
        bounds.append(Line2D([], [], color=ink, linewidth=1.2, linestyle="dotted", label="longest allowed"))
    return [*keys, shortest, *bounds]


def _width(schedule: ContactSchedule) -> float:
    """Width of the figure [inch] at which the names below neighbouring bars keep apart."""
    effectors = schedule.sequence.effectors
    one = _NAME_SIZE / 72.0 * (0.5 * max((len(name) for name in effectors), default=0) + 1.0)
    return max(11.0, label_room(effectors) + len(schedule.sequence) * one)


def _bars(schedule: ContactSchedule, name: str, end: float) -> list[tuple[float, float]]:
    stops = np.append(schedule.instants[1:-1], end)
    return [
        (float(start), float(stop - start))
        for start, stop, phase in zip(schedule.instants[:-1], stops, schedule.sequence, strict=True)
        if name in phase.stance
    ]


def _loaded(motion: Motion, name: str) -> list[tuple[float, float]]:
    """Start and length of each interval in which the contact presses."""
    on = np.concatenate([[False], motion.support[:, motion.contact_names.index(name)], [False]])
    starts, stops = np.flatnonzero(on[1:] & ~on[:-1]), np.flatnonzero(on[:-1] & ~on[1:])
    last = len(motion.time) - 1
    return [
        (float(motion.time[a]), float(motion.time[min(b, last)] - motion.time[a]))
        for a, b in zip(starts, stops, strict=True)
    ]
