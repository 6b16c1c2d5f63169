"""Contacts of a body that goes on its feet, from start to goal.

Footsteps are searched for with cheap tests (:mod:`manikin.planning.contacts.footsteps`); whole postures are
looked for along the best way only, two for each pair of footholds: one that rests on the foot that stands,
the other already down, and one that rests on the other, the first about to leave.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import hinge_line, stature_of
from manikin.body.segments import FEET
from manikin.contact import Contact, SolePart, sole_part
from manikin.kinematics.step_reach import StepReach
from manikin.kinematics.trunk_postures import CEILINGS, TrunkClearance, TrunkPostures
from manikin.numerics.spatial import FloatArray
from manikin.planning.contacts.best_first import PosedSearch
from manikin.planning.contacts.contact_plan import ContactPlan, Contacts, Paces, Stage
from manikin.planning.contacts.footholds import Foothold, Footholds, feet_of, heading_between
from manikin.planning.contacts.footsteps import HELD_HIGHEST, HIGHEST, FootstepSearch
from manikin.planning.contacts.handholds import Handholds
from manikin.planning.contacts.posture_finder import Posed, PostureFinder
from manikin.planning.contacts.seat import leave_seat
from manikin.planning.guide.ground import HELD_COST, STEP
from manikin.scene import Scene

COLUMN = (0.12, 0.5, 1.75 * CEILINGS[-1])
"""Radius, lowest and highest end above the ground of what is free, at 1.75 m [m]: as low as a trunk folds."""
STRONG_TRIES = 16
"""Ways that are refused because a posture at rest asks for more than the strength; then later stages decide,
as a motion may need less than its postures at rest, whose knees and trunk are not bent for least torque."""

NEAR_TRIES = 12  # ways after which a pair without a posture closes all that are much like it
ALIKE_TRIES = 3  # pairs without a posture and much like each other, which close all that are
HIGH = 0.3  # step at which hands may join as soon as feet alone do not make it, of a body of 1.75 m [m]
HIGH_TRIES = 2  # ways after which a high step without a posture closes all that are much like it
HAND_TRIES = 4  # ways that feet alone do not make after which hands may join at any step
DEEP_INSET = 0.02  # of the centre of mass as a body that turned round carries on a hand, at 1.75 m [m]
CROSSED = 0.03  # depth to which straight ways of a high step may cross something; our choice [m]
HOLDS = 6  # most places of hands that are tried at a step


UNSEEN, ASIDE = 0.12, (0.0, 0.06, -0.06)
"""Shortest way of the trunk in a step half-way of which room for it is sought, and how far beside [m]; our
choice."""


@dataclass(frozen=True)
class WalkSettings(Paces):
    """How a body goes on its feet; the values are our choice.

    Attributes:
        stride: Way between two feet that costs least over the ground, of a body of 1.75 m [m].
        searches: Most postures that are looked for.
        reach_duration: Shortest time between a hand's change and the next one [s].
        grasp_force: Largest force of a grasp along each axis [N].
    """

    hinge_pace: float = 2.0
    stride: float = 0.4
    searches: int = 400
    reach_duration: float = 0.5
    grasp_force: float = 400.0


@dataclass(frozen=True, eq=False)
class _Stand:
    """Two footholds, and the number of the trunk's posture between them."""

    left: Foothold
    right: Foothold
    trunk: int = 0

    @property
    def between(self) -> FloatArray:
        """(4,) x, y and height of the ground [m] and heading [rad] between the feet."""
        left, right = self.left, self.right
        middle = 0.5 * (left.position + right.position)
        low = min(float(left.position[2]), float(right.position[2]))
        # A foot that stands high folds its leg; the body is as high as the other one lets it.
        return np.array(
            [middle[0], middle[1], low + 0.4 * (float(middle[2]) - low), heading_between(left, right)]
        )


