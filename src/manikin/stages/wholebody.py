"""The whole-body stage: a motion of all joints that follows the centre of mass, and its report."""

from dataclasses import asdict
from typing import Any

import numpy as np

from manikin.centroidal import CentroidalResult
from manikin.motion import Motion
from manikin.stages.context import RunContext
from manikin.stages.key_postures import KeyedPlan
from manikin.stages.planned_motion import use_of_friction
from manikin.stages.report import Report
from manikin.wholebody import WholeBodyResult, plan_whole_body
from manikin.wholebody.point_mass import point_mass_motion


def follow_centre_of_mass(context: RunContext, report: Report, plan: KeyedPlan) -> WholeBodyResult | None:
    """Plan all joints along a trajectory of the centre of mass; None where there is none.

    Args:
        context: Of the run.
        report: Takes the ``wholebody`` block.
        plan: The trajectory with its key postures.
    """
    trajectory = plan.trajectory
    if trajectory is None:
        return None
    rng = np.random.default_rng(context.scenario.seed)
    unused = rng.bit_generator.state
    result = plan_whole_body(
        context.body, context.scene, trajectory, rng=rng, settings=context.settings,
        padded=context.padded, key_postures=context.known_postures, waypoints=plan.postures,
        progress=lambda share: report.progress("wholebody", share),
    )  # fmt: skip
    drawn = rng.bit_generator.state != unused
    passage = context.passage(trajectory.schedule, result.motion).summary()
    used = {"friction": use_of_friction(trajectory.schedule, result.motion)}
    report.finish("wholebody", wholebody_summary(result) | passage | used | {"seed_matters": drawn})
    report.require("wholebody", result.requirements)
    report.planned = result.succeeded
    if result.failure is not None:
        report.fail("wholebody", result.failure.reason, result.failure.time, result.failure.where)
    report.keep_motions(trajectory.schedule, result.motion)
    return result


def move_point_mass(report: Report, centroidal: CentroidalResult) -> Motion | None:
    """Motion of a body that has no joints to plan for and nothing to execute; None without a plan.

    Args:
        report: Keeps the motion.
        centroidal: The plan of its centre of mass.
    """
    if centroidal.trajectory is None:
        return None
    motion = point_mass_motion(centroidal.problem, centroidal.trajectory, centroidal.polytopes)
    report.keep_motions(centroidal.trajectory.schedule, motion)
    report.planned = centroidal.succeeded
    return motion


def wholebody_summary(result: WholeBodyResult) -> dict[str, Any]:
    """Return the ``wholebody`` block of the summary."""
    certificate = result.certificate
    return {
        "method": "follow",
        "max_support_error_m": certificate.max_support_error_m,
        "max_meeting_error_m": certificate.max_meeting_error_m,
        "max_com_error_m": certificate.max_com_error_m,
        "min_clearance_m": certificate.min_clearance_m,
        "closest_pair": list(certificate.closest_pair),
        "max_scuff_m": certificate.max_scuff_m,
        "max_joint_limit_violation_rad": certificate.max_joint_limit_violation_rad,
        "max_velocity_share": certificate.max_velocity_share,
        "max_torque_share": certificate.max_torque_share,
        "max_torque_joint": certificate.tightest_joint,
        "max_torque_at_s": certificate.worst_times_s["max_torque_share"],
        "impacts": [asdict(impact) for impact in certificate.impacts],
        "min_margin": float(result.motion.margin.min()),
        "min_force_at_com_N": certificate.min_force_at_com_N,
        "min_zmp_distance_m": certificate.min_zmp_distance_m,
        "swings": [{"effector": s.swing.effector, "method": s.method} for s in result.swings],
        "wall_s": result.wall_time,
    }
