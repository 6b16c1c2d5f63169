"""Standard output and standard error of the commands, and their exit status."""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Annotated, Any

import typer

from manikin.errors import InputError

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
    from manikin.result_directory import to_json

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
