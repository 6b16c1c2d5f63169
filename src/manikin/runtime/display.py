"""One-line ``repr`` and notebook table of a value; packages called as verbs; colours of figures and pages."""

import sys
from collections.abc import Iterable, Mapping, Sized
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
        known = fields(self) if is_dataclass(self) else ()
        return {field.name: _short(getattr(self, field.name)) for field in known}

    def __repr__(self) -> str:
        """``Name(label=text, ...)`` in less than 200 characters."""
        inside = ", ".join(f"{label}={text}" for label, text in self.facts().items())
        return f"{type(self).__name__}({_cut(inside, LONGEST_LINE - len(type(self).__name__))})"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self.facts())


def html_table(title: str, rows: Mapping[str, str]) -> str:
    """Two-column HTML table of labels and texts, with a title."""
    lines = "".join(
        f"<tr><th style='text-align:left'>{escape(label)}</th><td>{escape(text)}</td></tr>"
        for label, text in rows.items()
    )
    return f"<table><caption>{escape(title)}</caption>{lines}</table>"


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def _short(value: Any) -> str:
    """A field in a few characters."""
    if isinstance(value, np.ndarray):
        return f"array{value.shape}".replace(",)", ")")
    if isinstance(value, bool | int | str) or value is None:
        return _cut(repr(value), _LONGEST_TEXT)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Sized):
        return f"{len(value)} {type(value).__name__}"
    return type(value).__name__


COLOURS = {
    "recorded": "#6A51A3", "shifted": "#B3A2D6", "planned": "#0072B2", "executed": "#D55E00",
    "left_foot": "#009E73", "right_foot": "#CC79A7", "left_hand": "#56B4E9", "right_hand": "#E69F00",
    "left_knee": "#005F45", "right_knee": "#8E4770", "left_elbow": "#1F6FA3", "right_elbow": "#9A6700",
    "pelvis": "#6A51A3", "buttocks": "#6A51A3",
    "ink": "#222222", "soft": "#8A8A8A", "shade": "#EEF1F5", "obstacle": "#C9CED6", "trunk": "#6F7784",
    "one support": "#0072B2", "two supports": "#C0392B", "more supports": "#4D4D4D",
    "first run": "#0072B2", "second run": "#D55E00",
}  # fmt: skip
"""Okabe and Ito's palette, which colour-blind readers can tell apart."""

MATERIAL_COLOURS = {
    "skin": "#DDB496", "hair": "#463127", "shirt": "#4774B5", "trousers": "#414957", "shoes": "#33302E",
}  # fmt: skip
"""Colours of what the surface of a person is made of."""

CYCLE = ("#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#6A51A3", "#8C564B")
"""Colours of effectors without one of their own."""


def readable(effector: str) -> str:
    """Name of an effector for people."""
    return effector.replace("_", " ")


def colours_of(effectors: Iterable[str]) -> dict[str, str]:
    """A colour for each effector: its own, or else the next free one."""
    names = list(dict.fromkeys(effectors))
    free = [colour for colour in CYCLE if colour not in {COLOURS.get(name) for name in names}]
    unknown = [name for name in names if name not in COLOURS]
    chosen = dict(zip(unknown, free * (len(unknown) // max(len(free), 1) + 1), strict=False))
    return {name: COLOURS.get(name) or chosen[name] for name in names}


def side_colour(name: str) -> str:
    """Colour of the body's side that a segment or effector belongs to."""
    side = next((side for side in ("left", "right") if name.startswith(side)), None)
    return COLOURS["trunk" if side is None else f"{side}_foot"]
