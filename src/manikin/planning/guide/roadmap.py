"""Visibility roadmaps of root poses ([Tonneau2015]_ Algorithm 4, corrected).

A pose that sees no guard becomes a guard; one that sees guards of several parts of the roadmap joins them;
any other is rejected. (In print every pose becomes a guard, as the visible one is not remembered.) A request
joins start and goal and finds the shortest way by A*, or says why there is none ([Tonneau2015]_ 6.3.1).
"""

import itertools
from copy import deepcopy
from dataclasses import dataclass, field, replace

import networkx as nx
import numpy as np
from networkx.utils import UnionFind

from manikin.numerics.spatial import FloatArray, finite_number
from manikin.planning.guide.root_pose import distance
from manikin.planning.guide.sampler import PoseSampler
from manikin.planning.guide.steering import LocalPlanner, Way


@dataclass(frozen=True)
class RoadmapSettings:
    """The numbers that Algorithm 4 leaves to its user; all are our choice.

    Attributes:
        failures: m, poses rejected in a row that end the construction.
        samples: Largest number of poses drawn.
        nearest: Guards asked for each pose, the nearest ones; the thesis asks all.
        farthest: Guards farther than this are not asked.
    """

    failures: int = 50
    samples: int = 1500
    nearest: int = 15
    farthest: float = 2.5

    def __post_init__(self) -> None:
        for name in ("failures", "samples", "nearest"):
            finite_number(getattr(self, name), f"roadmap {name}", at_least=1)
        finite_number(self.farthest, "roadmap farthest", above=0.0)


@dataclass
class Roadmap:
    """Poses and the ways between them.

    Attributes:
        graph: Nodes 0, 1, ... with ``guard`` (bool); edges with ``weight``, the distance 6.3, and
            ``turn_at``, the share at which the root turns on the spot seen from the node of the
            smaller number, or None for a straight way.
        samples: Poses drawn so far.
        rejected: Poses rejected in a row at the end.
    """

    settings: RoadmapSettings = field(default_factory=RoadmapSettings)
    graph: nx.Graph = field(default_factory=nx.Graph)
    samples: int = 0
    rejected: int = 0
    _poses: FloatArray = field(default_factory=lambda: np.empty((64, 7)))
    _parts: UnionFind = field(default_factory=UnionFind)

    @property
    def poses(self) -> FloatArray:
        """(n, 7) the nodes' poses."""
        return self._poses[: len(self.graph)]

    def copy(self) -> "Roadmap":
        """A copy that can grow without changing this one."""
        return replace(self, graph=self.graph.copy(), _poses=self._poses.copy(), _parts=deepcopy(self._parts))

    def joined(self, first: int, second: int) -> bool:
        """Whether two nodes lie in one part."""
        return self._parts[first] == self._parts[second]

    def nearest_nodes(self, pose: FloatArray, *, guards_only: bool) -> list[int]:
        """Nodes near a pose (7,), the nearest first, as many as the settings allow."""
        away, nodes = distance(self.poses, pose), self.graph.nodes
        order = np.argsort(away, kind="stable")
        near = map(int, order[away[order] <= self.settings.farthest])
        return [n for n in near if not guards_only or nodes[n]["guard"]][: self.settings.nearest]

    def add(self, pose: FloatArray, *, guard: bool) -> int:
        """Add a node and return its number."""
        node = len(self.graph)
        if node == len(self._poses):
            self._poses = np.concatenate([self._poses, np.empty_like(self._poses)])
        self._poses[node] = pose
        self.graph.add_node(node, guard=guard)
        return node

    def join(self, first: int, second: int, way: Way) -> None:
        """Add a way between two nodes, seen from the first."""
        weight = float(distance(self.poses[first], self.poses[second]))
        seen = way if first < second else way.reversed()
        self.graph.add_edge(first, second, weight=weight, turn_at=seen.turn_at)
        self._parts.union(first, second)

    def way(self, first: int, second: int) -> Way:
        """The way of an edge, seen from the first node."""
        way = Way(self.graph.edges[first, second]["turn_at"])
        return way if first < second else way.reversed()

    def consider(self, pose: FloatArray, planner: LocalPlanner, rng: np.random.Generator) -> bool:
        """One pass of Algorithm 4: whether a pose (7,) is kept, as a guard or as a connection."""
        seen: dict[int, tuple[int, Way]] = {}
        for node in self.nearest_nodes(pose, guards_only=True):
            part = self._parts[node]
            if part not in seen:
                way = planner.connect(pose, self.poses[node], float(rng.uniform()))
                if way is not None:
                    seen[part] = (node, way)
        if len(seen) == 1:
            self.rejected += 1
            return False
        self.rejected = 0
        new = self.add(pose, guard=not seen)
        for node, way in seen.values():
            self.join(new, node, way)
        return True


