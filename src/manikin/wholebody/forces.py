"""Contact forces and joint torques that a planned motion needs.

The generalised forces of inverse dynamics leave a six-dimensional wrench that the contacts
must supply.  It is shared among the force-carrying points with the least squared force along
the edges of their friction pyramids; contacts that have just been made, or are about to be
left, cost more, so that load passes smoothly from one to the next.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import daqp
import numpy as np
import pinocchio as pin
from scipy.optimize import lsq_linear, nnls

from manikin.body import BodyModel
from manikin.body.limb import carrying_segment, hinge_line
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart, Stance
from manikin.spatial import FloatArray, skew
from manikin.wholebody.configuration_spline import rotation_from_quaternion

_RAMP = 0.08
"""Time over which a contact takes or loses its share of the load [s]."""

_SUDDEN_RAMP = 0.02
"""The same for a contact that is made at speed [s]."""

TORQUE_SHARE = 0.98
"""Share of the joints' strength that the forces are shared for where it does not suffice at once."""

_WRENCH_WEIGHT = 1.0e3
"""Cost of missing the wrench relative to the cost of force."""


_ARM = 0.1
"""Length that makes moments comparable with forces [m]."""

_HANGING_COST = 3.0
"""Cost of a force on a hanging segment (toes) relative to one on the effector's own."""


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Forces of a planned motion.

    Attributes:
        tau: (n, nv) generalised forces; the first six are what no contact force could
            supply (zero for a motion in balance) [N, N.m].
        contact_force: (n, c, 6) force and moment about the contact's origin, in world
            axes [N, N.m].
        missing_wrench: (n,) norm of the first six entries of ``tau``.
    """

    tau: FloatArray
    contact_force: FloatArray
    missing_wrench: FloatArray


@dataclass(frozen=True, eq=False)
class _Generators:
    """Force directions of one stance.

    Attributes:
        point: (g, 3) where each acts [m].
        direction: (g, 3) unit normal force plus friction.
        contact: (g,) index into the contact names.
        carrier: (g,) joint of the segment that it acts on.
        cost: (g,) cost of its magnitude, more where it bends the toes.
        limit: (g,) largest magnitude: the force limit of a grasp, infinite for the others [N].
    """

    point: FloatArray
    direction: FloatArray
    contact: np.ndarray
    carrier: np.ndarray
    cost: FloatArray
    limit: FloatArray

    @cached_property
    def wrenches(self) -> FloatArray:
        """(6, g) wrench of each unit magnitude about the world origin."""
        return np.vstack([self.direction.T, np.cross(self.point, self.direction).T])

    @cached_property
    def balance(self) -> tuple[FloatArray, FloatArray]:
        """Mean contact point (3,) and the (6, g) wrenches about it, moments in units of force."""
        centre = self.point.mean(axis=0)
        moment = np.cross(self.point - centre, self.direction) / _ARM
        return centre, np.vstack([self.direction.T, moment.T])

    def shifted(self, contact: int, offset: FloatArray) -> "_Generators":
        """The same forces with those of one contact acting elsewhere by an offset (3,) [m]."""
        return replace(self, point=self.point + np.outer(self.contact == contact, offset))

    @cached_property
    def by_carrier(self) -> tuple[tuple[int, FloatArray], ...]:
        """Joint and (6, g) wrenches of the generators that act on it, zero for the others."""
        return tuple(
            (int(joint), self.wrenches * (self.carrier == joint)) for joint in np.unique(self.carrier)
        )

    @cached_property
    def by_contact(self) -> dict[int, FloatArray]:
        """(6, g) wrenches of the generators of each contact, zero for the others."""
        return {int(index): self.wrenches * (self.contact == index) for index in np.unique(self.contact)}


def plan_forces(
    body: BodyModel,
    schedule: ContactSchedule,
    time: FloatArray,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
) -> ContactForces:
    """Distribute the contact forces of a motion and compute its joint torques.

    Args:
        body: The body.
        schedule: Its contacts in time.
        time: (n,) [s].
        q: (n, nq) configurations.
        v: (n, nv) velocities.
        a: (n, nv) accelerations.
    """
    model = body.pinocchio
    data = model.createData()
    names = schedule.sequence.effectors
    stances = [_generators(body, phase.stance, names) for phase in schedule.sequence]
    shares = load_shares(schedule, time, names)
    settling = {name: schedule.settling(time, name) for name in names}
    sliding = [name for name in names if np.any(settling[name])]
    phases = schedule.phase_at(time)
    rotations = rotation_from_quaternion(q[:, 3:7])
    tau = np.zeros((len(time), model.nv))
    forces = np.zeros((len(time), len(names), 6))
    for k in range(len(time)):
        needed = pin.rnea(model, data, q[k], v[k], a[k]).copy()
        generators, stance = stances[phases[k]], schedule.sequence[int(phases[k])].stance
        for name in sliding:
            if settling[name][k]:
                here = effector_position(body, data, q[k], name)
                generators = generators.shifted(names.index(name), here - stance[name].position)
        wrench = _base_wrench_in_world(needed[:6], q[k], rotations[k])
        magnitude = _share_wrench(generators, wrench, shares[k])
        pin.computeJointJacobians(model, data, q[k])
        tau[k] = needed - _apply(model, data, generators, magnitude)
        if np.any(np.abs(tau[k, 6:]) > body.torque_limit) or np.any(magnitude > generators.limit):
            other = _share_within_limits(
                generators,
                wrench,
                shares[k],
                needed[6:],
                _joint_map(model, data, generators)[6:],
                TORQUE_SHARE * body.torque_limit,
            )
            if other is not None:
                magnitude = other
                tau[k] = needed - _apply(model, data, generators, magnitude)
        forces[k] = _by_contact(generators, magnitude, stance, names)
    return ContactForces(tau, forces, np.linalg.norm(tau[:, :6], axis=1))


def effector_position(body: BodyModel, data: pin.Data, q: FloatArray, effector: str) -> FloatArray:
    """(3,) place of an effector in the world [m]."""
    pin.forwardKinematics(body.pinocchio, data, q)
    place = pin.updateFramePlacement(body.pinocchio, data, body.effector_frame(effector))
    return np.array(place.translation)


def load_shares(schedule: ContactSchedule, time: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """(n, c) readiness of each contact to carry load, ramping from 0.05 to 1 at its ends."""
    shares = np.ones((len(time), len(names)))
    held = np.array([[name in phase.stance for name in names] for phase in schedule.sequence])
    for column in range(len(names)):
        for phase in range(1, len(held)):
            instant = schedule.instants[phase]
            if held[phase, column] and not held[phase - 1, column]:
                after = time >= instant
                settles = schedule.sequence[phase].stance[names[column]].settle > 0.0
                ramp = _SUDDEN_RAMP if settles else _RAMP
                shares[after, column] = np.minimum(shares[after, column], (time[after] - instant) / ramp)
            if held[phase - 1, column] and not held[phase, column]:
                before = time < instant
                shares[before, column] = np.minimum(shares[before, column], (instant - time[before]) / _RAMP)
    return np.clip(shares, 0.05, 1.0)


def _generators(body: BodyModel, stance: Stance, names: tuple[str, ...]) -> _Generators:
    points, directions, contacts, carriers, costs, limits = [], [], [], [], [], []
    for contact in stance:
        edges = _edges(contact)
        for local in _force_points(body, contact):
            segment = carrying_segment(body, contact.effector, local)
            carrier = body.pinocchio.frames[body.segment_frame(segment)].parentJoint
            hanging = segment != body.effector(contact.effector).segment
            for edge in edges:
                points.append(contact.position + contact.rotation_contact_to_world @ local)
                directions.append(edge)
                contacts.append(names.index(contact.effector))
                carriers.append(carrier)
                costs.append(_HANGING_COST if hanging else 1.0)
                limits.append(contact.max_force if contact.kind is ContactKind.GRASP else np.inf)
    return _Generators(
        np.array(points), np.array(directions), np.array(contacts), np.array(carriers), np.array(costs),
        np.array(limits),
    )  # fmt: skip


def _force_points(body: BodyModel, contact: Contact) -> FloatArray:
    """(k, 3) points of the contact frame that carry force: corners, and the ends of the toes' hinge."""
    line = hinge_line(body, contact.effector)
    inside = line is not None and abs(line) < 0.5 * contact.length
    if (
        contact.kind is not ContactKind.SOLE
        or contact.part is not SolePart.FULL
        or line is None
        or not inside
    ):
        return contact.points
    half = 0.5 * contact.width
    return np.vstack([contact.points, [[line, half, 0.0], [line, -half, 0.0]]])


