"""From a guide of the root to a sequence of contacts: the road of [Tonneau2015]_ 7.2, algorithm 7.

The guide is followed limb by limb.  The limb that is farthest behind is put to a new place, its
contact broken and made; all others are maintained.  A change counts only when two postures exist,
free of collision and at rest on the contacts that stay: one that still holds the old contact and
one that already holds the new one.  Where there is none, a shorter step, another place or another
limb is tried, and then the change before is taken back.

Also here. From a seat onto the feet: the first stages of a plan whose start holds on by more than feet.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, FrictionModel
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.contact_plan import ContactPlan, Stage
from manikin.planning.contacts.depth_first import (
    Extension,
    GuideLine,
    PartialPlan,
    SearchLog,
    heading_of,
    search_depth_first,
)
from manikin.planning.contacts.limb_places import Footholds, stature_of
from manikin.planning.contacts.posture_finder import Posed, PostureFinder, PostureFinderSettings
from manikin.scene import Scene

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
    poser: PostureFinder, start: Stage, feet: frozenset[str], upright: FloatArray, log: SearchLog
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


NEARER = (0.7, 0.4)
"""Shares of the way to its place with which a foot comes nearer when no stride is possible."""

AT_GOAL = 0.06
"""Distance of a foot from its place at the goal that is not worth a step [m]."""

AT_GOAL_TURN = float(np.deg2rad(15.0))
"""The same for its heading [rad]."""


@dataclass(frozen=True)
class ExtendSettings:
    """How contacts follow a guide; the values are our choice.

    Attributes:
        stride: Way from a foot to the next one [m], for a body of 1.75 m.
        shares: Shares of the stride that are tried, in order.
        searches: Most postures that are looked for.
        swing_duration: Shortest flight of a foot [s].
        swing_speed: Its mean speed on longer ways [m/s].
        shift_duration: Shortest time between two flights [s].
        friction: Coulomb coefficient of the soles.
        natural: Whether hips and shoulders keep to their learnt ranges.
        friction_model: Of the stances.
    """

    stride: float = 0.36
    shares: tuple[float, ...] = (1.0, 0.75, 0.5, 0.3)
    searches: int = 250
    swing_duration: float = 0.7
    swing_speed: float = 0.7
    shift_duration: float = 0.35
    friction: float = 0.7
    natural: bool = False
    friction_model: FrictionModel = "outer"


@dataclass(frozen=True, eq=False)
class _Step:
    """One foot to another place.

    Attributes:
        foot: Its effector.
        contact: Where it goes.
        along: How far along the guide that is [m].
    """

    foot: str
    contact: Contact
    along: float


def follow_guide(
    body: BodyModel,
    scene: Scene,
    guide: GuideLine,
    start: Stage,
    goal: Stage,
    settings: ExtendSettings | None = None,
    reference: FloatArray | None = None,
) -> Extension:
    """Find the contacts with which a body on feet follows a guide.

    Contacts of the start that are no feet, such as a seat, are left first.

    Args:
        body: A body with soles.
        scene: Its surroundings.
        guide: Way of the root, from where it is at the start.
        start: Contacts and posture at the start.
        goal: Contacts and posture at the goal, on feet.
        settings: How to search.
        reference: (nq,) posture to be like where the task leaves freedom; standing when omitted.
    """
    settings = settings or ExtendSettings()
    asked = PostureFinderSettings(natural=settings.natural, friction_model=settings.friction_model)
    poser = PostureFinder(body, scene, reference, asked)
    log = SearchLog(poser, settings.searches)
    steps = _Steps(poser, guide, goal, settings, log)
    first = on_feet(poser, start, steps.feet, guide.at(0.0), log)
    if first is None:
        return log.failure(f"cannot leave {', '.join(set(start.contacts) - steps.feet)}", guide.length)
    return search_depth_first(first, steps, log, guide.length)


class _Steps:
    """Steps of feet, as :class:`~manikin.planning.contacts.depth_first.Moves`."""

    def __init__(
        self, poser: PostureFinder, guide: GuideLine, goal: Stage, settings: ExtendSettings, log: SearchLog
    ) -> None:
        self._poser, self._guide, self._goal, self._settings, self._log = poser, guide, goal, settings, log
        self._body = body = poser.body
        self._footholds = Footholds(body, poser.scene)
        self._below_root = _standing_feet(body)
        self._stride = settings.stride * stature_of(body) / 1.75
        self._lifted: dict[tuple[int, str], tuple[Stage, Posed]] = {}  # by identity of the stage

    @property
    def feet(self) -> frozenset[str]:
        """Effectors that step."""
        return frozenset(self._below_root)

    def finished(self, partial: PartialPlan) -> ContactPlan | None:
        """The plan, when every foot is where it is at the goal."""
        if not all(self._is_at_goal(partial, foot) for foot in self._below_root):
            return None
        contacts = partial.last.contacts
        posed = self._poser.pose(contacts, contacts, self._goal.q, self._goal.q[:7], restarts=True)
        if posed.q is None:
            self._log.refuse(f"at the goal: {posed.reason}")
            return None
        return ContactPlan.of(self._body, partial.stages, posed.q)

    def proposals(self, partial: PartialPlan) -> Iterator[_Step]:
        """Steps, the longest of the foot that is farthest behind first."""
        for name in sorted(partial.along, key=lambda foot: partial.along[foot]):
            if self._is_at_goal(partial, name):
                continue
            tried: list[FloatArray] = []
            for along, contact in self._wanted(partial, name):
                if any(np.linalg.norm(contact.position - other) < 0.03 for other in tried):
                    continue
                tried.append(contact.position)
                yield _Step(name, contact, along)

    def accepted(self, partial: PartialPlan, change: _Step) -> PartialPlan | None:
        """The plan with a step more, or None where a posture is missing."""
        foot, contact, held = change.foot, change.contact, partial.last.contacts
        standing = {name: other for name, other in held.items() if name != foot}
        landed = {**standing, foot: contact}
        along = {**partial.along, foot: change.along}
        lifting = self._lifting(partial, foot)
        if lifting.q is None:
            self._log.refuse(f"{foot} cannot be lifted: {lifting.reason}")
            return None
        there = float(np.mean(list(along.values())))
        landing = self._poser.pose(landed, standing, lifting.q, self._guide.at(there))
        if landing.q is None:
            self._log.refuse(f"{foot} cannot be put down: {landing.reason}")
            return None
        way = 0.0 if foot not in held else float(np.linalg.norm(contact.position - held[foot].position))
        flight = max(self._settings.swing_duration, way / self._settings.swing_speed)
        stages = (
            *partial.stages,
            Stage.of(self._body, standing, lifting.q, flight),
            Stage.of(self._body, landed, landing.q, self._settings.shift_duration),
        )
        return PartialPlan(stages, along)

    def _is_at_goal(self, partial: PartialPlan, foot: str) -> bool:
        held, wanted = partial.last.contacts.get(foot), self._goal.contacts[foot]
        if held is None:
            return False
        away = float(np.linalg.norm(held.position - wanted.position))
        return away <= AT_GOAL and float(np.cos(held.yaw - wanted.yaw)) >= np.cos(AT_GOAL_TURN)

    def _wanted(self, partial: PartialPlan, foot: str) -> Iterator[tuple[float, Contact]]:
        """Contacts to which a foot may go, each with how far along the guide it is."""
        own = partial.along[foot]
        ahead = max(value for name, value in partial.along.items() if name != foot)
        strides = [ahead + share * self._stride for share in self._settings.shares]
        # Where no stride leads, the foot comes nearer first, as on a turn.
        nearer = [own + share * (min(strides[0], self._guide.length) - own) for share in NEARER]
        for along in (*strides, *nearer):
            if along >= self._guide.length - 1e-6:
                yield self._guide.length, self._goal.contacts[foot]
            elif along > own:
                for contact in self._places(foot, along):
                    yield along, contact

    def _places(self, foot: str, along: float) -> list[Contact]:
        """Contacts of a foot near where it would be if the body stood below the guide's pose."""
        pose = self._guide.at(along)
        yaw = heading_of(pose)
        wanted = pose[:3] + rotation_from_yaw(yaw) @ self._below_root[foot]
        holds = self._footholds.near(wanted, yaw)
        if not holds:
            self._log.refuse(f"no foothold for {foot} near {np.round(wanted, 2).tolist()} m")
        return [
            hold.contact(foot, self._footholds.length, self._footholds.width, self._settings.friction)
            for hold in holds
        ]

    def _lifting(self, partial: PartialPlan, foot: str) -> Posed:
        """Posture before a foot is lifted: the same wherever it goes, and looked for once.

        It counts every time, so that a foot that cannot be lifted uses up the search.
        """
        key = id(partial.last), foot
        if key in self._lifted:
            self._poser.searches += 1
            return self._lifted[key][1]
        held = partial.last.contacts
        standing = {name: other for name, other in held.items() if name != foot}
        posed = self._poser.pose(held, standing, partial.last.q, self._guide.at(partial.here))
        self._lifted[key] = partial.last, posed
        return posed


def _standing_feet(body: BodyModel) -> dict[str, FloatArray]:
    """(3,) place of each foot's sole relative to the root in the standing posture, root level [m]."""
    q = np.array(body.standing_posture())
    state = Configuration(body, q)
    return {
        limb.effector: state.effector_placement(limb.effector)[1] - q[:3]
        for limb in body.limbs
        if limb.effector.endswith("foot")
    }
