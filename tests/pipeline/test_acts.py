"""Acts on objects, from the start alone to the force that is held in the physics engine."""

import numpy as np
import pytest

from manikin.errors import ScenarioError
from manikin.pipeline import runner
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.scenarios import load_scenario
from manikin.scenarios.found_supports import PLANNING, with_supports


@pytest.fixture(scope="module")
def rope():
    """Contacts found for pulling a rope, and the scene."""
    scenario = load_scenario("pull-rope")
    body, scene = scenario.build_body(), scenario.build_scene()
    return find_supports(scenario, body, scene, np.random.default_rng(0)), scene


def test_a_way_ends_with_both_hands_on_the_object(rope):
    found, scene = rope
    assert found.failure is None
    found.scenario.check_contacts(scene)
    last = found.plan.stages[-1]
    assert {"left_hand", "right_hand"} <= set(last.contacts)
    assert all(
        scene.touched_obstacles(last.contacts[hand]) == ("bar",) for hand in ("left_hand", "right_hand")
    )
    assert found.scenario.file.task.act.force_N == 200.0


def test_a_posture_that_a_later_stage_refuses_is_followed_by_the_next_best(rope):
    """The last change of contacts is of no way: the hands or feet that act are elsewhere in the next plan."""
    found, _ = rope
    again = found.again(len(found.plan.stages) - 1, "it fails")
    assert again.failure is None
    before, after = (plan.stages[-1].contacts for plan in (found.plan, again.plan))
    assert before.keys() == after.keys()
    assert not all(contact.same_place(after[name]) for name, contact in before.items())


@pytest.mark.long
def test_a_tall_person_gets_to_where_only_a_posture_that_leans_back_has_room():
    """None of the trunk's postures is free with a bar 0.1 m before the feet; that of the goal is known."""
    scenario = load_scenario("pull-rope", "wall").with_body(stature_m=1.88)
    found = find_supports(scenario, scenario.build_body(), scenario.build_scene(), np.random.default_rng(0))
    assert found.failure is None


def test_an_object_out_of_reach_ends_in_an_explained_failure():
    result = runner.run("push-cupboard", variant="out-of-reach")
    assert not result.succeeded
    assert result.summary["failure"]["stage"] == "contacts"
    assert "within reach" in result.summary["failure"]["reason"]


def test_another_seed_keeps_the_planner_s_options(rope):
    """A scenario that was changed has every default written out; its planning is still nobody's choice."""
    found, _ = rope
    scenario = load_scenario("pull-rope").with_seed(3)
    planning = with_supports(scenario, found.plan).file.planning
    assert planning.degree == PLANNING["degree"]
    assert planning.weights.smoothness == PLANNING["weights"]["smoothness"]


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("task.act.on=wardrobe", "task.act.on"),
        ("task.act.direction=[0, 0, 1]", "level"),
        ("task.act.force_N=-1", "task.act.force_N"),
        ("wholebody.method=refine", "follow"),
    ],
)
def test_an_act_that_makes_no_sense_is_refused(override, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("push-cupboard", None, [override])


@pytest.mark.long
@pytest.mark.slow
def test_the_force_is_held_in_the_physics_engine(runs):
    """200 N within 5 % for two seconds, without falling, sliding palms or an unplanned touch."""
    result = runs("push-cupboard")
    assert result.summary["failure"] is None
    act = result.summary["act"]
    assert act["mean_force_N"] == pytest.approx(200.0, rel=0.05)
    assert act["least_force_N"] >= 0.95 * 200.0
    assert act["palm_friction_share"] <= 1.0
    assert act["min_feet_margin"] > 0.0
    assert act["held_s"] >= 1.95
    assert act["max_torque_share"] <= 1.0
    assert act["equilibrium_residual"] < 1e-6
    assert result.summary["ergonomics"]["force_verdict"] == "to be avoided"  # of 200 N at most, EN 1005-3
    assert not result.summary["execution"]["fell"]
    # The run directory holds the scenario with its supports and the act, ready to run again.
    again = load_scenario(result.directory / "scenario.yaml")
    assert again.file.task.act.force_N == 200.0
    assert "left_hand" in again.build_sequence()[-1].stance
