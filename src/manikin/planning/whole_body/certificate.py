"""Certificates of whole-body motions: every quantity measured afresh on dense samples, beside its limit.

Nothing here comes from the solver: all is computed again from the samples of the finished motion.  Feet and
hands in flight begin and end at distance zero from their supports, which does not count as clearance; how
deep they go into them is measured apart, and so is what is held at a point, as the palm above its heel.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from manikin.balance import MotionMargin, WrenchPolytope, motion_margin
from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart
from manikin.kinematics import touching_pairs
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, rotation_vector
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body.fit_targets import KeptDistances
from manikin.planning.whole_body.refine_measures import RefineObstacles
from manikin.planning.whole_body.sliding_touchdown import Ignored, SlidingTouchdown, sliding_touchdown_errors
from manikin.runtime.requirement import Requirement, RequirementTable, Sense, requirement_table
from manikin.scene import Proximity
from manikin.scene.distance import MotionDistances, considered, segment_of


@dataclass(frozen=True)
class WholeBodyRequirements:
    """Limits that a whole-body motion must keep to count as a success, as far as it is measured.

    Attributes:
        support_error: Largest distance of an effector from its contact [m].
        support_turn: Largest angle of a sole from its contact [rad].
        meeting_error: Largest depth in its surface, or distance from it, of what is made at speed [m].
        com_error: Largest distance of the centre of mass from its plan [m].
        clearance: Least distance to obstacles and between body parts [m].
        penetration: Largest depth of anything in anything but what it holds on to, flights included [m].
        sinking: Largest depth of what is held at a point beyond its shapes, as a hand on its heel [m].
        joint_limit: Largest violation of a joint range [rad].
        velocity_share: Largest share of a joint's velocity limit.
        missing_wrench: Largest part of the dynamics left without a contact force [N, N.m].
        physics_violation: Largest wrench that no admissible contact force supplies [N].
        margin: Least margin of the whole body's wrench, where the stance's wrenches fill a volume [N.m].
        torque_share: Largest share of a joint's torque limit.
    """

    support_error: float = 1.0e-3
    support_turn: float = 5.0e-3
    meeting_error: float = 2.0e-3
    com_error: float = 2.0e-3
    clearance: float = 0.01
    penetration: float = 1.0e-3
    sinking: float = 5.0e-3
    joint_limit: float = 1.0e-9
    velocity_share: float = 1.0
    missing_wrench: float = 1.0
    physics_violation: float = 1.0
    margin: float = 0.0
    torque_share: float = 1.0


@dataclass(frozen=True)
class RefineRequirements(WholeBodyRequirements):
    """Limits of a refined motion, whose clearance includes flights away from their supports.

    Executed, a foot of a creature is up to 3 mm from where it is planned; what grazed an edge met it.
    """

    clearance: float = 0.002


QUANTITIES: Mapping[str, tuple[str, str, Sense, str]] = MappingProxyType({
    "max_support_error_m": ("support error", "m", "<=", "support_error"),
    "max_support_turn_rad": ("support turn", "rad", "<=", "support_turn"),
    "max_meeting_error_m": ("distance of a sliding contact from its surface", "m", "<=", "meeting_error"),
    "max_com_error_m": ("centre-of-mass error", "m", "<=", "com_error"),
    "min_clearance_m": ("clearance", "m", ">=", "clearance"),
    "max_scuff_m": ("depth of a flight in what it leaves or reaches", "m", "<=", ""),
    "max_penetration_m": ("penetration", "m", "<=", "penetration"),
    "max_sinking_m": ("depth of what is held at a point", "m", "<=", "sinking"),
    "max_joint_limit_violation_rad": ("joint range violation", "rad", "<=", "joint_limit"),
    "max_velocity_share": ("share of a velocity limit", "", "<=", "velocity_share"),
    "max_missing_wrench": ("missing wrench", "N, N.m", "<=", "missing_wrench"),
    "max_physics_violation": ("wrench without contact force", "N", "<=", "physics_violation"),
    "min_margin": ("margin of the whole body", "N.m", ">=", "margin"),
    "max_torque_share": ("share of a torque limit", "", "<=", "torque_share"),
})  # fmt: skip
"""Quantities of a certificate in the order in which they are reported: name, unit, sense of the limit, and
the field of :class:`WholeBodyRequirements` that has it; none where nothing is required."""


@dataclass(frozen=True)
class WholeBodyFailure:
    """Reason why no whole-body motion was found.

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


