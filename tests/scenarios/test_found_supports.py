"""Supports of found contacts: where the body rests, where it walks, and how long phases last."""

import itertools
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from manikin.contact import SolePart
from manikin.errors import ScenarioError
from manikin.pipeline.stages import Report, RunContext, contact_stage, whole_body_stage
from manikin.pipeline.stages.contact_stage import find_supports, plan_contacts, slower
from manikin.pipeline.stages.context import Passing
from manikin.planning.com import Failure, plan_com
from manikin.planning.contacts import rising_times
from manikin.scenarios import found_supports, load_scenario
from manikin.scenarios.found_supports import Pace, without_rests

BLOCK = """
- {name: block, box: [3.0, 2.0, HEIGHT], position: [1.8, 0.0, MIDDLE]}
"""


@pytest.fixture(scope="module")
def way(tmp_path_factory):
    """Scenario of a way to a place [m], onto a block of a height [m] or with a scene, and its contacts."""

    @cache
    def found(height, *, goal=0.8, scene=""):
        ends = f"start: {{at: [0.0, 0.0], heading_deg: 0.0}}, goal: {{at: [{goal}, 0.0], heading_deg: 0.0}}"
        text = f"name: way\ntask: {{{ends}}}\n" + (f"scene: {scene}" if scene else "")
        if height:
            text += "scene:" + BLOCK.replace("HEIGHT", str(height)).replace("MIDDLE", str(0.5 * height))
        file = tmp_path_factory.mktemp("way") / "way.yaml"
        file.write_text(text)
        scenario = load_scenario(file)
        context = RunContext.of(scenario)
        result = find_supports(scenario, context.body, context.scene, np.random.default_rng(0))
        assert result.failure is None
        return context, result

    return found


def test_a_body_walks_on_level_ground(way):
    """It rests nowhere, its feet roll, and phases have both bounds; the goal is within its reach."""
    context, found = way(0.0)
    walking = without_rests(context.scenario, found.plan)
    supports = walking.file.supports
    assert supports.foot == "rolling"
    assert walking.file.manner == "walking"  # with arms that swing, as people's do
    assert context.with_supports(walking).settings.manner.name == "walking"
    assert found.scenario.file.manner == "ready"
    assert all(phase.com_near is None for phase in supports.phases)
    assert any(phase.com_near is not None for phase in found.scenario.file.supports.phases)
    for phase in supports.phases[1:-1]:
        flies = len(phase.entries()) == 1
        assert phase.min_duration_s >= (found_supports.QUICK.swing if flies else found_supports.QUICK.rolled)
        assert phase.max_duration_s >= 1.5 * phase.min_duration_s
    problem = walking.build_centroidal_problem()
    assert len(problem.sequence) > len(supports.phases)  # heels and toes have phases of their own
    assert problem.regions[-1].violation(problem.goal_com) <= 0.0


@pytest.mark.parametrize("height", [0.12, 0.3])
def test_a_body_climbs_without_rest_what_feet_alone_make(way, height):
    """On a step of stairs and on a high one it passes from foot to foot, on feet that land flat there."""
    context, found = way(height)
    walking = without_rests(context.scenario, found.plan)
    assert all(phase.com_near is None for phase in walking.file.supports.phases)
    sequence = walking.build_centroidal_problem().sequence
    parts = {contact.part for phase in sequence for contact in phase.stance if contact.position[2] > 0.05}
    assert SolePart.TOES in parts  # the foot below leaves from its toes before the other has flown
    rising = [phase.stance for phase in sequence if np.ptp([c.position[2] for c in phase.stance]) > 0.05]
    landed = [contact.part for stance in rising for contact in stance if contact.position[2] > 0.05]
    assert rising
    assert set(landed) == {SolePart.FULL}


BAR = """
- {name: bar, box: [0.08, 2.0, 0.1], position: [0.9, 0.0, 1.45]}
"""


