"""First contacts of any limbs: places near where each limb should be, in the order in which they fit."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from manikin.contact import Contact
from manikin.contact_planning.generator import GeneratedContact
from manikin.contact_planning.limb_extend import UP
from manikin.contact_planning.limb_places import LimbPlaces
from manikin.contact_planning.poser import Poser
from manikin.contact_planning.stage import Stage
from manikin.spatial import FloatArray

PLACES = 4
"""Places of each limb among which the start is sought."""

TRIES = 40
"""Most of their combinations for which a posture is looked for; our choice."""


@dataclass(frozen=True, eq=False)
class LimbStart:
    """A start on limbs, or why there is none.

    Attributes:
        stage: Contacts and a posture at rest on them, or None.
        reason: In one line, where there is none.
    """

    stage: Stage | None
    reason: str = ""


def starts_on_limbs(poser: Poser, places: LimbPlaces, q: FloatArray, duration: float) -> Iterator[LimbStart]:
    """Starts near a posture that touches nothing, the best contacts first; one failure where there is none.

    Args:
        poser: Finds postures of the body in its scene.
        places: Offers contacts of its limbs.
        q: (nq,) where the body should be, each limb where it should be relative to the root.
        duration: Shortest time for which the contacts are held [s].
    """
    offered = {name: _contacts(places.find(name, q, q[:7], UP, PLACES)) for name in places.limbs}
    offered = {name: items for name, items in offered.items() if items}
    if not offered:
        yield LimbStart(None, "no limb has a contact")
        return
    reason, found = "", False
    for contacts in islice(best_first(offered), TRIES):
        posed = poser.pose(contacts, contacts, q, q[:7])
        reason = reason or posed.reason
        if posed.q is not None:
            found = True
            yield LimbStart(Stage.of(poser.body, contacts, posed.q, duration))
    if not found:
        yield LimbStart(None, reason)


def _contacts(found: list[GeneratedContact]) -> list[tuple[float, Contact]]:
    """Contacts of one limb with what each is worse than the best, by the scores of the generator."""
    places = [(item.score, item.contact) for item in found if item.contact is not None]
    best = max((score for score, _ in places), default=0.0)
    return sorted(((best - score, contact) for score, contact in places), key=lambda item: item[0])


def best_first(offered: Mapping[str, list[tuple[float, Contact]]]) -> Iterator[dict[str, Contact]]:
    """One contact for each limb, the least loss of score in all first."""
    items = list(offered.values())
    known = {(0,) * len(items)}
    open_ = [(0.0, choice) for choice in known]
    while open_:
        _, choice = heapq.heappop(open_)
        yield {item[k][1].effector: item[k][1] for item, k in zip(items, choice, strict=True)}
        for limb, k in enumerate(choice):
            after = (*choice[:limb], k + 1, *choice[limb + 1 :])
            if k + 1 < len(items[limb]) and after not in known:
                known.add(after)
                cost = sum(item[number][0] for item, number in zip(items, after, strict=True))
                heapq.heappush(open_, (cost, after))
