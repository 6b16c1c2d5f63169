"""Contacts of hands, feet on holds and the legs of an insect, from start and goal alone."""

import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from manikin.body import Configuration
from manikin.contact import ContactKind, ContactModel
from manikin.errors import ScenarioError
from manikin.numerics.spatial import IDENTITY
from manikin.pipeline import runner
from manikin.pipeline.stages.contact_stage import find_supports
from manikin.pipeline.stages.context import plan_in_world
from manikin.scenarios import load_scenario
from manikin.scenarios.families import FAMILIES, draw_scene
from manikin.scene import Proximity, segment_of
from manikin.verification import check_contact_plan

DOG = Path(__file__).parents[1] / "body" / "data" / "dog.urdf"


def search(name, *overrides, seed=0):
    scenario = load_scenario(name, overrides=overrides)
    body, scene = scenario.build_body(), scenario.build_scene()
    return find_supports(scenario, body, scene, np.random.default_rng(seed)), body, scene


def checked(name, plan, *overrides):
    """The plan, measured by means that are not the planner's."""
    return check_contact_plan(load_scenario(name, overrides=overrides), plan_in_world(plan, IDENTITY))


SHORT = {
    "insect-books": ("task.start.at=[-0.25, 0.0]", "task.goal.at=[-0.05, 0.0]", "task.goal.height_m=0.05"),
    "climb@left": (),
}
"""Onto the first books; along a wall from where the climber already hangs on it. Up it: the sweep."""


@pytest.fixture(scope="module", params=["insect-books", pytest.param("climb@left", marks=pytest.mark.long)])
def found(request):
    return search(request.param, *SHORT[request.param])


def test_every_posture_is_free_balanced_and_on_its_contacts(found, request):
    """Measured afresh, balance by a linear program on contact forces; one contact changes at a time."""
    result, name = found[0], request.node.callspec.params["found"]
    assert result.failure is None
    check = checked(name, result.plan, *SHORT[name])
    assert check.verdict == "certified"
    value = check.requirements.value
    assert value("max_contact_error_m") < 3e-4
    assert value("min_clearance_m") > 0.0002  # shanks and forearms beside what they stand on or hold
    assert check.room > 0.01
    assert value("max_torque_share") < 1.0


def test_the_root_gets_to_its_goal(found):
    """To a few centimetres where it can stand anywhere, to half a row of holds on a wall."""
    result, body, _ = found
    goal = {"hold": [0.12, 0.3 if len(result.plan.stages[0].contacts) == 4 else 0.0], "book": [-0.05, 0.0]}
    at = goal["book" if body.stature is None else "hold"]
    assert np.linalg.norm(result.plan.goal[:2] - at) <= (0.03 if body.stature is None else 0.2)


@pytest.mark.parametrize("found", [pytest.param("climb@left", marks=pytest.mark.long)], indirect=True)
def test_a_climber_who_begins_on_the_wall_holds_on_with_hands_and_feet(found):
    """Near where the scenario says, which leaves a posture the room of half a row of holds."""
    result, _, scene = found
    first = result.plan.stages[0]
    assert not any("floor" in scene.touched_obstacles(contact) for contact in first.contacts.values())
    assert set(first.contacts) == {"left_hand", "right_hand", "left_foot", "right_foot"}
    np.testing.assert_allclose(first.q[:2], [0.12, -0.3], atol=0.2)


def test_contacts_lie_on_surfaces_and_hands_on_holds(found):
    result, _, scene = found
    for stage in result.plan.stages:
        for contact in stage.contacts.values():
            if contact.kind is ContactKind.GRASP:
                assert all(name.startswith("hold") for name in scene.touched_obstacles(contact))
            else:
                scene.supporting_surface(contact, 1e-6)


def test_a_flight_passes_a_posture_off_its_contacts(found):
    result, _, _ = found
    for before, after in pairwise(result.plan.stages):
        left = set(before.contacts) - set(after.contacts)
        assert (after.via is not None) == bool(left)
    schedule = result.plan.schedule(ContactModel(normal_force_cap=1000.0))
    times, keys = result.plan.keys(schedule)
    flights = sum(stage.via is not None for stage in result.plan.stages)
    assert len(keys) == len(times) == len(result.plan.stages) + 1 + flights
    assert np.all(np.diff(times) > 0.0)


@pytest.mark.long
@pytest.mark.parametrize("found", ["insect-books"], indirect=True)
def test_the_same_seed_has_the_same_contacts(found):
    again, _, _ = search("insect-books", *SHORT["insect-books"])
    np.testing.assert_array_equal(again.plan.postures, found[0].plan.postures)


@pytest.mark.parametrize(
    ("name", "where", "reason"),
    [
        ("climb-wall@bare", "contacts", "has a place within reach of it"),
        ("insect-books@gap", "contacts", "a gap is wider"),
    ],
)
def test_what_no_limb_can_reach_is_explained(name, where, reason):
    result, _, _ = search(name)
    assert result.plan is None
    assert result.where == where
    assert reason in result.failure


