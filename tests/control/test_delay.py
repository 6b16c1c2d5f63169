"""Late torques: what is on its way, and the delay found from the torques that are felt."""

import numpy as np
import pytest

from manikin.control.delay import CREEP, DelayEstimator, PendingDecisions

PERIOD, JOINTS = 0.005, 20


def commands(count, rng):
    """(count, joints) torques that wander as those of a control do [N.m]."""
    return np.cumsum(rng.standard_normal((count, JOINTS)), axis=0)


def felt(torques, step, delay):
    """(joints,) mean over the period that ends with a step, in hundredths of it; the first acted before."""
    times = (step - 1 + (np.arange(100) + 0.5) / 100) * PERIOD - delay
    return torques[np.maximum(np.floor(times / PERIOD).astype(int), 0)].mean(axis=0)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("delay", [0.0, 0.002, 0.0137, 0.03, 0.08])
def test_the_delay_is_found(delay, noise):
    """Within a second, to 0.2 ms; with as much noise as torques change in a period, to 0.7 ms."""
    rng = np.random.default_rng(0)
    torques, estimator = commands(200, rng), DelayEstimator(0.0075, PERIOD)
    for step, torque in enumerate(torques):
        if step:
            estimator.felt(felt(torques, step, delay) + noise * rng.standard_normal(JOINTS))
        estimator.commanded(torque)
    assert estimator.delay == pytest.approx(delay, abs=7e-4 if noise else 2e-4)


def test_the_believed_delay_stays_where_torques_tell_nothing():
    """Torques that do not change, felt with noise, fit any delay."""
    rng, estimator = np.random.default_rng(1), DelayEstimator(0.0075, PERIOD)
    for _ in range(400):
        estimator.felt(50.0 + rng.standard_normal(JOINTS))
        estimator.commanded(np.full(JOINTS, 50.0))
    assert estimator.delay == 0.0075


def test_time_goes_on_while_the_delay_is_found():
    """The time for which torques are decided on, now and the delay, grows in every step."""
    rng = np.random.default_rng(2)
    torques, estimator = commands(200, rng), DelayEstimator(0.06, PERIOD)
    delays = []
    for step, torque in enumerate(torques):
        if step:
            estimator.felt(felt(torques, step, 0.0))
        estimator.commanded(torque)
        delays.append(estimator.delay)
    assert delays[-1] == pytest.approx(0.0, abs=1e-6)
    assert np.diff(delays).min() >= -CREEP * PERIOD - 1e-12


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.005, 0.0137])
def test_what_acts_before_a_decision_does(delay):
    """Durations add up to the delay, the last period's to it; each decision acts later by the delay."""
    pending = PendingDecisions(1, delay, PERIOD)
    for number in range(30):
        pending.append(np.array([float(number)]))
    coming = list(pending.coming())
    assert sum(time for time, _ in coming) == pytest.approx(delay, abs=1e-15)
    at = 30 * PERIOD
    for time, decided in coming:
        assert decided[0] == np.floor((at + 0.5 * time - delay) / PERIOD)
        at += time
    times = (29 + (np.arange(1000) + 0.5) / 1000) * PERIOD - delay
    assert pending.acted()[0] == pytest.approx(np.floor(times / PERIOD).mean(), abs=2e-3)
