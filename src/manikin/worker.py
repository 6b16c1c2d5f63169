"""What every process that works beside this one begins with."""

import multiprocessing
import os
import signal
import threading

from threadpoolctl import threadpool_limits


def prepare_worker() -> None:
    """Make a new process one of a pool: one thread, deaf to Ctrl-C, which its parent sees to.

    It ends when its parent does, even where that is killed and cannot say so.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
