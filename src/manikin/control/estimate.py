"""State of a body estimated from noisy measurements and the accelerations that control decided on.

Torques of a control that takes noisy measurements for the state jump by a large share of the strength from
one step to the next.  The filter is a Kalman filter of place, velocity and disturbance along each coordinate,
with the constant gains to which it settles; place and velocity are measured at every step.  The disturbance
is the acceleration beside the one decided on: of masses that are not as believed, or of a push.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg import solve_discrete_are

from manikin.body import BodyModel
from manikin.numerics.spatial import FloatArray, finite_number

LEVER = 0.3
"""Length by which noise of a velocity [m/s] is that of an angular rate [rad/s]; our choice [m]."""

SURPRISE = (1.0, 5.0)
"""Standard deviations of the root's acceleration [m/s^2] and of the angular ones [rad/s^2] from what was
decided on, anew in each step: contacts early or late, other masses, pushes.  See docs/execution.md."""

WANDERING = (0.4, 2.0)
"""Standard deviations by which the disturbance of the root [m/s^2] and the angular ones [rad/s^2] change in a
second, as of random walks; chosen on trials of five scenarios, see docs/execution.md."""

EXACT = 1e-3
"""Least noise that is thought of a measurement beside a noisy one, relative to what the surprise of one
period makes of the same."""


@dataclass(frozen=True)
class StateNoise:
    """Standard deviations of what control is told of the state, anew at every control step.

    Attributes:
        angle: Of the root's attitude about each axis and of each hinge [rad].
        position: Of the root along each axis [m].
        velocity: Of the root along each axis [m/s]; of angular rates over :data:`LEVER`.
    """

    angle: float = 0.0
    position: float = 0.0
    velocity: float = 0.0

    def __post_init__(self) -> None:
        for name in ("angle", "position", "velocity"):
            finite_number(getattr(self, name), f"state noise {name!r}", at_least=0.0)

    def told(
        self, body: BodyModel, q: FloatArray, v: FloatArray, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """Configuration (nq,) and velocity (nv,) as control is told them."""
        near, rate = rng.standard_normal((2, body.nv))
        near[:3] *= self.position
        near[3:] *= self.angle
        rate *= self.velocity
        rate[3:] /= LEVER
        return pin.integrate(body.pinocchio, q, near), v + rate

    def gains(self, period: float) -> tuple[FloatArray, FloatArray]:
        """(3, 2) gains of the root's place, velocity and disturbance, and of the angular ones."""
        place = settled_gain(self.position, self.velocity, SURPRISE[0], WANDERING[0], period)
        return place, settled_gain(self.angle, self.velocity / LEVER, SURPRISE[1], WANDERING[1], period)


def settled_gain(
    place: float, velocity: float, acceleration: float, wandering: float, period: float
) -> FloatArray:
    """(3, 2) gain to which the Kalman filter of place, velocity and disturbance settles.

    Args:
        place: Standard deviation of the measured place.
        velocity: The same of the velocity; without any noise at all both are believed.
        acceleration: Standard deviation of the acceleration from the known one, anew in each period [s].
        wandering: Standard deviation of the change of the disturbance within a second.
    """
    if place == velocity == 0.0:
        return np.eye(3)[:, :2]
    passing = np.array([[1.0, period, 0.5 * period**2], [0.0, 1.0, period], [0.0, 0.0, 1.0]])
    pushed = acceleration * np.array([0.5 * period**2, period, 0.0])
    wanders = np.diag([0.0, 0.0, period * wandering**2])
    measured = np.diag(np.maximum([place, velocity], EXACT * pushed[:2]) ** 2)
    seen = np.eye(3)[:, :2]
    spread = solve_discrete_are(passing.T, seen, np.outer(pushed, pushed) + wanders, measured)
    told = seen.T @ spread @ seen + measured
    return np.asarray(np.linalg.solve(told, seen.T @ spread).T, dtype=np.float64)


class StateEstimator:
    """Estimates configuration, velocity and disturbance step by step.

    Attributes:
        disturbance: (nv,) generalised acceleration beside the one decided on, as believed now.
    """

    def __init__(self, body: BodyModel, noise: StateNoise, period: float) -> None:
        """Prepare for measurements with some noise at every period [s]."""
        self._model = body.pinocchio
        self._period = period
        place, angle = noise.gains(period)
        self._gain = np.repeat(np.stack([place, angle]), (3, body.nv - 3), axis=0)
        self._last: tuple[FloatArray, FloatArray] | None = None
        self.disturbance: FloatArray = np.zeros(body.nv)

    def update(self, q: FloatArray, v: FloatArray, acceleration: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Configuration (nq,) and velocity (nv,) believed now; the first ones as they are measured.

        Args:
            q: (nq,) measured configuration.
            v: (nv,) measured velocity.
            acceleration: (nv,) generalised acceleration of the torques that have acted since the last step,
                without the disturbance.
        """
        if self._last is not None:
            before, rate = self._last
            passed, acceleration = self._period, acceleration + self.disturbance
            way = passed * rate + 0.5 * passed**2 * acceleration
            there, then = pin.integrate(self._model, before, way), rate + passed * acceleration
            innovation = np.stack([pin.difference(self._model, there, q), v - then], axis=1)
            by_place, by_rate, by_push = np.einsum("nij,nj->in", self._gain, innovation)
            q, v = pin.integrate(self._model, there, by_place), then + by_rate
            self.disturbance = self.disturbance + by_push
        self._last = q, v
        return q, v
