"""A foot on or over the floor: where its sole is, and over which end it rolls."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from manikin.body import BodyModel
from manikin.errors import BodyError
from manikin.locomotion.turns import rotations
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Sole:
    """Points of either sole of a human in the foot's frame.

    Attributes:
        centre: Of the whole sole ahead of the ankle [m].
        heel: Rear end, behind the ankle [m].
        ball: Line of the toe hinges, ahead of the ankle [m].
        toes: From there to the front end [m].
        depth: Below the ankle [m].
        half_width: [m].
    """

    centre: float
    heel: float
    ball: float
    toes: float
    depth: float
    half_width: float

    @classmethod
    def of_body(cls, body: BodyModel) -> Self:
        """Sole of a human.

        Raises:
            BodyError: If the body has no measured soles.
        """
        if body.sole_length is None or body.sole_width is None:
            raise BodyError(f"body {body.name!r} has no soles; valid: a human")
        centre = body.effector("left_foot").translation
        heel, ball = float(centre[0]) - 0.5 * body.sole_length, float(body.segment("left_toes").origin[0])
        return cls(
            centre=float(centre[0]), heel=heel, ball=ball, toes=heel + body.sole_length - ball,
            depth=-float(centre[2]), half_width=0.5 * body.sole_width,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class FootPlacement:
    """Feet by the place of the sole on the floor, as if it were put flat over the end it stands on.

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
        """Of feet with orientations (..., 3, 3), foot to world, and origins (..., 3) [m]."""
        yaw = np.arctan2(foot[..., 1, 0], foot[..., 0, 0])
        pitch = -np.arcsin(np.clip(foot[..., 2, 0], -1.0, 1.0))
        roll = np.arctan2(foot[..., 2, 1], foot[..., 2, 2])
        pivot = np.where(pitch > 0.0, sole.ball, sole.heel)
        place = ankle + pivot[..., None] * foot[..., 0] - sole.depth * foot[..., 2]
        clearance = place[..., 2] - _edge(sole, pitch, roll)
        return cls(place[..., :2] + _flat(sole, pivot, yaw), yaw, pitch, roll, clearance)

    def turned(self, sole: Sole, angle: FloatArray) -> Self:
        """The feet turned about the end they stand on, heel or ball, by (...) angles [rad]."""
        pivot = np.where(self.pitch > 0.0, sole.ball, sole.heel)
        yaw = self.yaw + angle
        return replace(
            self, point=self.point - _flat(sole, pivot, self.yaw) + _flat(sole, pivot, yaw), yaw=yaw
        )

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
    found = np.empty((*yaw.shape, 2))
    found[..., 0], found[..., 1] = np.cos(yaw), np.sin(yaw)
    return (sole.centre - pivot)[..., None] * found


def _edge(sole: Sole, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(...) height of the sole's middle line above its lower edge [m]."""
    return sole.half_width * np.abs(np.sin(roll)) * np.cos(pitch)
