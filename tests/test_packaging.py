"""Every package that is imported is declared, where it is needed, and names tell things apart."""

import ast
import importlib.util
import re
import sys
import tomllib
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
DISTRIBUTION = {
    "PIL": "pillow",
    "yaml": "pyyaml",
    "pinocchio": "pin",
    "mpl_toolkits": "matplotlib",
    "xdist": "pytest-xdist",
}
"""Names of distributions that differ from those of their packages."""


@cache
def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(folder):
    """Distributions imported anywhere in a folder, with one file each."""
    found = {}
    for path in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            else:
                continue
            for package in {name.partition(".")[0] for name in names} - sys.stdlib_module_names:
                found[DISTRIBUTION.get(package, package.replace("_", "-"))] = path
    return found


def declared(*extras):
    """Distributions that the package and these extras name."""
    lines = [*PROJECT["dependencies"], *(line for extra in extras for line in EXTRAS[extra])]
    return {re.match(r"[\w-]+", line)[0].lower() for line in lines}


@pytest.mark.parametrize(("folder", "extras"), [("src", ()), ("tests", ("test", "video", "usd"))])
def test_every_import_is_declared(folder, extras):
    scripts = {path.stem.replace("_", "-") for path in (ROOT / "docs").glob("*.py")}
    known = {*declared(*extras), *scripts, "manikin", "tests"}
    assert {name: str(path) for name, path in imported(folder).items() if name not in known} == {}


@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks").glob("*.py")), ids=lambda path: path.stem)
def test_benchmarks_and_sweeps_know_the_package_as_it_is(path):
    """An import fails where a name has moved; what they measure takes too long for a test."""
    spec = importlib.util.spec_from_file_location(f"benchmark_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)


def test_no_two_classes_have_one_name_and_no_file_name_is_used_more_than_twice():
    """Who reads a name knows what it is; private classes included."""
    files = sorted((ROOT / "src/manikin").rglob("*.py"))
    nodes = (node for path in files for node in tree_of(path).body)
    classes = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    assert [name for name, count in classes.items() if count > 1] == []
    names = Counter(path.name for path in files if path.name != "__init__.py")
    assert [name for name, count in names.items() if count > 2] == []
