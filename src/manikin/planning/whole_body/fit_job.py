"""The fit of one whole-body spline: knots, samples, repairs of what it misses, the better attempt.

The motion along a planned centre of mass, the refinement of key configurations and the adaptation of a
recording are three goals of the same job; each gives its objective, and the first two measure the result.
"""

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.configuration_spline import ConfigurationSpline
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.certificate import MotionCertificate
from manikin.planning.whole_body.fit import DEGREE, FitResult, MotionFit, spline_through
from manikin.planning.whole_body.fit_objective import MotionObjective
from manikin.planning.whole_body.fit_scales import MotionScales
from manikin.runtime.parallel import NO_DEADLINE, Deadline
from manikin.scene.distance import segment_of

CLEARANCE = frozenset({"min_clearance_m"})
"""Key of the clearance in a certificate."""

DIP = 1e-3
"""Least by which a clearance between two samples is below those at both, to ask for more samples [m]."""

FORCES = frozenset({"max_missing_wrench", "max_torque_share"})
"""Keys of the requirements on forces. A first fit does not know the strength, and has sudden momentum."""

MOST_ASTRAY, MUCH_EXCESS, A_LOT, UNCHANGED = 10.0, 4.0, 0.6, 0.02
"""Excess, but of forces, of a fit of which no repair is tried: its contacts, or their times, are not the
body's. Excess above which a repair has to help a lot, and the share of it that it may leave then. Relative
change of what is missed most by which a repair has moved anything."""

STRONGER, NEARER, LEAST_SAFE_DISTANCE = 0.5, 0.75, 0.014
"""Factor of the scales of what was missed; factor of the wanted clearance where the required one is missed,
and the wanted clearance that this leaves [m]: more than the required one."""

SUDDEN_KNOTS = np.array([-0.09, -0.06, -0.035, -0.015, 0.015, 0.035, 0.06, 0.09, 0.13])
"""Knots added around a touch-down at speed, relative to it [s]."""

CLOSEST_KNOTS = 4.0e-3
"""Knots closer than this are one [s]."""

Places = tuple[tuple[float, ...], ...]
"""Groups of instants as phases with the share of them that is over: they stay where phases last longer."""

S = TypeVar("S", bound=MotionScales)

Progress = Callable[[float], None]
"""Takes the share of the work that is done, in [0, 1]."""


def no_progress(share: float) -> None:
    """Ignore the share of the work that is done."""
    del share


class FitGoal(Protocol):
    """Contacts and residuals that a spline is fitted to."""

    @property
    def schedule(self) -> ContactSchedule:
        """Contacts in time."""
        ...

    def objective(self, time: FloatArray, basis: SampledBasis, scales: MotionScales) -> MotionObjective:
        """Residuals at times (n,) [s] of a spline with this basis there."""
        ...


class MeasuredGoal(FitGoal, Protocol):
    """Goal of a fit whose result can be measured."""

    def measure(self, spline: ConfigurationSpline) -> tuple[Motion, MotionCertificate]:
        """Dense samples of a motion, and what was measured on them."""
        ...


G = TypeVar("G", bound=MeasuredGoal)


@dataclass(frozen=True, eq=False)
class FitAttempt(Generic[G]):
    """One fit with its measured motion.

    Attributes:
        fine: Where the knots were doubled, once for each group of places.
        continued: Whether it went on from an earlier spline.
        fit: The solver, with its multipliers and damping.
        certificate: Measured on them, beside its limits.
    """

    goal: G
    scales: MotionScales
    fine: Places
    continued: bool
    fit: MotionFit
    result: FitResult
    motion: Motion
    certificate: MotionCertificate

    @property
    def broken(self) -> frozenset[str]:
        """Keys of the requirements that do not hold."""
        return self.certificate.broken

    @property
    def excess(self) -> float:
        """Sum of how far requirements are broken, see :meth:`.MotionCertificate.excess`."""
        return self.certificate.excess(self.broken)

    @property
    def astray(self) -> float:
        """The excess of all requirements but those on forces."""
        return self.certificate.excess(self.broken - FORCES)

    def is_too_near(self, segments: Collection[str]) -> bool:
        """Whether the clearance that is missed is one of these segments'."""
        near = {segment_of(shape) for shape in self.certificate.closest_pair}
        return bool(self.broken & CLEARANCE) and not near.isdisjoint(segments)

    @property
    def unsampled(self) -> frozenset[str]:
        """The clearance, if it is missed between the samples of the fit alone: no weight finds that."""
        worst = self.certificate.worst(CLEARANCE)
        if worst is None or worst.time_s is None:
            return frozenset()
        seen = self.fit.clearance_beside(self.result.spline, worst.time_s)
        return CLEARANCE if seen - worst.measured > DIP else frozenset()

    @property
    def is_fine(self) -> bool:
        """Whether the knots near all key instants were doubled."""
        return any(len(places) >= len(self.goal.schedule.instants) for places in self.fine)

    def finer(self, keys: Collection[str]) -> Places:
        """:attr:`fine` with the places where most is missed of some requirements that are broken.

        The first time that something else than the clearance is missed, the key instants are added. More
        knots where nothing is missed cost time and change nothing.
        """
        asked = frozenset(keys)
        others, clearance = (self.certificate.worst(some) for some in (asked - CLEARANCE, asked & CLEARANCE))
        found = [row for row in (others, clearance) if row is not None]
        if not found:
            return self.fine
        schedule = self.goal.schedule
        whole = () if others is None or self.is_fine else key_instants(schedule)
        numbers = np.arange(len(schedule.instants))
        places = np.interp([row.time_s or 0.0 for row in found], schedule.instants, numbers)
        return (*self.fine, (*whole, *places.tolist()))

    def is_stuck_after(self, before: "FitAttempt[G]") -> bool:
        """Whether what the attempt before missed most is missed as much again: the fit is at a minimum."""
        worst = before.certificate.cause
        if worst is None or worst.key not in self.broken:
            return False
        old, new = (item.certificate.excess((worst.key,)) for item in (before, self))
        return abs(new - old) < UNCHANGED * old

    @property
    def is_caught(self) -> bool:
        """Whether a part of the body is on the wrong side of another or of an obstacle.

        No small step leads out: the fit begins again from its first guess, with more weight on clearance.
        """
        return self.certificate.is_caught


