"""``manikin balance``: polytope and margins of one stance."""

from pathlib import Path
from typing import Annotated

import typer

from manikin.cli.console import JsonOption, flattened, print_json, print_table, stdout_kept_clean


def balance(
    stance: Annotated[Path, typer.Argument(metavar="STANCE.yaml", help="Stance file.")],
    json: JsonOption = False,
    polytope: Annotated[bool, typer.Option("--polytope", help="Add the rows H and h to the JSON.")] = False,
) -> None:
    """Polytope and margins of one stance and centre-of-mass state."""
    from manikin.scenarios.stance_file import load_stance_file

    question = load_stance_file(stance)
    with stdout_kept_clean():
        report = question.evaluate().as_dict(polytope=polytope and json)
    if json:
        print_json(report)
    else:
        print_table(flattened(report))
