"""Refine a sequence of key configurations into a smooth motion that keeps to physics ([Tonneau2015]_ 7.3).

The third stage of the thesis hands the contact sequence to a trajectory optimisation (ITOMP) and reports that
this "is not fully functional"; the optimisation here is our own, with the terms of 7.3.1 and 7.3.2 on the
whole-body fit: one quintic spline, analytic Gauss-Newton steps, contacts made exact by multipliers.  A fit
that breaks a requirement is repeated with other weights, knots, contacts or timing.
"""

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import ContactSchedule, StanceSequence
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.efort import Task
from manikin.planning.whole_body.contact_variables import VariableChoice, Variables, VariableSamples, released
from manikin.planning.whole_body.fit import DEGREE, spline_through
from manikin.planning.whole_body.fit_job import FitAttempt, FitJob, Progress, no_progress
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import MotionScales, RefineScales
from manikin.planning.whole_body.refine_certificate import (
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
from manikin.planning.whole_body.refine_objective import RefineObjective, refine_targets
from manikin.planning.whole_body.refine_physics import MarginCost
from manikin.planning.whole_body.whole_body_certificate import WholeBodyFailure
from manikin.runtime.requirement import Requirement, RequirementTable
from manikin.scene import Proximity, Scene

REPAIRS = 5
"""Most fits that follow a failed one with other weights, knots or timing."""

SLOWER = 1.3
"""Factor by which a phase gets longer in which balance or speed is missed again."""

FINEST = 2
"""How often the spline's knots near the key instants are doubled at most."""

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

PENALTIES = MappingProxyType(
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
class _Goal:
    """Keys and contacts at one timing.

    Attributes:
        job: The refinement that it belongs to.
        path: The keys.
        schedule: Contacts in time.
    """

    job: "Refinement"
    path: KeyPath
    schedule: ContactSchedule

    def objective(self, time: FloatArray, basis: SampledBasis, scales: MotionScales) -> MotionObjective:
        """Residuals at times (n,) [s]."""
        assert isinstance(scales, RefineScales)
        job = self.job
        targets = refine_targets(
            job.body, job.scene, self.path, self.schedule, time, scales, job.task, job.padded, job.variables
        )
        wanted = job.rooms(self.schedule, job.settings.friction_share)
        return RefineObjective(job.body, job.proximity, targets, basis, wanted)

    def measure(self, spline: ConfigurationSpline) -> tuple[Motion, RefineResiduals, RequirementTable]:
        """Sample a motion and certify it."""
        job = self.job
        motion, certificate = certified_motion(
            job.body, job.scene, job.proximity, self.schedule, job.rooms(self.schedule), spline,
            job.settings.sampling, job.padded,
        )  # fmt: skip
        return motion, certificate, certificate.table(job.settings.requirements)

    def at_rest(self) -> VariableSamples:
        """What the keys say about the contacts, before there is a motion."""
        time = sample_uniformly(self.schedule, SPARSE)
        return VariableSamples.at_rest(
            self.job.body, self.schedule.sequence.effectors, (self.path.time, self.path.q),
            (time, self.path.at(time)),
        )  # fmt: skip

    def moving(self, spline: ConfigurationSpline) -> VariableSamples:
        """What a motion says about the contacts."""
        time = sample_uniformly(self.schedule, SPARSE)
        names = self.schedule.sequence.effectors
        return VariableSamples.of_motion(self.job.body, names, time, spline.evaluate(time))


class Refinement:
    """One job, with what its attempts share.

    Args:
        body: The body.
        scene: Its surroundings.
        settings: Options.
        task: Direction of EFORT, or None.
        padded: Obstacles that any part of the body may lean on.

    Attributes:
        variables: Of each phase, the contact variables of its effectors, as chosen last.
    """

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        settings: RefineSettings,
        task: Task | None,
        padded: tuple[str, ...],
    ) -> None:
        self.body, self.scene, self.settings, self.task, self.padded = body, scene, settings, task, padded
        self.proximity = Proximity(body, scene)
        self.variables: Variables = ()
        self._rooms: dict[tuple[StanceSequence, float], tuple[MarginCost, ...]] = {}
        self._job = FitJob(
            settings.knot_spacing, settings.samples_per_span, penalties=PENALTIES, patience=PATIENT,
            by_count=True, rescaled=True,
        )  # fmt: skip
        self._choice = VariableChoice(
            body, scene, settings.scales, max(settings.requirements.support_error, NEARLY),
            settings.friction_share,
        )  # fmt: skip

    def run(self, path: KeyPath, schedule: ContactSchedule, began: float, progress: Progress) -> RefineResult:
        """Fit, repair and measure.

        Args:
            path: Key configurations.
            schedule: Contacts in time.
            began: Reading of the clock from which the wall time counts [s].
            progress: Called with the share of the fits that are done.
        """
        goal = _Goal(self, path, schedule)
        self.variables = tuple(dict.fromkeys(phase.stance.effectors, 1.0) for phase in schedule.sequence)
        if self.settings.retime:
            share = self.settings.scales.velocity_share
            goal = _Goal(self, *stretched_for_speed(self.body, path, schedule, share))
        if self.settings.contact_variables:
            goal = self._chosen(goal, goal.at_rest())

        def remedy(number: int, last: FitAttempt[_Goal]) -> FitAttempt[_Goal]:
            progress((number + 1) / (REPAIRS + 1))
            return self._remedy(number, last)

        best = self._job.repair(self._job.attempt(goal, self.settings.scales), remedy, REPAIRS)
        if self.settings.speed_share is not None and not best.broken:
            best = self._hurried(best, self.settings.speed_share)
        progress(1.0)
        return self._result(best, path.duration, schedule, began)

    def rooms(self, schedule: ContactSchedule, friction_share: float = 1.0) -> tuple[MarginCost, ...]:
        """Wrench polytope of each phase, with a share of the friction."""
        key = schedule.sequence, friction_share
        if key not in self._rooms:
            self._rooms[key] = rooms_of(schedule, friction_share)
        return self._rooms[key]

    def _remedy(self, number: int, last: FitAttempt[_Goal]) -> FitAttempt[_Goal]:
        """The next fit after one that breaks requirements: other contacts, weights, timing or knots."""
        goal, job, broken = last.goal, self._job, last.broken
        if self.settings.contact_variables:
            chosen = self._chosen(goal, goal.moving(last.result.spline), goal.at_rest())
            if chosen is not goal:
                return job.attempt(chosen, last.scales, last.fine)
        if last.is_caught:
            return job.restart(last, last.fine)
        scales = job.updated(last.scales, broken)
        slower = number > 0 and self.settings.retime and bool(broken & _SLOWED)
        fine = last.fine + (last.fine < FINEST and bool(broken & _EXACT))
        if not slower and fine == last.fine:
            return job.improve(last, scales)
        near = last.result.spline
        if slower:
            goal = self._slower(last)
            near = _retimed(near, last.goal.schedule, goal.schedule)
        return job.attempt(goal, scales, fine, near)

    def _hurried(self, best: FitAttempt[_Goal], share: float) -> FitAttempt[_Goal]:
        """Shorten phases round by round; what breaks a requirement is taken back where it does."""
        settled = frozenset[int]()
        for _ in range(ROUNDS):
            goal = best.goal
            factors = shortening(self.body, best.motion, goal.schedule, share, settled)
            if np.all(factors == 1.0):
                break
            shorter = _Goal(self, *shortened(goal.path, goal.schedule, factors))
            near = _retimed(best.result.spline, goal.schedule, shorter.schedule)
            trial = self._job.attempt(shorter, best.scales, best.fine, near)
            if trial.broken:
                times = trial.certificate.worst_times_s
                settled = settled.union(*(around(shorter.schedule, times[name]) for name in trial.broken))
            else:
                best = trial
        return best

    def _chosen(self, goal: _Goal, samples: VariableSamples, resting: VariableSamples | None = None) -> _Goal:
        """Choose the contact variables for a motion; another goal where a contact was let go."""
        chosen, kept = self._choice.choose(goal.schedule, samples, resting)
        self.variables = tuple({**old, **new} for old, new in zip(self.variables, chosen, strict=True))
        return goal if kept is goal.schedule else replace(goal, schedule=kept)

    def _slower(self, last: FitAttempt[_Goal]) -> _Goal:
        """Give the worst phase more time."""
        before, path, schedule = last.goal.schedule, last.goal.path, last.goal.schedule
        for name in sorted(last.broken & _SLOWED):
            when = float(np.interp(last.certificate.worst_times_s[name], before.instants, schedule.instants))
            path, schedule = stretched_around(path, schedule, when, SLOWER)
        return _Goal(self, path, schedule)

    def _result(
        self, found: FitAttempt[_Goal], duration: float, given: ContactSchedule, began: float
    ) -> RefineResult:
        """Measures of the input, of a spline through it and of the motion, and the verdict.

        Args:
            found: The best attempt.
            duration: Of the input [s].
            given: Contacts of the input.
            began: Reading of the clock from which the wall time counts [s].
        """
        schedule, path, spline = found.goal.schedule, found.goal.path, found.result.spline
        time = sample_uniformly(schedule, STEP)
        obstacles = RefineObstacles(self.body, self.scene, schedule, time, self.padded)
        knots = self._job.knots(schedule)
        fitted, basis = self._job.samples(knots)
        smoothed = spline_through(path.at(fitted), basis, knots)
        before, start, after = (
            measure(
                self.body, self.proximity, obstacles, path, schedule, self.rooms(schedule), time, samples,
                self.task,
            )
            for samples in (path.at(time), smoothed.evaluate(time).q, spline.evaluate(time).q)
        )  # fmt: skip
        slack, when = least_slack(self.body, schedule, spline, time)
        table = RequirementTable((
            *found.requirements,
            Requirement("min_contact_slack", "least slack of the contacts' limits", "N, N.m", slack, ">=",
                        0.0, when, tolerance=-LEAST_SLACK),
        ))  # fmt: skip
        broken, failure = table.first_broken, None
        if broken is not None:
            failure = WholeBodyFailure.at(schedule, broken.time_s or 0.0, broken.reason)
        return RefineResult(
            found.motion, spline, schedule, before, start, after, found.certificate, table, slack, failure,
            self.variables, tuple(released(given, schedule)), path.duration / duration,
            self._job.iterations, clock.perf_counter() - began,
        )  # fmt: skip


def _retimed(
    spline: ConfigurationSpline, before: ContactSchedule, after: ContactSchedule
) -> ConfigurationSpline:
    """A spline in the time of another schedule."""
    knots = np.interp(spline.knots, before.instants, after.instants)
    return ConfigurationSpline(knots, spline.control_points, DEGREE)


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
    settings = settings or RefineSettings(scales=RefineScales.of(body))
    return Refinement(body, scene, settings, task, tuple(padded)).run(
        path, schedule, began, progress or no_progress
    )
