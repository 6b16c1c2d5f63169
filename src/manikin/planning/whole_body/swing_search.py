"""Flights of an effector found by search, shortened and smoothed ([Qiu2012]_ 6.2.3-6.2.5).

CHECK-PG asks two questions of a pose at an instant, the cheap one first: does the effector keep
clear of everything, and does the posture generator find a whole-body posture with it there?
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from manikin.kinematics import Placement, PostureProblem, SolverSettings, generate_posture
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.birrt import Feasible, plan_flight, slow_enough, walk
from manikin.planning.whole_body.swing import SwingLimits, required_clearance
from manikin.planning.whole_body.swing_curve import SwingCurve
from manikin.planning.whole_body.swing_path import EffectorPath, FlightClearance, Pose

CONTROLS, SHARPENINGS = (12, 14, 17, 20, 24, 29, 35, 42, 50, 64, 80), (0, 1, 3)
"""Numbers of control poses that are tried, from the smoothest curve to the closest, and corrections towards
the corners of the path that are tried for each of them."""


class SmoothCurve(NamedTuple):
    """A smooth swing that was found by search, or why there is none."""

    curve: SwingCurve | None
    failure: str | None = None


def smooth_path(
    path: EffectorPath, feasible: Feasible, rng: np.random.Generator, *, limits: SwingLimits,
    hints: tuple[Any, ...] | None = None, iterations: int = 60,
) -> EffectorPath:  # fmt: skip
    """Replace stretches of a path by straight edges between two random points (Algorithm 6).

    A stretch is replaced only when the new edge passes both checks (the printed algorithm replaces it in any
    case).  Straight edges are the shortest in the metric, so the path never grows longer.

    Args:
        path: Path to shorten; its nodes are taken to be feasible.
        hints: Hints at the nodes of the path, for warm starts.
        iterations: How many replacements are tried.
    """
    known = list(hints or [None] * len(path.time))
    for _ in range(iterations):
        if len(path.time) < 3:
            break
        first, second = sorted(rng.choice(len(path.time) - 1, size=2, replace=False).tolist())
        ends = slice(first, second + 1, second - first)
        times = path.time[ends] + rng.uniform(size=2) * np.diff(path.time)[ends]
        # Hardly beside a node, the new edge would begin or end in a segment without duration [s].
        if min(times[0] - path.time[first], times[1] - times[0], path.time[second + 1] - times[1]) < 1e-6:
            continue
        edge = EffectorPath(times, *path.sample(times))
        found = _edge_hints(edge, feasible, limits, known[first])
        if found is not None:
            known[first + 1 : second + 1] = found
            path = EffectorPath(*(
                np.concatenate([whole[: first + 1], part, whole[second + 1 :]])
                for whole, part in (
                    (path.time, edge.time), (path.position, edge.position), (path.rotation, edge.rotation),
                )
            ))  # fmt: skip
    return path


def _edge_hints(edge: EffectorPath, feasible: Feasible, limits: SwingLimits, hint: Any) -> list[Any] | None:
    """Hints at both ends of an edge, or None where it is too fast or a point of it has no posture."""
    distance = np.linalg.norm(np.diff(edge.position, axis=0), axis=1)
    if not slow_enough(limits, distance, np.linalg.norm(edge.turns, axis=1), np.diff(edge.time))[0]:
        return None
    start = feasible(Pose(edge.position[0], edge.rotation[0]), float(edge.time[0]), hint)
    end = None if start is None else walk(feasible, edge, start)
    return None if end is None else [start, end]


def smooth_curve(
    path: EffectorPath, feasible: Feasible, *, limits: SwingLimits, hint: Any = None
) -> SmoothCurve:
    """Turn a path into a C4 swing from rest to rest that is feasible at dense instants.

    Curves of more and more control poses follow the path more and more closely; the first (smoothest) one
    that keeps the speed limits and has a posture everywhere is returned.

    Args:
        limits: Speed limits; a rest-to-rest curve is faster in the middle than the path's average.
        hint: Hint at the start of the path.
    """
    failure = None
    for controls, sharpening in itertools.product(CONTROLS, SHARPENINGS):
        curve = SwingCurve.along(path, controls, sharpening)
        failure = _curve_failure(curve, feasible, limits, hint)
        if failure is None:
            return SmoothCurve(curve)
    return SmoothCurve(None, failure)


def _curve_failure(curve: SwingCurve, feasible: Feasible, limits: SwingLimits, hint: Any) -> str | None:
    """Limit or check that a curve does not keep, or None."""
    haste = curve.haste(limits.speed, limits.angular_speed)
    if haste is not None:
        return haste
    # Instants at most this far apart [s].
    count = max(2, int(np.ceil(curve.duration / 0.02)))
    state = curve.evaluate(np.linspace(curve.start_time, curve.end_time, count + 1))
    for time, position, rotation in zip(state.time, state.position, state.rotation, strict=True):
        hint = feasible(Pose(position, rotation), float(time), hint)
        if hint is None:
            return f"no feasible posture at t = {time:.3f} s"
    return None


QUICK, THOROUGH = SolverSettings(iterations=25, restarts=False, explain=False), SolverSettings(explain=False)
"""Settings for postures that start from a neighbour's, where a failure is final, and for the first one."""


