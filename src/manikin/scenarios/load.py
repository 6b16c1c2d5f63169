"""Reading scenarios: the file, what it extends, the variant asked for and values set from outside."""

from collections.abc import Sequence
from pathlib import Path

from manikin.errors import ScenarioError
from manikin.scenarios.extends import read_extended
from manikin.scenarios.find import built_in, find_scenario
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.tree import VARIANTS, Tree
from manikin.scenarios.validation import validate
from manikin.scenarios.variants import apply_variant, variants_of


def list_scenarios() -> dict[str, str]:
    """Names of the built-in scenarios with a one-line description each, sorted by name."""
    return {name: load_scenario(path).description for name, path in built_in().items()}


def list_variants(name_or_path: str | Path) -> dict[str, str]:
    """Names of a scenario's variants with a one-line description each, in the file's order.

    Raises:
        ScenarioError: If the scenario cannot be read.
    """
    path, _ = find_scenario(name_or_path)
    return {
        variant: load_scenario(path, variant).description
        for variant in variants_of(read_extended(path), str(path))
    }


def load_scenario(
    name_or_path: str | Path, variant: str | None = None, overrides: Sequence[str] = ()
) -> Scenario:
    """Read a built-in scenario by name, or any scenario file by path.

    Every variant of the file is checked, whichever is asked for.

    Args:
        name_or_path: ``"platform"``, or the path of a YAML file; ``"walls@trial-4"`` asks for a
            variant as well.
        variant: Name of one of the file's variants.
        overrides: Values to set, ``"supports.friction=0.5"`` each; see
            :func:`manikin.scenarios.overrides.override`.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    path, named = find_scenario(name_or_path)
    if variant is not None and named is not None:
        raise ScenarioError(f"{name_or_path}: names a variant, and so does {variant!r}; valid: one of them")
    wanted = named if variant is None else variant
    tree = read_extended(path)
    plain = _build(tree, path)
    variants = {name: _build_variant(tree, name, path) for name in variants_of(tree, str(path))}
    scenario = plain
    if wanted is not None:
        scenario = variants.get(wanted) or _build_variant(tree, wanted, path)
    return scenario.with_overrides(overrides)


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
