"""Robot description files (URDF) as plain, checked values, with spheres, capsules and boxes as shapes.

A cylinder becomes the capsule of its radius and length, rounded at the ends, or a box where it is shorter
than wide. A mesh becomes the smallest of a box, a capsule and a sphere that hold it.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import trimesh

from manikin.body.segments import ShapeKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, rotation_from_rpy

_THINNEST = 1e-4
"""Least side of a box around a mesh [m]."""
MAX_BYTES = 20_000_000
"""Largest file that is read; those of humanoids have a hundredth of it."""
MAX_MESH_BYTES = 200_000_000
"""Largest mesh file that is read."""
MAX_LINKS = 200
"""Most links; humanoids with hands have about a hundred."""
HEAVIEST = 1e4
"""Largest mass of a link [kg]."""
FARTHEST = 100.0
"""Largest length, and distance from the frame that it is given in [m]."""


class UrdfShape(NamedTuple):
    """A collision shape in the frame of its link or its geometry, as :class:`manikin.body.Shape`."""

    kind: ShapeKind
    size: FloatArray
    rotation: FloatArray = np.eye(3)
    translation: FloatArray = np.zeros(3)


def _shape(element: Element, link: str, folder: Path) -> UrdfShape:
    where = f"{link} collision"
    rotation, translation = _placement(element.find("origin"), where)
    geometry = element.find("geometry")
    items = [] if geometry is None else list(geometry)
    if len(items) != 1 or items[0].tag not in ("box", "sphere", "cylinder", "capsule", "mesh"):
        tags = [item.tag[:40] for item in items]
        raise BodyError(f"{where} has geometry {tags}; valid: box, sphere, cylinder, capsule or mesh")
    kind, size, turn, centre = _primitive(items[0], where, folder)
    if np.any(size <= 0.0) or np.any(size > FARTHEST):
        raise BodyError(f"{where} size is {size.tolist()}; valid: > 0 and at most {FARTHEST:g} m")
    return UrdfShape(kind, size, rotation @ turn, translation + rotation @ centre)


def _primitive(item: Element, where: str, folder: Path) -> UrdfShape:
    if item.tag == "mesh":
        return _of_mesh(item, where, folder)
    if item.tag == "box":
        return UrdfShape(ShapeKind.BOX, _numbers(item, "size", f"{where} box"))
    radius = _number(item, "radius", f"{where} {item.tag}")
    if item.tag == "sphere":
        return UrdfShape(ShapeKind.SPHERE, np.array([radius]))
    length = _number(item, "length", f"{where} {item.tag}")
    if item.tag == "capsule":
        return UrdfShape(ShapeKind.CAPSULE, np.array([radius, length]))
    return rounded_cylinder(radius, length)


def rounded_cylinder(radius: float, length: float) -> UrdfShape:
    """The capsule of a cylinder's radius and length [m], or the box of one that is shorter than wide."""
    if length > 2.0 * radius:
        return UrdfShape(ShapeKind.CAPSULE, np.array([radius, length - 2.0 * radius]))
    return UrdfShape(ShapeKind.BOX, np.array([2.0 * radius, 2.0 * radius, length]))


def _of_mesh(item: Element, where: str, folder: Path) -> UrdfShape:
    """The shape around a mesh file."""
    name = item.get("filename", "")
    scale = _numbers(item, "scale", f"{where} mesh", np.ones(3))
    if np.any(scale == 0.0):
        raise BodyError(f"{where} mesh scale is {scale.tolist()}; valid: not zero")
    file = _mesh_file(name, folder)
    if file is None:
        raise BodyError(f"{where} mesh {name[:200]!r} is not found from {folder}; valid: a mesh file")
    try:
        return _around_file(file, file.stat().st_mtime_ns, tuple(scale.tolist()))
    except BodyError as error:
        raise BodyError(f"{where} {error}") from None


