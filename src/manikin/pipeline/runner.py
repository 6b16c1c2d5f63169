"""The pipeline: scenario, contacts, centre of mass, whole body, act, execution, results.

Each stage reads the one before it and its result is written as soon as it is known, so that
nothing already computed is lost.  A stage that finds nothing ends the run with an
explanation; only misuse and broken input raise.
"""

import bisect
import re
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from manikin.contact import ContactSchedule
from manikin.errors import ScenarioError
from manikin.pipeline.stages import ExecutionRequirements, Progress, Report, RunContext, RunResult
from manikin.pipeline.stages.contact_stage import plan_contacts, plan_contacts_again, slower
from manikin.pipeline.stages.context import StageFailure
from manikin.pipeline.stages.execution_stage import PlannedMotion, append_act, execute_motion
from manikin.pipeline.stages.operation_stage import run_operations
from manikin.pipeline.stages.recovery_stage import recover_from_push
from manikin.pipeline.stages.refinement_stage import from_rest_to_rest, is_hard, refine_contacts
from manikin.pipeline.stages.walking_execution import walk_before, walk_in_balance, way_before
from manikin.pipeline.stages.walking_stage import walk_to_goal, ways_found
from manikin.pipeline.stages.whole_body_stage import (
    follow_centre_of_mass,
    move_point_mass,
    plan_centre_of_mass,
    with_key_postures,
    with_rolling_feet,
    with_stricter_key_postures,
)
from manikin.planning.whole_body import WholeBodySettings
from manikin.runtime.memory import give_memory_back
from manikin.scenarios import Scenario, load_scenario


def run(
    scenario: str | Path | Scenario, *, variant: str | None = None, overrides: Sequence[str] = (),
    out: str | Path | None = None, seed: int | None = None, settings: WholeBodySettings | None = None,
    requirements: ExecutionRequirements | None = None, progress: Progress | None = None,
) -> RunResult:  # fmt: skip
    """Plan a scenario, execute it in the physics engine and report.

    An infeasible task, or a motion that fell, is a result with ``succeeded`` False.

    Args:
        scenario: Name of a built-in scenario, a scenario file, or a scenario.
        overrides: Values to set, ``"supports.friction=0.5"`` each.
        out: Run directory; nothing is written when omitted.
        seed: Seed of every random choice; the scenario's own when omitted.
        settings: Options of the whole-body stage; the defaults in the scenario's manner when omitted.
        requirements: What the execution must keep.
        progress: Called with the stage and the share of it that is done.

    Raises:
        InputError: If the scenario, or a file it names, is not usable.
    """
    job = _job(scenario, variant, overrides)
    if seed is not None:
        job = job.with_seed(seed)
    # Threads make the many small products slower, and the last bits depend on their number.
    with threadpool_limits(1):
        began = clock.perf_counter()
        context = RunContext.of(job, settings)
        report = Report(context, out, progress, began)
        try:
            return _follow_the_road(context, report, requirements or ExecutionRequirements())
        finally:
            give_memory_back()


def _job(scenario: str | Path | Scenario, variant: str | None, overrides: Sequence[str]) -> Scenario:
    if not isinstance(scenario, Scenario):
        return load_scenario(str(scenario), variant, overrides)
    if variant is not None:
        beside = "is given beside a scenario that is already loaded"
        raise ScenarioError(f"variant {variant!r} {beside}; valid: its name or file")
    return scenario.with_overrides(overrides)


def _follow_the_road(context: RunContext, report: Report, requirements: ExecutionRequirements) -> RunResult:
    """The whole road; contacts are planned where the scenario lists none, and none for a body that stays."""
    context = context.timed()
    if context.scenario.file.recovery is not None:
        return RunResult.of(report, recovery=recover_from_push(context, report))
    if context.scenario.file.task.operations is not None:
        return run_operations(context, report, requirements, _follow_the_road)
    walking = context.scenario.file.walking
    if walking is not None and walking.whole_body == "recorded":
        return RunResult.of(report, planned=walk_to_goal(context, report))
    if walking is not None and context.scenario.file.supports is None:
        walk = walk_in_balance(context, report, requirements)
        return RunResult.of(report, execution=walk.execution, planned=walk.planned)
    if walking is not None and not ways_found(report, way_before(context)[0]):
        return RunResult.of(report)
    with_contacts = context if context.scenario.file.supports is not None else plan_contacts(context, report)
    if with_contacts is None:
        return RunResult.of(report)
    if context.scenario.is_point_mass and not context.scenario.refines:  # its centre of mass is all there is
        centroidal = plan_centre_of_mass(with_contacts, report)
        return RunResult.of(report, centroidal, planned=move_point_mass(report, centroidal))
    result, schedule = _planned(with_contacts, report, requirements)
    while with_contacts.has_time and (
        other := slower(with_contacts, report, failed_stage(report.failure, schedule, with_contacts))
    ):
        with_contacts = other
        result, schedule = _planned(with_contacts, report, requirements)
    if with_contacts.has_time and (rolling := with_rolling_feet(with_contacts, report)) is not None:
        again = _planned(rolling, report, requirements)
        result, schedule = (result, schedule) if report.prefer_earlier() else again
    for _ in range(1, context.scenario.contacts.attempts):
        stage = failed_stage(report.failure, schedule, with_contacts)
        if stage is None or not with_contacts.has_time:
            break
        other = plan_contacts_again(with_contacts, report, stage)
        if other is None:
            break
        with_contacts = other
        result, schedule = _planned(with_contacts, report, requirements)
    if not with_contacts.has_time:
        report.tell_end_of_time()
    return result()


