"""Postures in the middle of flights that a contact plan leaves out."""

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.scene import Box, Obstacle, Scene
from manikin.wholebody.mid_flights import LIFT, with_mid_flights
from manikin.wholebody.refine_input import KeyPath


@pytest.fixture(scope="module")
def walked(cases):
    """Three steps of which only the changes of contact are known, and the same with feet lifted."""
    case = cases.crouch(2)
    body, scene, time, q, schedule = case
    changes = np.isclose(time[:, None], schedule.instants).any(axis=1)
    path = KeyPath(time[changes], q[changes])
    return case, path, with_mid_flights(body, scene, schedule, path)


def test_each_flight_gets_one_posture_in_its_middle(walked):
    case, path, lifted = walked
    swings = case.schedule.sequence.swings()
    middles = [np.mean(case.schedule.swing_interval(swing)) for swing in swings]
    added = np.setdiff1d(lifted.time, path.time)
    np.testing.assert_allclose(added, sorted(middles))
    np.testing.assert_allclose(lifted.at(path.time), path.at(path.time), atol=1e-12)


def test_there_the_foot_is_above_both_its_places_and_the_other_one_stands(walked):
    """Within the posture generator's millimetre."""
    case, _, lifted = walked
    for swing in case.schedule.sequence.swings():
        middle = float(np.mean(case.schedule.swing_interval(swing)))
        posture = Configuration(case.body, lifted.at(np.array([middle]))[0])
        place = posture.effector_placement(swing.effector)[1]
        half = 0.5 * (swing.start.position + swing.end.position)
        np.testing.assert_allclose(place, half + np.array([0.0, 0.0, LIFT]), atol=1e-3)
        for contact in case.schedule.sequence[int(case.schedule.phase_at(middle))].stance:
            stands = posture.effector_placement(contact.effector)[1]
            np.testing.assert_allclose(stands, contact.position, atol=1e-3)


def test_a_path_with_keys_inside_its_flights_stays_as_it_is(walked):
    case, _, _ = walked
    path = KeyPath(case.time, case.q)
    same = with_mid_flights(case.body, case.scene, case.schedule, path)
    np.testing.assert_array_equal(same.time, path.time)


def test_a_flight_without_a_posture_stays_as_it_is(walked):
    """A foot cannot be lifted into a slab that begins where it lands."""
    case, path, _ = walked
    low = Scene([Obstacle("slab", Box((9.0, 9.0, 0.1)), translation=(0.0, 0.0, 0.3))])
    same = with_mid_flights(case.body, low, case.schedule, path)
    np.testing.assert_array_equal(same.time, path.time)
