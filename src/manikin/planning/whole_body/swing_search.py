"""Flights of an effector found by search, shortened and smoothed ([Qiu2012]_ 6.2.3-6.2.5).

CHECK-PG asks two questions of a pose at an instant, the cheap one first: does the effector keep
clear of everything, and does the posture generator find a whole-body posture with it there?
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.kinematics import Placement, PostureProblem, SolverSettings, generate_posture
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.planning.whole_body.birrt import (
    BiRrtStatistics,
    EdgeChecker,
    Feasible,
    FlightLimits,
    SamplingZone,
    plan_flight,
)
from manikin.planning.whole_body.swing import Clearance, SwingLimits, required_clearance
from manikin.planning.whole_body.swing_curve import SwingCurve
from manikin.planning.whole_body.swing_path import EffectorPath, Pose

CONTROLS = (12, 14, 17, 20, 24, 29, 35, 42, 50, 64, 80)
"""Numbers of control poses that are tried, from the smoothest curve to the closest."""

SHORTEST = 1e-6
"""Shortest segment that a replacement may leave [s]."""

SHARPENINGS = (0, 1, 3)
"""Corrections towards the corners of the path that are tried for each of them."""


@dataclass(frozen=True, eq=False)
class SmoothedPath:
    """Result of :func:`smooth_path`.

    Attributes:
        path: The shortened path; never longer than the one given.
        hints: What the feasibility check returned at each node.
        shortcuts: How many replacements were made.
        checks: Calls of the feasibility check.
    """

    path: EffectorPath
    hints: tuple[Any, ...]
    shortcuts: int
    checks: int


@dataclass(frozen=True, eq=False)
class SmoothCurve:
    """Result of :func:`smooth_curve`.

    Attributes:
        failure: None, or what the last curve tried does not keep, and when.
    """

    curve: SwingCurve | None
    failure: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether a curve was found."""
        return self.curve is not None


def smooth_path(
    path: EffectorPath,
    feasible: Feasible,
    rng: np.random.Generator,
    *,
    limits: FlightLimits | None = None,
    hints: tuple[Any, ...] | None = None,
    iterations: int = 100,
) -> SmoothedPath:
    """Replace stretches of a path by straight edges between two random points (Algorithm 6).

    A stretch is replaced only when the new edge passes both checks (the printed algorithm
    replaces it in any case).  Straight edges are the shortest in the metric, so the path
    never grows longer.

    Args:
        path: Path to shorten; its nodes are taken to be feasible.
        hints: Hints at the nodes of the path, for warm starts.
        iterations: How many replacements are tried.
    """
    checker = EdgeChecker(feasible, limits or FlightLimits())
    known = list(hints) if hints is not None else [None] * len(path)
    shortcuts = 0
    for _ in range(iterations):
        if len(path) < 3:
            break
        first, second = sorted(rng.choice(len(path) - 1, size=2, replace=False).tolist())
        shares = rng.uniform(size=2)
        shorter = _shortcut(path, known, first, second, shares, checker)
        if shorter is not None:
            path, known = shorter
            shortcuts += 1
    return SmoothedPath(path, tuple(known), shortcuts, checker.checks)


def smooth_curve(
    path: EffectorPath,
    feasible: Feasible,
    *,
    limits: FlightLimits | None = None,
    hint: Any = None,
    time_step: float = 0.02,
) -> SmoothCurve:
    """Turn a path into a C4 swing from rest to rest that is feasible at dense instants.

    Curves of more and more control poses follow the path more and more closely; the first
    (smoothest) one that keeps the speed limits and has a posture everywhere is returned.

    Args:
        limits: Speed limits; a rest-to-rest curve is faster in the middle than the path's average.
        hint: Hint at the start of the path.
        time_step: Spacing of the checked instants [s].
    """
    finite_number(time_step, "smooth_curve time_step [s]", above=0.0)
    limits = limits or FlightLimits()
    checker = EdgeChecker(feasible, limits)
    failure = None
    for controls, sharpening in itertools.product(CONTROLS, SHARPENINGS):
        curve = SwingCurve.along(path, controls, sharpening)
        failure = _curve_failure(curve, checker, limits, hint, time_step)
        if failure is None:
            return SmoothCurve(curve)
    return SmoothCurve(None, failure)


