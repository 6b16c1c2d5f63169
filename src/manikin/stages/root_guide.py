"""The way of the root from start to goal, as the contact planner follows it ([Tonneau2015]_ chapter 6)."""

import time as clock
from dataclasses import dataclass

import numpy as np

from manikin.contact_planning import GuideLine
from manikin.reachability import GuideTask, LocalPlanner, World, nearest_fit, plan_guide, relax
from manikin.spatial import FloatArray

GUIDE_POSES = 200
"""Poses by which the contact planner knows a guide."""


@dataclass(frozen=True, eq=False)
class RootGuide:
    """A way of the root, or why there is none.

    Attributes:
        line: The way, or None.
        samples: Poses drawn in the search.
        wall_s: Wall time [s].
        failure: None, or the reason in one line.
    """

    line: GuideLine | None
    samples: int
    wall_s: float
    failure: str | None = None


def guide_root(world: World, ends: FloatArray, rng: np.random.Generator) -> RootGuide:
    """Find a comfortable way between two poses of the root.

    Args:
        world: Scene, abstraction of the body, region and condition of the way.
        ends: (2, 7) poses at start and goal; where they do not fit, the nearest that do are taken.
        rng: Source of all randomness.
    """
    began = clock.perf_counter()
    checker = world.checker()
    fits = [nearest_fit(pose, checker) for pose in ends]
    ends = np.array([pose if fit is None else fit for pose, fit in zip(ends, fits, strict=True)])
    found = plan_guide(world, GuideTask(*ends), rng)
    samples = found.statistics.samples
    if found.path is None:
        return RootGuide(None, samples, clock.perf_counter() - began, found.failure or "no guide")
    poses = found.path.poses(np.linspace(0.0, 1.0, GUIDE_POSES))
    line = GuideLine.through(relax(poses, LocalPlanner(checker, tuple(ends)), rng))
    return RootGuide(line, samples, clock.perf_counter() - began)
