"""A guide for the root from start to goal: roadmap, request, spline ([Tonneau2015]_ chapter 6)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from manikin.numerics.spatial import FloatArray
from manikin.planning.guide.abstraction import Abstraction
from manikin.planning.guide.checker import ReachabilityChecker
from manikin.planning.guide.condition import Condition
from manikin.planning.guide.roadmap import (
    Roadmap,
    RoadmapSettings,
    Route,
    attach,
    find_route,
    grow,
    unfit_end,
)
from manikin.planning.guide.root_path import RootLimits, RootPath, approximate, prune, shorten
from manikin.planning.guide.root_pose import checked_pose
from manikin.planning.guide.sampler import PoseSampler, SamplingRegion
from manikin.planning.guide.steering import LocalPlanner
from manikin.scene.scene import Scene

CHUNK = 10
"""Poses drawn between two looks at whether start and goal are joined."""

PATIENCE = 5
"""Times as many rejections in a row end a search for one task as end an offline roadmap."""


@dataclass(frozen=True, eq=False)
class GuideWorld:
    """Scene, creature and condition: what a roadmap is about.

    Attributes:
        region: Where roots are drawn.
        condition: What every pose must satisfy.
        roadmap: Numbers of Algorithm 4; its ``samples`` is the budget of one search.
    """

    scene: Scene
    abstraction: Abstraction
    region: SamplingRegion
    condition: Condition = field(default_factory=Condition)
    roadmap: RoadmapSettings = field(default_factory=RoadmapSettings)

    def checker(self) -> ReachabilityChecker:
        """Checker with the margins of planning."""
        return ReachabilityChecker(self.abstraction, self.scene, self.condition)


@dataclass(frozen=True, eq=False)
class GuideTask:
    """Start and goal of a guide, poses (7,) of the root, and its speed limits."""

    start: FloatArray
    goal: FloatArray
    limits: RootLimits

    def __init__(self, start: ArrayLike, goal: ArrayLike, limits: RootLimits | None = None) -> None:
        ends = checked_pose(start, "guide start"), checked_pose(goal, "guide goal")
        vars(self).update(start=ends[0], goal=ends[1], limits=limits or RootLimits())


@dataclass(frozen=True, eq=False)
class GuideResult:
    """A path of the root, or why there is none.

    Attributes:
        milestones: (n, 7) poses that straight ways join, before the spline; None without a way.
        samples: Poses drawn in this search.
        where: ``"start"``, ``"goal"`` or ``"roadmap"``: what the failure is about.
    """

    path: RootPath | None
    milestones: FloatArray | None
    samples: int
    failure: str | None = None
    where: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether a path was found."""
        return self.path is not None


def offline_roadmap(world: GuideWorld, rng: np.random.Generator) -> Roadmap:
    """Roadmap of a world without a task in mind, to be asked many times ([Tonneau2015]_ Algorithm 4)."""
    checker, roadmap = world.checker(), Roadmap(world.roadmap)
    grow(roadmap, PoseSampler(checker, world.region), LocalPlanner(checker), rng, world.roadmap.samples)
    return roadmap


def plan_guide(
    world: GuideWorld, task: GuideTask, rng: np.random.Generator, roadmap: Roadmap | None = None
) -> GuideResult:
    """Plan a path of the root.

    Start and goal become guards of the roadmap, which grows until a way joins them or its budget is
    spent; then the way is pruned, made a spline and shortened.

    Args:
        roadmap: A roadmap of this world to begin with; it is left as it is. Empty when omitted.
    """
    planner = LocalPlanner(world.checker(), (task.start, task.goal))
    unfit = unfit_end(planner, task.start, task.goal)
    if unfit is not None:
        return GuideResult(None, None, 0, unfit.failure, unfit.where)
    growing = Roadmap(world.roadmap) if roadmap is None else roadmap.copy()
    growing.samples = growing.rejected = 0
    route = _search(world, task, growing, planner, rng)
    if route.poses is None:
        return GuideResult(None, None, growing.samples, route.failure, route.where)
    pruned = prune(route.poses, planner)
    path = shorten(approximate(pruned, planner, task.limits, rng), planner, rng)
    return GuideResult(path, pruned, growing.samples)


def _search(
    world: GuideWorld, task: GuideTask, roadmap: Roadmap, planner: LocalPlanner, rng: np.random.Generator
) -> Route:
    """Grow the roadmap until start and goal are joined, and ask it for the way."""
    sampler = PoseSampler(planner.checker, world.region)
    start, goal = (attach(roadmap, pose, planner, rng) for pose in (task.start, task.goal))
    for _ in range(0, world.roadmap.samples, CHUNK):
        if roadmap.joined(start, goal):
            break
        before = roadmap.samples
        grow(roadmap, sampler, planner, rng, CHUNK, PATIENCE * world.roadmap.failures)
        if roadmap.samples == before:
            break
    return find_route(roadmap, planner, start, goal)
