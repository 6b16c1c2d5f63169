"""Smoothing whose cutoff rises at touch-downs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from manikin.recordings.dynamics.recorded_dynamics import CUTOFF, LocalCutoff, smooth

RATE = 100.0
TIME = np.arange(400) / RATE


@given(frequency=st.floats(0.5, 20.0), cutoff=st.floats(2.0, 12.0))
def test_one_cutoff_is_the_filter_of_second_order_without_delay(frequency, cutoff):
    wave = np.sin(2.0 * np.pi * frequency * TIME + 0.3)[:, None]
    found = smooth(wave, RATE, np.full(400, cutoff))[100:-100]
    ratio = np.sin(np.pi * frequency / RATE) / np.sin(np.pi * cutoff / RATE)
    np.testing.assert_allclose(found, wave[100:-100] / (1.0 + ratio**4), atol=1e-3)
    # As Butterworth's, which bends the frequencies by a tangent in place of a sine: alike while they are low.
    if max(frequency, cutoff) < 6.0:
        theirs = sosfiltfilt(butter(2, cutoff, fs=RATE, output="sos"), wave, axis=0)[100:-100]
        np.testing.assert_allclose(found, theirs, atol=0.02)


@given(slope=st.floats(-10.0, 10.0), start=st.floats(-5.0, 5.0), instants=st.lists(st.floats(0.0, 4.0)))
def test_a_straight_line_stays(slope, start, instants):
    line = (start + slope * TIME)[:, None]
    np.testing.assert_allclose(smooth(line, RATE, LocalCutoff(5.0, 8.0).at(TIME, instants)), line, atol=1e-8)


def test_the_cutoff_is_highest_at_touch_downs():
    cutoff = LocalCutoff(5.0, 8.0).at(TIME, (1.0, 1.1))
    assert cutoff.max() == pytest.approx(8.0)
    assert cutoff[108] == pytest.approx(5.0 + 3.0 * np.exp(-(0.02**2) / 0.08**2))
    np.testing.assert_allclose(cutoff[200:], 5.0, atol=1e-12)


def test_an_impact_is_seen_sharper_and_noise_elsewhere_is_not():
    # Falls with 1 m/s^2 until the foot lands at 2 s, which stops it within no time.
    speed = np.where(TIME < 2.0, -TIME, -2.0)
    fall = (np.cumsum(speed) / RATE)[:, None]
    accelerations = [
        np.gradient(np.gradient(smooth(fall, RATE, cutoff)[:, 0], 1 / RATE), 1 / RATE)
        for cutoff in (np.full(400, 5.0), CUTOFF.at(TIME, (2.0,)))
    ]
    truth = np.where(TIME < 2.0, -1.0, 0.0)
    errors = [np.sqrt(np.mean((one - truth)[150:250] ** 2)) for one in accelerations]
    assert errors[1] < 0.8 * errors[0]
    noise = np.random.default_rng(1).normal(size=(400, 1))
    far = [
        smooth(noise, RATE, cutoff)[50:150].std() for cutoff in (np.full(400, 5.0), CUTOFF.at(TIME, (2.0,)))
    ]
    assert far[1] == pytest.approx(far[0], rel=1e-3)
