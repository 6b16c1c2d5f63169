"""The execution stage: the planned motion under control in the physics engine, and its report."""

from typing import Any

from manikin.contact import ContactSchedule
from manikin.control import ControlSettings, ReturnSettings, SupportSettings
from manikin.motion import Motion
from manikin.requirement import RequirementTable
from manikin.scenarios import Scenario
from manikin.simulation import Execution, Push, execute, push_on_the_way
from manikin.stages.act import measured_act_failure
from manikin.stages.context import RunContext
from manikin.stages.planned_motion import PlannedMotion
from manikin.stages.report import Failure, Report, place
from manikin.stages.requirements import ExecutionRequirements


def execute_motion(
    context: RunContext, report: Report, planned: PlannedMotion, requirements: ExecutionRequirements
) -> Execution:
    """Execute a motion, with the scenario's push and its act, and measure what became of it.

    A body that may be pushed is ready for it, but not told when or whence; see
    :mod:`manikin.control.plan_return`.

    Args:
        context: Of the run.
        report: Takes the ``execution`` block, and the failure of a motion that broke a requirement.
        planned: What is executed.
        requirements: What the execution must keep.
    """
    scenario, act = context.scenario, planned.act
    # The share of the friction that planning keeps to, where it has its own, holds in control too.
    settings = ControlSettings(
        supports=SupportSettings(friction_share=scenario.friction_share),
        returning=None if scenario.push is None else ReturnSettings(),
    )
    result = execute(
        context.body, context.scene, planned.motion, planned.schedule,
        pushes=_pushes(scenario, planned.motion), padded=context.padded, settings=settings,
        wishes=() if act is None else act.wishes,
        progress=lambda share: report.progress("execution", share),
    )  # fmt: skip
    table = requirements.table(result, scenario.seated_from is not None)
    report.require("execution", table)
    fallen = _failure(planned.schedule, result, table)
    exerted = measured_act_failure(context, report, planned, result.motion)
    failure = exerted if fallen is None else fallen
    block = {
        "required": True,
        "failure": None if failure is None else failure.as_dict(),
        **_summary_in_world(result, report),
        **context.passage(result.schedule or planned.schedule, result.motion).summary(),
    }
    report.finish("execution", block)
    report.proved = failure is None
    if failure is not None:
        report.fail(failure.stage, failure.reason, failure.time_s, failure.where)
    report.keep_motions(planned.schedule, planned.motion, result.motion)
    return result


def _summary_in_world(result: Execution, report: Report) -> dict[str, Any]:
    block = result.summary()
    if block["push"] is not None:
        block["push"] |= {"direction_deg": report.transform.turned(block["push"]["direction_deg"])}
    return block


def _failure(schedule: ContactSchedule, result: Execution, table: RequirementTable) -> Failure | None:
    """What the execution itself did not keep, or None."""
    broken = table.first_broken
    if result.failure:
        reason, time = result.failure, float(result.failure_time_s or 0.0)
    elif broken is not None:
        reason, time = broken.reason, broken.time_s or 0.0
    else:
        return None
    phase = int((result.schedule or schedule).phase_at(time))
    held = ", ".join(schedule.sequence[phase].stance.effectors)
    return Failure("execution", reason, time, place(phase, held))


def _pushes(scenario: Scenario, motion: Motion) -> tuple[Push, ...]:
    """The push that a scenario asks for, its direction seen from where the body faces then."""
    push = scenario.push
    if push is None:
        return ()
    scenario.check_push(float(motion.time[-1]))
    return (
        push_on_the_way(
            motion, push.force_N, push.direction_deg, push.at_s, push.duration_s, push.frequency_hz or 0.0
        ),
    )
