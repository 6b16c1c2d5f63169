"""``manikin push``: push a standing body once, or search how hard it can be pushed from every direction.

Also here. What is pushed and how, as the options of ``manikin push`` say it, turned into a scenario.
``manikin push --map``: the largest impulse held, by direction, of one or several ways to stand.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manikin.cli.console import DONE, JsonOption, print_json, refuse, run_job, stdout_kept_clean
from manikin.errors import InputError
from manikin.runtime.progress import Interruption

if TYPE_CHECKING:
    from manikin.scenarios import Scenario
    from manikin.simulation import DirectionSearch, HeldImpulse, PushMap


_OPTIONS: dict[tuple[str | int, ...], str] = {
    ("push", "direction_deg"): "--direction",
    ("push", "duration_s"): "--duration",
    ("recovery", "duration_s"): "--duration",
    ("recovery", "delay_s"): "--delay",
    ("recovery", "feet"): "--feet",
    ("recovery", "support"): "--support",
    ("recovery", "feet_apart_m"): "--feet-apart",
    ("recovery", "steps"): "--steps",
    ("recovery", "ankle_stiffness"): "--ankle-stiffness",
    ("recovery", "locked"): "--locked",
    ("recovery", "strength"): "--strength",
    ("body", "model"): "--body",
    ("body", "stature_m"): "--stature",
    ("body", "mass_kg"): "--mass",
    ("body", "sex"): "--sex",
}
"""Where the values of the scenario come from, for messages."""

_NUMBERS: dict[str, tuple[str, type[int] | type[float]]] = {
    "steps": ("steps", int),
    "feet-apart": ("feet_apart", float),
    "delay": ("delay", float),
    "ankle-stiffness": ("ankle_stiffness", float),
    "strength": ("strength", float),
}
"""Settings of a comparison that are numbers, with their field and kind."""


@dataclass(frozen=True)
class PushOptions:
    """The options that a single push and a map have in common.

    Attributes:
        duration: Of the push [s].
        delay: From the beginning of the push until the body reacts [s]; None for the scenarios' own.
        feet: ``"held"`` or ``"free"``; None for the scenarios' own.
        support: ``"both"`` feet, or ``"left"`` or ``"right"``; None for the scenarios' own.
        feet_apart: Distance between the middles of both soles [m]; None for that of the body's posture.
        steps: How many steps may be taken; None for the scenarios' own.
        ankle_stiffness: Of both ankles before the body reacts, in ``m g h`` per radian; None for the
            scenarios' own.
        locked: Groups of joints that hold the posture.
        posture_control_only: Whether the quadratic program is left out.
        strength: Torque and speed limits relative to those of the body.
        body: ``"kudoh"`` or ``"human"``.
        stature, mass, sex: Of a human [m], [kg]; None for the scenarios' own.
    """

    duration: float = 0.1
    delay: float | None = None
    feet: str | None = None
    support: str | None = None
    feet_apart: float | None = None
    steps: int | None = None
    ankle_stiffness: float | None = None
    locked: tuple[str, ...] = ()
    posture_control_only: bool = False
    strength: float = 1.0
    body: str = "kudoh"
    stature: float | None = None
    mass: float | None = None
    sex: str | None = None

    def scenario(self, name: str, force: float = 1.0, direction: float = 0.0) -> "Scenario":
        """The scenario of one push.

        Args:
            name: Of the scenario.
            force: [N].
            direction: Of the force, counter-clockwise from the body's forward axis [deg].

        Raises:
            ScenarioError: If a value is not usable; the message names the option.
        """
        from manikin.numerics.spatial import finite_number
        from manikin.scenarios.planned import push_task
        from manikin.simulation.recover import STRONGEST

        if self.body not in ("kudoh", "human"):
            raise InputError(f"--body is {self.body!r}; valid: kudoh or human")
        finite_number(force, "--force [N]", above=0.0, at_most=STRONGEST)
        body = {"model": self.body, "stature_m": self.stature, "mass_kg": self.mass, "sex": self.sex}
        recovery = {
            "feet": self.feet, "support": self.support, "feet_apart_m": self.feet_apart,
            "steps": self.steps, "delay_s": self.delay,
            "ankle_stiffness": self.ankle_stiffness, "locked": list(self.locked),
            "strength": self.strength, "posture_control_only": self.posture_control_only,
        }  # fmt: skip
        return push_task(
            force, direction, duration=self.duration, name=name, body=_given(body),
            recovery=_given(recovery), where=_OPTIONS,
        )  # fmt: skip

    def changed(self, text: str) -> "PushOptions":
        """The same with some options set as ``KEY=VALUE,KEY=VALUE`` says; several groups are ``arms+hips``.

        Raises:
            InputError: If that is not what the text is.
        """
        changes = dict(_setting(part.strip(), text) for part in text.split(","))
        return replace(self, **changes)


def conditions(scenario: "Scenario", tolerance: float) -> dict[str, Any]:
    """Plain values that say what a map is about, with every default.

    Args:
        scenario: Of any of its pushes.
        tolerance: Of its search [N.s].
    """
    assert scenario.recovery is not None
    assert scenario.push is not None
    recovery = scenario.recovery.model_dump(mode="json", exclude={"duration_s"})
    return {
        "body": scenario.file.body.model_dump(mode="json", exclude_none=True), **recovery,
        "duration_s": scenario.push.duration_s, "tolerance_Ns": tolerance,
    }  # fmt: skip


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}


def _setting(part: str, text: str) -> tuple[str, Any]:
    """Field and value of one setting of a comparison."""
    key, equals, value = part.partition("=")
    if key == "posture-control-only" and value in ("", "yes", "no"):
        return "posture_control_only", value != "no"
    if key in ("feet", "support") and value:
        return key, value
    if key == "locked" and value:
        return key, () if value == "none" else tuple(value.split("+"))
    if key in _NUMBERS and equals:
        field, number = _NUMBERS[key]
        try:
            return field, number(value)
        except ValueError:
            pass
    raise InputError(
        f"--compare {text}: {part!r} is not a setting; valid: feet=free, support=left, steps=1, "
        "feet-apart=M, locked=arms+hips or none, delay=SECONDS, ankle-stiffness=X, strength=X, "
        "posture-control-only, or several with commas between"
    )


STAGE = "map"


@dataclass(frozen=True)
class MapRequest:
    """What is searched.

    Attributes:
        options: Of the map that is asked for.
        compare: What further maps differ in, each as :meth:`PushOptions.changed` takes it.
        directions: How many, all around.
        tolerance: Of the impulses [N.s].
    """

    options: PushOptions
    compare: tuple[str, ...]
    directions: int
    tolerance: float

    def searches(self) -> "list[tuple[PushMap, list[DirectionSearch]]]":
        """Each map, empty, with the searches of its directions.

        Raises:
            InputError: If a value is not usable.
        """
        from manikin.numerics.spatial import finite_number
        from manikin.pipeline.stages.recovery_stage import push_trials
        from manikin.simulation import DirectionSearch, PushMap, equal_directions

        directions = equal_directions(self.directions)
        tolerance = finite_number(self.tolerance, "--tolerance", at_least=0.01, at_most=100.0)
        found = []
        for options in (self.options, *(self.options.changed(text) for text in self.compare)):
            job = options.scenario("push-map")
            trials = push_trials(job)
            searches = [DirectionSearch(trials, direction, tolerance) for direction in directions]
            empty = PushMap.empty(conditions(job, tolerance), directions, trials.bound(directions))
            found.append((empty, searches))
        return found


def search_map(
    request: MapRequest,
    directory: Path | None,
    interruption: Interruption,
    *,
    jobs: int | None,
    draw: bool,
    json: bool,
) -> int:
    """Search, keep every direction as soon as it is known, draw and print.

    Args:
        request: What is searched.
        directory: Where the files go, or None to write nothing.
        interruption: Asked whether to go on after each direction.
        jobs: Processes; one per core when None.
        draw: Whether the figure is drawn.
        json: Whether the maps are printed as JSON.

    Returns:
        The exit status.
    """
    from manikin.pipeline.batch import usable_cores
    from manikin.reports.directories import MapDirectory, maps_as_dict
    from manikin.runtime.progress import StageProgress
    from manikin.simulation import search_directions

    asked = request.searches()
    maps = [empty for empty, _ in asked]
    kept = None if directory is None else MapDirectory(directory, maps)
    if kept is not None:
        maps = list(kept.maps)
    waiting = [(number, place) for number, one in enumerate(maps) for place in one.missing]
    total = sum(len(one.directions) for one in maps)
    with stdout_kept_clean(), StageProgress() as bars:
        bars(STAGE, 1.0 - len(waiting) / total, f"{total - len(waiting)} of {total} directions")
        searches = [asked[number][1][place] for number, place in waiting]
        done = search_directions(searches, jobs=jobs or usable_cores())
        for count, (index, found) in enumerate(done, total - len(waiting) + 1):
            number, place = waiting[index]
            maps[number] = maps[number].with_found(place, found)
            if kept is not None:
                kept.keep(maps)
            interruption.check()
            bars(STAGE, count / total, _remark(count, total, maps[number], place, found))
        if kept is not None and draw:
            from manikin.reports.write_outputs import write_push_map_figure

            write_push_map_figure(maps, asked[0][1][0].trials, kept.figures)
    if json:
        print_json(maps_as_dict(maps))
    else:
        _print_maps(maps)
        if directory is not None:
            typer.echo(f"files in {directory}", err=True)
    return DONE


def _remark(count: int, total: int, one: "PushMap", place: int, found: "HeldImpulse") -> str:
    held = "none" if found.held is None else f"{found.held:.1f} N.s"
    return f"{count} of {total} directions; {held} towards {one.directions[place]:g} deg"


def _print_maps(maps: "list[PushMap]") -> None:
    """Directions and the largest impulses held, one column per map."""
    from manikin.simulation.push_map import told_apart

    common, names = told_apart([one.conditions for one in maps])
    typer.echo(f"largest impulse that is held [N.s]: {common}")
    rows = [["towards [deg]", *(name or "held" for name in names)]]
    for place, direction in enumerate(maps[0].directions):
        rows.append([f"{direction:g}", *(_impulse(one.found[place]) for one in maps)])
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        typer.echo("  ".join(f"{text:>{width}}" for text, width in zip(row, widths, strict=True)))


def _impulse(found: "HeldImpulse | None") -> str:
    if found is None or found.held is None:
        return "-"
    return f"{found.held:.1f}" if found.beyond is not None else f">= {found.held:.1f}"


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
        list[str] | None, typer.Option(metavar="arms|hips", help="Joints that hold the posture; repeatable.")
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
        Path | None, typer.Option(metavar="DIR", help="Directory. Default: one in runs; none with --json.")
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
