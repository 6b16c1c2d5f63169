"""Refine a sequence of key configurations into a smooth motion that keeps to physics ([Tonneau2015]_ 7.3).

The third stage of the thesis hands the contact sequence to a trajectory optimisation (ITOMP) and reports that
this "is not fully functional"; the optimisation here is our own, with the terms of 7.3.1 and 7.3.2 on the
machine of the whole-body fit: one quintic spline, analytic Gauss-Newton steps, contacts made exact by
multipliers.

Also here. The fits of one refinement: other weights, knots, contacts or timing, until nothing is broken.
"""

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.numerics.banded import SampledBasis
from manikin.planning.contacts.efort import Task
from manikin.planning.whole_body.contact_variables import VariableChoice, Variables, VariableSamples, released
from manikin.planning.whole_body.fit import FitResult, MotionFit, spline_through, stronger
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.fit_targets import phase_knots, refined, sample_times
from manikin.planning.whole_body.refine_certificate import (
    Progress,
    RefineResiduals,
    RefineResult,
    RefineSettings,
    certified_motion,
    least_slack,
)
from manikin.planning.whole_body.refine_input import (
    ROUNDS,
    KeyPath,
    around,
    check_input,
    shortened,
    shortening,
    stretched_around,
    stretched_for_speed,
)
from manikin.planning.whole_body.refine_measures import (
    STEP,
    RefineObstacles,
    measure,
    rooms_of,
    sample_uniformly,
)
from manikin.planning.whole_body.refine_objective import RefineObjective, RefineTargets, refine_targets
from manikin.planning.whole_body.refine_physics import MarginCost
from manikin.planning.whole_body.whole_body_certificate import WholeBodyFailure
from manikin.runtime.requirement import Requirement, RequirementTable
from manikin.scene import Proximity, Scene

DEGREE = 5
"""Degree of the spline: four continuous derivatives."""

REPAIRS = 5
"""Most fits that follow a failed one with other weights, knots or timing."""

SLOWER = 1.3
"""Factor by which a phase gets longer in which balance or speed is missed again."""

FINEST = 2
"""How often the spline's knots near the key instants are doubled at most."""

CAUGHT = -0.02
"""Below this clearance a part of the body is caught on the wrong side of another: the fit begins anew [m]."""

LEAST_SLACK = -1e-6
"""Slack of the contacts' limits below which no contact forces balance the body: 0 but for rounding."""

SPARSE = 0.03
"""Spacing of the samples for which the contact variables are chosen [s]."""

NEARLY = 0.02
"""An effector this near its contact is meant to be there: that it is so exactly is for the repairs [m]."""

PATIENT = 0.004
"""Relative decrease of the objective below which a repair stops."""

_SLOWED = frozenset({"max_velocity_share", "max_physics_violation", "min_margin", "max_torque_share"})
"""Broken requirements that a slower motion may keep."""

_EXACT = frozenset({"max_support_error_m", "max_support_turn_rad"})
"""Broken requirements that a spline with more knots may keep."""

_SCALES = MappingProxyType(
    {
        "max_support_error_m": ("tolerance", "position", "rotation"),
        "max_support_turn_rad": ("turn_tolerance", "position", "rotation"),
        "min_clearance_m": ("clearance",),
        "max_penetration_m": ("clearance", "touching"),
        "max_joint_limit_violation_rad": ("joint_limit",),
        "max_velocity_share": ("joint_velocity",),
        "max_physics_violation": ("missing_wrench", "margin_violation"),
        "min_margin": ("margin_violation", "missing_wrench"),
        "max_torque_share": ("force",),
    }
)
"""Scales that decide each field of the certificate."""


