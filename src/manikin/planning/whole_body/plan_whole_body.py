"""Plan the whole-body motion of a centre-of-mass trajectory and its contacts.

Swings are smooth curves where that suffices and Bi-RRT paths where it does not ([Qiu2012]_ 6.2.3); guide
postures show the way; the whole body then follows contacts, swings and centre of mass as one spline.
"""

import time as clock
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import pairwise, product
from types import MappingProxyType

import numpy as np

from manikin.balance import WrenchPolytope, motion_margin, pseudo_wrench, wrench_polytopes
from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel
from manikin.body.configuration import Configuration
from manikin.body.limbs import end_segments, hanging_segment
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body.certificate import (
    MotionCertificate,
    WholeBodyFailure,
    WholeBodyRequirements,
    certify,
)
from manikin.planning.whole_body.fit_job import FitAttempt, FitJob, Progress, no_progress, split_spans
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import FitScales, MotionScales
from manikin.planning.whole_body.fit_targets import (
    FLAT_TOES,
    EffectorTarget,
    FitTargets,
    KeptDistances,
    effector_targets,
    flat_share,
    ignored_pairs,
    lay_toes_flat,
    toe_angles,
)
from manikin.planning.whole_body.handling import FREE_HANDS, Handling
from manikin.planning.whole_body.key_postures import KeyPostures
from manikin.planning.whole_body.posture_style import (
    CLOSE,
    READY,
    WALKING,
    Guide,
    PostureStyle,
    plan_guide,
    reference_motion,
)
from manikin.planning.whole_body.sliding_touchdown import Ignored, sliding_touchdown_at
from manikin.planning.whole_body.swing import SwingLimits
from manikin.planning.whole_body.swing_planner import (
    FlightPlanner,
    PlannedSwing,
    leaning_pairs,
    rolls_on_point,
)
from manikin.runtime.display import Displayed
from manikin.runtime.parallel import NO_DEADLINE, Deadline
from manikin.runtime.requirement import RequirementTable
from manikin.scene import Proximity, Scene

FIRST_DECREASE, LATER_DECREASE = 0.02, 0.005
"""Relative decrease of the objective below which the first repair stops, and a later one or a fit that begins
again."""

INEXACT = frozenset({"max_support_error_m", "max_support_turn_rad", "max_com_error_m"})
"""Broken requirements that a spline with more knots may keep."""

HELD_JOINT = 2.0e-3
"""Deviation of a joint that stays from its angle that costs one unit [rad]."""

STRENGTH_STEP = 0.05
"""By how much less of the strength a fit may use where the one before was too strong all the same."""

PENALTIES = MappingProxyType({
    "max_meeting_error_m": ("position",),
    "min_clearance_m": ("clearance",),
    "max_sinking_m": ("clearance",),
    "max_joint_limit_violation_rad": ("joint_limit",),
    "max_velocity_share": ("joint_velocity",),
    "max_missing_wrench": ("force", "moment_share"),
    "max_torque_share": ("torque_share",),
})  # fmt: skip
"""Scales that decide each residual of the certificate; contacts and centre of mass are constraints."""


@dataclass(frozen=True)
class WholeBodySettings:
    """Options of :func:`plan_whole_body`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        guide_spacing: Largest distance of the guide postures [s].
        sampling: Spacing of the finished motion's samples [s].
        manner: How the body carries itself where the task leaves freedom.
        deadline: After which nothing else is tried.
    """

    knot_spacing: float = 0.05
    samples_per_span: int = 3
    guide_spacing: float = 0.1
    sampling: float = 1.0e-3
    swing: SwingLimits = field(default_factory=SwingLimits)
    fit: FitScales = field(default_factory=FitScales)
    requirements: WholeBodyRequirements = field(default_factory=WholeBodyRequirements)
    manner: PostureStyle = READY
    deadline: Deadline = NO_DEADLINE


@dataclass(frozen=True, eq=False, repr=False)
class WholeBodyResult(Displayed):
    """A whole-body motion, or the best attempt and what it breaks.

    Attributes:
        trajectory: The plan that the motion follows: that which was given, or slower in parts.
        motion: Sampled at 1 kHz; of the best attempt when it failed.
        certificate: Measured on the samples of the motion, beside its limits.
        iterations: Gauss-Newton steps of the fit.
    """

    trajectory: CentroidalTrajectory
    motion: Motion
    spline: ConfigurationSpline
    certificate: MotionCertificate
    swings: tuple[PlannedSwing, ...]
    guide: Guide
    failure: WholeBodyFailure | None
    iterations: int
    wall_time: float

    @property
    def succeeded(self) -> bool:
        """Whether every requirement is kept."""
        return self.failure is None

    @property
    def requirements(self) -> RequirementTable:
        """Every requirement with its measured value."""
        return self.certificate.required


