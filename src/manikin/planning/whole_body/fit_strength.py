"""Joint torques beyond the strength as residuals of the whole-body fit, with their derivatives.

The torques that inverse dynamics asks of the joints with the contact forces of a motion nearby are
differentiated by the state. What wrench the root then lacks is given by changes of those forces at the points
of the contacts, least in the sum of squares, weighed by the load of each contact. A single support has one
such change, so that a step along these derivatives shifts its centre of pressure as the true one does;
between several supports the forces are shared anew now and then (:meth:`.MotionFit.solve`).
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.balance.motion_forces import plan_forces
from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment
from manikin.body.strength import with_masses
from manikin.contact import CarriedLoad, Contact, ContactSchedule
from manikin.motion.configuration_spline import StateSamples
from manikin.numerics.spatial import FloatArray, rotation_from_quaternion, skew
from manikin.scene.distance import moves_by_joint

AT_KEY = 1.0e-6
"""Time from a key instant within which a sample is at it [s]."""


@dataclass(frozen=True, eq=False)
class HeldForces:
    """Contact forces at the samples of a fit.

    Attributes:
        joints: (c,) joint that carries each effector.
        known: (n,) whether the forces supply what the motion needs.
        wrench: (n, c, 6) force [N] and moment about the world origin [N.m], world axes.
        sharing: (n, c, 6, 6) change of each of these wrenches for one that is missing.
        hinges: (k,) hinges whose torque counts: those that a force does not reach through toes.
        models: n models of the body, with what it carries then.
    """

    joints: tuple[int, ...]
    known: NDArray[np.bool_]
    wrench: FloatArray
    sharing: FloatArray
    hinges: tuple[int, ...]
    models: tuple[pin.Model, ...]

    @classmethod
    def of(
        cls, body: BodyModel, schedule: ContactSchedule, time: FloatArray, states: StateSamples
    ) -> "HeldForces":
        """Contact forces of the states of a motion at times (n,) [s].

        At a key instant they are those on the stance before or after it that has fewer contacts.
        """
        made = np.diff([len(phase.stance) for phase in schedule.sequence]) > 0
        ends = np.any(np.abs(time[:, None] - schedule.instants[1:-1][made]) < AT_KEY, axis=1)
        time = np.where(ends, time - 2.0 * AT_KEY, time)
        tau, wrench = plan_forces(body, schedule, time, *states)
        names, phases = schedule.sequence.effectors, schedule.phase_at(time)
        # Wrench that contact forces may leave unsupplied where they are held [N, N.m].
        known = np.linalg.norm(tau[:, :6], axis=1) < 1.0
        give, data = np.zeros((*wrench.shape, 6)), body.pinocchio.createData()
        for number, phase in enumerate(schedule.sequence):
            for contact in phase.stance:
                part = phases == number, names.index(contact.effector)
                wrench[*part, 3:] += np.cross(contact.position, wrench[*part, :3])
                load = np.linalg.norm(wrench[*part, :3], axis=1)
                give[part] = load[:, None, None] * compliance(contact)
                for row in np.flatnonzero((phases == number) & schedule.settling(time, contact.effector)):
                    pin.forwardKinematics(body.pinocchio, data, states.q[row])
                    frame = body.effector_frame(contact.effector)
                    here = pin.updateFramePlacement(body.pinocchio, data, frame)
                    moved = replace(
                        contact, position=here.translation, rotation_contact_to_world=here.rotation
                    )
                    own = row, names.index(contact.effector)
                    give[own] = np.linalg.norm(wrench[own][:3]) * compliance(moved)
        # Eigenvalues of the contacts' compliance below this share of the largest give no wrench.
        sharing = give @ np.linalg.pinv(give.sum(axis=1), rcond=1e-10, hermitian=True)[:, None]
        model: pin.Model = body.pinocchio
        joints = tuple(model.frames[body.effector_frame(name)].parentJoint for name in names)
        toes = [hanging_segment(body, body.effector(name).segment) for name in names]
        left_out = {
            model.joints[model.frames[body.segment_frame(toe.name)].parentJoint].idx_v - 6
            for toe in toes if toe is not None
        }  # fmt: skip

        @cache
        def loaded(load: CarriedLoad | None) -> pin.Model:
            return model if load is None else with_masses(body, load.masses).pinocchio

        models = tuple(loaded(schedule.sequence[int(phase)].load) for phase in phases)
        hinges = tuple(k for k in range(body.nv - 6) if k not in left_out)
        return cls(joints, known, wrench, sharing, hinges, models)


def compliance(contact: Contact) -> FloatArray:
    """(6, 6) sum over a contact's points of the wrenches of unit forces there, about the world origin.

    Times a wrench's multiplier it is the change of the contact's wrench that has the least squares of forces.
    """
    points = contact.points_in_world
    moment = skew(points)
    result = np.zeros((6, 6))
    result[:3, :3] = len(points) * np.eye(3)
    result[3:, :3] = moment.sum(axis=0)
    result[:3, 3:] = result[3:, :3].T
    result[3:, 3:] = (moment @ moment.transpose(0, 2, 1)).sum(axis=0)
    if contact.max_force > 0.0:
        result[3:, 3:] += (contact.max_moment / contact.max_force) ** 2 * np.eye(3)
    return result


class ExcessTorque(NamedTuple):
    """Shares of the strength beyond the wanted one.

    Attributes:
        hinges: (k,) the hinges that have one at some sample.
        value: (n, k) excess of their shares, zero where there is none.
        by_state: (n, k, nv) its derivatives by the tangent of the configuration, velocity and acceleration.
    """

    hinges: NDArray[np.int64]
    value: FloatArray
    by_state: tuple[FloatArray, FloatArray, FloatArray]


def excess_torque(
    body: BodyModel, states: StateSamples, jacobians: FloatArray, held: HeldForces, wanted: float
) -> ExcessTorque:
    """Shares of the strength that n states take beyond ``wanted``, with forces near those held.

    Args:
        jacobians: (n, 6, nv) of all joints at the states: velocity of the point at the world origin, and
            angular one.
    """
    data_of = {id(model): model.createData() for model in {id(each): each for each in held.models}.values()}
    n, moves = len(states.q), moves_by_joint(body.pinocchio)
    required, answer = np.empty((n, body.nv)), np.zeros((n, body.nv, 6))
    for s, model in enumerate(held.models):
        required[s] = pin.rnea(model, data_of[id(model)], states.q[s], states.v[s], states.a[s])
    for number, joint in enumerate(held.joints):
        columns = np.flatnonzero(moves[joint])
        by_wrench = jacobians[:, :, columns].transpose(0, 2, 1)
        required[:, columns] -= (by_wrench @ held.wrench[:, number, :, None])[:, :, 0]
        answer[:, columns] -= by_wrench @ held.sharing[:, number]
    answer = answer[:, 6:] @ _root_to_world(states.q)
    torque = required[:, 6:] + (answer @ required[:, :6, None])[:, :, 0]
    limit = np.where(torque > 0.0, body.torque_upper, body.torque_lower)
    hinges = np.array(held.hinges)
    excess = np.where(held.known[:, None], np.maximum(torque / limit - wanted, 0.0), 0.0)[:, hinges]
    active = np.flatnonzero(np.any(excess > 0.0, axis=0))
    value, rows = excess[:, active], hinges[active]
    strong = np.flatnonzero(np.any(value > 0.0, axis=1))
    by = np.empty((3, len(strong), body.nv, body.nv))
    forces = pin.StdVec_Force()
    forces.extend([pin.Force.Zero() for _ in range(body.pinocchio.njoints)])
    for k, s in enumerate(strong):
        model, data = held.models[s], data_of[id(held.models[s])]
        pin.forwardKinematics(model, data, states.q[s])
        for joint in held.joints:
            forces[joint] = pin.Force.Zero()
        for joint, wrench in zip(held.joints, held.wrench[s], strict=True):
            forces[joint] += data.oMi[joint].actInv(pin.Force(wrench))
        by[:, k] = pin.computeRNEADerivatives(model, data, states.q[s], states.v[s], states.a[s], forces)
    by[2] = np.triu(by[2]) + np.triu(by[2], 1).transpose(0, 2, 1)
    scale = (value[strong] > 0.0) / limit[strong][:, rows]
    by_state = np.zeros((3, n, len(rows), body.nv))
    by_state[:, strong] = scale[:, :, None] * (by[:, :, 6 + rows] + answer[strong][:, rows] @ by[:, :, :6])
    return ExcessTorque(rows, value, (by_state[0], by_state[1], by_state[2]))


def _root_to_world(q: FloatArray) -> FloatArray:
    """(n, 6, 6) map of a wrench on the root, in its frame, to the world's axes and origin."""
    rotation = rotation_from_quaternion(q[:, 3:7])
    result = np.zeros((len(q), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = rotation
    result[:, 3:, :3] = skew(q[:, :3]) @ rotation
    return result
