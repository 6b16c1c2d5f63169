"""Figures over time below a strip of the contacts that are held: margin, timing, RULA and REBA, strength."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from manikin.contact import ContactSchedule
from manikin.ergonomics import Assessment, Ergonomics, JointStrength, LowBack
from manikin.ergonomics.low_back import ACTION_LIMIT, MAXIMUM_LIMIT
from manikin.motion import Motion
from manikin.motion.motion import PhaseTable
from manikin.numerics.signals import mask_runs
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.figures import style
from manikin.runtime.display import COLOURS, CYCLE, colours_of, readable

AT_LIMIT = 1e-3
"""A duration this close to its bound is at it [s]."""
_NAME_SIZE = 6.5
"""Font of the names below the bars [points]."""


def timing_figure(record: RunRecord) -> Figure:
    """Draw the durations of the phases with their bounds, and the supports in time ([Qiu2012]_ Fig. 5.16)."""
    schedule = style.need(record.schedule, "a contact schedule")
    phases = style.need(record.phases, "phases")
    executed = record.motions.get("executed")
    rows = 0.4 * len(record.effectors)
    most = max(len(phase.stance) for phase in schedule.sequence)
    figure, grid = style.new_grid(
        _width(schedule), 4.0 + 0.13 * most + rows, "Timing of the phases", 2, 1, height_ratios=[2.2, rows],
        left=style.label_room(record.effectors), top=0.7, between=0.6 + 0.13 * most,
    )  # fmt: skip
    _draw_durations(figure.add_subplot(grid[0]), schedule)
    axes, end = figure.add_subplot(grid[1]), style.end_of(record)
    draw_phases(axes, phases, end)
    colours = colours_of(record.effectors)
    for row, name in enumerate(record.effectors):
        bars = _bars(phases, name, end)
        axes.broken_barh(bars, (row + 0.12, 0.40), facecolors=colours[name], alpha=0.9)
        if executed is not None and name in executed.contact_names:
            bars = _loaded(executed, name)
            axes.broken_barh(bars, (row + 0.56, 0.26), facecolors=COLOURS["ink"], alpha=0.75)
    axes.set_yticks(np.arange(len(record.effectors)) + 0.5, [readable(n) for n in record.effectors])
    axes.set_ylim(len(record.effectors), 0.0)
    title = "planned supports (wide bars) and loaded contacts of the execution (narrow bars)"
    style.dress(axes, "", "time [s]", title if executed is not None else "planned supports")
    axes.grid(False)
    return figure


def _draw_durations(axes: Axes, schedule: ContactSchedule) -> None:
    durations = schedule.durations
    for number, (phase, duration) in enumerate(zip(schedule.sequence, durations, strict=True)):
        least, most = phase.min_duration, phase.max_duration
        at_limit = duration <= least + AT_LIMIT
        axes.bar(number, duration, width=0.62, color=style.support_colour(len(phase.stance)), alpha=0.8,
                 hatch="///" if at_limit else None, edgecolor="white", linewidth=0.0)  # fmt: skip
        for bound, line in ((least, "solid"), (most, "dotted")):
            if bound is not None and bound < 3.0 * float(durations.max()):
                axes.hlines(bound, number - 0.38, number + 0.38, color=COLOURS["ink"], linewidth=1.2,
                            linestyle=line, zorder=4)  # fmt: skip
        style.note(axes, f"{duration:.2f}", (number, max(duration, least)))
    named = [f"{n}\n{style.named_below(phase.stance.effectors)}" for n, phase in enumerate(schedule.sequence)]
    axes.set_xticks(range(len(durations)), named)
    style.dress(axes, "duration [s]", "", f"total {float(durations.sum()):.2f} s")
    axes.tick_params(axis="x", labelsize=_NAME_SIZE)
    axes.set_xlim(-0.6, len(durations) - 0.4)
    axes.set_ylim(0.0, 1.14 * max(float(durations.max()), max(p.min_duration for p in schedule.sequence)))
    axes.grid(False, axis="x")
    style.legend_above(axes, _keys(schedule))


def _keys(schedule: ContactSchedule) -> list[Patch | Line2D]:
    look: dict[str, Any] = {"color": COLOURS["ink"], "linewidth": 1.2}
    keys: list[Patch | Line2D] = [*style.support_keys(len(phase.stance) for phase in schedule.sequence)]
    keys.append(Patch(facecolor=COLOURS["soft"], hatch="///", edgecolor="white", label="as short as allowed"))
    keys.append(Line2D([], [], **look, label="shortest allowed"))
    if any(phase.max_duration is not None for phase in schedule.sequence):
        keys.append(Line2D([], [], **look, linestyle="dotted", label="longest allowed"))
    return keys


def _width(schedule: ContactSchedule) -> float:
    """Width of the figure [inch] at which the names below neighbouring bars keep apart."""
    effectors = schedule.sequence.effectors
    item = _NAME_SIZE / 72.0 * (0.5 * max((len(name) for name in effectors), default=0) + 1.0)
    return max(11.0, style.label_room(effectors) + len(schedule.sequence) * item)


def _bars(phases: PhaseTable, name: str, end: float) -> list[tuple[float, float]]:
    """Start and length of each phase in which an effector is in contact."""
    return [(start, stop - start) for start, stop, on in _spans(phases, end) if name in on]


def _loaded(motion: Motion, name: str) -> list[tuple[float, float]]:
    """Start and length of each interval in which the contact presses."""
    time, runs = motion.time, mask_runs(motion.support[:, motion.contact_names.index(name)])
    return [(time[start], time[min(stop, len(time) - 1)] - time[start]) for start, stop in runs]


POINT_MASS = "planned point mass"
ZOOM_FROM = 5.0
"""A second panel shows the lower part when some phase peaks this many times higher than another."""
ZOOM = 2.5
"""Height of that panel over the smallest peak of a phase."""


def margin_figure(record: RunRecord) -> Figure:
    """Draw the margins with the minimum of each phase ([Qiu2012]_ Fig. 5.13, 5.16, 5.23, 7.9)."""
    curves = dict(style.need(record.tracks, "a motion of the centre of mass"))
    if record.motions and record.plan is not None:
        curves = {POINT_MASS: record.plan, **curves}
    phases = style.need(record.phases, "phases")
    units = list(dict.fromkeys(curve.margin_unit for curve in curves.values()))
    panels: list[tuple[str, float | None]] = [(unit, None) for unit in units]
    ceiling = _zoom_ceiling(curves, phases)
    if len(units) == 1 and ceiling is not None:
        panels.append((units[0], ceiling))
    size = 13.5, 4.8 + 2.6 * (len(panels) - 1)
    drawing = timeline(record, size, "Stability margin", len(panels), strip=0.075, between=0.15)
    drawing.strip()
    for row, (unit, top) in enumerate(panels, 1):
        axes = drawing.panel(row)
        shown = {name: curve for name, curve in curves.items() if curve.margin_unit == unit}
        _draw_curves(axes, shown, phases, top)
        drawing.label(axes, f"margin{'' if top is None else ', lower part'} [{unit}]")
    style.legend_in_title(drawing.figure, *drawing.figure.axes[1 : 1 + len(units)])
    return drawing.figure


def phase_minima(curve: ComTrack, phases: PhaseTable) -> list[int]:
    """Sample with the smallest margin of each phase that has a sample."""
    inside = phases.phase_at(curve.time)
    samples = [np.flatnonzero(inside == phase) for phase in range(len(phases))]
    return [int(of[np.argmin(curve.margin[of])]) for of in samples if len(of)]


def _zoom_ceiling(curves: dict[str, ComTrack], phases: PhaseTable) -> float | None:
    """Upper end of the zoomed panel, or None when one panel shows everything well."""
    peaks = []
    for curve in curves.values():
        inside = phases.phase_at(curve.time)
        peaks += [float(curve.margin[inside == n].max(initial=-np.inf)) for n in range(len(phases))]
    lowest = min((peak for peak in peaks if peak > 0.0), default=0.0)
    return ZOOM * lowest if lowest > 0.0 and max(peaks) > ZOOM_FROM * lowest else None


def _draw_curves(axes: Axes, curves: dict[str, ComTrack], phases: PhaseTable, top: float | None) -> None:
    axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
    for name, curve in curves.items():
        index = int(np.argmin(curve.margin))
        phase = int(phases.phase_at(curve.time[index : index + 1])[0])
        where = f"in phase {phase}" if curve.time[index] <= phases.instants[-1] else "at rest"
        least = f"lowest {curve.margin[index]:.1f} {curve.margin_unit} {where}, {curve.time[index]:.2f} s"
        axes.plot(curve.time, curve.margin, label=f"{name} ({least})", **style.STYLES[name])
    low = min(0.0, *(float(curve.margin.min()) for curve in curves.values()))
    high = max(float(curve.margin.max()) for curve in curves.values()) if top is None else top
    low = low if top is None else max(low, -top)
    axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    labels = style.Labels(axes)
    for name, curve in curves.items():
        if name != POINT_MASS:
            _mark_minima(axes, labels, curve, phases, name, top)


def _mark_minima(
    axes: Axes, labels: style.Labels, curve: ComTrack, phases: PhaseTable, name: str, top: float | None
) -> None:
    """Mark the least margin of each phase, numbered where there is room, and ring the least of all."""
    offset = (0.0, -11.0 if name == "executed" else 4.0)
    first, last = phases.instants[[0, -1]] + 0.01 * np.ptp(phases.instants) * np.array([1.0, -1.0])
    for index in sorted(phase_minima(curve, phases), key=lambda index: curve.margin[index]):
        time, margin = float(curve.time[index]), float(curve.margin[index])
        if top is not None and margin > top:
            continue
        axes.plot(time, margin, "o", markersize=3.5, color=COLOURS[name], zorder=5)
        look = {"ha": "left" if time < first else "right" if time > last else "center", "zorder": 6}
        labels.write(f"{margin:.0f}", (time, margin), offset, size=7, color=COLOURS[name], **look)
    index = int(np.argmin(curve.margin))
    ring = {"markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4, "zorder": 6}
    axes.plot(curve.time[index], curve.margin[index], "o", markeredgecolor=COLOURS[name], **ring)


@dataclass(frozen=True, eq=False)
class Timeline:
    """A figure whose first row shows the contacts and whose other rows are panels over time, to an end [s].

    The phases are shaded in every panel.
    """

    figure: Figure
    grid: GridSpec
    phases: PhaseTable
    end: float

    def strip(self, column: int = 0, title: str = "", *, named: bool = True) -> None:
        """Draw the contacts over the panels of a column, with the names of the effectors beside them."""
        axes = self.figure.add_subplot(self.grid[0, column])
        _draw_contact_strip(axes, self.phases, self.end)
        if title:
            axes.set_title(title, fontsize=10, loc="left", pad=15)
        if not named:
            axes.set_yticklabels([])

    def panel(self, row: int, column: int = 0) -> Axes:
        """Axes over time with the phases shaded; ``row`` counts from 1, below the strip."""
        axes = self.figure.add_subplot(self.grid[row, column])
        draw_phases(axes, self.phases, self.end)
        return axes

    def label(self, axes: Axes, ylabel: str) -> None:
        """Dress a panel; only the lowest one of its column has times below it."""
        place = axes.get_subplotspec()
        lowest = place is not None and place.is_last_row()
        style.dress(axes, ylabel, "time [s]" if lowest else "")
        axes.tick_params(labelbottom=lowest)


def timeline(
    record: RunRecord, size: tuple[float, float], title: str, panels: int, columns: int = 1, *,
    strip: float = 0.1, **margins: Any,
) -> Timeline:  # fmt: skip
    """Make the figure and its grid; the strips and panels are drawn when asked for.

    Args:
        size: Width and height of the figure [inch].
        panels: Rows of panels below the strip.
        strip: Height of the strip for each effector, relative to that of a panel.
        margins: Of :func:`manikin.reports.figures.style.new_grid`.
    """
    phases = style.need(record.phases, "phases")
    heights = [strip * max(len(record.effectors), 2)] + [1.0] * panels
    margins = {"left": style.label_room(record.effectors), **margins}
    figure, grid = style.new_grid(*size, title, 1 + panels, columns, height_ratios=heights, **margins)
    return Timeline(figure, grid, phases, style.end_of(record))


def draw_phases(axes: Axes, phases: PhaseTable, end: float) -> None:
    """Shade single supports and draw a line at every key instant; time runs to ``end`` [s]."""
    for start, stop, supports in _spans(phases, end):
        if len(supports) <= 1:
            axes.axvspan(start, stop, color=COLOURS["shade"], zorder=0, linewidth=0)
    for instant in phases.instants:
        axes.axvline(float(instant), color="#B9BEC6", linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
    axes.set_xlim(float(phases.instants[0]), end)


def _draw_contact_strip(axes: Axes, phases: PhaseTable, end: float) -> None:
    """One bar per effector while it is in contact, and the numbers of the phases, from 0, above."""
    effectors = list(dict.fromkeys(name for supports in phases.supports for name in supports))
    colours = colours_of(effectors)
    for row, effector in enumerate(effectors):
        bars = _bars(phases, effector, end)
        axes.broken_barh(bars, (row + 0.15, 0.7), facecolors=colours[effector], alpha=0.85)
    axes.set_yticks(np.arange(len(effectors)) + 0.5, [readable(name) for name in effectors], fontsize=8)
    axes.set_ylim(len(effectors) + 0.05, 0.0)
    axes.set_xlim(float(phases.instants[0]), end)
    axes.tick_params(length=0, labelbottom=False)
    axes.set_xticks([])
    axes.spines[:].set_visible(False)
    labels = style.Labels(axes)  # numbers where there is room, of the long phases first
    for number in np.argsort(-np.diff(phases.instants), kind="stable"):
        middle = float(phases.instants[number : number + 2].mean())
        labels.write(f"{number}", (middle, 0.0), (0.0, 2.0), size=8, ha="center", color=COLOURS["ink"])
    if end > phases.instants[-1] + 0.2:
        middle = (float(phases.instants[-1]) + end) / 2
        labels.write("rest", (middle, 0.0), (0.0, 2.0), size=8, ha="center", color=COLOURS["soft"])


def _spans(phases: PhaseTable, end: float) -> list[tuple[float, float, tuple[str, ...]]]:
    """Start, end and supports of each phase; the last one lasts until ``end``."""
    instants = [float(instant) for instant in phases.instants]
    stops = [*instants[1:-1], max(end, instants[-1])]
    return list(zip(instants[:-1], stops, phases.supports, strict=True))


LEVEL_COLOURS = ("#DDEBDD", "#EFF3D2", "#FBEBC3", "#F6D2BB", "#EDB4B1")
"""Colours of the action levels, the least urgent first; RULA's four levels begin at the second."""
LEVELS = {
    "RULA": ("acceptable", "investigate", "change soon", "change now"),
    "REBA": ("negligible", "low", "medium", "high", "very high"),
}
"""Action levels, in a word."""
SHOWN_JOINTS = 5
"""Joints whose shares are drawn, those with the largest peaks."""
_RULA_ENDS, _REBA_ENDS = (2, 4, 6, 7), (1, 3, 7, 10, 15)


