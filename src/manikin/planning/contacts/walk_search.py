"""Contacts of a body that goes on its feet, from start to goal.

Footsteps are searched for with cheap tests (:mod:`manikin.planning.contacts.footsteps`); whole postures are
looked for along the best way only, two for each pair of footholds: one that rests on the foot that stands,
the other already down, and one that rests on the other, the first about to leave.
A pair without a posture is closed, and the search goes on with the next best way.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.balance.criteria import static_torque_share
from manikin.body import BodyModel
from manikin.contact import Contact, Stance
from manikin.kinematics.step_reach import StepReach
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.contact_plan import ContactPlan, Stage
from manikin.planning.contacts.depth_first import Extension, SearchLog
from manikin.planning.contacts.endpoint import FEET, stand_up
from manikin.planning.contacts.footholds import Foothold, Footholds
from manikin.planning.contacts.footsteps import STEP, FootstepSearch
from manikin.planning.contacts.limb_places import stature_of
from manikin.planning.contacts.posture_finder import Posed, PostureFinder
from manikin.planning.contacts.trunk_postures import TrunkClearance, TrunkPostures
from manikin.scene import Scene

COLUMN = (0.12, 0.5, 0.9)
"""Radius, lowest and highest end above the ground of what has to be free, of a body of 1.75 m [m]."""


STRONG_TRIES = 8
"""Ways that are refused because a posture at rest asks for more than the strength.

