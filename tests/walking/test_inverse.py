"""Weights from recorded walks: known weights come back, and what cannot be known is said."""

import sys
from pathlib import Path

import numpy as np
import pytest

from manikin.errors import InputError
from manikin.walking import LITERAL_ORDER, PROSE_ORDER, START, ShoulderPaths, walking_path

sys.path.append(str(Path(__file__).parents[2] / "docs"))

from identify_objective import (
    FIRST_GUESS,
    IDENTIFIED,
    SWAY,
    RecordedWalk,
    _Fit,
    _objective,
    identify_objective,
    predicted,
    recorded_walk,
    share_errors,
)

TARGETS = [(1, 0, 0), (-1, 1, np.pi / 4), (2, 1, np.pi / 2), (-2, 0.5, np.pi), (1.5, -1, -np.pi / 4)]


def recorded(target, objective, noise, step=0.01):
    """The optimal walk sampled every 10 ms, with what ``noise(times)`` adds (n, 3)."""
    path = walking_path(START, target, objective)
    time = np.arange(0.0, path.duration, step)
    return RecordedWalk(time, path.place_at(time) + noise(time), START, path.place[-1])


def white(rng):
    return lambda time: rng.normal(size=(len(time), 3)) * [0.01, 0.01, 0.02]


def swaying(rng):
    """Like a trunk over its steps: 2 cm aside at a step per 0.55 s, 3 degrees of turning, and noise."""
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)

    def noise(time):
        wave = np.sin(2.0 * np.pi * time[:, None] / 1.1 + phase) * [0.02, 0.02, 0.05]
        return wave + white(rng)(time)

    return noise


@pytest.mark.parametrize("objective", [PROSE_ORDER, LITERAL_ORDER])
@pytest.mark.parametrize("kind", [white, swaying])
@pytest.mark.parametrize("seed", range(2))
def test_known_weights_come_back_from_five_noisy_walks(objective, kind, seed):
    rng = np.random.default_rng(seed)
    found = identify_objective([recorded(target, objective, kind(rng)) for target in TARGETS])
    wanted = objective.weights[1:]
    assert found.objective.weights[1:] == pytest.approx(wanted, rel=0.05)
    assert np.all(found.low < found.objective.weights[1:])
    assert np.all(found.objective.weights[1:] < found.high)
    # The fit leaves the noise, no more: 1 cm per axis, and the sway of 2 cm.
    assert found.position_errors.max() < (0.014 if kind is white else 0.03)


def test_exact_walks_give_exact_weights_and_no_error():
    found = identify_objective([recorded(target, PROSE_ORDER, lambda _: 0.0) for target in TARGETS])
    assert found.objective.weights == pytest.approx(PROSE_ORDER.weights, rel=1e-3)
    assert found.position_errors.max() < 1e-4
    assert found.heading_errors.max() < 1e-4


def test_intervals_hold_as_often_as_they_say():
    """95 percent intervals of four weights in ten trials hold 38 times of 40 on average."""
    inside = 0  # fewer than 32 has odds below 1e-3, even of weights whose errors are correlated in pairs
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        found = identify_objective([recorded(t, PROSE_ORDER, white(rng), 0.02) for t in TARGETS[:3]])
        inside += int(
            np.sum((found.low <= PROSE_ORDER.weights[1:]) & (PROSE_ORDER.weights[1:] <= found.high))
        )
    assert 32 <= inside <= 40


def test_slopes_of_a_path_over_the_weights_agree_with_differences():
    fit = _Fit(recorded(TARGETS[1], PROSE_ORDER, white(np.random.default_rng(0))), FIRST_GUESS)
    logs = np.log([1.3, 1.1, 0.8, 3.0])
    exact = fit.at(_objective(FIRST_GUESS, logs)).slopes
    for i, change in enumerate(1e-3 * np.eye(4)):
        above, below = (fit.at(_objective(FIRST_GUESS, logs + s * change)).residuals for s in (1.0, -1.0))
        # The solver's own tolerance over the step.
        assert np.allclose(exact[:, i], (above - below) / 2e-3, atol=2e-4)
        assert np.abs(exact[:, i]).max() > 1e-2


def test_the_wrong_order_of_the_weights_is_told_from_the_right_one():
    """[Truong2010]_ 5.5 against 5.5.1: walks of one order do not fit the other."""
    found = identify_objective(
        [recorded(target, LITERAL_ORDER, white(np.random.default_rng(3))) for target in TARGETS]
    )
    lateral, angular = IDENTIFIED.index("lateral"), IDENTIFIED.index("angular")
    assert found.high[lateral] < found.low[angular]


def test_straight_walks_alone_are_refused():
    walk = recorded((0.0, 2.0, np.pi / 2), PROSE_ORDER, lambda _: 0.0)
    with pytest.raises(InputError, match="do not depend on the weights lateral, angular, goal; valid: walks"):
        identify_objective([walk])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: identify_objective([]), "no recorded walk to identify weights from; valid: at least one"),
        (
            lambda: RecordedWalk(np.zeros(20), np.zeros((20, 3))),
            "recorded walk has 20 instants from 0 s; valid: at least 10, increasing, none before 0 s",
        ),
        (
            lambda: RecordedWalk(np.arange(20.0), np.zeros((20, 3))),
            "recorded walk ends where it starts; valid: at least 0.1 m away",
        ),
    ],
)
def test_bad_recordings_are_refused_in_one_line(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value) == message


def test_a_goal_given_in_another_turn_is_unwound():
    time = np.linspace(0.0, 2.0, 20)
    place = np.column_stack([time, 0 * time, np.linspace(0.0, 3.5, 20)])
    walk = RecordedWalk(time, place, goal=(2.0, 0.0, 3.5 - 2 * np.pi))
    assert walk.goal[2] == pytest.approx(3.5)


