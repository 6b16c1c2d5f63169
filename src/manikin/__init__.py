"""Plan, prove and measure how a body moves through a cluttered scene.

The verbs of :mod:`manikin.api` stand under this name, ``import manikin as mk``; engines load when one is
used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from manikin.runtime import __version__

if TYPE_CHECKING:
    from manikin.api import (
        adapt,
        analyze,
        balance,
        compare,
        creature,
        grasp,
        plan,
        point,
        push,
        read,
        scene,
        simulate,
        sole,
        stance,
        walk,
    )
    from manikin.body import human
    from manikin.pipeline.runner import run


__all__ = [
    "__version__", "adapt", "analyze", "balance", "compare", "creature", "grasp", "human", "plan", "point",
    "push", "read", "run", "scene", "simulate", "sole", "stance", "walk",
]  # fmt: skip


_PACKAGES = ("balance", "scene")
"""Verbs whose names are those of packages, which can be called; see :mod:`manikin.runtime.display`."""


def __getattr__(name: str) -> Any:
    """Load a verb when it is first used."""
    if name not in __all__:
        raise AttributeError(f"module 'manikin' has no attribute {name!r}; it has {', '.join(__all__)}")
    if name in _PACKAGES:
        return import_module(f"manikin.{name}")
    home = import_module("manikin.pipeline.runner" if name == "run" else "manikin.api")
    globals()[name] = getattr(home, name)
    return globals()[name]
