"""A foot on or over the floor: where its sole is, and over which end it rolls."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from manikin.body import BodyModel
from manikin.errors import BodyError
from manikin.locomotion.turns import rotations
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Sole:
    """Points of a human's sole in the foot's frame.

    Attributes:
        centre: Of the whole sole ahead of the ankle [m].
        heel: Rear end, behind the ankle [m].
        ball: Line of the toe hinges, ahead of the ankle [m].
        depth: Below the ankle [m].
        half_width: [m].
    """

    centre: float
    heel: float
    ball: float
    depth: float
    half_width: float

    @classmethod
    def of_body(cls, body: BodyModel, side: str) -> Self:
        """Sole of a human.

        Raises:
            BodyError: If the body has no measured soles.
        """
        if body.sole_length is None or body.sole_width is None:
            raise BodyError(f"body {body.name!r} has no soles; valid: a human")
        centre = body.effector(f"{side}_foot").translation
        return cls(
            centre=float(centre[0]),
            heel=float(centre[0]) - 0.5 * body.sole_length,
            ball=float(body.segment(f"{side}_toes").origin[0]),
            depth=-float(centre[2]),
            half_width=0.5 * body.sole_width,
        )


@dataclass(frozen=True, eq=False)
class FootPlacement:
    """n feet by the place of the sole on the floor, as if it were put flat over the end it stands on.

    A foot that rolls from heel to ball without sliding keeps its ``point``: with its toes up it turns about
    the heel, with its heel up about the ball.

    Attributes:
        point: (n, 2) where the middle of the flat sole would be [m].
        yaw: (n,) direction of the toes [rad].
        pitch: (n,) heel up is positive [rad].
        roll: (n,) left edge up is positive [rad].
        clearance: (n,) height of the lowest point [m].
    """

    point: FloatArray
    yaw: FloatArray
    pitch: FloatArray
    roll: FloatArray
    clearance: FloatArray

    @classmethod
    def of_foot(cls, sole: Sole, foot: FloatArray, ankle: FloatArray) -> Self:
        """Of feet with orientations (n, 3, 3), foot to world, and origins (n, 3) [m]."""
        yaw = np.arctan2(foot[:, 1, 0], foot[:, 0, 0])
        pitch = -np.arcsin(np.clip(foot[:, 2, 0], -1.0, 1.0))
        roll = np.arctan2(foot[:, 2, 1], foot[:, 2, 2])
        pivot = np.where(pitch > 0.0, sole.ball, sole.heel)
        place = ankle + pivot[:, None] * foot[:, :, 0] - sole.depth * foot[:, :, 2]
        flat = (sole.centre - pivot)[:, None] * np.column_stack([np.cos(yaw), np.sin(yaw)])
        clearance = place[:, 2] - _edge(sole, pitch, roll)
        return cls(place[:, :2] + flat, yaw, pitch, roll, clearance)

    def to_foot(self, sole: Sole) -> tuple[FloatArray, FloatArray]:
        """(n, 3, 3) orientations, foot to world, and (n, 3) origins (ankles) [m]."""
        foot = rotations(self.yaw, self.pitch, self.roll)
        pivot = np.where(self.pitch > 0.0, sole.ball, sole.heel)
        flat = (sole.centre - pivot)[:, None] * np.column_stack([np.cos(self.yaw), np.sin(self.yaw)])
        height = self.clearance + _edge(sole, self.pitch, self.roll)
        place = np.column_stack([self.point - flat, height])
        return foot, place - pivot[:, None] * foot[:, :, 0] + sole.depth * foot[:, :, 2]


def _edge(sole: Sole, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """(n,) height of the sole's middle line above its lower edge [m]."""
    return sole.half_width * np.abs(np.sin(roll)) * np.cos(pitch)

