"""``manikin walk``: the walk of a whole body to a place, or of a walker steered with keys."""

import math
from typing import Annotated, Any

import typer

from manikin.cli.console import (
    DONE,
    FiguresOption,
    JsonOption,
    OutOption,
    SexOption,
    announce,
    directory_of,
    print_json,
    refuse,
    run_job,
)
from manikin.errors import InputError

SHOWN = (
    "duration_s", "path_length_m", "cost", "max_forward_mps", "max_left_mps", "steps", "max_stance_slide_m",
    "min_room_m", "path_wall_ms", "motion_wall_ms",
)  # fmt: skip
"""Printed values of a walk; everything is in the JSON."""

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
    sex: SexOption = "male",
    drive: Annotated[
        bool, typer.Option("--drive", help="Steer a walker in the browser with keys and sliders instead.")
    ] = False,
    port: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, max=65535, help="With --drive: port; 0 picks a free one."),
    ] = None,
    out: OutOption = None,
    figures: FiguresOption = True,
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
    outcome = run_job(job, directory_of(out, job.name, json=json), context.obj, draw=figures)
    block = outcome.summary["walk"]
    if json:
        print_json({"max_stance_slide_m": None} | block | outcome.summary)
    else:
        outcome.print({key: block.get(key) for key in SHOWN})
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
    serve_drive(WalkController(person, place=place), around, port, announce)
    return DONE