def _planned(
    context: RunContext, report: Report, requirements: ExecutionRequirements
) -> tuple[Callable[[], RunResult], ContactSchedule | None]:
    """Refined where that is asked for, from rest to rest where a step is hard; else as :func:`_followed`.

    Where a body that rests at every change of contact fails so, it is refined from rest to rest, too.
    """
    resting = from_rest_to_rest(context)
    if context.scenario.refines:
        return _refined(resting or context, report, requirements)
    if resting is not None and is_hard(context):
        return _refined(resting, report, requirements)
    found = _followed(context, report, requirements)
    if report.failure is None or resting is None or context.resting is not None or not context.has_time:
        return found
    report.try_again()
    again = _refined(resting, report, requirements)
    return found if report.prefer_earlier() else again


def _followed(
    context: RunContext, report: Report, requirements: ExecutionRequirements
) -> tuple[Callable[[], RunResult], ContactSchedule | None]:
    """The centre of mass first, then all joints along it, the act and the execution.

    Returns what makes the result, and the schedule of the contacts, as far as it came.
    """
    centroidal = plan_centre_of_mass(context, report)
    plan = with_key_postures(context, report, centroidal)
    plan, wholebody = follow_centre_of_mass(context, report, plan)
    if wholebody is not None and not wholebody.succeeded and context.has_time:
        other = with_stricter_key_postures(context, report, centroidal, plan)
        if other is not None:
            plan, wholebody = follow_centre_of_mass(context, report, other)
    schedule = None if plan.trajectory is None else plan.trajectory.schedule
    if schedule is None or wholebody is None or not wholebody.succeeded:
        return partial(RunResult.of, report, plan.centroidal, wholebody), schedule
    planned = walk_before(context, report, PlannedMotion(schedule, wholebody.motion))
    planned = append_act(context, report, planned)
    wholebody = replace(wholebody, motion=planned.motion)
    if report.failure is not None or not context.scenario.execution_required:
        return partial(RunResult.of, report, plan.centroidal, wholebody), schedule
    execution = execute_motion(context, report, planned, requirements)
    report.judge()
    return partial(RunResult.of, report, plan.centroidal, wholebody, execution), schedule


def failed_stage(
    failure: StageFailure | None, schedule: ContactSchedule | None, context: RunContext
) -> int | None:
    """Index of the stage of the contact plan in which a later stage failed, or None where it is not known."""
    if failure is None:
        return None
    problem = None if schedule is not None or context.plan is None else context.problem
    sequence = schedule.sequence if schedule is not None else None if problem is None else problem.sequence
    if (named := re.match(r"phase (\d+)", failure.where)) is not None:
        phase = int(named[1])
    elif schedule is not None:
        phase = int(schedule.phase_at(failure.time_s))
    else:
        return None
    if sequence is None or context.plan is None:
        return phase
    return bisect.bisect_right(sequence.begins, phase) - 1


def _refined(
    context: RunContext, report: Report, requirements: ExecutionRequirements
) -> tuple[Callable[[], RunResult], ContactSchedule | None]:
    """As :func:`_followed`, but postures of the contact plan or of the centre of mass are refined."""
    centroidal = None
    if context.plan is not None:
        schedule = context.plan.schedule(context.scenario.contact_model)
        keys = context.plan.keys(schedule)
    else:
        plan = with_key_postures(context, report, plan_centre_of_mass(context, report))
        centroidal = plan.centroidal
        if plan.trajectory is None or plan.postures is None:
            return partial(RunResult.of, report, centroidal), None
        schedule = plan.trajectory.schedule
        keys = schedule.instants, np.array([item.q for item in plan.postures.postures])
    refined, execution = refine_contacts(context, report, schedule, *keys), None
    planned = walk_before(context, report, PlannedMotion(refined.schedule, refined.motion))
    refined = replace(refined, motion=planned.motion, schedule=planned.schedule)
    if report.failure is None and refined.succeeded and context.scenario.execution_required:
        execution = execute_motion(context, report, planned, requirements)
        report.judge()
    return partial(RunResult.of, report, centroidal, refined, execution), refined.schedule