def test_a_body_that_bends_below_a_bar_walks(way):
    """Each phase has a plane above the postures at both its ends, in place of a bound by the bar's shape.

    Feet roll as on any way: on flat ones the body would crouch from its first step to its last.
    """
    context, found = way(0.0, goal=2.0, scene=BAR)
    walking, plan = without_rests(context.scenario, found.plan), found.plan
    supports, problem = walking.file.supports, walking.build_centroidal_problem()
    assert supports.foot == "rolling"
    assert problem.geometric == ()
    coms = [*(stage.com for stage in plan.stages), plan.goal_com]
    begins = [*problem.sequence.begins, len(problem.regions)]
    for number, (phase, ends) in enumerate(zip(supports.phases, itertools.pairwise(coms), strict=True)):
        parts = problem.regions[begins[number] : begins[number + 1]]
        normal = np.array(phase.com_below.normal) / np.linalg.norm(phase.com_below.normal)
        rooms = (phase.com_below.position - np.array(ends)) @ normal
        assert 0.0 <= rooms.min() < 0.031  # the postures are below it, and the higher one is just below
        higher = ends[int(rooms.argmin())]
        stances = [phase.stance for phase in problem.sequence][begins[number] : begins[number + 1]]
        whole = [all(contact.part is SolePart.FULL for contact in stance) for stance in stances]
        missed = [float(region.violation(higher)) for region in parts]
        # The posture has flat soles: parts on heel or toes miss it by a little.
        assert all(miss <= (1e-9 if flat else 0.02) for miss, flat in zip(missed, whole, strict=True))
        above = higher + np.array([0.0, 0.0, 0.1])
        assert min(float(region.violation(above)) for region in parts) > 0.03
    result = plan_com(problem, guesses=1)
    assert result.failure is None
    assert result.iterations < 150


@pytest.fixture
def paced(way, monkeypatch):
    """A walk onto a step as it is first planned, and a report that can be told of failures."""
    context, found = way(0.12)
    report = Report(context, None, None, time.perf_counter())
    monkeypatch.setattr(contact_stage, "find_supports", lambda *_: found)  # it would be found again
    return plan_contacts(context, report), report


def rests(context):
    """Numbers of the phases that begin with a rest."""
    phases = context.scenario.file.supports.phases
    return {k for k, phase in enumerate(phases) if phase.com_near is not None}


def test_a_walk_that_fails_has_more_time_then_rests_there_then_everywhere(paced):
    """Each phase of the walk gets more time; rests are around the stage in which the motion failed."""
    quick, report = paced
    stages, at = len(quick.plan.stages), 3

    def least(context):
        return np.array([phase.min_duration_s for phase in context.scenario.file.supports.phases])

    def fail():
        report.summary["wholebody"] = {}  # a motion there was
        report.fail("wholebody", "left_foot misses its position", 1.0, "phase 2")

    fail()
    slow = slower(quick, report, at)
    assert (least(slow)[1:-1] > least(quick)[1:-1] + 0.04).all()
    assert not rests(slow)
    fail()
    there = slower(slow, report, at)
    assert rests(there) == {at - 1, at, at + 1, at + 2}
    away = np.abs(np.arange(stages) - at) > 2  # the phases beside them have a rest at one end
    assert away.any()
    np.testing.assert_array_equal(least(there)[away], least(slow)[away])
    fail()
    everywhere = slower(there, report, at)
    assert rests(everywhere) == set(range(1, stages))
    assert everywhere.passing is None
    fail()
    assert slower(everywhere, report, at) is None


def test_a_walk_below_a_bar_that_fails_is_tried_on_flat_feet_first(way, monkeypatch):
    """At the same pace and without rests; after that it has more time, as any walk."""
    context, found = way(0.0, goal=2.0, scene=BAR)
    report = Report(context, None, None, time.perf_counter())
    monkeypatch.setattr(contact_stage, "find_supports", lambda *_: found)
    walking = plan_contacts(context, report)
    assert walking.scenario.file.supports.foot == "rolling"
    assert walking.scenario.file.manner == "walking"  # the way is level

    def fail():
        report.summary["wholebody"] = {}
        report.fail("wholebody", "left_forearm comes too near to the bar", 1.0, "phase 2")

    fail()
    flat = slower(walking, report, 3)
    assert flat.scenario.file.supports.foot is None
    assert flat.passing.paces == walking.passing.paces
    assert not rests(flat)
    fail()
    slow = slower(flat, report, 3)
    assert slow.scenario.file.supports.foot is None
    assert slow.passing.paces != flat.passing.paces


