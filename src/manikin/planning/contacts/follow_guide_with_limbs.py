"""Contacts of any limbs along a guide of the root: [Tonneau2015]_ 7.2, algorithm 7, with a repair step.

One limb moves at a time: the one whose contact is farthest behind on the guide, to a place that the
generator finds where the limb should be when the root has gone ahead.  All others are maintained.  A
change counts only with three postures: one that still holds the old contact, one in which the limb is
free, one that holds the new contact, all free of collision, within the joint ranges and at rest on the
contacts that stay.  Where one is missing, another place, a shorter way or another limb is tried, and then
the change before is taken back.

Also here. First contacts of any limbs: places near where each limb should be, in the order in which they fit.
"""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.contact import Contact, ContactKind
from manikin.kinematics import Placement
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.contact_plan import ContactPlan, Stage
from manikin.planning.contacts.depth_first import (
    Extension,
    GuideLine,
    PartialPlan,
    SearchLog,
    search_depth_first,
)
from manikin.planning.contacts.generator import GeneratedContact
from manikin.planning.contacts.limb_places import LimbPlaces
from manikin.planning.contacts.posture_finder import Posed, PostureFinder

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


def starts_on_limbs(
    poser: PostureFinder, places: LimbPlaces, q: FloatArray, duration: float
) -> Iterator[LimbStart]:
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


UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LimbExtendSettings:
    """How contacts follow a guide; the values are our choice.

    Attributes:
        stride: Way of the root while every limb moves once [m].
        shares: Shares of it that are tried, in order.
        places: Places that are tried for each.
        searches: Most postures that are looked for.
        same_place: Distance between two contacts that is not worth a move [m].
        lift: How far a limb in flight keeps from the line between its contacts [m].
        swing_duration: Shortest flight of a limb [s].
        swing_speed: Its mean speed on longer ways [m/s].
        shift_duration: Shortest time between two flights [s].
        hinge_pace: Mean speed of the hinge that turns most [rad/s].
        goal_distance: Distance of the root from its goal at which it is reached [m].
        goal_turn: The same for its attitude [rad].
    """

    stride: float = 0.36
    shares: tuple[float, ...] = (1.0, 0.6, 0.3)
    places: int = 4
    searches: int = 600
    same_place: float = 0.12
    lift: float = 0.08
    swing_duration: float = 0.7
    swing_speed: float = 0.7
    shift_duration: float = 0.35
    hinge_pace: float = 1.3
    goal_distance: float = 0.08
    goal_turn: float = float(np.deg2rad(15.0))


@dataclass(frozen=True, eq=False)
class _Move:
    """One limb to another place, or away for good.

    Attributes:
        limb: Its effector, or that of what makes no contacts, such as a seat.
        lifting: (nq,) posture that rests on all other contacts.
        place: What the generator found; None for what is left for good.
        along: How far along the guide all limbs are then [m].
        there: How far along it the root is then [m].
    """

    limb: str
    lifting: FloatArray
    place: GeneratedContact | None
    along: Mapping[str, float]
    there: float


def follow_guide_with_limbs(
    poser: PostureFinder,
    places: LimbPlaces,
    guide: GuideLine,
    start: Stage,
    settings: LimbExtendSettings | None = None,
) -> Extension:
    """Find the contacts with which a body follows a guide on any of its limbs.

    Args:
        poser: Finds postures of the body in its scene.
        places: Offers contacts of its limbs.
        guide: Way of the root, from where it is at the start.
        start: Contacts and posture at the start; limbs without a contact make one where they can.
        settings: How to search.
    """
    settings = settings or LimbExtendSettings()
    log = SearchLog(poser, settings.searches)
    along = dict.fromkeys(places.limbs, -settings.stride) | dict.fromkeys(start.contacts, 0.0)
    moves = _LimbMoves(poser, places, guide, settings, log)
    return search_depth_first(PartialPlan((start,), along), moves, log, guide.length)


