"""Pushes during an executed run: from the scenario to the summary, and what is refused."""

import pytest
from tests.conftest import QUICKLY

from manikin.errors import ScenarioError
from manikin.pipeline import runner
from manikin.pipeline.stages import ExecutionRequirements, Report, RunContext
from manikin.pipeline.stages.execution_stage import PlannedMotion, execute_motion
from manikin.scenarios import load_scenario
from manikin.scenarios.sections.task_sections import LARGEST_FORCE
from manikin.simulation.push_force import STRONGEST

PUSH = "push={force_N: 100, direction_deg: 0, duration_s: 0.1, at_s: 1.0}"


def test_the_largest_push_is_the_same_for_all_who_are_pushed():
    assert LARGEST_FORCE == STRONGEST


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("force_N=.nan", "push.force_N is nan; valid: a finite number"),
        ("force_N=1000000.0", "push.force_N is 1000000.0; valid: a number <= 5000"),
        ("force_N=-3", "push.force_N is -3; valid: a number > 0"),
        ("duration_s=-1", "push.duration_s is -1; valid: a number > 0"),
        ("duration_s=0", "push.duration_s is 0; valid: a number > 0"),
        ("frequency_hz=-2", "push.frequency_hz is -2; valid: a number > 0"),
        ("frequency_hz=1000.0", "push.frequency_hz is 1000.0; valid: a number <= 100"),
        ("at_s=-1", "push.at_s is -1; valid: a number >= 0"),
        ("at_s=.inf", "push.at_s is inf; valid: a finite number"),
        ("direction_deg=.nan", "push.direction_deg is nan; valid: a finite number"),
        ("force=3", "push.force is not a known key; did you mean 'force_N'?"),
    ],
)
@pytest.mark.parametrize("name", ["platform", "walk"])
def test_absurd_pushes_are_refused_in_one_line(name, setting, says):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(name, overrides=[PUSH, f"push.{setting}"])
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_push_after_the_end_is_refused():
    scenario = load_scenario("platform", overrides=[PUSH, "push.at_s=99"])
    with pytest.raises(ScenarioError, match=r"push\.at_s.* is 99; valid: before the motion ends at 5\.000 s"):
        scenario.check_push(5.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["step", pytest.param("platform", marks=pytest.mark.long)])
def test_a_pushed_body_goes_on_to_its_goal(runs, name):
    """The plan is that of the body that nobody pushes, whose run the tests share."""
    if name == "step":
        file = runs.step_file()
        planned, plain = runs.step(), load_scenario(file, overrides=[QUICKLY])
        scenario = load_scenario(file, overrides=[QUICKLY, PUSH, "push.force_N=160"])
    else:
        planned, plain, scenario = runs(name), load_scenario(name), load_scenario(f"{name}@pushed")
    named = {"name": plain.name, "description": plain.file.description}
    assert scenario.replaced(push=None, **named).to_yaml() == plain.to_yaml()
    report = Report(context := RunContext.of(scenario), None, None, 0.0)
    schedule = planned.centroidal.trajectory.schedule
    requirements = ExecutionRequirements()
    motion = PlannedMotion(schedule, planned.wholebody.motion)  # both in the frame of the task
    execution = execute_motion(context, report, motion, requirements)
    assert report.failure is None
    assert requirements.table(execution).held
    push = execution.summary()["push"]
    assert push["recovered"]
    assert push["impulse_Ns"] == pytest.approx(scenario.file.push.force_N * scenario.file.push.duration_s)
    assert push["max_deviation_m"] > 0.005
    assert push["return_s"] < 2.0
    assert push["waited_s"] > 0.1 or name == "step"  # there the body comes back before the foot leaves
    assert execution.final_com_error_m < 1e-3


@pytest.mark.long
@pytest.mark.slow
def test_too_strong_a_push_ends_in_a_failure_that_is_explained():
    result = runner.run("platform@pushed-hard")
    failure, push = result.summary["failure"], result.summary["execution"]["push"]
    assert not result.succeeded
    assert failure["stage"] == "execution"
    assert failure["reason"].startswith("fell: the CoM is")
    assert failure["time_s"] > load_scenario("platform@pushed-hard").file.push.at_s
    assert not push["recovered"]
    assert push["return_s"] is None
