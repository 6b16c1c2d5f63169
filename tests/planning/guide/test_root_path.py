"""Paths of the root: smooth, bounded, within their speed limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from manikin.errors import InputError
from manikin.planning.guide.root_path import RootLimits, RootPath
from manikin.planning.guide.root_pose import angles_between


def walk(seed, count, turn=0.4, stride=0.3):
    """Control poses of a random walk."""
    rng = np.random.default_rng(seed)
    position = np.cumsum(rng.uniform(-stride, stride, (count, 3)), axis=0)
    turns, now = [], Rotation.random(random_state=seed)
    for step in rng.uniform(-turn, turn, (count, 3)):
        now = now * Rotation.from_rotvec(step)
        turns.append(now.as_quat())
    return np.hstack([position, turns])


paths = st.builds(
    lambda seed, count, linear, angular: RootPath.through(walk(seed, count), RootLimits(linear, angular)),
    st.integers(0, 10_000),
    st.integers(2, 25),
    st.tuples(*[st.floats(0.2, 2.0)] * 3),
    st.tuples(*[st.floats(0.2, 3.0)] * 3),
)


@given(path=paths)
def test_speed_limits_are_kept_and_used(path):
    """Differences between neighbouring times stay below every limit; somewhere one is nearly met."""
    times = np.linspace(0.0, path.duration, 4001)
    poses, step = path.at_times(times), times[1]
    turns = Rotation.from_quat(poses[:, 3:])
    change = np.hstack([np.diff(poses[:, :3], axis=0), (turns[:-1].inv() * turns[1:]).as_rotvec()]) / step
    # A difference of rotations misses the rate by the square of the small turn between them.
    assert np.all(np.abs(change) <= path.limits.both * (1.0 + 1e-5))
    assert (np.abs(change) / path.limits.both).max() > 0.9
    assert np.all(np.abs(path.velocities(times)) <= path.limits.both * (1.0 + 1e-9))


@given(path=paths, share=st.floats(0.001, 0.999))
def test_rates_are_the_derivatives(path, share):
    h = 1e-6
    before, after = path.poses([share - h, share + h])
    turn = (Rotation.from_quat(before[3:]).inv() * Rotation.from_quat(after[3:])).as_rotvec()
    numeric = np.concatenate([after[:3] - before[:3], turn]) / (2 * h)
    np.testing.assert_allclose(path.rates(share)[0], numeric, atol=2e-5 * max(1.0, np.abs(numeric).max()))


@given(path=paths)
def test_motion_stays_below_its_bounds(path):
    """Length and turn of each span, measured finely, are no more than what the bounds say."""
    borders, lengths, angles = path.span_bounds
    for low, high, length, angle in zip(borders[:-1], borders[1:], lengths, angles, strict=True):
        poses = path.poses(np.linspace(low, high, 50))
        assert np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1).sum() <= length * (1.0 + 1e-9)
        assert angles_between(poses[:-1], poses[1:]).sum() <= angle * (1.0 + 1e-6) + 1e-6


@given(path=paths)
def test_poses_are_held_before_the_start_and_after_the_end(path):
    assert angles_between(path.at_times(0.0)[0], path.start) < 1e-7
    np.testing.assert_allclose(
        path.at_times([-1.0, path.duration + 1.0])[:, :3], [path.start[:3], path.goal[:3]]
    )


def test_a_straight_way_takes_its_length_over_the_limit():
    """1 m at 0.5 m/s along x, with the per cent that the time law keeps in hand."""
    ends = np.array([[0, 0, 0, 0, 0, 0, 1.0], [1, 0, 0, 0, 0, 0, 1.0]])
    assert RootPath.through(ends, RootLimits(0.5, 1.0)).duration == pytest.approx(2.0, rel=0.011)


def test_paths_are_read_only_and_checked():
    path = RootPath.through(walk(0, 6))
    with pytest.raises(ValueError, match="read-only"):
        path.control_points[0, 0] = 1.0
    with pytest.raises(InputError, match="knots span"):
        RootPath(1, [0, 0, 2, 2], walk(0, 2))
    with pytest.raises(InputError, match="root limits linear"):
        RootLimits(0.0)
