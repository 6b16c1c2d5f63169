"""Result directories, and files that are written as a whole or not at all.

Content goes to a hidden temporary file in the same folder, is flushed to the disk and then renamed over the
target, which the operating system does in one step. An interruption, even a kill, leaves the old file or
none; after a kill a ``.NAME.*.tmp`` file may remain.
"""

import csv
import io
import json
import math
import os
import secrets
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from filelock import FileLock, Timeout

from manikin.errors import MotionFileError

FIGURES = "figures"
"""Folder of the figures in a result directory."""
LOCK = ".lock"
"""File whose lock says that a directory is being written to."""


class ResultDirectory:
    """Directory of one kind of result.

    Whatever writes to it raises :class:`~manikin.errors.MotionFileError` if that is not possible. A directory
    with marks, or with ``exclusive``, belongs to one process at a time, as long as the object is there.

    Attributes:
        path: The directory.
        kind: What the result is called in messages, such as ``"run"``.
        marks: Files of which every such directory has one, the first of them named in messages: a directory
            without any is not taken over. If empty, any directory is, and its other files are left alone.
        exclusive: Whether a directory without marks belongs to one process, too.
        writer: Command that writes the files, for messages.
    """

    kind: str = "result"
    marks: ClassVar[tuple[str, ...]] = ()
    exclusive: ClassVar[bool] = False
    writer: ClassVar[str] = "manikin"

    def __init__(self, path: str | Path, kind: str | None = None) -> None:
        """Create the directory, or take over that of an earlier such result.

        Raises:
            MotionFileError: If that is not possible, or another process writes to it.
        """
        self.path, self.kind = Path(path), kind or self.kind
        self._lock: FileLock | None = None
        if self.path.exists() and not self.path.is_dir():
            raise MotionFileError(f"{self.path}: is a file; valid: a directory for the {self.kind}")
        make_directory(self.path)
        if not self.marks:
            if self.exclusive:
                self._claim()
            return
        content = sorted(item.name for item in self.path.iterdir() if not item.name.startswith("."))
        if content and not set(self.marks) & set(content):
            raise MotionFileError(
                f"{self.path}: holds {content[0]!r} but no {self.marks[0]}, so it is not an earlier "
                f"{self.kind}; valid: a new or empty directory, or one of an earlier {self.kind}"
            )
        self._claim()
        # What a killed process was about to write stays behind as a hidden .NAME.*.tmp file.
        self.remove(".*.tmp", "*/.*.tmp")

    def __getstate__(self) -> dict[str, Any]:
        """State of a copy, which claims nothing."""
        return self.__dict__ | {"_lock": None}

    def _claim(self) -> None:
        """Keep other processes out of the directory while this object is there."""
        # In one process a later result takes over from an earlier one.
        lock = FileLock(self.path.resolve() / LOCK, timeout=0, thread_local=False, is_singleton=True)
        try:
            lock.acquire()
        except Timeout:
            problem = f"another process writes to this {self.kind}"
            raise MotionFileError(f"{self.path}: {problem}; valid: another directory, or later") from None
        except OSError as error:
            problem = f"cannot be written ({error.strerror or error})"
            raise MotionFileError(f"{self.path}: {problem}; valid: in a writable directory") from None
        self._lock = lock

    @property
    def figures(self) -> Path:
        """Folder of the figures, created when asked for."""
        return self.folder(FIGURES)

    def folder(self, name: str) -> Path:
        """Folder inside the directory, created when asked for."""
        folder = self.path / name
        make_directory(folder)
        return folder

    def write(self, name: str, content: str | Mapping[str, Any]) -> Path:
        """Write a text, or plain values and arrays as JSON, atomically; a folder in the name is created."""
        path = self.path / name
        make_directory(path.parent)
        return write_result(path, content)

    def read(self, name: str) -> dict[str, Any]:
        """JSON object in a file of the directory; MotionFileError if it is damaged."""
        return read_json(self.path / name, f"as written by {self.writer}")

    def damaged(self, file: Path, advice: str = "") -> MotionFileError:
        """Error of a file whose content does not fit."""
        return MotionFileError(f"{file}: is damaged; valid: as written by {self.writer}{advice}")

    def remove(self, *patterns: str) -> None:
        """Remove files by their patterns."""
        with writing(self.path):
            for pattern in patterns:
                for file in self.path.glob(pattern):
                    file.unlink()


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Context in which an OSError becomes a MotionFileError: ``path`` cannot be written."""
    try:
        yield
    except OSError as error:
        problem = f"{path}: cannot be written ({error.strerror or error})"
        raise MotionFileError(f"{problem}; valid: in a writable directory") from None


def write_result(path: str | Path, content: str | Mapping[str, Any]) -> Path:
    """Write a text, or plain values as JSON, atomically; MotionFileError if it cannot be written."""
    with writing(Path(path)):
        write_text(path, content if isinstance(content, str) else to_json(content) + "\n")
    return Path(path)


def write_content(path: str | Path, data: bytes) -> Path:
    """Write bytes atomically; MotionFileError if they cannot be written."""
    with writing(Path(path)):
        write_bytes(path, data)
    return Path(path)


def read_json(path: Path, valid: str = "as written by manikin") -> dict[str, Any]:
    """JSON object in a file; MotionFileError, with what is ``valid``, if it is none or cannot be read."""
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise MotionFileError(f"{path}: there is no such file; valid: {valid}") from None
    except (OSError, ValueError) as error:
        raise MotionFileError(f"{path}: is damaged ({error}); valid: {valid}") from None
    if not isinstance(value, dict):
        raise MotionFileError(f"{path}: is damaged (not a JSON object); valid: {valid}")
    return value


def make_directory(path: Path) -> None:
    """Create a directory, and those above it, unless it is there; MotionFileError if that fails."""
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Comma-separated text; None is an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def columns_csv(columns: Mapping[str, np.ndarray], digits: int) -> str:
    """Comma-separated text of arrays (n,), under their names, with so many significant digits."""
    text = io.StringIO()
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt=f"%.{digits}g", delimiter=",")
    return text.getvalue()


def to_json(value: Any) -> str:
    """JSON text of plain values and numpy arrays; NaN and infinity, which JSON lacks, become null."""
    return json.dumps(_plain(value), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Context that yields a temporary path; what is written there replaces ``path`` on success.

    Its folder must exist, a symbolic link is followed; OSError if the folder cannot be written to.
    """
    target = Path(path).resolve()
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write ``text`` in UTF-8 with Unix line ends, atomically; OSError as of :func:`atomic_path`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write ``data`` atomically; OSError as of :func:`atomic_path`."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)
