"""Contacts of a body that goes on its feet, from start to goal.

Footsteps are searched for with cheap tests (:mod:`manikin.planning.contacts.footsteps`); whole postures are looked
for along the best way only, two for each pair of footholds: one that rests on the foot that stands, the other
already down, and one that rests on the other, the first about to leave.  A pair without a posture is closed, and the
search goes on with the next best way; so is a pair that a later stage could not use (:class:`Refusal`).
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.contact import Contact, sole
from manikin.kinematics import reach_volume
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.contact_plan import HINGE_PACE, ContactPlan, Stage
from manikin.planning.contacts.depth_first import Extension, SearchLog
from manikin.planning.contacts.endpoint import stand_up
from manikin.planning.contacts.footing import Foothold, Footing
from manikin.planning.contacts.footsteps import FootstepSearch
from manikin.planning.contacts.limb_places import stature_of
from manikin.planning.contacts.posture_finder import Posed, PostureFinder
from manikin.planning.guide.abstraction import abstraction_of
from manikin.planning.guide.checker import Margins, ReachabilityChecker

FEET = ("left_foot", "right_foot")

BENT = (
    (1.0, 0.0, 0.0),
    (0.94, 0.35, 0.15),
    (0.85, 0.6, 0.4),
    (0.72, 0.8, 0.8),
    (0.6, 0.9, 1.2),
    (0.5, 1.0, 1.8),
)
"""Heights of the root, of a standing one's, leans of the trunk forward [rad] and what a step in them costs [s]."""

COLUMN = (0.12, 0.5, 0.9)
"""Radius, lowest and highest end of the column that has to be free above the ground, of a body of 1.75 m [m]."""


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
    hinge_pace: float = HINGE_PACE


