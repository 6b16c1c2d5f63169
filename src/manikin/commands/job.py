"""One job through the pipeline, with bars and a report for people."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from manikin.commands.console import flattened, print_table, stdout_kept_clean
from manikin.interruption import Interruption

if TYPE_CHECKING:
    from manikin.scenarios import Scenario


def run_job(
    job: "Scenario", directory: Path | None, interruption: Interruption, *, draw: bool
) -> dict[str, Any]:
    """Run a scenario with bars on standard error; returns its summary.

    Args:
        job: The scenario.
        directory: Run directory, or None to write nothing.
        interruption: Asked whether to go on whenever something was reported.
        draw: Whether figures are drawn into the directory.
    """
    from manikin.progress import StageProgress

    with stdout_kept_clean(), StageProgress() as bars:
        from manikin import pipeline

        def progress(stage: str, share: float) -> None:
            interruption.check()
            bars(stage, share)

        result = pipeline.run(job, out=directory, seed=job.seed, progress=progress)
        interruption.check()
        if directory is not None and draw:
            from manikin.products import write_products

            write_products(directory, progress)
        return dict(result.summary)


def print_summary(summary: dict[str, Any], directory: Path | None) -> None:
    """Print the whole summary of a run, and how it ended."""
    print_table(flattened({key: value for key, value in summary.items() if key != "failure"}))
    print_ending(summary, directory)


def print_ending(summary: dict[str, Any], directory: Path | None) -> None:
    """Say on standard error why a run failed, if it did, and where its files are."""
    failure = summary.get("failure")
    if failure:
        typer.echo(f"failed in {failure['stage']}: {failure['reason']}", err=True)
    fault = (summary.get("execution") or {}).get("failure")
    if fault and not failure:
        typer.echo(f"its execution, an attempt, failed: {fault['reason']}", err=True)
    if directory is not None:
        typer.echo(f"files in {directory}; see them with: manikin view {directory}", err=True)
