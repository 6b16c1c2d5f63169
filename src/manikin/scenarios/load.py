"""Finding and reading scenario files."""

import difflib
from importlib import resources
from pathlib import Path

from manikin.errors import ScenarioError
from manikin.scenarios.scenario import Scenario
from manikin.scenarios.schema import ScenarioFile
from manikin.scenarios.validation import validate
from manikin.scenarios.yaml_reader import read_yaml

_SUFFIXES = (".yaml", ".yml")


def list_scenarios() -> dict[str, str]:
    """Names of the built-in scenarios with a one-line description each, sorted by name."""
    return {name: load_scenario(path).description for name, path in _built_in().items()}


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read a built-in scenario by name, or any scenario file by path.

    Args:
        name_or_path: ``"platform"``, or the path of a YAML file.

    Raises:
        ScenarioError: One line that names the file, the key, what was wrong and what is valid.
    """
    path = _find(name_or_path)
    data, lines = read_yaml(path)
    file = validate(ScenarioFile, data, str(path), lines)
    return Scenario(file, source=str(path), folder=path.resolve().parent, lines=lines)


def _built_in() -> dict[str, Path]:
    folder = Path(str(resources.files("manikin.scenarios")))
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def _find(name_or_path: str | Path) -> Path:
    built_in, path = _built_in(), Path(name_or_path)
    if isinstance(name_or_path, str) and name_or_path in built_in:
        return built_in[name_or_path]
    known = f"valid: a scenario file (.yaml) or one of the built-in scenarios: {', '.join(built_in)}"
    if not str(name_or_path).strip():
        raise ScenarioError(f"scenario name is empty; {known}")
    if path.is_dir():
        raise ScenarioError(f"{path}: is a directory; {known}")
    if not path.is_file():
        close = difflib.get_close_matches(str(name_or_path), built_in, n=1)
        hint = f"did you mean {close[0]!r}? " if close else ""
        raise ScenarioError(f"{path}: there is no such file; {hint}{known}")
    if path.suffix.lower() not in _SUFFIXES:
        raise ScenarioError(f"{path}: is not a scenario file by its name; {known}")
    return path
