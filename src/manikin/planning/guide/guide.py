"""A guide for the root from start to goal: roadmap, request, spline ([Tonneau2015]_ chapter 6).

Also here. Roadmaps in files, to be used again for the same scene, creature and condition.
"""

import hashlib
from dataclasses import dataclass, field, replace
from pathlib import Path

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.planning.guide.abstraction import Abstraction
from manikin.planning.guide.checker import Margins, ReachabilityChecker
from manikin.planning.guide.condition import Condition
from manikin.planning.guide.roadmap import (
    Roadmap,
    RoadmapSettings,
    Route,
    attach,
    build_roadmap,
    find_route,
    grow,
    unfit_end,
)
from manikin.planning.guide.root_path import (
    RootLimits,
    RootPath,
    ShortcutSettings,
    approximate,
    prune,
    shorten,
)
from manikin.planning.guide.root_pose import checked_pose
from manikin.planning.guide.sampler import PoseSampler, SamplerSettings, SamplingRegion
from manikin.planning.guide.steering import LocalPlanner, Way
from manikin.runtime.files import atomic_path
from manikin.scene.scene import Scene

CHUNK = 10
"""Poses drawn between two looks at whether start and goal are joined."""

PATIENCE = 5
"""Times as many rejections in a row end a search for one task as end an offline roadmap."""


@dataclass(frozen=True)
class GuideSettings:
    """Everything that chapter 6 leaves to its user.

    Attributes:
        margins: What planning keeps in hand.
        sampler: Numbers of Algorithm 3.
        roadmap: Numbers of Algorithm 4; its ``samples`` is the budget of one search.
        shortcut: Numbers of 6.3.2.
    """

    margins: Margins = field(default_factory=Margins)
    sampler: SamplerSettings = field(default_factory=SamplerSettings)
    roadmap: RoadmapSettings = field(default_factory=RoadmapSettings)
    shortcut: ShortcutSettings = field(default_factory=ShortcutSettings)


@dataclass(frozen=True, eq=False)
class GuideWorld:
    """Scene, creature and condition: what a roadmap is about.

    Attributes:
        scene: The obstacles.
        abstraction: The creature.
        region: Where roots are drawn.
        condition: What every pose must satisfy.
        settings: Numbers of the algorithms.
    """

    scene: Scene
    abstraction: Abstraction
    region: SamplingRegion
    condition: Condition = field(default_factory=Condition)
    settings: GuideSettings = field(default_factory=GuideSettings)

    @property
    def key(self) -> str:
        """Digest of everything that decides which poses and ways a roadmap may hold."""
        text = "|".join(
            [
                self.scene.signature,
                self.abstraction.signature,
                self.condition.key,
                self.region.key,
                repr((self.settings.margins, self.settings.sampler, self.settings.roadmap)),
            ]
        )
        return hashlib.sha256(text.encode()).hexdigest()

    def checker(self) -> ReachabilityChecker:
        """Checker with the margins of planning."""
        return ReachabilityChecker(self.abstraction, self.scene, self.condition, self.settings.margins)


@dataclass(frozen=True, eq=False)
class GuideTask:
    """From where to where.

    Attributes:
        start: (7,) pose of the root.
        goal: (7,) pose of the root.
        limits: Speed limits of the path.
    """

    start: FloatArray
    goal: FloatArray
    limits: RootLimits

    def __init__(self, start: ArrayLike, goal: ArrayLike, limits: RootLimits | None = None) -> None:
        object.__setattr__(self, "start", checked_pose(start, "guide start"))
        object.__setattr__(self, "goal", checked_pose(goal, "guide goal"))
        object.__setattr__(self, "limits", limits or RootLimits())


@dataclass(frozen=True)
class GuideStatistics:
    """What a search did.

    Attributes:
        samples: Poses drawn in this search.
        nodes: Nodes of the roadmap at the end.
        parts: Parts of it that no way joins.
        asked: Poses decided about.
        route_poses: Poses of the way through the roadmap.
        pruned_poses: Poses of it that pruning left.
        control_poses: Control poses of the path.
        restart: Number of the restart that this is the result of.
    """

    samples: int = 0
    nodes: int = 0
    parts: int = 0
    asked: int = 0
    route_poses: int = 0
    pruned_poses: int = 0
    control_poses: int = 0
    restart: int = 0


