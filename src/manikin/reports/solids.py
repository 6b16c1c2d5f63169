"""Triangles that pictures and pages show: people by their surface, other bodies by their shapes, a scene."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from manikin.body import BodyModel
from manikin.body.flesh import MATERIALS
from manikin.body.segments import segment_triangles
from manikin.body.skin import segment_frames, skin_of
from manikin.contact import Contact
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import COLOURS, MATERIAL_COLOURS, colours_of, side_colour
from manikin.scene import HalfSpace, Obstacle, Plane, Scene

SHEET = 0.004
"""Height of the outline of a contact above its surface [m], so that it is not hidden by it."""


@dataclass(frozen=True, eq=False, repr=False)
class DrawnSolid:
    """Triangles of one thing.

    Attributes:
        name: Of the thing.
        vertices: (n, 3) in the world [m].
        faces: (m, 3) their corners, counter-clockwise from outside.
        colours: (m, 3) red, green and blue of the faces, 0 to 1.
        normals: (n, 3) unit normals of a smooth surface; None where every face is flat.
    """

    name: str
    vertices: FloatArray
    faces: np.ndarray
    colours: FloatArray
    normals: FloatArray | None = None


def rgb(colour: str) -> FloatArray:
    """(3,) red, green and blue from 0 to 1 of a colour such as ``"#C9CED6"``."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


def body_solid(
    body: BodyModel, q: FloatArray, marked: Sequence[str] = (), coarse: float | None = None
) -> DrawnSolid | None:
    """A body in a configuration (nq,), or None of a body without shapes.

    Args:
        marked: Segments that have the colour of the executed motion.
        coarse: Edge of the cells in which vertices of a person's surface become one [m]; None for none.
    """
    rotations, origins = segment_frames(body, q)
    names = [segment.name for segment in body.segments]
    if (skin := skin_of(body)) is not None:
        skin = skin if coarse is None else skin.coarser(coarse)
        vertices, normals = skin.posed(rotations, origins)
        colours = np.array([rgb(MATERIAL_COLOURS[material]) for material in MATERIALS])[skin.materials]
        strongest = skin.bones[:, 0][skin.faces[:, 0]]
        colours[np.isin(np.array(skin.segments)[strongest], marked)] = rgb(COLOURS["executed"])
        return DrawnSolid(body.name, vertices, skin.faces, colours, normals)
    parts = []
    for name, rotation, origin in zip(names, rotations, origins, strict=True):
        if (found := segment_triangles(body.segment(name), rounds=16)) is not None:
            colour = rgb(COLOURS["executed"] if name in marked else side_colour(name))
            mesh = trimesh.Trimesh(*found, process=False)
            turned = np.array(mesh.vertex_normals) @ rotation.T
            parts.append(DrawnSolid(name, found[0] @ rotation.T + origin, found[1],
                               np.tile(colour, (len(found[1]), 1)), turned))  # fmt: skip
    return joined(body.name, parts) if parts else None


def joined(name: str, parts: Sequence[DrawnSolid]) -> DrawnSolid:
    """Several solids with normals as one."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return DrawnSolid(
        name, np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)]),
        np.concatenate([part.colours for part in parts]),
        np.concatenate([part.normals for part in parts if part.normals is not None]),
    )  # fmt: skip


def finite_obstacles(
    scene: Scene, low: FloatArray | None = None, high: FloatArray | None = None
) -> Iterator[Obstacle]:
    """Obstacles that end somewhere; only those near the box between two corners (3,) [m] if it is given."""
    for obstacle in scene:
        if not isinstance(obstacle.shape, (HalfSpace, Plane)):
            below, above = obstacle.bounds
            if low is None or high is None or not (np.any(below > high) or np.any(above < low)):
                yield obstacle


def scene_solids(scene: Scene, low: FloatArray, high: FloatArray) -> list[DrawnSolid]:
    """Finite obstacles as they are, cut at the box between two corners (3,) [m]."""
    result = []
    for obstacle in finite_obstacles(scene, low, high):
        mesh = obstacle.to_trimesh()
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
        for axis in range(3):
            for corner, sign in ((low, 1.0), (high, -1.0)):
                if np.any(sign * (vertices[:, axis] - corner[axis]) < 0.0):
                    normal = sign * np.eye(3)[axis]
                    cut = trimesh.intersections.slice_faces_plane(vertices, faces, normal, corner)
                    vertices, faces = np.asarray(cut[0]), np.asarray(cut[1])
        if len(faces):
            colours = np.tile(rgb(COLOURS["obstacle"]), (len(faces), 1))
            result.append(DrawnSolid(obstacle.name, vertices, faces, colours))
    return result


def contact_solids(contacts: Iterable[Contact]) -> list[DrawnSolid]:
    """Soles and other flat contacts as sheets in the colours of their effectors."""
    contacts = [contact for contact in contacts if len(contact.points) > 2]
    colours, result = colours_of(contact.effector for contact in contacts), []
    for contact in contacts:
        corners = contact.points_in_world + SHEET * contact.normal
        faces = np.array([(0, k, k + 1) for k in range(1, len(corners) - 1)])
        tint = np.tile(rgb(colours[contact.effector]), (len(faces), 1))
        result.append(DrawnSolid(contact.effector, corners, faces, tint))
    return result
