"""Refine a sequence of key configurations into a smooth motion that keeps to physics ([Tonneau2015]_ 7.3).

The third stage of the thesis hands the contact sequence to a trajectory optimisation (ITOMP) and reports that
this "is not fully functional"; the optimisation here is our own, with the terms of 7.3.1 and 7.3.2 on the
whole-body fit.  A fit that breaks a requirement is repeated with other weights, knots, contacts or timing.
"""

import json
import time as clock
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.motion_forces import full_motion
from manikin.body import BodyModel
from manikin.contact import ContactSchedule, StanceSequence
from manikin.kinematics.efort import Task
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.motion.description import describe_schedule
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.planning.whole_body.certificate import (
    CAUGHT,
    MotionCertificate,
    RefineRequirements,
    WholeBodyFailure,
    WholeBodyRequirements,
    certify_refined,
)
from manikin.planning.whole_body.contact_variables import VariableChoice, Variables, VariableSamples
from manikin.planning.whole_body.fit import DEGREE, spline_through
from manikin.planning.whole_body.fit_job import FitAttempt, FitJob, Progress, no_progress
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import MotionScales, RefineScales
from manikin.planning.whole_body.refine_input import (
    ROUNDS,
    KeyPath,
    around,
    check_input,
    retime,
    shortening,
    stretched,
    stretched_around,
    stretched_for_speed,
)
from manikin.planning.whole_body.refine_measures import (
    STEP,
    RefineMeasures,
    RefineObstacles,
    balance_of,
    measure,
    rooms_of,
    sample_uniformly,
)
from manikin.planning.whole_body.refine_objective import RefineObjective, refine_targets
from manikin.planning.whole_body.refine_physics import contact_slack
from manikin.runtime.display import Displayed
from manikin.runtime.parallel import NO_DEADLINE, Deadline
from manikin.runtime.requirement import Requirement, RequirementTable
from manikin.scene import Proximity, Scene

REPAIRS = 5
"""Most fits that follow a failed one with other weights, knots or timing."""

_SLOWED = MappingProxyType({
    "max_velocity_share": 1.3, "max_physics_violation": 1.3, "min_margin": 1.3, "max_torque_share": 1.6,
})  # fmt: skip
"""Broken requirements that a slower motion may keep, and by how much longer its phase gets."""

_EXACT = frozenset({"max_support_error_m", "max_support_turn_rad"})
"""Broken requirements that a spline with more knots may keep."""

PENALTIES = MappingProxyType({
    "min_clearance_m": ("clearance",),
    "max_penetration_m": ("clearance", "touching"),
    "max_sinking_m": ("clearance",),
    "max_joint_limit_violation_rad": ("joint_limit",),
    "max_velocity_share": ("joint_velocity",),
    "max_physics_violation": ("missing_wrench", "margin_violation"),
    "min_margin": ("margin_violation", "missing_wrench"),
})  # fmt: skip
"""Scales that decide each residual of the certificate; contacts are constraints."""


@dataclass(frozen=True)
class RefineSettings:
    """Options of :func:`refine_motion`.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        sampling: Spacing of the finished motion's samples, at which it is certified [s].
        retime: Whether the motion may be slowed down.
        friction_share, sole_share: Shares of the friction, and of the soles' length and width, with which the
            margin is wanted; the certificate has all of them.
        contact_variables: Whether contacts that the motion does not need, and whose effectors are not there,
            are let go; else all contacts of the sequence are held.
        speed_share: Share of the velocity limits up to which phases are shortened, as far as every
            requirement is kept; None leaves them as they are.
        deadline: After which nothing is repaired or shortened.
    """

    knot_spacing: float = 0.1
    samples_per_span: int = 3
    sampling: float = 5.0e-3
    scales: RefineScales = field(default_factory=RefineScales)
    requirements: WholeBodyRequirements = field(default_factory=RefineRequirements)
    retime: bool = True
    friction_share: float = 0.8
    sole_share: float = 0.8
    contact_variables: bool = True
    speed_share: float | None = None
    deadline: Deadline = NO_DEADLINE

    def __post_init__(self) -> None:
        if self.speed_share is not None:
            finite_number(self.speed_share, "refinement speed_share", above=0.0, at_most=1.0)


