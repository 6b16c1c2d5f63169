"""A motion that is there already, made with a load in the hands."""

from manikin.balance.motion_margin import motion_margin
from manikin.body import BodyModel, carrying
from manikin.contact import ContactSchedule
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.wholebody.forces import plan_forces
from manikin.wholebody.full_motion import centroidal_state


def carried_motion(
    body: BodyModel, motion: Motion, schedule: ContactSchedule, mass: float, hand: str = "both"
) -> tuple[BodyModel, Motion]:
    """The same postures with a load in the hands: what they need of contacts and joints is computed anew.

    Centre of mass, momentum, contact forces, torques and the margin (about the centre of mass) are those of
    the loaded body on the planned contacts. Nothing is planned again: a negative margin says that nobody
    would move so with that load.

    Args:
        body: Who moves, with empty hands.
        motion: Its motion.
        schedule: Its contacts in time.
        mass: Of the load [kg].
        hand: ``"left"``, ``"right"`` or ``"both"``.

    Returns:
        The body with the load, and the motion.

    Raises:
        InputError: If the body carries something already, or has no such hand.
    """
    if body.loads:
        raise InputError(
            f"the motion was made with {sum(body.loads.values()):g} kg in the hands; valid: a motion without"
        )
    loaded = carrying(body, mass, hand)
    time, q, v, a = motion.time, motion.q, motion.v, motion.a
    com, momentum, wrench = centroidal_state(loaded, q, v, a)
    forces = plan_forces(loaded, schedule, time, q, v, a)
    stances = [phase.stance.bounded(loaded.mass) for phase in schedule.sequence]
    names = schedule.sequence.effectors
    return loaded, Motion(
        time=time, q=q, v=v, a=a, tau=forces.tau, com=com, angular_momentum=momentum,
        margin=motion_margin(stances, schedule.phase_at(time), wrench, com).margin,
        support=schedule.support(time, names), contact_force=forces.contact_force, contact_names=names,
        joint_names=loaded.joint_names,
    )  # fmt: skip
