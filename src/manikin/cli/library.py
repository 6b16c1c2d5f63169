"""``manikin library``: the motion library of walking cycles from recordings."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from manikin.cli.console import DONE, JsonOption, bars, print_json, print_table
from manikin.errors import InputError

library = typer.Typer(
    help="Walking cycles by velocity, from recorded motion.", no_args_is_help=True, rich_markup_mode=None
)


@library.callback()
def _group() -> None:
    """Walking cycles by velocity, from recorded motion."""


@library.command()
def build(
    context: typer.Context,
    directory: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Folder with clips_locomotion.csv and, in mocap, the BVH and AMC files it names.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="File to write (.npz).")] = Path("walking_library.npz"),
    json: JsonOption = False,
) -> int:
    """Cut cycles from recordings and write them, as Fourier coefficients, to a file."""
    from manikin.walking.gait.library_build import build_library
    from manikin.walking.gait.motion_library import save_library

    if not out.parent.is_dir() or out.is_dir():
        raise InputError(f"--out is {out}; valid: a file in a folder that exists")
    with bars(context.obj) as progress:
        built = build_library(directory, lambda share, remark: progress("library", share, remark))
        save_library(built.library, out)
    classes = Counter(built.library.kinds)
    summary = {
        "file": str(out),
        "size_bytes": out.stat().st_size,
        "cycles": len(built.library),
        "classes": dict(classes),
        "windows_without_cycle": [f"{w.file} {w.first}-{w.last}" for w in built.without_cycle],
        "windows_near_others": [f"{w.file} {w.first}-{w.last}" for w in built.near_others],
        "acknowledgements": list(built.library.acknowledgements),
    }
    if json:
        print_json(summary)
    else:
        print_table(summary | {"classes": ", ".join(f"{number} {kind}" for kind, number in classes.items())})
    return DONE
