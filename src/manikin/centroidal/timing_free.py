"""The timing-free method: CoM trajectory, durations and margin in one optimisation ([Qiu2012]_ 5.4)."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from manikin.balance import WrenchPolytope
from manikin.centroidal.certificate import TOLERANCE, Residuals, measure
from manikin.centroidal.feasibility import Failure, Feasibility, assess_feasibility, polytopes_of
from manikin.centroidal.initial_guess import GUESS_STYLES, guess
from manikin.centroidal.problem import CentroidalProblem, Weights
from manikin.centroidal.trajectory import CentroidalTrajectory
from manikin.centroidal.transcription import (
    MARGIN_SCALE,
    Programme,
    Structure,
    spline_from_bezier,
    transcribe,
)
from manikin.contact import ContactSchedule
from manikin.spatial import FloatArray

MAX_ROUNDS = 4
"""Solutions with growing targets before another initial guess is tried."""


@dataclass(frozen=True)
class Targets:
    """What the programme is asked at its samples, a little more than the problem asks everywhere.

    Attributes:
        margin: Smallest margin [N.m] or [N].
        position: Distance kept from the geometric constraints and the support distance [m].
        weights: Of the objectives.
        duration: Distance kept from the total duration [s].
    """

    margin: float
    position: float
    weights: Weights
    duration: float = 1e-7


def first_targets(problem: CentroidalProblem) -> Targets:
    """Targets of the first round."""
    return Targets(problem.required_margin + 1e-3, 3e-4, problem.weights)


@dataclass(frozen=True, eq=False)
class CentroidalResult:
    """A trajectory with its certificate, or why there is none.

    Attributes:
        problem: What was asked.
        polytopes: W_i of the phases about the world origin.
        feasibility: Radii of the consecutive intersections.
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


@dataclass(frozen=True, eq=False)
class _Attempt:
    trajectory: CentroidalTrajectory
    certificate: Residuals
    unknowns: FloatArray
    iterations: int


def plan_com(problem: CentroidalProblem) -> CentroidalResult:
    """Find control points, key instants and margin of a CoM trajectory ([Qiu2012]_ 5.20-5.28).

    The result is measured every millisecond; where a requirement is broken between the
    samples, it is asked for with a growing allowance and solved again. A result that does not
    meet its own certificate is a failure.

    Args:
        problem: What to find.

    Returns:
        A result that holds the trajectory or says which requirement could not be met.
    """
    began = time.perf_counter()
    polytopes = polytopes_of(problem)
    feasibility = assess_feasibility(problem, polytopes)
    attempts: list[_Attempt] = []
    best: _Attempt | None = None
    failure = feasibility.failure
    if failure is None:
        attempts = _attempts(problem, polytopes)
        best = min(attempts, key=lambda attempt: max(attempt.certificate.largest.value, 0.0))
        if not best.certificate.within():
            failure = _explain(problem, polytopes, best)
    return CentroidalResult(
        problem, polytopes, feasibility, failure,
        best.trajectory if best is not None and failure is None else None,
        None if best is None else best.certificate,
        sum(attempt.iterations for attempt in attempts), len(attempts), time.perf_counter() - began,
    )  # fmt: skip


def build_programme(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope]) -> Programme:
    """The compiled optimisation of a problem, shared by all problems of the same structure."""
    return transcribe(
        Structure(
            degree=problem.degree,
            samples=problem.samples,
            rows=tuple(len(polytope.h) for polytope in polytopes),
            contacts=tuple(len(phase.stance) for phase in problem.sequence),
            margin_space=problem.margin_space,
            geometric=tuple(constraint.function for constraint in problem.geometric),
            limited_distance=problem.support_distance is not None,
        )
    )


def _attempts(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope]) -> list[_Attempt]:
    programme = build_programme(problem, polytopes)
    attempts: list[_Attempt] = []
    for style in GUESS_STYLES:
        bezier, durations = guess(problem, style)
        unknowns = programme.pack_unknowns(bezier, durations, problem.required_margin)
        targets = first_targets(problem)
        for _ in range(MAX_ROUNDS):
            attempt = _solve(programme, problem, polytopes, unknowns, targets)
            attempts.append(attempt)
            if attempt.certificate.within():
                return attempts
            targets = _grown(targets, problem, attempt.certificate)
            unknowns = attempt.unknowns
            if _hopeless(attempt.certificate):
                break
    return attempts


def _hopeless(certificate: Residuals) -> bool:
    """Whether the violation is more than a sampling effect."""
    margin = certificate["balance margin"].value
    others = max(item.value for item in certificate.items if item.requirement != "balance margin")
    return margin > 5.0 or others > 0.02


def _grown(targets: Targets, problem: CentroidalProblem, certificate: Residuals) -> Targets:
    positions = ["support distance"] if problem.support_distance is not None else []
    positions += [constraint.name for constraint in problem.geometric]
    position = max((certificate[name].value for name in positions), default=0.0)
    return replace(
        targets,
        margin=targets.margin + 1.2 * max(certificate["balance margin"].value, 0.0),
        position=targets.position + (1.2 * position + 1e-5 if position > TOLERANCE else 0.0),
    )


