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
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from manikin.kinematics.step_reach import StepReach
from manikin.numerics.graph_search import Graph
from manikin.numerics.polytope import rectangles_apart
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.contacts.best_first import Refused
from manikin.planning.contacts.footholds import Feet, Foothold, Footholds
from manikin.scene import Scene
from manikin.scene.collision import column_is_free

STEP = 0.7  # time of a short step [s]; our choice, as the next ones
EASY = 3.0**0.25  # way at twice the cost of a short step, over that of the cheapest gait: of a quartic
REACH_MARGIN = 0.02  # distance that steps keep to the end of what the body reaches [m]; our choice
HIGHEST = 0.53  # largest difference in height of two soles, of a body of 1.75 m [m]
HELD_HIGHEST = 0.80  # the same of a body that has something to hold on to or lean on [m]
FACED_HIGHEST = 0.86  # the same of one that faces what is higher, where its hands are [m]
FACED = (0.34, 0.27)  # least way of the lower foot behind the higher one then, most way aside [m]
ON_TOES = 0.04  # way beyond the reach of flat soles then, as the lower foot is on its toes [m]
HELD_COST = 4.0 * STEP  # cost of a step that is higher than HIGHEST: hands come and go [s]
FLAT = 0.3  # largest difference in height at which both soles lie flat at rest, of a body of 1.75 m [m]
UNREST_COST = 10.0  # cost of a step at which the body cannot rest on either foot, by how much [s/m]
NARROWEST = 0.115  # least distance of the middles of two soles across, of a body of 1.75 m [m]
SOLES_APART = 0.016  # least distance of two soles seen from above: a little more than postures keep [m]
ALONG = (-0.4, -0.25, 0.0, 0.15, 0.28, 0.38, 0.48, 0.58, 0.70)
ACROSS = (0.15, 0.19, 0.26, 0.36, 0.48)
TURNS = (-0.26, 0.0, 0.26, 0.52, 0.87)
"""Steps that are tried from a foot: ahead and to its side [m], and turned outwards [rad]."""
CELL = 0.1  # width of the cells of the ground on which the estimate is computed [m]
GAP = 0.85  # longest way between cells over no ground that the estimate takes [m]
MERGED = 0.06
MERGED_TURN = math.radians(15.0)  # places [m] and headings [rad] this close together count as one foothold
LOW_STEP = 0.05  # distance of places on a way for one who crawls [m]
LOW_RISE = 0.2  # largest difference in height of its cells [m]
WIDEST = 3.0  # widest gap that is told as the reason why no way leads to the goal [m]
BETWEEN = np.array([0.2, 0.4, 0.6, 0.8])  # shares of such a way at which nothing may stand in it
GREED = ((1.8, 300), (2.4, 800), (4.0, 20_000))
"""Factors on the estimate, tried in turn, each with the footholds that may be expanded with it.  They bound
no cost: the estimate counts turns, and may be more than the least cost."""
FAR = 20.0  # estimate of the cost from which on the first factor is left out [s]; our choice
SAME_GREED = 3  # ways after which the search for another one begins with the factor that found the last
ALIKE = 0.08  # distance of footholds up to which a step is much like one that was refused [m]; our choice
SAME_WAY, SAME_TURN, SAME_SLOPE = 0.04, 0.25, 0.1  # up to which steps are as hard [m, rad, 1]; our choice
OVERHANG_COST = 6.0  # cost of a sole that hangs over, by the share of it that does [s]
TURN_COST = 0.9  # cost of a turn [s/rad]: two steps turn a body by a right angle
TURN_WAY = 0.6  # way on which going backwards costs as much as a turn by two radians [m]
LOOK = 5  # cells of the way that tell where it leads
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
        heights = HIGHEST * scale, self._highest * scale
        self._field = _Field(scene, footholds, start, goal, column, stride * scale, heights)
        places = np.array([hold.position for hold in self.holds])
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


