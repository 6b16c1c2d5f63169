"""The motion library: walking cycles of one body by velocity, and its file.

The file holds Fourier coefficients in NumPy's ``.npz``, without pickled objects.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, human
from manikin.body.limbs import mirrored_hinges
from manikin.errors import InputError
from manikin.numerics.signals import shifted
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.runtime.files import atomic_path

MIRRORED = " mirrored"

ROOT = ("ahead", "left", "height", "roll", "pitch", "yaw")
"""Signals of the root: error around the line or circle and height [m]; turns, with the error of the heading
as yaw [rad]. The angles of the hinges follow."""

_ROOT_MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])

REFERENCE_STATURE, STAND = 1.75, "stand"
"""Stature of the reference body [m], and class of the cycle without steps."""


@cache
def reference_body() -> BodyModel:
    """The human whose hinges and leg length the cycles have."""
    return human(REFERENCE_STATURE)


def leg_length(body: BodyModel) -> float:
    """Hip to ankle of a stretched leg [m], by which places and velocities scale from body to body."""
    return -float(body.segment("left_leg").origin[2] + body.segment("left_foot").origin[2])


@dataclass(frozen=True, eq=False)
class MotionLibrary:
    """c cycles that begin when the left toes push off ([Truong2010]_ 6.4).

    Joint angles are those of the reference body's revolute hinges. Their ranges leave one triple of angles
    only for every turn of a ball joint (the middle one stays within 90 degrees, the others within 180), so
    that blends of postures within the ranges are within the ranges, without leaps.

    Attributes:
        names: Names of the cycles, ``FILE first-last``, with ``mirrored`` for the mirror images.
        kinds: Class of each, such as ``"walk straight"``.
        velocities: (c, 3) forward, left [m/s], angular [rad/s].
        periods: (c,) durations [s].
        events: (c, 3) phases at which the left foot lands, the right one leaves the floor, and the right one
            landed before: below 0 where it did so before the cycle's begin.
        coefficients: (c, 2 k + 1, s) Fourier coefficients of the signals: :data:`ROOT`, then the hinges.
        joint_names: Names of the hinges.
        leg: Leg length of the reference body [m].
        acknowledgements: Sources of the recordings.
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    velocities: FloatArray
    periods: FloatArray
    events: FloatArray
    coefficients: FloatArray
    joint_names: tuple[str, ...]
    leg: float
    acknowledgements: tuple[str, ...]

    def __post_init__(self) -> None:
        c, signals, where = len(self.names), len(ROOT) + len(self.joint_names), "motion library"
        wanted = {"velocities": (c, 3), "periods": (c,), "events": (c, 3), "coefficients": (c, None, signals)}
        for name, shape in wanted.items():
            object.__setattr__(self, name, frozen_array(getattr(self, name), f"{where} {name}", shape))
        if len(self.kinds) != c:
            raise InputError(f"{where} has {len(self.kinds)} kinds; valid: {c}, one a cycle")
        count = self.coefficients.shape[1]
        if count % 2 == 0 or count < 3:
            raise InputError(f"{where} has {count} coefficients a signal; valid: 3, 5, 7, ...")
        if c == 0 or self.periods.min() <= 0.0 or not self.leg > 0.0:
            raise InputError(f"{where} has no cycle, or no duration or leg length; valid: all > 0")
        landing, off, other = self.events.T
        ordered = (landing > 0.0) & (landing < 1.0) & (off > 0.0) & (off < 1.0)
        if not np.all(ordered & (other < off) & (other > off - 1.0)):
            valid = "0 < landing, off < 1, other before off"
            raise InputError(f"{where} has events out of order; valid: {valid}")

    def __len__(self) -> int:
        return len(self.names)

    @property
    def harmonics(self) -> int:
        """Number of harmonics of every signal."""
        return (self.coefficients.shape[1] - 1) // 2

    def chosen(self, indices: Sequence[int] | NDArray[np.integer]) -> Self:
        """The library of some of its cycles."""
        return replace(
            self,
            **{name: getattr(self, name)[list(indices)] for name in _SERIES},
            **{name: tuple(getattr(self, name)[i] for i in indices) for name in ("names", "kinds")},
        )

    def mirrored(self, body: BodyModel) -> Self:
        """The library of the mirror images, which begin at the left toe-off again; of the body's hinges."""
        (indices, factors), hinges = mirrored_hinges(body), slice(len(ROOT), None)
        coefficients = np.array(self.coefficients)
        coefficients[:, :, : len(ROOT)] *= _ROOT_MIRROR
        coefficients[:, :, hinges] = factors * self.coefficients[:, :, hinges][:, :, indices]
        strike, off, other = self.events.T
        return replace(
            self, names=tuple(name + MIRRORED for name in self.names),
            velocities=self.velocities * [1.0, -1.0, -1.0],
            events=np.column_stack([other + 1.0 - off, 1.0 - off, strike - off]),
            coefficients=np.array([shifted(c, p) for c, p in zip(coefficients, off, strict=True)]),
        )  # fmt: skip

    def with_cycles(self, other: "MotionLibrary") -> Self:
        """Both libraries in one."""
        series = {name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in _SERIES}
        return replace(self, names=self.names + other.names, kinds=self.kinds + other.kinds, **series)


