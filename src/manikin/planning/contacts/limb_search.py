"""Contacts of any limbs from start to goal: a best-first search over sets of contacts.

A state is the set of contacts that are held; a move breaks one of them and makes one of the same limb
elsewhere.  Cheap tests are the reach of every limb from the pose of the root that suits a state best, and
balance on the contacts that stay.  Whole postures are looked for along the best way only: one that still
holds the old contact and rests on the others, one with the limb off the line between its contacts, and one
that already holds the new one ([Tonneau2015]_ 7.2).  What has no posture is closed, what is much like it
costs more.  A body that goes on its feet has :mod:`manikin.planning.contacts.walk_search`.
"""

import heapq
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial import cKDTree

from manikin.body import Configuration
from manikin.body.limbs import limb_placement, limb_slots
from manikin.contact import Contact, ContactKind
from manikin.kinematics import Placement
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.graph_search import Graph
from manikin.numerics.polytope import convex_polygon, signed_distance
from manikin.numerics.spatial import FloatArray, quaternions, rotation_from_yaw, rotations
from manikin.planning.contacts.best_first import PosedSearch, Refused, heading_of
from manikin.planning.contacts.contact_plan import ContactPlan, Contacts, Paces, Stage
from manikin.planning.contacts.heuristics import duration
from manikin.planning.contacts.posture_finder import Posed, PostureFinder

GREED = ((1.5, 200), (3.0, 600), (6.0, 1500))  # on the estimate, states expanded with each; our choice
GOAL_REACH = 1.5  # distance from the root at the goal within which limbs have to have places, by their reach
STEEPEST_TRUNK = 0.5  # largest pitch of a trunk that follows its contacts [rad]; our choice
LEVELLED = 0.8  # share of the slope of its contacts to which a trunk pitches; our choice
FARTHEST = 0.5  # largest distance of a first contact to the place of its limb, by its reach; our choice
APART = 0.15  # distance between first contacts that are tried for a limb, by its reach; our choice
REST = 0.06  # distance to the edges of where it rests at which a trunk is thought, by the reach; our choice
SHARES = np.linspace(0.0, 1.0, 9)  # of the way of the trunk to the middle of the limbs that stay
WIDE = 0.12  # distance to the edges of where it rests at which a trunk is at ease, by the reach; our choice
NARROW = 3.0  # cost of a move over contacts on one line, without room between their edges, in moves
OVERREACH = 30.0  # cost of a limb that is beyond its reach then by as much as that, in moves; our choice
PROVEN = 0.8  # discount on a move that has a posture: such ways are gone on with [moves]; our choice
AHEAD = np.linspace(0.0, 2.0, 7)[1:, None]  # places ahead at which a contact may be kept [strides]
LOOSE = 1.0  # cost of a limb without a contact, in moves; our choice
HOOKED = rotations(np.array(0.0), np.array(-0.25 * math.pi), np.array(0.0))
"""Turn of a hand whose fingers hook round an edge, from one that lies flat on it."""
GRIPPED = 0.5  # weight with which a hand keeps its turn round the bar that it holds; our choice [1/rad^2]
FARTHEST_TURN = math.radians(60.0)  # by which it turns there from one posture to the next; our choice
SOLES_APART = 0.02  # least distance of two soles side by side; our choice [m]
SOLE_ABOVE = 0.1  # distance of two soles of which one may be above the other; our choice [m]
TURN = 0.2  # distance that counts as much as a right angle when a limb's sample is chosen [m]; our choice
FREE = -1  # row of a hand that has let go
State = tuple[int, ...]
"""Place of each limb, by its row among those of the limb; the first is that of the start, if it has one."""


