"""Bidirectional RRT of a flying effector in configuration-time space ([Qiu2012]_ 6.2.4).

Two trees grow from the poses at lift-off (forwards in time) and touch-down (backwards), alternately, until an
edge joins them.  A node is a pose and an instant; an edge is a straight flight with a shortest turn.
Algorithms 4 and 5 are corrected: the speed limits are checked towards the sampled point, whose direction the
candidate keeps, and a candidate whose edge fails a check is not added.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.swing import SwingLimits
from manikin.planning.whole_body.swing_path import EffectorPath, Pose, metric

Feasible = Callable[[Pose, float, Any], Any]
"""``feasible(pose, time, hint) -> hint``: None when no posture exists there, otherwise anything
(such as the posture found) that is handed back with the neighbouring question for a warm start."""

RESOLUTION, STEP, CONNECT = 0.05, 0.2, 0.5
"""Metric distance between two checked points of an edge, and largest metric lengths of a new edge (d_lim) and
of the one that joins the trees."""

MARGIN, ABOVE, SPREAD = 0.3, 0.5, 0.2
"""Poses are drawn from the box around both ends, with these added to each side and above [m], and turned away
from the shortest turn between the ends by up to this about each axis [rad]."""


def slow_enough(
    limits: SwingLimits, distance: FloatArray, angle: FloatArray, duration: FloatArray
) -> NDArray[np.bool_]:
    """CHECK-VELOCITY: whether edges keep both speed limits on average ([Qiu2012]_ 6.7, 6.8), elementwise."""
    kept = (distance <= limits.speed * duration) & (angle <= limits.angular_speed * duration)
    return (duration > 0.0) & kept


@dataclass(frozen=True, eq=False)
class BiRrtResult:
    """Path found, with what the feasibility check returned at each of its nodes, or why there is none."""

    path: EffectorPath | None
    hints: tuple[Any, ...]
    failure: str | None = None


def plan_flight(
    start: Pose, goal: Pose, start_time: float, end_time: float, feasible: Feasible,
    rng: np.random.Generator, *, limits: SwingLimits, iterations: int = 2000,
) -> BiRrtResult:  # fmt: skip
    """Search a path of an effector between two timed poses.

    Args:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        feasible: CHECK-PG: whether a posture exists with the effector at a pose and time.
        limits: Speed limits, of the average along an edge.
        iterations: Largest number of random points (n_it).

    Raises:
        InputError: If the end is not after the start.
    """
    if end_time <= start_time:
        raise InputError(f"flight ends at {end_time} s; valid: after its start at {start_time} s")
    search = _Search((start, goal), (start_time, end_time), feasible, limits, iterations)
    failure = search.plant()
    for _ in range(0 if failure else iterations):
        joint = search.grow(rng)
        if joint is not None:
            return BiRrtResult(*search.path(*joint))
    return BiRrtResult(None, (), failure or search.explain(iterations))


def walk(feasible: Feasible, edge: EffectorPath, hint: Any, *, backwards: bool = False) -> Any:
    """CHECK-PG of an edge of two nodes: the hint at its far end, or None where a point has no posture.

    The node the walk sets out from, the last when backwards in time, has ``hint`` and is not asked again.
    """
    count = max(1, int(np.ceil(edge.length / RESOLUTION)))
    shares = np.arange(1, count + 1) / count
    times = edge.time[0] + edge.duration * (1.0 - shares if backwards else shares)
    for time, position, rotation in zip(times, *edge.sample(times), strict=True):
        hint = feasible(Pose(position, rotation), float(time), hint)
        if hint is None:
            break
    return hint


class _Tree:
    """Nodes of one tree: position, quaternion and time in a row; ``direction`` is -1 backwards in time."""

    def __init__(self, direction: int, most: int) -> None:
        self.direction, self._rows = direction, np.empty((most, 8))
        self.parent: list[int] = []
        self.hint: list[Any] = []

    @property
    def nodes(self) -> FloatArray:
        """(n, 8) nodes."""
        return self._rows[: len(self.parent)]

    def add(self, node: FloatArray, parent: int, hint: Any) -> int:
        self._rows[len(self.parent)] = node
        self.parent.append(parent)
        self.hint.append(hint)
        return len(self.parent) - 1

    def apart(self, node: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance, angle and time still to go from each node to another (negative time: too late)."""
        distance = np.linalg.norm(self.nodes[:, :3] - node[:3], axis=1)
        angle = 2.0 * np.arccos(np.minimum(np.abs(self.nodes[:, 3:7] @ node[3:7]), 1.0))
        return distance, angle, self.direction * (node[7] - self.nodes[:, 7])

    def branch(self, index: int) -> list[tuple[FloatArray, Any]]:
        """Nodes with their hints from one to the root."""
        line = []
        while index >= 0:
            line.append((self.nodes[index], self.hint[index]))
            index = self.parent[index]
        return line


