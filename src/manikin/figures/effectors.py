"""Where feet and hands are in time, planned and executed."""

import numpy as np
from matplotlib.figure import Figure

from manikin.figures.style import STYLES, legend_in_title, need, span_at_least
from manikin.figures.timeline import timeline
from manikin.figures.tracking import interpolated
from manikin.palette import readable
from manikin.record import RunRecord

LEAST_SPAN = 0.02
"""Height of a panel at the least [m]."""


def effectors_figure(record: RunRecord) -> Figure:
    """Draw the coordinates of every foot and hand in contact ([Qiu2012]_ Fig. 6.10, 7.15).

    Args:
        record: With a motion and the body; the largest error is named when there are both motions.

    Raises:
        FigureError: If there is no whole-body motion.
    """
    paths = need(record.effector_paths, "a whole-body motion and the body")
    names = list(next(iter(paths.values())))
    need(names, "an effector in contact")
    size = max(4.4 * len(names), 7.0), 7.0
    shown = timeline(
        record, size, "Feet and hands", 3, len(names), strip=0.14, top=0.75, between=0.22, across=0.5
    )
    for column, name in enumerate(names):
        shown.strip(column, _title(record, name), named=column == 0)
        for row, axis in enumerate("xyz"):
            axes = shown.panel(row + 1, column)
            for kind, found in paths.items():
                axes.plot(record.motions[kind].time, found[name][:, row], label=kind, **STYLES[kind])
            shown.label(axes, f"{axis} [m]" if column == 0 else "")
            span_at_least(axes, LEAST_SPAN)
    legend_in_title(shown.figure, axes)
    return shown.figure


def _title(record: RunRecord, name: str) -> str:
    title = readable(name).capitalize()
    if len(record.effector_paths) < 2:
        return title
    planned, executed = record.motions["planned"], record.motions["executed"]
    plan = interpolated(executed.time, planned.time, record.effector_paths["planned"][name])
    error = np.linalg.norm(record.effector_paths["executed"][name] - plan, axis=1)
    return f"{title} (largest error {1000.0 * error.max():.2g} mm)"
