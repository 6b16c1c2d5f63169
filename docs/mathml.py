"""Hook of the documentation: formulas become MathML, which browsers draw without a script or a font."""

import re
from html import unescape
from typing import Any

from latex2mathml.converter import convert

FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\(?P<open>[(\[])(?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)


def as_mathml(html: str) -> str:
    """HTML with each formula of TeX as MathML.

    Raises:
        Exception: Of latex2mathml, for a formula that it cannot read; the build stops there.
    """

    def drawn(match: re.Match[str]) -> str:
        block = match["open"] == "["
        mathml = convert(unescape(match["tex"]).strip(), display="block" if block else "inline")
        return f'<{match["tag"]} class="formula">{mathml}</{match["tag"]}>'

    return FORMULA.sub(drawn, html)


def on_page_content(html: str, **_: Any) -> str:
    """Called for the content of each page."""
    return as_mathml(html)
