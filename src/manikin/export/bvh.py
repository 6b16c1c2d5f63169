"""Motions as Biovision hierarchy (BVH) files, for animation programs.

BVH has y up and no unit; programs take it for centimetres.  Ours: x to the body's left, y
up, z forward, centimetres, degrees, ``(X, Y, Z) = 100 (y, z, x)``, which is a rotation of
our world (x forward, y left, z up) and no mirror image.  Every joint has three rotation
channels: the segment's hinges in their order, then the axes it does not have, at zero.
A BVH rotation is the product of its channels from left to right, like our hinges.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Segment
from manikin.body.segments import end_of
from manikin.errors import MotionFileError
from manikin.motion import Motion
from manikin.spatial import FloatArray

TO_BVH: FloatArray = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Rotation of our world's axes to BVH's: X = y (left), Y = z (up), Z = x (forward)."""
TO_BVH.setflags(write=False)

CENTIMETRES = 100.0
_ROOT_ORDER = "YXZ"  # yaw, pitch, roll: the singularity is a pelvis that looks straight up or down


@dataclass(frozen=True, eq=False)
class _Joint:
    """Channels of one segment.

    Attributes:
        segment: The segment.
        order: Rotation axes of its three channels, such as ``"XZY"``.
        columns: Index among the hinges of each channel's angle, or None without one.
        signs: +1 or -1 for a hinge about the negative axis.
    """

    segment: Segment
    order: str
    columns: tuple[int | None, ...] | None
    signs: tuple[float, ...]


def to_bvh(body: BodyModel, motion: Motion) -> str:
    """Text of a BVH file.

    Args:
        body: Who moves.
        motion: Evenly sampled; see :func:`manikin.export.resample`.

    Raises:
        MotionFileError: If the motion is not the body's, or is not evenly sampled.
    """
    if motion.joint_names != body.joint_names:
        raise MotionFileError("motion has other joints than the body; valid: the body's own motion")
    joints = _joints(body)
    text = StringIO()
    text.write("HIERARCHY\n")
    _write_joint(text, body.segments[0], joints, 0)
    text.write(f"MOTION\nFrames: {len(motion.time)}\nFrame Time: {_frame_time(motion):.9g}\n")
    order = _depth_first(body)
    frames = np.hstack([_root_channels(motion), *(_angles(joints[s.name], body, motion) for s in order[1:])])
    np.savetxt(text, frames, fmt="%.7f")
    return text.getvalue()


def _frame_time(motion: Motion) -> float:
    if len(motion.time) == 1:
        return 0.01
    steps = np.diff(motion.time)
    if np.ptp(steps) > 1e-6:
        raise MotionFileError(
            f"motion is sampled every {steps.min():.6g} to {steps.max():.6g} s; valid: one rate (resample it)"
        )
    return float(motion.duration / len(steps))


def _joints(body: BodyModel) -> dict[str, _Joint]:
    joints, column = {}, 0
    for segment in body.segments:
        joints[segment.name] = _joint(segment, column)
        column += len(segment.hinges)
    return joints


def _joint(segment: Segment, first_column: int) -> _Joint:
    order, signs = "", []
    for hinge in segment.hinges:
        axis = TO_BVH @ hinge.axis
        nearest = int(np.argmax(np.abs(axis)))
        if not np.isclose(abs(axis[nearest]), 1.0, rtol=0.0, atol=1e-12) or "XYZ"[nearest] in order:
            # Oblique or repeated axes cannot be channels; the whole rotation is split instead.
            return _Joint(segment, "ZXY", None, (1.0, 1.0, 1.0))
        order += "XYZ"[nearest]
        signs.append(float(np.sign(axis[nearest])))
    missing = [axis for axis in "ZXY" if axis not in order]
    columns = tuple(range(first_column, first_column + len(signs))) + (None,) * len(missing)
    return _Joint(segment, order + "".join(missing), columns, (*signs, *(1.0 for _ in missing)))


def _children(body: BodyModel, name: str) -> list[Segment]:
    return [segment for segment in body.segments if segment.parent == name]


def _depth_first(body: BodyModel) -> list[Segment]:
    order, waiting = [], [body.segments[0]]
    while waiting:
        segment = waiting.pop(0)
        order.append(segment)
        waiting = _children(body, segment.name) + waiting
    return order


def _write_joint(text: StringIO, segment: Segment, joints: dict[str, _Joint], depth: int) -> None:
    indent, inner = "\t" * depth, "\t" * (depth + 1)
    root = segment.parent is None
    order = _ROOT_ORDER if root else joints[segment.name].order
    channels = [*(f"{axis}position" for axis in "XYZ" if root), *(f"{axis}rotation" for axis in order)]
    offset = np.zeros(3) if root else CENTIMETRES * (TO_BVH @ segment.origin)
    text.write(f"{indent}{'ROOT' if root else 'JOINT'} {segment.name}\n{indent}{{\n")
    text.write(f"{inner}OFFSET {_numbers(offset)}\n{inner}CHANNELS {len(channels)} {' '.join(channels)}\n")
    children = [joint.segment for joint in joints.values() if joint.segment.parent == segment.name]
    for child in children:
        _write_joint(text, child, joints, depth + 1)
    if not children:
        end = CENTIMETRES * (TO_BVH @ end_of(segment))
        text.write(f"{inner}End Site\n{inner}{{\n{inner}\tOFFSET {_numbers(end)}\n{inner}}}\n")
    text.write(f"{indent}}}\n")


def _numbers(values: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{value:.7f}" for value in values)


def _root_channels(motion: Motion) -> FloatArray:
    """(n, 6) position [cm] and angles [deg] of the pelvis."""
    position = CENTIMETRES * motion.q[:, :3] @ TO_BVH.T
    rotation = TO_BVH @ Rotation.from_quat(motion.q[:, 3:7]).as_matrix() @ TO_BVH.T
    return np.hstack([position, _euler(rotation, _ROOT_ORDER)])


def _angles(joint: _Joint, body: BodyModel, motion: Motion) -> FloatArray:
    """(n, 3) channel values of a segment [deg]."""
    hinges = motion.q[:, 7:]
    if joint.columns is not None:
        values = [np.zeros(len(hinges)) if c is None else hinges[:, c] for c in joint.columns]
        return np.degrees(np.column_stack(values) * joint.signs)
    rotation = np.broadcast_to(np.eye(3), (len(hinges), 3, 3))
    for hinge in joint.segment.hinges:
        angle = hinges[:, body.joint_index(hinge.name)]
        rotation = rotation @ Rotation.from_rotvec(angle[:, None] * hinge.axis).as_matrix()
    return _euler(TO_BVH @ rotation @ TO_BVH.T, joint.order)


def _euler(rotation: FloatArray, order: str) -> FloatArray:
    """(n, 3) intrinsic angles [deg] without jumps of a turn between samples."""
    with warnings.catch_warnings():
        # At the singularity SciPy sets the third angle to zero: one of the right answers.
        warnings.filterwarnings("ignore", "Gimbal lock", UserWarning)
        angles = Rotation.from_matrix(rotation).as_euler(order)
    return np.degrees(np.unwrap(angles, axis=0))