class _Field:
    """Cost to the goal over cells of the ground, for a thin column in place of the body."""

    def __init__(
        self, scene: Scene, footholds: Footholds, start: Feet, goal: Feet,
        column: tuple[float, float, float], stride: float, highest: tuple[float, float], gap: float = GAP,
    ) -> None:  # fmt: skip
        easy, self._highest = highest
        ends = np.array([hold.position for hold in (*start, *goal)])
        room = 1.5 + 0.25 * float(np.linalg.norm(ends[0] - ends[2]))
        low, high = ends[:, :2].min(axis=0) - room, ends[:, :2].max(axis=0) + room
        counts = np.ceil((high - low) / CELL).astype(int) + 1
        axes = [low[axis] + CELL * np.arange(counts[axis]) for axis in range(2)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        rows, height = footholds.levels(grid)
        # What lies close under something else on which a foot can stand is not reached.
        order = np.lexsort((height, rows))
        rows, height = rows[order], height[order]
        covered = np.zeros(len(rows), dtype=bool)
        covered[:-1] = (rows[1:] == rows[:-1]) & (np.diff(height) < 0.45)
        points = np.column_stack([grid[rows], height])[~covered]
        self._points = points = points[column_is_free(scene, points, column)]
        self._column_is_free = lambda places: column_is_free(scene, places, column)
        self._names = footholds.below
        slow, size = np.ones(len(points)), len(points)
        for share, more in ((1.35, 0.8), (1.8, 0.5)):
            slow[~column_is_free(scene, points, (*column[:2], share * column[2]))] += more
        self._tree = cKDTree(points)
        near = cKDTree(points[:, :2]).query_pairs(1.6 * CELL, output_type="ndarray")
        # Over gaps: cells at the edge of the ground, and of what is far above it, reach farther.
        beside = np.abs(points[near[:, 0], 2] - points[near[:, 1], 2]) <= easy
        edge = np.flatnonzero(np.bincount(near[beside].ravel(), minlength=size) < 8)
        if len(edge) and gap:
            far = edge[cKDTree(points[edge, :2]).query_pairs(gap, output_type="ndarray")]
            near = np.vstack([near, far[self._is_open(far)]])
        self._near, away = near, points[near[:, 0]] - points[near[:, 1]]
        self._rise = rise = np.abs(away[:, 2])
        self._pace = pace = STEP * (1.0 + 1.0 / 3.0) / stride
        slower = 0.5 * (slow[near[:, 0]] + slow[near[:, 1]])
        length = pace * slower * np.linalg.norm(away[:, :2], axis=1) + 1.2 * rise
        length += np.where(rise > easy, 8.0 * (rise - 0.2) + HELD_COST, 0.0)
        passable = rise <= self._highest
        near, length = near[passable], length[passable]
        graph = csr_array((length + 1e-9, (near[:, 0], near[:, 1])), shape=(size, size))
        middle = 0.5 * (goal[0].position + goal[1].position)
        self._root = int(self._tree.query(middle)[1])
        self._cost, before = dijkstra(graph, directed=False, indices=self._root, return_predecessors=True)
        self._before, (first, last) = before, (hold.yaw for hold in goal)
        self._yaw = math.atan2(math.sin(first) + math.sin(last), math.cos(first) + math.cos(last))
        # Where the way leads from each cell, and how far it is.
        onward = ahead = np.where(before >= 0, before, np.arange(size))
        for _ in range(LOOK - 1):
            ahead = onward[ahead]
        way = points[ahead, :2] - points[:, :2]
        self._heading = np.arctan2(way[:, 1], way[:, 0])
        # The next place on it where a body goes so far down that it faces where it comes from; or the end.
        down = points[:, 2] - points[onward, 2] > HELD_HIGHEST / HIGHEST * easy
        faced = np.where(down, np.arange(size), onward)
        while (faced != faced[faced]).any():
            faced = faced[faced]
        self._then = np.where(down[faced], self._heading[faced] + math.pi, self._yaw)
        ends = np.where(down[faced, None], points[faced, :2], middle[:2])
        self._way = np.linalg.norm(points[:, :2] - ends, axis=1)

    def _is_open(self, pairs: np.ndarray, shares: FloatArray = BETWEEN) -> np.ndarray:
        """(k,) whether the column passes between pairs (k, 2) of cells over what has no ground."""
        ends = self._points[pairs]
        ends[..., 2] = ends[..., 2].max(axis=1, keepdims=True)
        between = ends[:, :1] + shares[:, None] * (ends[:, 1:] - ends[:, :1])
        free = self._column_is_free(between.reshape(-1, 3))
        return np.asarray(free.reshape(len(pairs), len(shares)).all(axis=1))

    def way(self, place: FloatArray) -> FloatArray | None:
        """(n, 3) cells from a place (3,) to the goal [m]; None where none lead there."""
        row = int(self._tree.query(place)[1])
        if not math.isfinite(self._cost[row]):
            return None
        rows = [row]
        while self._before[rows[-1]] >= 0:
            rows.append(int(self._before[rows[-1]]))
        return self._points[rows]

    def walled_off(self, place: FloatArray) -> str:
        """Why no way leads from a place (3,) to the goal: a gap, a step that is too high, or no room."""
        row = int(self._tree.query(place)[1])
        gap = self._widest_gap(row)
        if gap is not None:
            most = f"feet make at most {GAP - CELL:.2f} m"
            return f"every way over the ground has a gap of about {gap:.1f} m; {most}"
        size = len(self._points)
        graph = csr_array((self._rise + 1e-6, (self._near[:, 0], self._near[:, 1])), shape=(size, size))
        way = minimum_spanning_tree(graph)
        costs, before = dijkstra(way, directed=False, indices=self._root, return_predecessors=True)
        if not math.isfinite(costs[row]):
            return "no way over the ground has room for the body"
        # The way with the lowest highest step is in a minimum spanning tree.
        highest, onto = 0.0, row
        while before[row] >= 0:
            pair = row, int(before[row])
            rise = abs(float(self._points[pair[0], 2] - self._points[pair[1], 2]))
            if rise > highest:
                highest, onto = rise, max(pair, key=lambda cell: float(self._points[cell, 2]))
            row = pair[1]
        names = ", ".join(self._names(self._points[onto]))
        step = f"a step of {highest:.2f} m" + (f" ({names})" if names else "")
        return f"every way with room for the body has {step}; feet make at most {self._highest:.2f} m"

    def _widest_gap(self, row: int) -> float | None:
        """Widest gap of the way from a cell to the goal whose gaps are narrowest [m].

        None where gaps up to :data:`WIDEST` do not join them: something stands between them.
        """
        size, (one, other) = len(self._points), self._near[self._rise <= self._highest].T
        parts = connected_components(csr_array((np.ones(len(one)), (one, other)), shape=(size, size)))[1]
        joined, widest = parts == parts[self._root], 0.0
        while not joined[row]:
            inside, outside = np.flatnonzero(joined), np.flatnonzero(~joined)
            tree = cKDTree(self._points[inside])
            width, near = tree.query(self._points[outside], distance_upper_bound=WIDEST)
            found = np.flatnonzero(np.isfinite(width))
            pairs = np.column_stack([inside[near[found]], outside[found]])
            rise = np.abs(np.diff(self._points[pairs, 2], axis=1)[:, 0])
            passes = rise <= self._highest
            passes[passes] = self._is_open(pairs[passes], np.linspace(0.0, 1.0, math.ceil(WIDEST / CELL)))
            if not passes.any():
                return None
            best = found[passes][np.argmin(width[found[passes]])]
            joined, widest = joined | (parts == parts[outside[best]]), max(widest, float(width[best]) - CELL)
        return widest

    def costs(self, places: FloatArray, yaws: FloatArray) -> FloatArray:
        """(k,) estimates of the costs from places (k, 3) [m] with headings (k,) [rad] to the goal [s]."""
        if not len(places):
            return np.zeros(0)
        gap, rows = self._tree.query(places, k=4)
        costs = self._cost[rows] + self._pace * gap
        pick = np.arange(len(places)), np.argmin(costs, axis=1)
        row = rows[pick]
        here, there, then = np.asarray(yaws), self._heading[row], self._then[row]
        # To turn to where the way leads and back, or to go as one stands: aside or backwards is slower.
        straight = _angle(here - there) + _angle(there - then)
        across = _angle(here - then) + self._way[row] / TURN_WAY * (1.0 - np.cos(here - there))
        return costs[pick] + TURN_COST * (np.minimum(straight, across) + _angle(then - self._yaw))


def low_way(
    scene: Scene, footholds: Footholds, ends: tuple[Feet, Feet], low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[FloatArray, np.ndarray] | None:  # fmt: skip
    """Way over the ground for a body that crawls, straight where it can be.

    Args:
        ends: Left and right foothold at start and goal.
        low: Radius, lowest and highest end of what has to be free to crawl [m].
        high: The same to walk.

    Returns:
        (n, 3) places on the ground, :data:`LOW_STEP` apart [m], and whether (n,) the body can walk there;
        None where no way leads to the goal.
    """
    field_ = _Field(scene, footholds, *ends, low, 1.0, (LOW_RISE, LOW_RISE), gap=0.0)
    start, goal = (0.5 * (left.position + right.position) for left, right in ends)
    cells = field_.way(start)
    if cells is None:
        return None
    corners, rest = [start], [*cells, goal]
    while rest:
        ways = [_between(corners[-1], end) for end in rest]
        far = next((k for k in range(len(rest) - 1, 0, -1) if column_is_free(scene, ways[k], low).all()), 0)
        corners.append(rest[far])
        rest = rest[far + 1 :]
    places = np.vstack([start[None], *(_between(*pair)[1:] for pair in pairwise(corners))])
    return places, column_is_free(scene, places, high)


def _between(first: FloatArray, last: FloatArray) -> FloatArray:
    """(n, 3) places on a straight way, :data:`LOW_STEP` apart at most."""
    count = 1 + math.ceil(float(np.linalg.norm(last - first)) / LOW_STEP)
    return first + np.linspace(0.0, 1.0, max(count, 2))[:, None] * (last - first)


def _angle(difference: FloatArray) -> FloatArray:
    """Size of angles [rad], at most half a turn."""
    return np.abs(np.mod(difference + math.pi, 2.0 * math.pi) - math.pi)
