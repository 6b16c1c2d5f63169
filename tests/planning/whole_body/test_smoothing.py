"""Shortening and smoothing: never longer, never infeasible, smooth at the end."""

import numpy as np
import pytest

from manikin.numerics.spatial import rotation_from_yaw
from manikin.planning.whole_body.birrt import plan_flight
from manikin.planning.whole_body.swing import SwingLimits
from manikin.planning.whole_body.swing_path import EffectorPath, Pose
from manikin.planning.whole_body.swing_search import search_swing, smooth_curve, smooth_path

START, GOAL = Pose(np.zeros(3), np.eye(3)), Pose(np.array([1.0, 0.0, 0.0]), rotation_from_yaw(0.6))


LIMITS = SwingLimits(speed=2.0, angular_speed=5.0)


def level_path(times, positions):
    return EffectorPath(times, positions, np.tile(np.eye(3), (len(times), 1, 1)))


def wall(extra):
    """A wall of 30 cm, thickened by ``extra``, on a floor."""

    def feasible(pose, _time, _hint):
        x, _, z = pose.position
        blocked = abs(x - 0.5) < 0.1 + extra and z < 0.3 + extra
        return None if blocked or z < -1e-9 else True

    return feasible


def found(seed):
    result = plan_flight(START, GOAL, 0.0, 2.0, wall(0.04), np.random.default_rng(seed), limits=LIMITS)
    assert result.path is not None, result.failure
    return result


@pytest.mark.parametrize("seed", range(5))
def test_smoothing_never_lengthens_and_keeps_limits_and_feasibility(seed):
    """After every number of iterations the path is no longer than before it."""
    result, limits = found(seed), LIMITS
    lengths = [result.path.length]
    for iterations in (1, 5, 20, 80):
        path = smooth_path(
            result.path, wall(0.04), np.random.default_rng(7), limits=limits, hints=result.hints,
            iterations=iterations,
        )  # fmt: skip
        lengths.append(path.length)
        durations = np.diff(path.time)
        assert np.all(durations > 0)
        steps, turns = np.diff(path.position, axis=0), path.turns
        assert np.all(np.linalg.norm(steps, axis=1) <= limits.speed * durations * (1 + 1e-9))
        assert np.all(np.linalg.norm(turns, axis=1) <= limits.angular_speed * durations * (1 + 1e-6))
        np.testing.assert_array_equal(path.position[[0, -1]], result.path.position[[0, -1]])
        # Edges are checked every 5 cm: thinner than the wall by at most that.
        times = np.linspace(0, 2, 200)
        positions, rotations = path.sample(times)
        shrunk = wall(-0.05)
        assert all(shrunk(Pose(p, r), 0, None) for p, r in zip(positions, rotations, strict=True))
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[-1] < lengths[0]


def test_nothing_is_replaced_when_the_checks_fail():
    """The printed algorithm would replace the path in any case."""
    result = found(0)
    smoothed = smooth_path(
        result.path, lambda *_: None, np.random.default_rng(0), limits=LIMITS, iterations=30
    )
    assert smoothed is result.path


def test_speed_limits_forbid_a_shortcut():
    """A detour walked at the limit cannot become a faster straight line in less time."""
    path = level_path([0, 1, 1.1, 2.1], [[0, 0, 0], [1, 0, 0], [1, 0.1, 0], [0, 0.1, 0]])
    limits = SwingLimits(speed=1.0)
    smoothed = smooth_path(
        path, lambda _pose, _time, _hint: True, np.random.default_rng(0), limits=limits, iterations=50
    )
    steps = np.linalg.norm(np.diff(smoothed.position, axis=0), axis=1)
    assert np.all(steps <= np.diff(smoothed.time) * (1.0 + 1e-9))


def test_a_straight_path_is_left_alone():
    """Two nodes have no two segments."""
    path = level_path([0, 1], [[0, 0, 0], [0.5, 0, 0]])
    assert smooth_path(path, lambda *_: pytest.fail("asked"), np.random.default_rng(0), limits=LIMITS) is path


def test_same_seed_same_result():
    """All randomness comes from the generator."""
    result = found(1)
    paths = [smooth_path(result.path, wall(0.04), np.random.default_rng(5), limits=LIMITS) for _ in range(2)]
    assert np.array_equal(paths[0].position, paths[1].position)


@pytest.mark.parametrize("seed", range(5))
def test_the_curve_is_feasible_and_at_rest_at_both_ends(seed):
    """A C4 curve past the wall, from a path with 4 cm of room."""
    result = found(seed)
    path = smooth_path(result.path, wall(0.04), np.random.default_rng(seed), limits=LIMITS)
    smooth = smooth_curve(path, wall(0.0), limits=SwingLimits(speed=3.0))
    assert smooth.curve is not None, smooth.failure
    state = smooth.curve.evaluate(np.linspace(0, 2, 101))
    assert all(wall(0.0)(Pose(p, r), 0, None) for p, r in zip(state.position, state.rotation, strict=True))
    assert smooth.curve.peak_speed <= 3.0
    assert np.abs(state.velocity[[0, -1]]).max() < 1e-10
    np.testing.assert_allclose(state.position[[0, -1]], path.position[[0, -1]], atol=1e-12)


def test_a_curve_that_is_too_fast_is_explained():
    """The limit is named."""
    path = level_path([0, 0.3], [[0, 0, 0], [1, 0, 0]])
    smooth = smooth_curve(path, lambda _pose, _time, _hint: True, limits=SwingLimits(speed=2.0))
    assert smooth.curve is None
    assert "speed reaches" in smooth.failure


def test_a_curve_without_posture_is_explained():
    """The instant is named."""
    path = level_path([0, 1], [[0, 0, 0], [0.5, 0, 0]])
    smooth = smooth_curve(path, lambda _pose, time, _hint: None if time > 0.5 else True, limits=LIMITS)
    assert smooth.curve is None
    assert "no feasible posture at t = 0.5" in smooth.failure


def test_search_shorten_and_smooth_in_one():
    """The whole second way, and its failure."""
    result = search_swing(
        START, GOAL, 0.0, 1.5, wall(0.0), np.random.default_rng(0), roomy=wall(0.04),
        limits=SwingLimits(speed=4.0),
    )  # fmt: skip
    assert result.curve is not None, result.failure
    assert result.curve.peak_speed <= 4.0
    hopeless = search_swing(
        START, GOAL, 0.0, 0.1, wall(0.0), np.random.default_rng(0), roomy=wall(0.0), limits=LIMITS
    )
    assert hopeless.curve is None
    assert "too short" in hopeless.failure