class BodyRoom:
    """Room for the trunk of a body between its feet, in one of a few postures."""

    def __init__(self, body: BodyModel, scene: Scene) -> None:
        self._postures = TrunkPostures.of(body)
        self._clearance = TrunkClearance(self._postures, scene)

    def cost(self, place: _Stand) -> float:
        """Cost of a step in the cheapest posture that is free, beyond upright [s]; infinite without one."""
        number = int(self._clearance.cheapest(place.between[None])[0])
        return STEP * (self._postures[number].cost - 1.0) if number >= 0 else math.inf

    def passes(self, before: _Stand, after: _Stand) -> bool:
        """Whether the trunk has room half-way between two places, or a little beside it.

        What is thinner than a step is long, such as a post, is not seen at the places themselves.
        """
        first, last = before.between, after.between
        way = last - first
        way[3] = math.remainder(way[3], 2.0 * math.pi)
        length = math.hypot(way[0], way[1])
        if length < UNSEEN:
            return True
        aside = np.array([-way[1], way[0], 0.0, 0.0]) / length
        half = first + 0.5 * way + np.multiply.outer(ASIDE, aside)
        return bool((self._clearance.cheapest(half) >= 0).any())

    def postures(self, places: Sequence[_Stand]) -> NDArray[np.int64]:
        """(k,) postures to take one after the other at places.

        Where no sequence of them passes, the cheapest that is free at each place, upright where none is.
        """
        between = np.array([place.between for place in places])
        along = self._clearance.along(between)
        return np.maximum(self._clearance.cheapest(between), 0) if along is None else along

    def guide(self, place: _Stand) -> FloatArray:
        """Guide of a posture there, on level ground: (7,) pose of the root upright, else the (nq,) whole.

        Upright arms hang as the manner wants; otherwise they have to be where the posture has room for them.
        """
        posture = self._postures[place.trunk]
        q = posture.at(place.between)
        return q[:7] if posture.cost <= 1.0 else q