class _Search:
    """State of one search: the two trees and the counters."""

    def __init__(
        self, ends: tuple[Pose, Pose], times: tuple[float, float], feasible: Feasible, limits: SwingLimits,
        iterations: int,
    ) -> None:  # fmt: skip
        self.ends, self.times, self.feasible, self.limits = ends, times, feasible, limits
        self.trees = _Tree(1, iterations + 1), _Tree(-1, iterations + 1)
        self.turn = Rotation.from_matrix(ends[0].rotation.T @ ends[1].rotation).as_rotvec()
        self.too_fast = self.infeasible = 0
        self.gap = np.inf

    def plant(self) -> str | None:
        """Set the roots; returns why the search is hopeless, or None."""
        duration = self.times[1] - self.times[0]
        distance = float(np.linalg.norm(self.ends[1].position - self.ends[0].position))
        angle = float(np.linalg.norm(self.turn))
        need = max(distance / self.limits.speed, angle / self.limits.angular_speed)
        if need > duration:
            return (
                f"the window of {duration:.3f} s is too short: {distance:.3f} m and {angle:.3f} rad need "
                f"at least {need:.3f} s at {self.limits.speed:g} m/s and {self.limits.angular_speed:g} rad/s"
            )
        for name, tree, pose, time in zip(("start", "goal"), self.trees, self.ends, self.times, strict=True):
            found = self.feasible(pose, time, None)
            if found is None:
                return f"the {name} pose at t = {time:.3f} s has no feasible posture"
            tree.add(_node(pose.position, pose.rotation, time), -1, found)
        return None

    def grow(self, rng: np.random.Generator) -> tuple[int, int] | None:
        """One iteration of Algorithm 4: expand both trees towards a random point."""
        node = self._random_node(rng)
        for tree, other in (self.trees, self.trees[::-1]):
            index = self._expand(tree, node)
            match = None if index is None else self._join(tree, index, other)
            if index is not None and match is not None:
                return (index, match) if tree is self.trees[0] else (match, index)
        return None

    def _random_node(self, rng: np.random.Generator) -> FloatArray:
        """Random pose and time inside the zone, within reach of both roots if one is drawn soon."""
        first, last = self.times
        places = np.stack([end.position for end in self.ends])
        lower = places.min(axis=0) - np.array([MARGIN, MARGIN, 0.0])
        upper = places.max(axis=0) + np.array([MARGIN, MARGIN, ABOVE])
        for _ in range(50):
            share = rng.uniform()
            position = rng.uniform(lower, upper)
            tilt = rng.uniform(-1.0, 1.0, 3) * SPREAD
            time = first + share * (last - first)
            reach = self.limits.speed * np.array([time - first, last - time])
            if np.all(np.linalg.norm(position - places, axis=1) <= reach):
                break
        turned = self.ends[0].rotation @ Rotation.from_rotvec(share * self.turn).as_matrix()
        return _node(position, turned @ Rotation.from_rotvec(tilt).as_matrix(), time)

    def _expand(self, tree: _Tree, node: FloatArray) -> int | None:
        """Algorithm 5: a new node towards a point, or None."""
        apart = tree.apart(node)
        allowed = slow_enough(self.limits, *apart)
        if not np.any(allowed):
            self.too_fast += 1
            return None
        away = np.where(allowed, metric(*apart), np.inf)
        near = int(np.argmin(away))
        edge = self._edge(tree, near, node, min(1.0, STEP / away[near]))
        hint = walk(self.feasible, edge, tree.hint[near], backwards=tree.direction < 0)
        if hint is None:
            self.infeasible += 1
            return None
        end = -1 if tree.direction > 0 else 0
        return tree.add(_node(edge.position[end], edge.rotation[end], float(edge.time[end])), near, hint)

    def _edge(self, tree: _Tree, near: int, node: FloatArray, share: float) -> EffectorPath:
        """LIMIT-METRIC: the first ``share`` of the edge from a node to another, in the order of time."""
        first = tree.nodes[near]
        last = first + share * (node - first)
        from_rotation = Rotation.from_quat(first[3:7])
        turn = (from_rotation.inv() * Rotation.from_quat(node[3:7])).as_rotvec()
        to_rotation = from_rotation * Rotation.from_rotvec(share * turn)
        rotations = np.stack([from_rotation.as_matrix(), to_rotation.as_matrix()])
        nodes, order = np.stack([first, last]), slice(None, None, tree.direction)
        return EffectorPath(nodes[order, 7], nodes[order, :3], rotations[order])

    def _join(self, tree: _Tree, index: int, other: _Tree) -> int | None:
        """IS-CONNECTED: the node of the other tree to which a checked edge leads, or None."""
        apart = other.apart(tree.nodes[index])
        away = np.where(slow_enough(self.limits, *apart), metric(*apart), np.inf)
        self.gap = min(self.gap, float(away.min()))
        for match in np.argsort(away, kind="stable")[:3]:
            if not away[match] <= CONNECT:
                break
            edge = self._edge(tree, index, other.nodes[match], 1.0)
            if walk(self.feasible, edge, tree.hint[index], backwards=tree.direction < 0) is not None:
                return int(match)
            self.infeasible += 1
        return None

    def path(self, forward: int, backward: int) -> tuple[EffectorPath, tuple[Any, ...]]:
        """CONSTRUCT-PATH: from the first root through the joint to the second root."""
        nodes, hints = zip(*self.trees[0].branch(forward)[::-1], *self.trees[1].branch(backward), strict=True)
        rows = np.array(nodes)
        path = EffectorPath(rows[:, 7], rows[:, :3], Rotation.from_quat(rows[:, 3:7]).as_matrix())
        return path, hints

    def explain(self, iterations: int) -> str:
        """Reason why the iterations were not enough."""
        first, second = (len(tree.parent) for tree in self.trees)
        return (
            f"no path in {iterations} iterations: trees of {first} and {second} nodes stay "
            f"{self.gap:.3f} apart (may join below {CONNECT:g}); {self.too_fast} expansions were beyond "
            f"the speed limits and {self.infeasible} edges had no feasible posture"
        )


def _node(position: FloatArray, rotation: FloatArray, time: float) -> FloatArray:
    return np.concatenate([position, Rotation.from_matrix(rotation).as_quat(), [time]])
