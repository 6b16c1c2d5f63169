"""A recorded motion planned anew on its own stances, and executed ([Qiu2012]_ 5.3.3 and 7.3)."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.centroidal import CentroidalResult, NearKeyFramesResult, Recording
from manikin.contact import ContactSchedule
from manikin.control import ControlSettings, TaskWeights
from manikin.errors import InputError
from manikin.mocap import Reconstruction, RecordedSupports, motion_of, recorded_schedule, smoothed
from manikin.mocap.recorded_stances import FRICTION
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.replan.com import METHODS, Method, plan_near_recorded_com, plan_recorded_com
from manikin.replan.contacts import (
    landing_flat,
    leaving_with_the_hinge,
    on_one_seat,
    rising_at_once,
    scene_under,
    within_toe_strength,
    without_remnants,
)
from manikin.replan.whole_body import AdaptedMotion, adapt_postures, rate_on_contacts, rate_on_plan
from manikin.scene import Scene
from manikin.simulation import Execution, execute
from manikin.spatial import FloatArray

SETTINGS = ControlSettings(weights=TaskWeights(posture=60.0))
"""Of the execution. A recorded posture is worth more than one that was only preferred: six times the usual
weight keeps arms off the trunk while they make up for what the contacts do not give."""


@dataclass(frozen=True, eq=False)
class Replan:
    """A recording, its new plan and what became of it; what was not asked for, or failed, is None.

    Attributes:
        method: Of the centre of mass.
        body: Who moves.
        scene: A floor, and blocks under what stands or sits higher.
        recording: The recorded centre of mass on the stances.
        recorded: The recorded motion, smoothed, its time 0 at the first instant.
        com: The planned centre of mass.
        adapted: The recorded postures on the planned centre of mass.
        execution: In the physics engine.
    """

    method: Method
    body: BodyModel
    scene: Scene
    recording: Recording
    recorded: Motion
    com: CentroidalResult
    adapted: AdaptedMotion | None = None
    execution: Execution | None = None

    @property
    def planned(self) -> Motion | None:
        """The planned whole-body motion."""
        return None if self.adapted is None else self.adapted.motion

    @property
    def executed(self) -> Motion | None:
        """The executed motion."""
        return None if self.execution is None else self.execution.motion

    @property
    def schedule(self) -> ContactSchedule:
        """Contacts of the plan in time; as recorded when there is none."""
        found = self.com.trajectory
        return self.recording.schedule if found is None else found.schedule

    @property
    def content(self) -> MotionFile:
        """What a motion file holds of it."""
        return MotionFile(self.planned, self.executed, self.body, self.scene, self.schedule)

    @cached_property
    def distance(self) -> FloatArray | None:
        """(n,) of the planned centre of mass from the recorded one, at equal shares of each phase [m]."""
        found = self.com.trajectory
        if found is None:
            return None
        instants = np.interp(self.recording.time, self.recording.key_times, found.schedule.instants)
        return np.linalg.norm(found.position(instants) - self.recording.com, axis=1)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, in SI units."""
        failure, distance = self.com.failure, self.distance
        near = self.com if isinstance(self.com, NearKeyFramesResult) else None
        return {
            "method": self.method,
            "succeeded": self.com.succeeded,
            "failure": None if failure is None else failure.reason,
            "recorded_duration_s": float(self.recording.time[-1]),
            "duration_s": None if distance is None else float(self.schedule.instants[-1]),
            "recorded_phase_durations_s": self.recording.schedule.durations.tolist(),
            "phase_durations_s": None if distance is None else self.schedule.durations.tolist(),
            "supports": [list(phase.stance.effectors) for phase in self.schedule.sequence],
            "com_rms_m": None if distance is None else float(np.sqrt(np.mean(distance**2))),
            "com_max_m": None if distance is None else float(distance.max()),
            "min_margin": None if distance is None else self.com.d_min,
            "margin_unit": self.com.problem.margin_unit,
            "key_frames": None if near is None else len(near.frames),
            "added_key_frames": None if near is None else len(near.added),
            "wholebody": self._adapted_block(),
            "execution": self._execution_block(),
        }

    def _adapted_block(self) -> dict[str, Any] | None:
        if self.adapted is None:
            return None
        measured = self.adapted.certificate
        names = ("max_support_error_m", "max_com_error_m", "min_clearance_m", "max_torque_share")
        return {
            **{name: float(getattr(measured, name)) for name in names},
            "closest_pair": list(measured.closest_pair),
            "posture_rms_rad": self.adapted.posture_rms,
            "share_positive_margin": float(np.mean(self.adapted.motion.margin > 0.0)),
        }

    def _execution_block(self) -> dict[str, Any] | None:
        found = self.execution
        if found is None:
            return None
        block = found.summary()
        return {
            "failure": found.failure or None,
            "executed_s": found.motion.duration,
            "share_positive_margin": float(np.mean(found.motion.margin > 0.0)),
            **{name: value for name, value in block.items() if name not in ("push", "peak_torque_Nm")},
        }


