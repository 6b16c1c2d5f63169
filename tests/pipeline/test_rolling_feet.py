"""Feet roll where a person cannot follow the plan on flat ones."""

import json
import time

import pytest

from manikin.contact import SolePart
from manikin.pipeline import runner
from manikin.pipeline.stages import Report, RunContext
from manikin.pipeline.stages.whole_body_stage import (
    centroidal_summary,
    plan_centre_of_mass,
    with_rolling_feet,
)
from manikin.runtime.requirement import Requirement, RequirementTable
from manikin.scenarios import load_scenario


def failed(scenario, stage="wholebody"):
    """A context and a report that has failed in a stage."""
    context = RunContext.of(scenario)
    report = Report(context, None, None, time.perf_counter())
    report.fail(stage, "left_foot misses its position", 1.0, "phase 2")
    report.summary["centroidal"] = {"duration_s": 5.0}
    return context, report


@pytest.mark.parametrize("stage", ["wholebody", "execution"])
def test_feet_roll_where_the_body_does_not_follow(stage):
    context, report = failed(load_scenario("platform"), stage)
    rolling = with_rolling_feet(context, report)
    assert rolling is not None
    assert report.failure is None
    (before,) = report.refused
    assert (before["phase"], before["stage"], before["time_s"]) == (None, stage, 1.0)
    parts = {contact.part for phase in rolling.problem.sequence for contact in phase.stance}
    assert {SolePart.HEEL, SolePart.TOES} <= parts
    # Rolling only adds phases: every stance of flat feet is among those of rolling ones, in order.
    places = [{c.effector: tuple(c.position) for c in phase.stance} for phase in rolling.problem.sequence]
    flat = [{c.effector: tuple(c.position) for c in phase.stance} for phase in context.problem.sequence]
    assert [place for place, last in zip(places, [None, *places], strict=False) if place != last] == flat
    assert with_rolling_feet(rolling, report) is None  # nothing has failed since
    report.fail("wholebody", "again", 1.0)
    assert with_rolling_feet(rolling, report) is None  # and once is enough


@pytest.mark.parametrize("stage", ["contacts", "centroidal", "act"])
def test_other_failures_leave_feet_as_they_are(stage):
    context, report = failed(load_scenario("platform"), stage)
    assert with_rolling_feet(context, report) is None
    assert report.failure.stage == stage


@pytest.mark.parametrize(("name", "settings"), [("platform", ["supports.foot=flat"]), ("crouch@refined", [])])
def test_feet_stay_flat_where_the_file_says_so_and_where_motions_are_refined(name, settings):
    context, report = failed(load_scenario(name).with_overrides(settings))
    assert with_rolling_feet(context, report) is None
    assert report.failure is not None


def test_the_summary_says_how_feet_stand_and_why():
    context, report = failed(load_scenario("platform"))
    flat = plan_centre_of_mass(context, report)
    assert centroidal_summary(flat)["feet"] == "flat"
    assert report.summary["centroidal"]["on_flat_feet"] is None
    report.fail("wholebody", "left_foot misses its position", 1.0, "phase 2")
    rolling = plan_centre_of_mass(with_rolling_feet(context, report), report)
    block = report.summary["centroidal"]
    assert centroidal_summary(rolling)["feet"] == block["feet"] == "rolling"
    assert block["on_flat_feet"]["reason"] == "left_foot misses its position"


@pytest.mark.parametrize("time_s", [0.0, 5.0, 5.5])
def test_at_the_ends_of_a_motion_both_feet_are_flat(time_s):
    """Rolling changes no stance there; after the end, at 5 s, the body only stands."""
    context, report = failed(load_scenario("platform"), "execution")
    report.fail("execution", "fell", time_s)
    assert with_rolling_feet(context, report) is None


def attempted(report, stage, number):
    """A report that has gone through the stages up to one and failed there."""
    order = ("centroidal", "wholebody", "execution")
    for name in order[: order.index(stage) + 1]:
        report.finish(name, {"duration_s": 5.0, "attempt": number})
        row = Requirement("error", "error", "m", number, "<=", 0.0)
        report.require(name, RequirementTable((row,)))
    report.planned = stage == "execution"
    report.fail(stage, f"attempt {number} fails", 1.0 + number, f"phase {number}")


@pytest.mark.parametrize("flat", ["wholebody", "execution"])
@pytest.mark.parametrize("rolling", ["centroidal", "wholebody", "execution"])
def test_all_of_a_run_is_told_of_whichever_attempt_came_farther(flat, rolling, tmp_path):
    """Failure, blocks, requirements, files: a CoM missed on rolling feet does not say why flat ones fail."""
    context = RunContext.of(load_scenario("platform"))
    report = Report(context, tmp_path / "run", None, time.perf_counter())
    attempted(report, flat, 1)
    assert with_rolling_feet(context, report) is not None
    attempted(report, rolling, 2)
    order = ("centroidal", "wholebody", "execution")
    told = 1 if order.index(rolling) < order.index(flat) else 2
    assert report.prefer_earlier() == (told == 1)
    assert report.failure.stage == (flat if told == 1 else rolling)
    assert f"attempt {told} fails" in report.failure.reason
    assert "attempt 2 fails" in report.failure.reason
    assert report.failure.where == f"phase {told}"
    summary = report.close()
    reached = order[: order.index(report.failure.stage) + 1]
    for name in order:
        block = summary[name]
        assert block == ({"duration_s": 5.0, "attempt": told} if name in reached else None)
        if block is not None:
            assert json.loads((tmp_path / f"run/stages/{name}.json").read_text()) == block
    assert [(row["stage"], row["measured"]) for row in summary["requirements"]] == [
        (n, told) for n in reached
    ]
    assert summary["planned"] == (report.failure.stage == "execution")
    kept = load_scenario(str(tmp_path / "run/scenario.yaml"))
    assert kept.file.supports.foot == (None if told == 1 else "rolling")


@pytest.mark.parametrize(("rolling", "told"), [("centroidal", 0), ("execution", 1)])
def test_a_run_returns_the_attempt_that_came_farther(rolling, told, monkeypatch):
    """The results of the stages are those of the attempt that the summary tells."""
    returned = []

    def followed(_context, report, _requirements):
        number, stage = len(returned), rolling if returned else "execution"
        returned.append(number)
        attempted(report, stage, number)
        return lambda: (number, report.close()), None

    monkeypatch.setattr(runner, "_followed", followed)
    number, summary = runner.run(load_scenario("platform"))
    assert (returned, number) == ([0, 1], told)
    assert summary["centroidal"]["attempt"] == told
    assert f"attempt {told} fails" in summary["failure"]["reason"]