def _shortcut(
    path: EffectorPath, hints: list[Any], first: int, second: int, shares: FloatArray, checker: EdgeChecker
) -> tuple[EffectorPath, list[Any]] | None:
    """The path with a straight edge from a point of segment ``first`` to one of segment ``second``."""
    steps = np.diff(path.time)
    times = path.time[[first, second]] + shares * steps[[first, second]]
    position, rotation = path.sample(times)
    # Hardly beside a node, the new edge would begin or end in a segment without duration.
    spans = (times[0] - path.time[first], times[1] - times[0], path.time[second + 1] - times[1])
    if min(spans) < SHORTEST:
        return None
    edge = EffectorPath(times, position, rotation)
    distance = np.linalg.norm(np.diff(position, axis=0), axis=1)
    angle = np.linalg.norm(edge.turns, axis=1)
    if not checker.slow_enough(distance, angle, np.diff(times))[0]:
        return None
    start_hint = checker.ask(Pose(position[0], rotation[0]), float(times[0]), hints[first])
    if start_hint is None:
        return None
    found = checker.walk(edge, start_hint)
    if found is None:
        return None
    return _spliced(path, edge, first, second), [
        *hints[: first + 1],
        start_hint,
        found[-1],
        *hints[second + 1 :],
    ]


def _spliced(path: EffectorPath, edge: EffectorPath, first: int, second: int) -> EffectorPath:
    parts = [
        np.concatenate([whole[: first + 1], piece, whole[second + 1 :]])
        for whole, piece in (
            (path.time, edge.time), (path.position, edge.position), (path.rotation, edge.rotation),
        )
    ]  # fmt: skip
    return EffectorPath(*parts)


def _curve_failure(
    curve: SwingCurve, checker: EdgeChecker, limits: FlightLimits, hint: Any, time_step: float
) -> str | None:
    """Limit or check that a curve does not keep, or None."""
    haste = curve.haste(limits.speed, limits.angular_speed)
    if haste is not None:
        return haste
    count = max(2, int(np.ceil(curve.duration / time_step)))
    state = curve.evaluate(np.linspace(curve.start_time, curve.end_time, count + 1))
    for k, time in enumerate(state.time):
        hint = checker.ask(Pose(state.position[k], state.rotation[k]), float(time), hint)
        if hint is None:
            return f"no feasible posture at t = {time:.3f} s"
    return None


QUICK = SolverSettings(iterations=25, restarts=False, explain=False)
"""Settings for postures that start from a neighbour's."""

THOROUGH = SolverSettings(explain=False)
"""Settings for the first posture of a search, without a neighbour."""


class PostureCheck:
    """CHECK-PG: whether a posture exists with the effector at a pose, its posture as the hint.

    Args:
        problem_at: What else must hold at a time [s]: contacts, centre of mass, scene.
        screen: Cheap test of pose and time that is asked first, such as :class:`ClearFlight`.
        rotation_weight: None to require the rotation too; otherwise it is only wished, with
            this weight: a foot behind the body cannot be kept level.
        quick: Settings with a hint to start from; a failure from it is final.
        thorough: Settings without one.
    """

    def __init__(
        self, effector: str, problem_at: Callable[[float], PostureProblem],
        screen: Callable[[float, Pose], bool] | None = None, *, rotation_weight: float | None = None,
        quick: SolverSettings = QUICK, thorough: SolverSettings = THOROUGH,
    ) -> None:  # fmt: skip
        self._effector = effector
        self._problem_at = problem_at
        self._screen = screen
        self._rotation_weight = rotation_weight
        self._quick = quick
        self._thorough = thorough

    def __call__(self, pose: Pose, time: float, hint: Any) -> FloatArray | None:
        """(nq,) posture with the effector at ``pose``, or None."""
        if self._screen is not None and not self._screen(time, pose):
            return None
        problem = self._problem_at(time)
        wanted = Placement(pose.position, pose.rotation, self._rotation_weight)
        placements = {**problem.placements, self._effector: wanted}
        settings = self._thorough if hint is None else self._quick
        result = generate_posture(replace(problem, placements=placements), hint, settings=settings)
        return result.q if result.succeeded else None


