"""The independent check passes valid contact plans and refuses broken ones with the true cause."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manikin.body import Configuration
from manikin.body.limbs import toe_hinge
from manikin.contact import point, sole
from manikin.errors import ContactError, ScenarioError
from manikin.kinematics import Placement, PostureProblem, generate_posture
from manikin.numerics.spatial import rotation_from_rpy
from manikin.scene.obstacle import Box, Cylinder, Obstacle
from manikin.verification import check_contact_plan, load_contact_plan, parse_contact_plan
from manikin.verification.equilibrium import CentreState, HandForce, dynamic_shortfall, rest
from manikin.verification.solids import Solid
from manikin.verification.touching import ContactRows, Rules

DATA = Path(__file__).parent / "data"


# --- ways to break a plan: each takes a scenario and a plan and returns both ------------------------------


def with_contact(plan, old, new):
    """The plan with one contact replaced wherever it is held, postures left as they are."""
    return replace(plan, stages=tuple(
        replace(stage, contacts={n: new if c is old else c for n, c in stage.contacts.items()})
        for stage in plan.stages
    ))  # fmt: skip


def without_postures(plan):
    """Contacts and centres of mass alone."""
    return replace(
        plan, goal=None, stages=tuple(replace(stage, posture=None, via=None) for stage in plan.stages)
    )


def with_obstacle(scenario, **entry):
    return scenario.replaced(scene=[*scenario._data()["scene"], {"name": "added", **entry}])


def first_foot(plan):
    return plan.stages[0].contacts["left_foot"]


def last_foot(plan):
    return plan.stages[-1].contacts["left_foot"]


def shifted(contact, x=0.0, y=0.0, z=0.0):
    return replace(contact, position=contact.position + np.array([x, y, z]))


def raised(scenario, plan):
    return scenario, with_contact(plan, last_foot(plan), shifted(last_foot(plan), z=0.02))


def tilted(scenario, plan):
    contact = last_foot(plan)
    turn = rotation_from_rpy(np.deg2rad(5.0), 0.0, 0.0)
    turned = replace(contact, rotation_contact_to_world=turn @ contact.rotation_contact_to_world)
    return scenario, with_contact(plan, contact, turned)


def beside(scenario, plan):
    """3 m beside what it lies on, in the air where that is raised."""
    return scenario, with_contact(plan, last_foot(plan), shifted(last_foot(plan), y=3.0, z=0.1))


def buried(scenario, plan):
    x, y, z = last_foot(plan).position
    return with_obstacle(scenario, box=[0.6, 0.6, 0.3], position=[x, y, z + 0.1]), plan


def far(scenario, plan):
    return scenario, without_postures(with_contact(plan, first_foot(plan), shifted(first_foot(plan), x=-3.0)))


def falling(scenario, plan):
    bare = without_postures(plan)
    goal_com = bare.goal_com + np.array([0.0, 0.4, 0.0])
    return scenario, replace(bare, goal_com=goal_com)


def swapped(scenario, plan):
    """Left and right foot exchanged, as legs would be that cross."""
    contacts = dict(plan.stages[0].contacts)
    left, right = contacts["left_foot"], contacts["right_foot"]
    crossed = with_contact(plan, left, replace(left, position=right.position))
    return scenario, with_contact(crossed, right, replace(right, position=left.position))


def walled(scenario, plan):
    """A thin wall, open below 0.8 m, that goes through the body at the start, one foot on its either side."""
    x, y, _ = np.mean([c.position for n, c in plan.stages[0].contacts.items() if "foot" in n], axis=0)
    turn = float(np.rad2deg(plan.stages[0].contacts["left_foot"].yaw))
    entry = {"box": [3.0, 0.02, 2.2], "position": [float(x), float(y), 1.9], "rpy_deg": [0.0, 0.0, turn]}
    return with_obstacle(scenario, **entry), plan


def sticky(scenario, plan):
    return scenario, with_contact(plan, last_foot(plan), replace(last_foot(plan), friction=1.5))


def elsewhere(scenario, plan):
    data = scenario._data()
    x, y = data["task"]["goal"]["at"]
    goal = {**data["task"]["goal"], "at": [x + 1.0, y]}
    return scenario.replaced(task={**data["task"], "goal": goal}), plan


def hurried(scenario, plan):
    """The start and the goal alone, with everything between changed at once."""
    feet = {name: c for name, c in plan.stages[-1].contacts.items() if name == "left_foot"}
    return scenario, replace(plan, stages=(plan.stages[0], replace(plan.stages[-1], contacts=feet)))


def struck(scenario, plan):
    state = Configuration(scenario.build_body(), plan.goal)
    head = state.point("head", [0.0, 0.0, 0.1])
    return with_obstacle(scenario, sphere={"radius_m": 0.1}, position=head.tolist()), plan


def overstretched(scenario, plan):
    body, goal = scenario.build_body(), np.array(plan.goal)
    slot = body.joint_index("left_elbow_flexion")
    goal[7 + slot] = body.upper[slot] + np.deg2rad(5.0)
    return scenario, replace(plan, goal=goal, goal_com=None)


def tiptoe(scenario, plan):
    points = np.array(last_foot(plan).points)
    points[points[:, 0] < 0.0, 0] = 0.06
    return scenario, with_contact(plan, last_foot(plan), replace(last_foot(plan), points=points))


def overgrown(scenario, plan):
    grown = replace(first_foot(plan), points=1.3 * first_foot(plan).points)
    return scenario, with_contact(plan, first_foot(plan), grown)


def pretended(scenario, plan):
    return scenario, replace(plan, goal_com=plan.goal_com + np.array([0.1, 0.0, 0.0]))


BREAKS = {
    raised: "max_contact_distance_m", tilted: "max_contact_angle_deg", beside: "max_contact_distance_m",
    buried: "max_hidden_depth_m", far: "max_reach_share", falling: "max_balance_shift_m",
    swapped: "max_contact_error_m", walled: "min_clearance_m", sticky: "max_friction",
    elsewhere: "goal_distance_m", hurried: "max_changes", struck: "min_clearance_m",
    overstretched: "max_range_violation_deg", tiptoe: "min_sole_share", overgrown: "max_beyond_sole_m",
    pretended: "max_com_difference_m",
}  # fmt: skip
"""Key of the requirement that says why each is refused; the first that does not hold."""

MEASURED = {raised: 0.02, tilted: 5.0, sticky: 1.5, overstretched: 5.0, tiptoe: 0.08 / 0.28, pretended: 0.1}
"""What it measures, in its unit."""


# --- the tests ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=("stairs", "stand-up-chair"))
def planned(request):
    return load_contact_plan(DATA / f"{request.param}.json")


@pytest.fixture(scope="module")
def rising():
    return load_contact_plan(DATA / "stand-up-chair.json")


def test_plans_of_our_planner_are_certified(planned):
    """Plans that were certified by the planner's own means keep every requirement of the check."""
    result = check_contact_plan(*planned)
    assert result.verdict == "certified"
    assert result.requirements.value("max_contact_error_m") < 1e-5


