"""From a guide of the root to a sequence of contacts: the road of [Tonneau2015]_ 7.2, algorithm 7.

The guide is followed limb by limb.  The limb that is farthest behind is put to a new place, its
contact broken and made; all others are maintained.  A change counts only when two postures exist,
free of collision and at rest on the contacts that stay: one that still holds the old contact and
one that already holds the new one.  Where there is none, a shorter step, another place or another
limb is tried, and then the change before is taken back.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact
from manikin.contact_planning.footholds import Footholds, stature_of
from manikin.contact_planning.guide_line import GuideLine, heading_of
from manikin.contact_planning.poser import Posed, Poser
from manikin.contact_planning.stage import ContactPlan, Stage
from manikin.scene import Scene
from manikin.spatial import FloatArray, rotation_from_yaw

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
    """

    stride: float = 0.36
    shares: tuple[float, ...] = (1.0, 0.75, 0.5, 0.3)
    searches: int = 250
    swing_duration: float = 0.7
    swing_speed: float = 0.7
    shift_duration: float = 0.35
    friction: float = 0.7


@dataclass(frozen=True, eq=False)
class Extension:
    """A contact plan, or why there is none.

    Attributes:
        plan: The plan, or None.
        searches: Postures looked for.
        backtracks: Changes taken back.
        failure: None, or the reason in one line.
        reached: Share of the guide that the farthest attempt got to.
    """

    plan: ContactPlan | None
    searches: int
    backtracks: int
    failure: str | None = None
    reached: float = 1.0

    @property
    def succeeded(self) -> bool:
        """Whether there is a plan."""
        return self.plan is not None


@dataclass(frozen=True, eq=False)
class _State:
    """Where the search is: stages so far and how far along the guide each foot is."""

    stages: tuple[Stage, ...]
    along: Mapping[str, float]

    @property
    def last(self) -> Stage:
        return self.stages[-1]


