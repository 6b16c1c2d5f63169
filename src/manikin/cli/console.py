"""Standard output and standard error of the commands, and their exit status.

Also here. One job through the pipeline, with bars and a report for people. The result of a run on the screen:
the verdict first, then each requirement with its measured value.
"""

import ctypes
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manikin.errors import InputError
from manikin.reports.summary_table import verdict_line
from manikin.runtime.progress import Interruption

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
    from manikin.runtime.progress import StageProgress

    with stdout_kept_clean(), StageProgress() as bars:
        from manikin.pipeline import runner as pipeline

        def progress(stage: str, share: float) -> None:
            interruption.check()
            bars(stage, share)

        result = pipeline.run(job, out=directory, seed=job.seed, progress=progress)
        interruption.check()
        if directory is None:
            return JobOutcome(dict(result.summary), None, None)
        from manikin.reports.pages import write_run_page
        from manikin.reports.write_outputs import write_outputs as write_products

        if draw:
            write_products(directory, progress)
        page = write_run_page(directory)
        viewable = directory if result.motion is not None else None
        return JobOutcome(dict(result.summary), page, viewable)


HEADINGS = {
    "walk": "planned walk", "centroidal": "planned centre of mass", "wholebody": "planned whole body",
    "act": "planned act", "execution": "executed in the physics engine", "act execution": "executed act",
    "push": "executed in the physics engine",
}  # fmt: skip
"""What the requirements of each stage are about."""

YES_OR_NO = {"fell": ("no", "yes"), "at_rest": ("no", "yes")}
"""Words of 0 and 1 for requirements that are no quantity."""


def print_verdict(summary: Mapping[str, Any]) -> None:
    """Print how a run ended, in one line, then every requirement; those that do not hold are marked."""
    for line in verdict_lines(summary):
        typer.echo(line)


def verdict_lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Lines of :func:`print_verdict`."""
    yield verdict_line(summary)
    yield about_line(summary)
    rows: Sequence[Mapping[str, Any]] = summary["requirements"]
    names = [requirement_name(row) for row in rows]
    width = max(map(len, names), default=0)
    heading = ""
    for name, row in zip(names, rows, strict=True):
        if HEADINGS[row["stage"]] != heading:
            heading = HEADINGS[row["stage"]]
            yield f"{heading}:"
        measured, allowed = requirement_values(row)
        mark = "ok    " if row["held"] else "FAILED"
        time = "" if row["time_s"] is None else f"at {row['time_s']:.2f} s"
        yield f"  {mark}  {name:{width}}  {measured:>14}  {allowed:<14}  {time}".rstrip()


def about_line(summary: Mapping[str, Any]) -> str:
    """Whose motion it is, how long it lasts and how long it took to compute."""
    stature, mass = summary["stature_m"], summary["mass_kg"]
    who = f"body of {mass:g} kg" if stature is None else f"person of {stature:g} m and {mass:g} kg"
    known = [summary[stage] or {} for stage in ("wholebody", "centroidal", "walk")]
    duration = next((block["duration_s"] for block in known if block.get("duration_s")), None)
    lasts = "" if duration is None else f", motion of {duration:.2f} s"
    return f"{who}{lasts}, computed in {summary['wall_s']:.1f} s, seed {summary['seed']}"


def requirement_name(row: Mapping[str, Any]) -> str:
    """Name of a requirement with what it was measured on."""
    return f"{row['name']} ({row['where']})" if row["where"] else str(row["name"])


def requirement_values(row: Mapping[str, Any]) -> tuple[str, str]:
    """Measured and allowed value of a requirement, as texts."""
    if row["key"] in YES_OR_NO:
        words = YES_OR_NO[row["key"]]
        return words[round(row["measured"])], words[round(row["limit"])]
    unit = f" {row['unit']}" if row["unit"] else ""
    measured = "-" if row["measured"] is None else f"{row['measured']:.3g}{unit}"
    return measured, f"{row['sense']} {row['limit']:.3g}{unit}"


DONE, BAD_INPUT, FAILED, INTERRUPTED = 0, 2, 3, 130

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]


def refuse(given: bool, option: str, because: str) -> None:
    """Refuse an option that was given where it has no meaning.

    Raises:
        InputError: If it was given.
    """
    if given:
        raise InputError(f"{option} does not go with this run: {because}; valid: leave it out")


def flattened(value: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested sections as one level of dotted keys; long mappings and lists as their size."""
    flat: dict[str, Any] = {}
    for key, item in value.items():
        if isinstance(item, dict) and key != "peak_torque_Nm":
            flat.update(flattened(item, f"{prefix}{key}."))
        else:
            flat[f"{prefix}{key}"] = item
    return flat


def print_table(rows: dict[str, Any]) -> None:
    """Print names and values in two columns."""
    width = max(len(name) for name in rows)
    for name, value in rows.items():
        typer.echo(f"{name:{width}}  {_shown(value)}")


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, dict):
        if value and all(isinstance(item, (int, float)) for item in value.values()):
            name, top = max(value.items(), key=lambda item: abs(item[1]))
            return f"largest {top:.4g} ({name})"
        return " ".join(_shown(item) for item in value.values()) or "-"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_shown(item) for item in value) + "]"
    return "-" if value is None else str(value)


def print_json(value: dict[str, Any]) -> None:
    """Print the one object that ``--json`` promises."""
    from manikin.runtime.files import to_json

    typer.echo(to_json(value))


def complain(message: str, status: int) -> int:
    """Say what was wrong, in one line, and return the exit status."""
    typer.echo(f"manikin: {' '.join(message.split())}", err=True)
    return status


@contextmanager
def stdout_kept_clean() -> Iterator[None]:
    """Send what libraries, native ones too, print on standard output to standard error meanwhile."""
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        ctypes.CDLL(None).fflush(None)  # C's own buffer, which a solver's banner may wait in
        os.dup2(saved, 1)
        os.close(saved)
