"""A motion complete with forces, torques, centre of mass and margin, from its states and contacts."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from manikin.balance import WrenchPolytope, motion_margin, pseudo_wrench
from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.spatial import FloatArray
from manikin.wholebody.forces import plan_forces


def full_motion(
    body: BodyModel,
    schedule: ContactSchedule,
    polytopes: Sequence[WrenchPolytope],
    time: FloatArray,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
) -> tuple[Motion, FloatArray]:
    """Share the contact forces of a motion and measure it.

    Args:
        body: The body.
        schedule: Its contacts in time.
        polytopes: Of each phase.
        time: (n,) [s].
        q: (n, nq) configurations.
        v: (n, nv) velocities.
        a: (n, nv) accelerations.

    Returns:
        The motion, and (n, 6) its whole-body pseudo-wrench about the world origin.
    """
    com, momentum, wrench = centroidal_state(body, q, v, a)
    forces = plan_forces(body, schedule, time, q, v, a)
    stances = [phase.stance for phase in schedule.sequence]
    margin = motion_margin(stances, schedule.phase_at(time), wrench, com, polytopes=polytopes)
    names = schedule.sequence.effectors
    motion = Motion(
        time=time, q=q, v=v, a=a, tau=forces.tau, com=com, angular_momentum=momentum,
        margin=margin.margin, support=schedule.support(time, names),
        contact_force=forces.contact_force, contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip
    return motion, wrench


def centroidal_state(
    body: BodyModel, q: FloatArray, v: FloatArray, a: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centre of mass (n, 3) [m], angular momentum (n, 3) and whole-body pseudo-wrench (n, 6)."""
    model, data = body.pinocchio, body.pinocchio.createData()
    com, momentum, rate = np.zeros((len(q), 3)), np.zeros((len(q), 3)), np.zeros((len(q), 6))
    for k in range(len(q)):
        pin.computeCentroidalMomentumTimeVariation(model, data, q[k], v[k], a[k])
        com[k], momentum[k], rate[k] = data.com[0], data.hg.angular, data.dhg.vector
    return com, momentum, pseudo_wrench(body.mass, com, rate[:, :3] / body.mass, rate[:, 3:])
