"""The body as a robot description, MJCF or URDF, and the scene around it.

MJCF is the simulation's own model (:mod:`manikin.simulation.compile`), saved. MuJoCo's writer rounds to six
digits; what counts, places, inertias, axes, limits, sizes and vertices, is written again with twelve.

URDF has one joint between two links, so a segment with several hinges is a chain of links without mass before
the segment's own. MuJoCo refuses those; the ``<mujoco>`` element, which other programs pass over, gives them
a nanogram for it alone. The root hangs on ``world`` by a floating joint. URDF knows no capsules: each is a
cylinder and two spheres. The scene is a description of its own, every obstacle fixed to ``world``.
"""

from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Hinge, Segment, Shape, ShapeKind
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, euler_angles, rotation_from_normal
from manikin.scene import Box, Capsule, Cylinder, HalfSpace, Mesh, Obstacle, Plane, Scene, Sphere
from manikin.simulation.compile import PhysicsOptions, model_spec

ENDLESS, THICK = 100.0, 0.1
"""Side of the box that stands for a plane or half-space in URDF, and its thickness below the surface [m]."""
LEAST = 1e-12
"""Mass [kg] and inertia [kg.m^2] that MuJoCo gives to links without any."""
WORLD = "world"


def digits(values: ArrayLike) -> str:
    """Numbers with twelve significant digits, spaces in between."""
    return " ".join(f"{value + 0.0:.12g}" for value in np.ravel(values).tolist())


def _text(root: Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


# --- MJCF --------------------------------------------------------------------------------------


def to_mjcf(body: BodyModel, motion: Motion, scene: Scene | None = None) -> str:
    """Text of an MJCF file of a body and its scene, with the motion's ends as key frames.

    Raises:
        SceneError: If a mesh is too large to simulate.
    """
    spec = model_spec(body, scene, PhysicsOptions())
    for name, sample in (("start", 0), ("end", -1)):
        q = motion.q[sample]
        spec.add_key(name=name, qpos=np.concatenate([q[:3], q[[6, 3, 4, 5]], q[7:]]))
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    for kind, items in (
        ("joint", spec.joints), ("geom", spec.geoms), ("site", spec.sites), ("mesh", spec.meshes),
        ("key", spec.keys),
    ):  # fmt: skip
        named = {item.name: item for item in items}
        for element in root.iter(kind):
            if (name := element.get("name")) in named:
                _write_exactly(element, kind, named[name])
    for element in root.iter("body"):
        _write_inertia(element, body.segment(element.get("name", "")))
    return _text(root)


def _write_exactly(element: Element, kind: str, item: Any) -> None:
    """Replace the numbers of an element by those of the item of the specification."""
    if kind == "mesh":
        element.set("vertex", digits(item.uservert))
    elif kind == "key":
        element.set("qpos", digits(item.qpos))
    elif kind == "joint" and "range" in element.attrib:
        element.attrib |= {"axis": digits(item.axis), "range": digits(item.range)}
    elif kind == "geom" and element.get("type") == "mesh":
        # The vertices are in the world; what the compiler makes of them it makes again.
        for key in ("pos", "quat"):
            element.attrib.pop(key, None)
    elif kind in ("geom", "site"):
        element.attrib |= {"pos": digits(item.pos), "quat": digits(item.quat)}
        if "size" in element.attrib:
            count = len(element.attrib["size"].split())
            element.set("size", digits(item.size[:count]))


def _write_inertia(element: Element, segment: Segment) -> None:
    element.set("pos", digits(segment.origin))
    inertial = element.find("inertial")
    assert inertial is not None
    inertial.attrib.clear()
    inertial.attrib |= {
        "pos": digits(segment.com), "mass": digits(segment.mass),
        "fullinertia": digits(segment.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
    }  # fmt: skip


# --- URDF --------------------------------------------------------------------------------------


def to_urdf(body: BodyModel) -> str:
    """Text of a URDF file of a body; segments, hinges and effectors keep their names."""
    root = _robot(body.name)
    SubElement(root, "link", name=WORLD)
    for segment in body.segments:
        links = [f"{segment.name}/{hinge.name}" for hinge in segment.hinges[:-1]] + [segment.name]
        for name in links[:-1]:
            SubElement(root, "link", name=name)
        _add_link(root, segment)
        if segment.parent is None:
            _add_joint(root, "root", "floating", WORLD, segment.name, np.zeros(3))
            continue
        if not segment.hinges:
            _add_joint(root, f"{segment.name}/fixed", "fixed", segment.parent, segment.name, segment.origin)
        parent, place = segment.parent, segment.origin
        for hinge, link in zip(segment.hinges, links, strict=False):
            _add_hinge(root, hinge, parent, link, place)
            parent, place = link, np.zeros(3)
    for effector in body.effectors.values():
        name = f"effector/{effector.name}"
        SubElement(root, "link", name=name)
        _add_joint(
            root, f"{name}/fixed", "fixed", effector.segment, name, effector.translation, effector.rotation
        )
    return _text(root)


def _robot(name: str) -> Element:
    root = Element("robot", name=name)
    least = digits(LEAST)
    compiler = {"boundmass": least, "boundinertia": least, "fusestatic": "false", "strippath": "false"}
    SubElement(SubElement(root, "mujoco"), "compiler", compiler)
    return root


def _add_link(root: Element, segment: Segment) -> None:
    link = SubElement(root, "link", name=segment.name)
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=digits(segment.com), rpy="0 0 0")
    SubElement(inertial, "mass", value=digits(segment.mass))
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    SubElement(inertial, "inertia", {key: digits(segment.inertia[at]) for key, at in places.items()})
    for shape in segment.shapes:
        for kind, sizes, place in _parts(shape):
            for tag in ("visual", "collision"):
                item = SubElement(link, tag)
                _add_origin(item, shape.translation + shape.rotation @ place, shape.rotation)
                SubElement(SubElement(item, "geometry"), kind, sizes)


def _parts(shape: Shape) -> Iterator[tuple[str, dict[str, str], FloatArray]]:
    """Geometries of URDF that make a shape: element, its attributes, centre in the shape's frame [m]."""
    if shape.kind is ShapeKind.BOX:
        yield "box", {"size": digits(shape.size)}, np.zeros(3)
        return
    radius = {"radius": digits(shape.size[0])}
    if shape.kind is ShapeKind.SPHERE:
        yield "sphere", radius, np.zeros(3)
        return
    yield "cylinder", radius | {"length": digits(shape.size[1])}, np.zeros(3)
    for sign in (-1.0, 1.0):
        yield "sphere", radius, np.array([0.0, 0.0, sign * shape.size[1] / 2.0])


def _add_origin(item: Element, place: FloatArray, rotation: FloatArray) -> None:
    turn = euler_angles(rotation, "xyz")
    SubElement(item, "origin", xyz=digits(place), rpy=digits(turn))


def _add_joint(
    root: Element, name: str, kind: str, parent: str, child: str, place: FloatArray,
    rotation: FloatArray | None = None,
) -> Element:  # fmt: skip
    joint = SubElement(root, "joint", name=name, type=kind)
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=child)
    _add_origin(joint, place, np.eye(3) if rotation is None else rotation)
    return joint


