"""Files made from results: figures of runs and comparisons, motions as BVH, CSV and GLB for other programs.

A CSV file has one row per sample, units in the header.

BVH has y up and no unit; programs take it for centimetres. Ours: x to the body's left, y up, z forward,
centimetres, degrees, ``(X, Y, Z) = 100 (y, z, x)``, a rotation of our world (x forward, y left, z up) and no
mirror image. Every joint has three rotation channels: the segment's hinges in their order, then the axes it
does not have, at zero. A BVH rotation is the product of its channels from left to right, like our hinges.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from manikin.body import BodyModel, Segment
from manikin.body.segments import end_of
from manikin.errors import InputError, MotionFileError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.pipeline.run_directory import read_run
from manikin.planning.contacts.single_contact import ContactAnswer
from manikin.reports.comparison import RunComparison
from manikin.reports.figures import ChoicePanel, contact_choice_figure, save_figure, write_figures
from manikin.reports.gltf import to_glb
from manikin.runtime.display import readable
from manikin.runtime.files import (
    FIGURES,
    ResultDirectory,
    columns_csv,
    make_directory,
    write_bytes,
    write_result,
    writing,
)
from manikin.scene import Scene

if TYPE_CHECKING:
    from manikin.motion.file import MotionFile


def to_csv(motion: Motion) -> str:
    """Text of a CSV file: time, pelvis, hinge angles, CoM, margin, supports, contact forces.

    Numbers have 9 significant digits; the separator is a comma, the decimal sign a point.
    """
    columns: dict[str, np.ndarray] = {"time [s]": motion.time}
    columns |= _columns("pelvis_", "xyz", " [m]", motion.q[:, :3])
    columns |= _columns("pelvis_quaternion_", "xyzw", " [-]", motion.q[:, 3:7])
    columns |= _columns("", motion.joint_names, " [rad]", motion.q[:, 7:])
    columns |= _columns("com_", "xyz", " [m]", motion.com) | {"margin [N.m]": motion.margin}
    for number, name in enumerate(motion.contact_names):
        columns[f"{name}_support [-]"] = motion.support[:, number]
        columns |= _columns(f"{name}_force_", "xyz", " [N]", motion.contact_force[:, number, :3])
        columns |= _columns(f"{name}_moment_", "xyz", " [N.m]", motion.contact_force[:, number, 3:])
    return columns_csv(columns, 9)


def _columns(before: str, names: Sequence[str], unit: str, values: FloatArray) -> dict[str, np.ndarray]:
    """Columns (n,) of values (n, k) by their whole names."""
    return {f"{before}{name}{unit}": column for name, column in zip(names, values.T, strict=True)}


def resample(motion: Motion, rate: float | None) -> Motion:
    """Return the motion at a constant rate, from its first instant on.

    Positions and rates are interpolated linearly, the pelvis' quaternion along the great arc, supports by the
    sample before. At instants that the motion has, its own samples are returned exactly.

    Args:
        rate: Samples per second [Hz], or None to leave it as it is.

    Raises:
        InputError: If the rate is not between 1 and 100,000 Hz.
    """
    if rate is None:
        return motion
    rate = finite_number(rate, "rate [Hz]", at_least=1.0, at_most=1e5)
    count = int(np.floor(motion.duration * rate + 1e-9)) + 1
    wanted = motion.time[0] + np.arange(count) / rate
    before, share = _places(motion.time, wanted)
    arrays: dict[str, Any] = {
        name: _linear(array, before, share) if array.dtype != np.bool_ else array[before]
        for name, array in motion.arrays().items()
    }
    arrays["time"] = wanted
    if len(motion.time) > 1:
        turns = Slerp(np.arange(len(motion.time)), Rotation.from_quat(motion.q[:, 3:7]))
        own = arrays["q"][:, 3:7]
        own[:] = np.where(share[:, None] == 0.0, own, turns(before + share).as_quat())
    return Motion(**arrays, contact_names=motion.contact_names, joint_names=motion.joint_names)


def _places(time: FloatArray, wanted: FloatArray) -> tuple[np.ndarray, FloatArray]:
    """Index of the sample before each instant and how far it is to the next (0 to 1)."""
    if len(time) == 1:
        return np.zeros(len(wanted), dtype=np.int64), np.zeros(len(wanted))
    before = np.clip(np.searchsorted(time, wanted + 1e-9, side="right") - 1, 0, len(time) - 2)
    share = np.clip((wanted - time[before]) / (time[before + 1] - time[before]), 0.0, 1.0)
    share = np.where(share < 1e-6, 0.0, np.where(share > 1.0 - 1e-6, 1.0, share))
    return before + (share == 1.0), np.where(share == 1.0, 0.0, share)


def _linear(array: FloatArray, before: np.ndarray, share: FloatArray) -> FloatArray:
    after = np.minimum(before + 1, len(array) - 1)
    weight = share.reshape(-1, *(1,) * (array.ndim - 1))
    return np.where(weight == 0.0, array[before], (1.0 - weight) * array[before] + weight * array[after])


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


FORMATS = ("bvh", "csv", "glb")
BVH_RATE, GLB_RATE = 100.0, 60.0
"""Samples per second of a BVH file unless the caller says otherwise [Hz]."""


def pick_motion(content: MotionFile, which: str | None = None) -> Motion:
    """The motion wanted; by default the executed one, else the planned one.

    Raises:
        InputError: If the file does not hold it.
    """
    name = list(content.motions)[-1] if which is None else which
    if name not in content.motions:
        raise InputError(f"motion is {name!r}; valid here: {', '.join(content.motions)}")
    return content.motions[name]


def export_motion(
    content: MotionFile, source: str | Path, format_name: str, *, out: str | Path | None = None,
    which: str | None = None, rate: float | None = None,
) -> Path:  # fmt: skip
    """Write a motion in another format, atomically, and return the file.

    Args:
        source: The run directory or motion file it came from.
        format_name: One of :data:`FORMATS`.
        out: File to write; ``motion.FORMAT`` beside the motion file when omitted.
        which: ``"planned"`` or ``"executed"``; see :func:`pick_motion`.
        rate: Samples per second [Hz]; 100 for BVH, 60 for GLB and every sample for CSV when omitted.

    Raises:
        InputError: If the format, the motion or the rate is not available.
        MotionFileError: If the file cannot be written, or BVH or GLB is wanted without a body.
    """
    if format_name not in FORMATS:
        raise InputError(f"format is {format_name!r}; valid: {', '.join(FORMATS)}")
    motion = pick_motion(content, which)
    folder = Path(source) if Path(source).is_dir() else Path(source).parent
    path = Path(out) if out is not None else folder / f"motion.{format_name}"
    if format_name == "csv":
        return write_result(path, to_csv(resample(motion, rate)))
    if content.body is None:
        raise MotionFileError(f"{source}: holds no body; valid: a motion file with a body for {format_name}")
    if format_name == "glb":
        sampled = resample(motion, GLB_RATE if rate is None else rate)
        with writing(path):
            write_bytes(path, to_glb(content.body, sampled, content.scene))
        return path
    return write_result(path, to_bvh(content.body, resample(motion, BVH_RATE if rate is None else rate)))


COMPARISON = "comparison.json"


def write_outputs(
    directory: str | Path, progress: Callable[[str, float], object] = lambda _stage, _share: None
) -> list[Path]:
    """Draw the figures of a finished run and write its BVH and GLB files, if it has joints; return the files.

    Args:
        progress: Told the stage ``"figures"`` and the share that is done.

    Raises:
        InputError: If the run cannot be read or a file cannot be written.
    """
    folder = Path(directory)
    record = read_run(folder)
    if not record.tracks and record.schedule is None:
        return []
    make_directory(folder / FIGURES)
    written = write_figures(record, folder / FIGURES, lambda share: progress("figures", 0.9 * share))
    if record.motions and record.body is not None and not record.body.is_point_mass:
        written += [export_motion(record.content, folder, kind) for kind in ("bvh", "glb")]
    progress("figures", 1.0)
    return written


def write_comparison_outputs(
    comparison: RunComparison, directory: str | Path, progress: Callable[[str, float], object]
) -> None:
    """Draw the figures of two runs and write ``comparison.json``; other files of the directory stay.

    Args:
        progress: Told the stage ``"figures"`` and the share that is done.

    Raises:
        MotionFileError: If the directory cannot be written to.
    """
    folder = ResultDirectory(directory, "comparison")
    folder.write(COMPARISON, comparison.as_dict())
    write_figures(comparison, folder.path, lambda share: progress("figures", share))


def write_contact_figure(body: BodyModel, scene: Scene, answer: ContactAnswer, path: str | Path) -> None:
    """Draw the body before and after it made the contact that was asked for.

    Raises:
        MotionFileError: If the file cannot be written.
    """
    result = answer.result
    task = np.array(answer.question.task) / np.linalg.norm(answer.question.task)
    panels = [ChoicePanel("before", answer.q, task=task)]
    if result.q is not None and result.contact is not None:
        title = f"{answer.question.heuristic}: {result.obstacle}, EFORT {answer.efort:.2f}"
        panels.append(ChoicePanel(title, result.q, (result.contact,), (result.limb,), task))
    save_figure(contact_choice_figure(body, scene, panels, f"Contact of {readable(result.limb)}"), Path(path))
