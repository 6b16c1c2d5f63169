"""Bidirectional RRT of a flying effector in configuration-time space ([Qiu2012]_ 6.2.4).

Two trees grow from the pose at lift-off (forwards in time) and the pose at touch-down
(backwards in time), alternately, until an edge joins them.  A node is a pose and an
instant; an edge is a straight flight with a shortest turn.  Algorithms 4 and 5 are
corrected: the speed limits are checked towards the sampled point, whose direction the
candidate keeps, and a candidate whose edge fails a check is not added.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.planning.whole_body.swing_path import EffectorPath, Metric, Pose

Feasible = Callable[[Pose, float, Any], Any]
"""``feasible(pose, time, hint) -> hint``: None when no posture exists there, otherwise anything
(such as the posture found) that is handed back with the neighbouring question for a warm start."""


@dataclass(frozen=True)
class FlightLimits:
    """Limits of the average velocity along an edge, and how densely edges are checked.

    Attributes:
        speed: Largest linear speed [m/s] ([Qiu2012]_ 6.7).
        angular_speed: Largest angular speed [rad/s] ([Qiu2012]_ 6.8).
        metric: Distance in configuration-time space.
        resolution: Metric distance between two checked points of an edge.
    """

    speed: float = 2.0
    angular_speed: float = 5.0
    metric: Metric = field(default_factory=Metric)
    resolution: float = 0.05

    def __post_init__(self) -> None:
        finite_number(self.speed, "flight limits speed [m/s]", above=0.0)
        finite_number(self.angular_speed, "flight limits angular_speed [rad/s]", above=0.0)
        finite_number(self.resolution, "flight limits resolution", above=0.0)


@dataclass(frozen=True, eq=False)
class SamplingZone:
    """Box of positions and range of turns in which random poses are drawn.

    Attributes:
        lower: (3,) lower corner of the box of positions [m].
        upper: (3,) upper corner [m].
        rotation_spread: (3,) largest random turn away from the shortest turn between the ends,
            about the effector's own axes [rad]; one number for all three.
    """

    lower: FloatArray
    upper: FloatArray
    rotation_spread: FloatArray | float = 0.2

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", frozen_array(self.lower, "sampling zone lower [m]", (3,)))
        object.__setattr__(self, "upper", frozen_array(self.upper, "sampling zone upper [m]", (3,)))
        spread = np.broadcast_to(np.asarray(self.rotation_spread, dtype=np.float64), (3,))
        object.__setattr__(
            self, "rotation_spread", frozen_array(spread, "sampling zone rotation_spread [rad]", (3,))
        )
        if not np.all(self.lower <= self.upper):
            raise InputError(
                f"sampling zone spans {self.lower.tolist()} to {self.upper.tolist()}; valid: lower <= upper"
            )

    @classmethod
    def around(
        cls,
        start: Pose,
        goal: Pose,
        margin: float = 0.3,
        above: float = 0.5,
        rotation_spread: FloatArray | float = 0.2,
    ) -> "SamplingZone":
        """Box around the two ends: ``margin`` to each side and below, ``above`` higher [m]."""
        ends = np.stack([start.position, goal.position])
        more = np.array([margin, margin, above])
        less = np.array([margin, margin, 0.0])
        return cls(ends.min(axis=0) - less, ends.max(axis=0) + more, rotation_spread)


@dataclass(frozen=True)
class BiRrtStatistics:
    """Counts of a search.

    Attributes:
        iterations: Random points drawn.
        too_fast: Expansions given up because no node could reach the point within the speed limits.
        infeasible: Edges rejected because a point on them had no posture.
        connections: Edges between the trees that were tried.
        checks: Calls of the feasibility check.
        nodes: Nodes of the forward and of the backward tree.
        gap: Smallest metric distance of two nodes of the two trees that may be joined in time.
    """

    iterations: int = 0
    too_fast: int = 0
    infeasible: int = 0
    connections: int = 0
    checks: int = 0
    nodes: tuple[int, int] = (0, 0)
    gap: float = float("inf")


@dataclass(frozen=True, eq=False)
class BiRrtResult:
    """Path found, or why none was.

    Attributes:
        hints: What the feasibility check returned at each node of the path.
    """

    path: EffectorPath | None
    hints: tuple[Any, ...]
    statistics: BiRrtStatistics
    failure: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether a path was found."""
        return self.path is not None


