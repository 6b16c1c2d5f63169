"""Fourier series of cycles, and the line or circle of the root."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.numerics.signals import fourier_basis, fourier_coefficients, shifted
from manikin.walking.gait.blend import steady_motion, travelled

PHASE = np.arange(64) / 64


def band_limited(seed, harmonics=8):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((2 * harmonics + 1, 3))


@pytest.mark.parametrize("seed", range(3))
def test_coefficients_come_back(seed):
    """Of a signal with no more harmonics than are kept; its period is 1, not 2 as the print of 6.1 has it."""
    known = band_limited(seed)
    signal = fourier_basis(PHASE) @ known
    np.testing.assert_allclose(fourier_coefficients(signal), known, atol=1e-12)
    np.testing.assert_allclose(fourier_basis(PHASE + 1.0) @ known, signal, atol=1e-12)


@given(st.floats(-2.0, 2.0))
def test_shift(phase):
    known = band_limited(5)
    moved = fourier_basis(PHASE) @ shifted(known, phase)
    np.testing.assert_allclose(moved, fourier_basis(PHASE + phase) @ known, atol=1e-9)


@given(
    st.tuples(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-2.5, 2.5)),
    st.floats(0.4, 2.0),
    st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-3.0, 3.0)),
)
def test_velocities_of_a_swaying_root(velocity, period, start):
    """Line or circle and sway are told apart exactly; a plain line fit is biased by the sway."""
    velocity, start = np.array(velocity), np.array(start)
    share = np.linspace(0.0, 1.0, 65)
    moved = travelled(np.tile(velocity, (65, 1)), period * share)
    cos, sin = np.cos(start[2]), np.sin(start[2])
    place = np.column_stack([
        start[0] + cos * moved[:, 0] - sin * moved[:, 1], start[1] + sin * moved[:, 0] + cos * moved[:, 1],
        start[2] + moved[:, 2],
    ])  # fmt: skip
    sway = np.column_stack([
        a * np.sin(2 * np.pi * k * share + b) for a, k, b in ((0.03, 2, 0.3), (0.05, 1, 1.0), (0.1, 1, 2.0))
    ])  # fmt: skip
    cos, sin = np.cos(place[:, 2]), np.sin(place[:, 2])
    swaying = place + np.column_stack([
        cos * sway[:, 0] - sin * sway[:, 1], sin * sway[:, 0] + cos * sway[:, 1], sway[:, 2]
    ])  # fmt: skip
    found = steady_motion(swaying, period)
    np.testing.assert_allclose(found.velocity, velocity, atol=1e-6)
    np.testing.assert_allclose(found.start, start, atol=1e-6)
    np.testing.assert_allclose(found.error, sway, atol=1e-6)


def test_travelled_is_an_arc():
    """Half a circle of 1 m radius; the straight limit joins smoothly."""
    half = travelled(np.array([np.pi, 0.0, np.pi]), np.array(1.0))
    np.testing.assert_allclose(half, [0.0, 2.0, np.pi], atol=1e-12)
    slow = travelled(np.array([[1.0, 0.5, 0.9e-6], [1.0, 0.5, 1.1e-6]]), np.array([1.0, 1.0]))
    np.testing.assert_allclose(slow[0, :2], slow[1, :2], atol=1e-6)