@dataclass(frozen=True)
class Impact:
    """A contact that is made at speed.

    Attributes:
        time_s: When [s].
        torque_share: Largest share of a joint's torque limit in the :data:`IMPACT` after it.
        at_s: When that share is reached [s].
    """

    effector: str
    time_s: float
    torque_share: float
    joint: str
    at_s: float


@dataclass(frozen=True)
class MotionCertificate(RequirementTable):
    """The worst value of every quantity of :data:`QUANTITIES` that was measured, beside its limit.

    ``max_missing_wrench`` is the part of the dynamics that the planned contact forces leave,
    ``max_physics_violation`` the wrench that no admissible force supplies, about the stance's mean contact
    point with 1 m. ``min_margin`` is about the CoM, over the stances whose wrenches fill a volume, and
    infinite without any.

    Attributes:
        closest_pair: Names of the shapes at the least clearance.
        min_force_at_com_N: Smallest force at the CoM that would end balance; None where none does [N].
        min_zmp_distance_m: Least distance of the ZMP to the edge of the support polygon, negative
            outside; of the phases whose contacts lie in one plane, None without any [m].
        impacts: Largest share of a torque limit just after each contact that is made at speed; they count in
            ``max_torque_share`` like any other instant.
    """

    closest_pair: tuple[str, str]
    min_force_at_com_N: float | None
    min_zmp_distance_m: float | None
    impacts: tuple[Impact, ...] = ()

    @property
    def is_caught(self) -> bool:
        """Whether a part of the body is on the wrong side of another or of an obstacle."""
        return self.value("min_clearance_m") < -CAUGHT

    def excess(self, keys: Collection[str]) -> float:
        """Sum of how far some requirements are broken, each in units of its limit or of :data:`UNITS`."""
        return sum(_excess(row) for row in self if row.key in keys)

    @property
    def cause(self) -> Requirement | None:
        """The broken requirement that says why there is no motion: what is caught, else what misses most."""
        return self["min_clearance_m"] if self.is_caught else self.worst(self.broken)

    def worst(self, keys: Collection[str]) -> Requirement | None:
        """The requirement that misses most of some; None where none of them is broken."""
        return max((row for row in self if row.key in keys and not row.held), key=_excess, default=None)

    @property
    def required(self) -> RequirementTable:
        """The quantities that have a limit here: margins on stances with a volume, contacts met at speed."""
        idle = ("max_meeting_error_m", 0.0), ("min_margin", np.inf)
        return requirement_table(row for row in self if (row.key, row.measured) not in idle)


UNITS = MappingProxyType({
    "min_clearance_m": 0.01, "max_joint_limit_violation_rad": 0.01, "max_missing_wrench": 10.0,
    "min_margin": 10.0,
})  # fmt: skip
"""Size at which a broken requirement counts as one, where that is not its limit."""


def _excess(row: Requirement) -> float:
    """How far a requirement is broken, in units of its limit or of :data:`UNITS`; 0 where it holds."""
    if row.held:
        return 0.0
    return abs(row.measured - row.limit) / UNITS.get(row.key, max(row.limit, 1e-9))


CAUGHT = 0.02
"""Depth from which on a part of the body is on the wrong side of another or of an obstacle [m]; ours."""


