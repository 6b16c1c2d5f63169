"""The command line: each command in a module beside this one.

Exit status: 0 done, 2 bad input (one line on standard error), 3 a run that ended in an explained failure,
130 interrupted. With ``--json`` standard output holds exactly one JSON object; everything else goes to
standard error. Nothing here loads numpy before a command runs: :func:`main` limits its threads first.
"""

import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from manikin.cli import console
from manikin.cli.adapt import adapt
from manikin.cli.analyze import analyze
from manikin.cli.balance import balance, contact
from manikin.cli.benchmark import benchmark
from manikin.cli.console import Interruption, JsonOption, flag
from manikin.cli.doctor import doctor
from manikin.cli.ergonomics import ergonomics
from manikin.cli.push import push
from manikin.cli.run import run
from manikin.cli.statistics import statistics
from manikin.cli.study import study
from manikin.cli.view import compare, export, view
from manikin.cli.walk import library, walk, words
from manikin.errors import InputError, ManikinError
from manikin.runtime import __version__
from manikin.runtime.child import end_as_told

__all__ = ["main"]


WHAT_NEXT = """manikin plans how a person moves through a cluttered scene and proves it in a physics engine.

  manikin scenarios                  List what can be run at once.
  manikin run platform               Plan and prove a motion; its report is in runs/platform.
  manikin view runs/platform         Watch it in the browser.
  manikin ergonomics runs/platform   Judge its postures and loads.
  manikin analyze RECORDING          Measure a recorded motion (.c3d .trc .bvh .amc).
  manikin --help                     List every command; 'manikin COMMAND --help' has its options."""
"""What the command says that is given nothing to do."""


app = typer.Typer(
    name="manikin",
    help="Plans how a person moves through a cluttered scene and proves it in a physics engine.",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status; no traceback for a user's mistake."""
    # Before numpy is loaded: threads make its small products several times slower, and the last
    # bits of a result depend on their number.  Whoever sets the variable has the last word.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    end_as_told()
    try:
        with Interruption() as interruption:
            given = None if arguments is None else list(arguments)
            status = app(args=given, standalone_mode=False, obj=interruption)
        if status == console.INTERRUPTED:  # typer turns Ctrl-C into this status without a word
            raise KeyboardInterrupt
        return status if isinstance(status, int) else console.DONE
    except typer.TyperException as error:
        problem = error.format_message().rstrip(".").replace("Value error, ", "")
        return console.complain(f"{problem}; see 'manikin --help'", console.BAD_INPUT)
    except InputError as error:
        return console.complain(str(error), console.BAD_INPUT)
    except ManikinError as error:
        return console.complain(str(error), console.FAILED)
    except (KeyboardInterrupt, typer.Abort):
        return console.complain("interrupted; the files of finished stages are kept", console.INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone, as in "manikin ... | head"; nobody is left to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return console.INTERRUPTED


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context, version: Annotated[bool, flag("--version", "Print the version.")] = False
) -> None:
    if version:
        typer.echo(f"manikin {__version__}")
    elif context.invoked_subcommand is None:
        typer.echo(WHAT_NEXT)


@app.command()
def scenarios(json: JsonOption = False) -> None:
    """List the built-in scenarios and their variants."""
    from manikin.scenarios import list_scenarios, list_variants

    descriptions = list_scenarios()
    variants = {name: list_variants(name) for name in descriptions}
    if json:
        console.print_json({"scenarios": descriptions, "variants": variants})
        return
    rows = {}
    for name, description in descriptions.items():
        rows[name] = description
        rows |= {f"{name}@{variant}": text for variant, text in variants[name].items()}
    console.print_table(rows)


for _command in (
    run, benchmark, study, analyze, adapt, push, walk, words, ergonomics, statistics, compare, view, balance,
    contact, export, doctor,
):  # fmt: skip
    app.command()(_command)
app.add_typer(library, name="library")


if __name__ == "__main__":
    sys.exit(main())