def plan_flight(
    start: Pose, goal: Pose, start_time: float, end_time: float, feasible: Feasible,
    rng: np.random.Generator, *, limits: FlightLimits | None = None, zone: SamplingZone | None = None,
    iterations: int = 2000, step: float = 0.2, connect: float = 0.5, start_hint: Any = None,
    goal_hint: Any = None,
) -> BiRrtResult:  # fmt: skip
    """Search a path of an effector between two timed poses.

    Args:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        feasible: CHECK-PG: whether a posture exists with the effector at a pose and time.
        limits: Speed limits, metric and density of the checks.
        zone: Where poses are drawn; around the two ends when omitted.
        iterations: Largest number of random points (n_it).
        step: Largest metric length of a new edge (d_lim).
        connect: Largest metric length of the edge that joins the trees.
        start_hint: Handed to the first check at the start.
        goal_hint: Handed to the first check at the goal.

    Raises:
        InputError: If the end is not after the start.
    """
    if end_time <= start_time:
        raise InputError(f"flight ends at {end_time} s; valid: after its start at {start_time} s")
    search = _Search(
        start, goal, start_time, end_time, feasible, limits or FlightLimits(),
        zone or SamplingZone.around(start, goal), step, connect,
    )  # fmt: skip
    failure = search.plant(start_hint, goal_hint)
    if failure:
        return BiRrtResult(None, (), search.statistics(), failure)
    for _ in range(iterations):
        joint = search.grow(rng)
        if joint is not None:
            path, hints = search.path(*joint)
            return BiRrtResult(path, hints, search.statistics())
    return BiRrtResult(None, (), search.statistics(), search.explain())


class EdgeChecker:
    """CHECK-VELOCITY and CHECK-PG of a straight edge, counting its questions."""

    def __init__(self, feasible: Feasible, limits: FlightLimits) -> None:
        self.feasible = feasible
        self.limits = limits
        self.checks = 0

    def ask(self, pose: Pose, time: float, hint: Any) -> Any:
        """Ask for one posture."""
        self.checks += 1
        return self.feasible(pose, time, hint)

    def slow_enough(self, distance: FloatArray, angle: FloatArray, duration: FloatArray) -> NDArray[np.bool_]:
        """Whether each edge keeps both speed limits and advances in time."""
        return (
            (duration > 0.0)
            & (distance <= self.limits.speed * duration)
            & (angle <= self.limits.angular_speed * duration)
        )

    def walk(self, edge: EffectorPath, hint: Any, *, backwards: bool = False) -> list[Any] | None:
        """Hints at the checked points of a straight edge, or None when one has no posture.

        The end the walk sets out from is not asked again; the one it arrives at is.

        Args:
            edge: A path of two nodes.
            hint: Hint at the node the walk sets out from: the first, or the last when backwards.
            backwards: Walk against the time.
        """
        count = max(1, int(np.ceil(edge.length(self.limits.metric) / self.limits.resolution)))
        shares = np.arange(1, count + 1) / count
        times = edge.time[0] + edge.duration * (1.0 - shares if backwards else shares)
        position, rotation = edge.sample(times)
        hints: list[Any] = []
        for k, time in enumerate(times):
            hint = self.ask(Pose(position[k], rotation[k]), float(time), hint)
            if hint is None:
                return None
            hints.append(hint)
        return hints


