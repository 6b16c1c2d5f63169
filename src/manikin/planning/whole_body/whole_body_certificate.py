"""Certificate of a planned whole-body motion, measured afresh at every millisecond.

Nothing here comes from the solver: placements, centre of mass, distances and dynamics are
computed again from the samples of the finished motion.

Also here. How deep feet and hands in flight go into what they have left or come to hold. Why a whole-body
motion is no success. How low a motion takes the body, and how near the head comes to the scene.

These pairs do not count as clearance, for a flight begins and ends at distance zero; what is
left out there is measured here.

People who pass under a beam were measured so ([Qiu2012]_ 3.2.3): by the lowest height of the
centre of mass; the clearance of the head is our own addition.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from manikin.balance import WrenchPolytope, motion_margin
from manikin.body import BodyModel
from manikin.body.limbs import end_segments, hanging_segment
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart
from manikin.motion import Motion
from manikin.motion.passage import Passage
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body.sliding_touchdown import Ignored, SlidingTouchdown, sliding_touchdown_errors
from manikin.planning.whole_body.swing_planner import hangs
from manikin.runtime.requirement import Requirement, RequirementTable, Sense, requirement_table
from manikin.scene import Proximity, Scene
from manikin.scene.distance import segment_of
from manikin.scene.scene import FLOOR


def deepest_penetration(
    body: BodyModel,
    proximity: Proximity,
    schedule: ContactSchedule,
    motion: Motion,
    ignored: Sequence[Ignored],
) -> tuple[float, float]:
    """Measure every flight at every sample.

    Args:
        body: The body.
        proximity: Distances to the scene.
        schedule: Contacts in time.
        motion: The planned motion, densely sampled.
        ignored: Pairs of segment and obstacle that may touch, per sample; what every segment may
            touch is padded, and not measured.

    Returns:
        Largest depth [m], zero where nothing goes in, and its time [s].
    """
    deepest, worst = 0.0, float(motion.time[0])
    for swing in schedule.sequence.swings():
        start, end = schedule.swing_interval(swing)
        rows = np.flatnonzero((motion.time >= start) & (motion.time < end))
        ends = frozenset(end_segments(body, swing.effector))
        obstacles = _supports(body, ends, [ignored[row] for row in rows.tolist()])
        if not obstacles:
            continue
        others = frozenset(
            (shape, other) for shape, other in proximity.pairs
            if segment_of(shape) not in ends or segment_of(other) not in obstacles
        )  # fmt: skip
        found = proximity.minimum_over(motion.q[rows], others, tolerance=1e-5)
        if -found.distance > deepest:
            deepest, worst = -float(found.distance), float(motion.time[rows[found.sample]])
    return deepest, worst


def _supports(body: BodyModel, ends: frozenset[str], ignored: Sequence[Ignored]) -> frozenset[str]:
    """Obstacles that the segments may touch at some time, those apart that every segment may touch."""
    pairs = frozenset[tuple[str, str]]().union(*ignored)
    near = {obstacle for segment, obstacle in pairs if segment in ends}
    padded = {name for name in near if all((segment.name, name) in pairs for segment in body.segments)}
    return frozenset(near - padded)


@dataclass(frozen=True)
class WholeBodyFailure:
    """Why no whole-body motion was found.

    Attributes:
        reason: What could not be met, in one line.
        time: When [s].
        where: The phase and what it stands on.
    """

    reason: str
    time: float
    where: str

    @classmethod
    def at(cls, schedule: ContactSchedule, time: float, reason: str) -> "WholeBodyFailure":
        """Failure at a time [s], with the phase that lasts then."""
        index = int(schedule.phase_at(time))
        held = ", ".join(schedule.sequence[index].stance.effectors) or "no contact"
        return cls(reason, time, f"phase {index} on {held}")


HEAD = "head"
"""Effector on top of the body."""


def measure_passage(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, motion: Motion, padded: Sequence[str] = ()
) -> Passage:
    """Least height of the CoM above the lowest limb in contact, and clearance of head and neck.

    Heights count until the body sits down, where it does; the clearance counts over the whole motion, to the
    scene without its floor and what may be leaned on.

    Args:
        body: The body.
        scene: The obstacles.
        schedule: The planned contacts.
        motion: Planned or executed; what lies beyond the schedule counts as its last phase.
        padded: Obstacles that any part of the body may lean on.
    """
    levels = np.full(len(schedule.sequence), np.nan)
    for index, phase in enumerate(schedule.sequence):
        if any(not hangs(body, name) for name in phase.stance.effectors):
            break
        heights = [float(item.position[2]) for item in phase.stance if item.kind is not ContactKind.GRASP]
        levels[index] = min(heights, default=np.nan)
    floor, room = levels[schedule.phase_at(motion.time)], _head_clearance(body, scene, motion, padded)
    return Passage.of(motion.time, motion.com, floor, room=room)


def _head_clearance(body: BodyModel, scene: Scene, motion: Motion, padded: Sequence[str]) -> float | None:
    obstacles = [item for item in scene if item.name != FLOOR and item.name not in padded]
    if not obstacles or HEAD not in body.effectors:
        return None
    above = head_segments(body)
    hard = Scene(obstacles, floor_height=None)
    ignored = frozenset(
        (segment.name, item.name) for segment in body.segments if segment.name not in above for item in hard
    )
    proximity = Proximity(body, hard, self_collision=False)
    return float(proximity.minimum_over(motion.q, ignored, tolerance=1e-5).distance)


def head_segments(body: BodyModel) -> tuple[str, ...]:
    """Names of the segments above the shoulders: the head's, and those below it that carry nothing else."""
    segments = {segment.name: segment for segment in body.segments}
    found = [body.effector(HEAD).segment]
    while True:
        parent = segments[found[-1]].parent
        if parent is None or sum(item.parent == parent for item in body.segments) != 1:
            return tuple(found)
        found.append(parent)


