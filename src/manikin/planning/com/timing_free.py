"""The timing-free method: CoM trajectory, durations and margin in one optimisation ([Qiu2012]_ 5.4).

It starts from the path of a pendulum on the supports, or from one through their centres.
"""

import itertools
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import linprog

from manikin.balance import LimitingConstraint, WrenchPolytope
from manikin.contact import ContactKind, ContactSchedule, Phase, StanceSequence
from manikin.numerics.spatial import GRAVITY, GRAVITY_VECTOR, FloatArray, skew
from manikin.numerics.spline import BSpline, clamped_knots, end_control_points, start_control_points
from manikin.planning.com.com_certificate import Residuals, measure
from manikin.planning.com.com_problem import CentroidalProblem, CentroidalTrajectory
from manikin.planning.com.feasibility import (
    FIRM_FRICTION,
    SLIPPERY,
    Failure,
    Feasibility,
    assess_feasibility,
    best_margin_at,
    least_friction,
    polytopes_of,
    with_firm_friction,
)
from manikin.planning.com.optimise import (
    Attempt,
    MarginTargets,
    facet_distances,
    nearest_faces,
    nearest_facets,
    optimise,
    trajectory_of,
    with_broken_faces,
    with_violated,
)
from manikin.runtime.display import Displayed


@dataclass(frozen=True)
class GuessStyle:
    """Way of guessing a first trajectory.

    Attributes:
        pull: 0 is the straight line from start to goal, 1 goes over the supports, None is the motion of a
            linear inverted pendulum on them.
        stretch: Durations as multiples of the lower bounds, before the bounds are applied.
    """

    pull: float | None
    stretch: float


GUESS_STYLES = (GuessStyle(0.5, 1.5), GuessStyle(0.3, 1.2), GuessStyle(0.7, 2.5))
"""Ways of guessing any motion."""

PENDULUM = GuessStyle(None, 1.5)
"""Way of guessing the motion of a body on its feet, tried before the others."""

_PENDULUM_SAMPLES = 5
_JERK_TIME = 0.02
"""Weight of the jerk in metres of distance from the supports [s^3]."""


def guess_styles(problem: CentroidalProblem) -> tuple[GuessStyle, ...]:
    """Ways of guessing, in the order in which they should be tried."""
    contacts = [contact for phase in problem.sequence for contact in phase.stance]
    on_feet = all(contact.kind is ContactKind.SOLE and contact.normal[2] > 0.99 for contact in contacts)
    return (PENDULUM, *GUESS_STYLES) if on_feet else GUESS_STYLES


def guess(
    problem: CentroidalProblem, style: GuessStyle, polytopes: Sequence[WrenchPolytope]
) -> tuple[FloatArray, FloatArray]:
    """Bezier points (phases, k + 1, 3) [m] and durations (phases,) [s] to start from."""
    durations = _guess_durations(problem, style.stretch, polytopes)
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    if style.pull is None:
        return _pendulum(problem, instants).bezier_points(), durations
    path = PchipInterpolator(instants, _guess_key_positions(problem, instants, style.pull))
    k, knots = problem.degree, clamped_knots(problem.degree, instants)
    times = np.linspace(0.0, instants[-1], 20 * len(durations) + 1)
    first = start_control_points(k, knots, problem.start_com, problem.start_velocity)
    last = end_control_points(k, knots, problem.goal_com, problem.goal_velocity)
    return BSpline.fit(k, knots, times, path(times), first=first, last=last).bezier_points(), durations


