"""``contacts.ranges: learnt``: the search keeps hips and shoulders to their learnt volumes."""

import numpy as np
import pytest

from manikin.body import human, limb_named
from manikin.body.natural_range import learnt_joints
from manikin.errors import ScenarioError
from manikin.kinematics import reach_volume
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.scenarios import load_scenario

SLACK = 2e-4
"""Tolerance of the postures' requirements [rad]."""


def learnt_distance(body, q):
    """(n,) distance of the worst hip or shoulder to the surface of its volume, negative outside [rad]."""
    angles = np.asarray(q)[:, 7:]
    return np.min([j.range.volume.distance(angles[:, j.hinges]) for j in learnt_joints(body)], axis=0)


def found_with(ranges, name):
    scenario = load_scenario(name, overrides=[f"contacts.ranges={ranges}"])
    body = scenario.build_body()
    search = find_supports(scenario, body, scenario.build_scene(), np.random.default_rng(scenario.seed))
    assert search.plan is not None, search.failure
    postures = [stage.q for stage in search.plan.stages]
    postures += [stage.via for stage in search.plan.stages if stage.via is not None]
    return search, learnt_distance(body, np.array([*postures, search.plan.goal]))


def test_steps_over_a_threshold_stay_within_the_learnt_ranges_where_that_is_asked_for():
    """Without, the step takes a hip or shoulder out of what was recorded."""
    _, freely = found_with("limits", "platform@found")
    assert freely.min() < -np.deg2rad(1.0)
    _, kept = found_with("learnt", "platform@found")
    assert kept.min() >= -SLACK


def test_a_learnt_reach_lies_within_that_of_the_hinges():
    """The hull of 4.3.4 with the volumes of 4.3.3 is smaller, and inside but for sampling."""
    body = human()
    limb = limb_named(body, "left_arm")
    whole = reach_volume(body, limb, np.random.default_rng(0), 4000)
    learnt = reach_volume(body, limb, np.random.default_rng(0), 4000, natural=True)
    assert whole.residual(learnt.vertices).min() > -0.03
    assert learnt.residual(whole.vertices).min() < -0.1


def test_ranges_that_are_not_known_are_refused():
    with pytest.raises(ScenarioError, match=r"contacts\.ranges"):
        load_scenario("crouch", overrides=["contacts.ranges=wide"])