@dataclass
class BodyRoom:
    """Room for the trunk of a body between its feet, in one of a few postures.

    Attributes:
        body: The body.
        checker: Tests the trunk.
    """

    body: BodyModel
    checker: ReachabilityChecker
    _known: dict[tuple[int, int], tuple[float, FloatArray]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        q = np.array(self.body.standing_posture())
        self._height = float(q[2])

    def poses(self, left: Foothold, right: Foothold) -> list[tuple[float, FloatArray]]:
        """Costs [s] and poses (7,) of the root between two footholds, the cheapest first."""
        x = math.cos(left.yaw) + math.cos(right.yaw)
        y = math.sin(left.yaw) + math.sin(right.yaw)
        yaw = math.atan2(y, x)
        middle = 0.5 * (left.position + right.position)
        low = min(float(left.position[2]), float(right.position[2]))
        ground = low + 0.4 * (float(middle[2]) - low)
        found = []
        for share, lean, cost in BENT:
            back = 0.3 * self._height * math.sin(lean)
            place = [middle[0] - back * math.cos(yaw), middle[1] - back * math.sin(yaw)]
            turn = Rotation.from_euler("ZYX", [yaw, lean, 0.0]).as_quat()
            found.append((cost, np.array([*place, ground + share * self._height, *turn])))
        return found

    def cost(self, left: Foothold, right: Foothold) -> float:
        """Cost of the cheapest free pose [s]; infinite where there is none."""
        return self.free(left, right)[0]

    def free(self, left: Foothold, right: Foothold) -> tuple[float, FloatArray]:
        """Cost [s] and pose (7,) of the root, the cheapest that is free; infinite where none is."""
        key = id(left), id(right)
        if key not in self._known:
            options = self.poses(left, right)
            free = ((cost, pose) for cost, pose in options if self.checker.trunk_is_free(pose))
            self._known[key] = next(free, (math.inf, options[0][1]))
        return self._known[key]


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
        legs = [limb for limb in body.limbs if limb.effector in FEET]
        volumes = [reach_volume(body, limb, np.random.default_rng(0)) for limb in legs]
        checker = ReachabilityChecker(abstraction_of(body, volumes), scene, margins=Margins(0.01, 0.0))
        self._room = BodyRoom(body, checker)
        first = self.goal.contacts[FEET[0]]
        steepest = min(math.radians(30.0), math.atan(0.8 * self.friction))
        self._footing = Footing(scene, (first.length, first.width), steepest)
        self._contacts: dict[tuple[str, int], Contact] = {}
        self._postures: dict[tuple[int, int, bool], Posed] = {}
        radius, low, high = (scale * value for value in COLUMN)
        start, goal = (self._holds(stage) for stage in (self.start, self.goal))
        self.search = FootstepSearch(
            self._footing, start, goal, scale, self._room.cost, (radius, low, high), self.settings.stride
        )
        for number, (stage, foot) in enumerate((s, f) for s in (self.start, self.goal) for f in FEET):
            self._contacts[foot, number] = stage.contacts[foot]
        self._risen: tuple[Stage, ...] = ()
        self.reasons: Counter[str] = Counter()
        self.replanned = 0

    def run(self) -> Extension:
        """The best way whose postures exist, or why there is none."""
        upright = self._room.poses(*self._holds(self.start))[0][1]
        first = stand_up(self.poser, self.start, frozenset(FEET), upright, self._log)
        if first is None:
            left = ", ".join(set(self.start.contacts) - set(FEET))
            return self._failed(f"cannot leave {left}")
        self._risen = first.stages
        while not self._log.is_spent:
            way = self.search.best()
            if way is None:
                return self._failed("no footsteps lead to the goal")
            plan = self._planned(way)
            if plan is not None:
                return Extension(plan, self._log.searches, self.replanned)
            self.replanned += 1
        return self._failed(f"no contacts after {self._log.searches} postures")

    def _failed(self, what: str) -> Extension:
        most = self.reasons.most_common(1)
        why = f"; most often: {most[0][0]}" if most else ""
        left = self.search.farthest()
        near = f", {left:.1f} s before it" if math.isfinite(left) else ""
        return Extension(None, self._log.searches, self.replanned, f"{what}{near}{why}", 0.0)

    def _holds(self, stage: Stage) -> tuple[Foothold, Foothold]:
        left, right = (stage.contacts[foot] for foot in FEET)
        return _hold_of(left), _hold_of(right)

    def _contact(self, foot: str, number: int) -> Contact:
        key = foot, number
        if key not in self._contacts:
            hold = self.search.hold(number)
            length, width = self._footing.size
            self._contacts[key] = sole(
                foot, hold.position, length=length, width=width, friction=self.friction,
                rotation=hold.rotation,
            )  # fmt: skip
        return self._contacts[key]

    def _planned(self, way: Sequence[int]) -> ContactPlan | None:
        """Plan of a way; None where a pair had no posture, which is closed then."""
        stages = list(self._risen)
        feet = FEET if way[0] == 0 else (FEET[1], FEET[0])
        names = [feet[k % 2] for k in range(len(way))]
        q = stages[-1].q
        for k in range(len(way) - 2):
            leaving, standing, landing = (self._contact(names[k + j], way[k + j]) for j in range(3))
            if leaving.same_place(landing):
                continue
            lifted = self._posed(names[k : k + 2], way[k : k + 2], 1, q)
            if lifted.q is None:
                return self._refuse(way[k], way[k + 1], f"{names[k]} cannot be lifted: {lifted.reason}", k)
            landed = self._posed(names[k + 1 : k + 3], way[k + 1 : k + 3], 0, lifted.q)
            if landed.q is None:
                return self._refuse(
                    way[k + 1], way[k + 2], f"{landing.effector} cannot be put down: {landed.reason}", k + 1
                )
            distance = float(np.linalg.norm(landing.position - leaving.position))
            flight = max(self.settings.swing_duration, distance / self.settings.swing_speed)
            body = self.poser.body
            stages.append(Stage.of(body, {standing.effector: standing}, lifted.q, flight))
            both = {standing.effector: standing, landing.effector: landing}
            stages.append(Stage.of(body, both, landed.q, self.settings.shift_duration))
            q = landed.q
        contacts = stages[-1].contacts
        posed = self.poser.pose(contacts, contacts, self.goal.q, self.goal.q[:7], restarts=True)
        if posed.q is None:
            self.reasons[f"at the goal: {posed.reason}"] += 1
            self.search.close(way[-2], way[-1])
            return None
        return ContactPlan.of(self.poser.body, stages, posed.q, self.settings.hinge_pace)

    def _refuse(self, stand: int, step: int, reason: str, where: int) -> None:
        self.reasons[reason] += 1
        self.search.close(stand, step)

    def _pose(self, first: int, second: int, side: int) -> FloatArray:
        """(7,) pose of the root between two footholds, ``side`` 0 where the first one is left."""
        a, b = self.search.hold(first), self.search.hold(second)
        left, right = (a, b) if side == 0 else (b, a)
        return self._room.free(left, right)[1]

    def _posed(self, names: Sequence[str], way: Sequence[int], rests: int, q: FloatArray) -> Posed:
        """Posture on a pair of footholds that rests on one of them; looked for once."""
        key = way[0], way[1], bool(rests)
        if key in self._postures:
            return self._postures[key]
        held = {name: self._contact(name, number) for name, number in zip(names, way, strict=True)}
        carrying: Mapping[str, Contact] = {names[rests]: held[names[rests]]}
        pose = self._pose(way[0], way[1], 0 if names[0] == FEET[0] else 1)
        posed = self.poser.pose(held, carrying, q, pose)
        if posed.q is None:
            posed = self.poser.pose(held, carrying, np.concatenate([pose, q[7:]]), pose, restarts=True)
        self._postures[key] = posed
        return posed


def _hold_of(contact: Contact) -> Foothold:
    """Foothold of a contact that is given."""
    return Foothold(contact.position, contact.yaw, contact.normal)
