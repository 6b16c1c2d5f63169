"""Contacts: those of each phase of a run, and those chosen for bodies shown as shaded solids in a scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, ContactSchedule
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.run_directory import ComTrack, RunRecord
from manikin.reports.figures import style, views
from manikin.reports.figures.space import Space
from manikin.reports.solids import body_solid
from manikin.runtime.display import COLOURS, colours_of, readable
from manikin.scene import Scene

Corners = tuple[FloatArray, FloatArray]
PIXELS = 500.0
"""Pixels of a panel with a body, along its longer side."""
MARGIN = 0.3
"""Room around the bodies [m]."""
NORMAL = 0.18
"""Length of the arrow of a contact's normal [m]."""
TASK = 0.45
"""Length of the arrow of a task [m]."""


@dataclass(frozen=True, eq=False)
class ChoicePanel:
    """One body of the figure in a configuration (nq,).

    Attributes:
        contacts: What was chosen, drawn as points with their normals.
        limbs: Names of the limbs to which they belong.
        task: (3,) direction of the task, drawn beside the head, or None.
    """

    title: str
    q: FloatArray
    contacts: Sequence[Contact] = ()
    limbs: Sequence[str] = ()
    task: FloatArray | None = None


def contact_choice_figure(
    body: BodyModel, scene: Scene, panels: Sequence[ChoicePanel], title: str = "Chosen contacts", *,
    elevation_deg: float = 14.0, azimuth_deg: float = -68.0, columns: int | None = None,
) -> Figure:  # fmt: skip
    """Draw a body with its contacts side by side, such as before, by one heuristic and by another.

    Args:
        scene: Its surroundings, as far as they are near.
        elevation_deg: Height of the eye above the horizon [deg].
        azimuth_deg: Direction of the eye about the vertical [deg].
        columns: Panels in a row; all when omitted.
    """
    style.need(panels, "a panel", "at least one body")
    wide = columns or len(panels)
    rows = -(-len(panels) // wide)
    figure = style.new_figure(3.3 * wide, 3.9 * rows + 0.4, title)
    low, high = _box(body, panels)
    if any(panel.task is not None for panel in panels):
        high[2] += TASK
    for number, panel in enumerate(panels):
        direction = float(np.deg2rad(azimuth_deg)), float(np.deg2rad(elevation_deg))
        _draw(figure.add_subplot(rows, wide, number + 1), body, scene, panel, (low, high), direction)
    return figure


def _draw(
    axes: Axes,
    body: BodyModel,
    scene: Scene,
    panel: ChoicePanel,
    box: Corners,
    direction: tuple[float, float],
) -> None:  # fmt: skip
    moved = [name for limb in body.limbs if limb.name in panel.limbs for name in limb.segments]
    ends = [segment.name for segment in body.segments if segment.parent in moved]
    solid = body_solid(body, panel.q, [*moved, *ends])
    corners = np.array([[box[i][0], box[j][1], box[k][2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    bodies = [] if solid is None else [solid]
    space = Space(bodies, np.zeros((len(bodies), 3)), scene, (), corners, direction)
    space.draw(axes, PIXELS)
    for contact in panel.contacts:
        _draw_arrow(axes, space, contact.position, NORMAL * contact.normal, COLOURS["planned"])
    if panel.task is not None:
        middle = np.array(Configuration(body, panel.q).com)
        middle[2] = box[1][2] - 0.7 * TASK
        _draw_arrow(axes, space, middle - 0.5 * TASK * panel.task, TASK * panel.task, COLOURS["ink"], 3.0)
    axes.set_title(panel.title, fontsize=9.5, color=COLOURS["ink"])


def _draw_arrow(
    axes: Axes, space: Space, start: FloatArray, vector: FloatArray, colour: str, width: float = 2.2
) -> None:
    """Draw an arrow of a vector (3,) from a point (3,) [m], before everything else."""
    first, last = space.camera.project(np.array([start, start + vector]))
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": width, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", tuple(last), tuple(first), arrowprops=look, zorder=20)


def _box(body: BodyModel, panels: Sequence[ChoicePanel]) -> Corners:
    """Corners of a box around all bodies [m]."""
    places = [contact.position for panel in panels for contact in panel.contacts]
    for panel in panels:
        posture = Configuration(body, panel.q)
        places += [posture.segment_placement(segment.name)[1] for segment in body.segments]
    return np.min(places, axis=0) - MARGIN, np.max(places, axis=0) + MARGIN


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
    """
    schedule = style.need(record.schedule, "a contact schedule")
    style.need(len(schedule.sequence) <= MOST, f"at most {MOST} phases")
    view = views.best_view(schedule)
    track = next(iter(record.tracks.values()), None)
    count = len(schedule.sequence)
    points = [c.points_in_world for c in views.distinct_contacts(schedule)]
    seen = np.vstack(points + ([] if track is None else [track.position]))
    low, high = seen.min(axis=0) - 0.1, seen.max(axis=0) + 0.1
    width, height = view(high - low)
    panel = min(PANEL * float(np.clip(1.3 * width / height, 0.55, 1.0)), TALLEST * width / height)
    pitch = np.array([max(1.06 * panel, TITLE) * width / panel, height + 0.45 * width / panel])
    scale = panel / width
    most = max(COLUMNS if count != 7 else 4, int(WIDEST / (pitch[0] * scale)))
    rows = -(-count // most)
    columns = min(count, most) if most <= COLUMNS else -(-count // rows)
    figure, grid = style.new_grid(
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
        start, end = schedule.instants[number : number + 2]
        style.note(axes, f"{number}: {start:.2f}–{end:.2f} s", (left, top), ha="left", fontsize=8.5)
        if record.scene is not None:
            views.draw_obstacles(axes, record.scene, place, low, high)
        _draw_phase(axes, schedule, number, place, track)
    (left, bottom), (right, top) = view(low), view(high)
    horizontal, vertical = view.labels
    style.dress(axes, f"{vertical}, each panel", f"{horizontal}, each panel")
    axes.grid(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.set_xticks(*views.panel_ticks(left, right, rights))
    axes.set_yticks(*views.panel_ticks(bottom, top, ups))
    axes.set(xlim=(left, right + rights[-1]), ylim=(bottom + ups[-1], top + 0.25 * width / panel))
    axes.set_aspect("equal", adjustable="box", anchor="W")
    for name, colour in colours_of(schedule.sequence.effectors).items():
        axes.plot([], [], color=colour, linewidth=5, alpha=0.6, label=readable(name))
    keys = [
        Line2D([], [], color=COLOURS["ink"], linewidth=2.0, label="centre of mass"),
        Patch(fill=False, linestyle="--", label="dashed or pale: left, or made next"),
    ]
    style.legend_in_title(figure, axes, handles=keys, most=max(2, int((figure.get_figwidth() - 3.5) / 1.35)))
    return figure


def _draw_phase(
    axes: Axes, schedule: ContactSchedule, number: int, view: views.View, track: ComTrack | None
) -> None:
    stance = schedule.sequence[number].stance
    colours = colours_of(schedule.sequence.effectors)
    near = schedule.sequence.phases[max(number - 1, 0) : number + 2]
    for contact in (contact for phase in near for contact in phase.stance):
        if not any(contact.same_place(other) for other in stance):
            views.draw_contact(axes, contact, view, colours[contact.effector], held=False)
    for contact in stance:
        views.draw_contact(axes, contact, view, colours[contact.effector])
    if track is not None:
        start, end = schedule.instants[number : number + 2]
        path = view(track.at(np.linspace(start, end, 40)))
        axes.plot(*view(track.position).T, color=COLOURS["soft"], linewidth=0.6, zorder=2.5)
        axes.plot(*path.T, color=COLOURS["ink"], linewidth=2.0, zorder=4)
        axes.plot(*path[-1], "o", color=COLOURS["ink"], markersize=3.5, zorder=5)
