"""``manikin push``: push a standing body once, or search how hard it can be pushed from every direction."""

from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.commands.console import JsonOption, print_json, refuse
from manikin.commands.job import run_job
from manikin.commands.push_map import MapRequest, search_map
from manikin.commands.push_options import PushOptions
from manikin.errors import InputError

SHOWN = (
    "recovered", "impulse_Ns", "direction_deg", "feet", "time_to_rest_s", "steps", "posture_share",
    "program_share", "max_capture_point_reach", "max_foot_motion_m", "final_com_height_m",
)  # fmt: skip
"""What people are told about one push; everything is in the JSON."""


def push(
    context: typer.Context,
    force: Annotated[float | None, typer.Option(metavar="N", help="Force [N].")] = None,
    direction: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="Of the force, counter-clockwise from ahead: 90 is to the left."),
    ] = None,
    duration: Annotated[float, typer.Option(metavar="S", help="How long [s].")] = 0.1,
    delay: Annotated[
        float | None, typer.Option(metavar="S", help="Until the body reacts [s]. Default: 0.2.")
    ] = None,
    feet: Annotated[
        str | None,
        typer.Option(metavar="held|free", help="Welded to the ground, or in contact. Default: held."),
    ] = None,
    support: Annotated[
        str | None, typer.Option(metavar="both|left|right", help="Feet to stand on. Default: both.")
    ] = None,
    feet_apart: Annotated[
        float | None,
        typer.Option(metavar="M", help="Between the middles of both soles [m]. Default: as the body stands."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(metavar="0|1|2", help="Steps that free feet may take. Default: 0.")
    ] = None,
    ankle_stiffness: Annotated[
        float | None,
        typer.Option(metavar="X", help="Before the body reacts [m g h per radian]. Default: 0.64."),
    ] = None,
    locked: Annotated[
        list[str] | None,
        typer.Option(metavar="arms|hips", help="Joints that hold the posture; repeatable."),
    ] = None,
    posture_control_only: Annotated[
        bool, typer.Option("--posture-control-only", help="Leave the quadratic program out.")
    ] = False,
    strength: Annotated[
        float, typer.Option(metavar="X", help="Torque and speed limits relative to the body's.")
    ] = 1.0,
    body: Annotated[str, typer.Option(metavar="kudoh|human", help="Who is pushed.")] = "kudoh",
    stature: Annotated[float | None, typer.Option(metavar="M", help="Of a human [m].")] = None,
    mass: Annotated[float | None, typer.Option(metavar="KG", help="Of a human [kg].")] = None,
    sex: Annotated[str | None, typer.Option(metavar="male|female", help="Of a human.")] = None,
    map_: Annotated[
        bool, typer.Option("--map", help="Search the largest impulse that is held, by direction.")
    ] = False,
    directions: Annotated[
        int | None, typer.Option(metavar="N", help="With --map: number of directions. Default: 24.")
    ] = None,
    tolerance: Annotated[
        float | None, typer.Option(metavar="N.S", help="With --map: of the impulse [N.s]. Default: 1.")
    ] = None,
    compare: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="With --map: a further map that differs in this, such as locked=arms, support=left "
            "or delay=0; repeatable.",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="With --map: processes; default: one per core.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory. Default: one in runs; none with --json."),
    ] = None,
    figures: Annotated[bool, typer.Option(help="Draw the figures into the directory.")] = True,
    json: JsonOption = False,
) -> int:
    """Push a standing body and see whether it stays on its feet."""
    options = PushOptions(
        duration=duration,
        delay=delay,
        feet=feet,
        support=support,
        feet_apart=feet_apart,
        steps=steps,
        ankle_stiffness=ankle_stiffness,
        locked=tuple(locked or ()),
        posture_control_only=posture_control_only,
        strength=strength,
        body=body,
        stature=stature,
        mass=mass,
        sex=sex,
    )
    if map_:
        refuse(force is not None, "--force", "it is what a map searches")
        refuse(direction is not None, "--direction", "a map has all of them")
        request = MapRequest(
            options,
            tuple(compare or ()),
            24 if directions is None else directions,
            1.0 if tolerance is None else tolerance,
        )
        directory = out if out is not None else None if json else Path("runs") / "push-map"
        return search_map(request, directory, context.obj, jobs=jobs, draw=figures, json=json)
    only_maps: dict[str, Any] = {
        "--directions": directions, "--tolerance": tolerance, "--compare": compare, "--jobs": jobs,
    }  # fmt: skip
    for option, value in only_maps.items():
        refuse(value is not None, option, "it is for --map")
    for option, value in {"--force": force, "--direction": direction}.items():
        if value is None:
            raise InputError(f"{option} is missing; valid: a number, or --map")
    assert force is not None
    assert direction is not None
    name = f"push-{force:g}N-{direction:g}deg"
    job = options.scenario(name, force, direction)
    directory = out if out is not None else None if json else Path("runs") / name
    outcome = run_job(job, directory, context.obj, draw=figures)
    if json:
        print_json(outcome.summary)
    else:
        outcome.print({key: outcome.summary["push"][key] for key in SHOWN})
    return outcome.status
