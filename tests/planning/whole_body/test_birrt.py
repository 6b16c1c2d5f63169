"""Bi-RRT in configuration-time space: ways around walls, limits kept, failures explained."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manikin.errors import InputError
from manikin.numerics.spatial import rotation_from_rpy, rotation_from_yaw
from manikin.planning.whole_body.birrt import plan_flight
from manikin.planning.whole_body.swing import SwingLimits
from manikin.planning.whole_body.swing_path import EffectorPath, Pose

START = Pose(np.zeros(3), np.eye(3))
GOAL = Pose(np.array([1.0, 0.0, 0.0]), rotation_from_yaw(0.8))


def over_the_wall(pose, _time, _hint):
    """A wall of 35 cm between start and goal, and a floor."""
    x, y, z = pose.position
    blocked = 0.4 < x < 0.6 and z < 0.35 and abs(y) < 1.0
    return None if blocked or z < -1e-9 else True


def anywhere(_pose, _time, _hint):
    return True


LIMITS = SwingLimits(speed=2.0, angular_speed=5.0)


def search(seed=0, feasible=over_the_wall, duration=2.0, limits=LIMITS, **options):
    rng = np.random.default_rng(seed)
    return plan_flight(START, GOAL, 0.0, duration, feasible, rng, limits=limits, **options)


@pytest.mark.parametrize("seed", range(6))
def test_finds_a_way_over_a_wall_within_the_limits(seed):
    """Ends exact, time increasing, speeds kept, every interpolated point feasible."""
    limits = SwingLimits(speed=2.0, angular_speed=2.0)
    result = search(seed, limits=limits)
    assert result.path is not None, result.failure
    path = result.path
    np.testing.assert_allclose(path.position[[0, -1]], [START.position, GOAL.position], atol=1e-12)
    np.testing.assert_allclose(path.rotation[-1], GOAL.rotation, atol=1e-12)
    assert path.time[0] == 0.0
    assert path.time[-1] == 2.0
    durations = np.diff(path.time)
    assert np.all(durations > 0)
    # Rounding of the interpolated nodes only.
    assert np.all(np.linalg.norm(np.diff(path.position, axis=0), axis=1) <= 2.0 * durations * (1 + 1e-9))
    assert np.all(np.linalg.norm(path.turns, axis=1) <= 2.0 * durations * (1 + 1e-6))
    assert len(result.hints) == len(path.time)
    positions, rotations = path.sample(np.linspace(0, 2, 300))
    inside = [over_the_wall(Pose(p, r), 0, None) is None for p, r in zip(positions, rotations, strict=True)]
    # Edges are checked every 5 cm: a corner may be cut by less than that.
    assert np.mean(inside) < 0.03


def test_same_seed_same_path():
    """All randomness comes from the generator."""
    first, second = search(3), search(3)
    assert np.array_equal(first.path.position, second.path.position)
    assert np.array_equal(first.path.time, second.path.time)
    assert not np.array_equal(first.path.position, search(4).path.position)


def test_a_gate_that_opens_late_is_passed_after_it_opens():
    """Time is a dimension of the search: the wall opens at 1 s."""

    def gate(pose, time, _hint):
        return None if 0.4 < pose.position[0] < 0.6 and time < 1.0 else True

    result = search(1, gate)
    assert result.path is not None, result.failure
    time = np.linspace(0, 2, 400)
    x = result.path.sample(time)[0][:, 0]
    assert np.all(time[(x > 0.45) & (x < 0.55)] > 0.93)  # an edge is checked every 5 cm


def test_hints_come_from_the_neighbour_in_the_tree():
    """Every question but the first two carries the answer of an earlier one."""
    asked = []

    def remember(_pose, _time, hint):
        asked.append(hint)
        return len(asked)

    assert search(0, remember).path is not None
    assert asked[:2] == [None, None]
    assert all(isinstance(hint, int) and hint <= k for k, hint in enumerate(asked[2:], start=2))


def test_rejected_nodes_are_not_added():
    """Where nothing but the ends is feasible the trees keep their roots only."""

    def ends_only(_pose, time, _hint):
        return True if time in (0.0, 2.0) else None

    result = search(0, ends_only, iterations=50)
    assert result.path is None
    assert "no path in 50 iterations: trees of 1 and 1 nodes" in result.failure
    assert "and 0 edges" not in result.failure


def test_a_window_too_short_is_explained_without_searching():
    """One metre at 2 m/s needs half a second."""
    result = search(duration=0.4, feasible=lambda *_: pytest.fail("asked"))
    assert result.path is None
    assert "too short" in result.failure
    assert "at least 0.500 s" in result.failure


def test_a_turn_too_fast_is_explained():
    """0.8 rad at 0.1 rad/s needs eight seconds."""
    result = search(limits=SwingLimits(angular_speed=0.1))
    assert "at least 8.000 s" in result.failure


@pytest.mark.parametrize(("which", "x"), [("start", 0.0), ("goal", 1.0)])
def test_an_infeasible_end_is_named(which, x):
    """The message says which end has no posture and when."""
    result = search(feasible=lambda pose, _time, _hint: None if pose.position[0] == x else True)
    assert f"the {which} pose at t = " in result.failure


def test_a_closed_wall_ends_in_an_explanation():
    """The counts say what happened."""

    def closed(pose, _time, _hint):
        return None if 0.4 < pose.position[0] < 0.6 else True

    result = search(0, closed, iterations=120)
    assert result.path is None
    assert result.path is None
    assert "no path in 120 iterations" in result.failure
    assert float(result.failure.split("stay ")[1].split()[0]) > 0.1
    assert "edges had no feasible posture" in result.failure


poses = st.tuples(*[st.floats(-1, 1)] * 3, *[st.floats(-1.5, 1.5)] * 3, st.floats(0.01, 3))


@given(poses, poses, poses)
def test_the_metric_is_one(a, b, c):
    """Symmetric, and straight edges are the shortest (triangle inequality)."""

    def node(values):
        return np.array(values[:3]), rotation_from_rpy(*values[3:6])

    def length(times, nodes):
        return EffectorPath(times, [n[0] for n in nodes], [n[1] for n in nodes]).length

    first, middle, last = node(a), node(b), node(c)
    t1, t2 = b[6], b[6] + c[6]
    detour = length([0.0, t1, t2], [first, middle, last])
    # The time part is the same sum; rounding of the logarithm near pi is below 1e-6.
    assert length([0.0, t2], [first, last]) <= detour + 1e-6
    assert length([0.0, t2], [last, first]) == pytest.approx(length([0.0, t2], [first, last]), abs=1e-6)


def test_the_metric_weighs_its_parts():
    """Equation 6.6 by hand: 0.3 m, 0.5 rad, 0.2 s."""
    path = EffectorPath([0, 0.2], [[0, 0, 0], [0.3, 0, 0]], [np.eye(3), rotation_from_yaw(0.5)])
    assert path.length == pytest.approx(np.sqrt(0.3**2 + (0.3 * 0.5) ** 2 + 0.2**2), rel=1e-12)


def test_paths_interpolate_straight_and_along_the_shortest_turn():
    """Half way is half way."""
    path = EffectorPath([1, 2], [[0, 0, 0], [1, 0, 0]], [np.eye(3), rotation_from_yaw(1.0)])
    position, rotation = path.sample(np.array([1.5]))
    np.testing.assert_allclose(position[0], [0.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(rotation[0], rotation_from_yaw(0.5), atol=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: EffectorPath([0, 0], np.zeros((2, 3)), np.zeros((2, 3, 3))), "increasing"),
        (lambda: EffectorPath([0, 1], np.zeros((3, 3)), np.zeros((2, 3, 3))), "shape"),
        (lambda: SwingLimits(speed=0.0), "speed"),
        (lambda: search(duration=0.0), "after its start"),
    ],
)
def test_misuse_is_refused(make, message):
    """Bad paths, limits and times raise one line."""
    with pytest.raises(InputError, match=message):
        make()