class ClearFlight:
    """Whether an effector keeps the clearance that swings must keep, less near its two contacts.

    Args:
        clearance: Signed distance of the effector at a time and pose [m].
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        limits: Clearance in flight and how it is gained near the contacts.
        extra: More than that, so that what is smoothed later has room [m].
    """

    def __init__(
        self, clearance: Clearance, start: Pose, goal: Pose, start_time: float, end_time: float,
        limits: SwingLimits, extra: float = 0.0,
    ) -> None:  # fmt: skip
        self._clearance = clearance
        self._ends = (start, goal)
        self._at_ends = (clearance(start_time, start), clearance(end_time, goal))
        wanted = limits.clearance + finite_number(extra, "clear flight extra [m]", at_least=0.0)
        self._limits = replace(limits, clearance=wanted)

    def __call__(self, time: float, pose: Pose) -> bool:
        """Whether the pose is clear at that time."""
        moved = [np.array([float(np.linalg.norm(pose.position - end.position))]) for end in self._ends]
        required = required_clearance((moved[0], moved[1]), self._at_ends, self._limits)
        return self._clearance(time, pose) >= float(required[0]) - 1e-9


@dataclass(frozen=True, eq=False)
class SwingSearch:
    """Result of :func:`search_swing`.

    Attributes:
        curve: A smooth curve with a posture at every checked instant, or None.
        path: The shortened path it follows, or None when no path was found.
    """

    curve: SwingCurve | None
    path: EffectorPath | None
    statistics: BiRrtStatistics
    failure: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether a curve was found."""
        return self.curve is not None


def search_swing(
    start: Pose, goal: Pose, start_time: float, end_time: float, feasible: Feasible,
    rng: np.random.Generator, *, roomy: Feasible | None = None, limits: FlightLimits | None = None,
    zone: SamplingZone | None = None, iterations: int = 2000, shortcuts: int = 60, attempts: int = 3,
) -> SwingSearch:  # fmt: skip
    """Search a path with the Bi-RRT, shorten it and turn it into a smooth swing.

    Args:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        feasible: CHECK-PG for the curve.
        roomy: Stricter CHECK-PG for the path, so that rounding its corners stays feasible;
            ``feasible`` itself when omitted.
        limits: Speed limits of the curve, metric and density of the checks.
        iterations: Largest number of random points.
        shortcuts: How many replacements are tried on the path.
        attempts: How many paths are searched when no smooth curve follows one.
    """
    limits = limits or FlightLimits()
    # Speeds left to the path: a flight from rest to rest is faster in its middle.
    slower = replace(limits, speed=0.65 * limits.speed, angular_speed=0.65 * limits.angular_speed)
    roomy = roomy or feasible
    for _ in range(max(1, attempts)):
        found = plan_flight(
            start, goal, start_time, end_time, roomy, rng, limits=slower, zone=zone, iterations=iterations
        )
        if found.path is None:
            return SwingSearch(None, None, found.statistics, found.failure)
        shorter = smooth_path(found.path, roomy, rng, limits=slower, hints=found.hints, iterations=shortcuts)
        curves = []
        for path in (shorter.path, found.path):
            curves.append(smooth_curve(path, feasible, limits=limits, hint=found.hints[0]))
            if curves[-1].curve is not None:
                return SwingSearch(curves[-1].curve, path, found.statistics)
    failure = f"a path was found but no smooth curve: {curves[0].failure}"
    return SwingSearch(None, shorter.path, found.statistics, failure)
