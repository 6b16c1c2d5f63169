"""The posture generator: a whole-body configuration that meets requirements ([Qiu2012]_ 6.2.2).

Sequential quadratic programming on the tangent space of the body. With requirements ``r(q) = 0``,
distances ``d(q) >= 0`` and wishes ``s(q)`` each iteration solves, for the tangent step ``v``,

    min  1/2 |s + S v|^2_W + 1/2 rho |r + R v|^2 + 1/2 rho |slack|^2
    s.t. d + D v + slack >= 0,  hinge ranges,  |v|_inf <= trust region,

which always has a solution. Steps are accepted when the sum of the squares falls, after a second-order
correction where the requirements curve. At last what the wishes have left in the requirements is removed by
the smallest changes, so that they end up exact and not merely heavily weighted.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body.configuration import Configuration
from manikin.body.model import BodyModel
from manikin.errors import BodyError
from manikin.kinematics.posture_problem import PostureProblem, place_over_contacts, without_one
from manikin.kinematics.posture_terms import ClearanceTerm, LimitTerm, Linearised
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.scene.distance import Pair

RESTARTS: tuple[dict[str, float], ...] = (
    {"hip_flexion": 1.4, "knee_flexion": 1.9, "ankle_dorsiflexion": 0.5},
    {"lumbar_flexion": 0.5, "thorax_flexion": 0.3, "neck_flexion": -0.3,
     "hip_flexion": 1.8, "knee_flexion": 2.0, "ankle_dorsiflexion": 0.5},
    {"lumbar_flexion": 0.6, "thorax_flexion": 0.4, "neck_flexion": -0.4,
     "hip_flexion": 1.2, "knee_flexion": 0.9, "ankle_dorsiflexion": 0.3},
)  # fmt: skip
"""Angles [rad] of hinges by the end of their names, from which a failed search is repeated:
a squat, a crouch and a stoop."""

NEAR = 2e-3
"""Violation [m, rad] below which the rest is done by projection onto the requirements."""
MAX_TRUST = 0.8
"""Largest trust region [m, rad]."""
COMPARED = 2
"""Cold starts that must succeed; the better posture is taken, as there are poor local minima."""
PATIENCE = 6
"""Iterations in a row that gain less than half a percent after which a start is given up."""


@dataclass(frozen=True)
class SolverSettings:
    """Tolerances and effort of a search.

    Attributes:
        tolerance: Largest residual of a requirement [m, rad].
        clearance_tolerance: Largest intrusion into a safety distance [m].
        settled: Change of a coordinate in one iteration below which the wishes count as met [m, rad].
        iterations: Largest number of iterations of each start.
        stiffness: Weight rho of requirements against wishes.
        trust: First trust region [m, rad].
        activation: Pairs farther than the safety distance plus this are not looked at [m].
        buffer: Aimed at beyond the safety distance [m].
        restarts: Whether to try again from crouched postures.
        explain: Whether a failure is examined further (costs a few solutions).
    """

    tolerance: float = 1e-6
    clearance_tolerance: float = 1e-4
    settled: float = 5e-3
    iterations: int = 60
    stiffness: float = 1e4
    trust: float = 0.3
    activation: float = 0.10
    buffer: float = 5e-4
    restarts: bool = True
    explain: bool = True

    def __post_init__(self) -> None:
        for name in ("tolerance", "clearance_tolerance", "settled", "stiffness", "trust", "activation"):
            finite_number(getattr(self, name), f"posture settings {name}", above=0.0)


@dataclass(frozen=True, eq=False)
class PostureResult:
    """A posture, or the best attempt and what it misses.

    Attributes:
        succeeded: Whether every requirement is met.
        q: (nq,) configuration found.
        error: Largest residual of the requirements [m, rad].
        clearance: Smallest distance beyond the safety distances [m] among the close pairs, or infinite.
        at_limit: Hinges at an end of their range.
        iterations: Iterations over all starts.
        failure: None, or the explanation in one line.
    """

    succeeded: bool
    q: FloatArray
    error: float
    clearance: float
    at_limit: tuple[str, ...]
    iterations: int
    failure: str | None = None


def generate_posture(
    problem: PostureProblem, start: ArrayLike | None = None, *, settings: SolverSettings | None = None
) -> PostureResult:
    """Find a posture.

    Args:
        start: (nq,) where to begin, such as a neighbouring posture (BodyError if it is not usable); the
            reference placed over the contacts when omitted.

    Returns:
        A posture that meets all requirements (without ``start`` the better of the first two
        found, by its preferences), otherwise the best attempt with an explanation.
    """
    settings = settings or SolverSettings()
    solver = PostureSolver(problem, settings)
    freely: PostureSolver | None = None
    tried: list[_Iterate] = []
    for q, warm in _starts(problem, start, settings):
        # A cold start goes to its contacts through the obstacles first: from outside, thin
        # obstacles would trap it on their wrong side. A low one may trap it there.
        through = not warm and problem.proximity is not None
        if through:
            freely = freely or PostureSolver(replace(problem, proximity=None), settings)
            tried.append(solver.solve(freely.solve(q).q))
        if not (through and solver.meets(tried[-1])):
            tried.append(solver.solve(q))
        met = sum(solver.meets(item) for item in tried)
        if met == COMPARED or (met and warm):
            break
    best = min(tried, key=solver.rank)
    return solver.result(best, solver.iterations + (freely.iterations if freely else 0))


class _Step(NamedTuple):
    """A step tried: where it leads, its largest component, and the merit before, gained and expected."""

    candidate: "_Iterate"
    size: float
    before: float
    gained: float
    expected: float


@dataclass(frozen=True, eq=False)
class _Iterate:
    """Everything known at one configuration (nq,), residuals stacked.

    Attributes:
        parts: Slice of each requirement in the stack.
        clearance: (k,) distances beyond the safety distances, of pairs of shapes.
    """

    q: FloatArray
    requirement: Linearised
    parts: tuple[slice, ...]
    wish: Linearised
    clearance: Linearised
    pairs: tuple[Pair, ...]

    @property
    def error(self) -> float:
        return float(np.abs(self.requirement.residual).max(initial=0.0))

    @property
    def intrusion(self) -> float:
        return float(max(0.0, -self.clearance.residual.min(initial=np.inf)))

    @property
    def violation(self) -> float:
        """Error and intrusion together, for choosing among failures."""
        return max(self.error, self.intrusion)


class PostureSolver:
    """Solves one problem from several starts."""

    def __init__(self, problem: PostureProblem, settings: SolverSettings) -> None:
        self.problem, self.settings = problem, settings
        self.requirements = problem.requirements()
        self._limits = LimitTerm(problem.body, problem.range_margin)
        self._clearances = None if problem.proximity is None else ClearanceTerm(
            problem.proximity, problem.clearance, problem.self_clearance, settings.activation,
            problem.ignore - set(problem.touching), problem.touching,
        )  # fmt: skip
        wishes = problem.wishes()
        self._wishes = tuple(term for _, term in wishes)
        self._wish_weights = np.concatenate([weight for weight, _ in wishes])
        self._configuration = _workspace(problem.body)
        self.iterations = 0

    def _moved(self, iterate: _Iterate, step: FloatArray) -> _Iterate:
        return self.linearise(pin.integrate(self.problem.body.pinocchio, iterate.q, step))

    def solve(self, q: FloatArray) -> _Iterate:
        """Iterate from one start until the posture settles or nothing improves any more."""
        settings = self.settings
        iterate = self.linearise(q)
        trust, idle = settings.trust, 0
        for _ in range(settings.iterations):
            self.iterations += 1
            move = self._best_move(iterate, trust)
            if move.gained < 0.1 * move.expected and move.size > 1e-5:
                trust = 0.3 * min(trust, move.size)
            elif move.gained > 0.7 * move.expected:
                trust = min(2.0 * trust, MAX_TRUST)
            if move.gained > 0.0:
                iterate = move.candidate
            near = iterate.violation < NEAR
            if near and move.size < settings.settled:
                break
            idle = idle + 1 if move.gained < (1e-3 if near else 5e-3) * move.before else 0
            if idle >= (2 if near else PATIENCE):
                break
        return self._exact(iterate) if iterate.violation < 5.0 * NEAR else iterate

    def _best_move(self, iterate: _Iterate, trust: float) -> _Step:
        """The step of the quadratic programme, bent back onto the requirements where that is better."""
        before = self._merit(iterate)
        step, predicted = self._step(iterate, trust)
        move = self._move(iterate, step, before, before - predicted)
        if move.gained < 0.5 * move.expected:
            # The requirements are curved: without bending, the trust region would shrink only
            # because straight steps leave them (Maratos effect).
            bent, _ = self._step(_bent(iterate, move.candidate, step), trust)
            other = self._move(iterate, bent, before, before - predicted)
            move = other if other.gained > move.gained else move
        return move

    def _move(self, iterate: _Iterate, step: FloatArray, before: float, expected: float) -> _Step:
        candidate = self._moved(iterate, step)
        gained = before - self._merit(candidate)
        return _Step(candidate, float(np.abs(step).max()), before, gained, expected)

    def _exact(self, iterate: _Iterate) -> _Iterate:
        """Remove what the wishes have pulled from the requirements, by the smallest changes."""
        for _ in range(8):
            if iterate.error <= 0.01 * self.settings.tolerance and self.meets(iterate):
                break
            moved = self._moved(iterate, self._step(iterate, 0.1, wishes=False)[0])
            if moved.violation >= iterate.violation and self.meets(iterate):
                break
            iterate = moved
        return iterate

    def meets(self, iterate: _Iterate) -> bool:
        """Whether all requirements and safety distances are kept."""
        settings = self.settings
        return iterate.error <= settings.tolerance and iterate.intrusion <= settings.clearance_tolerance

    def rank(self, iterate: _Iterate) -> tuple[bool, float]:
        """Order of preference: what meets the requirements, then the better wishes or smaller violation."""
        met = self.meets(iterate)
        return not met, self._merit(iterate) if met else iterate.violation

    def linearise(self, q: FloatArray) -> _Iterate:
        """Evaluate every term, with hinges put back that rounding took out of their ranges."""
        q = np.concatenate([q[:7], np.clip(q[7:], self._limits.lower, self._limits.upper)])
        configuration, nv = self._configuration.update(q), self.problem.body.nv
        requirements = [term.evaluate(configuration) for term in self.requirements]
        ends = np.cumsum([0, *(len(item.residual) for item in requirements)]).tolist()
        parts = tuple(slice(first, stop) for first, stop in pairwise(ends))
        wishes = [term.evaluate(configuration) for term in self._wishes]
        clearance, pairs = _stack([], nv), ()
        if self._clearances is not None:
            clearance, pairs = self._clearances.evaluate(configuration)
        return _Iterate(q, _stack(requirements, nv), parts, _stack(wishes, nv), clearance, pairs)

    def result(self, iterate: _Iterate, iterations: int) -> PostureResult:
        """Pack the best iterate, with an explanation when it does not meet the requirements."""
        succeeded, q = self.meets(iterate), frozen_array(iterate.q, "posture q")
        limits = self._limits.at_limit(self._configuration.update(q))
        failure = None if succeeded else self._explanation(iterate, limits)
        clearance = float(iterate.clearance.residual.min(initial=np.inf))
        return PostureResult(succeeded, q, iterate.error, clearance, limits, iterations, failure)

    def _merit(self, iterate: _Iterate) -> float:
        intrusion = np.minimum(iterate.clearance.residual - self.settings.buffer, 0.0)
        hard = np.sum(iterate.requirement.residual**2) + np.sum(intrusion**2)
        soft = np.sum(self._wish_weights * iterate.wish.residual**2)
        return float(0.5 * soft + 0.5 * self.settings.stiffness * hard)

    def _step(self, iterate: _Iterate, trust: float, *, wishes: bool = True) -> tuple[FloatArray, float]:
        """Solve the quadratic program; returns the step and the merit it predicts."""
        rho, buffer, nv = self.settings.stiffness, self.settings.buffer, self.problem.body.nv
        (residual, jacobian), (wish, wish_jacobian) = iterate.requirement, iterate.wish
        weighted = self._wish_weights[:, None] * wish_jacobian
        damping = self.problem.preferences.damping * np.eye(nv)
        hessian = wish_jacobian.T @ weighted + rho * (jacobian.T @ jacobian) + damping
        gradient = (weighted.T @ wish if wishes else 0.0) + rho * (jacobian.T @ residual)
        distance, slope = iterate.clearance
        angles, limits = iterate.q[7:], self._limits
        lower, upper = np.full(nv, -trust), np.full(nv, trust)  # the trust region, cut by the hinge ranges
        lower[6:] = np.maximum(lower[6:], np.minimum(limits.lower - angles, 0.0))
        upper[6:] = np.minimum(upper[6:], np.maximum(limits.upper - angles, 0.0))
        bounds = lower, upper
        program = solve_qp(hessian, gradient, slope, buffer - distance, None, bounds, softness=1.0 / rho)
        step = program.x if program.solved else np.zeros(nv)
        hard = np.sum((residual + jacobian @ step) ** 2)
        hard += np.sum(np.minimum(distance + slope @ step - buffer, 0.0) ** 2)
        soft = np.sum(self._wish_weights * (wish + wish_jacobian @ step) ** 2)
        return step, float(0.5 * soft + 0.5 * rho * hard)

    def _explanation(self, iterate: _Iterate, limits: tuple[str, ...]) -> str:
        """The worst requirements that are not met, the ends of ranges, and what stands in the way."""
        misses: list[tuple[float, str]] = []
        for term, part in zip(self.requirements, iterate.parts, strict=True):
            residual = iterate.requirement.residual[part]
            size = float(np.abs(residual).max(initial=0.0))
            if size > self.settings.tolerance:
                misses.append((size, term.describe(residual)))
        if self._clearances is not None and iterate.intrusion > self.settings.clearance_tolerance:
            text = self._clearances.describe(iterate.clearance.residual, iterate.pairs)
            misses.append((iterate.intrusion, text))
        text = "; ".join(miss for _, miss in sorted(misses, key=lambda item: -item[0])[:2])
        if limits:
            text += f"; at the end of their range: {', '.join(limits[:6])}"
        quick = replace(self.settings, explain=False)
        for name, lighter in without_one(self.problem) if self.settings.explain else ():
            if generate_posture(lighter, settings=quick).succeeded:
                return f"{text}; a posture exists without {name}"
        return text


@lru_cache(maxsize=16)
def _workspace(body: BodyModel) -> Configuration:
    """A state of a body that is always updated before it is used: making one takes as long as a few steps."""
    return Configuration(body)


def _starts(
    problem: PostureProblem, start: ArrayLike | None, settings: SolverSettings
) -> Iterator[tuple[FloatArray, bool]]:
    """Configurations to begin from, the most promising first, and whether each is near a solution."""
    if start is not None:
        yield frozen_array(start, "posture start", (problem.body.nq,), BodyError), True
        if not settings.restarts:
            return
    ready = [place_over_contacts(problem, q) for q in _templates(problem, settings)]
    configuration, terms = _workspace(problem.body), problem.requirements()

    def distance(q: FloatArray) -> float:
        return sum(float(np.sum(t.evaluate(configuration.update(q)).residual ** 2)) for t in terms)

    yield from ((q, False) for q in sorted(ready, key=distance))


def _templates(problem: PostureProblem, settings: SolverSettings) -> Iterator[FloatArray]:
    """The reference, and the reference bent as in :data:`RESTARTS`."""
    assert problem.reference is not None  # set on construction
    yield problem.reference
    for angles in RESTARTS if settings.restarts else ():
        q = np.array(problem.reference)
        for index, name in enumerate(problem.body.joint_names):
            q[7 + index] = next((value for key, value in angles.items() if name.endswith(key)), q[7 + index])
        yield q


def _bent(iterate: _Iterate, candidate: _Iterate, step: FloatArray) -> _Iterate:
    """The iterate, shifted so that the linear model of residuals and distances is exact at the candidate."""
    jacobian = iterate.requirement.jacobian
    distance, slope = iterate.clearance
    reached = dict(zip(candidate.pairs, candidate.clearance.residual, strict=True))
    shifts = [
        reached[pair] - linear if pair in reached else 0.0
        for pair, linear in zip(iterate.pairs, distance + slope @ step, strict=True)
    ]
    requirement = Linearised(candidate.requirement.residual - jacobian @ step, jacobian)
    clearance = Linearised(distance + np.array(shifts).reshape(-1), slope)
    return replace(iterate, requirement=requirement, clearance=clearance)


def _stack(parts: list[Linearised], nv: int) -> Linearised:
    if not parts:
        return Linearised(np.zeros(0), np.zeros((0, nv)))
    residuals, jacobians = zip(*parts, strict=True)
    return Linearised(np.concatenate(residuals), np.vstack(jacobians))
