"""``manikin ergonomics``: posture scores, loads, strength, effort and lowest margin of a motion."""

from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli import console
from manikin.cli.console import JsonOption, LoadHandOption, MotionArgument, flag, option
from manikin.errors import InputError

_SCORE = ("max", "max_at_s", "max_side", "mean", "action_level", "action", "share_of_time")

SHOWN = {
    "rula": _SCORE,
    "reba": _SCORE,
    "strength": ("max_share", "max_joint", "max_at_s"),
    "effort": ("squared_share_s", "rms_share", "positive_work_J", "negative_work_J"),
    "margin": ("min", "unit", "at_s", "limiting_contact"),
}
"""Printed values of each part; everything is in the JSON."""


def ergonomics(
    source: MotionArgument,
    planned: Annotated[bool, flag("--planned", "The planned motion.")] = False,
    executed: Annotated[
        bool, flag("--executed", "The executed motion; the default if there is one.")
    ] = False,
    json: JsonOption = False,
    csv: Annotated[Path | None, option("FILE", "Write scores, angles and torque shares over time.")] = None,
    figure: Annotated[Path | None, option("FILE", "Draw scores and torque shares as PNG.")] = None,
    reach_mesh: Annotated[
        Path | None,
        option("FILE", "Write what both hands reach in the first posture as a mesh: STL, OBJ, PLY or GLB."),
    ] = None,
    load_kg: Annotated[
        float | None, option("KG", "Load in the hands, as a mass. Default: that of the motion.")
    ] = None,
    load_hand: LoadHandOption = "both",
    load_pattern: Annotated[str, option("intermittent|static|shock", "How the load acts.")] = "intermittent",
    coupling: Annotated[str, option("good|fair|poor|unacceptable", "Hold on the load, for REBA.")] = "good",
    static: Annotated[bool, flag("--static", "The posture is held for more than a minute.")] = False,
    repeated: Annotated[bool, flag("--repeated", "It is done more than four times a minute.")] = False,
    rapid: Annotated[bool, flag("--rapid", "Rapid large changes or an unstable base, for REBA.")] = False,
    raised: Annotated[bool, flag("--shoulder-raised", "A shoulder is raised.")] = False,
    supported: Annotated[
        bool, flag("--trunk-supported", "The trunk of a seated person is well supported.")
    ] = False,
    fraction: Annotated[
        float, option("X", "Share of the strength above which a joint counts as loaded.")
    ] = 0.5,
    neck: Annotated[float, option("DEG", "Flexion of the neck when it is upright.", "--neck-deg")] = 0.0,
    lifts: Annotated[float, option("N", "How often the load is lifted.", "--lifts-per-minute")] = 0.2,
    hours: Annotated[float, option("H", "For how long at a stretch.", "--lifting-hours")] = 1.0,
    cycles: Annotated[
        float | None,
        option("N", "How often the motion is made, for EN 1005-3 and -4.", "--cycles-per-minute"),
    ] = None,
    job_hours: Annotated[
        float | None, option("H", "For how long such motions are made at a stretch, for EN 1005-3.")
    ] = None,
    domestic: Annotated[
        bool, flag("--domestic", "What is pushed or pulled is used at home, for EN 1005-3.")
    ] = False,
    people_age: Annotated[
        float | None, option("YEARS", "Age of those who shall have the strength. Default: the body's.")
    ] = None,
    back_lever: Annotated[
        float, option("M", "Lever of the back's muscles about L5/S1.", "--back-lever-m")
    ] = 0.05,
) -> None:
    """Judge a motion: posture scores, load on the low back, lifting, strength, effort, lowest margin."""
    if planned and executed:
        raise InputError("--planned and --executed exclude each other; valid: one of them or none")
    from manikin.ergonomics import Circumstances, ergonomics_of
    from manikin.ergonomics.lift_of_motion import heaviest
    from manikin.motion.file import read_motions

    content = read_motions(source)
    which = "planned" if planned else "executed" if executed else list(content.motions)[-1]
    if which not in content.motions:
        raise InputError(f"{source}: holds no {which} motion; valid: {', '.join(content.motions)}")
    body, motion = content.body, content.motions[which]
    if body is None:
        raise InputError(f"{source}: holds no body; valid: a motion file with one, as manikin run writes it")
    if load_kg:
        from manikin.balance.motion_forces import carried_motion

        if content.schedule is None:
            raise InputError(f"{source}: holds no contacts for --load-kg; valid: a motion of manikin run")
        body, motion = carried_motion(body, motion, content.schedule, load_kg, load_hand or "both")
    given = Circumstances(
        heaviest(body, content.schedule), load_pattern, coupling, static, repeated, rapid, raised, supported,
        neck_upright_deg=neck, lifts_per_minute=lifts, lifting_hours=hours, people_age=people_age,
        back_lever_m=back_lever, cycles_per_minute=cycles, job_hours=job_hours, domestic=domestic,
    )  # fmt: skip
    with console.stdout_kept_clean():
        result = ergonomics_of(body, motion, schedule=content.schedule, given=given, fraction=fraction)
    if csv is not None:
        from manikin.runtime.files import write_result

        write_result(csv, result.csv())
    if figure is not None:
        from manikin.reports.figures import ergonomics_figure, save_figure

        save_figure(ergonomics_figure(result, f"Ergonomics of {source.resolve().stem}, {which}"), figure)
    if reach_mesh is not None:
        from manikin.reports.export import write_reach

        write_reach(reach_mesh, body, motion.q[0])
    report = {"motion": which} | result.as_dict()
    if json:
        console.print_json(report)
    else:
        _print(report)


def _print(report: dict[str, Any]) -> None:
    """The main values of each part, then what could not be told and why."""
    from manikin.ergonomics.load_report import load_lines

    rows: dict[str, Any] = {key: report[key] for key in ("motion", "duration_s", "frames")}
    for part, keys in SHOWN.items():
        values = report[part]
        shown = None if values is None else {key: values[key] for key in keys}
        rows |= console.flattened({part: shown})
    console.print_table(rows | load_lines(report))
    for part, reason in report["missing"].items():
        typer.echo(f"{part}: {reason}", err=True)
