"""``--set KEY=VALUE``: single values of a scenario, changed from outside."""

import copy
from collections.abc import Sequence
from typing import Any

from manikin.errors import ScenarioError
from manikin.scenarios.tree import NULL_IS_A_VALUE, VARIANTS, Tree
from manikin.scenarios.yaml_reader import KeyPath, parse_value

RESOLVED = ("extends", VARIANTS)
"""Keys that a scenario no longer has when it is loaded."""


def override(tree: Tree, settings: Sequence[str]) -> Tree:
    """Set single values.

    A key is a dotted path; an entry of a list is meant by its number from 0, an obstacle also by
    its name: ``scene.roof.position.2=0.4``.  The value is YAML; ``null`` removes the key or entry.

    Args:
        tree: Content of a scenario with its defaults; not changed.
        settings: ``KEY=VALUE`` each, applied in order.

    Returns:
        The changed content, not yet checked.

    Raises:
        ScenarioError: One line, if a key leads nowhere or a value is not YAML.
    """
    changed = Tree(copy.deepcopy(tree.data), dict(tree.lines))
    for setting in settings:
        changed = _set(changed, setting)
    return changed


def _set(tree: Tree, setting: str) -> Tree:
    key, equals, text = setting.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise ScenarioError(f"--set {setting}: is not KEY=VALUE; valid: such as supports.friction=0.5")
    source = f"--set {key.strip()}"
    if parts[0] in RESOLVED:
        raise ScenarioError(f"{source}: {parts[0]} cannot be set; valid: the keys of one scenario")
    value = parse_value(text, source)
    holder: Any = tree.data
    path: KeyPath = ()
    made: dict[KeyPath, str] = {}
    for depth, part in enumerate(parts[:-1]):
        step = _step(holder, part, parts[:depth], source)
        path = (*path, step)
        if isinstance(holder, dict) and step not in holder:
            holder[step], made[path] = {}, source
        holder = holder[step]
    step = _step(holder, parts[-1], parts[:-1], source)
    if value is not None or (*path, step) in NULL_IS_A_VALUE:
        holder[step] = value
        changed = (*path, step)
    elif isinstance(holder, list):
        holder.pop(int(step))
        changed = path  # the entries behind it have moved
    else:
        holder.pop(step, None)
        changed = (*path, step)
    lines = {p: where for p, where in tree.lines.items() if p[: len(changed)] != changed}
    return Tree(tree.data, {**lines, **made, changed: source})


def _step(place: Any, part: str, before: Sequence[str], source: str) -> str | int:
    """Key or index that ``part`` means in ``place``."""
    if isinstance(place, dict):
        return part
    where = ".".join(before)
    if not isinstance(place, list):
        raise ScenarioError(f"{source}: {where} is {place!r}, which holds no {part!r}; valid: {where}=VALUE")
    if part.isdigit() and int(part) < len(place):
        return int(part)
    names = [entry["name"] for entry in place if isinstance(entry, dict) and "name" in entry]
    if part in names:
        return names.index(part)
    numbers = f"an entry from 0 to {len(place) - 1}" if place else "nothing, the list is empty"
    valid = f"{numbers}, or {', '.join(names)}" if names else numbers
    raise ScenarioError(f"{source}: {where} has no entry {part!r}; valid: {valid}")
