"""``manikin library build``: the motion library of walking cycles from recordings."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from manikin.commands.console import DONE, JsonOption, print_json, print_table, stdout_kept_clean

library = typer.Typer(
    help="Walking cycles by velocity, from recorded motion.", no_args_is_help=True, rich_markup_mode=None
)

DEFAULT = "walking_library.npz"


@library.callback()
def _group() -> None:
    """Walking cycles by velocity, from recorded motion."""


@library.command()
def build(
    directory: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Folder with clips_locomotion.csv and, in mocap, the BVH and AMC files it names.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="File to write (.npz).")] = Path(DEFAULT),
    json: JsonOption = False,
) -> int:
    """Cut cycles from recordings and write them, as Fourier coefficients, to a file."""
    from manikin.errors import InputError
    from manikin.locomotion.library_build import build_library
    from manikin.locomotion.library_file import save_library
    from manikin.progress import StageProgress

    if not out.parent.is_dir() or out.is_dir():
        raise InputError(f"--out is {out}; valid: a file in a folder that exists")
    with stdout_kept_clean(), StageProgress() as bars:
        built = build_library(directory, lambda share, remark: bars("library", share, remark))
        save_library(built.library, out)
    summary = {
        "file": str(out),
        "size_bytes": out.stat().st_size,
        "cycles": len(built.library),
        "classes": dict(Counter(built.library.kinds)),
        "windows_without_cycle": [f"{w.file} {w.first}-{w.last}" for w in built.without_cycle],
        "windows_near_others": [f"{w.file} {w.first}-{w.last}" for w in built.near_others],
        "acknowledgements": list(built.library.acknowledgements),
    }
    if json:
        print_json(summary)
    else:
        print_table(summary | {"classes": ", ".join(f"{n} {k}" for k, n in summary["classes"].items())})
    return DONE