@dataclass(frozen=True)
class WholeBodyRequirements:
    """What a whole-body motion must keep to count as a success.

    Attributes:
        support_error: Largest distance of an effector from its contact [m].
        support_turn: Largest angle of a sole from its contact [rad].
        meeting_error: Largest depth in its surface, or distance from it, of what is made at speed [m].
        com_error: Largest distance of the centre of mass from its plan [m].
        clearance: Least distance to obstacles and between body parts [m].
        joint_limit: Largest violation of a joint range [rad].
        velocity_share: Largest share of a joint's velocity limit.
        missing_wrench: Largest part of the dynamics left without a contact force [N, N.m].
        torque_share: Largest share of a joint's torque limit.
    """

    support_error: float = 1.0e-3
    support_turn: float = 5.0e-3
    meeting_error: float = 2.0e-3
    com_error: float = 2.0e-3
    clearance: float = 0.01
    joint_limit: float = 1.0e-9
    velocity_share: float = 1.0
    missing_wrench: float = 1.0
    torque_share: float = 1.0


@dataclass(frozen=True)
class Impact:
    """A contact that is made at speed.

    Attributes:
        effector: What touches down.
        time_s: When [s].
        torque_share: Largest share of a joint's torque limit in the :data:`IMPACT` after it.
        joint: Name of that joint.
        at_s: When that share is reached [s].
    """

    effector: str
    time_s: float
    torque_share: float
    joint: str
    at_s: float


