"""The act at the end of a scenario's motion: certified, appended to the motion, measured."""

from dataclasses import dataclass
from typing import Any

from manikin.acting import (
    Act,
    ActKind,
    BracedForces,
    PlannedAct,
    largest_force,
    measure_act,
    plan_act,
    share_force,
)
from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
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


@dataclass(frozen=True, eq=False)
class ActOutcome:
    """What one step of an act gives.

    Attributes:
        summary: Values of the run's ``act`` block.
        planned: The motion with the act, or None.
        failure: Why it is no success, in one line, or None.
    """

    summary: dict[str, Any]
    planned: PlannedAct | None = None
    failure: str | None = None


class ActStage:
    """The act of one scenario with supports.

    Attributes:
        act: What is done.
    """

    def __init__(self, scenario: Scenario, body: BodyModel, act: Act) -> None:
        section = scenario.act
        self.act, self._body, self._friction = act, body, scenario.explicit_supports().friction
        self._ramp, self._hold = (0.0, 0.0) if section is None else (section.ramp_s, section.hold_s)

    def plan(self, motion: Motion, schedule: ContactSchedule) -> ActOutcome:
        """Certify the last posture of a motion and append the act to it."""
        contacts, act = list(schedule.sequence[-1].stance), self.act
        largest = largest_force(self._body, motion.q[-1], contacts, act, self._friction)
        forces = share_force(self._body, motion.q[-1], contacts, act, self._friction)
        summary = _summary(act, largest, forces)
        if forces is None or forces.torque_share > 1.0:
            weak = "friction and balance allow" if forces is None else f"{forces.tightest} allows"
            return ActOutcome(
                summary, failure=f"the last posture cannot {act.kind} with {act.force:g} N: {weak} less"
            )
        return ActOutcome(summary, plan_act(motion, schedule, forces, self._ramp, self._hold))

    def measure(self, executed: Motion, planned: PlannedAct) -> ActOutcome:
        """Measure an executed act; without a failure of its own where it was not reached."""
        act = self.act
        measured = measure_act(
            executed, planned.schedule, act, planned.timing, self._body.mass, self._friction
        )
        if measured is None:
            return ActOutcome({})
        wrong = abs(measured.mean_force - act.force) > FORCE_ERROR * act.force
        reason = f"the mean force was {measured.mean_force:.0f} N; wanted {act.force:g} N"
        return ActOutcome(measured.summary(), failure=reason if wrong else None)


def append_act(context: RunContext, report: Report, planned: PlannedMotion) -> PlannedMotion:
    """A motion with the scenario's act at its end; as it is without one, or where it cannot be done.

    Args:
        context: Of the run.
        report: Takes the ``act`` block.
        planned: The motion to the place of the act.
    """
    act = act_of(context.scenario)
    if act is None:
        return planned
    found = ActStage(context.scenario, context.body, act).plan(planned.motion, planned.schedule)
    report.finish("act", found.summary)
    if found.planned is None:
        report.fail("wholebody", found.failure or "", planned.end, act.obstacle)
        return planned
    report.keep_motions(found.planned.schedule, found.planned.motion)
    return PlannedMotion(found.planned.schedule, found.planned.motion, found.planned)


def measured_act_failure(
    context: RunContext, report: Report, planned: PlannedMotion, executed: Motion
) -> Failure | None:
    """Add what was exerted to the report; a failure where it is too little or too much.

    Args:
        context: Of the run.
        report: Has the ``act`` block.
        planned: The motion, with its act or without one.
        executed: What the physics engine made of it.
    """
    act = act_of(context.scenario)
    if act is None or planned.act is None:
        return None
    found = ActStage(context.scenario, context.body, act).measure(executed, planned.act)
    report.finish("act", report.summary["act"] | found.summary)
    if found.failure is None:
        return None
    return Failure("execution", found.failure, planned.act.timing.end, act.obstacle)


def _summary(act: Act, largest: BracedForces | None, forces: BracedForces | None) -> dict[str, Any]:
    return {
        "kind": str(act.kind), "on": act.obstacle, "wanted_force_N": act.force,
        "largest_force_N": 0.0 if largest is None else largest.force,
        "max_torque_share": None if forces is None else forces.torque_share,
        "tightest_joint": None if forces is None else forces.tightest,
        "equilibrium_residual": None if forces is None else forces.residual,
    }  # fmt: skip