class WalkSearch(PosedSearch[int, tuple[int, int]]):
    """Search for the contacts of a walk that can be asked again with more pairs closed."""

    def __init__(
        self, poser: PostureFinder, start: Stage, goal: Stage, friction: float = 0.7,
        settings: WalkSettings | None = None,
    ) -> None:  # fmt: skip
        """Prepare a search.

        Args:
            poser: Finds postures of a body with soles in its scene.
            start: Contacts and posture at the start; those of no feet are left first.
            goal: Contacts and posture at the goal, on feet.
            friction: Coulomb coefficient of soles and palms.
        """
        self.start, self.goal, self.friction = start, goal, friction
        self.settings = settings or WalkSettings()
        super().__init__(poser, self.settings.searches)
        body, scene = poser.body, poser.scene
        self._scale = scale = stature_of(body) / 1.75
        self._handholds = Handholds(body, scene, friction, self.settings.grasp_force)
        self._room = BodyRoom(body, scene)
        first = goal.contacts[FEET[0]]
        steepest = min(math.radians(30.0), math.atan(0.8 * friction))
        self._footholds = Footholds(body, scene, (first.length, first.width), steepest)
        self._contact, self._on_toes = cache(self._made), cache(self._tilted)
        self._postures: dict[tuple[frozenset[Contact], frozenset[str], int], Posed] = {}
        self._near: dict[tuple[int, ...], list[Contact]] = {}
        radius, low, high = (scale * value for value in COLUMN)
        ends = feet_of(start.contacts), feet_of(goal.contacts)
        self.search = FootstepSearch(
            scene, self._footholds, *ends, scale, (StepReach.of(body), StepReach.at_rest(body)),
            self._pair_cost, self._passes, (radius, low, high), self.settings.stride, self._handholds.exist,
        )  # fmt: skip
        self._risen: tuple[Stage, ...] = ()
        self._lenient = False  # whether postures count that are too hard at rest

    def _best(self) -> list[int] | str:
        if not self._risen:
            upright = self._room.guide(_Stand(*feet_of(self.start.contacts)))
            leaving = leave_seat(self.poser, self.start, frozenset(FEET), upright)
            if leaving.failure is not None:
                self.reasons[leaving.failure] += 1
                return f"cannot leave {', '.join(sorted(set(self.start.contacts) - set(FEET)))}"
            self._risen = leaving.stages
        way = self.search.best()
        if way is not None:
            return way
        why = self.search.walled_off()
        if why is None:
            return "no footsteps lead to the goal"
        return f"the goal is walled off from the start: {why}{self._ends_apart()}"

    def _ends_apart(self) -> str:
        """On what start and goal are, where one is far above the other; empty where they are not."""
        levels = [float(end.contacts[FEET[0]].position[2]) for end in (self.start, self.goal)]
        if abs(levels[1] - levels[0]) <= HELD_HIGHEST * self._scale:
            return ""
        (end, name), other = (self.goal, "goal"), "start"
        if levels[0] > levels[1]:
            (end, name), other = (self.start, "start"), "goal"
        on = ", ".join(self.poser.scene.touched_obstacles(end.contacts[FEET[0]]))
        return f"; the {name} is on {on}, {abs(levels[1] - levels[0]):.2f} m above the {other}"

    def _close(self, move: tuple[int, int]) -> None:
        self.search.refuse(*move)

    def _farthest(self) -> str:
        if self.search.walled_off() is not None or not self.search.expanded:
            return ""
        place = self.search.farthest()[1].position
        return f" beyond [{place[0]:.2f}, {place[1]:.2f}, {place[2]:.2f}] m"

    def _made(self, foot: str, number: int) -> Contact:
        """Contact on a foothold; the first two footholds are those of the start, the next two the goal's."""
        if number < 4:
            return (self.start if number < 2 else self.goal).contacts[foot]
        return self._footholds.contact(foot, self.search.holds[number], self.friction)

    def _tilted(self, foot: Contact) -> Contact:
        """The toes of a contact of a foot, the contact itself where they do not lie on a surface."""
        hinge = hinge_line(self.poser.body, foot.effector)
        rises = hinge is not None and foot.rises_on_toes(hinge)
        return sole_part(foot, SolePart.TOES, hinge) if rises and hinge is not None else foot

    def _planned(self, way: list[int]) -> ContactPlan | None:
        stages = list(self._risen)
        self._moves = [None] * len(stages)
        feet = FEET if way[0] == 0 else (FEET[1], FEET[0])
        names = [feet[k % 2] for k in range(len(way))]
        holds = [self.search.holds[number] for number in way]
        places = [
            _Stand(one, other) if name == FEET[0] else _Stand(other, one)
            for name, (one, other) in zip(names[:-1], pairwise(holds), strict=True)
        ]
        trunks = self._room.postures(places).tolist()
        q, hands, body = stages[-1].q, dict[str, Contact](), self.poser.body
        for k in range(len(way) - 2):
            leaving, standing, landing = (self._contact(names[k + j], way[k + j]) for j in range(3))
            if leaving.same_place(landing):
                continue
            before, after = (replace(places[j], trunk=trunks[j]) for j in (k, k + 1))
            changes, held, made, landed = self._moved((leaving, standing, landing), before, after, hands, q)
            if landed.q is None:
                first = k + len(made)
                return self._refuse(way[first], way[first + 1], landed.reason, too_hard=landed.too_hard)
            stages += [*changes, *made]
            self._moves += [(way[k + 1], way[k + 2])] * (2 + len(changes))
            q, hands = landed.q, held
        if hands:
            left = None
            for _ in self._leniencies():
                left = self._left(stages[-1].contacts, places[-1], hands, q) if left is None else left
            if left is None:
                return self._refuse(way[-2], way[-1], f"{' and '.join(hands)} cannot be left")
            stages += left
            self._moves += [(way[-2], way[-1])] * len(left)
        contacts = stages[-1].contacts
        posed = self.poser.pose(contacts, contacts, self.goal.q, self.goal.q[:7], restarts=True)
        if posed.q is None:
            self.reasons[f"at the goal: {posed.reason}"] += 1
            self.search.close(way[-2], way[-1])
            return None
        return ContactPlan.of(body, stages, posed.q, self.settings)

    def _refuse(self, stand: int, step: int, reason: str, *, too_hard: bool = False) -> None:
        self.reasons[reason] += 1
        rise = abs(float(self.search.holds[stand].position[2] - self.search.holds[step].position[2]))
        if too_hard:
            self.search.refuse_everywhere(stand, step)
            return
        most = NEAR_TRIES if rise < HIGH * self._scale else HIGH_TRIES
        if self.search.close(stand, step) >= ALIKE_TRIES or self.replanned >= most:
            self.search.refuse(stand, step)

    def _passes(self, left: Foothold, reached: Foothold, standing: Foothold) -> bool:
        """Whether a foot on its way and the trunk pass beside what is there."""
        before, after = _Stand(left, standing), _Stand(reached, standing)
        return self._footholds.passes(left, reached, standing) and self._room.passes(before, after)

    def _pair_cost(self, left: Foothold, right: Foothold) -> float:
        """Cost of the trunk's room, and of hands where feet alone do not make the step."""
        place = _Stand(left, right)
        cost = self._room.cost(place)
        rise = abs(float(left.position[2] - right.position[2]))
        if rise <= HIGHEST * self._scale or not math.isfinite(cost):
            return cost
        return cost + HELD_COST if self._holds_near(place, place) else math.inf

    def _holds_near(self, before: _Stand, after: _Stand) -> list[Contact]:
        holds = before.left, before.right, after.left, after.right
        key = *map(id, holds), before.trunk, after.trunk
        if key not in self._near:
            roots = [self._room.guide(place)[:7] for place in (before, after)]
            heights = [float(hold.position[2]) for hold in holds]
            deep = max(heights) - min(heights) > HELD_HIGHEST * self._scale
            self._near[key] = self._handholds.near(roots, min(heights), HOLDS, low=deep)
        return self._near[key]

    def _moved(
        self, feet: Sequence[Contact], before: _Stand, after: _Stand, hands: dict[str, Contact], q: FloatArray
    ) -> tuple[list[Stage], dict[str, Contact], list[Stage], Posed]:
        """What hands do before a step, what they hold then, and the step: the first that has postures."""
        failed: tuple[list[Stage], Posed] | None = None
        for _ in self._leniencies():
            for changes, held, start in self._hands_before(feet, before, after, hands, q):
                made, landed = self._step(feet, before, after, start, held)
                high = held or hands or self._rise(before, after) > HIGH * self._scale
                if landed.q is not None and high:
                    ways = q, *(stage.q for stage in (*changes, *made))
                    if crossed := self.poser.crossing(*ways, deeper=CROSSED, step=True):
                        landed = Posed(None, f"{crossed} pass through each other on the way to a step")
                if landed.q is not None:
                    return changes, held, made, landed
                failed = failed or (made, landed)
        stays = ["the step has no posture, whatever the hands hold", f"{' and '.join(hands)} cannot be left"]
        made, landed = failed or ([], Posed(None, stays[bool(hands)]))
        return [], hands, made, landed

    def _hands_before(
        self, feet: Sequence[Contact], before: _Stand, after: _Stand, hands: dict[str, Contact], q: FloatArray
    ) -> Iterator[tuple[list[Stage], dict[str, Contact], FloatArray]]:
        """What hands may hold at a step: nothing, the same, or something new, with the stages to there."""
        standing = {foot.effector: foot for foot in feet[:2]}
        bare = self._left({**standing, **hands}, before, hands, q)
        start = bare[-1].q if bare else q
        rise = self._rise(before, after)
        deep = bool(rise > HELD_HIGHEST * self._scale)  # where a hand carries if one can
        if bare is not None and not deep:
            yield bare, {}, start
        if hands:
            yield [], hands, q
        if bare is None or (rise < HIGH * self._scale and self.replanned < HAND_TRIES):
            return
        holds = self._holds_near(before, after)
        pairs = [(a, b) for a, b in combinations(holds[: HOLDS // 2], 2) if a.effector[0] != b.effector[0]]
        for contacts in [*((hold,) for hold in holds), *pairs[:2], *[()] * deep]:
            stages, held, at = list(bare), dict[str, Contact](), start
            carrying = {feet[1].effector: feet[1], **{contact.effector: contact for contact in contacts}}
            down = float(feet[1].position[2] - feet[2].position[2])
            if self._footed(feet[2], carrying, after, start, down)[1].q is None:
                continue  # without a posture at the end of the step, whatever comes before
            for contact in contacts:
                carrying = {**standing, **held}
                held[contact.effector] = contact
                both = {**standing, **held}
                posed = self._posed(both, carrying, before, at)
                if posed.q is None:
                    self.reasons[f"{contact.effector} cannot be put down: {posed.reason}"] += 1
                    break
                at = posed.q
                stages.append(Stage.of(self.poser.body, both, at, self.settings.reach_duration))
            else:
                yield stages, held, at

    @staticmethod
    def _rise(before: _Stand, after: _Stand) -> float:
        """Height between the lowest and the highest foothold of a step [m]."""
        holds = (hold for place in (before, after) for hold in (place.left, place.right))
        return float(np.ptp([hold.position[2] for hold in holds]))

    def _left(self, contacts: Contacts, place: _Stand, hands: Contacts, q: FloatArray) -> list[Stage] | None:
        """Stages in which hands leave one after the other; None where they cannot."""
        held, stages = dict(contacts), list[Stage]()
        for hand in hands:
            carrying = {name: contact for name, contact in held.items() if name != hand}
            posed = self._posed(held, carrying, place, q)
            if posed.q is None:
                return None
            q, held = posed.q, carrying
            stages.append(Stage.of(self.poser.body, held, q, self.settings.reach_duration))
        return stages

    def _step(
        self, feet: Sequence[Contact], before: _Stand, after: _Stand, q: FloatArray, hands: Contacts
    ) -> tuple[list[Stage], Posed]:
        """Stages in which a foot has left one place and is on another, the other one stands.

        With the posture that was looked for last: one without, and fewer stages, where there is none.
        """
        leaving, standing, landing = feet
        carrying = {standing.effector: standing, **hands}
        off = abs(float(leaving.position[2] - standing.position[2]))
        last, lifted = self._footed(leaving, carrying, before, q, off)
        if lifted.q is None:
            return [], replace(lifted, reason=f"{leaving.effector} cannot be lifted: {lifted.reason}")
        body, flight = self.poser.body, self.settings.flight(leaving, landing)
        stages = [Stage.of(body, carrying, lifted.q, flight, tilted=() if last is leaving else (last,))]
        down = float(standing.position[2] - landing.position[2])
        first, landed = self._footed(landing, carrying, after, lifted.q, down)
        if landed.q is None:
            return stages, replace(landed, reason=f"{landing.effector} cannot be put down: {landed.reason}")
        both, shift = {**carrying, landing.effector: landing}, self.settings.shift_duration
        tilted = () if first is landing else (first,)
        return [*stages, Stage.of(body, both, landed.q, shift, tilted=tilted)], landed

    def _footed(
        self, foot: Contact, carrying: Contacts, place: _Stand, q: FloatArray, high: float
    ) -> tuple[Contact, Posed]:
        """What a foot touches with that does not carry, and the posture: its toes if so ``high`` it must."""
        for foot_or_toes in (foot, self._on_toes(foot)) if high > HIGH * self._scale else (foot,):
            held = {**carrying, foot.effector: foot_or_toes}
            posed = self._posed(held, carrying, place, q, high)
            if posed.q is not None:
                return foot_or_toes, posed
        return foot, posed

    def _posed(
        self, held: Contacts, carrying: Contacts, place: _Stand, q: FloatArray, high: float = 0.0
    ) -> Posed:
        """Posture that holds contacts and rests on some; looked for once with each trunk."""
        key = frozenset(held.values()), frozenset(carrying), place.trunk
        if key in self._postures:
            return self._strong(self._postures[key])
        guide, feet_alone = self._room.guide(place), set(held) <= set(FEET)
        inset = None if feet_alone or high <= HELD_HIGHEST * self._scale else DEEP_INSET * self._scale
        posed = self.poser.pose(held, carrying, q, guide, inset=inset)
        if posed.q is None and (feet_alone or len(held) > 2) and high <= HIGH * self._scale:
            start = np.concatenate([guide, q[len(guide) :]])
            posed = self.poser.pose(held, carrying, start, guide, restarts=feet_alone)
        self._postures[key] = self.poser.eased(posed, held, carrying)
        return self._strong(self._postures[key])

    def _leniencies(self) -> Iterator[None]:
        """Try without postures that are too hard at rest, then, after many ways, with them."""
        for lenient in (False, True) if self.replanned >= STRONG_TRIES else (False,):
            self._lenient = lenient
            yield

    def _strong(self, posed: Posed) -> Posed:
        """The posture, or none where the joints are too weak for it and that counts."""
        return Posed(posed.q) if self._lenient and posed.too_hard else posed.at_rest
