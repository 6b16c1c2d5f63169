"""Searches of several directions at once, each in a process beside this one."""

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.synchronize import Event

from threadpoolctl import threadpool_limits

from manikin.errors import InputError, ManikinError
from manikin.simulation.push_search import DirectionSearch, HeldImpulse
from manikin.worker import prepare_worker


def search_directions(
    searches: Sequence[DirectionSearch], *, jobs: int = 1
) -> Iterator[tuple[int, HeldImpulse]]:
    """Search directions, of one map or several, side by side.

    Each search depends on nothing but itself, so the result is the same for any number of jobs.

    Args:
        searches: What to search.
        jobs: Processes; 1 searches here. With more a script must keep its own work under
            ``if __name__ == "__main__":``.

    Yields:
        Index of a search that is done, and what it found, in the order in which they end.

    Raises:
        InputError: If ``jobs`` is less than 1, or a search refuses its push.
        ManikinError: If a process ends before its search.
    """
    if jobs < 1:
        raise InputError(f"jobs is {jobs}; valid: at least 1")
    if jobs > 1 and len(searches) > 1:
        yield from _side_by_side(searches, min(jobs, len(searches)))
        return
    for number, search in enumerate(searches):
        with threadpool_limits(1):
            found = search.run()
        yield number, found


def _side_by_side(searches: Sequence[DirectionSearch], jobs: int) -> Iterator[tuple[int, HeldImpulse]]:
    # Fresh processes: copies of this one would share the threads and locks of its libraries.
    context = multiprocessing.get_context("spawn")
    given_up = context.Event()
    pool = ProcessPoolExecutor(jobs, context, _prepare, (given_up,))
    try:
        futures = {pool.submit(_run, search): number for number, search in enumerate(searches)}
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool:
        raise ManikinError("a process of the search ended before its time, for want of memory?") from None
    finally:
        given_up.set()
        pool.shutdown(wait=False, cancel_futures=True)


_given_up: Event | None = None


def _prepare(given_up: Event) -> None:
    """Make a new process one of the search, which ends when it is given up."""
    global _given_up
    _given_up = given_up
    prepare_worker()


def _run(search: DirectionSearch) -> HeldImpulse:
    return search.run(_still_wanted)


def _still_wanted() -> None:
    """Raise if nobody wants the result any more."""
    if _given_up is not None and _given_up.is_set():
        raise ManikinError("the search was given up")