def plan_whole_body(
    body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory, *, rng: np.random.Generator,
    settings: WholeBodySettings | None = None, padded: Sequence[str] = (),
    known: Guide | None = None, waypoints: KeyPostures | None = None,
    handling: Handling = FREE_HANDS, progress: Progress | None = None,
) -> WholeBodyResult:  # fmt: skip
    """Find a whole-body motion that keeps contacts, centre of mass and distances.

    Args:
        trajectory: Planned centre of mass with its contacts in time; its soles are those
            that the forces act on.
        rng: Source of all randomness (the Bi-RRT).
        padded: Obstacles that any part of the body may lean on: it is kept off them where that is
            possible, but the certificate does not ask for it.
        known: Postures at the key instants, and perhaps in between, which the motion stays near; the
            manner's when omitted.
        waypoints: Postures of the plan's key instants, which lead the motion where one that is led by
            the manner is caught on the wrong side of an obstacle.
        handling: What the hands do, and the posture in which the motion begins.
        progress: Called now and then with the share done.

    Returns:
        The motion with its certificate. When the motion breaks a requirement, the fit goes on with more
        weight on it as long as that helps; where an arm is then too near to something, the arms are kept
        close to the body; where the limb in flight is, its flight is searched again with the Bi-RRT before
        the result is called a failure.
    """
    began = clock.perf_counter()
    led = waypoints.guide() if known is None and waypoints is not None else None
    leaning, tell = leaning_pairs(body, padded), progress or no_progress
    keys = [] if known is None else resting_keys(body, trajectory, known)
    if known is not None and len(keys) > 2:
        known = known.resting(trajectory.schedule.instants[keys])
    if known is not None and handling.begin is not None:
        known = known.through(trajectory.schedule.instants[0], handling.begin)
    settings = settings or WholeBodySettings()
    planner = _Planner(body, scene, trajectory, rng, settings, leaning, known, led, handling)
    if len(keys) > 2:
        return _in_parts(planner, keys, began, tell)
    return planner.run(planner.swings(), began, tell)


