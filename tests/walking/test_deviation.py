"""Lengths of holonomic ends, mean paths and deviations from them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.walking import ShoulderPaths, holonomic_ends, path_deviation, segment_path

RATE = 100.0
SIDE = np.array([0.0, 0.18])


def along(place, rate=RATE):
    """A walker looking along x at (n, 2) places [m]."""
    return ShoulderPaths(np.asarray(place) + SIDE, np.asarray(place) - SIDE, rate)


def stretches(*parts):
    """A way of straight stretches at 1 m/s: direction [rad] and length [m]."""
    steps = [np.tile([np.cos(a), np.sin(a)], (round(length * RATE), 1)) for a, length in parts]
    return along(np.cumsum(np.vstack([np.zeros((1, 2)), *steps]), axis=0) / RATE)


def test_lengths_of_the_ends():
    """Known to one frame at each corner, where the tangent turns: 1 cm each."""
    found = segment_path(stretches((np.pi / 2, 0.3), (0.0, 2.0), (-np.pi / 2, 0.2)), online=True)
    ends = holonomic_ends(found)
    assert ends.from_origin == pytest.approx(0.3, abs=0.02)
    assert ends.to_goal == pytest.approx(0.2, abs=0.02)
    # At both corners one frame's speed is that across the corner, 1 / sqrt(2).
    assert ends.length == pytest.approx(2.5 - 2 * (1 - np.sqrt(0.5)) / RATE, abs=1e-9)


def test_a_nonholonomic_walk_has_no_ends():
    ends = holonomic_ends(segment_path(stretches((0.0, 1.0)), online=True))
    assert (ends.from_origin, ends.to_goal) == (0.0, 0.0)
    assert ends.length == pytest.approx(1.0)


def test_a_holonomic_walk_is_both_ends():
    ends = holonomic_ends(segment_path(stretches((np.pi / 2, 0.5)), online=True))
    assert ends.from_origin == ends.to_goal == ends.length == pytest.approx(0.5)


def test_parallel_walks_are_half_their_distance_from_the_mean():
    way = np.column_stack([np.linspace(0.0, 2.0, 101), np.zeros(101)])
    found = path_deviation([along(way + SIDE), along(way - SIDE)])
    assert np.allclose(found.mean, way)
    assert np.allclose(found.deviation, 0.18)
    assert found.average == pytest.approx(0.18)
    assert found.largest == pytest.approx(0.18)


def test_duration_and_rate_do_not_matter_but_the_way_of_going_does():
    """A straight walk at an even pace is the same slower; TD of one that starts late is the lag's half."""
    slow = along(np.linspace([0.0, 0.0], [2.0, 0.0], 241), rate=60.0)
    fast = along(np.linspace([0.0, 0.0], [2.0, 0.0], 101))
    same = path_deviation([slow, fast])
    assert same.time[-1] == pytest.approx(1.0)
    assert len(same.mean) == 101
    assert same.largest < 1e-12
    share = np.linspace(0.0, 1.0, 101)
    late = along(np.column_stack([2.0 * share**2, np.zeros(101)]))
    lag = path_deviation([fast, late])
    assert np.allclose(lag.deviation, share - share**2)
    assert lag.largest == pytest.approx(0.25)
    assert lag.average == pytest.approx(1.0 / 6.0, abs=0.01)


@given(st.integers(0, 10**6), st.integers(2, 8))
def test_shifted_walks_deviate_by_the_spread_of_their_shifts(seed, count):
    rng = np.random.default_rng(seed)
    way, shifts = np.cumsum(rng.normal(0.01, 0.01, (40, 2)), axis=0), rng.normal(0.0, 0.1, (count, 2))
    found = path_deviation([along(way + shift) for shift in shifts])
    assert np.allclose(found.mean, way + shifts.mean(axis=0))
    assert np.allclose(found.deviation, np.sqrt(np.sum(np.var(shifts, axis=0))))
    assert found.average <= found.largest + 1e-12


def test_one_walk_has_no_deviation():
    with pytest.raises(InputError, match="at least 2"):
        path_deviation([stretches((0.0, 1.0))])
