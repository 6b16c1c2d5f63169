"""Scene of a scenario, and the posture of its body at the start."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.errors import ScenarioError
from manikin.numerics.spatial import FloatArray, finite_number, rotation_from_rpy, turned_root
from manikin.planning.contacts import Endpoints, Habit
from manikin.planning.whole_body.posture_style import posture_style_of
from manikin.scenarios.sections.task_sections import ObstacleSection
from manikin.scenarios.sequence import friction_of
from manikin.scenarios.values import ScenarioValues
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere, load_mesh


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


CLIMBING = "climbing"
"""Name of the posture of one who hangs on holds: where the root is, with whatever contacts are there."""


def start_posture(
    values: ScenarioValues,
    body: BodyModel,
    scene: Scene,
    *,
    at: tuple[float, float] | None = None,
    heading_deg: float | None = None,
    posture: str | None = None,
) -> FloatArray:
    """(nq,) configuration at the start: a posture turned and moved to its place.

    A standing body is the standing posture as it is: its root at the place, or its centre of mass over
    the file's, its soles at the height of the supports or of the floor. A seated or crouched one is what
    planning would start from (:class:`manikin.planning.contacts.Endpoints`); a climbing one is the reference
    near which planning would seek holds.

    Args:
        at: Where to stand, x and y [m]; the file's own place when omitted.
        heading_deg: Where to face, counter-clockwise from world x [deg]; the file's own, or that of
            its feet, when omitted.
        posture: Name of a posture; the file's own, or standing, when omitted.

    Raises:
        ScenarioError: If the posture is not known, does not exist there, or the file gives no place.
        InputError: If a number is not finite.
    """
    start = values.file.task.start
    name = posture or start.posture or Habit.STANDING
    if name not in (*Habit, CLIMBING):
        raise ScenarioError(f"posture is {name!r}; valid: {', '.join((*Habit, CLIMBING))}")
    heading_deg = None if heading_deg is None else finite_number(heading_deg, "heading [deg]")
    at = None if at is None else (finite_number(at[0], "at x [m]"), finite_number(at[1], "at y [m]"))
    yaw = float(np.deg2rad(values.start_heading_deg if heading_deg is None else heading_deg))
    place = at or start.at
    if name == CLIMBING:
        spot = values.start_com[:2] if place is None else place
        level = values.start_level if start.height_m is None else start.height_m
        return carried_to(posture_style_of(CLIMBING).posture(body), spot, yaw, level)
    if name != Habit.STANDING:
        spot = np.array(values.start_com[:2] if place is None else place)
        result = Endpoints(
            body, scene, friction_of(values), friction_model=values.contact_model.friction
        ).find(spot, yaw, Habit(name), start.height_m)
        if result.stage is None:
            raise ScenarioError(f"{values.source}: {result.failure}; valid: another place or posture")
        return np.array(result.stage.q)
    q = turned_root(body.standing_posture(), yaw)
    q[2] += values.start_level
    q[:2] = place if place is not None else q[:2] + values.start_com[:2] - Configuration(body, q).com[:2]
    return q


def carried_to(q: FloatArray, at: ArrayLike, yaw: float, level: float) -> FloatArray:
    """(nq,) a posture made for the ground at the origin, at a place x and y and a level [m], turned [rad]."""
    posture = turned_root(q, yaw)
    posture[:2] = at
    posture[2] += level
    return posture


def build_scene(values: ScenarioValues) -> Scene:
    """Build the obstacles and the floor.

    Raises:
        ScenarioError: If a mesh cannot be read or a shape is degenerate.
    """
    obstacles = []
    for index, entry in enumerate(values.file.scene):
        with values.refusing(("scene", index)):
            obstacles.append(build_obstacle(entry, values.folder))
    return Scene(obstacles, floor_height=values.file.floor_height_m)
