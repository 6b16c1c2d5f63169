"""The motion file: recorded, planned and executed motion, body, scene and schedule in one HDF5 file.

Layout (format version 1)::

    /                    attributes: format, format_version, created_by
    /shifted, /recorded, /planned, /executed   one group per motion; attributes: joint_names, contact_names
        time (n,) q (n, nq) v (n, nv) a (n, nv) tau (n, nv) com (n, 3)
        angular_momentum (n, 3) margin (n,) support (n, c) contact_force (n, c, 6)
                         each with the attributes: unit, description
    /body, /scene, /schedule   JSON texts, see manikin.motion.description

Every group and text may be missing.  The same data always gives the same bytes.

A file may come from anywhere: links that lead out of it, external storage, arrays larger than
:data:`MAX_BYTES` and numbers beyond :data:`LARGEST` are refused before they are used. The first 512 bytes,
the user block, hold a digest (:mod:`manikin.runtime.hdf5`): what was changed since is tried out first.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.errors import InputError, MotionFileError
from manikin.motion import description
from manikin.motion.motion import Motion
from manikin.runtime import __version__, hdf5
from manikin.runtime.display import Displayed
from manikin.runtime.files import write_bytes
from manikin.scene import Scene

FORMAT = "manikin-motion"
FORMAT_VERSION = 1
GROUPS = ("shifted", "recorded", "planned", "executed")
TEXTS = ("body", "scene", "schedule")
MAX_BYTES = 800_000_000
"""Largest size of all arrays and texts of a file; an hour at 100 Hz has two thirds of it [bytes]."""
LARGEST: Mapping[str, float] = {
    "time": 1e6, "q": 1e4, "com": 1e4, "v": 1e5, "a": 1e9, "tau": 1e9, "angular_momentum": 1e9,
    "contact_force": 1e9, "margin": np.inf,
}  # fmt: skip
"""Largest magnitude of a number of each dataset, in its unit; what is larger is damage."""
UNMEASURED = ("tau", "contact_force", "margin")
"""Datasets with NaN for what was not measured, such as the forces of a recorded motion."""
UNIT_NORM = 1e-3
"""Largest deviation of a quaternion's norm from 1."""

DATASETS: Mapping[str, tuple[str, str]] = {
    "time": ("s", "sample times, increasing"),
    "q": ("m, -, rad", "pelvis position, pelvis quaternion xyzw, hinge angles"),
    "v": ("m/s, rad/s", "pelvis linear and angular velocity in the pelvis frame, hinge rates"),
    "a": ("m/s^2, rad/s^2", "derivative of v"),
    "tau": ("N, N.m", "generalised forces; the first six, of the pelvis, are zero"),
    "com": ("m", "centre of mass in the world"),
    "angular_momentum": ("kg.m^2/s", "about the centre of mass, world axes"),
    "margin": (
        "N.m",
        "distance of the pseudo-wrench to the faces of the wrench polytope, moments about the centre of "
        "mass, negative outside; with the unit N, the smallest force at the centre of mass that ends balance",
    ),
    "support": ("-", "1 where the contact is active, in the order of contact_names"),
    "contact_force": ("N, N.m", "force and moment of the scene on the body, world axes, about the contact"),
}
"""Unit and meaning of each dataset of a motion."""

_Value = TypeVar("_Value")


@dataclass(frozen=True, eq=False, repr=False)
class MotionFile(Displayed):
    """Content of a motion file; what it does not hold is None.

    Attributes:
        executed: Motion as simulated.
        recorded: Motion of a recorded person, reconstructed.
        shifted: The recorded motion after the least shift onto its contacts.
    """

    planned: Motion | None = None
    executed: Motion | None = None
    body: BodyModel | None = None
    scene: Scene | None = None
    schedule: ContactSchedule | None = None
    recorded: Motion | None = None
    shifted: Motion | None = None

    def facts(self) -> dict[str, str]:
        """What a reader wants to know first."""
        held = [name for name in ("body", "scene", "schedule") if getattr(self, name) is not None]
        motions = {name: f"{motion.duration:.2f} s" for name, motion in self.motions.items()}
        return motions | {"with": " ".join(held) or "nothing"}

    @property
    def motions(self) -> dict[str, Motion]:
        """The motions there are, by name, in the order of :data:`GROUPS`."""
        return {name: motion for name in GROUPS if (motion := getattr(self, name)) is not None}


