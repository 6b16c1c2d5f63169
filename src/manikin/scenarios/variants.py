"""``variants``: named changes of a scenario, kept in its own file."""

import difflib
from collections.abc import Mapping

from manikin.errors import ScenarioError
from manikin.scenarios.tree import VARIANTS, Tree, merge
from manikin.scenarios.validation import place

_NOT_IN_A_VARIANT = ("extends", VARIANTS)


def variants_of(tree: Tree, source: str) -> dict[str, Tree]:
    """Changes of each variant, in the order of the file.

    Args:
        tree: Content of a scenario file.
        source: Its name, for messages.

    Raises:
        ScenarioError: If a variant is not a mapping or holds a key that only a file has.
    """
    found = tree.data.get(VARIANTS) if isinstance(tree.data, Mapping) else None
    if found is None:
        return {}
    if not isinstance(found, Mapping):
        here = place(source, (VARIANTS,), tree.lines)
        raise ScenarioError(f"{here} is {found!r}; valid: a mapping of names and what they change")
    for name, change in found.items():
        here = place(source, (VARIANTS, name), tree.lines)
        if not isinstance(name, str) or not name or set(name) & set("@/ "):
            raise ScenarioError(f"{here} is a name that cannot be asked for; valid: no @, / or space")
        if not isinstance(change, Mapping):
            raise ScenarioError(f"{here} is {change!r}; valid: a mapping with what it changes")
        for key in _NOT_IN_A_VARIANT:
            if key in change:
                raise ScenarioError(f"{here}.{key} is not for a variant; valid: the other keys")
    return {name: tree.under(VARIANTS, name) for name in found}


def apply_variant(tree: Tree, variant: str, source: str) -> Tree:
    """Lay one variant over the scenario; the variants themselves stay.

    The name of the result is ``NAME@VARIANT``, unless the variant gives one.

    Args:
        tree: Content of a scenario file.
        variant: Name of the variant.
        source: Name of the file, for messages.

    Raises:
        ScenarioError: If there is no such variant, in one line with the valid names.
    """
    known = variants_of(tree, source)
    if variant not in known:
        close = difflib.get_close_matches(variant, known, n=1)
        hint = f"did you mean {close[0]!r}? " if close else ""
        valid = ", ".join(known) or "none, the scenario has no variants"
        raise ScenarioError(f"{source}: has no variant {variant!r}; {hint}valid: {valid}")
    change = known[variant]
    merged = merge(tree, change)
    if "name" in change.data or not isinstance(tree.data.get("name"), str):
        return merged
    return Tree({**merged.data, "name": f"{tree.data['name']}@{variant}"}, merged.lines)
