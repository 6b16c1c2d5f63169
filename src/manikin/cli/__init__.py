"""Commands of the command line, one module each.

Nothing here loads numpy before a command runs: :func:`manikin.cli.app.main` limits its threads first.
"""

from manikin.cli.app import main

__all__ = ["main"]
