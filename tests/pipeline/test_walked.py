"""Walks from footprints to the executed motion."""

import numpy as np
import pytest

from manikin.pipeline.runner import run
from manikin.scenarios import load_scenario
from manikin.scenarios.planned import walking_supports
from manikin.walking import walking_path
from manikin.walking.stepper import place_footprints


def check(result):
    """Every stage kept its requirements, on its own certificate (metres, newton metres)."""
    summary = result.summary
    assert summary["succeeded"], summary["failure"]
    com, body, executed = summary["centroidal"], summary["wholebody"], summary["execution"]
    assert com["min_margin"] >= 10.8
    assert body["min_margin"] > 0.0
    assert body["max_support_error_m"] <= 1e-3
    assert body["max_com_error_m"] <= 2e-3
    assert body["min_clearance_m"] >= 0.01
    assert body["max_joint_limit_violation_rad"] <= 1e-9
    assert body["max_torque_share"] <= 1.0
    assert body["max_velocity_share"] <= 1.0
    assert not executed["fell"]
    assert executed["com_max_error_m"] <= 0.01
    assert executed["max_foot_error_m"] <= 0.01
    assert executed["min_margin"] > 0.0


@pytest.mark.long
@pytest.mark.slow
def test_a_walk_around_is_executed():
    goal = (1.0, 1.0, np.pi / 2)
    path = walking_path((0, 0, 0), goal, max_speed=0.6)
    scenario = walking_supports(place_footprints(path), load_scenario("walk"))
    result = run(scenario)
    check(result)
    assert np.allclose(result.executed.com[-1, :2], goal[:2], atol=0.01)
