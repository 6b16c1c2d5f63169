"""The unified walking model: a body on the floor that goes forward, sideways and turns ([Truong2010]_ 5.3).

The thesis counts the lateral velocity to the right (5.5) and orders its state ``(x, y, theta, v_f, omega,
v_l)``. Everywhere in this project left is positive, and lateral comes before angular.

A walk costs time, accelerations and looking away from the goal ([Truong2010]_ 5.4-5.5).
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number

TERMS = ("time", "forward", "lateral", "angular", "goal")
"""Names of the five terms of (5.6), in the order of every vector of them."""

FURTHER_TERMS = ("speed", "turning", "jerk", "work", "tangential")
"""Names of terms of other models, most of which the thesis tried and rejected (5.6).

They follow the others where one has a weight."""

POWER_BLUR, SPEED_BLUR = 0.05, 0.05
"""Power per mass [W/kg] and speed [m/s] below which the terms of work and of the speed's rate are rounded
off, where they have no slope."""


@dataclass(frozen=True)
class WalkObjective:
    """``T + a1 int u_forward^2 + a2 int u_lateral^2 + a3 int u_angular^2 + a4 int w(r) psi^2`` (5.6).

    ``psi`` is the direction of the goal from the body's heading, in (-pi, pi] (5.7), which at the goal has no
    value. Here it fades with the distance ``r`` of the goal as ``w = r^2 / (r^2 + goal_fade^2)``, by default
    within the radius in which the thesis' subjects stepped sideways without turning (4.6, Fig. 4.23); a fade
    of a few centimetres gives the criterion as it is printed.

    The defaults are the numbers of (5.8) in the order of the text of 5.5.1: lateral accelerations cost about
    1.5 times what forward ones do, angular ones less. Read literally, (5.5) and (5.8) swap the two:
    :data:`LITERAL_ORDER`.

    Attributes:
        time: a0 [1/s].
        forward: a1 [s^3/m^2].
        lateral: a2 [s^3/m^2].
        angular: a3 [s^3/rad^2].
        goal: a4 [1/(s rad^2)].
        goal_fade: Distance at which the goal term has faded to one half [m].
        speed: Of the square of the speed over the floor, as of kinetic energy [s/m^2].
        turning: Of the square of the angular velocity [s/rad^2].
        jerk: Of the square of the third derivative of the place [s^5/m^2].
        work: Of the mechanical work per mass done on the body, either way, ``|v a|`` [s^2/m^2].
        tangential: Of the square of the rate of the speed over the floor [s^3/m^2] (2.3).
    """

    time: float = 1.0
    forward: float = 1.2
    lateral: float = 1.7
    angular: float = 0.7
    goal: float = 5.2
    goal_fade: float = 0.5
    speed: float = 0.0
    turning: float = 0.0
    jerk: float = 0.0
    work: float = 0.0
    tangential: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            where, least = (
                f"walking weight {name.replace('_', ' ')}",
                0.0 if name in ("goal", *FURTHER_TERMS) else None,
            )
            number = finite_number(value, where, at_least=least, above=0.0 if least is None else None)
            object.__setattr__(self, name, number)

    @property
    def further(self) -> bool:
        """Whether a term beyond those of (5.6) has a weight."""
        return any(getattr(self, name) > 0.0 for name in FURTHER_TERMS)

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of its terms: :data:`TERMS`, with :data:`FURTHER_TERMS` if one of them has a weight."""
        return TERMS + FURTHER_TERMS if self.further else TERMS

    @property
    def weights(self) -> FloatArray:
        """(k,) weights in the order of :attr:`terms`."""
        return np.array([getattr(self, name) for name in self.terms])

    def straight_duration(self, distance: float) -> float:
        """Duration of the best walk straight ahead, ``(36 a1 d^2 / a0)^(1/4)`` [s]; its cost is 4/3 a0 T."""
        return float((36.0 * self.forward * distance**2 / self.time) ** 0.25)


PROSE_ORDER = WalkObjective()
"""The weights of (5.8) as the text of 5.5.1 explains them."""

LITERAL_ORDER = WalkObjective(lateral=0.7, angular=1.7)
"""The weights of (5.8) with u_1, u_2, u_3 as (5.5) names them."""

RECORDED_WALKS = WalkObjective(forward=4.4, lateral=2.7, angular=0.82, goal=1.2)
"""Identified from 42 recorded walks of all kinds at once, to two digits (``docs/inverse.md``); ours."""

RECORDED_TURNS = WalkObjective(forward=2.8, lateral=0.58, angular=0.63, goal=1.1)
"""Identified from the 15 of them in which somebody turns a corner, so that heading and way part; ours.

With these weights most walks to goals 1 to 3 m away begin and end holonomically, as in the thesis (4.5)."""


def goal_direction(place: FloatArray, goal: FloatArray) -> FloatArray:
    """(n,) psi of (n, 3) places: direction of the goal from the heading, in (-pi, pi] [rad] (5.7)."""
    offset = goal[:2] - place[:, :2]
    cos, sin = np.cos(place[:, 2]), np.sin(place[:, 2])
    return np.arctan2(cos * offset[:, 1] - sin * offset[:, 0], cos * offset[:, 0] + sin * offset[:, 1])


