"""Feet that do not slide: where they stand, how they get there, and the legs that follow.

The thesis leaves this open (6.8): steps of blended cycles do not quite fit the blended velocity. Here a foot
has one place on the floor from landing to toe-off, over which it rolls from heel to ball; in the swing the
correction goes over, smoothly, from one step's to the next. Legs follow by inverse kinematics in closed form.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from manikin.body import BodyModel
from manikin.errors import BodyError
from manikin.kinematics.leg_kinematics import HINGES, LegKinematics
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, dot, rotations
from manikin.recordings.readers.marker_sets import SIDES
from manikin.walking.gait.blend import GaitFrames


@dataclass(eq=False)
class FootState:
    """State of a foot from one instant to the next; corrections are added to the pose that the gait has.

    Attributes:
        pose: (3,) x, y [m], yaw [rad] where it stands.
        offset: (3,) correction of the last instant, ``before`` and ``after`` are those at the begin and the
            end of the swing.
    """

    pose: FloatArray
    offset: FloatArray
    before: FloatArray
    after: FloatArray
    standing: bool = True

    def lifted(self, swing: float, target: FloatArray) -> None:
        """Begin a swing to a correction (3,); after half of it the foot, which just stood, keeps its own."""
        self.standing, self.before = False, self.offset
        self.after = self.offset if swing > 0.5 else target

    def update(self, wanted: FloatArray, swing: float) -> None:
        """Go on to where the gait has the foot (3,), at a share of the swing, -1 while it stands."""
        if swing >= 0.0:
            share = float(smooth_step(np.array(swing)))
            self.offset = (1.0 - share) * self.before + share * self.after
            return
        if not self.standing:
            self.pose, self.standing = wanted + self.after, True
        self.offset = self.pose - wanted
        self.offset[2] = (self.offset[2] + np.pi) % (2.0 * np.pi) - np.pi


@dataclass(frozen=True, eq=False)
class Sole:
    """Points of either sole of a human in the foot's frame.

    Attributes:
        centre: Middle of the whole sole, ahead of the ankle [m]; so are ``heel``, its rear end (negative),
            and ``ball``, the line of the toe hinges.
        toes: Distance from there to the front end [m].
        depth: Depth below the ankle [m].
    """

    centre: float
    heel: float
    ball: float
    toes: float
    depth: float
    half_width: float

    @classmethod
    def of_body(cls, body: BodyModel) -> Self:
        """Sole of a human; a body without measured soles is refused."""
        if body.sole_length is None or body.sole_width is None:
            raise BodyError(f"body {body.name!r} has no soles; valid: a human")
        centre, _, height = body.effector("left_foot").translation.tolist()
        heel, ball = centre - 0.5 * body.sole_length, float(body.segment("left_toes").origin[0])
        return cls(centre, heel, ball, heel + body.sole_length - ball, -height, 0.5 * body.sole_width)


@dataclass(frozen=True, eq=False)
class FootPlacement:
    """Feet by the pose of the sole on the floor, as if it were put flat over the end it stands on.

    A foot that rolls from heel to ball without sliding keeps its ``point``: with its toes up it turns about
    the heel, with its heel up about the ball.

    Attributes:
        point: (..., 2) where the middle of the flat sole would be [m].
        yaw: (...) direction of the toes [rad].
        pitch: (...) heel up is positive [rad].
        roll: (...) left edge up is positive [rad].
        clearance: (...) height of the lowest point [m].
    """

    point: FloatArray
    yaw: FloatArray
    pitch: FloatArray
    roll: FloatArray
    clearance: FloatArray

    @classmethod
    def of_foot(cls, sole: Sole, foot: FloatArray, ankle: FloatArray) -> Self:
        """Placements of feet with orientations (..., 3, 3), foot to world, and origins (..., 3) [m]."""
        yaw = np.arctan2(foot[..., 1, 0], foot[..., 0, 0])
        pitch = -np.arcsin(np.clip(foot[..., 2, 0], -1.0, 1.0))
        roll = np.arctan2(foot[..., 2, 1], foot[..., 2, 2])
        pivot = np.where(pitch > 0.0, sole.ball, sole.heel)
        place = ankle + pivot[..., None] * foot[..., 0] - sole.depth * foot[..., 2]
        clearance = place[..., 2] - _edge(sole, pitch, roll)
        return cls(place[..., :2] + _flat(sole, pivot, yaw), yaw, pitch, roll, clearance)

    def turned(self, sole: Sole, angle: FloatArray) -> Self:
        """The feet turned about the end they stand on, heel or ball, by (...) angles [rad]."""
        pivot, yaw = np.where(self.pitch > 0.0, sole.ball, sole.heel), self.yaw + angle
        point = self.point - _flat(sole, pivot, self.yaw) + _flat(sole, pivot, yaw)
        return replace(self, point=point, yaw=yaw)

    def to_foot(self, sole: Sole) -> tuple[FloatArray, FloatArray]:
        """(..., 3, 3) orientations, foot to world, and (..., 3) origins (ankles) [m]."""
        foot = rotations(self.yaw, self.pitch, self.roll)
        pivot = np.where(self.pitch > 0.0, sole.ball, sole.heel)
        place = np.empty((*pivot.shape, 3))
        place[..., :2] = self.point - _flat(sole, pivot, self.yaw)
        place[..., 2] = self.clearance + _edge(sole, self.pitch, self.roll)
        return foot, place - pivot[..., None] * foot[..., 0] + sole.depth * foot[..., 2]


def _flat(sole: Sole, pivot: FloatArray, yaw: FloatArray) -> FloatArray:
    """(..., 2) from the pivot to the middle of the flat sole [m]."""
    return (sole.centre - pivot)[..., None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)


def _edge(sole: Sole, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(...) height of the sole's middle line above its lower edge [m]."""
    return sole.half_width * np.abs(np.sin(roll)) * np.cos(pitch)