def test_the_pace_of_a_task_stretches_all_phases_on_feet(way):
    """Walking and at rest; beside supports, which have their durations, it is refused."""
    context, found = way(0.0)
    slow = context.scenario.with_overrides(["task.pace=slow"])

    def least(scenario):
        return np.array([phase.min_duration_s for phase in scenario.file.supports.phases])

    for supported in (without_rests, found_supports.with_supports):
        ratios = least(supported(slow, found.plan)) / least(supported(context.scenario, found.plan))
        np.testing.assert_allclose(ratios, 1.5)
    with pytest.raises(ScenarioError, match=r"task\.pace is given beside supports, whose phases"):
        found.scenario.with_overrides(["task.pace=brisk"])


def test_a_body_rises_from_a_seat_without_a_rest_and_walks_on():
    """It keeps to its leaning postures on the seat; nothing holds it there as it leaves, or on its steps."""
    scenario = load_scenario("stand-up-chair").in_task_frame()
    found = find_supports(scenario, scenario.build_body(), scenario.build_scene(), np.random.default_rng(0))
    rise = len(rising_times(found.plan.stages))
    walking, resting = without_rests(scenario, found.plan), found.scenario
    quick, slow = (one.file.supports.phases for one in (walking, resting))
    assert slow[rise - 1].com_lead_s > 0.0
    assert all(phase.com_lead_s == 0.0 and phase.com_near is not None for phase in quick[1 : rise + 1])
    assert all(phase.com_near is None for phase in quick[rise + 1 :])
    assert sum(phase.min_duration_s for phase in quick) < 0.7 * sum(phase.min_duration_s for phase in slow)
    sequence = walking.build_centroidal_problem().sequence
    assert len(sequence.begins) == len(quick)
    assert walking.file.supports.foot == "rolling"
    paces = [Pace.RESTING if number == rise - 1 else Pace.PASSING for number in range(len(quick))]
    part = without_rests(scenario, found.plan, paces).file.supports.phases
    assert part[rise - 1].com_lead_s > 0.0
    assert [phase.com_near for phase in part[rise + 1 :]] == [phase.com_near for phase in quick[rise + 1 :]]


def test_a_body_walks_to_a_seat_and_rests_before_it():
    """Steps are passed; the centre of mass is planned up to the touch, on as many phases as come before."""
    scenario = load_scenario("stand-up-chair", overrides=[
        "task={start: {at: [1.2, -1.2]}, goal: {at: [0.0, 0.0], heading_deg: 0, posture: seated}}",
        "scene=[{name: seat, padded: true, box: [0.42, 0.46, 0.06], position: [-0.08, 0.0, 0.38]}]",
    ]).in_task_frame()  # fmt: skip
    found = find_supports(scenario, scenario.build_body(), scenario.build_scene(), np.random.default_rng(0))
    walking = without_rests(scenario, found.plan)
    phases = walking.file.supports.phases
    rests = [number for number, phase in enumerate(phases) if phase.com_near is not None]
    assert rests == [len(phases) - 2, len(phases) - 1]
    sequence = walking.build_centroidal_problem().sequence
    assert len(sequence.begins) == len(phases) - 1
    assert "buttocks" not in sequence.effectors


def test_a_walk_without_a_plan_of_the_centre_of_mass_rests_there_then_everywhere(paced):
    quick, report = paced
    report.fail("centroidal", "the largest margin found is 2.07 N.m", 1.0, "phase 2")
    there = slower(quick, report, 3)
    assert rests(there) == {2, 3, 4, 5}
    report.fail("centroidal", "the largest margin found is 2.07 N.m", 1.0, "phase 2")
    assert slower(there, report, 3) is there.resting


