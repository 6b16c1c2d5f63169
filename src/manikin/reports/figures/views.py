"""Views of a scene along a world axis: projected contacts, obstacles and bodies."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Rectangle

from manikin.body import BodyModel
from manikin.contact import Contact, ContactSchedule, SolePart
from manikin.numerics.polytope import convex_polygon, polygon_area
from manikin.numerics.spatial import FloatArray
from manikin.reports.figures.raster import Camera, hiding, picture
from manikin.reports.solids import body_solid, finite_obstacles, scene_solids
from manikin.runtime.display import COLOURS
from manikin.scene import Box, Mesh, Scene

_LINE = 1e-4
"""Projected areas below this are lines [m^2]."""
_APART = 0.05
"""Contacts nearer to each other than this cannot be told apart [m]."""
BOX_CORNERS = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
"""(8, 3) corners of a cube with an edge of 2 about the origin."""
PICTURE = 320
"""Pixels of a picture of one body, along its longer side."""


@dataclass(frozen=True)
class View:
    """Projection along a world axis.

    Attributes:
        name: Such as ``"xz"``.
        axes: Indices of the world axes that are drawn to the right and upward.
        offset: Where the world's origin is drawn [m]; panels in one pair of axes are much faster to draw.
    """

    name: str
    axes: tuple[int, int]
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def depth(self) -> int:
        """Index of the world axis along which one looks."""
        return 3 - sum(self.axes)

    def __call__(self, points: FloatArray) -> FloatArray:
        """(..., 2) projection of (..., 3) points."""
        return np.asarray(points)[..., list(self.axes)] + np.array(self.offset)

    def moved(self, right: float, up: float) -> "View":
        """The same view, drawn elsewhere."""
        return replace(self, offset=(right, up))

    @property
    def camera(self) -> Camera:
        """Parallel rays; places in its picture are those of :meth:`__call__` without the offset.

        Seen from +z or +x, but from -y, so that x points to the right.
        """
        axes = np.eye(3)[[*self.axes, self.depth]]
        return Camera(axes * [[1.0], [1.0], [-1.0 if self.name == "xz" else 1.0]], np.zeros(3))

    @property
    def labels(self) -> tuple[str, str]:
        """Labels of the two axes."""
        return f"{self.name[0]} [m]", f"{self.name[1]} [m]"

    @property
    def words(self) -> str:
        """Direction of the view, in words."""
        return {"xy": "from above", "xz": "along y", "yz": "along x"}[self.name]


ABOVE = View("xy", (0, 1))
ALONG_Y = View("xz", (0, 2))
ALONG_X = View("yz", (1, 2))
VIEWS = (ABOVE, ALONG_Y, ALONG_X)


def best_view(schedule: ContactSchedule) -> View:
    """View in which the contacts can be told apart and show the largest area.

    From above for feet on the ground; for feet on two facing walls the one along the walls.
    """
    stances = [phase.stance for phase in schedule.sequence]

    def separation(view: View) -> float:
        gaps = [
            float(np.linalg.norm(view(a.position) - view(b.position)))
            for stance in stances
            for a, b in combinations(stance, 2)
        ]
        return min(gaps, default=1.0)

    def area(view: View) -> float:
        return sum(abs(float(c.normal[view.depth])) * c.length * c.width for s in stances for c in s)

    clear = [view for view in VIEWS if separation(view) > _APART]
    if not clear:
        return max(VIEWS, key=separation)
    return max(clear, key=lambda view: (round(area(view), 6), separation(view)))


def distinct_contacts(schedule: ContactSchedule) -> list[Contact]:
    """Every contact once, in the order in which it is made; of a rolling foot the full sole."""
    result: list[Contact] = []
    for phase in schedule.sequence:
        for contact in phase.stance:
            known = next((n for n, other in enumerate(result) if contact.same_place(other)), None)
            if known is None:
                result.append(contact)
            elif result[known].part is not SolePart.FULL and contact.part is SolePart.FULL:
                result[known] = contact
    return result


def draw_contact(axes: Axes, contact: Contact, view: View, colour: str, *, held: bool = True) -> None:
    """Draw a sole as its outline, seen from its edge as a bar, and a point or grasp as a marker."""
    corners = convex_polygon(view(contact.points_in_world))
    style = "solid" if held else (0, (3, 2))
    if len(corners) > 2 and polygon_area(corners) > _LINE:
        axes.fill(*corners.T, facecolor=colour, alpha=0.35 if held else 0.0, zorder=2)
        axes.fill(*corners.T, fill=False, edgecolor=colour, linewidth=1.2, linestyle=style, zorder=2.1)
    elif len(contact.points) > 1:
        ends = corners[[0, int(np.argmax(np.linalg.norm(corners - corners[0], axis=1)))]]
        strength = 1.0 if held else 0.3
        axes.plot(*ends.T, color=colour, linewidth=5.0, alpha=strength, solid_capstyle="butt", zorder=2)
    else:
        place = view(contact.position)
        face = colour if held else "none"
        axes.plot(*place, "s", color=colour, markerfacecolor=face, markersize=6, zorder=2)


def draw_obstacles(axes: Axes, scene: Scene, view: View, low: FloatArray, high: FloatArray) -> None:
    """Draw the outlines of the finite obstacles near the box between two corners (3,) [m], and the floor.

    Of a mesh, which need not be convex, all triangles that face the eye are drawn.
    """
    outlines, widths = list[FloatArray](), list[float]()
    for obstacle in finite_obstacles(scene, low, high):
        shape = obstacle.shape
        if isinstance(shape, Mesh):
            triangles = view.camera.project(obstacle.to_world(shape.vertices))[shape.faces]
            facing = np.array([polygon_area(corners) > 0.0 for corners in triangles])
            outlines += list(triangles[facing] + view.offset)
            widths += [0.0] * int(facing.sum())
            continue
        if isinstance(shape, Box):
            points = obstacle.to_world(BOX_CORNERS * shape.size / 2)
        else:
            points = np.asarray(obstacle.to_trimesh().vertices)
        outlines.append(convex_polygon(view(points)))
        widths.append(0.7)
    (left, bottom), (right, top) = view(low), view(high)
    look: dict[str, Any] = {"facecolor": COLOURS["obstacle"], "edgecolor": COLOURS["soft"], "zorder": 0.5}
    patches = PolyCollection(outlines, linewidths=widths or 0.7, alpha=0.3, **look)
    axes.add_collection(patches, autolim=False)
    patches.set_clip_path(Rectangle((left, bottom), right - left, top - bottom, transform=axes.transData))
    if view.name != "xy" and scene.floor_height is not None:
        level = scene.floor_height + view.offset[1]
        if bottom <= level <= top:
            axes.hlines(level, left, right, color=COLOURS["soft"], linewidth=0.9, zorder=0.6)


def draw_body(
    axes: Axes,
    scene: Scene | None,
    body: BodyModel,
    q: FloatArray,
    view: View,
    box: tuple[FloatArray, FloatArray],
) -> None:
    """Draw a body in a configuration (nq,) and the obstacles in a box [m] as a shaded picture."""
    low, high = box
    (left, bottom), (right, top) = view.camera.project(np.array(box))
    solid = body_solid(body, q)
    bodies = [] if solid is None else [solid]
    obstacles = [] if scene is None else scene_solids(scene, low, high)
    window, dots = (left, right, bottom, top), PICTURE / max(right - left, top - bottom)
    clear = hiding(bodies, obstacles, view.camera, window)
    image = picture([*bodies, *obstacles], view.camera, window, dots, clear=clear, shadows=False)
    (x, y) = view.offset
    place = (left + x, right + x, bottom + y, top + y)
    axes.imshow(image, extent=place, interpolation="antialiased", zorder=1.6)
    if scene is not None and scene.floor_height is not None and low[2] <= scene.floor_height <= high[2]:
        level = scene.floor_height + y
        axes.hlines(level, left + x, right + x, color=COLOURS["soft"], linewidth=0.9, zorder=1.7)


def panel_ticks(low: float, high: float, offsets: Sequence[float]) -> tuple[list[float], list[str]]:
    """Places and labels of some ticks in each of several panels in one pair of axes.

    They reach from ``low`` to ``high``; the zero of each is drawn at an offset [m].
    """
    span = high - low
    fitting = (step for step in (0.1, 0.2, 0.25, 0.5, 1.0, 2.0) if span / step <= 4.0)
    step = next(fitting, 10.0 ** np.ceil(np.log10(span)))
    values = step * np.arange(np.ceil((low + 0.04 * span) / step), np.floor((high - 0.04 * span) / step) + 1)
    places = [float(offset + value) for offset in offsets for value in values]
    return places, [f"{value + 0.0:.3g}" for _ in offsets for value in values]


def sections(values: np.ndarray) -> list[slice]:
    """Stretches of equal values; each but the last includes the first sample of the next."""
    edges = [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist(), len(values)]
    return [slice(start, min(stop + 1, len(values))) for start, stop in pairwise(edges)]