def _solve(
    programme: Programme,
    problem: CentroidalProblem,
    polytopes: Sequence[WrenchPolytope],
    unknowns: FloatArray,
    targets: Targets,
) -> _Attempt:
    lower, upper = _unknown_bounds(programme, problem, targets)
    row_lower, row_upper = _row_bounds(programme, problem, targets)
    solution = programme.solver(
        x0=np.clip(unknowns, lower, upper),
        p=programme.pack_parameters(_parameters(problem, polytopes, targets.weights)),
        lbx=lower, ubx=upper, lbg=row_lower, ubg=row_upper,
    )  # fmt: skip
    found = np.asarray(solution["x"], dtype=np.float64).ravel()
    trajectory = _trajectory(programme, problem, found)
    certificate = measure(problem, trajectory, polytopes)
    return _Attempt(trajectory, certificate, found, int(programme.solver.stats()["iter_count"]))


def _parameters(
    problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], weights: Weights
) -> dict[str, object]:
    values: dict[str, object] = {
        "mass": problem.mass,
        "weights": (weights.margin, weights.smoothness, weights.duration),
        "velocity": weights.velocity,
        "acceleration": weights.acceleration,
        "jerk": weights.jerk,
    }
    for name in ("start_velocity", "start_acceleration", "goal_velocity", "goal_acceleration"):
        value = getattr(problem, name)
        values[name] = np.zeros(3) if value is None else value
    for index, (phase, polytope) in enumerate(zip(problem.sequence, polytopes, strict=True)):
        values[f"H{index}"], values[f"h{index}"] = polytope.H, polytope.h
        values[f"contacts{index}"] = [contact.position for contact in phase.stance]
    return values


def _unknown_bounds(
    programme: Programme, problem: CentroidalProblem, targets: Targets
) -> tuple[FloatArray, FloatArray]:
    phases, k = programme.structure.phases, programme.structure.degree
    points = np.full((phases, k + 1, 3), np.inf)
    scale = MARGIN_SCALE[problem.margin_space]
    low, high = -points, points.copy()
    for bound in (low, high):
        bound[0, 0], bound[-1, -1] = problem.start_com, problem.goal_com
    lower = programme.pack_unknowns(low, problem.min_durations, targets.margin)
    upper = programme.pack_unknowns(high, problem.max_durations, np.inf * scale)
    return lower, upper


def _row_bounds(
    programme: Programme, problem: CentroidalProblem, targets: Targets
) -> tuple[FloatArray, FloatArray]:
    limit = (problem.support_distance or 0.0) - targets.position
    longest = np.inf if problem.max_duration is None else problem.max_duration - targets.duration
    bounds = {
        "balance": (0.0, np.inf),
        "distance": (-np.inf, limit**2),
        "continuity": (0.0, 0.0),
        "total_duration": (0.0, longest),
    }
    ends = iter(
        (problem.start_velocity, problem.start_acceleration, problem.goal_velocity, problem.goal_acceleration)
    )
    lower, upper = [], []
    for group, count in programme.groups:
        if group == "end":
            low, high = (0.0, 0.0) if next(ends) is not None else (-np.inf, np.inf)
        elif group.startswith("geometric"):
            low, high = -np.inf, -targets.position
        else:
            low, high = bounds[group]
        lower.append(np.full(count, low))
        upper.append(np.full(count, high))
    return np.concatenate(lower), np.concatenate(upper)


def _trajectory(
    programme: Programme, problem: CentroidalProblem, unknowns: FloatArray
) -> CentroidalTrajectory:
    bezier, durations, _ = programme.unpack_unknowns(unknowns)
    durations = np.clip(durations, problem.min_durations, problem.max_durations)
    spline = spline_from_bezier(
        bezier, durations,
        start=_given(problem.start_com, problem.start_velocity, problem.start_acceleration),
        goal=_given(problem.goal_com, problem.goal_velocity, problem.goal_acceleration),
    )  # fmt: skip
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    return CentroidalTrajectory(problem.mass, spline, ContactSchedule(problem.sequence, instants))


def _given(
    position: FloatArray, velocity: FloatArray | None, acceleration: FloatArray | None
) -> tuple[FloatArray, ...]:
    if velocity is None:
        return (position,)
    return (position, velocity) if acceleration is None else (position, velocity, acceleration)


def _explain(problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], best: _Attempt) -> Failure:
    """Name the requirement that fails; when it may be balance, find the largest margin possible."""
    worst = best.certificate.largest
    relaxed = Targets(-np.inf, first_targets(problem).position, Weights(1.0, 1e-3, 0.0))
    attempt = _solve(build_programme(problem, polytopes), problem, polytopes, best.unknowns, relaxed)
    found = attempt.certificate
    others = [item for item in found.items if item.requirement != "balance margin"]
    if max(item.value for item in others) > 10 * relaxed.position:
        return Failure(
            worst.requirement, f"no trajectory found: {worst} in the best attempt", worst.phase, worst.time
        )
    phase, unit = found.limiting_phase, problem.margin_unit
    held = ", ".join(problem.sequence[phase].stance.effectors)
    return Failure(
        "balance margin",
        f"the largest margin found is {found.min_margin:.2f} {unit}, limited in phase {phase} on "
        f"{held or 'no contact'}; required {problem.required_margin:.2f} {unit}",
        phase,
        found.limiting_time,
        held,
    )