_SERIES = ("velocities", "periods", "events", "coefficients")

FORMAT = "manikin motion library 1"

LARGEST = 50_000_000
"""Largest file that is read [bytes]."""

_ARRAYS = {"velocities": 2, "periods": 1, "events": 2, "coefficients": 3, "leg": 0}
_WORDS = {"format": 0, "names": 1, "kinds": 1, "joint_names": 1, "acknowledgements": 1}


def save_library(library: MotionLibrary, path: str | Path) -> None:
    """Write a library; mirror images are left out and made again when it is read.

    The coefficients are rounded to single precision, some 1e-7 rad. InputError if the file (``.npz``) cannot
    be written.
    """
    kept = [i for i, name in enumerate(library.names) if not name.endswith(MIRRORED)]
    part = library.chosen(kept)
    arrays: dict[str, Any] = {
        "format": np.array(FORMAT), "names": np.array(part.names), "kinds": np.array(part.kinds),
        "sided": np.array([name + MIRRORED in library.names for name in part.names]),
        **{name: getattr(part, name) for name in _SERIES},
        "coefficients": part.coefficients.astype(np.float32), "joint_names": np.array(library.joint_names),
        "leg": np.array(library.leg), "acknowledgements": np.array(library.acknowledgements),
    }  # fmt: skip
    try:
        with atomic_path(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}") from None


def load_library(path: str | Path | None = None) -> MotionLibrary:
    """Read a library, with its mirror images.

    It is in a file written by :func:`save_library`, or comes with this package if the path is omitted.
    InputError if it is no such file, or what it holds does not fit together.
    """
    return _shipped() if path is None else _read(Path(path))


@cache
def _shipped() -> MotionLibrary:
    with resources.as_file(resources.files("manikin.walking") / "data" / "walking_library.npz") as file:
        return _read(file)


def _read(file: Path) -> MotionLibrary:
    try:
        if file.stat().st_size > LARGEST:
            raise InputError(f"{file} is larger than {LARGEST // 1_000_000} MB; valid: a motion library")
        archive = np.load(file, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise InputError(f"{file} holds one array; valid: a motion library (.npz)")
        with archive:
            given = {name: archive[name] for name in archive.files}
    except InputError:
        raise
    except OSError as error:
        wrong = f"cannot be read: {error.strerror or error}"
        raise InputError(f"{file} {wrong}; valid: a motion library") from None
    except Exception:  # numpy, zipfile and zlib raise a dozen kinds for damaged bytes
        raise InputError(f"{file} is damaged or no motion library; valid: a file of this package") from None
    return _library(file, given)


def _library(file: Path, given: dict[str, Any]) -> MotionLibrary:
    for name, dimensions in (*_ARRAYS.items(), *_WORDS.items(), ("sided", 1)):
        if name not in given:
            raise InputError(f"{file} has no {name!r}; valid: a motion library")
        kind, array = "U" if name in _WORDS else "b" if name == "sided" else "f", given[name]
        if array.dtype.kind != kind or array.ndim != dimensions:
            wrong, valid = f"{array.dtype} of {array.ndim} dimensions", f"{dimensions} dimensions"
            raise InputError(f"{file} {name} is {wrong}; valid: kind {kind!r}, {valid}")
    if str(given["format"]) != FORMAT:
        raise InputError(f"{file} has the format {str(given['format'])!r}; valid: {FORMAT!r}")
    sided, names = given["sided"], tuple(given["names"].tolist())
    if len(sided) != len(names) or len(set(names)) != len(names):
        raise InputError(f"{file} names are not unique, or their number is not that of 'sided'")
    body = reference_body()
    if tuple(given["joint_names"].tolist()) != body.joint_names:
        wrong = "is for other hinges than those of our human"
        raise InputError(f"{file} {wrong}; valid: a library of this version")
    try:
        library = MotionLibrary(
            names, tuple(given["kinds"].tolist()), joint_names=body.joint_names, leg=float(given["leg"]),
            acknowledgements=tuple(given["acknowledgements"].tolist()),
            **{name: given[name] for name in _SERIES},
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    chosen = np.flatnonzero(sided)
    return library.with_cycles(library.chosen(chosen).mirrored(body)) if len(chosen) else library