class _Tree:
    """Nodes of one tree in growing arrays; ``direction`` is +1 forwards and -1 backwards in time."""

    def __init__(self, direction: int) -> None:
        self.direction = direction
        self.count = 0
        self.position = np.empty((64, 3))
        self.quaternion = np.empty((64, 4))
        self.time = np.empty(64)
        self.parent: list[int] = []
        self.hint: list[Any] = []

    def add(self, position: FloatArray, quaternion: FloatArray, time: float, parent: int, hint: Any) -> int:
        if self.count == len(self.time):
            for name in ("position", "quaternion", "time"):
                array = getattr(self, name)
                setattr(self, name, np.concatenate([array, np.empty_like(array)]))
        index = self.count
        self.position[index], self.quaternion[index], self.time[index] = position, quaternion, time
        self.parent.append(parent)
        self.hint.append(hint)
        self.count += 1
        return index

    def apart(
        self, position: FloatArray, quaternion: FloatArray, time: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distance, angle and time still to go from each node to a point (negative time: too late)."""
        n = self.count
        distance = np.linalg.norm(self.position[:n] - position, axis=1)
        angle = 2.0 * np.arccos(np.minimum(np.abs(self.quaternion[:n] @ quaternion), 1.0))
        return distance, angle, self.direction * (time - self.time[:n])

    def branch(self, index: int) -> list[int]:
        """Indices from a node to the root."""
        line = [index]
        while self.parent[line[-1]] >= 0:
            line.append(self.parent[line[-1]])
        return line


class _Search:
    """State of one search: the two trees and the counters."""

    def __init__(
        self, start: Pose, goal: Pose, start_time: float, end_time: float, feasible: Feasible,
        limits: FlightLimits, zone: SamplingZone, step: float, connect: float,
    ) -> None:  # fmt: skip
        self.ends = (start, goal)
        self.times = (start_time, end_time)
        self.limits = limits
        self.zone = zone
        self.step = finite_number(step, "flight step", above=0.0)
        self.connect = finite_number(connect, "flight connect", above=0.0)
        self.checker = EdgeChecker(feasible, limits)
        self.trees = (_Tree(1), _Tree(-1))
        self.turn = Rotation.from_matrix(start.rotation.T @ goal.rotation).as_rotvec()
        self.iterations = self.too_fast = self.infeasible = self.connections = 0
        self.gap = np.inf

    def plant(self, start_hint: Any, goal_hint: Any) -> str | None:
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
        for name, tree, pose, time, hint in zip(
            ("start", "goal"), self.trees, self.ends, self.times, (start_hint, goal_hint), strict=True
        ):
            found = self.checker.ask(pose, time, hint)
            if found is None:
                return f"the {name} pose at t = {time:.3f} s has no feasible posture"
            tree.add(pose.position, _quaternion(pose.rotation), time, -1, found)
        return None

    def grow(self, rng: np.random.Generator) -> tuple[int, int] | None:
        """One iteration of Algorithm 4: expand both trees towards a random point."""
        self.iterations += 1
        position, quaternion, time = self._random_point(rng)
        for tree, other in (self.trees, self.trees[::-1]):
            index = self._expand(tree, position, quaternion, time)
            if index is None:
                continue
            match = self._join(tree, index, other)
            if match is not None:
                return (index, match) if tree is self.trees[0] else (match, index)
        return None

    def _random_point(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, float]:
        """Random pose and time inside the zone, within reach of both roots if one is drawn soon."""
        zone, (first, last) = self.zone, self.times
        for _ in range(50):
            share = rng.uniform()
            position = rng.uniform(zone.lower, zone.upper)
            tilt = rng.uniform(-1.0, 1.0, 3) * zone.rotation_spread
            time = first + share * (last - first)
            reach = self.limits.speed * np.array([time - first, last - time])
            away = [float(np.linalg.norm(position - end.position)) for end in self.ends]
            if np.all(away <= reach):
                break
        turned = self.ends[0].rotation @ Rotation.from_rotvec(share * self.turn).as_matrix()
        return position, _quaternion(turned @ Rotation.from_rotvec(tilt).as_matrix()), time

    def _expand(self, tree: _Tree, position: FloatArray, quaternion: FloatArray, time: float) -> int | None:
        """Algorithm 5: a new node towards a point, or None."""
        distance, angle, duration = tree.apart(position, quaternion, time)
        allowed = self.checker.slow_enough(distance, angle, duration)
        if not np.any(allowed):
            self.too_fast += 1
            return None
        metric = np.where(allowed, self.limits.metric.combine(distance, angle, duration), np.inf)
        near = int(np.argmin(metric))
        share = min(1.0, self.step / metric[near])
        edge = self._edge(tree, near, position, quaternion, time, share)
        hints = self.checker.walk(edge, tree.hint[near], backwards=tree.direction < 0)
        if hints is None:
            self.infeasible += 1
            return None
        end = -1 if tree.direction > 0 else 0
        return tree.add(
            edge.position[end], _quaternion(edge.rotation[end]), float(edge.time[end]), near, hints[-1]
        )

    def _edge(
        self, tree: _Tree, near: int, position: FloatArray, quaternion: FloatArray, time: float, share: float
    ) -> EffectorPath:
        """LIMIT-METRIC: the first ``share`` of the edge from a node to a point, in the order of time."""
        from_rotation = Rotation.from_quat(tree.quaternion[near])
        turn = (from_rotation.inv() * Rotation.from_quat(quaternion)).as_rotvec()
        rotation = (from_rotation * Rotation.from_rotvec(share * turn)).as_matrix()
        nodes = [
            (tree.time[near], tree.position[near], from_rotation.as_matrix()),
            (
                tree.time[near] + share * (time - tree.time[near]),
                tree.position[near] + share * (position - tree.position[near]),
                rotation,
            ),
        ][:: tree.direction]
        times, positions, rotations = zip(*nodes, strict=True)
        return EffectorPath(np.array(times), np.array(positions), np.array(rotations))

    def _join(self, tree: _Tree, index: int, other: _Tree) -> int | None:
        """IS-CONNECTED: the node of the other tree to which a checked edge leads, or None."""
        position, quaternion = tree.position[index], tree.quaternion[index]
        distance, angle, duration = other.apart(position, quaternion, tree.time[index])
        metric = self.limits.metric.combine(distance, angle, duration)
        metric = np.where(self.checker.slow_enough(distance, angle, duration), metric, np.inf)
        self.gap = min(self.gap, float(metric.min()))
        for match in np.argsort(metric, kind="stable")[:3]:
            if not metric[match] <= self.connect:
                break
            self.connections += 1
            edge = self._edge(
                tree, index, other.position[match], other.quaternion[match], float(other.time[match]), 1.0
            )
            if self.checker.walk(edge, tree.hint[index], backwards=tree.direction < 0) is not None:
                return int(match)
            self.infeasible += 1
        return None

    def path(self, forward: int, backward: int) -> tuple[EffectorPath, tuple[Any, ...]]:
        """CONSTRUCT-PATH: from the first root through the joint to the second root."""
        nodes = [(self.trees[0], i) for i in reversed(self.trees[0].branch(forward))]
        nodes += [(self.trees[1], i) for i in self.trees[1].branch(backward)]
        path = EffectorPath(
            np.array([tree.time[i] for tree, i in nodes]),
            np.array([tree.position[i] for tree, i in nodes]),
            Rotation.from_quat(np.array([tree.quaternion[i] for tree, i in nodes])).as_matrix(),
        )
        return path, tuple(tree.hint[i] for tree, i in nodes)

    def statistics(self) -> BiRrtStatistics:
        return BiRrtStatistics(
            self.iterations, self.too_fast, self.infeasible, self.connections, self.checker.checks,
            (self.trees[0].count, self.trees[1].count), self.gap,
        )  # fmt: skip

    def explain(self) -> str:
        """Reason why the iterations were not enough."""
        first, second = (tree.count for tree in self.trees)
        return (
            f"no path in {self.iterations} iterations: trees of {first} and {second} nodes stay "
            f"{self.gap:.3f} apart (may join below {self.connect:g}); {self.too_fast} expansions were beyond "
            f"the speed limits and {self.infeasible} edges had no feasible posture"
        )


def _quaternion(rotation: FloatArray) -> FloatArray:
    return Rotation.from_matrix(rotation).as_quat()
