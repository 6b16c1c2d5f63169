"""Position, velocity and acceleration of the centre of mass in time."""

import numpy as np
from matplotlib.figure import Figure

from manikin.figures.style import STYLES, legend_in_title, need, span_at_least
from manikin.figures.timeline import timeline
from manikin.record import RunRecord
from manikin.spatial import FloatArray

QUANTITIES = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"))

LEAST_SPAN = 4e-3
"""Height of a panel at the least, in its unit."""


def com_figure(record: RunRecord) -> Figure:
    """Draw the CoM along each axis, planned and executed ([Qiu2012]_ Fig. 5.12, 5.22, 6.9, 7.8, 7.14).

    Args:
        record: With a planned CoM, or at least one motion.

    Raises:
        FigureError: If it has neither.
    """
    tracks = need(record.tracks, "a motion of the centre of mass")
    shown = timeline(
        record,
        (14.0, 7.0),
        "Centre of mass",
        3,
        len(QUANTITIES),
        strip=0.14,
        top=0.75,
        between=0.22,
        across=0.75,
    )
    for column, (quantity, unit) in enumerate(QUANTITIES):
        shown.strip(column, quantity.capitalize(), named=column == 0)
        for row, axis in enumerate("xyz"):
            axes = shown.panel(row + 1, column)
            drawn = []
            for name, track in tracks.items():
                values = getattr(track, quantity)[:, row]
                axes.plot(track.time, values, label=name, **STYLES[name])
                drawn.append(values)
            if quantity == "acceleration":
                axes.set_ylim(_without_spikes(np.concatenate(drawn)))
            span_at_least(axes, LEAST_SPAN)
            shown.label(axes, f"{axis} [{unit}]")
    legend_in_title(shown.figure, axes)
    return shown.figure


def _without_spikes(values: FloatArray) -> tuple[float, float]:
    """Limits that hold all but the impacts of some milliseconds."""
    low, high = (float(v) for v in np.percentile(values, (0.5, 99.5)))
    room = 0.15 * max(high - low, 0.02)
    return max(low - room, float(values.min()) - room), min(high + room, float(values.max()) + room)
