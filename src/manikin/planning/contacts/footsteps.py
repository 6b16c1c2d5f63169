"""Footsteps from start to goal: a best-first search over single footholds.

A node is a foothold that carries while the other foot moves; an edge is a pair of footholds in which the
body passes from one to the other.  What a step costs is about the time that a person takes for it.  The
estimate of the cost that is left is the length of the shortest way over the ground for a thin column, so that
ways round obstacles, over steps and across gaps are known from the start.

Tests of the foot and the trunk come when a step is about to be taken.  The caller tests whether a pair of
footholds has postures, closes one without with :meth:`FootstepSearch.close`, and asks for the next best way.
"""

import math
from collections.abc import Callable
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from manikin.kinematics.step_reach import StepReach
from manikin.numerics.graph_search import Graph
from manikin.numerics.polytope import rectangles_apart
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.best_first import Refused
from manikin.planning.contacts.footholds import Feet, Foothold, Footholds, heading_between
from manikin.planning.guide.ground import STEP, GroundField
from manikin.scene import Scene

EASY = 3.0**0.25  # way at twice the cost of a short step, over that of the cheapest gait: of a quartic
REACH_MARGIN = 0.02  # distance that steps keep to the end of what the body reaches [m]; our choice
HIGHEST = 0.53  # largest difference in height of two soles, of a body of 1.75 m [m]
HELD_HIGHEST = 0.80  # the same of a body that has something to hold on to or lean on [m]
FACED_HIGHEST = 0.86  # the same of one that faces what is higher, where its hands are [m]
FACED = (0.34, 0.27)  # least way of the lower foot behind the higher one then, most way aside [m]
ON_TOES = 0.04  # way beyond the reach of flat soles then, as the lower foot is on its toes [m]
FLAT = 0.3  # largest difference in height at which both soles lie flat at rest, of a body of 1.75 m [m]
UNREST_COST = 10.0  # cost of a step at which the body cannot rest on either foot, by how much [s/m]
NARROWEST = 0.115  # least distance of the middles of two soles across, of a body of 1.75 m [m]
SOLES_APART = 0.016  # least distance of two soles seen from above: a little more than postures keep [m]
ALONG = (-0.4, -0.25, 0.0, 0.15, 0.28, 0.38, 0.48, 0.58, 0.70)
ACROSS = (0.15, 0.19, 0.26, 0.36, 0.48)
TURNS = (-0.26, 0.0, 0.26, 0.52, 0.87)
"""Steps that are tried from a foot: ahead and to its side [m], and turned outwards [rad]."""
MERGED = 0.06
MERGED_TURN = math.radians(15.0)  # places [m] and headings [rad] this close together count as one foothold
GREED = ((1.8, 300), (2.4, 800), (4.0, 20_000))
"""Factors on the estimate, tried in turn, each with the footholds that may be expanded with it.  They bound
no cost: the estimate counts turns, and may be more than the least cost."""
FAR = 20.0  # estimate of the cost from which on the first factor is left out [s]; our choice
SAME_GREED = 3  # ways after which the search for another one begins with the factor that found the last
ALIKE = 0.08  # distance of footholds up to which a step is much like one that was refused [m]; our choice
SAME_WAY, SAME_TURN, SAME_SLOPE = 0.04, 0.25, 0.1  # up to which steps are as hard [m, rad, 1]; our choice
OVERHANG_COST = 6.0  # cost of a sole that hangs over, by the share of it that does [s]
_KEY_BITS = 42, 21, 16  # where place and heading of a foothold begin in the number of its cell and surface


class _Node(NamedTuple):
    """A foot on a foothold, ``side`` +1 for the left one; ``ends`` where the other one is at its goal."""

    hold: int
    side: int
    ends: bool = False


