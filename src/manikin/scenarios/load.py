"""Reading of scenario files, with what they extend (``extends``) and their ``variants``."""

import difflib
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

from manikin.errors import ScenarioError
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import place, validate
from manikin.scenarios.yaml_reader import VARIANTS, Tree, merge, read_yaml
from manikin.scene import mesh_place

EXTENDS = "extends"
"""Key that names the scenario a file is built on; the first key of the file."""


def read_extended(path: Path, above: tuple[Path, ...] = ()) -> Tree:
    """Read a scenario file, laid over the one it extends, if any; the key ``extends`` is left out.

    Relative mesh paths of an extended file in another folder become absolute. ``above`` are files that extend
    this one, the first at the front. ScenarioError if a file cannot be read, is missing or extends itself.
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
        base = Tree(_with_absolute_files(base.data, base_path.resolve().parent), base.lines)
    return merge(base, tree.without(EXTENDS))


def _with_absolute_files(data: Any, folder: Path) -> Any:
    if not isinstance(data, Mapping):
        return data
    changed = dict(data)
    if isinstance(data.get("mesh"), str):
        changed["mesh"] = mesh_place(data["mesh"], folder)
    if isinstance(body := data.get("body"), Mapping):
        files = {key: body[key] for key in ("urdf", "mjcf") if isinstance(body.get(key), str)}
        changed["body"] = {**body, **{key: str((folder / name).resolve()) for key, name in files.items()}}
    if isinstance(data.get("scene"), list):
        changed["scene"] = [_with_absolute_files(entry, folder) for entry in data["scene"]]
    if isinstance(data.get(VARIANTS), Mapping):
        changed[VARIANTS] = {k: _with_absolute_files(v, folder) for k, v in data[VARIANTS].items()}
    return changed


def variants_of(tree: Tree, source: str) -> dict[str, Tree]:
    """Changes of each variant, in order; ScenarioError if one is no mapping or has a key for files only."""
    result = tree.data.get(VARIANTS) if isinstance(tree.data, Mapping) else None
    if result is None:
        return {}
    if not isinstance(result, Mapping):
        here = place(source, (VARIANTS,), tree.lines)
        raise ScenarioError(f"{here} is {result!r}; valid: a mapping of names and what they change")
    for name, change in result.items():
        here = place(source, (VARIANTS, name), tree.lines)
        if not isinstance(name, str) or not name or set(name) & set("@/ "):
            raise ScenarioError(f"{here} is a name that cannot be asked for; valid: no @, / or space")
        if not isinstance(change, Mapping):
            raise ScenarioError(f"{here} is {change!r}; valid: a mapping with what it changes")
        for key in (EXTENDS, VARIANTS):
            if key in change:
                raise ScenarioError(f"{here}.{key} is not for a variant; valid: the other keys")
    return {name: tree.under(VARIANTS, name) for name in result}


def apply_variant(tree: Tree, variant: str, source: str) -> Tree:
    """Lay one variant over the scenario, whose variants stay; ScenarioError if there is none of that name.

    The name of the result is ``NAME@VARIANT``, unless the variant gives one.
    """
    known = variants_of(tree, source)
    if variant not in known:
        valid = ", ".join(known) or "none, the scenario has no variants"
        raise ScenarioError(f"{source}: has no variant {variant!r}; {_hint(variant, known)}valid: {valid}")
    change = known[variant]
    merged = merge(tree, change)
    if "name" in change.data or not isinstance(tree.data.get("name"), str):
        return merged
    return Tree({**merged.data, "name": f"{tree.data['name']}@{variant}"}, merged.lines)


def _hint(given: str, known: Mapping[str, object]) -> str:
    close = difflib.get_close_matches(given, known, n=1)
    return f"did you mean {close[0]!r}? " if close else ""


def built_in() -> dict[str, Path]:
    """Files of the built-in scenarios by name, sorted."""
    return {path.stem: path for path in _built_in_files()}


@cache
def _built_in_files() -> tuple[Path, ...]:
    return tuple(sorted(Path(str(resources.files("manikin.scenarios"))).glob("*.yaml")))


def find_scenario(name_or_path: str | Path, folder: Path = Path()) -> tuple[Path, str | None]:
    """Find a scenario file and the variant, or None, that its name carries.

    It is ``"walls"``, ``"walls@trial-4"``, or the path of a YAML file, from ``folder`` if relative, likewise
    with or without ``@`` and a variant. ScenarioError if there is no such file.
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
        raise ScenarioError(f"{path}: there is no such file; {_hint(str(name_or_path), known)}{valid}")
    if path.suffix.lower() not in (".yaml", ".yml"):
        raise ScenarioError(f"{path}: is not a scenario file by its name; {valid}")
    return path