FLAT = np.deg2rad(4.0)
"""A standing foot pitched by less than this is put flat, more or less [rad]."""

LEAVING, LANDING, LIFT = 0.2, 0.2, 0.15
"""Shares of the swing in which a foot leaves, and in which it reaches, the floor; least lift of a foot, as a
share of the distance by which its step is corrected [-]."""

STRAIGHTENING = 2.5
"""Toes are straight again at this height over their length; at 1 they would leave the floor no sooner than
they must, faster than toes can move."""

HEEL_UP, MOST_HEEL, OFF_FLOOR = np.deg2rad(20.0), np.deg2rad(20.0), 0.05
"""A standing foot with its heel up by the first rolls on for its leg, with less heel the less so, by the
second at most [rad]; one that is higher than the third does not [m]."""

_YIELDING = ("hip_rotation", "ankle_dorsiflexion", "ankle_inversion")


def smooth_step(share: FloatArray) -> FloatArray:
    """From 0 to 1 with no slope and no curvature at the ends; outside of them constant."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 + s * (6.0 * s - 15.0))


class Legs:
    """Both legs of a body: feet from postures, and postures from feet; left first, then right."""

    def __init__(self, body: BodyModel) -> None:
        """Take lengths and soles from a human."""
        self._body, self._legs, self._sole = body, LegKinematics(body), Sole.of_body(body)
        self._toes, self._hips = (
            np.array([body.joint_index(f"{side}_{hinge}") for side in SIDES])
            for hinge in ("toe_extension", "hip_flexion")
        )
        self._lumbar = body.joint_index("lumbar_flexion")

    def feet(self, frames: GaitFrames) -> FootPlacement:
        """(2, n) placements of the feet in the gait."""
        return FootPlacement.of_foot(self._sole, *self._legs.feet(frames.pelvis, frames.place, frames.angles))

    def reached(
        self, frames: GaitFrames, feet: FootPlacement, least: FloatArray | float = 0.0
    ) -> tuple[FloatArray, FloatArray]:
        """(n, nq) postures with the feet at (2, n) placements, and (n,) sinking of the pelvis [m].

        The pelvis sinks where a leg is too short, by ``least`` [m] or more, and tilts forward where a hip
        does not extend far enough. A foot whose ankle turns no further rolls over its edge, heel or ball.
        """
        angles, feet = frames.angles, self._with_heels_up(frames, feet)
        for last in (False, False, True):
            angles, sink = self._legs_to(frames, feet, angles, least)
            excess = angles - np.minimum(np.maximum(angles, self._body.lower), self._body.upper)
            excess[:, self._hips] = 0.0
            if last or not np.any(excess[:, self._legs.slots]):
                break
            feet, angles = self._yielding(feet, angles, excess)
        q = np.empty((len(sink), self._body.nq))
        q[:, :3], q[:, 3:7] = frames.place, frames.turn
        q[:, 2] -= sink
        # Toes stay above the floor while the heel is up, and straighten as the foot rises.
        free = np.arcsin(np.clip(feet.clearance / (STRAIGHTENING * self._sole.toes), 0.0, 1.0))
        angles[:, self._toes] = np.maximum(feet.pitch - free, 0.0).T
        self._tilt(q, angles)
        q[:, 7:] = np.minimum(np.maximum(angles, self._body.lower), self._body.upper)
        return q, sink

    def _with_heels_up(self, frames: GaitFrames, feet: FootPlacement) -> FootPlacement:
        """Feet that roll on over the ball where a leg is longer than the gait has it: knees stay as bent.

        One step of Newton's method on the distance of the ankle from the hip, which the pitch shortens.
        """
        share = smooth_step(feet.pitch / HEEL_UP) * smooth_step(1.0 - feet.clearance / OFF_FLOOR)
        if not np.any(share):
            return feet
        foot, ankle = feet.to_foot(self._sole)
        line = ankle - self._legs.hips(frames.pelvis, frames.place)
        length = np.sqrt(dot(line, line))
        knees = frames.angles[:, self._legs.slots[:, HINGES.index("knee_flexion")]].T
        shortens = -dot(line, self._sole.ball * foot[..., 2] + self._sole.depth * foot[..., 0]) / length
        more = (length - self._legs.length_at(knees)) / np.maximum(shortens, 0.5 * self._sole.ball)
        return replace(feet, pitch=feet.pitch + share * np.clip(more, 0.0, MOST_HEEL))

    def _legs_to(
        self, frames: GaitFrames, feet: FootPlacement, angles: FloatArray, least: FloatArray | float
    ) -> tuple[FloatArray, FloatArray]:
        """Angles (n, h), within the limits or not, and sinking of the pelvis (n,) [m]."""
        foot, ankle = feet.to_foot(self._sole)
        hips = self._legs.hips(frames.pelvis, frames.place)
        away = np.sum((hips - ankle)[..., :2] ** 2, axis=-1)
        highest = ankle[..., 2] + np.sqrt(np.maximum(self._legs.length**2 - away, 0.0))
        sink = np.maximum((hips[..., 2] - highest).max(axis=0), least)
        place = frames.place.copy()
        place[:, 2] -= sink
        return self._legs.angles(frames.pelvis, place, foot, ankle, angles), sink

    def _yielding(
        self, feet: FootPlacement, angles: FloatArray, excess: FloatArray
    ) -> tuple[FootPlacement, FloatArray]:
        """Feet and knee rotations that ask less of joints at the ends of their ranges.

        A foot rolls over its edge, heel or ball where the ankle turns no further; the knee takes over what
        the hip cannot rotate, and the foot turns about its heel or ball for what the knee cannot either.
        """
        over = np.moveaxis(excess[:, self._legs.slots], 0, 1)
        hip, ankle, inversion = (over[..., HINGES.index(name)] for name in _YIELDING)
        angles = angles.copy()
        knees = self._legs.slots[:, HINGES.index("knee_rotation")]
        wanted = angles[:, knees] + hip.T
        angles[:, knees] = np.clip(wanted, self._body.lower[knees], self._body.upper[knees])
        side = np.array([[1.0], [-1.0]])
        turned = feet.turned(self._sole, side * (wanted - angles[:, knees]).T)
        return replace(turned, pitch=feet.pitch + ankle, roll=feet.roll + side * inversion), angles

    def _tilt(self, q: FloatArray, angles: FloatArray) -> None:
        """Tilt the pelvis about the line of the hip joints; hips and spine make up for it."""
        lower = self._body.lower
        tilt = np.maximum((lower[self._hips] - angles[:, self._hips]).max(axis=1), 0.0)
        tilt = np.minimum(tilt, np.maximum(angles[:, self._lumbar] - lower[self._lumbar], 0.0))
        if np.any(tilt):
            angles[:, self._hips] += tilt[:, None]
            angles[:, self._lumbar] -= tilt
            x, y, z, w = q[:, 3:7].T
            s, c = np.sin(0.5 * tilt), np.cos(0.5 * tilt)
            q[:, 3:7] = np.column_stack([x * c - z * s, y * c + w * s, z * c + x * s, w * c - y * s])


def corrected(
    wanted: FootPlacement, swing: FloatArray, offset: FloatArray, distance: FloatArray
) -> FootPlacement:
    """Feet (...) of the gait moved by their corrections, on the floor where they stand.

    Of the swing are (...) shares [-], -1 while they stand; offsets are (..., 3) x, y [m] and yaw [rad],
    distances (...) the correction of the whole step [m].
    """
    rising = smooth_step(swing / LEAVING) * smooth_step((1.0 - swing) / LANDING)
    up = np.where(swing < 0.0, 0.0, rising)
    flat = wanted.pitch - FLAT * np.tanh(wanted.pitch / FLAT)
    return FootPlacement(
        point=wanted.point + offset[..., :2],
        yaw=wanted.yaw + offset[..., 2],
        pitch=up * wanted.pitch + (1.0 - up) * flat,
        roll=up * wanted.roll,
        clearance=up * (np.maximum(wanted.clearance, 0.0) + LIFT * distance),
    )


def poses(feet: FootPlacement) -> FloatArray:
    """(..., n, 3) x, y [m] and yaw [rad] of feet at n instants, the yaw continuous."""
    return np.concatenate([feet.point, np.unwrap(feet.yaw)[..., None]], axis=-1)


def put_in_place(wanted: FootPlacement, swing: FloatArray) -> FootPlacement:
    """The feet (2, n) of a whole walk: in every stance at the mean of where the gait has them.

    In the first stance they are where they were at the start, in the last one where they come to rest. The
    swing (2, n) is as of :func:`corrected`.
    """
    both = [_steps(path, share) for path, share in zip(poses(wanted), swing, strict=True)]
    offset, distance = (np.array(values) for values in zip(*both, strict=True))
    return corrected(wanted, swing, offset, distance)


def _steps(path: FloatArray, swing: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corrections (n, 3) of one foot, and the correction of the whole step at each instant (n,) [m]."""
    n, standing = len(swing), swing < 0.0
    offset, distance = np.zeros((n, 3)), np.zeros(n)
    for first, last in mask_runs(standing):
        anchor = path[0] if first == 0 else path[-1] if last == n else path[first:last].mean(axis=0)
        offset[first:last] = anchor - path[first:last]
    for first, last in mask_runs(~standing):
        before = offset[first - 1] if first else np.zeros(3)
        after = offset[last] if last < n else np.zeros(3)
        share = smooth_step(swing[first:last])[:, None]
        offset[first:last] = (1.0 - share) * before + share * after
        distance[first:last] = np.hypot(*(after - before)[:2])
    return offset, distance
