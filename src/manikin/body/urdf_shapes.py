"""What collides in a robot description, as spheres, capsules and boxes.

A cylinder becomes the capsule of its radius and length, rounded at the ends, or a box where it is shorter
than wide. A mesh becomes the smallest of a box, a capsule and a sphere that hold it.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import trimesh

from manikin.body.segments import ShapeKind
from manikin.body.xml_values import number, placement, vector
from manikin.errors import BodyError
from manikin.spatial import FloatArray

_THINNEST = 1e-4
"""Least side of a box around a mesh [m]."""


@dataclass(frozen=True, eq=False)
class UrdfShape:
    """A collision shape in the frame of its link.

    Attributes:
        kind: Sphere, capsule or box.
        size: (1,), (2,) or (3,) as in :class:`manikin.body.ShapeKind` [m].
        rotation: (3, 3) from the shape's axes to the link's.
        translation: (3,) of its centre [m].
    """

    kind: ShapeKind
    size: FloatArray
    rotation: FloatArray
    translation: FloatArray


def read_shapes(link: Element, where: str, folder: Path) -> tuple[UrdfShape, ...]:
    """Shapes of a ``<link>``; what is only visual is left out.

    Args:
        link: The element.
        where: For messages.
        folder: Where its file is.

    Raises:
        BodyError: If a shape is not understood, not positive, or its mesh cannot be read.
    """
    return tuple(_shape(element, where, folder) for element in link.findall("collision"))


def _shape(element: Element, link: str, folder: Path) -> UrdfShape:
    where = f"{link} collision"
    rotation, translation = placement(element.find("origin"), where)
    geometry = element.find("geometry")
    found = [] if geometry is None else list(geometry)
    if len(found) != 1 or found[0].tag not in ("box", "sphere", "cylinder", "capsule", "mesh"):
        tags = [item.tag[:40] for item in found]
        raise BodyError(f"{where} has geometry {tags}; valid: box, sphere, cylinder, capsule or mesh")
    kind, size, turn, centre = _primitive(found[0], where, folder)
    if np.any(size <= 0.0):
        raise BodyError(f"{where} size is {size.tolist()}; valid: metres > 0")
    return UrdfShape(kind, size, rotation @ turn, translation + rotation @ centre)


_Primitive = tuple[ShapeKind, FloatArray, FloatArray, FloatArray]


def _primitive(item: Element, where: str, folder: Path) -> _Primitive:
    """Kind, size, rotation and centre in the frame of the geometry."""
    if item.tag == "mesh":
        return _of_mesh(item, where, folder)
    if item.tag == "box":
        return ShapeKind.BOX, vector(item, "size", f"{where} box"), np.eye(3), np.zeros(3)
    radius = number(item, "radius", f"{where} {item.tag}")
    if item.tag == "sphere":
        return ShapeKind.SPHERE, np.array([radius]), np.eye(3), np.zeros(3)
    length = number(item, "length", f"{where} {item.tag}")
    if item.tag == "capsule":
        return ShapeKind.CAPSULE, np.array([radius, length]), np.eye(3), np.zeros(3)
    if length > 2.0 * radius:
        return ShapeKind.CAPSULE, np.array([radius, length - 2.0 * radius]), np.eye(3), np.zeros(3)
    return ShapeKind.BOX, np.array([2.0 * radius, 2.0 * radius, length]), np.eye(3), np.zeros(3)


def _of_mesh(item: Element, where: str, folder: Path) -> _Primitive:
    """The shape around a mesh file."""
    name = item.get("filename", "")
    scale = vector(item, "scale", f"{where} mesh", np.ones(3))
    file = _mesh_file(name, folder)
    if file is None:
        raise BodyError(f"{where} mesh {name[:200]!r} is not found from {folder}; valid: a mesh file")
    try:
        return _around_file(file, file.stat().st_mtime_ns, tuple(scale.tolist()))
    except BodyError as error:
        raise BodyError(f"{where} {error}") from None


@lru_cache(maxsize=64)
def _around_file(file: Path, stamp: int, scale: tuple[float, ...]) -> _Primitive:  # noqa: ARG001
    """The shape around a file as it was at a time; limbs often have one mesh in common."""
    try:
        points = np.asarray(trimesh.load(file, force="mesh").vertices, dtype=np.float64)
    except Exception as error:  # the readers of each format raise what they like
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise BodyError(f"mesh '{file}' cannot be read ({reason}); valid: a mesh") from None
    if len(points) < 4 or not np.all(np.isfinite(points)):
        raise BodyError(f"mesh '{file}' has {len(points)} vertices; valid: at least 4 finite ones")
    return _around(points * np.array(scale))


def _mesh_file(name: str, folder: Path) -> Path | None:
    if not name:
        return None
    plain = name.removeprefix("file://")
    if not name.startswith("package://"):
        found = folder / plain
        return found if found.is_file() else None
    inside = name.removeprefix("package://")
    rest = inside.partition("/")[2]
    tried = [base / part for base in (folder, *folder.resolve().parents[:3]) for part in (inside, rest)]
    return next((file for file in tried if file.is_file()), None)


def _around(points: FloatArray) -> _Primitive:
    """Smallest of the box, capsule and sphere around points."""
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
    volumes = {
        ShapeKind.BOX: float(np.prod(extents)),
        ShapeKind.CAPSULE: np.pi * radius**2 * (length + 4.0 / 3.0 * radius),
        ShapeKind.SPHERE: 4.0 / 3.0 * np.pi * reach**3,
    }
    kind = min(volumes, key=lambda item: volumes[item])
    if kind is ShapeKind.BOX:
        return kind, extents, turn, centre
    if kind is ShapeKind.SPHERE:
        return kind, np.array([reach]), np.eye(3), centre
    upright = np.roll(np.eye(3), along - 2, axis=0)
    return kind, np.array([radius, length]), turn @ upright, centre


def _capsule(local: FloatArray, along: int) -> tuple[float, float]:
    """Radius and length of the capsule along one axis that holds points around its middle [m]."""
    across = np.linalg.norm(np.delete(local, along, axis=1), axis=1)
    radius = max(float(across.max()), _THINNEST)
    caps = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    return radius, max(2.0 * float((np.abs(local[:, along]) - caps).max()), _THINNEST)
