"""A motion that is there already, made with a load in the hands."""

from manikin.balance import wrench_polytopes
from manikin.body import BodyModel, carrying
from manikin.contact import ContactSchedule
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.wholebody.full_motion import full_motion


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
    stances = [phase.stance.bounded(loaded.mass) for phase in schedule.sequence]
    states = motion.time, motion.q, motion.v, motion.a
    measured, _ = full_motion(loaded, schedule, wrench_polytopes(stances), *states)
    return loaded, measured
