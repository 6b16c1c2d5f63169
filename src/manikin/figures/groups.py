"""Colours of groups of motions, and the entries of a legend for them."""

from collections.abc import Iterable, Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

COLOURS_OF_GROUPS = (
    "#6A51A3", "#D55E00", "#56B4E9", "#B59B00", "#8C564B", "#4D4D4D", "#E7298A", "#66A61E",
)  # fmt: skip
"""None is that of a foot; where there are more groups, colours come again."""

FITTING = 6.0
"""Characters of tick labels that stand side by side on an inch."""


def group_colours(groups: Iterable[str]) -> dict[str, str]:
    """A colour for each group, in the order in which they appear."""
    count = len(COLOURS_OF_GROUPS)
    return {group: COLOURS_OF_GROUPS[number % count] for number, group in enumerate(dict.fromkeys(groups))}


def group_keys(colours: dict[str, str]) -> list[Patch]:
    """Entries of a legend."""
    return [Patch(color=colour, alpha=0.75, label=group) for group, colour in colours.items()]


def legend_below_title(figure: Figure, keys: Sequence[Artist]) -> None:
    """A legend in one row below the figure's title, which long names do not reach."""
    figure.legend(
        handles=list(keys), loc="upper left", ncols=len(keys), fontsize=8.5, frameon=False, borderaxespad=0.0,
        bbox_to_anchor=(0.01, 1.0 - 0.36 / figure.get_figheight()), handlelength=1.6, columnspacing=1.2,
    )  # fmt: skip


def name_groups(axes: Axes, groups: Sequence[str]) -> None:
    """Write the names of groups below their places 0, 1, ..., aslant where they are long."""
    width = axes.get_position().width * axes.figure.get_figwidth()
    axes.set_xticks(range(len(groups)), groups)
    if sum(len(group) + 2 for group in groups) > FITTING * width * 2.0:
        axes.tick_params(axis="x", labelsize=7, labelrotation=20)
        for label in axes.get_xticklabels():
            label.set_ha("right")
    axes.set_xlim(-0.6, max(len(groups), 1) - 0.4)