def certify(
    body: BodyModel, proximity: Proximity, trajectory: CentroidalTrajectory, motion: Motion,
    ignored: tuple[Ignored, ...], points: KeptDistances, wrench: FloatArray,
    meeting: SlidingTouchdown | None = None, polytopes: Sequence[WrenchPolytope] | None = None,
    requirements: WholeBodyRequirements | None = None,
) -> MotionCertificate:  # fmt: skip
    """Measure a motion against its contacts, centre of mass, limits and obstacles.

    Args:
        ignored: Pairs that may touch, per sample.
        points: Those of them that are held at a point, whose depth counts.
        wrench: (n, 6) pseudo-wrench of the whole body about the world origin, per sample.
        meeting: What is met at speed, at the motion's samples.
        polytopes: Of the phases, where they are known.
    """
    schedule, distances = trajectory.schedule, proximity.along(motion.q)
    com = np.linalg.norm(motion.com - trajectory.position(motion.time), axis=1)
    series = {
        "max_com_error_m": np.where(trajectory.binds(motion.time), com, 0.0),
        "max_meeting_error_m": sliding_touchdown_errors(proximity, meeting, motion),
        "max_missing_wrench": np.linalg.norm(motion.tau[:, :6], axis=1),
    }
    scuff = deepest_penetration(body, distances, schedule, motion.time, ignored)
    worst = {"max_scuff_m": (*scuff, ""), **deepest_point(distances, points, motion.time)}
    stances, phases = [phase.stance for phase in schedule.sequence], schedule.phase_at(motion.time)
    return _certificate(
        body, distances, schedule, motion, ignored, series, worst,
        motion_margin(stances, phases, wrench, motion.com, polytopes=polytopes),
        requirements or WholeBodyRequirements(),
    )  # fmt: skip


def certify_refined(
    body: BodyModel, proximity: Proximity, schedule: ContactSchedule, obstacles: RefineObstacles,
    motion: Motion, violation: FloatArray, balance: MotionMargin, flat: Sequence[bool],
    requirements: WholeBodyRequirements | None = None,
) -> MotionCertificate:  # fmt: skip
    """Measure a refined motion against its contacts, limits and obstacles.

    Args:
        obstacles: What may touch at the motion's samples.
        violation: (n,) its physics violation [N].
        flat: Of each phase, whether its stance's wrenches fill no volume: margins do not count there.
    """
    without = np.array(flat)[schedule.phase_at(motion.time)]
    margin = np.where(without, np.inf, motion.margin)
    lowest = int(np.argmin(margin))
    distances = proximity.along(motion.q)
    flying = distances.minimum(obstacles.touching(), tolerance=1e-5)
    worst = {
        "min_margin": (float(margin[lowest]), float(motion.time[lowest]), ""),
        "max_penetration_m": (
            max(0.0, -float(flying.distance)),
            float(motion.time[flying.sample]),
            " and ".join(flying.pair or ()),
        ),
        **deepest_point(distances, obstacles.points, motion.time),
    }
    return _certificate(
        body, distances, schedule, motion, obstacles.during_flights(), {"max_physics_violation": violation},
        worst, replace(balance, force=np.where(without, np.inf, balance.force)),
        requirements or RefineRequirements(),
    )  # fmt: skip


def _certificate(
    body: BodyModel, distances: MotionDistances, schedule: ContactSchedule, motion: Motion,
    ignored: tuple[Ignored, ...], series: Mapping[str, FloatArray],
    worst: dict[str, tuple[float, float, str]], balance: MotionMargin, requirements: WholeBodyRequirements,
) -> MotionCertificate:  # fmt: skip
    """The table of series (n,), of worst values with times [s] and places, and what any motion is asked."""
    effectors, joints = schedule.sequence.effectors, body.joint_names
    support, turn = support_errors(body, schedule, motion)
    share = body.torque_share(motion.tau[:, 6:])
    rate = np.abs(motion.v[:, 6:]) / body.velocity_limit
    beyond = np.maximum(np.maximum(body.lower - motion.q[:, 7:], motion.q[:, 7:] - body.upper), 0.0)
    measured = {
        "max_support_error_m": (support, effectors), "max_support_turn_rad": (turn, effectors),
        "max_joint_limit_violation_rad": (beyond, joints), "max_velocity_share": (rate, joints),
        "max_torque_share": (share, joints),
        **{key: (values[:, None], ("",)) for key, values in series.items()},
    }  # fmt: skip
    for key, (values, names) in measured.items():
        if not values.size:  # without joints
            worst[key] = 0.0, float(motion.time[0]), ""
            continue
        sample, column = divmod(int(np.argmax(values)), len(names))
        worst[key] = float(values[sample, column]), float(motion.time[sample]), names[column]
    closest = distances.minimum(ignored, tolerance=1e-5)
    pair = closest.pair or ("", "")
    when = float(motion.time[closest.sample])
    worst["min_clearance_m"] = float(closest.distance), when, " and ".join(pair)
    rows = tuple(
        Requirement(
            key, name, unit, worst[key][0], sense, getattr(requirements, field) if field else np.inf,
            *worst[key][1:],
        )
        for key, (name, unit, sense, field) in QUANTITIES.items() if key in worst
    )  # fmt: skip
    return MotionCertificate(
        rows, pair, balance.min_force, balance.min_zmp_distance,
        _impacts(body, schedule, motion.time, share),
    )  # fmt: skip


