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
        ValueError: If an alignment is left in a formula, whose environment latex2mathml does not know then.
        Exception: Of latex2mathml, for a formula that it cannot read; the build stops there.
    """

    def drawn(match: re.Match[str]) -> str:
        block = match["open"] == "["
        # Of the two names of the same alignment the converter knows the one.
        tex = unescape(match["tex"]).strip().replace("{aligned}", "{align*}")
        mathml = convert(tex, display="block" if block else "inline")
        if ">&<" in mathml or ">&#x00026;<" in mathml:
            raise ValueError(f"the alignment of {tex!r} is not understood; valid: aligned, bmatrix, cases")
        return f'<{match["tag"]} class="formula">{mathml}</{match["tag"]}>'

    return FORMULA.sub(drawn, html)


def on_page_content(html: str, **_: Any) -> str:
    """Called for the content of each page."""
    return as_mathml(html)
