"""Contacts on a ladder: where a climber's centre of mass is, and how long it has."""

from itertools import pairwise

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.pipeline.stages import RunContext
from manikin.pipeline.stages.contact_stage import HOLDING_ACCELERATION, find_supports
from manikin.scenarios.families import FAMILIES, draw_scene


@pytest.fixture(scope="module")
def plan():
    """Down from the second rung of a ladder of round rungs."""
    scenario = draw_scene(FAMILIES["ladders"], 1310)
    context = RunContext.of(scenario, None)
    found = find_supports(context.scenario, context.body, context.scene, np.random.default_rng(0))
    assert found.plan is not None, found.failure
    return context.body, found.plan


def test_a_climber_does_not_swing_back_to_move_a_hand(plan):
    """Its centre of mass stays within 5 cm of the way between those at both ends of the flight."""
    body, found = plan
    flights = 0
    for stage, after in pairwise(found.stages):
        moved = set(after.contacts) - set(stage.contacts)
        if stage.via is None or not any("hand" in name for name in moved):
            continue
        flights += 1
        way, via = after.com - stage.com, Configuration(body, stage.via).com - stage.com
        share = np.clip(via @ way / max(way @ way, 1e-9), 0.0, 1.0)
        assert np.linalg.norm(via - share * way) < 0.05
    assert flights > 0


def test_changes_take_the_time_of_a_gentle_motion(plan):
    """``T^2 >= 10 d / (sqrt(3) a)`` for the smoothest motion over ``d`` from rest to rest."""
    _, found = plan
    com = np.array([*(stage.com for stage in found.stages), found.goal_com])
    ways = np.linalg.norm(np.diff(com, axis=0), axis=1)
    for stage, way in zip(found.stages, ways, strict=True):
        assert 10.0 / np.sqrt(3.0) * way / stage.min_duration**2 <= HOLDING_ACCELERATION + 1e-9