def list_scenarios() -> dict[str, str]:
    """Names of the built-in scenarios with a one-line description each, sorted by name."""
    return {name: load_scenario(path).file.description for name, path in built_in().items()}


def list_variants(name_or_path: str | Path) -> dict[str, str]:
    """Variants of a scenario with a one-line description each; ScenarioError if it cannot be read."""
    path, _ = find_scenario(name_or_path)
    return {variant: each.file.description for variant, each in _built(path).items() if variant is not None}


def load_scenario(
    name_or_path: str | Path, variant: str | None = None, overrides: Sequence[str] = ()
) -> Scenario:
    """Read a built-in scenario by name, or any scenario file by path, with all its variants checked.

    Args:
        name_or_path: ``"platform"``, or the path of a YAML file; ``"walls@trial-4"`` asks for a variant too.
        overrides: Values to set, ``"supports.friction=0.5"`` each; see
            :func:`manikin.scenarios.scenario.override`.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    path, named = find_scenario(name_or_path)
    if variant is not None and named is not None:
        raise ScenarioError(f"{name_or_path}: names a variant, and so does {variant!r}; valid: one of them")
    wanted = named if variant is None else variant
    scenario = _built(path).get(wanted) or _build_variant(read_extended(path), wanted or "", path)
    return scenario.with_overrides(overrides)


def load_scene(name_or_path: str | Path) -> Scenario:
    """Read a scenario of which the scene matters, by name or path; a file may have a scene and nothing else.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    path, named = find_scenario(name_or_path)
    tree = read_extended(path)
    if named is not None or not isinstance(tree.data, Mapping) or "scene" not in tree.data:
        return load_scenario(name_or_path)
    rest = {} if "task" in tree.data or "recovery" in tree.data else SOME_TASK
    return _build(Tree({"name": path.stem, **rest, **tree.data}, tree.lines), path)


SOME_TASK: Mapping[str, Any] = {"task": {"start": {"at": [0.0, 0.0]}, "goal": {"at": [0.0, 0.0]}}}
"""Task of a file that has none."""


def _built(path: Path) -> Mapping[str | None, Scenario]:
    """The scenario of a file, by None, and all its variants by name."""
    return _built_once(path) if path in _built_in_files() else _built_now(path)


def _built_now(path: Path) -> dict[str | None, Scenario]:
    tree = read_extended(path)
    built: dict[str | None, Scenario] = {None: _build(tree, path)}
    return built | {name: _build_variant(tree, name, path) for name in variants_of(tree, str(path))}


@cache
def _built_once(path: Path) -> Mapping[str | None, Scenario]:
    """Of a built-in scenario, whose file stays as it is while a process runs."""
    return MappingProxyType(_built_now(path))


def _build(tree: Tree, path: Path) -> Scenario:
    resolved = tree.without(VARIANTS)
    file = validate(ScenarioFile, resolved.data, str(path), resolved.lines)
    return Scenario(file, source=str(path), folder=path.resolve().parent, lines=resolved.lines)


def _build_variant(tree: Tree, name: str, path: Path) -> Scenario:
    changed = apply_variant(tree, name, str(path))
    try:
        return _build(changed, path)
    except ScenarioError as error:
        raise ScenarioError(f"{error} (variant {name!r})") from None
