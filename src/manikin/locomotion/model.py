"""The unified walking model: a body on the floor that goes forward, sideways and turns ([Truong2010]_ 5.3).

The thesis counts the lateral velocity to the right (5.5) and orders its state ``(x, y, theta, v_f, omega,
v_l)``. Everywhere in this project left is positive, and lateral comes before angular:
:func:`state_from_thesis` and :func:`state_to_thesis` are the only door between the two.
"""

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.spatial import FloatArray

STATE = ("x", "y", "heading", "forward", "left", "angular")
"""Order of a state: place [m] and heading [rad] in the world, velocities in the body frame [m/s, rad/s]."""

CONTROL = ("forward", "left", "angular")
"""Order of velocities and accelerations: along the body's x [m/s^2], its y [m/s^2], about z [rad/s^2]."""


def state_derivative(state: ArrayLike, control: ArrayLike) -> FloatArray:
    """Rate of a state under accelerations ([Truong2010]_ 5.5, with left positive).

    Args:
        state: (..., 6) in the order of :data:`STATE`.
        control: (..., 3) accelerations in the order of :data:`CONTROL`: rates of the body's own velocities.

    Returns:
        (..., 6).
    """
    z, u = _last(state, 6, "walking state"), _last(control, 3, "walking control")
    rate = np.empty((*np.broadcast_shapes(z.shape[:-1], u.shape[:-1]), 6))
    rate[..., :3] = to_world(z[..., 2], z[..., 3:])
    rate[..., 3:] = u
    return rate


def to_world(heading: ArrayLike, velocity: ArrayLike) -> FloatArray:
    """(..., 3) rates of x, y and heading of (..., 3) forward, left and angular velocity."""
    v = _last(velocity, 3, "body velocity")
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack(
        [cos * v[..., 0] - sin * v[..., 1], sin * v[..., 0] + cos * v[..., 1], v[..., 2]], axis=-1
    )


def to_body(heading: ArrayLike, rate: ArrayLike) -> FloatArray:
    """(..., 3) forward, left and angular velocity of (..., 3) rates of x, y and heading."""
    v = _last(rate, 3, "rate of the place")
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack(
        [cos * v[..., 0] + sin * v[..., 1], cos * v[..., 1] - sin * v[..., 0], v[..., 2]], axis=-1
    )


def body_motion(place: ArrayLike, rate: ArrayLike, second: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Velocities and accelerations that move the body along a given path.

    x, y and heading as functions of time are flat outputs of the model: its other states and its controls
    follow from them and their derivatives, for any twice differentiable path.

    Args:
        place: (..., 3) x, y [m] and heading [rad].
        rate: (..., 3) first derivatives.
        second: (..., 3) second derivatives.

    Returns:
        (..., 3) velocities and (..., 3) accelerations in the order of :data:`CONTROL`.
    """
    heading = _last(place, 3, "place")[..., 2]
    velocity, acceleration = to_body(heading, rate), to_body(heading, second)
    acceleration[..., 0] += velocity[..., 2] * velocity[..., 1]
    acceleration[..., 1] -= velocity[..., 2] * velocity[..., 0]
    return velocity, acceleration


def state_from_thesis(state: ArrayLike) -> FloatArray:
    """(..., 6) state of a (..., 6) state ``(x, y, theta, v_f, omega, v_l)`` of [Truong2010]_ 5.5."""
    z = _last(state, 6, "state of the thesis")
    return np.concatenate([z[..., :4], -z[..., 5:6], z[..., 4:5]], axis=-1)


def state_to_thesis(state: ArrayLike) -> FloatArray:
    """(..., 6) state ``(x, y, theta, v_f, omega, v_l)`` of [Truong2010]_ 5.5 of a (..., 6) state."""
    z = _last(state, 6, "walking state")
    return np.concatenate([z[..., :4], z[..., 5:6], -z[..., 4:5]], axis=-1)


def _last(value: ArrayLike, size: int, name: str) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != size:
        raise InputError(f"{name} has shape {array.shape}; valid: (..., {size})")
    return array
