"""The act at the end of a scenario's motion: certified, appended to the motion, measured."""

from typing import Any

from manikin.acting import (
    Act,
    ActKind,
    BracedForces,
    largest_force,
    measure_act,
    plan_act,
    share_force,
)
from manikin.balance.contact_forces import FrictionUse, friction_share
from manikin.contact import ContactKind, FrictionModel
from manikin.motion import Motion
from manikin.requirement import Requirement, RequirementTable
from manikin.scenarios import Scenario
from manikin.stages.context import RunContext
from manikin.stages.planned_motion import PlannedMotion
from manikin.stages.report import Failure, Report

FORCE_ERROR = 0.05
"""Largest error of the mean force that was exerted, as a share of what is wanted."""


def act_of(scenario: Scenario) -> Act | None:
    """The act of a scenario, or None."""
    found = scenario.act
    if found is None:
        return None
    return Act(ActKind(found.kind), found.on, found.direction, found.force_N)


def append_act(context: RunContext, report: Report, planned: PlannedMotion) -> PlannedMotion:
    """A motion with the scenario's act at its end; as it is without one, or where it cannot be done.

    The last posture is certified for the act first.

    Args:
        context: Of the run.
        report: Takes the ``act`` block.
        planned: The motion to the place of the act.
    """
    act, section = act_of(context.scenario), context.scenario.act
    if act is None or section is None:
        return planned
    q, contacts = planned.motion.q[-1], list(planned.schedule.sequence[-1].stance)
    rub = context.scenario.explicit_supports().friction, context.scenario.contact_model.friction
    largest = largest_force(context.body, q, contacts, act, *rub)
    forces = share_force(context.body, q, contacts, act, *rub)
    used = _used_friction(planned, forces, context.scenario.contact_model.friction)
    report.finish("act", _summary(act, largest, forces) | {"friction": used})
    if forces is not None:
        report.require("act", RequirementTable((
            Requirement("max_torque_share", "share of a torque limit in the act", "", forces.torque_share,
                        "<=", 1.0, planned.end, forces.tightest),
        )))  # fmt: skip
    if forces is None or forces.torque_share > 1.0:
        weak = "friction and balance allow" if forces is None else f"{forces.tightest} allows"
        reason = f"the last posture cannot {act.kind} with {act.force:g} N: {weak} less"
        report.planned = False
        report.fail("wholebody", reason, planned.end, act.obstacle)
        return planned
    acting = plan_act(planned.motion, planned.schedule, forces, section.ramp_s, section.hold_s)
    report.keep_motions(acting.schedule, acting.motion)
    return PlannedMotion(acting.schedule, acting.motion, acting)


def measured_act_failure(
    context: RunContext, report: Report, planned: PlannedMotion, executed: Motion
) -> Failure | None:
    """Add what was exerted to the report; a failure where it is too little or too much, or nothing.

    Args:
        context: Of the run.
        report: Has the ``act`` block.
        planned: The motion, with its act or without one.
        executed: What the physics engine made of it.
    """
    act, acting = act_of(context.scenario), planned.act
    if act is None or acting is None:
        return None
    friction = context.scenario.explicit_supports().friction
    found = measure_act(executed, acting.schedule, act, acting.timing, context.body.mass, friction)
    if found is None:
        return Failure("execution", "the motion did not come to its act", acting.timing.end, act.obstacle)
    report.finish("act", report.summary["act"] | found.summary())
    row = Requirement("mean_force_error_N", "error of the mean force", "N", abs(found.mean_force - act.force),
                      "<=", FORCE_ERROR * act.force, acting.timing.end, act.obstacle)  # fmt: skip
    report.require("act execution", RequirementTable((row,)))
    if not row.held:
        reason = f"the mean force was {found.mean_force:.0f} N; wanted {act.force:g} N"
        return Failure("execution", reason, acting.timing.end, act.obstacle)
    return None


def _used_friction(
    planned: PlannedMotion, forces: BracedForces | None, model: FrictionModel
) -> dict[str, float | str] | None:
    """Largest share of the friction that the feet use while they act."""
    if forces is None:
        return None
    feet = [
        (float(friction_share(contact, force[None, :3], model)[0]), contact.effector)
        for contact, force in zip(planned.schedule.sequence[-1].stance, forces.contact_force, strict=True)
        if contact.kind is not ContactKind.GRASP
    ]
    share, effector = max(feet)
    return FrictionUse(model, share, planned.end, effector).summary()


def _summary(act: Act, largest: BracedForces | None, forces: BracedForces | None) -> dict[str, Any]:
    return {
        "kind": str(act.kind), "on": act.obstacle, "wanted_force_N": act.force,
        "largest_force_N": 0.0 if largest is None else largest.force,
        "max_torque_share": None if forces is None else forces.torque_share,
        "tightest_joint": None if forces is None else forces.tightest,
        "equilibrium_residual": None if forces is None else forces.residual,
    }  # fmt: skip
