"""Phases and supports of several motions: durations, each and on average, and places seen from above."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch

from manikin.recordings.statistics.passages import SupportPlacement
from manikin.recordings.statistics.phases import FLIGHT, By, PhaseSequence, by_group, phase_durations
from manikin.reports.figures import style
from manikin.runtime.display import COLOURS, colours_of, readable

SHARE = 0.5
"""Share of the places inside an ellipse, for a normal distribution."""
FEWEST = 3
"""Places of which an ellipse is drawn: two make a line."""


def placements_figure(groups: Mapping[str, Sequence[SupportPlacement]]) -> Figure:
    """Draw the places of the supports of each group, with means and ellipses ([Qiu2012]_ Fig. 3.9).

    Args:
        groups: Placements by group, one panel each; the origin of the frame is the cross.
    """
    shown = style.need({name: result for name, result in groups.items() if result}, "a placement")
    everywhere = np.vstack([item.places for result in shown.values() for item in result])
    low, high = everywhere.min(axis=0) - 0.25, everywhere.max(axis=0) + 0.25
    wide = 9.6
    panel = float(np.clip((wide - 0.9) * (high[1] - low[1]) / (high[0] - low[0]), 1.3, 5.0))
    figure, grid = style.new_grid(
        wide, 0.9 + (panel + 0.7) * len(shown), f"Supports (crosses: means; ellipses: {SHARE:.0%})",
        len(shown), 1, between=0.7, top=0.8, bottom=0.5,
    )  # fmt: skip
    colours = colours_of(item.effector for result in shown.values() for item in result)
    for row, (name, result) in enumerate(shown.items()):
        axes = figure.add_subplot(grid[row])
        motions = len({clip for item in result for clip in item.clips})
        style.dress(axes, "y [m]", "x [m]", f"{name}, {motions} motions")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_aspect("equal", adjustable="box", anchor="W")
        axes.plot(0.0, 0.0, "+", color=COLOURS["ink"], markersize=10, zorder=2)
        _draw(axes, result, colours)
    keys = [
        Line2D([], [], color=colour, label=readable(name), marker="o", linestyle="")
        for name, colour in colours.items()
    ]
    style.legend_in_title(figure, handles=keys)
    return figure


def _draw(axes: Axes, found: Sequence[SupportPlacement], colours: Mapping[str, str]) -> None:
    for item in found:
        colour = colours[item.effector]
        axes.plot(*item.places.T, "o", color=colour, markersize=3.5, alpha=0.6, zorder=3)
        axes.plot(*item.mean, "x", color=colour, markersize=6, zorder=5)
        if len(item.places) >= FEWEST:
            (long, short), turn = item.ellipse(SHARE)
            look = {"fill": False, "edgecolor": colour, "linewidth": 1.2, "zorder": 4}
            angle = float(np.degrees(turn))
            axes.add_patch(Ellipse(tuple(item.mean), 2 * long, 2 * short, angle=angle, **look))
    labels, look = style.Labels(axes), {"ha": "center", "zorder": 6}
    for item in sorted(found, key=lambda each: -len(each.places)):
        labels.write(f"{item.number}", tuple(item.mean), (0.0, 6.0), color=colours[item.effector], **look)


WIDTH = 0.8
"""Width of all bars of one phase over the distance between phases."""
BEYOND = 2.5
"""Height of the axes per largest mean, beyond which whiskers are cut off."""


def phase_durations_figure(sequences: Sequence[PhaseSequence], by: By = "number") -> Figure:
    """Draw the phases of each motion as a bar, and means by group ([Qiu2012]_ Fig. 3.11).

    Phases cut off by the recording are pale and do not count in the means, which are of phases with the same
    ``by``, such as ``number`` for motions that begin alike. Whiskers reach from the least to the largest; the
    number of phases stands at the bottom.
    """
    motions = style.need([item for item in sequences if item.phases], "a motion with phases")
    groups = by_group(motions)
    names = [item.name for members in groups.values() for item in members]
    tall = 0.21 * len(names) + 0.12 * len(groups)
    figure, grid = style.new_grid(
        11.0, 5.2 + tall, "Durations of the phases", 2, 1, height_ratios=[tall, 3.3], top=0.75, between=0.85,
        left=style.label_room(names),
    )  # fmt: skip
    _draw_motions(figure.add_subplot(grid[0]), groups)
    _draw_means(figure.add_subplot(grid[1]), groups, by)
    return figure


def _draw_motions(axes: Axes, groups: dict[str, tuple[PhaseSequence, ...]]) -> None:
    level, ticks, kinds = 0.0, {}, {}
    for group, members in groups.items():
        for item in members:
            begin = item.phases[0].start
            for phase, kind, whole in zip(item.phases, item.kinds, item.whole, strict=True):
                colour = style.support_colour(len(phase.effectors))
                kinds[kind] = colour = COLOURS["right_hand"] if kind == FLIGHT else colour
                axes.barh(level, phase.duration, left=phase.start - begin, height=0.75, color=colour,
                          alpha=0.85 if whole else 0.3, edgecolor="white", linewidth=0.6)  # fmt: skip
            ticks[level] = item.name
            level -= 1.0
        axes.annotate(
            group, (1.0, level + len(members)), xycoords=("axes fraction", "data"), xytext=(-2, 0),
            textcoords="offset points", fontsize=8, ha="right", va="center", color=COLOURS["ink"],
        )  # fmt: skip
        level -= 0.6
    style.dress(axes, "", "time from the beginning [s]")
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.tick_params(axis="y", labelsize=7)
    axes.grid(False, axis="y")
    axes.set_ylim(level + 1.0, 0.6)
    keys = [Patch(color=colour, alpha=0.85, label=kind) for kind, colour in kinds.items()]
    keys.append(Patch(color=COLOURS["soft"], alpha=0.3, label="cut off by the recording"))
    style.legend_above(axes, keys, most=7)


def _draw_means(axes: Axes, groups: dict[str, tuple[PhaseSequence, ...]], by: By) -> None:
    result = {group: phase_durations(members, by) for group, members in groups.items()}
    names = _in_order([list(each) for each in result.values()])
    width, colours = WIDTH / len(result), style.group_colours(result)
    for number, (group, each) in enumerate(result.items()):
        for place, name in enumerate(names):
            if name not in each:
                continue
            spread, x = each[name], place - WIDTH / 2 + (number + 0.5) * width
            axes.bar(x, spread.mean, width=0.94 * width, color=colours[group], alpha=0.75)
            ends = [[spread.mean - spread.smallest], [spread.largest - spread.mean]]
            axes.errorbar(x, spread.mean, ends, color=COLOURS["ink"], linewidth=0.8, capsize=2)
            style.note(axes, f"{spread.count}", (x, 0.0), 2, fontsize=6.5, color="white", fontweight="bold")
    style.dress(axes, "mean, least and largest [s]")
    axes.set_xticks(range(len(names)), [name.replace("+", "\n").replace("_", " ") for name in names])
    axes.grid(False, axis="x")
    axes.set_xlim(-0.6, len(names) - 0.4)
    if spreads := [spread for each in result.values() for spread in each.values()]:
        highest, mean = max(item.largest for item in spreads), max(item.mean for item in spreads)
        axes.set_ylim(0.0, min(1.06 * highest, BEYOND * mean))
    style.legend_above(axes, style.group_keys(colours), most=7)


def _in_order(lists: Sequence[Sequence[str]]) -> list[str]:
    """All names once; a name stands behind those that it follows in the longest list."""
    merged: list[str] = list(max(lists, key=len, default=[]))
    for names in lists:
        for before, name in pairwise(["", *names]):
            if name not in merged:
                merged.insert(merged.index(before) + 1 if before in merged else 0, name)
    return merged
