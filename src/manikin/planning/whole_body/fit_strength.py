"""Joint torques beyond the strength as residuals of the whole-body fit, with their derivatives.

The contact forces of an earlier motion are held where they act, and the torques that inverse
dynamics then asks of the joints are differentiated by posture and acceleration
(:func:`pinocchio.computeRNEADerivatives`). With the centre of mass and the momentum on their plan the forces
of a single support hardly depend on the posture, so that a step along these derivatives is one of the true
torques; in a double support the forces are shared anew after each fit.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment
from manikin.body.strength import with_masses
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.configuration_spline import StateSamples
from manikin.numerics.spatial import FloatArray

MISSING = 1.0
"""Wrench that contact forces may leave unsupplied where they are held [N, N.m]."""


@dataclass(frozen=True, eq=False)
class HeldForces:
    """Contact forces at the samples of a fit.

    Attributes:
        joints: (c,) joint that carries each effector.
        known: (n,) whether the forces supply what the motion needs; not so where a contact made at speed
            still settles.
        wrench: (n, c, 6) force [N] and moment about the world origin [N.m], world axes.
        hinges: (k,) hinges whose torque counts: those that a force does not reach through toes.
        models: n models of the body, with what it carries then.
    """

    joints: tuple[int, ...]
    known: NDArray[np.bool_]
    wrench: FloatArray
    hinges: tuple[int, ...]
    models: tuple[pin.Model, ...]

    @classmethod
    def of(cls, body: BodyModel, schedule: ContactSchedule, motion: Motion, time: FloatArray) -> "HeldForces":
        """Contact forces of a motion at other times.

        Args:
            time: (n,) samples of the fit [s].
        """
        rows = np.clip(np.searchsorted(motion.time, time), 0, len(motion.time) - 1)
        names, phases = motion.contact_names, schedule.phase_at(motion.time[rows])
        settling = np.any([schedule.settling(motion.time[rows], name) for name in names], axis=0)
        known = ~settling & (np.linalg.norm(motion.tau[rows, :6], axis=1) < MISSING)
        wrench = motion.contact_force[rows].copy()
        for sample, phase in enumerate(phases):
            for contact in schedule.sequence[int(phase)].stance:
                part = wrench[sample, names.index(contact.effector)]
                part[3:] += np.cross(contact.position, part[:3])
        model: pin.Model = body.pinocchio
        joints = tuple(model.frames[body.effector_frame(name)].parentJoint for name in names)
        toes = [hanging_segment(body, body.effector(name).segment) for name in names]
        left_out = {
            model.joints[model.frames[body.segment_frame(toe.name)].parentJoint].idx_v - 6
            for toe in toes if toe is not None
        }  # fmt: skip
        models = {id(None): model}
        loads = [schedule.sequence[int(phase)].load for phase in phases]
        for load in loads:
            if load is not None and id(load) not in models:
                models[id(load)] = with_masses(body, load.masses).pinocchio
        return cls(
            joints, known, wrench, tuple(k for k in range(body.nv - 6) if k not in left_out),
            tuple(models[id(load)] for load in loads),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class ExcessTorque:
    """Shares of the strength beyond the wanted one.

    Attributes:
        hinges: (k,) the hinges that have one at some sample.
        value: (n, k) excess of their shares, zero where there is none.
        by_posture: (n, k, nv) its derivative by the tangent of the configuration.
        by_acceleration: (n, k, nv) its derivative by the acceleration.
    """

    hinges: NDArray[np.int64]
    value: FloatArray
    by_posture: FloatArray
    by_acceleration: FloatArray


def excess_torque(body: BodyModel, states: StateSamples, held: HeldForces, wanted: float) -> ExcessTorque:
    """Shares of the strength that sampled states take beyond ``wanted`` while contact forces are held.

    Args:
        states: n states.
        wanted: Share of the strength that costs nothing.
    """
    data_of = {key: model.createData() for key, model in {id(each): each for each in held.models}.items()}
    n, hinges = len(states.q), np.array(held.hinges)
    torque = np.empty((n, body.nv - 6))
    external: list[pin.StdVec_Force] = []
    for s, model in enumerate(held.models):
        data = data_of[id(model)]
        pin.forwardKinematics(model, data, states.q[s])
        forces = pin.StdVec_Force()
        forces.extend([pin.Force.Zero() for _ in range(model.njoints)])
        for joint, wrench in zip(held.joints, held.wrench[s], strict=True):
            forces[joint] += data.oMi[joint].actInv(pin.Force(wrench))
        external.append(forces)
        torque[s] = pin.rnea(model, data, states.q[s], states.v[s], states.a[s], forces)[6:]
    limit = np.where(torque > 0.0, body.torque_upper, body.torque_lower)
    excess = np.where(held.known[:, None], np.maximum(torque / limit - wanted, 0.0), 0.0)[:, hinges]
    active = np.flatnonzero(np.any(excess > 0.0, axis=0))
    value, rows = excess[:, active], hinges[active]
    by_posture, by_acceleration = np.zeros((2, n, len(rows), body.nv))
    for s in np.flatnonzero(np.any(value > 0.0, axis=1)):
        model = held.models[s]
        by_q, _, by_a = pin.computeRNEADerivatives(
            model, data_of[id(model)], states.q[s], states.v[s], states.a[s], external[s]
        )
        scale = (value[s] > 0.0) / limit[s, rows]
        by_posture[s] = scale[:, None] * by_q[6 + rows]
        full = np.triu(by_a) + np.triu(by_a, 1).T
        by_acceleration[s] = scale[:, None] * full[6 + rows]
    return ExcessTorque(rows, value, by_posture, by_acceleration)
