"""Where a task starts or ends: postures on contacts, from a place, a heading and a habit.

A start may also be on any limbs, each near where a posture has it (:func:`starts_on_limbs`), and a start that
holds on by more than feet is left for the feet first (:func:`stand_up`).
"""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.body.human import SEAT_LENGTH, SEAT_WIDTH
from manikin.contact import Contact, FrictionModel, sole
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.contact_plan import Stage
from manikin.planning.contacts.footholds import Footholds
from manikin.planning.contacts.generator import GeneratedContact
from manikin.planning.contacts.limb_places import LimbPlaces, stature_of
from manikin.planning.contacts.posture_finder import PostureFinder, PostureFinderSettings
from manikin.scene import Scene, Surface

UP = np.array([0.0, 0.0, 1.0])

FEET = ("left_foot", "right_foot")

SEAT_FRICTION = 0.3
"""Coulomb coefficient of clothes on a seat; our choice."""

SEAT_HEIGHTS = (0.12, 0.40)
"""Lowest and greatest height of a seat above the feet [statures]; our choice."""

FEET_BEFORE_SEAT = tuple(np.linspace(0.15, 0.30, 11))
"""Distances from the middle of the buttocks to that of the soles that are tried [statures]."""

CROUCH = 0.6
"""Height of a crouching body's root relative to a standing one's; our choice."""


class Habit(StrEnum):
    """Way in which a body is at rest."""

    STANDING = "standing"
    SEATED = "seated"
    CROUCHED = "crouched"


@dataclass(frozen=True, eq=False)
class Endpoint:
    """A start or goal, or why there is none.

    Attributes:
        stage: Contacts and posture at rest on them, or None.
    """

    stage: Stage | None
    failure: str | None = None


class Endpoints:
    """Finds starts and goals of a body on its feet or a seat in one scene."""

    def __init__(
        self, body: BodyModel, scene: Scene, friction: float, reference: FloatArray | None = None, *,
        natural: bool = False, friction_model: FrictionModel = "outer",
    ) -> None:  # fmt: skip
        """Prepare a scene.

        Args:
            body: A body with soles.
            friction: Coulomb coefficient of the soles.
            reference: (nq,) posture to be like where the task leaves freedom; standing when omitted.
            natural: Whether hips and shoulders keep to their learnt ranges.
            friction_model: Friction model of the stances.
        """
        self._body, self._scene, self._friction = body, scene, friction
        self._stature = stature_of(body)
        settings = PostureFinderSettings(natural=natural, friction_model=friction_model)
        self._poser = PostureFinder(body, scene, reference, settings)
        self._footholds = Footholds(body, scene)

    def find(self, at: FloatArray, heading: float, habit: Habit, height: float | None = None) -> Endpoint:
        """Posture at a place; the lowest surface on which one exists, where no height is given.

        Args:
            at: (2,) below the root, or of the middle of the buttocks on a seat [m].
            heading: Where to face [rad].
            height: Height of the surface to stand or sit on [m].
        """
        reasons: list[str] = []
        tried = self._seated if habit is Habit.SEATED else self._standing
        for contacts, guess in tried(np.asarray(at), heading, habit, height):
            # A body that sits has its weight where its upright trunk puts it, not over the root.
            place = Configuration(self._body, guess).com[:2] if habit is Habit.SEATED else None
            posed = self._poser.pose(contacts, contacts, guess, guess[:7], place=place, restarts=True)
            if posed.q is not None:
                return Endpoint(Stage.of(self._body, contacts, posed.q, 0.35))
            reasons.append(posed.reason)
        at_seat = "at the height of a seat with room for both feet before it"
        nowhere = at_seat if habit is Habit.SEATED else "with room for both feet"
        why = reasons[0] if reasons else f"there is no surface {nowhere}"
        return Endpoint(None, f"no posture {habit} at {np.round(at, 3).tolist()} m: {why}")

    def risen(self, stage: Stage) -> Endpoint:
        """Where a body is when it has left all contacts of a start but those of its feet."""
        feet = {name: contact for name, contact in stage.contacts.items() if name.endswith("foot")}
        posed = self._poser.pose(feet, feet, stage.q, restarts=True)
        if posed.q is None:
            return Endpoint(None, f"no posture on {', '.join(feet) or 'feet'} alone: {posed.reason}")
        return Endpoint(Stage.of(self._body, feet, posed.q, 0.3))

    def _standing(
        self, at: FloatArray, heading: float, habit: Habit, height: float | None
    ) -> Iterator[tuple[dict[str, Contact], FloatArray]]:
        q = np.array(self._body.standing_posture())
        turn = rotation_from_yaw(heading)
        state = Configuration(self._body, q)
        for level in self._levels(at, height):
            wanted = {
                foot: np.array([*at, level]) + turn @ state.effector_placement(foot)[1] for foot in FEET
            }
            contacts = self._feet(wanted, heading, level, 0.1)
            if len(contacts) == 2:
                guess = q.copy()
                guess[:2], guess[3:7] = at, _level_turn(heading)
                guess[2] = level + q[2] * (CROUCH if habit is Habit.CROUCHED else 1.0)
                yield contacts, guess

    def _seated(
        self, at: FloatArray, heading: float, _habit: Habit, height: float | None
    ) -> Iterator[tuple[dict[str, Contact], FloatArray]]:
        """Buttocks on a seat and feet on the floor before it, the nearest to it first."""
        size, turn = self._stature, rotation_from_yaw(heading)
        low, high = (share * size for share in SEAT_HEIGHTS)
        q = self._body.posture({**self._body.standing_angles, **_SITTING})
        q[3:7] = _level_turn(heading)
        sitting = Configuration(self._body, q).effector_placement("buttocks")[1]
        # Below the seat there may be no floor: it is looked for where the feet may be.
        ahead = [at + distance * size * turn[:2, 0] for distance in FEET_BEFORE_SEAT[::5]]
        for floor in sorted({level for place in ahead for level in self._levels(place, None)}):
            for seat in self._levels(at, height):
                if not low <= seat - floor <= high:
                    continue
                buttocks = sole(
                    "buttocks", np.array([*at, seat]), heading, length=SEAT_LENGTH * size,
                    width=SEAT_WIDTH * size, friction=SEAT_FRICTION,
                )  # fmt: skip
                guess = q.copy()
                guess[:3] += buttocks.position - sitting
                for distance in FEET_BEFORE_SEAT:
                    wanted = {}
                    for foot, side in zip(FEET, (0.07, -0.07), strict=True):
                        away = turn @ np.array([distance * size, side * size, 0.0])
                        wanted[foot] = np.array([*(buttocks.position + away)[:2], floor])
                    feet = self._feet(wanted, heading, floor, 0.02, 0.05)
                    if len(feet) == 2:
                        yield {"buttocks": buttocks, **feet}, guess

    def _feet(
        self,
        wanted: Mapping[str, FloatArray],
        heading: float,
        level: float,
        step: float,
        away: float = np.inf,
    ) -> dict[str, Contact]:
        """Footholds nearest to where feet should be, up to a step in height and a distance off [m]."""
        contacts: dict[str, Contact] = {}
        for foot, place in wanted.items():
            for contact in self._footholds.near(foot, place, heading, self._friction):
                off = float(np.linalg.norm(contact.position - place))
                if abs(contact.position[2] - level) < step and off < away:
                    contacts[foot] = contact
                    break
        return contacts

    def _levels(self, at: FloatArray, height: float | None) -> list[float]:
        """Heights of the surfaces below and above a place, the lowest first; those near one given."""
        levels: set[float] = set()
        for surface in self._scene.surfaces_facing((0.0, 0.0, 1.0), self._footholds.steepest):
            level = _height_at(surface, at)
            if level is not None and (height is None or abs(level - height) < 0.05):
                levels.add(round(level, 6))
        return sorted(levels)