def write_motions(path: str | Path, content: MotionFile) -> None:
    """Write a motion file with at least one motion; an interruption leaves the old file or none.

    Raises:
        MotionFileError: If there is no motion, or the file cannot be written.
    """
    if not content.motions:
        raise MotionFileError(f"{path}: no motion to write; valid: a recorded, planned or executed one")
    # In memory first: where the disk is full, HDF5 cannot close a file, and ends the process.
    with h5py.File.in_memory(libver="v110") as file:
        _fill(file, content)
        file.flush()
        image = file.id.get_file_image()
    try:
        write_bytes(path, hdf5.sealed(image))
    except OSError as error:
        problem = f"cannot be written ({_reason(error)})"
        raise MotionFileError(f"{path}: {problem}; valid: a writable folder with room") from None


def read_motions(path: str | Path) -> MotionFile:
    """Read a motion file.

    Args:
        path: The file, or a run directory that holds a ``motion.h5``.

    Raises:
        MotionFileError: If it is missing, damaged, of another kind or of a later version.
    """
    file_path = Path(path) / "motion.h5" if Path(path).is_dir() else Path(path)
    if not file_path.is_file():
        valid = "a motion file (.h5) or a run directory"
        raise MotionFileError(f"{file_path}: there is no such file; valid: {valid}")
    try:
        if not hdf5.is_as_written(file_path):
            hdf5.try_out(file_path, MAX_BYTES)
        with h5py.File(file_path, "r") as file:
            return _content(file, str(file_path))
    except (OSError, RuntimeError, KeyError) as error:  # as h5py says that bytes do not fit each other
        problem = f"cannot be read as HDF5 ({_reason(error)})"
        raise MotionFileError(f"{file_path}: {problem}; valid: a motion file written by manikin") from None


def _fill(file: h5py.File, content: MotionFile) -> None:
    file.attrs.update(format=FORMAT, format_version=FORMAT_VERSION, created_by=f"manikin {__version__}")
    for name, motion in content.motions.items():
        _write_motion(file.create_group(name), motion)
        file[f"{name}/margin"].attrs["form"] = margin_form(motion, content.schedule)
    for name in TEXTS:
        if (value := getattr(content, name)) is not None:
            # A dataset, not an attribute: attributes end at 64 kB and a mesh is larger.
            text = json.dumps(getattr(description, f"describe_{name}")(value))
            file.create_dataset(name, data=text, dtype=h5py.string_dtype(), track_times=False)


def margin_form(motion: Motion, schedule: ContactSchedule | None) -> str:
    """Form of a motion's margin in words, with the friction model where the schedule is known."""
    form = "smallest force at the centre of mass"
    if motion.margin_unit == "N.m":
        form = "residual ball of the wrench polytope, moments about the centre of mass, alpha = 1 m"
    phases = () if schedule is None else schedule.sequence
    models = sorted({phase.stance.friction_model for phase in phases if len(phase.stance)})
    return f"{form}; friction model {' and '.join(models)}" if models else form


def _write_motion(group: h5py.Group, motion: Motion) -> None:
    for key in ("joint_names", "contact_names"):
        group.attrs.create(key, np.array(getattr(motion, key), dtype=object), dtype=h5py.string_dtype())
    for name, array in motion.arrays().items():
        unit, meaning = DATASETS[name]
        unit = motion.margin_unit if name == "margin" else unit
        data = array.astype(np.uint8) if array.dtype == np.bool_ else array
        group.create_dataset(name, data=data, track_times=False).attrs.update(unit=unit, description=meaning)


def _content(file: h5py.File, source: str) -> MotionFile:
    if file.attrs.get("format") != FORMAT:
        raise MotionFileError(f"{source}: is not a motion file; valid: an HDF5 file with format = {FORMAT!r}")
    version = file.attrs.get("format_version")
    if version != FORMAT_VERSION:
        raise MotionFileError(f"{source}: has format version {version}; valid: {FORMAT_VERSION}")
    _check_size(file, source)
    content = MotionFile(
        body=_read_json(file, "body", description.body_from, source),
        scene=_read_json(file, "scene", description.scene_from, source),
        schedule=_read_json(file, "schedule", description.schedule_from, source),
        **{name: _read_motion(file, name, source) for name in GROUPS},
    )
    if not content.motions:
        raise MotionFileError(f"{source}: holds no motion; valid: a group {' or '.join(GROUPS)}")
    for name, motion in content.motions.items():
        if content.body is not None and motion.joint_names != content.body.joint_names:
            problem = f"{name} has other joints than the body; valid: the body's joint_names"
            raise MotionFileError(f"{source}: {problem}")
    return content


