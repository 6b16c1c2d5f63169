"""How far a flying effector is from the scene and from the limbs that stand.

Used while the rest of the posture is still unknown: the effector's own segments are exact, a
standing limb is its end segments at their contact and its next segment pointing towards the
centre of mass.
"""

from collections.abc import Callable, Sequence
from typing import Any

import coal
import numpy as np

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
    """

    def __init__(
        self, body: BodyModel, scene: Scene, effector: str, standing: Sequence[Contact], com: CentreOfMass
    ) -> None:
        self._own = end_shapes(body, effector)
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
        self._com = com
        self._request = coal.DistanceRequest()
        self._result = coal.DistanceResult()

    def __call__(self, time: float, pose: Pose) -> float:
        """Return the signed distance at a pose [m]; negative means penetration."""
        com = self._com(time)
        limbs = [limb.placed(com) for limb in self._limbs]
        smallest = np.inf
        for geometry, turn, offset in self._own:
            placement = coal.Transform3s(pose.rotation @ turn, pose.position + pose.rotation @ offset)
            for other, where in [*self._fixed, *limbs]:
                self._result.clear()
                distance = coal.distance(geometry, placement, other, where, self._request, self._result)
                smallest = min(smallest, distance)
        return float(smallest)


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
