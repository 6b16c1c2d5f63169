"""The command line: ``manikin scenarios | run | push | walk | words | view | ergonomics | export | ...``.

Exit status: 0 done, 2 bad input (one line on standard error), 3 a run that ended in an
explained failure, 130 interrupted.  With ``--json`` standard output holds exactly one
JSON object; everything else goes to standard error.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli.analyze import analyze
from manikin.cli.console import (
    BAD_INPUT,
    DONE,
    FAILED,
    INTERRUPTED,
    JsonOption,
    complain,
    flattened,
    print_json,
    print_table,
    refuse,
    run_job,
    stdout_kept_clean,
)
from manikin.cli.ergonomics import ergonomics
from manikin.cli.push import push
from manikin.cli.statistics import statistics
from manikin.cli.walk import library, walk
from manikin.cli.words import words
from manikin.errors import InputError, ManikinError
from manikin.runtime.progress import Interruption
from manikin.runtime.version import __version__

ALL = "all"
"""In place of a scenario: every built-in one with its variants."""

RESULTS = "results.json"
"""What ``manikin run all --out DIR`` found, in DIR."""

app = typer.Typer(
    name="manikin",
    help="Plans how a person moves through a cluttered scene and proves it in a physics engine.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

ScenarioArgument = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE.yaml|all",
        help="Built-in scenario or scenario file; NAME@V is its variant V; all: every one of them.",
    ),
]
RunArgument = Annotated[Path, typer.Argument(metavar="DIR|FILE", help="Run directory or motion file (.h5).")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status; no traceback for a user's mistake."""
    # Before numpy is loaded: threads make its small products several times slower, and the last
    # bits of a result depend on their number.  Whoever sets the variable has the last word.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    try:
        with Interruption() as interruption:
            given = None if arguments is None else list(arguments)
            status = app(args=given, standalone_mode=False, obj=interruption)
        if status == INTERRUPTED:  # typer turns Ctrl-C into this status without a word
            raise KeyboardInterrupt
        return status if isinstance(status, int) else DONE
    except typer.TyperException as error:
        return complain(f"{error.format_message().rstrip('.')}; see 'manikin --help'", BAD_INPUT)
    except InputError as error:
        return complain(str(error), BAD_INPUT)
    except ManikinError as error:
        return complain(str(error), FAILED)
    except (KeyboardInterrupt, typer.Abort):
        return complain("interrupted; the files of finished stages are kept", INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone, as in "manikin ... | head"; nobody is left to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return INTERRUPTED


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        typer.echo(f"manikin {__version__}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command()
def scenarios(json: JsonOption = False) -> None:
    """List the built-in scenarios and their variants."""
    from manikin.scenarios import list_scenarios, list_variants

    found = list_scenarios()
    variants = {name: list_variants(name) for name in found}
    if json:
        print_json({"scenarios": found, "variants": variants})
        return
    rows: dict[str, str] = {}
    for name, description in found.items():
        rows[name] = description
        rows |= {f"{name}@{variant}": text for variant, text in variants[name].items()}
    width = max(len(name) for name in rows)
    for name, description in rows.items():
        typer.echo(f"{name:{width}}  {description}")


@app.command()
def run(
    context: typer.Context,
    scenario: ScenarioArgument,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run directory. Default: runs/NAME; none with --json.")
    ] = None,
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed; default: the scenario's.")] = None,
    json: JsonOption = False,
    stature: Annotated[
        float | None, typer.Option(metavar="M", min=1.4, max=2.1, help="Other stature, 1.4 to 2.1 m.")
    ] = None,
    mass: Annotated[
        float | None, typer.Option(metavar="KG", min=35.0, max=160.0, help="Other mass, 35 to 160 kg.")
    ] = None,
    sex: Annotated[str | None, typer.Option(metavar="male|female", help="Other sex.")] = None,
    age: Annotated[float | None, typer.Option(metavar="YEARS", help="Other age, 18 to 90 years.")] = None,
    strength: Annotated[
        float | None,
        typer.Option(
            metavar="X", help="Torque limits relative to a healthy adult of that sex, size and age."
        ),
    ] = None,
    load_kg: Annotated[
        float | None, typer.Option(metavar="KG", help="Load in the hands during the whole motion.")
    ] = None,
    load_hand: Annotated[
        str | None, typer.Option(metavar="left|right|both", help="Hand that carries it. Default: both.")
    ] = None,
    variant: Annotated[
        str | None, typer.Option(metavar="V", help="One of the scenario's variants; also NAME@V.")
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Set one value, such as supports.friction=0.5 or scene.roof.position.2=1.4; repeatable.",
        ),
    ] = None,
    moved: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Run the scenario elsewhere: its origin at X Y [m], turned about that [deg].",
        ),
    ] = None,
    figures: Annotated[bool, typer.Option(help="Draw the figures into the run directory.")] = True,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Runs at a time with 'all'; default: one per core.")
    ] = None,
) -> int:
    """Plan a scenario, execute it in the physics engine and report: proved, planned or failed."""
    if scenario == ALL:
        refuse(variant is not None, "--variant", "every variant is run")
        refuse(bool(overrides), "--set", "it belongs to one scenario")
        refuse(moved is not None, "--moved", "it belongs to one scenario")
        refuse(load_kg is not None or load_hand is not None, "--load-kg", "it belongs to one scenario")
        body = {"--stature": stature, "--mass": mass, "--sex": sex, "--age": age, "--strength": strength}
        given = {"--seed": seed} | body
        words = [word for name, value in given.items() if value is not None for word in (name, str(value))]
        _check_values(seed, stature, mass, sex, age, strength)
        directory = out if out is not None else None if json else Path("runs")
        asked = {"stature_m": stature, "seed": seed}
        return _run_all(directory, asked, tuple(words), context.obj, draw=figures, workers=jobs, json=json)
    refuse(jobs is not None, "--jobs", "it is for 'manikin run all'")
    refuse(load_hand is not None and load_kg is None, "--load-hand", "it needs --load-kg")
    load = None if load_kg is None else {"mass_kg": load_kg, "hand": load_hand or "both"}
    from manikin.scenarios import load_scenario

    job = load_scenario(scenario, variant, overrides or ())
    job = job.with_body(stature_m=stature, mass_kg=mass, sex=sex, age=age, strength=strength, load=load)
    if seed is not None:
        job = job.with_seed(seed)
    if moved is not None:
        job = job.moved(*moved)
    directory = out if out is not None else None if json else Path("runs") / job.name
    outcome = run_job(job, directory, context.obj, draw=figures)
    if json:
        print_json(outcome.summary)
    else:
        outcome.print()
    return outcome.status


