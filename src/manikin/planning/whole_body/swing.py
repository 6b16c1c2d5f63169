"""Find a smooth swing that keeps clear of everything: simple curves first, then a local optimisation.

The first way of [Qiu2012]_ 6.2.3 to move a flying effector, made stronger: a small family of curves over
one apex is tried from the least to the most effort; where none keeps the wanted clearance, the best one is
moved by sequential quadratic programming (least squared jerk, linearised distances) until it does.
"""

import itertools
from collections.abc import Iterator, Sequence
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
from manikin.planning.whole_body.swing_path import FlightClearance, Pose

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
    start: Pose, goal: Pose, start_time: float, end_time: float, clearance: FlightClearance, *,
    limits: SwingLimits | None = None, start_normal: ArrayLike = (0.0, 0.0, 1.0),
    end_normal: ArrayLike = (0.0, 0.0, 1.0), pitch: float = 0.0, refine: int = 20,
    heights: Sequence[float] = HEIGHTS, laterals: Sequence[float] = LATERALS,
) -> SwingPlan:  # fmt: skip
    """Find a smooth flight from ``start`` to ``goal`` that keeps clear.

    Args:
        start_time: Lift-off [s].
        end_time: Touch-down [s].
        clearance: Of the effector.
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
    gauge = _Gauge.of(start, goal, (start_time, end_time), clearance, limits)
    best = gauge.first_clear(family)
    curve, free = best.curve, _free_directions(leaving, reaching, len(best.curve.control_position))
    for _ in range(refine):
        step = gauge.best_step(curve, free)
        moved = curve.control_position + (free @ step).reshape(-1, 3)
        curve = SwingCurve(curve.start_time, curve.end_time, moved, curve.control_rotation)
        plan = gauge.check(curve)
        best = max(best, plan, key=_rank)
        if np.abs(step).max() < (SETTLED if plan.succeeded else STATIONARY):
            break
    return best


def check_swing(curve: SwingCurve, clearance: FlightClearance, limits: SwingLimits) -> SwingPlan:
    """Measure a curve against its limits, densely in time."""
    times = curve.start_time, curve.end_time
    return _Gauge.of(curve.start, curve.end, times, clearance, limits).check(curve)


@dataclass(frozen=True, eq=False)
class _Gauge:
    """Measures the curves of one flight.

    Attributes:
        at_contact: (2,) clearances at both ends [m].
    """

    clearance: FlightClearance
    limits: SwingLimits
    at_contact: FloatArray

    @classmethod
    def of(
        cls,
        start: Pose,
        goal: Pose,
        times: tuple[float, float],
        clearance: FlightClearance,
        limits: SwingLimits,
    ) -> "_Gauge":
        """The gauge of flights between two poses."""
        position, rotation = (np.array(part) for part in zip(start, goal, strict=True))
        return cls(clearance, limits, clearance(np.array(times), position, rotation).distance)

    def check(self, curve: SwingCurve) -> SwingPlan:
        """See :func:`check_swing`."""
        state, distance, required = self._dense(curve, LOOKED)
        in_flight = required >= self.limits.clearance
        in_flight = in_flight if in_flight.any() else np.arange(len(required)) % (len(required) - 1) > 0
        if not np.isfinite([(distance - required)[1:-1].min(), distance[in_flight].min()]).all():
            state, distance, required = self._dense(curve, np.inf)
        slack = (distance - required)[1:-1]  # at the contacts themselves it is zero by definition
        worst = int(np.argmin(slack)) + 1
        failure = curve.haste(self.limits.speed, self.limits.angular_speed)
        if slack[worst - 1] < -TOLERANCE:
            position = ", ".join(f"{x:.3f}" for x in state.position[worst])
            failure = (
                f"clearance is {distance[worst]:.4f} m at t = {state.time[worst]:.3f} s with the effector at "
                f"[{position}]; required {required[worst]:.4f} m"
            )
        return SwingPlan(curve, float(slack[worst - 1]), float(distance[in_flight].min()), failure)

    def first_clear(self, family: Iterator[SwingCurve]) -> SwingPlan:
        """First curve that keeps the limits, or else the first of those nearest to clear.

        A curve is given up at the first instant at which it is too near and no better than the best one
        before it. Instants at which curves were given up are looked at first.
        """
        best, least = None, -np.inf
        # Order of few instants at which a curve is looked at before it is checked densely, and of the dense
        # ones.
        coarse, dense = list[int](), list[int]()
        for curve in family:
            slack = self._least_slack(curve, least, coarse, 13)
            if slack >= -TOLERANCE:
                if curve.haste(self.limits.speed, self.limits.angular_speed) is not None:
                    # Higher ones are faster still: what slows one down is the optimisation.
                    return self.check(curve)
                slack = self._least_slack(curve, least, dense)
                if slack >= -TOLERANCE:
                    return self.check(curve)
            if best is None or min(slack, 0.0) > least:
                best, least = curve, min(slack, 0.0)
        assert best is not None  # a family has members
        return self.check(best)

    def _least_slack(
        self, curve: SwingCurve, known: float, order: list[int], count: int | None = None
    ) -> float:
        """Smallest slack [m]; of what is neither clear nor better than ``known``, the first that shows it.

        That instant becomes the first in the order in which they are looked at. Of what is clear it is
        infinite.
        """
        state = curve.evaluate(self._instants(curve, count))
        required = self._required(state)
        order[:] = order or range(1, len(required) - 1)
        smallest, enough = np.inf, min(known + TOLERANCE, -TOLERANCE)
        for first, last in ((0, 1), (1, len(order))):
            rows = order[first:last]
            poses = state.time[rows], state.position[rows], state.rotation[rows]
            slack = self.clearance(*poses, required[rows]).distance - required[rows]
            shown = np.flatnonzero(slack < enough)
            if len(shown):
                order.insert(0, order.pop(first + int(shown[0])))
                return float(min(smallest, slack[: shown[0] + 1].min()))
            smallest = min(smallest, float(slack.min(initial=np.inf)))
        return smallest

    def _instants(self, curve: SwingCurve, count: int | None = None) -> FloatArray:
        count = count or max(33, int(np.ceil(curve.duration / self.limits.time_step)) + 1)
        return np.linspace(curve.start_time, curve.end_time, count)

    def _required(self, state: SwingState) -> FloatArray:
        """Distance wanted at each instant of a whole curve, from those at its two contacts."""
        from_start, to_end = (np.linalg.norm(state.position - state.position[end], axis=1) for end in (0, -1))
        return required_clearance((from_start, to_end), self.at_contact, self.limits)

    def _dense(self, curve: SwingCurve, room: float) -> tuple[SwingState, FloatArray, FloatArray]:
        """States at dense instants, distances where less than a room beyond those required, and these [m]."""
        state = curve.evaluate(self._instants(curve))
        required = self._required(state)
        near = self.clearance(state.time, state.position, state.rotation, required + room)
        return state, near.distance, required

    def best_step(self, curve: SwingCurve, free: FloatArray) -> FloatArray:
        """One quadratic program: least squared jerk under linearised distances and speeds.

        Args:
            free: (3n, f) directions in which the control points may move, whose shares are found.
        """
        n = len(curve.control_position)
        # Least integral of squared jerk of a rest-to-rest flight of 1 m in 1 s: the unit of effort.
        energy = block_rows(jerk_energy(n) / 720.0)
        distance_rows, distance_lower = self._distance_rows(curve)
        speed_rows, speed_lower = _speed_rows(curve, self.limits)
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

    def _distance_rows(self, curve: SwingCurve) -> tuple[FloatArray, FloatArray]:
        """Rows G and bounds l of ``G dx >= l`` from the distances near the required ones."""
        # Spacing of the instants at which the optimisation linearises the distances [s].
        count, n = max(33, int(curve.duration / 0.012)), len(curve.control_position)
        state = curve.evaluate(self._instants(curve, count))
        required = self._required(state)
        near = self.clearance(state.time, state.position, state.rotation, required + 0.1)
        index = np.flatnonzero(np.isfinite(near.distance))[1:-1]
        weights = basis((state.time[index] - curve.start_time) / curve.duration, n)
        rows = (weights[:, :, None] * near.gradient[index, None]).reshape(-1, 3 * n)
        # Near its contacts the effector cannot have gained the whole buffer yet.
        share = np.clip(required[index] / max(self.limits.clearance, BUFFER), 0.0, 1.0)
        return rows, required[index] + BUFFER * share - near.distance[index]


def _exertion(choice: tuple[float, float, float]) -> float:
    """Order of the heights, lateral offsets and apexes of the family, from the least to the most effort."""
    return choice[0] + 0.5 * abs(choice[1]) + 0.2 * abs(choice[2] - 0.5)


def required_clearance(
    moved: tuple[ArrayLike, ArrayLike], at_contact: FloatArray, limits: SwingLimits
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

LOOKED = 0.02
"""Distances this much beyond the required one are measured at first: the least one mostly is [m]."""


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