A motion may need less than its postures at rest, whose knees and trunk are not bent for least torque; so
after that many ways the later stages decide."""

EASIER = (0.4, 0.2, 0.55)
"""Places of the centre of mass over the sole that carries, from its middle ahead, as shares of half its
length, at which a posture is tried that asks for less strength: a thigh that is more upright turns less under
the pelvis, and a knee has less before it."""

NEAR_TRIES = 12
"""Ways after which a pair without a posture closes all that are much like it."""


@dataclass(frozen=True)
class WalkSettings:
    """How a body goes on its feet; the values are our choice.

    Attributes:
        stride: Way between two feet that costs least over the ground, of a body of 1.75 m [m].
        searches: Most postures that are looked for.
        swing_duration: Shortest flight of a foot [s].
        swing_speed: Its mean speed on longer ways [m/s].
        shift_duration: Shortest time between two flights [s].
        hinge_pace: Mean speed of the hinge that turns most [rad/s].
    """

    stride: float = 0.4
    searches: int = 400
    swing_duration: float = 0.7
    swing_speed: float = 0.7
    shift_duration: float = 0.35
    hinge_pace: float = 2.0


@dataclass
class BodyRoom:
    """Room for the trunk of a body between its feet, in one of a few postures.

    Attributes:
        body: The body.
        scene: What is around it.
    """

    body: BodyModel
    scene: Scene

    def __post_init__(self) -> None:
        self._postures = TrunkPostures.of(self.body)
        self._clearance = TrunkClearance(self._postures, self.scene)
        self._costs = self._postures.costs - 1.0

    def cost(self, left: Foothold, right: Foothold) -> float:
        """Cost of a step in the cheapest posture that is free, beyond upright [s]; infinite without one."""
        place = self._place(left, right)
        number = int(self._clearance.cheapest(place[None])[0])
        return STEP * float(self._costs[number]) if number >= 0 else math.inf

    def postures(self, pairs: Sequence[tuple[Foothold, Foothold]]) -> NDArray[np.int64]:
        """(k,) postures to take one after the other between pairs of footholds, left and right.

        Where no sequence of them passes, the cheapest that is free at each pair, upright where none is.
        """
        places = np.array([self._place(*pair) for pair in pairs])
        along = self._clearance.along(places)
        return np.maximum(self._clearance.cheapest(places), 0) if along is None else along

    def guide(self, number: int, left: Foothold, right: Foothold) -> FloatArray:
        """Guide of a posture there, on level ground: (7,) pose of the root upright, else the (nq,) whole.

        Upright arms hang as the manner wants; otherwise they have to be where the posture has room for them.
        """
        posture = self._postures[number]
        q = posture.at(self._place(left, right))
        return q[:7] if posture.cost <= 1.0 else q

    def stooped(self, number: int) -> list[int]:
        """A posture and up to three in which the trunk is bent more, the cheapest first."""
        heights = [item.height for item in self._postures]
        return [number, *(n for n, high in enumerate(heights) if high < 0.97 * heights[number])][:4]

    def _place(self, left: Foothold, right: Foothold) -> FloatArray:
        """(4,) x, y and height of the ground [m] and heading [rad] between two feet."""
        yaw = math.atan2(math.sin(left.yaw) + math.sin(right.yaw), math.cos(left.yaw) + math.cos(right.yaw))
        middle = 0.5 * (left.position + right.position)
        low = min(float(left.position[2]), float(right.position[2]))
        # A foot that stands high folds its leg; the body is as high as the other one lets it.
        return np.array([middle[0], middle[1], low + 0.4 * (float(middle[2]) - low), yaw])


@dataclass
class WalkSearch:
    """Search for the contacts of a walk that can be asked again with more pairs closed.

    Attributes:
        poser: Finds postures of a body with soles in its scene.
        start: Contacts and posture at the start; those of no feet are left first.
        goal: Contacts and posture at the goal, on feet.
        friction: Coulomb coefficient of the soles.
        settings: Paces and bounds.
    """

    poser: PostureFinder
    start: Stage
    goal: Stage
    friction: float = 0.7
    settings: WalkSettings = WalkSettings()

    def __post_init__(self) -> None:
        body, scene = self.poser.body, self.poser.scene
        self._log = SearchLog(self.poser, self.settings.searches)
        scale = stature_of(body) / 1.75
        self._room = BodyRoom(body, scene)
        first = self.goal.contacts[FEET[0]]
        steepest = min(math.radians(30.0), math.atan(0.8 * self.friction))
        self._footholds = Footholds(body, scene, (first.length, first.width), steepest)
        self._contacts: dict[tuple[str, int], Contact] = {}
        self._postures: dict[tuple[int, int, bool, int], Posed] = {}
        radius, low, high = (scale * value for value in COLUMN)
        start, goal = (self._holds(stage) for stage in (self.start, self.goal))
        self.search = FootstepSearch(
            scene,
            self._footholds,
            start,
            goal,
            scale,
            StepReach.of(body),
            self._room.cost,
            (radius, low, high),
            self.settings.stride,
        )
        for number, (stage, foot) in enumerate((s, f) for s in (self.start, self.goal) for f in FEET):
            self._contacts[foot, number] = stage.contacts[foot]
        self._risen: tuple[Stage, ...] = ()
        self._steps: list[tuple[int, int] | None] = []
        self.reasons: Counter[str] = Counter()
        self.replanned = 0

    def run(self) -> Extension:
        """The best way whose postures exist, or why there is none."""
        upright = self._room.guide(0, *self._holds(self.start))
        first = stand_up(self.poser, self.start, frozenset(FEET), upright, self._log)
        if first is None:
            left = ", ".join(set(self.start.contacts) - set(FEET))
            return self._failed(f"cannot leave {left}")
        self._risen = first.stages
        while not self._log.is_spent:
            way = self.search.best()
            if way is None:
                why = self.search.walled_off()
                return self._failed(
                    "no footsteps lead to the goal" if why is None
                    else f"the goal is walled off from the start: {why}"
                )  # fmt: skip
            plan = self._planned(way)
            if plan is not None:
                return Extension(plan, self._log.searches, self.replanned)
            self.replanned += 1
        return self._failed(f"no contacts after {self._log.searches} postures")

    def refuse(self, phase: int) -> bool:
        """Close the step of a phase of the last plan, and what is much like it; False where it has none."""
        pair = self._steps[phase] if phase < len(self._steps) else None
        if pair is None:
            return False
        self.search.refuse(*pair)
        return True

    def _failed(self, what: str) -> Extension:
        most = self.reasons.most_common(1)
        why = f"; most often: {most[0][0]}" if most else ""
        if self.search.walled_off() is None and self.search.expanded:
            place = self.search.farthest()[1].position
            what += f" beyond [{place[0]:.2f}, {place[1]:.2f}, {place[2]:.2f}] m"
        return Extension(None, self._log.searches, self.replanned, f"{what}{why}", 0.0)

    def _holds(self, stage: Stage) -> tuple[Foothold, Foothold]:
        left, right = (stage.contacts[foot] for foot in FEET)
        return Foothold.of(left), Foothold.of(right)

    def _contact(self, foot: str, number: int) -> Contact:
        key = foot, number
        if key not in self._contacts:
            self._contacts[key] = self._footholds.contact(foot, self.search.hold(number), self.friction)
        return self._contacts[key]

    def _planned(self, way: Sequence[int]) -> ContactPlan | None:
        """Plan of a way; None where a pair had no posture, which is closed then."""
        stages = list(self._risen)
        self._steps = [None] * len(stages)
        feet = FEET if way[0] == 0 else (FEET[1], FEET[0])
        names = [feet[k % 2] for k in range(len(way))]
        pairs = [self._pair(names[k], way[k : k + 2]) for k in range(len(way) - 1)]
        trunks = self._room.postures(pairs).tolist()
        q = stages[-1].q
        for k in range(len(way) - 2):
            leaving, standing, landing = (self._contact(names[k + j], way[k + j]) for j in range(3))
            if leaving.same_place(landing):
                continue
            lifted = self._posed(names[k : k + 2], way[k : k + 2], 1, trunks[k], q)
            if lifted.q is None:
                return self._refuse(way[k], way[k + 1], f"{names[k]} cannot be lifted: {lifted.reason}")
            landed = self._posed(names[k + 1 : k + 3], way[k + 1 : k + 3], 0, trunks[k + 1], lifted.q)
            if landed.q is None:
                why = f"{landing.effector} cannot be put down: {landed.reason}"
                return self._refuse(way[k + 1], way[k + 2], why)
            distance = float(np.linalg.norm(landing.position - leaving.position))
            flight = max(self.settings.swing_duration, distance / self.settings.swing_speed)
            body = self.poser.body
            stages.append(Stage.of(body, {standing.effector: standing}, lifted.q, flight))
            both = {standing.effector: standing, landing.effector: landing}
            stages.append(Stage.of(body, both, landed.q, self.settings.shift_duration))
            self._steps += [(way[k + 1], way[k + 2])] * 2
            q = landed.q
        contacts = stages[-1].contacts
        posed = self.poser.pose(contacts, contacts, self.goal.q, self.goal.q[:7], restarts=True)
        if posed.q is None:
            self.reasons[f"at the goal: {posed.reason}"] += 1
            self.search.close(way[-2], way[-1])
            return None
        return ContactPlan.of(self.poser.body, stages, posed.q, self.settings.hinge_pace)

    def _refuse(self, stand: int, step: int, reason: str) -> None:
        self.reasons[reason] += 1
        if self.replanned < NEAR_TRIES:
            self.search.close(stand, step)
        else:
            self.search.refuse(stand, step)

    def _pair(self, first: str, numbers: Sequence[int]) -> tuple[Foothold, Foothold]:
        """Left and right of two footholds, the first of which is one foot's."""
        one, other = (self.search.hold(number) for number in numbers)
        return (one, other) if first == FEET[0] else (other, one)

    def _posed(
        self, names: Sequence[str], way: Sequence[int], rests: int, trunk: int, q: FloatArray
    ) -> Posed:
        """Posture on a pair of footholds that rests on one of them; looked for once with each trunk."""
        key = way[0], way[1], bool(rests), trunk
        if key in self._postures:
            return self._postures[key]
        held = {name: self._contact(name, number) for name, number in zip(names, way, strict=True)}
        carrying: Mapping[str, Contact] = {names[rests]: held[names[rests]]}
        guide = self._room.guide(trunk, *self._pair(names[0], way))
        posed = self.poser.pose(held, carrying, q, guide)
        if posed.q is None:
            start = np.concatenate([guide, q[len(guide) :]])
            posed = self.poser.pose(held, carrying, start, guide, restarts=True)
        if posed.q is not None:
            posed = self._easier(posed, held, held[names[rests]], self._pair(names[0], way), trunk)
        self._postures[key] = posed
        return posed

    def _easier(
        self, posed: Posed, held: Mapping[str, Contact], carrying: Contact, pair: tuple[Foothold, Foothold],
        trunk: int,
    ) -> Posed:  # fmt: skip
        """A posture on one foot that the joints can hold at rest: the given one, or one that leans ahead."""
        body, stance, name = self.poser.body, Stance([carrying]), carrying.effector

        def share_of(item: Posed) -> float:
            return math.inf if item.q is None else static_torque_share(body, item.q, stance)

        best, least = posed, share_of(posed)
        turn = carrying.rotation_contact_to_world
        middle, ahead = carrying.position + turn @ carrying.centre, 0.5 * carrying.length * turn[:, 0]
        for number, part in ((n, part) for n in self._room.stooped(trunk) for part in EASIER):
            if least <= 1.0 or best.q is None:
                break
            place, guide = (middle + part * ahead)[:2], self._room.guide(number, *pair)
            other = self.poser.pose(held, {name: carrying}, best.q, guide, place=place)
            share = share_of(other)
            if share < least:
                best, least = other, share
        if least > 1.0 and self.replanned < STRONG_TRIES:
            return Posed(None, f"resting on {name} asks for {least:.2f} of the strength")
        return best