@dataclass(frozen=True, eq=False)
class PostureCheck:
    """CHECK-PG: whether a posture exists with the effector at a pose, its posture as the hint.

    Attributes:
        problem_at: What else must hold at a time [s]: contacts, centre of mass, scene.
        screen: Cheap test of time and pose that is asked first, such as :class:`ClearFlight`.
        rotation_weight: With which the rotation is wished, not required: a foot behind the body cannot be
            kept level.
    """

    effector: str
    problem_at: Callable[[float], PostureProblem]
    screen: Callable[[float, Pose], bool]
    rotation_weight: float

    def __call__(self, pose: Pose, time: float, hint: Any) -> FloatArray | None:
        """(nq,) posture with the effector at ``pose``, or None."""
        if not self.screen(time, pose):
            return None
        problem, wanted = self.problem_at(time), Placement(*pose, self.rotation_weight)
        problem = replace(problem, placements={**problem.placements, self.effector: wanted})
        result = generate_posture(problem, hint, settings=THOROUGH if hint is None else QUICK)
        return result.q if result.succeeded else None


class ClearFlight:
    """Whether an effector keeps the clearance that swings must keep, less near its two contacts.

    Args:
        clearance: Of the effector.
        ends: Poses at lift-off and touch-down.
        times: Of both [s].
        limits: Clearance in flight and how it is gained near the contacts.
        extra: More than that, so that what is smoothed later has room [m].
    """

    def __init__(
        self, clearance: FlightClearance, ends: tuple[Pose, Pose], times: tuple[float, float],
        limits: SwingLimits, extra: float = 0.0,
    ) -> None:  # fmt: skip
        self._clearance, self._ends = clearance, ends
        at_ends = clearance(np.array(times), *(np.array(part) for part in zip(*ends, strict=True)))
        self._at_ends = at_ends.distance
        self._limits = replace(limits, clearance=limits.clearance + extra)

    def __call__(self, time: float, pose: Pose) -> bool:
        """Whether the pose is clear at that time."""
        moved = [np.linalg.norm(pose.position - end.position) for end in self._ends]
        required = required_clearance((moved[0], moved[1]), self._at_ends, self._limits) - 1e-9
        near = self._clearance(np.array([time]), pose.position[None], pose.rotation[None], required)
        return bool(near.distance[0] >= required)


def search_swing(
    start: Pose, goal: Pose, start_time: float, end_time: float, feasible: Feasible,
    rng: np.random.Generator, *, roomy: Feasible, limits: SwingLimits, iterations: int = 2000,
) -> SmoothCurve:  # fmt: skip
    """Search a path with the Bi-RRT, shorten it and turn it into a smooth swing.

    Args:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        feasible: CHECK-PG for the curve.
        roomy: Stricter CHECK-PG for the path, so that rounding its corners stays feasible.
        limits: Speed limits of the curve.
        iterations: Largest number of random points.
    """
    failure = None
    # Speeds left to the path: a flight from rest to rest is faster in its middle.
    slower = replace(limits, speed=0.65 * limits.speed, angular_speed=0.65 * limits.angular_speed)
    for _ in range(3):  # paths that are searched when no smooth curve follows one
        found = plan_flight(
            start, goal, start_time, end_time, roomy, rng, limits=slower, iterations=iterations
        )
        if found.path is None:
            return SmoothCurve(None, found.failure)
        shorter = smooth_path(found.path, roomy, rng, limits=slower, hints=found.hints)
        smooth = smooth_curve(shorter, feasible, limits=limits, hint=found.hints[0])
        failure = smooth.failure
        if smooth.curve is None:
            smooth = smooth_curve(found.path, feasible, limits=limits, hint=found.hints[0])
        if smooth.curve is not None:
            return smooth
    return SmoothCurve(None, f"a path was found but no smooth curve: {failure}")
