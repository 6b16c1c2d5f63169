"""Obstacles, support surfaces, and distances between the body and the scene."""

from manikin.runtime.display import make_callable
from manikin.scene.covering import cover
from manikin.scene.distance import Proximity, segment_of
from manikin.scene.footing import FootingTable, Places
from manikin.scene.mesh import PACKAGE, Mesh, load_mesh, mesh_place, package_file
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Obstacle, Plane, Sphere
from manikin.scene.scene import Scene
from manikin.scene.spheres import SphereProximity
from manikin.scene.surface import GraspLine, Surface

__all__ = [
    "PACKAGE", "Box", "Capsule", "Cylinder", "FootingTable", "GraspLine", "HalfSpace", "Mesh", "Obstacle",
    "Places", "Plane", "Proximity", "Scene", "Sphere", "SphereProximity", "Surface", "cover", "load_mesh",
    "mesh_place", "package_file", "segment_of",
]  # fmt: skip


make_callable(__name__)
