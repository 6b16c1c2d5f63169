"""Stages of the centre of mass and of the whole body that follows it.

Between them lie the postures at the key instants; where one fails, the centre of mass is planned again.
"""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from manikin.balance import motion_margin
from manikin.balance.contact_forces import friction_use
from manikin.contact import ContactSchedule, SolePart, StanceSequence
from manikin.motion import Motion
from manikin.motion.configuration_spline import align_quaternions
from manikin.numerics.spatial import FloatArray
from manikin.pipeline.stages.context import Report, RunContext, place, reason_in_world, trajectory_in_world
from manikin.planning import com
from manikin.planning.com import CentroidalResult, CentroidalTrajectory, KeyframeProblem, KeyframeResult
from manikin.planning.com.com_certificate import phase_times
from manikin.planning.whole_body import (
    Eligibility,
    KeyPostures,
    RefineResult,
    WholeBodyResult,
    continue_seated,
    find_eligible_plan,
    find_key_postures,
    plan_whole_body,
)
from manikin.planning.whole_body.certificate import MotionCertificate
from manikin.planning.whole_body.point_mass_motion import point_mass_forces, point_mass_motion
from manikin.planning.whole_body.posture_style import Guide

KEY_ROOM = 0.5
"""Share of the fit's distance from the ends of the joint ranges that key postures keep."""
KEY_TOLERANCES = (1.0e-3, 2.0e-4)
"""Tolerances of key postures [m]: as exact as the finished motion has to be; and more, where no motion is
found although each posture was just within reach."""


EASED_MARGIN = 0.5
"""Share of the wanted margin with which a body still passes from foot to foot before it rests instead."""


@dataclass(frozen=True, eq=False)
class KeyedPlan:
    """A plan of the centre of mass with its key postures.

    Attributes:
        centroidal: The plan, the last one where it was planned again.
        trajectory: It on the real supports; None where it cannot be done.
        postures: Its key postures, or None.
        replans: Plans tried after the first one because a posture failed.
    """

    centroidal: CentroidalResult
    trajectory: CentroidalTrajectory | None = None
    postures: KeyPostures | None = None
    replans: int = 0


def with_key_postures(context: RunContext, report: Report, planned: CentroidalResult) -> KeyedPlan:
    """Find the key postures of a plan, or of another one where a posture fails; of a failed plan none."""
    if planned.trajectory is None:
        return KeyedPlan(planned)
    return _reported(report, _tested(context, report, planned, KEY_TOLERANCES[0]))


def with_stricter_key_postures(
    context: RunContext, report: Report, planned: CentroidalResult, before: KeyedPlan
) -> KeyedPlan | None:
    """Another plan where no motion was found and a key posture is only just within reach, or None.

    Args:
        report: Has the failure of the whole body, which is forgotten where there is another plan.
        before: What was found for the first plan.
    """
    if planned.trajectory is None:
        return None
    failure = report.failure
    result = _tested(context, report, planned, KEY_TOLERANCES[1])
    if result.failure is not None or result.trajectory is None or result.replans <= before.replans:
        report.failure = failure
        return None
    report.failure = None
    return _reported(report, result)


def _tested(context: RunContext, report: Report, planned: CentroidalResult, tolerance: float) -> Eligibility:
    """The plan, or another one where a key posture fails; with the fit's room in the ranges if possible."""
    result = _eligible(context, report, planned, KEY_ROOM * context.settings.fit.joint_buffer, tolerance)
    if result.failure is not None or (result.trajectory is None and result.replans > 0):
        report.failure = None  # of a seated part that did not fit another plan
        result = _eligible(context, report, planned, 0.0, tolerance)
    return result


def _eligible(
    context: RunContext, report: Report, planned: CentroidalResult, range_margin: float, tolerance: float
) -> Eligibility:
    """Test the key postures of a plan, and plan again where they fail."""
    replan = not isinstance(context.problem, KeyframeProblem)

    def realise(trajectory: CentroidalTrajectory) -> CentroidalTrajectory | None:
        return _on_real_supports(context, report, trajectory)

    def look(trajectory: CentroidalTrajectory, similar: KeyPostures | None) -> KeyPostures:
        return find_key_postures(
            context.body, context.scene, trajectory, manner=context.settings.manner,
            requirements=context.settings.requirements, range_margin=range_margin,
            tolerance=tolerance, known=_planned_postures(context, trajectory.schedule),
            padded=() if context.plan is None else context.padded, ease=replan, similar=similar,
        )  # fmt: skip

    # Where the body may rest instead, only the way that was found is mended.
    return find_eligible_plan(
        planned, realise, look, replan=replan, guesses=None if context.resting is None else 0,
    )  # fmt: skip


