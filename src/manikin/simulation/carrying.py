"""Contacts as the physics engine measures them, and the stances of those that carry.

A planned contact counts when its effector presses, and with no more of its area than touches: its points
within :data:`TOUCHING` of the surface, and wherever the engine's contact points carry force. Unplanned ones
count too. So the measured wrench lies in the wrench polytope of the stance, up to :data:`TOUCHING`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from manikin.balance.motion_margin import MotionMargin, motion_margin
from manikin.contact import Contact, ContactKind, ContactModel, SolePart, Stance
from manikin.numerics.polytope import signed_distance
from manikin.numerics.spatial import FloatArray, cross, rotation_from_normal

PRESSES = 1.0 / 75.0
"""Force from which something counts as a support, relative to the body's mass [N/kg]: 1 N of a person, and of
an insect of 2 kg, whose six tips share 20 N, a fortieth of that."""

TOUCHING = 1e-3
"""A point of a pressing sole this near to its surface touches [m]: the engine's soft contacts let corners
lift by less, which a rigid sole on a rigid floor would not."""

ALONG = 0.9
"""Least cosine between the normals of a measured and a planned contact that are the same [-]."""


@dataclass(frozen=True)
class Touch:
    """The first time of a touch that was not planned.

    Attributes:
        time: [s].
        segment: Segment of the body.
        other: Obstacle or other segment.
        force: Largest normal force of any instant, of all its points together [N].
    """

    time: float
    segment: str
    other: str
    force: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Plain values for the run's summary."""
        return {"segment": self.segment, "other": self.other, "time_s": self.time, "max_force_N": self.force}

    def __str__(self) -> str:
        return f"{self.segment} touches {self.other} at {self.time:.3f} s"


@dataclass(frozen=True, eq=False)
class Sensed:
    """Measurements of one engine step; all values belong to the state at its beginning.

    Attributes:
        time: Beginning of the step [s].
        a: (nv,) generalised acceleration [m/s^2, rad/s^2].
        segments: Segment of each of the k contact points.
        others: Obstacle, or other segment, of each contact point.
        on_scene: (k,) whether ``others`` is an obstacle.
        positions: (k, 3) of the contact points [m].
        normals: (k, 3) unit, out of ``others``.
        forces: (k, 3) on ``segments`` [N].
        depths: (k,) penetration [m].
        grips: Force [N] and its point [m] of every grip, (2, 3) each, by effector.
    """

    time: float
    a: FloatArray
    segments: tuple[str, ...]
    others: tuple[str, ...]
    on_scene: NDArray[np.bool_]
    positions: FloatArray
    normals: FloatArray
    forces: FloatArray
    depths: FloatArray
    grips: Mapping[str, FloatArray]

    def wrench(self, about: FloatArray, segments: Sequence[str] | None = None) -> FloatArray:
        """(6,) force and moment of the scene about a point (3,) [m] on all or some segments, grips apart."""
        chosen = self.on_scene
        if segments is not None:
            chosen = chosen & np.array([name in segments for name in self.segments], dtype=bool)
        forces, arms = self.forces[chosen], self.positions[chosen] - about
        return np.concatenate((forces.sum(axis=0), cross(arms, forces).sum(axis=0)))

    def grip_wrench(self, effector: str, about: FloatArray) -> FloatArray:
        """(6,) force and moment of the grip of an effector; zero without one."""
        if effector not in self.grips:
            return np.zeros(6)
        force, position = self.grips[effector]
        return np.concatenate((force, cross(position - about, force)))