def _pendulum(problem: CentroidalProblem, instants: FloatArray) -> BSpline:
    """Path of a linear inverted pendulum whose zero moment point is near the middles of the supports.

    With ``c`` the middle of a phase's supports and ``h`` the height of the start above them, the spline
    minimises ``|p - h / g p'' - c|^2 + w^2 |p^(3)|^2`` over samples. The true height changes evenly.
    """
    k, knots = problem.degree, clamped_knots(problem.degree, instants)
    count, durations = len(knots) - k - 1, np.diff(instants)
    share = (np.arange(_PENDULUM_SAMPLES) + 0.5) / _PENDULUM_SAMPLES
    times = (instants[:-1, None] + durations[:, None] * share).ravel()
    weight = np.repeat(np.sqrt(durations), _PENDULUM_SAMPLES)[:, None]
    stances = [phase.stance for phase in problem.sequence]
    middles = np.array([np.mean([c.points_in_world.mean(axis=0) for c in s], axis=0) for s in stances])
    wanted = np.repeat(middles[:, :2], _PENDULUM_SAMPLES, axis=0)
    height = problem.start_com[2] - middles[0, 2]
    basis = BSpline(k, knots, np.eye(count))
    rows = np.vstack([
        weight * (basis(times) - height / GRAVITY * basis(times, 2)), _JERK_TIME * weight * basis(times, 3)
    ])  # fmt: skip
    values = np.vstack([weight * wanted, np.zeros_like(wanted)])
    rest = np.zeros(3)
    speeds = [rest if v is None else v for v in (problem.start_velocity, problem.goal_velocity)]
    first = start_control_points(k, knots, problem.start_com, speeds[0], rest)
    last = end_control_points(k, knots, problem.goal_com, speeds[1], rest)
    points = np.linspace(problem.start_com, problem.goal_com, count)
    points[: len(first)], points[count - len(last) :] = first, last
    inner = slice(len(first), count - len(last))
    given = rows[:, : inner.start] @ first[:, :2] + rows[:, inner.stop :] @ last[:, :2]
    points[inner, :2] = np.linalg.lstsq(rows[:, inner], values - given, rcond=None)[0]
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
    if way[-1] > 0.0:
        points[inner, 2] = np.interp(way[inner], way[[0, -1]], points[[0, -1], 2])
    return BSpline(k, knots, points)


def _guess_durations(
    problem: CentroidalProblem, stretch: float, polytopes: Sequence[WrenchPolytope]
) -> FloatArray:
    lower, upper = problem.min_durations, problem.max_durations
    durations = np.minimum(stretch * lower + 0.1, upper)
    # Where the weight cannot be carried the body falls: such a phase is over as soon as it may be.
    falling = np.array([not can_rest(polytope, problem.mass) for polytope in polytopes])
    durations = np.where(falling, lower, durations)
    if problem.max_duration is not None and durations.sum() > problem.max_duration:
        room = problem.max_duration - lower.sum()
        durations = lower + 0.95 * room * (durations - lower) / max((durations - lower).sum(), 1e-9)
    return durations


def can_rest(polytope: WrenchPolytope, mass: float) -> bool:
    """Whether the contacts can hold a body of this mass still at some position of its CoM.

    The wrench ``[m (-g); p ^ m (-g)]`` is linear in the position ``p``: a linear programme.
    """
    weight = -mass * GRAVITY_VECTOR
    rows, bounds = polytope.H[:, 3:] @ -skew(weight), polytope.h - polytope.H[:, :3] @ weight
    result = linprog(np.zeros(3), rows, bounds, bounds=(None, None), method="highs")
    return result.status != 2  # infeasible


def _guess_key_positions(problem: CentroidalProblem, instants: FloatArray, pull: float) -> FloatArray:
    progress = (instants / instants[-1])[:, None]
    positions = problem.start_com + progress * (problem.goal_com - problem.start_com)
    stances = [phase.stance for phase in problem.sequence]
    for index, (before, after) in enumerate(itertools.pairwise(stances), start=1):
        # Towards the contacts held across the key instant, or towards all when none is.
        held = [contact.position for contact in before if contact.effector in after]
        held = held or [contact.position for stance in (before, after) for contact in stance]
        if held:
            positions[index, :2] += pull * (np.mean(held, axis=0)[:2] - positions[index, :2])
    return positions


MAX_ROUNDS = 6
"""Optimisations from one initial guess before another guess is tried."""

NEGLIGIBLE = 0.02
"""Share of the margin by which left-out facets may lower it without another round."""

LOST = 0.3
"""Distance out of reach from which on a trajectory is no start for the next round [m]; our choice."""


