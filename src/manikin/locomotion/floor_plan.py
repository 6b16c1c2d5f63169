"""What of a scene is in a walker's way: its obstacles seen from above."""

import numpy as np

from manikin.errors import InputError
from manikin.locomotion.obstacles import WalkObstacle
from manikin.scene import Capsule, Cylinder, HalfSpace, Obstacle, Plane, Scene, Sphere
from manikin.spatial import FloatArray

STEPPED_ON = 0.02
"""Height above the floor up to which things are walked over [m]."""

CORNERS = 12
"""Of an outline at most; rounder ones are enclosed in one of so many, since every corner costs time."""


def floor_plan(scene: Scene, height: float) -> tuple[WalkObstacle, ...]:
    """Discs and convex polygons that a body of a height has to walk around.

    Obstacles are seen as the convex hulls of their outlines from above, whole, even where only a part of
    them is in the way. What hangs above the head and what lies flat on the floor are left out.

    Args:
        scene: With a level floor.
        height: Of the body [m].

    Raises:
        InputError: If the scene has no floor, or an endless obstacle other than a level one below it.
    """
    if scene.floor_height is None:
        raise InputError("scene has no floor; valid: floor_height_m, to walk on")
    low, high = scene.floor_height + STEPPED_ON, scene.floor_height + height
    return tuple(
        _outline(one)
        for one in scene
        if not _is_floor(one, low) and one.bounds[1][2] > low and one.bounds[0][2] < high
    )


def _is_floor(obstacle: Obstacle, low: float) -> bool:
    """Whether it is an endless level surface below the walker."""
    if not isinstance(obstacle.shape, Plane | HalfSpace):
        return False
    normal, offset = obstacle.world_plane
    if normal[2] > 1.0 - 1e-9 and offset <= low:
        return True
    raise InputError(
        f"obstacle {obstacle.name!r} is endless and no floor; valid for a walk: boxes, round bodies, meshes"
    )


def _outline(obstacle: Obstacle) -> WalkObstacle:
    name, shape = obstacle.name, obstacle.shape
    upright = abs(obstacle.rotation[2, 2]) > 1.0 - 1e-9
    if isinstance(shape, Sphere) or (isinstance(shape, Cylinder | Capsule) and upright):
        return WalkObstacle.disc(name, obstacle.translation[:2], shape.radius)
    points = np.asarray(obstacle.to_trimesh().vertices)[:, :2]
    outline = WalkObstacle(name, np.unique(np.round(points, 9), axis=0))
    return outline if len(outline.corners) <= CORNERS else WalkObstacle(name, _around(outline.corners))


def _around(corners: FloatArray) -> FloatArray:
    """(:data:`CORNERS`, 2) where neighbouring tangents of a polygon meet, those in even directions.

    One of them is along the longest chord, so that long outlines stay narrow.
    """
    chords = (corners[:, None] - corners).reshape(-1, 2)
    longest = chords[np.hypot(*chords.T).argmax()]
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False) + np.arctan2(longest[1], longest[0])
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    offset = (corners @ normal.T).max(axis=0)
    pairs = np.stack([normal, np.roll(normal, -1, axis=0)], axis=1)
    return np.linalg.solve(pairs, np.stack([offset, np.roll(offset, -1)], axis=1)[..., None])[..., 0]
