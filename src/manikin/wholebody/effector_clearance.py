"""How far a flying effector is from the scene and from the limbs that stand.

Used while the rest of the posture is still unknown: the effector's own segments are exact, a
standing limb is its end segments at their contact and its next segment pointing towards the
centre of mass.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.body.limb import hanging_segment
from manikin.body.segments import Segment
from manikin.contact import Contact
from manikin.scene import Scene
from manikin.scene.collision import collision_parts
from manikin.spatial import FloatArray, rotation_from_normal
from manikin.wholebody.path import Pose

CentreOfMass = Callable[[float], FloatArray]
"""Planned centre of mass (3,) [m] at a time [s]."""

Placed = tuple[Any, Any]
"""A Coal geometry and its transform to the world."""

_ENDLESS = 1.0e9
"""Half the extent of what has no end (a floor) [m]."""

_LIMB_SHARE = 0.75
"""Share of the standing limb's last long segment that is kept clear of."""


class EffectorClearance:
    """Callable ``(time, pose) -> signed distance [m]`` for one flying effector.

    Args:
        body: The body.
        scene: The obstacles, the floor included.
        effector: Name of the flying effector.
        standing: Contacts of the other effectors during the flight.
        com: Planned centre of mass, which the standing limbs point to.
        bend: Angle of the hanging segment (toes) at a time [rad]; straight when omitted.
    """

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        effector: str,
        standing: Sequence[Contact],
        com: CentreOfMass,
        bend: Callable[[float], float] | None = None,
    ) -> None:
        self._own = end_shapes(body, effector)
        self._bend, self._hinge = bend, _hinge_of(body, effector)
        self._fixed = [
            (part.geometry, coal.Transform3s(part.rotation, part.translation))
            for obstacle in scene.obstacles
            for part in collision_parts(obstacle)
        ]
        self._limbs = []
        for contact in standing:
            rotation, position = contact.rotation_contact_to_world, contact.position
            for geometry, turn, offset in end_shapes(body, contact.effector):
                placement = coal.Transform3s(rotation @ turn, position + rotation @ offset)
                self._fixed.append((geometry, placement))
            limb = _last_long_segment(body, contact)
            if limb is not None:
                self._limbs.append(limb)
        boxes = [_world_box(geometry, placement) for geometry, placement in self._fixed]
        self._low, self._high = (np.array([box[side] for box in boxes]).reshape(-1, 3) for side in (0, 1))
        balls = [_ball(geometry) for geometry, _, _ in self._own]
        self._centres = np.array(
            [offset + turn @ ball[0] for (_, turn, offset), ball in zip(self._own, balls, strict=True)]
        )
        self._radii = np.array([ball[1] for ball in balls])
        # A bent shape stays this close to its straight place.
        hanging = [offset for _, _, offset in self._own[self._hinge.first :]]
        self._reach = max((2.0 * float(np.linalg.norm(o - self._hinge.place)) for o in hanging), default=0.0)
        self._com = com
        self._placed: dict[float, list[Placed]] = {}
        self._bents: dict[float, list[tuple[Any, FloatArray, FloatArray]]] = {}
        self._request = coal.DistanceRequest()
        self._result = coal.DistanceResult()

    def __call__(self, time: float, pose: Pose) -> float:
        """Return the signed distance at a pose [m]; negative means penetration."""
        local = self._bent(time)
        own = [
            (geometry, coal.Transform3s(pose.rotation @ turn, pose.position + pose.rotation @ offset))
            for geometry, turn, offset in local
        ]
        smallest = min((self._distance(mine, limb) for limb in self._placed_limbs(time) for mine in own),
                       default=np.inf)  # fmt: skip
        # Far obstacles are told by the box around them and the ball around the own shape.
        centres = pose.position + self._centres @ pose.rotation.T
        slack = 0.0 if local is self._own else self._reach
        beyond = np.maximum(np.maximum(self._low - centres[:, None], centres[:, None] - self._high), 0.0)
        lower = np.sqrt(np.einsum("ijk,ijk->ij", beyond, beyond)) - self._radii[:, None] - slack
        for index in np.argsort(lower, axis=None, kind="stable"):
            mine, other = divmod(int(index), lower.shape[1])
            if lower[mine, other] > smallest:
                break
            smallest = min(smallest, self._distance(own[mine], self._fixed[other]))
        return float(smallest)

    def _bent(self, time: float) -> list[tuple[Any, FloatArray, FloatArray]]:
        """The own shapes in the effector frame, those of the hanging segment turned about its hinge."""
        if self._bend is None:
            return self._own
        if time not in self._bents:
            self._bents[time] = self._turned(self._bend(time))
        return self._bents[time]

    def _turned(self, angle: float) -> list[tuple[Any, FloatArray, FloatArray]]:
        if angle == 0.0:
            return self._own
        turn = Rotation.from_rotvec(angle * self._hinge.axis).as_matrix()
        place = self._hinge.place
        bent = [
            (geometry, turn @ rotation, place + turn @ (offset - place))
            for geometry, rotation, offset in self._own[self._hinge.first :]
        ]
        return [*self._own[: self._hinge.first], *bent]

    def _placed_limbs(self, time: float) -> list[Placed]:
        if time not in self._placed:
            com = self._com(time) if self._limbs else np.zeros(3)
            self._placed[time] = [limb.placed(com) for limb in self._limbs]
        return self._placed[time]

    def _distance(self, mine: Placed, other: Placed) -> float:
        self._result.clear()
        return coal.distance(*mine, *other, self._request, self._result)


