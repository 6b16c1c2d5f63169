"""Slices of the partition, several at once, each in a process beside this one."""

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

from threadpoolctl import threadpool_limits

from manikin.errors import InputError, ManikinError
from manikin.locomotion.words.grid import THESIS_GRID, WordGrid
from manikin.locomotion.words.partition import WordSlice, solve_slice
from manikin.worker import prepare_worker


def solve_slices(
    headings_deg: Sequence[float], grid: WordGrid = THESIS_GRID, *, jobs: int = 1
) -> Iterator[WordSlice]:
    """Solve slices side by side; each depends on nothing but itself, so any number of jobs finds the same.

    Args:
        headings_deg: Final heading of each [deg].
        grid: Of the places.
        jobs: Processes; 1 works here. With more a script must keep its own work under
            ``if __name__ == "__main__":``.

    Yields:
        The slices in the order in which they are done.

    Raises:
        InputError: If ``jobs`` is less than 1, or a slice cannot be solved.
        ManikinError: If a process ends before its slice.
    """
    if jobs < 1:
        raise InputError(f"jobs is {jobs}; valid: at least 1")
    if jobs == 1 or len(headings_deg) < 2:
        for heading in headings_deg:
            with threadpool_limits(1):
                found = solve_slice(heading, grid)
            yield found
        return
    # Fresh processes: copies of this one would share the threads and locks of its libraries.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(headings_deg)), context, prepare_worker)
    try:
        futures = [pool.submit(solve_slice, heading, grid) for heading in headings_deg]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise ManikinError("a process of the words ended before its time, for want of memory?") from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