@pytest.mark.parametrize("spoil", BREAKS, ids=lambda spoil: spoil.__name__)
def test_a_broken_plan_is_refused_with_the_true_cause(rising, spoil):
    """Each way of breaking a plan breaks first the requirement that is its cause."""
    broken = check_contact_plan(*spoil(*rising)).requirements.first_broken
    assert broken is not None
    assert broken.key == BREAKS[spoil]
    assert broken.measured == pytest.approx(MEASURED.get(spoil, broken.measured), abs=1e-6)


def test_a_foot_may_leave_from_its_toes():
    """The left heel is up by 0.3 rad: held where the plan says so and the toes lie flat."""
    scenario, plan = load_contact_plan(DATA / "stairs.json")
    body, stages = scenario.build_body(), list(plan.stages)
    number = next(k for k, s in enumerate(stages) if set(s.contacts) == {"right_foot"})
    stage, foot = stages[number], stages[number - 1].contacts["left_foot"]
    hinge, flat = toe_hinge(body, "left_foot"), foot.rotation_contact_to_world
    turned = flat @ rotation_from_rpy(0.0, 0.3, 0.0)
    place = Placement(foot.position + flat @ hinge - turned @ hinge, turned)
    com = Configuration(body, stage.posture).com
    standing = tuple(stage.contacts.values())
    found = generate_posture(PostureProblem(body, standing, {"left_foot": place}, com=com), stage.posture)
    assert found.succeeded
    verdicts = {}
    for names, angle in (((), 0.3), (("left_foot",), 0.3), (("left_foot",), 0.32)):
        q = found.q.copy()
        q[7 + body.joint_names.index("left_toe_extension")] = angle
        stages[number] = replace(stage, posture=q, com=None, on_toes=frozenset(names))
        tilted_plan = replace(plan, stages=tuple(stages))
        content = tilted_plan.to_dict(body, scenario)
        assert content["stages"][number].get("on_toes", []) == list(names)
        again = parse_contact_plan(content, "a plan", scenario)[1]
        assert again.stages[number].on_toes == frozenset(names)
        broken = check_contact_plan(scenario, tilted_plan).requirements.first_broken
        verdicts[names, angle] = broken and (broken.key, broken.measured)
    key, missed = verdicts[(), 0.3]
    assert key == "max_contact_error_m"
    # The middle of the sole is on a circle about the hinge.
    assert missed == pytest.approx(2.0 * np.sin(0.15) * np.linalg.norm(hinge[[0, 2]]), abs=1e-4)
    assert verdicts[("left_foot",), 0.3] is None
    key, missed = verdicts[("left_foot",), 0.32]
    assert key == "max_contact_error_m"
    assert missed == pytest.approx(0.02 * (0.5 * foot.length - hinge[0]), rel=0.1)