@dataclass(frozen=True)
class WholeBodyResiduals:
    """Largest violations of a planned motion.

    Attributes:
        max_support_error_m: Distance of an effector from its contact [m].
        max_support_turn_rad: Angle of a sole from its contact [rad].
        max_meeting_error_m: Depth in its surface, or distance from it, of what is made at speed until
            it has settled [m].
        max_com_error_m: Distance of the centre of mass from its plan [m].
        min_clearance_m: Least counted distance [m].
        closest_pair: Names of the shapes at that distance.
        max_scuff_m: Depth to which a flying foot or hand goes into what it has left or comes to hold,
            which does not count as clearance; nothing is required of it [m].
        max_joint_limit_violation_rad: Violation of a joint range [rad].
        max_velocity_share: Largest share of a joint's velocity limit.
        max_missing_wrench: Part of the dynamics that no admissible contact force supplies [N, N.m].
        max_torque_share: Largest share of a joint's torque limit.
        tightest_joint: Name of that joint.
        min_force_at_com_N: Smallest force at the CoM that would end balance; None where none does [N].
        min_zmp_distance_m: Least distance of the ZMP to the edge of the support polygon, negative
            outside; of the phases whose contacts lie in one plane, None without any [m].
        worst_times_s: When each of the errors is largest [s], by field name.
        impacts: Largest share of a torque limit just after each contact that is made at speed; they count in
            ``max_torque_share`` like any other instant.
    """

    max_support_error_m: float
    max_support_turn_rad: float
    max_meeting_error_m: float
    max_com_error_m: float
    min_clearance_m: float
    closest_pair: tuple[str, str]
    max_scuff_m: float
    max_joint_limit_violation_rad: float
    max_velocity_share: float
    max_missing_wrench: float
    max_torque_share: float
    tightest_joint: str
    min_force_at_com_N: float | None
    min_zmp_distance_m: float | None
    worst_times_s: dict[str, float]
    impacts: tuple[Impact, ...] = ()

    def table(self, requirements: WholeBodyRequirements) -> RequirementTable:
        """Every requirement with its measured value; keys are the names of the fields."""
        r, pair = requirements, " and ".join(self.closest_pair)
        return requirement_table([
            self._row("max_support_error_m", "support error", "m", r.support_error),
            self._row("max_support_turn_rad", "support turn", "rad", r.support_turn),
            None if self.max_meeting_error_m == 0.0  # nothing was met at speed
            else self._row("max_meeting_error_m", "distance of a sliding contact from its surface", "m",
                      r.meeting_error),
            self._row("max_com_error_m", "centre-of-mass error", "m", r.com_error),
            self._row("min_clearance_m", "clearance", "m", r.clearance, ">=", pair),
            self._row("max_joint_limit_violation_rad", "joint range violation", "rad", r.joint_limit),
            self._row("max_velocity_share", "share of a velocity limit", "", r.velocity_share),
            self._row("max_missing_wrench", "missing wrench", "N, N.m", r.missing_wrench),
            self._row("max_torque_share", "share of a torque limit", "", r.torque_share,
                      where=self.tightest_joint),
        ])  # fmt: skip

    def _row(
        self, key: str, name: str, unit: str, limit: float, sense: Sense = "<=", where: str = ""
    ) -> Requirement:
        time = self.worst_times_s.get(key)
        return Requirement(key, name, unit, float(getattr(self, key)), sense, limit, time, where)


def certify(
    body: BodyModel,
    proximity: Proximity,
    trajectory: CentroidalTrajectory,
    motion: Motion,
    ignored: tuple[Ignored, ...],
    wrench: FloatArray,
    meeting: SlidingTouchdown | None = None,
    polytopes: Sequence[WrenchPolytope] | None = None,
) -> WholeBodyResiduals:
    """Measure a motion against its contacts, centre of mass, limits and obstacles.

    Args:
        body: The body.
        proximity: Distances to the scene and within the body.
        trajectory: Planned centre of mass and contacts.
        motion: The planned motion, densely sampled.
        ignored: Pairs that may touch, per sample.
        wrench: (n, 6) pseudo-wrench of the whole body about the world origin, per sample.
        meeting: What is met at speed, at the motion's samples.
        polytopes: Of the phases, where they are known.
    """
    support, turn = support_errors(body, trajectory.schedule, motion)
    com = np.linalg.norm(motion.com - trajectory.position(motion.time), axis=1)
    com = np.where(trajectory.binds(motion.time), com, 0.0)
    angles = motion.q[:, 7:]
    limit = np.maximum(body.lower - angles, angles - body.upper).max(axis=1)
    speed = (np.abs(motion.v[:, 6:]) / body.velocity_limit).max(axis=1)
    share = body.torque_share(motion.tau[:, 6:])
    torque = share.max(axis=1, initial=0.0)
    missing = np.linalg.norm(motion.tau[:, :6], axis=1)
    clearance = proximity.minimum_over(motion.q, ignored, tolerance=1e-5)
    series = {
        "max_support_error_m": support, "max_support_turn_rad": turn, "max_com_error_m": com,
        "max_meeting_error_m": sliding_touchdown_errors(proximity, meeting, motion),
        "max_joint_limit_violation_rad": np.maximum(limit, 0.0), "max_velocity_share": speed,
        "max_missing_wrench": missing, "max_torque_share": torque,
    }  # fmt: skip
    times = {name: float(motion.time[int(np.argmax(values))]) for name, values in series.items()}
    scuff, times["max_scuff_m"] = deepest_penetration(body, proximity, trajectory.schedule, motion, ignored)
    closest_sample = clearance.sample if clearance.sample is not None else 0
    times["min_clearance_m"] = float(motion.time[closest_sample])
    stances = [phase.stance for phase in trajectory.schedule.sequence]
    phases = trajectory.schedule.phase_at(motion.time)
    balance = motion_margin(stances, phases, wrench, motion.com, polytopes=polytopes)
    return WholeBodyResiduals(
        **{name: float(values.max()) for name, values in series.items()},
        min_clearance_m=float(clearance.distance),
        closest_pair=clearance.pair or ("", ""),
        max_scuff_m=scuff,
        tightest_joint=body.joint_names[int(np.argmax(share.max(axis=0)))],
        min_force_at_com_N=balance.min_force,
        min_zmp_distance_m=balance.min_zmp_distance,
        worst_times_s=times,
        impacts=_impacts(body, trajectory.schedule, motion.time, share),
    )


