"""The keyframe-based method: a smooth CoM through recorded positions ([Qiu2012]_ 5.3).

The CoM passes the recorded positions where the support changes, with the least velocity and jerk in between.
Balance is imposed at these key frames and measured every millisecond afterwards; where it is lost in between,
the recorded position there becomes one more key frame and the programme is solved again (5.3.3).
"""

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce

import numpy as np

from manikin.balance import WrenchPolytope
from manikin.numerics.polytope import Polytope
from manikin.numerics.spatial import FloatArray
from manikin.planning.com.com_certificate import (
    TOLERANCE,
    UNIT_SCALE,
    Residual,
    Residuals,
    measure,
    phase_margins,
    phase_times,
    position_excess,
)
from manikin.planning.com.com_problem import CentroidalProblem, CentroidalTrajectory
from manikin.planning.com.feasibility import (
    VANISHING_MARGIN,
    Failure,
    assess_feasibility,
    best_margin_at,
    misplaced,
    polytopes_of,
)
from manikin.planning.com.keyframe_problem import KeyframeProblem
from manikin.planning.com.keyframe_spline import KeyframeProgramme, build_keyframe_programme, phases_touching
from manikin.planning.com.timing_free import CentroidalResult, missed_margin

MAX_ROUNDS = 30
"""Key frames that are tried before the method gives up."""


@dataclass(frozen=True, eq=False)
class KeyframeResult(CentroidalResult):
    """A trajectory through the key frames with its certificate, or why there is none.

    Attributes:
        keyframes: What was asked; ``problem`` is its ``requirements``.
        frames: Samples of the recording that the trajectory passes, in order.
        added: Those among them that were added, in the order of their addition.
        least_margins: Least margin of the motion after each solution [N.m] or [N].
        programme: Programme of the last solution; None when nothing was attempted.
    """

    keyframes: KeyframeProblem
    frames: tuple[int, ...]
    added: tuple[int, ...]
    least_margins: tuple[float, ...]
    programme: KeyframeProgramme | None

    @property
    def added_times(self) -> tuple[float, ...]:
        """Instants of the added key frames [s], in the order of their addition."""
        return tuple(float(self.keyframes.recording.time[frame]) for frame in self.added)

    def _measured(self, trajectory: CentroidalTrajectory) -> Residuals:
        return _measure(self.keyframes, trajectory, self.polytopes, self.frames)


def plan_com_through_key_frames(problem: KeyframeProblem) -> KeyframeResult:
    """Find the smoothest balanced CoM trajectory through the key frames of a recording.

    Every programme is convex and solved to its one optimum (:mod:`manikin.planning.com.keyframe_spline`). A
    trajectory that does not meet its own certificate, measured every millisecond, gets key frames until it
    does or no sample is left that would help; then the result says which requirement could not be met.
    """
    return _KeyFrameSearch(problem).run()


@dataclass(frozen=True, eq=False)
class _Attempt:
    frames: tuple[int, ...]
    programme: KeyframeProgramme
    trajectory: CentroidalTrajectory
    certificate: Residuals


