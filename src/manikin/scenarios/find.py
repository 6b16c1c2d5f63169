"""Finding scenario files: built-in ones by name, others by path, either with a variant."""

import difflib
from importlib import resources
from pathlib import Path

from manikin.errors import ScenarioError

SUFFIXES = (".yaml", ".yml")


def built_in() -> dict[str, Path]:
    """Files of the built-in scenarios by name, sorted."""
    folder = Path(str(resources.files("manikin.scenarios")))
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def find_scenario(name_or_path: str | Path, folder: Path = Path()) -> tuple[Path, str | None]:
    """Find a scenario file and the variant that its name may carry.

    Args:
        name_or_path: ``"walls"``, ``"walls@trial-4"``, or the path of a YAML file, likewise with
            or without ``@`` and a variant.
        folder: Folder that a relative path starts from.

    Returns:
        The file, and the name of the variant or None.

    Raises:
        ScenarioError: If there is no such file, in one line with the valid names.
    """
    known, text = built_in(), str(name_or_path)
    if isinstance(name_or_path, str) and not (text in known or (folder / text).exists()):
        before, at, variant = text.rpartition("@")
        if at and before and "/" not in variant:
            return _find(before, folder, known), variant
    return _find(name_or_path, folder, known), None


def _find(name_or_path: str | Path, folder: Path, known: dict[str, Path]) -> Path:
    if isinstance(name_or_path, str) and name_or_path in known:
        return known[name_or_path]
    path = folder / name_or_path
    valid = f"valid: a scenario file (.yaml) or one of the built-in scenarios: {', '.join(known)}"
    if not str(name_or_path).strip():
        raise ScenarioError(f"scenario name is empty; {valid}")
    if path.is_dir():
        raise ScenarioError(f"{path}: is a directory; {valid}")
    if not path.is_file():
        close = difflib.get_close_matches(str(name_or_path), known, n=1)
        hint = f"did you mean {close[0]!r}? " if close else ""
        raise ScenarioError(f"{path}: there is no such file; {hint}{valid}")
    if path.suffix.lower() not in SUFFIXES:
        raise ScenarioError(f"{path}: is not a scenario file by its name; {valid}")
    return path
