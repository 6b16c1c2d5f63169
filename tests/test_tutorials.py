"""The tutorials: what they tell a reader to type runs, and prints what they show."""

import contextlib
import io
import re
import shutil
from pathlib import Path

import pytest

from manikin.cli import main

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "tutorials"
BLOCK = re.compile(r"^```(bash|python|text)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
MADE = "manikin run platform"
"""The run that all tests share."""
SHOWN = ("manikin run", "manikin view")
"""What is not run here: further runs, and what serves a page until it is stopped."""


def blocks(page):
    return BLOCK.findall((FOLDER / page).read_text(encoding="utf-8"))


def printed(kind, text, names):
    """Standard output of a block of commands or of Python."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        if kind == "python":
            exec(compile(text, "<tutorial>", "exec"), names)
        else:
            for line in text.splitlines():
                if not line.startswith(SHOWN):
                    assert main(line.split()[1:]) == 0, line
    return out.getvalue()


def follow(page):
    """Each output that a page shows, beside what is printed."""
    names, last = {}, ""
    for kind, text in blocks(page):
        if kind == "text":
            yield text, last
        else:
            last = printed(kind, text, names)


def same(shown, line):
    """Whether words are equal, and numbers to 5 % or two units of the last digit shown.

    The optimisations end within their tolerances, not on the same digits on every processor.
    """
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", line).split():
        return False
    for expected, got in zip(NUMBER.findall(shown), NUMBER.findall(line), strict=True):
        digits = len(expected.partition(".")[2])
        if abs(float(got) - float(expected)) > max(0.05 * abs(float(expected)), 2.0 * 10.0**-digits):
            return False
    return True


@pytest.mark.parametrize("page", sorted(path.name for path in FOLDER.glob("*.md")))
def test_a_tutorial_prints_what_it_shows(page, tmp_path, monkeypatch, runs):
    """Line by line in the order of the page; ``...`` stands for lines that are left out."""
    assert MADE in "".join(text for kind, text in blocks(page) if kind == "bash")
    shutil.copytree(runs("platform").directory, tmp_path / "runs/platform")
    monkeypatch.chdir(tmp_path)
    for shown, output in follow(page):
        lines = iter(output.splitlines())
        for line in shown.splitlines():
            if line != "...":
                assert any(same(line, got) for got in lines), f"{line!r} is not in\n{output}"
        assert "..." in shown.splitlines() or not list(lines)


def test_numbers_are_compared_as_numbers():
    assert same("force 100 N at 1.74 s", "force 103 N at  1.75 s")
    assert not same("force 100 N", "force 106 N")
    assert not same("force 100 N", "moment 100 N")
