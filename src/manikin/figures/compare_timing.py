"""The phases of two runs in time."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from manikin.comparison import RunComparison, TimingRow
from manikin.figures.style import dress, named_below, need, new_grid, support_colour, support_keys
from manikin.palette import COLOURS

RUN_COLOURS = (COLOURS["first run"], COLOURS["second run"])


def compare_timing_figure(comparison: RunComparison) -> Figure:
    """Draw both runs as a bar of phases, and the durations side by side ([Qiu2012]_ Fig. 7.16).

    Lines join the key instants of matched phases; phases without a match are hatched.

    Raises:
        FigureError: If a run has no contact schedule.
    """
    rows = need(comparison.rows, "phases of both runs")
    most = max(len(row.supports) for row in rows)
    longest = max(len(name) for name in comparison.names)
    figure, grid = new_grid(
        max(11.0, 1.1 * len(rows)), 5.6 + 0.13 * most, "Timing of two runs", 2, 1, top=0.75,
        bottom=0.2 + 0.14 * most, between=0.75, left=max(0.7, 0.2 + 0.08 * longest),
        height_ratios=[1.0, 1.3],
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
            alone = row.first is None or row.second is None
            axes.barh(level, phase.duration_s, left=phase.start_s, height=0.5, alpha=0.8, edgecolor="white",
                      color=support_colour(len(row.supports)), hatch="xx" if alone else None)  # fmt: skip
            axes.text((phase.start_s + phase.end_s) / 2, level, f"{phase.index}", ha="center", va="center",
                      fontsize=8, color="white", fontweight="bold")  # fmt: skip
            ends.append(phase.end_s)
        if row.first is not None and row.second is not None:
            for upper, lower in (
                (row.first.start_s, row.second.start_s),
                (row.first.end_s, row.second.end_s),
            ):
                axes.plot([upper, lower], [0.74, 0.26], color=COLOURS["soft"], linewidth=0.8)
    axes.set_yticks([1.0, 0.0], list(comparison.names))
    axes.set_ylim(-0.4, 1.4)
    axes.set_xlim(0.0, 1.01 * max(ends))
    dress(axes, "", "time [s]")
    axes.set_yticks([1.0, 0.0], list(comparison.names))
    axes.grid(False, axis="y")
    keys = support_keys(len(row.supports) for row in comparison.rows)
    if any(row.first is None or row.second is None for row in comparison.rows):
        keys.append(Patch(facecolor=COLOURS["soft"], edgecolor="white", hatch="xx", label="no match"))
    _legend(axes, keys)


def _draw_durations(axes: Axes, rows: Sequence[TimingRow], names: tuple[str, str]) -> None:
    longest = 0.0
    for number, row in enumerate(rows):
        for shift, phase, colour in ((-0.2, row.first, RUN_COLOURS[0]), (0.2, row.second, RUN_COLOURS[1])):
            if phase is None:
                continue
            axes.bar(number + shift, phase.duration_s, width=0.38, color=colour, alpha=0.85)
            axes.annotate(f"{phase.duration_s:.2f}", (number + shift, phase.duration_s), (0, 2),
                          textcoords="offset points", ha="center", fontsize=7)  # fmt: skip
            longest = max(longest, phase.duration_s)
    dress(axes, "duration [s]")
    axes.set_xticks(range(len(rows)), [named_below(row.supports) for row in rows])
    axes.tick_params(axis="x", labelsize=7)
    axes.set_ylim(0.0, 1.14 * longest)
    axes.grid(False, axis="x")
    keys = [
        Patch(color=colour, alpha=0.85, label=name) for colour, name in zip(RUN_COLOURS, names, strict=True)
    ]
    _legend(axes, keys)


def _legend(axes: Axes, keys: list[Patch]) -> None:
    axes.legend(
        handles=keys, fontsize=8, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1, ncols=len(keys),
    )  # fmt: skip
