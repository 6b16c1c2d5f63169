"""``manikin words``: the partition of the goals of a walk into words."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from manikin.cli.console import DONE, JsonOption, print_json, refuse, stdout_kept_clean
from manikin.errors import InputError
from manikin.runtime.progress import Interruption

STAGE = "words"


def words(
    context: typer.Context,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Directory. Default: runs/words; none with --json.")
    ] = None,
    slices: Annotated[
        str, typer.Option(metavar="DEG,DEG|all", help="Final headings, each a multiple of 10 from 0 to 350.")
    ] = "all",
    jobs: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes; default: one per core.")
    ] = None,
    figures: Annotated[
        bool | None, typer.Option("--figures/--no-figures", help="Draw the figures into the directory.")
    ] = None,
    json: JsonOption = False,
) -> int:
    """Partition the goals of a walk by the word of the best path; goes on where it was interrupted."""
    headings = _headings(slices)
    directory = out if out is not None else None if json else Path("runs") / "words"
    refuse(figures is True and directory is None, "--figures", "there is no directory to draw into")
    summary = _solve(headings, directory, context.obj, jobs=jobs, draw=figures is not False)
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


def _solve(
    headings: Sequence[int],
    directory: Path | None,
    interruption: Interruption,
    *,
    jobs: int | None,
    draw: bool,
) -> dict[str, Any]:
    """Solve the slices that are not known yet, keep each as soon as it is, draw them."""
    from manikin.pipeline.batch import usable_cores
    from manikin.reports.directories import WordsDirectory, partition_as_dict
    from manikin.runtime.progress import StageProgress
    from manikin.walking.words import THESIS_GRID, WordSlice, solve_slices

    kept = None if directory is None else WordsDirectory(directory, THESIS_GRID)
    known: dict[int, WordSlice] = {} if kept is None else kept.slices
    if kept is not None:
        kept.begin(headings)
    waiting = [heading for heading in headings if heading not in known]
    with stdout_kept_clean(), StageProgress() as bars:
        done = len(headings) - len(waiting)
        bars(STAGE, done / len(headings), f"{done} of {len(headings)} slices")
        for one in solve_slices(waiting, THESIS_GRID, jobs=jobs or usable_cores()):
            known[round(one.heading_deg)] = one
            if kept is not None:
                kept.keep(one)
            interruption.check()
            done += 1
            bars(STAGE, done / len(headings), f"{done} of {len(headings)} slices")
        if kept is None:
            return partition_as_dict(THESIS_GRID, headings, known)
        summary = kept.finish(headings)
        if draw:
            from manikin.reports.write_outputs import write_words_figures

            write_words_figures([known[heading] for heading in headings], kept.figures)
    return summary


def _print(summary: dict[str, Any]) -> None:
    """Words, number of goals and share of each."""
    width = max(len(word) for word in summary["counts"])
    for word, count in summary["counts"].items():
        typer.echo(f"{word:{width}}  {count:6d}  {100 * summary['shares'][word]:6.2f} %")
    typer.echo(f"{'all':{width}}  {summary['solved']:6d}")
