"""``manikin export``: a motion for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from manikin.cli.console import MotionArgument


def export(
    source: MotionArgument,
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

    typer.echo(str(export_motion(read_motions(source), source, format, out=out, which=motion, rate=rate)))
