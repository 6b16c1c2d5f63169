"""Searches of several directions at once, each in a process beside this one."""

import multiprocessing
from collections.abc import Iterator, Sequence
from functools import partial
from multiprocessing.synchronize import Event

from manikin.errors import InputError, ManikinError
from manikin.simulation.push_search import DirectionSearch, HeldImpulse
from manikin.worker import FRESH, prepare_worker, side_by_side


def search_directions(
    searches: Sequence[DirectionSearch], *, jobs: int = 1
) -> Iterator[tuple[int, HeldImpulse]]:
    """Search directions, of one map or several, side by side.

    Each search depends on nothing but itself, so the result is the same for any number of jobs.

    Args:
        searches: What to search.
        jobs: Processes, see :func:`manikin.worker.side_by_side`.

    Yields:
        Index of a search that is done, and what it found, in the order in which they end.

    Raises:
        InputError: If ``jobs`` is less than 1, or a search refuses its push.
        ManikinError: If a process ends before its search.
    """
    if jobs < 1:
        raise InputError(f"jobs is {jobs}; valid: at least 1")
    given_up = multiprocessing.get_context(FRESH).Event()
    try:
        yield from side_by_side(_run, searches, jobs, "search", prepare=partial(_prepare, given_up))
    finally:
        given_up.set()


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
