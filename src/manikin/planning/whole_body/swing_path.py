"""Poses of one flying effector in time, and its distance from the scene and the standing limbs.

A path is a polyline of timed poses.  Distances are measured while the rest of the posture is still
unknown: the effector's own segments are exact, a standing limb is its end segments at their contact and
its next segment pointing to a given place, such as the centre of mass.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import coal
import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import hanging_segment, toe_hinge
from manikin.contact import Contact
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, dot, frozen_array, rotation_from_normal
from manikin.scene import Scene
from manikin.scene.collision import collision_parts, local_box, pair_meter, part_meter


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


OwnShape = tuple[Any, FloatArray, FloatArray]
"""A Coal geometry, its rotation and translation in the effector frame."""


class Nearness(NamedTuple):
    """Distances of an effector at n poses to everything it must not touch.

    Attributes:
        distance: (n,) signed [m]; infinite where it is not below what was asked for.
        gradient: (n, 3) with respect to the effector's place; zero where the distance is infinite.
    """

    distance: FloatArray
    gradient: FloatArray


class FlightClearance(Protocol):
    """Measures one flying effector."""

    def __call__(
        self, time: FloatArray, position: FloatArray, rotation: FloatArray, within: ArrayLike = np.inf
    ) -> Nearness:
        """Distances at times (n,) [s], places (n, 3) [m] and axes (n, 3, 3); those below ``within`` [m]."""
        ...


class EffectorClearance:
    """The :class:`FlightClearance` of one flying effector from the scene and the standing limbs.

    Args:
        scene: The obstacles, the floor included.
        standing: Contacts of the other effectors during the flight.
        towards: Places (n, 3), or one, [m] that the limb above a standing contact points to at times [s].
        bend: Angles (n,) of the hanging segment (toes) at times (n,) [rad]; straight when omitted.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, effector: str, standing: Sequence[Contact],
        towards: Callable[[Contact, FloatArray], FloatArray],
        bend: Callable[[FloatArray], FloatArray] | None = None,
    ) -> None:  # fmt: skip
        own, frame = end_shapes(body, effector), body.effector(effector)
        hanging, place = hanging_segment(body, frame.segment), toe_hinge(body, effector)
        axis = None if hanging is None else frame.rotation.T @ hanging.hinges[0].axis
        self._hinge = None if place is None or axis is None or bend is None else (place, axis, bend)
        self._first_bent = len(body.segment(frame.segment).shapes)
        geometries, self._turns, self._offsets = [item[0] for item in own], *_stacked(own)
        low, high = np.array([local_box(item) for item in geometries]).transpose(1, 0, 2)
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        parts = [part for obstacle in scene.obstacles for part in collision_parts(obstacle)]
        placed = [
            (geometry, pose.rotation @ turn, pose.position + pose.rotation @ offset)
            for contact in standing
            for pose in [Pose.of(contact)]
            for geometry, turn, offset in end_shapes(body, contact.effector)
        ]
        limbs = ((contact, _standing_limb(body, contact)) for contact in standing)
        self._limbs, self._towards = (
            [(contact, *limb) for contact, limb in limbs if limb is not None],
            towards,
        )
        fixed = [(part.geometry, part.rotation, part.translation) for part in parts] + placed
        boxes = [(part.low, part.high) for part in parts] + [local_box(item) for item, _, _ in placed]
        # Axes of the boxes around the fixed shapes, one below the other, and the ends along each of them.
        rotations, translations = _stacked(fixed)
        self._axes = np.swapaxes(rotations, 1, 2).reshape(-1, 3)
        origins = (np.swapaxes(rotations, 1, 2) @ translations[:, :, None]).reshape(-1)
        self._low, self._high = (origins + np.ravel([box[end] for box in boxes]) for end in (0, 1))
        others = [item for item, _, _ in placed] + [limb[-1] for limb in self._limbs]
        self._meters = [
            [part_meter(mine, part) for part in parts] + [pair_meter(mine, other) for other in others]
            for mine in geometries
        ]
        self._places = [coal.Transform3s(turn, place) for _, turn, place in fixed]
        self._above = [coal.Transform3s() for _ in self._limbs]
        self._places += self._above
        self._moving = [coal.Transform3s() for _ in own]

    def __call__(
        self, time: FloatArray, position: FloatArray, rotation: FloatArray, within: ArrayLike = np.inf
    ) -> Nearness:
        """See :class:`FlightClearance`."""
        turns, places = self._own(time, position, rotation)
        ends = [
            joint + length * _unit(np.broadcast_to(self._towards(contact, time), position.shape) - joint)
            for contact, joint, length, _ in self._limbs
        ]
        lower = self._lower(turns, places, ends)
        within = np.broadcast_to(within, time.shape)
        distance, gradient = np.full(len(time), np.inf), np.zeros((len(time), 3))
        limbs_near = (
            lower[:, :, len(self._places) - len(ends) :].min(axis=1, initial=np.inf) < within[:, None]
        )
        for row in np.flatnonzero(lower.min(axis=(1, 2), initial=np.inf) < within).tolist():
            for mine, shape in enumerate(self._moving):
                shape.setTransform(turns[row, mine], places[row, mine])
            for number in np.flatnonzero(limbs_near[row]).tolist():
                joint, along = self._limbs[number][1], ends[number][row] - self._limbs[number][1]
                self._above[number].setTransform(rotation_from_normal(along), joint + 0.5 * along)
            distance[row], gradient[row] = self._nearest(lower[row], float(within[row]))
        return Nearness(distance, gradient)

    def _nearest(self, lower: FloatArray, within: float) -> tuple[float, FloatArray]:
        """Least distance [m] of the shapes as they are placed, if below ``within``, and its gradient (3,)."""
        least, gradient = np.inf, np.zeros(3)
        for index in np.argsort(lower, axis=None, kind="stable").tolist():
            mine, other = divmod(index, lower.shape[1])
            if lower[mine, other] >= within:
                break
            distance, normal, *_ = self._meters[mine][other](self._moving[mine], self._places[other], within)
            if distance < within:
                least, within, gradient = distance, distance, -normal
        return least, gradient

    def _own(
        self, time: FloatArray, position: FloatArray, rotation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Rotations (n, shapes, 3, 3) and translations (n, shapes, 3) of the own shapes, the toes bent."""
        turns = np.tile(self._turns, (len(time), 1, 1, 1))
        offsets = np.tile(self._offsets, (len(time), 1, 1))
        if self._hinge is not None:
            place, axis, bend = self._hinge
            bent = Rotation.from_rotvec(bend(time)[:, None] * axis).as_matrix()[:, None]
            hanging = slice(self._first_bent, None)
            turns[:, hanging] = bent @ turns[:, hanging]
            offsets[:, hanging] = (
                place + ((offsets[:, hanging] - place)[:, :, None] @ np.swapaxes(bent, 2, 3))[:, :, 0]
            )
        placed = position[:, None] + offsets @ np.swapaxes(rotation, 1, 2)
        return rotation[:, None] @ turns, placed

    def _lower(self, turns: FloatArray, places: FloatArray, ends: Sequence[FloatArray]) -> FloatArray:
        """(n, shapes, others) lower bounds [m] from boxes along the others' axes; minus infinity at 0."""
        centres = places + (turns @ self._middle[:, :, None])[..., 0]
        count, shapes = places.shape[:2]
        middle = centres @ self._axes.T
        half = (np.abs(self._axes @ turns) @ self._half[:, :, None])[..., 0]
        beyond = [
            np.maximum(self._low - middle - half, middle - half - self._high).reshape(count, shapes, -1, 3)
        ]
        world = (np.abs(turns) @ self._half[:, :, None])[..., 0]
        for end, (_, joint, _, capsule) in zip(ends, self._limbs, strict=True):
            low, high = (extreme(joint, end)[:, None] for extreme in (np.minimum, np.maximum))
            room = world + capsule.radius
            beyond.append(np.maximum(low - centres - room, centres - room - high)[:, :, None])
        gaps = np.maximum(np.concatenate(beyond, axis=2), 0.0)
        lower = np.sqrt(dot(gaps, gaps))
        return np.where(lower > 0.0, lower, -np.inf)


def _stacked(shapes: Sequence[OwnShape]) -> tuple[FloatArray, FloatArray]:
    """Rotations (k, 3, 3) and translations (k, 3) of shapes."""
    return (
        np.array([turn for _, turn, _ in shapes]).reshape(-1, 3, 3),
        np.array([place for _, _, place in shapes]).reshape(-1, 3),
    )


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


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