@dataclass(frozen=True, eq=False, repr=False)
class RefineResult(Displayed):
    """A refined motion, or the best attempt and what it breaks.

    Attributes:
        motion: Densely sampled; its time begins where the input's does.
        schedule: The contacts in the motion's own time, without those that were let go.
        before: The input at the motion's own timing, joined by interpolation.
        smoothed: The spline through the input from which the optimisation begins.
        requirements: What the certificate and the contacts' limits were held against.
        contact_slack: Room that all limits of the contacts have in common, the least at samples 10 ms
            apart, by linear programs, see :func:`.contact_slack` [N, N.m].
        variables: Of each phase, the contact variable of each contact of the input's sequence, in [0, 1].
        released: Phase and effector of every contact that was let go.
        stretch: Duration of the motion relative to the input's.
    """

    motion: Motion
    spline: ConfigurationSpline
    schedule: ContactSchedule
    before: RefineMeasures
    smoothed: RefineMeasures
    after: RefineMeasures
    certificate: MotionCertificate
    requirements: RequirementTable
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


@dataclass(frozen=True, eq=False)
class _RefineGoal:
    """Keys and contacts at one timing, or a part of them.

    Attributes:
        span: Key instants from which and to which the part lasts.
        ends: Postures in which the body rests there; None where it only comes to rest.
    """

    job: "Refinement"
    path: KeyPath
    schedule: ContactSchedule
    span: tuple[int, int]
    ends: tuple[FloatArray | None, FloatArray | None] = (None, None)

    @property
    def is_whole(self) -> bool:
        """Whether the part is all of it."""
        return self.span == (0, len(self.schedule.sequence))

    @property
    def content(self) -> str:
        """What is done in the part, whenever it begins, to 1e-9 s, m and rad, and what is held beside it."""
        first, last = self.span
        instants, keys = self.schedule.instants[first : last + 1], self.path.time
        begin, end = self.interval
        inside = (keys > begin + 1e-9) & (keys < end - 1e-9)
        around = self.schedule.sequence.phases[max(first - 1, 0) : last + 1]
        phases = ContactSchedule(StanceSequence(around), np.arange(len(around) + 1.0))
        postures = np.vstack([self.path.at(instants), self.path.q[inside]])
        return json.dumps([
            describe_schedule(phases)["phases"], (instants - begin).round(9).tolist(),
            (keys[inside] - begin).round(9).tolist(), postures.round(9).tolist(),
            [end is None for end in self.ends], first > 0, self.job.padded,
        ])  # fmt: skip

    @property
    def interval(self) -> tuple[float, float]:
        """When the part begins and ends [s]."""
        begin, end = self.schedule.instants[list(self.span)].tolist()
        return begin, end

    def objective(self, time: FloatArray, basis: SampledBasis, scales: MotionScales) -> MotionObjective:
        """Residuals at times (n,) [s]."""
        assert isinstance(scales, RefineScales)
        job = self.job
        targets = refine_targets(
            job.body, job.scene, self.path, self.schedule, time, scales, job.task, job.padded, job.variables
        )
        targets = replace(targets, ends=self.ends)
        wanted = job.rooms(self.schedule.sequence, job.settings.friction_share, job.settings.sole_share)
        return RefineObjective(job.body, job.proximity, targets, basis, wanted)

    def measure(self, spline: ConfigurationSpline) -> tuple[Motion, MotionCertificate]:
        """Sample a motion and certify it."""
        job, schedule, rooms = self.job, self.schedule, self.job.rooms(self.schedule.sequence)
        time = sample_uniformly(*self.interval, job.settings.sampling)
        polytopes = [room.polytope for room in rooms]
        motion, wrench = full_motion(job.body, schedule, polytopes, time, *spline.evaluate(time))
        balance, violation = balance_of(schedule, rooms, time, wrench, motion.com)
        obstacles = RefineObstacles(job.body, job.scene, schedule, time, job.padded)
        return motion, certify_refined(
            job.body, job.proximity, schedule, obstacles, motion, violation, balance,
            [room.is_flat for room in rooms], job.settings.requirements,
        )  # fmt: skip

    def samples(self, spline: ConfigurationSpline | None = None) -> VariableSamples:
        """Samples of a motion, or of the keys at rest, for the choice of the contacts."""
        body, names = self.job.body, self.schedule.sequence.effectors
        time = sample_uniformly(*self.interval, 0.03)
        if spline is not None:
            return VariableSamples.of(body, names, time, spline.evaluate(time))
        still, path = np.zeros((len(time), body.nv)), self.path
        keys = path.time, path.q, np.zeros((len(path.q), body.nv))
        return VariableSamples.of(body, names, time, (path.at(time), still, still), keys)


FittedParts = dict[str, FitAttempt[_RefineGoal]]
"""Parts from rest to rest that were fitted, by what their fits follow from."""


