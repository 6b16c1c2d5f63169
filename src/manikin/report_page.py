"""A page of HTML that needs nothing beside itself: headings, tables, drawings, pictures."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from html import escape
from typing import Any

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 72rem }
body { margin: 2rem auto; padding: 0 1rem } body.wide { max-width: none }
h1 { font-size: 1.5rem; margin: 0 } h2 { font-size: 1.1rem; margin: 1.8rem 0 .4rem }
p.sub { color: #666; margin: .2rem 0 1rem }
table { border-collapse: collapse; margin: .3rem 0 } th { text-align: left; font-weight: 600 }
th, td { padding: .15rem .9rem .15rem 0; border-bottom: 1px solid #e4e4e4; vertical-align: top }
th.number, td.number { text-align: right; font-variant-numeric: tabular-nums }
body.wide th { position: sticky; top: 0; background: #fff; vertical-align: bottom }
body.wide { font-size: 13px; line-height: 1.3 } body.wide td, body.wide th { padding-right: .6rem }
ul.remarks { background: #fff6e5; border-left: 4px solid #e69f00; padding: .5rem .5rem .5rem 1.8rem }
td:first-child { white-space: nowrap }
img, svg { max-width: 100%; height: auto; display: block; margin: .8rem 0 }
a { color: #0072b2 }
""".strip()


class ReportPage:
    """Collects the parts of a page.

    Attributes:
        title: Of the page.
        wide: Whether it takes the whole width of the window, for a table of many columns.
    """

    def __init__(self, title: str, subtitle: str = "", *, wide: bool = False) -> None:
        self.title, self.wide = title, wide
        self._parts = [f"<h1>{escape(title)}</h1>"]
        if subtitle:
            self._parts.append(f'<p class="sub">{escape(subtitle)}</p>')

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append(f"<h2>{escape(text)}</h2>")

    def remarks(self, lines: Iterable[str]) -> None:
        """What a reader must know first; nothing where there is none."""
        items = "".join(f"<li>{escape(line)}</li>" for line in lines)
        if items:
            self._parts.append(f'<ul class="remarks">{items}</ul>')

    def text(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{escape(text)}</p>")

    def numbers(self, rows: Mapping[str, Any]) -> None:
        """Names and their values in two columns."""
        self.table(("", ""), [(name, _text(value)) for name, value in rows.items()], headed=False)

    def table(
        self, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, headed: bool = True,
        decimals: Sequence[int | None] = (), links: Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        """Rows under named columns.

        Args:
            columns: Their names.
            rows: As many values each.
            headed: Whether the names are shown.
            decimals: For the numbers of each column; None, and what is left out, for four digits in all.
            links: Addresses of values that are links, by their text.
        """
        found, places = list(rows), [*decimals, *[None] * (len(columns) - len(decimals))]
        numeric = [
            any(isinstance(row[column], int | float) and not isinstance(row[column], bool) for row in found)
            for column in range(len(columns))
        ]
        kinds = [' class="number"' if one else "" for one in numeric]
        head = "".join(f"<th{kind}>{escape(name)}</th>" for kind, name in zip(kinds, columns, strict=True))
        body = "".join(
            f"<tr>{''.join(map(partial(_cell, links or {}), kinds, places, row))}</tr>" for row in found
        )
        self._parts.append(f"<table>{f'<tr>{head}</tr>' if headed else ''}{body}</table>")

    def picture(self, png: bytes, words: str) -> None:
        """A picture, held in the page itself.

        Args:
            png: Content of a PNG file.
            words: What it shows, for who does not see it.
        """
        data, size = base64.b64encode(png).decode("ascii"), ""
        if png[12:16] == b"IHDR":  # at half its pixels, so that letters of all pictures are equally large
            size = f' width="{int.from_bytes(png[16:20], "big") // 2}"'
        self._parts.append(f'<img alt="{escape(words)}"{size} src="data:image/png;base64,{data}">')

    def drawing(self, svg: str) -> None:
        """An SVG element, as :meth:`manikin.svg.Drawing.svg` gives it."""
        self._parts.append(svg)

    def html(self) -> str:
        """Text of the file."""
        head = f'<meta charset="utf-8"><title>{escape(self.title)}</title><style>{STYLE}</style>'
        kind = ' class="wide"' if self.wide else ""
        return f'<!doctype html><html lang="en"><head>{head}</head><body{kind}>\n' + "\n".join(
            [*self._parts, "</body></html>\n"]
        )


def _cell(links: Mapping[str, str], kind: str, decimals: int | None, value: Any) -> str:
    text = escape(_text(value, decimals))
    if isinstance(value, str) and value in links:
        text = f'<a href="{escape(links[value])}">{text}</a>'
    return f"<td{kind}>{text}</td>"


def _text(value: Any, decimals: int | None = None) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.4g}" if decimals is None else f"{value:.{decimals}f}"
    if isinstance(value, str | int):
        return str(value)
    return ", ".join(_text(one, decimals) for one in value)
