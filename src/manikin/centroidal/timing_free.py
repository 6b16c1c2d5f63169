"""The timing-free method: CoM trajectory, durations and margin in one optimisation ([Qiu2012]_ 5.4)."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from manikin.balance import LimitingConstraint, WrenchPolytope
from manikin.centroidal.causes import FIRM_FRICTION, SLIPPERY, least_friction, with_firm_friction
from manikin.centroidal.certificate import Residuals, measure
from manikin.centroidal.facets import facet_distances, nearest_facets, with_violated
from manikin.centroidal.feasibility import Failure, Feasibility, assess_feasibility, polytopes_of
from manikin.centroidal.initial_guess import GuessStyle, guess, guess_styles
from manikin.centroidal.optimise import Attempt, Targets, optimise, trajectory_of
from manikin.centroidal.problem import CentroidalProblem
from manikin.centroidal.trajectory import CentroidalTrajectory
from manikin.display import Displayed
from manikin.spatial import FloatArray

MAX_ROUNDS = 6
"""Optimisations from one initial guess before another guess is tried."""

NEGLIGIBLE = 0.02
"""Share of the margin by which left-out facets may lower it without another round."""


@dataclass(frozen=True, eq=False, repr=False)
class CentroidalResult(Displayed):
    """A trajectory with its certificate, or why there is none.

    Attributes:
        problem: What was asked.
        polytopes: W_i of the phases about ``problem.reference``.
        feasibility: Upper bounds of the margin at the key instants.
        failure: Why it failed, or None.
        trajectory: The trajectory; None when it failed.
        certificate: Requirements measured every millisecond; of the best attempt when it
            failed, None when nothing was attempted.
        iterations: Of the solver, over all rounds.
        rounds: Number of optimisations.
        wall_time: [s].
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
        certificate = self.certificate
        polytope = self.polytopes[certificate.limiting_phase]
        return limiting_at(self.problem, self.trajectory, polytope, certificate.limiting_time)

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
        return measure(self.problem, self.trajectory, self.polytopes)


def plan_com(problem: CentroidalProblem) -> CentroidalResult:
    """Find control points, key instants and margin of a CoM trajectory ([Qiu2012]_ 5.20-5.28).

    Every solution is measured every millisecond against all facets and all bounds. Where a
    requirement is broken between the samples it is asked for with more distance, where by a
    facet that was left out the facet is added, and the programme is solved again. A result
    that does not meet its own certificate is a failure.

    Args:
        problem: What to find.

    Returns:
        A result that holds the trajectory or says which requirement could not be met.
    """
    began = time.perf_counter()
    polytopes = polytopes_of(problem)
    feasibility = assess_feasibility(problem, polytopes)
    attempts: list[Attempt] = []
    failure, best = feasibility.failure, None
    if failure is None:
        attempts = _search(problem, polytopes)
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


def _search(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope]) -> list[Attempt]:
    attempts: list[Attempt] = []
    for style in guess_styles(problem):
        attempts.extend(_rounds(problem, polytopes, style))
        if attempts[-1].certificate.within():
            break
    return attempts


def _rounds(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], style: GuessStyle
) -> Iterator[Attempt]:
    """Optimise until the certificate holds with all facets, or until another round cannot help."""
    bezier, durations = guess(problem, style, polytopes)
    trajectory = trajectory_of(problem, bezier, durations)
    facets = nearest_facets(facet_distances(problem, trajectory, polytopes))
    targets = Targets.of(problem)
    for _ in range(MAX_ROUNDS):
        attempt = optimise(problem, polytopes, facets, targets, bezier, durations)
        yield attempt
        distances = facet_distances(problem, attempt.trajectory, polytopes)
        kept = min(float(values[rows].min()) for values, rows in zip(distances, facets, strict=True))
        more_facets = with_violated(facets, distances, kept - NEGLIGIBLE * abs(kept))
        enough = all(len(new) == len(old) for new, old in zip(more_facets, facets, strict=True))
        if enough and (attempt.certificate.within() or _hopeless(attempt, targets)):
            return
        if enough:
            targets = targets.grown(problem, attempt.certificate)
        facets, bezier, durations = more_facets, attempt.bezier, attempt.durations


def _hopeless(attempt: Attempt, targets: Targets) -> bool:
    """Whether a violation is more than an effect of sampling."""
    return not attempt.converged or attempt.margin < targets.margin - 1e-3


def limiting_at(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytope: WrenchPolytope, time: float
) -> LimitingConstraint:
    """Contact and limit nearest to the wrench of a trajectory at a time.

    Args:
        problem: Says what the margin measures.
        trajectory: The trajectory.
        polytope: Of the phase of that time, about ``problem.reference``.
        time: [s].
    """
    fixed = problem.margin_space == "wrench_about_origin"
    about = np.zeros(3) if fixed else trajectory.position(time)
    return polytope.limiting(trajectory.pseudo_wrench(time, problem.reference), about)


def _friction_cause(problem: CentroidalProblem) -> str:
    """Say that the same problem has a plan with firm friction; empty where it has none or is not slippery."""
    least = least_friction([phase.stance for phase in problem.sequence])
    if least >= SLIPPERY:
        return ""
    firm = plan_com(with_firm_friction(problem))
    if firm.d_min is None or not firm.succeeded:
        return ""
    return (
        f"; the friction of {least:g} is too low: with {FIRM_FRICTION:g} it would be {firm.d_min:.2f} "
        f"{problem.margin_unit}"
    )


def _explain(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], best: Attempt) -> Failure:
    """Name the requirement that fails in the best attempt.

    The required margin is penalised and not imposed, so that an attempt that breaks nothing
    else has the largest margin that was found.
    """
    found, worst = best.certificate, best.certificate.largest
    barrier = next((item for item in problem.geometric if item.impassable), None)
    if barrier is not None:
        at = found[barrier.name]
        return Failure(barrier.name, f"{barrier.impassable}; no way around it was found", at.phase, at.time)
    if worst.requirement != "balance margin":
        return Failure(
            worst.requirement, f"no trajectory found: {worst} in the best attempt", worst.phase, worst.time
        )
    polytope = polytopes[found.limiting_phase]
    limit = limiting_at(problem, best.trajectory, polytope, found.limiting_time)
    place = f"in phase {found.limiting_phase} at {found.limiting_time:.3f} s by {limit.description}"
    reason = (
        f"the largest margin found is {found.min_margin:.2f} {problem.margin_unit}, limited {place}; "
        f"required {problem.required_margin:.2f} {problem.margin_unit}"
    )
    return Failure("balance margin", reason, found.limiting_phase, found.limiting_time, limit.effector)
