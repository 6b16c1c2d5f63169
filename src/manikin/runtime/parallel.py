"""Work in processes beside this one."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from threadpoolctl import ThreadpoolController, threadpool_limits

from manikin.errors import ManikinError

FRESH = "spawn"
"""Fresh processes: copies of this one would share the threads and locks of its libraries."""

SERVED = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else FRESH
"""Copies of a fresh process that has imported already what they need, where the system has such."""

T = TypeVar("T")
R = TypeVar("R")


def prepare_worker() -> None:
    """Make a new process one of a pool: one thread, deaf to Ctrl-C, which its parent sees to.

    It ends when its parent does, even where that is killed and cannot say so.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(1)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def side_by_side(
    work: Callable[[T], R],
    items: Sequence[T],
    workers: int,
    name: str,
    *,
    prepare: Callable[[], None] = prepare_worker,
    method: str = FRESH,
) -> Iterator[tuple[int, R]]:
    """Do the same work on many items, each in one of several processes, or all of them here.

    Nothing goes on when the iterator is closed, but what a process has begun.

    Args:
        work: Can be pickled, as items and results can; depends on nothing but its item.
        items: What to work on.
        workers: Processes; with 1, and for a single item, all is done here, on one thread. With more a script
            must keep its own work under ``if __name__ == "__main__":``.
        name: Of the work, for the message of an error.
        prepare: What each process begins with; calls :func:`prepare_worker`.
        method: How processes are started, :data:`FRESH` or :data:`SERVED`.

    Yields:
        Number of an item and its result, in the order in which they are done.

    Raises:
        ManikinError: If a process ends before its time.
    """
    if workers == 1 or len(items) < 2:
        threads = ThreadpoolController()
        for number, item in enumerate(items):
            with threads.limit(limits=1):
                found = work(item)
            yield number, found
        return
    context = multiprocessing.get_context(method)
    pool = ProcessPoolExecutor(min(workers, len(items)), context, prepare)
    try:
        futures = {pool.submit(work, item): number for number, item in enumerate(items)}
        for future in as_completed(futures):
            yield futures.pop(future), future.result()
    except BrokenProcessPool:
        raise ManikinError(f"a process of the {name} ended before its time, for want of memory?") from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
