"""The configuration spline's derivatives are exact in Pinocchio's convention."""

import numpy as np
import pinocchio as pin
import pytest

from manikin.body import human
from manikin.errors import SplineError
from manikin.motion.configuration_spline import (
    ConfigurationSpline,
    align_quaternions,
    by_raw_spline,
    states_from_raw,
    tangent_map,
    turn_derivatives,
)
from manikin.numerics.spatial import rotation_from_quaternion


@pytest.fixture
def model() -> pin.Model:
    model = pin.Model()
    root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    model.addJoint(root, pin.JointModelRX(), pin.SE3.Identity(), "hinge")
    return model


@pytest.fixture
def spline() -> ConfigurationSpline:
    rng = np.random.default_rng(3)
    degree, points = 5, 9
    control = rng.normal(size=(points, 8))
    control[:, 3:7] = np.array([0.1, -0.2, 0.3, 1.0]) + 0.3 * rng.normal(size=(points, 4))
    knots = np.concatenate([np.zeros(degree + 1), [0.3, 0.7, 1.1], np.full(degree + 1, 1.6)])
    return ConfigurationSpline(knots, control, degree)


def test_velocity_is_the_derivative_of_the_configuration(spline, model):
    """Central difference on the manifold; its error is O(h^2) ~ 1e-8 times the third derivative."""
    t, h = np.linspace(0.05, 1.55, 31), 1e-5
    before, now, after = (spline.evaluate(t + d) for d in (-h, 0.0, h))
    for k in range(len(t)):
        numeric = (
            pin.difference(model, now.q[k], after.q[k]) - pin.difference(model, now.q[k], before.q[k])
        ) / (2 * h)
        np.testing.assert_allclose(now.v[k], numeric, atol=2e-6)


def test_acceleration_is_the_derivative_of_the_velocity(spline):
    t, h = np.linspace(0.05, 1.55, 31), 1e-5
    before, now, after = (spline.evaluate(t + d) for d in (-h, 0.0, h))
    np.testing.assert_allclose(now.a, (after.v - before.v) / (2 * h), atol=5e-5)


def test_tangent_map_is_the_derivative_of_the_configuration(model):
    rng = np.random.default_rng(5)
    raw = rng.normal(size=(4, 8))
    h = 1e-6

    def configuration(row):
        return np.concatenate([row[:3], row[3:7] / np.linalg.norm(row[3:7]), row[7:]])

    for row, block in zip(raw, tangent_map(raw), strict=True):
        for column in range(7):
            step = np.zeros(8)
            step[column] = h
            numeric = (
                pin.difference(model, configuration(row), configuration(row + step))
                - pin.difference(model, configuration(row), configuration(row - step))
            ) / (2 * h)
            np.testing.assert_allclose(block[:6, column], numeric[:6], atol=1e-8)


def test_rotation_from_quaternion_agrees_with_pinocchio():
    u = np.random.default_rng(1).normal(size=(5, 4))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    for row, rotation in zip(u, rotation_from_quaternion(u), strict=True):
        np.testing.assert_allclose(rotation, pin.Quaternion(*row[[3, 0, 1, 2]]).matrix(), atol=1e-14)


def test_aligned_quaternions_never_jump_to_the_opposite_half_space():
    q = np.random.default_rng(2).normal(size=(20, 9))
    aligned = align_quaternions(q)
    assert np.all(np.sum(aligned[1:, 3:7] * aligned[:-1, 3:7], axis=1) >= 0)
    np.testing.assert_array_equal(np.abs(aligned), np.abs(q))


def test_knots_and_control_points_must_fit():
    with pytest.raises(SplineError, match="knots = control points"):
        ConfigurationSpline(np.zeros(5), np.zeros((3, 8)), 5)


def test_turn_derivatives_agree_with_finite_differences():
    """Central differences of smooth functions of size one: error ~ 1e-9."""
    rng = np.random.default_rng(4)
    raw, rate, second = (rng.normal(size=(5, 7)) for _ in range(3))
    exact = turn_derivatives(raw[:, 3:], rate[:, 3:], second[:, 3:])
    h = 1e-6
    for column in range(4):
        for which in range(3):
            step = np.zeros(7)
            step[3 + column] = h
            plus, minus = (
                states_from_raw(*[x + sign * step * (which == k) for k, x in enumerate((raw, rate, second))])
                for sign in (1.0, -1.0)
            )
            omega, alpha = (
                (a[:, 3:6] - b[:, 3:6]) / (2 * h) for a, b in ((plus.v, minus.v), (plus.a, minus.a))
            )
            by_value_rate = (exact.omega_by_value, exact.omega_by_rate, np.zeros((5, 3, 4)))[which]
            by_all = (exact.alpha_by_value, exact.alpha_by_rate, exact.alpha_by_second)[which]
            np.testing.assert_allclose(omega, by_value_rate[:, :, column], atol=1e-7)
            np.testing.assert_allclose(alpha, by_all[:, :, column], atol=1e-6)


