"""Lowest centres of mass of several motions, and the room below what they passed."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from manikin.figures.groups import group_colours, name_groups
from manikin.figures.style import dress, need, new_grid
from manikin.mocap.published_phases import published_heights
from manikin.mocap.statistics import GroupStatistics
from manikin.palette import COLOURS


@dataclass(frozen=True)
class LowestPoints:
    """Of one group of motions.

    Attributes:
        group: Its name.
        com: Lowest heights of the centre of mass above the floor, of each motion or passage [m].
        overhead: Height of what was passed; None where nothing was or it is not known [m].
        rooms: From the highest part of the body to it; empty where not known [m].
    """

    group: str
    com: tuple[float, ...]
    overhead: float | None = None
    rooms: tuple[float, ...] = ()

    @classmethod
    def of(cls, group: GroupStatistics, overhead: float | None = None) -> "LowestPoints":
        """Those of the passages of a group, or of its whole motions where none are known."""
        if not group.under:
            return cls(group.group, tuple(one.com_lowest for one in group.whole.values()))
        rooms = tuple(one.room for _, one in group.under if one.room is not None)
        return cls(group.group, tuple(one.com_lowest for _, one in group.under), overhead, rooms)


def published_lowest() -> tuple[LowestPoints, ...]:
    """Those quoted for each beam in the thesis."""
    known = published_heights()
    return tuple(LowestPoints(beam, (low,), known.beams[beam]) for beam, low in known.lowest.items())


def com_heights_figure(groups: Sequence[LowestPoints], standing: float | None = None) -> Figure:
    """Draw lowest centres of mass by group, and the height up to what was passed ([Qiu2012]_ 3.13, 3.14).

    Args:
        groups: At least one with a height.
        standing: Height of the centre of mass in standing, drawn as a line [m].

    Raises:
        FigureError: If there is no height.
    """
    shown = need([one for one in groups if one.com], "a height of the centre of mass")
    figure, grid = new_grid(9.6, 4.4, "Lowest centre of mass", 1, 2, top=0.8, across=0.9)
    left, right = (figure.add_subplot(grid[column]) for column in range(2))
    colours = group_colours(one.group for one in shown)
    for number, one in enumerate(shown):
        colour = colours[one.group]
        _dots(left, number, one.com, colour)
        if one.overhead is not None:
            _dots(right, number, [one.overhead - low for low in one.com], colour)
            if one.rooms:
                right.plot([number + 0.25] * len(one.rooms), one.rooms, "_", color=COLOURS["ink"])
    if standing is not None:
        left.axhline(standing, color=COLOURS["soft"], linewidth=1.0, linestyle=(0, (5, 3)))
        left.annotate("standing", (0.0, standing), (2, 2), textcoords="offset points", fontsize=8,
                      xycoords=("axes fraction", "data"), color=COLOURS["soft"])  # fmt: skip
    dress(left, "height above the floor [m]", title="Lowest centre of mass")
    dress(right, "up to what is passed [m]", title="Room above it (dots) and the body (dashes)")
    for axes in (left, right):
        name_groups(axes, [one.group for one in shown])
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        axes.grid(False, axis="x")
    if not any(one.overhead is not None for one in shown):
        right.annotate("nothing overhead is known", (0.5, 0.5), xycoords="axes fraction", ha="center",
                       fontsize=9, color=COLOURS["soft"])  # fmt: skip
    return figure


def _dots(axes: Axes, number: int, values: Sequence[float], colour: str) -> None:
    mean = sum(values) / len(values)
    axes.bar(number, mean, width=0.6, color=colour, alpha=0.35)
    axes.plot([number] * len(values), values, "o", color=colour, markersize=4)
    axes.annotate(f"{mean:.2f}", (number, 0.0), (0, 3), textcoords="offset points", fontsize=7.5,
                  ha="center")  # fmt: skip
