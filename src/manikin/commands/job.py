"""One job through the pipeline, with bars and a report for people."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from manikin.commands.console import DONE, FAILED, print_table, stdout_kept_clean
from manikin.commands.verdict import print_verdict
from manikin.interruption import Interruption

if TYPE_CHECKING:
    from manikin.scenarios import Scenario


@dataclass(frozen=True, eq=False)
class JobOutcome:
    """What a job left behind.

    Attributes:
        summary: Of the run.
        page: The report page, or None if nothing was written.
        viewable: Directory of the run if it holds a motion to watch, else None.
    """

    summary: dict[str, Any]
    page: Path | None
    viewable: Path | None

    @property
    def status(self) -> int:
        """Exit status: done only for a run that succeeded."""
        return DONE if self.summary["succeeded"] else FAILED

    def print(self, shown: Mapping[str, Any] | None = None) -> None:
        """Print the verdict, the requirements, further values, and last the path of the report page.

        Args:
            shown: Values to print below the requirements.
        """
        print_verdict(self.summary)
        if shown:
            print_table(dict(shown))
        if self.viewable is not None:
            typer.echo(f"watch it with: manikin view {self.viewable}")
        if self.page is not None:
            typer.echo(f"report: {self.page}")


def run_job(job: "Scenario", directory: Path | None, interruption: Interruption, *, draw: bool) -> JobOutcome:
    """Run a scenario with bars on standard error.

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
        if directory is None:
            return JobOutcome(dict(result.summary), None, None)
        from manikin.products import write_products
        from manikin.run_page import write_run_page

        if draw:
            write_products(directory, progress)
        page = write_run_page(directory)
        viewable = directory if result.motion is not None else None
        return JobOutcome(dict(result.summary), page, viewable)