def ergonomics_figure(found: Ergonomics, title: str = "Ergonomics") -> Figure:
    """Draw the scores of both sides, the compression of the low back, and the largest torque shares."""
    posture, strength = found.posture, found.strength
    back = None if posture is None else found.loads.low_back
    rows = 2 * (posture is not None) + (back is not None) + (strength is not None)
    style.need(rows and len(found.time) > 1, "scores or torques over time", "a motion of a human")
    figure, grid = style.new_grid(11.0, 0.9 + 2.3 * rows, title, rows, 1, between=0.45, left=0.6)
    panels = [figure.add_subplot(grid[row, 0]) for row in range(rows)]
    if posture is not None:
        _draw_scores(panels[0], posture.rula, _RULA_ENDS, LEVEL_COLOURS[1:])
        _draw_scores(panels[1], posture.reba, _REBA_ENDS, LEVEL_COLOURS)
    if back is not None:
        _draw_low_back(panels[2], back)
    if strength is not None:
        _draw_shares(panels[-1], found, strength)
    for axes in panels:
        axes.set_xlim(float(found.time[0]), float(found.time[-1]))
        axes.tick_params(labelbottom=axes is panels[-1])
    panels[-1].set_xlabel("time [s]", fontsize=9)
    return figure


def _draw_scores(axes: Axes, one: Assessment, ends: Sequence[int], colours: Sequence[str]) -> None:
    """Both sides as steps over the bands of the action levels."""
    for before, last, colour in zip((0, *ends), ends, colours, strict=False):
        axes.axhspan(before + 0.5, last + 0.5, color=colour, linewidth=0, zorder=0)
    for side, colour, aside in (("left", "#0072B2", 0.06), ("right", "#D55E00", -0.06)):
        axes.step(one.time, one.sides[side] + aside, where="mid", color=colour, linewidth=1.3, label=side)
    style.dress(axes, f"{one.method} score")
    axes.grid(visible=False)
    axes.set_ylim(0.5, ends[-1] + 0.5)
    axes.set_yticks(range(1, ends[-1] + 1, 1 if ends[-1] < 10 else 2))
    lines, _ = axes.get_legend_handles_labels()
    levels = zip(colours, LEVELS[one.method], strict=True)
    style.legend_above(axes, [*lines, *(Patch(color=colour, label=level) for colour, level in levels)])