@dataclass(frozen=True, eq=False)
class _Attempt:
    """One fit with its measured motion.

    Attributes:
        path: The input at the motion's timing.
        schedule: Its contacts.
        fit: What was solved.
        spline: What it found.
        motion: Its samples.
        certificate: Measured on them.
    """

    path: KeyPath
    schedule: ContactSchedule
    fit: MotionFit
    spline: ConfigurationSpline
    motion: Motion
    certificate: RefineResiduals


class Refinement:
    """One job, with what its steps share."""

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        path: KeyPath,
        schedule: ContactSchedule,
        settings: RefineSettings,
        task: Task | None,
        padded: tuple[str, ...],
    ) -> None:
        self.body, self.scene, self.path, self.schedule = body, scene, path, schedule
        self.settings, self.task, self.padded = settings, task, padded
        self.proximity = Proximity(body, scene)
        self.given = schedule
        self.variables: Variables = tuple(
            dict.fromkeys(phase.stance.effectors, 1.0) for phase in schedule.sequence
        )
        self.iterations = 0

    def run(self, began: float, progress: Progress) -> RefineResult:
        """Fit, repair and measure.

        Args:
            began: Reading of the clock from which the wall time counts [s].
            progress: Told the share of the fits that are done.
        """
        given = self.path.duration
        if self.settings.retime:
            share = self.settings.scales.velocity_share
            self.path, self.schedule = stretched_for_speed(self.body, self.path, self.schedule, share)
        if self.settings.contact_variables:
            self._choose(self._at_rest())
        scales, fine = self.settings.scales, 0
        best = last = self._attempt(scales, fine)
        for number in range(REPAIRS):
            progress((number + 1) / (REPAIRS + 1))
            broken = last.certificate.table(self.settings.requirements).broken
            if not broken:
                break
            if self.settings.contact_variables and self._choose(self._moving(last), self._at_rest()):
                last = self._attempt(scales, fine)
                best = self._better(best, last)
                continue
            if last.certificate.min_clearance_m < CAUGHT:
                scales = _reweighed(scales, broken & {"min_clearance_m"})
                last = self._attempt(scales, fine)
                best = self._better(best, last)
                continue
            scales = _reweighed(scales, broken)
            slower = number > 0 and self.settings.retime and bool(broken & _SLOWED)
            finer = fine < FINEST and bool(broken & _EXACT)
            if slower or finer:
                fine += finer
                near = self._slow_down(last, broken) if slower else last.spline
                last = self._attempt(scales, fine, near)
            else:
                last = self._improved(last, scales)
            best = self._better(best, last)
            if best is not last and best.schedule.sequence is last.schedule.sequence:
                last, self.path, self.schedule = best, best.path, best.schedule
        if (
            self.settings.speed_share is not None
            and not best.certificate.table(self.settings.requirements).broken
        ):
            best = self._hurried(best, scales, fine, self.settings.speed_share)
        progress(1.0)
        return self._result(best, given, began)

    def _hurried(self, best: _Attempt, scales: RefineScales, fine: int, share: float) -> _Attempt:
        """Shorten phases round by round; what breaks a requirement is taken back where it does."""
        settled = frozenset[int]()
        for _ in range(ROUNDS):
            factors = shortening(self.body, best.motion, best.schedule, share, settled)
            if np.all(factors == 1.0):
                break
            self.path, self.schedule = shortened(best.path, best.schedule, factors)
            trial = self._attempt(scales, fine, self._retimed(best.spline, best.schedule))
            broken = trial.certificate.table(self.settings.requirements).broken
            if broken:
                blamed = (around(trial.schedule, trial.certificate.worst_times_s[name]) for name in broken)
                settled = settled.union(*blamed)
                self.path, self.schedule = best.path, best.schedule
            else:
                best = trial
        return best

    def _retimed(self, spline: ConfigurationSpline, before: ContactSchedule) -> ConfigurationSpline:
        """A spline in the time of the present schedule."""
        knots = np.interp(spline.knots, before.instants, self.schedule.instants)
        return ConfigurationSpline(knots, spline.control_points, DEGREE)

    def _attempt(self, scales: RefineScales, fine: int, near: ConfigurationSpline | None = None) -> _Attempt:
        knots = phase_knots(self.schedule.instants, self.settings.knot_spacing, DEGREE)
        for _ in range(fine):
            knots = refined(knots, self.schedule.instants, DEGREE)
        time = sample_times(knots, self.settings.samples_per_span)
        targets = refine_targets(
            self.body,
            self.scene,
            self.path,
            self.schedule,
            time,
            scales,
            self.task,
            self.padded,
            self.variables,
        )
        fit = MotionFit(
            self.body, self.proximity, targets.fit, knots, DEGREE, scales, self._objective(targets)
        )
        start = fit.initial_spline(targets.fit.reference if near is None else near.evaluate(time).q)
        found = fit.solve(start) if near is None else fit.improve(start, scales)
        return self._judged(fit, found)

    def _improved(self, last: _Attempt, scales: RefineScales) -> _Attempt:
        """Go on with other weights."""
        last.fit.rescale(scales)
        return self._judged(last.fit, last.fit.improve(last.spline, scales))

    def _judged(self, fit: MotionFit, found: FitResult) -> _Attempt:
        self.iterations += found.iterations
        motion, certificate = certified_motion(
            self.body, self.scene, self.proximity, self.schedule, self.rooms, found.spline,
            self.settings.sampling, self.padded,
        )  # fmt: skip
        return _Attempt(self.path, self.schedule, fit, found.spline, motion, certificate)

    def _objective(self, targets: RefineTargets) -> Callable[..., MotionObjective]:
        def make(
            body: BodyModel, proximity: Proximity | None, _: object, basis: SampledBasis
        ) -> MotionObjective:
            return RefineObjective(body, proximity, targets, basis, self.wanted_rooms)

        return make

    @cached_property
    def rooms(self) -> tuple[MarginCost, ...]:
        """Wrench polytope of each phase."""
        return rooms_of(self.schedule)

    @cached_property
    def wanted_rooms(self) -> tuple[MarginCost, ...]:
        """The same with the share of the friction with which the margin is wanted."""
        return rooms_of(self.schedule, self.settings.friction_share)

    @cached_property
    def _choice(self) -> VariableChoice:
        tolerance = max(self.settings.requirements.support_error, NEARLY)
        return VariableChoice(
            self.body, self.scene, self.settings.scales, tolerance, self.settings.friction_share
        )

    def _at_rest(self) -> VariableSamples:
        """What the keys say about the contacts, before there is a motion."""
        path, names = self.path, self.schedule.sequence.effectors
        time = sample_uniformly(self.schedule, SPARSE)
        return VariableSamples.at_rest(self.body, names, (path.time, path.q), (time, path.at(time)))

    def _moving(self, attempt: _Attempt) -> VariableSamples:
        """What a motion says about them."""
        time = sample_uniformly(attempt.schedule, SPARSE)
        names = attempt.schedule.sequence.effectors
        return VariableSamples.of_motion(self.body, names, time, attempt.spline.evaluate(time))

    def _choose(self, samples: VariableSamples, resting: VariableSamples | None = None) -> bool:
        """Choose the contact variables for a motion; whether a contact was let go."""
        chosen, kept = self._choice.choose(self.schedule, samples, resting)
        self.variables = tuple({**old, **new} for old, new in zip(self.variables, chosen, strict=True))
        if kept is self.schedule:
            return False
        self.schedule = kept
        for name in ("rooms", "wanted_rooms"):
            self.__dict__.pop(name, None)
        return True

    def _slow_down(self, last: _Attempt, broken: frozenset[str]) -> ConfigurationSpline:
        """Give the worst phase more time; the last spline at the new timing."""
        before = self.schedule
        for name in sorted(broken & _SLOWED):
            when = last.certificate.worst_times_s[name]
            when = float(np.interp(when, before.instants, self.schedule.instants))
            self.path, self.schedule = stretched_around(self.path, self.schedule, when, SLOWER)
        return self._retimed(last.spline, before)

    def _better(self, first: _Attempt, second: _Attempt) -> _Attempt:
        """The one that breaks fewer requirements; of two alike, the later one."""
        required = self.settings.requirements
        fewer = len(first.certificate.table(required).broken) < len(second.certificate.table(required).broken)
        return first if fewer else second

    def _result(self, found: _Attempt, given: float, began: float) -> RefineResult:
        schedule, path, rooms = found.schedule, found.path, rooms_of(found.schedule)
        time = sample_uniformly(schedule, STEP)
        obstacles = RefineObstacles(self.body, self.scene, schedule, time, self.padded)
        knots = phase_knots(schedule.instants, self.settings.knot_spacing, DEGREE)
        input_samples = path.at(time)
        fitted = sample_times(knots, self.settings.samples_per_span)
        basis = SampledBasis.at(fitted, knots, DEGREE)
        smoothed = spline_through(path.at(fitted), basis, knots, DEGREE).evaluate(time).q
        before, start, after = (
            measure(self.body, self.proximity, obstacles, path, schedule, rooms, time, samples, self.task)
            for samples in (input_samples, smoothed, found.spline.evaluate(time).q)
        )
        slack, when = least_slack(self.body, schedule, found.spline, time)
        table = RequirementTable((
            *found.certificate.table(self.settings.requirements),
            Requirement("min_contact_slack", "least slack of the contacts' limits", "N, N.m", slack, ">=",
                        0.0, when, tolerance=-LEAST_SLACK),
        ))  # fmt: skip
        broken, failure = table.first_broken, None
        if broken is not None:
            failure = WholeBodyFailure.at(schedule, broken.time_s or 0.0, broken.reason)
        return RefineResult(
            found.motion, found.spline, schedule, before, start, after, found.certificate, table, slack,
            failure, self.variables, tuple(released(self.given, schedule)), path.duration / given,
            self.iterations, clock.perf_counter() - began,
        )  # fmt: skip


