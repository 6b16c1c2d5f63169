"""``manikin benchmark``: how many random everyday scenes are planned and proved, and how fast."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from manikin.cli import console
from manikin.cli.console import JobsOption, JsonOption, OutOption, argument, flag, option
from manikin.errors import InputError


def benchmark(
    context: typer.Context,
    families: Annotated[str, option("all|A,B", "Families of scenes; --list shows them.")] = "all",
    seeds: Annotated[int, option("N", "Scenes of each.", min=1, max=100_000)] = 5,
    first_seed: Annotated[int, option("N", "Number of the first scene.", min=0)] = 0,
    stage: Annotated[
        Literal["contacts", "all"], option("contacts|all", "Contacts alone, or whole runs.")
    ] = "contacts",
    jobs: JobsOption = None,
    time_limit: Annotated[
        float, option("S", "Processor time after which a task is ended [s].", min=1.0)
    ] = 600.0,
    out: OutOption = None,
    fresh: Annotated[bool, flag("--fresh", "Do tasks again that the directory has already.")] = False,
    write_scenes: Annotated[
        Path | None, option("DIR", "Only write the scenes as scenario files there.")
    ] = None,
    list_families: Annotated[bool, flag("--list", "Only list the families.")] = False,
    check: Annotated[
        Path | None, option("PLAN.json", "Only check a contact plan, of whatever planner.")
    ] = None,
    scenario: Annotated[
        str | None, argument("[SCENARIO]", "With --check: what the plan is for; default: its own.")
    ] = None,
    json: JsonOption = False,
) -> int:
    """Plan families of random everyday scenes, and count what is found, planned and proved."""
    from manikin.pipeline import benchmark as tasks
    from manikin.scenarios.families import FAMILIES, chosen_families

    if check is not None:
        return _checked(check, scenario, json=json)
    if scenario is not None:
        raise InputError(f"SCENARIO {scenario!r} is given without --check; valid: --check PLAN.json SCENARIO")
    chosen = chosen_families(families)
    numbers = range(first_seed, first_seed + seeds)
    if list_families:
        descriptions = {name: family.description for name, family in FAMILIES.items()}
        console.print_report({"families": descriptions}, descriptions, json=json)
        return console.DONE
    if write_scenes is not None:
        tasks.write_scenes(chosen, numbers, write_scenes)
        typer.echo(f"{len(chosen) * seeds} scenes in {write_scenes}", err=True)
        return console.DONE
    directory = console.directory_of(out, "benchmark", json=json)
    with console.bars(context.obj) as progress:

        def report(entry: Mapping[str, Any], done: int, count: int) -> None:
            progress("benchmark", done / count, f"{done} of {count}, {entry['family']}-{entry['seed']}")

        result = tasks.run_benchmark(
            chosen, numbers, stage=stage, path=directory, jobs=jobs, time_limit=time_limit, fresh=fresh,
            report=report,
        )  # fmt: skip
    from manikin.reports.pages import write_benchmark_page
    from manikin.reports.summary_table import failure_lines, family_table

    page = None if directory is None else write_benchmark_page(directory, result)
    console.print_lines(result, [family_table(result), *failure_lines(result)], page, json=json)
    return console.DONE


def _checked(plan: Path, scenario: str | None, *, json: bool) -> int:
    """Check one contact plan and print what was measured."""
    from manikin.reports.summary_table import requirement_lines
    from manikin.scenarios import load_scenario
    from manikin.verification import check_contact_plan, load_contact_plan

    job = None if scenario is None else load_scenario(scenario)
    result = check_contact_plan(*load_contact_plan(plan, job))
    report = result.to_dict()
    rows = report["requirements"]
    console.print_lines(report, [result.verdict, *requirement_lines(rows)], json=json)
    return console.DONE if result.held else console.FAILED
