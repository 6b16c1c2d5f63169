"""The second way to move a flying effector: search, shorten, smooth ([Qiu2012]_ 6.2.3-6.2.5).

CHECK-PG asks two questions of a pose at an instant, the cheap one first: does the effector keep
clear of everything, and does the posture generator find a whole-body posture with it there?
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.posture import Placement, PostureProblem, SolverSettings, generate_posture
from manikin.spatial import FloatArray, finite_number
from manikin.wholebody.birrt import BiRrtStatistics, Feasible, FlightLimits, SamplingZone, plan_flight
from manikin.wholebody.path import EffectorPath, Pose
from manikin.wholebody.smoothing import smooth_curve, smooth_path
from manikin.wholebody.swing import Clearance, SwingLimits, required_clearance
from manikin.wholebody.swing_curve import SwingCurve

QUICK = SolverSettings(iterations=25, restarts=False, explain=False)
"""Settings for postures that start from a neighbour's."""

THOROUGH = SolverSettings(explain=False)
"""Settings for the first posture of a search, without a neighbour."""


class PostureCheck:
    """CHECK-PG: whether a posture exists with the effector at a pose, its posture as the hint.

    Args:
        effector: Name of the flying effector.
        problem_at: What else must hold at a time [s]: contacts, centre of mass, scene.
        screen: Cheap test of pose and time that is asked first, such as :class:`ClearFlight`.
        rotation_weight: None to require the rotation too; otherwise it is only wished, with
            this weight: a foot behind the body cannot be kept level.
        quick: Settings with a hint to start from; a failure from it is final.
        thorough: Settings without one.
    """

    def __init__(
        self,
        effector: str,
        problem_at: Callable[[float], PostureProblem],
        screen: Callable[[float, Pose], bool] | None = None,
        *,
        rotation_weight: float | None = None,
        quick: SolverSettings = QUICK,
        thorough: SolverSettings = THOROUGH,
    ) -> None:
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
        start: Pose at lift-off.
        goal: Pose at touch-down.
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        limits: Clearance in flight and how it is gained near the contacts.
        extra: More than that, so that what is smoothed later has room [m].
    """

    def __init__(
        self,
        clearance: Clearance,
        start: Pose,
        goal: Pose,
        start_time: float,
        end_time: float,
        limits: SwingLimits,
        extra: float = 0.0,
    ) -> None:
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
        statistics: What the search did.
        failure: None, or why there is no curve.
    """

    curve: SwingCurve | None
    path: EffectorPath | None
    statistics: BiRrtStatistics
    failure: str | None = None

    @property
    def succeeded(self) -> bool:
        """Whether a curve was found."""
        return self.curve is not None


PATH_SPEED_SHARE = 0.65
"""Share of the speed limits left to the path: a flight from rest to rest is faster in its middle."""


def search_swing(
    start: Pose,
    goal: Pose,
    start_time: float,
    end_time: float,
    feasible: Feasible,
    rng: np.random.Generator,
    *,
    roomy: Feasible | None = None,
    limits: FlightLimits | None = None,
    zone: SamplingZone | None = None,
    iterations: int = 2000,
    shortcuts: int = 60,
    attempts: int = 3,
) -> SwingSearch:
    """Search a path with the Bi-RRT, shorten it and turn it into a smooth swing.

    Args:
        start: Pose at lift-off.
        goal: Pose at touch-down.
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        feasible: CHECK-PG for the curve.
        rng: Source of all randomness.
        roomy: Stricter CHECK-PG for the path, so that rounding its corners stays feasible;
            ``feasible`` itself when omitted.
        limits: Speed limits of the curve, metric and density of the checks.
        zone: Where poses are drawn.
        iterations: Largest number of random points.
        shortcuts: How many replacements are tried on the path.
        attempts: How many paths are searched when no smooth curve follows one.
    """
    limits = limits or FlightLimits()
    slower = replace(
        limits, speed=PATH_SPEED_SHARE * limits.speed, angular_speed=PATH_SPEED_SHARE * limits.angular_speed
    )
    result: SwingSearch | None = None
    for _ in range(max(1, attempts)):
        result = _search_once(
            start, goal, start_time, end_time, feasible, roomy or feasible, rng, limits, slower, zone,
            iterations, shortcuts,
        )  # fmt: skip
        if result.succeeded or result.path is None:
            break
    assert result is not None  # there is at least one attempt
    return result


def _search_once(
    start: Pose,
    goal: Pose,
    start_time: float,
    end_time: float,
    feasible: Feasible,
    roomy: Feasible,
    rng: np.random.Generator,
    limits: FlightLimits,
    slower: FlightLimits,
    zone: SamplingZone | None,
    iterations: int,
    shortcuts: int,
) -> SwingSearch:
    found = plan_flight(
        start, goal, start_time, end_time, roomy, rng, limits=slower, zone=zone, iterations=iterations
    )
    if found.path is None:
        return SwingSearch(None, None, found.statistics, found.failure)
    shorter = smooth_path(found.path, roomy, rng, limits=slower, hints=found.hints, iterations=shortcuts)
    failure = None
    for path in (shorter.path, found.path):
        curve = smooth_curve(path, feasible, limits=limits, hint=found.hints[0])
        if curve.curve is not None:
            return SwingSearch(curve.curve, path, found.statistics)
        failure = failure or curve.failure
    return SwingSearch(
        None, shorter.path, found.statistics, f"a path was found but no smooth curve: {failure}"
    )
