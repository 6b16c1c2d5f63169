"""Refine a sequence of key configurations into a smooth motion that keeps to physics ([Tonneau2015]_ 7.3).

The third stage of the thesis hands the contact sequence to a trajectory optimisation (ITOMP) and reports that
this "is not fully functional"; the optimisation here is our own, with the terms of 7.3.1 and 7.3.2 on the
machine of the whole-body fit: one quintic spline, analytic Gauss-Newton steps, contacts made exact by
multipliers.
"""

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.contact_planning.efort import Task
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray, finite_number
from manikin.wholebody.banded import SampledBasis
from manikin.wholebody.configuration_spline import ConfigurationSpline
from manikin.wholebody.contact_slack import contact_slack
from manikin.wholebody.failure import WholeBodyFailure
from manikin.wholebody.fit import FitResult, MotionFit, spline_through
from manikin.wholebody.forces import plan_forces
from manikin.wholebody.knots import phase_knots, refined, sample_times
from manikin.wholebody.objective import MotionObjective
from manikin.wholebody.refine_balance import BalanceRoom
from manikin.wholebody.refine_certificate import RefineRequirements, RefineResiduals, certify_refined
from manikin.wholebody.refine_input import KeyPath, check_input, stretched_around, stretched_for_speed
from manikin.wholebody.refine_measures import (
    STEP,
    RefineMeasures,
    balance_of,
    measure,
    rooms_of,
    sample_uniformly,
    whole_body_wrench,
)
from manikin.wholebody.refine_objective import RefineObjective, RefineTargets, refine_targets
from manikin.wholebody.refine_obstacles import RefineObstacles
from manikin.wholebody.refine_scales import RefineScales
from manikin.wholebody.refine_timing import ROUNDS, around, shortened, shortening
from manikin.wholebody.refine_variables import VariableChoice, Variables, VariableSamples, released
from manikin.wholebody.reweigh import stronger

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

PATIENT = 0.004
"""Relative decrease of the objective below which a repair stops."""

Progress = Callable[[float], None]
"""Told the share of the work that is done, in [0, 1]."""


@dataclass(frozen=True)
class RefineSettings:
    """Options of :func:`refine_motion`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        samples_per_span: Samples between two knots.
        sampling: Spacing of the finished motion's samples, at which it is certified [s].
        scales: Weights and limits of the fit.
        requirements: What the finished motion must keep.
        retime: Whether the motion may be slowed down.
        friction_share: Share of the friction with which the margin is wanted; the certificate has all of it.
        contact_variables: Whether contacts that the motion does not need, and whose effectors are not there,
            are let go; else all contacts of the sequence are held.
        speed_share: Share of the velocity limits up to which phases are shortened, as far as every
            requirement is kept and no joint needs more than its strength, or than before; None leaves them as
            they are.
    """

    knot_spacing: float = 0.1
    samples_per_span: int = 3
    sampling: float = 5.0e-3
    scales: RefineScales = field(default_factory=RefineScales)
    requirements: RefineRequirements = field(default_factory=RefineRequirements)
    retime: bool = True
    friction_share: float = 0.8
    contact_variables: bool = True
    speed_share: float | None = None

    def __post_init__(self) -> None:
        if self.speed_share is not None:
            share = finite_number(self.speed_share, "refinement speed_share", above=0.0)
            if share > 1.0:
                raise InputError(f"refinement speed_share is {share:g}; valid: at most 1")


@dataclass(frozen=True, eq=False)
class RefineResult:
    """A refined motion, or the best attempt and what it breaks.

    Attributes:
        motion: Densely sampled; its time begins where the input's does.
        spline: The motion in closed form.
        schedule: The contacts in the motion's own time, without those that were let go.
        before: The input at the motion's own timing, joined by interpolation.
        smoothed: The spline through the input from which the optimisation begins.
        after: The refined motion.
        certificate: Measured on the samples of the motion.
        contact_slack: Room that all limits of the contacts have in common, the least at samples 10 ms
            apart, by linear programs, see :mod:`manikin.wholebody.contact_slack` [N, N.m].
        failure: Why it is no success, or None.
        variables: Of each phase, the contact variable of each contact of the input's sequence, in [0, 1].
        released: Phases and effectors of the contacts that were let go.
        stretch: Duration of the motion relative to the input's.
        iterations: Gauss-Newton steps.
        wall_time: [s].
    """

    motion: Motion
    spline: ConfigurationSpline
    schedule: ContactSchedule
    before: RefineMeasures
    smoothed: RefineMeasures
    after: RefineMeasures
    certificate: RefineResiduals
    contact_slack: float
    failure: WholeBodyFailure | None
    variables: Variables
    released: tuple[tuple[int, str], ...]
    stretch: float
    iterations: int
    wall_time: float

    @property
    def succeeded(self) -> bool:
        """Whether every requirement is kept."""
        return self.failure is None


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
    job = _Refinement(
        body,
        scene,
        path,
        schedule,
        settings or RefineSettings(scales=RefineScales.of(body)),
        task,
        tuple(padded),
    )
    return job.run(began, progress or _silent)


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