def _on_real_supports(
    context: RunContext, report: Report, planned: CentroidalTrajectory
) -> CentroidalTrajectory | None:
    """The plan on the real soles, friction and caps, with the seated part where there is one."""
    real, seated_from = context.scenario.build_sequence(), context.scenario.seated_from
    seat = len(real) if seated_from is None else real.begins[seated_from]
    standing = StanceSequence(real.phases[:seat])
    trajectory = replace(planned, schedule=ContactSchedule(standing, planned.schedule.instants))
    if seat == len(real):
        return trajectory
    sitting = StanceSequence(real.phases[seat:])
    continuation = continue_seated(context.body, context.scene, trajectory, sitting)
    if continuation.failure is not None:
        report.fail("wholebody", continuation.failure, trajectory.duration, f"phase {seat}")
    return continuation.trajectory


def _in_world(found: KeyPostures, report: Report) -> KeyPostures:
    transform, postures = report.transform, []
    for item in found.postures:
        reason = None if item.reason is None else reason_in_world(item.reason, transform)
        centre, q = transform.points(item.com), transform.poses(item.q)
        postures.append(replace(item, com=centre, q=q, reason=reason))
    return replace(found, postures=tuple(postures))


def _reported(report: Report, found: Eligibility) -> KeyedPlan:
    """Report a plan that was tested, and return it with its trajectory if it can be done."""
    postures = None if found.postures is None else _in_world(found.postures, report)
    block = centroidal_summary(found.centroidal) | {"replans": found.replans}
    block["key_postures"] = None if postures is None else postures.summary()
    report_centre_of_mass(report, found.centroidal, block)
    if postures is not None:
        report.keep("key_postures", postures.to_dict())
    trajectory = found.trajectory
    if found.failure is not None:
        trajectory, failed = None, found.failure.posture
        where = place(failed.phase, ", ".join(failed.contacts))
        report.fail(found.failure.stage, found.failure.reason, failed.time, where)
    return KeyedPlan(found.centroidal, trajectory, found.postures, found.replans)


def with_rolling_feet(context: RunContext, report: Report) -> RunContext | None:
    """The task on feet that roll, after the body failed to follow it on feet flat by default, or None.

    A foot that is about to leave, with the legs far apart, stands on its toes then, as a person's does.
    None where the file says how feet stand, where contacts were searched or recorded, under a push, in an
    act, where a phase has ``com_near``, and where the body fails at an end of the motion, on flat feet.
    """
    file, failure = context.scenario.file, report.failure
    if failure is None or failure.stage not in ("wholebody", "execution") or file.supports is None:
        return None
    if file.body.model != "human" or file.push is not None or file.task.act is not None:
        return None
    if context.plan is not None or context.scenario.refines or isinstance(context.problem, KeyframeProblem):
        return None
    if file.supports.foot is not None or any(phase.com_near is not None for phase in file.supports.phases):
        return None
    if not 0.0 < failure.time_s < (report.summary["centroidal"]["duration_s"] or 0.0):
        return None
    report.try_again()
    rolling = context.with_supports(context.scenario.with_overrides(["supports.foot=rolling"]))
    report.keep_scenario(rolling.scenario)
    return rolling


def plan_centre_of_mass(context: RunContext, report: Report) -> CentroidalResult:
    """Plan the centre of mass on the supports, freely timed or through the key frames of a recording."""
    report.progress("centroidal", 0.0)
    problem = context.problem
    if problem is None:
        raise context.scenario.error(("supports",), "are missing; valid: with supports")
    if isinstance(problem, KeyframeProblem):
        result = com.plan_com_through_key_frames(problem)
    else:
        # Where the body may rest instead, what one guess does not find is not worth the time.
        result = com.plan_com(problem, guesses=None if context.resting is None else 1)
        if result.failure is not None and context.resting is not None:
            result = _with_less_margin(context, report, result)
        elif result.failure is not None and context.scenario.keeps_upright:
            # The task may need a deeper bend.
            result = com.plan_com(context.scenario.build_centroidal_problem(upright=False))
    report_centre_of_mass(report, result, centroidal_summary(result))
    if (failure := result.failure) is not None:
        where = place(failure.phase, failure.where)
        report.fail("centroidal", failure.reason, failure.time or 0.0, where)
    report.progress("centroidal", 1.0)
    return result


