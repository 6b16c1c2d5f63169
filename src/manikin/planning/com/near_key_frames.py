"""A balanced CoM near the key frames of a recording: the keyframe-based method for noisy ones.

[Qiu2012]_ 5.3 passes the recorded positions exactly. Where a walk's supports last a tenth of a second, a
centimetre of error asks for accelerations that no foot can give. Here the key frames pull, and where the
motion strays from the recording, the sample that is farthest off becomes one more key frame.

Balance is imposed every ten milliseconds by a quadratic programme: the pseudo-wrench ``m [a - g; p x (a -
g)]`` ([Qiu2012]_ 4.6) is linearised about the last solution, whose position gives the rows their lengths
about the CoM. Where the recorded rate of the angular momentum is known, the plan has one too, near it, and
both wrenches keep their balance: that of the point mass, as in the thesis, and that of the body which turns
([Qiu2012]_ 4.51). More margin than has to be kept is wished for. All this is our own.
"""

import itertools
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from manikin.balance import WrenchPolytope
from manikin.balance.margin import wrench_levers
from manikin.errors import InputError
from manikin.numerics.qp import solve_sparse_qp
from manikin.numerics.spatial import GRAVITY_VECTOR, FloatArray, skew
from manikin.numerics.spline import BSpline, basis_matrix, clamped_knots
from manikin.planning.com.com_certificate import TOLERANCE, Residuals, measure, phase_margins
from manikin.planning.com.com_problem import CentroidalProblem, CentroidalTrajectory
from manikin.planning.com.feasibility import Failure, assess_feasibility, polytopes_of
from manikin.planning.com.keyframe_problem import KeyframeProblem, RecordedCom
from manikin.planning.com.keyframe_spline import quadrature
from manikin.planning.com.timing_free import CentroidalResult

DEGREE = 5
"""Degree of the spline ([Qiu2012]_ 5.3.3)."""

KNOT_SPACING = 0.05
"""Largest distance of the spline's knots: steps of a walk are supports of a tenth of a second [s]."""

BALANCE_STEP = 0.01
"""Largest distance of two instants at which balance is imposed [s]."""

FACETS = 16
"""Facets of a polytope that an instant is kept from: the nearest ones."""

PULL = 1e4
"""Cost of a mean squared distance from the key frames, against that of a speed of 1 m/s [1/m^2]."""

TURN = 100.0
"""Unit of the rate of the angular momentum among the unknowns [N.m]."""

TURN_PULL = 2.0
"""Cost of its mean squared distance from the recorded one: 10 N.m cost as much as 1 mm at key frames."""

RESERVE = 5.8
"""Margin of the body that turns beyond the point mass's: it keeps its planned turning only nearly [N.m]."""

ROOM = 14.5
"""Margin wished for beyond that, for whoever follows the plan to come back to it [N.m]."""

ROOM_PULL = 1.0
"""Cost of the mean square of the share of it that lacks: as much as key frames missed by a centimetre."""

TURN_BEND = 1e-7
"""Cost of its mean squared second derivative, in that unit [s^4]."""