def cost_rates(
    place: FloatArray, velocity: FloatArray, acceleration: FloatArray, jerk: FloatArray,
    goal: FloatArray, objective: WalkObjective,
) -> FloatArray:  # fmt: skip
    """(n, k) integrands of the terms of an objective without their weights.

    Args:
        place: (n, 3) x, y [m], heading [rad].
        velocity: (n, 3) forward, left [m/s], angular [rad/s].
        acceleration: (n, 3) forward, left [m/s^2], angular [rad/s^2].
        jerk: (n, 3) third derivatives of x, y [m/s^3] and heading [rad/s^3].
        goal: (3,) x, y [m], heading [rad].
        objective: Which terms, and where that of the goal fades.
    """
    square = np.sum((goal[:2] - place[:, :2]) ** 2, axis=1)
    faded = square / (square + objective.goal_fade**2) * goal_direction(place, goal) ** 2
    rates = np.column_stack([np.ones(len(place)), acceleration**2, faded])
    if not objective.further:
        return rates
    # The rate of half the square of the speed is the same in every frame.
    power = np.sum(velocity[:, :2] * acceleration[:, :2], axis=1)
    square = np.sum(velocity[:, :2] ** 2, axis=1)
    work, tangential = np.hypot(power, POWER_BLUR) - POWER_BLUR, power**2 / (square + SPEED_BLUR**2)
    jerks = np.sum(jerk[:, :2] ** 2, axis=1)
    return np.column_stack([rates, square, velocity[:, 2] ** 2, jerks, work, tangential])


START = (0.0, 0.0, float(np.pi / 2))
"""Where every subject stood: x, y [m], heading [rad] ([Truong2010]_ Fig. 4.14)."""


def experiment_targets() -> FloatArray:
    """106 targets like those of the experiment ([Truong2010]_ 4.3.3).

    The thesis states 106 targets at 32 places of [-3, 3] x [-1, 1] m, 16 on either side, with headings out
    of eight from 0 to 7 pi/4; which ones is in a drawing only. Here the places are 0.5, 1, 2 and 3 m to
    either side and -1, 0, 0.5 and 1 m ahead, with three or four of the headings at each.

    Returns:
        (106, 3) x, y [m], heading [rad], in [0, 2 pi).
    """
    targets = []
    for number, (x, y) in enumerate(itertools.product((0.5, 1.0, 2.0, 3.0), (-1.0, 0.0, 0.5, 1.0))):
        headings = [(3 * number + step) % 8 for step in ((0, 2, 4, 6) if number % 3 == 0 else (0, 3, 5))]
        for heading in headings[: 4 if number < 15 else 3]:
            angle = heading * np.pi / 4
            targets += [(x, y, angle), (-x, y, (np.pi - angle) % (2.0 * np.pi))]
    return np.array(targets)


def state_derivative(state: ArrayLike, control: ArrayLike) -> FloatArray:
    """(..., 6) rate of a state under accelerations ([Truong2010]_ 5.5, with left positive).

    States are (..., 6) x, y [m], heading [rad], forward and left [m/s], angular velocity [rad/s], controls
    (..., 3) rates of the velocities.
    """
    z, u = _last(state, 6, "walking state"), _last(control, 3, "walking control")
    rate = np.empty((*np.broadcast_shapes(z.shape[:-1], u.shape[:-1]), 6))
    rate[..., :3] = to_world(z[..., 2], z[..., 3:])
    rate[..., 3:] = u
    return rate


def runge_kutta(
    derivative: Callable[[FloatArray, FloatArray], FloatArray], state: FloatArray, controls: FloatArray,
    step: float | FloatArray,
) -> FloatArray:  # fmt: skip
    """(n + 1, ...) states after every step by the classical rule of fourth order, from a state (...).

    Args:
        derivative: Rate of a state under a control.
        controls: (2 n + 1, ...) at the ends and the middle of every step.
        step: Length of a step, a number or of a shape that multiplies states.
    """
    states = [state]
    for i in range(0, len(controls) - 1, 2):
        first = derivative(state, controls[i])
        second = derivative(state + step / 2 * first, controls[i + 1])
        third = derivative(state + step / 2 * second, controls[i + 1])
        fourth = derivative(state + step * third, controls[i + 2])
        state = state + step / 6 * (first + 2 * second + 2 * third + fourth)
        states.append(state)
    return np.array(states)


def to_world(heading: ArrayLike, velocity: ArrayLike) -> FloatArray:
    """(..., 3) rates of x, y and heading of (..., 3) forward, left and angular velocity."""
    ahead, left, turn = np.moveaxis(_last(velocity, 3, "body velocity"), -1, 0)
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([cos * ahead - sin * left, sin * ahead + cos * left, turn], axis=-1)


def to_body(heading: ArrayLike, rate: ArrayLike) -> FloatArray:
    """(..., 3) forward, left and angular velocity of (..., 3) rates of x, y and heading."""
    x, y, turn = np.moveaxis(_last(rate, 3, "rate of the place"), -1, 0)
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([cos * x + sin * y, cos * y - sin * x, turn], axis=-1)


def body_motion(place: ArrayLike, rate: ArrayLike, second: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """(..., 3) velocities and (..., 3) accelerations that move the body along a given path.

    x, y and heading (..., 3) with their first and second derivatives are flat outputs of the model: its other
    states and its controls follow from them.
    """
    heading = _last(place, 3, "place")[..., 2]
    velocity, acceleration = to_body(heading, rate), to_body(heading, second)
    acceleration[..., 0] += velocity[..., 2] * velocity[..., 1]
    acceleration[..., 1] -= velocity[..., 2] * velocity[..., 0]
    return velocity, acceleration


def _last(value: ArrayLike, size: int, name: str) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != size:
        raise InputError(f"{name} has shape {array.shape}; valid: (..., {size})")
    return array
