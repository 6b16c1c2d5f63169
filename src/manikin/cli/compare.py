"""``manikin compare``: two runs side by side."""

from pathlib import Path
from typing import Annotated

import typer

from manikin.cli.console import JsonOption, bars, print_json


def compare(
    context: typer.Context,
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
        from manikin.reports.write_outputs import write_comparison_outputs

        with bars(context.obj) as progress:
            write_comparison_outputs(comparison, out, progress)
    if json:
        print_json(comparison.as_dict())
        return
    from manikin.reports.comparison.comparison_table import report, report_console

    report_console().print(report(comparison))
    if out is not None:
        typer.echo(f"figures in {out}", err=True)
