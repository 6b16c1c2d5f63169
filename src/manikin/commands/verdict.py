"""The result of a run on the screen: the verdict first, then each requirement with its measured value."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import typer

from manikin.results import verdict_line

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
