"""Poses of one flying effector in time, and its distance from the scene and the standing limbs.

A path is a polyline of timed poses.  Distances are measured while the rest of the posture is still
unknown: the effector's own segments are exact, a standing limb is its end segments at their contact and
its next segment pointing to a given place, such as the centre of mass.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import coal
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import hanging_segment, toe_hinge
from manikin.contact import Contact
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, frozen_array, rotation_from_normal
from manikin.scene import Scene
from manikin.scene.collision import collision_parts


class Pose(NamedTuple):
    """Placement of an effector frame in the world.

    Attributes:
        position: (3,) origin [m].
        rotation: (3, 3) effector-to-world rotation.
    """

    position: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, contact: Contact) -> "Pose":
        """Placement of an effector in contact."""
        return cls(contact.position, contact.rotation_contact_to_world)

    @classmethod
    def in_posture(cls, body: BodyModel, q: FloatArray, effector: str) -> "Pose":
        """Placement of an effector in a posture (nq,)."""
        rotation, position = Configuration(body, q).effector_placement(effector)
        return cls(np.array(position), np.array(rotation))


ROTATION_WEIGHT, TIME_WEIGHT = 0.09, 1.0
"""lambda1 [m^2/rad^2] and lambda2 [m^2/s^2] of :func:`metric`, not published: 1 rad is 0.3 m, 1 s is 1 m."""


def metric(translation: ArrayLike, rotation: ArrayLike, time: ArrayLike) -> FloatArray:
    """Distance in configuration-time space ([Qiu2012]_ 6.6, with R(theta_1, theta_2)), elementwise.

    ``d^2 = |p1 - p2|^2 + lambda1 |log R12|^2 + lambda2 (t1 - t2)^2``, from its three parts [m, rad, s].
    """
    return np.sqrt(
        np.square(translation) + ROTATION_WEIGHT * np.square(rotation) + TIME_WEIGHT * np.square(time)
    )


@dataclass(frozen=True, eq=False)
class EffectorPath:
    """Timed poses joined by straight lines and shortest rotations.

    Attributes:
        time: (n,) strictly increasing [s], n >= 2.
        position: (n, 3) [m].
        rotation: (n, 3, 3) effector-to-world.
    """

    time: FloatArray
    position: FloatArray
    rotation: FloatArray

    def __init__(self, time: ArrayLike, position: ArrayLike, rotation: ArrayLike) -> None:
        times = frozen_array(time, "path time [s]", (None,))
        n = len(times)
        if n < 2 or not np.all(np.diff(times) > 0):
            raise InputError(f"path time is {times.tolist()}; valid: two or more increasing instants")
        object.__setattr__(self, "time", times)
        object.__setattr__(self, "position", frozen_array(position, "path position [m]", (n, 3)))
        object.__setattr__(self, "rotation", frozen_array(rotation, "path rotation", (n, 3, 3)))

    @property
    def duration(self) -> float:
        """Time from the first to the last node [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def turns(self) -> FloatArray:
        """(n-1, 3) rotation vectors between neighbouring nodes, in the frame of the earlier one [rad]."""
        relative = np.swapaxes(self.rotation[:-1], 1, 2) @ self.rotation[1:]
        return Rotation.from_matrix(relative).as_rotvec()

    @property
    def length(self) -> float:
        """Sum of the :func:`metric` lengths of the segments."""
        steps = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return float(metric(steps, np.linalg.norm(self.turns, axis=1), np.diff(self.time)).sum())

    def sample(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Positions (k, 3) and rotations (k, 3, 3) at times (k,) [s]; held constant outside."""
        times = np.clip(time, self.time[0], self.time[-1])
        index = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, len(self.time) - 2)
        share = ((times - self.time[index]) / np.diff(self.time)[index])[:, None]
        position = (1.0 - share) * self.position[index] + share * self.position[index + 1]
        rotation = self.rotation[index] @ Rotation.from_rotvec(share * self.turns[index]).as_matrix()
        return position, rotation


Placed = tuple[Any, Any]
"""A Coal geometry and its transform to the world."""

OwnShape = tuple[Any, FloatArray, FloatArray]
"""A Coal geometry, its rotation and translation in the effector frame."""


class EffectorClearance:
    """Callable ``(time, pose) -> signed distance [m]`` for one flying effector.

    Args:
        scene: The obstacles, the floor included.
        standing: Contacts of the other effectors during the flight.
        towards: Place (3,) [m] that the limb above a standing contact points to at a time [s].
        bend: Angle of the hanging segment (toes) at a time [rad]; straight when omitted.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, effector: str, standing: Sequence[Contact],
        towards: Callable[[Contact, float], FloatArray], bend: Callable[[float], float] | None = None,
    ) -> None:  # fmt: skip
        self._own, frame = end_shapes(body, effector), body.effector(effector)
        self._first_bent = len(body.segment(frame.segment).shapes)
        hanging, place = hanging_segment(body, frame.segment), toe_hinge(body, effector)
        axis = None if hanging is None else frame.rotation.T @ hanging.hinges[0].axis
        self._hinge = None if place is None or axis is None else (place, axis)
        self._fixed = [
            (part.geometry, coal.Transform3s(part.rotation, part.translation))
            for obstacle in scene.obstacles
            for part in collision_parts(obstacle)
        ]
        for contact in standing:
            self._fixed += _placed(end_shapes(body, contact.effector), Pose.of(contact))
        limbs = ((contact, _standing_limb(body, contact)) for contact in standing)
        self._limbs = [(contact, *limb) for contact, limb in limbs if limb is not None]
        boxes = [_world_box(geometry, placement) for geometry, placement in self._fixed]
        self._low, self._high = (np.array([box[side] for box in boxes]).reshape(-1, 3) for side in (0, 1))
        balls = [_local_box(geometry) for geometry, _, _ in self._own]
        self._centres = np.array(
            [offset + turn @ ball[0] for (_, turn, offset), ball in zip(self._own, balls, strict=True)]
        )
        self._radii = np.array([np.linalg.norm(half) for _, half in balls])
        self._towards, self._bend = towards, bend
        self._placed_limbs, self._bent = cache(self._limbs_at), cache(self._bent_at)
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()

    def __call__(self, time: float, pose: Pose) -> float:
        """Return the signed distance at a pose [m]; negative means penetration."""
        local, slack = self._bent(time)
        own = _placed(local, pose)
        smallest = min((self._distance(mine, limb) for limb in self._placed_limbs(time) for mine in own),
                       default=np.inf)  # fmt: skip
        # Far obstacles are ruled out by the box around them and the ball around the own shape.
        centres = pose.position + self._centres @ pose.rotation.T
        beyond = np.maximum(np.maximum(self._low - centres[:, None], centres[:, None] - self._high), 0.0)
        lower = np.sqrt(np.einsum("ijk,ijk->ij", beyond, beyond)) - self._radii[:, None] - slack
        for index in np.argsort(lower, axis=None, kind="stable"):
            mine, other = divmod(int(index), lower.shape[1])
            if lower[mine, other] > smallest:
                break
            smallest = min(smallest, self._distance(own[mine], self._fixed[other]))
        return float(smallest)

    def _bent_at(self, time: float) -> tuple[list[OwnShape], float]:
        """The own shapes, those of the hanging segment bent, and how far that is from straight [m]."""
        angle = 0.0 if self._bend is None else self._bend(time)
        if angle == 0.0 or self._hinge is None:
            return self._own, 0.0
        place, axis = self._hinge
        turn = Rotation.from_rotvec(angle * axis).as_matrix()
        hanging = self._own[self._first_bent :]
        bent = [(item, turn @ own, place + turn @ (offset - place)) for item, own, offset in hanging]
        reach = max(2.0 * float(np.linalg.norm(offset - place)) for _, _, offset in hanging)
        return [*self._own[: self._first_bent], *bent], reach

    def _limbs_at(self, time: float) -> list[Placed]:
        """Capsules from the joints above the standing effectors to where their limbs point."""
        placed = []
        for contact, joint, length, capsule in self._limbs:
            direction = self._towards(contact, time) - joint
            direction = direction / max(float(np.linalg.norm(direction)), 1e-9)
            place = joint + 0.5 * length * direction
            placed.append((capsule, coal.Transform3s(rotation_from_normal(direction), place)))
        return placed

    def _distance(self, mine: Placed, other: Placed) -> float:
        self._result.clear()
        return coal.distance(*mine, *other, self._request, self._result)


def _placed(shapes: Sequence[OwnShape], pose: Pose) -> list[Placed]:
    """An effector's shapes with its frame at a pose."""
    return [
        (geometry, coal.Transform3s(pose.rotation @ turn, pose.position + pose.rotation @ offset))
        for geometry, turn, offset in shapes
    ]


def end_shapes(body: BodyModel, effector: str) -> list[OwnShape]:
    """Shapes of an effector's end segments: its own and the one that hangs on it (toes), at zero angle."""
    frame, shapes = body.effector(effector), list[OwnShape]()
    hanging, to_frame = hanging_segment(body, frame.segment), frame.rotation.T
    ends = [(body.segment(frame.segment), np.zeros(3))]
    ends += [] if hanging is None else [(hanging, hanging.origin)]
    geometries = {item.name: item.geometry for item in body.geometry.geometryObjects}
    for segment, offset in ends:
        for shape in segment.shapes:
            place = to_frame @ (offset + shape.translation - frame.translation)
            shapes.append((geometries[f"{segment.name}/{shape.name}"], to_frame @ shape.rotation, place))
    return shapes


def _local_box(geometry: Any) -> tuple[FloatArray, FloatArray]:
    """Middle (3,) and half the edges (3,) of the box around a geometry in its own frame [m]."""
    geometry.computeLocalAABB()
    low, high = np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)
    return 0.5 * (low + high), 0.5 * (high - low)


