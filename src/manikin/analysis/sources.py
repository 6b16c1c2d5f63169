"""Files of recordings among files and folders."""

from collections.abc import Iterable
from pathlib import Path

from manikin.errors import InputError
from manikin.mocap.read import READERS


def recordings_in(sources: Iterable[str | Path]) -> tuple[Path, ...]:
    """Recordings among files and folders, each once: files as given, those of a folder in order of path.

    A file that is named is taken whatever its ending, so that its reader can say what is wrong with it.

    Args:
        sources: Files, or folders that are searched to any depth.

    Raises:
        InputError: If a source is not there, or a folder holds no recording.
    """
    found: dict[Path, None] = {}
    for source in map(Path, sources):
        if not source.exists():
            raise InputError(f"{source}: there is no such file; valid: a recording, or a folder of them")
        if not source.is_dir():
            found[source] = None
            continue
        inside = sorted(
            path for path in source.rglob("*") if path.suffix.lower() in READERS and path.is_file()
        )
        if not inside:
            raise InputError(f"{source}: holds no recording; valid: files {', '.join(READERS)}")
        found |= dict.fromkeys(inside)
    return tuple(found)
