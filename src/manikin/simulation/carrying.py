"""The contacts that really carry: a stance from what touches in the physics engine.

A planned contact counts when its effector presses, and with no more of its area than touches: the points of
the contact that are within :data:`TOUCHING` of the surface, and wherever the engine's contact points carry
force. What touches without a plan and carries counts too. So the measured wrench of the scene lies in the
wrench polytope of the stance, up to :data:`TOUCHING`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from manikin.contact import Contact, ContactKind, ContactModel, SolePart, Stance
from manikin.numerics.spatial import FloatArray, rotation_from_normal

PRESSES = 1.0
"""Force from which something counts as a support [N]."""

TOUCHING = 1e-3
"""A point of a pressing sole this near to its surface touches [m]: the engine's soft contacts let corners
lift by less, which a rigid sole on a rigid floor would not."""

ALONG = 0.9
"""Least cosine between the force's normal and the planned contact's for one to be the other."""


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

    def of(self, segments: Sequence[str]) -> NDArray[np.bool_]:
        """(k,) whether each point is on one of the segments."""
        return np.array([name in segments for name in self.segments], dtype=bool)

    def __len__(self) -> int:
        return len(self.forces)


Pose = tuple[FloatArray, FloatArray]
"""Position (3,) [m] and rotation (3, 3) of an effector in the world."""


class CarryingContacts:
    """Turns carried points into stances, sample after sample; a contact that stays is the same object."""

    def __init__(self, segments: Mapping[str, Sequence[str]], mass: float) -> None:
        """Start with nothing known.

        Args:
            segments: Names of the segments with which each effector touches.
            mass: Of the body [kg]; bounds the forces of a stance without caps.
        """
        self._segments = dict(segments)
        self._mass = mass
        self._last: dict[str, Contact] = {}

    def stance(
        self,
        points: CarriedPoints,
        pose: Callable[[str], Pose],
        planned: Mapping[str, Contact],
        gripping: Sequence[str] = (),
        model: ContactModel | None = None,
    ) -> Stance:
        """Stance of one control step.

        Args:
            points: What carried.
            pose: Of an effector, as it is.
            planned: Contact that each effector has, had last or is about to make.
            gripping: Effectors that hold on.
            model: Friction cone and cap of the planned stance; without a cap, that of a body.
        """
        contacts = [planned[name] for name in gripping if name in planned]
        left = np.ones(len(points), dtype=bool)
        for name, contact in planned.items():
            if name in gripping or contact.kind is ContactKind.GRASP:
                continue
            chosen = left & points.of(self._segments[name]) & (points.normals @ contact.normal > ALONG)
            if points.forces[chosen].sum() < PRESSES:
                continue
            left &= ~chosen
            contacts.append(self._known(*_touched(contact, pose(name), points, chosen)))
        for segment, other in dict.fromkeys(zip(points.segments, points.others, strict=True)):
            pair = np.array(points.others) == other
            chosen = left & pair & points.of([segment])
            if points.forces[chosen].sum() >= PRESSES:
                contacts.append(
                    self._known(_unplanned(f"{segment} on {other}", points, chosen), partial=True)
                )
        return Stance(contacts, model=model).bounded(self._mass)

    def _known(self, contact: Contact, partial: bool) -> Contact:
        """The same contact as before where it has not moved, so that stances can be told apart by it."""
        last = self._last.get(contact.effector)
        if last is not None and _same_place(last, contact):
            return last
        kept = replace(contact, points=_hull(contact.points)) if partial else contact
        self._last[contact.effector] = kept
        return kept


def _same_place(first: Contact, second: Contact) -> bool:
    """Whether a contact is the one of before but for less than :data:`TOUCHING`.

    Every corner of the first is still met by a point of the second, none of which is outside its hull.
    """
    alike = first.kind is second.kind and first.part is second.part and first.friction == second.friction
    if not alike or first.normal @ second.normal < 1.0 - 1e-6:
        return False
    if first.torsion_limit != second.torsion_limit:
        return False
    one, other = ((c.points_in_world - first.position) @ first.rotation_contact_to_world
                  for c in (first, second))  # fmt: skip
    if np.abs(np.concatenate([one[:, 2], other[:, 2]])).max() > TOUCHING:
        return False
    missing = np.linalg.norm(one[:, None, :2] - other[:, :2], axis=2).min(axis=1)
    return bool(missing.max() <= TOUCHING and _outside(other[:, :2], one[:, :2]) <= TOUCHING)


def _outside(points: FloatArray, corners: FloatArray) -> float:
    """Farthest that any of (k, 2) points is outside the hull of (m, 2) corners [m]."""
    ends = np.roll(corners, -1, axis=0)
    along = ends - corners
    length = np.maximum(np.sum(along**2, axis=1), 1e-18)
    offset = points[:, None] - corners
    share = np.clip(np.sum(offset * along, axis=2) / length, 0.0, 1.0)
    apart = np.linalg.norm(offset - share[..., None] * along, axis=2).min(axis=1)
    if len(corners) > 2:
        turn = along[:, 0] * offset[..., 1] - along[:, 1] * offset[..., 0]
        inside = np.all(turn >= 0.0, axis=1) | np.all(turn <= 0.0, axis=1)
        apart = np.where(inside, 0.0, apart)
    return float(apart.max(initial=0.0))


def _touched(
    contact: Contact, pose: Pose, points: CarriedPoints, chosen: NDArray[np.bool_]
) -> tuple[Contact, bool]:
    """A planned contact where it is, with what of it touches, and whether that is not all of it."""
    weights = points.forces[chosen]
    centre = weights @ points.positions[chosen] / weights.sum()
    if contact.kind is ContactKind.POINT:
        return replace(contact, position=centre), False
    position, rotation = pose
    normal = contact.normal
    if contact.part is SolePart.FULL:
        corners = position + contact.points @ rotation.T
        corners = corners[np.abs((corners - centre) @ normal) <= TOUCHING]
        if len(corners) == len(contact.points):
            whole = replace(contact, position=position - ((position - centre) @ normal) * normal)
            if np.all(_beyond(whole, points.positions[chosen]) <= TOUCHING):
                return (contact if _same_place(contact, whole) else whole), False
    else:
        corners = contact.points_in_world
    local = (np.vstack([corners, points.positions[chosen]]) - centre) @ contact.rotation_contact_to_world
    local[:, 2] = 0.0
    return replace(contact, position=centre, points=local, torsion_limit=None), True


def _beyond(contact: Contact, positions: FloatArray) -> FloatArray:
    """(k,) how far points lie outside the rectangle of a sole, along its axes [m]."""
    local = (positions - contact.position) @ contact.rotation_contact_to_world - contact.centre
    return (np.abs(local[:, :2]) - 0.5 * np.array([contact.length, contact.width])).max(axis=1)


def _hull(points: FloatArray) -> FloatArray:
    """Corners of the hull of points in a plane, or the ends of a line, or one point.

    Corners that stand out by less than a tenth of :data:`TOUCHING` are left out.
    """
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
    """A contact of what touches without a plan: its points, about the mean of their normals."""
    weights = points.forces[chosen]
    centre = weights @ points.positions[chosen] / weights.sum()
    normal = weights @ points.normals[chosen]
    rotation = rotation_from_normal(normal / np.linalg.norm(normal), 0.0)
    local = (points.positions[chosen] - centre) @ rotation
    local[:, 2] = 0.0
    return Contact(name, ContactKind.SOLE, centre, rotation, local, float(points.friction[chosen].min()))
