"""First trajectory for the optimisation: of a pendulum on the supports, or through their centres."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import linprog

from manikin.balance import WrenchPolytope
from manikin.centroidal.problem import CentroidalProblem
from manikin.contact import ContactKind, Stance
from manikin.spatial import GRAVITY, GRAVITY_VECTOR, FloatArray, skew
from manikin.spline import BSpline, clamped_knots, end_control_points, start_control_points


@dataclass(frozen=True)
class GuessStyle:
    """One way of guessing; several are tried in order.

    Attributes:
        pull: 0 follows the straight line from start to goal, 1 goes over the supports. None is the motion of
            a linear inverted pendulum on the supports.
        stretch: Durations as multiples of the lower bounds, before the bounds are applied.
    """

    pull: float | None
    stretch: float


INFEASIBLE = 2
"""Status of a linear programme without a solution."""

GUESS_STYLES = (GuessStyle(0.5, 1.5), GuessStyle(0.3, 1.2), GuessStyle(0.7, 2.5))
"""Of any motion."""

PENDULUM = GuessStyle(None, 1.5)
"""Of a body on its feet, before the others."""

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
    """Bezier points (phases, k + 1, 3) [m] and durations (phases,) [s] to start from.

    Args:
        problem: What to find.
        style: How to guess.
        polytopes: W_i of the phases about ``problem.reference``.
    """
    durations = _guess_durations(problem, style.stretch, polytopes)
    instants = np.concatenate([[0.0], np.cumsum(durations)])
    if style.pull is None:
        return _pendulum(problem, instants).bezier_points(), durations
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


def _pendulum(problem: CentroidalProblem, instants: FloatArray) -> BSpline:
    """Path of a linear inverted pendulum whose zero moment point is near the middles of the supports.

    Its height is that of the start. With ``c`` the middle of a phase's supports and ``h`` the height above
    them, the spline minimises ``|p - h / g p'' - c|^2 + w^2 |p^(3)|^2`` over samples of the motion; as ``h``
    is given, this is linear least squares. The true height changes evenly along the way.
    """
    k = problem.degree
    knots = clamped_knots(k, instants)
    count = len(knots) - k - 1
    share = (np.arange(_PENDULUM_SAMPLES) + 0.5) / _PENDULUM_SAMPLES
    durations = np.diff(instants)
    times = (instants[:-1, None] + durations[:, None] * share).ravel()
    weight = np.repeat(np.sqrt(durations), _PENDULUM_SAMPLES)[:, None]
    middles = np.array([
        np.mean([contact.points_in_world.mean(axis=0) for contact in phase.stance], axis=0)
        for phase in problem.sequence
    ])  # fmt: skip
    wanted = np.repeat(middles[:, :2], _PENDULUM_SAMPLES, axis=0)
    height = problem.start_com[2] - middles[0, 2]
    basis = BSpline(k, knots, np.eye(count))
    rows = np.vstack([
        weight * (basis(times) - height / GRAVITY * basis(times, 2)), _JERK_TIME * weight * basis(times, 3)
    ])  # fmt: skip
    values = np.vstack([weight * wanted, np.zeros_like(wanted)])
    rest = np.zeros(3)
    first = start_control_points(k, knots, problem.start_com, _or(problem.start_velocity, rest), rest)
    last = end_control_points(k, knots, problem.goal_com, _or(problem.goal_velocity, rest), rest)
    points = np.linspace(problem.start_com, problem.goal_com, count)
    points[: len(first)], points[count - len(last) :] = first, last
    inner = slice(len(first), count - len(last))
    given = rows[:, : inner.start] @ first[:, :2] + rows[:, inner.stop :] @ last[:, :2]
    points[inner, :2] = np.linalg.lstsq(rows[:, inner], values - given, rcond=None)[0]
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
    if way[-1] > 0.0:
        points[inner, 2] = np.interp(way[inner], way[[0, -1]], points[[0, -1], 2])
    return BSpline(k, knots, points)


def _or(given: FloatArray | None, default: FloatArray) -> FloatArray:
    return default if given is None else given


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
    found = linprog(
        np.zeros(3),
        polytope.H[:, 3:] @ -skew(weight),
        polytope.h - polytope.H[:, :3] @ weight,
        bounds=(None, None),
        method="highs",
    )
    return found.status != INFEASIBLE


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
