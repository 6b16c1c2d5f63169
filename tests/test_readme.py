"""The README: its commands are the ones that are checked, its example runs, its tables are true."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from manikin.cli import app
from manikin.pipeline import runner
from manikin.scenarios import load_scenario

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = typer.main.get_command(app).commands


def marked_command(name):
    """Lines of the block after ``<!-- command: NAME -->``, as ``.ci/run`` takes them."""
    block = re.search(rf"<!-- command: {name} -->\n```bash\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    return block[1].splitlines()


@pytest.mark.parametrize(
    ("name", "last"), [("run", "manikin run platform"), ("test", "python -m pytest -n 2")]
)
def test_each_fresh_machine_command_is_one_line(name, last):
    (line,) = marked_command(name)
    assert line.startswith("python3 -m venv .venv && ")
    assert line.endswith(f".venv/bin/{last}")


@pytest.mark.parametrize("name", ["run", "test"])
def test_ci_extracts_the_same_commands(name):
    """The shell function of ``.ci/run`` itself, run on the README."""
    function = next(
        line for line in (ROOT / ".ci/run").read_text().splitlines() if line.startswith("readme_command()")
    )
    found = subprocess.run(
        ["bash", "-c", f"{function}; readme_command {name}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert found.stdout.splitlines() == marked_command(name)


def test_the_command_table_lists_every_command_and_option():
    """Every command of the program has a row, every row is a command, and its options exist."""
    rows = {row[1]: row[0] for row in re.finditer(r"^\| `manikin (\w+).*$", README, re.MULTILINE)}
    assert set(rows) == set(COMMANDS)
    for name, row in rows.items():
        known = {option for parameter in _parameters(COMMANDS[name]) for option in _options(parameter)}
        assert set(re.findall(r"--[\w-]+", row)) <= known


def _parameters(command):
    """Of a command, or of those of a group."""
    inner = getattr(command, "commands", {})
    return [*command.params, *(parameter for each in inner.values() for parameter in each.params)]


def _options(parameter):
    return [*parameter.opts, *parameter.secondary_opts]


def example():
    """The example of the README, and what it prints."""
    code, printed = re.search(r"```python\n(.*?)```\n\n```text\n(.*?)```", README, re.DOTALL).groups()
    assert len(code.splitlines()) <= 10
    return code, printed


def test_the_example_prints_what_the_readme_says(tmp_path, monkeypatch, capsys, runs):
    """The margins follow from the example's numbers alone, so they are compared to the printed digit.

    Its run is the one that the tests share, in a process of its own as that of the example.
    """
    result = runs("platform")

    def shared(job, *, out, seed):
        assert job.to_yaml() == load_scenario("platform").to_yaml()
        assert seed is None
        shutil.copytree(result.directory, out)
        return result

    code, printed = example()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(runner, "run", shared)
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out == printed
    assert (tmp_path / "margin.png").stat().st_size > 10_000


@pytest.mark.long
def test_the_example_runs_by_itself(tmp_path):
    """Everything of it in a fresh process."""
    code, printed = example()
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path,
        env={**os.environ, "MPLBACKEND": "Agg"},
    )  # fmt: skip
    assert found.stdout == printed


@pytest.mark.long
def test_the_notebook_runs_from_top_to_bottom(tmp_path, monkeypatch):
    """Each code cell runs as it stands, and each but the imports ends in a value that a notebook shows."""
    monkeypatch.chdir(tmp_path)
    cells = json.loads((ROOT / "docs/tutorials/first-motion.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, object] = {}
    for cell in (cell for cell in cells if cell["cell_type"] == "code"):
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, "cell", "exec"), names)
        if last is not None:
            shown = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
            assert hasattr(shown, "_repr_html_") or hasattr(shown, "savefig")
    assert names["planned"].verdict == "planned"
    assert names["pushed"].verdict == "proved"


def test_every_linked_file_exists():
    links = re.findall(r"\]\((?!https?:)([^)#]+)", README)
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_the_picture_is_small():
    """A page that loads fast: the picture stays below 400 kB."""
    assert (ROOT / "docs/images/platform.png").stat().st_size < 400_000
