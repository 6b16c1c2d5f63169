"""A balanced CoM near the key frames of a recording: the keyframe-based method for noisy ones.

:func:`~manikin.centroidal.keyframes.plan_com_through_key_frames` passes the recorded positions exactly, as
[Qiu2012]_ 5.3 does. Where a walk's supports last a tenth of a second, a centimetre of error asks for
accelerations that no foot can give, and further key frames make it worse. Here the key frames pull, balance
is imposed all along, and the motion is measured every millisecond. Where it strays from the recording,
the sample that is farthest off becomes one more key frame. With the recorded rate of the angular momentum the
plan keeps its balance twice: as a point mass, as in the thesis, and with a rate near the recorded one.
"""

import time as clock
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from manikin.balance import WrenchPolytope
from manikin.centroidal.certificate import TOLERANCE, Residuals, measure, phase_margins
from manikin.centroidal.feasibility import Failure, Feasibility, assess_feasibility, polytopes_of
from manikin.centroidal.keyframe_problem import KeyframeProblem
from manikin.centroidal.near_programme import NearProgramme
from manikin.centroidal.problem import CentroidalProblem
from manikin.centroidal.timing_free import CentroidalResult
from manikin.centroidal.trajectory import CentroidalTrajectory
from manikin.errors import InputError
from manikin.spatial import FloatArray

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
class _Attempt:
    frames: tuple[int, ...]
    points: FloatArray
    trajectory: CentroidalTrajectory
    problem: CentroidalProblem
    certificate: Residuals


def plan_com_near_key_frames(problem: KeyframeProblem) -> NearKeyFramesResult:
    """Find a smooth CoM that keeps its balance and comes near the key frames of a recording.

    The ends are free: position and velocity of the first and last sample pull like those of any key frame.
    The number of control points follows from the duration.

    Args:
        problem: What to find, without conditions on velocity or acceleration of the ends, with a margin in
            the space of wrenches. A distance from the supports and geometric constraints are measured, not
            sought.

    Raises:
        InputError: If the problem has conditions on the ends, or a margin in the space of forces.
    """
    _check(problem)
    return _Search(problem).run()


class _Search:
    """The rounds of one problem."""

    def __init__(self, problem: KeyframeProblem) -> None:
        asked, recording = problem.requirements, problem.recording
        self.problem, self.recording, self.iterations, self.rounds = problem, recording, 0, 0
        self.polytopes: tuple[WrenchPolytope, ...] = polytopes_of(asked)
        self.programme = NearProgramme.of(asked.mass, self.polytopes, recording, asked.weights)

    def run(self) -> NearKeyFramesResult:
        began = clock.perf_counter()
        feasibility = assess_feasibility(self.problem.requirements, self.polytopes)
        failure, best = _hopeless(feasibility), None
        if failure is None:
            best = self._best()
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

    def _best(self) -> _Attempt | None:
        """The nearest of the balanced attempts, each with more key frames than the one before."""
        best = None
        for attempt in self._attempts():
            if best is None or self._order(attempt) < self._order(best):
                best = attempt
        return best

    def _attempts(self) -> Iterator[_Attempt]:
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

    def _order(self, attempt: _Attempt) -> tuple[bool, float]:
        return not attempt.certificate.within(), float(np.sqrt(np.mean(self._distance(attempt) ** 2)))

    def _solve(self, frames: tuple[int, ...], start: FloatArray | None) -> _Attempt | None:
        """Linearise and solve until nothing moves and the margin is kept between the instants as well."""
        index, required = list(frames), self.problem.requirements.required_margin
        shares = np.minimum(self.recording.time[index] / self.recording.time[-1], 1.0)
        wanted = self.recording.com[index]
        points = self.programme.free(shares, wanted) if start is None else start
        margin, attempt = np.full(len(self.polytopes), required + SPARE), None
        for _ in range(LINEARISATIONS):
            self.rounds += 1
            found = self.programme.solve(shares, wanted, margin, points)
            if found is None:
                return attempt
            moved = float(np.abs(found[0] - points).max())
            points, self.iterations = found[0], self.iterations + found[1]
            if moved > STILL:
                continue
            attempt = self._measured(frames, points)
            missing = required - np.array([float(values.min()) for values in self._margins(attempt)])
            if np.all(missing <= 0.0):
                break
            margin += np.where(missing > 0.0, missing + 0.5 * SPARE, 0.0)
        return self._measured(frames, points)

    def _measured(self, frames: tuple[int, ...], points: FloatArray) -> _Attempt:
        asked = self.problem.requirements
        trajectory = CentroidalTrajectory(
            asked.mass, self.programme.spline(points), self.recording.schedule,
            turning=self.programme.turning_spline(points),
        )  # fmt: skip
        problem = replace(asked, start_com=points[0, :3], goal_com=points[-1, :3])
        measured = [measure(problem, way, self.polytopes) for way in _ways(trajectory)]
        worst = min(measured, key=lambda certificate: certificate.min_margin)
        return _Attempt(frames, points, trajectory, problem, worst)

    def _margins(self, attempt: _Attempt) -> list[FloatArray]:
        """Of each phase, the lesser ones of the point mass and of the body that turns."""
        found = [phase_margins(attempt.problem, way, self.polytopes) for way in _ways(attempt.trajectory)]
        return [np.minimum.reduce(margins) for margins in zip(*found, strict=True)]

    def _distance(self, attempt: _Attempt) -> FloatArray:
        offset = attempt.trajectory.position(self.recording.time) - self.recording.com
        return np.linalg.norm(offset, axis=1)

    def _straying(self, attempt: _Attempt) -> list[int]:
        """The farthest sample between each two key frames, where it is too far off and not too near them."""
        distance, time, found = self._distance(attempt), self.recording.time, []
        for before, after in zip(attempt.frames[:-1], attempt.frames[1:], strict=True):
            away = np.minimum(time - time[before], time[after] - time)
            usable = np.where(away >= self.problem.frame_spacing - TOLERANCE, distance, 0.0)
            if usable.max() > STRAY:
                found.append(int(np.argmax(usable)))
        return found

    def _explain(self, best: _Attempt | None) -> Failure | None:
        if best is None:
            return Failure(
                "balance margin", "no smooth centre of mass near the key frames keeps its balance all along"
            )
        if best.certificate.within():
            return None
        worst = best.certificate.largest
        return Failure(worst.requirement, f"{worst} near the key frames", worst.phase, worst.time)


def _ways(trajectory: CentroidalTrajectory) -> tuple[CentroidalTrajectory, ...]:
    """The trajectory, and without its turning."""
    return (trajectory,) if trajectory.turning is None else (trajectory, replace(trajectory, turning=None))


def _hopeless(feasibility: Feasibility) -> Failure | None:
    """What no motion can do; the recorded ends are only wished for."""
    failure = feasibility.failure
    return None if failure is None or failure.requirement in ("start balance", "goal balance") else failure


def _check(problem: KeyframeProblem) -> None:
    asked = problem.requirements
    for name in ("start_velocity", "goal_velocity", "start_acceleration", "goal_acceleration"):
        if getattr(asked, name) is not None:
            raise InputError(f"near key frames {name} is given; valid: None, for the recording pulls there")
    if asked.margin_space != "wrench":
        raise InputError(f"near key frames margin_space is {asked.margin_space!r}; valid: wrench")
