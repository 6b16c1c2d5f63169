"""Slices of the partition, several at once, each in a process beside this one."""

from collections.abc import Iterator, Sequence
from functools import partial

from manikin.errors import InputError
from manikin.locomotion.words.grid import THESIS_GRID, WordGrid
from manikin.locomotion.words.partition import WordSlice, solve_slice
from manikin.worker import side_by_side


def solve_slices(
    headings_deg: Sequence[float], grid: WordGrid = THESIS_GRID, *, jobs: int = 1
) -> Iterator[WordSlice]:
    """Solve slices side by side; each depends on nothing but itself, so any number of jobs finds the same.

    Args:
        headings_deg: Final heading of each [deg].
        grid: Of the places.
        jobs: Processes, see :func:`manikin.worker.side_by_side`.

    Yields:
        The slices in the order in which they are done.

    Raises:
        InputError: If ``jobs`` is less than 1, or a slice cannot be solved.
        ManikinError: If a process ends before its slice.
    """
    if jobs < 1:
        raise InputError(f"jobs is {jobs}; valid: at least 1")
    for _, found in side_by_side(partial(solve_slice, grid=grid), headings_deg, jobs, "words"):
        yield found
