"""Joint torques beyond the strength as residuals of the whole-body fit, with their derivatives.

The torques that inverse dynamics asks of the joints with the contact forces of an earlier motion are
differentiated by the state. What wrench the root then lacks is given by changes of those forces at the points
of the contacts, least in the sum of squares, weighed by the load of each contact. A single support has one
such change, so that a step along these derivatives shifts its centre of pressure as the true one does;
between several supports the forces are shared anew after each fit.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment
from manikin.body.strength import with_masses
from manikin.contact import CarriedLoad, Contact, ContactSchedule
from manikin.motion import Motion
from manikin.motion.configuration_spline import StateSamples
from manikin.numerics.spatial import FloatArray, skew

AT_KEY = 1.0e-6
"""Time from a key instant within which a sample is at it [s]."""


@dataclass(frozen=True, eq=False)
class HeldForces:
    """Contact forces at the samples of a fit.

    Attributes:
        joints: (c,) joint that carries each effector.
        known: (n,) whether the forces supply what the motion needs; not so where a contact made at speed
            still settles.
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
    def of(cls, body: BodyModel, schedule: ContactSchedule, motion: Motion, time: FloatArray) -> "HeldForces":
        """Contact forces of a motion at the samples (n,) of a fit [s].

        At a key instant they are those on the stance before or after it that has fewer contacts.
        """
        rows = np.clip(np.searchsorted(motion.time, time), 0, len(motion.time) - 1)
        made = np.diff([len(phase.stance) for phase in schedule.sequence]) > 0
        ends = np.any(np.abs(time[:, None] - schedule.instants[1:-1][made]) < AT_KEY, axis=1)
        before = np.searchsorted(motion.time, time - AT_KEY) - 1
        rows = np.where(ends, np.maximum(before, 0), rows)
        names, phases = motion.contact_names, schedule.phase_at(motion.time[rows])
        settling = np.any([schedule.settling(motion.time[rows], name) for name in names], axis=0)
        # Wrench that contact forces may leave unsupplied where they are held [N, N.m].
        known = ~settling & (np.linalg.norm(motion.tau[rows, :6], axis=1) < 1.0)
        wrench = motion.contact_force[rows].copy()
        give = np.zeros((*wrench.shape, 6))
        for number, phase in enumerate(schedule.sequence):
            for contact in phase.stance:
                part = phases == number, names.index(contact.effector)
                wrench[*part, 3:] += np.cross(contact.position, wrench[*part, :3])
                load = np.linalg.norm(wrench[*part, :3], axis=1)
                give[part] = load[:, None, None] * compliance(contact)
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


def excess_torque(body: BodyModel, states: StateSamples, held: HeldForces, wanted: float) -> ExcessTorque:
    """Shares of the strength that n states take beyond ``wanted``, with forces near those held."""
    data_of = {id(model): model.createData() for model in {id(each): each for each in held.models}.values()}
    n, hinges = len(states.q), np.array(held.hinges)
    torque, answer = np.empty((n, body.nv - 6)), np.empty((n, body.nv - 6, 6))
    external: list[pin.StdVec_Force] = []
    for s, model in enumerate(held.models):
        data = data_of[id(model)]
        pin.computeJointJacobians(model, data, states.q[s])
        forces = pin.StdVec_Force()
        forces.extend([pin.Force.Zero() for _ in range(model.njoints)])
        by_root = np.zeros((body.nv, 6))
        for joint, wrench, sharing in zip(held.joints, held.wrench[s], held.sharing[s], strict=True):
            forces[joint] += data.oMi[joint].actInv(pin.Force(wrench))
            by_root -= pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.WORLD).T @ sharing
        external.append(forces)
        answer[s] = by_root[6:] @ data.oMi[1].toDualActionMatrix()
        required = pin.rnea(model, data, states.q[s], states.v[s], states.a[s], forces)
        torque[s] = required[6:] + answer[s] @ required[:6]
    limit = np.where(torque > 0.0, body.torque_upper, body.torque_lower)
    excess = np.where(held.known[:, None], np.maximum(torque / limit - wanted, 0.0), 0.0)[:, hinges]
    active = np.flatnonzero(np.any(excess > 0.0, axis=0))
    value, rows = excess[:, active], hinges[active]
    by_state = np.zeros((3, n, len(rows), body.nv))
    for s in np.flatnonzero(np.any(value > 0.0, axis=1)):
        model = held.models[s]
        by_q, by_v, by_a = pin.computeRNEADerivatives(
            model, data_of[id(model)], states.q[s], states.v[s], states.a[s], external[s]
        )
        scale = (value[s] > 0.0) / limit[s, rows]
        full = np.triu(by_a) + np.triu(by_a, 1).T
        for out, by in zip(by_state, (by_q, by_v, full), strict=True):
            out[s] = scale[:, None] * (by[6 + rows] + answer[s, rows] @ by[:6])
    return ExcessTorque(rows, value, (by_state[0], by_state[1], by_state[2]))
