"""Postures that follow points: normal equations, steps within bounds, many searches at once."""

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.body import human, random_configuration
from manikin.kinematics.point_targets import PointTargets, PostureCost
from manikin.kinematics.tracking import bounded_step, follow, search

SEGMENTS = (
    "pelvis", "thorax", "neck", "left_upper_arm", "left_forearm", "right_upper_arm", "right_forearm",
    "left_thigh", "left_leg", "left_foot", "right_thigh", "right_leg", "right_foot",
)  # fmt: skip


@pytest.fixture(scope="module")
def body():
    return human()


def places(body, segments, points, q):
    data, found = body.pinocchio.createData(), []
    for posture in q:
        pin.framesForwardKinematics(body.pinocchio, data, posture)
        frames = [data.oMf[body.segment_frame(segment)] for segment in segments]
        found.append([frame.act(point) for frame, point in zip(frames, points, strict=True)])
    return np.array(found)


def recorded(body, q, noise=0.0, seed=0):
    """Three points on each of some segments, where postures have them."""
    rng = np.random.default_rng(seed)
    segments = tuple(np.repeat(SEGMENTS, 3).tolist())
    points = rng.normal(scale=0.1, size=(len(segments), 3))
    there = places(body, segments, points, q) + rng.normal(scale=noise, size=(len(q), len(segments), 3))
    names = tuple(f"{segment} {k}" for k, segment in enumerate(segments))
    return PointTargets(names, segments, points, there, rng.uniform(0.5, 1.0, len(names)))


def swinging(body, n, rate=100.0):
    q, phase = np.tile(body.standing_posture(), (n, 1)), 2.0 * np.pi * np.arange(n) / rate
    q[:, 0] += 1.2 * np.arange(n) / rate
    for joint, size, delay in (
        ("left_hip_flexion", 0.4, 0.0), ("right_hip_flexion", -0.4, 0.0), ("thorax_rotation", 0.1, 1.0),
        ("left_knee_flexion", 0.5, 1.0), ("right_elbow_flexion", 0.4, 2.0),
    ):  # fmt: skip
        q[:, 7 + body.joint_index(joint)] += abs(size) + size * np.sin(phase + delay)
    q[:, 7:] = np.clip(q[:, 7:], body.lower, body.upper)
    return q


def test_gradient_and_matrix_are_those_of_the_cost(body):
    """By differences of the cost, and of the points' places; one body is 100 m from the origin."""
    rng = np.random.default_rng(1)
    q = np.array([random_configuration(body, rng) for _ in range(3)])
    q[:, :3] += [[0.0, 0.0, 0.0], [5.0, -3.0, 1.0], [100.0, 0.0, 0.0]]
    targets = recorded(body, q, noise=0.05)
    wanted = np.array(targets.positions)
    wanted[1, :7] = np.nan
    cost, step = PostureCost(body, targets), 1e-6
    held = q[:, 7:] + 0.1
    gradient, matrix = cost.equations(cost.at(q, held, wanted))
    weights = np.where(np.isnan(wanted[..., 0]), 0.0, targets.weights)[..., None]
    root, slopes, costs = np.sqrt(weights), [], []
    for slot in cost.slots:
        v = np.zeros(body.nv)
        v[slot] = step
        ends = [np.array([pin.integrate(body.pinocchio, one, sign * v) for one in q]) for sign in (1.0, -1.0)]
        ahead, behind = (places(body, targets.segments, targets.points, end) for end in ends)
        slopes.append((root * (ahead - behind)).reshape(len(q), -1) / (2.0 * step))
        costs.append([cost.at(end, held, wanted).cost for end in ends])
    costs, slopes = np.array(costs), np.array(slopes).transpose(1, 0, 2)
    np.testing.assert_allclose(gradient, 0.5 * (costs[:, 0] - costs[:, 1]).T / (2.0 * step), atol=1e-6)
    expected = slopes @ slopes.transpose(0, 2, 1)
    hinges = np.arange(6, len(cost.slots))
    expected[:, hinges, hinges] += 1e-5
    np.testing.assert_allclose(matrix, np.tril(expected), atol=1e-6)


@given(st.integers(0, 10_000))
def test_a_step_keeps_its_bounds_and_is_level_within_them(seed):
    """Of any quadratic the slope is zero along every unknown that is not on its bound."""
    rng = np.random.default_rng(seed)
    half = rng.normal(size=(8, 8))
    matrix, right = half @ half.T + 0.1 * np.eye(8), rng.normal(size=8)
    lower, upper = -rng.exponential(size=8) * (rng.random(8) < 0.8), rng.exponential(size=8)
    step = bounded_step(np.tril(matrix), right, 0.01, lower, upper)
    assert np.all((step >= lower) & (step <= upper))
    damped = matrix + 0.01 * np.eye(8)
    slope = damped @ step - right
    inside = (step > lower) & (step < upper)
    np.testing.assert_allclose(slope[inside], 0.0, atol=1e-9)


def test_together_as_one_by_one(body):
    """Searches do not depend on what is searched beside them, to rounding."""
    q = swinging(body, 8)
    targets = recorded(body, q, noise=0.01)
    starts, cost = np.tile(q[:1], (8, 1)), PostureCost(body, targets)
    together, costs = search(cost, starts, targets.positions, starts)
    for k in range(8):
        one, own = search(cost, starts[k : k + 1], targets.positions[k : k + 1], starts[k : k + 1])
        assert costs[k] == pytest.approx(own[0], rel=1e-6)
        np.testing.assert_allclose(together[k], one[0], atol=1e-6)


def test_dense_recordings_are_followed_as_frame_by_frame(body):
    """Of a noisy motion with a gap: residuals to 0.1 mm, hinges to 0.5 degrees, and the same on every run."""
    q = swinging(body, 150)
    targets = recorded(body, q, noise=0.003)
    positions = np.array(targets.positions)
    positions[60:90, 24:27] = np.nan
    targets = PointTargets(targets.names, targets.segments, targets.points, positions, targets.weights)
    starts = np.tile(body.standing_posture(), (150, 1))
    dense, away = follow(body, targets, starts, 100.0)
    slow, slowly = follow(body, targets, starts)
    assert np.array_equal(np.isnan(away), np.isnan(positions[..., 0]))
    np.testing.assert_allclose(away, slowly, atol=1e-4)
    assert np.abs(dense[:, 7:] - slow[:, 7:]).max() < np.deg2rad(0.5)
    assert np.all((dense[:, 7:] >= body.lower) & (dense[:, 7:] <= body.upper))
    again, _ = follow(body, targets, starts, 100.0)
    np.testing.assert_array_equal(again, dense)
