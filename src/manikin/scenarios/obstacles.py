"""Obstacles of a scenario file."""

from pathlib import Path

import numpy as np

from manikin.scenarios.sections import ObstacleSection
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Sphere, load_mesh
from manikin.spatial import rotation_from_rpy


def build_obstacle(entry: ObstacleSection, folder: Path) -> Obstacle:
    """Build one obstacle.

    Args:
        entry: Its section of the file.
        folder: Folder that a relative mesh path starts from.

    Raises:
        SceneError: If the mesh cannot be read or the shape is degenerate.
    """
    rotation = rotation_from_rpy(*np.radians(entry.rpy_deg))
    return Obstacle(entry.name, _shape(entry, folder), rotation, entry.position)


def _shape(
    entry: ObstacleSection, folder: Path
) -> Box | Capsule | Cylinder | HalfSpace | Mesh | Plane | Sphere:
    if entry.box is not None:
        return Box(entry.box)
    if entry.cylinder is not None:
        return Cylinder(entry.cylinder.radius_m, entry.cylinder.length_m)
    if entry.capsule is not None:
        return Capsule(entry.capsule.radius_m, entry.capsule.length_m)
    if entry.sphere is not None:
        return Sphere(entry.sphere.radius_m)
    if entry.plane is not None:
        return Plane(entry.plane)
    if entry.half_space is not None:
        return HalfSpace(entry.half_space)
    path = folder / str(entry.mesh)
    return load_mesh(path, unit=entry.unit, scale=entry.scale or 1.0, convex=entry.convex or "no")