IMPACT = 0.03
"""Time after a touch-down at speed whose torques are listed as those of the impact [s]."""


def _impacts(
    body: BodyModel, schedule: ContactSchedule, time: FloatArray, share: FloatArray
) -> tuple[Impact, ...]:
    """Torques just after each contact that is made at speed, in time, of shares (n, nv - 6) of the limits."""
    found = []
    for name in schedule.sequence.effectors:
        settling = schedule.settling(time, name)
        for first in np.flatnonzero(settling & ~np.append(False, settling[:-1])):
            shortly = share[first : int(np.searchsorted(time, time[first] + IMPACT))]
            sample, joint = np.unravel_index(int(np.argmax(shortly)), shortly.shape)
            largest, at = float(shortly[sample, joint]), float(time[first + sample])
            found.append(Impact(name, float(time[first]), largest, body.joint_names[joint], at))
    return tuple(sorted(found, key=lambda impact: impact.time_s))


def support_errors(
    body: BodyModel, schedule: ContactSchedule, motion: Motion
) -> tuple[FloatArray, FloatArray]:
    """(n, c) position [m] and orientation [rad] errors of the effectors in contact, zero of the others.

    Of a contact that is still settling, what it is below its surface counts.
    """
    held = {contact for phase in schedule.sequence for contact in phase.stance}
    frames = {
        contact: (body.effector_frame(contact.effector), body.segment_frame(_carrier(body, contact)))
        for contact in held
    }
    every = sorted({frame for pair in frames.values() for frame in pair})
    rotations, places = _placements(body, every, motion.q)
    names = schedule.sequence.effectors
    position, turn = np.zeros((len(motion.time), len(names))), np.zeros((len(motion.time), len(names)))
    phases = schedule.phase_at(motion.time)
    for number, phase in enumerate(schedule.sequence):
        rows = np.flatnonzero(phases == number)
        for contact in phase.stance if len(rows) else ():
            settling = schedule.settling(motion.time[rows], contact.effector)
            columns = map(every.index, frames[contact])
            own, carrier = ((rotations[rows, k], places[rows, k]) for k in columns)
            moved, turned = _errors(body, contact, own, carrier)
            below = (contact.position - own[1]) @ contact.normal
            column = names.index(contact.effector)
            position[rows, column] = np.where(settling, below, moved)
            turn[rows, column] = np.where(settling, 0.0, turned)
    return position, turn


_Poses = tuple[FloatArray, FloatArray]
"""Rotations (n, 3, 3) and origins (n, 3) of a frame in the world."""


def _placements(body: BodyModel, frames: Sequence[int], postures: FloatArray) -> _Poses:
    """(n, frames, 3, 3) rotations and (n, frames, 3) origins [m] of frames in n postures."""
    model, data = body.pinocchio, body.pinocchio.createData()
    rotations = np.empty((len(postures), len(frames), 3, 3))
    places = np.empty((len(postures), len(frames), 3))
    for k, q in enumerate(postures):
        pin.forwardKinematics(model, data, q)
        for column, frame in enumerate(frames):
            here = pin.updateFramePlacement(model, data, frame)
            rotations[k, column], places[k, column] = here.rotation, here.translation
    return rotations, places


