"""The independent check passes valid contact plans and refuses broken ones with the true cause."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manikin.numerics.spatial import rotation_from_rpy
from manikin.verification import check_contact_plan, load_contact_plan

DATA = Path(__file__).parent / "data"
PLANS = ("stairs", "stand-up-chair")


@pytest.fixture(scope="module", params=PLANS)
def planned(request):
    return load_contact_plan(DATA / f"{request.param}.json")


def with_contact(plan, old, new):
    """The plan with one contact replaced wherever it is held, postures left as they are."""
    stages = [
        replace(
            stage, contacts={name: new if c is old else c for name, c in stage.contacts.items()}
        )
        for stage in plan.stages
    ]  # fmt: skip
    return replace(plan, stages=tuple(stages))


def test_plans_of_our_planner_are_certified(planned):
    """Plans that were certified by the planner's own means keep every requirement of the check."""
    result = check_contact_plan(*planned)
    assert result.held
    assert result.complete
    assert result.verdict == "certified"
    assert result.requirements.value("max_contact_error_m") < 1e-5


def test_a_contact_above_the_surface_is_refused(planned):
    """A contact 2 cm above the floor is 2 cm from every surface."""
    scenario, plan = planned
    contact = plan.stages[-1].contacts["left_foot"]
    raised = replace(contact, position=contact.position + np.array([0.0, 0.0, 0.02]))
    result = check_contact_plan(scenario, with_contact(plan, contact, raised))
    assert result.requirements.first_broken.key == "max_contact_distance_m"
    assert result.requirements.value("max_contact_distance_m") == pytest.approx(0.02, abs=1e-6)


def test_a_tilted_contact_is_refused(planned):
    """A contact that is tilted by five degrees is at that angle to its surface."""
    scenario, plan = planned
    contact = plan.stages[-1].contacts["left_foot"]
    turn = rotation_from_rpy(np.deg2rad(5.0), 0.0, 0.0)
    tilted = replace(contact, rotation_contact_to_world=turn @ contact.rotation_contact_to_world)
    result = check_contact_plan(scenario, with_contact(plan, contact, tilted))
    assert result.requirements.first_broken.key == "max_contact_angle_deg"
    assert result.requirements.value("max_contact_angle_deg") == pytest.approx(5.0, abs=1e-3)