@dataclass(frozen=True)
class LimbSettings(Paces):
    """How limbs are moved, of a body whose limbs reach 1 m; the values are our choice.

    Attributes:
        stride: Way of a limb that costs least [m].
        around: Distance from where a limb should be up to which places are tried [strides].
        beyond: How far limbs are beyond their reach from a stiff trunk at most, by that reach.
        price: Cost of a move as such: the more, the fewer contacts.
        brief: Cost of a contact that can be kept on nothing of the way ahead ([Tonneau2015]_ 7.4), in moves.
        comfort: Cost of a limb that is as far from where it should be as it reaches, in moves.
        farthest: Longest way of a limb from a contact to the next [strides].
        sway: Distance of the root from the polygon of the contacts that stay at most, by that reach.
        searches: Most postures that are looked for.
        lift: How far a limb in flight keeps from the line between its contacts [m].
        goal_distance: Distance of the root from its goal at which it is reached [m].
        goal_turn: Angle between the root's heading and the goal's at which it is reached [rad].
        turns: Whether the root's heading follows the contacts; it goes from that of the start to the goal's
            otherwise, as that of a climber does, whose trunk is pitched by no slope either.
        retreats: Distances behind where the root should be from which postures are tried too, by that reach;
            for who climbs on whole soles, which also keep apart and on their own sides then.
        lets_go: Whether hands may let go, as those of one who stands at the goal.
        greeds: Factors on the estimate, and states expanded with each.
    """

    stride: float = 0.4
    around: float = 0.45
    beyond: float = 0.0
    price: float = 2.2
    brief: float = 1.0
    comfort: float = 2.0
    farthest: float = math.inf
    sway: float = 0.12
    searches: int = 900
    lift: float = 0.08
    goal_distance: float = 0.08
    goal_turn: float = math.radians(12.0)
    turns: bool = True
    lets_go: bool = False
    retreats: tuple[float, ...] = ()
    greeds: tuple[tuple[float, int], ...] = GREED


@dataclass(frozen=True, eq=False)
class LimbHolds:
    """Places for one limb.

    Attributes:
        positions: (m, 3) [m].
        contact: Makes the contact of a row.
        is_free: Whether there is room for the limb's end at a row.
        samples: Of the limb.
        root_to_segment: Rotation (3, 3) and place (3,) of the segment that carries it, from the root.
        wanted: (3,) where the limb should be from the root [m].
    """

    positions: FloatArray
    contact: Callable[[int], Contact]
    is_free: Callable[[int], bool]
    samples: LimbSamples
    root_to_segment: tuple[FloatArray, FloatArray]
    wanted: FloatArray

    @property
    def effector(self) -> str:
        """Effector of the limb."""
        return self.samples.limb.effector

    def stretched(
        self, q: FloatArray, root: FloatArray, contact: Contact, state: Configuration
    ) -> FloatArray:
        """(nq,) posture with its root at a (7,) pose and the limb as in the sample nearest to a contact."""
        limb, guess = self.samples.limb, np.concatenate([root, q[7:]])
        rotation, origin = limb_placement(state.update(guess), limb)
        off = np.linalg.norm(self.samples.positions - (contact.position - origin) @ rotation, axis=1)
        frame = rotation.T @ contact.rotation_contact_to_world
        if contact.kind is ContactKind.GRASP:
            frame = frame @ HOOKED
        off -= TURN * (self.samples.upward @ frame[:, 2])
        if contact.kind is not ContactKind.POINT:
            off -= TURN * (self.samples.rotations[:, :, 0] @ frame[:, 0])
        guess[limb_slots(state.body, limb)] = self.samples.angles[int(np.argmin(off))]
        return guess

    def nearest(self, root: FloatArray, most: int) -> list[tuple[float, Contact]]:
        """Free places near where the limb should be of a (7,) pose of the root, with their distances [m]."""
        if not len(self.positions):
            return []
        away = np.linalg.norm(self.positions - pin.XYZQUATToSE3(root).act(self.wanted), axis=1)
        near, size = list[int](), self.samples.hull[1]
        for row in np.argsort(away, kind="stable").tolist():
            apart = np.linalg.norm(self.positions[near] - self.positions[row], axis=1)
            if len(near) == most or away[row] > FARTHEST * size:
                break
            if apart.min(initial=np.inf) >= APART * size and self.is_free(row):
                near.append(row)
        return [(float(away[row]), replace(self.contact(row), oriented=False)) for row in near]

    def room(self, places: FloatArray) -> FloatArray:
        """(k,) distance of places (k, 3) seen from the root to the end of the reach [m]; negative outside."""
        turn, at = self.root_to_segment
        return self.samples.reach.residual((places - at) @ turn)


class _Guess(NamedTuple):
    """Pose (7,) of the root, posture (nq,) to begin with, (2,) place of the CoM [m]; None: by the pose."""

    root: FloatArray
    q: FloatArray
    near: FloatArray | None


