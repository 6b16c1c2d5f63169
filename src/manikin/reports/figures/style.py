"""The common look of the figures: colours, axes, legends, and texts that do not cover each other."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from manikin.errors import FigureError
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import RunRecord
from manikin.runtime.display import COLOURS, readable

_WIDTH = 0.64
"""Width of a character over the size of its font, of the widest digits."""
_HEIGHT = 1.1
"""Height of a line over the size of its font."""


class Labels:
    """Writes short texts on axes, each only where it covers none of those written before.

    The limits of the axes have to be final, for they say how far apart two places are drawn.
    """

    def __init__(self, axes: Axes) -> None:
        """Begin without any text on axes; places are in the coordinates of their data."""
        axes.apply_aspect()
        self._axes, self._transform = axes, axes.transData
        self._point = axes.figure.dpi / 72.0
        self._taken: list[Bbox] = []

    def write(
        self, text: str, place: tuple[float, float], offset: tuple[float, float] = (0.0, 0.0), *,
        size: float = 7.5, ha: str = "left", **style: Any,
    ) -> bool:  # fmt: skip
        """Write a line of text unless it would cover another one, and return whether it was written.

        Args:
            place: What it belongs to.
            offset: From there to the lower edge of the text [points].
            size: Of the font [points].
            ha: Horizontal alignment.
            style: Passed on to Matplotlib, such as ``color``.
        """
        corner = self._transform.transform(place) + self._point * np.asarray(offset)
        width, height = self._point * size * np.array([_WIDTH * len(text), _HEIGHT])
        left = corner[0] - {"left": 0.0, "center": 0.5, "right": 1.0}[ha] * width
        box = Bbox.from_bounds(left, corner[1], width, height)
        if any(box.overlaps(other) for other in self._taken):
            return False
        self._taken.append(box)
        self._axes.annotate(
            text, place, offset, xycoords=self._transform, textcoords="offset points", fontsize=size, ha=ha,
            va="bottom", path_effects=[white_edge()], **style,
        )  # fmt: skip
        return True


COLOURS_OF_GROUPS = (
    "#6A51A3", "#D55E00", "#56B4E9", "#B59B00", "#8C564B", "#4D4D4D", "#E7298A", "#66A61E",
)  # fmt: skip
"""Colours of groups, none of them that of a foot; they are repeated for more groups."""
FITTING = 6.0
"""Characters of tick labels that stand side by side on an inch."""


def group_colours(groups: Iterable[str]) -> dict[str, str]:
    """A colour for each group, in the order in which they appear."""
    count = len(COLOURS_OF_GROUPS)
    return {group: COLOURS_OF_GROUPS[number % count] for number, group in enumerate(dict.fromkeys(groups))}


def group_keys(colours: dict[str, str]) -> list[Patch]:
    """Entries of a legend."""
    return [Patch(color=colour, alpha=0.75, label=group) for group, colour in colours.items()]


def name_groups(axes: Axes, groups: Sequence[str]) -> None:
    """Write the names of groups below their places 0, 1, ..., aslant where they are long."""
    width = axes.get_position().width * axes.figure.get_figwidth()
    axes.set_xticks(range(len(groups)), groups)
    if sum(len(group) + 2 for group in groups) > FITTING * width * 2.0:
        axes.tick_params(axis="x", labelsize=7, labelrotation=20)
        for label in axes.get_xticklabels():
            label.set_ha("right")
    axes.set_xlim(-0.6, max(len(groups), 1) - 0.4)


STYLES: dict[str, dict[str, Any]] = {
    "recorded": {"color": COLOURS["recorded"], "linewidth": 1.6, "zorder": 2.8},
    "planned point mass": {"color": "#8A8A8A", "linewidth": 1.2, "zorder": 2.5},
    "planned": {"color": COLOURS["planned"], "linewidth": 2.4, "zorder": 3},
    "executed": {"color": COLOURS["executed"], "linewidth": 0.9, "zorder": 4},
}
DPI = 150
T = TypeVar("T")


def new_figure(width: float, height: float, title: str) -> Figure:
    """Figure of the given size [inch] with its own canvas, no window and no global state."""
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=12, fontweight="bold", color=COLOURS["ink"], x=0.01, ha="left")
    return figure


def new_grid(
    width: float, height: float, title: str, rows: int, columns: int, *, left: float = 0.65,
    right: float = 0.15, top: float = 0.5, bottom: float = 0.5, across: float = 0.6, between: float = 0.3,
    **ratios: Any,
) -> tuple[Figure, GridSpec]:  # fmt: skip
    """Figure of the given size [inch] whose grid has known margins, which takes half the time to draw.

    The margins ``left``, ``right``, ``top``, ``bottom`` are for labels and title, ``across`` and ``between``
    the gaps between columns and rows, all in inches; ``ratios`` are ``width_ratios`` and ``height_ratios``.
    """
    figure = new_figure(width, height, title)
    figure.set_layout_engine("none")
    figure.suptitle(title, y=1.0 - 0.1 / height, va="top", x=0.01, ha="left", fontweight="bold")
    one_width = (width - left - right - across * (columns - 1)) / columns
    one_height = (height - top - bottom - between * (rows - 1)) / rows
    grid = figure.add_gridspec(
        rows, columns, left=left / width, right=1.0 - right / width, top=1.0 - top / height,
        bottom=bottom / height, wspace=across / one_width, hspace=between / one_height, **ratios,
    )  # fmt: skip
    return figure, grid


def label_room(effectors: Iterable[str]) -> float:
    """Room that the names of effectors need beside a strip [inch]."""
    return max([0.65, *(0.12 + 0.072 * len(name) for name in effectors)])


def dress(axes: Axes, ylabel: str = "", xlabel: str = "", title: str = "") -> None:
    """Give axes their labels and a quiet frame."""
    axes.set_ylabel(ylabel, fontsize=9)
    axes.set_xlabel(xlabel, fontsize=9)
    if title:
        axes.set_title(title, fontsize=10, loc="left", color=COLOURS["ink"])
    axes.tick_params(labelsize=8, color=COLOURS["soft"])
    axes.locator_params(axis="y", nbins=5)  # ticks are what takes most of the drawing time
    axes.grid(True, color="#E3E3E3", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(COLOURS["soft"])


def support_colour(count: int) -> str:
    """Colour of a phase with this many supports."""
    return COLOURS[("one support", "one support", "two supports", "more supports")[min(count, 3)]]


def support_words(count: int) -> str:
    """Words for a phase with this many supports."""
    return ("flight", "one support", "two supports", "three or more")[min(count, 3)]


def support_keys(counts: Iterable[int]) -> list[Patch]:
    """Entries of a legend for the colours of phases with these numbers of supports."""
    known = sorted({min(count, 3) for count in counts})
    return [Patch(color=support_colour(count), alpha=0.8, label=support_words(count)) for count in known]


def named_below(effectors: Iterable[str]) -> str:
    """The supports of a phase below each other, for the label of a bar."""
    return "\n".join(readable(name) for name in effectors) or "flight"


def need(value: T | None, what: str, of: str = "a run") -> T:
    """The value, or a refusal to draw ``of`` something that lacks it.

    Raises:
        FigureError: If there is none.
    """
    if not value:
        raise FigureError(f"this figure needs {what}, and there is none; valid: {of} with it")
    return value


def end_of(record: RunRecord) -> float:
    """Last instant that a motion or a phase reaches [s]."""
    times = [track.time for track in record.tracks.values()]
    times += [] if record.phases is None else [record.phases.instants]
    return max(float(time[-1]) for time in times)


def span_at_least(axes: Axes, least: float) -> None:
    """Widen the vertical limits to ``least`` about their middle, so that noise is not magnified."""
    low, high = axes.get_ylim()
    if high - low < least:
        axes.set_ylim((low + high - least) / 2, (low + high + least) / 2)


def white_edge() -> withStroke:
    """Path effect that keeps a text readable on top of lines."""
    return withStroke(linewidth=2.5, foreground="white")


def legend_above(axes: Axes, handles: Sequence[Artist] = (), *, most: int = 99) -> None:
    """A legend in rows of at most ``most`` entries above the right end of the axes, where it hides nothing.

    Its entries are ``handles``, or else what the axes show.
    """
    known = list(handles) or axes.get_legend_handles_labels()[0]
    axes.legend(
        handles=known, fontsize=8, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.1, ncols=min(len(known), most), handlelength=1.4, columnspacing=1.2,
    )  # fmt: skip


def legend_in_title(
    figure: Figure, *axes: Axes, handles: Sequence[Artist] = (), most: int = 99, **style: Any
) -> None:
    """A legend at the height of the figure's title, in rows of at most ``most`` entries.

    Its entries are what ``axes`` show, and then ``handles``.
    """
    known = [handle for item in axes for handle in item.get_legend_handles_labels()[0]] + list(handles)
    look = {"loc": "upper right", "borderaxespad": 0.3, "handlelength": 1.6, "columnspacing": 1.2} | style
    figure.legend(handles=known, fontsize=8.5, frameon=False, ncols=min(len(known), most), **look)


def legend_below_title(figure: Figure, keys: Sequence[Artist]) -> None:
    """A legend in one row below the figure's title, which long names do not reach."""
    place = (0.01, 1.0 - 0.36 / figure.get_figheight())
    legend_in_title(figure, handles=keys, loc="upper left", borderaxespad=0.0, bbox_to_anchor=place)


def draw_heading(axes: Axes, place: Sequence[float] | FloatArray, length: float) -> None:
    """Draw an arrow from x, y [m] along the heading [rad] of a place (3,), so long [m]."""
    x, y, heading = map(float, place)
    tip = x + length * float(np.cos(heading)), y + length * float(np.sin(heading))
    arrow = {"arrowstyle": "-|>", "color": COLOURS["ink"], "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, (x, y), arrowprops=arrow, zorder=5)


def note(axes: Axes, text: str, place: tuple[float, float], up: float = 3.0, **style: Any) -> None:
    """Write a text above the middle of a place, ``up`` points higher."""
    look = {"ha": "center", "fontsize": 8, "textcoords": "offset points"} | style
    axes.annotate(text, place, (0, up), **look)
