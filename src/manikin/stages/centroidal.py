"""The centroidal stage: a balanced trajectory of the centre of mass, and its report."""

from typing import Any

import numpy as np

from manikin.balance import motion_margin
from manikin.balance.contact_forces import friction_use
from manikin.centroidal import (
    CentroidalResult,
    CentroidalTrajectory,
    KeyframeProblem,
    KeyframeResult,
    plan_com,
    plan_com_through_key_frames,
)
from manikin.centroidal.certificate import phase_times
from manikin.stages.context import RunContext
from manikin.stages.report import Report, place
from manikin.stages.world_frame import trajectory_in_world
from manikin.wholebody.point_mass import point_mass_forces


def plan_centre_of_mass(context: RunContext, report: Report) -> CentroidalResult:
    """Plan the centre of mass on the supports, freely timed or through the key frames of a recording.

    Args:
        context: With supports.
        report: Takes the ``centroidal`` block.
    """
    report.progress("centroidal", 0.0)
    problem = context.posed_problem()
    recorded = isinstance(problem, KeyframeProblem)
    result = plan_com_through_key_frames(problem) if recorded else plan_com(problem)
    report_centre_of_mass(report, result, centroidal_summary(result))
    if result.failure is not None:
        failure = result.failure
        where = place(failure.phase, failure.where)
        report.fail("centroidal", failure.reason, failure.time or 0.0, where)
    report.progress("centroidal", 1.0)
    return result


def report_centre_of_mass(report: Report, result: CentroidalResult, block: dict[str, Any]) -> None:
    """Take a plan into the report, with its trajectory.

    Args:
        report: Of the run.
        result: The plan.
        block: Its ``centroidal`` block.
    """
    report.finish("centroidal", block)
    if result.certificate is not None:
        report.require("centroidal", result.certificate.table(result.problem))
    if result.trajectory is not None:
        report.keep("com_trajectory", trajectory_in_world(result.trajectory, report.transform).to_dict())


def centroidal_summary(result: CentroidalResult) -> dict[str, Any]:
    """Return the ``centroidal`` block of the summary."""
    trajectory = result.trajectory
    recorded = isinstance(result, KeyframeResult)
    return {
        "method": "keyframes" if recorded else "timing-free",
        "added_key_frames_s": sorted(result.added_times) if recorded else None,
        "duration_s": None if trajectory is None else trajectory.duration,
        "phase_durations_s": None if trajectory is None else trajectory.schedule.durations.tolist(),
        "min_margin": result.d_min,
        "margin_unit": result.problem.margin_unit,
        "friction": None if trajectory is None else _friction(trajectory),
        "limiting_phase": result.limiting_phase,
        "limiting_contact": limiting_contact(result),
        "min_force_at_com_N": least_force_at_com(result),
        "min_zmp_distance_m": None if result.certificate is None else result.certificate.min_zmp_distance,
        "feasibility_radius": result.feasibility_radius,
        "replans": 0,
        "key_postures": None,
        "wall_s": result.wall_time,
    }


def least_force_at_com(result: CentroidalResult) -> float | None:
    """Smallest force at the CoM that would end the point mass's balance, every millisecond [N]."""
    trajectory = result.trajectory
    if trajectory is None:
        return None
    times = phase_times(trajectory)
    phases = np.repeat(np.arange(len(times)), [len(instants) for instants in times])
    instants = np.concatenate(times)
    found = motion_margin(
        [phase.stance for phase in trajectory.schedule.sequence], phases,
        trajectory.pseudo_wrench(instants), trajectory.position(instants), polytopes=result.polytopes,
    )  # fmt: skip
    return found.min_force


def limiting_contact(result: CentroidalResult) -> str | None:
    """Contact and limit behind the smallest margin, such as ``"left_foot: tipping over ..."``."""
    limiting = result.limiting
    return None if limiting is None else limiting.description


FORCE_STEP = 0.02
"""Time between the samples at which the use of friction is measured [s]."""


def _friction(trajectory: CentroidalTrajectory) -> dict[str, float | str]:
    """Use of friction by the contact forces of the point mass, the least ones that carry it."""
    time = np.linspace(0.0, trajectory.duration, max(2, round(trajectory.duration / FORCE_STEP) + 1))
    forces = point_mass_forces(trajectory, time)
    return friction_use(trajectory.schedule, time, trajectory.schedule.sequence.effectors, forces).summary()
