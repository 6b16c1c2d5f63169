"""The recovery stage: a standing body is pushed and keeps its balance, in the physics engine."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby

from manikin import simulation
from manikin.body import BodyModel
from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence
from manikin.control.recovery import RecoverySettings
from manikin.errors import ScenarioError
from manikin.numerics.spatial import rotation_from_yaw
from manikin.pipeline.stages.context import Report, RunContext
from manikin.scenarios import Scenario
from manikin.scenarios.sections.task_sections import PushSection, RecoverySection

STAGE = "push"


def recover_from_push(context: RunContext, report: Report) -> simulation.Recovery:
    """Push the body of a scenario with a ``recovery`` section and measure what becomes of it.

    Raises:
        ScenarioError: If there is nothing to recover from, or the push is not usable.
    """
    scenario, body = context.scenario, context.body
    section, push = _sections(scenario)
    force = push.force_N * rotation_from_yaw(math.radians(push.direction_deg))[:, 0]
    task, settings = _task(scenario, section, body), _settings(scenario, section)
    timing, frequency = (push.at_s, push.duration_s), push.frequency_hz or 0.0
    with scenario.refusing(("push",)):
        item = simulation.push_near_com(body, force, *timing, frequency=frequency, q=task.q)
    task = replace(task, pushes=(item,))
    progress = partial(report.progress, STAGE)
    result = simulation.recover(body, task, settings, scene=context.scene, progress=progress)
    report.finish(STAGE, result.summary() | _bound(body, task, settings, result))
    report.require(STAGE, result.requirements)
    report.planned, report.proved = None, result.recovered
    if result.failure:
        report.fail(STAGE, result.failure, float(result.trace.motion.time[-1]), f"feet {section.feet}")
    report.keep_motions(_schedule(result), None, result.trace.motion)
    return result


def push_trials(scenario: Scenario) -> simulation.PushTrials:
    """The body and stance of a scenario with a ``recovery`` section, to be pushed from any direction.

    Of its push only the duration and the beginning are taken over; the ground is level and empty.

    Raises:
        ScenarioError: If there is nothing to recover from.
    """
    (section, push), body = _sections(scenario), scenario.build_body()
    task, settings = _task(scenario, section, body), _settings(scenario, section)
    return simulation.PushTrials(body, task, settings, push.duration_s, push.at_s)


def push_map_searches(
    scenarios: Sequence[Scenario], directions: int, tolerance: float
) -> list[tuple[simulation.PushMap, list[simulation.DirectionSearch]]]:
    """Empty maps of the largest impulses held, each with the searches of its directions.

    Args:
        scenarios: One with a ``recovery`` section for each map.
        directions: How many, all around.
        tolerance: Of the impulses [N.s].

    Raises:
        InputError: If a number is not usable.
    """
    angles = simulation.equal_directions(directions)
    maps = []
    for scenario in scenarios:
        trials, (section, push) = push_trials(scenario), _sections(scenario)
        conditions = {
            "body": scenario.file.body.model_dump(mode="json", exclude_none=True),
            **section.model_dump(mode="json", exclude={"duration_s"}),
            "duration_s": push.duration_s, "tolerance_Ns": tolerance,
        }  # fmt: skip
        searches = [simulation.DirectionSearch(trials, angle, tolerance) for angle in angles]
        maps.append((simulation.PushMap.empty(conditions, angles, trials.bound(angles)), searches))
    return maps


def _sections(scenario: Scenario) -> tuple[RecoverySection, PushSection]:
    if scenario.file.recovery is None or scenario.file.push is None:
        raise ScenarioError(f"scenario {scenario.name!r} has no recovery; valid: recovery and push")
    return scenario.file.recovery, scenario.file.push


def _task(scenario: Scenario, section: RecoverySection, body: BodyModel) -> simulation.RecoveryTask:
    """The stance, without a push."""
    feet, options = simulation.Feet(section.feet), {"friction": section.friction, "steps": section.steps}
    task = simulation.RecoveryTask((), feet, section.duration_s, **options)
    if section.support == "both":
        if section.feet_apart_m is None:
            return task
        with scenario.refusing(("recovery", "feet_apart_m")):
            return replace(task, q=simulation.feet_apart_posture(body, section.feet_apart_m))
    foot = f"{section.support}_foot"
    with scenario.refusing(("recovery", "support")):
        return replace(task, q=simulation.one_foot_posture(body, foot), support=(foot,))


def _settings(scenario: Scenario, section: RecoverySection) -> RecoverySettings:
    return RecoverySettings(
        friction_model=scenario.contact_model.friction,
        delay=section.delay_s, locked=tuple(section.locked), strength=section.strength,
        posture_control_only=section.posture_control_only, ankle_stiffness=section.ankle_stiffness,
        sole_inset=section.sole_inset_m,
    )  # fmt: skip


def _bound(
    body: BodyModel, task: simulation.RecoveryTask, settings: RecoverySettings, found: simulation.Recovery
) -> dict[str, float | None]:
    """Upper bound of the impulse that free feet hold without a step, for one push that is no sine."""
    if len(task.pushes) != 1 or task.pushes[0].frequency > 0.0:
        return {"bound_Ns": None}
    direction = math.degrees(math.atan2(found.direction[1], found.direction[0]))
    bound = simulation.PushTrials(body, task, settings, task.pushes[0].duration).bound([direction])
    return {"bound_Ns": None if bound is None else bound[0]}


def _schedule(found: simulation.Recovery) -> ContactSchedule:
    """The feet that carried, in time."""
    time, standings = found.trace.motion.time, found.trace.standings
    phases, instants, first = [], [float(time[0])], 0
    for standing, run in groupby(standings):
        first += len(list(run))
        phases.append(Phase(Stance(standing.soles)))
        instants.append(float(time[min(first, len(time) - 1)]))
    return ContactSchedule(StanceSequence(phases), instants)
