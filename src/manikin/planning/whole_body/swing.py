"""Find a smooth swing that keeps clear of everything: simple curves first, then a local optimisation.

The first way of [Qiu2012]_ 6.2.3 to move a flying effector, made stronger: a small family of curves over
one apex is tried from the least to the most effort; where none keeps the wanted clearance, the best one is
moved by sequential quadratic programming (least squared jerk, linearised distances) until it does.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.planning.whole_body.swing_curve import (
    RESTING,
    SwingCurve,
    SwingState,
    basis,
    block_rows,
    jerk_energy,
)
from manikin.planning.whole_body.swing_path import Pose

Clearance = Callable[[float, Pose], float]
"""Signed distance [m] of an effector at a pose and a time [s] to everything it must not touch."""

HEIGHTS = (0.06, 0.10, 0.15, 0.22, 0.30, 0.42, 0.56, 0.70)
"""Apex heights above the higher end that are tried [m]."""

LATERALS, APEXES = (0.0, 0.10, -0.10, 0.20, -0.20), (0.5, 0.4, 0.6)
"""Lateral offsets of the apex that are tried [m], and shares of the duration at which it is passed."""


@dataclass(frozen=True)
class SwingLimits:
    """Limits that a swing must keep.

    Attributes:
        clearance: Distance to everything once the effector is away from its two contacts [m].
        speed: Largest linear speed [m/s].
        angular_speed: Largest angular speed [rad/s].
        departure: Clearance gained per metre moved away from a contact, where the effector may be as close to
            the surface as the contact itself.
        time_step: Spacing of the instants that are checked [s].
    """

    clearance: float = 0.025
    speed: float = 3.0
    angular_speed: float = 8.0
    departure: float = 0.5
    time_step: float = 0.004

    def __post_init__(self) -> None:
        finite_number(self.clearance, "swing limits clearance [m]", at_least=0.0)
        finite_number(self.speed, "swing limits speed [m/s]", above=0.0)
        finite_number(self.angular_speed, "swing limits angular_speed [rad/s]", above=0.0)
        finite_number(self.departure, "swing limits departure", at_least=0.0, at_most=1.0)
        finite_number(self.time_step, "swing limits time_step [s]", above=0.0)


@dataclass(frozen=True, eq=False)
class SwingPlan:
    """A curve, measured beside its limits.

    Attributes:
        slack: Smallest distance minus the distance required there [m]; negative is too close.
        clearance: Smallest distance while away from the two contacts [m].
        failure: None, or what is not kept, where and when.
    """

    curve: SwingCurve
    slack: float
    clearance: float
    failure: str | None

    @property
    def succeeded(self) -> bool:
        """Whether the curve keeps every limit."""
        return self.failure is None


def plan_swing(
    start: Pose, goal: Pose, start_time: float, end_time: float, clearance: Clearance, *,
    limits: SwingLimits | None = None, start_normal: ArrayLike = (0.0, 0.0, 1.0),
    end_normal: ArrayLike = (0.0, 0.0, 1.0), pitch: float = 0.0, refine: int = 20,
    heights: Sequence[float] = HEIGHTS, laterals: Sequence[float] = LATERALS,
) -> SwingPlan:  # fmt: skip
    """Find a smooth flight from ``start`` to ``goal`` that keeps clear.

    Args:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        clearance: Signed distance of the effector at a time and pose [m].
        start_normal: (3,) normal of the surface that is left.
        end_normal: (3,) normal of the surface that is reached.
        pitch: Extra turn about the effector's own y axis in early flight, toes down when positive [rad].
        refine: Largest number of iterations of the optimisation; 0 tries the family only.
        heights: Apex heights above the higher end that are tried [m].
        laterals: Lateral offsets of the apex that are tried, to the left of the travel [m].

    Returns:
        The curve found, or the best attempt and what it breaks.

    Raises:
        InputError: If the times or normals are not usable.
    """
    limits = limits or SwingLimits()
    leaving = frozen_array(start_normal, "swing start_normal", (3,))
    reaching = frozen_array(end_normal, "swing end_normal", (3,))
    if end_time <= start_time:
        raise InputError(f"swing ends at {end_time} s; valid: after its start at {start_time} s")
    family = (
        SwingCurve.lift(
            start, goal, start_time, end_time, height=height, lateral=lateral, apex=apex,
            start_normal=leaving, end_normal=reaching, pitch=pitch,
        )
        for height, lateral, apex in sorted(itertools.product(heights, laterals, APEXES), key=_exertion)
    )  # fmt: skip
    best = _first_clear(family, clearance, limits)
    curve, free = best.curve, _free_directions(leaving, reaching, len(best.curve.control_position))
    for _ in range(refine):
        step = _best_step(curve, clearance, limits, free)
        moved = curve.control_position + (free @ step).reshape(-1, 3)
        curve = SwingCurve(curve.start_time, curve.end_time, moved, curve.control_rotation)
        plan = check_swing(curve, clearance, limits)
        best = max(best, plan, key=_rank)
        if np.abs(step).max() < (SETTLED if plan.succeeded else STATIONARY):
            break
    return best


def check_swing(curve: SwingCurve, clearance: Clearance, limits: SwingLimits) -> SwingPlan:
    """Measure a curve against its limits, densely in time."""
    state, distance, required = _measured(curve, clearance, limits)
    slack = (distance - required)[1:-1]  # at the contacts themselves it is zero by definition
    worst = int(np.argmin(slack)) + 1
    in_flight = required >= limits.clearance
    smallest = float(distance[in_flight].min() if np.any(in_flight) else distance[1:-1].min())
    failure = curve.haste(limits.speed, limits.angular_speed)
    if slack[worst - 1] < -TOLERANCE:
        position = ", ".join(f"{x:.3f}" for x in state.position[worst])
        failure = (
            f"clearance is {distance[worst]:.4f} m at t = {state.time[worst]:.3f} s with the effector at "
            f"[{position}]; required {required[worst]:.4f} m"
        )
    return SwingPlan(curve, float(slack[worst - 1]), smallest, failure)


def _first_clear(family: Iterator[SwingCurve], clearance: Clearance, limits: SwingLimits) -> SwingPlan:
    """First curve that keeps the limits, or else the first of those nearest to clear.

    A curve is given up at the first instant at which it is too near and no better than the best one before
    it. Instants at which curves were given up are looked at first.
    """
    best, least = None, -np.inf
    # Order of few instants at which a curve is looked at before it is checked densely, and of the dense ones.
    coarse, dense = list[int](), list[int]()
    for curve in family:
        slack = _least_slack(curve, clearance, limits, least, coarse, 13)
        if slack >= -TOLERANCE:
            if curve.haste(limits.speed, limits.angular_speed) is not None:
                # Higher ones are faster still: what slows one down is the optimisation.
                return check_swing(curve, clearance, limits)
            slack = _least_slack(curve, clearance, limits, least, dense)
            if slack >= -TOLERANCE:
                return check_swing(curve, clearance, limits)
        if best is None or min(slack, 0.0) > least:
            best, least = curve, min(slack, 0.0)
    assert best is not None  # a family has members
    return check_swing(best, clearance, limits)


def _least_slack(
    curve: SwingCurve, clearance: Clearance, limits: SwingLimits, known: float, order: list[int],
    count: int | None = None,
) -> float:  # fmt: skip
    """Smallest slack [m]; of what is neither clear nor better than ``known``, the first that shows it.

    That instant becomes the first in the order in which they are looked at.
    """
    state = curve.evaluate(_instants(curve, limits, count))

    def distance(index: int) -> float:
        return clearance(float(state.time[index]), Pose(state.position[index], state.rotation[index]))

    last = len(state.time) - 1
    order[:] = order or range(1, last)
    required = _required(curve, state, (distance(0), distance(last)), limits)
    smallest, enough = np.inf, min(known + TOLERANCE, -TOLERANCE)
    for place, index in enumerate(order):
        smallest = min(smallest, distance(index) - float(required[index]))
        if smallest < enough:
            order.insert(0, order.pop(place))
            break
    return smallest


def _exertion(choice: tuple[float, float, float]) -> float:
    """Order of the heights, lateral offsets and apexes of the family, from the least to the most effort."""
    return choice[0] + 0.5 * abs(choice[1]) + 0.2 * abs(choice[2] - 0.5)


def _instants(curve: SwingCurve, limits: SwingLimits, count: int | None = None) -> FloatArray:
    count = count or max(33, int(np.ceil(curve.duration / limits.time_step)) + 1)
    return np.linspace(curve.start_time, curve.end_time, count)


def _measured(
    curve: SwingCurve, clearance: Clearance, limits: SwingLimits, count: int | None = None
) -> tuple[SwingState, FloatArray, FloatArray]:
    """States of a curve at its instants, with their distances and those required there [m]."""
    state = curve.evaluate(_instants(curve, limits, count))
    poses = zip(state.time, state.position, state.rotation, strict=True)
    distance = np.array([clearance(float(t), Pose(p, r)) for t, p, r in poses])
    return state, distance, _required(curve, state, (float(distance[0]), float(distance[-1])), limits)


def required_clearance(
    moved: tuple[ArrayLike, ArrayLike], at_contact: tuple[float, float], limits: SwingLimits
) -> FloatArray:
    """Distance wanted: the full one in flight, less near the two contacts.

    Args:
        moved: Distances from the pose at lift-off and from the one at touch-down, any shape [m].
        at_contact: Clearances at these two poses [m].
        limits: Clearance in flight and how it is gained.
    """
    left, reached = (
        contact + limits.departure * np.asarray(away) for away, contact in zip(moved, at_contact, strict=True)
    )
    return np.minimum(np.minimum(limits.clearance, left), reached)


def _required(
    curve: SwingCurve, state: SwingState, at_contact: tuple[float, float], limits: SwingLimits
) -> FloatArray:
    """Distance wanted at each instant of a curve, from those at its two contacts."""
    from_start = np.linalg.norm(state.position - curve.start.position, axis=1)
    to_end = np.linalg.norm(state.position - curve.end.position, axis=1)
    return required_clearance((from_start, to_end), at_contact, limits)


def _rank(plan: SwingPlan) -> tuple[bool, float]:
    """Order of preference: a curve that keeps the limits, then the least effort or the least violation."""
    return plan.succeeded, -plan.curve.effort if plan.succeeded else plan.slack


def _free_directions(start_normal: FloatArray, end_normal: FloatArray, n: int) -> FloatArray:
    """(3n, f) directions in which the control points may move: all inner ones, the lifts along the normal."""
    columns = []
    for index in range(RESTING, n - RESTING):
        lifts = {RESTING: start_normal, n - RESTING - 1: end_normal}
        block = lifts[index][:, None] / np.linalg.norm(lifts[index]) if index in lifts else np.eye(3)
        column = np.zeros((n, 3, block.shape[1]))
        column[index] = block
        columns.append(column.reshape(3 * n, -1))
    return np.hstack(columns)


TRUST, SETTLED, STATIONARY = 0.05, 0.004, 1e-5
"""Largest change of a control coordinate in one iteration, and changes below which the optimisation stops:
where the limits are kept, and where they are not but the next curve would be the same [m]."""

TOLERANCE, BUFFER = 5e-5, 0.003
"""Accuracy expected of distances, by which toes may dip as they leave, and what is aimed at beyond the
required clearance, for what lies between the samples [m]."""


def _best_step(curve: SwingCurve, clearance: Clearance, limits: SwingLimits, free: FloatArray) -> FloatArray:
    """One quadratic program: least squared jerk under linearised distances and speeds."""
    n = len(curve.control_position)
    # Least integral of squared jerk of a rest-to-rest flight of 1 m in 1 s: the unit of effort.
    energy = block_rows(jerk_energy(n) / 720.0)
    distance_rows, distance_lower = _distance_rows(curve, clearance, limits)
    speed_rows, speed_lower = _speed_rows(curve, limits)
    rows, count = np.vstack([distance_rows, speed_rows]) @ free, free.shape[1]
    lower = np.concatenate([distance_lower, speed_lower])
    # One last unknown: the worst violation, costly but allowed.
    hessian = np.zeros((count + 1, count + 1))
    hessian[:count, :count] = free.T @ energy @ free + 1e-6 * np.eye(count)
    hessian[count, count] = 1.0
    gradient = np.concatenate([free.T @ (energy @ curve.control_position.ravel()), [1e3]])
    matrix = np.hstack([rows, np.ones((len(rows), 1))])
    bounds = np.append(np.full(count, -TRUST), 0.0), np.append(np.full(count, TRUST), 1e3)
    solution = solve_qp(hessian, gradient, matrix, lower, None, bounds)
    return solution.x[:count] if solution.solved else np.zeros(count)


def _distance_rows(
    curve: SwingCurve, clearance: Clearance, limits: SwingLimits
) -> tuple[FloatArray, FloatArray]:
    """Rows G and bounds l of ``G dx >= l`` from the distances near the required ones."""
    # Spacing of the instants at which the optimisation linearises the distances [s].
    count, n = max(33, int(curve.duration / 0.012)), len(curve.control_position)
    state, distance, required = _measured(curve, clearance, limits, count)
    weights = basis((state.time - curve.start_time) / curve.duration, n)
    rows, lower = [], []
    for index in np.flatnonzero(distance - required < 0.1)[1:-1]:
        pose = Pose(state.position[index], state.rotation[index])
        slope = _slope(clearance, float(state.time[index]), pose, float(distance[index]))
        rows.append(np.kron(weights[index], slope))
        # Near its contacts the effector cannot have gained the whole buffer yet.
        buffer = BUFFER * min(1.0, max(0.0, required[index]) / max(limits.clearance, BUFFER))
        lower.append(required[index] + buffer - distance[index])
    return np.array(rows).reshape(-1, 3 * n), np.array(lower)


def _slope(clearance: Clearance, time: float, pose: Pose, distance: float) -> FloatArray:
    """Gradient of the clearance with the position, by forward differences."""
    step = 1e-4
    moved = (Pose(pose.position + step * axis, pose.rotation) for axis in np.eye(3))
    return np.array([(clearance(time, other) - distance) / step for other in moved])


def _speed_rows(curve: SwingCurve, limits: SwingLimits) -> tuple[FloatArray, FloatArray]:
    """Rows and bounds that keep the speed, linearised along the current velocity."""
    share = np.linspace(0.0, 1.0, 41)
    weights = basis(share, len(curve.control_position), 1) / curve.duration
    velocity = weights @ curve.control_position
    speed = np.linalg.norm(velocity, axis=1)
    fast = np.flatnonzero(speed > 0.7 * limits.speed)
    rows = [np.kron(weights[i], -velocity[i] / speed[i]) for i in fast]
    # In metres per a tenth of a second: comparable with the distances in the shared violation.
    matrix = 0.1 * np.array(rows).reshape(len(fast), 3 * len(curve.control_position))
    return matrix, 0.1 * (speed[fast] - 0.98 * limits.speed)