@dataclass(frozen=True, eq=False)
class _Goal:
    """Swings to follow, led by guide postures.

    Attributes:
        straight_toes: Whether toes are straight while their sole is held.
    """

    planner: "_Planner"
    swings: tuple[PlannedSwing, ...]
    guide: Guide
    manner: PostureStyle
    straight_toes: bool

    @property
    def schedule(self) -> ContactSchedule:
        """Contacts in time."""
        return self.planner.trajectory.schedule

    def objective(self, time: FloatArray, basis: SampledBasis, scales: MotionScales) -> MotionObjective:
        """Residuals at times (n,) [s]."""
        del scales
        return MotionObjective(self.planner.body, self.planner.proximity, self._targets(time), basis)

    def measure(self, spline: ConfigurationSpline) -> tuple[Motion, MotionCertificate]:
        """Sample a fitted motion and certify it."""
        planner, schedule = self.planner, self.schedule
        begin, end = planner.instants[[0, -1]].tolist()
        time = np.linspace(begin, end, max(2, round((end - begin) / planner.settings.sampling) + 1))
        motion, wrench = full_motion(planner.body, schedule, planner.polytopes, time, *spline.evaluate(time))
        ignored = planner.ignored(time)
        if planner.leaning:
            ignored = tuple(pairs | planner.leaning for pairs in ignored)
        return motion, certify(
            planner.body, planner.proximity, planner.trajectory, motion, ignored,
            KeptDistances.of_points(planner.body, planner.scene, schedule, time, planner.leaning), wrench,
            sliding_touchdown_at(planner.body, planner.scene, schedule, time), planner.polytopes,
            planner.settings.requirements,
        )  # fmt: skip

    def failure(self, certificate: MotionCertificate) -> WholeBodyFailure | None:
        """Reason why a motion to this goal is no success, or None."""
        broken = certificate.cause
        if broken is None:
            return None
        reason, time = broken.reason, broken.time_s or 0.0
        for item in self.swings:
            if item.failure is not None and item.interval[0] <= time <= item.interval[1]:
                reason += f"; swing of {item.swing.effector}: {item.failure}"
        for when, missed in [item for item in self.guide.failures if abs(item[0] - time) < 0.2][:1]:
            reason += f"; posture at {when:.2f} s: {missed}"
        return WholeBodyFailure.at(self.schedule, time, reason)

    def _targets(self, time: FloatArray) -> FitTargets:
        planner, schedule, trajectory = self.planner, self.schedule, self.planner.trajectory
        scale, reference = np.tile(self.manner.scale(planner.body), (len(time), 1)), self.guide.at(time)
        straight = flat_share(planner.body, schedule, time) if self.straight_toes else {}
        for joint, flat in straight.items():
            reference[:, 7 + joint] *= 1.0 - flat
            scale[:, 6 + joint] *= (FLAT_TOES / scale[:, 6 + joint]) ** flat
        lay_toes_flat(planner.toes(self.swings, time), reference, scale)
        reference = planner.handling.applied(planner.body, reference)
        scale[:, [6 + joint for joint in planner.handling.angles(planner.body)]] = HELD_JOINT
        return FitTargets(
            time, schedule, planner.effectors(self.swings, time), trajectory.position(time),
            # Importance of a centre of mass that only shows the way.
            com_weight=np.where(trajectory.binds(time), 1.0, 0.01),
            com_acceleration=trajectory.acceleration(time), margin=planner.planned_margins(time),
            reference=reference, reference_scale=scale,
            ignored=planner.ignored(time),
            meeting=sliding_touchdown_at(planner.body, planner.scene, schedule, time),
            loads=tuple(schedule.sequence[int(phase)].load for phase in schedule.phase_at(time)),
            ends=planner.ends, settles=planner.settles,
            kept=KeptDistances.of(planner.body, planner.scene, schedule, time, planner.leaning),
        )  # fmt: skip


Ends = tuple[FloatArray | None, FloatArray | None]
"""Postures (nq,) in which a motion begins and ends; None for any."""


