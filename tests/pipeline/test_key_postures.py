"""Key postures decide about a plan of the centre of mass, and a failed one leads to another plan."""

import json
from dataclasses import replace

import numpy as np
import pytest

from manikin.pipeline.runner import run
from manikin.pipeline.stages import Report, RunContext, whole_body_stage
from manikin.pipeline.stages.whole_body_stage import plan_centre_of_mass
from manikin.planning.com.feasibility import Failure
from manikin.planning.whole_body import Eligibility, key_postures
from manikin.planning.whole_body.key_postures import KeyPosture, KeyPostures
from manikin.planning.whole_body.posture_style import FAR, READY, reference_motion
from manikin.scenarios import load_scenario

STRIDE = """
name: stride
description: One long step
body: {{model: human, stature_m: 1.75, mass_kg: 79, sex: male}}
scene:
  - {{name: lamp, box: [{lamp_m}, {lamp_m}, 0.1], position: [{length}, 0.0, {lamp_height}]}}
supports:
  friction: 0.7
  sole: {{length_m: 0.28, width_m: 0.12}}
  normal_force_cap_N: 1500
  phases:
    - left_foot: {{position: [0.0, 0.1, 0.0], yaw_deg: 0}}
      right_foot: {{position: [0.0, -0.1, 0.0], yaw_deg: 0}}
    - right_foot: same
      min_duration_s: 0.5
    - left_foot: {{position: [{length}, 0.1, 0.0], yaw_deg: 0}}
      right_foot: same
      min_duration_s: 0.2
    - left_foot: same
      min_duration_s: 0.5
    - left_foot: same
      right_foot: {{position: [{length}, -0.1, 0.0], yaw_deg: 0}}
task:
  start: {{com: [0.0, 0.0, 0.97]}}
  goal: {{com: [{length}, 0.0, {goal_height}]}}
com_constraints: {constraints}
planning:
  degree: 5
  min_margin: 15
  weights: {{margin: 0.3, smoothness: 10, duration: 2, acceleration: [1, 1, 1]}}
"""
"""Nothing but the legs limits the height of the CoM: a point mass steps as far as it likes, level."""


def stride(tmp_path, **changes):
    given = {
        "length": 0.74, "lamp_m": 0.1, "lamp_height": 3.0, "goal_height": 0.97, "constraints": "[]",
    }  # fmt: skip
    file = tmp_path / "stride.yaml"
    file.write_text(STRIDE.format(**(given | changes)))
    return file


@pytest.mark.long
@pytest.mark.slow
def test_a_plan_too_high_for_the_legs_is_planned_again_lower_and_executed(tmp_path):
    """Feet 0.74 m apart: legs of 0.9 m cannot carry the CoM at 0.95 m, as the first plan wants it.

    A distance that the file gives takes the place of the body's reach, with which the first plan is lower.
    """
    far = "[{max_support_distance_m: 1.3}]"
    result = run(stride(tmp_path, constraints=far), out=tmp_path / "run")
    summary = result.summary
    assert summary["succeeded"], summary["failure"]
    assert 1 <= summary["centroidal"]["replans"] <= 3
    assert summary["centroidal"]["key_postures"] == {"count": 6, "failed": []}
    assert summary["centroidal"]["min_margin"] >= 15.0
    planes = result.centroidal.problem.key_planes
    assert planes
    for plane in planes:
        # The plane binds the motion that was planned in the end, and the executed one within its error.
        time = result.centroidal.key_instants[plane.key]
        assert plane.violation(result.centroidal.trajectory.position(time)) <= 1e-6
        executed = result.executed.com[np.searchsorted(result.executed.time, time)]
        in_task = result.transform_task_to_world.inverse.points(executed)
        assert plane.violation(in_task) <= summary["execution"]["com_max_error_m"] + 1e-3
    kept = json.loads((tmp_path / "run/stages/key_postures.json").read_text())
    np.testing.assert_allclose(kept["time_s"], result.centroidal.key_instants)
    assert kept["reason"] == [None] * 6


@pytest.mark.long
def test_a_plan_at_the_end_of_the_legs_is_planned_lower_so_that_the_arms_may_hang(tmp_path, monkeypatch):
    """Feet 0.66 m apart: the first plan has postures, with the trunk bent and arms thrown up to be that high.

    The other one is hardly slower, and its farthest posture is nearer to the preferred one.
    """
    far = "[{max_support_distance_m: 1.3}]"
    context = RunContext.of(load_scenario(stride(tmp_path, length=0.66, constraints=far)))
    report = Report(context, None, None, 0.0)
    planned = plan_centre_of_mass(context, report)
    found = {}
    for name, search in (("first", lambda found, *_: found), ("easier", key_postures._with_easier)):
        monkeypatch.setattr(key_postures, "_with_easier", search)
        found[name] = whole_body_stage._eligible(context, report, planned, 0.0, 1e-3)

    def strains(eligible):
        preferred = reference_motion(context.body, eligible.trajectory, eligible.trajectory.schedule.instants)
        postures = eligible.postures.postures
        return [READY.strain(context.body, q, item.q) for q, item in zip(preferred, postures, strict=True)]

    first, easier = found["first"], found["easier"]
    assert not first.postures.failed
    assert not easier.postures.failed
    assert max(strains(first)) > 2.0 * FAR
    assert max(strains(easier)) < 0.6 * max(strains(first))
    assert (first.replans, easier.replans) == (0, 0)  # a stricter search compares plans that failed
    assert easier.trajectory.duration < key_postures.LITTLE_LONGER * first.trajectory.duration
    for item in first.postures.postures:
        if item.easier_com is not None:
            assert item.easier_com[2] < item.com[2] - 0.005