class FootstepSearch:
    """Search for footsteps of one body in one scene.

    Attributes:
        holds: All footholds, by their numbers; the first four are those of start and goal.
        expanded: Footholds from which steps were tried.
    """

    def __init__(
        self, scene: Scene, footholds: Footholds, start: Feet, goal: Feet, scale: float,
        reach: tuple[StepReach, StepReach], pair_cost: Callable[[Foothold, Foothold], float],
        passes: Callable[[Foothold, Foothold, Foothold], bool],
        column: tuple[float, float, float], stride: float, held: bool,
    ) -> None:  # fmt: skip
        """Prepare a search.

        Args:
            scale: Size of the body relative to one of 1.75 m.
            reach: Places of one foot relative to the other that the body reaches, and those at which it rests
                on either foot.
            pair_cost: Cost of the body between two footholds, left and right [s]; infinite without room.
            passes: Whether foot and body pass from a foothold to another one beside a third that stands.
            column: Radius, lowest and highest end above the ground of what has to be free to pass [m].
            stride: Way between two feet that costs least over the ground, of a body of 1.75 m [m].
            held: Whether there may be something to hold on to.
        """
        self._footholds, self._scale, self._pair_cost = footholds, scale, pair_cost
        self._reach, self._rest = reach
        self._stride, self._highest, self.expanded = stride, FACED_HIGHEST if held else HIGHEST, 0
        self.holds = [*start, *goal]
        self._keys: dict[int, int] = {}
        self._is_free = cache(lambda number: number < 4 or footholds.is_free(self.holds[number]))
        self._passes = cache(lambda *numbers: passes(*(self.holds[number] for number in numbers)))
        self._pairs = dict.fromkeys(((0, 1), (1, 0), (2, 3), (3, 2)), 0.0)  # postures are known at the ends
        self._next: dict[tuple[int, int], list[tuple[_Node, float]]] = {}
        self._closed: set[tuple[int, int]] = set()
        self._refused, self._missing = Refused(ALIKE), Refused(ALIKE)
        self._too_hard: list[FloatArray] = []
        self._offsets = _offsets(scale)
        heights = HIGHEST * scale, HELD_HIGHEST * scale, self._highest * scale
        places = np.array([hold.position for hold in self.holds])
        self._field = GroundField(
            scene, footholds.ground, places, heading_between(*goal), column, stride * scale, heights
        )
        yaws = np.array([hold.yaw for hold in self.holds])
        self._ahead: list[float] = self._field.costs(places, yaws).tolist()
        # With the first factor nearly all footholds about a far way would be expanded before its end.
        self._first_greed, self._ways = int(min(self._ahead[:2]) > FAR), 0

    def close(self, stand: int, step: int) -> int:
        """Close a pair of footholds, which has no posture, and count those much like it that were closed."""
        self._closed.add((stand, step))
        self._missing.places.append(self._at(stand, step))
        return self._missing.alike(self._at(stand, step))

    def refuse(self, stand: int, step: int) -> None:
        """Close all steps that are much like one, with which a later stage failed."""
        self._refused.places.append(self._at(stand, step))

    def _at(self, stand: int, step: int) -> FloatArray:
        return np.array([self.holds[stand].position, self.holds[step].position])

    def refuse_everywhere(self, stand: int, step: int) -> None:
        """Close all steps like one for which the joints are too weak, and longer ones, wherever they are."""
        self._too_hard.append(self._shape(stand, step))

    def _shape(self, stand: int, step: int) -> FloatArray:
        """(8,) way, turn and normals of a step in the heading frame of the foot that stands, of a right foot.

        Each is in units up to which steps are alike.
        """
        first, last = self.holds[stand], self.holds[step]
        frame = rotation_from_yaw(first.yaw)
        way, normals = (last.position - first.position) @ frame, [first.rotation[:, 2], last.rotation[:, 2]]
        turn = math.remainder(last.yaw - first.yaw, 2.0 * math.pi)
        out = 1.0 if way[1] >= 0.0 else -1.0
        slopes = (np.array(normals) @ frame)[:, :2] * [1.0, out] / SAME_SLOPE
        return np.concatenate([way * [1.0, out, 1.0] / SAME_WAY, [out * turn / SAME_TURN], slopes.ravel()])

    def _harder(self, shape: FloatArray) -> bool:
        """Whether a step is like one that is too hard, or goes farther ahead, up or down than it."""
        hard = np.array(self._too_hard)
        beyond = shape - hard
        way = np.sign(hard[:, :3]) * (np.abs(hard[:, :3]) > 1.0) * [1.0, 0.0, 1.0]
        beyond[:, :3] = np.where(way == 0.0, beyond[:, :3], np.minimum(way * beyond[:, :3], 0.0))
        return bool((np.abs(beyond) <= 1.0).all(axis=1).any())

    def best(self) -> list[int] | None:
        """Numbers of the footholds of the best way, from both of the start to both of the goal; None without.

        Consecutive ones are of different feet; the first two and the last two are those of start and goal.
        """
        graph = Graph(
            lambda node: self._ahead[node.hold], self._steps, self._tested,
            lambda node: node.ends and self._at_goal(node),
        )  # fmt: skip
        way, counts = graph.best([_Node(0, 1), _Node(1, -1)], GREED[self._first_greed :])
        self.expanded += sum(counts)
        self._ways += 1
        if self._ways >= SAME_GREED:
            self._first_greed += len(counts) - 1
        # The foot that is not the first to stand is where it is at the start.
        return None if way is None else [1 - way[0].hold, *(node.hold for node in way)]

    def farthest(self) -> tuple[float, Foothold]:
        """Least cost that was left at a foothold which was reached [s], and that foothold."""
        return min(((self._ahead[n], self.holds[n]) for n, _ in self._next), key=lambda item: item[0])

    def walled_off(self) -> str | None:
        """Why no way over the ground leads from the start to the goal; None where one does."""
        return None if min(self._ahead[:2]) < math.inf else self._field.walled_off(self.holds[0].position)

    def climbs(self) -> bool:
        """Whether the easiest way over the ground has a step that feet alone do not make."""
        way = self._field.way(self.holds[0].position)
        return way is not None and bool((np.abs(np.diff(way[:, 2])) > HIGHEST * self._scale).any())

    def _at_goal(self, node: _Node) -> bool:
        return node.hold == (2 if node.side > 0 else 3)

    def _tested(self, before: _Node | None, parent: _Node, node: _Node) -> float:
        """Cost of the body's room at a step; infinite where the foot, its flight or the body has none."""
        pair = parent.hold, node.hold
        hard = bool(self._too_hard) and self._harder(self._shape(*pair))
        if hard or pair in self._closed or self._refused.alike(self._at(*pair)) > 0:
            return math.inf
        if pair not in self._pairs:
            stand, step = self.holds[parent.hold], self.holds[node.hold]
            passes = self._is_free(node.hold) and self._is_made(stand, step, -parent.side)
            self._pairs[pair] = self._pair_cost(*(stand, step)[:: parent.side]) if passes else math.inf
        left, cost = 1 - parent.hold if before is None else before.hold, self._pairs[pair]
        return cost if math.isinf(cost) or self._passes(left, *pair[::-1]) else math.inf

    def _is_made(self, stand: Foothold, step: Foothold, out: int) -> bool:
        """Whether a body makes a step: its place may stand for one close by, for which that is known."""
        place = step.position[None], np.array([step.yaw]), np.array([step.share])
        made = bool(np.isfinite(self._step_costs(stand, out, *place)[0]))
        deep = abs(float(step.position[2] - stand.position[2])) > HELD_HIGHEST * self._scale
        return made and (not deep or self._footholds.faces(stand, step))

    def _steps(self, node: _Node) -> list[tuple[_Node, float]]:
        """The other foot on footholds to which it may go, with the cost of the step alone."""
        key = node.hold, node.side
        if key in self._next:
            return self._next[key]
        stand = self.holds[node.hold]
        out = -node.side  # the other foot is to the right of a left one
        ahead, across, turns = self._offsets
        turn = np.array([math.cos(stand.yaw), math.sin(stand.yaw)])
        side = np.array([-turn[1], turn[0]]) * out
        places = stand.position[:2] + ahead[:, None] * turn + across[:, None] * side
        yaws = stand.yaw + out * turns
        goal = 3 if node.side > 0 else 2
        found = self._footholds.lay(places, yaws, float(stand.position[2]), self._highest * self._scale)
        ends = self.holds[goal]
        costs = self._step_costs(
            stand, out,
            np.vstack([ends.position, found.positions]), np.append(ends.yaw, found.yaws),
            np.append(ends.share, found.shares),
        )  # fmt: skip
        rows = np.flatnonzero(np.isfinite(costs))
        steps: dict[int, float] = {}
        if len(rows) and rows[0] == 0:
            steps[goal] = float(costs[0])
            rows = rows[1:]
        rows -= 1
        at, turned = found.positions[rows, :2] / MERGED, found.yaws[rows] % (2.0 * math.pi) / MERGED_TURN
        cells = np.rint(np.column_stack([at, turned])).astype(np.int64)
        keys = cells @ (1 << np.array(_KEY_BITS)) + found.surfaces[rows]
        fresh: list[int] = []
        for row, label, cost in zip(rows.tolist(), keys.tolist(), costs[1 + rows].tolist(), strict=True):
            number = self._keys.setdefault(label, len(self.holds))
            if number == len(self.holds):
                self.holds.append(self._footholds.hold(found, row))
                fresh.append(row)
            # A place close by stands for the one that was asked for.
            if cost < steps.get(number, math.inf):
                steps[number] = cost
        self._ahead.extend(self._field.costs(found.positions[fresh], found.yaws[fresh]).tolist())
        arrived = self._at_goal(node)
        self._next[key] = followers = [
            (_Node(number, -node.side, arrived), cost) for number, cost in steps.items()
            if self._ahead[number] < math.inf
        ]  # fmt: skip
        return followers

    def _step_costs(
        self, stand: Foothold, out: int, positions: FloatArray, yaws: FloatArray, shares: FloatArray
    ) -> FloatArray:
        """(k,) costs of steps [s]; infinite where no body makes them."""
        away = positions - stand.position
        c, s = math.cos(stand.yaw), math.sin(stand.yaw)
        ahead, aside = c * away[:, 0] + s * away[:, 1], out * (c * away[:, 1] - s * away[:, 0])
        turned = out * (np.mod(yaws - stand.yaw + math.pi, 2.0 * math.pi) - math.pi)
        rise, size = np.abs(away[:, 2]), self._scale
        way = np.hypot(ahead, np.maximum(0.0, aside - 0.19 * size))
        apart = np.column_stack([ahead, out * aside, away[:, 2], out * turned])
        foot = "left_foot" if out > 0 else "right_foot"
        deep = rise > HELD_HIGHEST * size
        made = self._reach.room(apart, foot) >= np.where(deep, -ON_TOES * size, REACH_MARGIN)
        faced = (ahead * np.sign(away[:, 2]) >= FACED[0] * size) & (aside <= FACED[1] * size)
        made &= np.where(deep, faced, ahead >= -FACED[0] * size)
        made &= (rise <= self._highest * size) & (turned >= -0.8) & (turned <= 1.1)
        made &= aside >= NARROWEST * size
        made &= rectangles_apart(ahead, aside, turned, self._footholds.size) >= SOLES_APART
        cost = STEP * (1.0 + (way / (EASY * self._stride * size)) ** 4)
        steep = 8.0 * np.maximum(0.0, rise - 0.2 * size)
        cost += 1.2 * rise + steep + 0.25 * np.abs(turned) + OVERHANG_COST * (1.0 - shares)
        cost += 0.6 * np.maximum(0.0, -ahead) + 0.8 * np.maximum(0.0, aside - 0.26 * size)
        cost += 1.5 * np.maximum(0.0, 0.15 * size - aside) + np.maximum(0.0, -0.3 - turned)
        flat = made & (rise < FLAT * size)
        cost[flat] += UNREST_COST * np.maximum(0.0, -self._rest.room(apart[flat], foot))
        return np.where(made, cost, np.inf)


def _offsets(scale: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(k,) ways ahead and across [m] and turns [rad] of steps; the farther one goes, the less one turns."""
    rows = [
        (ahead, across, turn) for ahead, across, turn in product(ALONG, ACROSS, TURNS)
        if (abs(turn) < 0.3 or ahead <= 0.3) and (across < 0.3 or (abs(ahead) <= 0.15 and abs(turn) < 0.3))
        and (across > 0.16 or turn >= 0.0) and (ahead >= 0.0 or abs(turn) < 0.3)
    ]  # fmt: skip
    ahead, across, turns = np.array(rows).T
    return scale * ahead, scale * across, turns