def _add_hinge(root: Element, hinge: Hinge, parent: str, child: str, place: FloatArray) -> None:
    joint = _add_joint(root, hinge.name, "revolute", parent, child, place)
    SubElement(joint, "axis", xyz=digits(hinge.axis))
    effort = max(-hinge.torque_lower, hinge.torque_upper)  # URDF has one limit for both directions
    limits = {"lower": hinge.lower, "upper": hinge.upper, "effort": effort, "velocity": hinge.velocity_limit}
    SubElement(joint, "limit", {key: digits(value) for key, value in limits.items()})


def scene_urdf(scene: Scene, folder: str) -> tuple[str, dict[str, bytes]]:
    """Text of a URDF file of a scene, and the STL files it needs by their names.

    Args:
        scene: What stands around.
        folder: Where the STL files are, as seen from the file.
    """
    root, meshes = _robot("scene"), dict[str, bytes]()
    SubElement(root, "link", name=WORLD)
    for obstacle in scene:
        link = SubElement(root, "link", name=obstacle.name)
        kind, sizes, rotation, place = _solid(obstacle, folder)
        if kind == "mesh":
            meshes[f"{obstacle.name}.stl"] = _stl(obstacle)
        for tag in ("visual", "collision"):
            SubElement(SubElement(SubElement(link, tag), "geometry"), kind, sizes)
        _add_joint(root, f"{obstacle.name}/fixed", "fixed", WORLD, obstacle.name, place, rotation)
    return _text(root), meshes


def _solid(obstacle: Obstacle, folder: str) -> tuple[str, dict[str, str], FloatArray, FloatArray]:
    """Element and attributes of an obstacle's geometry, its rotation and place in the world."""
    shape, rotation, place = obstacle.shape, obstacle.rotation, obstacle.translation
    if isinstance(shape, Box):
        return "box", {"size": digits(shape.size)}, rotation, place
    if isinstance(shape, Sphere):
        return "sphere", {"radius": digits(shape.radius)}, rotation, place
    if isinstance(shape, Cylinder):
        return "cylinder", {"radius": digits(shape.radius), "length": digits(shape.length)}, rotation, place
    if isinstance(shape, (Mesh, Capsule)):
        return "mesh", {"filename": f"{folder}/{obstacle.name}.stl"}, np.eye(3), np.zeros(3)
    assert isinstance(shape, (Plane, HalfSpace))
    normal, offset = obstacle.world_plane
    size = {"size": digits([ENDLESS, ENDLESS, THICK])}
    return "box", size, rotation_from_normal(normal), normal * (offset - THICK / 2.0)


def _stl(obstacle: Obstacle) -> bytes:
    """Binary STL of an obstacle in the world [m]."""
    data: Any = obstacle.to_trimesh().export(file_type="stl")
    return bytes(data)
