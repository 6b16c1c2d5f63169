"""How far the centre of mass is from what supports it, while it does."""

from collections.abc import Mapping, Sequence

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from manikin.figures.groups import group_colours, legend_below_title, name_groups
from manikin.figures.style import dress, need, new_grid
from manikin.mocap.recorded_clip import RecordedClip
from manikin.mocap.spread import Spread
from manikin.mocap.support_distances import LIMIT, support_distances
from manikin.palette import COLOURS, readable


def com_distances_figure(
    clips: Sequence[RecordedClip],
    *,
    limit: float = LIMIT,
    published: Mapping[str, Spread] | None = None,
) -> Figure:
    """Draw the distance from the centre of mass to each support against time ([Qiu2012]_ 3.2.3, Table 3.5).

    A panel for each effector; on the right the largest one of each motion, with mean and range of published
    ones as a band.

    Args:
        clips: Recorded motions; a colour for each group. None are needed where there are published ones.
        limit: Drawn as a dashed line [m].
        published: Largest distances by effector, such as those of
            :func:`~manikin.mocap.published_phases.published_distances`.

    Raises:
        FigureError: If nothing is known of any effector.
    """
    known = published or {}
    found = [(clip, one) for clip in clips for one in support_distances(clip)]
    effectors = need(sorted({*known, *(one.effector for _, one in found)}), "a support")
    colours = group_colours(clip.group for clip in clips)
    groups = list(colours)
    figure, grid = new_grid(
        9.6, 1.2 + 2.6 * len(effectors), "Centre of mass to its supports", len(effectors), 2,
        width_ratios=[3.0, 1.0], top=1.0, between=0.85, across=0.5,
    )  # fmt: skip
    for row, effector in enumerate(effectors):
        axes = figure.add_subplot(grid[row, 0])
        most = figure.add_subplot(grid[row, 1], sharey=axes)
        for clip, one in found:
            if one.effector == effector:
                axes.plot(one.time - one.time[0], one.distance, color=colours[clip.group], linewidth=1.0,
                          alpha=0.8)  # fmt: skip
        for number, group in enumerate(groups):
            each = [
                max(float(one.distance.max()) for of, one in found if of is clip and one.effector == effector)
                for clip in clips
                if clip.group == group and effector in {one.effector for of, one in found if of is clip}
            ]
            most.plot([number] * len(each), each, "o", color=colours[group], markersize=4)
        if effector in known:
            spread = known[effector]
            most.axhspan(spread.smallest, spread.largest, color=COLOURS["shade"], zorder=0)
            most.axhline(spread.mean, color=COLOURS["soft"], linewidth=1.0, zorder=1)
        for panel in (axes, most):
            panel.axhline(limit, color=COLOURS["ink"], linewidth=1.0, linestyle=(0, (5, 3)))
        dress(axes, "distance [m]", "time from touch-down, or from the beginning [s]", readable(effector))
        dress(most, title="largest of each motion")
        name_groups(most, groups)
        most.tick_params(labelleft=False)
    keys = [Line2D([], [], color=colour, label=group) for group, colour in colours.items()]
    keys.append(Line2D([], [], color=COLOURS["ink"], linestyle=(0, (5, 3)), label=f"limit, {limit:g} m"))
    if known:
        keys.append(Line2D([], [], color=COLOURS["soft"], label="published mean and range", linewidth=3))
    legend_below_title(figure, keys)
    return figure
