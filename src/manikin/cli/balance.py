"""``manikin balance`` and ``manikin contact``: margins of one stance, the best contact of one limb."""

from pathlib import Path
from typing import Annotated

import typer

from manikin.cli import console
from manikin.cli.console import JsonOption, argument, flag, option


def balance(
    stance: Annotated[Path, argument("STANCE.yaml", "Stance file.")],
    json: JsonOption = False,
    polytope: Annotated[bool, flag("--polytope", "Add the rows H and h to the JSON.")] = False,
) -> None:
    """Polytope and margins of one stance and centre-of-mass state."""
    from manikin.scenarios.stance_file import judge_stance_file

    with console.stdout_kept_clean():
        report = judge_stance_file(stance).as_dict(polytope=polytope and json)
    console.print_report(report, console.flattened(report), json=json)


def contact(
    scenario: Annotated[str, argument("NAME|FILE.yaml", "Scenario: its body, scene and start.")],
    limb: Annotated[str, option("L", "Limb that shall make a contact.")],
    task: Annotated[tuple[float, float, float], option("X Y Z", "Direction of the task in the world.")],
    role: Annotated[
        str, option("auto|body|object", "Whether the limb moves the body along the task or an object.")
    ] = "auto",
    pull: Annotated[bool, flag("--pull", "Hold on and pull instead of pressing.")] = False,
    kind: Annotated[
        str | None, option("sole|point|grasp", "How it touches; default: the limb's own way.")
    ] = None,
    heuristic: Annotated[str, option("H", "efort, distance, manipulability or random.")] = "efort",
    samples: Annotated[int, option("N", "Samples of the limb.", min=100, max=1_000_000)] = 10_000,
    seed: Annotated[int | None, option("N", "Default: the scenario's.", min=0)] = None,
    at: Annotated[tuple[float, float] | None, option("X Y", "Where to stand [m].")] = None,
    heading: Annotated[float | None, option("DEG", "Where to face.")] = None,
    posture: Annotated[str | None, option("P", "Posture; default: the start's.")] = None,
    figure: Annotated[Path | None, option("FILE.png", "Draw the answer.")] = None,
    json: JsonOption = False,
) -> int:
    """Find the contact of one limb that serves a task best.

    No answer has less than the usable EFORT, with which the limb at all its strength carries its weight.
    """
    from manikin.planning.contacts.single_contact import ContactQuestion, find_contact
    from manikin.scenarios import load_scenario
    from manikin.scenarios.world import contact_rules, start_posture

    job = load_scenario(scenario)
    with console.stdout_kept_clean():
        body, scene = job.build_body(), job.build_scene()
        q = start_posture(job, body, scene, at=at, heading_deg=heading, posture=posture)
        question = ContactQuestion.of(
            limb, task, role, pull, heuristic, kind, samples, job.seed if seed is None else seed
        )
        answer = find_contact(body, scene, q, question, contact_rules(job, body))
        if figure is not None:
            from manikin.reports.export import write_contact_figure

            write_contact_figure(body, scene, answer, figure)
    report = answer.as_dict()
    names = {"efort": "efort [N per N.m]", "usable_efort": "usable_efort [N per N.m]"}
    console.print_report(
        report, {names.get(key, key): value for key, value in report.items() if key != "q"}, json=json
    )
    if not (json or report["found"]):
        typer.echo(f"no contact: {report['failure']}", err=True)
    return console.DONE if report["found"] else console.FAILED