@dataclass(eq=False)
class FitJob:
    """Fits splines to goals, repairs what they miss and chooses the better attempt.

    Attributes:
        knot_spacing: Largest distance of the spline's knots [s].
        sudden: Whether knots lie closer around touch-downs at speed.
        penalties: Names of the scales that decide each residual, by the residual's key.
        patience: Relative decrease of the objective below which a repair stops.
        gives_up: Whether a repair that hardly helps is the last one.
        by_count: Whether the attempt that breaks the fewest requirements is the better one, of two alike the
            later, and is gone on from; else the one that misses least.
        span: Key instants from which and to which the splines last; the whole schedule when None.
        deadline: After which nothing is repaired.
        iterations: Gauss-Newton steps of all fits so far.
    """

    knot_spacing: float
    samples_per_span: int = 3
    sudden: bool = False
    penalties: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    patience: float = 0.0
    gives_up: bool = False
    by_count: bool = False
    span: tuple[int, int] | None = None
    deadline: Deadline = NO_DEADLINE
    iterations: int = 0

    def knots(self, schedule: ContactSchedule, fine: Places = ()) -> FloatArray:
        """Clamped knots [s] for contacts in time, doubled near places, see :attr:`FitAttempt.fine`."""
        sudden = touch_downs_at_speed(schedule) if self.sudden else ()
        first, last = self.span or (0, len(schedule.sequence))
        instants = schedule.instants[first : last + 1]
        knots = phase_knots(instants, self.knot_spacing, sudden)
        for places in fine:
            knots = refined(knots, np.interp(places, np.arange(len(schedule.instants)), schedule.instants))
        return knots

    def samples(self, knots: FloatArray) -> tuple[FloatArray, SampledBasis]:
        """Times (n,) [s] at which residuals count, and the basis of a spline there."""
        time = sample_times(knots, self.samples_per_span)
        return time, SampledBasis.at(time, knots, DEGREE)

    def solve(
        self, goal: FitGoal, scales: MotionScales, fine: Places = (),
        near: ConfigurationSpline | None = None,
    ) -> tuple[MotionFit, FitResult]:  # fmt: skip
        """Fit a spline, from the objective's reference or from an earlier spline."""
        knots = self.knots(goal.schedule, fine)
        time, basis = self.samples(knots)
        objective = goal.objective(time, basis, scales)
        if near is None or not np.isin(near.knots, knots).all():
            guess = objective.targets.reference if near is None else near.evaluate(time).q
            start = spline_through(guess, basis, knots)
        else:  # a least-squares spline would have other accelerations
            start = near.on_knots(knots)
        fit = MotionFit(objective, knots)
        return fit, fit.solve(start, scales, further=near is not None)

    def attempt(
        self, goal: G, scales: MotionScales, fine: Places = (), near: ConfigurationSpline | None = None
    ) -> FitAttempt[G]:
        """Fit a spline as :meth:`solve` does, and measure it."""
        return self._measured(goal, scales, fine, near is not None, *self.solve(goal, scales, fine, near))

    def restart(self, last: FitAttempt[G], fine: Places = ()) -> FitAttempt[G]:
        """Begin again from the first guess, with more weight on clearance."""
        return self.attempt(last.goal, self.updated(last.scales, last.broken & CLEARANCE), fine)

    def improve(self, last: FitAttempt[G], scales: MotionScales) -> FitAttempt[G]:
        """Go on with other scales on the same knots."""
        result = last.fit.solve(last.result.spline, scales, further=True)
        return self._measured(last.goal, scales, last.fine, True, last.fit, result)

    def repair(
        self, first: FitAttempt[G], remedy: Callable[[int, FitAttempt[G]], FitAttempt[G] | None], most: int
    ) -> FitAttempt[G]:
        """Repeat a remedy until every requirement is kept.

        Args:
            remedy: Makes the next attempt from the number of remedies tried and the last attempt; None where
                nothing helps.
            most: Most remedies.

        Returns:
            The best attempt, with the scales and the fineness of the last one.
        """
        best, last, vain = first, first, 0
        for number in range(most):
            hopeless = self.gives_up and last.astray > MOST_ASTRAY
            if not last.broken or hopeless or self.deadline.is_over:
                break
            following = remedy(number, last)
            if following is None:
                break
            # A repair is in vain that changes the excess so little, or makes it worse.
            much = following.excess > MUCH_EXCESS
            vain = vain + 1 if following.excess > (A_LOT if much else 1.0) * last.excess else 0
            ends = following.is_stuck_after(last) or vain > (0 if much else 1)
            last = following
            best = self.better(best, last)
            if self.gives_up and ends:
                break
            same = best.goal.schedule.sequence is last.goal.schedule.sequence
            if self.by_count and last.continued and best is not last and same:
                last = replace(best, scales=last.scales, fine=last.fine)
        return replace(best, scales=last.scales, fine=last.fine)

    def better(self, first: FitAttempt[G], second: FitAttempt[G]) -> FitAttempt[G]:
        """The better of two attempts, see :attr:`by_count`."""
        if self.by_count:
            return first if len(first.broken) < len(second.broken) else second
        return second if second.excess < first.excess else first

    def updated(self, scales: S, broken: frozenset[str], narrow: bool = False) -> S:
        """Scales at which broken requirements weigh more; narrow ones count on less clearance if missed."""
        if narrow and broken & CLEARANCE:  # What is far enough no longer pushes.
            safe = max(NEARER * scales.safe_distance, LEAST_SAFE_DISTANCE)
            scales = replace(scales, safe_distance=safe, softness=NEARER * scales.softness)
        names = {name for key in broken for name in self.penalties.get(key, ())}
        smaller = {name: STRONGER * getattr(scales, name) for name in sorted(names)}
        return replace(scales, **smaller, decrease=self.patience)

    def _measured(
        self, goal: G, scales: MotionScales, fine: Places, continued: bool, fit: MotionFit, result: FitResult
    ) -> FitAttempt[G]:
        self.iterations += result.iterations
        return FitAttempt(goal, scales, fine, continued, fit, result, *goal.measure(result.spline))


