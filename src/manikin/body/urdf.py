"""Robot description files (URDF) as plain values, checked."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from manikin.body.urdf_shapes import UrdfShape, read_shapes
from manikin.body.xml_values import number, placement, vector
from manikin.errors import BodyError
from manikin.spatial import FloatArray

JOINT_KINDS = ("revolute", "continuous", "fixed", "floating")
"""Kinds of joints that are understood; a floating one only between a massless root and the body."""

CONTINUOUS = float(np.pi)
"""A continuous joint gets half a turn either way [rad]."""


@dataclass(frozen=True, eq=False)
class UrdfLink:
    """A link.

    Attributes:
        name: Unique.
        mass: [kg], 0 without an ``<inertial>``.
        com: (3,) in the link's frame [m].
        inertia: (3, 3) about the centre of mass, in the link's axes [kg.m^2].
        shapes: What collides.
    """

    name: str
    mass: float
    com: FloatArray
    inertia: FloatArray
    shapes: tuple[UrdfShape, ...]


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint; its frame is that of the child link.

    Attributes:
        name: Unique.
        kind: One of :data:`JOINT_KINDS`.
        parent: Name of a link.
        child: Name of a link.
        rotation: (3, 3) from the child's axes to the parent's at angle 0.
        translation: (3,) of the child's origin in the parent's frame [m].
        axis: (3,) unit axis in the child's frame.
        lower: Smallest angle [rad].
        upper: Largest angle [rad].
        effort: Largest torque [N.m].
        velocity: Largest speed [rad/s].
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
    effort: float
    velocity: float


@dataclass(frozen=True, eq=False)
class Urdf:
    """A robot: a tree of links.

    Attributes:
        name: Of the robot.
        links: By name, parents first, each branch as a whole.
        joints: The joint to its parent of each link but the root, by the link's name.
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
    root = _parsed(file)
    where = str(file)
    links = [_link(element, file) for element in root.findall("link")]
    joints = [_joint(element, where) for element in root.findall("joint")]
    if not links:
        raise BodyError(f"{where}: no link; valid: at least one")
    _check_unique([link.name for link in links], "link", where)
    _check_unique([joint.name for joint in joints], "joint", where)
    order = _order(links, joints, where)
    by_name = {link.name: link for link in links}
    name = root.get("name") or file.stem
    return Urdf(name, {n: by_name[n] for n in order}, {joint.child: joint for joint in joints})


def _parsed(file: Path) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(file.read_bytes())
    except OSError as error:
        raise BodyError(f"{file}: {error.strerror or error}; valid: a URDF file") from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise BodyError(f"{file}: is no XML ({error}); valid: a URDF file") from None
    if root.tag != "robot":
        raise BodyError(f"{file}: begins with <{root.tag[:40]}>; valid: <robot>")
    return root


def _link(element: ElementTree.Element, file: Path) -> UrdfLink:
    name = _name(element, "link", str(file))
    where = f"{file}: link {name!r}"
    inertial = element.find("inertial")
    shapes = read_shapes(element, where, file.parent)
    if inertial is None:
        return UrdfLink(name, 0.0, np.zeros(3), np.zeros((3, 3)), shapes)
    turn, com = placement(inertial.find("origin"), f"{where} inertial")
    mass = number(_child(inertial, "mass", where), "value", f"{where} mass")
    matrix = _child(inertial, "inertia", where)
    xx, yy, zz, xy, xz, yz = (
        number(matrix, key, f"{where} inertia") for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass < 0.0:
        raise BodyError(f"{where} mass is {mass:g}; valid: >= 0")
    turned = turn @ inertia @ turn.T
    return UrdfLink(name, mass, com, 0.5 * (turned + turned.T), shapes)


def _joint(element: ElementTree.Element, where: str) -> UrdfJoint:
    name = _name(element, "joint", where)
    place = f"{where}: joint {name!r}"
    kind = element.get("type", "")
    if kind not in JOINT_KINDS:
        raise BodyError(f"{place} type is {kind[:40]!r}; valid: {', '.join(JOINT_KINDS)}")
    if element.find("mimic") is not None:
        raise BodyError(f"{place} mimics another one; valid: joints that move on their own")
    rotation, translation = placement(element.find("origin"), place)
    parent, child = (_child(element, key, place).get("link", "") for key in ("parent", "child"))
    axis_element = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if axis_element is None else vector(axis_element, "xyz", f"{place} axis")
    length = float(np.linalg.norm(axis))
    if kind in ("revolute", "continuous") and length < 1e-9:
        raise BodyError(f"{place} axis is {axis.tolist()}; valid: not zero")
    limits = _limits(element, kind, place)
    return UrdfJoint(name, kind, parent, child, rotation, translation, axis / max(length, 1e-9), *limits)


def _limits(element: ElementTree.Element, kind: str, place: str) -> tuple[float, float, float, float]:
    """Lower, upper, effort, velocity."""
    if kind not in ("revolute", "continuous"):
        return 0.0, 0.0, 0.0, 0.0
    limit = _child(element, "limit", place)
    place = f"{place} limit"
    effort, velocity = (number(limit, key, place) for key in ("effort", "velocity"))
    lower, upper = (
        (-CONTINUOUS, CONTINUOUS)
        if kind == "continuous"
        else (number(limit, key, place, 0.0) for key in ("lower", "upper"))
    )
    if not (lower < upper and effort > 0.0 and velocity > 0.0):
        raise BodyError(
            f"{place} has lower {lower:g}, upper {upper:g}, effort {effort:g}, velocity {velocity:g}; "
            "valid: lower < upper, effort > 0, velocity > 0"
        )
    return lower, upper, effort, velocity


def _order(links: list[UrdfLink], joints: list[UrdfJoint], where: str) -> list[str]:
    """Names of the links, parents first; refuses what is no tree."""
    names = [link.name for link in links]
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in names:
                raise BodyError(f"{where}: joint {joint.name!r} has link {link!r}; valid: one of {names}")
    _check_unique([joint.child for joint in joints], "child link", where)
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


def _check_unique(names: list[str], kind: str, where: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BodyError(f"{where}: {kind} {twice[0]!r} occurs twice; valid: once")


def _name(element: ElementTree.Element, kind: str, where: str) -> str:
    name = element.get("name", "")
    if not name:
        raise BodyError(f"{where}: a {kind} has no name; valid: a name")
    return name


def _child(element: ElementTree.Element, tag: str, where: str) -> ElementTree.Element:
    found = element.find(tag)
    if found is None:
        raise BodyError(f"{where} has no <{tag}>; valid: one")
    return found
