"""Packages that are also verbs of the library."""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any


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
