"""``manikin words``: the partition of the goals of a walk into words."""

from typing import Annotated, Any

import typer

from manikin.cli.console import (
    DONE,
    JobsOption,
    JsonOption,
    OutOption,
    bars,
    directory_of,
    print_json,
    refuse,
)
from manikin.errors import InputError


def words(
    context: typer.Context,
    out: OutOption = None,
    slices: Annotated[
        str, typer.Option(metavar="DEG,DEG|all", help="Final headings, each a multiple of 10 from 0 to 350.")
    ] = "all",
    jobs: JobsOption = None,
    figures: Annotated[
        bool | None, typer.Option("--figures/--no-figures", help="Draw the figures into the directory.")
    ] = None,
    json: JsonOption = False,
) -> int:
    """Partition the goals of a walk by the word of the best path; an interrupted run is continued."""
    headings = _headings(slices)
    directory = directory_of(out, "words", json=json)
    refuse(figures is True and directory is None, "--figures", "there is no directory to draw into")
    from manikin.pipeline.batch import usable_cores
    from manikin.reports.directories import solve_partition
    from manikin.walking.words import THESIS_GRID

    with bars(context.obj) as progress:
        summary = solve_partition(
            headings, THESIS_GRID, directory, jobs=jobs or usable_cores(), draw=figures is not False,
            progress=progress,
        )  # fmt: skip
    if json:
        print_json(summary)
    else:
        _print(summary)
        typer.echo(f"files in {directory}", err=True)
    return DONE


def _headings(text: str) -> list[int]:
    """Headings [deg] of an option.

    Raises:
        InputError: If it is not a list of headings.
    """
    from manikin.walking.words import HEADINGS

    if text == "all":
        return list(HEADINGS)
    valid = {str(heading): heading for heading in HEADINGS}
    parts = [part.strip() for part in text.split(",")]
    for part in parts:
        if part not in valid:
            raise InputError(
                f"--slices {text}: {part!r} is no slice; valid: all, or 0, 10, ... 350 with commas between"
            )
    return sorted({valid[part] for part in parts})


def _print(summary: dict[str, Any]) -> None:
    """Words, number of goals and share of each."""
    width = max(len(word) for word in summary["counts"])
    for word, count in summary["counts"].items():
        typer.echo(f"{word:{width}}  {count:6d}  {100 * summary['shares'][word]:6.2f} %")
    typer.echo(f"{'all':{width}}  {summary['solved']:6d}")