def _with_less_margin(context: RunContext, report: Report, failed: CentroidalResult) -> CentroidalResult:
    """Plan again a body that passes with :data:`EASED_MARGIN` of the margin, where a plan had more than that.

    It keeps what it has to keep at rest, so that no margin of a file is eased; the scenario says so.
    """
    asked, resting = context.scenario, context
    while resting.resting is not None:
        resting = resting.resting
    share = max(EASED_MARGIN, resting.scenario.required_margin / max(asked.required_margin, 1e-9))
    if share >= 1.0 or (failed.d_min or 0.0) <= share * asked.required_margin:
        return failed
    eased = asked.with_overrides([f"planning.min_margin={share * asked.file.planning.min_margin!r}"])
    report.keep_scenario(eased)
    return com.plan_com(eased.build_centroidal_problem(), guesses=1)


def report_centre_of_mass(report: Report, result: CentroidalResult, block: dict[str, Any]) -> None:
    """Take a plan into the report, with its trajectory and its ``centroidal`` block."""
    refused = report.refused if report.summary["contacts"] is None else []
    on_flat_feet = next((failure for failure in refused if failure["phase"] is None), None)
    report.finish("centroidal", block | {"on_flat_feet": on_flat_feet})
    if result.certificate is not None:
        report.require("centroidal", result.certificate.table(result.problem))
    if result.trajectory is not None:
        report.keep("com_trajectory", trajectory_in_world(result.trajectory, report.transform).to_dict())


def centroidal_summary(result: CentroidalResult) -> dict[str, Any]:
    """Return the ``centroidal`` block of the summary."""
    trajectory, recorded = result.trajectory, isinstance(result, KeyframeResult)
    parts = {contact.part for phase in result.problem.sequence for contact in phase.stance}
    return {
        "method": "keyframes" if recorded else "timing-free",
        "feet": "flat" if parts.isdisjoint((SolePart.HEEL, SolePart.TOES)) else "rolling",
        "added_key_frames_s": sorted(result.added_times) if recorded else None,
        "duration_s": None if trajectory is None else trajectory.duration,
        "phase_durations_s": None if trajectory is None else trajectory.schedule.durations.tolist(),
        "min_margin": result.d_min, "margin_unit": result.problem.margin_unit,
        "friction": None if trajectory is None else _friction(trajectory),
        "limiting_phase": result.limiting_phase,
        "limiting_contact": None if result.limiting is None else result.limiting.description,
        "min_force_at_com_N": least_force_at_com(result),
        "min_zmp_distance_m": None if result.certificate is None else result.certificate.min_zmp_distance,
        "feasibility_radius": result.feasibility_radius, "replans": 0, "key_postures": None,
        "wall_s": result.wall_time,
    }  # fmt: skip


def least_force_at_com(result: CentroidalResult) -> float | None:
    """Smallest force at the CoM that would end the point mass's balance, every millisecond [N]."""
    trajectory = result.trajectory
    if trajectory is None:
        return None
    times, stances = phase_times(trajectory), [phase.stance for phase in trajectory.schedule.sequence]
    phases, instants = np.repeat(np.arange(len(times)), [*map(len, times)]), np.concatenate(times)
    wrench, position = trajectory.pseudo_wrench(instants), trajectory.position(instants)
    return motion_margin(stances, phases, wrench, position, polytopes=result.polytopes).min_force


FORCE_STEP = 0.02
"""Time between the samples at which the use of friction is measured [s]."""


def _friction(trajectory: CentroidalTrajectory) -> dict[str, float | str]:
    """Use of friction by the contact forces of the point mass, the least ones that carry it."""
    time = np.linspace(0.0, trajectory.duration, max(2, round(trajectory.duration / FORCE_STEP) + 1))
    forces = point_mass_forces(trajectory, time)
    return friction_use(trajectory.schedule, time, trajectory.schedule.sequence.effectors, forces).summary()


def follow_centre_of_mass(
    context: RunContext, report: Report, plan: KeyedPlan
) -> tuple[KeyedPlan, WholeBodyResult | None]:
    """Plan all joints along a trajectory of the centre of mass; None where there is none.

    The plan is the one that the motion follows, which may have taken more time.
    """
    trajectory = plan.trajectory
    if trajectory is None:
        return plan, None
    rng = np.random.default_rng(context.scenario.seed)
    unused = rng.bit_generator.state
    result = plan_whole_body(
        context.body, context.scene, trajectory, rng=rng, settings=context.settings,
        padded=context.padded, waypoints=plan.postures,
        known=_known_postures(context, plan, trajectory.schedule), handling=context.handling,
        progress=lambda share: report.progress("wholebody", share),
    )  # fmt: skip
    if result.trajectory is not trajectory:
        plan = _slowed(report, plan, result.trajectory)
    block = wholebody_summary(result) | {"seed_matters": rng.bit_generator.state != unused}
    report_whole_body(context, report, result.trajectory.schedule, result, block)
    return plan, result