def test_feet_on_their_toes_leave_or_land():
    """A plan file may name a foot as it leaves and as it lands, but not one that stays."""
    scenario, plan = load_contact_plan(DATA / "stairs.json")
    content, last = plan.to_dict(scenario.build_body(), scenario), {"left_foot", "right_foot"}
    for stage in content["stages"]:
        changed = sorted(last ^ set(stage["contacts"]))
        last = set(stage["contacts"])
        stage["on_toes"] = changed
    again = parse_contact_plan(content, "a plan", scenario)[1]
    assert [sorted(stage.on_toes) for stage in again.stages] == [s["on_toes"] for s in content["stages"]]
    assert max(len(stage.on_toes) for stage in again.stages) == 1
    staying = (set(content["stages"][0]["contacts"]) & set(content["stages"][1]["contacts"])).pop()
    content["stages"][1]["on_toes"] = [staying]
    with pytest.raises(ScenarioError, match=f"on_toes names '{staying}'; valid: feet that leave or land"):
        parse_contact_plan(content, "a plan", scenario)


def test_numbers_that_are_none_are_refused(rising):
    """A plan made in memory is held to finite numbers as a file is."""
    contact = last_foot(rising[1])
    broken = replace(contact, position=np.array([np.nan, 0.0, 0.0]))
    with pytest.raises(ContactError, match=r"contacts.left_foot is \[nan, 0.0, 0.0\]; valid: finite"):
        with_contact(rising[1], contact, broken)


