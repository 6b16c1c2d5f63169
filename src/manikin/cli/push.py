"""``manikin push``: push a standing body once, or search how hard it can be pushed from every direction."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from manikin.cli import console
from manikin.cli.console import (
    FiguresOption,
    Interruption,
    JobsOption,
    JsonOption,
    OutOption,
    SexOption,
    flag,
    option,
)
from manikin.errors import InputError
from manikin.reports.summary_table import columns

if TYPE_CHECKING:
    from manikin.scenarios import Scenario
    from manikin.simulation import DirectionSearch, HeldImpulse, PushMap

_COMPARED: dict[str, tuple[str, Callable[[str], Any]]] = {
    "feet": ("feet", str),
    "support": ("support", str),
    "steps": ("steps", int),
    "feet-apart": ("feet_apart_m", float),
    "delay": ("delay_s", float),
    "ankle-stiffness": ("ankle_stiffness", float),
    "strength": ("strength", float),
    "locked": ("locked", lambda value: [] if value == "none" else value.split("+")),
}
"""Settings of ``--compare``: key of the recovery and how its value is read."""

_COMPARE = (
    "With --map: a further map that differs in this, such as locked=arms, support=left "
    "or delay=0; repeatable."
)

_OPTIONS: dict[tuple[str | int, ...], str] = {
    ("push", "direction_deg"): "--direction",
    ("push", "duration_s"): "--duration",
    ("recovery", "duration_s"): "--duration",
    **{("recovery", key): f"--{name}" for name, (key, _) in _COMPARED.items()},
    ("body", "model"): "--body",
    ("body", "stature_m"): "--stature",
    ("body", "mass_kg"): "--mass",
    ("body", "sex"): "--sex",
}
"""Options that give the values of the scenario, for messages."""

SHOWN = (
    "recovered", "impulse_Ns", "direction_deg", "feet", "time_to_rest_s", "steps", "posture_share",
    "program_share", "max_capture_point_reach", "max_foot_motion_m", "final_com_height_m",
)  # fmt: skip
"""Printed values of one push; everything is in the JSON."""


def push(
    context: typer.Context,
    force: Annotated[float | None, option("N", "Force [N].")] = None,
    direction: Annotated[
        float | None, option("DEG", "Of the force, counter-clockwise from ahead: 90 is to the left.")
    ] = None,
    duration: Annotated[float, option("S", "How long [s].")] = 0.1,
    delay: Annotated[float | None, option("S", "Until the body reacts [s]. Default: 0.2.")] = None,
    feet: Annotated[
        str | None, option("held|free", "Welded to the ground, or in contact. Default: held.")
    ] = None,
    support: Annotated[str | None, option("both|left|right", "Feet to stand on. Default: both.")] = None,
    feet_apart: Annotated[
        float | None, option("M", "Between the middles of both soles [m]. Default: as the body stands.")
    ] = None,
    steps: Annotated[int | None, option("0|1|2", "Steps that free feet may take. Default: 0.")] = None,
    ankle_stiffness: Annotated[
        float | None, option("X", "Before the body reacts [m g h per radian]. Default: 0.64.")
    ] = None,
    locked: Annotated[
        list[str] | None, option("arms|hips", "Joints that hold the posture; repeatable.")
    ] = None,
    posture_control_only: Annotated[
        bool, flag("--posture-control-only", "Leave the quadratic program out.")
    ] = False,
    strength: Annotated[float, option("X", "Torque and speed limits relative to the body's.")] = 1.0,
    body: Annotated[Literal["kudoh", "human"], option("kudoh|human", "Who is pushed.")] = "kudoh",
    stature: Annotated[float | None, option("M", "Of a human [m].")] = None,
    mass: Annotated[float | None, option("KG", "Of a human [kg].")] = None,
    sex: SexOption = None,
    map_: Annotated[bool, flag("--map", "Search the largest impulse that is held, by direction.")] = False,
    directions: Annotated[int | None, option("N", "With --map: number of directions. Default: 24.")] = None,
    tolerance: Annotated[float | None, option("N.S", "With --map: of the impulse [N.s]. Default: 1.")] = None,
    compare: Annotated[list[str] | None, option("KEY=VALUE", _COMPARE)] = None,
    jobs: JobsOption = None,
    out: OutOption = None,
    figures: FiguresOption = True,
    json: JsonOption = False,
) -> int | None:
    """Push a standing body and see whether it stays on its feet."""
    from manikin.numerics.spatial import finite_number
    from manikin.scenarios.planned import push_task
    from manikin.simulation.push_force import STRONGEST

    person = console.given({"model": body, "stature_m": stature, "mass_kg": mass, "sex": sex})
    recovery = console.given({
        "feet": feet, "support": support, "feet_apart_m": feet_apart, "steps": steps, "delay_s": delay,
        "ankle_stiffness": ankle_stiffness, "locked": list(locked or ()), "strength": strength,
        "posture_control_only": posture_control_only,
    })  # fmt: skip

    def scenario(name: str, force: float, direction: float, changes: dict[str, Any]) -> "Scenario":
        return push_task(
            force, direction, duration=duration, name=name, body=person, recovery=recovery | changes,
            where=_OPTIONS,
        )  # fmt: skip

    if map_:
        from manikin.pipeline.stages.recovery_stage import push_map_searches

        console.refuse(force is not None, "--force", "it is what a map searches")
        console.refuse(direction is not None, "--direction", "a map has all of them")
        within = 1.0 if tolerance is None else tolerance
        within = finite_number(within, "--tolerance", at_least=0.01, at_most=100.0)
        changed = ({}, *(_changes(text) for text in compare or ()))
        scenarios = [scenario("push-map", 1.0, 0.0, changes) for changes in changed]
        asked = push_map_searches(scenarios, 24 if directions is None else directions, within)
        directory = console.directory_of(out, "push-map", json=json)
        return _search(asked, directory, context.obj, jobs=jobs, draw=figures, json=json)
    only_maps: dict[str, Any] = {
        "--directions": directions, "--tolerance": tolerance, "--compare": compare, "--jobs": jobs,
    }  # fmt: skip
    console.refuse_given(only_maps, "it is for --map")
    if force is None or direction is None:
        option = "--force" if force is None else "--direction"
        raise InputError(f"{option} is missing; valid: a number, or --map")
    finite_number(force, "--force [N]", above=0.0, at_most=STRONGEST)
    job = scenario(f"push-{force:g}N-{direction:g}deg", force, direction, {})
    return console.run_job(job, out, context.obj, draw=figures, json=json, part="push", shown=SHOWN)


def _changes(text: str) -> dict[str, Any]:
    """Keys of the recovery that ``KEY=VALUE,KEY=VALUE`` sets."""
    changes = {}
    for part in (part.strip() for part in text.split(",")):
        key, _, value = part.partition("=")
        try:
            if key == "posture-control-only" and value in ("", "yes", "no"):
                changes["posture_control_only"] = value != "no"
                continue
            if value:
                name, read = _COMPARED[key]
                changes[name] = read(value)
                continue
        except (KeyError, ValueError):
            pass
        raise InputError(
            f"--compare {text}: {part!r} is not a setting; valid: feet=free, support=left, steps=1, "
            "feet-apart=M, locked=arms+hips or none, delay=SECONDS, ankle-stiffness=X, strength=X, "
            "posture-control-only, or several with commas between"
        )
    return changes


def _search(
    asked: "list[tuple[PushMap, list[DirectionSearch]]]", path: Path | None, interruption: Interruption, *,
    jobs: int | None, draw: bool, json: bool,
) -> None:  # fmt: skip
    """Search maps, keep every direction as soon as it is known, draw and print."""
    from manikin.reports.directories import MapDirectory, maps_as_dict
    from manikin.simulation import search_directions

    maps = [empty for empty, _ in asked]
    directory = None if path is None else MapDirectory(path, maps)
    if directory is not None:
        maps = list(directory.maps)
    waiting = [(number, index) for number, item in enumerate(maps) for index in item.missing]
    total = sum(len(item.directions) for item in maps)
    known = total - len(waiting)
    with console.bars(interruption) as progress:
        progress("map", known / total, f"{known} of {total} directions")
        searches = [asked[number][1][index] for number, index in waiting]
        done = search_directions(searches, jobs=console.processes(jobs))
        for count, (which, result) in enumerate(done, known + 1):
            number, index = waiting[which]
            maps[number] = maps[number].with_found(index, result)
            if directory is not None:
                directory.keep(maps)
            held = "none" if result.held is None else f"{result.held:.1f} N.s"
            towards = f"{maps[number].directions[index]:g} deg"
            progress("map", count / total, f"{count} of {total} directions; {held} towards {towards}")
        if directory is not None and draw:
            directory.draw(asked[0][1][0].trials)
    if json:
        console.print_json(maps_as_dict(maps))
    else:
        _print_maps(maps)
        if path is not None:
            typer.echo(f"files in {path}", err=True)


def _print_maps(maps: "list[PushMap]") -> None:
    """Directions and the largest impulses held, one column per map."""
    from manikin.simulation.push_map import told_apart

    common, names = told_apart([item.conditions for item in maps])
    typer.echo(f"largest impulse that is held [N.s]: {common}")
    rows = [["towards [deg]", *(name or "held" for name in names)]]
    for place, direction in enumerate(maps[0].directions):
        rows.append([f"{direction:g}", *(_impulse(item.found[place]) for item in maps)])
    typer.echo(columns(rows, right=range(len(rows[0]))))


def _impulse(found: "HeldImpulse | None") -> str:
    if found is None or found.held is None:
        return "-"
    return f"{found.held:.1f}" if found.beyond is not None else f">= {found.held:.1f}"
