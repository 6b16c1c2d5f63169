"""A motion as a BVH file, ready to be retargeted, and the scene beside it.

BVH has no unit; programs take it for centimetres. Ours: x to the body's left, y up, z forward, centimetres,
degrees, ``(X, Y, Z) = 100 (y, z, x)``, a rotation of our world (x forward, y left, z up) and no mirror image;
with z up our world's own axes. All channels zero is a person with the arms stretched aside, palms down, toes
forward (T-pose), or the zero posture of another body. All joints have the same three rotation channels.

With ``R`` the rotation of a segment in our world, ``T`` that in the T-pose and ``A`` the axes' change, a
segment is turned by ``A R T^T A^T`` from the rest of the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from io import StringIO

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel, Segment
from manikin.body.segments import end_of
from manikin.body.skin import segment_frames
from manikin.errors import InputError, MotionFileError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, continuous_angles
from manikin.reports.gltf import TO_GLTF
from manikin.reports.solids import finite_obstacles
from manikin.scene import Scene

CENTIMETRES = 100.0
ORDERS: Mapping[str, str] = {"y": "ZXY", "z": "XYZ"}
"""Order of the rotation channels by the axis that points up: about forward, left and up."""
AXES: Mapping[str, FloatArray] = {"y": TO_GLTF, "z": np.eye(3)}
"""Rotation of our world's axes to the file's, by the file's axis that points up."""

_TRUNK: Mapping[str, Mapping[str, str]] = {
    "cmu": {"pelvis": "Hips", "lumbar": "LowerBack", "thorax": "Spine1", "neck": "Neck", "head": "Head"},
    "mixamo": {"pelvis": "Hips", "lumbar": "Spine", "thorax": "Spine2", "neck": "Neck", "head": "Head"},
    "vrm": {"pelvis": "hips", "lumbar": "spine", "thorax": "chest", "neck": "neck", "head": "head"},
}
_LIMBS: Mapping[str, Mapping[str, str]] = {
    "cmu": {"upper_arm": "Arm", "forearm": "ForeArm", "hand": "Hand", "thigh": "UpLeg", "leg": "Leg",
            "foot": "Foot", "toes": "ToeBase"},
    "vrm": {"upper_arm": "UpperArm", "forearm": "LowerArm", "hand": "Hand", "thigh": "UpperLeg",
            "leg": "LowerLeg", "foot": "Foot", "toes": "Toes"},
}  # fmt: skip
NAMES = ("manikin", *_TRUNK)
"""Whose names the joints may have."""


def joint_names(body: BodyModel, names: str) -> dict[str, str]:
    """Name of each segment's joint by the segment.

    Args:
        body: Whose segments they are.
        names: One of :data:`NAMES`.

    Raises:
        InputError: If the names are not known, or a segment has none among them.
    """
    if names not in NAMES:
        raise InputError(f"names are {names!r}; valid: {', '.join(NAMES)}")
    own = [segment.name for segment in body.segments]
    if names == "manikin":
        return {name: name for name in own}
    before = "mixamorig:" if names == "mixamo" else ""
    limbs = _LIMBS["vrm" if names == "vrm" else "cmu"]
    sides = {"left": "left", "right": "right"} if names == "vrm" else {"left": "Left", "right": "Right"}
    known = dict(_TRUNK[names]) | {
        f"{side}_{part}": word + limb for side, word in sides.items() for part, limb in limbs.items()
    }
    if missing := [name for name in own if name not in known]:
        raise InputError(f"names {names!r} have none for {missing[0]!r}; valid: manikin, or a human")
    return {name: before + known[name] for name in own}


def to_bvh(body: BodyModel, motion: Motion, names: str = "manikin", up: str = "y") -> str:
    """Text of a BVH file of a motion that is evenly sampled.

    Args:
        body: Whose motion it is.
        motion: At one rate.
        names: Whose names the joints have, one of :data:`NAMES`.
        up: Axis of the file that points up, ``"y"`` or ``"z"``.

    Raises:
        MotionFileError: If the motion is not the body's, or is not evenly sampled.
        InputError: If names or axis are not known, or the names are not those of the body's parts.
    """
    if motion.joint_names != body.joint_names:
        raise MotionFileError("motion has other joints than the body; valid: the body's own motion")
    if up not in AXES:
        raise InputError(f"up is {up!r}; valid: {', '.join(AXES)}")
    return _BvhText(body, motion, joint_names(body, names), up).text()


