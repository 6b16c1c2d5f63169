"""A human's leg in closed form: where the foot is, and the angles that put it somewhere; many at once."""

import numpy as np

from manikin.body import BodyModel
from manikin.body.ball_joint import ball_angles, ball_rotation
from manikin.errors import BodyError
from manikin.spatial import FloatArray

HINGES = (
    "hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "knee_rotation",
    "ankle_dorsiflexion", "ankle_inversion",
)  # fmt: skip

LEAST_BEND = np.deg2rad(2.0)
"""A leg that cannot reach its foot is stretched to this [rad]; nearly straight knees jerk."""


class LegKinematics:
    """Forward and inverse kinematics of one leg of :func:`manikin.body.human`, without iteration.

    The chain is hip (flexion, abduction, rotation), knee (flexion about y, rotation about the shank), ankle
    (dorsiflexion about y, inversion about x). The law of cosines gives the knee; the turn of the leg about
    the line from hip to ankle and the two angles of the ankle give the foot its orientation, with the knee's
    rotation kept as it is.
    """

    def __init__(self, body: BodyModel, side: str) -> None:
        """Take the lengths and axes from a body.

        Args:
            body: A human.
            side: ``"left"`` or ``"right"``.

        Raises:
            BodyError: If its leg has other hinges.
        """
        parts = [body.segment(f"{side}_{name}") for name in ("thigh", "leg", "foot")]
        found = tuple(hinge.name for part in parts for hinge in part.hinges)
        if found != tuple(f"{side}_{name}" for name in HINGES):
            raise BodyError(f"{side} leg has the hinges {', '.join(found)}; valid: those of a human")
        self.slots = np.array([body.joint_index(name) for name in found])
        """(7,) places of the hinges among all hinges."""
        self.hip = np.array(parts[0].origin)
        """(3,) hip joint in the pelvis [m]."""
        self.thigh, self.shank = (-float(part.origin[2]) for part in parts[1:])
        self._hip_axes = np.array([hinge.axis for hinge in parts[0].hinges])
        self._knee_turn = float(parts[1].hinges[1].axis[2])
        self._roll = float(parts[2].hinges[1].axis[0])
        self._lower, self._upper = body.lower[self.slots], body.upper[self.slots]
        self._middle = 0.5 * (self._lower + self._upper)[:3]
        self.length = float(np.sqrt(
            self.thigh**2 + self.shank**2 + 2.0 * self.thigh * self.shank * np.cos(LEAST_BEND)
        ))  # fmt: skip
        """Largest distance of the ankle from the hip [m]."""

    def foot(self, pelvis: FloatArray, place: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Orientation and origin (ankle) of the foot.

        Args:
            pelvis: (n, 3, 3) from the pelvis' axes to the world's.
            place: (n, 3) pelvis' origin [m].
            angles: (n, 7) of :data:`HINGES` [rad].

        Returns:
            (n, 3, 3) from the foot's axes to the world's, and (n, 3) [m].
        """
        thigh = pelvis @ ball_rotation(self._hip_axes, angles[:, :3])
        shank = thigh @ _about_y(angles[:, 3]) @ _about_z(self._knee_turn * angles[:, 4])
        foot = shank @ _about_y(-angles[:, 5]) @ _about_x(self._roll * angles[:, 6])
        ankle = place + pelvis @ self.hip - self.thigh * thigh[:, :, 2] - self.shank * shank[:, :, 2]
        return foot, ankle

    def angles(
        self, pelvis: FloatArray, place: FloatArray, foot: FloatArray, ankle: FloatArray, rotation: FloatArray
    ) -> FloatArray:
        """Angles within the limits that put the foot there; out of reach, as near as a stretched leg gets.

        Args:
            pelvis: (n, 3, 3) from the pelvis' axes to the world's.
            place: (n, 3) pelvis' origin [m].
            foot: (n, 3, 3) from the foot's axes to the world's.
            ankle: (n, 3) the foot's origin [m].
            rotation: (n,) angle of the knee about the shank, kept [rad].

        Returns:
            (n, 7) of :data:`HINGES` [rad].
        """
        line = ankle - place - pelvis @ self.hip
        size = np.linalg.norm(line, axis=1)
        reach = np.clip(size, abs(self.thigh - self.shank) + 1e-6, self.length)
        a, b = self.thigh, self.shank
        bend = np.arccos(np.clip((reach**2 - a**2 - b**2) / (2.0 * a * b), -1.0, 1.0))
        # Angle at the hip between the thigh and the line to the ankle, which lies behind it.
        behind = np.arctan2(b * np.sin(bend), a + b * np.cos(bend))
        up = -line / size[:, None]
        # Two directions across the line; the leg is turned about it so that the shank's left-right axis
        # is perpendicular to the foot's long axis, as the two axes of the ankle demand.
        side = _across(up, pelvis[:, :, 1])
        front = np.cross(side, up)
        turned = self._knee_turn * rotation
        # The shank's y axis in the frame (front, side, up) of the leg's plane.
        cosine, sine = np.cos(turned), np.sin(turned)
        lean = bend - behind
        c1, c2, c3 = -sine * np.cos(lean), cosine, sine * np.sin(lean)
        f1, f2, f3 = (np.einsum("ni,ni->n", foot[:, :, 0], axis) for axis in (front, side, up))
        along, across = c1 * f1 + c2 * f2, c1 * f2 - c2 * f1
        amount = np.maximum(np.hypot(along, across), 1e-9)
        phase = np.arctan2(across, along)
        offset = np.arccos(np.clip(-c3 * f3 / amount, -1.0, 1.0))
        turn = np.stack([phase + offset, phase - offset])
        ahead = np.cos(turn) * f1 + np.sin(turn) * f2
        turn = np.where(ahead[0] >= ahead[1], turn[0], turn[1])
        cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
        plane = np.stack([cos * front + sin * side, cos * side - sin * front, up], axis=-1)
        thigh = plane @ _about_y(-behind)
        shank = thigh @ _about_y(bend) @ _about_z(turned)
        ankle_turn = shank.transpose(0, 2, 1) @ foot
        found = np.empty((len(line), 7))
        found[:, :3] = ball_angles(self._hip_axes, pelvis.transpose(0, 2, 1) @ thigh, self._middle)
        found[:, 3], found[:, 4] = bend, rotation
        found[:, 5] = np.arctan2(ankle_turn[:, 2, 0], ankle_turn[:, 0, 0])
        found[:, 6] = self._roll * np.arctan2(-ankle_turn[:, 1, 2], ankle_turn[:, 1, 1])
        return np.clip(found, self._lower, self._upper)


def _across(axis: FloatArray, near: FloatArray) -> FloatArray:
    """(n, 3) unit vectors perpendicular to ``axis``, as near to ``near`` as can be."""
    side = near - np.einsum("ni,ni->n", near, axis)[:, None] * axis
    return side / np.linalg.norm(side, axis=1)[:, None]


def _about_x(angle: FloatArray) -> FloatArray:
    return _turn(angle, 1, 2)


def _about_y(angle: FloatArray) -> FloatArray:
    return _turn(angle, 2, 0)


def _about_z(angle: FloatArray) -> FloatArray:
    return _turn(angle, 0, 1)


def _turn(angle: FloatArray, first: int, second: int) -> FloatArray:
    """(n, 3, 3) rotations that carry the first axis towards the second."""
    turn = np.zeros((len(angle), 3, 3))
    turn[:] = np.eye(3)
    cosine, sine = np.cos(angle), np.sin(angle)
    turn[:, first, first] = turn[:, second, second] = cosine
    turn[:, second, first], turn[:, first, second] = sine, -sine
    return turn
