"""A walking path: where a walker is and how it moves from start to goal, with its cost and residuals."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.numerics.spatial import FloatArray
from manikin.numerics.spline import BSpline, basis_matrix
from manikin.walking.path.walk_obstacles import Walker, WalkObstacle, clearance
from manikin.walking.path.walking_model import (
    WalkObjective,
    body_motion,
    cost_rates,
    runge_kutta,
    state_derivative,
)

SAMPLING = 0.01
"""Longest step between the instants of the arrays [s]."""

TOLERANCE = 1e-4
"""Residuals up to which a path counts as meeting what was asked [m], [rad], [m/s], [rad/s]."""

HOLONOMIC_ANGLE = np.radians(15.0)
"""Angle between heading and motion from which a motion is holonomic [rad] ([Truong2010]_ 4.2.1)."""

_DENSE = 4000


@dataclass(frozen=True)
class WalkingResiduals:
    """Largest violations of a task by a path, measured without the solver.

    Attributes:
        position: Between the path and the model (5.5) under its accelerations, and at the goal [m].
        heading: The same [rad]; a goal is met up to whole turns.
        velocity: The same of forward and lateral velocity, and of those asked at the ends [m/s].
        angular: The same of the angular velocity [rad/s].
        cost: Between the solver's cost and that of a sum over many more instants, as a share [-].
        penetration: Lack of room beside obstacles, negative where there is more [m]; -inf without obstacles.
        overspeed: Speed beyond its limit [m/s]; -inf without a limit.
    """

    position: float
    heading: float
    velocity: float
    angular: float
    cost: float
    penetration: float
    overspeed: float

    def within(self, tolerance: float = TOLERANCE) -> bool:
        """Whether none but ``cost`` exceeds the tolerance."""
        return all(value <= tolerance for name, value in vars(self).items() if name != "cost")


@dataclass(frozen=True, eq=False)
class WalkingTask:
    """Start, goal and constraints of a walk.

    Places are (3,) x, y [m], heading [rad], velocities (3,) forward, left [m/s], angular [rad/s].

    Attributes:
        room: Distance to keep from obstacles [m].
        max_speed: Limit of the speed over the floor [m/s], or None.
    """

    start: FloatArray
    goal: FloatArray
    objective: WalkObjective
    obstacles: tuple[WalkObstacle, ...]
    walker: Walker
    room: float
    max_speed: float | None
    start_velocity: FloatArray
    goal_velocity: FloatArray


class SampledWalk(ABC):
    """Series of a walk at even instants, at most :data:`SAMPLING` apart, from its functions of time."""

    duration: float
    failure: str | None

    @abstractmethod
    def place_at(self, time: ArrayLike) -> FloatArray:
        """(..., 3) x, y [m] and heading [rad] at (...) instants [s]."""

    @abstractmethod
    def motion_at(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """(..., 3) velocities and (..., 3) accelerations of the body at (...) instants [s]."""

    @property
    def stretches(self) -> tuple[tuple[float, float], ...]:
        """Instants at which it begins to move from rest, and at which it rests again [s]."""
        return ((0.0, self.duration),)

    @property
    def succeeded(self) -> bool:
        """Whether it is a solution of its task."""
        return self.failure is None

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants of the series [s]."""
        return _frozen(np.linspace(0.0, self.duration, int(np.ceil(self.duration / SAMPLING)) + 1))

    @cached_property
    def place(self) -> FloatArray:
        """(n, 3) x, y [m], heading [rad], continuous."""
        return _frozen(self.place_at(self.time))

    @cached_property
    def velocity(self) -> FloatArray:
        """(n, 3) forward, left [m/s] and angular velocity [rad/s]."""
        return _frozen(self.motion_at(self.time)[0])

    @cached_property
    def acceleration(self) -> FloatArray:
        """(n, 3) rates of the velocities: the controls of (5.5), the lateral one to the left."""
        return _frozen(self.motion_at(self.time)[1])

    @property
    def x(self) -> FloatArray:
        """(n,) [m]."""
        return self.place[:, 0]

    @property
    def y(self) -> FloatArray:
        """(n,) [m]."""
        return self.place[:, 1]

    @property
    def heading(self) -> FloatArray:
        """(n,) [rad], continuous."""
        return self.place[:, 2]


