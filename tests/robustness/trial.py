"""Damaged files, each read as a command would: refused in one line, or what is read is plausible."""

import contextlib
import io
import signal
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from tests.robustness.samples import DAMAGED, FORMATS, Format

from manikin.errors import InputError, ManikinError
from manikin.runtime.memory import limit_memory

LONGEST = 30
"""Time in which every file is read or refused [s]."""
MEMORY = 2 * 1024**3
"""What reading may add to the memory of a process [bytes]."""
LARGEST = 1e4
"""Numbers of what is read are smaller [SI units]."""


class _TooLong(BaseException):
    pass


@dataclass(frozen=True)
class Finding:
    """A file that was neither refused in one line nor read as something plausible."""

    format: str
    seed: int
    case: int
    what: str


def tried(kind: Format, seed: int, cases: range) -> list[Finding]:
    """Findings among some damaged files of a format."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        path = kind.write(folder)
        if (what := _implausible(kind.read(path))) is not None:
            raise ValueError(f"the whole {kind.name} file is not plausible: {what}")
        damaged = folder / DAMAGED.get(kind.name, path.name)
        whole = damaged.read_bytes()
        found = []
        for case in cases:
            damaged.write_bytes(kind.damaged(whole, seed, case))
            if (what := _fault(kind, path)) is not None:
                found.append(Finding(kind.name, seed, case, what))
        return found


def _fault(kind: Format, path: Path) -> str | None:
    try:
        with _time_limit(), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return _implausible(kind.read(path))
    except InputError as error:
        return f"{str(error)[:300]!r} is no line that says what is valid" if "\n" in str(error) else None
    except ManikinError as error:
        return f"{type(error).__name__}: {error}"
    except _TooLong:
        return f"takes longer than {LONGEST} s"
    except (Exception, MemoryError):
        return "".join(traceback.format_exc().splitlines(keepends=True)[-4:])


def _implausible(values: list[Any]) -> str | None:
    for value in values:
        array = np.asarray(value, dtype=np.float64)
        if not np.all(np.isfinite(array)) or (array.size and np.abs(array).max() > LARGEST):
            return f"read {array.ravel()[:3]}, the largest {np.abs(array).max():.3g}"
    return None


@contextlib.contextmanager
def _time_limit() -> Iterator[None]:
    def stop(_number: int, _frame: Any) -> None:
        raise _TooLong

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(LONGEST)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def batch_of(name: str, seed: int, first: int, count: int) -> list[Finding]:
    """Findings among cases of a format, in a process that may use :data:`MEMORY` more than it does."""
    limit_memory(MEMORY)
    kind = next(kind for kind in FORMATS if kind.name == name)
    return tried(kind, seed, range(first, first + count))
