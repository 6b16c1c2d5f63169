"""Colours of groups of motions, and the entries of a legend for them."""

from collections.abc import Iterable

from matplotlib.patches import Patch

COLOURS_OF_GROUPS = (
    "#6A51A3", "#D55E00", "#56B4E9", "#B59B00", "#8C564B", "#4D4D4D", "#E7298A", "#66A61E",
)  # fmt: skip
"""None is that of a foot; where there are more groups, colours come again."""


def group_colours(groups: Iterable[str]) -> dict[str, str]:
    """A colour for each group, in the order in which they appear."""
    count = len(COLOURS_OF_GROUPS)
    return {group: COLOURS_OF_GROUPS[number % count] for number, group in enumerate(dict.fromkeys(groups))}


def group_keys(colours: dict[str, str]) -> list[Patch]:
    """Entries of a legend."""
    return [Patch(color=colour, alpha=0.75, label=group) for group, colour in colours.items()]
