"""Costs of places of a creature's limbs: EFORT, and how long a contact can be kept."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from manikin.body import Configuration, limb_named, quadruped
from manikin.kinematics.limb_samples import sample_limb
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning import contacts
from manikin.planning.contacts import LimbHolds, LimbSettings
from manikin.scenarios.families import FAMILIES, draw_scene


def test_effort_is_inverse_to_the_force_that_a_limb_has_upwards():
    """1 for half of all places; over an upright stretched leg, which carries without torque, next to none."""
    body = quadruped()
    limb = body.limbs[0]
    samples = sample_limb(body, limb_named(body, limb.name), np.random.default_rng(0), 4000)
    turn = np.eye(3)
    holds = LimbHolds(np.zeros((0, 3)), None, None, samples, (turn, np.zeros(3)), np.zeros(3))
    at = samples.positions
    force = 1.0 / np.sqrt(samples.products[:, 2, 2])
    effort = holds.effort(at)
    assert np.mean(effort <= 1.0) == pytest.approx(0.5, abs=1e-3)
    some = effort < effort.max()
    assert effort[some] * force[some] == pytest.approx(np.median(force), rel=1e-9)
    assert effort[np.argmax(force)] < 0.5


@pytest.mark.parametrize("seed", [1621, 1623])
def test_a_quadruped_goes_with_fewer_contacts_where_they_last(monkeypatch, tmp_path, seed):
    """Over rubble; each change is of one contact, and the body gets as far."""
    scenario = draw_scene(FAMILIES["quadruped-rubble"], seed, tmp_path)
    body, scene = scenario.build_body(), scenario.build_scene()
    plans = []
    for settings in (LimbSettings(), replace(LimbSettings(), brief=0.0, effort=0.0)):
        monkeypatch.setattr(contacts, "LimbSettings", lambda kept=settings: kept)
        plans.append(find_supports(scenario, body, scene, np.random.default_rng(0)).plan)
    assert plans[0].steps < plans[1].steps
    for plan in plans:
        held = [set(stage.contacts) for stage in plan.stages]
        assert all(len(a ^ b) == 1 for a, b in pairwise(held))
        assert np.linalg.norm(Configuration(body, plan.goal).com - plans[0].goal_com) < 0.1