IMPACT = 0.03
"""Time after a touch-down at speed whose torques are listed as those of the impact [s]."""


def _impacts(
    body: BodyModel, schedule: ContactSchedule, time: FloatArray, share: FloatArray
) -> tuple[Impact, ...]:
    """Torques just after each contact that is made at speed, in time.

    Args:
        body: The body.
        schedule: Its contacts in time.
        time: (n,) [s].
        share: (n, nv - 6) shares of the torque limits.
    """
    found = []
    for name in schedule.sequence.effectors:
        settling = schedule.settling(time, name)
        for first in np.flatnonzero(settling & ~np.append(False, settling[:-1])):
            rows = np.arange(first, int(np.searchsorted(time, time[first] + IMPACT)))
            sample, joint = np.unravel_index(int(np.argmax(share[rows])), share[rows].shape)
            largest = float(share[rows][sample, joint])
            at = float(time[rows[sample]])
            found.append(Impact(name, float(time[first]), largest, body.joint_names[joint], at))
    return tuple(sorted(found, key=lambda impact: impact.time_s))


def support_errors(
    body: BodyModel, schedule: ContactSchedule, motion: Motion
) -> tuple[FloatArray, FloatArray]:
    """(n,) largest position [m] and orientation [rad] error of the effectors in contact.

    Of a contact that is still settling, what it is below its surface counts.
    """
    model, data = body.pinocchio, body.pinocchio.createData()
    position, turn = np.zeros(len(motion.time)), np.zeros(len(motion.time))
    phases = schedule.phase_at(motion.time)
    settling = {name: schedule.settling(motion.time, name) for name in schedule.sequence.effectors}
    for k, q in enumerate(motion.q):
        pin.forwardKinematics(model, data, q)
        pin.updateFramePlacements(model, data)
        for contact in schedule.sequence[int(phases[k])].stance:
            measure = _placement_error if contact.part is SolePart.FULL else _part_error
            moved, turned = measure(body, data, contact)
            if settling[contact.effector][k]:
                place = data.oMf[body.effector_frame(contact.effector)].translation
                moved, turned = -float(contact.normal @ (place - contact.position)), 0.0
            position[k], turn[k] = max(position[k], moved), max(turn[k], turned)
    return position, turn


def _placement_error(body: BodyModel, data: pin.Data, contact: Contact) -> tuple[float, float]:
    """Distance [m] and, of a sole, angle [rad] of an effector from its contact."""
    placement = data.oMf[body.effector_frame(contact.effector)]
    moved = float(np.linalg.norm(placement.translation - contact.position))
    if contact.kind is not ContactKind.SOLE:
        return moved, 0.0
    return moved, float(np.linalg.norm(pin.log3(contact.rotation_contact_to_world.T @ placement.rotation)))


def _part_error(body: BodyModel, data: pin.Data, contact: Contact) -> tuple[float, float]:
    """Largest distance of a point of a part from where it touches [m]; tilts show in it too."""
    effector = body.effector(contact.effector)
    hanging = hanging_segment(body, effector.segment)
    moved = 0.0
    for local, wanted in zip(contact.points, contact.points_in_world, strict=True):
        inside = effector.translation + effector.rotation @ local
        segment = effector.segment
        if contact.part is SolePart.TOES and hanging is not None:
            segment, inside = hanging.name, inside - hanging.origin
        actual = data.oMf[body.segment_frame(segment)].act(inside)
        moved = max(moved, float(np.linalg.norm(actual - wanted)))
    return moved, 0.0
