"""``extends``: a scenario file that is built on another one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from manikin.errors import ScenarioError
from manikin.scenarios.find import find_scenario
from manikin.scenarios.tree import VARIANTS, Tree, merge
from manikin.scenarios.validation import place
from manikin.scenarios.variants import apply_variant
from manikin.scenarios.yaml_reader import read_yaml

EXTENDS = "extends"
"""Key that names the scenario a file is built on; the first key of the file."""


def read_extended(path: Path, above: tuple[Path, ...] = ()) -> Tree:
    """Read a scenario file, laid over the one it extends, if any.

    Args:
        path: The file.
        above: Files that extend this one, the first at the front.

    Returns:
        The content without the key ``extends``; relative mesh paths of an extended file in
        another folder have become absolute.

    Raises:
        ScenarioError: One line, if a file cannot be read, is missing or extends itself.
    """
    tree = Tree(*read_yaml(path))
    if not isinstance(tree.data, Mapping) or EXTENDS not in tree.data:
        return tree
    named = tree.data[EXTENDS]
    here = place(str(path), (EXTENDS,), tree.lines)
    if next(iter(tree.data)) != EXTENDS:
        raise ScenarioError(f"{here} is not at the top; valid: the first key of the file")
    if not isinstance(named, str) or not named.strip():
        raise ScenarioError(f"{here} is {named!r}; valid: a built-in scenario or a scenario file")
    try:
        base_path, variant = find_scenario(named, path.parent)
    except ScenarioError as error:
        raise ScenarioError(f"{here} names what cannot be used: {error}") from None
    chain = (*above, path.resolve())
    if base_path.resolve() in chain:
        raise ScenarioError(f"{here} is {named!r}, which leads back to {base_path}; valid: no circles")
    base = read_extended(base_path, chain)
    if variant is not None:
        base = apply_variant(base, variant, str(base_path))
    if base_path.resolve().parent != path.resolve().parent:
        base = Tree(_with_absolute_meshes(base.data, base_path.resolve().parent), base.lines)
    return merge(base, tree.without(EXTENDS))


def _with_absolute_meshes(data: Any, folder: Path) -> Any:
    if not isinstance(data, Mapping):
        return data
    changed = dict(data)
    if isinstance(data.get("scene"), list):
        changed["scene"] = [_with_absolute_mesh(entry, folder) for entry in data["scene"]]
    if isinstance(data.get(VARIANTS), Mapping):
        changed[VARIANTS] = {k: _with_absolute_meshes(v, folder) for k, v in data[VARIANTS].items()}
    return changed


def _with_absolute_mesh(entry: Any, folder: Path) -> Any:
    if isinstance(entry, Mapping) and isinstance(entry.get("mesh"), str):
        return {**entry, "mesh": str((folder / entry["mesh"]).resolve())}
    return entry