class _Planner:
    """One planning job, with what its attempts share."""

    def __init__(
        self, body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory, rng: np.random.Generator,
        settings: WholeBodySettings, leaning: Ignored = frozenset(), known: Guide | None = None,
        waypoints: Guide | None = None, handling: Handling = FREE_HANDS,
    ) -> None:  # fmt: skip
        self.ends: Ends = (handling.begin, None)
        self.settles, self.rng, self.handling = handling.settles, rng, handling
        self.instants = trajectory.schedule.instants
        self.body, self.scene, self.trajectory, self.settings = body, scene, trajectory, settings
        self.leaning, self.known, self.waypoints = leaning, known, waypoints
        self.proximity = Proximity(body, scene)
        self.flights = FlightPlanner(
            body, scene, trajectory, settings.swing, rng,
            lambda time: self._reference(np.array([time]), settings.manner, known)[0],
        )  # fmt: skip
        self.job = FitJob(
            settings.knot_spacing, settings.samples_per_span, sudden=True, penalties=PENALTIES,
            patience=LATER_DECREASE, gives_up=True, deadline=settings.deadline,
        )  # fmt: skip
        self.guide = cache(self._guide)

    def part(self, first: int, last: int, ends: Ends) -> "_Planner":
        """The same job from one key instant to another, at rest at both, in given postures (nq,) or any.

        Its known postures lead on from that in which it begins, not from that which was planned there.
        """
        part = copy(self)
        part.ends, part.settles = ends, last < len(self.instants) - 1
        part.instants = self.instants[first : last + 1]
        if self.known is not None and ends[0] is not None:
            part.known = self.known.through(part.instants[0], ends[0])
        part.job, part.guide = replace(self.job, span=(first, last)), cache(part._guide)
        return part

    def slower(self, first: int, last: int, factor: float) -> "_Planner":
        """The same job with more time between two key instants at which the body rests."""
        trajectory = self.trajectory.slowed((first, last), factor)
        before, after = self.trajectory.schedule.instants, trajectory.schedule.instants
        known, waypoints = (
            None if guide is None else guide.retimed(before, after) for guide in (self.known, self.waypoints)
        )
        return _Planner(
            self.body, self.scene, trajectory, self.rng, self.settings, self.leaning, known, waypoints,
            self.handling,
        )  # fmt: skip

    def swings(self) -> tuple[PlannedSwing, ...]:
        """Every flight that the motion has to do with; a foot rolls in the phases beside its flight."""
        first, last = self.job.span or (0, len(self.trajectory.schedule.sequence))
        flights = self.flights.flights
        return tuple(
            self.flights.plan(swing)
            for swing in flights if swing.first_phase <= last and swing.last_phase >= first - 1
        )  # fmt: skip

    def run(self, swings: tuple[PlannedSwing, ...], began: float, progress: Progress) -> WholeBodyResult:
        """Fit a motion to the swings, in other manners or to other swings where it fails."""
        progress(0.2)
        manner, body = self.settings.manner, self.body
        arms = (_limb_of(body, name) for name in body.effectors if "hand" in name)
        hanging = (hanging_segment(body, body.effector(name).segment) for name in body.effectors)
        toes = [segment.name for segment in hanging if segment is not None]
        best = self._attempt(swings, manner, progress)
        # Raised arms may have to pass through a thigh, swinging ones through a wall.
        raised, late = manner in (READY, WALKING), self.settings.deadline
        if raised and best.is_too_near(frozenset[str]().union(*arms)) and not late.is_over:
            best = self.job.better(best, self._attempt(swings, CLOSE, progress))
        # Straight toes may be in the way of a flight; those of feet that roll are as the roll has them.
        straight = flat_share(body, self.trajectory.schedule, self.instants[:1]).keys()
        bends = bool(straight - self.toes(swings, self.instants[:1]).keys())
        if bends and best.is_too_near(toes) and not late.is_over:
            best = self.job.better(best, self._attempt(swings, manner, progress, straight_toes=False))
        searched = None if late.is_over else self._search_again(swings, best)
        if searched is not None:
            best = self.job.better(best, self._attempt(searched, manner, progress))
        progress(1.0)
        goal, failure = best.goal, best.goal.failure(best.certificate)
        return WholeBodyResult(
            self.trajectory, best.motion, best.result.spline, best.certificate, goal.swings, goal.guide,
            failure, best.result.iterations, clock.perf_counter() - began,
        )  # fmt: skip

    def _search_again(
        self, swings: tuple[PlannedSwing, ...], best: FitAttempt[_Goal]
    ) -> tuple[PlannedSwing, ...] | None:
        """Replace a smooth swing whose limb comes too near to something, when there is one."""
        time = best.certificate["min_clearance_m"].time_s or 0.0
        for index, item in enumerate(swings):
            smooth = item.method == "smooth" and not item.searched and item.roll is None
            # A clearance that is missed this close to a flight is put down to it [s].
            near = item.interval[0] - 0.05 <= time <= item.interval[1] + 0.05
            if smooth and near and best.is_too_near(_limb_of(self.body, item.swing.effector)):
                other = self.flights.search(item.swing, item)
                if other.method != item.method:
                    return (*swings[:index], other, *swings[index + 1 :])
        return None

    def _attempt(
        self, swings: tuple[PlannedSwing, ...], manner: PostureStyle, progress: Progress,
        straight_toes: bool = True,
    ) -> FitAttempt[_Goal]:  # fmt: skip
        """Fit a motion to the swings; where it misses a little, fit on with more weight on that.

        The first fit is led by the manner, or by the key postures where that one is caught. The fit has the
        last word on a guide: only where all are caught, one that missed many postures is sought again with
        restarts.
        """
        share = manner.moment_factor * self.settings.fit.moment_share
        scales, first = replace(self.settings.fit, moment_share=share), None
        ways = (self.known,) if self.waypoints is None else (self.known, self.waypoints)
        for restarts, known in product((False, True), ways):
            quick = self.guide(swings, manner, known, False)
            hopeless = restarts and len(quick.failures) <= 0.1 * len(quick.time)
            if hopeless or (first is not None and self.settings.deadline.is_over):
                continue
            goal = _Goal(self, swings, self.guide(swings, manner, known, restarts), manner, straight_toes)
            progress(0.4)
            attempt = self.job.attempt(goal, scales)
            progress(0.8)
            if not attempt.is_caught:
                first = attempt
                break
            first = first or attempt
        assert first is not None  # the first way is always tried
        return self.job.repair(first, self._remedy, 5)  # most fits with other weights

    def _remedy(self, number: int, last: FitAttempt[_Goal]) -> FitAttempt[_Goal] | None:
        """The next fit after one that breaks requirements; None where contacts stay out of reach."""
        goal, broken = last.goal, last.broken
        if last.is_caught:  # Fits that follow may have the finer knots again.
            return replace(self.job.restart(last), fine=last.fine)
        if last.is_fine and broken & INEXACT:
            return None
        exact, weak = INEXACT | last.unsampled, "max_torque_share" in broken
        if weak:  # where a contact made at speed still settles, only the momentum decides the torques
            when, names = last.certificate["max_torque_share"].time_s or 0.0, goal.schedule.sequence.effectors
            if any(goal.schedule.settling(when, name)[0] for name in names):
                broken |= {"max_missing_wrench"}
        scales = self.job.updated(last.scales, broken, narrow=number > 0)
        if weak:
            scales = replace(scales, strength_share=scales.strength_share - STRENGTH_STEP)
        if broken & exact:
            return self.job.attempt(goal, scales, last.finer(exact), last.result.spline)
        return self.job.improve(last, replace(scales, decrease=FIRST_DECREASE) if number == 0 else scales)

    def _guide(
        self, swings: tuple[PlannedSwing, ...], manner: PostureStyle, known: Guide | None, restarts: bool
    ) -> Guide:
        """The guide to the swings for a manner, a set of known postures and a way of search."""
        schedule = self.trajectory.schedule
        time = split_spans(self.instants, self.settings.guide_spacing)
        toes, reference = self.toes(swings, time), self._reference(time, manner, known)
        lay_toes_flat(toes, reference)
        reference, held = self.handling.applied(self.body, reference), self.handling.angles(self.body)
        # A guide that lags behind postures at rest at their ends would have to catch up there.
        exact = (*toes, *held) if known is None or known.rates is None else range(self.body.nq - 7)
        com = self.trajectory.position(time)
        com[~self.trajectory.binds(time)] = np.nan  # The body is safe without one.
        return plan_guide(
            self.body, self.proximity, schedule, time, self.effectors(swings, time), com,
            self.ignored(time), reference,
            self.settings.fit.safe_distance, manner, exact, restarts,
        )  # fmt: skip

    def ignored(self, time: FloatArray) -> tuple[Ignored, ...]:
        """Pairs that may touch at each time (n,) [s]: of contacts, and of hands with an object."""
        touches, pairs = self.handling.touches, ignored_pairs(
            self.body, self.scene, self.trajectory.schedule, time
        )  # fmt: skip
        return tuple(found | touches for found in pairs) if touches else pairs

    def effectors(self, swings: tuple[PlannedSwing, ...], time: FloatArray) -> dict[str, EffectorTarget]:
        """Target of every effector that has a task: on contacts, in flight, or on an object."""
        begin, end = self.trajectory.schedule.instants[[0, -1]].tolist()
        return effector_targets(self.trajectory.schedule, swings, time) | self.handling.targets(
            time, begin, end
        )

    def toes(self, swings: tuple[PlannedSwing, ...], time: FloatArray) -> dict[int, FloatArray]:
        """Angles (n,) of the joints of toes that stay flat [rad], see :func:`toe_angles`."""
        rolls = [(item.swing.effector, item.roll) for item in swings if item.roll is not None]
        return toe_angles(self.body, rolls, time)

    def _reference(self, time: FloatArray, manner: PostureStyle, known: Guide | None) -> FloatArray:
        """(n, nq) preferred postures: between those that are known, or the manner's."""
        return reference_motion(self.body, self.trajectory, time, manner) if known is None else known.at(time)

    @cached_property
    def polytopes(self) -> list[WrenchPolytope]:
        """Wrench polytope of each phase, about the middle of its contacts."""
        return list(wrench_polytopes([phase.stance for phase in self.trajectory.schedule.sequence]))

    def planned_margins(self, time: FloatArray) -> FloatArray:
        """(n,) margins of the planned centre of mass [N.m]."""
        schedule, com = self.trajectory.schedule, self.trajectory.position(time)
        wrench = pseudo_wrench(self.body.mass, com, self.trajectory.acceleration(time))
        if any(phase.load is not None for phase in schedule.sequence):
            wrench = self.trajectory.pseudo_wrench(time)
        stances = [phase.stance for phase in schedule.sequence]
        return motion_margin(stances, schedule.phase_at(time), wrench, com, polytopes=self.polytopes).margin


