"""Views of a scene along a world axis: projected contacts, obstacles and bodies."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Rectangle

from manikin.body import BodyModel, Shape, ShapeKind
from manikin.contact import Contact, ContactSchedule, SolePart
from manikin.numerics.polytope import convex_polygon
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import COLOURS, side_colour
from manikin.scene import Box, HalfSpace, Mesh, Obstacle, Plane, Scene

_LINE = 1e-4
"""Projected areas below this are lines [m^2]."""
_APART = 0.05
"""Contacts nearer to each other than this cannot be told apart [m]."""
BOX_CORNERS = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
"""(8, 3) corners of a cube with an edge of 2 about the origin."""
_CIRCLE = np.column_stack([np.cos(a := np.linspace(0.0, 2.0 * np.pi, 17)[:-1]), np.sin(a)])


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


def finite_obstacles(
    scene: Scene, low: FloatArray | None = None, high: FloatArray | None = None
) -> Iterator[Obstacle]:
    """Obstacles that end somewhere; only those near the box between two corners (3,) [m] if it is given."""
    for obstacle in scene:
        if not isinstance(obstacle.shape, (HalfSpace, Plane)):
            below, above = obstacle.bounds
            if low is None or high is None or not (np.any(below > high) or np.any(above < low)):
                yield obstacle


def draw_obstacles(axes: Axes, scene: Scene, view: View, low: FloatArray, high: FloatArray) -> None:
    """Draw the outlines of the finite obstacles near the box between two corners (3,) [m], and the floor."""
    outlines = []
    for obstacle in finite_obstacles(scene, low, high):
        shape = obstacle.shape
        if isinstance(shape, Box):
            points = obstacle.to_world(BOX_CORNERS * shape.size / 2)
        elif isinstance(shape, Mesh):
            points = obstacle.to_world(shape.vertices)
        else:
            points = np.asarray(obstacle.to_trimesh().vertices)
        outlines.append(convex_polygon(view(points)))
    (left, bottom), (right, top) = view(low), view(high)
    look: dict[str, Any] = {"facecolor": COLOURS["obstacle"], "edgecolor": COLOURS["soft"], "zorder": 0.5}
    patches = PolyCollection(outlines, linewidth=0.7, alpha=0.3, **look)
    axes.add_collection(patches, autolim=False)
    patches.set_clip_path(Rectangle((left, bottom), right - left, top - bottom, transform=axes.transData))
    if view.name != "xy" and scene.floor_height is not None:
        level = scene.floor_height + view.offset[1]
        if bottom <= level <= top:
            axes.hlines(level, left, right, color=COLOURS["soft"], linewidth=0.9, zorder=0.6)


def draw_body(axes: Axes, body: BodyModel, q: FloatArray, view: View) -> None:
    """Draw the silhouettes of a body's shapes in a configuration (nq,), the farthest first."""
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, np.asarray(q))
    drawn = []
    for segment in body.segments:
        placement = data.oMf[body.segment_frame(segment.name)]
        for shape in segment.shapes:
            centre = placement.translation + placement.rotation @ shape.translation
            outline = _outline(shape, placement.rotation @ shape.rotation, centre, view)
            # Seen from +z or +x, but from -y, so that x points to the right.
            depth = centre[view.depth] * (-1.0 if view.name == "xz" else 1.0)
            drawn.append((depth, outline, side_colour(segment.name)))
    _, outlines, colours = zip(*sorted(drawn, key=lambda item: item[0]), strict=True)
    look: dict[str, Any] = {"edgecolors": "white", "linewidths": 0.4, "alpha": 0.85, "zorder": 3}
    axes.add_collection(PolyCollection(outlines, facecolors=colours, **look), autolim=False)


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


def polygon_area(corners: FloatArray) -> float:
    """Area of a convex polygon of (k, 2) corners, counter-clockwise."""
    x, y = np.asarray(corners).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def sections(values: np.ndarray) -> list[slice]:
    """Stretches of equal values; each but the last includes the first sample of the next."""
    edges = [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist(), len(values)]
    return [slice(start, min(stop + 1, len(values))) for start, stop in pairwise(edges)]


def _outline(shape: Shape, rotation: FloatArray, centre: FloatArray, view: View) -> FloatArray:
    if shape.kind is ShapeKind.BOX:
        return convex_polygon(view(centre + (BOX_CORNERS * shape.size / 2) @ rotation.T))
    radius = float(shape.size[0])
    half = shape.size[1] / 2 * rotation[:, 2] if shape.kind is ShapeKind.CAPSULE else np.zeros(3)
    ends = view(np.array([centre - half, centre + half]))
    return convex_polygon(np.vstack([end + radius * _CIRCLE for end in ends]))
