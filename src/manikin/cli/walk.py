"""``manikin walk``, ``words`` and ``library``: walks of a body, their words and their recorded cycles."""

import math
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli import console
from manikin.cli.console import (
    FiguresOption,
    HostOption,
    JobsOption,
    JsonOption,
    OutOption,
    SexOption,
    argument,
    flag,
    option,
)
from manikin.errors import InputError
from manikin.viewer import THIS_COMPUTER

SHOWN = (
    "duration_s", "path_length_m", "cost", "max_forward_mps", "max_left_mps", "steps", "max_stance_slide_m",
    "min_room_m", "path_wall_ms", "motion_wall_ms",
)  # fmt: skip
"""Printed values of a walk; everything is in the JSON."""

Place = tuple[float, float, float]
_WEIGHTS = "Weights: prose or literal of the thesis, recorded or recorded-turns. Default: prose."
_FOLDER = "Folder with clips_locomotion.csv and, in mocap, the BVH and AMC files it names."


def walk(
    context: typer.Context,
    to: Annotated[
        Place | None, option("X Y HEADING_DEG", "Goal [m, m, deg, counter-clockwise from x].")
    ] = None,
    start: Annotated[Place, option("X Y HEADING_DEG", "Start [m, m, deg].", "--from")] = (0.0, 0.0, 0.0),
    scene: Annotated[
        str | None, option("NAME|FILE.yaml", "Scenario whose obstacles stand in the way.", "--in")
    ] = None,
    max_speed: Annotated[float | None, option("M/S", "Limit of the speed. Default: 1.6.")] = None,
    weights: Annotated[str | None, option("NAME", _WEIGHTS)] = None,
    stature: Annotated[float, option("M", "Stature [m].")] = 1.75,
    mass: Annotated[float, option("KG", "Mass [kg].")] = 70.0,
    sex: SexOption = "male",
    execute: Annotated[bool, flag("--execute", "Walk in balance, and in the physics engine.")] = False,
    drive: Annotated[
        bool, flag("--drive", "Steer a walker in the browser with keys and sliders instead.")
    ] = False,
    port: Annotated[
        int | None, option("N", "With --drive: port; 0 picks a free one.", min=0, max=65535)
    ] = None,
    host: HostOption = THIS_COMPUTER,
    out: OutOption = None,
    figures: FiguresOption = True,
    json: JsonOption = False,
) -> int | None:
    """Walk to a place as people do: path by optimal control, whole body from recorded walks."""
    body: dict[str, Any] = {"model": "human", "stature_m": stature, "mass_kg": mass, "sex": sex}
    if drive:
        walked = {"--to": to, "--max-speed": max_speed, "--weights": weights, "--out": out}
        walked["--execute"] = execute or None
        console.refuse_given(walked | {"--json": json or None}, "it is for a walk to a place")
        return _drive(body, start, scene, 8080 if port is None else port, host)
    console.refuse(port is not None, "--port", "it is for --drive")
    console.refuse(host != THIS_COMPUTER, "--host", "it is for --drive")
    if to is None:
        raise InputError("--to is missing; valid: X Y HEADING_DEG, or --drive")
    from manikin.scenarios import load_scenario
    from manikin.scenarios.planned import walk_task

    around = None if scene is None else load_scenario(scene)
    job = walk_task(
        to, start=start, body=body, max_speed=max_speed, weights=weights, around=around, execute=execute
    )
    return console.run_job(
        job, out, context.obj, draw=figures, json=json, part="walk", shown=SHOWN,
        beside={"max_stance_slide_m": None},
    )  # fmt: skip


def _drive(body: dict[str, Any], start: Place, scene: str | None, port: int, host: str) -> None:
    """Serve the page until Ctrl-C."""
    from manikin.body import human
    from manikin.scenarios import load_scenario
    from manikin.viewer import serve_drive
    from manikin.walking import WalkController

    person = human(body["stature_m"], body["mass_kg"], body["sex"])
    around = None if scene is None else load_scenario(scene).build_scene()
    place = (start[0], start[1], math.radians(start[2]))
    serve_drive(WalkController(person, place=place), around, port, console.announce, host=host)


def words(
    context: typer.Context,
    out: OutOption = None,
    slices: Annotated[
        str, option("DEG,DEG|all", "Final headings, each a multiple of 10 from 0 to 350.")
    ] = "all",
    jobs: JobsOption = None,
    figures: Annotated[
        bool | None, flag("--figures/--no-figures", "Draw the figures into the directory.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Partition the goals of a walk by the word of the best path; an interrupted run is continued."""
    headings = _headings(slices)
    directory = console.directory_of(out, "words", json=json)
    console.refuse(figures is True and directory is None, "--figures", "there is no directory to draw into")
    from manikin.reports.directories import solve_partition
    from manikin.walking.words import THESIS_GRID

    with console.bars(context.obj) as progress:
        summary = solve_partition(
            headings, THESIS_GRID, directory, jobs=console.processes(jobs), draw=figures is not False,
            progress=progress,
        )  # fmt: skip
    if json:
        console.print_json(summary)
    else:
        width = max(len(word) for word in summary["counts"])
        for word, count in summary["counts"].items():
            typer.echo(f"{word:{width}}  {count:6d}  {100 * summary['shares'][word]:6.2f} %")
        typer.echo(f"{'all':{width}}  {summary['solved']:6d}")
        typer.echo(f"files in {directory}", err=True)


def _headings(text: str) -> list[int]:
    """Headings [deg] of an option."""
    from manikin.walking.words import HEADINGS

    if text == "all":
        return list(HEADINGS)
    valid = {str(heading): heading for heading in HEADINGS}
    try:
        return sorted({valid[part.strip()] for part in text.split(",")})
    except KeyError as error:
        raise InputError(
            f"--slices {text}: {error} is no slice; valid: all, or 0, 10, ... 350 with commas between"
        ) from None


library = typer.Typer(no_args_is_help=True, rich_markup_mode=None)


@library.callback()
def _group() -> None:
    """Walking cycles by velocity, from recorded motion."""


@library.command()
def build(
    context: typer.Context,
    directory: Annotated[Path, argument("DIR", _FOLDER)],
    out: Annotated[Path, typer.Option(help="File to write (.npz).")] = Path("walking_library.npz"),
    json: JsonOption = False,
) -> None:
    """Cut cycles from recordings and write them, as Fourier coefficients, to a file."""
    from manikin.walking.gait.library_build import build_library
    from manikin.walking.gait.motion_library import save_library

    if not out.parent.is_dir() or out.is_dir():
        raise InputError(f"--out is {out}; valid: a file in a folder that exists")
    with console.bars(context.obj) as progress:
        built = build_library(directory, lambda share, remark: progress("library", share, remark))
        save_library(built.library, out)
    classes = Counter(built.library.kinds)
    summary = {
        "file": str(out), "size_bytes": out.stat().st_size, "cycles": len(built.library),
        "classes": dict(classes),
        "windows_without_cycle": [f"{w.file} {w.first}-{w.last}" for w in built.without_cycle],
        "windows_near_others": [f"{w.file} {w.first}-{w.last}" for w in built.near_others],
        "acknowledgements": list(built.library.acknowledgements),
    }  # fmt: skip
    counts = ", ".join(f"{number} {kind}" for kind, number in classes.items())
    console.print_report(summary, summary | {"classes": counts}, json=json)
