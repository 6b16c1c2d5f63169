"""Creatures of any shape from robot descriptions, with limbs that are named ([Tonneau2015]_ 4.3.1).

A robot description has no limbs; the caller names where they end. Its frames may be turned any way; ours are
all parallel to the root's in the zero posture. Links on fixed joints become part of what they are fixed to. A
chain of massless links at one point becomes one segment with several hinges.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body.configuration import Configuration
from manikin.body.limbs import are_mirrored
from manikin.body.mjcf import read_mjcf
from manikin.body.model import BodyModel
from manikin.body.segments import Effector, Hinge, Limb, Segment, Shape
from manikin.body.urdf import Urdf, UrdfJoint, read_urdf
from manikin.contact import ContactKind
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array, rotation_from_normal, skew

_MOST_HINGES = 3


@dataclass(frozen=True)
class LimbSpec:
    """End of a limb of a robot, and its kind of contact.

    Attributes:
        tip: Link that touches; the effector gets its name.
        root: First link of the limb; None for the one that is carried by the body's root.
        contact: ``"point"``, ``"sole"`` or ``"grasp"``.
        position: (3,) where it touches, in the link's frame [m].
        normal: (3,) normal of the contact, from the scene into the body, in the link's frame; None for
            straight up in the standing posture.
    """

    tip: str
    root: str | None = None
    contact: str = "point"
    position: ArrayLike = (0.0, 0.0, 0.0)
    normal: ArrayLike | None = None


def creature_from_urdf(
    path: str | Path,
    limbs: Mapping[str, LimbSpec | Mapping[str, Any]],
    *,
    standing: Mapping[str, float] | None = None,
    sole_length: float | None = None,
    sole_width: float | None = None,
) -> BodyModel:
    """Make a body from a URDF file.

    The root floats; massless links above it, such as a world, are left out. Revolute joints become hinges of
    their limits, continuous ones with half a turn either way; prismatic, planar and mimicking joints are
    refused. Spheres, capsules and boxes stand for all shapes, see :mod:`manikin.body.urdf`. Segments that
    overlap in the zero or the standing posture are not checked against each other. Limbs that are reflections
    of each other are found.

    Args:
        limbs: Limbs by name; mappings have the keys of :class:`LimbSpec`.
        standing: Joint angles of the standing posture [rad]; others are 0, or the nearer limit.
        sole_length: Length of the soles [m], of limbs that touch with one.
        sole_width: Width of the soles [m].

    Raises:
        BodyError: If the file or a limb is not usable.
    """
    return _creature(read_urdf(path), str(path), limbs, standing, sole_length, sole_width)


JOINT_SPEED = 10.0
"""Velocity limit of joints whose description has none [rad/s]; those of legged robots have 10 to 30."""


def creature_from_mjcf(
    path: str | Path,
    limbs: Mapping[str, LimbSpec | Mapping[str, Any]],
    *,
    standing: Mapping[str, float] | None = None,
    sole_length: float | None = None,
    sole_width: float | None = None,
    joint_speed: float = JOINT_SPEED,
) -> BodyModel:
    """Make a body from the robot of an MJCF file, as :func:`creature_from_urdf` does from URDF.

    Bodies are what links are there. The root floats whether or not it has a free joint. Balls, slides and
    equalities are refused; see :func:`manikin.body.mjcf.read_mjcf` for what is left out.

    Args:
        limbs: Limbs by name; mappings have the keys of :class:`LimbSpec`.
        standing: Joint angles of the standing posture [rad]; others are 0, or the nearer limit.
        sole_length: Length of the soles [m], of limbs that touch with one.
        sole_width: Width of the soles [m].
        joint_speed: Velocity limit of all joints, of which MJCF has none [rad/s].

    Raises:
        BodyError: If the file or a limb is not usable.
    """
    speed = finite_number(joint_speed, "joint speed [rad/s]", above=0.0, error=BodyError)
    return _creature(read_mjcf(path, speed), str(path), limbs, standing, sole_length, sole_width)


def _creature(
    description: Urdf, path: str, limbs: Mapping[str, LimbSpec | Mapping[str, Any]],
    standing: Mapping[str, float] | None, sole_length: float | None, sole_width: float | None,
) -> BodyModel:  # fmt: skip
    robot = _without_empty_root(description, path)
    tree = _SegmentTree(robot, path)
    specs = {name: _spec(name, value, path) for name, value in limbs.items()}
    _check_soles(specs, sole_length, sole_width)
    effectors = {spec.tip: tree.effector(name, spec) for name, spec in specs.items()}
    if len(effectors) != len(specs):
        raise BodyError(f"{path}: two limbs have the same tip; valid: one limb per link")
    angles = _standing(tree.segments, standing or {})
    chains = tuple(tree.limb(name, spec) for name, spec in specs.items())
    body = BodyModel(
        robot.name, tree.segments, effectors, angles, sole_length=sole_length, sole_width=sole_width,
        limbs=chains,
    )  # fmt: skip
    upright = [spec.tip for spec in specs.values() if spec.normal is None]
    return _with_soft_pairs(_with_mirrors(_with_upright(body, upright)))


def _spec(name: str, value: LimbSpec | Mapping[str, Any], where: str) -> LimbSpec:
    if isinstance(value, LimbSpec):
        return value
    valid = [item.name for item in fields(LimbSpec)]
    unknown = [key for key in value if key not in valid]
    if unknown or "tip" not in value:
        wrong = f"key {unknown[0]!r}" if unknown else "no tip"
        raise BodyError(f"{where}: limb {name!r} has {wrong}; valid: {', '.join(valid)}")
    return LimbSpec(**value)


def _check_soles(specs: Mapping[str, LimbSpec], length: float | None, width: float | None) -> None:
    for name, spec in specs.items():
        if spec.contact not in list(ContactKind):
            raise BodyError(f"limb {name!r} contact is {spec.contact!r}; valid: {', '.join(ContactKind)}")
        if spec.contact == ContactKind.SOLE and (length is None or width is None):
            raise BodyError(f"limb {name!r} touches with a sole; valid: sole_length and sole_width [m]")


def _without_empty_root(robot: Urdf, where: str) -> Urdf:
    """The robot without massless roots, such as the world, that carry one link fixed or floating."""
    while True:
        root = next(iter(robot.links))
        below = [joint for joint in robot.joints.values() if joint.parent == root]
        empty = not robot.links[root].mass and not robot.links[root].shapes
        if not (empty and len(below) == 1 and below[0].kind in ("fixed", "floating")):
            break
        robot = Urdf(
            robot.name,
            {name: link for name, link in robot.links.items() if name != root},
            {name: joint for name, joint in robot.joints.items() if name != below[0].child},
        )
    floating = [joint.name for joint in robot.joints.values() if joint.kind == "floating"]
    if floating:
        raise BodyError(f"{where}: joint {floating[0]!r} floats; valid: only below a massless root")
    return robot


class _Member(NamedTuple):
    """A link's segment, its rotation (3, 3) and place (3,) [m] in the root's frame, in the zero posture."""

    segment: str
    rotation: FloatArray
    place: FloatArray


class _SegmentTree:
    """Segments of a robot, and where its links went."""

    def __init__(self, robot: Urdf, where: str) -> None:
        self.robot, self.where = robot, where
        self.members: dict[str, _Member] = {}
        for name in robot.links:
            self.members[name] = self._member(name)
        heads = [name for name, member in self.members.items() if member.segment == name]
        hinges = {name: self._hinges(name) for name in heads}
        above = {name: joint.parent for name, joint in robot.joints.items()}
        parents = {name: self.members[above[name]].segment if name in above else None for name in heads}
        self._fold(hinges, parents)
        self.folded = {name for name in heads if name not in hinges}
        self.segments = tuple(self._segment(name, parents[name], hinges[name]) for name in hinges)

    def _member(self, name: str) -> _Member:
        joint = self.robot.joints.get(name)
        if joint is None:
            return _Member(name, np.eye(3), np.zeros(3))
        above = self.members[joint.parent]
        segment = above.segment if joint.kind == "fixed" else name
        place = above.place + above.rotation @ joint.translation
        return _Member(segment, above.rotation @ joint.rotation, place)

    def _hinges(self, name: str) -> tuple[Hinge, ...]:
        joint: UrdfJoint | None = self.robot.joints.get(name)
        if joint is None:
            return ()
        axis, torques = (
            _tidy(self.members[name].rotation @ joint.axis),
            (joint.torque_lower, joint.torque_upper),
        )
        return (Hinge(joint.name, axis, joint.lower, joint.upper, joint.velocity, *torques),)

    def _fold(self, hinges: dict[str, tuple[Hinge, ...]], parents: dict[str, str | None]) -> None:
        """Give the hinges of massless segments to their only child at the same place."""
        for name in list(hinges):
            parent = parents[name]
            if parent is None or parents[parent] is None:
                continue
            links = [self.robot.links[link] for link in self._links(parent)]
            if any(link.mass or link.shapes for link in links):
                continue
            only = [child for child in hinges if parents[child] == parent] == [name]
            if only and np.allclose(self._origin(name, parent), 0.0, rtol=0.0, atol=1e-12):
                joined = hinges[parent] + hinges[name]
                if len(joined) <= _MOST_HINGES:
                    hinges[name], parents[name] = joined, parents[parent]
                    del hinges[parent]

    def _links(self, segment: str) -> list[str]:
        return [name for name, member in self.members.items() if member.segment == segment]

    def _origin(self, name: str, parent: str | None) -> FloatArray:
        return np.zeros(3) if parent is None else _tidy(self.members[name].place - self.members[parent].place)

    def _segment(self, name: str, parent: str | None, hinges: tuple[Hinge, ...]) -> Segment:
        origin, shapes = self._origin(name, parent), tuple(self._shapes(name))
        return Segment(name, parent, origin, hinges, *self._inertia(name), shapes)

    def _inertia(self, segment: str) -> tuple[float, FloatArray, FloatArray]:
        """Mass, centre and inertia about it of all links of a segment, in its frame."""
        origin = self.members[segment].place
        parts = []
        for name in self._links(segment):
            link, member = self.robot.links[name], self.members[name]
            com = member.place - origin + member.rotation @ link.com
            parts.append((link.mass, com, member.rotation @ link.inertia @ member.rotation.T))
        mass = float(sum(part[0] for part in parts))
        if not mass > 0.0:
            raise BodyError(
                f"{self.where}: link {segment!r} moves and has no mass; valid: an <inertial>, or another "
                "joint at the same place below it"
            )
        com = sum((part[0] * part[1] for part in parts), np.zeros(3)) / mass
        total = np.zeros((3, 3))
        for part_mass, place, moments in parts:
            arm = skew(place - com)
            total += moments - part_mass * arm @ arm
        return mass, com, 0.5 * (total + total.T)

    def _shapes(self, segment: str) -> list[Shape]:
        origin = self.members[segment].place
        return [
            Shape(
                f"{name}_{number}", shape.kind, shape.size,
                member.place - origin + member.rotation @ shape.translation,
                _orthonormal(member.rotation @ shape.rotation),
            )
            for name in self._links(segment)
            for member in (self.members[name],)
            for number, shape in enumerate(self.robot.links[name].shapes)
        ]  # fmt: skip

    def _link(self, limb: str, name: str, what: str) -> _Member:
        if name not in self.members or self.members[name].segment in self.folded:
            valid = [link for link, member in self.members.items() if member.segment not in self.folded]
            raise BodyError(f"{self.where}: limb {limb!r} {what} is {name!r}; valid: one of {valid}")
        return self.members[name]

    def effector(self, limb: str, spec: LimbSpec) -> Effector:
        """The end of a limb as a frame on its segment."""
        member = self._link(limb, spec.tip, "tip")
        place = frozen_array(spec.position, f"limb {limb!r} position [m]", (3,), BodyError)
        turn = np.eye(3)
        if spec.normal is not None:
            normal = frozen_array(spec.normal, f"limb {limb!r} normal", (3,), BodyError)
            if np.linalg.norm(normal) < 1e-9:
                raise BodyError(f"limb {limb!r} normal is zero; valid: a direction")
            turn = rotation_from_normal(_tidy(member.rotation @ normal))
        offset = member.place - self.members[member.segment].place + member.rotation @ place
        return Effector(spec.tip, member.segment, _tidy(offset), turn)

    def limb(self, name: str, spec: LimbSpec) -> Limb:
        """The chain of segments from the limb's root to its tip."""
        parents = {segment.name: segment.parent for segment in self.segments}
        first = None if spec.root is None else self._link(name, spec.root, "root").segment
        chain = [self._link(name, spec.tip, "tip").segment]
        while chain[-1] != first and parents[chain[-1]] is not None:
            chain.append(str(parents[chain[-1]]))
        if first is not None and chain[-1] != first:
            raise BodyError(f"{self.where}: limb {name!r} root {spec.root!r} does not carry {spec.tip!r}; "
                            "valid: a link between the body's root and the tip")  # fmt: skip
        if first is None:
            chain.pop()
        return Limb(name, spec.tip, tuple(reversed(chain)), ContactKind(spec.contact))


