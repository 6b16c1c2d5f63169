"""Torques against strength and what they add up to, for torques with known integrals."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human
from manikin.ergonomics import cumulative_effort, joint_strength
from manikin.errors import InputError

from .conftest import still

BODY = human()
KNEE = BODY.joint_index("left_knee_flexion")


def with_torque(torque, rate=None, duration=2.0, samples=401):
    """A motion in which only the left knee works: torque and rate [N.m], [rad/s] at each instant."""
    time = np.linspace(0.0, duration, samples)
    motion = still(BODY, BODY.standing_posture(), duration=duration, rate=(samples - 1) / duration)
    tau, v = np.zeros((samples, BODY.nv)), np.zeros((samples, BODY.nv))
    tau[:, 6 + KNEE] = torque(time)
    v[:, 6 + KNEE] = 0.0 if rate is None else rate(time)
    return replace(motion, tau=tau, v=v)


def test_peak_instant_and_time_above():
    """A triangle from 0 to the whole extension strength and back: above one half for half of the time."""
    limit = -BODY.torque_lower[KNEE]
    found = joint_strength(BODY, with_torque(lambda t: -limit * (1.0 - np.abs(t - 1.0))))
    assert found.limit[KNEE] == limit
    assert found.peak[KNEE] == pytest.approx(1.0)
    assert found.peak_time[KNEE] == pytest.approx(1.0)
    assert found.loaded[KNEE] == pytest.approx(0.5, abs=0.01)  # two samples of 200
    assert found.order[0] == KNEE
    assert np.count_nonzero(found.peak) == 1


def test_work_and_squared_share_of_a_sine():
    """Tau = L sin t, rate = cos t over a whole turn: as much power is taken as given.

    Each half turn gives pi / 2 of squared share, but the flexors' half counts against their own limit.
    """
    limit = -BODY.torque_lower[KNEE]
    motion = with_torque(lambda t: limit * np.sin(t), np.cos, duration=2.0 * np.pi)
    found = cumulative_effort(BODY, motion)
    squares = 0.5 * np.pi * (1.0 + (limit / BODY.torque_upper[KNEE]) ** 2)
    assert found.squared_share[KNEE] == pytest.approx(squares, rel=1e-6)
    assert found.positive_work[KNEE] == pytest.approx(limit, rel=1e-4)
    assert found.negative_work[KNEE] == pytest.approx(-limit, rel=1e-4)
    assert found.absolute_work.sum() == pytest.approx(2.0 * limit, rel=1e-4)
    mean = np.sqrt(squares / (2.0 * np.pi * len(BODY.joint_names)))
    assert found.mean_share == pytest.approx(mean, rel=1e-6)


@given(st.floats(0.1, 20.0), st.floats(0.1, 5.0))
def test_effort_grows_with_the_square_of_torque_and_with_time(size, slower):
    one = cumulative_effort(BODY, with_torque(lambda t: 10.0 * np.ones_like(t), duration=2.0))
    other = cumulative_effort(
        BODY, with_torque(lambda t: size * 10.0 * np.ones_like(t), duration=2.0 * slower)
    )
    assert other.squared_share[KNEE] == pytest.approx(size**2 * slower * one.squared_share[KNEE])


def test_without_torques_there_is_neither():
    motion = still(BODY, BODY.standing_posture())
    assert joint_strength(BODY, motion) is None
    assert cumulative_effort(BODY, motion) is None


def test_frames_without_torques_are_left_out():
    """The second half is not known: the rest counts, no bridge is built over the gap."""
    motion = with_torque(lambda t: 0.1 * BODY.torque_upper[KNEE] * np.ones_like(t))
    tau = np.array(motion.tau)
    tau[100:200] = tau[300:] = np.nan
    motion = replace(motion, tau=tau)
    strength, effort = joint_strength(BODY, motion), cumulative_effort(BODY, motion)
    assert strength.known == pytest.approx(200 / 401)
    assert np.isnan(strength.largest[150])
    assert effort.duration == pytest.approx(2 * 99 * 0.005)
    assert effort.squared_share[KNEE] == pytest.approx(effort.duration * 0.1**2)


def test_a_fraction_beyond_the_strength_is_refused():
    with pytest.raises(InputError, match="fraction of the strength"):
        joint_strength(BODY, with_torque(np.zeros_like), fraction=1.5)
