"""The report for faults: complete, and true where something does not work."""

import json
from importlib import import_module

from manikin.cli import main
from manikin.cli.console import DONE, FAILED

command = import_module("manikin.cli.doctor")  # its name in the package is the command's


def test_everything_that_a_run_needs_works_here(capfd):
    assert main(["doctor", "--json"]) == DONE
    report = json.loads(capfd.readouterr().out)
    assert {"numpy", "mujoco", "pin", "casadi", "viser"} <= report["packages"].keys()
    assert not {"ruff", "pytest", "mkdocs"} & report["packages"].keys()
    assert [test["problem"] for test in report["tests"].values()] == [None] * len(command._TESTS)


def test_what_does_not_work_is_named(capfd, monkeypatch):
    def broken():
        raise RuntimeError("no OpenGL")

    monkeypatch.setattr(command, "_TESTS", {"viewer": broken, "files": command._files})
    assert main(["doctor"]) == FAILED
    output = capfd.readouterr().out
    assert "viewer: RuntimeError: no OpenGL" in output
    assert "files: works" in output
    assert "please report" in output
