"""``manikin walk``: how a person walks to a place, with the whole body; or somebody steered with keys.

Also here. ``manikin library build``: the motion library of walking cycles from recordings.
"""

import math
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli.console import DONE, JsonOption, print_json, print_table, refuse, run_job, stdout_kept_clean
from manikin.errors import InputError

library = typer.Typer(
    help="Walking cycles by velocity, from recorded motion.", no_args_is_help=True, rich_markup_mode=None
)

DEFAULT = "walking_library.npz"


@library.callback()
def _group() -> None:
    """Walking cycles by velocity, from recorded motion."""


@library.command()
def build(
    directory: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Folder with clips_locomotion.csv and, in mocap, the BVH and AMC files it names.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="File to write (.npz).")] = Path(DEFAULT),
    json: JsonOption = False,
) -> int:
    """Cut cycles from recordings and write them, as Fourier coefficients, to a file."""
    from manikin.errors import InputError
    from manikin.runtime.progress import StageProgress
    from manikin.walking.gait.library_build import build_library
    from manikin.walking.gait.motion_library import save_library

    if not out.parent.is_dir() or out.is_dir():
        raise InputError(f"--out is {out}; valid: a file in a folder that exists")
    with stdout_kept_clean(), StageProgress() as bars:
        built = build_library(directory, lambda share, remark: bars("library", share, remark))
        save_library(built.library, out)
    summary = {
        "file": str(out),
        "size_bytes": out.stat().st_size,
        "cycles": len(built.library),
        "classes": dict(Counter(built.library.kinds)),
        "windows_without_cycle": [f"{w.file} {w.first}-{w.last}" for w in built.without_cycle],
        "windows_near_others": [f"{w.file} {w.first}-{w.last}" for w in built.near_others],
        "acknowledgements": list(built.library.acknowledgements),
    }
    if json:
        print_json(summary)
    else:
        print_table(summary | {"classes": ", ".join(f"{n} {k}" for k, n in summary["classes"].items())})
    return DONE


SHOWN = (
    "duration_s", "path_length_m", "cost", "max_forward_mps", "max_left_mps", "steps", "max_stance_slide_m",
    "min_room_m", "path_wall_ms", "motion_wall_ms",
)  # fmt: skip
"""What people are told about a walk; everything is in the JSON."""

Place = tuple[float, float, float]


def walk(
    context: typer.Context,
    to: Annotated[
        Place | None,
        typer.Option(metavar="X Y HEADING_DEG", help="Goal [m, m, deg, counter-clockwise from x]."),
    ] = None,
    start: Annotated[Place, typer.Option("--from", metavar="X Y HEADING_DEG", help="Start [m, m, deg].")] = (
        0.0,
        0.0,
        0.0,
    ),
    scene: Annotated[
        str | None,
        typer.Option("--in", metavar="NAME|FILE.yaml", help="Scenario whose obstacles stand in the way."),
    ] = None,
    max_speed: Annotated[
        float | None, typer.Option(metavar="M/S", help="Limit of the speed. Default: 1.6.")
    ] = None,
    weights: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Weights: prose or literal of the thesis, recorded or recorded-turns. Default: prose.",
        ),
    ] = None,
    stature: Annotated[float, typer.Option(metavar="M", help="Stature [m].")] = 1.75,
    mass: Annotated[float, typer.Option(metavar="KG", help="Mass [kg].")] = 70.0,
    sex: Annotated[str, typer.Option(metavar="male|female", help="Sex.")] = "male",
    drive: Annotated[
        bool, typer.Option("--drive", help="Steer a walker in the browser with keys and sliders instead.")
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, max=65535, help="With --drive: port; 0 picks a free one."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Run directory. Default: one in runs; none with --json."),
    ] = None,
    figures: Annotated[bool, typer.Option(help="Draw the figures into the directory.")] = True,
    json: JsonOption = False,
) -> int:
    """Walk to a place as people do: path by optimal control, whole body from recorded walks."""
    body: dict[str, Any] = {"model": "human", "stature_m": stature, "mass_kg": mass, "sex": sex}
    if drive:
        given: dict[str, Any] = {
            "--to": to, "--max-speed": max_speed, "--weights": weights, "--out": out, "--json": json or None,
        }  # fmt: skip
        for option, value in given.items():
            refuse(value is not None, option, "it is for a walk to a place")
        return _drive(body, start, scene, 8080 if port is None else port)
    refuse(port is not None, "--port", "it is for --drive")
    if to is None:
        raise InputError("--to is missing; valid: X Y HEADING_DEG, or --drive")
    from manikin.scenarios import load_scenario
    from manikin.scenarios.planned import walk_task

    around = None if scene is None else load_scenario(scene)
    job = walk_task(to, start=start, body=body, max_speed=max_speed, weights=weights, around=around)
    directory = out if out is not None else None if json else Path("runs") / job.name
    outcome = run_job(job, directory, context.obj, draw=figures)
    found = outcome.summary["walk"]
    if json:
        print_json({"max_stance_slide_m": None} | found | outcome.summary)
    else:
        outcome.print({key: found.get(key) for key in SHOWN})
    return outcome.status


def _drive(body: dict[str, Any], start: Place, scene: str | None, port: int) -> int:
    """Serve the page until Ctrl-C."""
    from manikin.body import human
    from manikin.scenarios import load_scenario
    from manikin.viewer import serve_drive
    from manikin.walking import WalkController

    person = human(body["stature_m"], body["mass_kg"], body["sex"])
    around = None if scene is None else load_scenario(scene).build_scene()
    place = (start[0], start[1], math.radians(start[2]))
    serve_drive(WalkController(person, place=place), around, port, _announce)
    return DONE


def _announce(url: str) -> None:
    typer.echo(f"viewer at {url} (Ctrl-C ends it)", err=True)