@dataclass(frozen=True, eq=False, repr=False)
class CentroidalResult(Displayed):
    """A trajectory with its certificate, or why there is none.

    Attributes:
        polytopes: W_i of the phases about ``problem.reference``.
        feasibility: Upper bounds of the margin at the key instants.
        trajectory: None when it failed.
        certificate: Requirements measured every millisecond; of the best attempt when it
            failed, None when nothing was attempted.
        rounds: Number of optimisations.
        wall_time: Wall time of the search [s].
    """

    problem: CentroidalProblem
    polytopes: tuple[WrenchPolytope, ...]
    feasibility: Feasibility
    failure: Failure | None
    trajectory: CentroidalTrajectory | None
    certificate: Residuals | None
    iterations: int
    rounds: int
    wall_time: float

    @property
    def succeeded(self) -> bool:
        """Whether the trajectory meets every requirement."""
        return self.failure is None

    @property
    def key_instants(self) -> FloatArray | None:
        """(phases + 1,) T_0 ... T_n [s] ([Qiu2012]_ 5.19)."""
        return None if self.trajectory is None else self.trajectory.schedule.instants

    @property
    def d_min(self) -> float | None:
        """Smallest margin over the motion, measured every millisecond [N.m] or [N]."""
        return None if self.certificate is None else self.certificate.min_margin

    @property
    def limiting_phase(self) -> int | None:
        """Phase in which the margin is smallest."""
        return None if self.certificate is None else self.certificate.limiting_phase

    @property
    def limiting(self) -> LimitingConstraint | None:
        """What limits the smallest margin: contact, what gives way there and in which direction."""
        if self.trajectory is None or self.certificate is None:
            return None
        polytope = self.polytopes[self.certificate.limiting_phase]
        return limiting_at(self.problem, self.trajectory, polytope, self.certificate.limiting_time)

    @property
    def limiting_contact(self) -> str | None:
        """Effector whose contact limits the smallest margin."""
        return None if self.limiting is None else self.limiting.effector

    @property
    def feasibility_radius(self) -> float:
        """Upper bound of d_min ([Qiu2012]_ Proposition 2) [N.m]."""
        return self.feasibility.radius

    def residuals(self) -> Residuals:
        """Measure every requirement again, every millisecond, by numpy alone.

        Raises:
            ValueError: If there is no trajectory.
        """
        if self.trajectory is None:
            raise ValueError("no trajectory to measure; valid: a result that succeeded")
        return self._measured(self.trajectory)

    def along(self, trajectory: CentroidalTrajectory) -> "CentroidalResult":
        """The same plan at another timing, measured anew."""
        phases = ContactSchedule(self.problem.sequence, trajectory.schedule.instants)
        timed = replace(trajectory, schedule=phases)
        return replace(self, trajectory=timed, certificate=self._measured(timed))

    def _measured(self, trajectory: CentroidalTrajectory) -> Residuals:
        return measure(self.problem, trajectory, self.polytopes)


def plan_com(
    problem: CentroidalProblem, *, guesses: int | None = None, near: CentroidalResult | None = None
) -> CentroidalResult:
    """Find control points, key instants and margin of a CoM trajectory ([Qiu2012]_ 5.20-5.28).

    Every solution is measured every millisecond against all facets and all bounds. Where a requirement is
    broken between the samples it is asked for with more distance, and solved again. A result that does not
    meet its own certificate is a failure that says which requirement could not be met.

    Args:
        guesses: Number of guesses to start from at most; all where None.
        near: Result of a problem that differs in key planes alone, to start from before any guess.
    """
    began = time.perf_counter()
    polytopes = polytopes_of(problem) if near is None else near.polytopes
    feasibility = assess_feasibility(problem, polytopes) if near is None else near.feasibility
    attempts: list[Attempt] = []
    failure, best = feasibility.failure, None
    if failure is None and (keys := _resting_keys(problem, polytopes)):
        return _in_parts(problem, polytopes, feasibility, keys)
    if failure is None:
        path = None if near is None else near.trajectory
        known = () if path is None else ((path.spline.bezier_points(), path.schedule.durations),)
        guessed = (guess(problem, style, polytopes) for style in guess_styles(problem)[:guesses])
        for start in itertools.chain(known, guessed):
            attempts.extend(_rounds(problem, polytopes, *start))
            if attempts[-1].certificate.within():
                break
        best = min(attempts, key=lambda attempt: attempt.certificate.rank)
        if not best.certificate.within():
            failure = _explain(problem, polytopes, best)
            failure = replace(failure, reason=failure.reason + _friction_cause(problem))
    return CentroidalResult(
        problem, polytopes, feasibility, failure,
        best.trajectory if best is not None and failure is None else None,
        None if best is None else best.certificate,
        sum(attempt.iterations for attempt in attempts), len(attempts), time.perf_counter() - began,
    )  # fmt: skip


LONG = 24
"""Phases of a motion on other contacts than feet from which on it is planned in parts."""

PART = 8
"""Most phases of a part, where there are rests between them."""

LEVEL = 0.04
"""Difference of the heights of rests up to which a body goes on from one to the other without coming to rest;
where they differ more it folds and stretches its limbs [m]."""

CALM, CALM_ON_POINTS = 0.6, 0.85
"""Share of the margins of the rests of a part that its motion keeps, and the same of one on points alone:
there a limb that carries little, as a hand when the other side's knee leaves, soon carries nothing."""