@dataclass(frozen=True, eq=False)
class WalkingPath(SampledWalk):
    """The best path found for a task; x forward, y left, headings counter-clockwise from the world's x.

    Attributes:
        task: What was asked.
        spline: x, y [m] and heading [rad] over the share of the duration, [0, 1].
        duration: Free end time T [s].
        cost: Of the objective [-].
        guess: Name of the initial guess that led to it.
        iterations: Iterations of the solver from that guess.
        failure: Why it is not a solution, or None. Then the path is the nearest attempt.
        others: Cost reached from every guess that converged, by its name.
    """

    task: WalkingTask
    spline: BSpline
    duration: float
    cost: float
    guess: str
    iterations: int
    failure: str | None = None
    others: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def length(self) -> float:
        """Length of the way over the floor [m]."""
        speed = np.hypot(*self._dense.velocity[:, :2].T)
        return float(np.trapezoid(speed, self._dense.time))

    @cached_property
    def cost_terms(self) -> dict[str, float]:
        """Weighted terms of the cost by name [-], each a sum over many instants."""
        values = self.task.objective.weights * self.term_integrals()
        return dict(zip(self.task.objective.terms, values.tolist(), strict=True))

    @cached_property
    def deviation(self) -> FloatArray:
        """(n,) direction of the motion from the heading, in (-pi, pi] [rad]; at rest, that of the start."""
        velocity = self.velocity.copy()
        # At the ends the direction is that of the acceleration out of rest, or into it.
        for end, sign in ((0, 1.0), (-1, -1.0)):
            if np.hypot(*velocity[end, :2]) < 1e-9:
                velocity[end] = sign * self.acceleration[end]
        return np.arctan2(velocity[:, 1], velocity[:, 0])

    @property
    def holonomic(self) -> NDArray[np.bool_]:
        """(n,) whether heading and motion are 15 degrees or more apart ([Truong2010]_ 4.2.1)."""
        return np.abs(self.deviation) >= HOLONOMIC_ANGLE

    def place_at(self, time: ArrayLike) -> FloatArray:
        """(..., 3) x, y [m] and heading [rad] at (...) times within the walk [s]."""
        return self.spline(np.asarray(time, dtype=np.float64) / self.duration)

    def motion_at(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """(..., 3) velocities and (..., 3) accelerations of the body at (...) times within the walk [s]."""
        share, duration = np.asarray(time, dtype=np.float64) / self.duration, self.duration
        place, rate, second = (self.spline(share, order) for order in range(3))
        return body_motion(place, rate / duration, second / duration**2)

    def term_integrals(self, intervals: int = _DENSE) -> FloatArray:
        """(k,) integrals of the terms without their weights, by Simpson's rule over evenly many intervals."""
        dense = self._dense if intervals == _DENSE else self._sampled(intervals)
        rates = cost_rates(
            dense.place, dense.velocity, dense.acceleration, dense.jerk, self.task.goal, self.task.objective
        )
        weights = np.full(len(rates), 2.0)
        weights[1::2], weights[0], weights[-1] = 4.0, 1.0, 1.0
        return self.duration / (3.0 * intervals) * weights @ rates

    def residuals(self) -> WalkingResiduals:
        """Integrate the model under the accelerations and measure everything densely, without the solver."""
        task, dense = self.task, self._dense
        drift = np.abs(self._integrated() - np.hstack([self.place, self.velocity])).max(axis=0)
        ends = np.abs(self.velocity[[0, -1]] - [task.start_velocity, task.goal_velocity]).max(axis=0)
        missed = np.abs(self.place[-1] - task.goal)
        missed[2] = abs(np.angle(np.exp(1j * missed[2])))
        room = clearance(task.obstacles, task.walker, dense.place, dense.time)
        speed = np.hypot(*dense.velocity[:, :2].T)
        cost = float(self.task.objective.weights @ self.term_integrals())
        return WalkingResiduals(
            position=float(max(drift[:2].max(), missed[:2].max())),
            heading=float(max(drift[2], missed[2])),
            velocity=float(max(drift[3:5].max(), ends[:2].max())),
            angular=float(max(drift[5], ends[2])),
            cost=abs(cost / self.cost - 1.0),
            penetration=task.room - float(room.min()) if room.size else -np.inf,
            overspeed=-np.inf if task.max_speed is None else float(speed.max()) - task.max_speed,
        )

    def _integrated(self) -> FloatArray:
        """(n, 6) states of the model (5.5) from the start, by Runge and Kutta's rule between the instants."""
        halves = np.linspace(0.0, self.duration, 8 * (len(self.time) - 1) + 1)
        state, step = np.append(self.task.start, self.task.start_velocity), (self.time[1] - self.time[0]) / 4
        return runge_kutta(state_derivative, state, self.motion_at(halves)[1], step)[::4]

    @cached_property
    def _dense(self) -> "_Dense":
        return self._sampled(_DENSE)

    def _sampled(self, intervals: int) -> "_Dense":
        spline, duration = self.spline, self.duration
        orders = _even_basis(spline.degree, tuple(spline.knots.tolist()), intervals) @ spline.control_points
        motion = body_motion(orders[0], orders[1] / duration, orders[2] / duration**2)
        time = np.linspace(0.0, duration, intervals + 1)
        return _Dense(time, orders[0], *motion, orders[3] / duration**3)


@lru_cache(maxsize=4)
def _even_basis(degree: int, knots: tuple[float, ...], intervals: int) -> FloatArray:
    """(4, n + 1, k) values of the basis of a spline and their derivatives, at even instants."""
    shares = np.linspace(0.0, 1.0, intervals + 1)
    return np.stack([basis_matrix(degree, knots, shares, order) for order in range(4)])


class _Dense(NamedTuple):
    """A path at many instants."""

    time: FloatArray
    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


def _frozen(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array
