"""Treadmills: the belt's velocity, and a walk seen from the belt."""

import numpy as np
import pytest

from manikin.recordings import ForcePlate, read_recording, reconstruct, supports_of, timing_errors
from manikin.recordings.supports.treadmill import belt_velocity, from_the_belt, plates_from_the_belt


@pytest.fixture(scope="module")
def walk(recordings_folder):
    return reconstruct(read_recording(recordings_folder / "grf/btkdata/FunctionalWalk.c3d"))


def test_a_walk_over_the_ground_has_no_belt(walk):
    assert belt_velocity(walk) is None


def test_a_walk_seen_from_beside_it_stands_on_a_belt(walk):
    """The walker's mean velocity is subtracted: the belt has its opposite, and supports are those before.

    Feet that carry move by some centimetres a second, from heel to toe: 5 % of the speed of the walk. That is
    below the speeds of touch-down and lift-off, so events move by less than two frames.
    """
    velocity = (walk.q[-1, :2] - walk.q[0, :2]) / (walk.time[-1] - walk.time[0])
    beside = from_the_belt(walk, velocity)
    belt = belt_velocity(beside)
    assert belt is not None
    np.testing.assert_allclose(belt, -velocity, atol=0.05 * np.linalg.norm(velocity))
    again, known = supports_of(from_the_belt(beside, belt)), supports_of(walk)
    assert [one.effector for one in again.supports] == [one.effector for one in known.supports]
    apart = [
        (one.start - other.start, one.end - other.end)
        for one, other in zip(again.supports, known.supports, strict=True)
    ]
    assert np.abs(apart).max() <= 2.0 / walk.rate + 1e-9


def test_the_centre_of_pressure_moves_with_the_ground():
    """A still force under a belt moves backward with it, seen from the belt: by minus velocity times time."""
    force, place = np.array([20.0, -10.0, 700.0]), np.array([0.2, 0.1, 0.0])
    wrenches = np.tile(np.hstack([force, np.cross(place, force)]), (100, 1))
    plate = ForcePlate("belt", wrenches, np.zeros(3), 100.0, 2.0)
    (moved,) = plates_from_the_belt([plate], np.array([-1.2, 0.3]), 2.5)
    way = np.outer(moved.time - 2.5, [1.2, -0.3])
    np.testing.assert_allclose(moved.cop[:, :2], place[:2] + way, atol=1e-9)
    np.testing.assert_array_equal(moved.force, plate.force)


def test_steps_of_a_sprint_are_those_of_its_plates(recordings_folder):
    """At 9.5 m/s no foot comes to rest in low-passed positions; the force that the motion needs shows steps.

    The bar is that of runs: 20 ms, median.
    """
    recording = read_recording(recordings_folder / "laboratories/nimble/JA1Gait35.c3d")
    supports = supports_of(reconstruct(recording), start=recording.start)
    assert [one.effector for one in supports.supports] == ["left_foot", "right_foot"] * 2 + ["left_foot"]
    errors = timing_errors(supports, recording.plates)
    assert len(errors) == 8
    assert np.median([abs(one.error) for one in errors]) < 0.02
