"""Obstacles, support surfaces, and distances between the body and the scene."""

from manikin.scene.mesh import Mesh, load_mesh
from manikin.scene.obstacle import Obstacle
from manikin.scene.scene import Scene
from manikin.scene.shapes import Box, Capsule, Cylinder, HalfSpace, Plane, Sphere
from manikin.scene.surface import Surface

__all__ = [
    "Box",
    "Capsule",
    "Cylinder",
    "HalfSpace",
    "Mesh",
    "Obstacle",
    "Plane",
    "Scene",
    "Sphere",
    "Surface",
    "load_mesh",
]
