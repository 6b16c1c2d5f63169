"""Griffe extension: the few reStructuredText marks in the docstrings as Markdown."""

import re
from typing import Any

import griffe

ROLE = re.compile(r":(?:class|func|meth|attr|mod|data|exc):`~?([^`]+)`")
CITATION = re.compile(r"\[([A-Z][a-z]+)(\d{4})\]_")


def as_markdown(text: str) -> str:
    """Roles become code, double backticks single ones, and ``[Qiu2012]_`` becomes Qiu (2012)."""
    text = ROLE.sub(lambda match: f"`{match[1].rsplit('.', 1)[-1]}`", text)
    return CITATION.sub(r"\1 (\2)", text.replace("``", "`"))


class RstRoles(griffe.Extension):
    """Rewrites every docstring that is loaded."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Rewrite the docstring of one object."""
        if obj.docstring is not None:
            obj.docstring.value = as_markdown(obj.docstring.value)