STILL, CLOSE_TO = (1.0e-3, 1.0e-2), 1.0e-3
"""Speed [m/s] and acceleration [m/s^2] of a centre of mass at rest, and its distance from that of a posture
in which the body rests there [m]."""


def resting_keys(body: BodyModel, trajectory: CentroidalTrajectory, known: Guide) -> list[int]:
    """Key instants at which the centre of mass of a crawl rests where a known posture has it; both ends too.

    Empty where nothing carries on a knee, a wrist or a tip, and where it does not bind to its end.
    """
    instants, phases = trajectory.schedule.instants, trajectory.schedule.sequence
    crawls = any(rolls_on_point(contact) for phase in phases for contact in phase.stance)
    if not crawls or trajectory.binding_until is not None:
        return []
    coms = np.array([Configuration(body, q).com for q in known.at(instants)])
    limits = (
        (trajectory.velocity(instants), STILL[0]), (trajectory.acceleration(instants), STILL[1]),
        (trajectory.position(instants) - coms, CLOSE_TO),
    )  # fmt: skip
    still = np.all([np.linalg.norm(values, axis=1) < limit for values, limit in limits], axis=0)
    still[[0, -1]] = True
    return np.flatnonzero(still).tolist()


SLOWER = (1.3, 1.7)
"""Factors on the time of a part that fails, tried in turn; our choice."""