def test_a_creature_from_a_robot_description_walks_up_a_step(tmp_path):
    """Four point feet, three of which carry it while the fourth is in the air."""
    shutil.copy(DOG, tmp_path)
    trimesh.creation.capsule(height=140.0, radius=15.0).export(tmp_path / "shank.stl")
    names = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
    content = {
        "name": "dog",
        "body": {
            "urdf": "dog.urdf",
            "limbs": {name: {"tip": f"{name}_foot", "position": [0.02, 0.0, 0.0]} for name in names},
            "standing_deg": {
                f"{name}_{joint}": angle
                for name in names
                for joint, angle in (("pitch", 34.4), ("knee", 68.8))
            },
        },
        "scene": [{"name": "step", "box": [0.5, 1.2, 0.04], "position": [0.6, 0.0, 0.02]}],
        "wholebody": {"method": "refine"},
        "task": {"start": {"at": [0.0, 0.0]}, "goal": {"at": [0.6, 0.0], "height_m": 0.04}},
    }
    path = tmp_path / "dog.yaml"
    path.write_text(yaml.safe_dump(content))
    result, _, _ = search(path)
    assert result.failure is None
    check = checked(path, result.plan)
    # Its tips are inside the shapes of its shanks, so that these sink into what they stand on.
    assert set(check.requirements.broken) <= {"min_touching_clearance_m"}
    assert check.room > 0.005
    last = result.plan.stages[-1].contacts.values()
    assert sum(contact.position[2] == pytest.approx(0.04) for contact in last) >= 2


@pytest.mark.long
def test_a_quadruped_goes_up_a_stair(tmp_path):
    """A riser of 0.15 m, under half a leg; the goal's height is that of the ground there."""
    content = {
        "name": "stair",
        "body": {"model": "quadruped"},
        "scene": [{"name": "step", "box": [1.8, 1.6, 0.15], "position": [1.5, 0.0, 0.075]}],
        "wholebody": {"method": "refine"},
        "task": {"start": {"at": [0.0, 0.0]}, "goal": {"at": [1.1, 0.0]}},
    }
    path = tmp_path / "stair.yaml"
    path.write_text(yaml.safe_dump(content))
    result, _, _ = search(path)
    assert result.failure is None
    check = checked(path, result.plan)  # of shanks from the step below their tips, too
    assert check.verdict == "certified"
    assert check.room > 0.0
    for contact in result.plan.stages[-1].contacts.values():
        assert contact.position[2] == pytest.approx(0.15)


def test_contacts_of_any_limbs_need_the_refinement():
    scenario = load_scenario("climb-wall", overrides=["wholebody.method=follow"])
    with pytest.raises(ScenarioError, match=r"wholebody\.method is follow; valid: refine"):
        runner.run(scenario)


@pytest.mark.long
def test_a_person_on_a_ladder_stays_upright(tmp_path):
    """Down from the fourth rung: trunk and pelvis are never tilted by more than 35 degrees."""
    scenario = draw_scene(FAMILIES["ladders"], 1300, tmp_path)
    body, scene = scenario.build_body(), scenario.build_scene()
    plan = find_supports(scenario, body, scene, np.random.default_rng(0)).plan
    assert plan is not None
    for stage in plan.stages:
        state = Configuration(body, stage.q)
        upright = [state.segment_placement(name)[0][2, 2] for name in ("pelvis", "thorax")]
        assert min(upright) > np.cos(np.deg2rad(35.0))


def test_a_free_hand_comes_to_its_rung_from_outside(tmp_path):
    """From the ground: half way to its first hold a hand is outside all that it could hold on to."""
    scenario = draw_scene(FAMILIES["ladders"], 1304, tmp_path)
    body, scene = scenario.build_body(), scenario.build_scene()
    plan = find_supports(scenario, body, scene, np.random.default_rng(0)).plan
    assert plan is not None
    for contact in (contact for stage in plan.stages for contact in stage.contacts.values()):
        assert contact.kind is not ContactKind.GRASP or scene.touched_obstacles(contact)
    proximity, reached = Proximity(body, scene), 0
    for before, after in pairwise(plan.stages):
        for name in set(after.contacts) - set(before.contacts):
            hand, is_free = body.effector(name).segment, "hand" in name and before.via is not None
            held = [hand_ for hand_ in before.contacts if body.effector(hand_).segment == hand]
            if not is_free or held:
                continue
            near = proximity.evaluate(before.via, 0.05)
            pairs = zip(near.distance, near.pairs, strict=True)
            mine = [distance for distance, (shape, _) in pairs if segment_of(shape) == hand]
            assert min(mine, default=1.0) > 0.0
            reached += 1
    assert reached >= 2
