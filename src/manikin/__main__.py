"""``python -m manikin`` and the command ``manikin``: the command line as a process of its own."""

import atexit
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

__all__ = ["program"]

_INTERRUPTED = 128 + signal.SIGINT


def program() -> int:
    """Run the command line and return the exit status, which no signal changes.

    SIGINT and SIGTERM are the command's while it works, see :class:`manikin.cli.console.Interruption`.
    Before that nothing is begun, and the process ends at once. After that the status is known, but Python
    gives both back to the system while it ends, and would end by them. It would as well end by SIGINT
    where a KeyboardInterrupt once left code that was given as text, such as a dataclass makes, even if it
    was caught: that is remembered until the next such code runs.
    """
    atexit.register(_on_signals, signal.SIG_IGN)  # the first registered is the last called
    _on_signals(_end_with(_INTERRUPTED, b"manikin: interrupted\n"))
    from manikin.cli import main

    status = main(sys.argv[1:])
    _on_signals(_end_with(status))
    exec("")  # forgets an interrupt of code that was given as text
    return status


def _on_signals(action: Any) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, action)


def _end_with(status: int, words: bytes = b"") -> Callable[[int, FrameType | None], None]:
    def end(_number: int, _frame: FrameType | None) -> None:
        os.write(2, words)
        os._exit(status)

    return end


if __name__ == "__main__":
    sys.exit(program())
