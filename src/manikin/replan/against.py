"""A plan against the recording on whose stances it was made ([Qiu2012]_ Table 7.7, Fig. 7.16 to 7.18)."""

from dataclasses import replace

import numpy as np

from manikin.balance import motion_margin, pseudo_wrench
from manikin.centroidal.certificate import phase_margins, phase_times
from manikin.comparison.compare import RunComparison, compare_runs
from manikin.motion.file import MotionFile
from manikin.record import ComTrack, RunRecord
from manikin.replan.planned_anew import Replan
from manikin.spatial import FloatArray


def against_recording(found: Replan) -> RunComparison:
    """Compare plan and recording as two runs: timing, centre of mass and margins; the recording comes first.

    Margins of both are those of a point mass: with the recorded acceleration, and as planned.

    Args:
        found: A plan; of one that failed there is only the recording.
    """
    schedule = found.recording.schedule
    first = RunRecord(
        "recorded", MotionFile(body=found.body, scene=found.scene, schedule=schedule),
        {"succeeded": True}, found.body.mass, _recorded_track(found),
    )  # fmt: skip
    succeeded = found.com.trajectory is not None
    content = MotionFile(body=found.body, scene=found.scene, schedule=found.schedule if succeeded else None)
    second = RunRecord(
        found.method, content, {"succeeded": succeeded}, found.body.mass, _planned_track(found)
    )  # fmt: skip
    return compare_runs(first, second)


def _recorded_track(found: Replan) -> ComTrack:
    recording = found.recording
    time, com = recording.time, recording.com
    velocity = np.gradient(com, time, axis=0, edge_order=2)
    acceleration = np.gradient(velocity, time, axis=0, edge_order=2)
    return ComTrack(time, com, velocity, acceleration, _margins(found, time, com, acceleration))


def _margins(found: Replan, time: FloatArray, com: FloatArray, acceleration: FloatArray) -> FloatArray:
    wrench = pseudo_wrench(found.body.mass, com, acceleration)
    schedule = found.recording.schedule
    stances = [phase.stance for phase in schedule.sequence]
    known = found.com.polytopes
    return motion_margin(stances, schedule.phase_at(time), wrench, com, polytopes=known).margin


def _planned_track(found: Replan) -> ComTrack | None:
    trajectory = found.com.trajectory
    if trajectory is None:
        return None
    trajectory = replace(trajectory, turning=None)
    time = np.concatenate(phase_times(trajectory))
    margin = np.concatenate(phase_margins(found.com.problem, trajectory, found.com.polytopes))
    derivatives = trajectory.position, trajectory.velocity, trajectory.acceleration
    position, velocity, acceleration = (evaluate(time) for evaluate in derivatives)
    return ComTrack(time, position, velocity, acceleration, margin, found.com.problem.margin_unit)