class _LimbMoves:
    """Moves of any limbs, as :class:`~manikin.planning.contacts.depth_first.Moves`."""

    def __init__(
        self,
        poser: PostureFinder,
        places: LimbPlaces,
        guide: GuideLine,
        settings: LimbExtendSettings,
        log: SearchLog,
    ) -> None:
        self._poser, self._places, self._guide, self._settings = poser, places, guide, settings
        self._body, self._log = poser.body, log

    def finished(self, partial: PartialPlan) -> ContactPlan | None:
        """The plan, when the root can be where the guide ends."""
        if partial.here < self._guide.length - 0.5 * self._settings.stride:
            return None
        contacts, goal = partial.last.contacts, self._guide.at(self._guide.length)
        posed = self._poser.pose(contacts, contacts, partial.last.q, goal)
        if posed.q is None:
            return None
        away = float(np.linalg.norm(posed.q[:3] - goal[:3]))
        turn = Rotation.from_quat(posed.q[3:7]) * Rotation.from_quat(goal[3:]).inv()
        if away > self._settings.goal_distance or turn.magnitude() > self._settings.goal_turn:
            self._log.refuse(f"the root stays {away:.2f} m from its goal")
            return None
        return ContactPlan.of(self._body, partial.stages, posed.q, self._settings.hinge_pace)

    def proposals(self, partial: PartialPlan) -> Iterator[_Move]:
        """Moves of the limb that is farthest behind first."""
        for name in sorted(partial.along, key=lambda limb: partial.along[limb]):
            lifting = self._lifted(partial, name)
            if lifting.q is None:
                self._log.refuse(f"{name} cannot leave its contact: {lifting.reason}")
                continue
            if name not in self._places.limbs:
                left = {other: value for other, value in partial.along.items() if other != name}
                yield _Move(name, lifting.q, None, left, partial.here)
                continue
            for along in self._aims(partial, name):
                yield from self._ahead(partial, name, lifting.q, along)
                if self._log.is_spent:
                    return

    def accepted(self, partial: PartialPlan, change: _Move) -> PartialPlan | None:
        """The plan with a move more, or None where a posture is missing."""
        if change.place is None:
            return self._left(partial, change)
        return self._landed(partial, change, change.place)

    def _left(self, partial: PartialPlan, move: _Move) -> PartialPlan:
        """A contact that no limb makes, such as a seat, left for good."""
        staying = _without(move.limb, partial.last.contacts)
        stage = Stage.of(self._body, staying, move.lifting, self._settings.swing_duration)
        return PartialPlan((*partial.stages, stage), move.along)

    def _aims(self, partial: PartialPlan, name: str) -> Iterator[float]:
        """How far along the guide the limb may go next."""
        held = [partial.along[other] for other in partial.last.contacts if other != name]
        ahead, own = max(held, default=0.0), partial.along[name]
        step = self._settings.stride / max(1, len(self._places.limbs) - 1)
        if name not in partial.last.contacts:
            step = 0.0
        tried: list[float] = []
        for share in self._settings.shares:
            along = min(max(ahead, 0.0) + share * step, self._guide.length)
            if along > own + 1e-6 and along not in tried:
                tried.append(along)
                yield along

    def _lifted(self, partial: PartialPlan, name: str) -> Posed:
        """Posture that holds all contacts and rests on all but one."""
        held = partial.last.contacts
        if name not in held:
            return Posed(partial.last.q)
        return self._pose(held, _without(name, held), partial.last.q, self._guide.at(partial.here))

    def _ahead(self, partial: PartialPlan, name: str, lifting: FloatArray, along: float) -> Iterator[_Move]:
        """Places ahead to which one limb may move."""
        staying = _without(name, partial.last.contacts)
        progress = {**partial.along, name: along}
        there = float(np.mean([progress[other] for other in (*staying, name)]))
        ahead = self._pose(staying, staying, lifting, self._guide.at(there))
        if ahead.q is None:
            self._log.refuse(f"the root cannot go on without {name}: {ahead.reason}")
            return
        direction = self._direction(there)
        found = self._places.find(name, ahead.q, self._guide.at(along), direction, self._settings.places)
        for place in found:
            yield _Move(name, lifting, place, progress, there)

    def _landed(self, partial: PartialPlan, move: _Move, place: GeneratedContact) -> PartialPlan | None:
        """The limb put to a place, or None where a posture is missing."""
        name = move.limb
        if place.contact is None or place.q is None:
            self._log.refuse(place.message)
            return None
        contact = replace(place.contact, oriented=False)
        before = partial.last.contacts.get(name)
        if (
            before is not None
            and np.linalg.norm(before.position - contact.position) < self._settings.same_place
        ):
            return replace(partial, along=move.along)
        staying = _without(name, partial.last.contacts)
        landed = {**staying, name: contact}
        landing = self._pose(landed, staying, place.q, self._guide.at(move.there))
        if landing.q is None:
            self._log.refuse(f"{name} cannot be put down: {landing.reason}")
            return None
        way = 0.0 if before is None else float(np.linalg.norm(contact.position - before.position))
        flight = max(self._settings.swing_duration, way / self._settings.swing_speed)
        stages = partial.stages
        if before is None:
            # The limb is free already: it reaches its contact while the phase before lasts.
            stages = (*stages[:-1], replace(stages[-1], min_duration=max(stages[-1].min_duration, flight)))
        else:
            via = self._between(staying, move.lifting, landing.q, before, contact)
            if via is None:
                self._log.refuse(f"{name} finds no way around")
                return None
            stages = (*stages, Stage.of(self._body, staying, move.lifting, flight, via=via))
        stages = (*stages, Stage.of(self._body, landed, landing.q, self._settings.shift_duration))
        return PartialPlan(stages, move.along)

    def _between(
        self,
        staying: Mapping[str, Contact],
        lifting: FloatArray,
        landing: FloatArray,
        before: Contact,
        after: Contact,
    ) -> FloatArray | None:
        """Posture in the middle of a flight, the limb off the line between its contacts, or None."""
        lift = self._settings.lift
        middle = 0.5 * (before.position + after.position)
        root = np.concatenate([0.5 * (lifting[:3] + landing[:3]), landing[3:7]])
        start = np.concatenate([root, 0.5 * (lifting + landing)[7:]])
        inward = (root[:3] - middle) * [1.0, 1.0, 0.0]
        inward /= max(float(np.linalg.norm(inward)), 1e-9)
        # What stands out of a wall is passed on the body's side, the ground from above.
        for share in (0.7, 0.0, 2.0):
            out = 0.5 * (before.normal + after.normal) + share * inward
            place = middle + lift * out / max(float(np.linalg.norm(out)), 1e-9)
            wish = {before.effector: Placement(place, None, None, 0.5 / lift**2)}
            posed = self._poser.pose(staying, staying, start, root, placements=wish)
            if posed.q is not None:
                return posed.q
        return None

    def _pose(
        self,
        held: Mapping[str, Contact],
        carrying: Mapping[str, Contact],
        start: FloatArray,
        guide: FloatArray,
    ) -> Posed:
        """A posture whose points stand upright on their surfaces, as far as they can."""
        wish = {
            name: Placement(None, contact.rotation_contact_to_world, 0.05)
            for name, contact in held.items()
            if contact.kind is ContactKind.POINT
        }
        return self._poser.pose(held, carrying, start, guide, placements=wish)

    def _direction(self, along: float) -> FloatArray:
        """(3,) where the scene shall push a limb: onward and up against the weight."""
        onward = self._guide.at(along + 0.3 * self._settings.stride)[:3] - self._guide.at(along)[:3]
        length = float(np.linalg.norm(onward))
        direction = UP + (onward / length if length > 1e-9 else 0.0)
        return direction if np.linalg.norm(direction) > 0.1 else UP


def _without(name: str, contacts: Mapping[str, Contact]) -> dict[str, Contact]:
    """All contacts but one."""
    return {other: contact for other, contact in contacts.items() if other != name}