app.command()(analyze)
app.command()(push)
app.command()(walk)
app.command()(words)
app.command()(ergonomics)
app.command()(statistics)
app.add_typer(library, name="library")


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory.")],
    second: Annotated[Path, typer.Argument(metavar="RUN", help="Run directory to compare with it.")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Draw figures of both and write comparison.json there.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Timing, centre of mass, margins and postures of two runs side by side."""
    from manikin.pipeline.run_directory import read_run

    records = read_run(first), read_run(second)
    from manikin.reports.comparison import compare_runs

    comparison = compare_runs(*records)
    if out is not None:
        from manikin.reports.write_outputs import write_comparison_outputs as write_comparison_products
        from manikin.runtime.progress import StageProgress

        with stdout_kept_clean(), StageProgress() as bars:
            write_comparison_products(comparison, out, bars)
    if json:
        print_json(comparison.as_dict())
        return
    from manikin.reports.comparison.comparison_table import report, report_console

    report_console().print(report(comparison))
    if out is not None:
        typer.echo(f"figures in {out}", err=True)


@app.command()
def view(
    source: Annotated[
        str,
        typer.Argument(
            metavar="DIR|FILE",
            help="Run directory or motion file (.h5); with --contacts a scenario's name or file.",
        ),
    ],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 picks a free one.")] = 8080,
    contacts: Annotated[
        bool, typer.Option("--contacts", help="Drag the body of a scenario and watch its contacts.")
    ] = False,
    samples: Annotated[
        int | None,
        typer.Option(metavar="N", min=100, max=1_000_000, help="With --contacts: samples of each limb."),
    ] = None,
) -> None:
    """Show a motion in the browser, or the contacts of a body moved by hand; on this computer only."""

    def announce(url: str) -> None:
        typer.echo(f"viewer at {url} (Ctrl-C ends it)", err=True)

    if contacts:
        from manikin.planning.contacts.single_contact import LiveContacts
        from manikin.scenarios import load_scenario
        from manikin.scenarios.sequence import contact_rules
        from manikin.scenarios.world import start_posture
        from manikin.viewer import serve_contacts

        job = load_scenario(source)
        body, scene = job.build_body(), job.build_scene()
        q = start_posture(job, body, scene)
        rules = contact_rules(job, body)
        live = LiveContacts(body, scene, q, samples=samples or 10_000, seed=job.seed, rules=rules)
        serve_contacts(live, port, announce)
        return
    if samples is not None:
        raise InputError("--samples goes with --contacts; valid: leave it out")
    from manikin.motion.file import read_motions
    from manikin.pipeline.run_directory import other_motions

    content = read_motions(Path(source))
    others = {name: read_motions(path) for name, path in other_motions(Path(source)).items()}
    from manikin.viewer import serve

    serve(content, port=port, announce=announce, others=others)


@app.command()
def balance(
    stance: Annotated[Path, typer.Argument(metavar="STANCE.yaml", help="Stance file.")],
    json: JsonOption = False,
    polytope: Annotated[bool, typer.Option("--polytope", help="Add the rows H and h to the JSON.")] = False,
) -> None:
    """Polytope and margins of one stance and centre-of-mass state."""
    from manikin.scenarios.stance_file import load_stance_file

    question = load_stance_file(stance)
    with stdout_kept_clean():
        report = question.evaluate().as_dict(polytope=polytope and json)
    if json:
        print_json(report)
    else:
        print_table(flattened(report))


@app.command()
def contact(
    scenario: Annotated[
        str, typer.Argument(metavar="NAME|FILE.yaml", help="Scenario: its body, scene and start.")
    ],
    limb: Annotated[str, typer.Option(metavar="L", help="Limb that shall make a contact.")],
    task: Annotated[
        tuple[float, float, float], typer.Option(metavar="X Y Z", help="Direction of the task in the world.")
    ],
    role: Annotated[
        str,
        typer.Option(
            metavar="auto|body|object", help="Whether the limb moves the body along the task or an object."
        ),
    ] = "auto",
    pull: Annotated[bool, typer.Option("--pull", help="Hold on and pull instead of pressing.")] = False,
    kind: Annotated[
        str | None,
        typer.Option(metavar="sole|point|grasp", help="How it touches; default: the limb's own way."),
    ] = None,
    heuristic: Annotated[
        str, typer.Option(metavar="H", help="efort, distance, manipulability or random.")
    ] = "efort",
    samples: Annotated[
        int, typer.Option(metavar="N", min=100, max=1_000_000, help="Samples of the limb.")
    ] = 10_000,
    seed: Annotated[int | None, typer.Option(metavar="N", min=0, help="Default: the scenario's.")] = None,
    at: Annotated[tuple[float, float] | None, typer.Option(metavar="X Y", help="Where to stand [m].")] = None,
    heading: Annotated[float | None, typer.Option(metavar="DEG", help="Where to face.")] = None,
    posture: Annotated[str | None, typer.Option(metavar="P", help="Posture; default: the start's.")] = None,
    figure: Annotated[Path | None, typer.Option(metavar="FILE.png", help="Draw the answer.")] = None,
    json: JsonOption = False,
) -> int:
    """Find the contact of one limb that serves a task best."""
    from manikin.planning.contacts.single_contact import ContactQuestion, find_contact
    from manikin.scenarios import load_scenario
    from manikin.scenarios.sequence import contact_rules
    from manikin.scenarios.world import start_posture

    job = load_scenario(scenario)
    with stdout_kept_clean():
        body, scene = job.build_body(), job.build_scene()
        q = start_posture(job, body, scene, at=at, heading_deg=heading, posture=posture)
        question = ContactQuestion.of(
            limb, task, role, pull, heuristic, kind, samples, job.seed if seed is None else seed
        )
        answer = find_contact(body, scene, q, question, contact_rules(job, body))
        if figure is not None:
            from manikin.reports.write_outputs import write_contact_figure

            write_contact_figure(body, scene, answer, figure)
    report = answer.as_dict()
    if json:
        print_json(report)
    else:
        print_table({key: value for key, value in report.items() if key != "q"})
        if not report["found"]:
            typer.echo(f"no contact: {report['failure']}", err=True)
    return DONE if report["found"] else FAILED


@app.command()
def export(
    source: RunArgument,
    format: Annotated[str, typer.Option("--format", metavar="bvh|csv", help="File format.")],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Default: beside the motion.")] = None,
    motion: Annotated[
        str | None, typer.Option(metavar="planned|executed", help="Default: executed if there is one.")
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Samples per second; default: 100 (bvh), all (csv).")
    ] = None,
) -> None:
    """Write a motion for other programs."""
    from manikin.reports.export import check_format, export_motion

    check_format(format)
    from manikin.motion.file import read_motions

    written = export_motion(read_motions(source), source, format, out=out, which=motion, rate=rate)
    typer.echo(str(written))


def _check_values(
    seed: int | None,
    stature: float | None,
    mass: float | None,
    sex: str | None,
    age: float | None,
    strength: float | None,
) -> None:
    """Refuse a value once, and not once per run."""
    from manikin.scenarios import list_scenarios, load_scenario

    job = load_scenario(next(iter(list_scenarios())))
    job = job.with_body(stature_m=stature, mass_kg=mass, sex=sex, age=age, strength=strength)
    if seed is not None:
        job.with_seed(seed)


def _run_all(
    out: Path | None,
    asked: dict[str, Any],
    arguments: tuple[str, ...],
    interruption: Interruption,
    *,
    draw: bool,
    workers: int | None,
    json: bool,
) -> int:
    from manikin.pipeline import batch
    from manikin.reports.summary_table import counts_line, text_table, verdict_line
    from manikin.runtime.files import make_directory, to_json, write_text

    runs = batch.built_in_jobs(statures=asked["stature_m"] is not None)
    if out is not None:
        make_directory(out)

    def report(entry: dict[str, Any], done: int) -> None:
        interruption.check()
        word = "as expected" if entry["as_expected"] else "NOT as expected"
        line = f"{verdict_line(entry)}, {word}, {entry['wall_s']:.1f} s"
        typer.echo(f"[{done}/{len(runs)}] {line}", err=True)

    options = batch.RunOptions(out, draw and out is not None, arguments)
    found = asked | batch.run_jobs(runs, options.command, workers=workers, report=report)
    if out is not None:
        write_text(out / RESULTS, to_json(found) + "\n")
    if json:
        print_json(found)
    else:
        typer.echo(text_table(found))
        typer.echo(counts_line(found))
    return FAILED if found["not_as_expected"] else DONE


if __name__ == "__main__":
    sys.exit(main())