def _edges(contact: Contact) -> FloatArray:
    if contact.kind is ContactKind.GRASP:
        return np.vstack([np.eye(3), -np.eye(3)])
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * contact.friction
    local = np.column_stack([signs, np.ones(4)])
    return local @ contact.rotation_contact_to_world.T


def _base_wrench_in_world(base: FloatArray, q: FloatArray, rotation: FloatArray) -> FloatArray:
    """Wrench about the world origin of the pelvis part of a generalised force."""
    force = rotation @ base[:3]
    return np.concatenate([force, rotation @ base[3:6] + skew(q[:3]) @ force])


def _share_wrench(generators: _Generators, wrench: FloatArray, shares: FloatArray) -> FloatArray:
    """Magnitudes (g,) >= 0 that supply the wrench with the least weighted square.

    The wrench is taken about the mean contact point, in units of its force, for conditioning.
    """
    matrix, target = _centred(generators, wrench)
    cost = np.diag(generators.cost / shares[generators.contact])
    stacked = np.vstack([_WRENCH_WEIGHT * matrix, cost])
    wanted = np.concatenate([_WRENCH_WEIGHT * target, np.zeros(len(cost))])
    try:
        return nnls(stacked, wanted)[0]
    except RuntimeError:  # its active set cycles where generators are nearly dependent
        return lsq_linear(stacked, wanted, bounds=(0.0, np.inf), tol=1e-12).x


