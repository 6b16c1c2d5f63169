"""Every term of the refinement, measured on samples of a motion without its spline or solver.

Velocities and accelerations are differences of the sampled configurations, so that the input, whose velocity
jumps at its keys, and the refined motion are measured in the same way.  An effector may touch what it holds,
and that alone; in flight it begins and ends at distance zero from its supports.
"""

import itertools
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import pinocchio as pin

from manikin.balance import MotionMargin, motion_margin
from manikin.body import BodyModel
from manikin.body.limbs import end_segments
from manikin.contact import ContactKind, ContactSchedule, Stance, StanceSequence
from manikin.kinematics.efort import Task
from manikin.motion.dynamics import centroidal_motion
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import FloatArray, wrench_map
from manikin.planning.whole_body.fit_targets import KeptDistances
from manikin.planning.whole_body.refine_contacts import (
    LEAST,
    contact_variables,
    efort_with_derivative,
    limb_directions,
)
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.refine_physics import MarginCost, centre_of
from manikin.planning.whole_body.sliding_touchdown import Ignored, with_pairs
from manikin.planning.whole_body.swing_planner import leaning_pairs, touch_pairs
from manikin.scene import Proximity, Scene
from manikin.scene.distance import ProximitySamples, moves_by_joint, segment_of

GRASPED = -0.05
"""Distance at which a hand that holds on to something begins to be pushed off it [m]."""


REACHING = 0.35
"""Longest time before and after a contact in which an effector may be at what it leaves or reaches [s]: in
the last third of a slow flight a foot is not above its place yet. Executed it is 0.4 s for a hand."""


class RefineObstacles:
    """Pairs that may be near each other, at samples of a motion.

    Args:
        time: (n,) [s].
        padded: Obstacles that any part of the body may touch.

    Attributes:
        ignored: Pairs of segment and obstacle that may touch at each sample, because they are in contact.
        points: Distances that those of them keep which are held at a point.

    Raises:
        ContactError: If a contact lies on no obstacle.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray,
        padded: Sequence[str] = (),
    ) -> None:  # fmt: skip
        leaning = leaning_pairs(body, padded)
        held = [
            leaning.union(*(touch_pairs(body, scene, contact) for contact in phase.stance))
            for phase in schedule.sequence
        ]
        self.ignored: tuple[Ignored, ...] = tuple(held[phase] for phase in schedule.phase_at(time))
        self.points = KeptDistances.of_points(body, scene, schedule, time, leaning)
        self._obstacles, names = [obstacle.name for obstacle in scene], schedule.sequence.effectors
        # Of each end of a flight the segments and the obstacle that they leave or reach; (n,) 0 at the
        # contact, 1 far from it or outside the flight; and whether a hand has its fingers around it.
        self._sides = list[tuple[Ignored, FloatArray, bool]]()
        self._ends = {name: end_segments(body, name) for name in names}
        self._near = dict(zip(names, np.where(schedule.support(time, names), 0.0, 1.0).T, strict=True))
        for swing in schedule.sequence.swings():
            start, end = schedule.swing_interval(swing)
            rows = (time >= start) & (time < end)
            for contact, gone in ((swing.start, time - start), (swing.end, end - time)):
                if contact is not None:
                    grasped = contact.kind is ContactKind.GRASP
                    # Share of a flight in which the wanted clearance to what was left, or is to be reached,
                    # rises or falls.
                    ramp = min(0.3 * (end - start), REACHING)
                    share = np.clip(gone / ramp, 0.0, 1.0)
                    away = np.where(rows, share**2 * (3.0 - 2.0 * share), 1.0)
                    self._near[swing.effector] = np.minimum(self._near[swing.effector], away)
                    self._sides.append((touch_pairs(body, scene, contact), away, grasped))

    def touching(self) -> tuple[Ignored, ...]:
        """Pairs that may go into each other at each sample: those in contact, and a hand about a grasp."""
        near = [(pairs, away < 1.0) for pairs, away, grasped in self._sides if grasped]
        return with_pairs(self.ignored, near)

    def during_flights(self) -> tuple[Ignored, ...]:
        """Pairs that do not count as clearance at each sample: in contact, leaving it or reaching it."""
        return with_pairs(self.ignored, [(pairs, away < 1.0) for pairs, away, _ in self._sides])

    def wanted(self, found: ProximitySamples, safe: float, touching: float) -> FloatArray:
        """(k,) wanted distance of close pairs: far from contacts, and where a flight begins or ends [m].

        Where an effector is held its distance to other obstacles is given as well, and less of it is wanted:
        a push that ended with the contact would tear it off.
        """
        wanted = np.full(len(found.distance), safe)
        named = np.array([(segment_of(shape), segment_of(other)) for shape, other in found.pairs])
        for name, ends in self._ends.items():
            rows = np.isin(named[:, 0], ends) & np.isin(named[:, 1], self._obstacles)
            # Share of the wanted clearance that an effector in contact has to keep from other obstacles.
            share = np.maximum(self._near[name][found.sample[rows]], 0.4)
            wanted[rows] = np.minimum(wanted[rows], share * safe)
        for pairs, away, grasped in self._sides:
            rows = np.zeros(len(wanted), dtype=bool)
            for segment, obstacle in pairs:
                rows |= (named[:, 0] == segment) & (named[:, 1] == obstacle)
            share, inside = away[found.sample[rows]], GRASPED if grasped else touching
            wanted[rows] = np.minimum(wanted[rows], share * safe + (1.0 - share) * inside)
        return wanted


STEP = 0.01
"""Spacing of the samples that are measured [s]."""


@dataclass(frozen=True)
class RefineMeasures:
    """Terms of the refinement as measured on a motion.

    Attributes:
        duration_s: [s].
        squared_accelerations: Integral of the squared joint accelerations [rad^2/s^3].
        squared_pelvis_accelerations: Integral of the pelvis' squared linear acceleration [m^2/s^3].
        physics_violation: Mean over time of the wrench that no admissible contact force supplies, about
            the stance's mean contact point with 1 m [N].
        max_physics_violation: Largest of it [N].
        min_clearance_m: Least signed distance between what is not in contact; flights count as far as
            they keep off what they leave or reach [m].
        max_penetration_m: Depth of anything in anything but what it holds on to [m].
        contact_error_m: Mean over time of ``sum c |e|``, see
            :mod:`~manikin.planning.whole_body.refine_contacts` [m].
        contact_slide_mps: Mean over time of ``sum c |e'|`` [m/s].
        efort_cost: Mean over time of ``sum c / alpha`` (7.9), alpha clamped.
        max_joint_limit_violation_rad: [rad].
        max_velocity_share: Largest share of a joint's velocity limit.
        min_margin: Least margin of the whole body's wrench about the CoM [N.m].
    """

    duration_s: float
    squared_accelerations: float
    squared_pelvis_accelerations: float
    physics_violation: float
    max_physics_violation: float
    min_clearance_m: float
    max_penetration_m: float
    contact_error_m: float
    contact_slide_mps: float
    efort_cost: float
    max_joint_limit_violation_rad: float
    max_velocity_share: float
    min_margin: float

    def as_dict(self) -> dict[str, float]:
        """The measures by name."""
        return asdict(self)


def sample_uniformly(start: float, end: float, step: float) -> FloatArray:
    """Times from a start to an end, both included, at most ``step`` apart [s]."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / step - 1e-9))) + 1)