@lru_cache(maxsize=64)
def _around_file(file: Path, stamp: int, scale: tuple[float, ...]) -> UrdfShape:  # noqa: ARG001
    """The shape around a file as it was at a time; limbs often have one mesh in common."""
    if (size := file.stat().st_size) > MAX_MESH_BYTES:
        raise BodyError(f"mesh '{file}' has {size} bytes; valid: at most {MAX_MESH_BYTES}")
    try:
        points = np.asarray(trimesh.load(file, force="mesh").vertices, dtype=np.float64)
    except Exception as error:  # the readers of each format raise what they like
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise BodyError(f"mesh '{file}' cannot be read ({reason}); valid: a mesh") from None
    if len(points) < 4 or not np.all(np.isfinite(points)):
        raise BodyError(f"mesh '{file}' has {len(points)} vertices; valid: at least 4 finite ones")
    return shape_around(points * np.array(scale))


def _mesh_file(name: str, folder: Path) -> Path | None:
    if not name:
        return None
    tried = [folder / name.removeprefix("file://")]
    if name.startswith("package://"):
        inside = name.removeprefix("package://")
        bases, parts = (folder, *folder.resolve().parents[:3]), (inside, inside.partition("/")[2])
        tried = [base / part for base in bases for part in parts]
    return next((file for file in tried if file.is_file()), None)


def shape_around(points: FloatArray) -> UrdfShape:
    """Smallest of the box, capsule and sphere around points (n, 3)."""
    try:
        to_box, extents = trimesh.bounds.oriented_bounds(points)
    except Exception:  # flat or straight: its hull has no volume
        middle, extents = 0.5 * (points.min(axis=0) + points.max(axis=0)), np.ptp(points, axis=0)
        to_box = np.eye(4)
        to_box[:3, 3] = -middle
    turn = to_box[:3, :3].T
    centre = -turn @ to_box[:3, 3]
    extents = np.maximum(extents, _THINNEST)
    local = (points - centre) @ turn
    along = int(np.argmax(extents))
    radius, length = _capsule(local, along)
    reach = max(float(np.linalg.norm(local, axis=1).max()), _THINNEST)
    capsule, volume = np.array([radius, length]), np.pi * radius**2 * (length + 4.0 / 3.0 * radius)
    upright = turn @ np.roll(np.eye(3), along - 2, axis=0)
    shapes = (
        (float(np.prod(extents)), UrdfShape(ShapeKind.BOX, extents, turn, centre)),
        (volume, UrdfShape(ShapeKind.CAPSULE, capsule, upright, centre)),
        (4.0 / 3.0 * np.pi * reach**3, UrdfShape(ShapeKind.SPHERE, np.array([reach]), np.eye(3), centre)),
    )
    return min(shapes, key=lambda item: item[0])[1]


def _capsule(local: FloatArray, along: int) -> tuple[float, float]:
    """Radius and length of the capsule along one axis that holds points around its middle [m]."""
    across = np.linalg.norm(np.delete(local, along, axis=1), axis=1)
    radius = max(float(across.max()), _THINNEST)
    caps = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    return radius, max(2.0 * float((np.abs(local[:, along]) - caps).max()), _THINNEST)


def _number(element: Element, key: str, where: str, default: float | None = None) -> float:
    """Finite number in an attribute, as :func:`_numbers`."""
    return float(_numbers(element, key, where, None if default is None else np.array([default]), 1)[0])


def _numbers(
    element: Element, key: str, where: str, default: FloatArray | None = None, count: int = 3
) -> FloatArray:
    """(count,) finite numbers in an attribute, or their default; ``where`` is for the message."""
    text = element.get(key)
    if text is None and default is not None:
        return default
    try:
        values = np.array((text or "").split(), dtype=np.float64)
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.all(np.isfinite(values)):
        shown = "missing" if text is None else repr(text[:40])
        raise BodyError(f"{where} {key} is {shown}; valid: {count} finite number{'s' if count > 1 else ''}")
    return values


def _placement(origin: Element | None, where: str) -> tuple[FloatArray, FloatArray]:
    """Rotation (3, 3) and translation (3,) [m] of an ``<origin>``; the identity without one."""
    if origin is None:
        return np.eye(3), np.zeros(3)
    roll, pitch, yaw = _numbers(origin, "rpy", f"{where} origin", np.zeros(3))
    place = _numbers(origin, "xyz", f"{where} origin", np.zeros(3))
    if np.abs(place).max() > FARTHEST:
        raise BodyError(f"{where} origin is {place.tolist()}; valid: at most {FARTHEST:g} m away")
    return rotation_from_rpy(roll, pitch, yaw), place


