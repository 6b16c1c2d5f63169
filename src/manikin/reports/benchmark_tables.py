"""Results of a benchmark: one row for each family, every failure with its reason, and a page of both."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from manikin.pipeline.run_directory import REPORT
from manikin.reports.pages import render
from manikin.reports.summary_table import NOTHING, number
from manikin.runtime.files import write_result
from manikin.scenarios.families import FAMILIES

HEADER = (
    "family", "tasks", "contacts", "certified", "planned", "proved", "contacts [s]: median", "95 %",
    "motion [s]", "computing / motion", "failures by stage",
)  # fmt: skip
"""Columns of the table; times are processor time, of motions the median."""


def family_rows(result: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """One row of texts for each family under :data:`HEADER`, all of them together last.

    Args:
        result: As :func:`manikin.pipeline.benchmark.run_benchmark` returns it.
    """
    rows = [*result["families"].items(), ("all", result["total"])]
    return [_row(name, counts, whole=result["stage"] == "all") for name, counts in rows]


def _row(name: str, counts: Mapping[str, Any], *, whole: bool) -> tuple[str, ...]:
    seconds = counts["contacts_s"]
    return (
        name,
        str(counts["tasks"]),
        str(counts["contacts"]),
        NOTHING if counts["checked"] is None else str(counts["checked"]),
        *(str(counts[key]) if whole else NOTHING for key in ("planned", "proved")),
        number(seconds["median"], 2),
        number(seconds["p95"], 2),
        number(counts["duration_s"], 1),
        number(counts["computing_over_motion"], 1),
        ", ".join(f"{stage} {count}" for stage, count in counts["failures"].items()) or NOTHING,
    )


def text_table(result: Mapping[str, Any]) -> str:
    """The table in columns of equal width."""
    rows = [HEADER, *family_rows(result)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADER))]
    lines = (
        "  ".join(cell.ljust(width) if column in (0, len(HEADER) - 1) else cell.rjust(width)
                  for column, (cell, width) in enumerate(zip(row, widths, strict=True)))
        for row in rows
    )  # fmt: skip
    return "\n".join(line.rstrip() for line in lines)


def failure_lines(result: Mapping[str, Any]) -> Iterator[str]:
    """Every task that failed with its stage and reason, and every one whose contacts the check refuses."""
    for entry in result["tasks"]:
        if entry["checked"] is not None and not entry["checked"]["certified"]:
            yield f"{entry['family']}-{entry['seed']} (check): {entry['checked']['verdict']}"
        if entry["failure"] is not None:
            failure = entry["failure"]
            yield f"{entry['family']}-{entry['seed']} ({failure['stage']}): {failure['reason']}"


def write_benchmark_page(directory: Path, result: Mapping[str, Any]) -> Path:
    """Write ``report.html`` of a benchmark beside its results, and return the file.

    Raises:
        MotionFileError: If it cannot be written.
    """
    descriptions = {name: family.description for name, family in FAMILIES.items()}
    rows = family_rows(result)
    page = render("benchmark", result=result, header=HEADER, rows=rows, descriptions=descriptions)
    return write_result(directory / REPORT, page)