def _slowed(report: Report, plan: KeyedPlan, trajectory: CentroidalTrajectory) -> KeyedPlan:
    """Report a plan with the trajectory that a motion follows, which took more time than was planned."""
    postures, instants = plan.postures, trajectory.schedule.instants
    if postures is not None:
        timed = (replace(item, time=float(instants[item.key])) for item in postures.postures)
        postures = replace(postures, postures=tuple(timed))
    centroidal = plan.centroidal.along(trajectory)
    return _reported(report, Eligibility(centroidal, trajectory, postures, plan.replans, None))


def _known_postures(context: RunContext, plan: KeyedPlan, schedule: ContactSchedule) -> Guide | None:
    """Postures of the contact plan in a schedule; those on the CoM of a body that passes them."""
    if context.plan is None:
        return None
    if context.resting is None or plan.postures is None:
        times, postures = context.plan.keys(schedule)
    else:
        found = plan.postures.postures
        times, postures = np.array([item.time for item in found]), np.array([item.q for item in found])
        if times[-1] < schedule.instants[-1]:  # they end as the centre of mass binds no more, on a seat
            times = np.append(times, schedule.instants[-1])
            postures = np.vstack([postures, context.plan.goal])
    return Guide(times, align_quaternions(postures), ())


def _planned_postures(context: RunContext, schedule: ContactSchedule) -> FloatArray | None:
    """(phases + 1, nq) postures of the contact plan at the key instants of a schedule; None without a plan.

    Feet that roll divide a phase in time; what is between two postures is on the line from one to the other.
    """
    if context.plan is None or len(context.plan.postures) >= len(schedule.instants):
        return None if context.plan is None else context.plan.postures
    begins = [*schedule.sequence.begins, len(schedule.sequence)]
    postures = align_quaternions(context.plan.postures)
    return Guide(schedule.instants[begins], postures, ()).at(schedule.instants)


def report_whole_body(
    context: RunContext, report: Report, schedule: ContactSchedule, result: WholeBodyResult | RefineResult,
    block: dict[str, Any],
) -> None:  # fmt: skip
    """Take a motion of all joints into the report; ``block`` is what its method says of it."""
    motion = result.motion
    measured = context.measured(schedule, motion)
    friction = friction_use(schedule, motion.time, motion.contact_names, motion.contact_force)
    report.finish("wholebody", block | measured | {"friction": friction.summary()})
    report.require("wholebody", result.requirements)
    report.planned = result.succeeded
    if result.failure is not None:
        report.fail("wholebody", result.failure.reason, result.failure.time, result.failure.where)
    report.keep_motions(schedule, motion)


def move_point_mass(report: Report, centroidal: CentroidalResult) -> Motion | None:
    """Motion of a body that has no joints to plan for and nothing to execute; None without a plan."""
    if centroidal.trajectory is None:
        return None
    motion = point_mass_motion(centroidal.problem, centroidal.trajectory, centroidal.polytopes)
    report.keep_motions(centroidal.trajectory.schedule, motion)
    report.planned = centroidal.succeeded
    return motion


def certificate_summary(certificate: MotionCertificate) -> dict[str, Any]:
    """Entries of the summary from a certificate of either method."""
    same = (
        "max_support_error_m", "min_clearance_m", "max_joint_limit_violation_rad", "max_velocity_share",
        "max_torque_share",
    )  # fmt: skip
    torque = certificate["max_torque_share"]
    return {key: certificate.value(key) for key in same} | {
        "closest_pair": list(certificate.closest_pair), "max_torque_joint": torque.where,
        "max_torque_at_s": torque.time_s, "min_force_at_com_N": certificate.min_force_at_com_N,
        "min_zmp_distance_m": certificate.min_zmp_distance_m,
    }  # fmt: skip


def wholebody_summary(result: WholeBodyResult) -> dict[str, Any]:
    """Return the ``wholebody`` block of the summary."""
    certificate = result.certificate
    return {
        "method": "follow", **certificate_summary(certificate),
        **{key: certificate.value(key) for key in ("max_meeting_error_m", "max_com_error_m", "max_scuff_m")},
        "impacts": [asdict(impact) for impact in certificate.impacts],
        "min_margin": float(result.motion.margin.min()),
        "swings": [{"effector": s.swing.effector, "method": s.method} for s in result.swings],
        "wall_s": result.wall_time,
    }  # fmt: skip
