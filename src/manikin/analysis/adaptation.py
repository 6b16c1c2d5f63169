"""A recorded motion adapted to another body or place, balanced and executed ([Qiu2012]_ 5.3.3, 7.3).

On its own stances, with the same body, it is re-planned.

The centre of mass is planned by either method of [Qiu2012]_ chapter 5.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from manikin.analysis.contact_adaptation import (
    landing_flat,
    leaving_with_the_hinge,
    on_one_seat,
    rising_at_once,
    scene_under,
    within_toe_strength,
    without_remnants,
)
from manikin.analysis.motion_transfer import MotionOnContacts, carried_over
from manikin.analysis.posture_adaptation import AdaptedMotion, adapt_postures, rate_as_recorded, rate_on_plan
from manikin.body import BodyModel
from manikin.contact import ContactSchedule, Phase, StanceSequence
from manikin.control import ControlSettings, TaskWeights
from manikin.control.settings import Impedance
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.file import MotionFile
from manikin.numerics.spatial import FloatArray, PlanarTransform
from manikin.planning.com import (
    BentSurface,
    CentroidalProblem,
    CentroidalResult,
    KeyframeProblem,
    NearKeyFramesResult,
    RecordedCom,
    height_band,
    plan_com,
    plan_com_near_key_frames,
)
from manikin.recordings import Reconstruction, RecordedSupports, motion_of, recorded_schedule, smoothed
from manikin.recordings.reconstruction.marker_reconstruction import seen_targets
from manikin.recordings.supports.recorded_stances import FRICTION
from manikin.scene import Scene
from manikin.simulation import Execution, execute

LEAST_FRAMES = 4
"""Frames of a part, at least: of fewer there are no accelerations."""


def crop(
    found: Reconstruction, supports: RecordedSupports, start: float, end: float
) -> tuple[Reconstruction, RecordedSupports]:
    """Cut a reconstruction and its supports, so that the first instant left is 0 on both clocks.

    The window is on the clock of the supports [s], with at least four frames.
    """
    time = supports.start + found.time
    rows = np.flatnonzero((time >= start - 1e-9) & (time <= end + 1e-9))
    if len(rows) < LEAST_FRAMES:
        valid = f"at least {LEAST_FRAMES} between {time[0]:g} and {time[-1]:g} s"
        raise InputError(f"window from {start:g} to {end:g} s leaves {len(rows)} frames; valid: {valid}")
    begin, last = float(time[rows[0]]), float(time[rows[-1]])
    targets, seen = seen_targets(found.targets, rows)
    part = replace(
        found, time=found.time[rows] - found.time[rows[0]], q=found.q[rows], targets=targets,
        residual=found.residual[np.ix_(rows, seen)], first_frame=found.first_frame + int(rows[0]),
    )  # fmt: skip
    held = tuple(
        replace(
            one, start=max(one.start - begin, 0.0), end=min(one.end, last) - begin,
            start_seen=one.start_seen and one.start >= begin, end_seen=one.end_seen and one.end <= last,
        )
        for one in supports.supports
        if one.start < last and one.end > begin
    )  # fmt: skip
    return part, RecordedSupports(held, 0.0, last - begin, supports.surfaces)


Method = Literal["keyframes", "timing-free"]
"""``keyframes``: near the recorded positions at the recorded instants (5.3), kept in balance all along;
``timing-free``: only the stances, both ends and the reach are kept (5.4)."""

METHODS: tuple[Method, ...] = get_args(Method)

SHORTEST, LONGEST = 0.5, 2.0
"""Bounds of a phase that is planned timing-free, as shares of its recorded duration: a leg needs time to
swing, and phases of a walk are no places to stay."""

HEIGHT_ROOM = 0.1
"""Room beyond the recorded heights of the centre of mass, for a plan that is timing-free [m]."""


def plan_recorded_com(
    mass: float, recording: RecordedCom, velocity: FloatArray, method: Method
) -> CentroidalResult:
    """Plan the centre of mass of a mass [kg].

    The timing-free method keeps the velocity (2, 3) of the recorded one at both ends [m/s].
    """
    if method == "keyframes":
        return plan_near_recorded_com(mass, recording)
    durations = zip(recording.sequence, recording.schedule.durations.tolist(), strict=True)
    free = [Phase(phase.stance, SHORTEST * lasting, LONGEST * lasting) for phase, lasting in durations]
    # Recorded heights with some room: contacts alone would admit a way through the floor.
    heights = recording.com[:, 2]
    ends = heights.min() - HEIGHT_ROOM, heights.max() + HEIGHT_ROOM
    return plan_com(CentroidalProblem(
        mass, StanceSequence(free), recording.com[0], recording.com[-1],
        start_velocity=velocity[0], goal_velocity=velocity[1], support_distance=farthest_support(recording),
        geometric=height_band(*(BentSurface(float(height), 0.0, 0.0, 0.0) for height in ends)),
    ))  # fmt: skip


def plan_near_recorded_com(mass: float, recording: RecordedCom) -> NearKeyFramesResult:
    """Plan the centre of mass of a mass [kg] near the recorded one."""
    return plan_com_near_key_frames(KeyframeProblem(mass, recording, start_velocity=None, goal_velocity=None))


def farthest_support(recording: RecordedCom) -> float:
    """Largest distance of the recorded centre of mass from a contact ([Qiu2012]_ Table 3.5, 5.26) [m]."""
    phases, distances = recording.schedule.phase_at(recording.time), [0.0]
    for index, phase in enumerate(recording.sequence):
        # The last sample of a phase is the first of the next one.
        rows = np.flatnonzero(phases == index)
        com = recording.com[rows[0] : rows[-1] + 2]
        distances += [np.linalg.norm(com - contact.position, axis=1).max() for contact in phase.stance]
    return float(max(distances))


SETTINGS = ControlSettings(
    period=0.002, weights=TaskWeights(flying=5e3, posture=60.0), watch_toes=True,
    toes_back=Impedance(1e4, 250.0),
)  # fmt: skip
"""Settings of the execution. A recorded posture is worth six times as much as one that was only preferred:
that keeps arms off the trunk while they make up for what the contacts do not give. Feet in flight count less
than the centre of mass, and those that stand more: where a hip was too weak for a swing, the body was thrown
up after its foot, off the ground. Feet land at speed: one that bounces off by a hair is pushed down at 1 m/s
if the torques of its load are held for 5 ms."""


@dataclass(frozen=True, eq=False)
class Adaptation:
    """A recording, its plan on a body in a place, and what became of it; what failed is None.

    Attributes:
        method: Of the centre of mass.
        source: The recorded motion on its contacts.
        carried: The same on the body and in the place it is adapted to, before it is balanced.
        recording: Centre of mass of ``carried`` on its stances.
        recorded: The recorded motion, smoothed, its time 0 at the first instant.
        adapted: The postures on the planned centre of mass.
    """

    method: Method
    source: MotionOnContacts
    carried: MotionOnContacts
    recording: RecordedCom
    recorded: Motion
    com: CentroidalResult
    adapted: AdaptedMotion | None = None
    execution: Execution | None = None

    @property
    def body(self) -> BodyModel:
        """Who makes the motion."""
        return self.carried.body

    @property
    def scene(self) -> Scene:
        """Where it is made."""
        return self.carried.scene

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
        """Content of its motion file."""
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
            "method": self.method, "succeeded": self.com.succeeded,
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
            "wholebody": self._adapted_block(), "execution": self._execution_block(),
        }  # fmt: skip

    def _adapted_block(self) -> dict[str, Any] | None:
        if self.adapted is None:
            return None
        measured = self.adapted.certificate
        names = ("max_support_error_m", "max_com_error_m", "min_clearance_m", "max_torque_share")
        return {name: measured.value(name) for name in names} | {
            "closest_pair": list(measured.closest_pair), "posture_rms_rad": self.adapted.posture_rms,
            "share_positive_margin": float(np.mean(self.adapted.motion.margin > 0.0)),
        }  # fmt: skip

    def _execution_block(self) -> dict[str, Any] | None:
        if (found := self.execution) is None:
            return None
        left_out = ("push", "peak_torque_Nm")
        return {
            "failure": found.failure or None, "executed_s": found.motion.duration,
            "share_positive_margin": float(np.mean(found.motion.margin > 0.0)),
        } | {name: value for name, value in found.summary().items() if name not in left_out}  # fmt: skip


def adapt_recording(
    found: Reconstruction, supports: RecordedSupports, *, body: BodyModel | None = None,
    scene: Scene | None = None, transform: PlanarTransform | None = None, pace: float = 1.0,
    method: Method = "keyframes", execute: bool = False, rolling: bool = True, friction: float = FRICTION,
) -> Adaptation:  # fmt: skip
    """Adapt a recorded motion to another body or another place, and execute it if asked to.

    Without either it is re-planned on the stances it was recorded on.

    Args:
        found: The postures, not yet smoothed.
        supports: What the person stood, sat or leaned on.
        body: Who makes the motion; the recorded person if None.
        scene: Where; a floor and blocks under what stands or sits higher if None.
        transform: From the frame of the recording to that of the scene; none if None.
        pace: Duration as a multiple of the recorded one, or of a dynamically similar one.
        method: Of the centre of mass.
        execute: Whether the recorded postures are adapted to the plan and executed.
        rolling: Whether a foot may stand on its toes alone; without, it stands on its whole sole.
        friction: Coefficient of feet and seat.

    Raises:
        InputError: If the method is unknown, the recording has no support at some time, or the body is no
            human.
        NoPlaceError: If a contact finds no surface in the scene.
    """
    source = recorded_on_contacts(found, supports, rolling=rolling, friction=friction)
    carried = carried_over(source, body, scene, transform)
    return adapt_carried(source, carried, motion_of(found), pace=pace, method=method, execute=execute)


def adapt_carried(
    source: MotionOnContacts, carried: MotionOnContacts, recorded: Motion, *, pace: float = 1.0,
    method: Method = "keyframes", execute: bool = False, padded: Sequence[str] = (),
) -> Adaptation:  # fmt: skip
    """Balance a motion that was carried over, and execute it if asked to.

    Args:
        source: The recorded motion on its contacts.
        carried: The same on the body and in the place it is adapted to.
        recorded: The recorded motion, smoothed.
        pace: Duration as a multiple of that of ``carried``.
        method: Of the centre of mass.
        execute: Whether the postures are adapted to the plan and executed.
        padded: Names of the obstacles that any part of the body may lean on.

    Raises:
        InputError: If the method is unknown, or there is no support at some time.
    """
    if method not in METHODS:
        raise InputError(f"method is {method!r}; valid: {', '.join(METHODS)}")
    timed = carried.slowed(pace)
    timed = replace(timed, schedule=within_toe_strength(timed.schedule, timed.body))
    stances = timed.schedule
    recording = RecordedCom(timed.time, timed.com, stances.sequence, stances.instants)
    velocity = np.gradient(timed.com, timed.time, axis=0, edge_order=2)[[0, -1]]
    if method == "keyframes":
        recording = _with_turning(timed, recording)
    com = plan_recorded_com(timed.body.mass, recording, velocity, method)
    result = Adaptation(method, source, timed, recording, recorded, com)
    return _executed(result, padded) if execute else result


def recorded_on_contacts(
    found: Reconstruction, supports: RecordedSupports, *, rolling: bool = True, friction: float = FRICTION
) -> MotionOnContacts:
    """The recorded motion, smoothed, on stances that a body of stiff segments can use.

    Raises:
        InputError: If the body has no feet with soles, or there are no two instants.
    """
    even, time = smoothed(found), supports.start + found.time
    stances = recorded_schedule(even, supports, friction=friction, rolling=rolling)
    stances = on_one_seat(landing_flat(stances, found.body))
    stances = leaving_with_the_hinge(stances, found.body, time, even.q)
    stances = rising_at_once(stances, found.body, time, even.q)
    stances = without_remnants(stances)
    floor = supports.surfaces[0] if supports.surfaces else 0.0
    return MotionOnContacts(found.body, scene_under(stances, floor), stances, time, even.q, floor)


def _with_turning(carried: MotionOnContacts, recording: RecordedCom) -> RecordedCom:
    """Recording with a rate of the angular momentum that the body can follow.

    First that of the recorded postures; and then that of the postures which are fitted to the plan it leads
    to, for the fit compromises between both and the contacts.
    """
    body, scene, recorded = carried.body, carried.scene, (carried.own_time, carried.q)
    recording = recording.with_angular_momentum_rate(rate_as_recorded(body, recording, recorded))
    com = plan_near_recorded_com(body.mass, recording)
    if com.trajectory is None:
        return recording
    rate = rate_on_plan(body, scene, com.trajectory, recorded, recording)
    return recording.with_angular_momentum_rate(rate)


def _executed(result: Adaptation, padded: Sequence[str]) -> Adaptation:
    body, scene, trajectory = result.body, result.scene, result.com.trajectory
    if trajectory is None:
        return result
    clock = trajectory.schedule.instants, result.recording.key_times
    recorded = result.carried.own_time, result.carried.q
    adapted = adapt_postures(body, scene, trajectory, result.com.polytopes, recorded, clock)
    execution = execute(
        body, scene, adapted.motion, trajectory.schedule, settings=SETTINGS, hold=0.0, padded=padded
    )
    return replace(result, adapted=adapted, execution=execution)