@dataclass
class _KeyFrameSearch:
    """The rounds of one problem."""

    problem: KeyframeProblem
    useless: set[int] = field(default_factory=set)
    added: list[int] = field(default_factory=list)
    least_margins: list[float] = field(default_factory=list)
    iterations: int = 0

    def run(self) -> KeyframeResult:
        began = clock.perf_counter()
        self.polytopes = polytopes_of(self.problem.requirements)
        # Propositions 1 and 2 and the ends, then each recorded position by itself.
        feasibility, attempt = assess_feasibility(self.problem.requirements, self.polytopes), None
        failure = feasibility.failure or _key_frame_failure(self.problem, self.polytopes)
        feasibility = replace(feasibility, failure=failure)
        if failure is None:
            first = tuple(self.problem.recording.key_frames.tolist())
            attempt = self._solve(first)
            failure = self._unsolvable(first) if attempt is None else None
        if attempt is not None:
            attempt = self._add_frames(attempt)
            failure = None if attempt.certificate.within() else self._explain(attempt)
        return KeyframeResult(
            problem=self.problem.requirements, polytopes=self.polytopes, feasibility=feasibility,
            failure=failure,
            trajectory=attempt.trajectory if attempt is not None and failure is None else None,
            certificate=None if attempt is None else attempt.certificate,
            iterations=self.iterations, rounds=len(self.least_margins),
            wall_time=clock.perf_counter() - began, keyframes=self.problem,
            frames=() if attempt is None else attempt.frames,
            added=() if attempt is None else tuple(f for f in self.added if f in attempt.frames),
            least_margins=tuple(self.least_margins),
            programme=None if attempt is None else attempt.programme,
        )  # fmt: skip

    def _add_frames(self, attempt: _Attempt) -> _Attempt:
        """Add the sample nearest to the worst violation until there is none, or no sample is left."""
        best = attempt
        for _ in range(MAX_ROUNDS):
            frame = None if attempt.certificate.within() else self._next_frame(attempt)
            if frame is None:
                break
            following = self._solve(tuple(sorted((*attempt.frames, frame))))
            if following is None:
                self.useless.add(frame)
                continue
            attempt = following
            self.added.append(frame)
            if attempt.certificate.rank < best.certificate.rank:
                best = attempt
        return best

    def _solve(self, frames: tuple[int, ...]) -> _Attempt | None:
        programme = self._programme(frames)
        solution = programme.solve(self.problem.requirements.required_margin)
        if solution is None:
            return None
        self.iterations += solution.iterations
        trajectory = self._trajectory(programme, solution.control_points)
        certificate = _measure(self.problem, trajectory, self.polytopes, frames)
        self.least_margins.append(certificate.min_margin)
        return _Attempt(frames, programme, trajectory, certificate)

    def _programme(self, frames: tuple[int, ...]) -> KeyframeProgramme:
        recording, index = self.problem.recording, list(frames)
        control_points = self.problem.control_points + len(frames) - len(recording.key_frames)
        return build_keyframe_programme(
            self.problem.requirements, self.polytopes, recording.schedule, recording.time[index],
            recording.com[index], control_points,
        )  # fmt: skip

    def _trajectory(self, programme: KeyframeProgramme, control_points: FloatArray) -> CentroidalTrajectory:
        mass, schedule = self.problem.requirements.mass, self.problem.recording.schedule
        return CentroidalTrajectory(mass, programme.spline(control_points), schedule)

    def _next_frame(self, attempt: _Attempt) -> int | None:
        """Sample nearest to the worst violation, among those far enough from all key frames."""
        recording = self.problem.recording
        key_times = recording.time[list(attempt.frames)]
        away = np.abs(recording.time[:, None] - key_times).min(axis=1)
        usable = away >= self.problem.frame_spacing - TOLERANCE
        usable[list(self.useless)] = False
        samples = np.flatnonzero(usable)
        gap_of_sample = np.searchsorted(key_times, recording.time[samples])
        time, severity = _violations(self.problem.requirements, attempt.trajectory, self.polytopes)
        gap_of_time = np.searchsorted(key_times, time)
        for index in np.argsort(-severity, kind="stable"):
            if severity[index] <= 0.0:
                return None
            near = samples[gap_of_sample == gap_of_time[index]]
            if len(near):
                return int(near[np.argmin(np.abs(recording.time[near] - time[index]))])
        return None

    def _unsolvable(self, frames: tuple[int, ...]) -> Failure:
        """Say how much margin the given key frames allow, and which of them limits it."""
        requirements, programme = self.problem.requirements, self._programme(frames)
        points, margin, row = programme.most_margin()
        phase = int(programme.phases[row])
        time = float(self.problem.recording.time[frames[programme.frames[row]]])
        what = (
            f"no spline of degree {programme.degree} with {len(points)} control points through the "
            f"{len(frames)} key frames keeps the required margin at all of them: the largest is {margin:.2f}"
        )
        trajectory = self._trajectory(programme, points)
        return missed_margin(requirements, trajectory, self.polytopes, phase, time, what)

    def _explain(self, attempt: _Attempt) -> Failure:
        """Name what the best attempt breaks between its key frames."""
        certificate, worst = attempt.certificate, attempt.certificate.largest
        count = len(attempt.frames) - len(self.problem.recording.key_frames)
        tried = f"with {count} key frames added, and no further sample of the recording helps"
        if worst.requirement != "balance margin":
            return Failure(worst.requirement, f"{worst} {tried}", worst.phase, worst.time)
        what = f"the largest margin found is {certificate.min_margin:.2f}"
        return missed_margin(
            self.problem.requirements, attempt.trajectory, self.polytopes, certificate.limiting_phase,
            certificate.limiting_time, what, f", {tried}",
        )  # fmt: skip