@dataclass(frozen=True, eq=False)
class GuideResult:
    """A path of the root, or why there is none.

    Attributes:
        path: The path, or None.
        milestones: (n, 7) poses that straight ways join, before the spline; None without a way.
        statistics: What the search did.
        failure: None, or the reason.
        where: ``"start"``, ``"goal"`` or ``"roadmap"``: what the failure is about.
    """

    path: RootPath | None
    milestones: FloatArray | None
    statistics: GuideStatistics
    failure: str | None = None
    where: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether a path was found."""
        return self.path is not None


def offline_roadmap(world: GuideWorld, rng: np.random.Generator) -> Roadmap:
    """Roadmap of a world without a task in mind, to be asked many times."""
    checker = world.checker()
    sampler = PoseSampler(checker, world.region, world.settings.sampler)
    return build_roadmap(sampler, LocalPlanner(checker), rng, world.settings.roadmap)


def plan_guide(
    world: GuideWorld,
    task: GuideTask,
    rng: np.random.Generator,
    roadmap: Roadmap | None = None,
) -> GuideResult:
    """Plan a path of the root.

    Start and goal become guards of the roadmap, which grows until a way joins them or its budget is
    spent; then the way is pruned, made a spline and shortened.

    Args:
        world: Scene, creature and condition.
        task: Start, goal and speed limits.
        rng: Source of all randomness.
        roadmap: A roadmap of this world to begin with; it is left as it is. Empty when omitted.
    """
    checker = world.checker()
    planner = LocalPlanner(checker, (task.start, task.goal))
    unfit = unfit_end(planner, task.start, task.goal)
    if unfit is not None:
        return _failed(unfit, GuideStatistics(asked=planner.asked))
    growing = Roadmap(world.settings.roadmap) if roadmap is None else roadmap.copy()
    growing.samples = growing.rejected = 0
    route = _search(world, task, growing, planner, rng)
    statistics = GuideStatistics(growing.samples, len(growing.poses), len(growing.components), planner.asked)
    if route.poses is None:
        return _failed(route, statistics)
    pruned = prune(route.poses, planner)
    shortcuts = world.settings.shortcut
    path = shorten(approximate(pruned, planner, task.limits, rng, shortcuts), planner, rng, shortcuts)
    counted = replace(
        statistics,
        asked=planner.asked,
        route_poses=len(route.poses),
        pruned_poses=len(pruned),
        control_poses=len(path.control_points),
    )
    return GuideResult(path, pruned, counted)


def _search(
    world: GuideWorld,
    task: GuideTask,
    roadmap: Roadmap,
    planner: LocalPlanner,
    rng: np.random.Generator,
) -> Route:
    """Grow the roadmap until start and goal are joined, and ask it for the way."""
    sampler = PoseSampler(planner.checker, world.region, world.settings.sampler)
    start = attach(roadmap, task.start, planner, rng)
    goal = attach(roadmap, task.goal, planner, rng)
    budget = world.settings.roadmap.samples
    for _ in range(0, budget, CHUNK):
        if roadmap.joined(start, goal):
            break
        before = roadmap.samples
        grow(roadmap, sampler, planner, rng, CHUNK, PATIENCE * world.settings.roadmap.failures)
        if roadmap.samples == before:
            break
    return find_route(roadmap, planner, start, goal)


def _failed(route: Route, statistics: GuideStatistics) -> GuideResult:
    return GuideResult(None, None, statistics, route.failure, route.where)


FORMAT = "manikin-roadmap-1"
_STRAIGHT = -1.0  # stands for "no turn on the spot" in the file


def save_roadmap(path: str | Path, roadmap: Roadmap, world: GuideWorld) -> None:
    """Write a roadmap and the digest of its world into a NumPy archive (``.npz``).

    Raises:
        OSError: If the folder cannot be written to.
    """
    edges = sorted((min(edge), max(edge)) for edge in roadmap.graph.edges)
    turns = [roadmap.way(a, b).turn_at for a, b in edges]
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            format=np.array(FORMAT),
            key=np.array(world.key),
            poses=roadmap.poses,
            guard=np.array([roadmap.graph.nodes[node]["guard"] for node in range(len(roadmap.poses))], bool),
            edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
            turn_at=np.array([_STRAIGHT if turn is None else turn for turn in turns], dtype=np.float64),
            counts=np.array([roadmap.samples, roadmap.rejected]),
        )


def load_roadmap(path: str | Path, world: GuideWorld) -> Roadmap | None:
    """Read a roadmap back.

    Args:
        path: File written by :func:`save_roadmap`.
        world: What it should be about.

    Returns:
        None if the file is about another scene, creature, condition or setting.

    Raises:
        InputError: If the file is missing or holds no roadmap.
    """
    file = Path(path)
    try:
        with np.load(file, allow_pickle=False) as archive:
            values = {name: archive[name] for name in archive.files}
        if str(values["format"]) != FORMAT:
            raise ValueError(f"format {values['format']}")
        if str(values["key"]) != world.key:
            return None
        return _roadmap(world, values)
    except FileNotFoundError:
        raise InputError(f"roadmap file '{file}' does not exist; valid: a file of save_roadmap") from None
    except (OSError, ValueError, KeyError, EOFError) as error:
        reason = " ".join(str(error).split())[:100]
        raise InputError(
            f"roadmap file '{file}' cannot be read ({reason}); valid: a file of save_roadmap"
        ) from None


def roadmap_for(path: str | Path, world: GuideWorld, rng: np.random.Generator) -> Roadmap:
    """Roadmap of a world from its file, or made now and written there.

    A file about another world is replaced.

    Raises:
        InputError: If the file exists and holds no roadmap.
        OSError: If the folder cannot be written to.
    """
    found = load_roadmap(path, world) if Path(path).exists() else None
    if found is None:
        found = offline_roadmap(world, rng)
        save_roadmap(path, found, world)
    return found


def _roadmap(world: GuideWorld, values: dict[str, np.ndarray]) -> Roadmap:
    roadmap = Roadmap(world.settings.roadmap, nx.Graph())
    for pose, guard in zip(values["poses"], values["guard"], strict=True):
        roadmap.add(pose, guard=bool(guard))
    for (first, second), turn in zip(values["edges"], values["turn_at"], strict=True):
        way = Way(None if turn == _STRAIGHT else float(turn))
        roadmap.join(int(first), int(second), way)
    roadmap.samples, roadmap.rejected = (int(count) for count in values["counts"])
    return roadmap
