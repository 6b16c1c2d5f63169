"""Writing files so that nobody ever sees half of one.

Content goes to a hidden temporary file in the same folder, is flushed to the disk and
then renamed over the target, which the operating system does in one step.  An
interruption, even a kill, leaves the old file or none; after a kill a ``.NAME.*.tmp``
file may remain.
"""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Context that yields a temporary path; what is written there replaces ``path`` on success.

    Args:
        path: The file to be written; its folder must exist. A symbolic link is followed.

    Raises:
        OSError: If the folder cannot be written to.
    """
    target = Path(path).resolve()
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        _flush(temporary)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: str | Path, text: str) -> None:
    """Write ``text`` in UTF-8 with Unix line ends, atomically.

    Raises:
        OSError: If the folder cannot be written to.
    """
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _flush(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())