@dataclass(frozen=True, eq=False)
class _Hinge:
    """Hinge of the segment that hangs on an effector's own.

    Attributes:
        first: Number of shapes before those of the hanging segment.
        place: (3,) in the effector frame [m].
        axis: (3,) unit axis in the effector frame.
    """

    first: int
    place: FloatArray
    axis: FloatArray


def _hinge_of(body: BodyModel, effector: str) -> _Hinge:
    frame = body.effector(effector)
    hanging = hanging_segment(body, frame.segment)
    first = len(body.segment(frame.segment).shapes)
    if hanging is None:
        return _Hinge(first, np.zeros(3), np.array([0.0, 1.0, 0.0]))
    place = frame.rotation.T @ (hanging.origin - frame.translation)
    return _Hinge(first, place, frame.rotation.T @ hanging.hinges[0].axis)


def end_shapes(body: BodyModel, effector: str) -> list[tuple[Any, FloatArray, FloatArray]]:
    """Coal geometry, rotation and translation in the effector frame of its end segments' shapes.

    The end segments are the effector's own and the one that hangs on it (toes), at zero angle.
    """
    frame = body.effector(effector)
    offsets = {frame.segment: np.zeros(3)}
    hanging = hanging_segment(body, frame.segment)
    if hanging is not None:
        offsets[hanging.name] = hanging.origin
    geometries = {item.name: item.geometry for item in body.geometry.geometryObjects}
    shapes = []
    for name, offset in offsets.items():
        for shape in body.segment(name).shapes:
            translation = frame.rotation.T @ (offset + shape.translation - frame.translation)
            geometry = geometries[f"{name}/{shape.name}"]
            shapes.append((geometry, frame.rotation.T @ shape.rotation, translation))
    return shapes


def _ball(geometry: Any) -> tuple[FloatArray, float]:
    """Centre (3,) and radius of a ball around a geometry, in its own frame [m]."""
    geometry.computeLocalAABB()
    low, high = np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)
    return 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))


def _world_box(geometry: Any, placement: Any) -> tuple[FloatArray, FloatArray]:
    """Corners (3,) of an axis-aligned box around a placed geometry [m]; boundless for half-spaces."""
    if isinstance(geometry, (coal.Halfspace, coal.Plane)):
        return np.full(3, -_ENDLESS), np.full(3, _ENDLESS)
    geometry.computeLocalAABB()
    low, high = np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)
    rotation, translation = np.array(placement.getRotation()), np.array(placement.getTranslation())
    centre, half = rotation @ (0.5 * (low + high)) + translation, np.abs(rotation) @ (0.5 * (high - low))
    return centre - half, centre + half


class _StandingLimb:
    """A capsule from the joint above a standing effector towards the centre of mass."""

    def __init__(self, joint: FloatArray, radius: float, length: float) -> None:
        self._joint = joint
        self._length = length
        self._geometry = coal.Capsule(radius, length)

    def placed(self, com: FloatArray) -> tuple[Any, coal.Transform3s]:
        direction = com - self._joint
        direction = direction / max(float(np.linalg.norm(direction)), 1e-9)
        centre = self._joint + 0.5 * self._length * direction
        return self._geometry, coal.Transform3s(rotation_from_normal(direction), centre)


def _last_long_segment(body: BodyModel, contact: Contact) -> _StandingLimb | None:
    end: Segment = body.segment(body.effector(contact.effector).segment)
    if end.parent is None:
        return None
    parent = body.segment(end.parent)
    length = float(np.linalg.norm(end.origin))
    radii = [float(shape.size[0]) for shape in parent.shapes if shape.kind == "capsule"]
    if not radii or length < 1e-6:
        return None
    frame = body.effector(contact.effector)
    joint = contact.position - contact.rotation_contact_to_world @ frame.rotation.T @ frame.translation
    return _StandingLimb(joint, max(radii), _LIMB_SHARE * length)
