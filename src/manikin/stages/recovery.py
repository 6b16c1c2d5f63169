"""The recovery stage: a standing body is pushed and keeps its balance, in the physics engine."""

import math

from manikin.contact import ContactSchedule, Phase, Stance, StanceSequence
from manikin.control.balance_recovery import RecoverySettings
from manikin.errors import InputError, ScenarioError
from manikin.simulation import Feet, Recovery, RecoveryTask, push_near_com, recover
from manikin.spatial import rotation_from_yaw
from manikin.stages.context import RunContext
from manikin.stages.report import Report

STAGE = "push"


def recover_from_push(context: RunContext, report: Report) -> Recovery:
    """Push the body of a scenario with a ``recovery`` section and measure what becomes of it.

    Args:
        context: Of the run.
        report: Takes the ``push`` block, and the failure where the body does not stand in the end.

    Raises:
        ScenarioError: If there is nothing to recover from, or the push is not usable.
    """
    scenario, body = context.scenario, context.body
    section, push = scenario.recovery, scenario.push
    if section is None or push is None:
        raise ScenarioError(f"scenario {scenario.name!r} has no recovery; valid: recovery and push")
    settings = RecoverySettings(
        delay=section.delay_s, locked=tuple(section.locked), strength=section.strength,
        posture_control_only=section.posture_control_only,
    )  # fmt: skip
    force = push.force_N * rotation_from_yaw(math.radians(push.direction_deg))[:, 0]
    try:
        pushes = (
            push_near_com(
                body, force, push.at_s, push.duration_s, frequency=push.frequency_hz or 0.0
            ),
        )  # fmt: skip
    except InputError as error:
        raise scenario.refused(("push",), error) from None
    task = RecoveryTask(pushes, Feet(section.feet), section.duration_s, friction=section.friction)
    found = recover(
        body, task, settings, scene=context.scene, progress=lambda share: report.progress(STAGE, share)
    )
    report.finish(STAGE, found.summary())
    if found.failure:
        report.fail(STAGE, found.failure, float(found.trace.motion.time[-1]), f"feet {section.feet}")
    report.keep_motions(_schedule(found), None, found.trace.motion)
    return found


def _schedule(found: Recovery) -> ContactSchedule:
    """Both feet stand where they are all the time."""
    time = found.trace.motion.time
    return ContactSchedule(StanceSequence([Phase(Stance(found.soles))]), [float(time[0]), float(time[-1])])