def _resting_keys(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope]) -> list[int]:
    """Key instants with rests that have the margin that is required, of a long motion; both ends too."""
    count, least = len(problem.sequence), problem.required_margin
    if count < LONG or not problem.rests or PENDULUM in guess_styles(problem):
        return []
    inner = [key for key in range(1, count) if _rest_margin(problem, polytopes, key) >= least]
    return [0, *inner, count] if inner else []


def _parted(problem: CentroidalProblem, keys: Sequence[int]) -> list[int]:
    """The fewest of the resting keys between which a body on points alone stays level, not far apart."""
    rests = [problem.start_com, *problem.rests[1:], problem.goal_com]
    heights = {key: float(rests[key][2]) for key in keys}
    pointed = [_is_on_points(phase) for phase in problem.sequence]
    chosen = [keys[0]]
    for key, following in itertools.pairwise(keys[1:]):
        first = chosen[-1]
        steep = max(abs(heights[one] - heights[first]) for one in (key, following)) > LEVEL
        if steep or following - first > PART or not all(pointed[first:following]):
            chosen.append(key)
    return [*chosen, keys[-1]]


def _is_on_points(phase: Phase) -> bool:
    """Whether every contact of a phase is a point, as on hands and knees."""
    return all(one.kind is ContactKind.POINT for one in phase.stance)


def _rest_margin(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], key: int) -> float:
    """Margin at the rest where a phase begins, on its contacts and on those of the phase before."""
    rest, both = problem.rests[key], polytopes[key - 1 : key + 1]
    return -np.inf if rest is None else min(best_margin_at(one, problem, rest, np.zeros(3)) for one in both)


def _in_parts(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], feasibility: Feasibility, keys: list[int]
) -> CentroidalResult:
    """Plan a long motion in parts from rest to rest, and join them; a part that fails is divided again.

    The programme grows faster than the motion, and one that lasts a minute does not end.
    """
    began, whole, parts, first = time.perf_counter(), None, list[CentroidalResult](), keys[0]
    # A part of one phase that rests at both ends has six conditions, and all parts one degree.
    problem = replace(problem, degree=max(problem.degree, 5))
    waiting = [*itertools.pairwise(_parted(problem, keys))]
    while waiting and (not parts or parts[-1].failure is None):
        first, last = waiting.pop(0)
        part = _part(problem, polytopes, first, last)
        found, inside = plan_com(part), keys[keys.index(first) : keys.index(last) + 1]
        if found.failure is not None and len(inside) > 2:
            waiting = [*itertools.pairwise(inside), *waiting]
            continue
        if found.failure is not None and part.required_margin > problem.required_margin:
            found = plan_com(replace(part, required_margin=problem.required_margin))
        parts.append(found)
        if found.trajectory is not None:
            whole = found.trajectory if whole is None else whole.followed_by(found.trajectory)
    failure, certificate = parts[-1].failure, None
    if failure is not None:
        passed = 0.0 if whole is None else whole.duration
        failure = replace(
            failure, reason=f"in the part from phase {first} on, counted from there: {failure.reason}",
            phase=None if failure.phase is None else failure.phase + first,
            time=None if failure.time is None else failure.time + passed,
        )  # fmt: skip
    elif whole is not None:
        certificate = measure(problem, whole, polytopes)
        worst = certificate.largest
        if not certificate.within():
            failure = Failure(worst.requirement, f"{worst} in the joined parts", worst.phase, worst.time)
    return CentroidalResult(
        problem, tuple(polytopes), feasibility, failure, whole if failure is None else None, certificate,
        sum(one.iterations for one in parts), sum(one.rounds for one in parts), time.perf_counter() - began,
    )  # fmt: skip


def _part(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], first: int, last: int
) -> CentroidalProblem:
    """The phases from one key instant to another, at rest at those inside the motion.

    Margin is required instead of wished for: no more is to be had than at the rests, whatever lies between.
    """
    count, still = len(problem.sequence), np.zeros(3)
    margins = [_rest_margin(problem, polytopes, key) for key in range(max(first, 1), min(last + 1, count))]
    share = CALM_ON_POINTS if all(map(_is_on_points, problem.sequence.phases[first:last])) else CALM
    calm = share * min((margin for margin in margins if margin > 0.0), default=0.0)
    planes = [replace(one, key=one.key - first) for one in problem.key_planes if first < one.key < last]
    ends: dict[str, Any] = {}
    for key, end in ((first, "start"), (last, "goal")):
        if 0 < key < count:
            ends |= {f"{end}_com": problem.rests[key], f"{end}_velocity": still, f"{end}_acceleration": still}
    return replace(
        problem, sequence=StanceSequence(problem.sequence.phases[first:last]), rests=(),
        regions=problem.regions[first:last], key_planes=tuple(planes),
        required_margin=max(problem.required_margin, calm), weights=replace(problem.weights, margin=0.0),
        **ends,
    )  # fmt: skip


