"""``manikin doctor``: what is installed, and whether the parts that a run needs work."""

import platform
import re
import sys
import tempfile
import time as clock
import urllib.request
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import typer

from manikin.cli import console
from manikin.cli.console import JsonOption
from manikin.runtime import __version__

_DEVELOPERS = re.compile(r"extra == .(test|docs|dev).")


def doctor(json: JsonOption = False) -> int:
    """Versions and a self-test of engine, solvers, files and viewer, for reports of faults."""
    report: dict[str, Any] = {
        "manikin": __version__, "python": sys.version.split()[0], "system": platform.platform(),
        "packages": _packages(),
    }  # fmt: skip
    tests: dict[str, Any] = {}
    for name, test in _TESTS.items():
        began, problem = clock.perf_counter(), None
        try:
            with console.stdout_kept_clean():
                test()
        except Exception as error:  # whatever it is, the report is what was asked for
            problem = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        tests[name] = {"works": problem is None, "problem": problem, "wall_s": clock.perf_counter() - began}
    report["tests"] = tests
    works = all(test["works"] for test in tests.values())
    if json:
        console.print_json(report)
    else:
        shown = {key: report[key] for key in ("manikin", "python", "system")} | report["packages"]
        console.print_table({key: value or "not installed" for key, value in shown.items()})
        for name, test in tests.items():
            typer.echo(f"{name}: {'works' if test['works'] else test['problem']} ({test['wall_s']:.1f} s)")
        typer.echo("everything works" if works else "something does not work; please report all of this")
    return console.DONE if works else console.FAILED


def _packages() -> dict[str, str | None]:
    """Version of each distribution that this one requires or can use; None if not installed."""
    required = [item for item in metadata.requires("manikin") or () if not _DEVELOPERS.search(item)]
    found: dict[str, str | None] = {}
    for name in sorted(re.split(r"[^\w.-]", item, maxsplit=1)[0] for item in required):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = None
    return found


def _check(value: float, wanted: float, tolerance: float) -> None:
    if not abs(value - wanted) <= tolerance:
        raise ArithmeticError(f"{value:.6g} came out, not {wanted:.6g} within {tolerance:g}")


def _engine() -> None:
    """A ball falls as far as it must."""
    import mujoco

    text = "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    while data.time < 0.5:
        mujoco.mj_step(model, data)
    _check(float(data.qpos[2]), -0.5 * 9.81 * float(data.time) ** 2, 0.02)


def _quadratic_programs() -> None:
    """The point of a line that is nearest to the origin."""
    import numpy as np

    from manikin.numerics.qp import QuadraticProgram, WarmQPSolver

    free = np.full(2, np.inf)
    row, one = np.ones((1, 2)), np.ones(1)
    program = QuadraticProgram(np.eye(2), np.zeros(2), row, one, one, -free, free, 1)
    _check(float(WarmQPSolver().solve(program).x[0]), 0.5, 1e-6)


def _nonlinear_programs() -> None:
    """The minimum of Rosenbrock's function."""
    import casadi

    x, y = casadi.SX.sym("x"), casadi.SX.sym("y")
    program = {"x": casadi.vertcat(x, y), "f": (1 - x) ** 2 + 100 * (y - x**2) ** 2}
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
    solver = casadi.nlpsol("solver", "ipopt", program, quiet)
    _check(float(solver(x0=[-1.2, 1.0])["x"][0]), 1.0, 1e-6)


def _body() -> None:
    """A person of 79 kg, upright, before a wall."""
    from manikin.body import Configuration, human
    from manikin.scene import Box, Obstacle, Proximity, Scene

    body = human()
    state = Configuration(body, body.standing_posture())
    _check(body.mass, 79.0, 1e-6)
    _check(float(state.com[1]), 0.0, 1e-6)
    wall = Scene([Obstacle("wall", Box((0.1, 4.0, 4.0)), translation=(1.05, 0.0, 0.0))], None)
    near = Proximity(body, wall, self_collision=False).evaluate(state.q, activation=2.0)
    _check(1.0 - float(near.distance.min()), 0.2, 0.1)


def _files() -> None:
    """A text is written as a whole, into a place where results go."""
    from manikin.runtime.files import write_text

    with tempfile.TemporaryDirectory() as folder:
        write_text(Path(folder) / "text", "whole\n")
        if (Path(folder) / "text").read_text() != "whole\n":
            raise OSError("what was written is not what is read")


def _viewer() -> None:
    """A page is served to this computer."""
    from manikin.scene import Scene
    from manikin.viewer.door import Door
    from manikin.viewer.drive import WalkViewer
    from manikin.walking import WalkController

    page = WalkViewer(WalkController(), Door(0), Scene(floor_height=0.0))
    try:
        with urllib.request.urlopen(page.url, timeout=10) as answer:
            if b"<html" not in answer.read().lower():
                raise OSError("the page is empty")
    finally:
        page.close()


_TESTS: dict[str, Callable[[], None]] = {
    "physics engine": _engine, "quadratic programs": _quadratic_programs,
    "nonlinear programs": _nonlinear_programs, "body and scene": _body, "files": _files, "viewer": _viewer,
}  # fmt: skip
