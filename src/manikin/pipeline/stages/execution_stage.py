"""Execution stage: the planned motion, with its act, under control in the physics engine.

The act at the end of a motion is certified and appended to it before, and measured afterwards.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from joblib import cpu_count

from manikin.balance.contact_forces import FrictionUse, friction_share
from manikin.contact import ContactKind, ContactSchedule, FrictionModel, StanceSequence
from manikin.control import ControlSettings, ReturnSettings, ShiftSettings, SoleRoom, SupportSettings
from manikin.motion import Motion
from manikin.pipeline.stages.context import Report, RunContext, StageFailure, place
from manikin.planning import push_pull
from manikin.planning.push_pull import Act, ActKind, BracedForces, PlannedAct
from manikin.runtime.requirement import Requirement, RequirementTable, requirement_table
from manikin.scenarios import Scenario
from manikin.simulation import Execution, Push, execute, push_on_the_way
from manikin.simulation.execution import ARRIVED, BACK
from manikin.simulation.trials import TrialTask, run_trials
from manikin.simulation.uncertainty import Uncertainty


@dataclass(frozen=True)
class ExecutionRequirements:
    """Limits that an executed motion must keep to count as a success.

    Attributes:
        com_rms_error: Root mean square distance of the CoM from its plan [m].
        foot_error: Largest distance of an effector from its plan [m].
        margin: Least margin, exclusive [N.m].
        walked_margin_share: Share of the control steps of a walk that need such a margin: feet that strike
            the ground and roll carry nothing, or a line, for some milliseconds.
        penetration: Deepest penetration of hard contacts [m]; ``padding_compression`` where the motion
            ends on a seat, whose impact shakes every contact.
        padding_compression: Deepest one of padded obstacles, which give way [m].
    """

    com_rms_error: float = 0.015
    foot_error: float = 0.02
    margin: float = 0.0
    walked_margin_share: float = 0.97
    penetration: float = 0.005
    padding_compression: float = 0.01

    def table(self, execution: Execution, seated: bool = False, walked: float = -np.inf) -> RequirementTable:
        """Every requirement with its measured value, of a motion that may end ``seated``.

        Where what was measured does not say when, the time is that of the least margin. A body that was
        pushed is out of balance and off its plan for a while; it has to be back on it at the end.

        Args:
            execution: The motion as executed.
            seated: Whether it ends on a seat.
            walked: Time until which it walks [s].
        """
        if execution.push is not None:
            rest = self._returned(execution, walked > -np.inf)
        else:
            rest = self._followed(execution, seated, walked)
        return requirement_table([*_kept_standing(execution), *rest])

    def _followed(self, execution: Execution, seated: bool, walked: float) -> list[Requirement | None]:
        """Requirements of a body that nothing disturbs."""
        deepest, motion = self.padding_compression if seated else self.penetration, execution.motion
        thinnest, pressed = float(motion.time[np.argmin(motion.margin)]), execution.max_padding_compression_m
        return [
            *self._balanced(execution.motion, walked),
            Requirement("com_rms_error_m", "RMS error of the centre of mass", "m",
                        execution.com_rms_error_m, "<=", self.com_rms_error, thinnest),
            Requirement("max_foot_error_m", "error", "m", execution.max_foot_error_m, "<=", self.foot_error,
                        execution.worst_effector_time_s, execution.worst_effector),
            Requirement("max_penetration_m", "penetration", "m", execution.max_penetration_m, "<=", deepest,
                        thinnest),
            Requirement("max_padding_compression_m", "compression of padding", "m", pressed, "<=",
                        self.padding_compression, thinnest) if pressed > 0.0 else None,
        ]  # fmt: skip

    def _balanced(self, motion: Motion, walked: float) -> list[Requirement | None]:
        """Of every control step after a walk, and of a share of those of the walk."""
        walks, name = motion.time <= walked + 1e-9, "executed margin"
        stepping, after = motion.margin[walks], motion.margin[~walks]
        return [
            Requirement("margin_share", f"share of the walk with an {name}", "",
                        float(np.mean(stepping > self.margin)), ">=", self.walked_margin_share,
                        float(motion.time[walks][np.argmin(stepping)])) if stepping.size else None,
            Requirement("min_margin", name, motion.margin_unit, float(after.min()), ">", self.margin,
                        float(motion.time[~walks][np.argmin(after)])) if after.size else None,
        ]  # fmt: skip

    def _returned(self, execution: Execution, walks: bool) -> list[Requirement | None]:
        """Requirements of a body that was pushed: it has to come back to its plan, and a walk to its end."""
        push, end = execution.push, float(execution.motion.time[-1])
        if push is None:
            return []
        return [
            Requirement("final_com_error_m", "distance of the centre of mass from its plan at the end", "m",
                        execution.final_com_error_m, "<=", BACK, end),
            Requirement("max_foot_deviation_m", "distance of an effector from its plan at the end", "m",
                        push.max_foot_deviation_m, "<=", self.foot_error, end),
            Requirement("moved_m", "distance of the end of the walk from where it was planned", "m",
                        execution.moved_m, "<=", ARRIVED, end) if walks else None,
        ]  # fmt: skip


def _kept_standing(execution: Execution) -> list[Requirement]:
    """Requirements of every execution: no fall, no unplanned touch."""
    touches, first = execution.counted_touches, next(iter(execution.counted_touches), None)
    begun = (None, "") if first is None else (first.time, f"{first.segment} on {first.other}")
    fallen = execution.failure_time_s if execution.fell else None
    return [
        Requirement("fell", "falls", "", float(execution.fell), "<=", 0.0, fallen),
        Requirement("unplanned_touches", "unplanned touches", "", float(len(touches)), "<=", 0.0, *begun),
    ]


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """Motion that is to be executed: contacts in time, all joints, and the act at the end of both.

    Attributes:
        walked: Time until which it walks on rolling feet [s]; before all times where it does not.
        room: Measures the room of soles beside what stands on the floor; None where nothing does.
    """

    schedule: ContactSchedule
    motion: Motion
    act: PlannedAct | None = None
    walked: float = -np.inf
    room: SoleRoom | None = None

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return float(self.motion.time[-1])

    def then(self, after: "PlannedMotion") -> "PlannedMotion":
        """Two motions, of which the second begins at rest in the last posture of this one, as one."""
        delay, schedule = self.end - float(after.motion.time[0]), after.schedule
        instants = np.concatenate([self.schedule.instants, schedule.instants[1:] + delay])
        phases = StanceSequence([*self.schedule.sequence, *schedule.sequence])
        joined = ContactSchedule(phases, instants), self.motion.then(after.motion)
        return PlannedMotion(*joined, after.act, self.walked, self.room)


FORCE_ERROR = 0.05
"""Largest error of the mean force that was exerted, as a share of what is wanted."""


def act_of(scenario: Scenario) -> Act | None:
    """The act of a scenario, or None."""
    act = scenario.file.task.act
    return None if act is None else Act(ActKind(act.kind), act.on, act.direction, act.force_N)


def append_act(context: RunContext, report: Report, planned: PlannedMotion) -> PlannedMotion:
    """A motion with the scenario's act at its end; as it is without one, or where it cannot be done.

    The last posture is certified for the act first.
    """
    act, section = act_of(context.scenario), context.scenario.file.task.act
    if act is None or section is None:
        return planned
    q, contacts = planned.motion.q[-1], list(planned.schedule.sequence[-1].stance)
    rub = context.scenario.explicit_supports().friction, context.scenario.contact_model.friction
    largest = push_pull.largest_force(context.body, q, contacts, act, *rub)
    forces = push_pull.share_force(context.body, q, contacts, act, *rub)
    used = (
        None if forces is None else _used_friction(planned, forces, context.scenario.contact_model.friction)
    )
    report.finish("act", _summary(act, largest, forces) | {"friction": used})
    if forces is not None:
        row = Requirement("max_torque_share", "share of a torque limit in the act", "", forces.torque_share,
                          "<=", 1.0, planned.end, forces.tightest)  # fmt: skip
        report.require("act", RequirementTable((row,)))
    if forces is None or forces.torque_share > 1.0:
        weak = "friction and balance allow" if forces is None else f"{forces.tightest} allows"
        reason = f"the last posture cannot {act.kind} with {act.force:g} N: {weak} less"
        report.planned = False
        report.fail("wholebody", reason, planned.end, act.obstacle)
        return planned
    acting = push_pull.plan_act(planned.motion, planned.schedule, act, forces, section.ramp_s, section.hold_s)
    report.keep_motions(acting.schedule, acting.motion)
    return replace(planned, schedule=acting.schedule, motion=acting.motion, act=acting)


def measured_act_failure(
    context: RunContext, report: Report, planned: PlannedMotion, executed: Motion
) -> StageFailure | None:
    """Add what was exerted to the report; a failure where it is too little or too much, or nothing."""
    act, acting = act_of(context.scenario), planned.act
    if act is None or acting is None:
        return None
    friction = context.scenario.explicit_supports().friction
    result = push_pull.measure_act(executed, acting.schedule, act, acting.timing, context.body.mass, friction)
    if result is None:
        reason = "the motion did not come to its act"
        return StageFailure("execution", reason, acting.timing.end, act.obstacle)
    report.finish("act", report.summary["act"] | result.summary())
    error, largest = abs(result.mean_force - act.force), FORCE_ERROR * act.force
    row = Requirement("mean_force_error_N", "error of the mean force", "N", error, "<=", largest,
                      acting.timing.end, act.obstacle)  # fmt: skip
    report.require("act execution", RequirementTable((row,)))
    reason = f"the mean force was {result.mean_force:.0f} N; wanted {act.force:g} N"
    return None if row.held else StageFailure("execution", reason, acting.timing.end, act.obstacle)


def _used_friction(
    planned: PlannedMotion, forces: BracedForces, model: FrictionModel
) -> dict[str, float | str]:
    """Largest share of the friction that the feet use while they act."""
    held = zip(planned.schedule.sequence[-1].stance, forces.contact_force, strict=True)
    share, effector = max(
        (float(friction_share(contact, force[None, :3], model)[0]), contact.effector)
        for contact, force in held
        if contact.kind is not ContactKind.GRASP
    )
    return FrictionUse(model, share, planned.end, effector).summary()


def _summary(act: Act, largest: BracedForces | None, forces: BracedForces | None) -> dict[str, Any]:
    return {
        "kind": str(act.kind), "on": act.obstacle, "wanted_force_N": act.force,
        "largest_force_N": 0.0 if largest is None else largest.force,
        "max_torque_share": None if forces is None else forces.torque_share,
        "tightest_joint": None if forces is None else forces.tightest,
        "equilibrium_residual": None if forces is None else forces.residual,
    }  # fmt: skip


def execute_motion(
    context: RunContext, report: Report, planned: PlannedMotion, requirements: ExecutionRequirements
) -> Execution:
    """Execute a motion, with the scenario's push and its act, and measure the result.

    A body that may be pushed is ready for it, but not told when or whence; see
    :mod:`manikin.control.plan_return` and, of a walk, :mod:`manikin.control.capture_step`.
    """
    scenario, act = context.scenario, planned.act
    # The share of the friction that planning keeps to, where it has its own, holds in control too.
    supports = SupportSettings(friction_share=scenario.friction_share)
    # What follows a walk is where it is, and no plan of steps.
    stepping = ShiftSettings(room=planned.room) if planned.walked >= planned.end else None
    # Feet of a walk land at speed, and their toes bounce.
    settings = ControlSettings(supports=supports, watch_toes=planned.walked > -np.inf)
    disturbed = replace(settings, returning=ReturnSettings(), stepping=stepping)
    if scenario.file.push is not None:
        settings = disturbed
    pushes, wishes = _pushes(scenario, planned.motion), () if act is None else tuple(act.wishes)
    result = execute(
        context.body, context.scene, planned.motion, planned.schedule,
        pushes=pushes, padded=context.padded, settings=settings, wishes=wishes,
        progress=lambda share: report.progress("execution", share),
    )  # fmt: skip
    table = requirements.table(result, scenario.seated_from is not None, planned.walked)
    report.require("execution", table)
    fallen = _failure(planned.schedule, result, table)
    exerted = measured_act_failure(context, report, planned, result.motion)
    failure = exerted if fallen is None else fallen
    summary = result.summary()
    if (push := summary["push"]) is not None:
        push["direction_deg"] = report.transform.turned(push["direction_deg"])
    block = {
        "required": True, "failure": None if failure is None else asdict(failure), **summary,
        **context.measured(result.schedule or planned.schedule, result.motion),
    }  # fmt: skip
    report.finish("execution", block)
    report.proved = failure is None
    if failure is not None:
        report.fail(failure.stage, failure.reason, failure.time_s, failure.where)
    report.keep_motions(planned.schedule, planned.motion, result.motion)
    if failure is None and scenario.file.execution.trials > 0:
        task = TrialTask(
            context.body, context.scene, planned.motion, planned.schedule, disturbed, tuple(context.padded),
            wishes, pushes,
        )  # fmt: skip
        report.finish("trials", _trials(scenario, task, report))
    return result


def _trials(scenario: Scenario, task: TrialTask, report: Report) -> dict[str, Any]:
    """The "trials" block: the motion in other worlds, by a body that is ready to be pushed."""
    section = scenario.file.execution
    given = section.uncertainty.model_dump(exclude_none=True)
    uncertainty = replace(Uncertainty.of(task.body).scaled(given.pop("factor")), **given)
    outcome = run_trials(
        task, section.trials, uncertainty=uncertainty, seed=scenario.seed, workers=cpu_count(),
        progress=lambda share: report.progress("trials", share),
    )  # fmt: skip
    return outcome.summary() | {"uncertainty": asdict(uncertainty)}


def _failure(schedule: ContactSchedule, result: Execution, table: RequirementTable) -> StageFailure | None:
    """Requirement that the execution itself broke, or None."""
    broken = table.first_broken
    if result.failure:
        reason, time = result.failure, float(result.failure_time_s or 0.0)
    elif broken is not None:
        reason, time = broken.reason, broken.time_s or 0.0
    else:
        return None
    phase = int((result.schedule or schedule).phase_at(time))
    held = ", ".join(schedule.sequence[phase].stance.effectors)
    return StageFailure("execution", reason, time, place(phase, held))


def _pushes(scenario: Scenario, motion: Motion) -> tuple[Push, ...]:
    """The push that a scenario asks for, its direction seen from where the body faces then."""
    push = scenario.file.push
    if push is None:
        return ()
    scenario.check_push(float(motion.time[-1]))
    timing = push.at_s, push.duration_s, push.frequency_hz or 0.0
    return (push_on_the_way(motion, push.force_N, push.direction_deg, *timing),)
