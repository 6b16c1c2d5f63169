"""Postures in the middle of flights that a contact plan leaves out."""

from dataclasses import replace

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.pipeline.stages import RunContext
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.pipeline.stages.refinement_stage import from_rest_to_rest
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.swing_planner import SHARES, with_mid_flights
from manikin.scenarios.families import FAMILIES, draw_scene
from manikin.scene import Box, Obstacle, Proximity, Scene


@pytest.fixture(scope="module")
def walked(cases):
    """Three steps of which only the changes of contact are known, and the same with feet lifted."""
    case = cases.crouch(2)
    body, scene, time, q, schedule = case
    changes = np.isclose(time[:, None], schedule.instants).any(axis=1)
    path = KeyPath(time[changes], q[changes])
    return case, path, with_mid_flights(body, scene, schedule, path)


def test_each_flight_gets_postures_inside_and_the_rest_stays(walked):
    case, path, lifted = walked
    added = np.setdiff1d(lifted.time, path.time)
    for swing in case.schedule.sequence.swings():
        start, end = case.schedule.swing_interval(swing)
        inside = added[(added > start) & (added < end)]
        np.testing.assert_allclose((inside - start) / (end - start), SHARES)
        added = np.setdiff1d(added, inside)
    assert len(added) == 0
    np.testing.assert_allclose(lifted.at(path.time), path.at(path.time), atol=1e-12)


def test_there_the_foot_is_off_the_ground_as_far_as_is_wanted_and_the_other_one_stands(walked):
    """The curve may be lower at a quarter of a flight: it has to gain half of the way it has gone."""
    case, path, lifted = walked
    wanted = RefineScales().safe_distance
    for time in np.setdiff1d(lifted.time, path.time):
        (swing,) = (
            swing
            for swing in case.schedule.sequence.swings()
            if case.schedule.swing_interval(swing)[0] < time < case.schedule.swing_interval(swing)[1]
        )
        posture = Configuration(case.body, lifted.at(np.array([time]))[0])
        height = posture.effector_placement(swing.effector)[1][2]
        gone = min(
            np.linalg.norm(posture.effector_placement(swing.effector)[1] - end.position)
            for end in (swing.start, swing.end)
        )
        assert height >= min(wanted, 0.5 * gone) - 1e-3  # the posture generator's millimetre
        for contact in case.schedule.sequence[int(case.schedule.phase_at(time))].stance:
            stands = posture.effector_placement(contact.effector)[1]
            np.testing.assert_allclose(stands, contact.position, atol=1e-3)


def test_a_foot_goes_around_what_stands_in_its_way(walked):
    """A bar across the way of the foot, higher than the foot would be lifted without it."""
    case, path, _ = walked
    swing = case.schedule.sequence.swings()[1]
    middle = 0.5 * (swing.start.position + swing.end.position) + np.array([0.0, 0.0, 0.06])
    bar = Obstacle("bar", Box((0.04, 0.14, 0.12)), translation=middle)
    scene = Scene([bar], floor_height=0.0)
    lifted = with_mid_flights(case.body, scene, case.schedule, path)
    start, end = case.schedule.swing_interval(swing)
    inside = lifted.time[(lifted.time > start) & (lifted.time < end)]
    assert len(inside) > 0
    near = Proximity(case.body, Scene([bar]))
    for q in lifted.at(inside):
        assert near.minimum_over(q[None], (frozenset(),)).distance > 0.0


def test_a_flight_that_is_clear_already_stays_as_it_is(walked):
    """The first foot is lifted by 5 cm in the middle of a short step over nothing."""
    case, _, _ = walked
    path = KeyPath(case.time, case.q)
    same = with_mid_flights(case.body, case.scene, case.schedule, path)
    end = case.schedule.swing_interval(case.schedule.sequence.swings()[0])[1]
    np.testing.assert_array_equal(same.time[same.time <= end], path.time[path.time <= end])


@pytest.mark.long
def test_a_flight_without_a_posture_stays_as_it_is(walked):
    """A foot cannot be lifted into a slab that begins where it lands."""
    case, path, _ = walked
    low = Scene([Obstacle("slab", Box((9.0, 9.0, 0.1)), translation=(0.0, 0.0, 0.3))])
    same = with_mid_flights(case.body, low, case.schedule, path)
    np.testing.assert_array_equal(same.time, path.time)


@pytest.mark.long
@pytest.mark.parametrize("seed", [5002, 5003])
def test_the_way_to_a_posture_does_not_lead_through_a_rung(seed):
    """On a ladder shanks were before a rung in a posture and behind it in the next, 6 cm through."""
    context = RunContext.of(draw_scene(FAMILIES["ladders"], seed), None)
    body, scene = context.body, context.scene
    found = find_supports(context.scenario, body, scene, np.random.default_rng(0))
    assert found.plan is not None, found.failure
    resting = from_rest_to_rest(replace(context, plan=found.plan))
    assert resting is not None
    schedule = resting.plan.schedule(context.scenario.contact_model)
    path = KeyPath(*resting.plan.keys(schedule))
    lifted = with_mid_flights(body, scene, schedule, path, dense=True)
    assert len(lifted.time) > len(path.time)
    near = Proximity(body, scene)
    legs = frozenset(pair for pair in near.pairs if not pair[0].endswith(("/shank", "/thigh")))
    time = np.arange(schedule.instants[0], schedule.instants[-1], 0.02)
    before, after = (near.minimum_over(way.at(time), legs).distance for way in (path, lifted))
    assert after > min(before, 0.0) - 0.01  # instants between those that are watched
