"""Neutral description of a body: segments, hinges, shapes, effectors and limbs.

Every engine model (Pinocchio, Coal, MuJoCo) is built from these values and from nothing else. In the zero
posture all segment frames are parallel to the world: x forward, y to the left, z up.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum

import numpy as np
import trimesh
from numpy.typing import ArrayLike

from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, check_rotation, finite_number, frozen_array

SIDES = ("left", "right")
FEET, HANDS = ("left_foot", "right_foot"), ("left_hand", "right_hand")
"""Sides of a human, and its effectors by them."""


class ShapeKind(StrEnum):
    """Kinds of collision shape and what their ``size`` holds [m]."""

    SPHERE = "sphere"
    """``(radius,)``."""
    CAPSULE = "capsule"
    """``(radius, length)``: a cylinder of ``length`` along the local z axis, a half sphere on each end."""
    BOX = "box"
    """``(x, y, z)`` full extents."""


_SIZE_COUNT = {ShapeKind.SPHERE: 1, ShapeKind.CAPSULE: 2, ShapeKind.BOX: 3}


@dataclass(frozen=True, eq=False)
class Shape:
    """A collision shape fixed to a segment.

    Attributes:
        name: Unique within its segment.
        kind: Sphere, capsule or box.
        size: (1,), (2,) or (3,) dimensions [m], see :class:`ShapeKind`.
        translation: (3,) centre of the shape in the segment frame [m].
        rotation: (3, 3) from the shape's axes to the segment's.
    """

    name: str
    kind: ShapeKind
    size: FloatArray
    translation: FloatArray
    rotation: FloatArray

    def __init__(
        self, name: str, kind: ShapeKind | str, size: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0),
        rotation: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        where = f"shape {name!r}"
        if kind not in list(ShapeKind):
            raise BodyError(f"{where} kind is {kind!r}; valid: {', '.join(ShapeKind)}")
        shape_kind = ShapeKind(kind)
        dimensions = frozen_array(size, f"{where} size [m]", (_SIZE_COUNT[shape_kind],), BodyError)
        if np.any(dimensions <= 0.0):
            raise BodyError(f"{where} size is {dimensions.tolist()}; valid: metres > 0")
        centre = frozen_array(translation, f"{where} translation", (3,), BodyError)
        turn = check_rotation(np.eye(3) if rotation is None else rotation, f"{where} rotation", BodyError)
        for item, value in zip(fields(self), (name, shape_kind, dimensions, centre, turn), strict=True):
            object.__setattr__(self, item.name, value)

    def distance_to(self, point: FloatArray) -> float:
        """Distance of a point (3,) of the segment frame to the shape, 0 inside [m]."""
        away = self.rotation.T @ (point - self.translation)
        if self.kind is ShapeKind.BOX:
            return float(np.linalg.norm(np.maximum(np.abs(away) - 0.5 * self.size, 0.0)))
        if self.kind is ShapeKind.CAPSULE:
            away[2] -= np.clip(away[2], -0.5 * self.size[1], 0.5 * self.size[1])
        return max(0.0, float(np.linalg.norm(away)) - float(self.size[0]))


@dataclass(frozen=True, eq=False)
class Hinge:
    """One revolute degree of freedom between a segment and its parent.

    Attributes:
        name: Unique in the body.
        axis: (3,) unit axis in the segment frame; a positive angle turns right-handed about it.
        lower: Smallest angle [rad].
        upper: Largest angle [rad].
        velocity_limit: Largest speed in either direction [rad/s].
        torque_lower: Most negative torque, < 0 [N.m].
        torque_upper: Largest torque, > 0 [N.m].
    """

    name: str
    axis: FloatArray
    lower: float
    upper: float
    velocity_limit: float
    torque_lower: float
    torque_upper: float

    def __post_init__(self) -> None:
        where = f"hinge {self.name!r}"
        axis = frozen_array(self.axis, f"{where} axis", (3,), BodyError)
        length = float(np.linalg.norm(axis))
        if length < 1e-9:
            raise BodyError(f"{where} axis is {axis.tolist()}; valid: a direction that is not zero")
        object.__setattr__(self, "axis", frozen_array(axis / length, "axis"))
        lower = finite_number(self.lower, f"{where} lower [rad]", error=BodyError)
        finite_number(self.upper, f"{where} upper [rad]", above=lower, error=BodyError)
        finite_number(self.velocity_limit, f"{where} velocity_limit [rad/s]", above=0.0, error=BodyError)
        finite_number(-self.torque_lower, f"{where} negated torque_lower [N.m]", above=0.0, error=BodyError)
        finite_number(self.torque_upper, f"{where} torque_upper [N.m]", above=0.0, error=BodyError)


@dataclass(frozen=True, eq=False)
class Segment:
    """A rigid segment, the hinges to its parent and its inertia.

    The hinges share the segment's origin and are applied in order, from the parent on. A segment without
    hinges is rigid on its parent; the root has no parent and moves freely.

    Attributes:
        name: Unique in the body.
        parent: Name of the parent, or None for the root.
        origin: (3,) origin in the parent's frame [m].
        hinges: Zero to three hinges.
        mass: [kg], > 0.
        com: (3,) centre of mass in the segment frame [m].
        inertia: (3, 3) rotational inertia about the centre of mass, segment axes [kg.m^2].
        shapes: Collision shapes.
    """

    name: str
    parent: str | None
    origin: FloatArray
    hinges: tuple[Hinge, ...]
    mass: float
    com: FloatArray
    inertia: FloatArray
    shapes: tuple[Shape, ...] = ()

    def __post_init__(self) -> None:
        where = f"segment {self.name!r}"
        finite_number(self.mass, f"{where} mass [kg]", above=0.0, error=BodyError)
        for name, shape in (("origin", (3,)), ("com", (3,)), ("inertia", (3, 3))):
            value = frozen_array(getattr(self, name), f"{where} {name}", shape, BodyError)
            object.__setattr__(self, name, value)
        inertia = self.inertia
        symmetric = np.abs(inertia - inertia.T).max() <= 1e-12 * np.abs(inertia).max()
        moments = np.sort(np.linalg.eigvalsh(inertia))
        if not symmetric or moments[0] <= 0.0 or moments[0] + moments[1] < moments[2] * (1.0 - 1e-9):
            raise BodyError(
                f"{where} inertia has principal moments {moments.tolist()}; "
                "valid: symmetric, positive, none larger than the sum of the other two"
            )


@dataclass(frozen=True, eq=False)
class Effector:
    """A named frame fixed to a segment, to be placed by tasks and contacts.

    Attributes:
        name: Unique among effectors.
        segment: Name of the segment that carries it.
        translation: (3,) origin in the segment frame [m].
        rotation: (3, 3) rotation from the effector's axes to the segment's.
    """

    name: str
    segment: str
    translation: FloatArray
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        where = f"effector {self.name!r}"
        place = frozen_array(self.translation, f"{where} translation", (3,), BodyError)
        object.__setattr__(self, "translation", place)
        object.__setattr__(self, "rotation", check_rotation(self.rotation, f"{where} rotation", BodyError))


@dataclass(frozen=True)
class Limb:
    """A chain of segments that ends in an effector made for contact ([Tonneau2015]_ 4.3.1).

    Its joints are those of its segments, in order; its frame has the origin of its first segment and the axes
    of that segment's parent. The effector's z axis is the normal of the contact, from the scene into the
    body. A contact of the trunk, as of a pelvis on a seat, is a limb without joints: its one segment is the
    root, whose frame is the limb's own.

    Attributes:
        name: Unique among the limbs.
        effector: Name of the effector.
        segments: Names from the limb's root segment to the effector's own, each the parent of the next.
        kind: How the effector touches when nothing else is said.
        mirror: Name of the limb that is its reflection in the sagittal plane, or None.
        patch: Length and width of the flat rectangle with which it touches as a sole does [m]; None where
            that is a sole of the body's size.
    """

    name: str
    effector: str
    segments: tuple[str, ...]
    kind: ContactKind
    mirror: str | None = None
    patch: tuple[float, float] | None = None


def check_limbs(
    limbs: tuple[Limb, ...], segments: Mapping[str, Segment], effectors: Mapping[str, Effector]
) -> None:
    """Raise a BodyError for limbs that are no chains, lack hinges, or name what does not exist."""
    names = [limb.name for limb in limbs]
    _check_unique(names, "limb")
    for limb in limbs:
        _check_chain(limb, segments)
        if limb.effector not in effectors or effectors[limb.effector].segment != limb.segments[-1]:
            valid = [name for name, item in effectors.items() if item.segment == limb.segments[-1]]
            raise BodyError(f"limb {limb.name!r} effector is {limb.effector!r}; valid: one of {valid}")
        if limb.mirror is not None and limb.mirror not in names:
            raise BodyError(f"limb {limb.name!r} mirror is {limb.mirror!r}; valid: one of {names}")


def _check_unique(names: list[str], kind: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BodyError(f"{kind} {twice[0]!r} occurs twice; valid: unique names")


def _check_chain(limb: Limb, segments: Mapping[str, Segment]) -> None:
    unknown = [name for name in limb.segments if name not in segments]
    if not limb.segments or unknown:
        wrong = repr(unknown[0]) if unknown else "none"
        raise BodyError(f"limb {limb.name!r} has segment {wrong}; valid: one of {list(segments)}")
    if limb.patch is not None and not all(np.isfinite(side) and side > 0.0 for side in limb.patch):
        raise BodyError(f"limb {limb.name!r} patch is {limb.patch} m; valid: a length and a width above 0")
    if len(limb.segments) == 1 and segments[limb.segments[0]].parent is None:
        return  # on the trunk, which no joint moves
    for parent, child in zip((None, *limb.segments), limb.segments, strict=False):
        actual = segments[child].parent
        if actual is None or parent not in (None, actual):
            raise BodyError(
                f"limb {limb.name!r} goes from {parent!r} to {child!r}, whose parent is {actual!r}; "
                "valid: segments that follow each other, the root not among them, or the root alone"
            )
    if not any(segments[name].hinges for name in limb.segments):
        raise BodyError(f"limb {limb.name!r} has no hinge; valid: at least one")


def end_of(segment: Segment) -> FloatArray:
    """(3,) end of a last segment in its frame [m]: twice its centre of mass, of a head straight above."""
    end = 2.0 * segment.com
    return end * [0.0, 0.0, 1.0] if segment.name == "head" else end


def segments_by_name(segments: tuple[Segment, ...]) -> Mapping[str, Segment]:
    """Segments by name; BodyError unless they form one tree with unique names, parents first."""
    index: dict[str, Segment] = {}
    for number, segment in enumerate(segments):
        if segment.name in index:
            raise BodyError(f"segment {segment.name!r} occurs twice; valid: unique names")
        if (segment.parent is None) != (number == 0):
            raise BodyError(f"segment {segment.name!r} is root {number}; valid: one root, listed first")
        if segment.parent is not None and segment.parent not in index:
            raise BodyError(
                f"segment {segment.name!r} has parent {segment.parent!r}; "
                f"valid: an earlier one of {list(index)}"
            )
        index[segment.name] = segment
    if not index:
        raise BodyError("body has no segments; valid: at least a root")
    _check_unique([hinge.name for segment in segments for hinge in segment.hinges], "hinge")
    return index


def segment_triangles(segment: Segment, rounds: int = 24) -> tuple[FloatArray, np.ndarray] | None:
    """Vertices (n, 3) [m] and faces (m, 3) of all shapes, capsules of ``rounds`` corners around, or None."""
    parts = [_mesh(shape, rounds) for shape in segment.shapes]
    if not parts:
        return None
    whole = trimesh.util.concatenate(parts)
    return np.asarray(whole.vertices), np.asarray(whole.faces)


def _mesh(shape: Shape, rounds: int) -> trimesh.Trimesh:
    if shape.kind is ShapeKind.BOX:
        mesh = trimesh.creation.box(shape.size)
    elif shape.kind is ShapeKind.SPHERE:
        mesh = trimesh.creation.icosphere(subdivisions=3 if rounds > 16 else 2, radius=float(shape.size[0]))
    else:
        radius, length = (float(value) for value in shape.size)
        mesh = trimesh.creation.capsule(height=length, radius=radius, count=[rounds, rounds])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))  # trimesh does not centre it
    placement = np.eye(4)
    placement[:3, :3], placement[:3, 3] = shape.rotation, shape.translation
    return mesh.apply_transform(placement)
