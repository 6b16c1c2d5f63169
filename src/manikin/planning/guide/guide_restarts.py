"""Searches from several seeds at once, the first here and the others in processes beside it.

The result is that of the lowest restart that succeeds, whichever finishes first, so that it depends
on the seed and not on the machine.  A restart gives up when a lower one has succeeded.
"""

import multiprocessing
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing.sharedctypes import Synchronized
from typing import Any

import numpy as np

from manikin.errors import InputError
from manikin.planning.guide.guide import (
    GuideResult,
    GuideStatistics,
    GuideTask,
    GuideWorld,
    KeepGoing,
    plan_guide,
)
from manikin.planning.guide.roadmap import Roadmap
from manikin.scene.scene import FLOOR, Scene


@dataclass(frozen=True, eq=False)
class _Job:
    """One restart, as it is sent to a process."""

    world: GuideWorld
    task: GuideTask
    roadmap: Roadmap | None
    seed: int
    number: int


def plan_guide_with_restarts(
    world: GuideWorld,
    task: GuideTask,
    seed: int,
    *,
    restarts: int = 4,
    workers: int = 2,
    roadmap: Roadmap | None = None,
) -> GuideResult:
    """Plan a path with several independent searches.

    Args:
        seed: Each restart draws from its own stream of this seed.
        restarts: Searches at most.
        workers: Processes, this one included; with 1 the searches run one after the other, with
            the same result. More than one pays for searches of several seconds, because a new
            process takes a second or more to begin; a script must then keep its own work under
            ``if __name__ == "__main__":``.
        roadmap: A roadmap of this world to begin with.

    Returns:
        The result of the lowest restart that succeeds, or of the last one when none does.

    Raises:
        InputError: If a count is less than 1.
    """
    for name, value in (("restarts", restarts), ("workers", workers)):
        if value < 1:
            raise InputError(f"{name} is {value}; valid: at least 1")
    jobs = [_Job(_portable(world), task, roadmap, seed, number) for number in range(restarts)]
    if workers > 1 and restarts > 1:
        return _in_processes(jobs, workers)
    result = _run(jobs[0], None)
    for job in jobs[1:]:
        if _final(result):
            break
        result = _run(job, None)
    return result


def _portable(world: GuideWorld) -> GuideWorld:
    """The same world with a fresh scene: what a scene has computed may not pass between processes."""
    items = [item for item in world.scene if item.name != FLOOR]
    return replace(world, scene=Scene(items, world.scene.floor_height))


def _final(result: GuideResult) -> bool:
    """Whether further restarts could not change the answer: a success, or an unfit end."""
    return result.succeeded or result.where in ("start", "goal")


def _in_processes(jobs: list[_Job], workers: int) -> GuideResult:
    """The lowest restart runs here, the others in processes beside it."""
    # Fresh processes: copies of this one would share the threads and locks of its libraries.
    context = multiprocessing.get_context("spawn")
    lowest: Any = context.Value("i", len(jobs))
    pool = ProcessPoolExecutor(min(workers, len(jobs)) - 1, context, _share, (lowest,))
    try:
        futures: list[Future[GuideResult]] = [pool.submit(_run_shared, job) for job in jobs[1:]]
        result = _run(jobs[0], None)
        for future in futures:
            if _final(result):
                break
            result = future.result()
    finally:
        with lowest.get_lock():
            lowest.value = -1  # nobody's result is wanted any more
        pool.shutdown(wait=False, cancel_futures=True)
    return result


_lowest: "Synchronized[int] | None" = None


def _share(lowest: "Synchronized[int]") -> None:
    """Give a process the number of the lowest restart that has its answer."""
    global _lowest
    _lowest = lowest


class _StillWanted:
    """Whether no lower restart has its answer."""

    def __init__(self, number: int, lowest: "Synchronized[int]") -> None:
        self._number, self._lowest = number, lowest

    def __call__(self) -> bool:
        return self._lowest.value > self._number


def _run_shared(job: _Job) -> GuideResult:
    lowest = _lowest
    if lowest is None:
        return _run(job, None)
    wanted = _StillWanted(job.number, lowest)
    if not wanted():
        return GuideResult(None, None, GuideStatistics(restart=job.number), "given up", "roadmap")
    result = _run(job, wanted)
    if _final(result):
        with lowest.get_lock():
            lowest.value = min(lowest.value, job.number)
    return result


def _run(job: _Job, keep_going: KeepGoing | None) -> GuideResult:
    stream = np.random.SeedSequence(job.seed, spawn_key=(job.number,))
    result = plan_guide(
        job.world, job.task, np.random.default_rng(stream), job.roadmap, keep_going=keep_going
    )
    return replace(result, statistics=replace(result.statistics, restart=job.number))
