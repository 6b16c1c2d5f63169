"""The low-pass filter of recorded signals."""

import numpy as np
import pytest

from manikin.numerics.signals import SHARES, low_passed


def test_two_passes_halve_the_amplitude_at_the_cutoff_without_delay():
    """Each pass of a Butterworth filter halves the power there."""
    rate, cutoff = 200.0, 5.0
    time = np.arange(2000) / rate
    wave = np.sin(2.0 * np.pi * cutoff * time)
    middle = slice(500, 1500)
    smooth = low_passed(wave, cutoff, rate)
    np.testing.assert_allclose(smooth[middle], 0.5 * wave[middle], atol=1e-6)


def test_what_does_not_change_or_changes_evenly_stays():
    """The ends are continued by their mirror images, which a straight line goes through.

    Two periods beyond an end the filter begins; to it 1e-4 of its lag there, 0.01, is left.
    """
    line = np.linspace([0.0, 3.0], [1.0, 3.0], 400)
    np.testing.assert_allclose(low_passed(line, 5.0, 100.0), line, atol=1e-5)


@pytest.mark.parametrize("length", [2, 5, 30])
def test_short_signals_are_filtered(length):
    values = np.full(length, 2.0)
    np.testing.assert_allclose(low_passed(values, 5.0, 100.0), values, atol=1e-12)


def test_a_cutoff_may_be_a_share_of_half_the_rate():
    noise = np.random.default_rng(0).standard_normal((300, 2))
    shares = low_passed(noise, 0.1, SHARES, padding=9)
    assert np.array_equal(shares, low_passed(noise, 5.0, 100.0, padding=9))
