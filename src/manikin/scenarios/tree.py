"""The content of a scenario file with the place of every key, and how one is laid over another.

A mapping is merged key by key; a list or a single value replaces the one below; ``null``
removes the key below it.  ``floor_height_m`` is the one key where ``null`` is a value.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from manikin.scenarios.yaml_reader import KeyPath

NULL_IS_A_VALUE: frozenset[KeyPath] = frozenset({("floor_height_m",)})
"""Keys that ``null`` sets instead of removing."""

VARIANTS = "variants"
"""Key of the named variants; what a ``null`` in one removes is decided when it is applied."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Plain values with the place that each came from.

    Attributes:
        data: Mappings, lists and single values, as the YAML reader returns them.
        lines: Place, such as ``"file.yaml:3"``, of every key and list entry.
    """

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
        if value is None and not _null_stays(here):
            merged.pop(key, None)
            _forget(lines, here)
        else:
            merged[key] = _merged(merged.get(key), value, here, lines, new)
    return merged


def _null_stays(path: KeyPath) -> bool:
    return path in NULL_IS_A_VALUE or (path[0] == VARIANTS and len(path) > 2)


def _forget(lines: dict[KeyPath, str], path: KeyPath) -> None:
    for known in [p for p in lines if p[: len(path)] == path]:
        del lines[known]
