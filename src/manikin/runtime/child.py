"""Processes that end with the one that started them, however that ends."""

import os
import threading
import time

PARENT = "MANIKIN_PARENT"
"""Variable of the environment that names the process which a command ends with."""
_INTERVAL = 0.25
"""Time between two looks at the parent [s]."""


def environment_of_child() -> dict[str, str]:
    """Environment in which a command of manikin computes on one thread and ends with this process."""
    return {**os.environ, "OMP_NUM_THREADS": "1", PARENT: str(os.getpid())}


def end_as_told() -> None:
    """End with the process that the environment names, if it names one; it does not for own children."""
    if (parent := os.environ.pop(PARENT, "")).isdecimal():
        end_with(int(parent))


def end_with(parent: int) -> None:
    """End this process soon after its parent, of this number, has ended."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_INTERVAL)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
