"""Requests to a roadmap: joining start and goal, A*, and why there is no way ([Tonneau2015]_ 6.3.1)."""

import itertools
from dataclasses import dataclass

import networkx as nx
import numpy as np

from manikin.reachability.pose import distance
from manikin.reachability.roadmap import Roadmap
from manikin.reachability.steering import LocalPlanner
from manikin.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Route:
    """Way through a roadmap, or why there is none.

    Attributes:
        poses: (n, 7) poses that straight ways join, from start to goal; None without a way.
        nodes: Nodes of the roadmap along it.
        length: Its length by the distance 6.3.
        failure: None, or the reason.
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

    Args:
        roadmap: The roadmap.
        planner: Knows how ways are joined.
        start: Node.
        goal: Node.
    """
    if not roadmap.joined(start, goal):
        return Route(None, failure=_walled_off(roadmap, start, goal), where="roadmap")
    share = roadmap.settings.position_share

    def estimate(first: int, second: int) -> float:
        return float(distance(roadmap.poses[first], roadmap.poses[second], share))

    nodes = nx.astar_path(roadmap.graph, start, goal, heuristic=estimate, weight="weight")
    pieces = [roadmap.poses[start][None]]
    for a, b in itertools.pairwise(nodes):
        points = planner.waypoints(roadmap.poses[a], roadmap.poses[b], roadmap.way(a, b).turn_at)
        pieces.append(points[1:])
    length = float(nx.path_weight(roadmap.graph, nodes, "weight"))
    return Route(np.vstack(pieces), tuple(nodes), length)


def request(
    roadmap: Roadmap,
    planner: LocalPlanner,
    start: FloatArray,
    goal: FloatArray,
    rng: np.random.Generator,
) -> Route:
    """Ask a roadmap for a way between two poses (7,); the roadmap is left as it is."""
    unfit = unfit_end(planner, start, goal)
    if unfit is not None:
        return unfit
    asked = roadmap.copy()
    first = attach(asked, start, planner, rng)
    last = attach(asked, goal, planner, rng)
    return find_route(asked, planner, first, last)


def _walled_off(roadmap: Roadmap, start: int, goal: int) -> str:
    """Reason in words why no way joins two nodes."""
    here = sorted(nx.node_connected_component(roadmap.graph, start))
    there = sorted(nx.node_connected_component(roadmap.graph, goal))
    places, others = roadmap.poses[here], roadmap.poses[there]
    apart = np.array([distance(others, pose, roadmap.settings.position_share) for pose in places])
    row, column = np.unravel_index(int(np.argmin(apart)), apart.shape)
    closest = [np.round(pose[:3], 2).tolist() for pose in (places[row], others[column])]
    return (
        f"the goal is walled off from the start as far as {roadmap.samples} sampled poses show: "
        f"{len(here)} of {len(roadmap.poses)} poses of the roadmap can be reached from the start and "
        f"{len(there)} from the goal; the closest two are at {closest[0]} m and {closest[1]} m"
    )
