"""Plan the whole-body motion of a centre-of-mass trajectory and its contacts.

Swings are smooth curves where that suffices and Bi-RRT paths where it does not
([Qiu2012]_ 6.2.3); guide postures show the way; the whole body then follows contacts, swings
and centre of mass as one spline, and the result is certified at 1 kHz.
"""

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from manikin.balance import WrenchPolytope, motion_margin, pseudo_wrench, wrench_polytopes
from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline, align_quaternions
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body.fit import (
    FIRST_DECREASE,
    LATER_DECREASE,
    FitResult,
    MotionFit,
    with_updated_penalties,
)
from manikin.planning.whole_body.fit_scales import FitScales
from manikin.planning.whole_body.fit_strength import HeldForces
from manikin.planning.whole_body.fit_targets import (
    FitTargets,
    effector_targets,
    flat_share,
    ignored_pairs,
    phase_knots,
    refined,
    sample_times,
    toe_angles,
    touch_downs_at_speed,
)
from manikin.planning.whole_body.key_postures import KeyPostures
from manikin.planning.whole_body.posture_style import (
    CLOSE,
    READY,
    Guide,
    PostureStyle,
    guide_times,
    plan_guide,
    reference_motion,
)
from manikin.planning.whole_body.sliding_touchdown import Ignored, sliding_touchdown_at
from manikin.planning.whole_body.swing import SwingLimits
from manikin.planning.whole_body.swing_planner import FlightPlanner, PlannedSwing
from manikin.planning.whole_body.whole_body_certificate import (
    WholeBodyFailure,
    WholeBodyRequirements,
    WholeBodyResiduals,
    certify,
)
from manikin.runtime.display import Displayed
from manikin.runtime.requirement import RequirementTable
from manikin.scene import Proximity, Scene

DEGREE = 5
"""Degree of the whole-body spline: four continuous derivatives."""

NEAR_FLIGHT = 0.05
"""A requirement that breaks this close to a flight is put down to it [s]."""

LOOSE_COM = 0.01
"""Importance of a centre of mass that only shows the way."""

SECOND_SEARCH = 600
"""Random points of the Bi-RRT where a smooth curve exists but the body cannot follow it."""

FLAT_TOES = 2.0e-3
"""Deviation of toes from lying flat, or straight, that costs one unit while feet are held or roll [rad]."""

REPAIRS = 3
"""Most fits that follow a failed one with other weights."""

CAUGHT = -0.02
"""Below this clearance a part of the body is caught on the wrong side of another, and no small step leads
out: the fit begins anew, led by the key postures, and then with more weight on clearance [m]."""

INEXACT = frozenset({"max_support_error_m", "max_support_turn_rad", "max_com_error_m"})
"""Broken requirements that a spline with more knots may keep."""

Progress = Callable[[float], None]
"""Told the share of the work that is done, in [0, 1]."""


@dataclass(frozen=True)
class WholeBodySettings:
    """Options of :func:`plan_whole_body`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        samples_per_span: Samples between two knots.
        guide_spacing: Largest distance of the guide postures [s].
        sampling: Spacing of the finished motion's samples [s].
        swing: What a swing must keep.
        fit: Scales and limits of the fit.
        requirements: What the finished motion must keep.
        manner: How the body carries itself where the task leaves freedom.
    """

    knot_spacing: float = 0.05
    samples_per_span: int = 3
    guide_spacing: float = 0.1
    sampling: float = 1.0e-3
    swing: SwingLimits = field(default_factory=SwingLimits)
    fit: FitScales = field(default_factory=FitScales)
    requirements: WholeBodyRequirements = field(default_factory=WholeBodyRequirements)
    manner: PostureStyle = READY


