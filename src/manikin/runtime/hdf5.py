"""HDF5 files from anywhere: whole as they were written, or tried out by a process that may be ended.

Bytes that do not fit each other can make the HDF5 library compute for ever, which nothing in the same process
can stop. A file is written with the SHA-256 digest of its bytes in its user block, the first 512 bytes, which
HDF5 leaves to programs. Where these are as written, the file is read at once; else another process reads it
first, within limits of time and memory.
"""

import hashlib
import signal
import subprocess
import sys
from pathlib import Path

import h5py

from manikin.runtime.memory import limit_memory

USER_BLOCK = 512
"""Bytes before the HDF5 content."""
TIME_LIMIT = 15.0
"""Wall time in which the other process has read the file [s]."""
MEMORY_LIMIT = 2 * 1024**3
"""What it may use more than it begins with [bytes]."""
_SEAL = b"manikin sha256 "
_END_WITH_PARENT = 1
"""Linux: PR_SET_PDEATHSIG."""


def sealed(image: bytes) -> bytes:
    """Content of an HDF5 file behind a user block with its digest."""
    return _user_block(hashlib.sha256(image).hexdigest()) + image


def is_as_written(path: Path) -> bool:
    """Whether the file has a digest, which is that of its content."""
    with path.open("rb") as file:
        head = file.read(USER_BLOCK)
        if not head.startswith(_SEAL):
            return False
        return head == _user_block(hashlib.file_digest(file, "sha256").hexdigest())


def _user_block(digest: str) -> bytes:
    return (_SEAL + digest.encode()).ljust(USER_BLOCK, b"\n")


def try_out(path: Path, largest: int) -> None:
    """Let another process read all of the file but arrays larger than ``largest`` bytes.

    Raises:
        OSError: If it does not end in time, is ended by the library, or wants too much memory.
    """
    command = [sys.executable, "-c", "from manikin.runtime.hdf5 import main; main()", str(path), str(largest)]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
            timeout=TIME_LIMIT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise OSError(f"reading it does not end within {TIME_LIMIT:g} s") from None
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"reading it ends with status {done.returncode}"]
        raise OSError(lines[-1][:160])


def main() -> None:
    """Read the file that the command line names; for :func:`try_out`."""
    _limit()
    largest = int(sys.argv[2])
    try:
        with h5py.File(sys.argv[1], "r") as file:
            _read_group(file, largest, depth=0)
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError) as error:
        sys.exit(" ".join(f"{type(error).__name__}: {error}".split()))


def _read_group(group: h5py.Group, largest: int, depth: int) -> None:
    dict(group.attrs)
    for name in group if depth < 4 else ():
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            _read_group(item, largest, depth + 1)
        elif isinstance(item, h5py.Dataset):
            dict(item.attrs)
            if item.nbytes <= largest and not item.external and not item.is_virtual:
                item[()]


def _limit() -> None:
    """Limit memory and processor time, and end with the parent: by the system, as HDF5 may not stop."""
    try:
        import ctypes
        import resource

        seconds = int(TIME_LIMIT) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        limit_memory(MEMORY_LIMIT)
        ctypes.CDLL(None).prctl(_END_WITH_PARENT, signal.SIGKILL)
    except (ImportError, OSError, ValueError, AttributeError):  # another system
        return