def _standing(segments: tuple[Segment, ...], wanted: Mapping[str, float]) -> dict[str, float]:
    """Angles within the ranges; those not wanted as near to 0 as they can be."""
    hinges = {hinge.name: (hinge.lower, hinge.upper) for segment in segments for hinge in segment.hinges}
    angles = {name: float(np.clip(0.0, *ends)) for name, ends in hinges.items()}
    for name, angle in wanted.items():
        if name not in hinges:
            raise BodyError(f"standing angle of {name!r}; valid: one of {list(hinges)}")
        lower, upper = hinges[name]
        if not lower <= angle <= upper:
            raise BodyError(f"standing angle of {name!r} is {angle:g} rad; valid: {lower:g} to {upper:g}")
        angles[name] = float(angle)
    return {name: angle for name, angle in angles.items() if angle != 0.0}


def _with_upright(body: BodyModel, effectors: list[str]) -> BodyModel:
    """The body with the axes of these effectors parallel to the root's in the standing posture."""
    state, turned = Configuration(body), dict(body.effectors)
    for name in effectors:
        turn, _ = state.segment_placement(turned[name].segment)
        turned[name] = replace(turned[name], rotation=_tidy(turn.T))
    return replace(body, effectors=turned)


def _with_mirrors(body: BodyModel) -> BodyModel:
    """The body with each limb that has a reflection knowing it."""
    limbs = []
    for limb in body.limbs:
        twins = [other.name for other in body.limbs if other is not limb and are_mirrored(body, limb, other)]
        limbs.append(replace(limb, mirror=twins[0] if twins else None))
    return replace(body, limbs=tuple(limbs))


def _with_soft_pairs(body: BodyModel) -> BodyModel:
    """The body without checks of segments that overlap in its zero or standing posture."""
    geometry, model = body.geometry, body.pinocchio
    data, pairs = pin.GeometryData(geometry), set(body.soft_pairs)
    for q in (body.zero_posture(), body.standing_posture()):
        pin.computeCollisions(model, model.createData(), geometry, data, q, False)
        for pair, result in zip(geometry.collisionPairs, data.collisionResults, strict=True):
            if result.isCollision():
                shapes = (geometry.geometryObjects[index] for index in (pair.first, pair.second))
                pairs.add(frozenset(shape.name.split("/")[0] for shape in shapes))
    return replace(body, soft_pairs=frozenset(pairs))


def _tidy(vector: FloatArray) -> FloatArray:
    """A vector without the dust that rotations leave where a component should be 0 or 1."""
    near = np.rint(vector)
    return np.where(np.abs(vector - near) < 1e-13, near, vector)


def _orthonormal(rotation: FloatArray) -> FloatArray:
    """The nearest rotation, by its polar decomposition."""
    u, _, v = np.linalg.svd(rotation)
    return u @ v