def _rounds(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], bezier: FloatArray, durations: FloatArray
) -> Iterator[Attempt]:
    """Optimise until the certificate holds with all facets, or until another round cannot help.

    It begins with Bezier points (phases, k + 1, 3) [m] and durations (phases,) [s].
    """
    trajectory = trajectory_of(problem, bezier, durations)
    facets = nearest_facets(facet_distances(problem, trajectory, polytopes))
    targets, faces = MarginTargets.of(problem), nearest_faces(problem, trajectory)
    for _ in range(MAX_ROUNDS):
        attempt = optimise(problem, polytopes, facets, targets, bezier, durations, faces)
        yield attempt
        distances = facet_distances(problem, attempt.trajectory, polytopes)
        kept = min(float(values[rows].min()) for values, rows in zip(distances, facets, strict=True))
        more_facets = with_violated(facets, distances, kept - NEGLIGIBLE * abs(kept))
        more_faces = with_broken_faces(problem, attempt.trajectory, faces)
        enough = [*map(len, more_facets + more_faces)] == [*map(len, facets + faces)]
        hopeless = not attempt.converged or attempt.margin < targets.margin - 1e-3
        if enough and (attempt.certificate.within() or hopeless):
            return  # a violation that is more than an effect of sampling stays
        if enough:
            targets = targets.grown(problem, attempt.certificate)
        facets, faces = more_facets, more_faces
        # The solver does not come back from far outside of the faces that were not imposed.
        if not problem.regions or attempt.certificate["reach"].value <= LOST:
            bezier, durations = attempt.bezier, attempt.durations


def limiting_at(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytope: WrenchPolytope, time: float
) -> LimitingConstraint:
    """Contact and limit nearest to the wrench of a trajectory at a time [s], in the polytope of its phase."""
    fixed = problem.margin_space == "wrench_about_origin"
    about = np.zeros(3) if fixed else trajectory.position(time)
    return polytope.limiting(trajectory.pseudo_wrench(time, problem.reference), about)


def _friction_cause(problem: CentroidalProblem) -> str:
    """Say that the same problem has a plan with firm friction; empty where it has none or is not slippery."""
    least = least_friction([phase.stance for phase in problem.sequence])
    firm = plan_com(with_firm_friction(problem)) if least < SLIPPERY else None
    if firm is None or firm.d_min is None or not firm.succeeded:
        return ""
    would = f"{FIRM_FRICTION:g} it would be {firm.d_min:.2f} {problem.margin_unit}"
    return f"; the friction of {least:g} is too low: with {would}"


def _explain(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], best: Attempt) -> Failure:
    """Name the requirement that fails in the best attempt; its margin is the largest if nothing else does."""
    certificate, worst = best.certificate, best.certificate.largest
    barrier = next((item for item in problem.geometric if item.impassable), None)
    if barrier is not None:
        at = certificate[barrier.name]
        return Failure(barrier.name, f"{barrier.impassable}; no way around it was found", at.phase, at.time)
    if worst.requirement != "balance margin":
        where = ", ".join(problem.sequence[worst.phase].stance.effectors) if worst.phase is not None else ""
        what = f"{worst} in the best attempt"
        if worst.requirement == "reach":
            what = f"at {worst.time:.3f} s the centre of mass is {worst.value:.3f} m out of this body's "
            what += f"reach on {where} in phase {worst.phase}, in the best attempt"
        return Failure(worst.requirement, f"no trajectory found: {what}", worst.phase, worst.time, where)
    what = f"the largest margin found is {certificate.min_margin:.2f}"
    phase, instant = certificate.limiting_phase, certificate.limiting_time
    return missed_margin(problem, best.trajectory, polytopes, phase, instant, what)


def missed_margin(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope],
    phase: int, time: float, what: str, tried: str = "",
) -> Failure:  # fmt: skip
    """Failure that names the contact limiting the margin of the best trajectory, in a phase at a time [s].

    How large the margin is (without the unit) and what was tried are in words.
    """
    limit, unit = limiting_at(problem, trajectory, polytopes[phase], time), problem.margin_unit
    reason = (
        f"{what} {unit}, limited in phase {phase} at {time:.3f} s by {limit.description}{tried}; "
        f"required {problem.required_margin:.2f} {unit}"
    )
    return Failure("balance margin", reason, phase, time, limit.effector)