@dataclass(frozen=True, eq=False, repr=False)
class WholeBodyResult(Displayed):
    """A whole-body motion, or the best attempt and what it breaks.

    Attributes:
        motion: Sampled at 1 kHz; of the best attempt when it failed.
        spline: The motion in closed form.
        certificate: Measured on the samples of the motion.
        requirements: What the certificate was held against.
        swings: The flights.
        guide: The guide postures.
        failure: Why it is no success, or None.
        iterations: Of the fit.
        wall_time: [s].
    """

    motion: Motion
    spline: ConfigurationSpline
    certificate: WholeBodyResiduals
    requirements: RequirementTable
    swings: tuple[PlannedSwing, ...]
    guide: Guide
    failure: WholeBodyFailure | None
    iterations: int
    wall_time: float

    @property
    def succeeded(self) -> bool:
        """Whether every requirement is kept."""
        return self.failure is None


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A fit with the postures that led it, and what it comes to."""

    guide: Guide
    fit: MotionFit
    found: FitResult
    result: WholeBodyResult


def plan_whole_body(
    body: BodyModel,
    scene: Scene,
    trajectory: CentroidalTrajectory,
    *,
    rng: np.random.Generator,
    settings: WholeBodySettings | None = None,
    padded: Sequence[str] = (),
    key_postures: FloatArray | None = None,
    waypoints: KeyPostures | None = None,
    progress: Progress | None = None,
) -> WholeBodyResult:
    """Find a whole-body motion that keeps contacts, centre of mass and distances.

    Args:
        body: The body.
        scene: The obstacles and the floor.
        trajectory: Planned centre of mass with its contacts in time; its soles are those
            that the forces act on.
        rng: Source of all randomness (the Bi-RRT).
        settings: Options.
        padded: Obstacles that any part of the body may lean on: it is kept off them where that is
            possible, but the certificate does not ask for it.
        key_postures: (phases + 1, nq) postures known for the key instants, which the motion stays near;
            the manner's when omitted.
        waypoints: Postures of the plan's key instants, which lead the motion where one that is led by
            the manner is caught on the wrong side of an obstacle.
        progress: Called now and then with the share done.

    Returns:
        The motion with its certificate. When the motion breaks a requirement, the fit goes on with more
        weight on it; when it still does, the arms are kept close to the body; when that does not help
        either, the flight in which it does is searched again with the Bi-RRT before the result is
        called a failure.
    """
    began = clock.perf_counter()
    planner = _Planner(body, scene, trajectory, rng, settings or WholeBodySettings(), progress)
    if key_postures is not None:
        planner.known = Guide(trajectory.schedule.instants, align_quaternions(np.array(key_postures)), ())
    if waypoints is not None and key_postures is None:
        planner.waypoints = waypoints.guide()
    planner.leaning = frozenset((segment.name, name) for segment in body.segments for name in padded)
    return planner.run(began)


class _Planner:
    """One planning job, with what its steps share."""

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        trajectory: CentroidalTrajectory,
        rng: np.random.Generator,
        settings: WholeBodySettings,
        progress: Progress | None,
    ) -> None:
        self.body, self.scene, self.trajectory, self.settings = body, scene, trajectory, settings
        self.proximity = Proximity(body, scene)
        self.flights = FlightPlanner(
            body, scene, trajectory, settings.swing, rng,
            lambda time: self._reference(np.array([time]))[0],
        )  # fmt: skip
        self.leaning: Ignored = frozenset()
        self.known: Guide | None = None
        self.straight_toes = True
        self.waypoints: Guide | None = None
        self._guides: dict[tuple[tuple[PlannedSwing, ...], PostureStyle, Guide | None], Guide] = {}
        self._progress = progress

    def run(self, began: float) -> WholeBodyResult:
        swings = tuple(self.flights.plan(swing) for swing in self.flights.flights())
        self._report(0.2)
        result = self._attempt(swings, began)
        if not result.succeeded and self.settings.manner is READY:
            result = _better(result, self._attempt_close(swings, began))
        if "min_clearance_m" in result.requirements.broken:
            result = _better(result, self._attempt_with_loose_toes(swings, began))
        searched = self._search_again(swings, result)
        if searched is not None:
            result = _better(result, self._attempt(searched, began))
        self._report(1.0)
        return result

    def _attempt_close(self, swings: tuple[PlannedSwing, ...], began: float) -> WholeBodyResult:
        """Try again with the arms close to the body: raised ones may have to pass through a thigh."""
        usual = self.settings
        self.settings = replace(usual, manner=CLOSE)
        result = self._attempt(swings, began)
        self.settings = usual
        return result

    def _attempt_with_loose_toes(self, swings: tuple[PlannedSwing, ...], began: float) -> WholeBodyResult:
        """Try again with toes that need not be straight: straight ones may be in the way of a flight."""
        self.straight_toes = False
        result = self._attempt(swings, began)
        self.straight_toes = True
        return result

    def _search_again(
        self, swings: tuple[PlannedSwing, ...], result: WholeBodyResult
    ) -> tuple[PlannedSwing, ...] | None:
        """Replace the smooth swing in whose flight a requirement breaks, when there is one."""
        if result.failure is None:
            return None
        for index, item in enumerate(swings):
            start, end = item.interval
            near = start - NEAR_FLIGHT <= result.failure.time <= end + NEAR_FLIGHT
            if item.method == "smooth" and item.failure is None and item.roll is None and near:
                other = self.flights.search(item.swing, item, iterations=SECOND_SEARCH)
                if other.method != item.method:
                    return (*swings[:index], other, *swings[index + 1 :])
        return None

    def _attempt(self, swings: tuple[PlannedSwing, ...], began: float) -> WholeBodyResult:
        """Fit a motion to the swings; where it misses a little, fit on with more weight on that."""
        first = self._first_fit(swings, began)
        guide, fit, found = first.guide, first.fit, first.found
        scales, fine, forces = self._scales(), False, None
        result = last = first.result
        for number in range(REPAIRS):
            if result.succeeded:
                break
            broken = last.requirements.broken
            if _is_caught(last):
                scales = with_updated_penalties(scales, broken & {"min_clearance_m"})
                fit, start = self._prepare(swings, guide, self._knots(), scales)
                found = fit.solve(start)
            else:
                inexact, strong = number == 0 and bool(broken & INEXACT), "max_torque_share" in broken
                patient = inexact or strong or number > 0
                scales = with_updated_penalties(
                    scales, broken, narrow=number > 0, decrease=LATER_DECREASE if patient else FIRST_DECREASE
                )
                start = found.spline
                if inexact or strong:
                    fine, forces = fine or inexact, last.motion if strong else forces
                    fit, start = self._prepare(swings, guide, self._knots(fine), scales, start, forces)
                found = fit.improve(start, scales)
            last = self._judged(found, swings, guide, began)
            result = _better(result, last)
        return result

    def _first_fit(self, swings: tuple[PlannedSwing, ...], began: float) -> "_Fitted":
        """The fit led by the manner, or by the key postures where that one is caught and theirs is not."""
        usual = self._fitted(swings, began)
        if self.waypoints is None or not _is_caught(usual.result):
            return usual
        self.known = self.waypoints
        led = self._fitted(swings, began)
        self.known = None
        return usual if _is_caught(led.result) else led

    def _fitted(self, swings: tuple[PlannedSwing, ...], began: float) -> "_Fitted":
        """Guide postures and the first fit near them."""
        guide = self._guide_once(swings)
        self._report(0.4)
        fit, start = self._prepare(swings, guide, self._knots(), self._scales())
        found = fit.solve(start)
        self._report(0.8)
        return _Fitted(guide, fit, found, self._judged(found, swings, guide, began))

    def _prepare(
        self,
        swings: tuple[PlannedSwing, ...],
        guide: Guide,
        knots: FloatArray,
        scales: FitScales,
        near: ConfigurationSpline | None = None,
        forces: Motion | None = None,
    ) -> tuple[MotionFit, ConfigurationSpline]:
        """A fit and where it begins: near the guide, or an earlier spline."""
        targets = self._targets(swings, guide, knots)
        if forces is not None:
            held = HeldForces.of(self.body, self.trajectory.schedule, forces, targets.time)
            targets = replace(targets, forces=held)
        fit = MotionFit(self.body, self.proximity, targets, knots, DEGREE, scales)
        return fit, fit.initial_spline(targets.reference if near is None else near.evaluate(targets.time)[0])

    def _judged(
        self, fit: FitResult, swings: tuple[PlannedSwing, ...], guide: Guide, began: float
    ) -> WholeBodyResult:
        """Sample a fitted motion and certify it."""
        motion, wrench = self._sample(fit.spline)
        ignored = ignored_pairs(self.body, self.scene, self.trajectory.schedule, motion.time)
        if self.leaning:
            ignored = tuple(pairs | self.leaning for pairs in ignored)
        meeting = sliding_touchdown_at(self.body, self.scene, self.trajectory.schedule, motion.time)
        certificate = certify(
            self.body, self.proximity, self.trajectory, motion, ignored, wrench, meeting, self._polytopes
        )
        table = certificate.table(self.settings.requirements)
        failure = self._failure(swings, guide, table)
        wall = clock.perf_counter() - began
        return WholeBodyResult(
            motion, fit.spline, certificate, table, swings, guide, failure, fit.iterations, wall
        )

    def _scales(self) -> FitScales:
        share = self.settings.manner.moment_factor * self.settings.fit.moment_share
        return replace(self.settings.fit, moment_share=share)

    def _guide_once(self, swings: tuple[PlannedSwing, ...]) -> Guide:
        """The guide to the swings, found once for each manner and set of known postures."""
        key = swings, self.settings.manner, self.known
        if key not in self._guides:
            self._guides[key] = self._guide(swings)
        return self._guides[key]

    def _guide(self, swings: tuple[PlannedSwing, ...]) -> Guide:
        schedule = self.trajectory.schedule
        time = guide_times(schedule.instants, self.settings.guide_spacing)
        toes = toe_angles(self.body, swings, time)
        reference = self._reference(time)
        return plan_guide(
            self.body, self.proximity, schedule, time, effector_targets(schedule, swings, time),
            self._guide_com(time), ignored_pairs(self.body, self.scene, schedule, time),
            _with_joints(reference, toes), self.settings.fit.safe_distance,
            self.settings.manner.preferences, tuple(toes),
        )  # fmt: skip

    def _reference(self, time: FloatArray) -> FloatArray:
        """(n, nq) preferred postures: between those that are known, or the manner's."""
        if self.known is not None:
            return self.known.at(time)
        return reference_motion(self.body, self.trajectory, time, self.settings.manner)

    def _guide_com(self, time: FloatArray) -> FloatArray:
        """(k, 3) centre of mass of the guide postures; NaN where the body is safe without one."""
        com = self.trajectory.position(time)
        com[~self.trajectory.binds(time)] = np.nan
        return com

    def _knots(self, fine: bool = False) -> FloatArray:
        """Knots of the spline; fine ones let legs that are almost straight bend suddenly."""
        schedule = self.trajectory.schedule
        sudden = touch_downs_at_speed(schedule)
        knots = phase_knots(schedule.instants, self.settings.knot_spacing, DEGREE, sudden)
        return refined(knots, schedule.instants, DEGREE) if fine else knots

    def _targets(self, swings: tuple[PlannedSwing, ...], guide: Guide, knots: FloatArray) -> FitTargets:
        """What the fit has to do."""
        schedule, settings = self.trajectory.schedule, self.settings
        time = sample_times(knots, settings.samples_per_span)
        toes = toe_angles(self.body, swings, time)
        scale = np.tile(self.settings.manner.scale(self.body), (len(time), 1))
        reference = guide.at(time)
        straight = flat_share(self.body, schedule, time) if self.straight_toes else {}
        for joint, flat in straight.items():
            reference[:, 7 + joint] *= 1.0 - flat
            scale[:, 6 + joint] *= (FLAT_TOES / scale[:, 6 + joint]) ** flat
        scale[:, [6 + joint for joint in toes]] = FLAT_TOES
        return FitTargets(
            time=time,
            effectors=effector_targets(schedule, swings, time),
            com=self.trajectory.position(time),
            com_weight=np.where(self.trajectory.binds(time), 1.0, LOOSE_COM),
            com_acceleration=self.trajectory.acceleration(time),
            margin=self._planned_margins(time),
            reference=_with_joints(reference, toes),
            reference_scale=scale,
            ignored=ignored_pairs(self.body, self.scene, schedule, time),
            meeting=sliding_touchdown_at(self.body, self.scene, schedule, time),
        )

    def _sample(self, spline: ConfigurationSpline) -> tuple[Motion, FloatArray]:
        """The motion at 1 kHz with its whole-body pseudo-wrench (n, 6)."""
        schedule = self.trajectory.schedule
        count = max(2, round(float(schedule.instants[-1]) / self.settings.sampling) + 1)
        time = np.linspace(0.0, float(schedule.instants[-1]), count)
        return full_motion(self.body, schedule, self._polytopes, time, *spline.evaluate(time))

    @cached_property
    def _polytopes(self) -> list[WrenchPolytope]:
        """Of each phase, about the middle of its contacts."""
        return list(wrench_polytopes([phase.stance for phase in self.trajectory.schedule.sequence]))

    def _planned_margins(self, time: FloatArray) -> FloatArray:
        """(n,) margins of the planned centre of mass [N.m]."""
        schedule, com = self.trajectory.schedule, self.trajectory.position(time)
        wrench = pseudo_wrench(self.body.mass, com, self.trajectory.acceleration(time))
        stances = [phase.stance for phase in schedule.sequence]
        return motion_margin(stances, schedule.phase_at(time), wrench, com, polytopes=self._polytopes).margin

    def _failure(
        self, swings: tuple[PlannedSwing, ...], guide: Guide, table: RequirementTable
    ) -> WholeBodyFailure | None:
        broken = table.first_broken
        if broken is None:
            return None
        reason, time = broken.reason, broken.time_s or 0.0
        for item in swings:
            start, end = item.interval
            if item.failure is not None and start <= time <= end:
                reason = f"{reason}; swing of {item.swing.effector}: {item.failure}"
        near = [failure for failure in guide.failures if abs(failure.time - time) < 0.2]
        if near:
            reason = f"{reason}; posture at {near[0].time:.2f} s: {near[0].reason}"
        return WholeBodyFailure.at(self.trajectory.schedule, time, reason)

    def _report(self, share: float) -> None:
        if self._progress is not None:
            self._progress(share)


def _with_joints(configurations: FloatArray, angles: Mapping[int, FloatArray]) -> FloatArray:
    """Configurations (n, nq) with other angles (n,) of some joints."""
    changed = np.array(configurations)
    for joint, values in angles.items():
        changed[:, 7 + joint] = values
    return changed


def _is_caught(result: WholeBodyResult) -> bool:
    """Whether a part of the body is on the wrong side of another or of an obstacle."""
    return result.certificate.min_clearance_m < CAUGHT


def _better(first: WholeBodyResult, second: WholeBodyResult) -> WholeBodyResult:
    """Prefer a success; of two failures, the first."""
    return second if second.succeeded and not first.succeeded else first
