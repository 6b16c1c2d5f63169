"""Contact forces and joint torques of a recorded motion.

The wrench that a motion needs is known, and shared among its contacts by
:mod:`manikin.mocap.force_sharing`.
"""

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.mocap.force_sharing import shared_wrenches, smooth_shares
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_margins import RecordedMargins, recorded_margins
from manikin.motion.motion import Motion
from manikin.spatial import GRAVITY, FloatArray, wrench_about


def torques_of(dynamics: RecordedDynamics, effectors: tuple[str, ...], wrenches: FloatArray) -> FloatArray:
    """(n, nv) generalised forces beside those of contacts: torques of the joints, and what the pelvis lacks.

    Args:
        dynamics: The motion.
        effectors: c names.
        wrenches: (n, c, 6) on each, about the world's origin [N, N.m].
    """
    torques = np.array(dynamics.free_torque)
    for number, effector in enumerate(effectors):
        moved = _moved_by(dynamics.body, effector)
        torques[:, moved] -= np.einsum("nij,ni->nj", dynamics.jacobians[:, :, moved], wrenches[:, number])
    return torques


def contact_wrenches(dynamics: RecordedDynamics, schedule: ContactSchedule, start: float = 0.0) -> FloatArray:
    """(n, c, 6) wrench on each effector of a schedule, about the world's origin [N, N.m]; 0 off its contacts.

    Args:
        dynamics: The motion.
        schedule: Its stances.
        start: The schedule's clock at the motion's first instant [s].
    """
    names, times = schedule.sequence.effectors, dynamics.time + start
    phases = schedule.phase_at(times)
    held, points = schedule.support(times, names), np.zeros((len(times), len(names), 3))
    for number, phase in enumerate(schedule.sequence):
        for contact in phase.stance:
            points[phases == number, names.index(contact.effector)] = contact.position
    step = float(dynamics.time[1] - dynamics.time[0])
    wrenches, weight = smooth_shares(dynamics.wrench, held, points, step), GRAVITY * dynamics.body.mass
    for number, phase in enumerate(schedule.sequence):
        frames = np.flatnonzero(phases == number)
        if len(frames) and len(phase.stance) > 1:
            columns = [names.index(name) for name in phase.stance.effectors]
            near = wrenches[frames[:, None], columns]
            wrenches[frames[:, None], columns] = shared_wrenches(
                phase.stance, dynamics.wrench[frames], weight, near
            )
    return wrenches


def motion_on_contacts(
    dynamics: RecordedDynamics,
    schedule: ContactSchedule,
    start: float = 0.0,
    margins: RecordedMargins | None = None,
) -> Motion:
    """The recorded motion with contacts, their forces, joint torques and the margin of balance.

    The margin is that of the whole body about its centre of mass, see
    :func:`manikin.mocap.recorded_margins.recorded_margins`. In flight no contact can push: the torques are
    those that the motion would need with nothing to push against, and the margin is minus the length of
    the wrench that is missing. The pelvis' six generalised forces are zero: with contacts exactly (but for
    rounding), in flight what is missing is left out.

    Args:
        dynamics: The motion.
        schedule: Its stances, of :func:`manikin.mocap.recorded_stances.recorded_schedule`.
        start: The schedule's clock at the motion's first instant [s].
        margins: Of the same motion on the same stances, where they are known already.
    """
    names = schedule.sequence.effectors
    times = dynamics.time + start
    phases = schedule.phase_at(times)
    wrenches = contact_wrenches(dynamics, schedule, start)
    forces = np.zeros_like(wrenches)
    for number, phase in enumerate(schedule.sequence):
        frames = phases == number
        for contact in phase.stance:
            column = names.index(contact.effector)
            forces[frames, column] = wrench_about(wrenches[frames, column], contact.position)
    torques = torques_of(dynamics, names, wrenches)
    torques[:, :6] = 0.0
    return Motion(
        time=dynamics.time, q=dynamics.q, v=dynamics.v, a=dynamics.a, tau=torques, com=dynamics.com,
        angular_momentum=dynamics.angular_momentum,
        margin=(margins or recorded_margins(dynamics, schedule, start)).whole_body,
        support=schedule.support(times, names), contact_force=forces, contact_names=names,
        joint_names=tuple(dynamics.body.joint_names),
    )  # fmt: skip


def _moved_by(body: BodyModel, effector: str) -> list[int]:
    """Indices of the velocities that move an effector."""
    model = body.pinocchio
    joint = model.frames[body.effector_frame(effector)].parentJoint
    return [
        place
        for one in model.supports[joint]
        for place in range(model.idx_vs[one], model.idx_vs[one] + model.nvs[one])
        if one
    ]