def _key_frame_failure(problem: KeyframeProblem, polytopes: Sequence[WrenchPolytope]) -> Failure | None:
    """Failure of a key frame whose recorded position breaks a constraint, or else cannot be balanced."""
    requirements, recording, frames = problem.requirements, problem.recording, []
    for number, frame in enumerate(recording.key_frames):
        time, com = float(recording.time[frame]), recording.com[frame]
        what = f"recorded CoM {np.round(com, 3).tolist()} of key frame {number} at {time:.3f} s"
        frames.append((time, com, what, phases_touching(recording.schedule, time)))
    for time, com, what, phases in frames:
        failure = misplaced(requirements, com, phases, what, TOLERANCE)
        if failure is not None:
            return replace(failure, time=time)
    for time, com, what, phases in frames:
        both = reduce(Polytope.intersection, [polytopes[phase] for phase in phases])
        margin, unit = best_margin_at(both, requirements, com, None), requirements.margin_unit
        if margin <= max(requirements.required_margin, VANISHING_MARGIN):
            stances = [recording.sequence[phase].stance for phase in phases]
            names = [name for name in stances[0].effectors if all(name in stance for stance in stances)]
            held = ", ".join(names) or "no contact"
            reason = (
                f"{what} reaches a margin of at most {margin:.2f} {unit} with any acceleration on {held}; "
                f"required {requirements.required_margin:g} {unit}"
            )
            return Failure("key frame balance", reason, phases[-1], time, held)
    return None


def _measure(
    problem: KeyframeProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope],
    frames: Sequence[int],
) -> Residuals:  # fmt: skip
    """Measure the requirements every millisecond, and the distance from the recording at the key frames."""
    certificate = measure(problem.requirements, trajectory, polytopes)
    times = problem.recording.time[list(frames)]
    errors = np.linalg.norm(trajectory.position(times) - problem.recording.com[list(frames)], axis=1)
    worst = int(np.argmax(errors))
    time, phase = float(times[worst]), int(trajectory.schedule.phase_at(times[worst]))
    distance = Residual("key frame position", float(errors[worst]), "m", phase, time)
    return replace(certificate, items=(*certificate.items, distance))


def _violations(
    problem: CentroidalProblem, trajectory: CentroidalTrajectory, polytopes: Sequence[WrenchPolytope]
) -> tuple[FloatArray, FloatArray]:
    """Every millisecond and the severity of the worst violation there, not positive where there is none."""
    times = phase_times(trajectory)
    margins = np.concatenate(phase_margins(problem, trajectory, polytopes))
    severity = (problem.required_margin - margins) / UNIT_SCALE[problem.margin_unit]
    for _, excess in position_excess(problem, trajectory, times):
        severity = np.maximum(severity, np.concatenate(excess) / UNIT_SCALE["m"])
    return np.concatenate(times), severity
