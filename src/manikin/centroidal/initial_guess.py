"""First trajectory for the optimisation: through the centres of the shared supports."""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from manikin.centroidal.problem import CentroidalProblem
from manikin.contact import Stance
from manikin.spatial import FloatArray
from manikin.spline import BSpline, clamped_knots, end_control_points, start_control_points


@dataclass(frozen=True)
class GuessStyle:
    """One way of guessing; several are tried in order.

    Attributes:
        pull: 0 follows the straight line from start to goal, 1 goes over the supports.
        stretch: Durations as multiples of the lower bounds, before the bounds are applied.
    """

    pull: float
    stretch: float


GUESS_STYLES = (GuessStyle(0.5, 1.5), GuessStyle(0.3, 1.2), GuessStyle(0.7, 2.5))


def guess(problem: CentroidalProblem, style: GuessStyle) -> tuple[FloatArray, FloatArray]:
    """Bezier points (phases, k + 1, 3) [m] and durations (phases,) [s] to start from."""
    durations = _guess_durations(problem, style.stretch)
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    path = PchipInterpolator(instants, _guess_key_positions(problem, instants, style.pull))
    k = problem.degree
    knots = clamped_knots(k, instants)
    rest = (problem.start_velocity, problem.goal_velocity)
    times = np.linspace(0.0, instants[-1], 20 * len(durations) + 1)
    spline = BSpline.fit(
        k, knots, times, path(times),
        first=start_control_points(k, knots, problem.start_com, rest[0]),
        last=end_control_points(k, knots, problem.goal_com, rest[1]),
    )  # fmt: skip
    return spline.bezier_points(), durations


def _guess_durations(problem: CentroidalProblem, stretch: float) -> FloatArray:
    lower, upper = problem.min_durations, problem.max_durations
    durations = np.minimum(stretch * lower + 0.1, upper)
    if problem.max_duration is not None and durations.sum() > problem.max_duration:
        room = problem.max_duration - lower.sum()
        durations = lower + 0.95 * room * (durations - lower) / max((durations - lower).sum(), 1e-9)
    return durations


def _guess_key_positions(problem: CentroidalProblem, instants: FloatArray, pull: float) -> FloatArray:
    progress = (instants / instants[-1])[:, None]
    positions = problem.start_com + progress * (problem.goal_com - problem.start_com)
    stances = [phase.stance for phase in problem.sequence]
    for index, (before, after) in enumerate(itertools.pairwise(stances), start=1):
        centre = _shared_centre(before, after)
        if centre is not None:
            positions[index, :2] += pull * (centre[:2] - positions[index, :2])
    return positions


def _shared_centre(before: Stance, after: Stance) -> FloatArray | None:
    """Mean position of the contacts held across a key instant, or of all when none is."""
    held = [contact.position for contact in before if contact.effector in after]
    held = held or [contact.position for stance in (before, after) for contact in stance]
    return np.mean(held, axis=0) if held else None