def test_a_walk_that_fails_at_a_second_place_rests_there_too(paced):
    """Where more than half of its stages have rests already, it rests at all of them."""
    quick, report = paced
    last = len(quick.plan.stages) - 1
    report.fail("centroidal", "the largest margin found is 2.07 N.m", 1.0, "phase 1")
    there = slower(quick, report, 1)
    report.fail("centroidal", "the largest margin found is 2.07 N.m", 3.0, f"phase {last}")
    both = slower(there, report, last)
    assert rests(there) < rests(both) < rests(quick.resting)
    report.fail("centroidal", "the largest margin found is 2.07 N.m", 2.0, "phase 4")
    full = slower(both, report, last // 2)
    assert full is both.resting or rests(both) < rests(full)


def test_where_a_posture_is_missing_feet_are_flat_before_the_body_rests_everywhere(paced):
    """More time is no help then."""
    walking, report = paced
    resting = walking.resting
    # Of supports with and without rests the centre of mass is mostly planned on one: none is posed before.
    assert not {"problem"} & (vars(walking).keys() | vars(resting).keys())
    assert walking.problem.regions != resting.problem.regions
    assert slower(walking, report, None) is None  # nothing has failed
    report.fail("wholebody", "no posture at T_2", 1.0, "phase 2")
    flat = slower(walking, report, 2)
    assert walking.scenario.file.supports.foot == "rolling"
    assert flat.scenario.file.supports.foot is None
    assert not rests(flat)
    report.fail("wholebody", "no posture at T_2", 1.0, "phase 2")
    assert slower(flat, report, 2) is resting
    assert report.failure is None
    assert [item["stage"] for item in report.refused] == ["wholebody", "wholebody"]


def test_a_flight_lasts_longer_over_a_sill(way):
    """By the way up and down again at 4 m/s; beside the sill flights are as before."""
    sill = "\n- {name: sill, box: [0.1, 1.0, 0.2], position: [0.45, 0.0, 0.1]}\n"
    context, found = way(0.0, scene=sill)
    stages, supports = found.plan.stages, without_rests(context.scenario, found.plan).file.supports
    crossed = 0
    for number in (k for k, stage in enumerate(stages) if len(stage.contacts) == 1):
        (before, after), (foot,) = (
            (stages[number - 1].contacts, stages[number + 1].contacts),
            set(stages[number - 1].contacts) - set(stages[number].contacts),
        )
        start, end = before[foot].position, after[foot].position
        crosses = start[0] < 0.4 and end[0] > 0.5
        swing = max(0.4, float(np.linalg.norm(end - start)) / 3.0)
        assert supports.phases[number].min_duration_s == pytest.approx(swing + crosses * 0.4 / 4.0)
        crossed += crosses
    assert crossed == 2  # by each foot once


@pytest.mark.parametrize("given", [None, 6.0])
def test_the_margin_of_a_file_is_not_eased(way, monkeypatch, given):
    """Where a walk has 0.7 of what is wanted, half of our own margin is asked for, and all of a file's."""
    context, found = way(0.0)
    if given is not None:
        context = RunContext.of(context.scenario.with_overrides([f"planning.min_margin={given}"]))
    walking = context.with_supports(without_rests(context.scenario, found.plan))
    resting = context.with_supports(found_supports.with_supports(context.scenario, found.plan))
    walking = replace(walking, passing=Passing(context.scenario, resting, ()))
    wanted, asked = walking.problem.required_margin, list[float]()
    failure = Failure("balance margin", "too small", 1, 0.5)

    def fails(problem, **_):
        asked.append(problem.required_margin)
        result = plan_com(replace(problem, required_margin=0.0), guesses=1)
        monkeypatch.setattr(type(result), "d_min", property(lambda _: 0.7 * wanted))
        return replace(result, problem=problem, failure=failure)

    monkeypatch.setattr(whole_body_stage.com, "plan_com", fails)
    whole_body_stage.plan_centre_of_mass(walking, Report(walking, None, None, time.perf_counter()))
    assert wanted > 0.0
    assert asked == pytest.approx([wanted, 0.5 * wanted] if given is None else [wanted])


def test_places_of_the_centre_of_mass_stay_where_phases_of_the_file_begin(way, monkeypatch):
    """Feet that roll divide phases; a rest is asked for where the phase of the file begins."""
    monkeypatch.setattr(found_supports, "MILD", 0.2)  # so that it rests on the step
    context, found = way(0.3)
    walking = without_rests(context.scenario, found.plan)
    supports, problem = walking.file.supports, walking.build_centroidal_problem()
    assert supports.foot == "rolling"
    rests = [k for k, phase in enumerate(supports.phases) if phase.com_near is not None]
    assert rests
    assert len(problem.sequence) > len(supports.phases)
    assert len(problem.sequence.begins) == len(supports.phases)
    assert {plane.key for plane in problem.key_planes} == {problem.sequence.begins[k] for k in rests}
    held = [set(problem.sequence[plane.key].stance.effectors) for plane in problem.key_planes]
    assert {frozenset(names) for names in held} == {frozenset(found.plan.stages[k].contacts) for k in rests}
