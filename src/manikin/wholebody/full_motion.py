"""A motion complete with forces, torques, centre of mass and margin, from its states and contacts."""

from collections.abc import Sequence

from manikin.balance import WrenchPolytope, motion_margin
from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.motion.dynamics import centroidal_motion
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
    found = centroidal_motion(body, q, v, a)
    forces = plan_forces(body, schedule, time, q, v, a)
    stances = [phase.stance for phase in schedule.sequence]
    margin = motion_margin(stances, schedule.phase_at(time), found.wrench, found.com, polytopes=polytopes)
    names = schedule.sequence.effectors
    motion = Motion(
        time=time, q=q, v=v, a=a, tau=forces.tau, com=found.com, angular_momentum=found.angular_momentum,
        margin=margin.margin, support=schedule.support(time, names),
        contact_force=forces.contact_force, contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip
    return motion, found.wrench
