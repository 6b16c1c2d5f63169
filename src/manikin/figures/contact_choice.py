"""Which contacts were chosen: bodies in a scene side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact
from manikin.errors import FigureError
from manikin.figures.bodies import body_solids, draw_arrow, draw_floor, draw_solids, scene_solids
from manikin.figures.style import new_figure
from manikin.palette import COLOURS
from manikin.scene import Scene
from manikin.spatial import FloatArray

MARGIN = 0.3
"""Room around the bodies [m]."""
NORMAL = 0.18
"""Length of the arrow of a contact's normal [m]."""
TASK = 0.45
"""Length of the arrow of a task [m]."""


@dataclass(frozen=True, eq=False)
class ChoicePanel:
    """One body of the figure.

    Attributes:
        title: Above the panel.
        q: (nq,) configuration.
        contacts: What was chosen, drawn as points with their normals.
        limbs: Names of the limbs to which they belong.
        task: (3,) direction of the task, drawn beside the head, or None.
    """

    title: str
    q: FloatArray
    contacts: Sequence[Contact] = ()
    limbs: Sequence[str] = ()
    task: FloatArray | None = field(default=None)


def contact_choice_figure(
    body: BodyModel,
    scene: Scene,
    panels: Sequence[ChoicePanel],
    title: str = "Chosen contacts",
    *,
    elevation_deg: float = 14.0,
    azimuth_deg: float = -68.0,
    columns: int | None = None,
) -> Figure:
    """Draw bodies with their contacts side by side, such as before, by one heuristic and by another.

    Args:
        body: The body of all panels.
        scene: Its surroundings, as far as they are near.
        panels: At least one.
        title: Of the figure.
        elevation_deg: Height of the eye above the horizon [deg].
        azimuth_deg: Direction of the eye about the vertical [deg].
        columns: Panels in a row; all when omitted.

    Raises:
        FigureError: If there is no panel.
    """
    if not panels:
        raise FigureError("contact choice figure has no panel; valid: at least one")
    wide = columns or len(panels)
    rows = -(-len(panels) // wide)
    figure = new_figure(3.3 * wide, 3.9 * rows + 0.4, title)
    low, high = _box(body, panels)
    if any(panel.task is not None for panel in panels):
        high[2] += TASK
    for number, panel in enumerate(panels):
        axes: Axes3D = figure.add_subplot(rows, wide, number + 1, projection="3d")
        _draw(axes, body, scene, panel, low, high)
        axes.view_init(elevation_deg, azimuth_deg)
    return figure


def _draw(
    axes: Axes3D, body: BodyModel, scene: Scene, panel: ChoicePanel, low: FloatArray, high: FloatArray
) -> None:
    axes.computed_zorder = False
    moved = [name for limb in body.limbs if limb.name in panel.limbs for name in limb.segments]
    ends = [segment.name for segment in body.segments if segment.parent in moved]
    draw_solids(axes, [*scene_solids(scene, low, high), *body_solids(body, panel.q, [*moved, *ends])])
    if scene.floor_height is not None:
        draw_floor(axes, scene.floor_height, low, high)
    for contact in panel.contacts:
        draw_arrow(axes, contact.position, NORMAL * contact.normal, COLOURS["planned"])
    if panel.task is not None:
        middle = np.array(Configuration(body, panel.q).com)
        middle[2] = high[2] - 0.7 * TASK
        start = middle - 0.5 * TASK * panel.task
        draw_arrow(axes, start, TASK * panel.task, COLOURS["ink"], 3.0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.25)  # type: ignore[arg-type]
    axes.set_axis_off()
    axes.text2D(0.5, 0.98, panel.title, transform=axes.transAxes, ha="center", va="bottom",
                fontsize=9.5, color=COLOURS["ink"])  # fmt: skip


def _box(body: BodyModel, panels: Sequence[ChoicePanel]) -> tuple[FloatArray, FloatArray]:
    """Corners of a box around all bodies [m]."""
    places = [
        Configuration(body, panel.q).segment_placement(segment.name)[1]
        for panel in panels
        for segment in body.segments
    ]
    places += [contact.position for panel in panels for contact in panel.contacts]
    return np.min(places, axis=0) - MARGIN, np.max(places, axis=0) + MARGIN
