"""The motion library as a file: coefficients in NumPy's ``.npz``, without pickled objects."""

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from manikin.atomic import atomic_path
from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.locomotion.blend import MIRRORED
from manikin.locomotion.library import MotionLibrary, reference_body

FORMAT = "manikin motion library 1"

SHIPPED = "walking_library.npz"

LARGEST = 50_000_000
"""Of a file that is read [bytes]."""

_ARRAYS = {"velocities": 2, "periods": 1, "events": 2, "coefficients": 3, "leg": 0}
_WORDS = {"format": 0, "names": 1, "kinds": 1, "joint_names": 1, "acknowledgements": 1}


def save_library(library: MotionLibrary, path: str | Path) -> None:
    """Write a library; mirror images are left out and made again when it is read.

    The coefficients are rounded to single precision, some 1e-7 rad.

    Args:
        library: Cycles.
        path: File to write, ``.npz``.

    Raises:
        InputError: If it cannot be written.
    """
    kept = [i for i, name in enumerate(library.names) if not name.endswith(MIRRORED)]
    sided = np.array([library.names[i] + MIRRORED in library.names for i in kept])
    arrays: dict[str, Any] = {
        "format": np.array(FORMAT),
        "names": np.array([library.names[i] for i in kept]),
        "kinds": np.array([library.kinds[i] for i in kept]),
        "sided": sided,
        "velocities": library.velocities[kept],
        "periods": library.periods[kept],
        "events": library.events[kept],
        "coefficients": library.coefficients[kept].astype(np.float32),
        "joint_names": np.array(library.joint_names),
        "leg": np.array(library.leg),
        "acknowledgements": np.array(library.acknowledgements),
    }
    try:
        with atomic_path(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}") from None


def load_library(path: str | Path | None = None) -> MotionLibrary:
    """Read a library, with its mirror images.

    Args:
        path: A file written by :func:`save_library`; the library that comes with this package if omitted.

    Raises:
        InputError: If it is no such file, or what it holds does not fit together.
    """
    if path is None:
        return _shipped()
    return _read(Path(path))


@cache
def _shipped() -> MotionLibrary:
    with resources.as_file(resources.files("manikin.locomotion") / "data" / SHIPPED) as file:
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
        raise InputError(
            f"{file} cannot be read: {error.strerror or error}; valid: a motion library"
        ) from None
    except Exception:  # numpy, zipfile and zlib raise a dozen kinds for damaged bytes
        raise InputError(f"{file} is damaged or no motion library; valid: a file of this package") from None
    return _library(file, given)


def _library(file: Path, given: dict[str, Any]) -> MotionLibrary:
    for name, dimensions in (*_ARRAYS.items(), *_WORDS.items(), ("sided", 1)):
        if name not in given:
            raise InputError(f"{file} has no {name!r}; valid: a motion library")
        kind = "U" if name in _WORDS else "b" if name == "sided" else "f"
        if given[name].dtype.kind != kind or given[name].ndim != dimensions:
            raise InputError(
                f"{file} {name} is {given[name].dtype} of {given[name].ndim} dimensions; "
                f"valid: kind {kind!r}, {dimensions} dimensions"
            )
    if str(given["format"]) != FORMAT:
        raise InputError(f"{file} has the format {str(given['format'])!r}; valid: {FORMAT!r}")
    sided, names = given["sided"], tuple(given["names"].tolist())
    if len(sided) != len(names) or len(set(names)) != len(names):
        raise InputError(f"{file} names are not unique, or their number is not that of 'sided'")
    body = _body(file, tuple(given["joint_names"].tolist()))
    try:
        library = MotionLibrary(
            names, tuple(given["kinds"].tolist()), given["velocities"], given["periods"], given["events"],
            given["coefficients"], body.joint_names, float(given["leg"]),
            tuple(given["acknowledgements"].tolist()),
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    chosen = np.flatnonzero(sided)
    return library.with_cycles(library.chosen(chosen).mirrored(body)) if len(chosen) else library


def _body(file: Path, joint_names: tuple[str, ...]) -> BodyModel:
    body = reference_body()
    if joint_names != body.joint_names:
        raise InputError(
            f"{file} is for other hinges than those of our human; valid: a library of this version"
        )
    return body
