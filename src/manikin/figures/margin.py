"""The stability margin in time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from manikin.figures.labels import Labels
from manikin.figures.style import STYLES, legend_in_title, need
from manikin.figures.timeline import timeline
from manikin.motion.derived import PhaseTable
from manikin.palette import COLOURS
from manikin.record import ComTrack, RunRecord

POINT_MASS = "planned point mass"
ZOOM_FROM = 5.0
"""A second panel shows the lower part when some phase peaks this many times higher than another."""

ZOOM = 2.5
"""Height of that panel over the smallest peak of a phase."""


def margin_figure(record: RunRecord) -> Figure:
    """Draw the margins with the minimum of each phase ([Qiu2012]_ Fig. 5.13, 5.16, 5.23, 7.9).

    Args:
        record: With a planned CoM, or at least one motion.

    Raises:
        FigureError: If it has neither.
    """
    curves = need(margin_curves(record), "a motion of the centre of mass")
    phases = need(record.phases, "phases")
    units = list(dict.fromkeys(curve.margin_unit for curve in curves.values()))
    panels: list[tuple[str, float | None]] = [(unit, None) for unit in units]
    ceiling = _zoom_ceiling(curves, phases)
    if len(units) == 1 and ceiling is not None:
        panels.append((units[0], ceiling))
    size = 13.5, 4.8 + 2.6 * (len(panels) - 1)
    drawing = timeline(record, size, "Stability margin", len(panels), strip=0.075, between=0.15)
    drawing.strip()
    for row, (unit, top) in enumerate(panels):
        axes = drawing.panel(row + 1)
        shown = {name: curve for name, curve in curves.items() if curve.margin_unit == unit}
        _draw_curves(axes, shown, phases, top)
        zoomed = "" if top is None else ", lower part"
        drawing.label(axes, f"margin{zoomed} [{unit}]")
    legend_in_title(drawing.figure, *drawing.figure.axes[1 : 1 + len(units)])
    return drawing.figure


def margin_curves(record: RunRecord) -> dict[str, ComTrack]:
    """Margins by name: of the planned point mass, then of each whole-body motion."""
    if not record.motions:
        return dict(record.tracks)
    curves = {} if record.plan is None else {POINT_MASS: record.plan}
    return {**curves, **record.tracks}


def phase_minima(curve: ComTrack, phases: PhaseTable) -> list[int | None]:
    """Sample with the smallest margin of each phase, None where the curve has no sample."""
    inside = phases.phase_at(curve.time)
    found: list[int | None] = []
    for phase in range(len(phases)):
        samples = np.flatnonzero(inside == phase)
        found.append(int(samples[np.argmin(curve.margin[samples])]) if len(samples) else None)
    return found


def _zoom_ceiling(curves: dict[str, ComTrack], phases: PhaseTable) -> float | None:
    """Upper end of the zoomed panel, or None when one panel shows everything well."""
    peaks = [
        float(curve.margin[phases.phase_at(curve.time) == phase].max(initial=-np.inf))
        for curve in curves.values()
        for phase in range(len(phases))
    ]
    lowest = min((peak for peak in peaks if peak > 0.0), default=0.0)
    return ZOOM * lowest if lowest > 0.0 and max(peaks) > ZOOM_FROM * lowest else None


def _draw_curves(axes: Axes, curves: dict[str, ComTrack], phases: PhaseTable, top: float | None) -> None:
    axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
    for name, curve in curves.items():
        label = f"{name} ({_lowest(curve, phases)})"
        axes.plot(curve.time, curve.margin, label=label, **STYLES[name])
    low = min(0.0, *(float(curve.margin.min()) for curve in curves.values()))
    high = max(float(curve.margin.max()) for curve in curves.values()) if top is None else top
    low = low if top is None else max(low, -top)
    axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    labels = Labels(axes)
    for name, curve in curves.items():
        if name != POINT_MASS:
            _mark_minima(axes, labels, curve, phases, name, top)


def _lowest(curve: ComTrack, phases: PhaseTable) -> str:
    index = int(np.argmin(curve.margin))
    phase = int(phases.phase_at(curve.time[index : index + 1])[0])
    where = f"in phase {phase}" if curve.time[index] <= phases.instants[-1] else "at rest"
    return f"lowest {curve.margin[index]:.1f} {curve.margin_unit} {where}, {curve.time[index]:.2f} s"


def _mark_minima(
    axes: Axes, labels: Labels, curve: ComTrack, phases: PhaseTable, name: str, top: float | None
) -> None:
    """Mark the least margin of each phase, numbered where there is room, and ring the least of all."""
    found = [index for index in phase_minima(curve, phases) if index is not None]
    offset = (0.0, -11.0 if name == "executed" else 4.0)
    for index in sorted(found, key=lambda index: curve.margin[index]):
        time, margin = float(curve.time[index]), float(curve.margin[index])
        if top is not None and margin > top:
            continue
        axes.plot(time, margin, "o", markersize=3.5, color=COLOURS[name], zorder=5)
        labels.write(
            f"{margin:.0f}", (time, margin), offset, size=7, ha=_alignment(time, phases), color=COLOURS[name],
            zorder=6,
        )  # fmt: skip
    index = int(np.argmin(curve.margin))
    axes.plot(
        curve.time[index], curve.margin[index], "o", markersize=9, markerfacecolor="none",
        markeredgecolor=COLOURS[name], markeredgewidth=1.4, zorder=6,
    )  # fmt: skip


def _alignment(time: float, phases: PhaseTable) -> str:
    """Alignment of a label that keeps it inside the axes."""
    first, last = float(phases.instants[0]), float(phases.instants[-1])
    edge = 0.01 * (last - first)
    return "left" if time < first + edge else "right" if time > last - edge else "center"
