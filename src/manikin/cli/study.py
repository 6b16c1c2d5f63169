"""``manikin study``: which people can do a task, over bodies, swept values and seeds."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli import console
from manikin.cli.console import JobsOption, JsonOption, OutOption, argument, flag, option


def study(
    context: typer.Context,
    file: Annotated[Path, argument("FILE.yaml", "Study file: scenario, bodies, sweeps, seeds.")],
    jobs: JobsOption = None,
    cluster: Annotated[
        str | None, option("tcp://HOST:PORT", "Dask scheduler whose workers do the jobs instead.")
    ] = None,
    out: OutOption = None,
    fresh: Annotated[bool, flag("--fresh", "Do jobs again that the directory has already.")] = False,
    list_bodies: Annotated[bool, flag("--list", "Only list the bodies and the number of jobs.")] = False,
    json: JsonOption = False,
) -> int:
    """Run a scenario with many bodies, values and seeds, and say who can do it and who cannot."""
    from manikin.pipeline.study import run_study, study_jobs
    from manikin.scenarios.study_file import load_study

    known = load_study(file)
    if list_bodies:
        bodies = {body.name: dict(body.keys) for body in known.bodies}
        report = {"bodies": bodies, "settings": len(known.settings), "jobs": len(study_jobs(known))}
        shown = {name: ", ".join(f"{k} {v}" for k, v in keys.items()) for name, keys in bodies.items()}
        console.print_report(report, {**shown, "jobs": report["jobs"]}, json=json)
        return console.DONE
    if cluster is not None:
        console.refuse(jobs is not None, "--jobs", "--cluster says who works")
    directory = console.directory_of(out, known.name, json=json)
    with console.bars(context.obj) as progress:

        def report_job(entry: Mapping[str, Any], done: int, count: int) -> None:
            progress("study", done / count, f"{done} of {count}, {entry['job']}")

        result = run_study(known, path=directory, jobs=jobs, cluster=cluster, fresh=fresh, report=report_job)
    from manikin.reports.pages import write_study_page
    from manikin.reports.summary_table import group_table, person_lines

    page = None if directory is None else write_study_page(directory, result)
    console.print_lines(result, [group_table(result), *person_lines(result)], page, json=json)
    return console.DONE
