"""Files made from results: figures of runs and comparisons, motions for other programs.

The formats are those of :mod:`manikin.reports.formats`, GLB (:mod:`manikin.reports.gltf`) and CSV, with one
row per sample and units in the header.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from manikin.body import BodyModel, Configuration
from manikin.body.skin import has_skin
from manikin.ergonomics import reach_envelopes
from manikin.errors import InputError, MotionFileError
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.pipeline.run_directory import read_run
from manikin.planning.contacts.single_contact import ContactAnswer
from manikin.recordings.virtual_markers import virtual_markers
from manikin.reports.comparison import RunComparison
from manikin.reports.figures import ChoicePanel, contact_choice_figure, save_figure, write_figures
from manikin.reports.formats.bvh import scene_obj, to_bvh
from manikin.reports.formats.opensim import coordinates_mot, external_loads, to_osim
from manikin.reports.formats.recorded import loads_mot, to_c3d, to_trc
from manikin.reports.formats.robots import scene_urdf, to_mjcf, to_urdf
from manikin.reports.formats.usd import to_usd
from manikin.reports.formats.video import SIZE, Film, to_gif, to_mp4
from manikin.reports.gltf import to_glb
from manikin.runtime.display import readable
from manikin.runtime.files import (
    FIGURES,
    ResultDirectory,
    columns_csv,
    make_directory,
    write_content,
    write_result,
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


def film_of_motion(
    content: MotionFile, which: str, format_name: str, progress: Callable[[float], object]
) -> bytes:
    """Content of an MP4 or GIF file of a motion, of the rate and size that exports have by default.

    Args:
        content: What the motion file holds.
        which: Name of the motion.
        format_name: ``"mp4"`` or ``"gif"``.
        progress: Told the share that is done.

    Raises:
        InputError: If the motion or a library is not available.
        MotionFileError: If there is no body, or nothing of it to draw.
    """
    if content.body is None:
        raise MotionFileError("motion file holds no body; valid: one with a body for a film")
    rate, write = _FORMATS[format_name].rate or 0.0, {"mp4": to_mp4, "gif": to_gif}[format_name]
    film = Film(content.body, resample(pick_motion(content, which), rate), content.scene, SIZE)
    return write(film, rate, progress)


@dataclass(frozen=True)
class ExportOptions:
    """What a caller may say about the file besides its rate.

    Attributes:
        size: Width and height of a film [pixels].
        names: Whose names the joints of a BVH file have, see :data:`manikin.reports.formats.bvh.NAMES`.
        up: Axis of a BVH file that points up, ``"y"`` or ``"z"``.
        beside: Whether files of the scene are written beside BVH and URDF files.
        progress: Told the share that is done, of a film.
    """

    size: tuple[int, int] = SIZE
    names: str = "manikin"
    up: str = "y"
    beside: bool = True
    progress: Callable[[float], object] = lambda _share: None


@dataclass(frozen=True, eq=False)
class _Export:
    """A motion, sampled as the format wants it, and where it goes."""

    content: MotionFile
    motion: Motion
    rate: float
    path: Path
    options: ExportOptions

    @property
    def body(self) -> BodyModel:
        assert self.content.body is not None
        return self.content.body

    @property
    def scene(self) -> Scene | None:
        return self.content.scene if self.options.beside else None

    def beside(self, ending: str) -> Path:
        return self.path.with_name(self.path.stem + ending)

    @property
    def film(self) -> Film:
        return Film(self.body, self.motion, self.content.scene, self.options.size)


def _write_bvh(export: _Export) -> None:
    options = export.options
    write_result(export.path, to_bvh(export.body, export.motion, options.names, options.up))
    if export.scene is not None:
        write_result(export.beside("_scene.obj"), scene_obj(export.scene, options.up))


def _write_urdf(export: _Export) -> None:
    write_result(export.path, to_urdf(export.body))
    if export.scene is not None:
        folder = export.beside("_meshes")
        text, meshes = scene_urdf(export.scene, folder.name)
        write_result(export.beside("_scene.urdf"), text)
        if meshes:
            make_directory(folder)
        for name, data in meshes.items():
            write_content(folder / name, data)


def _write_trc(export: _Export) -> None:
    write_result(export.path, to_trc(export.body, export.motion))
    if export.motion.contact_names:
        write_result(export.beside("_grf.mot"), loads_mot(export.body, export.motion))


def _write_osim(export: _Export) -> None:
    body, motion = export.body, export.motion
    write_result(export.path, to_osim(body, virtual_markers(body) if has_skin(body) else ()))
    write_result(export.beside(".mot"), coordinates_mot(body, motion))
    if motion.contact_names:
        forces = export.beside("_grf.mot")
        write_result(forces, loads_mot(body, motion))
        write_result(forces.with_suffix(".xml"), external_loads(body, motion, forces.name))


@dataclass(frozen=True)
class _Format:
    """How a format is written.

    Attributes:
        rate: Samples per second unless the caller says otherwise [Hz]; None for every sample.
        ending: Of the file's name; the format's own when empty.
    """

    write: Callable[[_Export], object]
    rate: float | None
    needs_body: bool = True
    ending: str = ""


_FORMATS: Mapping[str, _Format] = {
    "bvh": _Format(_write_bvh, 100.0),
    "csv": _Format(lambda e: write_result(e.path, to_csv(e.motion)), None, needs_body=False),
    "glb": _Format(lambda e: write_content(e.path, to_glb(e.body, e.motion, e.content.scene)), 60.0),
    "usd": _Format(lambda e: write_content(e.path, to_usd(e.body, e.motion, e.rate, e.content.scene)), 60.0),
    "mp4": _Format(lambda e: write_content(e.path, to_mp4(e.film, e.rate, e.options.progress)), 25.0),
    "gif": _Format(lambda e: write_content(e.path, to_gif(e.film, e.rate, e.options.progress)), 12.5),
    "mjcf": _Format(
        lambda e: write_result(e.path, to_mjcf(e.body, e.motion, e.content.scene)), None, ending="xml"
    ),
    "urdf": _Format(_write_urdf, None),
    "osim": _Format(_write_osim, 100.0),
    "trc": _Format(_write_trc, 100.0),
    "c3d": _Format(lambda e: write_content(e.path, to_c3d(e.body, e.motion)), 100.0),
}
FORMATS = tuple(_FORMATS)


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
    which: str | None = None, rate: float | None = None, options: ExportOptions | None = None,
) -> Path:  # fmt: skip
    """Write a motion in another format, atomically, and return the file.

    Args:
        content: What the motion file holds.
        source: The run directory or motion file it came from.
        format_name: One of :data:`FORMATS`.
        out: File to write; ``motion.FORMAT`` beside the motion file when omitted.
        which: ``"planned"`` or ``"executed"``; see :func:`pick_motion`.
        rate: Samples per second [Hz]; when omitted the format's own, of CSV every sample.
        options: Further choices; defaults when None.

    Raises:
        InputError: If the format, the motion, the rate or a library is not available.
        MotionFileError: If the file cannot be written, or a body is needed and there is none.
    """
    if format_name not in FORMATS:
        raise InputError(f"format is {format_name!r}; valid: {', '.join(FORMATS)}")
    motion, kind = pick_motion(content, which), _FORMATS[format_name]
    folder = Path(source) if Path(source).is_dir() else Path(source).parent
    path = Path(out) if out is not None else folder / f"motion.{kind.ending or format_name}"
    if kind.needs_body and content.body is None:
        raise MotionFileError(f"{source}: holds no body; valid: a motion file with a body for {format_name}")
    rate = kind.rate if rate is None else rate
    sampled = resample(motion, rate)
    kind.write(_Export(content, sampled, rate or 0.0, path, options or ExportOptions()))
    return path


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
        plain = ExportOptions(beside=False)
        written += [export_motion(record.content, folder, kind, options=plain) for kind in ("bvh", "glb")]
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


REACH_FORMATS = (".stl", ".obj", ".ply", ".glb")
"""Endings of the files of a reach."""


def write_reach(path: str | Path, body: BodyModel, q: FloatArray) -> Path:
    """Write what both hands of a person reach in a posture (nq,), the trunk still, as a mesh in the world.

    Args:
        path: File, one of :data:`REACH_FORMATS`.
        body: With two arms.
        q: Posture.

    Raises:
        InputError: If the ending is another one.
        MotionFileError: If the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in REACH_FORMATS:
        raise InputError(
            f"reach mesh is {path.name!r}; valid: a name that ends in {', '.join(REACH_FORMATS)}"
        )
    envelope = reach_envelopes(body)["both"]
    to_world, mesh = np.eye(4), envelope.mesh
    to_world[:3, :3], to_world[:3, 3] = Configuration(body, q).segment_placement(envelope.segment)
    mesh.apply_transform(to_world)
    data = cast("bytes | str", mesh.export(file_type=path.suffix[1:].lower()))
    write_content(path, data.encode() if isinstance(data, str) else data)
    return path


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
