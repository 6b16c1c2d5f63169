"""One-line ``repr`` and notebook table of a value; packages that can be called as verbs."""

import sys
from collections.abc import Mapping, Sized
from dataclasses import fields, is_dataclass
from html import escape
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np


class CallablePackage(ModuleType):
    """Package that can be called: ``manikin.balance(...)`` is :func:`manikin.api.balance`.

    The front door has verbs whose names are those of packages; an attribute of ``manikin`` can only be one of
    both, and importing a package makes it that one. The package stays what it is and is called as well.
    """

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Call the verb of this name."""
        verb = getattr(import_module("manikin.api"), self.__name__.rpartition(".")[2])
        return verb(*arguments, **options)


def make_callable(name: str) -> None:
    """Let the package called ``name``, which is being imported, be called as the verb of the same name."""
    sys.modules[name].__class__ = CallablePackage


LONGEST_LINE = 180
"""Characters of a value's line; arrays of contacts or samples would fill screens."""

_LONGEST_TEXT = 48


class Displayed:
    """Base of values that print as one line and show as a table in a notebook.

    A subclass says in :meth:`facts` what a reader wants to know first. Without that, its fields are told,
    arrays by their shape. Dataclasses take ``repr=False``, which would write the line themselves.
    """

    def facts(self) -> dict[str, str]:
        """Description of the value as labels and short texts in order."""
        if not is_dataclass(self):
            return {}
        return {field.name: _short(getattr(self, field.name)) for field in fields(self)}

    def __repr__(self) -> str:
        """``Name(label=text, ...)`` in less than 200 characters."""
        inside = ", ".join(f"{label}={text}" for label, text in self.facts().items())
        if len(inside) > LONGEST_LINE - len(type(self).__name__):
            inside = inside[: LONGEST_LINE - len(type(self).__name__) - 3] + "..."
        return f"{type(self).__name__}({inside})"

    def _repr_html_(self) -> str:
        """Table of the facts, as notebooks show it."""
        return html_table(type(self).__name__, self.facts())


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Two-column HTML table with a title.

    Args:
        rows: Label and text of each row.
    """
    lines = "".join(
        f"<tr><th style='text-align:left'>{escape(label)}</th><td>{escape(text)}</td></tr>"
        for label, text in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption>{lines}</table>"


def _short(value: Any) -> str:
    """A field in a few characters."""
    if isinstance(value, np.ndarray):
        return f"array{value.shape}".replace(",)", ")")
    if isinstance(value, bool | int | str) or value is None:
        text = repr(value)
        return text if len(text) <= _LONGEST_TEXT else f"{text[: _LONGEST_TEXT - 3]}..."
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Sized):
        return f"{len(value)} {type(value).__name__}"
    return type(value).__name__
