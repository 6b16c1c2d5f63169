"""Forward and inverse kinematics of a human's legs in closed form, many postures at once."""

import numpy as np

from manikin.body import BodyModel
from manikin.body.limbs import REFLECTION, are_mirrored, limb_named
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, cross, dot, matrix

HINGES = (
    "hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "knee_rotation",
    "ankle_dorsiflexion", "ankle_inversion",
)  # fmt: skip

LEAST_BEND = np.deg2rad(5.0)
"""A leg that cannot reach its foot is stretched to this [rad]; nearly straight knees jerk."""

_AXES = ((0, -1, 0), (1, 0, 0), (0, 0, -1), (0, 1, 0), (0, 0, -1), (0, -1, 0), (-1, 0, 0))
"""Axes of the left leg's hinges; those of the right one are reflected."""

_KNEE_ROTATION = HINGES.index("knee_rotation")
_REFLECT = np.outer(REFLECTION, REFLECTION)


class LegKinematics:
    """Forward and inverse kinematics of both legs of :func:`manikin.body.human`, without iteration.

    The law of cosines gives the knee; the turn of the leg about the line from hip to ankle and the two angles
    of the ankle give the foot its orientation, with the knee's rotation kept as it is. The right leg is the
    left one of a reflected body. Arrays of both legs have a first axis of length 2: left, right.
    """

    def __init__(self, body: BodyModel) -> None:
        """Take the lengths from a human; BodyError if its legs have other hinges or differ."""
        sides = [[body.segment(f"{side}_{name}") for name in ("thigh", "leg", "foot")]
                 for side in ("left", "right")]  # fmt: skip
        left = [hinge for part in sides[0] for hinge in part.hinges]
        same_names = [hinge.name for hinge in left] == [f"left_{name}" for name in HINGES]
        if not same_names or not np.allclose([hinge.axis for hinge in left], _AXES):
            raise BodyError(f"legs of body {body.name!r} have other hinges; valid: those of a human")
        if not are_mirrored(body, limb_named(body, "left_leg"), limb_named(body, "right_leg")):
            raise BodyError(f"legs of body {body.name!r} differ; valid: equal ones")
        self.slots = np.array([
            [body.joint_index(hinge.name) for part in parts for hinge in part.hinges] for parts in sides
        ])  # fmt: skip
        """(2, 7) places of the hinges among all hinges."""
        self.hip = np.array([parts[0].origin for parts in sides])
        """(2, 3) hip joints in the pelvis [m]."""
        self.thigh, self.shank = (-float(part.origin[2]) for part in sides[0][1:])
        self.length = float(self.length_at(np.array(LEAST_BEND)))
        """Largest distance of the ankle from the hip [m]."""

    def length_at(self, bend: FloatArray) -> FloatArray:
        """(...) distance of the ankle from the hip [m] at (...) angles of the knee [rad]."""
        a, b = self.thigh, self.shank
        return np.sqrt(a**2 + b**2 + 2.0 * a * b * np.cos(bend))

    def hips(self, pelvis: FloatArray, place: FloatArray) -> FloatArray:
        """(2, n, 3) places of the hip joints of (n, 3, 3) turns and (n, 3) origins of the pelvis [m]."""
        return place + np.einsum("nij,kj->kni", pelvis, self.hip)

    def feet(
        self, pelvis: FloatArray, place: FloatArray, angles: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Rotations (2, n, 3, 3) and origins (2, n, 3) [m] of the feet in the world, see :meth:`angles`."""
        thigh, shank = self.segments(pelvis, angles)
        a = angles[:, self.slots].transpose(2, 1, 0)
        foot = _reflect_right(_reflect_right(shank) @ _turn(-a[5], "y") @ _turn(-a[6], "x"))
        ankle = self.hips(pelvis, place) - self.thigh * thigh[..., 2] - self.shank * shank[..., 2]
        return foot, ankle

    def segments(self, pelvis: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations (2, n, 3, 3) of thighs and shanks to the world, see :meth:`angles`."""
        a = angles[:, self.slots].transpose(2, 1, 0)
        thigh = _reflected(pelvis) @ bend(-a[0], a[1], -a[2])
        shank = thigh @ _turn(a[3], "y") @ _turn(-a[4], "z")
        return _reflect_right(thigh), _reflect_right(shank)

    def angles(
        self, pelvis: FloatArray, place: FloatArray, foot: FloatArray, ankle: FloatArray, angles: FloatArray
    ) -> FloatArray:
        """(n, h) angles, within limits or not, that place the feet, or come as near as possible [rad].

        Args:
            pelvis: (n, 3, 3) from the pelvis' axes to the world's.
            place: (n, 3) pelvis' origin [m].
            foot: (2, n, 3, 3) from the feet's axes to the world's.
            ankle: (2, n, 3) the feet's origins [m].
            angles: (n, h) of all hinges; the rotations of the knees are kept [rad].
        """
        rotation = angles[:, self.slots[:, _KNEE_ROTATION]].T
        result = angles.copy()
        result[:, self.slots] = self.bent(pelvis, place, foot, ankle, rotation)[0].transpose(1, 0, 2)
        return result

    def bent(
        self, pelvis: FloatArray, place: FloatArray, foot: FloatArray, ankle: FloatArray, rotation: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Angles (2, n, 7), and rotations (2, n, 3, 3) of thighs and shanks to the world.

        As :meth:`angles`, with rotations (2, n) of the knees [rad].
        """
        line = ankle - self.hips(pelvis, place)
        line[1] *= REFLECTION
        pelvis, foot = _reflected(pelvis), _reflect_right(foot)
        size = np.sqrt(dot(line, line))
        reach = np.clip(size, abs(self.thigh - self.shank) + 1e-6, self.length)
        a, b = self.thigh, self.shank
        knee = np.arccos(np.clip((reach**2 - a**2 - b**2) / (2.0 * a * b), -1.0, 1.0))
        # Angle at the hip between the thigh and the line to the ankle, which lies behind it.
        behind = np.arctan2(b * np.sin(knee), a + b * np.cos(knee))
        plane = _plane(-line / size[..., None], pelvis[..., 1], foot[..., 0], rotation, knee - behind)
        thigh = plane @ _turn(-behind, "y")
        shank = thigh @ _turn(knee, "y") @ _turn(-rotation, "z")
        hip, ankle_turn = np.swapaxes(pelvis, -1, -2) @ thigh, np.swapaxes(shank, -1, -2) @ foot
        legs = np.stack([
            np.arctan2(-hip[..., 0, 2], hip[..., 2, 2]),
            np.arcsin(np.clip(-hip[..., 1, 2], -1.0, 1.0)),
            np.arctan2(-hip[..., 1, 0], hip[..., 1, 1]),
            knee,
            rotation,
            np.arctan2(ankle_turn[..., 2, 0], ankle_turn[..., 0, 0]),
            np.arctan2(ankle_turn[..., 1, 2], ankle_turn[..., 1, 1]),
        ], axis=-1)  # fmt: skip
        return legs, _reflect_right(thigh), _reflect_right(shank)


def _plane(
    up: FloatArray, aside: FloatArray, toes: FloatArray, rotation: FloatArray, lean: FloatArray
) -> FloatArray:
    """(..., 3, 3) axes (front, side, up) of the plane in which the leg bends.

    It is turned about the line from hip to ankle, ``up`` (..., 3), so that the shank's left-right axis, after
    the knee's rotation and at its lean from the line (...) [rad], is perpendicular to the foot's long axis
    ``toes``, as the two axes of the ankle demand; ``aside`` is roughly to the left.
    """
    side = aside - dot(aside, up)[..., None] * up
    side /= np.sqrt(dot(side, side))[..., None]
    front = cross(side, up)
    # The shank's y axis in the frame (front, side, up).
    sine = np.sin(rotation)
    c1, c2, c3 = sine * np.cos(lean), np.cos(rotation), -sine * np.sin(lean)
    f1, f2, f3 = dot(toes, front), dot(toes, side), dot(toes, up)
    along, across = c1 * f1 + c2 * f2, c1 * f2 - c2 * f1
    amount = np.maximum(np.hypot(along, across), 1e-9)
    phase = np.arctan2(across, along)
    offset = np.arccos(np.clip(-c3 * f3 / amount, -1.0, 1.0))
    left, right = phase + offset, phase - offset
    ahead = np.cos(left) * f1 + np.sin(left) * f2 >= np.cos(right) * f1 + np.sin(right) * f2
    turn = np.where(ahead, left, right)
    cos, sin = np.cos(turn)[..., None], np.sin(turn)[..., None]
    plane = np.empty((*up.shape, 3))
    plane[..., 0], plane[..., 1], plane[..., 2] = cos * front + sin * side, cos * side - sin * front, up
    return plane


def _reflected(turns: FloatArray) -> FloatArray:
    """(2, n, 3, 3) turns (n, 3, 3), and what they are in the reflected body."""
    return np.stack([turns, turns * _REFLECT])


def _reflect_right(turns: FloatArray) -> FloatArray:
    """(2, n, 3, 3) with the second half reflected, to and from the reflected body."""
    reflected = turns.copy()
    reflected[1] *= _REFLECT
    return reflected


def bend(flexion: FloatArray, side_bend: FloatArray, twist: FloatArray) -> FloatArray:
    """(..., 3, 3) turns about y, then x, then z, as of the spine; the hip turns about -y, x, -z."""
    cy, sy = np.cos(flexion), np.sin(flexion)
    cx, sx = np.cos(side_bend), np.sin(side_bend)
    cz, sz = np.cos(twist), np.sin(twist)
    return matrix([
        [cy * cz + sy * sx * sz, -cy * sz + sy * sx * cz, sy * cx],
        [cx * sz, cx * cz, -sx],
        [-sy * cz + cy * sx * sz, sy * sz + cy * sx * cz, cy * cx],
    ])  # fmt: skip


def _turn(angle: FloatArray, axis: str) -> FloatArray:
    """(..., 3, 3) rotations about x, y or z."""
    about = "xyz".index(axis)
    first, second = (about + 1) % 3, (about + 2) % 3
    turn = np.zeros((*angle.shape, 3, 3))
    cosine, sine = np.cos(angle), np.sin(angle)
    turn[..., first, first] = turn[..., second, second] = cosine
    turn[..., second, first], turn[..., first, second] = sine, -sine
    turn[..., about, about] = 1.0
    return turn
