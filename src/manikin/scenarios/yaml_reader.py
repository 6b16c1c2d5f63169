"""YAML with the line of every key, and how one file is laid over another.

YAML 1.1's traps are left out: ``1e-3`` is a number (PyYAML reads a text), ``010`` is ten, ``no`` and ``on``
are texts, and a key given twice is an error instead of silently replacing the first.

A mapping is merged key by key; a list or a single value replaces the one below; ``null`` removes the key
below it. ``floor_height_m`` is the one key where ``null`` is a value.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from manikin.errors import ScenarioError
from manikin.scenarios.validation import KeyPath

MAX_BYTES = 2_000_000
"""Largest file that is read; scenarios are a few kilobytes."""
MAX_ENTRIES = 100_000
"""Most keys and list entries of a file, counted after its aliases are written out."""
MAX_DEPTH = 100
"""Most mappings and lists inside each other; scenarios have fewer than ten."""
TOO_DEEP = f"is nested too deeply; valid: at most {MAX_DEPTH} levels"

_REPLACED = tuple(f":{kind}" for kind in ("int", "float", "bool", "timestamp"))

_FastestLoader: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_FastestLoader):
    """Safe loader with YAML 1.2's floats and booleans, in C where PyYAML has it."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except (ValueError, TypeError, LookupError, AttributeError):
            kind = str(node.tag).rpartition(":")[2]
            problem = f"{str(node.value)[:40]!r} is no {kind}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from None


_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if not tag.endswith(_REPLACED)]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_FLOAT = r"^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$|^[-+]?\.(inf|Inf|INF)$|^\.(nan|NaN|NAN)$"
for _kind, _pattern, _first in (
    ("int", r"^[-+]?(0|[1-9][0-9]*)$", "-+0123456789"),
    ("float", _FLOAT, "-+0123456789."),
    ("bool", r"^(true|True|TRUE|false|False|FALSE)$", "tTfF"),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(_pattern), list(_first))


def read_yaml(path: Path, kind: str = "") -> tuple[Any, dict[KeyPath, str]]:
    """Content of a YAML document in plain values, and the place of each key and entry: ``"file.yaml:3"``.

    ScenarioError if the file cannot be read, is not YAML or is empty. Where a ``kind`` of file is named, one
    that is not there is told to be of that kind.
    """
    if kind and not path.is_file():
        problem = "is a directory" if path.is_dir() else "there is no such file"
        raise ScenarioError(f"{path}: {problem}; valid: a {kind} file (.yaml)")
    data, lines = _parse(_read_text(path), str(path), "key: value lines")
    if data is None:
        raise ScenarioError(f"{path}: is empty; valid: a YAML mapping, see 'manikin scenarios'")
    return data, {key: f"{path}:{line}" for key, line in lines.items()}


def parse_value(text: str, source: str) -> Any:
    """Parse one YAML value, ``null`` included; ScenarioError, which names ``source``, if it is none."""
    if not text.strip():
        raise ScenarioError(f"{source}: has no value; valid: a YAML value, null removes the key")
    return _parse(text, source, "a YAML value")[0]


def _parse(text: str, source: str, valid: str) -> tuple[Any, dict[KeyPath, int]]:
    lines: dict[KeyPath, int] = {}
    try:
        _check_depth(text, source)
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            if node is not None:
                _walk(node, (), lines, source, set())
            data = None if node is None else loader.construct_document(node)
        finally:
            loader.dispose()
    except (yaml.YAMLError, ValueError, TypeError) as error:
        line, problem = "", str(error)[:120]
        if isinstance(error, yaml.MarkedYAMLError):
            mark = error.problem_mark or error.context_mark
            line = f":{mark.line + 1}" if mark is not None else ""
            problem = str(error.problem or error.context)
        problem = " ".join(problem.split())
        if "nesting depth" in problem:  # newer parsers have a limit of their own
            raise ScenarioError(f"{source}{line}: {TOO_DEEP}") from None
        raise ScenarioError(f"{source}{line}: is not valid YAML ({problem}); valid: {valid}") from None
    return data, lines


