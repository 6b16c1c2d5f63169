"""Ways of the centre of mass of several motions, from the side and from above."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from manikin.errors import FigureError
from manikin.figures.groups import group_colours, legend_below_title
from manikin.figures.style import dress, need, new_grid
from manikin.mocap.recorded_clip import RecordedClip
from manikin.mocap.support_placements import Origin
from manikin.palette import COLOURS, colours_of
from manikin.spatial import FloatArray


def com_paths_figure(
    clips: Sequence[RecordedClip], origins: Sequence[Origin], *, overhead: float | None = None
) -> Figure:
    """Draw the ways of the centres of mass over their supports ([Qiu2012]_ Fig. 3.12).

    The lowest points are marked. Dotted, from the side, is the way of the head's highest point.

    Args:
        clips: At least one; a colour for each group.
        origins: Of each motion, from where it is seen.
        overhead: Height of what they pass under, drawn as a line; None for nothing [m].

    Raises:
        FigureError: If there is no motion, or not one origin for each.
    """
    motions = list(need(list(clips), "a recorded motion"))
    if len(motions) != len(origins):
        raise FigureError(f"{len(origins)} origins of {len(motions)} motions; valid: one for each")
    figure, grid = new_grid(
        9.6, 7.4, "Ways of the centre of mass", 2, 1, height_ratios=[1.25, 1.0], top=0.8, between=0.7
    )
    side, above = (figure.add_subplot(grid[row]) for row in range(2))
    colours = group_colours(clip.group for clip in motions)
    for clip, origin in zip(motions, origins, strict=True):
        _draw(side, above, clip, origin, colours[clip.group])
    side.axhline(0.0, color=COLOURS["soft"], linewidth=1.0)
    if overhead is not None:
        side.axhline(overhead, color=COLOURS["ink"], linewidth=1.4, linestyle=(0, (6, 2)))
    dress(side, "height above the floor [m]", "along the way [m]")
    dress(above, "aside [m]", "along the way [m]", "From above, with the supports")
    above.set_aspect("equal", adjustable="datalim")
    above.sharex(side)
    keys = [Line2D([], [], color=colour, label=group) for group, colour in colours.items()]
    keys.append(Line2D([], [], color=COLOURS["ink"], marker="v", linestyle="", label="lowest"))
    if any("head" in clip.tops for clip in motions):
        keys.append(Line2D([], [], color=COLOURS["soft"], linestyle=":", label="top of the head"))
    if overhead is not None:
        label = f"overhead, {overhead:g} m"
        keys.append(Line2D([], [], color=COLOURS["ink"], linestyle=(0, (6, 2)), label=label))
    legend_below_title(figure, keys)
    return figure


def _draw(side: Axes, above: Axes, clip: RecordedClip, origin: Origin, colour: str) -> None:
    com = _seen(clip, origin, clip.com)
    side.plot(com[:, 0], com[:, 2], color=colour, linewidth=1.3, alpha=0.85)
    above.plot(com[:, 0], com[:, 1], color=colour, linewidth=1.3, alpha=0.85)
    if "head" in clip.tops:
        head = _seen(clip, origin, clip.tops["head"])
        side.plot(head[:, 0], head[:, 2], color=colour, linewidth=0.9, linestyle=":", alpha=0.7)
    lowest = com[int(np.argmin(com[:, 2]))]
    side.plot(lowest[0], lowest[2], "v", color=colour, markeredgecolor=COLOURS["ink"], zorder=5)
    above.plot(lowest[0], lowest[1], "v", color=colour, markeredgecolor=COLOURS["ink"], zorder=5)
    colours = colours_of(one.effector for one in clip.supports.supports)
    for one in clip.supports.supports:
        place = _seen(clip, origin, one.place[None])[0]
        above.plot(place[0], place[1], "s", color=colours[one.effector], markersize=4, alpha=0.45, zorder=1)
        side.plot(place[0], place[2], "|", color=colours[one.effector], markersize=7, alpha=0.7, zorder=1)


def _seen(clip: RecordedClip, origin: Origin, places: FloatArray) -> FloatArray:
    """(n, 3) in the frame of the origin, heights above the floor [m]."""
    return np.column_stack([origin.seen(places), places[:, 2] - clip.floor])
