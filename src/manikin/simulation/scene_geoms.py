"""Obstacles of a scene as static geometries of the physics engine."""

from typing import Any

import mujoco
import numpy as np

from manikin.errors import SceneError
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere
from manikin.scene.mesh import MeshPiece
from manikin.spatial import FloatArray, rotation_from_normal

PREFIX = "scene/"
"""Every geometry of an obstacle is named ``scene/<obstacle>`` or ``scene/<obstacle>/<number>``."""

PLANE_THICKNESS = 2e-3
"""Thickness given to a two-sided plane, half on each side [m]."""
PLANE_HALF_SIZE = 50.0
"""Half the side of the square that stands for a two-sided plane [m]."""
SHEET_THICKNESS = 5e-3
"""Thickness given to each triangle of a mesh that is not convex, inwards [m]."""
MAX_SHEETS = 3000
"""More triangles than this in pieces that are not convex are refused."""

_GEOM = mujoco.mjtGeom


def add_scene(spec: Any, scene: Scene, contact: dict[str, Any]) -> None:
    """Add every obstacle to the world body of a MuJoCo specification.

    A convex mesh piece becomes one convex geometry. A piece that is not convex becomes one
    thin prism per triangle, :data:`SHEET_THICKNESS` thick towards its inside, since MuJoCo
    would collide with its convex hull instead.

    Args:
        spec: ``mujoco.MjSpec``.
        scene: The obstacles.
        contact: Contact settings of every geometry.

    Raises:
        SceneError: If a mesh that is not convex has too many triangles.
    """
    for obstacle in scene:
        shape = obstacle.shape
        if isinstance(shape, Mesh):
            _add_mesh(spec, obstacle, shape, contact)
        else:
            kind, size, rotation, translation = _primitive(obstacle)
            spec.worldbody.add_geom(
                name=PREFIX + obstacle.name, type=kind, size=size, pos=translation,
                quat=quaternion(rotation), **contact,
            )  # fmt: skip


def obstacle_of(geom_name: str) -> str | None:
    """Name of the obstacle a geometry belongs to, or None for one of the body's."""
    if not geom_name.startswith(PREFIX):
        return None
    return geom_name.removeprefix(PREFIX).split("/")[0]


def quaternion(rotation: FloatArray) -> FloatArray:
    """(4,) wxyz quaternion of a rotation matrix."""
    result = np.empty(4)
    mujoco.mju_mat2Quat(result, np.ascontiguousarray(rotation, dtype=np.float64).ravel())
    return result


def _primitive(obstacle: Obstacle) -> tuple[Any, list[float], FloatArray, FloatArray]:
    """Kind, MuJoCo size (half lengths), rotation and translation."""
    shape, rotation, translation = obstacle.shape, obstacle.rotation, obstacle.translation
    if isinstance(shape, Box):
        return _GEOM.mjGEOM_BOX, list(shape.size / 2), rotation, translation
    if isinstance(shape, Sphere):
        return _GEOM.mjGEOM_SPHERE, [shape.radius, 0.0, 0.0], rotation, translation
    if isinstance(shape, Cylinder):
        return _GEOM.mjGEOM_CYLINDER, [shape.radius, shape.length / 2, 0.0], rotation, translation
    if isinstance(shape, Capsule):
        return _GEOM.mjGEOM_CAPSULE, [shape.radius, shape.length / 2, 0.0], rotation, translation
    assert isinstance(shape, (Plane, HalfSpace))
    normal, offset = obstacle.world_plane
    turned, place = rotation_from_normal(normal), normal * offset
    if isinstance(shape, HalfSpace):
        return _GEOM.mjGEOM_PLANE, [0.0, 0.0, 1.0], turned, place
    half = [PLANE_HALF_SIZE, PLANE_HALF_SIZE, PLANE_THICKNESS / 2]
    return _GEOM.mjGEOM_BOX, half, turned, place


def _add_mesh(spec: Any, obstacle: Obstacle, mesh: Mesh, contact: dict[str, Any]) -> None:
    sheets = sum(len(piece.faces) for piece in mesh.pieces if not piece.convex)
    if sheets > MAX_SHEETS:
        raise SceneError(
            f"obstacle {obstacle.name!r} has {sheets} triangles in pieces that are not convex; "
            f"valid: at most {MAX_SHEETS} to simulate, so decimate it or set convex to 'parts'"
        )
    number = 0
    for piece in mesh.pieces:
        for vertices in _convex_bodies(piece):
            name = f"{PREFIX}{obstacle.name}/{number}"
            number += 1
            item = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
            item.uservert = (vertices @ obstacle.rotation.T + obstacle.translation).ravel()
            spec.worldbody.add_geom(name=name, type=_GEOM.mjGEOM_MESH, meshname=name, **contact)


def _convex_bodies(piece: MeshPiece) -> list[FloatArray]:
    """Vertices of the convex bodies that stand for a piece."""
    if piece.convex:
        return [piece.vertices]
    corners = piece.vertices[piece.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    inner = corners - SHEET_THICKNESS * normals[:, None, :]
    return list(np.concatenate([corners, inner], axis=1))