def _check_depth(text: str, source: str) -> None:
    # The events come one by one; the C composer ends the process where it recurses too deeply.
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                mark = event.start_mark
                place = source if mark is None else f"{source}:{mark.line + 1}"
                raise ScenarioError(f"{place}: {TOO_DEEP}")
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _read_text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file():
            raise ScenarioError(f"{path}: is no regular file; valid: a text file in UTF-8")
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise ScenarioError(f"{path}: has {size} bytes; valid: at most {MAX_BYTES}")
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: byte {error.start} is not UTF-8; valid: a text file in UTF-8") from None
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read ({error.strerror}); valid: a readable file") from None


def _walk(node: yaml.Node, path: KeyPath, lines: dict[KeyPath, int], source: str, above: set[int]) -> None:
    lines.setdefault(path, node.start_mark.line + 1)
    if len(lines) > MAX_ENTRIES:
        raise ScenarioError(f"{source}: has more than {MAX_ENTRIES} entries; valid: fewer")
    if id(node) in above:
        raise ScenarioError(f"{source}:{lines[path]}: contains itself through an alias; valid: plain values")
    if isinstance(node, yaml.MappingNode):
        seen: set[str] = set()
        for key, value in node.value:
            name = str(key.value)
            line = key.start_mark.line + 1
            if name in seen and name != "<<":
                raise ScenarioError(f"{source}:{line}: key {name!r} is given twice; valid: once")
            seen.add(name)
            lines[(*path, name)] = line
            _walk(value, (*path, name), lines, source, above | {id(node)})
    elif isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            _walk(item, (*path, index), lines, source, above | {id(node)})


NULL_IS_A_VALUE: frozenset[KeyPath] = frozenset({("floor_height_m",)})
"""Keys that ``null`` sets instead of removing."""

VARIANTS = "variants"
"""Key of the named variants; what a ``null`` in one removes is decided when it is applied."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Plain values with the place, such as ``"file.yaml:3"``, of every key and list entry."""

    data: Any
    lines: Mapping[KeyPath, str] = field(default_factory=dict)

    def under(self, *path: str | int) -> "Tree":
        """Return the part under a key path that exists."""
        data = self.data
        for key in path:
            data = data[key]
        depth = len(path)
        return Tree(data, {p[depth:]: place for p, place in self.lines.items() if p[:depth] == path})

    def without(self, key: str) -> "Tree":
        """Return the same tree without one key of its root."""
        if not isinstance(self.data, Mapping) or key not in self.data:
            return self
        lines = dict(self.lines)
        _forget(lines, (key,))
        return Tree({k: v for k, v in self.data.items() if k != key}, lines)


def merge(below: Tree, above: Tree) -> Tree:
    """Lay ``above`` over ``below``; neither is changed."""
    lines = dict(below.lines)
    return Tree(_merged(below.data, above.data, (), lines, above.lines), lines)


def _merged(
    below: Any, above: Any, path: KeyPath, lines: dict[KeyPath, str], new: Mapping[KeyPath, str]
) -> Any:
    if not isinstance(above, Mapping):
        _forget(lines, path)
        lines.update({p: place for p, place in new.items() if p[: len(path)] == path})
        return above
    if not isinstance(below, Mapping):
        _forget(lines, path)
        below = {}
    if path in new:
        lines[path] = new[path]
    merged = dict(below)
    for key, value in above.items():
        here = (*path, key)
        is_change = here[0] == VARIANTS and len(here) > 2
        if value is None and not (is_change or here in NULL_IS_A_VALUE):
            merged.pop(key, None)
            _forget(lines, here)
        else:
            merged[key] = _merged(merged.get(key), value, here, lines, new)
    return merged


def _forget(lines: dict[KeyPath, str], path: KeyPath) -> None:
    for known in [p for p in lines if p[: len(path)] == path]:
        del lines[known]