def grow(
    roadmap: Roadmap, sampler: PoseSampler, planner: LocalPlanner, rng: np.random.Generator, samples: int,
    failures: int | None = None,
) -> None:  # fmt: skip
    """Draw poses and let the roadmap consider them, at most ``samples`` and those of the settings.

    It ends earlier when so many were rejected in a row (``failures``, the settings' when omitted).
    """
    most = roadmap.settings.failures if failures is None else failures
    for _ in range(samples):
        if roadmap.rejected >= most or roadmap.samples >= roadmap.settings.samples:
            return
        roadmap.samples += 1
        pose = sampler.draw(rng)
        if pose is None:
            roadmap.rejected += 1
        else:
            roadmap.consider(pose, planner, rng)


@dataclass(frozen=True, eq=False)
class Route:
    """Way through a roadmap, or why there is none.

    Attributes:
        poses: (n, 7) poses that straight ways join, from start to goal; None without a way.
        nodes: Nodes of the roadmap along it.
        length: Its length by the distance 6.3.
        where: ``"start"``, ``"goal"`` or ``"roadmap"``: what the failure is about.
    """

    poses: FloatArray | None
    nodes: tuple[int, ...] = ()
    length: float = float("inf")
    failure: str | None = None
    where: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether there is a way."""
        return self.poses is not None


def unfit_end(planner: LocalPlanner, start: FloatArray, goal: FloatArray) -> Route | None:
    """Failure that says why the start or the goal does not satisfy the condition, or None."""
    for name, pose in (("start", start), ("goal", goal)):
        reason = planner.plain.explain(pose)
        if reason is not None:
            return Route(None, failure=f"the {name} does not satisfy the condition: {reason}", where=name)
    return None


def attach(roadmap: Roadmap, pose: FloatArray, planner: LocalPlanner, rng: np.random.Generator) -> int:
    """Add a pose (7,) as a guard with ways to every node in sight, and return its number."""
    near = roadmap.nearest_nodes(pose, guards_only=False)
    node = roadmap.add(pose, guard=True)
    for other in near:
        way = planner.connect(pose, roadmap.poses[other], float(rng.uniform()))
        if way is not None:
            roadmap.join(node, other, way)
    return node


def find_route(roadmap: Roadmap, planner: LocalPlanner, start: int, goal: int) -> Route:
    """Shortest way between two nodes (Algorithm 5, A*), its straight parts spelled out.

    The estimate is the distance 6.3 itself, which never overestimates, because it is a metric.
    """
    if not roadmap.joined(start, goal):
        return Route(None, failure=_walled_off(roadmap, start, goal), where="roadmap")
    poses = roadmap.poses
    nodes = nx.astar_path(roadmap.graph, start, goal, lambda a, b: float(distance(poses[a], poses[b])))
    pieces = [poses[start][None]]
    for a, b in itertools.pairwise(nodes):
        pieces.append(planner.waypoints(poses[a], poses[b], roadmap.way(a, b).turn_at)[1:])
    length = float(nx.path_weight(roadmap.graph, nodes, "weight"))
    return Route(np.vstack(pieces), tuple(nodes), length)


def request(
    roadmap: Roadmap, planner: LocalPlanner, start: FloatArray, goal: FloatArray, rng: np.random.Generator
) -> Route:
    """Ask a roadmap for a way between two poses (7,); the roadmap is left as it is."""
    unfit = unfit_end(planner, start, goal)
    if unfit is not None:
        return unfit
    asked = roadmap.copy()
    first, last = (attach(asked, pose, planner, rng) for pose in (start, goal))
    return find_route(asked, planner, first, last)


def _walled_off(roadmap: Roadmap, start: int, goal: int) -> str:
    """Reason in words why no way joins two nodes."""
    from_start, from_goal = (sorted(nx.node_connected_component(roadmap.graph, end)) for end in (start, goal))
    places, others = roadmap.poses[from_start], roadmap.poses[from_goal]
    apart = np.array([distance(others, pose) for pose in places])
    row, column = np.unravel_index(int(np.argmin(apart)), apart.shape)
    closest = [np.round(pose[:3], 2).tolist() for pose in (places[row], others[column])]
    return (
        f"the goal is walled off from the start as far as {roadmap.samples} sampled poses show: "
        f"{len(from_start)} of {len(roadmap.poses)} poses of the roadmap can be reached from the start and "
        f"{len(from_goal)} from the goal; the closest two are at {closest[0]} m and {closest[1]} m"
    )