# --- parts of walks, and recorded ones ---------------------------------------------------------

PASSING = ((1.1, 0.1, 0.2), (0.8, -0.1, -0.3))
"""Velocities at the ends: forward, left [m/s], angular [rad/s]."""


def passing(target, objective, noise, step=0.02):
    """The optimal walk between two velocities."""
    path = walking_path(START, target, objective, start_velocity=PASSING[0], goal_velocity=PASSING[1])
    time = np.arange(0.0, path.duration, step)
    return RecordedWalk(time, path.place_at(time) + noise(time), START, path.place[-1], *PASSING)


def test_velocities_at_the_ends_are_those_asked():
    walks = [passing(target, PROSE_ORDER, lambda _: 0.0) for target in TARGETS[::2]]
    found = identify_objective(walks)
    assert found.objective.weights == pytest.approx(PROSE_ORDER.weights, rel=1e-2)
    for path in found.paths:
        assert path.velocity[0] == pytest.approx(PASSING[0], abs=1e-6)
        assert path.velocity[-1] == pytest.approx(PASSING[1], abs=1e-6)
        assert path.residuals().within()
    # The last sample is up to 20 ms before the end, at 0.8 m/s.
    assert found.share_errors.max() < 0.01
    assert found.position_errors.max() < 1e-4
    # At rest the same walks cannot be explained.
    resting = [RecordedWalk(walk.time, walk.place, walk.start, walk.goal) for walk in walks]
    assert identify_objective(resting).position_errors.mean() > 0.02


def test_slopes_between_velocities_agree_with_differences():
    fit = _Fit(passing(TARGETS[2], PROSE_ORDER, white(np.random.default_rng(0))), FIRST_GUESS)
    logs = np.log([1.3, 1.1, 0.8, 3.0])
    exact = fit.at(_objective(FIRST_GUESS, logs)).slopes
    for i, change in enumerate(1e-3 * np.eye(4)):
        above, below = (fit.at(_objective(FIRST_GUESS, logs + s * change)).residuals for s in (1.0, -1.0))
        np.testing.assert_allclose(exact[:, i], (above - below) / 2e-3, atol=2e-4)


def test_intervals_between_walks_are_wider_where_errors_last():
    """An error that lasts a walk looks like many small ones if samples count as independent."""
    rng = np.random.default_rng(3)

    def lasting(time):
        return np.sin(np.pi * time[:, None] / time[-1]) * rng.normal(size=3) * [0.05, 0.05, 0.1]

    walks = [recorded(target, PROSE_ORDER, lasting, 0.02) for target in (*TARGETS, (2, -1, 0.5), (1, 2, 1))]
    samples, between = (
        identify_objective(walks, PROSE_ORDER, independent_samples=flag) for flag in (True, False)
    )
    assert between.objective == samples.objective
    assert np.median(np.log(between.high / between.low) / np.log(samples.high / samples.low)) > 2.0
    with pytest.raises(InputError, match="valid: more than 4"):
        identify_objective(walks[:4], independent_samples=False)


def test_given_weights_predict_and_are_measured():
    """Errors at equal shares do not see tempo: a walk that is only slower has none."""
    walk = recorded(TARGETS[1], PROSE_ORDER, lambda _: 0.0)
    slower = RecordedWalk(1.5 * walk.time, walk.place, walk.start, walk.goal)
    (path,) = predicted([slower], PROSE_ORDER)
    assert share_errors([slower], [path])[0] < 0.01
    assert path.duration == pytest.approx(walk.time[-1], abs=0.02)
    literal = predicted([slower], LITERAL_ORDER)
    assert share_errors([slower], literal)[0] > 0.05


def swaying_shoulders(rate=60.0):
    """Two seconds of standing, two metres straight ahead at 1 m/s, standing; strides at 1 Hz sway by 3 cm."""
    time = np.arange(0.0, 6.0, 1.0 / rate)
    share = np.clip((time - 2.0) / 2.0, 0.0, 1.0)
    middle = np.column_stack([2.0 * share, 0.03 * np.sin(2.0 * np.pi * time) * (share > 0.0) * (share < 1.0)])
    left = np.array([0.0, 0.2])
    return ShoulderPaths(middle + left, middle - left, rate)


def test_a_recorded_walk_has_no_standing_and_no_sway():
    walk, with_steps = (recorded_walk(swaying_shoulders(), None, sway) for sway in (SWAY, None))
    assert walk.time[0] == 0.0
    assert 2.0 < walk.time[-1] < 3.5
    np.testing.assert_allclose(walk.place[:, 2], 0.0, atol=1e-9)
    assert np.abs(walk.place[:, 1]).max() < 0.01
    assert np.abs(with_steps.place[:, 1]).max() > 0.02
    np.testing.assert_array_equal(walk.goal_velocity, with_steps.goal_velocity)
    # Cut inside the walk, its velocity is asked of the prediction.
    part = recorded_walk(swaying_shoulders(), (160, 200))
    assert part.start_velocity == pytest.approx([1.0, 0.0, 0.0], abs=0.1)
    assert part.goal_velocity == pytest.approx([1.0, 0.0, 0.0], abs=0.1)


def test_a_recorded_walk_needs_somebody_who_walks():
    with pytest.raises(InputError, match="nobody walks in frames 0 to 60"):
        recorded_walk(swaying_shoulders(), (0, 60))
    with pytest.raises(InputError, match="below half the rate"):
        recorded_walk(swaying_shoulders(), None, 30.0)