def scene_obj(scene: Scene, up: str = "y") -> str:
    """Text of an OBJ file of a scene's finite obstacles, in the unit and the axes of the BVH file."""
    text, count = StringIO(), 1
    text.write("# centimetres\n")
    for obstacle in finite_obstacles(scene):
        mesh = obstacle.to_trimesh()
        text.write(f"o {'_'.join(obstacle.name.split())}\n")
        np.savetxt(text, CENTIMETRES * np.asarray(mesh.vertices) @ AXES[up].T, fmt="v %.7f %.7f %.7f")
        np.savetxt(text, np.asarray(mesh.faces) + count, fmt="f %d %d %d")
        count += len(mesh.vertices)
    return text.getvalue()


def rest_rotations(body: BodyModel) -> dict[str, FloatArray]:
    """(3, 3) rotation of each segment in the T-pose, by its name; of no arm the identity."""
    turned = {"left": 0.5 * np.pi, "right": -0.5 * np.pi}
    arms = {
        f"{side}_{part}": Rotation.from_euler("x", angle).as_matrix()
        for side, angle in turned.items() for part in ("upper_arm", "forearm", "hand")
    }  # fmt: skip
    human = body.stature is not None
    return {s.name: arms.get(s.name, np.eye(3)) if human else np.eye(3) for s in body.segments}


@dataclass(frozen=True, eq=False)
class _BvhText:
    """A BVH file in the making."""

    body: BodyModel
    motion: Motion
    names: dict[str, str]
    up: str

    @cached_property
    def _axes(self) -> FloatArray:
        return AXES[self.up]

    @cached_property
    def _rest(self) -> dict[str, FloatArray]:
        return rest_rotations(self.body)

    def text(self) -> str:
        result = StringIO()
        result.write("HIERARCHY\n")
        order = self._write_joint(result, self.body.segments[0], 0)
        count, step = len(self.motion.time), _frame_time(self.motion)
        result.write(f"MOTION\nFrames: {count}\nFrame Time: {step:.9g}\n")
        position = CENTIMETRES * self.motion.q[:, :3] @ self._axes.T
        angles = continuous_angles(self._turns(order), ORDERS[self.up])
        table = np.hstack([position, np.degrees(angles).reshape(count, -1)])
        np.savetxt(result, table, fmt="%.7f")
        return result.getvalue()

    def _write_joint(self, text: StringIO, segment: Segment, depth: int) -> list[Segment]:
        """Write a segment and what hangs on it, and return them in the order of the file."""
        indent, inner = "\t" * depth, "\t" * (depth + 1)
        root = segment.parent is None
        channels = [f"{axis}position" for axis in "XYZ" if root]
        channels += [f"{axis}rotation" for axis in ORDERS[self.up]]
        offset = np.zeros(3) if segment.parent is None else self._offset(segment.parent, segment.origin)
        text.write(f"{indent}{'ROOT' if root else 'JOINT'} {self.names[segment.name]}\n{indent}{{\n")
        text.write(
            f"{inner}OFFSET {_numbers(offset)}\n{inner}CHANNELS {len(channels)} {' '.join(channels)}\n"
        )
        order = [segment]
        for child in (item for item in self.body.segments if item.parent == segment.name):
            order += self._write_joint(text, child, depth + 1)
        if len(order) == 1:
            end = self._offset(segment.name, end_of(segment))
            text.write(f"{inner}End Site\n{inner}{{\n{inner}\tOFFSET {_numbers(end)}\n{inner}}}\n")
        text.write(f"{indent}}}\n")
        return order

    def _offset(self, segment: str, point: FloatArray) -> FloatArray:
        """(3,) point of a segment's frame [m] as an offset in the file's rest."""
        return CENTIMETRES * (self._axes @ self._rest[segment] @ point)

    def _turns(self, order: list[Segment]) -> FloatArray:
        """(n, s, 3, 3) rotations of the segments, each in its parent's frame, from the file's rest."""
        index = {segment.name: number for number, segment in enumerate(self.body.segments)}
        rest = np.array([self._rest[name] for name in index])
        world = np.array([segment_frames(self.body, q)[0] for q in self.motion.q])
        turned = self._axes @ world @ rest.transpose(0, 2, 1) @ self._axes.T
        parents = [None if s.parent is None else turned[:, index[s.parent]].transpose(0, 2, 1) for s in order]
        return np.stack(
            [
                turned[:, index[segment.name]] if parent is None else parent @ turned[:, index[segment.name]]
                for segment, parent in zip(order, parents, strict=True)
            ],
            axis=1,
        )


def _frame_time(motion: Motion) -> float:
    if len(motion.time) == 1:
        return 0.01
    steps = np.diff(motion.time)
    if np.ptp(steps) > 1e-6:
        every = f"{steps.min():.6g} to {steps.max():.6g} s"
        raise MotionFileError(f"motion is sampled every {every}; valid: one rate (resample it)")
    return float(motion.duration / len(steps))


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.7f}" for value in values + 0.0)
