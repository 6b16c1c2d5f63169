"""Contacts of a climber's limbs along a guide of the root: algorithm 7 of [Tonneau2015]_ 7.2.

The guide is followed limb by limb.  The limb that is farthest behind is put to a new place, its
contact broken and made; all others are maintained.  A change counts only when three postures exist,
free of collision and at rest on the contacts that stay: one that still holds the old contact, one with the
limb off the line between its contacts, and one that already holds the new one.  Where one is missing, a
shorter step, another place or another limb is tried, and then the change before is taken back.  Limbs go to
contacts of the :class:`~manikin.planning.contacts.ContactGenerator` until the root is at its goal.

A body that goes on its feet has :mod:`manikin.planning.contacts.walk_search`, a creature
:mod:`manikin.planning.contacts.limb_search`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.contact import Contact, ContactKind
from manikin.kinematics import Placement
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.best_first import Extension
from manikin.planning.contacts.contact_plan import HINGE_PACE, ContactPlan, Stage
from manikin.planning.contacts.depth_first import (
    GuideLine,
    PartialPlan,
    SearchLog,
    search_depth_first,
)
from manikin.planning.contacts.endpoint import UP
from manikin.planning.contacts.limb_places import LimbPlaces
from manikin.planning.contacts.posture_finder import Posed, PostureFinder

Item = TypeVar("Item")


@dataclass(frozen=True)
class ExtendSettings:
    """How contacts follow a guide; the values are our choice.

    Attributes:
        stride: Way of the root while every limb moves once [m].
        shares: Shares of the stride that are tried, in order.
        searches: Most postures that are looked for.
        lift: How far a limb in flight keeps from the line between its contacts [m].
        swing_duration: Shortest flight of a limb [s].
        swing_speed: Its mean speed on longer ways [m/s].
        shift_duration: Shortest time between two flights [s].
        hinge_pace: Mean speed of the hinge that turns most [rad/s].
        places: Places that are tried for each share of the stride.
        same_place: Distance between two contacts that is not worth a move [m].
        goal_distance: Distance of the root from its goal at which it is reached [m].
        goal_turn: Angle between the root's attitude and the goal's at which it is reached [rad].
    """

    stride: float = 0.36
    shares: tuple[float, ...] = (1.0, 0.6, 0.3)
    searches: int = 600
    lift: float = 0.08
    swing_duration: float = 0.7
    swing_speed: float = 0.7
    shift_duration: float = 0.35
    hinge_pace: float = HINGE_PACE
    places: int = 4
    same_place: float = 0.12
    goal_distance: float = 0.08
    goal_turn: float = float(np.deg2rad(15.0))


def follow_guide(
    poser: PostureFinder,
    places: LimbPlaces,
    guide: GuideLine,
    start: Stage,
    settings: ExtendSettings | None = None,
) -> Extension:
    """Find the contacts with which a body follows a guide on any of its limbs.

    Args:
        guide: Way of the root, from where it is at the start.
        start: Contacts and posture at the start; limbs without a contact make one where they can.
    """
    settings = settings or ExtendSettings()
    log = SearchLog(poser, settings.searches)
    along = dict.fromkeys(places.limbs, -settings.stride) | dict.fromkeys(start.contacts, 0.0)
    moves = _Moves(poser, guide, settings, log, places)
    return search_depth_first(PartialPlan((start,), along), moves, log, guide.length)


@dataclass(frozen=True, eq=False)
class _Move:
    """One limb to another place, or away for good.

    Attributes:
        limb: Its effector, or that of what makes no contacts, such as a seat.
        contact: Where it goes; None for what is left for good.
        along: How far along the guide each contact is then [m].
        root_along: How far along it the root is then [m].
        lifting: (nq,) posture that rests on all other contacts; None where it is not known yet.
        start: (nq,) where the search for the posture on the new contact begins; ``lifting`` when None.
    """

    limb: str
    contact: Contact | None
    along: Mapping[str, float]
    root_along: float
    lifting: FloatArray | None = None
    start: FloatArray | None = None


class _Moves:
    """Moves of any limbs, as :class:`~manikin.planning.contacts.depth_first.Moves`."""

    def __init__(
        self,
        poser: PostureFinder,
        guide: GuideLine,
        settings: ExtendSettings,
        log: SearchLog,
        places: LimbPlaces,
    ) -> None:
        self._poser, self._guide, self._log = poser, guide, log
        self._settings, self._places = settings, places

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
        return ContactPlan.of(self._poser.body, partial.stages, posed.q, self._settings.hinge_pace)

    def proposals(self, partial: PartialPlan) -> Iterator[_Move]:
        """Moves of the limb that is farthest behind first."""
        for name in sorted(partial.along, key=lambda limb: partial.along[limb]):
            lifting = self._lifted(partial, name)
            if lifting.q is None:
                self._log.refuse(f"{name} cannot leave its contact: {lifting.reason}")
                continue
            if name not in self._places.limbs:
                yield _Move(name, None, _without(name, partial.along), partial.here, lifting.q)
                continue
            for along in self._aims(partial, name):
                yield from self._ahead(partial, name, lifting.q, along)
                if self._log.is_spent:
                    return

    def accepted(self, partial: PartialPlan, change: _Move) -> PartialPlan | None:
        """The plan with a move more, or None where a posture is missing."""
        held, lifting = partial.last.contacts, change.lifting
        if lifting is None:
            return None
        if change.contact is None:
            left = _without(change.limb, held)
            stage = Stage.of(self._poser.body, left, lifting, self._settings.swing_duration)
            return PartialPlan((*partial.stages, stage), change.along)
        contact, before = replace(change.contact, oriented=False), held.get(change.limb)
        near = self._settings.same_place
        if before is not None and np.linalg.norm(before.position - contact.position) < near:
            return replace(partial, along=change.along)
        return self._landed(partial, change, contact, lifting)

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
        """Posture that holds all contacts and rests on all but one; as it is where the limb has none."""
        held = partial.last.contacts
        if name not in held:
            return Posed(partial.last.q)
        return self._pose(held, _without(name, held), partial.last.q, self._guide.at(partial.here))

    def _landed(
        self, partial: PartialPlan, move: _Move, contact: Contact, lifting: FloatArray
    ) -> PartialPlan | None:
        """The plan with a limb put to a place, or None where a posture is missing."""
        name, staying = move.limb, _without(move.limb, partial.last.contacts)
        landed = {**staying, name: contact}
        start = lifting if move.start is None else move.start
        landing = self._pose(landed, staying, start, self._guide.at(move.root_along))
        if landing.q is None:
            self._log.refuse(f"{name} cannot be put down: {landing.reason}")
            return None
        before = partial.last.contacts.get(name)
        way = 0.0 if before is None else float(np.linalg.norm(contact.position - before.position))
        flight = max(self._settings.swing_duration, way / self._settings.swing_speed)
        stages, body = partial.stages, self._poser.body
        if before is None:
            # The limb is free already: it reaches its contact while the phase before lasts.
            stages = (*stages[:-1], replace(stages[-1], min_duration=max(stages[-1].min_duration, flight)))
        else:
            via = self._between(staying, lifting, landing.q, before, contact)
            if via is None:
                self._log.refuse(f"{name} finds no way around")
                return None
            stages = (*stages, Stage.of(body, staying, lifting, flight, via=via))
        stages = (*stages, Stage.of(body, landed, landing.q, self._settings.shift_duration))
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
        root: FloatArray,
    ) -> Posed:
        """A posture whose points stand upright on their surfaces, as far as they can."""
        wish = {
            name: Placement(None, contact.rotation_contact_to_world, 0.05)
            for name, contact in held.items()
            if contact.kind is ContactKind.POINT
        }
        return self._poser.pose(held, carrying, start, root, placements=wish)

    def _ahead(self, partial: PartialPlan, name: str, lifting: FloatArray, along: float) -> Iterator[_Move]:
        """Places ahead to which one limb may move."""
        staying = _without(name, partial.last.contacts)
        progress = {**partial.along, name: along}
        root_along = float(np.mean([progress[other] for other in (*staying, name)]))
        ahead = self._pose(staying, staying, lifting, self._guide.at(root_along))
        if ahead.q is None:
            self._log.refuse(f"the root cannot go on without {name}: {ahead.reason}")
            return
        direction, root = self._direction(root_along), self._guide.at(along)
        for place in self._places.find(name, ahead.q, root, direction, self._settings.places):
            if place.contact is None or place.q is None:
                self._log.refuse(place.message)
            else:
                yield _Move(name, place.contact, progress, root_along, lifting, place.q)

    def _direction(self, along: float) -> FloatArray:
        """(3,) where the scene shall push a limb: onward and up against the weight."""
        onward = self._guide.at(along + 0.3 * self._settings.stride)[:3] - self._guide.at(along)[:3]
        length = float(np.linalg.norm(onward))
        direction = UP + (onward / length if length > 1e-9 else 0.0)
        return direction if np.linalg.norm(direction) > 0.1 else UP


def _without(name: str, items: Mapping[str, Item]) -> dict[str, Item]:
    """All items but that of one name."""
    return {other: item for other, item in items.items() if other != name}
