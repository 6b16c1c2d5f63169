"""Runs whose whole-body motion is refined, from start and goal and from supports."""

import json

import numpy as np
import pytest

from manikin.errors import ScenarioError
from manikin.motion.dynamics import centroidal_motion
from manikin.motion.file import read_motions
from manikin.pipeline import runner
from manikin.pipeline.run_directory import read_run
from manikin.pipeline.stages import ExecutionRequirements, RunResult
from manikin.planning.whole_body.refine_physics import contact_slack
from manikin.reports.figures.effectors import flights_figure
from manikin.reports.summary_table import verdict_line
from manikin.scenarios import load_scenario

REFINED = ("wholebody.method=refine", "contacts.attempts=1")

STEP = """
name: step
supports:
  friction: 0.7
  sole: {length_m: 0.28, width_m: 0.12}
  normal_force_cap_N: 1500
  phases:
    - {left_foot: {position: [0, 0.1, 0]}, right_foot: {position: [0, -0.1, 0]}}
    - {left_foot: same, min_duration_s: 0.5}
    - {left_foot: same, right_foot: {position: [0.2, -0.1, 0]}}
task: {start: {com: [0, 0, 0.9]}, goal: {com: [0.1, 0, 0.9]}}
com_constraints: [{height_band: {lower: "0.86", upper: "0.94"}}]
wholebody: {method: refine}
"""


@pytest.fixture(scope="module", params=["step", pytest.param("chair", marks=pytest.mark.long)])
def refined(request, tmp_path_factory):
    """A step on listed supports, or rising from a chair on found ones.

    The execution is held to what no execution keeps.
    """
    folder = tmp_path_factory.mktemp("runs")
    (folder / "step.yaml").write_text(STEP)
    job = {"step": (folder / "step.yaml", ()), "chair": ("stand-up-chair", REFINED)}[request.param]
    strict = ExecutionRequirements(com_rms_error=0.0)
    return runner.run(job[0], overrides=job[1], out=folder / request.param, requirements=strict)


only_step = pytest.mark.parametrize("refined", ["step"], indirect=True)
only_chair = pytest.mark.parametrize(
    "refined", [pytest.param("chair", marks=pytest.mark.long)], indirect=True
)


def test_contacts_that_cannot_be_refined_are_planned_again_without_the_step(monkeypatch):
    """The phase that the refinement names goes back to the search, which is asked once more."""
    asked, tried = [], []

    def refined(context, report, _):
        tried.append(context)
        if len(tried) == 1:
            report.fail("wholebody", "a hand is torn off", 0.4, "phase 1 on left_hand")
        return lambda: RunResult.of(report), None

    def again(context, report, phase):
        asked.append(phase)
        report.try_again(phase)
        return context

    monkeypatch.setattr(runner, "plan_contacts", lambda context, _: context)
    monkeypatch.setattr(runner, "_refined", refined)
    monkeypatch.setattr(runner, "plan_contacts_again", again)
    runner.run("climb")
    assert (len(tried), asked) == (2, [1])


def test_contacts_become_a_motion_that_keeps_to_physics(refined):
    """The requirements of the refinement, and ten and five times less than its input."""
    body = refined.summary["wholebody"]
    assert refined.summary["planned"]
    assert body["method"] == "refine"
    assert body["min_margin"] > 0.0
    assert body["min_clearance_m"] > 0.0
    assert body["max_support_error_m"] <= 1e-3
    assert body["max_joint_limit_violation_rad"] <= 1e-9
    assert body["max_velocity_share"] <= 1.0
    measures = body["refinement"]
    assert measures["min_contact_slack"] > 0.0
    before, after = measures["before"], measures["after"]
    assert before["physics_violation"] > 10.0 * after["physics_violation"]
    assert measures["squared_accelerations_fall"] > 5.0


def test_the_balance_of_the_motion_file_is_that_of_linear_programs(refined):
    """Every 10 ms, from the positions, velocities and accelerations in the file alone."""
    content = read_motions(refined.directory)
    motion = content.planned
    every = slice(None, None, 2)
    wrench = centroidal_motion(content.body, motion.q[every], motion.v[every], motion.a[every]).wrench
    slack = contact_slack(content.schedule, motion.time[every], wrench)
    assert slack.min() > 0.0
    assert slack.min() == pytest.approx(
        refined.summary["wholebody"]["refinement"]["min_contact_slack"], rel=0.1
    )


def test_a_planned_motion_whose_execution_breaks_a_requirement_is_no_success(refined):
    summary = refined.summary
    assert (summary["planned"], summary["proved"], refined.succeeded) == (True, False, False)
    assert (summary["verdict"], refined.verdict) == ("failed", "failed")
    assert summary["failure"] == summary["execution"]["failure"]
    assert summary["failure"]["stage"] == "execution"
    assert summary["failure"]["reason"].startswith("RMS error of the centre of mass")
    broken = [(row["stage"], row["key"]) for row in summary["requirements"] if not row["held"]]
    assert broken == [("execution", "com_rms_error_m")]
    line = verdict_line(summary)
    assert line.startswith("failed: RMS error of the centre of mass")
    assert "after a plan that kept every requirement" in line


def test_the_run_directory_is_like_any_other(refined):
    on_disk = json.loads((refined.directory / "summary.json").read_text())
    assert on_disk["wholebody"] == json.loads(json.dumps(refined.summary["wholebody"]))
    record = read_run(refined.directory)
    assert set(record.motions) == {"planned", "executed"}
    assert flights_figure(record) is not None
    assert load_scenario(refined.directory / "scenario.yaml").refines


def test_the_motion_is_executed(refined):
    """By the defaults of the execution this run is a success as well."""
    assert ExecutionRequirements().table(refined.execution).held
    assert refined.execution.succeeded
    assert refined.summary["execution"]["required"] is True


@only_step
def test_listed_supports_are_refined_between_their_key_postures(refined):
    summary = refined.summary
    assert summary["centroidal"]["key_postures"] == {"count": 4, "failed": []}
    assert refined.planned.time[-1] >= summary["centroidal"]["duration_s"] - 1e-9
    np.testing.assert_allclose(refined.planned.com[-1], [0.1, 0.0, 0.9], atol=0.05)


@only_chair
def test_who_rises_from_a_chair_has_no_plan_of_the_centre_of_mass(refined):
    """Start and goal stay what the scenario says: the same run again gives the same motion."""
    assert refined.summary["centroidal"] is None
    assert load_scenario(refined.directory / "scenario.yaml").file.supports is None
    assert refined.executed.com[-1, 2] - refined.executed.com[0, 2] > 0.2


@pytest.mark.parametrize("name", ["walk", "walls"])
def test_what_cannot_be_refined_is_refused(name):
    with pytest.raises(ScenarioError, match=r"wholebody\.method is refine; valid: follow"):
        load_scenario(name, overrides=REFINED)