def replan(
    found: Reconstruction,
    supports: RecordedSupports,
    *,
    method: Method = "keyframes",
    execute: bool = False,
    rolling: bool = True,
    required_margin: float = 0.0,
    friction: float = FRICTION,
) -> Replan:
    """Plan a recorded motion anew on the stances it was recorded on, and execute it if asked to.

    Args:
        found: The postures, not yet smoothed.
        supports: Found from them.
        method: How the centre of mass is planned.
        execute: Whether the recorded postures are adapted to the plan and executed.
        rolling: Whether a foot may stand on its toes alone; without, it stands on its whole sole.
        required_margin: Of the planned point mass, to keep all along [N.m].
        friction: Coefficient of feet and seat.

    Raises:
        InputError: If the method is unknown, or the recording has no support at some time.
    """
    if method not in METHODS:
        raise InputError(f"replan method is {method!r}; valid: {', '.join(METHODS)}")
    even, recorded = smoothed(found), motion_of(found)
    stances = recorded_schedule(even, supports, friction=friction, rolling=rolling)
    stances = on_one_seat(landing_flat(stances, found.body))
    stances = leaving_with_the_hinge(stances, found.body, supports.start + found.time, even.q)
    stances = rising_at_once(stances, found.body, supports.start + found.time, even.q)
    stances = within_toe_strength(without_remnants(stances), found.body)
    time = supports.start + found.time
    recording = Recording(time, recorded.com, stances.sequence, stances.instants)
    velocity = np.gradient(recorded.com, recorded.time, axis=0, edge_order=2)[[0, -1]]
    scene = scene_under(stances, supports.surfaces[0] if supports.surfaces else 0.0)
    if method == "keyframes":
        recording = _with_turning(found.body, scene, recording, (even.time, even.q), required_margin)
    com = plan_recorded_com(found.body.mass, recording, velocity, method, required_margin)
    result = Replan(method, found.body, scene, recording, recorded, com)
    return _executed(result, even) if execute and com.trajectory is not None else result


def _with_turning(
    body: BodyModel,
    scene: Scene,
    recording: Recording,
    recorded: tuple[FloatArray, FloatArray],
    margin: float,
) -> Recording:
    """The same with a rate of the angular momentum that the body can follow.

    First that of the recorded postures on their contacts; and then that of the postures which are fitted to
    the plan it leads to, for the fit gives way between both.
    """
    recording = recording.with_angular_momentum_rate(rate_on_contacts(body, scene, recording, recorded))
    com = plan_near_recorded_com(body.mass, recording, margin)
    if com.trajectory is None:
        return recording
    rate = rate_on_plan(body, scene, com.trajectory, recorded, recording)
    return recording.with_angular_momentum_rate(rate)


def _executed(result: Replan, even: Reconstruction) -> Replan:
    body, scene, trajectory = result.body, result.scene, result.com.trajectory
    if trajectory is None:
        return result
    schedule = trajectory.schedule
    clock = schedule.instants, result.recording.key_times
    adapted = adapt_postures(body, scene, trajectory, result.com.polytopes, (even.time, even.q), clock)
    execution = execute(body, scene, adapted.motion, schedule, settings=SETTINGS, hold=0.0)
    return Replan(
        result.method, body, scene, result.recording, result.recorded, result.com, adapted, execution
    )  # fmt: skip
