"""A page of HTML that needs nothing beside itself: headings, tables, drawings, pictures.

Also here. The report page of a run: verdict, requirements, figures and all numbers in one file.
"""

import base64
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from manikin.pipeline.run_directory import REPORT, read_summary
from manikin.reports.summary_table import verdict_line
from manikin.runtime.files import FIGURES, write_result
from manikin.runtime.version import __version__

TEMPLATE = "page.html.jinja"
"""Template of every page, in the folder ``templates`` beside this file."""


@cache
def page_template() -> Template:
    """Template of a page; text is escaped wherever it is filled in."""
    loader = PackageLoader("manikin.reports")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template(TEMPLATE)


class ReportPage:
    """Collects the parts of a page.

    Attributes:
        title: Title of the page.
        subtitle: One line under the title; empty for none.
        wide: Whether it takes the whole width of the window, for a table of many columns.
    """

    def __init__(self, title: str, subtitle: str = "", *, wide: bool = False) -> None:
        self.title, self.subtitle, self.wide = title, subtitle, wide
        self._parts: list[dict[str, Any]] = []

    def verdict(self, text: str, *, failed: bool) -> None:
        """Add how a run ended, in a coloured box."""
        self._parts.append({"kind": "verdict", "text": text, "failed": failed})

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append({"kind": "heading", "text": text})

    def remarks(self, lines: Iterable[str]) -> None:
        """Add a list of remarks in a coloured box; nothing if there is none."""
        if found := list(lines):
            self._parts.append({"kind": "remarks", "lines": found})

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append({"kind": "text", "text": text})

    def numbers(self, rows: Mapping[str, Any]) -> None:
        """Add names and their values in two columns."""
        self.table(("", ""), [(name, _text(value)) for name, value in rows.items()], headed=False)

    def table(
        self, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, headed: bool = True,
        decimals: Sequence[int | None] = (), links: Mapping[str, str] | None = None,
        failed: Sequence[bool] = (),
    ) -> None:  # fmt: skip
        """Add rows under named columns.

        Args:
            columns: Their names.
            rows: As many values each.
            headed: Whether the names are shown.
            decimals: For the numbers of each column; None, and what is left out, for four digits in all.
            links: Addresses of values that are links, by their text.
            failed: Whether to mark each row as a failure; none if left out.
        """
        found, places = list(rows), [*decimals, *[None] * (len(columns) - len(decimals))]
        numeric = [
            any(isinstance(row[column], int | float) and not isinstance(row[column], bool) for row in found)
            for column in range(len(columns))
        ]
        marks = [*failed, *[False] * (len(found) - len(failed))]
        heads = [
            {"name": name, "numeric": number} for name, number in zip(columns, numeric, strict=True)
        ] if headed else []  # fmt: skip
        cells = [
            [_cell(links or {}, *entry) for entry in zip(numeric, places, row, strict=True)] for row in found
        ]
        body = [{"cells": row, "failed": mark} for row, mark in zip(cells, marks, strict=True)]
        self._parts.append({"kind": "table", "columns": heads, "rows": body})

    def picture(self, png: bytes, words: str) -> None:
        """Add a picture, held in the page itself.

        Args:
            png: Content of a PNG file.
            words: Alternative text.
        """
        width = 0
        if png[12:16] == b"IHDR":  # at half its pixels, so that letters of all pictures are equally large
            width = int.from_bytes(png[16:20], "big") // 2
        data = base64.b64encode(png).decode("ascii")
        self._parts.append({"kind": "picture", "words": words, "data": data, "width": width})

    def drawing(self, svg: str) -> None:
        """Add an SVG element, as :meth:`manikin.reports.analysis_sheet.SvgDrawing.svg` gives it."""
        self._parts.append({"kind": "drawing", "svg": svg})

    def html(self) -> str:
        """Text of the file."""
        return page_template().render(
            title=self.title, subtitle=self.subtitle, wide=self.wide, parts=self._parts
        )


def _cell(links: Mapping[str, str], numeric: bool, decimals: int | None, value: Any) -> dict[str, Any]:
    link = links.get(value) if isinstance(value, str) else None
    return {"text": _text(value, decimals), "numeric": numeric, "link": link}


def _text(value: Any, decimals: int | None = None) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if decimals is None else f"{value:.{decimals}f}"
    if isinstance(value, str | int):
        return str(value)
    return ", ".join(_text(one, decimals) for one in value)


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