_SITTING = {
    f"{side}_{joint}": angle
    for side in ("left", "right")
    for joint, angle in (("hip_flexion", 1.4), ("knee_flexion", 1.6), ("ankle_dorsiflexion", 0.1))
}


def _level_turn(yaw: float) -> FloatArray:
    """(4,) quaternion xyzw of a turn about the vertical."""
    return np.array([0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)])


def _height_at(surface: Surface, at: FloatArray) -> float | None:
    """Height of a surface above or below a place on the ground [m], or None beside it."""
    base = surface.polygon[0]
    height = base[2] - float((at - base[:2]) @ surface.normal[:2]) / surface.normal[2]
    point = np.array([[at[0], at[1], height]])
    return height if float(surface.outside(point)[0]) <= 1e-9 else None


PLACES = 4
"""Places of each limb among which a start is sought."""

TRIES = 40
"""Most of their combinations for which a posture is looked for; our choice."""


def starts_on_limbs(
    poser: PostureFinder, places: LimbPlaces, q: FloatArray, duration: float
) -> Iterator[Endpoint]:
    """Starts near a posture that touches nothing, the best contacts first; one failure where there is none.

    Args:
        q: (nq,) where the body should be, each limb where it should be relative to the root.
        duration: Shortest time for which the contacts are held [s].
    """
    offered = {name: _losses(places.find(name, q, q[:7], UP, PLACES)) for name in places.limbs}
    offered = {name: items for name, items in offered.items() if items}
    if not offered:
        yield Endpoint(None, "no limb has a contact")
        return
    reason, any_start = "", False
    for contacts in islice(best_first(offered), TRIES):
        posed = poser.pose(contacts, contacts, q, q[:7])
        reason = reason or posed.reason
        if posed.q is not None:
            any_start = True
            yield Endpoint(Stage.of(poser.body, contacts, posed.q, duration))
    if not any_start:
        yield Endpoint(None, reason)


def _losses(answers: list[GeneratedContact]) -> list[tuple[float, Contact]]:
    """Contacts of one limb with what each is worse than the best, by the scores of the generator."""
    places = [(item.score, item.contact) for item in answers if item.contact is not None]
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


def stand_up(
    poser: PostureFinder, start: Stage, feet: frozenset[str], upright: FloatArray
) -> tuple[Stage, ...] | str:
    """The start on feet; its other contacts are left first, all at once.

    Args:
        start: Contacts and posture at the start.
        feet: Effectors to stand on.
        upright: (7,) pose of the root that has risen.

    Returns:
        The stages up to standing on feet alone, or why a posture is missing.
    """
    body = poser.body
    held = {name: contact for name, contact in start.contacts.items() if name in feet}
    if len(held) == len(start.contacts):
        return (start,)
    leaving = poser.pose(start.contacts, held, start.q, inset=SEAT_OFF_INSET, restarts=True)
    if leaving.q is None:
        return leaving.reason
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
        return risen.reason
    stages.append(Stage.of(body, held, risen.q, SETTLING_TIME))
    return tuple(stages)
