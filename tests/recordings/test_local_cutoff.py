"""Smoothing whose cutoff rises at touch-downs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from manikin.errors import InputError
from manikin.recordings.dynamics.recorded_dynamics import CUTOFF, LocalCutoff, smooth, touch_downs_of
from manikin.recordings.supports.body_supports import RecordedSupports, support_in

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


PLACES = (np.zeros(3), np.zeros(3), np.zeros(3))


@given(
    first=st.integers(0, 40), length=st.integers(1, 60),
    rate=st.sampled_from([30.0, 60.0, 100.0, 120.0, 250.0]), start=st.sampled_from([0.0, 0.21, 3.7]),
)  # fmt: skip
def test_a_support_is_between_the_frames_that_show_it_and_those_that_do_not(first, length, rate, start):
    """Its frames are found again from its instants; an end that is not seen is that of the recording."""
    count = 80
    stop = min(first + length, count)
    one = support_in("left_foot", (first, stop), count, rate, start, PLACES)
    assert one.frames(start, rate, count) == (first, stop)
    assert (one.start_seen, one.end_seen) == (first > 0, stop < count)
    assert one.start == pytest.approx(start + (first - 0.5 if first else 0.0) / rate)
    assert one.end == pytest.approx(start + (stop - 0.5 if stop < count else count - 1.0) / rate)


def supports(*frames):
    """Supports of the left and the right foot in turn, in frames of a recording of 4 s."""
    feet = ("left_foot", "right_foot")
    every = [support_in(feet[k % 2], one, 400, RATE, 1.0, PLACES) for k, one in enumerate(frames)]
    return RecordedSupports(tuple(every), 1.0, 4.99, (0.0,))


def test_touch_downs_of_walks_count_and_landings_from_flights_do_not():
    walk = supports((0, 80), (70, 150), (140, 220))
    assert touch_downs_of(walk) == pytest.approx((0.695, 1.395))
    run = supports((20, 45), (55, 80), (90, 115))
    assert touch_downs_of(run) == ()
    # Both feet land from a jump, the right one a frame later than the left one.
    assert touch_downs_of(supports((100, 200), (101, 200))) == ()


def test_a_cutoff_that_falls_at_touch_downs_is_refused():
    with pytest.raises(InputError, match="highest cutoff"):
        LocalCutoff(5.0, 4.0)
