"""From a seat onto the feet: the first stages of a plan whose start holds on by more than feet."""

from manikin.body import Configuration
from manikin.contact_planning.depth_first import SearchLog
from manikin.contact_planning.extension import PartialPlan
from manikin.contact_planning.poser import Poser
from manikin.contact_planning.stage import Stage
from manikin.spatial import FloatArray

LEANING = (0.2, 0.4, 0.6, 0.8, 0.92)
"""Shares of the way of the centre of mass to the feet at which a body that leaves a seat has a posture."""

LEANING_TIME = 0.3
"""Shortest time between two of them [s]."""

SEAT_OFF_INSET = 0.015
"""Distance of the centre of mass to the edge of where it may rest on the feet when a seat is left [m]."""

RISING_TIME = 1.8
"""Shortest time from there to standing [s]."""

SETTLING_TIME = 0.8
"""Shortest time that the body stands then [s]."""

SEATED_ROOM = (0.01, 0.01, 0.006)
"""How far from these postures the centre of mass may be [m]: a seated trunk cannot follow any path."""


def on_feet(
    poser: Poser, start: Stage, feet: frozenset[str], upright: FloatArray, log: SearchLog
) -> PartialPlan | None:
    """The start on feet; its other contacts are left first, all at once.

    Args:
        poser: Finds postures.
        start: Contacts and posture at the start.
        feet: Effectors to stand on.
        upright: (7,) pose of the root that has risen.
        log: Where a missing posture is noted.

    Returns:
        The stages up to standing on feet alone; None where a posture is missing.
    """
    body = poser.body
    held = {name: contact for name, contact in start.contacts.items() if name in feet}
    along = dict.fromkeys(held, 0.0)
    if len(held) == len(start.contacts):
        return PartialPlan((start,), along)
    leaving = poser.pose(start.contacts, held, start.q, inset=SEAT_OFF_INSET, restarts=True)
    if leaving.q is None:
        log.refuse(leaving.reason)
        return None
    over_feet = Configuration(body, leaving.q).com[:2]
    stages = [start]
    for share in LEANING:
        place = (1.0 - share) * start.com[:2] + share * over_feet
        posed = poser.pose(start.contacts, start.contacts, stages[-1].q, place=place)
        if posed.q is not None:
            stages.append(Stage.of(body, start.contacts, posed.q, LEANING_TIME, SEATED_ROOM))
    stages.append(Stage.of(body, held, leaving.q, RISING_TIME, SEATED_ROOM))
    risen = poser.pose(held, held, leaving.q, upright, restarts=True)
    if risen.q is None:
        log.refuse(risen.reason)
        return None
    stages.append(Stage.of(body, held, risen.q, SETTLING_TIME))
    return PartialPlan(tuple(stages), along)
