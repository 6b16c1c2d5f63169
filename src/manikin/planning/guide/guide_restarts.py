"""Several independent searches for a guide path, one after the other or side by side.

The result is that of the lowest restart that succeeds, whichever ends first, so that it depends on the seed
and not on the machine.
"""

from contextlib import closing
from dataclasses import replace
from functools import partial

import numpy as np

from manikin.errors import InputError
from manikin.planning.guide.guide import (
    GuideResult,
    GuideTask,
    GuideWorld,
    plan_guide,
)
from manikin.planning.guide.roadmap import Roadmap
from manikin.runtime.parallel import side_by_side
from manikin.scene.scene import FLOOR, Scene


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
        workers: Processes, see :func:`manikin.runtime.parallel.side_by_side`; the result is the same for any
            number. More than one pays for searches of several seconds.
        roadmap: A roadmap of this world to begin with.

    Returns:
        The result of the lowest restart that succeeds, or of the last one when none does.

    Raises:
        InputError: If a count is less than 1.
    """
    for name, value in (("restarts", restarts), ("workers", workers)):
        if value < 1:
            raise InputError(f"{name} is {value}; valid: at least 1")
    search = partial(_search, _portable(world), task, roadmap, seed)
    results: dict[int, GuideResult] = {}
    with closing(side_by_side(search, range(restarts), workers, "guide search")) as done:
        for number, result in done:
            results[number] = result
            lowest = 0
            while lowest in results:
                if _final(results[lowest]):
                    return results[lowest]
                lowest += 1
    return results[restarts - 1]


def _portable(world: GuideWorld) -> GuideWorld:
    """The same world with a fresh scene: what a scene has computed may not pass between processes."""
    items = [item for item in world.scene if item.name != FLOOR]
    return replace(world, scene=Scene(items, world.scene.floor_height))


def _final(result: GuideResult) -> bool:
    """Whether further restarts could not change the answer: a success, or an unfit end."""
    return result.succeeded or result.where in ("start", "goal")


def _search(
    world: GuideWorld, task: GuideTask, roadmap: Roadmap | None, seed: int, number: int
) -> GuideResult:
    """One restart, with its own stream of random numbers."""
    stream = np.random.SeedSequence(seed, spawn_key=(number,))
    result = plan_guide(world, task, np.random.default_rng(stream), roadmap)
    return replace(result, statistics=replace(result.statistics, restart=number))
