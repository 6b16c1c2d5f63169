"""Poses of one flying effector in time, and its distance from the scene and the standing limbs.

A path is a polyline of timed poses.  Distances are measured while the rest of the posture is still
unknown: the effector's own segments are exact, a standing limb is its end segments at their contact and
its next segment pointing towards the centre of mass.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import coal
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import hanging_segment
from manikin.body.segments import Segment
from manikin.contact import Contact
from manikin.errors import InputError
from manikin.numerics.spatial import (
    FloatArray,
    check_rotation,
    finite_number,
    frozen_array,
    rotation_from_normal,
)
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


def make_pose(position: ArrayLike, rotation: ArrayLike | None = None, name: str = "pose") -> Pose:
    """Check and freeze a pose; the identity rotation when omitted.

    Raises:
        InputError: If the position is not three finite numbers or the rotation is not one.
    """
    frame = np.eye(3) if rotation is None else rotation
    return Pose(
        frozen_array(position, f"{name} position [m]", (3,)), check_rotation(frame, f"{name} rotation")
    )


@dataclass(frozen=True)
class Metric:
    """Distance in configuration-time space ([Qiu2012]_ 6.6, with R(theta_1, theta_2)).

    ``d^2 = |p1 - p2|^2 + lambda1 |log R12|^2 + lambda2 (t1 - t2)^2``.  The values of the
    weights are not published; the defaults make 1 rad worth 0.3 m and 1 s worth 1 m.

    Attributes:
        rotation_weight: lambda1 [m^2/rad^2].
        time_weight: lambda2 [m^2/s^2].
    """

    rotation_weight: float = 0.09
    time_weight: float = 1.0

    def __post_init__(self) -> None:
        finite_number(self.rotation_weight, "metric rotation_weight", at_least=0.0)
        finite_number(self.time_weight, "metric time_weight", at_least=0.0)

    def combine(self, translation: ArrayLike, rotation: ArrayLike, time: ArrayLike) -> FloatArray:
        """Distance from its three parts [m, rad, s], elementwise."""
        return np.sqrt(
            np.square(translation)
            + self.rotation_weight * np.square(rotation)
            + self.time_weight * np.square(time)
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

    def __init__(self, time: ArrayLike, position: ArrayLike, rotation: ArrayLike | None = None) -> None:
        times = frozen_array(time, "path time [s]", (None,))
        n = len(times)
        if n < 2 or not np.all(np.diff(times) > 0):
            raise InputError(f"path time is {times.tolist()}; valid: two or more increasing instants")
        frames = np.broadcast_to(np.eye(3), (n, 3, 3)) if rotation is None else rotation
        object.__setattr__(self, "time", times)
        object.__setattr__(self, "position", frozen_array(position, "path position [m]", (n, 3)))
        object.__setattr__(self, "rotation", frozen_array(frames, "path rotation", (n, 3, 3)))

    def __len__(self) -> int:
        return len(self.time)

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
    def speeds(self) -> FloatArray:
        """(n-1,) average speed of each segment [m/s] ([Qiu2012]_ 6.7)."""
        return np.linalg.norm(np.diff(self.position, axis=0), axis=1) / np.diff(self.time)

    @property
    def angular_speeds(self) -> FloatArray:
        """(n-1,) average angular speed of each segment [rad/s] ([Qiu2012]_ 6.8)."""
        return np.linalg.norm(self.turns, axis=1) / np.diff(self.time)

    def length(self, metric: Metric) -> float:
        """Sum of the metric lengths of the segments."""
        steps = np.linalg.norm(np.diff(self.position, axis=0), axis=1)
        return float(metric.combine(steps, np.linalg.norm(self.turns, axis=1), np.diff(self.time)).sum())

    def sample(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Positions (k, 3) and rotations (k, 3, 3) at the given times; held constant outside."""
        times = np.clip(np.atleast_1d(np.asarray(time, dtype=np.float64)), self.time[0], self.time[-1])
        index = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, len(self) - 2)
        share = ((times - self.time[index]) / np.diff(self.time)[index])[:, None]
        position = (1.0 - share) * self.position[index] + share * self.position[index + 1]
        rotation = self.rotation[index] @ Rotation.from_rotvec(share * self.turns[index]).as_matrix()
        return position, rotation

    def at(self, time: float) -> Pose:
        """Pose at one time [s]."""
        position, rotation = self.sample(time)
        return Pose(position[0], rotation[0])


CentreOfMass = Callable[[float], FloatArray]
"""Planned centre of mass (3,) [m] at a time [s]."""

Placed = tuple[Any, Any]
"""A Coal geometry and its transform to the world."""

_ENDLESS = 1.0e9
"""Half the extent of what has no end (a floor) [m]."""


class EffectorClearance:
    """Callable ``(time, pose) -> signed distance [m]`` for one flying effector.

    Args:
        scene: The obstacles, the floor included.
        standing: Contacts of the other effectors during the flight.
        com: Planned centre of mass, which the standing limbs point to.
        bend: Angle of the hanging segment (toes) at a time [rad]; straight when omitted.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, effector: str, standing: Sequence[Contact], com: CentreOfMass,
        bend: Callable[[float], float] | None = None,
    ) -> None:  # fmt: skip
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
        # Far obstacles are ruled out by the box around them and the ball around the own shape.
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


class _Hinge(NamedTuple):
    """Hinge of the segment that hangs on an effector's own, in the effector frame.

    Attributes:
        first: Number of shapes before those of the hanging segment.
        place: (3,) [m].
        axis: (3,) unit axis.
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
    # Share of the standing limb's last long segment that is kept clear of.
    return _StandingLimb(joint, max(radii), 0.75 * length)
