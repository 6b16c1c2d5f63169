"""Bodies and scenes as shaded solids in three dimensions."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import trimesh
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D

from manikin.body import BodyModel
from manikin.body.triangles import segment_triangles
from manikin.palette import COLOURS
from manikin.scene import HalfSpace, Plane, Scene
from manikin.spatial import FloatArray

LONGEST_EDGE = 0.12
"""Triangles of obstacles are cut to edges of at most this length [m], so that they sort by depth."""
_LIGHT = np.array([0.35, -0.55, 0.76])
_SHADE = 0.45
"""Brightness of what faces away from the light, as a share."""


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles of one colour.

    Attributes:
        triangles: (n, 3, 3) corners in the world [m].
        colour: Of all of them.
        alpha: Opacity in [0, 1].
    """

    triangles: FloatArray
    colour: str
    alpha: float = 1.0


def body_solids(body: BodyModel, q: FloatArray, marked: Iterable[str] = ()) -> list[Solid]:
    """Shapes of a body in one configuration.

    Args:
        body: The body.
        q: (nq,) configuration.
        marked: Names of segments drawn in the executed motion's colour.
    """
    data = body.pinocchio.createData()
    pin.framesForwardKinematics(body.pinocchio, data, q)
    found, wanted = [], set(marked)
    for segment in body.segments:
        triangles = segment_triangles(segment, rounds=10)
        if triangles is None:
            continue
        vertices, faces = triangles
        place = data.oMf[body.segment_frame(segment.name)]
        world = vertices @ place.rotation.T + place.translation
        colour = COLOURS["executed"] if segment.name in wanted else "#7F8FA6"
        found.append(Solid(world[faces], colour))
    return found


def scene_solids(scene: Scene, low: FloatArray, high: FloatArray) -> list[Solid]:
    """Finite obstacles, those of them that are between two corners (3,) of a box [m]."""
    found = []
    for obstacle in scene:
        if isinstance(obstacle.shape, (HalfSpace, Plane)):
            continue
        bounds = obstacle.bounds
        if (bounds[1] < low).any() or (bounds[0] > high).any():
            continue
        mesh = obstacle.to_trimesh()
        finer = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, LONGEST_EDGE)
        triangles = np.asarray(finer[0])[np.asarray(finer[1])]
        inside = ((triangles.max(axis=1) > low) & (triangles.min(axis=1) < high)).all(axis=1)
        found.append(Solid(np.clip(triangles[inside], low, high), COLOURS["obstacle"], 0.55))
    return found


def draw_solids(axes: Axes3D, solids: Iterable[Solid]) -> None:
    """Draw solids in one collection, so that all triangles are sorted by depth together."""
    parts = [item for item in solids if len(item.triangles)]
    triangles = np.concatenate([item.triangles for item in parts])
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    light = (normals / np.maximum(lengths, 1e-15)) @ (_LIGHT / np.linalg.norm(_LIGHT))
    bright = _SHADE + (1.0 - _SHADE) * 0.5 * (1.0 + light)
    colours = np.concatenate(
        [np.tile([*to_rgb(item.colour), item.alpha], (len(item.triangles), 1)) for item in parts]
    )
    colours[:, :3] *= bright[:, None]
    axes.add_collection3d(Poly3DCollection(triangles, facecolors=colours, edgecolors="none", linewidths=0.0))


def draw_floor(axes: Axes3D, height: float, low: FloatArray, high: FloatArray, step: float = 0.5) -> None:
    """Draw the floor between two corners as lines ``step`` apart [m]."""
    xs, ys = (np.arange(np.floor(low[i] / step), np.ceil(high[i] / step) + 1) * step for i in (0, 1))
    lines = [[(x, ys[0], height), (x, ys[-1], height)] for x in xs]
    lines += [[(xs[0], y, height), (xs[-1], y, height)] for y in ys]
    axes.add_collection3d(Line3DCollection(lines, colors="#D5D9DF", linewidths=0.6, zorder=0))


def draw_arrow(axes: Axes3D, start: FloatArray, vector: FloatArray, colour: str, width: float = 2.2) -> None:
    """Draw an arrow of a vector (3,) from a point (3,) [m], before everything else."""
    axes.quiver(*start, *vector, color=colour, linewidth=width, arrow_length_ratio=0.3, zorder=20)