def test_derivatives_by_states_become_those_by_the_spline():
    """Of inverse dynamics, whose torques a turning pelvis changes by its velocity in its own frame as well.

    Central differences; relative to the largest derivative their error is about 1e-7.
    """
    body, rng, h = human(1.75, 79.0), np.random.default_rng(0), 1e-6
    model, data = body.pinocchio, body.pinocchio.createData()
    values = np.tile(body.standing_posture(), (3, 1)) + 0.3 * rng.normal(size=(3, body.nq))
    raw = values, rng.normal(size=values.shape), 3.0 * rng.normal(size=values.shape)

    def torques(*raw):
        return np.array([pin.rnea(model, data, *state) for state in zip(*states_from_raw(*raw), strict=True)])

    states = states_from_raw(*raw)
    by_state = [np.empty((3, body.nv, body.nv)) for _ in range(3)]
    for row, state in enumerate(zip(*states, strict=True)):
        for into, part in zip(by_state, pin.computeRNEADerivatives(model, data, *state), strict=True):
            into[row] = part
    by_state[2] = np.triu(by_state[2]) + np.triu(by_state[2], 1).transpose(0, 2, 1)
    exact = by_raw_spline(by_state, states, raw, tangent_map(values))
    for order in range(3):
        for column in range(12):  # the pelvis and some joints
            step = [h * np.eye(body.nq)[column] * (order == k) for k in range(3)]
            ahead, behind = (
                torques(*(x + sign * s for x, s in zip(raw, step, strict=True))) for sign in (1, -1)
            )
            found, size = exact[order][:, :, column], np.abs(exact[order][:, :, column]).max()
            np.testing.assert_allclose(
                found, (ahead - behind) / (2 * h), rtol=0.0, atol=1e-6 * max(size, 1.0)
            )


def at_rest(rng, start, end, points=12, degree=5):
    """Spline between two postures at which velocity and acceleration are zero, and its duration."""
    control = rng.normal(size=(points, 8))
    control[:, 3:7] = np.array([0.1, -0.2, 0.3, 1.0]) + 0.1 * rng.normal(size=(points, 4))
    control[:3], control[-3:] = start, end
    inner = np.sort(rng.uniform(0.1, 1.5, points - degree - 1))
    knots = np.concatenate([np.zeros(degree + 1), inner, np.full(degree + 1, 1.6)])
    return ConfigurationSpline(knots, control, degree)


def test_inserted_knots_change_nothing_of_the_motion(spline):
    """Control points are convex combinations of those before: the error is that of rounding."""
    first, last = spline.knots[[0, -1]]
    more = first + (last - first) * np.array([0.013, 0.377, 0.6181, 0.9991])
    finer = spline.on_knots(np.sort(np.append(spline.knots, more)))
    assert len(finer.control_points) == len(spline.control_points) + len(more)
    time = np.linspace(first, last, 200)
    for before, after in zip(spline.evaluate(time), finer.evaluate(time), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-9 * max(1.0, float(np.abs(before).max())))
    np.testing.assert_array_equal(spline.on_knots(spline.knots).control_points, spline.control_points)
    with pytest.raises(SplineError, match="include those of the spline"):
        finer.on_knots(spline.knots)


def test_joined_splines_are_each_of_them_and_smooth_where_they_meet():
    """A quaternion and its negative are the same attitude; the second one is turned round."""
    rng = np.random.default_rng(5)
    ends = rng.normal(size=(3, 8))
    ends[:, 3:7] = np.array([0.1, -0.2, 0.3, 1.0])
    opposite = ends.copy()
    opposite[:, 3:7] *= -1.0
    first, second = at_rest(rng, ends[0], ends[1]), at_rest(rng, opposite[1], opposite[2])
    flipped = second.control_points.copy()
    flipped[3:-3, 3:7] *= -1.0
    second = ConfigurationSpline(second.knots, flipped, 5)
    whole, t = ConfigurationSpline.joined([first, second]), np.linspace(0.0, 1.6, 41)
    for found, wanted in zip(whole.evaluate(t), first.evaluate(t), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-9)
    later, own = whole.evaluate(1.6 + t), second.evaluate(t)
    np.testing.assert_allclose(later.v, own.v, atol=1e-9)
    np.testing.assert_allclose(later.a, own.a, atol=1e-8)
    around = whole.evaluate(1.6 + np.array([-1e-7, 0.0, 1e-7]))
    np.testing.assert_allclose(around.v, 0.0, atol=1e-9)
    np.testing.assert_allclose(around.a, 0.0, atol=1e-3)  # the third derivative is of the order of 1e3


def test_splines_that_do_not_meet_are_not_joined():
    rng = np.random.default_rng(6)
    ends = np.tile(np.array([0.0, 0.0, 0.0, 0.1, -0.2, 0.3, 1.0, 0.0]), (2, 1))
    ends[1, 7] = 0.1
    with pytest.raises(SplineError, match=r"gap of 0\.1"):
        ConfigurationSpline.joined([at_rest(rng, ends[0], ends[0]), at_rest(rng, ends[1], ends[1])])
