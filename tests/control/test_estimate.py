"""Estimate of a noisy state: gains of the Kalman filter, and what they leave of the noise."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import solve_discrete_are

from manikin.body import human
from manikin.control.estimate import LEVER, SURPRISE, WANDERING, StateEstimator, StateNoise, settled_gain

PERIOD = 0.005
BODY = human(1.75, 75.0)
NOISE = StateNoise(angle=np.deg2rad(0.1), position=1e-3, velocity=5e-3)


PASSING = np.array([[1.0, PERIOD, 0.5 * PERIOD**2], [0.0, 1.0, PERIOD], [0.0, 0.0, 1.0]])
SEEN = np.eye(3)[:2]


def model_of(place, velocity, scale, wandering):
    """Covariances of what is new in a step (3, 3) and of what is measured (2, 2)."""
    pushed = scale * np.array([0.5 * PERIOD**2, PERIOD, 0.0])
    new = np.outer(pushed, pushed) + np.diag([0.0, 0.0, PERIOD * wandering**2])
    return new, np.diag([place**2, velocity**2])


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
@pytest.mark.parametrize(("place", "velocity"), [(1e-3, 5e-3), (2e-3, 0.02), (1e-3, 1e-3)])
def test_gains_are_those_to_which_the_filter_settles(place, velocity, scale):
    """After 20,000 steps of the filter with changing gains."""
    new, measured = model_of(place, velocity, scale, scale)
    spread = np.eye(3)
    for _ in range(20_000):
        spread = PASSING @ spread @ PASSING.T + new
        gain = spread @ SEEN.T @ np.linalg.inv(SEEN @ spread @ SEEN.T + measured)
        spread = (np.eye(3) - gain @ SEEN) @ spread
    np.testing.assert_allclose(settled_gain(place, velocity, scale, scale, PERIOD), gain, rtol=1e-4)


@pytest.mark.parametrize(("place", "velocity"), [(0.0, 5e-3), (1e-3, 0.0)])
def test_what_alone_is_exact_is_believed_and_corrects_the_other(place, velocity):
    """To 1 %; no error stays: neither of a rate that exact places show, nor of a place at the beginning."""
    gain, exact = settled_gain(place, velocity, 5.0, 5.0, PERIOD), int(velocity == 0.0)
    assert gain[exact, exact] == pytest.approx(1.0, abs=0.01)
    assert np.abs(np.linalg.eigvals((np.eye(3) - gain @ SEEN) @ PASSING)).max() < 1.0 - 1e-6


def test_what_is_exact_is_believed():
    """Without noise the state is the measured one, to the rounding of turns."""
    estimator, rng = StateEstimator(BODY, StateNoise(), PERIOD), np.random.default_rng(0)
    for _ in range(3):
        q = pin.integrate(BODY.pinocchio, BODY.standing_posture(), 0.1 * rng.standard_normal(BODY.nv))
        v, acceleration = rng.standard_normal((2, BODY.nv))
        found = estimator.update(q, v, acceleration)
        assert np.abs(pin.difference(BODY.pinocchio, q, found[0])).max() < 1e-12
        np.testing.assert_allclose(found[1], v, atol=1e-12)


def test_errors_are_those_of_the_filter():
    """Of 4000 steps along a motion whose accelerations are as surprising as is thought, within 15 %.

    Without the filter they are those of the noise: places five times as far off, rates by a seventh and more.
    """
    model, rng = BODY.pinocchio, np.random.default_rng(1)
    estimator = StateEstimator(BODY, NOISE, PERIOD)
    q, v = BODY.standing_posture(), np.zeros(BODY.nv)
    surprise = np.repeat(SURPRISE, (3, BODY.nv - 3))
    places, rates = [], []
    known, aside = np.zeros(BODY.nv), np.zeros(BODY.nv)
    wandering = np.sqrt(PERIOD) * np.repeat(WANDERING, (3, BODY.nv - 3))
    for step in range(4000):
        found = estimator.update(*NOISE.told(BODY, q, v, rng), known)
        if step > 200:
            places.append(pin.difference(model, q, found[0]))
            rates.append(found[1] - v)
        known = -v / 0.2  # keeps the motion slow
        aside = 0.999 * aside + wandering * rng.standard_normal(BODY.nv)
        true = known + aside + surprise * rng.standard_normal(BODY.nv)
        q, v = pin.integrate(model, q, PERIOD * v + 0.5 * PERIOD**2 * true), v + PERIOD * true
    for columns, place, velocity, scale, wandering in (
        (slice(0, 3), NOISE.position, NOISE.velocity, SURPRISE[0], WANDERING[0]),
        (slice(3, None), NOISE.angle, NOISE.velocity / LEVER, SURPRISE[1], WANDERING[1]),
    ):
        new, measured = model_of(place, velocity, scale, wandering)
        before = solve_discrete_are(PASSING.T, SEEN.T, new, measured)
        told = SEEN @ before @ SEEN.T + measured
        after = before - before @ SEEN.T @ np.linalg.inv(told) @ SEEN @ before
        wanted = np.sqrt(np.diag(after))
        assert np.std(np.array(places)[:, columns]) == pytest.approx(wanted[0], rel=0.15)
        assert np.std(np.array(rates)[:, columns]) == pytest.approx(wanted[1], rel=0.15)
        assert wanted[0] < 0.25 * place
        assert wanted[1] < 0.9 * velocity


def test_a_lasting_disturbance_is_found():
    """2 m/s^2 and rad/s^2 that control does not know of, after 2 s; 15 % on the mean over coordinates."""
    model, rng = BODY.pinocchio, np.random.default_rng(2)
    estimator, q, v = StateEstimator(BODY, NOISE, PERIOD), BODY.standing_posture(), np.zeros(BODY.nv)
    known = np.zeros(BODY.nv)
    for _ in range(400):
        estimator.update(*NOISE.told(BODY, q, v, rng), known)
        known = -v / 0.2
        true = known + 2.0
        q, v = pin.integrate(model, q, PERIOD * v + 0.5 * PERIOD**2 * true), v + PERIOD * true
    assert np.mean(estimator.disturbance[:3]) == pytest.approx(2.0, rel=0.15)
    assert np.mean(estimator.disturbance[3:]) == pytest.approx(2.0, rel=0.15)