class Refinement:
    """One job, with what its attempts share.

    Args:
        padded: Obstacles that any part of the body may lean on.

    Attributes:
        variables: Of each phase, the contact variables of its effectors, as chosen last.
        rooms: Wrench polytopes of a sequence with shares of friction and soles, see :func:`.rooms_of`.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, settings: RefineSettings, task: Task | None,
        padded: tuple[str, ...],
    ) -> None:  # fmt: skip
        self.body, self.scene, self.settings, self.task, self.padded = body, scene, settings, task, padded
        self.proximity = Proximity(body, scene)
        self.variables: Variables = ()
        self.rooms = cache(rooms_of)
        self._job = FitJob(
            # Relative decrease of the objective below which a repair stops.
            settings.knot_spacing, settings.samples_per_span, penalties=PENALTIES, patience=0.004,
            by_count=True, deadline=settings.deadline,
        )  # fmt: skip
        self._choice = VariableChoice(
            # An effector this near its contact is meant to be there: exactness is for the repairs [m].
            body, scene, settings.scales, max(settings.requirements.support_error, 0.02),
            settings.friction_share,
        )  # fmt: skip

    def run(
        self, path: KeyPath, schedule: ContactSchedule, rests: Sequence[int], fitted: FittedParts,
        began: float, progress: Progress,
    ) -> RefineResult:  # fmt: skip
        """Fit, repair and measure; the wall time counts from a reading of the clock [s].

        A motion that rests at key instants is fitted part by part, and ends with the first part that fails.
        Parts that were fitted before are taken over.
        """
        count, known = len(schedule.sequence), path.at(schedule.instants)
        self.variables = tuple(dict.fromkeys(phase.stance.effectors, 1.0) for phase in schedule.sequence)
        goal = _RefineGoal(self, path, schedule, (0, count))
        if self.settings.retime:
            share = self.settings.scales.velocity_share
            goal = _RefineGoal(self, *stretched_for_speed(self.body, path, schedule, share), goal.span)
        parts = list[FitAttempt[_RefineGoal]]()
        for first, last in pairwise([0, *rests, count]):
            ends = known[first] if first > 0 else None, known[last] if last < count else None
            self._job = replace(self._job, span=(first, last))
            done = partial(self._done, progress, schedule, (first, last))
            parts.append(self._part(replace(goal, span=(first, last), ends=ends), fitted, done))
            goal = parts[-1].goal
            if parts[-1].broken:
                break
        progress(1.0)
        return self._result(parts, path.duration, schedule, began)

    @staticmethod
    def _done(progress: Progress, schedule: ContactSchedule, span: tuple[int, int], share: float) -> None:
        """Tell the share of the whole that is done with a share of a part."""
        start, *ends = schedule.instants[[0, *span, -1]].tolist()
        progress((ends[0] - start + share * (ends[1] - ends[0])) / (ends[2] - start))

    def _part(self, goal: _RefineGoal, known: FittedParts, progress: Progress) -> FitAttempt[_RefineGoal]:
        """The best motion of a part: that of the same part in another plan if it holds here, or a new one."""
        if goal.is_whole:
            return self._fitted(goal, progress)
        content = goal.content
        part = self._taken_over(goal, known[content]) if content in known else None
        if part is None or part.broken:
            part = self._fitted(goal, progress)
        if not part.broken:
            known[content] = part
        return part

    @staticmethod
    def _taken_over(goal: _RefineGoal, found: FitAttempt[_RefineGoal]) -> FitAttempt[_RefineGoal]:
        """The same part of another plan, in the time of this one, measured anew."""
        first, last = goal.span
        before = goal.schedule.instants
        its = found.goal.schedule.instants[found.goal.span[0] : found.goal.span[1] + 1]
        mine = before[first] + its - its[0]
        after = np.concatenate([before[:first], mine, mine[-1] + before[last + 1 :] - before[last]])
        path, schedule = retime(goal.path, goal.schedule, before, after)
        goal, spline = replace(goal, path=path, schedule=schedule), _retimed(found.result.spline, its, mine)
        motion, certificate = goal.measure(spline)
        result = found.result._replace(spline=spline)
        return replace(found, goal=goal, result=result, motion=motion, certificate=certificate)

    def _fitted(self, goal: _RefineGoal, progress: Progress) -> FitAttempt[_RefineGoal]:
        """The best motion of a part that was found."""
        if self._chooses(goal):
            goal = self._chosen(goal, goal.samples())
        first = self._job.attempt(goal, self.settings.scales)
        best = self._job.repair(first, partial(self._remedy, progress), REPAIRS)
        if self.settings.speed_share is not None and not best.broken:
            best = self._hurried(best, self.settings.speed_share)
        return best

    def _chooses(self, goal: _RefineGoal) -> bool:
        """Whether contacts may be let go: the postures at the ends of a part have them all."""
        return self.settings.contact_variables and goal.is_whole

    def _remedy(
        self, progress: Progress, number: int, last: FitAttempt[_RefineGoal]
    ) -> FitAttempt[_RefineGoal] | None:
        """The next fit after one that breaks requirements: other contacts, weights, timing or knots.

        None for a part that is caught a second time: in the postures at its ends it will stay so.
        """
        progress((number + 1) / (REPAIRS + 1))
        goal, job, broken = last.goal, self._job, last.broken
        if self._chooses(goal):
            chosen = self._chosen(goal, goal.samples(last.result.spline), goal.samples())
            if chosen is not goal:
                return job.attempt(chosen, last.scales, last.fine)
        caught = last.certificate.value("max_penetration_m") > CAUGHT
        if caught and number > 0 and not last.goal.is_whole:
            return None
        if last.is_caught:
            return job.restart(last, last.fine)
        scales = job.updated(last.scales, broken)
        weak = "max_torque_share" in broken
        # Weights may find the strength; where they do not, time does.
        waits = weak and number < 2
        slower = number > 0 and self.settings.retime and not waits and bool(broken & _SLOWED.keys())
        if last.is_fine and len(last.fine) > 1 and broken <= _EXACT:  # is out of reach
            return None
        # Rounds in which knots are doubled: two, or three where the first two are for the clearance.
        more = len(last.fine) < (2 if last.is_fine else 3)
        fine = last.finer(_EXACT | last.unsampled) if more else last.fine
        if not slower and fine == last.fine:
            return job.improve(last, scales)
        near = last.result.spline
        if slower:
            goal = self._slower(last)
            near = _retimed(near, last.goal.schedule.instants, goal.schedule.instants)
        return job.attempt(goal, scales, fine, near)

    def _hurried(self, best: FitAttempt[_RefineGoal], share: float) -> FitAttempt[_RefineGoal]:
        """Shorten phases round by round; what breaks a requirement is taken back where it does."""
        first, last = best.goal.span
        settled = frozenset(range(len(best.goal.schedule.sequence))) - frozenset(range(first, last))
        for _ in range(ROUNDS):
            goal = best.goal
            factors = shortening(self.body, best.motion, goal.schedule, share, settled)
            if np.all(factors == 1.0) or self.settings.deadline.is_over:
                break
            path, schedule = stretched(goal.path, goal.schedule, factors)
            shorter = replace(goal, path=path, schedule=schedule)
            near = _retimed(best.result.spline, goal.schedule.instants, shorter.schedule.instants)
            trial = self._job.attempt(shorter, best.scales, best.fine, near)
            if trial.broken:
                times = (trial.certificate[key].time_s or 0.0 for key in trial.broken)
                settled = settled.union(*(around(shorter.schedule, time) for time in times))
            else:
                best = trial
        return best

    def _chosen(
        self, goal: _RefineGoal, samples: VariableSamples, resting: VariableSamples | None = None
    ) -> _RefineGoal:
        """Choose the contact variables for a motion; another goal where a contact was let go."""
        chosen, kept = self._choice.choose(goal.schedule, samples, resting)
        self.variables = tuple({**old, **new} for old, new in zip(self.variables, chosen, strict=True))
        return goal if kept is goal.schedule else replace(goal, schedule=kept)

    def _slower(self, last: FitAttempt[_RefineGoal]) -> _RefineGoal:
        """Give the worst phase more time."""
        path, schedule = last.goal.path, last.goal.schedule
        for name in sorted(last.broken & _SLOWED.keys()):
            worst = last.certificate[name].time_s or 0.0
            when = float(np.interp(worst, last.goal.schedule.instants, schedule.instants))
            path, schedule = stretched_around(path, schedule, when, _SLOWED[name], last.goal.span)
        return replace(last.goal, path=path, schedule=schedule)

    def _result(
        self, parts: Sequence[FitAttempt[_RefineGoal]], duration: float, given: ContactSchedule, began: float
    ) -> RefineResult:
        """Measures of the input, of a spline through it and of the motion, and the verdict.

        Args:
            parts: One after the other.
            duration: Of the input [s].
            given: Contacts of the input.
        """
        whole, last = parts[-1].goal, parts[-1].goal.span[1]
        given, schedule = _until(given, last), _until(whole.schedule, last)
        motion, certificate = parts[-1].motion, parts[-1].certificate
        spline, path = parts[-1].result.spline, whole.path
        if len(parts) > 1:
            spline = ConfigurationSpline.joined([part.result.spline for part in parts])
            motion, certificate = _RefineGoal(self, path, schedule, (0, last)).measure(spline)
        time = sample_uniformly(float(schedule.instants[0]), float(schedule.instants[-1]), STEP)
        obstacles = RefineObstacles(self.body, self.scene, schedule, time, self.padded)
        knots = replace(self._job, span=None).knots(schedule)
        fitted, basis = self._job.samples(knots)
        smoothed = spline_through(path.at(fitted), basis, knots)
        before, start, after = (
            measure(
                self.body, self.proximity, obstacles, path, schedule, self.rooms(schedule.sequence), time,
                samples, self.task,
            )
            for samples in (path.at(time), smoothed.evaluate(time).q, spline.evaluate(time).q)
        )  # fmt: skip
        slacks = contact_slack(schedule, time, centroidal_motion(self.body, *spline.evaluate(time)).wrench)
        worst = int(np.argmin(slacks))
        slack, when = float(slacks[worst]), float(time[worst])
        # Without contact forces that balance the body it is negative, but for rounding.
        room = Requirement(
            "min_contact_slack", "least slack of the contacts' limits", "N, N.m", slack, ">=", 0.0, when,
            tolerance=1e-6,
        )  # fmt: skip
        table = RequirementTable((*certificate.required, room))
        # What a part broke that ends before its limb is there, that alone.
        broken, failure = parts[-1].certificate.cause or table.first_broken, None
        if broken is not None:
            failure = WholeBodyFailure.at(schedule, broken.time_s or 0.0, broken.reason)
        released = tuple(
            (number, name)
            for number, (one, kept) in enumerate(zip(given.sequence, schedule.sequence, strict=True))
            for name in one.stance.effectors if name not in kept.stance
        )  # fmt: skip
        return RefineResult(
            motion, spline, schedule, before, start, after, certificate, table, slack, failure,
            self.variables[:last], released, path.duration / duration, self._job.iterations,
            clock.perf_counter() - began,
        )  # fmt: skip


def _until(schedule: ContactSchedule, last: int) -> ContactSchedule:
    """The first phases of a schedule, up to a key instant."""
    if last == len(schedule.sequence):
        return schedule
    return ContactSchedule(StanceSequence(schedule.sequence.phases[:last]), schedule.instants[: last + 1])


def _retimed(spline: ConfigurationSpline, before: FloatArray, after: FloatArray) -> ConfigurationSpline:
    """A spline, or a part of one, with instants before at others (k,) [s]."""
    return ConfigurationSpline(np.interp(spline.knots, before, after), spline.control_points, DEGREE)


def refine_motion(
    body: BodyModel, scene: Scene, time: ArrayLike, q: ArrayLike, schedule: ContactSchedule, *,
    settings: RefineSettings | None = None, task: Task | None = None, padded: Sequence[str] = (),
    rests: Sequence[int] = (), fitted: FittedParts | None = None, progress: Progress | None = None,
) -> RefineResult:  # fmt: skip
    """Turn key configurations and their contacts into a smooth motion in balance and without collision.

    Args:
        time: (n,) times of the key configurations [s].
        q: (n, nq) key configurations, joined by interpolation.
        schedule: Which effector holds which contact when, over the same interval; full soles only.
        task: Direction of EFORT; the pelvis' displacement in each phase when omitted (7.9).
        padded: Obstacles that any part of the body may lean on.
        rests: Key instants inside at which the body rests in its key configuration, all contacts held.
        fitted: Parts from rest to rest that were fitted for other plans of the same body, scene and settings;
            takes new ones up.
        progress: Called now and then with the share done.

    Returns:
        The motion with its certificate and the measures of every term before and after.  Where a
        requirement breaks, its weight grows, the spline gets more knots, or the phase lasts longer.
        A motion with rests that fails ends at the rest after that.

    Raises:
        InputError: If keys, contacts and body do not fit each other.
        ContactError: If nothing bounds the normal force of a contact, or it lies on no obstacle.
    """
    began = clock.perf_counter()
    path = KeyPath(time, q)
    check_input(body, path, schedule)
    settings = settings or RefineSettings(scales=RefineScales.of(body))
    return Refinement(body, scene, settings, task, tuple(padded)).run(
        path, schedule, rests, {} if fitted is None else fitted, began, progress or no_progress
    )
