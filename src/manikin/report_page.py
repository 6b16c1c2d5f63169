"""A page of HTML that needs nothing beside itself: headings, tables, pictures."""

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 72rem }
body { margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.5rem; margin: 0 } h2 { font-size: 1.1rem; margin: 1.8rem 0 .4rem }
p.sub { color: #666; margin: .2rem 0 1rem }
table { border-collapse: collapse; margin: .3rem 0 } th { text-align: left; font-weight: 600 }
th, td { padding: .15rem .9rem .15rem 0; border-bottom: 1px solid #e4e4e4; vertical-align: top }
td.number { text-align: right; font-variant-numeric: tabular-nums }
ul.remarks { background: #fff6e5; border-left: 4px solid #e69f00; padding: .5rem .5rem .5rem 1.8rem }
img { max-width: 100% } a { color: #0072b2 } details { margin: .4rem 0 } summary { cursor: pointer }
""".strip()


class ReportPage:
    """Collects the parts of a page.

    Attributes:
        title: Of the page.
    """

    def __init__(self, title: str, subtitle: str = "") -> None:
        self.title = title
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
        self.table(("", ""), rows.items(), headed=False)

    def table(
        self, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, headed: bool = True,
        links: Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        """Rows under named columns.

        Args:
            columns: Their names.
            rows: As many values each.
            headed: Whether the names are shown.
            links: Addresses of values that are links, by their text.
        """
        head = "".join(f"<th>{escape(name)}</th>" for name in columns) if headed else ""
        body = "".join(f"<tr>{''.join(_cell(value, links or {}) for value in row)}</tr>" for row in rows)
        self._parts.append(f"<table>{f'<tr>{head}</tr>' if head else ''}{body}</table>")

    def picture(self, png: bytes, words: str) -> None:
        """A picture, held in the page itself.

        Args:
            png: Content of a PNG file.
            words: What it shows, for who does not see it.
        """
        data = base64.b64encode(png).decode("ascii")
        self._parts.append(f'<img alt="{escape(words)}" src="data:image/png;base64,{data}">')

    def html(self) -> str:
        """Text of the file."""
        head = f'<meta charset="utf-8"><title>{escape(self.title)}</title><style>{STYLE}</style>'
        return f'<!doctype html><html lang="en"><head>{head}</head><body>\n' + "\n".join(
            [*self._parts, "</body></html>\n"]
        )


def _cell(value: Any, links: Mapping[str, str]) -> str:
    if isinstance(value, str) and value in links:
        return f'<td><a href="{escape(links[value])}">{escape(value)}</a></td>'
    if isinstance(value, bool | str) or value is None:
        return f"<td>{'-' if value is None else escape(str(value))}</td>"
    if isinstance(value, float):
        return f'<td class="number">{value:.4g}</td>'
    if isinstance(value, int):
        return f'<td class="number">{value}</td>'
    return (
        f"<td>{escape(', '.join(f'{one:.4g}' if isinstance(one, float) else str(one) for one in value))}</td>"
    )
