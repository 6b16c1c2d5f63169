"""Kinematics and dynamics of a configuration, against finite differences and identities."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import Configuration, difference, human, integrate, interpolate, random_configuration
from manikin.errors import BodyError

BODY = human()
STEP = 1e-6
# Central differences with a step of 1e-6 on lengths of a metre: truncation 1e-12, rounding 1e-10;
# velocities of a few rad/s multiply that by less than ten.
CLOSE = 1e-8

SEEDS = st.integers(0, 2**32 - 1)


def draw(seed, speed=1.0):
    """Random state."""
    rng = np.random.default_rng(seed)
    return random_configuration(BODY, rng), speed * rng.standard_normal(BODY.nv), rng


def along(q, v, evaluate):
    """Central difference of ``evaluate`` along the velocity ``v``."""
    forward, backward = (evaluate(Configuration(BODY, integrate(BODY, q, v, h))) for h in (STEP, -STEP))
    return (forward - backward) / (2 * STEP)


@given(SEEDS)
def test_com_jacobian(seed):
    q, v, _ = draw(seed)
    state = Configuration(BODY, q, v)
    np.testing.assert_allclose(state.com_jacobian @ v, along(q, v, lambda c: c.com), atol=CLOSE)
    np.testing.assert_allclose(state.com_velocity, state.com_jacobian @ v, atol=1e-12)


@given(SEEDS)
def test_effector_and_point_jacobians(seed):
    q, v, rng = draw(seed)
    state = Configuration(BODY, q, v)
    for name in BODY.effectors:
        twist = state.effector_jacobian(name) @ v
        np.testing.assert_allclose(
            twist[:3], along(q, v, lambda c, n=name: c.effector_placement(n)[1]), atol=CLOSE
        )
        rotation = state.effector_placement(name)[0]
        rate = along(q, v, lambda c, n=name: c.effector_placement(n)[0]) @ rotation.T
        np.testing.assert_allclose(twist[3:], [rate[2, 1], rate[0, 2], rate[1, 0]], atol=CLOSE)
    offset = rng.uniform(-0.2, 0.2, 3)
    for name in ("pelvis", "head", "left_forearm", "right_toes"):
        velocity = state.point_jacobian(name, offset) @ v
        np.testing.assert_allclose(velocity, along(q, v, lambda c, n=name: c.point(n, offset)), atol=CLOSE)


@given(SEEDS)
def test_momentum_is_the_sum_over_the_segments(seed):
    """Linear and angular momentum about the centre of mass, added up segment by segment."""
    q, v, _ = draw(seed)
    state = Configuration(BODY, q, v)
    linear, angular = np.zeros(3), np.zeros(3)
    for part in BODY.segments:
        rotation, _ = state.segment_placement(part.name)
        velocity = state.point_jacobian(part.name, part.com) @ v
        spin = state.segment_jacobian(part.name)[3:] @ v
        linear += part.mass * velocity
        angular += rotation @ part.inertia @ rotation.T @ spin
        angular += part.mass * np.cross(state.point(part.name, part.com) - state.com, velocity)
    np.testing.assert_allclose(state.angular_momentum, angular, atol=1e-9)
    np.testing.assert_allclose(state.centroidal_map @ v, np.concatenate([linear, angular]), atol=1e-9)
    np.testing.assert_allclose(linear, BODY.mass * state.com_velocity, atol=1e-9)


@given(SEEDS)
def test_equation_of_motion_and_newton_euler(seed):
    """``M a + h`` is inverse dynamics; its root part is Newton's and Euler's law for the whole body."""
    q, v, rng = draw(seed, speed=2.0)
    a = rng.standard_normal(BODY.nv)
    state = Configuration(BODY, q, v)
    force = state.mass_matrix @ a + state.nonlinear_effects
    model, data = BODY.pinocchio, BODY.pinocchio.createData()
    np.testing.assert_allclose(force, pin.rnea(model, data, q, v, a), atol=1e-8)
    rotation, _ = state.segment_placement("pelvis")
    momentum_rate = pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a).vector
    weight = np.array([0.0, 0.0, -BODY.mass * 9.81])
    np.testing.assert_allclose(rotation @ force[:3], momentum_rate[:3] - weight, atol=1e-8)


@given(SEEDS)
def test_power_of_gravity_and_inertia(seed):
    """The power of ``M a + h`` is the rate of kinetic plus potential energy."""
    q, v, rng = draw(seed)
    a = rng.standard_normal(BODY.nv)
    state = Configuration(BODY, q, v)

    def energy(h):
        # To second order the motion with acceleration a: q + v h + a h^2/2, v + a h.
        moved = Configuration(BODY, integrate(BODY, q, v + 0.5 * h * a, h), v + h * a)
        kinetic = 0.5 * moved.v @ moved.mass_matrix @ moved.v
        return kinetic - BODY.mass * BODY.pinocchio.gravity.linear @ moved.com

    rate = (energy(1e-5) - energy(-1e-5)) / 2e-5
    # Truncation 1e-10 times third derivatives of some 1e4 J; rounding 1e-11 J / 1e-5.
    assert (state.mass_matrix @ a + state.nonlinear_effects) @ v == pytest.approx(rate, abs=1e-3)


def test_mass_matrix_is_symmetric_and_positive():
    q, v, _ = draw(0)
    matrix = Configuration(BODY, q, v).mass_matrix
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    np.testing.assert_allclose(matrix[:3, :3], BODY.mass * np.eye(3), atol=1e-10)


def test_results_do_not_depend_on_the_order_of_the_questions():
    """Lazy results share engine data, yet none disturbs another."""
    q, v, _ = draw(5)
    names = ("com", "com_jacobian", "centroidal_map", "mass_matrix", "nonlinear_effects")
    forward, backward = Configuration(BODY, q, v), Configuration(BODY, q, v)

    def ask(state, order):
        found = {}
        for name in order:
            found[name] = getattr(state, name)
            found[name + "/hand"] = state.effector_jacobian("left_hand")
            found[name + "/foot"] = state.effector_jacobian("left_foot")
        return found

    first, second = ask(forward, names), ask(backward, names[::-1])
    for name, value in first.items():
        np.testing.assert_array_equal(value, second[name], err_msg=name)


def test_results_are_kept_and_cannot_be_changed():
    state = Configuration(BODY)
    jacobian = state.com_jacobian
    assert state.com_jacobian is jacobian
    with pytest.raises(ValueError, match="read-only"):
        jacobian[0, 0] = 1.0
    before = jacobian.copy()
    q, v, _ = draw(1)
    assert state.update(q, v) is state
    np.testing.assert_array_equal(jacobian, before)
    assert np.abs(state.com_jacobian - before).max() > 0.01


@given(SEEDS)
def test_difference_undoes_integration(seed):
    q, v, rng = draw(seed, speed=0.5)
    end = integrate(BODY, q, v)
    np.testing.assert_allclose(difference(BODY, q, end), v, atol=1e-9)
    other = random_configuration(BODY, rng)
    np.testing.assert_allclose(
        difference(BODY, interpolate(BODY, q, other, 1.0), other), np.zeros(BODY.nv), atol=1e-7
    )
    half = interpolate(BODY, q, end, 0.5)
    np.testing.assert_allclose(difference(BODY, q, half), 0.5 * v, atol=1e-9)


def test_random_configurations_stay_in_range_and_repeat():
    first, second = (random_configuration(BODY, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert np.all((first[7:] >= BODY.lower) & (first[7:] <= BODY.upper))
    assert np.linalg.norm(first[3:7]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(("q", "v"), [(np.zeros(45), None), (np.zeros(46), np.zeros(46))])
def test_vectors_of_another_size_are_refused(q, v):
    with pytest.raises(BodyError, match="valid"):
        Configuration(BODY, q, v)