class NearProgramme:
    """Quadratic programme of a CoM near key frames: what does not depend on the last solution."""

    def __init__(
        self, problem: CentroidalProblem, polytopes: Sequence[WrenchPolytope], recording: RecordedCom
    ) -> None:
        """Lay out knots and instants for polytopes W_i of the phases about one point.

        Of the weights, those of velocity, acceleration and jerk count, the first entry for all three axes.
        """
        weights, instants = problem.weights, recording.schedule.instants
        duration = float(instants[-1])
        self.mass, self.polytopes, self.reference = problem.mass, polytopes, polytopes[0].reference
        self.knots = clamped_knots(DEGREE, np.linspace(0.0, 1.0, max(1, round(duration / KNOT_SPACING)) + 1))
        # (n, n) objective of one axis without the pull; (n, n) and (n, 3) one of the turning, or None.
        costs = {1: weights.velocity[0], 2: weights.acceleration[0], 3: weights.jerk[0]}
        self.smoothness = _squared(self.knots, duration, costs)
        self.turning = _turning(self.knots, duration, recording)
        # (m,) phases of the instants at which balance is imposed, (m, n) CoM and acceleration by points.
        ends = itertools.pairwise(instants)
        times = [np.linspace(a, b, int(np.ceil((b - a) / BALANCE_STEP)) + 1) for a, b in ends]
        self.phases = np.repeat(np.arange(len(times)), [len(part) for part in times])
        shares = np.minimum(np.concatenate(times) / duration, 1.0)
        self.position = basis_matrix(DEGREE, self.knots, shares)
        self.acceleration = basis_matrix(DEGREE, self.knots, shares, 2) / duration**2

    def spline(self, points: FloatArray) -> BSpline:
        """CoM over [0, 1] of control points (n, 3 or 6)."""
        return BSpline(DEGREE, self.knots, points[:, :3])

    def turning_spline(self, points: FloatArray) -> BSpline | None:
        """Rate of the angular momentum over [0, 1] of control points (n, 3 or 6) [N.m]."""
        return None if self.turning is None else BSpline(DEGREE, self.knots, TURN * points[:, 3:])

    def free(self, shares: FloatArray, wanted: FloatArray) -> FloatArray:
        """(n, 3 or 6) control points, of CoM and turning, near (f, 3) ``wanted`` [m], unbalanced."""
        points = [np.linalg.solve(q, -line) for q, line in self._objectives(shares, wanted)]
        return np.asarray(np.hstack(points), dtype=np.float64)

    def solve(
        self, shares: FloatArray, wanted: FloatArray, margin: FloatArray, near: FloatArray
    ) -> tuple[FloatArray, int] | None:
        """Control points and iterations; None when the linearised programme has no solution.

        Key frames are (f,) ``shares`` of [0, 1] with (f, 3) ``wanted`` CoM [m]; the margin (phases,) is kept
        [N.m], and the wrench linearised about (n, 3 or 6) control points ``near``.
        """
        parts = self._objectives(shares, wanted)
        linear = np.hstack([line for _, line in parts])
        rows, bounds = self._balance(margin, near)
        axes = [np.diag(np.repeat(np.arange(len(parts)) == number, 3)) for number in range(len(parts))]
        whole = sum(np.kron(quadratic, axis) for (quadratic, _), axis in zip(parts, axes, strict=True))
        lacking, free = len(self.phases), np.full(linear.size, np.inf)
        cost = sparse.block_diag([whole, ROOM_PULL / lacking * sparse.eye_array(lacking)])
        solution = solve_sparse_qp(
            2.0 * cost, 2.0 * np.append(linear.ravel(), np.zeros(lacking)), rows, None, bounds,
            (np.append(-free, np.zeros(lacking)), np.append(free, np.ones(lacking))),
        )  # fmt: skip
        if not solution.solved:
            return None
        return solution.x[: linear.size].reshape(linear.shape), solution.iterations

    def _objectives(self, shares: FloatArray, wanted: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """(n, n) and (n, 3) of CoM and turning: the objective is ``C' Q C + 2 l' C`` of each axis."""
        basis = basis_matrix(DEGREE, self.knots, shares)
        pull = PULL / len(shares) * basis.T
        com = self.smoothness + pull @ basis, -pull @ wanted
        return [com] if self.turning is None else [com, self.turning]

    def _balance(self, margin: FloatArray, near: FloatArray) -> tuple[Any, FloatArray]:
        """Rows and bounds of unit length; ``p x b`` is ``p0 x b + p x b0 - p0 x b0`` with ``b = a - g``."""
        blocks, bounds, gravity = [], [], GRAVITY_VECTOR
        for row, phase in enumerate(self.phases.tolist()):
            polytope, place, change = self.polytopes[phase], self.position[row], self.acceleration[row]
            force, moment = self.mass * polytope.H[:, :3], self.mass * polytope.H[:, 3:]
            p, b = place @ near[:, :3] - self.reference, change @ near[:, :3] - gravity
            length = wrench_levers(polytope.H, p[None])[0]
            by_acceleration, by_position = force + moment @ skew(p), -moment @ skew(b)
            bound = polytope.h - margin[phase] * length + by_acceleration @ gravity + moment @ np.cross(p, b)
            still = bound - by_acceleration @ (b + gravity) - by_position @ p
            bound += by_position @ self.reference
            # Derivatives (facets, 3) by the turning: None of the point mass, those of the body that turns.
            for turn in (None,) if self.turning is None else (None, TURN * polytope.H[:, 3:]):
                room = still - (0.0 if turn is None else turn @ (place @ near[:, 3:]))
                chosen = np.argsort(room / length, kind="stable")[:FACETS]
                block = change[:, None] * by_acceleration[chosen, None]
                block = block + place[:, None] * by_position[chosen, None]
                if self.turning is not None:
                    by_turn = np.zeros((len(chosen), 3)) if turn is None else turn[chosen]
                    block = np.concatenate([block, place[:, None] * by_turn[:, None]], axis=2)
                block = block.reshape(len(chosen), -1)
                scale = np.linalg.norm(block, axis=1)
                # Only the wrench that is planned for, not that of the point mass beside it, has room.
                wished = 0.0 if turn is None and self.turning is not None else ROOM
                where = np.arange(len(chosen)), np.full(len(chosen), row)
                lacking = -wished * length[chosen] / scale
                lacks = sparse.csr_matrix((lacking, where), shape=(len(chosen), len(self.phases)))
                blocks.append(sparse.hstack([block / scale[:, None], lacks]))
                spare = wished + (0.0 if turn is None else RESERVE)
                bounds.append((bound[chosen] - spare * length[chosen]) / scale)
        return sparse.vstack(blocks).tocsc(), np.concatenate(bounds)


def _turning(
    knots: FloatArray, duration: float, recording: RecordedCom
) -> tuple[FloatArray, FloatArray] | None:
    """(n, n) and (n, 3) objective of the rate of the angular momentum, near the recorded one."""
    if recording.angular_momentum_rate is None:
        return None
    basis = basis_matrix(DEGREE, knots, np.minimum(recording.time / duration, 1.0))
    pull = TURN_PULL / len(basis) * basis.T
    bend = _squared(knots, duration, {2: TURN_BEND})
    return pull @ basis + bend, -pull @ recording.angular_momentum_rate / TURN


def _squared(knots: FloatArray, duration: float, costs: Mapping[int, float]) -> FloatArray:
    """(n, n) mean over time of the weighted squared derivatives by order, exact for the polynomials."""
    times, share = quadrature(DEGREE, knots)
    total = np.zeros((len(knots) - DEGREE - 1,) * 2)
    for order, cost in costs.items():
        basis = basis_matrix(DEGREE, knots, times, order) / duration**order
        total += cost * basis.T @ (share[:, None] * basis)
    return total


STRAY = 0.01
"""Distance from the recording from which a sample becomes a key frame [m]."""

FRAME_ROUNDS = 6
"""Times that key frames are added at most."""

LINEARISATIONS = 12
"""Programmes for one set of key frames at most."""

SPARE = 0.5
"""Margin asked for beyond the required one at first, and then by as much as it is missed between the
instants at which it is imposed [N.m]."""

STILL = 1e-4
"""A solution whose control points move less has converged [m]."""


@dataclass(frozen=True, eq=False)
class NearKeyFramesResult(CentroidalResult):
    """A balanced trajectory near a recording, or why there is none.

    Attributes:
        keyframes: What was asked; ``problem`` are its requirements with the ends that were found.
        frames: Samples of the recording that pulled, in order.
        added: Those among them that are no changes of support.
        distance: (n,) of the CoM from the recording at its samples [m]; NaN without a trajectory.
    """

    keyframes: KeyframeProblem
    frames: tuple[int, ...]
    added: tuple[int, ...]
    distance: FloatArray

    @property
    def rms(self) -> float:
        """Root mean square of the distance [m]."""
        return float(np.sqrt(np.mean(self.distance**2)))


@dataclass(frozen=True, eq=False)
class _NearAttempt:
    frames: tuple[int, ...]
    points: FloatArray
    trajectory: CentroidalTrajectory
    problem: CentroidalProblem
    certificate: Residuals


def plan_com_near_key_frames(problem: KeyframeProblem) -> NearKeyFramesResult:
    """Find a smooth CoM that keeps its balance and comes near the key frames of a recording.

    The ends are free: the first and last sample pull like any key frame. The number of control points follows
    from the duration. A distance from the supports and geometric constraints are measured, not sought.

    Raises:
        InputError: If the problem has conditions on velocity or acceleration of the ends, or a margin that
            is not one in the space of wrenches.
    """
    asked = problem.requirements
    for name in ("start_velocity", "goal_velocity", "start_acceleration", "goal_acceleration"):
        if getattr(asked, name) is not None:
            raise InputError(f"near key frames {name} is given; valid: None, for the recording pulls there")
    if asked.margin_space != "wrench":
        raise InputError(f"near key frames margin_space is {asked.margin_space!r}; valid: wrench")
    return _NearSearch(problem).run()


class _NearSearch:
    """The rounds of one problem."""

    def __init__(self, problem: KeyframeProblem) -> None:
        asked, recording = problem.requirements, problem.recording
        self.problem, self.recording, self.iterations, self.rounds = problem, recording, 0, 0
        self.polytopes: tuple[WrenchPolytope, ...] = polytopes_of(asked)
        self.programme = NearProgramme(asked, self.polytopes, recording)

    def run(self) -> NearKeyFramesResult:
        began = clock.perf_counter()
        feasibility = assess_feasibility(self.problem.requirements, self.polytopes)
        failure, best = feasibility.failure, None
        if failure is not None and failure.requirement in ("start balance", "goal balance"):
            failure = None  # the recorded ends are only wished for
        if failure is None:
            # The nearest of the balanced attempts, each with more key frames than the one before.
            best = min(self._attempts(), key=self._order, default=None)
            failure = self._explain(best)
        succeeded = best is not None and failure is None
        distance = np.full(len(self.recording.time), np.nan) if best is None else self._distance(best)
        changes = set(self.recording.key_frames.tolist())
        frames = () if best is None else best.frames
        return NearKeyFramesResult(
            problem=self.problem.requirements if best is None else best.problem, polytopes=self.polytopes,
            feasibility=replace(feasibility, failure=failure), failure=failure,
            trajectory=best.trajectory if best is not None and succeeded else None,
            certificate=None if best is None else best.certificate, iterations=self.iterations,
            rounds=self.rounds, wall_time=clock.perf_counter() - began, keyframes=self.problem, frames=frames,
            added=tuple(frame for frame in frames if frame not in changes), distance=distance,
        )  # fmt: skip

    def _attempts(self) -> Iterator[_NearAttempt]:
        frames, start = tuple(self.recording.key_frames.tolist()), None
        for _ in range(FRAME_ROUNDS):
            attempt = self._solve(frames, start)
            if attempt is None:
                return
            yield attempt
            further = self._straying(attempt)
            if not further:
                return
            frames, start = tuple(sorted({*frames, *further})), attempt.points

    def _order(self, attempt: _NearAttempt) -> tuple[bool, float]:
        return not attempt.certificate.within(), float(np.sqrt(np.mean(self._distance(attempt) ** 2)))

    def _solve(self, frames: tuple[int, ...], start: FloatArray | None) -> _NearAttempt | None:
        """Linearise and solve until nothing moves and the margin is kept between the instants as well."""
        index, required = list(frames), self.problem.requirements.required_margin
        shares = np.minimum(self.recording.time[index] / self.recording.time[-1], 1.0)
        wanted = self.recording.com[index]
        points = self.programme.free(shares, wanted) if start is None else start
        margin, attempt = np.full(len(self.polytopes), required + SPARE), None
        for _ in range(LINEARISATIONS):
            self.rounds += 1
            solution = self.programme.solve(shares, wanted, margin, points)
            if solution is None:
                return attempt
            moved = float(np.abs(solution[0] - points).max())
            points, self.iterations = solution[0], self.iterations + solution[1]
            if moved > STILL:
                continue
            attempt = self._measured(frames, points)
            missing = required - np.array([float(values.min()) for values in self._margins(attempt)])
            if np.all(missing <= 0.0):
                break
            margin += np.where(missing > 0.0, missing + 0.5 * SPARE, 0.0)
        return self._measured(frames, points)

    def _measured(self, frames: tuple[int, ...], points: FloatArray) -> _NearAttempt:
        asked = self.problem.requirements
        trajectory = CentroidalTrajectory(
            asked.mass, self.programme.spline(points), self.recording.schedule,
            turning=self.programme.turning_spline(points),
        )  # fmt: skip
        problem = replace(asked, start_com=points[0, :3], goal_com=points[-1, :3])
        measured = [measure(problem, way, self.polytopes) for way in _ways(trajectory)]
        worst = min(measured, key=lambda certificate: certificate.min_margin)
        return _NearAttempt(frames, points, trajectory, problem, worst)

    def _margins(self, attempt: _NearAttempt) -> list[FloatArray]:
        """Margins of each phase, the lesser of the point mass and of the body that turns [N.m]."""
        both = [phase_margins(attempt.problem, way, self.polytopes) for way in _ways(attempt.trajectory)]
        return [np.minimum.reduce(margins) for margins in zip(*both, strict=True)]

    def _distance(self, attempt: _NearAttempt) -> FloatArray:
        offset = attempt.trajectory.position(self.recording.time) - self.recording.com
        return np.linalg.norm(offset, axis=1)

    def _straying(self, attempt: _NearAttempt) -> list[int]:
        """The farthest sample between each two key frames, where it is too far off and not too near them."""
        distance, time, frames = self._distance(attempt), self.recording.time, []
        for before, after in itertools.pairwise(attempt.frames):
            away = np.minimum(time - time[before], time[after] - time)
            usable = np.where(away >= self.problem.frame_spacing - TOLERANCE, distance, 0.0)
            if usable.max() > STRAY:
                frames.append(int(np.argmax(usable)))
        return frames

    def _explain(self, best: _NearAttempt | None) -> Failure | None:
        if best is None:
            reason = "no smooth centre of mass near the key frames keeps its balance all along"
            return Failure("balance margin", reason)
        if best.certificate.within():
            return None
        worst = best.certificate.largest
        return Failure(worst.requirement, f"{worst} near the key frames", worst.phase, worst.time)


def _ways(trajectory: CentroidalTrajectory) -> tuple[CentroidalTrajectory, ...]:
    """The trajectory, and the same without its turning."""
    return (trajectory,) if trajectory.turning is None else (trajectory, replace(trajectory, turning=None))
