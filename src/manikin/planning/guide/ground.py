"""Guides over the ground: ways for a thin column in place of the body, and what is left of them.

The cells of the ground are those on which the column stands; ways lead from cell to cell, up and down steps
and over gaps.  Searches for contacts follow them where a body goes on its feet, or on hands and knees.
"""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from manikin.numerics.spatial import FloatArray
from manikin.scene import Scene
from manikin.scene.collision import column_is_free
from manikin.scene.footing import FootingTable

STEP = 0.7  # time of a short step [s]; our choice, as the next ones
HELD_COST = 4.0 * STEP  # cost of a step that is too high for feet alone: hands come and go [s]
CELL = 0.1  # width of the cells of the ground [m]
GAP = 0.85  # longest way between cells over no ground [m]
WIDEST = 3.0  # widest gap that is told as the reason why no way leads to the goal [m]
BETWEEN = np.array([0.2, 0.4, 0.6, 0.8])  # shares of such a way at which nothing may stand in it
COVERED = 0.45  # height of what is above a place on which a foot can stand, below which none does [m]
TURN_COST = 0.9  # cost of a turn [s/rad]: two steps turn a body by a right angle
TURN_WAY = 0.6  # way on which going backwards costs as much as a turn by two radians [m]
LOOK = 5  # cells of the way that tell where it leads
LOW_STEP = 0.05  # distance of places on a way for one who crawls [m]
LOW_RISE = 0.2  # largest difference in height of its cells [m]
ON_PLANE = 0.02  # difference in height up to which a place is on a surface [m]
_POINT = 1e-6 * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


class Ground:
    """Heights of the surfaces of a scene on which a foot could stand."""

    def __init__(self, scene: Scene, steepest: float) -> None:
        """Prepare a scene; surfaces slope by an angle at most [rad]."""
        self.surfaces = scene.surfaces_facing((0.0, 0.0, 1.0), steepest)
        self._table = FootingTable(self.surfaces, _POINT)

    def levels(self, places: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
        """Rows (m,) of places (k, 2) [m] that have a surface below or above, and its height there [m]."""
        put = self._table.under(places, np.zeros(len(places)))
        on = self._table.place(put.numbers, put.positions, put.rotations).share > 0.5
        return put.rows[on], put.positions[on, 2]

    def below(self, place: FloatArray) -> tuple[str, ...]:
        """Names of the obstacles whose surface is at a place (3,) [m]; none without a surface."""
        level = float(place[2])
        put = self._table.under(place[None, :2], np.zeros(1), level - ON_PLANE, level + ON_PLANE)
        on = self._table.place(put.numbers, put.positions, put.rotations).share > 0.5
        return self.surfaces[int(put.numbers[on][0])].obstacles if on.any() else ()


class GroundField:
    """Cost to the goal over cells of the ground, for a thin column in place of the body."""

    def __init__(
        self, scene: Scene, ground: Ground, ends: FloatArray, heading: float,
        column: tuple[float, float, float], stride: float, highest: tuple[float, float, float],
        gap: float = GAP,
    ) -> None:  # fmt: skip
        """Compute the costs.

        Args:
            ends: (4, 3) places of two feet at the start, then at the goal [m].
            heading: Of the goal [rad].
            column: Radius, lowest and highest end above the ground of what has to be free [m].
            stride: Way between two feet that costs least over level ground [m].
            highest: Steps that the body makes on its feet alone, without facing what is higher, and at all
                [m].
            gap: Longest way between cells over no ground; none when zero [m].
        """
        easy, faced_from, self._highest = highest
        room = 1.5 + 0.25 * float(np.linalg.norm(ends[0] - ends[2]))
        low, high = ends[:, :2].min(axis=0) - room, ends[:, :2].max(axis=0) + room
        counts = np.ceil((high - low) / CELL).astype(int) + 1
        axes = [low[axis] + CELL * np.arange(counts[axis]) for axis in range(2)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        rows, height = ground.levels(grid)
        # What lies close under something else on which a foot can stand is not reached.
        order = np.lexsort((height, rows))
        rows, height = rows[order], height[order]
        covered = np.zeros(len(rows), dtype=bool)
        covered[:-1] = (rows[1:] == rows[:-1]) & (np.diff(height) < COVERED)
        points = np.column_stack([grid[rows], height])[~covered]
        self._points = points = points[column_is_free(scene, points, column)]
        self._column_is_free = lambda places: column_is_free(scene, places, column)
        self._names = ground.below
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
        middle = ends[2:].mean(axis=0)
        self._root = int(self._tree.query(middle)[1])
        self._cost, before = dijkstra(graph, directed=False, indices=self._root, return_predecessors=True)
        self._before, self._yaw = before, heading
        # Where the way leads from each cell, and how far it is.
        onward = ahead = np.where(before >= 0, before, np.arange(size))
        for _ in range(LOOK - 1):
            ahead = onward[ahead]
        way = points[ahead, :2] - points[:, :2]
        self._heading = np.arctan2(way[:, 1], way[:, 0])
        # The next place on it where a body goes so far down that it faces where it comes from; or the end.
        down = points[:, 2] - points[onward, 2] > faced_from
        faced = np.where(down, np.arange(size), onward)
        while (faced != faced[faced]).any():
            faced = faced[faced]
        self._then = np.where(down[faced], self._heading[faced] + math.pi, self._yaw)
        stops = np.where(down[faced, None], points[faced, :2], middle[:2])
        self._way = np.linalg.norm(points[:, :2] - stops, axis=1)

    def _is_open(self, pairs: NDArray[np.int64], shares: FloatArray = BETWEEN) -> NDArray[np.bool_]:
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
    scene: Scene, ground: Ground, ends: FloatArray, low: tuple[float, float, float],
    high: tuple[float, float, float],
) -> tuple[FloatArray, NDArray[np.bool_]] | None:  # fmt: skip
    """Way over the ground for a body that crawls, straight where it can be.

    Args:
        ends: (4, 3) places of two feet at the start, then at the goal [m].
        low: Radius, lowest and highest end of what has to be free to crawl [m].
        high: The same to walk.

    Returns:
        (n, 3) places on the ground, :data:`LOW_STEP` apart [m], and whether (n,) the body can walk there;
        None where no way leads to the goal.
    """
    start, goal = ends.reshape(2, 2, 3).mean(axis=1)
    rises = LOW_RISE, LOW_RISE, LOW_RISE
    cells = GroundField(scene, ground, ends, 0.0, low, 1.0, rises, gap=0.0).way(start)
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