def _draw_low_back(axes: Axes, back: LowBack) -> None:
    """Compression of L5/S1 over the colours of the levels of NIOSH."""
    top = 1.1 * max(MAXIMUM_LIMIT, float(np.nanmax(back.compression)))
    for bottom, limit, colour in zip(
        (0.0, ACTION_LIMIT, MAXIMUM_LIMIT),
        (ACTION_LIMIT, MAXIMUM_LIMIT, top),
        LEVEL_COLOURS[::2],
        strict=True,
    ):
        axes.axhspan(bottom / 1e3, limit / 1e3, color=colour, linewidth=0, zorder=0)
    axes.plot(back.time, back.compression / 1e3, color="#0072B2", linewidth=1.1, label="compression")
    axes.plot(back.time, back.shear / 1e3, color="#D55E00", linewidth=1.1, label="shear")
    style.dress(axes, "L5/S1 [kN]")
    axes.grid(visible=False)
    axes.set_ylim(min(0.0, float(np.nanmin(back.shear)) / 1e3), top / 1e3)
    lines, _ = axes.get_legend_handles_labels()
    levels = zip(LEVEL_COLOURS[::2], ("below action limit", "above", "above maximum"), strict=True)
    style.legend_above(axes, [*lines, *(Patch(color=colour, label=level) for colour, level in levels)])


def _draw_shares(axes: Axes, found: Ergonomics, strength: JointStrength) -> None:
    for index, colour in zip(strength.order[:SHOWN_JOINTS], CYCLE, strict=False):
        label = f"{readable(strength.joint_names[index])} ({strength.peak[index]:.0%})"
        axes.plot(found.time, strength.share[:, index], color=colour, linewidth=1.1, label=label)
    axes.axhline(1.0, color=COLOURS["ink"], linewidth=0.8)
    axes.axhline(strength.fraction, color=COLOURS["soft"], linewidth=0.8, linestyle=(0, (4, 3)))
    style.dress(axes, "torque per strength")
    axes.set_ylim(0.0, 1.05 * max(1.0, float(np.nanmax(strength.peak))))
    style.legend_above(axes)