def _in_parts(planner: _Planner, keys: Sequence[int], began: float, progress: Progress) -> WholeBodyResult:
    """Plan a motion in parts from rest to rest, and join them.

    A fit takes or leaves a step for the whole of its motion, and its repairs weigh all of it anew. A part
    ends in any posture of its contacts. The motion ends with a part that fails, as the failure is known.
    """
    parts, last = list[WholeBodyResult](), 0
    for first, last in pairwise(keys):
        progress(0.2 + 0.8 * first / keys[-1])
        planner, part = _with_time(planner, (first, last), (_end_of(parts), None), began)
        parts.append(part)
        if not part.succeeded:
            break
    spline = ConfigurationSpline.joined([part.spline for part in parts])
    guide = Guide.joined([part.guide for part in parts])
    flights = [item for part in parts for item in part.swings]
    # A flight near the end of a part is one of the next part, too.
    swings = {(one.swing.effector, one.swing.first_phase, one.swing.start is None): one for one in flights}
    whole = planner.part(keys[0], last, (None, None))
    goal = _Goal(whole, tuple(swings.values()), guide, planner.settings.manner, True)
    motion, certificate = goal.measure(spline)
    failure = goal.failure(certificate) or parts[-1].failure
    progress(1.0)
    return WholeBodyResult(
        planner.trajectory, motion, spline, certificate, goal.swings, guide, failure,
        sum(part.iterations for part in parts), clock.perf_counter() - began,
    )  # fmt: skip


def _end_of(parts: Sequence[WholeBodyResult]) -> FloatArray | None:
    """Posture (nq,) in which the last part ends; None without parts."""
    return parts[-1].spline.control_points[-1] if parts else None


def _with_time(
    planner: _Planner, span: tuple[int, int], ends: Ends, began: float
) -> tuple[_Planner, WholeBodyResult]:
    """Plan a part between postures (nq,), with more time where it fails; the job at its timing."""
    part = planner.part(*span, ends)
    first = part.run(part.swings(), began, no_progress)
    phases = planner.trajectory.schedule.sequence.phases[slice(*span)]
    if first.succeeded or any(phase.max_duration is not None for phase in phases):
        return planner, first
    for factor in SLOWER:
        if planner.settings.deadline.is_over:
            break
        slower = planner.slower(*span, factor)
        part = slower.part(*span, ends)
        other = part.run(part.swings(), began, no_progress)
        if other.succeeded:
            return slower, other
    return planner, first


def _limb_of(body: BodyModel, effector: str) -> frozenset[str]:
    """Names of the segments of the limb that ends in an effector, with what hangs on it."""
    limbs = (limb.segments for limb in body.limbs if limb.effector == effector)
    return frozenset(end_segments(body, effector)).union(*limbs)