def _centred(generators: _Generators, wrench: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Wrenches (6, g) of the generators and the wanted one (6,) about the mean contact point."""
    centre, matrix = generators.balance
    force, moment = wrench[:3], wrench[3:]
    turned = np.array([
        centre[1] * force[2] - centre[2] * force[1],
        centre[2] * force[0] - centre[0] * force[2],
        centre[0] * force[1] - centre[1] * force[0],
    ])  # fmt: skip
    return matrix, np.concatenate([force, (moment - turned) / _ARM])


def _share_within_limits(
    generators: _Generators,
    wrench: FloatArray,
    shares: FloatArray,
    needed: FloatArray,
    joint_map: FloatArray,
    torque_limit: FloatArray,
) -> FloatArray | None:
    """Magnitudes (g,) that keep the joints' torques and the grasps' forces within their limits, or None.

    Args:
        generators: Force directions of the stance.
        wrench: (6,) to supply, about the world origin.
        shares: (c,) readiness of each contact to carry load.
        needed: (nv - 6,) joint torques without contacts [N.m].
        joint_map: (nv - 6, g) torque that a unit magnitude takes from each joint.
        torque_limit: (nv - 6,) [N.m].
    """
    matrix, target = _centred(generators, wrench)
    cost = (generators.cost / shares[generators.contact]) ** 2
    count = len(cost)
    limit = np.where(np.isfinite(generators.limit), generators.limit, 1e6)
    solution, _, flag, _ = daqp.solve(
        np.diag(cost / cost.mean()),
        np.zeros(count),
        np.ascontiguousarray(np.vstack([matrix, joint_map])),
        np.concatenate([limit, target, needed + torque_limit]),
        np.concatenate([np.zeros(count), target, needed - torque_limit]),
        np.concatenate([np.zeros(count), np.full(6, _EQUALITY), np.zeros(len(needed))]).astype(np.int32),
    )
    return np.maximum(np.asarray(solution, dtype=np.float64), 0.0) if flag > 0 else None


_EQUALITY = 5
"""DAQP's mark of an equality."""


def _joint_map(model: pin.Model, data: pin.Data, generators: _Generators) -> FloatArray:
    """(nv, g) generalised force of a unit magnitude of each generator."""
    total = np.zeros((model.nv, len(generators.cost)))
    for joint, wrenches in generators.by_carrier:
        total += pin.getJointJacobian(model, data, joint, pin.WORLD).T @ wrenches
    return total


def _apply(model: pin.Model, data: pin.Data, generators: _Generators, magnitude: FloatArray) -> FloatArray:
    """Generalised force of the contact forces."""
    total = np.zeros(model.nv)
    for joint, wrenches in generators.by_carrier:
        jacobian = pin.getJointJacobian(model, data, joint, pin.WORLD)
        total += jacobian.T @ (wrenches @ magnitude)
    return total


def _by_contact(
    generators: _Generators, magnitude: FloatArray, stance: Stance, names: tuple[str, ...]
) -> FloatArray:
    out = np.zeros((len(names), 6))
    for contact in stance:
        index = names.index(contact.effector)
        resultant = generators.by_contact[index] @ magnitude
        out[index, :3] = resultant[:3]
        out[index, 3:] = resultant[3:] - skew(contact.position) @ resultant[:3]
    return out
