"""Shorten a found path at random and turn it into a smooth swing ([Qiu2012]_ 6.2.5)."""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.spatial import FloatArray, finite_number
from manikin.wholebody.birrt import EdgeChecker, Feasible, FlightLimits
from manikin.wholebody.path import EffectorPath, Pose
from manikin.wholebody.swing_curve import SwingCurve

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
        curve: A curve that was checked, or None.
        controls: Control poses of the last curve tried.
        checks: Calls of the feasibility check.
        failure: None, or what the last curve tried does not keep, and when.
    """

    curve: SwingCurve | None
    controls: int
    checks: int
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
        feasible: CHECK-PG, as for the search.
        rng: Source of all randomness.
        limits: Speed limits, metric and density of the checks, as for the search.
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
        path: A feasible path.
        feasible: CHECK-PG, as for the search.
        limits: Speed limits; a rest-to-rest curve is faster in the middle than the path's average.
        hint: Hint at the start of the path.
        time_step: Spacing of the checked instants [s].
    """
    finite_number(time_step, "smooth_curve time_step [s]", above=0.0)
    limits = limits or FlightLimits()
    checker = EdgeChecker(feasible, limits)
    failure, controls = None, 0
    for controls, sharpening in itertools.product(CONTROLS, SHARPENINGS):
        curve = SwingCurve.along(path, controls, sharpening)
        failure = _curve_failure(curve, checker, limits, hint, time_step)
        if failure is None:
            return SmoothCurve(curve, controls, checker.checks)
    return SmoothCurve(None, controls, checker.checks, failure)


def _shortcut(
    path: EffectorPath,
    hints: list[Any],
    first: int,
    second: int,
    shares: FloatArray,
    checker: EdgeChecker,
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
    """What a curve does not keep, or None."""
    if curve.peak_speed > limits.speed:
        return f"speed reaches {curve.peak_speed:.2f} m/s; limit {limits.speed:.2f} m/s"
    if curve.peak_angular_speed > limits.angular_speed:
        return f"angular speed reaches {curve.peak_angular_speed:.2f} rad/s; limit {limits.angular_speed:.2f}"
    count = max(2, int(np.ceil(curve.duration / time_step)))
    state = curve.evaluate(np.linspace(curve.start_time, curve.end_time, count + 1))
    for k, time in enumerate(state.time):
        hint = checker.ask(Pose(state.position[k], state.rotation[k]), float(time), hint)
        if hint is None:
            return f"no feasible posture at t = {time:.3f} s"
    return None
