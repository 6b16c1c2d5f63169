"""The postures of two runs at the key instants they share."""

import numpy as np
from matplotlib.figure import Figure

from manikin.comparison import RunComparison
from manikin.figures.compare_timing import RUN_COLOURS
from manikin.figures.postures import GAP, chosen_instants, draw_moment, frame_panels
from manikin.figures.style import dress, need, new_grid
from manikin.figures.views import ALONG_X, ALONG_Y
from manikin.palette import COLOURS, readable

REACH = np.array([0.65, 0.65, 1.0])
"""Drawn around the centres of mass [m]."""


def compare_postures_figure(comparison: RunComparison) -> Figure:
    """Draw the bodies of both runs at matching key instants, one row each ([Qiu2012]_ Fig. 7.19).

    Under each pair stand the joints that differ most.

    Raises:
        FigureError: If a run has no such motion or no body, or no phase matches.
    """
    which = need(comparison.postures_of, "a whole-body motion of the same kind in both runs")
    postures = list(need(comparison.postures, "a phase that both runs have"))
    for run in comparison.runs:
        need(run.body, "a body in both runs")
    chosen = chosen_instants(np.arange(float(len(postures)))).astype(int)
    postures = [postures[index] for index in chosen]
    com = np.vstack([run.motions[which].com for run in comparison.runs])
    low, high = com.min(axis=0) - REACH, com.max(axis=0) + REACH
    view = ALONG_Y if np.ptp(com[:, 1]) < np.ptp(com[:, 0]) else ALONG_X
    left, right = view(np.array([low, high]))[:, 0]
    pitch = right - left + GAP
    scale = 1.85 / pitch
    figure, grid = new_grid(
        max(1.85 * len(postures), 6.0) + 0.9, 2.0 * (high[2] - low[2]) * scale + 2.2,
        f"Postures of two runs at the key instants ({which}), seen {view.words}", 2, 1, top=0.7, bottom=0.95,
        between=0.35, left=0.85,
    )  # fmt: skip
    offsets = [pitch * column for column in range(len(postures))]
    for row, (name, run, colour) in enumerate(
        zip(comparison.names, comparison.runs, RUN_COLOURS, strict=True)
    ):
        axes = figure.add_subplot(grid[row, 0])
        for offset, posture in zip(offsets, postures, strict=True):
            time = posture.second_s if row else posture.first_s
            motion = run.motions[which]
            sample = int(np.argmin(np.abs(motion.time - time)))
            draw_moment(axes, run, motion, sample, view.moved(offset, 0.0), (low, high))
            axes.annotate(f"{time:.2f} s", (offset + (left + right) / 2, high[2]), (0, 3),
                          textcoords="offset points", ha="center", fontsize=8.5, color=colour)  # fmt: skip
            if row:
                worst = posture.largest[:2]
                text = "\n".join(f"{readable(j.joint)} {j.difference_deg:+.1f}°" for j in worst)
                axes.annotate(text, (offset + (left + right) / 2, low[2]), (0, -44), ha="center", va="bottom",
                              textcoords="offset points", fontsize=6.5, color="#5A5F69")  # fmt: skip
        dress(axes, f"{name}\n{view.labels[1]}", "")
        frame_panels(axes, (left, right), (low[2], high[2]), offsets)
    note = f"numbers along the axes: {view.labels[0]}; below: largest differences, second less first"
    figure.text(0.01, 0.01, note, fontsize=7.5, color=COLOURS["soft"])
    return figure
