"""Triangles of the body's collision shapes."""

import numpy as np
import trimesh

from manikin.body.segments import Segment, Shape, ShapeKind
from manikin.spatial import FloatArray


def segment_triangles(segment: Segment, rounds: int = 24) -> tuple[FloatArray, np.ndarray] | None:
    """Vertices (n, 3) [m] and faces (m, 3) of all shapes in the segment's frame, or None.

    Args:
        segment: The segment.
        rounds: Corners of the round cross-section of a capsule.
    """
    parts = [_placed(shape, rounds) for shape in segment.shapes]
    if not parts:
        return None
    whole = trimesh.util.concatenate(parts)
    return np.asarray(whole.vertices), np.asarray(whole.faces)


def _placed(shape: Shape, rounds: int) -> trimesh.Trimesh:
    mesh = _mesh(shape, rounds)
    placement = np.eye(4)
    placement[:3, :3], placement[:3, 3] = shape.rotation, shape.translation
    mesh.apply_transform(placement)
    return mesh


def _mesh(shape: Shape, rounds: int) -> trimesh.Trimesh:
    if shape.kind is ShapeKind.BOX:
        return trimesh.creation.box(shape.size)
    if shape.kind is ShapeKind.SPHERE:
        return trimesh.creation.icosphere(subdivisions=3 if rounds > 16 else 2, radius=float(shape.size[0]))
    radius, length = (float(value) for value in shape.size)
    capsule = trimesh.creation.capsule(height=length, radius=radius, count=[rounds, rounds])
    capsule.apply_translation(-capsule.bounds.mean(axis=0))  # trimesh does not centre it
    return capsule
