"""Two runs in one figure: timing, centres of mass, margins, and postures at the key instants they share."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from manikin.pipeline.run_directory import ComTrack
from manikin.reports.alignment import TimingRow
from manikin.reports.comparison import RunComparison, shared_tracks
from manikin.reports.figures import scene, style
from manikin.reports.figures.com import draw_paths, frame_plane, mark_instants, planes
from manikin.reports.figures.space import Space
from manikin.reports.figures.views import ALONG_X, ALONG_Y, distinct_contacts
from manikin.runtime.display import COLOURS, readable


def compare_margin_figure(comparison: RunComparison) -> Figure:
    """Draw the margins of each stage over matched phases, each phase drawn equally wide."""
    rows = [row for row in comparison.rows if row.first is not None and row.second is not None]
    style.need(rows, "a phase that both runs have", "two runs")
    shared = shared_tracks(*comparison.runs)
    stages = [stage for stage, (one, other) in shared.items() if one.margin_unit == other.margin_unit]
    style.need(stages, "a margin of both runs in the same unit")
    most = max(len(row.supports) for row in rows)
    figure, grid = style.new_grid(
        max(9.0, 1.3 * len(rows)), 1.2 + 2.2 * len(stages) + 0.14 * most, "Margins of two runs",
        len(stages), 1, top=0.55, bottom=0.4 + 0.14 * most,
    )  # fmt: skip
    for number, stage in enumerate(stages):
        axes = figure.add_subplot(grid[number])
        for which, (name, track) in enumerate(zip(comparison.names, shared[stage], strict=True)):
            _draw(axes, rows, track, which, name)
        axes.axhline(0.0, color=COLOURS["ink"], linewidth=0.9)
        last = number == len(stages) - 1
        unit = shared[stage][0].margin_unit
        style.dress(axes, f"{stage} [{unit}]", "supports of the phase" if last else "")
        axes.set_xticks(np.arange(len(rows)) + 0.5)
        axes.set_xticklabels([style.named_below(row.supports) for row in rows] if last else [])
        axes.tick_params(axis="x", labelsize=7, length=0)
        axes.grid(False, axis="x")
        for edge in range(1, len(rows)):
            axes.axvline(edge, color="#B9BEC6", linewidth=0.7, linestyle=(0, (4, 3)))
        axes.set_xlim(0.0, len(rows))
    style.legend_in_title(figure, axes)
    return figure


def _draw(axes: Axes, rows: list[TimingRow], track: ComTrack, which: int, name: str) -> None:
    for column, row in enumerate(rows):
        phase = row.second if which else row.first
        if phase is None:
            continue
        inside = (track.time >= phase.start_s) & (track.time < phase.end_s)
        share = (track.time[inside] - phase.start_s) / phase.duration_s
        axes.plot(
            column + share, track.margin[inside], color=RUN_COLOURS[which], zorder=3 + which,
            linewidth=1.0 if which else 2.2, label=name if column == 0 else None,
        )  # fmt: skip


REACH = np.array([0.65, 0.65, 1.0])
"""Drawn around the centres of mass [m]."""


def compare_postures_figure(comparison: RunComparison) -> Figure:
    """Draw the bodies of both runs at matching key instants, one row each ([Qiu2012]_ Fig. 7.19).

    Under each pair stand the joints that differ most.
    """
    which = style.need(comparison.postures_of, "a whole-body motion of the same kind in both runs")
    postures = list(style.need(comparison.postures, "a phase that both runs have"))
    for run in comparison.runs:
        style.need(run.body, "a body in both runs")
    chosen = scene.chosen_instants(np.arange(float(len(postures)))).astype(int)
    postures = [postures[index] for index in chosen]
    com = np.vstack([run.motions[which].com for run in comparison.runs])
    low, high = com.min(axis=0) - REACH, com.max(axis=0) + REACH
    view = ALONG_Y if np.ptp(com[:, 1]) < np.ptp(com[:, 0]) else ALONG_X
    left, right = view(np.array([low, high]))[:, 0]
    pitch = right - left + scene.GAP
    scale = 1.85 / pitch
    figure, grid = style.new_grid(
        max(1.85 * len(postures), 6.0) + 0.9, 2.0 * (high[2] - low[2]) * scale + 2.2,
        f"Postures of two runs at the key instants ({which}), seen {view.words}", 2, 1, top=0.7, bottom=0.95,
        between=0.35, left=0.85,
    )  # fmt: skip
    offsets = [pitch * column for column in range(len(postures))]
    for row, (name, run) in enumerate(zip(comparison.names, comparison.runs, strict=True)):
        axes, motion, colour = figure.add_subplot(grid[row, 0]), run.motions[which], RUN_COLOURS[row]
        for offset, posture in zip(offsets, postures, strict=True):
            time = posture.second_s if row else posture.first_s
            sample = int(np.argmin(np.abs(motion.time - time)))
            scene.draw_moment(axes, run, motion, sample, view.moved(offset, 0.0), (low, high))
            middle = offset + (left + right) / 2
            style.note(axes, f"{time:.2f} s", (middle, high[2]), fontsize=8.5, color=colour)
            if row:
                text = "\n".join(f"{readable(j.joint)} {j.difference_deg:+.1f}°" for j in posture.largest[:2])
                style.note(axes, text, (middle, low[2]), -44, va="bottom", fontsize=6.5, color="#5A5F69")
        style.dress(axes, f"{name}\n{view.labels[1]}", "")
        scene.frame_panels(axes, (left, right), (low[2], high[2]), offsets)
    legend = f"numbers along the axes: {view.labels[0]}; below: largest differences, second less first"
    figure.text(0.01, 0.01, legend, fontsize=7.5, color=COLOURS["soft"])
    return figure


RUN_COLOURS = (COLOURS["first run"], COLOURS["second run"])


def compare_timing_figure(comparison: RunComparison) -> Figure:
    """Draw both runs as a bar of phases, and the durations side by side ([Qiu2012]_ Fig. 7.16).

    Lines join the key instants of matched phases; phases without a match are hatched.
    """
    rows = style.need(comparison.rows, "phases of both runs")
    most = max(len(row.supports) for row in rows)
    left = max(0.7, 0.2 + 0.08 * max(map(len, comparison.names)))
    figure, grid = style.new_grid(
        max(11.0, 1.1 * len(rows)), 5.6 + 0.13 * most, "Timing of two runs", 2, 1, top=0.75,
        bottom=0.2 + 0.14 * most, between=0.75, left=left, height_ratios=[1.0, 1.3],
    )  # fmt: skip
    _draw_bars(figure.add_subplot(grid[0]), comparison)
    _draw_durations(figure.add_subplot(grid[1]), rows, comparison.names)
    return figure


def _draw_bars(axes: Axes, comparison: RunComparison) -> None:
    ends = [0.0]
    for row in comparison.rows:
        for level, phase in ((1.0, row.first), (0.0, row.second)):
            if phase is None:
                continue
            colour, alone = style.support_colour(len(row.supports)), row.first is None or row.second is None
            axes.barh(level, phase.duration_s, left=phase.start_s, height=0.5, alpha=0.8, edgecolor="white",
                      color=colour, hatch="xx" if alone else None)  # fmt: skip
            axes.text((phase.start_s + phase.end_s) / 2, level, f"{phase.phase}", ha="center", va="center",
                      fontsize=8, color="white", fontweight="bold")  # fmt: skip
            ends.append(phase.end_s)
        if (one := row.first) is not None and (other := row.second) is not None:
            for instants in ((one.start_s, other.start_s), (one.end_s, other.end_s)):
                axes.plot(instants, [0.74, 0.26], color=COLOURS["soft"], linewidth=0.8)
    axes.set_ylim(-0.4, 1.4)
    axes.set_xlim(0.0, 1.01 * max(ends))
    style.dress(axes, "", "time [s]")
    axes.set_yticks([1.0, 0.0], list(comparison.names))
    axes.grid(False, axis="y")
    keys = style.support_keys(len(row.supports) for row in comparison.rows)
    if any(row.first is None or row.second is None for row in comparison.rows):
        keys.append(Patch(facecolor=COLOURS["soft"], edgecolor="white", hatch="xx", label="no match"))
    style.legend_above(axes, keys)


def _draw_durations(axes: Axes, rows: Sequence[TimingRow], names: tuple[str, str]) -> None:
    longest = 0.0
    for number, row in enumerate(rows):
        for shift, phase, colour in ((-0.2, row.first, RUN_COLOURS[0]), (0.2, row.second, RUN_COLOURS[1])):
            if phase is None:
                continue
            axes.bar(number + shift, phase.duration_s, width=0.38, color=colour, alpha=0.85)
            style.note(axes, f"{phase.duration_s:.2f}", (number + shift, phase.duration_s), 2, fontsize=7)
            longest = max(longest, phase.duration_s)
    style.dress(axes, "duration [s]")
    axes.set_xticks(range(len(rows)), [style.named_below(row.supports) for row in rows])
    axes.tick_params(axis="x", labelsize=7)
    axes.set_ylim(0.0, 1.14 * longest)
    axes.grid(False, axis="x")
    named = zip(RUN_COLOURS, names, strict=True)
    style.legend_above(axes, [Patch(color=colour, alpha=0.85, label=name) for colour, name in named])


def compare_planes_figure(comparison: RunComparison) -> Figure:
    """Draw both CoM paths on xy, xz and yz, enlarged to the paths ([Qiu2012]_ Fig. 7.18)."""
    tracks = _tracks(comparison)
    seen = np.vstack([track.position for track in tracks.values()])
    low, high = seen.min(axis=0), seen.max(axis=0)
    room = 0.08 * float((high - low).max()) + 0.01
    low, high = low - room, high + room
    figure, panels = planes("Centres of mass of two runs on the coordinate planes", high - low)
    for view, axes in panels:
        draw_paths(axes, view, tracks, _styles(comparison))
        frame_plane(axes, view, low, high)
        labels = style.Labels(axes)
        for run, track, colour in zip(comparison.runs, tracks.values(), RUN_COLOURS, strict=True):
            if run.phases is not None:
                mark_instants(labels, axes, view, track.at(run.phases.instants), colour)
    style.legend_in_title(figure, axes)
    return figure


def compare_scene_figure(comparison: RunComparison) -> Figure:
    """Draw both CoM paths in space, with the scene and supports of the first run ([Qiu2012]_ Fig. 7.17)."""
    tracks, first = _tracks(comparison), comparison.first
    contacts = [] if first.schedule is None else distinct_contacts(first.schedule)
    space = Space.of(first.scene, [track.position for track in tracks.values()], contacts=contacts)
    figure, axes = scene.space_figure(space, "Centres of mass of two runs")
    space.draw_points(axes)
    for name, track in tracks.items():
        space.plot(axes, track.position, label=name, **{**_styles(comparison)[name], "zorder": 8})
    space.name_obstacles(style.Labels(axes))
    style.legend_in_title(figure, axes)
    return figure


def _tracks(comparison: RunComparison) -> dict[str, ComTrack]:
    """The planned CoM of each run."""
    tracks = [style.need(run.tracks, "a centre of mass of both runs") for run in comparison.runs]
    return {name: next(iter(of.values())) for name, of in zip(comparison.names, tracks, strict=True)}


def _styles(comparison: RunComparison) -> dict[str, dict[str, Any]]:
    thick = {"color": RUN_COLOURS[0], "linewidth": 2.4, "zorder": 3}
    thin = {"color": RUN_COLOURS[1], "linewidth": 1.2, "zorder": 4}
    return dict(zip(comparison.names, (thick, thin), strict=True))
