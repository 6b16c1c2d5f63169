"""The report page of a run: verdict, requirements, figures and all numbers in one file."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from manikin.output import REPORT, read_summary
from manikin.report_page import ReportPage
from manikin.result_directory import FIGURES, write_result
from manikin.results import verdict_line
from manikin.version import __version__

FIRST = ("scene", "postures", "margin", "com", "contacts")
"""Figures that come first, in this order; the others follow by name."""

COLUMNS = ("stage", "requirement", "where", "measured", "", "allowed", "unit", "at [s]", "")
"""Columns of the table of requirements."""

LEFT_OUT = ("requirements", "failure", "verdict", "planned", "proved", "succeeded")
"""Keys of the summary that the page says in other words."""


def write_run_page(directory: str | Path) -> Path:
    """Write ``report.html`` of a finished run, with every figure that is in its directory.

    Args:
        directory: Written by ``manikin run``.

    Returns:
        The file.

    Raises:
        MotionFileError: If the summary cannot be read or the page cannot be written.
    """
    folder = Path(directory)
    page, file = run_page(folder, read_summary(folder)), folder / REPORT
    return write_result(file, page.html())


def run_page(folder: Path, summary: Mapping[str, Any]) -> ReportPage:
    """Compose the page of a run.

    Args:
        folder: Run directory, whose figures are put in.
        summary: Of the run.
    """
    page = ReportPage(str(summary["scenario"]), f"run of manikin {__version__}")
    page.verdict(verdict_line(summary), failed=not summary["succeeded"])
    rows = summary["requirements"]
    if rows:
        page.heading("Requirements")
        page.table(
            COLUMNS, map(_requirement_row, rows), decimals=(None, None, None, None, None, None, None, 2),
            failed=[not row["held"] for row in rows],
        )  # fmt: skip
    pictures = list(_pictures(folder / FIGURES))
    if pictures:
        page.heading("Figures")
    for file in pictures:
        page.picture(file.read_bytes(), file.stem.replace("_", " "))
    page.heading("All numbers")
    page.numbers(dict(_flat({key: value for key, value in summary.items() if key not in LEFT_OUT})))
    return page


def _requirement_row(row: Mapping[str, Any]) -> tuple[Any, ...]:
    return (
        row["stage"], row["name"], row["where"], row["measured"], row["sense"], row["limit"], row["unit"],
        row["time_s"], "kept" if row["held"] else "NOT KEPT",
    )  # fmt: skip


def _pictures(folder: Path) -> Iterator[Path]:
    found = {file.stem: file for file in sorted(folder.glob("*.png"))}
    yield from (found.pop(name) for name in FIRST if name in found)
    yield from found.values()


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and their values; of a list of mappings, one entry each."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and all(isinstance(item, Mapping) for item in value):
            yield from _flat({str(number): item for number, item in enumerate(value)}, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
