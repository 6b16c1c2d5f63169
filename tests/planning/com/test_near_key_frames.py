"""A balanced CoM near key frames, on the recorded CoM of an executed motion with and without noise."""

import numpy as np
import pytest

from manikin.balance import pseudo_wrench, wrench_polytope
from manikin.contact import Phase, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.planning.com import (
    KeyframeProblem,
    RecordedCom,
    near_key_frames,
    plan_com_near_key_frames,
    plan_com_through_key_frames,
)

MASS = 70.0
HEIGHT = 0.9
CAP = 2000.0


def stepping(noise=0.0, seed=0):
    """Three seconds of rocking from foot to foot, each lifted once: the CoM of a pendulum above the feet."""
    feet = {
        name: sole(name, (0.0, y, 0.0), length=0.26, width=0.11, friction=0.8)
        for name, y in (("left_foot", 0.1), ("right_foot", -0.1))
    }
    both = Stance(list(feet.values()), CAP)
    stances = [both, Stance([feet["left_foot"]], CAP), both, Stance([feet["right_foot"]], CAP), both]
    times = [0.0, 0.7, 1.1, 1.9, 2.3, 3.0]
    sequence = StanceSequence(
        [Phase(s, b - a, b - a) for s, a, b in zip(stances, times, times[1:], strict=False)]
    )
    time = np.linspace(0.0, 3.0, 301)
    sway = 0.1 * np.sin(2.0 * np.pi * (time - 0.3) / 2.4)
    com = np.stack([np.zeros_like(time), sway, np.full_like(time, HEIGHT)], axis=1)
    error = np.random.default_rng(seed).normal(0.0, noise, com.shape)
    return RecordedCom(time, com + error, sequence, times), com


def asked(recording, **options):
    return KeyframeProblem(MASS, recording, start_velocity=None, goal_velocity=None, **options)


def margins(found, times):
    trajectory = found.trajectory
    wrench = pseudo_wrench(MASS, trajectory.position(times), trajectory.acceleration(times))
    stances = [trajectory.schedule.stance_at(time) for time in times]
    return np.array([wrench_polytope(s).margin(w) for s, w in zip(stances, wrench, strict=True)])


@pytest.fixture(scope="module")
def usual():
    """Plan near the key frames of the motion without noise."""
    return plan_com_near_key_frames(asked(stepping()[0]))


def test_the_plan_is_balanced_and_near(usual):
    """Margin measured apart from the planner, at instants that it did not look at."""
    assert usual.succeeded
    assert margins(usual, np.random.default_rng(1).uniform(0.0, 3.0, 60)).min() >= 0.0
    assert usual.rms < 0.01
    assert usual.d_min >= 0.0


def test_noise_that_no_foot_could_follow_is_not_followed():
    """With three millimetres of noise the exact method fails, and the pulled one hardly notices."""
    recording, truth = stepping(noise=0.003, seed=3)
    exact = plan_com_through_key_frames(asked(recording, control_points=40))
    found = plan_com_near_key_frames(asked(recording))
    assert not exact.succeeded
    assert found.succeeded
    away = np.linalg.norm(found.trajectory.position(recording.time) - truth, axis=1)
    # Noise of 3 mm along each of three axes has a root mean square of 5.2 mm: it must not grow.
    assert np.sqrt(np.mean(away**2)) < 0.01


@pytest.mark.long
def test_a_wanted_margin_is_kept_and_costs_nearness(usual):
    wide = plan_com_near_key_frames(asked(stepping()[0], required_margin=6.0))
    assert wide.succeeded
    assert wide.d_min >= 6.0
    assert wide.rms >= usual.rms - 1e-4


@pytest.mark.long
def test_more_margin_than_has_to_be_kept_is_wished_for(monkeypatch, usual):
    """Where none is required the lower half of the margins is larger than without the wish."""
    times = np.linspace(0.0, 3.0, 301)
    monkeypatch.setattr(near_key_frames, "ROOM_PULL", 0.0)
    content = plan_com_near_key_frames(asked(stepping()[0]))
    low, lower = (np.sort(margins(found, times))[:150].mean() for found in (usual, content))
    assert low > lower + 1.0
    assert usual.rms < 0.01


def test_stances_that_share_nothing_are_explained():
    """From one foot to the other without both: their polytopes only share the empty wrench."""
    feet = [
        sole(name, (0.0, y, 0.0), length=0.26, width=0.11, friction=0.8)
        for name, y in (("left_foot", 0.3), ("right_foot", -0.3))
    ]
    time = np.linspace(0.0, 1.0, 51)
    com = np.column_stack([np.zeros(51), np.linspace(0.3, -0.3, 51), np.full(51, HEIGHT)])
    recording = RecordedCom(
        time, com, StanceSequence([Phase(Stance([foot], CAP)) for foot in feet]), [0.0, 0.5, 1.0]
    )
    found = plan_com_near_key_frames(asked(recording))
    assert found.trajectory is None
    assert found.failure.reason
    assert np.isnan(found.distance).all()


def test_conditions_at_the_ends_are_refused():
    with pytest.raises(InputError, match="start_velocity"):
        plan_com_near_key_frames(KeyframeProblem(MASS, stepping()[0]))