class LimbSearch(PosedSearch[State, tuple[State, State]]):
    """Search for the contacts of any limbs, which can be asked again with more moves closed."""

    def __init__(
        self, poser: PostureFinder, holds: Sequence[LimbHolds], start: Stage, goal: FloatArray, size: float,
        settings: LimbSettings | None = None, lead: Callable[[], FloatArray | None] | None = None,
    ) -> None:  # fmt: skip
        """Prepare a search.

        Args:
            holds: Places of each limb that makes contacts.
            start: Contacts and posture at the start; limbs without a contact make one where they can.
            goal: (7,) pose of the root at the goal.
            size: Mean distance that the limbs reach [m].
            lead: Finds places (n, 3) of the root on a guide to the goal, None where the straight way is free
                [m]; asked when a chain of places leads there. The straight way when omitted.
        """
        self.settings, self._lead = settings or LimbSettings(), lead
        super().__init__(poser, self.settings.searches)
        self.holds, self.start, self.goal, self.size = holds, start, goal, size
        root = start.q[:7]
        self._yaws = heading_of(root), heading_of(goal)
        turn = rotation_from_yaw(self._yaws[0])
        first = [
            start.contacts[item.effector].position
            if item.effector in start.contacts else root[:3] + turn @ item.wanted
            for item in holds
        ]  # fmt: skip
        # The last one is that of a hand that has let go, which counts nowhere.
        self._places = [np.vstack([at, item.positions, at]) for at, item in zip(first, holds, strict=True)]
        self._trees = [cKDTree(item.positions) if len(item.positions) else None for item in holds]
        self._wanted = np.array([item.wanted for item in holds])
        # Each of these is asked again and again.
        self._contact, self._has_room = cache(self._made), cache(self._roomy)
        self._beyond, self._resting = cache(self._overreached), cache(self._rest_without)
        kinds = [self._contact(k, 1).kind if len(item.positions) else None for k, item in enumerate(holds)]
        self._grasps = [kind is ContactKind.GRASP for kind in kinds]
        self._tips = [kind is ContactKind.POINT for kind in kinds]
        self._on_tips = all(self._tips)
        self._next: dict[State, list[tuple[State, float]]] = {}
        self._later: dict[State, list[tuple[State, float]]] = {}
        self._ahead: dict[State, float] = {}
        self._stuck: set[tuple[State, int]] = set()
        self._dearer = [Refused(0.12 * size) for _ in holds]  # by places of the limb and the root
        # Place and rotation of the root, and the place a stride on.
        self._trunks: dict[State, tuple[FloatArray, FloatArray, FloatArray]] = {}
        self._postures: dict[tuple[object, ...], Posed] = {}
        self._greedier = 0  # how many of the factors on the estimate found no way
        self._state = Configuration(poser.body, start.q)

    def _best(self) -> list[State] | str:
        first = (0,) * len(self.holds)
        if self._walled_off:
            return self._walled_off
        self._frame_costs([first])
        graph = Graph(
            self._ahead.__getitem__, self._followers, self._tested, lambda state: self._ahead[state] <= 0.0
        )
        way, expanded = graph.best([first], self.settings.greeds[self._greedier :])
        # Moves that are closed since do not make a way easier to find with a factor that found none.
        self._greedier += len(expanded) - 1
        return way or "no contacts lead to the goal"

    @cached_property
    def _walled_off(self) -> str:
        """Why no chain of places leads from the start to the goal; empty where one does."""
        shared = {id(item.positions): item.positions for item in self.holds}
        places = np.vstack([self._at([(0,) * len(self.holds)])[0], *shared.values()])
        there, enough = self.goal[:3], GOAL_REACH * self.size
        # Hands alone carry nobody for long: what stands has to have places there.
        standing = [item for k, item in enumerate(self.holds) if not self._grasps[k]] or self.holds
        away = [np.linalg.norm(item.positions - there, axis=1).min(initial=np.inf) for item in standing]
        if min(away) > enough:
            names = ", ".join(item.effector for item in standing)
            return f"the goal is walled off from the start: none of {names} has a place within reach of it"
        tree, left = cKDTree(places), np.linalg.norm(places - there, axis=1)
        known = np.arange(len(places)) < len(self.holds)
        open_ = sorted((left[row], row) for row in range(len(self.holds)))
        while open_:
            near, row = heapq.heappop(open_)
            if near <= enough:
                return ""
            around = np.array(tree.query_ball_point(places[row], self.size))
            for other in around[~known[around]].tolist():
                known[other] = True
                heapq.heappush(open_, (left[other], other))
        return f"the goal is walled off from the start: a gap is wider than {self.size:.2f} m"

    def _farthest(self) -> str:
        if not self._ahead:
            return ""
        left, whole = min(self._ahead.values()), self._ahead[(0,) * len(self.holds)]
        return f" beyond {100.0 * (1.0 - min(1.0, left / max(whole, 1e-9))):.0f} % of the way"

    # --- the cheap search ---------------------------------------------------------------------

    def _at(self, states: Sequence[State]) -> FloatArray:
        """(k, n, 3) places of k states [m]."""
        rows = np.array(states)
        return np.stack([places[rows[:, k]] for k, places in enumerate(self._places)], axis=1)

    def _frames(self, states: Sequence[State]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Roots (k, 3) [m], headings and pitches (k,) [rad] that suit the contacts of k states best."""
        places, share = self._at(states), self._shares(states)
        middle, mean = (share[..., None] * places).sum(axis=1), share @ self._wanted
        away = share[..., None] * (places - middle[:, None])
        if self.settings.turns:
            flat = self._wanted - mean[:, None]
            sine = (flat[..., 0] * away[..., 1] - flat[..., 1] * away[..., 0]).sum(axis=1)
            cosine = (flat[..., 0] * away[..., 0] + flat[..., 1] * away[..., 1]).sum(axis=1)
            yaw = np.arctan2(sine, cosine)
            along = np.cos(yaw)[:, None] * away[..., 0] + np.sin(yaw)[:, None] * away[..., 1]
            slope = (along * away[..., 2]).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-9)
            pitch = np.clip(-LEVELLED * np.arctan(slope), -STEEPEST_TRUNK, STEEPEST_TRUNK)
        else:
            yaw, pitch = np.full(len(places), self._yaws[1]), np.zeros(len(places))
        turned = rotations(yaw, pitch, np.zeros(len(places))) @ mean[..., None]
        return middle - turned[..., 0], yaw, pitch

    def _shares(self, states: Sequence[State]) -> FloatArray:
        """(k, n) share of each limb that is held in the limbs of a state that are."""
        begun = np.array([item.effector in self.start.contacts for item in self.holds])
        rows = np.array(states)
        held = ((rows > 0) | (begun & (rows == 0))).astype(np.float64)
        return held / np.maximum(held.sum(axis=1, keepdims=True), 1.0)

    def _frame_costs(self, states: Sequence[State]) -> FloatArray:
        """Costs (k,) of how far limbs are from where they should be, infinite out of reach."""
        places, held = self._at(states), self._shares(states) > 0.0
        roots, yaw, pitch = self._frames(states)
        turn = rotations(yaw, pitch, np.zeros(len(yaw)))
        local = np.einsum("kji,knj->kni", turn, places - roots[:, None])
        off = held * np.linalg.norm(local - self._wanted, axis=2) / self.size
        cost = (self.settings.comfort * off**2 + LOOSE * ~held).sum(axis=1)
        for k, item in enumerate(self.holds):
            beyond = np.where(held[:, k], -item.room(local[:, k]) / self.size, 0.0)
            cost += np.where(beyond > self.settings.beyond, np.inf, 4.0 * np.maximum(beyond, 0.0))
        away, (off_way, onward) = np.linalg.norm(roots - self.goal[:3], axis=1), self._ahead_of(roots)
        off_heading = np.abs(np.mod(yaw - self._yaws[1] + math.pi, 2.0 * math.pi) - math.pi)
        n, stride = len(self.holds), self.settings.stride
        near = (away <= self.settings.goal_distance) & (off_heading <= self.settings.goal_turn)
        # From the goal every limb of who climbs on rungs, whose trunk does not pitch, reaches its place.
        there = (places - self.goal[:3]) @ rotation_from_yaw(self._yaws[1])
        for k, item in enumerate(self.holds if self.settings.retreats else ()):
            near &= ~held[:, k] | (-item.room(there[:, k]) <= self.settings.beyond * self.size)
        ahead = n * (off_way + 0.6 * self.size * off_heading) / stride
        self._trunks.update(zip(states, zip(roots, turn, onward, strict=True), strict=True))
        for state, left in zip(states, np.where(near, 0.0, ahead + 1e-6).tolist(), strict=True):
            self._ahead.setdefault(state, left)
        return cost

    @cached_property
    def _way(self) -> tuple[FloatArray, FloatArray]:
        """Places (n, 3) of the root on the way to the goal, and what is left of it from each (n,) [m]."""
        lead = None if self._lead is None else self._lead()
        places = self.goal[None, :3] if lead is None else np.vstack([lead, self.goal[:3]])
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        return places, np.append(np.cumsum(steps[::-1])[::-1], 0.0)

    def _ahead_of(self, roots: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Length (k,) of the way from roots (k, 3) to the goal, and places (k, 3) a stride on [m]."""
        places, left = self._way
        off = np.linalg.norm(roots[:, None] - places, axis=2)
        near = np.argmin(off, axis=1)
        then = np.argmax(left <= left[near, None] - self.settings.stride, axis=1)
        then = np.where(left[near] <= self.settings.stride, len(places) - 1, then)
        return off[np.arange(len(roots)), near] + left[near], places[then]

    def _followers(self, state: State) -> list[tuple[State, float]]:
        """States after one move, with what it costs."""
        if state in self._next:
            return self._next[state]
        (root, turn, onward), stride = self._trunks[state], self.settings.stride
        away = onward - root
        onward = min(1.0, 0.5 * stride / max(float(np.linalg.norm(away)), 1e-9)) * away
        states, steps = list[State](), list[float]()
        for k, tree in enumerate(self._trees):
            if tree is None or (state, k) in self._stuck or state[k] == FREE:
                continue
            if self.settings.lets_go and self._grasps[k] and self._held(k, state[k]):
                states.append((*state[:k], FREE, *state[k + 1 :]))
                steps.append(1.0)
            here, wanted = self._places[k][state[k]], root + turn @ self._wanted[k]
            # From behind where it should be to ahead of it.
            centres = wanted + np.outer((0.0, 1.0, 2.0), onward)
            rows = set[int]().union(*tree.query_ball_point(centres, self.settings.around * stride))
            if not rows or not any(self._grasps):
                rows |= set(tree.query(wanted + onward, k=min(3, tree.n))[1].ravel().tolist())
            places = np.array(sorted(rows)) + 1
            ways = np.linalg.norm(self._places[k][places] - here, axis=1)
            longest = self.settings.farthest * stride if self._held(k, state[k]) else math.inf
            far = (places != state[k]) & (ways > 0.15 * stride) & (ways <= longest)
            states += [(*state[:k], row, *state[k + 1 :]) for row in places[far].tolist()]
            cost = self.settings.price + 0.5 * (ways[far] / (2.0 * stride)) ** 2
            if self.settings.brief > 0.0:
                kept = self._duration(k, self._places[k][places[far]], root + AHEAD * away, turn)
                cost += self.settings.brief * (1.0 - kept)
            steps += cost.tolist()
        costs = self._frame_costs(states) if states else np.zeros(0)
        moves = [
            (after, step + cost)
            for after, step, cost in zip(states, steps, costs.tolist(), strict=True) if math.isfinite(cost)
        ]  # fmt: skip
        # A limb that is still free comes first ([Tonneau2015]_ 7.2), as long as it finds a place.
        whole = all(self._held(k, row) for k, row in enumerate(state))
        fills = set[State]()
        for after, _ in moves if not whole else ():
            k = self._moved(state, after)
            if after[k] != FREE and not self._held(k, state[k]) and self._has_room(k, after[k]):
                fills.add(after)
        self._later[state] = [item for item in moves if item[0] not in fills] if fills else []
        self._next[state] = [item for item in moves if item[0] in fills] or moves
        return self._next[state]

    def _duration(self, k: int, places: FloatArray, roots: FloatArray, turn: FloatArray) -> FloatArray:
        """(n,) share of the roots (w, 3) on the way ahead up to which limb k reaches places (n, 3) [m]."""
        local = (places[:, None] - roots) @ turn
        return duration(self.holds[k].room(local.reshape(-1, 3)).reshape(local.shape[:2]) >= 0.0)

    def _tested(self, _: State | None, before: State, after: State) -> float:
        """What a move costs beyond its way; infinite where it is closed, blocked or without balance."""
        k = self._moved(before, after)
        if (before, k) in self._stuck:
            return math.inf
        cost = self._beyond(before, after, k)
        proven = self._postures.get((after, k, True))
        if proven is not None and proven.q is not None and math.isfinite(cost):
            cost = -PROVEN
        return cost if math.isinf(cost) else cost + 2.0 * self._dearer[k].alike(self._closing(k, after))

    def _closing(self, k: int, after: State) -> FloatArray:
        """(2, 3) places of limb k and the root, by which moves are alike [m]."""
        return np.array([self._places[k][after[k]], self._trunks[after][0]])

    def _overreached(self, before: State, after: State, k: int) -> float:
        """What a move of limb k costs whose limbs come to the ends of their reach; infinite without room."""
        if after[k] != FREE and not (self._has_room(k, after[k]) and self._beside(k, after)):
            return math.inf
        rest, cost = self._resting(k, before)
        return cost if rest is None or math.isinf(cost) else cost + self._stretched(after, *rest)

    def _rest_without(self, k: int, before: State) -> tuple[tuple[FloatArray, FloatArray] | None, float]:
        """Middle (2,) and hull (m, 2) of what stays when limb k moves [m], and what that costs.

        Middle and hull are None where hands hold on, which keep the balance anywhere.
        """
        staying = [j for j in range(len(self.holds)) if j != k and self._held(j, before[j])]
        if any(self._grasps[j] for j in staying):
            return None, 0.0
        at = self._at([before])[0, staying, :2]
        middle, hull = at.mean(axis=0), convex_polygon(at)
        cost = self._stretched(before, middle, hull)
        if all(self._tips[j] for j in staying):
            # On tips nearly on one line the trunk comes to rest far off its way, and nothing may go wrong.
            room = float(signed_distance(middle, hull))
            cost += NARROW * max(0.0, 1.0 - room / (WIDE * self.size))
        return (middle, hull), cost

    def _stretched(self, state: State, middle: FloatArray, hull: FloatArray) -> float:
        """What it costs that limbs come to the ends of their reach where the trunk rests; infinite beyond.

        On its way over the limbs that stay the trunk takes the others there.
        """
        root, turn, _ = self._trunks[state]
        ways = root[:2] + SHARES[:, None] * (middle - root[:2])
        rooms = signed_distance(ways, hull)
        if rooms[0] < -self.settings.sway * self.size:
            return math.inf
        shifted = np.append(ways[int(np.argmax(rooms >= min(REST * self.size, rooms[-1])))], root[2])
        local = (self._at([state])[0] - shifted) @ turn
        beyond = [-float(item.room(local[j])) for j, item in enumerate(self.holds) if self._held(j, state[j])]
        return OVERREACH * max(0.0, *beyond) / self.size

    def _beside(self, k: int, state: State) -> bool:
        """Whether a sole lies beside the others, or above or below them, and on its own side of them."""
        body, mine = self.poser.body, self._contact(k, state[k])
        whole = self.settings.retreats and mine.kind is ContactKind.SOLE
        if not whole or not body.sole_length or not body.sole_width:
            return True
        for j, row in enumerate(state):
            other = self._contact(j, row) if j != k and self._held(j, row) else mine
            if other is mine or other.kind is not ContactKind.SOLE:
                continue
            off = np.abs((other.position - mine.position) @ mine.rotation_contact_to_world)
            side = (other.position - mine.position) @ rotation_from_yaw(self._yaws[1])[:, 1]
            beside = (off < [body.sole_length, body.sole_width + SOLES_APART, SOLE_ABOVE]).all()
            if beside or side * (self._wanted[j, 1] - self._wanted[k, 1]) < 0.0:
                return False
        return True

    def _moved(self, before: State, after: State) -> int:
        return next(k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b)

    def _held(self, k: int, row: int) -> bool:
        return row > 0 or (row == 0 and self.holds[k].effector in self.start.contacts)

    def _close(self, move: tuple[State, State]) -> None:
        before, after = move
        k = self._moved(before, after)
        left = [item for item in self._next.get(before, []) if item[0] != after]
        self._next[before] = left or self._later.pop(before, [])
        self._dearer[k].places.append(self._closing(k, after))

    # --- whole postures -------------------------------------------------------------------------

    def _made(self, k: int, row: int) -> Contact:
        if row == 0:
            return self.start.contacts[self.holds[k].effector]
        return replace(self.holds[k].contact(row - 1), oriented=False)

    def _roomy(self, k: int, row: int) -> bool:
        """Whether there is room for the end of limb k at a place, and for a tip beside what it touches."""
        if not self.holds[k].is_free(row - 1):
            return False
        return not self._tips[k] or self.poser.clears(self._contact(k, row))

    def _contacts_of(self, state: State) -> dict[str, Contact]:
        return {
            item.effector: self._contact(k, row)
            for k, (item, row) in enumerate(zip(self.holds, state, strict=True)) if self._held(k, row)
        }  # fmt: skip

    def _guide(self, state: State) -> FloatArray:
        """(7,) pose of the root that suits a state."""
        root, yaw, pitch = (value[0] for value in self._frames([state]))
        return np.concatenate([root, quaternions(yaw, pitch, np.array(0.0))])

    def _planned(self, way: list[State]) -> ContactPlan | None:
        body, stages = self.poser.body, [self.start]
        self._moves = [None]
        for before, after in pairwise(way):
            k = self._moved(before, after)
            name, held, landed = self.holds[k].effector, self._contacts_of(before), self._contacts_of(after)
            staying = {other: contact for other, contact in held.items() if other != name}
            guesses = self._guesses(self._guide(before), stages[-1].q)
            lifted = self._posed(held, staying, guesses, (before, k, False), stages[-1].q)
            if lifted.q is None:
                self._stuck.add((before, k))
                return self._refused(before, after, f"{name} cannot leave its contact: {lifted.reason}")
            old, new, q, postures = held.get(name), landed.get(name), lifted.q, [stages[-1].q, lifted.q]
            if new is not None:
                guesses = self._guesses(self._guide(after), q, (self.holds[k], new))
                landing = self._posed(landed, staying, guesses, (after, k, True), q)
                if landing.q is None:
                    return self._refused(before, after, f"{name} cannot be put down: {landing.reason}")
                q = landing.q
                via = None
                if old is not None or self.settings.retreats:
                    via = self._between(staying, lifted.q, q, (old or new, new), (before, after))
                postures += [q] if via is None else [via, q]
                if old is None:
                    # The limb is free already: it reaches its contact while the phase before lasts.
                    longest = max(stages[-1].min_duration, self.settings.swing_duration)
                    stages[-1] = replace(stages[-1], min_duration=longest, via=via)
                else:
                    if via is None:
                        return self._refused(before, after, f"{name} finds no way around")
                    stages.append(Stage.of(body, staying, lifted.q, self.settings.flight(old, new), via=via))
            if crossed := self.poser.crossing(*postures):
                return self._refused(before, after, f"{crossed} pass through each other as {name} moves")
            stages.append(Stage.of(body, landed, q, self.settings.shift_duration))
            self._moves += [(before, after)] * (len(stages) - len(self._moves))
        contacts = stages[-1].contacts
        end = self.poser.pose(contacts, contacts, stages[-1].q, self.goal)
        end = self.poser.eased(end, contacts, contacts).at_rest
        if end.q is None or np.linalg.norm(end.q[:3] - self.goal[:3]) > self.settings.goal_distance:
            self._ahead[way[-1]] = 1e-3
            self.reasons[f"at the goal: {end.reason or 'the root stays away from it'}"] += 1
            if len(way) > 1:
                self._close((way[-2], way[-1]))
            return None
        return ContactPlan.of(body, stages, end.q, self.settings)

    def _guesses(
        self, guide: FloatArray, q: FloatArray, landing: tuple[LimbHolds, Contact] | None = None
    ) -> Iterator[_Guess]:
        """As the root should be, as it is, and farther back.

        Farther from what a climber holds on to, knees that bend have room before them.  A limb that lands
        reaches for its contact from there.  Who stays where it is keeps the centre of mass there too: over
        the root, behind legs that are bent, each change of contact would swing it farther back.
        """
        back, roots = pin.XYZQUATToSE3(guide).rotation[:, 0], [guide]
        if self.settings.retreats:
            roots.append(q[:7])
        for away in self.settings.retreats:
            roots.append(np.concatenate([guide[:3] - away * self.size * back, guide[3:7]]))
        for root in roots:
            start = q if landing is None else landing[0].stretched(q, root, landing[1], self._state)
            stays = bool(self.settings.retreats) and np.array_equal(root, q[:7])
            yield _Guess(root, start, self._state.update(q).com[:2] if stays else None)

    def _refused(self, before: State, after: State, reason: str) -> None:
        self.reasons[reason] += 1
        self._close((before, after))

    def _between(
        self, staying: Contacts, lifting: FloatArray, landing: FloatArray,
        ends: tuple[Contact, Contact], move: tuple[State, State],
    ) -> FloatArray | None:  # fmt: skip
        """Posture in the middle of a flight, the limb off the line between its contacts, or None.

        On rungs what reaches for its first contact, at both ends then, comes there from outside.
        """
        (before, after), lift = ends, self.settings.lift
        middle = 0.5 * (before.position + after.position)
        start = 0.5 * (lifting + landing)
        start[3:7] = landing[3:7]
        # What stands out of a wall is passed on the body's side.
        inward = (start[:3] - middle) * [1.0, 1.0, 0.0]
        inward /= max(float(np.linalg.norm(inward)), 1e-9)
        for number, share in enumerate((0.7, 0.0, 2.0)):
            out = 0.5 * (before.normal + after.normal) + share * inward
            place = middle + lift * out / max(float(np.linalg.norm(out)), 1e-9)
            wish = {before.effector: Placement(place, None, None, 0.5 / lift**2)}
            guesses = self._guesses(start[:7], start)
            posed = self._posed(staying, staying, guesses, (*move, number), lifting, wish)
            if posed.q is not None:
                return posed.q
        return None

    def _posed(
        self, held: Contacts, carrying: Contacts,
        guesses: Iterable[_Guess], key: tuple[object, ...], last: FloatArray,
        wishes: Mapping[str, Placement] | None = None,
    ) -> Posed:  # fmt: skip
        """A posture whose points stand upright on their surfaces, as far as they can; looked for once.

        It is near the first of some guesses from which there is one; hands that hold on turn little round
        their bars from the posture before, ``last`` (nq,).
        """
        if key not in self._postures:
            posed, state = Posed(None), self._state.update(last)
            gripping = [name for name, item in carrying.items() if item.kind is ContactKind.GRASP]
            turns = {name: Placement(None, state.effector_placement(name)[0], GRIPPED) for name in gripping}
            wishes = {**turns, **(wishes or {})}
            attempts = (
                (guide, start, place)
                for guide, start, near in guesses for place in self._resting_places(carrying, guide, near)
            )  # fmt: skip
            for guide, start, place in attempts:
                posed = self.poser.pose(
                    held, carrying, start, guide, place=place, placements=wishes, through=self._on_tips
                )
                if posed.q is not None and not (twisted := self._twisted(posed.q, turns)):
                    break
                posed = posed if posed.q is None else Posed(None, twisted)
            self._postures[key] = self.poser.eased(posed, held, carrying, wishes).at_rest
        return self._postures[key]

    def _twisted(self, q: FloatArray, turns: Mapping[str, Placement]) -> str:
        """Which hand has turned farther round its bar than a grip can, and that it has; or empty."""
        state = self._state.update(q)
        for name, before in turns.items():
            assert before.rotation is not None
            turn = np.linalg.norm(pin.log3(before.rotation.T @ state.effector_placement(name)[0]))
            if turn > FARTHEST_TURN:
                return f"{name} would turn by {np.degrees(turn):.0f} degrees where it holds on"
        return ""

    def _resting_places(
        self, carrying: Contacts, guide: FloatArray, near: FloatArray | None
    ) -> Iterator[FloatArray | None]:
        """(2,) places of the centre of mass to try, None for the one nearest to a guide [m].

        A creature's legs reach farther over a support that is narrow if it rests away from its edge.
        """
        if self.settings.retreats:
            near = self._over_feet(carrying, guide[:2] if near is None else near)
            yield self.poser.resting_place(carrying, near, self.poser.settings.inset)
            return
        yield None
        inner = self.poser.inner_place(carrying, guide) if self._on_tips else None
        if inner is not None:
            yield inner

    def _over_feet(self, carrying: Contacts, near: FloatArray) -> FloatArray:
        """(2,) place beside another that is over the middle of the feet that carry, seen from behind [m].

        Hands could carry a climber that is beside its foot, at the end of their strength.
        """
        feet = [item.position[:2] for item in carrying.values() if item.kind is not ContactKind.GRASP]
        aside = rotation_from_yaw(self._yaws[1])[:2, 1]
        return near + float(aside @ (np.mean(feet, axis=0) - near)) * aside if feet else near
