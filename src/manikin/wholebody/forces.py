"""Contact forces and joint torques that a planned motion needs.

The generalised forces of inverse dynamics leave a six-dimensional wrench that the contacts
must supply.  It is shared among the force-carrying points with the least squared force along
the edges of their friction pyramids; contacts that have just been made, or are about to be
left, cost more, so that load passes smoothly from one to the next.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.optimize import nnls

from manikin.body import BodyModel
from manikin.body.limb import carrying_segment, hinge_line
from manikin.contact import Contact, ContactKind, ContactSchedule, Stance
from manikin.spatial import FloatArray, skew
from manikin.wholebody.configuration_spline import rotation_from_quaternion

_RAMP = 0.08
"""Time over which a contact takes or loses its share of the load [s]."""

_WRENCH_WEIGHT = 1.0e3
"""Cost of missing the wrench relative to the cost of force."""


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
    """

    point: FloatArray
    direction: FloatArray
    contact: np.ndarray
    carrier: np.ndarray
    cost: FloatArray


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
    phases = schedule.phase_at(time)
    rotations = rotation_from_quaternion(q[:, 3:7])
    tau = np.zeros((len(time), model.nv))
    forces = np.zeros((len(time), len(names), 6))
    for k in range(len(time)):
        needed = pin.rnea(model, data, q[k], v[k], a[k]).copy()
        generators, stance = stances[phases[k]], schedule.sequence[int(phases[k])].stance
        wrench = _base_wrench_in_world(needed[:6], q[k], rotations[k])
        magnitude = _share_wrench(generators, wrench, shares[k])
        pin.computeJointJacobians(model, data, q[k])
        tau[k] = needed - _apply(model, data, generators, magnitude)
        forces[k] = _by_contact(generators, magnitude, stance, names)
    return ContactForces(tau, forces, np.linalg.norm(tau[:, :6], axis=1))


def load_shares(schedule: ContactSchedule, time: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """(n, c) readiness of each contact to carry load, ramping from 0.05 to 1 at its ends."""
    shares = np.ones((len(time), len(names)))
    held = np.array([[name in phase.stance for name in names] for phase in schedule.sequence])
    for column in range(len(names)):
        for phase in range(1, len(held)):
            instant = schedule.instants[phase]
            if held[phase, column] and not held[phase - 1, column]:
                after = time >= instant
                shares[after, column] = np.minimum(shares[after, column], (time[after] - instant) / _RAMP)
            if held[phase - 1, column] and not held[phase, column]:
                before = time < instant
                shares[before, column] = np.minimum(shares[before, column], (instant - time[before]) / _RAMP)
    return np.clip(shares, 0.05, 1.0)


def _generators(body: BodyModel, stance: Stance, names: tuple[str, ...]) -> _Generators:
    points, directions, contacts, carriers, costs = [], [], [], [], []
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
    return _Generators(
        np.array(points), np.array(directions), np.array(contacts), np.array(carriers), np.array(costs)
    )


def _force_points(body: BodyModel, contact: Contact) -> FloatArray:
    """(k, 3) points of the contact frame that carry force: corners, and the ends of the toes' hinge."""
    line = hinge_line(body, contact.effector)
    inside = line is not None and abs(line) < 0.5 * contact.length
    if contact.kind is not ContactKind.SOLE or line is None or not inside:
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
    return np.concatenate([force, rotation @ base[3:6] + np.cross(q[:3], force)])


def _share_wrench(generators: _Generators, wrench: FloatArray, shares: FloatArray) -> FloatArray:
    """Magnitudes (g,) >= 0 that supply the wrench with the least weighted square.

    The wrench is taken about the mean contact point, in units of its force, for conditioning.
    """
    centre = generators.point.mean(axis=0)
    arm = generators.point - centre
    matrix = np.hstack([generators.direction, np.cross(arm, generators.direction) / 0.1])
    target = np.concatenate([wrench[:3], (wrench[3:] - np.cross(centre, wrench[:3])) / 0.1])
    cost = np.diag(generators.cost / shares[generators.contact])
    stacked = np.vstack([_WRENCH_WEIGHT * matrix.T, cost])
    return nnls(stacked, np.concatenate([_WRENCH_WEIGHT * target, np.zeros(len(cost))]))[0]


def _apply(model: pin.Model, data: pin.Data, generators: _Generators, magnitude: FloatArray) -> FloatArray:
    """Generalised force of the contact forces."""
    total = np.zeros(model.nv)
    force = generators.direction * magnitude[:, None]
    for joint in np.unique(generators.carrier):
        mine = generators.carrier == joint
        jacobian = pin.getJointJacobian(model, data, int(joint), pin.WORLD)
        resultant = force[mine].sum(axis=0)
        moment = np.cross(generators.point[mine], force[mine]).sum(axis=0)
        total += jacobian.T @ np.concatenate([resultant, moment])
    return total


def _by_contact(
    generators: _Generators, magnitude: FloatArray, stance: Stance, names: tuple[str, ...]
) -> FloatArray:
    out = np.zeros((len(names), 6))
    force = generators.direction * magnitude[:, None]
    for contact in stance:
        mine = generators.contact == names.index(contact.effector)
        out[names.index(contact.effector), :3] = force[mine].sum(axis=0)
        moment = (skew(generators.point[mine] - contact.position) @ force[mine][:, :, None])[:, :, 0]
        out[names.index(contact.effector), 3:] = moment.sum(axis=0)
    return out