def _world_box(geometry: Any, placement: Any) -> tuple[FloatArray, FloatArray]:
    """Corners (3,) of an axis-aligned box around a placed geometry [m]; boundless for half-spaces."""
    if isinstance(geometry, (coal.Halfspace, coal.Plane)):
        return np.full(3, -1.0e9), np.full(3, 1.0e9)
    middle, half = _local_box(geometry)
    rotation = np.array(placement.getRotation())
    centre, half = rotation @ middle + np.array(placement.getTranslation()), np.abs(rotation) @ half
    return centre - half, centre + half


def _standing_limb(body: BodyModel, contact: Contact) -> tuple[FloatArray, float, Any] | None:
    """Joint (3,) above a standing effector, with the length [m] and the capsule of the limb above it."""
    frame = body.effector(contact.effector)
    end = body.segment(frame.segment)
    shapes = () if end.parent is None else body.segment(end.parent).shapes
    radii = [float(shape.size[0]) for shape in shapes if shape.kind == "capsule"]
    # Share of the standing limb's last long segment that is kept clear of.
    length = 0.75 * float(np.linalg.norm(end.origin))
    if not radii or length < 1e-6:
        return None
    joint = contact.position - contact.rotation_contact_to_world @ frame.rotation.T @ frame.translation
    return joint, length, coal.Capsule(max(radii), length)
