"""A page of HTML that needs nothing beside itself: headings, tables, drawings, pictures."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

TEMPLATE = "page.html.jinja"
"""Template of every page, in the folder ``templates`` of the package."""


@cache
def page_template() -> Template:
    """Template of a page; text is escaped wherever it is filled in."""
    loader = PackageLoader("manikin")
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
        """Add an SVG element, as :meth:`manikin.svg.Drawing.svg` gives it."""
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