class EngineStep(NamedTuple):
    """What is kept of one engine step with k contact points until it is looked at; all of its beginning.

    Attributes:
        time: [s].
        root: (3,) position of the root [m].
        qvel: (nv,) velocity in the engine's convention.
        qacc: (nv,) acceleration in the engine's convention.
        rotation: (9,) matrix from the root's axes to the world's.
        force: (6,) generalised force of all contacts on the root: in world axes [N], in its own [N.m].
        others: (6,) wrench of grips [N, N.m].
        grips: Force [N] and its point [m] of every grip, (2, 3) each, by effector.
        geoms: (k, 2) geometries of the engine.
        depths: (k,) penetration [m].
        positions: (k, 3) [m].
        frames: (k, 9) matrices whose rows are the axes of the contact, the first from the first geometry to
            the second.
        friction: (k,) coefficient.
        forces: (k, 3) along these axes on the second geometry [N].
        leant: (k,) whether the body only leans there.
    """

    time: float
    root: FloatArray
    qvel: FloatArray
    qacc: FloatArray
    rotation: FloatArray
    force: FloatArray
    others: FloatArray
    grips: Mapping[str, FloatArray]
    geoms: NDArray[np.int32]
    depths: FloatArray
    positions: FloatArray
    frames: FloatArray
    friction: FloatArray
    forces: FloatArray
    leant: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CarriedPoints:
    """Contact points of body and scene that carried force during a control step.

    Attributes:
        segments: Segment of each of the k points.
        others: Obstacle of each.
        positions: (k, 3) [m].
        normals: (k, 3) unit, out of the obstacle.
        forces: (k,) normal force, its mean over the control step [N].
        friction: (k,) coefficient.
    """

    segments: tuple[str, ...]
    others: tuple[str, ...]
    positions: FloatArray
    normals: FloatArray
    forces: FloatArray
    friction: FloatArray

    @classmethod
    def none(cls) -> "CarriedPoints":
        """No points."""
        return cls((), (), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0))

    def of(self, segments: Sequence[str]) -> NDArray[np.bool_]:
        """(k,) whether each point is on one of the segments."""
        return np.array([name in segments for name in self.segments], dtype=bool)

    def centre(self, chosen: NDArray[np.bool_]) -> FloatArray:
        """(3,) centre of pressure of some of the points [m]."""
        weights = self.forces[chosen]
        return weights @ self.positions[chosen] / weights.sum()


Pose = tuple[FloatArray, FloatArray]
"""Position (3,) [m] and rotation (3, 3) of an effector in the world."""


class CarryingContacts:
    """Turns carried points into stances, sample after sample; a contact that stays is the same object."""

    def __init__(self, segments: Mapping[str, Sequence[str]], mass: float) -> None:
        """Start with the segments with which each effector touches, and the mass [kg] by which forces go."""
        self._segments, self._mass, self._least = dict(segments), mass, PRESSES * mass
        self._last: dict[str, Contact] = {}
        self._stances: dict[tuple[ContactModel | int | None, ...], Stance] = {}

    def stance(
        self, points: CarriedPoints, pose: Callable[[str], Pose], planned: Mapping[str, Contact],
        gripping: Sequence[str] = (), model: ContactModel | None = None,
    ) -> Stance:  # fmt: skip
        """Stance of one control step.

        Args:
            points: Contact points that carried.
            pose: Function of an effector's name: its measured pose.
            planned: Contact that each effector has, had last or is about to make.
            gripping: Effectors that hold on.
            model: Friction cone and cap of the planned stance; without a cap, that of a body.
        """
        contacts = [planned[name] for name in gripping if name in planned]
        left = np.ones(len(points.forces), dtype=bool)
        for name, contact in planned.items():
            if name in gripping or contact.kind is ContactKind.GRASP:
                continue
            chosen = left & points.of(self._segments[name]) & (points.normals @ contact.normal > ALONG)
            if points.forces[chosen].sum() < self._least:
                continue
            left &= ~chosen
            contacts.append(self._known(*_touched(contact, pose(name), points, chosen)))
        pairs = zip(points.segments, points.others, left.tolist(), strict=True)
        for segment, other in dict.fromkeys((segment, other) for segment, other, free in pairs if free):
            chosen = left & (np.array(points.others) == other) & points.of([segment])
            if points.forces[chosen].sum() >= self._least:
                unplanned = _unplanned(f"{segment} on {other}", points, chosen)
                contacts.append(self._known(unplanned, partial=True))
        key = model, *map(id, contacts)  # which the stance keeps
        if key not in self._stances:
            self._stances[key] = Stance(contacts, model=model).bounded(self._mass)
        return self._stances[key]

    def _known(self, contact: Contact, partial: bool) -> Contact:
        """The same contact as before where it has not moved, so that stances can be told apart by it."""
        last = self._last.get(contact.effector)
        if last is None or not (last is contact or _same_place(last, contact)):
            last = replace(contact, points=_hull(contact.points)) if partial else contact
            self._last[contact.effector] = last
        return last


def carried_margin(stances: Sequence[Stance], wrenches: FloatArray, com: FloatArray) -> MotionMargin:
    """Margins of n measured wrenches about the centre of mass in the stances that carried them.

    Args:
        stances: n stances; those of the same contacts count as one.
        wrenches: (n, 6) mean wrenches of the scene about the world origin [N, N.m].
        com: (n, 3) [m].
    """
    keys, numbers, different = [tuple(map(id, stance)) for stance in stances], {}, []
    for key, stance in zip(keys, stances, strict=True):
        if numbers.setdefault(key, len(different)) == len(different):
            different.append(stance)
    rows = np.array([numbers[key] for key in keys], dtype=np.int64)
    return motion_margin(different, rows, wrenches.reshape(-1, 6), com.reshape(-1, 3))


