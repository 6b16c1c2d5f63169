"""The unified walking model against the equations of the thesis and against differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from manikin.errors import InputError
from manikin.walking.path.walking_model import body_motion, state_derivative, to_body, to_world

numbers = st.floats(-10.0, 10.0)


def thesis_derivative(z, u):
    """[Truong2010]_ 5.5 as printed; z = (x, y, theta, v_f, omega, v_l), u = (u_1, u_2, u_3)."""
    _, _, theta, forward, omega, lateral = z
    c, s = np.cos(theta), np.sin(theta)
    return np.array([c * forward + s * lateral, s * forward - c * lateral, omega, u[0], u[1], u[2]])


@given(arrays(float, 6, elements=numbers), arrays(float, 3, elements=numbers))
def test_it_is_the_model_of_the_thesis_with_left_for_right(z, u):
    control = [u[0], -u[2], u[1]]  # forward, left, angular of forward, angular, right
    x, y, heading, forward, angular, right = z
    ours = state_derivative([x, y, heading, forward, -right, angular], control)
    # The rate of a state converts as the state does, because the conversion is linear.
    assert np.allclose([*ours[:4], ours[5], -ours[4]], thesis_derivative(z, u), atol=1e-12)


def test_left_is_the_opposite_of_the_lateral_velocity_found_from_data():
    """[Truong2010]_ 5.3-5.4: v_f = v cos(th_S - th_T), v_l = v sin(th_S - th_T), to the right."""
    speed, heading, tangent = 0.9, 0.7, 0.2
    forward, left, _ = to_body(heading, [speed * np.cos(tangent), speed * np.sin(tangent), 0.0])
    assert forward == pytest.approx(speed * np.cos(heading - tangent))
    assert left == pytest.approx(-speed * np.sin(heading - tangent))
    assert left < 0.0  # the heading is to the left of the way, so the body moves to its right


@given(numbers, arrays(float, 3, elements=numbers))
def test_body_and_world_velocities_are_inverse(heading, velocity):
    assert np.allclose(to_body(heading, to_world(heading, velocity)), velocity, atol=1e-12)


def test_accelerations_are_the_rates_of_the_bodys_own_velocities():
    """Not the acceleration of a point in the body's axes: differences of the body's velocities."""
    t = np.linspace(0.0, 1.0, 11)

    def motion(t):
        place = np.stack([np.sin(2 * t), t**3, np.cos(3 * t)], axis=-1)
        rate = np.stack([2 * np.cos(2 * t), 3 * t**2, -3 * np.sin(3 * t)], axis=-1)
        second = np.stack([-4 * np.sin(2 * t), 6 * t, -9 * np.cos(3 * t)], axis=-1)
        return body_motion(place, rate, second)

    h = 1e-5
    differences = (motion(t + h)[0] - motion(t - h)[0]) / (2 * h)
    # Central differences: h^2 times a third derivative below 1e3.
    assert np.allclose(motion(t)[1], differences, atol=1e-6)


def test_wrong_shapes_are_refused_in_one_line():
    with pytest.raises(InputError, match=r"walking state has shape \(5,\); valid: \(\.\.\., 6\)"):
        state_derivative(np.zeros(5), np.zeros(3))
