"""Costs of a creature's moves: their number, and how long a contact can be kept."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.planning import contacts
from manikin.planning.contacts import LimbSettings
from manikin.scenarios.families import FAMILIES, draw_scene


@pytest.mark.long
@pytest.mark.parametrize("seed", [1621])
def test_a_quadruped_goes_with_fewer_contacts_where_they_last(monkeypatch, tmp_path, seed):
    """Over rubble; each change is of one contact, and the body gets as far."""
    scenario = draw_scene(FAMILIES["quadruped-rubble"], seed, tmp_path)
    body, scene = scenario.build_body(), scenario.build_scene()
    plans = []
    for settings in (LimbSettings(), replace(LimbSettings(), price=1.0, brief=0.0)):
        monkeypatch.setattr(contacts, "LimbSettings", lambda kept=settings: kept)
        plans.append(find_supports(scenario, body, scene, np.random.default_rng(0)).plan)
    assert plans[0].steps < plans[1].steps
    for plan in plans:
        held = [set(stage.contacts) for stage in plan.stages]
        assert all(len(a ^ b) == 1 for a, b in pairwise(held))
        assert np.linalg.norm(Configuration(body, plan.goal).com - plans[0].goal_com) < 0.1