def _same_place(first: Contact, second: Contact) -> bool:
    """Whether a contact is the one of before but for less than :data:`TOUCHING`.

    Every corner of the first is still met by a point of the second, none of which is outside its hull.
    """
    alike = first.kind is second.kind and first.part is second.part and first.friction == second.friction
    alike &= first.torsion_limit == second.torsion_limit
    if not alike or first.normal @ second.normal < 1.0 - 1e-6:
        return False
    one, rotation = first.points, first.rotation_contact_to_world
    other = (second.points_in_world - first.position) @ rotation
    if max(np.abs(one[:, 2]).max(), np.abs(other[:, 2]).max()) > TOUCHING:
        return False
    if len(one) == len(other) and np.square(one - other).sum(axis=1).max() <= TOUCHING**2:
        return True  # point by point, as from one sample to the next
    if np.square(one[:, None, :2] - other[:, :2]).sum(axis=2).min(axis=1).max() > TOUCHING**2:
        return False
    return bool(signed_distance(other[:, :2], first.outline).min() >= -TOUCHING)


def _touched(
    contact: Contact, pose: Pose, points: CarriedPoints, chosen: NDArray[np.bool_]
) -> tuple[Contact, bool]:
    """A planned contact where it is, with what of it touches, and whether that is not all of it."""
    centre, normal, (position, rotation) = points.centre(chosen), contact.normal, pose
    if contact.kind is ContactKind.POINT:
        return replace(contact, position=centre), False
    if contact.part is SolePart.FULL:
        corners = position + contact.points @ rotation.T
        corners = corners[np.abs((corners - centre) @ normal) <= TOUCHING]
        if len(corners) == len(contact.points):
            place = position - ((position - centre) @ normal) * normal
            if np.all(_beyond(contact, place, points.positions[chosen]) <= TOUCHING):
                still = math.dist(place, contact.position) <= TOUCHING
                return (contact if still else replace(contact, position=place)), False
    else:
        corners = contact.points_in_world
    local = (np.vstack([corners, points.positions[chosen]]) - centre) @ contact.rotation_contact_to_world
    local[:, 2] = 0.0
    return replace(contact, position=centre, points=local, torsion_limit=None), True


def _beyond(contact: Contact, place: FloatArray, positions: FloatArray) -> FloatArray:
    """(k,) how far points lie outside the rectangle of a sole at a place, or outside its polygon [m]."""
    local = (positions - place) @ contact.rotation_contact_to_world - contact.centre
    if contact.hangs_over:
        return -signed_distance((local + contact.centre)[:, :2], contact.outline)
    return (np.abs(local[:, :2]) - 0.5 * np.array([contact.length, contact.width])).max(axis=1)


def _hull(points: FloatArray) -> FloatArray:
    """Corners of the hull of points in a plane that stand out, or the ends of a line, or one point."""
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    extent, axes = np.linalg.svd(flat, full_matrices=False)[1:]
    if np.abs(flat).max() <= 0.5 * TOUCHING:
        return points.mean(axis=0, keepdims=True)
    if len(points) < 3 or extent[-1] <= 0.1 * TOUCHING:
        along = flat @ axes[0]
        return points[[int(np.argmin(along)), int(np.argmax(along))]]
    corners = list(ConvexHull(points[:, :2]).vertices)
    while len(corners) > 3:
        room = [_height(points, corners, number) for number in range(len(corners))]
        if min(room) > 0.1 * TOUCHING:
            break
        corners.pop(int(np.argmin(room)))
    return points[corners]


def _height(points: FloatArray, corners: list[int], number: int) -> float:
    """How far a corner of a polygon stands out from the line of its neighbours [m]."""
    before, corner, after = (points[corners[(number + k) % len(corners)], :2] for k in (-1, 0, 1))
    along, arm = after - before, corner - before
    return abs(along[0] * arm[1] - along[1] * arm[0]) / max(float(np.linalg.norm(along)), 1e-12)


def _unplanned(name: str, points: CarriedPoints, chosen: NDArray[np.bool_]) -> Contact:
    """A contact that is not planned: its points, about the mean of their normals."""
    centre, normal = points.centre(chosen), points.forces[chosen] @ points.normals[chosen]
    rotation = rotation_from_normal(normal / np.linalg.norm(normal), 0.0)
    local = (points.positions[chosen] - centre) @ rotation
    local[:, 2] = 0.0
    return Contact(name, ContactKind.SOLE, centre, rotation, local, float(points.friction[chosen].min()))
