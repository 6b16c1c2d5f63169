"""``manikin view``, ``compare`` and ``export``: runs and motions watched, compared, written for others."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from manikin.cli import console
from manikin.cli.console import HostOption, JsonOption, MotionArgument, OutOption, argument, flag, option
from manikin.viewer import THIS_COMPUTER

if TYPE_CHECKING:
    from manikin.scenarios import Scenario
    from manikin.viewer.placing import Planned

_SOURCE = "Run directory or motion file (.h5); with --contacts or --scene a scenario's name or file."


def view(
    source: Annotated[str, argument("DIR|FILE", _SOURCE)],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 picks a free one.")] = 8080,
    host: HostOption = THIS_COMPUTER,
    contacts: Annotated[
        bool, flag("--contacts", "Drag the body of a scenario and watch its contacts.")
    ] = False,
    samples: Annotated[
        int | None, option("N", "With --contacts: samples of each limb.", min=100, max=1_000_000)
    ] = None,
    placing: Annotated[
        bool, flag("--scene", "Place start and goal in a scene with the mouse, plan and watch.")
    ] = False,
    out: OutOption = None,
) -> None:
    """Show a motion in the browser, the contacts of a body moved by hand, or a task placed by hand."""
    console.refuse(contacts and placing, "--contacts", "it does not go with --scene")
    console.refuse(out is not None and not placing, "--out", "it is for --scene")
    if contacts:
        from manikin.scenarios import load_scenario
        from manikin.scenarios.world import contact_rules, start_posture
        from manikin.viewer import serve_contacts
        from manikin.viewer.drive import LiveContacts

        job = load_scenario(source)
        body, scene = job.build_body(), job.build_scene()
        q, rules = start_posture(job, body, scene), contact_rules(job, body)
        live = LiveContacts(body, scene, q, samples=samples or 10_000, seed=job.seed, rules=rules)
        serve_contacts(live, port, console.announce, host=host)
        return
    console.refuse(samples is not None, "--samples", "it is for --contacts")
    if placing:
        from manikin.scenarios import load_scene
        from manikin.viewer import serve_task

        job = load_scene(source)
        directory = Path("runs") / job.name if out is None else out
        serve_task(job, partial(_planned, directory), port, console.announce, host=host, film=_film)
        return
    from manikin.motion.file import read_motions
    from manikin.pipeline.run_directory import other_motions

    content = read_motions(Path(source))
    others = {name: read_motions(path) for name, path in other_motions(Path(source)).items()}
    from manikin.viewer import serve

    serve(content, port=port, announce=console.announce, others=others, host=host, film=_film)


def _film(*wanted: Any) -> bytes:
    """Make a film that a visitor of the page asks for, see :func:`manikin.reports.export.film_of_motion`."""
    from manikin.reports.export import film_of_motion

    return film_of_motion(*wanted)


def _planned(directory: Path, job: "Scenario", progress: Callable[..., None]) -> "Planned":
    """Run a task that was placed by hand, in a run directory."""
    from manikin.motion.file import read_motions
    from manikin.pipeline import runner
    from manikin.reports.summary_table import verdict_line
    from manikin.viewer.placing import Planned

    result = runner.run(job, out=directory, progress=progress)
    words = verdict_line(result.summary)
    return Planned(words, None if result.motion is None else read_motions(directory))


def compare(
    context: typer.Context,
    first: Annotated[Path, argument("RUN", "Run directory.")],
    second: Annotated[Path, argument("RUN", "Run directory to compare with it.")],
    out: Annotated[
        Path | None, option("DIR", "Draw figures of both and write comparison.json there.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Timing, centre of mass, margins and postures of two runs side by side."""
    from manikin.pipeline.run_directory import read_run

    records = read_run(first), read_run(second)
    from manikin.reports.comparison import compare_runs

    comparison = compare_runs(*records)
    if out is not None:
        from manikin.reports.export import write_comparison_outputs

        with console.bars(context.obj) as progress:
            write_comparison_outputs(comparison, out, progress)
    if json:
        console.print_json(comparison.as_dict())
        return
    from manikin.reports.comparison_tables import report, report_console

    report_console().print(report(comparison))
    if out is not None:
        typer.echo(f"figures in {out}", err=True)


def export(
    context: typer.Context,
    source: MotionArgument,
    format: Annotated[
        Literal["bvh", "c3d", "csv", "gif", "glb", "mjcf", "mp4", "osim", "trc", "urdf", "usd"],
        option("bvh|c3d|csv|gif|glb|mjcf|mp4|osim|trc|urdf|usd", "File format.", "--format"),
    ],
    out: Annotated[Path | None, option("FILE", "Default: beside the motion.")] = None,
    motion: Annotated[str | None, option("planned|executed", "Default: executed if there is one.")] = None,
    rate: Annotated[
        float | None,
        option("HZ", "Samples per second; default: 100, but 60 glb and usd, 25 mp4, 12.5 gif, all csv."),
    ] = None,
    size: Annotated[str | None, option("WxH", "Pixels of mp4 and gif; default: 640x480.")] = None,
    names: Annotated[
        Literal["manikin", "cmu", "mixamo", "vrm"], option("manikin|cmu|mixamo|vrm", "Joint names of bvh.")
    ] = "manikin",
    up: Annotated[Literal["y", "z"], option("y|z", "Axis of bvh that points up.")] = "y",
) -> None:
    """Write a motion for other programs."""
    from manikin.motion.file import read_motions
    from manikin.reports.export import ExportOptions, export_motion
    from manikin.reports.formats.video import SIZE, film_size

    film = format in ("mp4", "gif")
    console.refuse(size is not None and not film, "--size", "it is for mp4 and gif")
    console.refuse(names != "manikin" and format != "bvh", "--names", "it is for bvh")
    console.refuse(up != "y" and format != "bvh", "--up", "it is for bvh")
    content, pixels = read_motions(source), SIZE if size is None else film_size(size)
    with console.bars(context.obj) as report:
        options = ExportOptions(pixels, names, up, progress=lambda share: report(format, share))
        path = export_motion(content, source, format, out=out, which=motion, rate=rate, options=options)
    typer.echo(str(path))