def key_instants(schedule: ContactSchedule) -> tuple[float, ...]:
    """A group of places: the key instants of contacts in time."""
    return tuple(map(float, range(len(schedule.instants))))


def touch_downs_at_speed(schedule: ContactSchedule) -> FloatArray:
    """(k,) times at which a contact is made that still has to settle [s]."""
    stances = [phase.stance for phase in schedule.sequence]
    settles = [
        any(item.settle > 0.0 and (before is None or item.effector not in before) for item in stance)
        for before, stance in zip([None, *stances], stances, strict=False)
    ]
    return schedule.instants[:-1][settles]


def phase_knots(
    instants: FloatArray, spacing: float, sudden: FloatArray | Sequence[float] = ()
) -> FloatArray:
    """Clamped knots [s] with key instants among them, ``spacing`` apart at most, closer at sudden times."""
    fine = np.concatenate([np.zeros(0), *(time + SUDDEN_KNOTS for time in sudden)])
    breaks = np.unique(np.concatenate([instants, fine[(fine > instants[0]) & (fine < instants[-1])]]))
    breaks = breaks[np.append(True, np.diff(breaks) > CLOSEST_KNOTS)]
    inner = split_spans(breaks, spacing)[:-1]
    return np.concatenate([np.full(DEGREE, instants[0]), inner, np.full(DEGREE + 1, instants[-1])])


def split_spans(breaks: FloatArray, spacing: float) -> FloatArray:
    """Breaks, and equal parts of at most ``spacing`` between them."""
    counts = np.maximum(np.ceil(np.diff(breaks) / spacing), 1.0).astype(int)
    parts = zip(breaks[:-1], breaks[1:], counts, strict=True)
    return np.append(np.concatenate([np.linspace(*part, endpoint=False) for part in parts]), breaks[-1])


def refined(knots: FloatArray, instants: FloatArray, within: float = 0.1) -> FloatArray:
    """Clamped knots [s] with every span split in two that has an instant or is ``within`` [s] of one."""
    breaks = np.unique(knots)
    middle = 0.5 * (breaks[:-1] + breaks[1:])
    near = np.abs(middle[:, None] - instants).min(axis=1) < np.maximum(within, 0.51 * np.diff(breaks))
    inner = np.sort(np.concatenate([breaks, middle[near & (np.diff(breaks) > 2.0 * CLOSEST_KNOTS)]]))
    return np.concatenate([np.full(DEGREE, breaks[0]), inner, np.full(DEGREE, breaks[-1])])


def sample_times(knots: FloatArray, per_span: int) -> FloatArray:
    """Times that split every knot span into ``per_span`` equal parts, both ends included [s]."""
    breaks = np.unique(knots)
    spans = [np.linspace(*span, per_span, endpoint=False) for span in itertools.pairwise(breaks)]
    return np.append(np.concatenate(spans), breaks[-1])