def _reweighed(scales: RefineScales, broken: frozenset[str]) -> RefineScales:
    """Scales at which the broken requirements weigh more, and more patience."""
    return replace(stronger(scales, broken, _SCALES), decrease=PATIENT)


def refine_motion(
    body: BodyModel,
    scene: Scene,
    time: ArrayLike,
    q: ArrayLike,
    schedule: ContactSchedule,
    *,
    settings: RefineSettings | None = None,
    task: Task | None = None,
    padded: Sequence[str] = (),
    progress: Progress | None = None,
) -> RefineResult:
    """Turn key configurations and their contacts into a smooth motion in balance and without collision.

    Args:
        body: The body.
        scene: The obstacles and the floor.
        time: (n,) times of the key configurations [s].
        q: (n, nq) key configurations, joined by interpolation.
        schedule: Which effector holds which contact when, over the same interval; full soles only.
        settings: Options.
        task: Direction of EFORT; the pelvis' displacement in each phase when omitted (7.9).
        padded: Obstacles that any part of the body may lean on.
        progress: Called now and then with the share done.

    Returns:
        The motion with its certificate and the measures of every term before and after.  Where a
        requirement breaks, its weight grows, the spline gets more knots, or the phase lasts longer.

    Raises:
        InputError: If keys, contacts and body do not fit each other.
        ContactError: If nothing bounds the normal force of a contact, or it lies on no obstacle.
    """
    began = clock.perf_counter()
    path = KeyPath(time, q)
    check_input(body, path, schedule)
    job = Refinement(
        body,
        scene,
        path,
        schedule,
        settings or RefineSettings(scales=RefineScales.of(body)),
        task,
        tuple(padded),
    )
    return job.run(began, progress or _silent)


def _silent(share: float) -> None:
    del share