def differences(body: BodyModel, time: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Velocities and accelerations (n, nv) of samples at a constant step, by central differences.

    Before and after the motion the body rests.
    """
    model, step = body.pinocchio, float(time[1] - time[0])
    extended = itertools.pairwise([q[0], *q, q[-1]])
    rate = np.array([pin.difference(model, a, b) for a, b in extended]) / step
    return 0.5 * (rate[1:] + rate[:-1]), (rate[1:] - rate[:-1]) / step


def physics_violation(room: MarginCost, stance_wrench: FloatArray) -> FloatArray:
    """(n,) distance of wrenches (n, 6) about the mean contact point to the polytope of a stance [N].

    The nearest point of it is found by a quadratic program for each wrench outside.
    """
    H, h = room.polytope.H, room.polytope.h
    missing = np.zeros(len(stance_wrench))
    # Around the wrench itself, in units of the body's weight, the program is well scaled.
    # Above this margin [N.m] the missing wrench is zero.
    for k in np.flatnonzero(room.polytope.margin(stance_wrench) < -1e-3):
        unit = max(1.0, float(np.abs(stance_wrench[k]).max()))
        bound = (h - H @ stance_wrench[k]) / unit
        nearest = solve_qp(np.eye(6), np.zeros(6), H, None, bound)
        missing[k] = unit * np.linalg.norm(nearest.x) if nearest.solved else max(0.0, -bound.min() * unit)
    return missing


def rooms_of(
    sequence: StanceSequence, friction_share: float = 1.0, sole_share: float = 1.0
) -> tuple[MarginCost, ...]:
    """Wrench polytope of each phase, with shares of the friction and of the soles' length and width."""
    return tuple(room_of(phase.stance, friction_share, sole_share) for phase in sequence)


def room_of(stance: Stance, friction_share: float = 1.0, sole_share: float = 1.0) -> MarginCost:
    """Wrench polytope of a stance, with shares of the friction and of the soles' length and width."""
    contacts = []
    for contact in stance:
        middle, kept = contact.points.mean(axis=0), sole_share if contact.kind is ContactKind.SOLE else 1.0
        points = middle + kept * (contact.points - middle)
        contacts.append(replace(contact, points=points, friction=friction_share * contact.friction))
    return MarginCost(stance.with_contacts(contacts))


def balance_of(
    schedule: ContactSchedule, rooms: tuple[MarginCost, ...], time: FloatArray, wrench: FloatArray,
    com: FloatArray,
) -> tuple[MotionMargin, FloatArray]:  # fmt: skip
    """Margins and (n,) physics violation of wrenches (n, 6) about the world origin with CoM (n, 3)."""
    phases, violation = schedule.phase_at(time), np.zeros(len(time))
    for number, (phase, room) in enumerate(zip(schedule.sequence, rooms, strict=True)):
        rows = phases == number
        if np.any(rows):
            violation[rows] = physics_violation(room, wrench[rows] @ wrench_map(centre_of(phase.stance)).T)
    polytopes = [room.polytope for room in rooms]
    found = motion_margin([one.stance for one in polytopes], phases, wrench, com, polytopes=polytopes)
    return found, violation


def measure(
    body: BodyModel, proximity: Proximity, obstacles: RefineObstacles, path: KeyPath,
    schedule: ContactSchedule, rooms: tuple[MarginCost, ...], time: FloatArray, q: FloatArray,
    task: Task | None = None,
) -> RefineMeasures:  # fmt: skip
    """Measure every term.

    Args:
        obstacles: What may touch at the samples.
        path: The input, for the directions of EFORT.
        rooms: Wrench polytope of each phase.
        time: (n,) samples at a constant step [s].
        q: (n, nq) configurations.
        task: As for :func:`~manikin.planning.whole_body.refine.refine_motion`.
    """
    (v, a), step = differences(body, time, q), float(time[1] - time[0])
    found = centroidal_motion(body, q, v, a)
    margin, violation = balance_of(schedule, rooms, time, found.wrench, found.com)
    error, slide, cost = _contact_terms(body, path, schedule, time, q, v, task)
    outside = np.maximum(body.lower - q[:, 7:], q[:, 7:] - body.upper).max()
    distances = proximity.along(q)
    clearance = distances.minimum(obstacles.during_flights(), tolerance=1e-5)
    flying = distances.minimum(obstacles.touching(), tolerance=1e-5)
    return RefineMeasures(
        duration_s=float(time[-1] - time[0]),
        squared_accelerations=step * float(np.sum(a[:, 6:] ** 2)),
        squared_pelvis_accelerations=step * float(np.sum(a[:, :3] ** 2)),
        physics_violation=float(violation.mean()), max_physics_violation=float(violation.max()),
        min_clearance_m=float(clearance.distance), max_penetration_m=max(0.0, -float(flying.distance)),
        contact_error_m=error, contact_slide_mps=slide, efort_cost=cost,
        max_joint_limit_violation_rad=max(0.0, float(outside)),
        max_velocity_share=float((np.abs(v[:, 6:]) / body.velocity_limit).max(initial=0.0)),
        min_margin=float(margin.margin.min()),
    )  # fmt: skip


def _contact_terms(
    body: BodyModel, path: KeyPath, schedule: ContactSchedule, time: FloatArray, q: FloatArray,
    v: FloatArray, task: Task | None,
) -> tuple[float, float, float]:  # fmt: skip
    """Means over time of the contact-invariant term's distance and speed, and of EFORT's cost."""
    model, data = body.pinocchio, body.pinocchio.createData()
    names = schedule.sequence.effectors
    place, jacobian = np.empty((len(q), len(names), 3)), np.empty((len(q), len(names), 6, model.nv))
    for k, state in enumerate(q):
        pin.computeJointJacobians(model, data, state)
        pin.updateFramePlacements(model, data)
        for column, name in enumerate(names):
            frame = body.effector_frame(name)
            place[k, column] = data.oMf[frame].translation
            jacobian[k, column] = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
    variables, limbs = contact_variables(schedule, time), limb_directions(body, path, schedule, time, task)
    moves, phases = moves_by_joint(model), schedule.phase_at(time)
    error = slide = cost = 0.0
    for column, (name, variable) in enumerate(variables.items()):
        for number, phase in enumerate(schedule.sequence):
            if name in phase.stance:
                away = place[phases == number, column] - phase.stance[name].position
                error += float(np.linalg.norm(away, axis=1).sum()) / len(time)
        speed = np.linalg.norm((jacobian[:, column, :3] @ v[:, :, None])[:, :, 0], axis=1)
        slide += float(np.mean(variable * speed))
        if name in limbs:
            chain = np.flatnonzero(moves[model.frames[body.effector_frame(name)].parentJoint])
            alpha, _ = efort_with_derivative(limbs[name], jacobian[:, column], chain)
            cost += float(np.mean(variable / np.maximum(alpha, LEAST)))
    return error, slide, cost
