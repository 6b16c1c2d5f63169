"""Contact forces and joint torques that a planned motion needs.

The wrench that the contacts must supply is shared among the force-carrying points with the least squared
force along the edges of their friction pyramids; contacts that have just been made, or are about to be left,
cost more, so that load passes smoothly from one to the next.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.balance.contact_forces import ContactGenerators, share
from manikin.balance.motion_margin import motion_margin
from manikin.balance.wrench import WrenchPolytope, wrench_polytopes
from manikin.body import BodyModel, carrying
from manikin.body.limbs import carrying_segment, hinge_line
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart, Stance
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.motion.dynamics import CarriedForces, FreeDynamics, centroidal_motion
from manikin.numerics.polytope import chord
from manikin.numerics.qp import solve_qp
from manikin.numerics.spatial import FloatArray, wrench_about
from manikin.scene.distance import moves_by_joint


def full_motion(
    body: BodyModel, schedule: ContactSchedule, polytopes: Sequence[WrenchPolytope], time: FloatArray,
    q: FloatArray, v: FloatArray, a: FloatArray,
) -> tuple[Motion, FloatArray]:  # fmt: skip
    """Share the contact forces of a motion and measure it.

    Args:
        polytopes: Of each phase.
        time: (n,) [s].
        q: (n, nq) configurations.
        v: (n, nv) velocities.
        a: (n, nv) accelerations.

    Returns:
        The motion, and (n, 6) its whole-body pseudo-wrench about the world origin.
    """
    needed, load = centroidal_motion(body, q, v, a), CarriedForces.of(body, schedule, time, q, v, a)
    if load is not None:
        needed = replace(needed, wrench=needed.wrench + load.wrench)
    tau, forces = plan_forces(body, schedule, time, q, v, a)
    stances = [phase.stance for phase in schedule.sequence]
    margin = motion_margin(stances, schedule.phase_at(time), needed.wrench, needed.com, polytopes=polytopes)
    names = schedule.sequence.effectors
    motion = Motion(
        time=time, q=q, v=v, a=a, tau=tau, com=needed.com, angular_momentum=needed.angular_momentum,
        margin=margin.margin, support=schedule.support(time, names),
        contact_force=forces, contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip
    return motion, needed.wrench


def carried_motion(
    body: BodyModel, motion: Motion, schedule: ContactSchedule, mass: float, hand: str = "both"
) -> tuple[BodyModel, Motion]:
    """The loaded body, and the same postures on the same contacts with a load [kg] in its hands.

    Centre of mass, momentum, contact forces, torques and the margin (about the centre of mass) are those of
    the loaded body. Nothing is planned again: a negative margin means that the load forbids the motion.

    Args:
        body: With empty hands, else InputError.
        motion: Its motion.
        mass: Of the load [kg].
        hand: ``"left"``, ``"right"`` or ``"both"``; InputError if the body has no such hand.
    """
    if body.loads:
        held = sum(body.loads.values())
        raise InputError(f"the motion was made with {held:g} kg in the hands; valid: a motion without")
    loaded = carrying(body, mass, hand)
    stances = [phase.stance.bounded(loaded.mass) for phase in schedule.sequence]
    states = motion.time, motion.q, motion.v, motion.a
    measured, _ = full_motion(loaded, schedule, wrench_polytopes(stances), *states)
    return loaded, measured


_RAMP, _SUDDEN_RAMP = 0.08, 0.02
"""Time over which a contact takes or loses its share of the load, and the same for one made at speed [s]."""
TORQUE_SHARES = (0.85, 0.98)
"""Shares of the strength for which forces are shared where the least ones take more than the first: it leaves
control some in reserve; the other is for where it does not suffice."""
SHARE_COST, MOST_SHARE = 1.0e3, 10.0
"""Cost of the square of the least share of the strength relative to the square of all forces, and the largest
one that is looked for."""
_MISSING_COST = 1.0e-6
"""Square of the cost of force relative to that of missing the wrench."""

_ARM = 0.1  # length that makes moments comparable with forces [m]
_RAISED = (
    0.005  # height above the lowest point of a contact that settles at which force costs twice as much [m]
)
_HANGING_COST = 3.0  # cost of a force on a hanging segment (toes) relative to one on the effector's own


@dataclass(frozen=True, eq=False)
class _Generators(ContactGenerators):
    """Force directions of one stance and the joints that carry them; contacts count among the contact names.

    Attributes:
        carrier: (g,) joint of the segment that each acts on.
        cost: (g,) cost of its magnitude, more where it bends the toes.
        moves: (joints, nv) 1 where a velocity coordinate moves a joint, else 0.
    """

    carrier: np.ndarray
    cost: FloatArray
    moves: FloatArray

    @cached_property
    def wrenches(self) -> FloatArray:
        """(6, g) wrench of each unit magnitude about the world origin."""
        return self.about(np.zeros(3))

    def centred(self, wrench: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Wrenches (6, g) of the generators and wanted ones (n, 6) about the mean contact point.

        Moments are in units of force, for conditioning.
        """
        centre = self.point.mean(axis=0)
        own, target = self.about(centre), wrench_about(wrench, centre)
        own[3:] /= _ARM
        target[:, 3:] /= _ARM
        return own, target

    def settling(
        self, number: int, contact: Contact, position: FloatArray, rotation: FloatArray
    ) -> "_Generators":
        """The same forces with those of a settling contact at the pose where its effector is now.

        They are cheapest where low. The number is that of the effector among the contact names.
        """
        own = self.contact == number
        point, cost = self.point.copy(), self.cost.copy()
        local = (self.point[own] - contact.position) @ contact.rotation_contact_to_world
        point[own] = position + local @ rotation.T
        height = point[own] @ contact.normal
        cost[own] *= 1.0 + ((height - height.min()) / _RAISED) ** 2
        return replace(self, point=point, cost=cost)

    @cached_property
    def by_carrier(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Of each joint that carries generators: :attr:`moves`, and the (6, g) wrenches, 0 for the others."""
        joints = np.unique(self.carrier)
        return tuple((self.moves[joint], self.wrenches * (self.carrier == joint)) for joint in joints)

    @cached_property
    def by_contact(self) -> dict[int, FloatArray]:
        """(6, g) wrenches of the generators of each contact, zero for the others."""
        return {int(index): self.wrenches * (self.contact == index) for index in np.unique(self.contact)}


def plan_forces(
    body: BodyModel, schedule: ContactSchedule, time: FloatArray, q: FloatArray, v: FloatArray, a: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distribute the contact forces of a motion, see :func:`full_motion`.

    Returns:
        (n, nv) generalised forces, of which the first six are what no contact force could supply (zero for a
        motion in balance), and (n, c, 6) force and moment about each contact's origin in world axes [N, N.m].
    """
    dynamics, load = FreeDynamics.of(body, q, v, a), CarriedForces.of(body, schedule, time, q, v, a)
    if load is not None:
        dynamics = dynamics.carrying(load)
    names = schedule.sequence.effectors
    shares = load_shares(schedule, time, names)
    tau, forces = np.zeros((len(time), body.nv)), np.zeros((len(time), len(names), 6))
    for rows, generators, stance in _alike(body, schedule, time, q):
        part = dynamics.part(rows)
        if not len(stance):
            tau[rows] = part.needed  # in the air nothing pushes
            continue
        cost = generators.cost / shares[rows][:, generators.contact]
        matrix, target = generators.centred(part.wrench)
        magnitude = share(matrix, target, cost**-2.0, _MISSING_COST).magnitude
        tau[rows] = part.needed - _apply(part.jacobians, generators, magnitude)
        over = np.any(body.torque_share(tau[rows, 6:]) > TORQUE_SHARES[0], axis=1)
        for k in np.flatnonzero(over | np.any(magnitude > generators.upper, axis=1)):
            joint_map = _joint_map(part.jacobians[k], generators)
            strength = body.torque_lower, body.torque_upper
            others = (
                _share_within_limits(
                    generators, matrix, target[k], cost[k], part.needed[k, 6:], joint_map[6:], strength, most
                ) for most in (*TORQUE_SHARES, None)
            )  # fmt: skip
            other = next((found for found in others if found is not None), None)
            if other is not None:
                magnitude[k] = other
                tau[rows[k]] = part.needed[k] - joint_map @ other
        for contact in stance:
            index = names.index(contact.effector)
            wrench = magnitude @ generators.by_contact[index].T
            forces[rows, index] = wrench_about(wrench, contact.position)
    return tau, forces


def _alike(
    body: BodyModel, schedule: ContactSchedule, time: FloatArray, q: FloatArray
) -> Iterator[tuple[NDArray[np.int64], _Generators, Stance]]:
    """Indices of the samples that have the same force directions, with these and the stance."""
    names = schedule.sequence.effectors
    data = body.pinocchio.createData()
    phases = schedule.phase_at(time)
    settling = {name: schedule.settling(time, name) for name in names}
    for number, phase in enumerate(schedule.sequence):
        generators, rows = _generators(body, phase.stance, names), phases == number
        sliding = np.any([settling[name] for name in names], axis=0) & rows
        if np.any(rows & ~sliding):
            yield np.flatnonzero(rows & ~sliding), generators, phase.stance
        for k in np.flatnonzero(sliding):
            moved = generators
            for index, name in enumerate(names):
                if settling[name][k]:
                    pin.forwardKinematics(body.pinocchio, data, q[k])
                    frame = pin.updateFramePlacement(body.pinocchio, data, body.effector_frame(name))
                    moved = moved.settling(index, phase.stance[name], frame.translation, frame.rotation)
            yield np.array([k]), moved, phase.stance


def load_shares(schedule: ContactSchedule, time: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """(n, c) readiness of each contact to carry load, ramping from 0.05 to 1 at its ends."""
    shares = np.ones((len(time), len(names)))
    for swing in schedule.sequence.swings():
        own, (lift_off, landing) = shares[:, names.index(swing.effector)], schedule.swing_interval(swing)
        if swing.start is not None:
            before = time < lift_off
            own[before] = np.minimum(own[before], (lift_off - time[before]) / _RAMP)
        if swing.end is not None:
            after, ramp = time >= landing, _SUDDEN_RAMP if swing.end.settle > 0.0 else _RAMP
            own[after] = np.minimum(own[after], (time[after] - landing) / ramp)
    return np.clip(shares, 0.05, 1.0)


def _generators(body: BodyModel, stance: Stance, names: tuple[str, ...]) -> _Generators:
    points = [_force_points(body, contact) for contact in stance]
    forces = ContactGenerators.of(stance, points, grasp_moments=False)
    contacts = np.array([names.index(contact.effector) for contact in stance], dtype=np.int64)
    carriers, costs = [], []
    for number, contact in enumerate(stance):
        count = int(np.sum(forces.contact == number)) // len(points[number])
        for local in points[number]:
            segment = carrying_segment(body, contact.effector, local)
            hanging = segment != body.effector(contact.effector).segment
            carriers += [body.pinocchio.frames[body.segment_frame(segment)].parentJoint] * count
            costs += [_HANGING_COST if hanging else 1.0] * count
    return _Generators(
        forces.point, forces.force, forces.couple, contacts[forces.contact], forces.normal, forces.upper,
        np.array(carriers), np.array(costs), moves_by_joint(body.pinocchio),
    )  # fmt: skip


def _force_points(body: BodyModel, contact: Contact) -> FloatArray:
    """(k, 3) points of the contact frame that carry force: corners, and the ends of the toes' hinge."""
    line = hinge_line(body, contact.effector)
    full = contact.kind is ContactKind.SOLE and contact.part is SolePart.FULL
    if not full or line is None or (abs(line) >= 0.5 * contact.length and not contact.hangs_over):
        return contact.points
    half = 0.5 * contact.width
    ends = chord(contact.outline, line) if contact.hangs_over else (half, -half)
    return contact.points if ends is None else np.vstack([contact.points, [[line, y, 0.0] for y in ends]])


def _share_within_limits(
    generators: _Generators, matrix: FloatArray, target: FloatArray, cost: FloatArray, needed: FloatArray,
    joint_map: FloatArray, strength: tuple[FloatArray, FloatArray], most: float | None,
) -> FloatArray | None:  # fmt: skip
    """Magnitudes (g,) that keep the joints' torques and the grasps' forces within their limits, or None.

    The generators' wrenches (6, g) supply the target (6,); the torques are those without contacts, (nv - 6,)
    [N.m], less what ``joint_map`` (nv - 6, g) takes per unit magnitude. They take ``most`` of the strength;
    where that is None, the least share of it that is possible.
    """
    cost, count = cost**2, len(cost)
    limit = np.where(np.isfinite(generators.upper), generators.upper, 1e6)
    hessian, rows, (weakest, strongest) = cost / cost.mean(), np.vstack([matrix, joint_map]), strength
    highest = np.full(len(needed), np.inf)
    if most is not None:
        lower, upper = needed - most * strongest, needed - most * weakest
        bounds = np.zeros(count), limit
    else:  # The share is one more unknown.
        share_cost = SHARE_COST * float(target @ target)
        hessian, bounds = np.append(hessian, share_cost), (np.zeros(count + 1), np.append(limit, MOST_SHARE))
        column = np.concatenate([np.zeros(6), strongest, -weakest])
        rows = np.column_stack([np.vstack([rows, -joint_map]), column])
        lower, upper = np.concatenate([needed, -needed]), np.concatenate([highest, highest])
    solution = solve_qp(
        np.diag(hessian), np.zeros(len(hessian)), rows, np.concatenate([target, lower]),
        np.concatenate([target, upper]), bounds, equalities=6,
    )  # fmt: skip
    return np.maximum(solution.x[:count], 0.0) if solution.solved else None


def _joint_map(jacobians: FloatArray, generators: _Generators) -> FloatArray:
    """(nv, g) generalised force of a unit magnitude of each generator, from joint Jacobians (6, nv)."""
    none = np.zeros((jacobians.shape[1], len(generators.cost)))
    return sum((jacobians * moved).T @ wrenches for moved, wrenches in generators.by_carrier) + none


def _apply(jacobians: FloatArray, generators: _Generators, magnitude: FloatArray) -> FloatArray:
    """(n, nv) generalised forces of contact forces (n, g), from joint Jacobians (n, 6, nv)."""
    total = np.zeros((len(jacobians), jacobians.shape[2]))
    for moved, wrenches in generators.by_carrier:
        total += moved * ((magnitude @ wrenches.T)[:, None, :] @ jacobians)[:, 0]
    return total
