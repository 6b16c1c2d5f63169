"""The contact strategy: one panel per phase."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from manikin.contact import Contact, ContactSchedule
from manikin.figures.style import dress, need, new_grid
from manikin.figures.views import (
    View,
    best_view,
    distinct_contacts,
    draw_contact,
    draw_obstacles,
    panel_ticks,
)
from manikin.palette import COLOURS, colours_of, readable
from manikin.record import ComTrack, RunRecord

COLUMNS = 6
PANEL = 2.3
"""Width of a panel [inch]; of a tall one less."""
TALLEST = 3.6
"""Height of a panel at the most [inch]."""
TITLE = 1.2
"""Room for the title above a panel [inch]."""
WIDEST = 13.0
"""Narrow panels stand beside each other up to this width [inch]."""
MOST = 24
"""More phases than this are not drawn one by one."""


def contacts_figure(record: RunRecord) -> Figure:
    """Draw the contacts held in each phase and the CoM's path in it ([Qiu2012]_ Fig. 5.15, 5.19).

    Held contacts are filled; dashed ones have been left or are made in the next phase. The
    view is from above, or along the walls when the contacts are on walls.

    Args:
        record: With a schedule; the CoM is drawn when there is one.

    Raises:
        FigureError: If there is no schedule, or it has more than :data:`MOST` phases.
    """
    schedule = need(record.schedule, "a contact schedule")
    need(len(schedule.sequence) <= MOST, f"at most {MOST} phases")
    view = best_view(schedule)
    track = next(iter(record.tracks.values()), None)
    count = len(schedule.sequence)
    points = [c.points_in_world for c in distinct_contacts(schedule)]
    seen = np.vstack(points + ([] if track is None else [track.position]))
    low, high = seen.min(axis=0) - 0.1, seen.max(axis=0) + 0.1
    width, height = view(high - low)
    panel = min(PANEL * float(np.clip(1.3 * width / height, 0.55, 1.0)), TALLEST * width / height)
    pitch = np.array([max(1.06 * panel, TITLE) * width / panel, height + 0.45 * width / panel])
    scale = panel / width
    most = max(COLUMNS if count != 7 else 4, int(WIDEST / (pitch[0] * scale)))
    rows = -(-count // most)
    columns = min(count, most) if most <= COLUMNS else -(-count // rows)
    figure, grid = new_grid(
        columns * pitch[0] * scale + 0.8, rows * pitch[1] * scale + 1.15,
        f"Contacts of each phase, {view.words}", 1, 1, top=0.75,
    )  # fmt: skip
    axes = figure.add_subplot(grid[0])
    rights = [pitch[0] * column for column in range(columns)]
    ups = [-pitch[1] * row for row in range(rows)]
    for number in range(count):
        place = view.moved(rights[number % columns], ups[number // columns])
        (left, bottom), (right, top) = place(low), place(high)
        axes.add_patch(Rectangle((left, bottom), right - left, top - bottom, fill=False, edgecolor="#C4C9D1",
                                 linewidth=0.7, zorder=0.4, clip_on=False))  # fmt: skip
        axes.annotate(_title(schedule, number), (left, top), (0, 3), textcoords="offset points", fontsize=8.5)
        if record.scene is not None:
            draw_obstacles(axes, record.scene, place, low, high)
        _draw_phase(axes, schedule, number, place, track)
    (left, bottom), (right, top) = view(low), view(high)
    horizontal, vertical = view.labels
    dress(axes, f"{vertical}, each panel", f"{horizontal}, each panel")
    axes.grid(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.set_xticks(*panel_ticks(left, right, rights))
    axes.set_yticks(*panel_ticks(bottom, top, ups))
    axes.set(xlim=(left, right + rights[-1]), ylim=(bottom + ups[-1], top + 0.25 * width / panel))
    axes.set_aspect("equal", adjustable="box", anchor="W")
    _legend(figure, schedule)
    return figure


def _draw_phase(
    axes: Axes, schedule: ContactSchedule, number: int, view: View, track: ComTrack | None
) -> None:
    stance = schedule.sequence[number].stance
    colours = colours_of(schedule.sequence.effectors)
    for near in (number - 1, number + 1):
        if 0 <= near < len(schedule.sequence):
            for contact in schedule.sequence[near].stance:
                if not _held(contact, stance.contacts):
                    draw_contact(axes, contact, view, colours[contact.effector], held=False)
    for contact in stance:
        draw_contact(axes, contact, view, colours[contact.effector])
    if track is not None:
        start, end = schedule.instants[number : number + 2]
        times = np.linspace(float(start), float(end), 40)
        path = view(track.at(times))
        axes.plot(*view(track.position).T, color=COLOURS["soft"], linewidth=0.6, zorder=2.5)
        axes.plot(*path.T, color=COLOURS["ink"], linewidth=2.0, zorder=4)
        axes.plot(*path[-1], "o", color=COLOURS["ink"], markersize=3.5, zorder=5)


def _held(contact: Contact, contacts: tuple[Contact, ...]) -> bool:
    return any(contact.same_place(other) for other in contacts)


def _title(schedule: ContactSchedule, number: int) -> str:
    start, end = (float(instant) for instant in schedule.instants[number : number + 2])
    return f"{number}: {start:.2f}–{end:.2f} s"


def _legend(figure: Figure, schedule: ContactSchedule) -> None:
    axes = figure.axes[0]
    for name, colour in colours_of(schedule.sequence.effectors).items():
        axes.plot([], [], color=colour, linewidth=5, alpha=0.6, label=readable(name))
    handles, labels = axes.get_legend_handles_labels()
    handles += [Line2D([], [], color=COLOURS["ink"], linewidth=2.0), Patch(fill=False, linestyle="--")]
    labels += ["centre of mass", "dashed or pale: left, or made next"]
    figure.legend(
        handles,
        labels,
        fontsize=8,
        frameon=False,
        loc="upper right",
        ncols=max(2, int((figure.get_figwidth() - 3.5) / 1.35)),
    )
