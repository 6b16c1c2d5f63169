"""A motion as a BVH file.

BVH has y up and no unit; programs take it for centimetres. Ours: x to the body's left, y up, z forward,
centimetres, degrees, ``(X, Y, Z) = 100 (y, z, x)``, a rotation of our world (x forward, y left, z up) and no
mirror image. Every joint has three rotation channels: the segment's hinges in their order, then the axes it
does not have, at zero. A BVH rotation is the product of its channels from left to right, like our hinges.
"""

from __future__ import annotations

import warnings
from io import StringIO

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Segment
from manikin.body.segments import end_of
from manikin.errors import MotionFileError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray

TO_BVH: FloatArray = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Rotation of our world's axes to BVH's: X = y (left), Y = z (up), Z = x (forward)."""
TO_BVH.setflags(write=False)

CENTIMETRES = 100.0
_ROOT_ORDER = "YXZ"  # yaw, pitch, roll: the singularity is a pelvis that looks straight up or down


def to_bvh(body: BodyModel, motion: Motion) -> str:
    """Text of a BVH file of a motion that is evenly sampled; see :func:`resample`.

    Raises:
        MotionFileError: If the motion is not the body's, or is not evenly sampled.
    """
    if motion.joint_names != body.joint_names:
        raise MotionFileError("motion has other joints than the body; valid: the body's own motion")
    text = StringIO()
    text.write("HIERARCHY\n")
    order = _write_joint(text, body.segments[0], body, 0)
    text.write(f"MOTION\nFrames: {len(motion.time)}\nFrame Time: {_frame_time(motion):.9g}\n")
    position = CENTIMETRES * motion.q[:, :3] @ TO_BVH.T
    rotation = TO_BVH @ Rotation.from_quat(motion.q[:, 3:7]).as_matrix() @ TO_BVH.T
    turns = (_angles(segment, body, motion) for segment in order[1:])
    np.savetxt(text, np.hstack([position, _euler(rotation, _ROOT_ORDER), *turns]), fmt="%.7f")
    return text.getvalue()


def _frame_time(motion: Motion) -> float:
    if len(motion.time) == 1:
        return 0.01
    steps = np.diff(motion.time)
    if np.ptp(steps) > 1e-6:
        every = f"{steps.min():.6g} to {steps.max():.6g} s"
        raise MotionFileError(f"motion is sampled every {every}; valid: one rate (resample it)")
    return float(motion.duration / len(steps))


def _channels(segment: Segment) -> tuple[str, list[float]]:
    """Rotation axes of a segment's three channels, such as ``"XZY"``, and the signs of its hinges about them.

    No signs where axes are oblique or repeated, which cannot be channels: the whole rotation is split then.
    """
    order, signs = "", []
    for hinge in segment.hinges:
        axis = TO_BVH @ hinge.axis
        nearest = int(np.argmax(np.abs(axis)))
        if not np.isclose(abs(axis[nearest]), 1.0, rtol=0.0, atol=1e-12) or "XYZ"[nearest] in order:
            return "ZXY", []
        order += "XYZ"[nearest]
        signs.append(float(np.sign(axis[nearest])))
    return order + "".join(axis for axis in "ZXY" if axis not in order), signs + [1.0] * (3 - len(signs))


def _write_joint(text: StringIO, segment: Segment, body: BodyModel, depth: int) -> list[Segment]:
    """Write a segment and what hangs on it, and return them in the order of the file."""
    indent, inner = "\t" * depth, "\t" * (depth + 1)
    root = segment.parent is None
    order = _ROOT_ORDER if root else _channels(segment)[0]
    channels = [*(f"{axis}position" for axis in "XYZ" if root), *(f"{axis}rotation" for axis in order)]
    offset = np.zeros(3) if root else CENTIMETRES * (TO_BVH @ segment.origin)
    text.write(f"{indent}{'ROOT' if root else 'JOINT'} {segment.name}\n{indent}{{\n")
    text.write(f"{inner}OFFSET {_numbers(offset)}\n{inner}CHANNELS {len(channels)} {' '.join(channels)}\n")
    order = [segment]
    for child in (item for item in body.segments if item.parent == segment.name):
        order += _write_joint(text, child, body, depth + 1)
    if len(order) == 1:
        end = CENTIMETRES * (TO_BVH @ end_of(segment))
        text.write(f"{inner}End Site\n{inner}{{\n{inner}\tOFFSET {_numbers(end)}\n{inner}}}\n")
    text.write(f"{indent}}}\n")
    return order


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.7f}" for value in values)


def _angles(segment: Segment, body: BodyModel, motion: Motion) -> FloatArray:
    """(n, 3) channel values of a segment [deg]."""
    order, signs = _channels(segment)
    angles = [motion.q[:, 7 + body.joint_index(hinge.name)] for hinge in segment.hinges]
    if signs:
        angles += [np.zeros(len(motion.time))] * (3 - len(angles))
        return np.degrees(np.column_stack(angles) * signs)
    rotation = np.broadcast_to(np.eye(3), (len(motion.time), 3, 3))
    for hinge, angle in zip(segment.hinges, angles, strict=True):
        rotation = rotation @ Rotation.from_rotvec(angle[:, None] * hinge.axis).as_matrix()
    return _euler(TO_BVH @ rotation @ TO_BVH.T, order)


def _euler(rotation: FloatArray, order: str) -> FloatArray:
    """(n, 3) intrinsic angles [deg] without jumps of a turn between samples."""
    with warnings.catch_warnings():
        # At the singularity SciPy sets the third angle to zero: one of the right answers.
        warnings.filterwarnings("ignore", "Gimbal lock", UserWarning)
        angles = Rotation.from_matrix(rotation).as_euler(order)
    return np.degrees(np.unwrap(angles, axis=0))