class _Refinement:
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
            broken = last.certificate.broken(self.settings.requirements)
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
        if self.settings.speed_share is not None and not best.certificate.broken(self.settings.requirements):
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
            required = self._strong(best)
            broken = trial.certificate.broken(required)
            if broken:
                blamed = (around(trial.schedule, trial.certificate.worst_times_s[name]) for name in broken)
                settled = settled.union(*blamed)
                self.path, self.schedule = best.path, best.schedule
            else:
                best = trial
        return best

    def _strong(self, attempt: _Attempt) -> RefineRequirements:
        """The requirements, with no more of the joints' strength than an attempt needs, or all of it."""
        required = self.settings.requirements
        share = max(1.0, attempt.certificate.max_torque_share)
        return replace(required, torque_share=min(share, required.torque_share or share))

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
        return self._judged(last.fit, last.fit.improve(last.spline, scales))

    def _judged(self, fit: MotionFit, found: FitResult) -> _Attempt:
        self.iterations += found.iterations
        motion, certificate = self._certified(found.spline)
        return _Attempt(self.path, self.schedule, fit, found.spline, motion, certificate)

    def _objective(self, targets: RefineTargets) -> Callable[..., MotionObjective]:
        def make(
            body: BodyModel, proximity: Proximity | None, _: object, basis: SampledBasis
        ) -> MotionObjective:
            return RefineObjective(body, proximity, targets, basis, self.wanted_rooms)

        return make

    @cached_property
    def rooms(self) -> tuple[BalanceRoom, ...]:
        """Wrench polytope of each phase."""
        return rooms_of(self.schedule)

    @cached_property
    def wanted_rooms(self) -> tuple[BalanceRoom, ...]:
        """The same with the share of the friction with which the margin is wanted."""
        return rooms_of(self.schedule, self.settings.friction_share)

    @cached_property
    def _choice(self) -> VariableChoice:
        tolerance = self.settings.requirements.support_error
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

    def _certified(self, spline: ConfigurationSpline) -> tuple[Motion, RefineResiduals]:
        """Sample a spline and measure it."""
        schedule = self.schedule
        time = sample_uniformly(schedule, self.settings.sampling)
        q, v, a = spline.evaluate(time)
        forces = plan_forces(self.body, schedule, time, q, v, a)
        wrench = whole_body_wrench(self.body, q, v, a)
        _, violation = balance_of(schedule, self.rooms, time, wrench)
        names = schedule.sequence.effectors
        com, momentum = self._centroidal(q, v)
        motion = Motion(
            time=time, q=q, v=v, a=a, tau=forces.tau, com=com, angular_momentum=momentum,
            margin=self._margin(time, wrench), support=schedule.support(time, names),
            contact_force=forces.contact_force, contact_names=names, joint_names=self.body.joint_names,
        )  # fmt: skip
        obstacles = RefineObstacles(self.body, self.scene, schedule, time, self.padded)
        flat = tuple(room.is_flat for room in self.rooms)
        certificate = certify_refined(self.body, self.proximity, schedule, obstacles, motion, violation, flat)
        return motion, certificate

    def _margin(self, time: FloatArray, wrench: FloatArray) -> FloatArray:
        """(n,) margin about the world origin, as of every motion [N.m]."""
        phases = self.schedule.phase_at(time)
        margin = np.zeros(len(time))
        for number, room in enumerate(self.rooms):
            rows = phases == number
            margin[rows] = room.polytope.at_reference(np.zeros(3)).margin(wrench[rows])
        return margin

    def _centroidal(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Centre of mass (n, 3) and angular momentum about it (n, 3)."""
        model, data = self.body.pinocchio, self.body.pinocchio.createData()
        com, momentum = np.zeros((len(q), 3)), np.zeros((len(q), 3))
        for k in range(len(q)):
            pin.computeCentroidalMomentum(model, data, q[k], v[k])
            com[k], momentum[k] = data.com[0], data.hg.angular
        return com, momentum

    def _better(self, first: _Attempt, second: _Attempt) -> _Attempt:
        """The one that breaks fewer requirements; of two alike, the later one."""
        required = self.settings.requirements
        fewer = len(first.certificate.broken(required)) < len(second.certificate.broken(required))
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
        slack, when = self._slack(found, time)
        violation = found.certificate.violation(self.settings.requirements)
        if violation is None and slack < LEAST_SLACK:
            violation = f"least slack of the contacts' limits is {slack:.4g}; allowed 0", when
        failure = None
        if violation is not None:
            reason, when = violation
            failure = WholeBodyFailure.at(schedule, when, reason)
        return RefineResult(
            found.motion, found.spline, schedule, before, start, after, found.certificate, slack, failure,
            self.variables, tuple(released(self.given, schedule)), path.duration / given, self.iterations,
            clock.perf_counter() - began,
        )  # fmt: skip

    def _slack(self, found: _Attempt, time: FloatArray) -> tuple[float, float]:
        """Least slack of the contacts' limits, and when [s]."""
        wrench = whole_body_wrench(self.body, *found.spline.evaluate(time))
        slack = contact_slack(found.schedule, time, wrench)
        worst = int(np.argmin(slack))
        return float(slack[worst]), float(time[worst])


_SLOWED = frozenset({"max_velocity_share", "max_physics_violation", "min_margin"})
"""Broken requirements that a slower motion may keep."""

_EXACT = frozenset({"max_support_error_m", "max_support_turn_rad"})
"""Broken requirements that a spline with more knots may keep."""

_SCALES = MappingProxyType(
    {
        "max_support_error_m": ("tolerance",),
        "max_support_turn_rad": ("turn_tolerance",),
        "min_clearance_m": ("clearance",),
        "max_penetration_m": ("clearance", "touching"),
        "max_joint_limit_violation_rad": ("joint_limit",),
        "max_velocity_share": ("joint_velocity",),
        "max_physics_violation": ("missing_wrench", "margin_violation"),
        "min_margin": ("margin_violation", "missing_wrench"),
    }
)
"""Scales that decide each field of the certificate."""


def _reweighed(scales: RefineScales, broken: frozenset[str]) -> RefineScales:
    """Scales at which the broken requirements weigh more, and more patience."""
    return replace(stronger(scales, broken, _SCALES), decrease=PATIENT)


def _silent(share: float) -> None:
    del share