JOINT_KINDS = ("revolute", "continuous", "fixed", "floating")
"""Kinds of joints that are understood; a floating one only between a massless root and the body."""

CONTINUOUS = float(np.pi)
"""A continuous joint gets half a turn either way [rad]."""


@dataclass(frozen=True, eq=False)
class UrdfLink:
    """A link; the inertia (3, 3) is about the centre of mass (3,) [m] in its axes [kg.m^2].

    Without an ``<inertial>`` the mass is 0.
    """

    name: str
    mass: float
    com: FloatArray
    inertia: FloatArray
    shapes: tuple[UrdfShape, ...]


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint of one of :data:`JOINT_KINDS`; its frame is that of the child link.

    Rotation (3, 3) and translation (3,) [m] take the child's frame to the parent's at angle 0; the unit axis
    (3,) is in the child's frame. Angles in rad, torques in N.m, speed in rad/s.
    """

    name: str
    kind: str
    parent: str
    child: str
    rotation: FloatArray
    translation: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    torque_lower: float
    torque_upper: float
    velocity: float


@dataclass(frozen=True, eq=False)
class Urdf:
    """A robot: a tree of links by name, parents first, each branch as a whole.

    Joints are those of each link but the root to its parent, by the link's name.
    """

    name: str
    links: dict[str, UrdfLink]
    joints: dict[str, UrdfJoint]


def read_urdf(path: str | Path) -> Urdf:
    """Read a robot description.

    Args:
        path: The file. Meshes are looked for beside it; ``package://NAME/rest`` is ``rest`` or
            ``NAME/rest`` in its folder or one above.

    Raises:
        BodyError: If the file is missing, no URDF, no tree, or has what is not understood.
    """
    file = Path(path)
    root = parsed_file(file, "robot", "a URDF file")
    where = str(file)
    links = [_link(element, file) for element in root.findall("link")]
    joints = [_joint(element, where) for element in root.findall("joint")]
    if not links:
        raise BodyError(f"{where}: no link; valid: at least one")
    if len(links) > MAX_LINKS:
        raise BodyError(f"{where}: {len(links)} links; valid: at most {MAX_LINKS}")
    check_unique([link.name for link in links], "link", where)
    check_unique([joint.name for joint in joints], "joint", where)
    by_name = {link.name: link for link in links}
    ordered = {name: by_name[name] for name in _order(links, joints, where)}
    return Urdf(root.get("name") or file.stem, ordered, {joint.child: joint for joint in joints})


def parsed_file(file: Path, tag: str, kind: str) -> Element:
    """Root of an XML file, which has to be a ``<tag>``; messages ask for what ``kind`` says."""
    try:
        if file.exists() and not file.is_file():
            raise BodyError(f"{file}: is no regular file; valid: {kind}")
        if (size := file.stat().st_size) > MAX_BYTES:
            raise BodyError(f"{file}: has {size} bytes; valid: at most {MAX_BYTES}")
        root = ElementTree.fromstring(file.read_bytes())
    except OSError as error:
        raise BodyError(f"{file}: {error.strerror or error}; valid: {kind}") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise BodyError(f"{file}: is no XML ({error}); valid: {kind}") from None
    if root.tag != tag:
        raise BodyError(f"{file}: begins with <{root.tag[:40]}>; valid: <{tag}>")
    return root


def _link(element: Element, file: Path) -> UrdfLink:
    name = _name(element, "link", str(file))
    where = f"{file}: link {name!r}"
    inertial = element.find("inertial")
    shapes = tuple(_shape(item, where, file.parent) for item in element.findall("collision"))
    if inertial is None:
        return UrdfLink(name, 0.0, np.zeros(3), np.zeros((3, 3)), shapes)
    turn, com = _placement(inertial.find("origin"), f"{where} inertial")
    mass = _number(_child(inertial, "mass", where), "value", f"{where} mass")
    matrix = _child(inertial, "inertia", where)
    xx, yy, zz, xy, xz, yz = (
        _number(matrix, key, f"{where} inertia") for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not 0.0 <= mass <= HEAVIEST:
        raise BodyError(f"{where} mass is {mass:g}; valid: 0 to {HEAVIEST:g} kg")
    if (largest := np.abs(inertia).max()) > HEAVIEST * FARTHEST**2:
        problem = f"{where} inertia has {largest:.3g}"
        raise BodyError(f"{problem}; valid: at most {HEAVIEST * FARTHEST**2:g} kg.m^2")
    turned = turn @ inertia @ turn.T
    return UrdfLink(name, mass, com, 0.5 * (turned + turned.T), shapes)


def _joint(element: Element, where: str) -> UrdfJoint:
    name = _name(element, "joint", where)
    place = f"{where}: joint {name!r}"
    kind = element.get("type", "")
    if kind not in JOINT_KINDS:
        raise BodyError(f"{place} type is {kind[:40]!r}; valid: {', '.join(JOINT_KINDS)}")
    if element.find("mimic") is not None:
        raise BodyError(f"{place} mimics another one; valid: joints that move on their own")
    rotation, translation = _placement(element.find("origin"), place)
    parent, child = (_child(element, key, place).get("link", "") for key in ("parent", "child"))
    given, x = element.find("axis"), np.array([1.0, 0.0, 0.0])
    axis = x if given is None else _numbers(given, "xyz", f"{place} axis")
    length = float(np.linalg.norm(axis))
    if kind in ("revolute", "continuous") and length < 1e-9:
        raise BodyError(f"{place} axis is {axis.tolist()}; valid: not zero")
    limits = _limits(element, kind, place)
    return UrdfJoint(name, kind, parent, child, rotation, translation, axis / max(length, 1e-9), *limits)


def _limits(element: Element, kind: str, place: str) -> tuple[float, float, float, float, float]:
    """Lower, upper, least and largest torque, velocity."""
    if kind not in ("revolute", "continuous"):
        return 0.0, 0.0, 0.0, 0.0, 0.0
    limit = _child(element, "limit", place)
    place = f"{place} limit"
    effort, velocity = (_number(limit, key, place) for key in ("effort", "velocity"))
    lower, upper = -CONTINUOUS, CONTINUOUS
    if kind == "revolute":
        lower, upper = (_number(limit, key, place, 0.0) for key in ("lower", "upper"))
    if not (lower < upper and effort > 0.0 and velocity > 0.0):
        raise BodyError(
            f"{place} has lower {lower:g}, upper {upper:g}, effort {effort:g}, velocity {velocity:g}; "
            "valid: lower < upper, effort > 0, velocity > 0"
        )
    return lower, upper, -effort, effort, velocity


def _order(links: list[UrdfLink], joints: list[UrdfJoint], where: str) -> list[str]:
    """Names of the links, parents first; refuses what is no tree."""
    names = [link.name for link in links]
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in names:
                raise BodyError(f"{where}: joint {joint.name!r} has link {link!r}; valid: one of {names}")
    check_unique([joint.child for joint in joints], "child link", where)
    roots = [name for name in names if name not in {joint.child for joint in joints}]
    if len(roots) != 1:
        raise BodyError(f"{where}: links without parent are {roots}; valid: exactly one, the root")
    order, waiting = [], roots
    while waiting:  # depth first, as MuJoCo counts
        order.append(waiting.pop())
        waiting += [joint.child for joint in reversed(joints) if joint.parent == order[-1]]
    if len(order) != len(names):
        lost = sorted(set(names) - set(order))
        raise BodyError(f"{where}: link {lost[0]!r} hangs on itself; valid: a tree")
    return order


def check_unique(names: list[str], kind: str, where: str) -> None:
    """Refuse names that occur twice."""
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BodyError(f"{where}: {kind} {twice[0]!r} occurs twice; valid: once")


def _name(element: Element, kind: str, where: str) -> str:
    name = element.get("name", "")
    if not name:
        raise BodyError(f"{where}: a {kind} has no name; valid: a name")
    return name


def _child(element: Element, tag: str, where: str) -> Element:
    child = element.find(tag)
    if child is None:
        raise BodyError(f"{where} has no <{tag}>; valid: one")
    return child