def test_a_file_read_back_is_the_same_plan(rising):
    """Contacts, postures and the scenario inside a file come back."""
    scenario, plan = rising
    content = json.loads(json.dumps(plan.to_dict(scenario.build_body(), scenario)))
    other, again = parse_contact_plan(content, "again.json")
    assert other.file.task == scenario.file.task
    assert np.allclose(again.goal, plan.goal, rtol=0.0, atol=1e-12)
    for first, second in zip(plan.stages, again.stages, strict=True):
        assert np.allclose(first.posture, second.posture, rtol=0.0, atol=1e-12)
        assert all(c.same_place(second.contacts[name]) for name, c in first.contacts.items())


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("stages", 0, "com"), [0.0, float("nan"), 1.0], "stages[0].com[1] is nan; valid: a finite number"),
        (("stages", 0, "contacts", "left_foot"), "same", "the stage before has no such contact"),
        (("stages", 0, "contacts", "tail"), {"position": [0, 0, 0]}, "is no effector of the body; valid: "),
        (("format",), "another", "format is 'another'; valid: 'manikin-contact-plan-1'"),
        (("stages", 1, "posture", "angles_rad"), {"tail": 0.1}, "angles_rad.tail is no hinge of the body"),
        (("stages", 1, "posture", "quaternion_xyzw"), [0, 0, 0, 0], "valid: four numbers of length 1"),
        (("stages", 1, "dynamic"), True, None),
        (("scenario",), "no-such-scene", "no-such-scene"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_one_line(path, value, said):
    """The message names the file, the key, what was wrong and what is valid."""
    content = json.loads((DATA / "stand-up-chair.json").read_text())
    place = content
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    if said is None:
        del place["duration_s"]
        said = "stages[1].duration_s is missing; valid: a number > 0"
    with pytest.raises(ScenarioError) as refused:
        parse_contact_plan(content, "plan.json")
    message = str(refused.value)
    assert message.startswith("plan.json") or path == ("scenario",)
    assert said in message
    assert "\n" not in message


def example():
    """Plan of the documentation: one step, without postures."""
    page = (Path(__file__).parents[2] / "docs" / "contact-plan.md").read_text()
    (text,) = re.findall(r"<!-- example: contact plan -->\n```json\n(.*?)```", page, re.DOTALL)
    return json.loads(text)


def test_the_example_of_the_documentation_is_certified_as_far_as_contacts_go():
    """A step by hand, without postures."""
    result = check_contact_plan(*parse_contact_plan(example(), "example.json"))
    assert result.verdict.startswith("certified without postures")


def test_feet_that_no_posture_reaches_are_refused():
    """Feet 1.5 m apart are nearer than the legs are long, and yet no joint goes so far with flat soles."""
    content = example()
    content["stages"][2]["contacts"]["left_foot"]["position"][0] = 1.54
    content["scenario"]["task"]["goal"]["at"] = [0.79, 0.0]
    content["goal"]["com"][0] = 0.79
    broken = check_contact_plan(*parse_contact_plan(content, "split.json")).requirements.first_broken
    assert broken.key == "max_reach_gap_m"
    assert "stages[2]" in broken.where


def test_a_sole_may_bridge_a_gap_that_leaves_enough_of_it(rising):
    """On two slabs 4 cm apart six sevenths of a sole touch; 14 cm apart half of it."""
    foot = sole("left_foot", [0.0, 0.0, 0.0], length=0.28, width=0.12, friction=0.7)
    for gap, held in ((0.04, True), (0.14, False)):
        away = 0.15 + 0.5 * gap
        slabs = [
            Solid(Obstacle(name, Box([0.3, 0.3, 0.02]), translation=[x, 0.0, -0.01]))
            for name, x in (("front", away), ("rear", -away))
        ]  # fmt: skip
        rows = ContactRows(rising[0].build_body(), slabs, Rules(0.7, 400.0))
        rows.measure({"left_foot": foot}, "stages[0]")
        found = {row.key: row for row in rows.rows if row is not None}
        assert found["max_contact_distance_m"].held
        assert found["min_sole_share"].held == held


@pytest.mark.parametrize("shape", [Cylinder(0.016, 0.4), Box([0.08, 0.025, 0.4])])
@pytest.mark.parametrize(("x", "side", "broken"), [
    (0.02, 0.06, set()), (0.02, 0.03, {"min_rung_share"}), (0.11, 0.06, {"min_sole_share"}),
])  # fmt: skip
def test_a_climber_stands_on_a_rung_by_the_middle_of_the_sole(rising, shape, x, side, broken):
    """With most of its width, and neither by heel nor toes; who walks does not stand on a rung at all."""
    lying = rotation_from_rpy(-0.5 * np.pi, 0.0, 0.0)
    half, top = (0.006, 0.016) if isinstance(shape, Cylinder) else (0.04, 0.0125)
    half = min(half, 0.14 - x)
    rung = Solid(Obstacle("rung", shape, lying, [x, 0.0, -top]))
    part = [[x + half, side], [x - half, side], [x - half, -side], [x + half, -side]]
    foot = sole("left_foot", [0.0, 0.0, 0.0], length=0.28, width=0.12, polygon=part, friction=0.7)
    for rungs, wanted in ((True, broken), (False, {"min_sole_share"})):
        rows = ContactRows(rising[0].build_body(), [rung], Rules(0.7, 400.0, rungs=rungs))
        rows.measure({"left_foot": foot}, "stages[0]")
        assert {row.key for row in rows.rows if row is not None and not row.held} == wanted


# --- balance ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("friction", "held"), [(0.355, False), (0.375, True)])
def test_a_slope_is_held_by_friction_above_its_tangent(friction, held):
    """Two soles on 20 degrees, straight down the slope: tan 20 = 0.364; the pyramid has edges there."""
    slope = rotation_from_rpy(0.0, np.deg2rad(20.0), 0.0)
    feet = [
        sole(name, [0.0, y, 0.0], length=0.28, width=0.12, friction=friction, rotation=slope)
        for name, y in (("left_foot", 0.1), ("right_foot", -0.1))
    ]  # fmt: skip
    result = rest(feet, 70.0, None, np.array([0.0, 0.0, 0.9]))
    assert (result.shift == 0.0) == held
    assert held == (result.place is not None)


def test_room_on_one_flat_sole_is_half_its_width():
    """At rest on level ground the centre of mass is over the sole: 6 cm from the sides of 12 cm."""
    foot = [sole("left_foot", [0.3, 0.2, 0.1], 0.7, length=0.28, width=0.12, friction=0.5)]
    assert rest(foot, 70.0, None, np.array([0.3, 0.2, 1.0])).room == pytest.approx(0.06, abs=1e-3)
    over = np.array([0.3, 0.2, 1.0]) + 0.1 * np.array([-np.sin(0.7), np.cos(0.7), 0.0])
    assert rest(foot, 70.0, None, over).shift == pytest.approx(0.04, abs=1e-3)


def test_a_push_moves_the_place_of_rest():
    """200 N at 1.2 m tip backwards by 240 N.m, 0.35 m of the weight; the sole ends 0.14 m behind."""
    feet = [
        sole(name, [0.0, y, 0.0], length=0.28, width=0.12, friction=0.7)
        for name, y in (("left_foot", 0.1), ("right_foot", -0.1))
    ]  # fmt: skip
    hands = [point(f"{side}_hand", [0.6, y, 1.2], friction=1e-3, normal=[-1.0, 0.0, 0.0])
             for side, y in (("left", 0.2), ("right", -0.2))]  # fmt: skip
    push = HandForce(np.array([1.0, 0.0, 0.0]), 200.0)
    com = np.array([0.0, 0.0, 1.0])
    needed = 200.0 * 1.2 / (70.0 * 9.81) - 0.14
    assert rest([*feet, *hands], 70.0, None, com).shift == 0.0
    assert rest([*feet, *hands], 70.0, None, com, act=push).shift == pytest.approx(needed, abs=1e-3)


def test_a_dynamic_stage_needs_the_accelerations_that_friction_allows():
    """From rest to rest over 0.3 m in 1 s: 1.2 m/s^2 are more than 0.05 g and less than 0.7 g.

    A linear inverted pendulum of 0.9 m moves its ZMP by 0.11 m for them: a long sole allows it.
    """
    start, end = (CentreState(np.array([x, 0.0, 0.9]), np.zeros(3)) for x in (-0.15, 0.15))

    def lacking(friction, duration):
        ground = [sole("left_foot", [0.0, 0.0, 0.0], length=0.9, width=0.3, friction=friction)]
        return dynamic_shortfall(ground, 70.0, None, start, end, duration)

    assert lacking(0.7, 1.0) < 1e-6
    assert lacking(0.05, 1.0) > 0.02
    assert lacking(0.7, 0.3) > 0.02