@pytest.mark.long
def test_a_goal_beyond_the_legs_is_named_without_planning_again(tmp_path):
    """The CoM at the goal is given: no plan can lower it. A standing body's is below 1 m."""
    result = run(stride(tmp_path, length=0.4, goal_height=1.15))
    failure, block = result.summary["failure"], result.summary["centroidal"]
    assert result.wholebody is None
    assert failure["stage"] == "wholebody"
    assert "T_5" in failure["reason"]
    assert "centre of mass misses" in failure["reason"]
    assert "a posture exists without the centre-of-mass requirement" in failure["reason"]
    assert failure["where"].startswith("phase 4 on")
    assert failure["time_s"] == pytest.approx(block["duration_s"])
    assert block["replans"] == 0
    assert block["key_postures"]["failed"][-1]["key"] == 5


@pytest.fixture
def ramp():
    """Context, report and planned centre of mass of a motion that ends on a seat."""
    context = RunContext.of(load_scenario("ramp"))
    report = Report(context, None, None, 0.0)
    return context, report, plan_centre_of_mass(context, report)


def test_a_seated_part_that_fits_no_replanned_com_is_tried_without_room_in_the_ranges(ramp, monkeypatch):
    """The first search plans again and finds no seated part; the second one counts, with its result."""
    context, report, planned = ramp
    search, calls = whole_body_stage.find_eligible_plan, []

    def first_fails(first, realise, look, **options):
        calls.append(look)
        if len(calls) == 1:
            report.fail("wholebody", "no final sitting posture", 0.0, "phase 6")
            return Eligibility(first, None, None, 1, None)
        return search(first, realise, look, **options)

    monkeypatch.setattr(whole_body_stage, "find_eligible_plan", first_fails)
    found = whole_body_stage.with_key_postures(context, report, planned)
    assert len(calls) == 2
    assert found.trajectory is not None
    assert report.failure is None


def test_a_stricter_search_counts_only_where_it_leads_to_another_plan(ramp, monkeypatch):
    """With the same plan as before nothing changes, the failure of the whole body included."""
    context, report, planned = ramp
    found = whole_body_stage.with_key_postures(context, report, planned)
    report.fail("wholebody", "nothing found", 1.0, "phase 2")
    assert whole_body_stage.with_stricter_key_postures(context, report, planned, found) is None
    assert report.failure.reason == "nothing found"

    def another(first, realise, *_, **__):
        return Eligibility(first, realise(first.trajectory), None, found.replans + 1, None)

    monkeypatch.setattr(whole_body_stage, "find_eligible_plan", another)
    other = whole_body_stage.with_stricter_key_postures(context, report, planned, found)
    assert other is not None
    assert other.replans == found.replans + 1
    assert report.failure is None


def test_a_plan_that_cannot_pass_well_inside_a_place_passes_just_inside(ramp, monkeypatch):
    """A posture exists 5 mm away; 10 mm farther no plan passes: the one that does is 2 mm farther."""
    context, _, planned = ramp
    time, beyond, there = planned.trajectory.schedule.instants[1], [], planned.trajectory.position
    near = there(time) - [0.0, 0.0, 0.005]
    nothing = KeyPosture(1, time, 0, ("left_foot",), there(time), context.body.standing_posture(), "x", near)
    search = key_postures.plan_com

    def narrow(problem, **options):
        beyond.append(problem.key_planes[-1].violation(near))
        if beyond[-1] > 0.005:
            return replace(planned, trajectory=None, failure=Failure("key plane", "no trajectory found"))
        return search(problem, **options)

    def look(trajectory, similar):  # noqa: ARG001
        return KeyPostures((nothing,) if trajectory.position(time)[2] > near[2] else ())

    monkeypatch.setattr(key_postures, "plan_com", narrow)
    found = key_postures.find_eligible_plan(planned, lambda trajectory: trajectory, look)
    assert found.failure is None
    assert found.replans == 1
    np.testing.assert_allclose(beyond, [0.01, 0.002])
    assert found.trajectory.position(time)[2] <= near[2] - 0.002 + 1e-6