def extend(
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
    poser = Poser(body, scene, reference)
    return _Search(poser, guide, goal, settings or ExtendSettings()).run(start)


class _Search:
    """Depth-first search over changes of contact."""

    def __init__(self, poser: Poser, guide: GuideLine, goal: Stage, settings: ExtendSettings) -> None:
        self._poser, self._guide, self._goal, self._settings = poser, guide, goal, settings
        self._body = body = poser.body
        self._footholds = Footholds(body, poser.scene)
        self._feet = _standing_feet(body)
        self._stride = settings.stride * stature_of(body) / 1.75
        self._reasons: Counter[str] = Counter()
        self._lifted: dict[tuple[int, str], tuple[Stage, Posed]] = {}  # by identity of the stage
        self._backtracks = 0
        self._farthest = 0.0

    def run(self, start: Stage) -> Extension:
        first = self._without_others(start)
        if first is None:
            return self._failed(f"cannot leave {', '.join(set(start.contacts) - set(self._feet))}")
        states, options = [first], [self._options(first)]
        while states:
            ended = self._ended(states[-1])
            if ended is not None:
                return Extension(ended, self._poser.searches, self._backtracks)
            following = None if self._spent else next(options[-1], None)
            if following is not None:
                states.append(following)
                options.append(self._options(following))
                continue
            if self._spent:
                return self._failed(f"no contacts after {self._poser.searches} postures")
            states.pop()
            options.pop()
            self._backtracks += 1
        return self._failed("no contacts follow the guide")

    @property
    def _spent(self) -> bool:
        return self._poser.searches >= self._settings.searches

    def _without_others(self, start: Stage) -> _State | None:
        """The state after contacts that are no feet have been left, all at once."""
        feet = {name: contact for name, contact in start.contacts.items() if name in self._feet}
        along = dict.fromkeys(feet, 0.0)
        if len(feet) == len(start.contacts):
            return _State((start,), along)
        leaving = self._poser.pose(start.contacts, feet, start.q, inset=SEAT_OFF_INSET, restarts=True)
        if leaving.q is None:
            self._reasons[leaving.reason] += 1
            return None
        over_feet = Configuration(self._body, leaving.q).com[:2]
        stages = [start]
        for share in LEANING:
            place = (1.0 - share) * start.com[:2] + share * over_feet
            posed = self._poser.pose(start.contacts, start.contacts, stages[-1].q, place=place)
            if posed.q is not None:
                stages.append(Stage.of(self._body, start.contacts, posed.q, LEANING_TIME, SEATED_ROOM))
        rising = RISING_TIME
        stages.append(Stage.of(self._body, feet, leaving.q, rising, SEATED_ROOM))
        risen = self._poser.pose(feet, feet, leaving.q, self._guide.at(0.0), restarts=True)
        if risen.q is None:
            self._reasons[risen.reason] += 1
            return None
        stages.append(Stage.of(self._body, feet, risen.q, SETTLING_TIME))
        return _State(tuple(stages), along)

    def _ended(self, state: _State) -> ContactPlan | None:
        """The plan, when every foot is where it is at the goal."""
        self._farthest = max(self._farthest, float(np.mean(list(state.along.values()))))
        if not all(self._is_at_goal(state, foot) for foot in self._feet):
            return None
        contacts = state.last.contacts
        posed = self._poser.pose(contacts, contacts, self._goal.q, self._goal.q[:7], restarts=True)
        if posed.q is None:
            self._reasons[f"at the goal: {posed.reason}"] += 1
            return None
        return ContactPlan.of(self._body, state.stages, posed.q)

    def _is_at_goal(self, state: _State, foot: str) -> bool:
        held, wanted = state.last.contacts.get(foot), self._goal.contacts[foot]
        if held is None:
            return False
        away = float(np.linalg.norm(held.position - wanted.position))
        return away <= AT_GOAL and float(np.cos(held.yaw - wanted.yaw)) >= np.cos(AT_GOAL_TURN)

    def _options(self, state: _State) -> Iterator[_State]:
        """States one step further, the longest step of the foot that is farthest behind first."""
        for name in sorted(state.along, key=lambda foot: state.along[foot]):
            if self._is_at_goal(state, name):
                continue
            tried: list[FloatArray] = []
            for along, contact in self._wanted(state, name):
                if any(np.linalg.norm(contact.position - other) < 0.03 for other in tried):
                    continue
                tried.append(contact.position)
                following = self._step(state, name, contact, along)
                if following is not None:
                    yield following
                if self._spent:
                    return

    def _wanted(self, state: _State, foot: str) -> Iterator[tuple[float, Contact]]:
        """Contacts to which a foot may go, each with how far along the guide it is."""
        own = state.along[foot]
        ahead = max(value for name, value in state.along.items() if name != foot)
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
        wanted = pose[:3] + rotation_from_yaw(yaw) @ self._feet[foot]
        holds = self._footholds.near(wanted, yaw)
        if not holds:
            self._reasons[f"no foothold for {foot} near {np.round(wanted, 2).tolist()} m"] += 1
        return [
            hold.contact(foot, self._footholds.length, self._footholds.width, self._settings.friction)
            for hold in holds
        ]

    def _step(self, state: _State, foot: str, contact: Contact, along: float) -> _State | None:
        """One foot put to another place, or None where a posture is missing."""
        held = state.last.contacts
        standing = {name: other for name, other in held.items() if name != foot}
        landed = {**standing, foot: contact}
        here = float(np.mean(list(state.along.values())))
        there = float(np.mean([along, *(value for name, value in state.along.items() if name != foot)]))
        lifting = self._lifting(state, foot, here)
        if lifting.q is None:
            self._reasons[f"{foot} cannot be lifted: {lifting.reason}"] += 1
            return None
        landing = self._poser.pose(landed, standing, lifting.q, self._guide.at(there))
        if landing.q is None:
            self._reasons[f"{foot} cannot be put down: {landing.reason}"] += 1
            return None
        way = 0.0 if foot not in held else float(np.linalg.norm(contact.position - held[foot].position))
        flight = max(self._settings.swing_duration, way / self._settings.swing_speed)
        stages = (
            *state.stages,
            Stage.of(self._body, standing, lifting.q, flight),
            Stage.of(self._body, landed, landing.q, self._settings.shift_duration),
        )
        return _State(stages, {**state.along, foot: along})

    def _lifting(self, state: _State, foot: str, here: float) -> Posed:
        """Posture before a foot is lifted: the same wherever it goes, and looked for once.

        It counts every time, so that a foot that cannot be lifted uses up the search.
        """
        key = id(state.last), foot
        if key in self._lifted:
            self._poser.searches += 1
            return self._lifted[key][1]
        held = state.last.contacts
        standing = {name: other for name, other in held.items() if name != foot}
        posed = self._poser.pose(held, standing, state.last.q, self._guide.at(here))
        self._lifted[key] = state.last, posed
        return posed

    def _failed(self, what: str) -> Extension:
        reached = self._farthest / self._guide.length if self._guide.length > 0.0 else 0.0
        most = self._reasons.most_common(1)
        why = f"; most often: {most[0][0]}" if most else ""
        text = f"{what} beyond {100.0 * reached:.0f} % of it ({self._farthest:.2f} m){why}"
        return Extension(None, self._poser.searches, self._backtracks, text, reached)


def _standing_feet(body: BodyModel) -> dict[str, FloatArray]:
    """(3,) place of each foot's sole relative to the root in the standing posture, root level [m]."""
    q = np.array(body.standing_posture())
    state = Configuration(body, q)
    return {
        limb.effector: state.effector_placement(limb.effector)[1] - q[:3]
        for limb in body.limbs
        if limb.effector.endswith("foot")
    }