def _check_size(file: h5py.File, source: str) -> None:
    """Refuse links out of the file, and arrays that would not fit into memory, before any is read."""
    items = [(file, name) for name in TEXTS if name in file.keys()]  # noqa: SIM118  # "in file" follows links
    for group in GROUPS:
        if isinstance(_linked(file, group, source), h5py.Group):
            items += [(file[group], name) for name in DATASETS]
    size = 0
    for parent, name in items:
        data = _linked(parent, name, source)
        if isinstance(data, h5py.Dataset):
            if data.external or data.is_virtual:
                raise MotionFileError(f"{source}: {data.name} lies in another file; valid: in this one")
            size += data.nbytes
    if size > MAX_BYTES:
        problem = f"holds {size / 1e6:.0f} MB of numbers"
        raise MotionFileError(f"{source}: {problem}; valid: at most {MAX_BYTES / 1e6:.0f} MB")


def _linked(parent: Any, name: str, source: str) -> Any:
    """Item of a group under a hard link, or None."""
    link = parent.get(name, getlink=True)
    if link is None:
        return None
    if not isinstance(link, h5py.HardLink):
        raise MotionFileError(f"{source}: {name} is a link to another place; valid: as written by manikin")
    return parent[name]


def _read_motion(file: h5py.File, name: str, source: str) -> Motion | None:
    if name not in file:
        return None
    group = file[name]
    if not isinstance(group, h5py.Group):
        raise MotionFileError(f"{source}: {name} is not a group; valid: a group with {', '.join(DATASETS)}")
    missing = [key for key in DATASETS if not isinstance(group.get(key), h5py.Dataset)]
    missing += [key for key in ("joint_names", "contact_names") if key not in group.attrs]
    if missing:
        raise MotionFileError(f"{source}: {name}/{missing[0]} is missing; valid: {', '.join(DATASETS)}")
    try:
        values: Any = group  # h5py's stubs cannot say that these are datasets
        arrays: dict[str, Any] = {key: values[key][()] for key in DATASETS}
        joints, contacts = (tuple(map(str, values.attrs[f"{key}_names"])) for key in ("joint", "contact"))
        unit = str(values["margin"].attrs.get("unit", "N.m"))
        motion = Motion(**arrays, joint_names=joints, contact_names=contacts, margin_unit=unit)
    except (ValueError, TypeError, MotionFileError) as error:
        raise MotionFileError(f"{source}: {name}: {error}") from None
    _check_values(motion, f"{source}: {name}")
    return motion


def _check_values(motion: Motion, where: str) -> None:
    """Refuse numbers that no motion has."""
    for key, array in motion.arrays().items():
        limit = LARGEST.get(key)
        worst = 0.0 if limit is None or not array.size else float(np.nanmax(np.abs(array), initial=0.0))
        if limit is not None and worst > limit:
            problem = f"{where}/{key} has the value {worst:.3g}"
            raise MotionFileError(f"{problem}; valid: at most {limit:g} in magnitude [{DATASETS[key][0]}]")
        if key not in UNMEASURED and not np.all(np.isfinite(array)):
            raise MotionFileError(f"{where}/{key} is not finite; valid: finite numbers")
    turns = motion.q[:, 3:7]
    if np.any(np.abs(np.linalg.norm(turns, axis=1) - 1.0) > UNIT_NORM):
        raise MotionFileError(f"{where}/q has a quaternion of another norm than 1; valid: unit quaternions")


def _read_json(
    file: h5py.File, name: str, build: Callable[[Mapping[str, Any]], _Value], source: str
) -> _Value | None:
    if name not in file:
        return None
    text: Any = file[name]
    try:
        return build(json.loads(text.asstr()[()]))
    except (KeyError, ValueError, TypeError, AttributeError, InputError) as error:
        told = f"{name} is damaged ({type(error).__name__}: {' '.join(str(error).split())[:120]})"
        raise MotionFileError(f"{source}: {told}; valid: as written by manikin") from None


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split())[:120]