def _carrier(body: BodyModel, contact: Contact) -> str:
    """Segment with which a contact touches: the toes, where a foot stands on them alone."""
    segment = body.effector(contact.effector).segment
    hanging = hanging_segment(body, segment) if contact.part is SolePart.TOES else None
    return segment if hanging is None else hanging.name


def _errors(body: BodyModel, contact: Contact, own: _Poses, carrier: _Poses) -> tuple[FloatArray, FloatArray]:
    """(n,) position [m] and orientation [rad] errors of an effector in contact.

    Of a part of a sole that is the largest distance of a point from where it touches; tilts show in it too.

    Args:
        own: Poses of the effector.
        carrier: Poses of the segment that touches.
    """
    still = np.zeros(len(own[1]))
    if contact.rolls:
        moved, turned = np.array([contact.rolled_away(*pose) for pose in zip(*own, strict=True)]).T
        return moved, turned
    if contact.part is SolePart.FULL:
        moved = np.linalg.norm(own[1] - contact.position, axis=1)
        if contact.kind is not ContactKind.SOLE:
            return moved, still
        return moved, np.linalg.norm(rotation_vector(contact.rotation_contact_to_world.T @ own[0]), axis=1)
    effector, segment = body.effector(contact.effector), _carrier(body, contact)
    points = effector.translation + contact.points @ effector.rotation.T
    if segment != effector.segment:
        points = points - body.segment(segment).origin
    actual = carrier[1][:, None] + points @ carrier[0].transpose(0, 2, 1)
    return np.linalg.norm(actual - contact.points_in_world, axis=2).max(axis=1), still


def deepest_point(
    distances: MotionDistances, points: KeptDistances, time: FloatArray
) -> dict[str, tuple[float, float, str]]:
    """Row ``max_sinking_m`` of what is held at a point and goes deepest into what it touches; or none.

    The row has the depth [m], zero where nothing goes in, its time [s] and the names of the two.
    """
    found = [
        distances.minimum(
            frozenset(compress(distances.pairs, considered(distances.pairs, pairs))), tolerance=1e-5,
            rows=np.flatnonzero(np.isfinite(wanted)),
        )
        for pairs, wanted in points.entries
    ]  # fmt: skip
    if not found:
        return {}
    deepest = min(found, key=lambda item: float(item.distance))
    where = " and ".join(deepest.pair or ())
    return {"max_sinking_m": (max(0.0, -float(deepest.distance)), float(time[deepest.sample]), where)}


def deepest_penetration(
    body: BodyModel, distances: MotionDistances, schedule: ContactSchedule, time: FloatArray,
    ignored: Sequence[Ignored],
) -> tuple[float, float]:  # fmt: skip
    """Largest depth of a flight [m], zero where nothing goes in, and its time [s].

    Args:
        distances: Along the motion, at times (n,) [s].
        ignored: Pairs of segment and obstacle that may touch, per sample; what every segment may
            touch is padded, and not measured.
    """
    deepest, worst = 0.0, float(time[0])
    for swing in schedule.sequence.swings():
        start, end = schedule.swing_interval(swing)
        rows = np.flatnonzero((time >= start) & (time < end))
        ends = {segment for segment, _ in touching_pairs(body, [(swing.effector, "")])}
        # What the segments may touch at some time, that apart which every segment may touch.
        touching = frozenset[tuple[str, str]]().union(*(ignored[row] for row in rows.tolist()))
        near = {obstacle for segment, obstacle in touching if segment in ends}
        obstacles = {one for one in near if any((other.name, one) not in touching for other in body.segments)}
        if not obstacles or not len(rows):
            continue
        others = frozenset(
            (shape, other) for shape, other in distances.pairs
            if segment_of(shape) not in ends or segment_of(other) not in obstacles
        )  # fmt: skip
        found = distances.minimum(others, tolerance=1e-5, rows=rows)
        if -found.distance > deepest:
            deepest, worst = -float(found.distance), float(time[found.sample])
    return deepest, worst
