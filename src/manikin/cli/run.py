"""``manikin run``: plan a scenario, execute it in the physics engine and report; or all built-in ones."""

from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli import console
from manikin.cli.console import (
    AgeOption,
    FiguresOption,
    Interruption,
    JobsOption,
    JsonOption,
    LoadHandOption,
    MassOption,
    OutOption,
    SexOption,
    StatureOption,
    StrengthOption,
    argument,
    option,
)

ALL = "all"
"""In place of a scenario: every built-in one with its variants."""

_SCENARIO = "Built-in scenario or scenario file; NAME@V is its variant V; all: every one of them."
_SET = "Set one value, such as supports.friction=0.5 or scene.roof.position.2=1.4; repeatable."
_TRIALS = "Execute a proved motion in N other worlds, too: masses, friction, heights, delay, noise, a push."
_UNCERTAINTY = "How far these worlds are from the believed one, relative to the default; with --trials."
_MOVED = "Move the scenario's origin to X Y [m], turned [deg]."


def run(
    context: typer.Context,
    scenario: Annotated[str, argument("NAME|FILE.yaml|all", _SCENARIO)],
    out: OutOption = None,
    seed: Annotated[int | None, option("N", "Seed; default: the scenario's.")] = None,
    json: JsonOption = False,
    stature: StatureOption = None,
    mass: MassOption = None,
    sex: SexOption = None,
    age: AgeOption = None,
    strength: StrengthOption = None,
    load_kg: Annotated[float | None, option("KG", "Load in the hands during the whole motion.")] = None,
    load_hand: LoadHandOption = None,
    variant: Annotated[str | None, option("V", "One of the scenario's variants; also NAME@V.")] = None,
    overrides: Annotated[list[str] | None, option("KEY=VALUE", _SET, "--set")] = None,
    moved: Annotated[tuple[float, float, float] | None, option("X Y YAW_DEG", _MOVED)] = None,
    trials: Annotated[int | None, option("N", _TRIALS, min=1)] = None,
    uncertainty: Annotated[float | None, option("X", _UNCERTAINTY, min=0.0, max=4.0)] = None,
    figures: FiguresOption = True,
    jobs: JobsOption = None,
) -> int:
    """Plan a scenario, execute it in the physics engine and report: proved, planned or failed."""
    body = {"stature_m": stature, "mass_kg": mass, "sex": sex, "age": age, "strength": strength}
    if scenario == ALL:
        console.refuse(variant is not None, "--variant", "every variant is run")
        loaded = load_hand if load_kg is None else load_kg
        single = {"--set": overrides or None, "--moved": moved, "--trials": trials, "--load-kg": loaded,
                  "--uncertainty": uncertainty}  # fmt: skip
        console.refuse_given(single, "it belongs to one scenario")
        return _run_all(out, seed, body, context.obj, draw=figures, workers=jobs, json=json)
    console.refuse(jobs is not None, "--jobs", "it is for 'manikin run all'")
    console.refuse(load_hand is not None and load_kg is None, "--load-hand", "it needs --load-kg")
    load = None if load_kg is None else {"mass_kg": load_kg, "hand": load_hand or "both"}
    from manikin.scenarios import load_scenario

    job = load_scenario(scenario, variant, overrides or ()).with_body(**body, load=load)
    if seed is not None:
        job = job.with_seed(seed)
    if moved is not None:
        job = job.moved(*moved)
    console.refuse(uncertainty is not None and trials is None, "--uncertainty", "it needs --trials")
    if trials is not None:
        settings = [f"execution.trials={trials}"]
        settings += [] if uncertainty is None else [f"execution.uncertainty.factor={uncertainty}"]
        job = job.with_overrides(settings)
    return console.run_job(job, out, context.obj, draw=figures, json=json)


def _run_all(
    out: Path | None, seed: int | None, body: dict[str, Any], interruption: Interruption, *, draw: bool,
    workers: int | None, json: bool,
) -> int:  # fmt: skip
    from manikin.pipeline import batch
    from manikin.reports.summary_table import counts_line, text_table, verdict_line
    from manikin.scenarios import list_scenarios, load_scenario

    # A value that is not usable is refused once, and not once per run.
    any_job = load_scenario(next(iter(list_scenarios()))).with_body(**body)
    any_job.build_body()
    if seed is not None:
        any_job.with_seed(seed)
    given = {"seed": seed} | {key.partition("_")[0]: value for key, value in body.items()}
    words = [word for name, value in given.items() if value is not None for word in (f"--{name}", str(value))]
    directory = out if out is not None else None if json else Path("runs")
    runs = batch.built_in_jobs(statures=body["stature_m"] is not None)
    kept = None if directory is None else batch.BatchDirectory(directory)

    def report(entry: dict[str, Any], done: int) -> None:
        interruption.check()
        word = "as expected" if entry["as_expected"] else "NOT as expected"
        typer.echo(f"[{done}/{len(runs)}] {verdict_line(entry)}, {word}, {entry['wall_s']:.1f} s", err=True)

    options = batch.RunOptions(directory, draw and directory is not None, tuple(words))
    results = {"stature_m": body["stature_m"], "seed": seed}
    results |= batch.run_jobs(runs, options.command, workers=workers, report=report)
    if kept is not None:
        kept.write(kept.RESULTS, results)
    if json:
        console.print_json(results)
    else:
        typer.echo(text_table(results))
        typer.echo(counts_line(results))
    return console.FAILED if results["not_as_expected"] else console.DONE
