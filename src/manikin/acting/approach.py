"""From the way to an act to the act: the last contacts of a contact plan."""

from manikin.acting.brace import Brace
from manikin.body import BodyModel
from manikin.contact_planning import ContactPlan, Stage

REACHING_TIME = 1.2
"""Shortest time in which the hands go to the object [s]; our choice."""

TOUCHING_TIME = 0.5
"""Shortest time from their touch to the act [s]."""

ROOM = (0.02, 0.02, 0.02)
"""How far from that of the posture the centre of mass may be when the hands touch [m]."""


def arrival(body: BodyModel, brace: Brace) -> Stage:
    """Goal of the way: the feet of the act, the hands still free."""
    return Stage.of(body, brace.feet, brace.q, REACHING_TIME)


def with_hands(body: BodyModel, way: ContactPlan, brace: Brace) -> ContactPlan:
    """The way to the act and the hands put to the object, both at once.

    Args:
        body: The body.
        way: Contacts from the start to the feet of the act.
        brace: The posture that acts, on the feet of the way's last stage.
    """
    last = way.stages[-1]
    reaching = Stage.of(body, last.contacts, last.q, REACHING_TIME, last.com_room)
    acting = Stage.of(body, {**last.contacts, **brace.hands}, brace.q, TOUCHING_TIME, ROOM)
    return ContactPlan.of(body, [*way.stages[:-1], reaching, acting], brace.q)
