"""What of a placed sole lies on a surface: its contact polygon and the share of its area.

A sole may hang over an edge. It then touches with the convex hull of what of it lies on the surface, and can
stand there if that is enough of it and holds the middle of the pressure.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.polygon import orient

from manikin.contact.contact import MOST_CORNERS
from manikin.numerics.polytope import convex_polygon, fewer_corners, polygon_area, walls
from manikin.numerics.spatial import FloatArray, cross
from manikin.scene.surface import Surface, walls_of
from manikin.scene.triangles import IntArray

LEAST_SHARE = 0.6
"""Least share of a sole's area that has to lie on its surface."""
WHOLE = 1.0 - 1e-6
"""Share from which on a sole lies on its surface with all of it."""

_INWARDS, _FLAT, _FAR = 1e-3, 1e-9, 10.0
"""Share of a sole's area by which its hull spans more than lies on the surface; turns that count as none
[m^2]; more than any sole is long [m]."""

_Clipped = tuple[NDArray[np.bool_], FloatArray, FloatArray]
"""Of each edge whether a part is inside a sole (p,), and where that begins and ends (p, 2) [m]."""


@dataclass(frozen=True, eq=False)
class Footing:
    """How placed soles lie on surfaces, one row per place.

    Attributes:
        share: (n,) of the area of each sole that lies on its surface.
        stands: (n,) whether the share is at least :data:`LEAST_SHARE` and the middle of the pressure is
            inside the contact polygon.
        footprint: (c, 2) the whole sole in the effector's frame [m].
    """

    share: FloatArray
    stands: NDArray[np.bool_]
    footprint: FloatArray
    _rows: IntArray  # (p,) row of each point, increasing
    _points: FloatArray  # (p, 2) what spans the polygons of soles that hang over, in the effector's frame

    def polygon(self, row: int) -> FloatArray:
        """(k, 2) contact polygon in the effector's frame [m], counter-clockwise, 3 to 8.

        The footprint itself, in its own order, where all of it lies on the surface; no corners where nothing.
        """
        if self.share[row] >= WHOLE:
            return self.footprint
        first, stop = np.searchsorted(self._rows, (row, row + 1))
        hull = convex_polygon(self._points[first:stop])
        return fewer_corners(hull, MOST_CORNERS) if len(hull) >= 3 else np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class Places:
    """Soles put onto surfaces, one row per place on the ground and surface below or above it.

    Attributes:
        rows: (k,) index of the place on the ground.
        numbers: (k,) index of the surface.
        positions: (k, 3) middle of the sole in the plane of the surface [m].
        rotations: (k, 3, 3) effector-to-world rotation, z along the normal, heading as asked for.
    """

    rows: IntArray
    numbers: IntArray
    positions: FloatArray
    rotations: FloatArray

    def __getitem__(self, chosen: IntArray | NDArray[np.bool_]) -> "Places":
        """Some of them, by index or mask."""
        return Places(self.rows[chosen], self.numbers[chosen], self.positions[chosen], self.rotations[chosen])


class FootingTable:
    """The surfaces of a scene, prepared for soles of one shape that are placed on them by the thousand.

    :meth:`under` gives all places of soles on the surfaces below or above points of the ground,
    :meth:`place` how they lie there. A thousand places take about 5 ms, half of them over an edge.

    The middle of the pressure is the point of the sole below the effector frame's origin, which is the middle
    of a sole: not the ankle, which is behind what carries a foot that has only its front on a tread.

    Args:
        footprint: (c, 2 or 3) corners of the convex sole in the effector's frame [m], in either sense;
            its origin is strictly inside.
    """

    def __init__(self, surfaces: Sequence[Surface], footprint: ArrayLike) -> None:
        self.surfaces = tuple(surfaces)
        self.footprint = np.asarray(footprint, dtype=np.float64)[:, :2]
        rings = [one for face in surfaces for one in ((face.polygon, 1.0), *((r, -1.0) for r in face.holes))]
        # Rings along two axes in the plane of their surface.
        self._axes = np.array([item.rotation[:, :2] for item in surfaces]).reshape(-1, 3, 2)
        owner = np.repeat(np.arange(len(surfaces)), [1 + len(item.holes) for item in surfaces])
        flat = [ring @ self._axes[number] for (ring, _), number in zip(rings, owner, strict=True)]
        self._start = np.concatenate([np.zeros((0, 2)), *flat])
        self._end = np.concatenate([np.zeros((0, 2)), *(np.roll(ring, -1, axis=0) for ring in flat)])
        self._edges_of_ring = _Ranges([len(ring) for ring, _ in rings])
        self._rings_of_surface = _Ranges([1 + len(item.holes) for item in surfaces])
        self._sign = np.array([sign for _, sign in rings])  # of the area inside a ring: holes are taken away
        middles = [0.5 * (ring.min(axis=0) + ring.max(axis=0)) for ring, _ in rings]
        self._middle = np.array(middles).reshape(-1, 3)
        around = zip(rings, middles, strict=True)
        self._reach = np.array([np.linalg.norm(ring - at, axis=1).max() for (ring, _), at in around])
        self._sole = _Sole(self.footprint)
        self._normals = np.array([item.normal for item in surfaces]).reshape(-1, 3)
        self._offsets = np.array([item.normal @ item.polygon[0] for item in surfaces])
        self._low = np.array([item.polygon[:, :2].min(axis=0) for item in surfaces]).reshape(-1, 2)
        self._high = np.array([item.polygon[:, :2].max(axis=0) for item in surfaces]).reshape(-1, 2)
        self._faces_up = self._normals[:, 2] > 0.1
        self._convex, self._walls, self._wall_offsets = walls_of(surfaces)
        walled = [item.walls for item in surfaces]
        self._rectangle = np.array([
            item is not None and len(item[0]) == 4 and abs(item[0][0] @ item[0][1]) < 1e-9
            and abs(item[0][1] @ item[0][2]) < 1e-9 and abs(item[0][2] @ item[0][3]) < 1e-9 for item in walled
        ], dtype=bool)  # fmt: skip

    def place(self, numbers: ArrayLike, positions: FloatArray, rotations: FloatArray) -> Footing:
        """Lay soles on surfaces.

        Args:
            numbers: (n,) index of the surface under each sole.
            positions: (n, 3) origin of each effector's frame in the world [m], as if moved into the plane of
                its surface along the normal.
            rotations: (n, 3, 3) effector-to-world rotations, z along the normal of the surface.
        """
        on = np.asarray(numbers, dtype=np.int64)
        count, sole = len(on), self._sole
        # Pairs of a sole and a ring of its surface; one farther away than both are large does not matter.
        rows, rings = self._rings_of_surface.expand(on)
        away = np.linalg.norm(positions[rows] - self._middle[rings], axis=1)
        known = away < self._reach[rings] + sole.radius
        rows, rings = rows[known], rings[known]
        pair, edges = self._edges_of_ring.expand(rings)
        axes = self._axes[on]
        origin = np.einsum("nij,ni->nj", axes, positions)[rows[pair]]
        start, end = self._start[edges] - origin, self._end[edges] - origin
        near = _any(pair, _distance(start, end) < sole.radius, len(rows))
        # A ring that no edge of comes near a sole has all of it inside or nothing, as its middle.
        around = _crossings(pair, start, end, len(rows)) % 2 == 1
        covered = np.bincount(rows, self._sign[rings] * around, count)
        share, stands = (covered > 0.5).astype(np.float64), covered > 0.5
        hanging = np.flatnonzero(_any(rows, near, count))
        if not len(hanging):
            return Footing(share, stands, self.footprint, np.zeros(0, dtype=np.int64), np.zeros((0, 2)))
        whole = around & ~near
        base = np.bincount(rows, self._sign[rings] * whole, count)
        mine = near[pair]
        of = rows[pair[mine]]
        turn = (axes.transpose(0, 2, 1) @ rotations[..., :2])[of]
        start, end = (np.einsum("pi,pij->pj", ends[mine], turn) for ends in (start, end))
        clipped = sole.clip(start, end)
        area = sole.area * base + np.bincount(of, sole.fan(start, end, clipped), count)
        share[hanging] = np.clip(area[hanging] / sole.area, 0.0, 1.0)
        parity = np.bincount(rows, whole, count).astype(np.int64)
        own = np.stack([
            (_crossings(of, start - corner, end - corner, count) + parity)[hanging] % 2 == 1
            for corner in self.footprint
        ], axis=1)  # fmt: skip
        spanning = self._spanning(of, clipped, own, hanging)
        stands[hanging] = (share[hanging] >= LEAST_SHARE) & _around_origin(*spanning, hanging)
        return Footing(share, stands, self.footprint, *spanning)

    def polygon(self, number: int, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """(k, 2) contact polygon of one sole in the effector's frame [m].

        That of its :class:`Footing`, but on a surface with a corner inwards, as of a plank that ends on a
        wide block. The hull spans what is beside that as well, which is wrong of parts of the sole, such as
        toes: a large convex piece of what lies on the surface takes its place, if the sole stands with that.
        """
        footing = self.place([number], position[None], rotation[None])
        hull, on = footing.polygon(0), float(footing.share[0]) * self._sole.area
        if not footing.stands[0] or on >= polygon_area(hull) - _INWARDS * self._sole.area:
            return hull
        surface = self.surfaces[number]
        rings = [(ring - position) @ rotation[:, :2] for ring in (surface.polygon, *surface.holes)]
        region = shapely.make_valid(shapely.Polygon(rings[0], rings[1:])) & shapely.Polygon(self.footprint)
        piece = _convex_piece(region)
        whole = piece.area >= LEAST_SHARE * self._sole.area and piece.contains(shapely.Point(0.0, 0.0))
        return fewer_corners(convex_polygon(shapely.get_coordinates(piece)), MOST_CORNERS) if whole else hull

    def standing(self, places: Places) -> FloatArray:
        """(k,) share of its area of each sole that stands, 0 of others: :meth:`place` without polygons."""
        room = self._room(places)
        share, known = self._cut(places, room, room.min(axis=1) <= 0.0, LEAST_SHARE)
        share[known & (share < LEAST_SHARE)] = 0.0
        rest = np.flatnonzero(~known)
        if len(rest):
            found = self.place(places.numbers[rest], places.positions[rest], places.rotations[rest])
            share[rest] = np.where(found.stands, found.share, 0.0)
        return share

    def meets(self, places: Places, least: float = 1e-6) -> NDArray[np.bool_]:
        """(k,) whether more than a share of each sole's area is on its surface."""
        room = self._room(places)
        share, known = self._cut(places, room, room.min(axis=1) <= -self._sole.radius, least)
        rest = np.flatnonzero(~known)
        if len(rest):
            share[rest] = self.place(
                places.numbers[rest], places.positions[rest], places.rotations[rest]
            ).share
        return share > least

    def near(self, places: Places, distance: float) -> NDArray[np.bool_]:
        """(k,) whether the middle of each sole may be on its surface, or within a distance of it [m]."""
        return self._room(places).min(axis=1) > -distance

    def _room(self, places: Places) -> FloatArray:
        """(k, e) distance inside each edge of a convex surface [m], endless for what has fewer or is none."""
        along = np.einsum("kei,ki->ke", self._walls[places.numbers], places.positions)
        return self._wall_offsets[places.numbers] - along

    def _cut(
        self, places: Places, room: FloatArray, off: NDArray[np.bool_], least: float
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Shares (k,) of soles on convex surfaces, and which are known: cut by one edge, or by a rectangle's.

        Those that are ``off``, or have less than ``least`` after one of several cuts, are known to have none.
        """
        on, sole = places.numbers, self._sole
        known = self._convex[on]
        row, wall = ((room < sole.radius) & (known & ~off)[:, None]).nonzero()
        flat = np.einsum("pi,pij->pj", self._walls[on[row], wall], places.rotations[row, :, :2])
        cuts, outward = np.zeros(room.shape), np.zeros((*room.shape, 2))
        cuts[row, wall] = sole.beyond(flat[:, None], room[row, wall, None])
        outward[row, wall] = flat
        several = np.count_nonzero(cuts, axis=1) > 1
        off |= several & (1.0 - cuts.max(axis=1) < least)
        share, cornered = 1.0 - cuts.sum(axis=1), self._rectangle[on]
        # What is beyond two edges of a rectangle is cut off once, not twice.
        some = np.flatnonzero(several & cornered & ~off)
        if len(some):
            row, wall = ((cuts[some, :4] > 0.0) & (cuts[some][:, [1, 2, 3, 0]] > 0.0)).nonzero()
            pair = some[row, None], np.column_stack([wall, (wall + 1) % 4])
            share += np.bincount(some[row], sole.beyond(outward[pair], room[pair]), len(on))
        return np.where(off, 0.0, np.clip(share, 0.0, 1.0)), known & (~several | cornered | off)

    def under(
        self, xy: FloatArray, yaw: FloatArray, low: ArrayLike = -np.inf, high: ArrayLike = np.inf
    ) -> Places:
        """Soles at places (n, 2) [m] with headings (n,) [rad], on every surface that they may meet.

        Surfaces steeper than 84 degrees have no soles; one at the very edge of a surface may have a share of
        0. Rows are ordered by place, then by surface; heights are from ``low`` to ``high``, (n,) or one [m].
        """
        radius = self._sole.radius
        first, last = (xy.min(axis=0), xy.max(axis=0)) if len(xy) else (np.zeros(2), np.zeros(2))
        beside = (self._low <= last + radius) & (self._high >= first - radius)
        near = (self._faces_up & beside[:, 0] & beside[:, 1]).nonzero()[0]
        within = np.ones((len(xy), len(near)), dtype=bool)
        for axis in range(2):
            along = xy[:, axis, None]
            within &= (along >= self._low[near, axis] - radius) & (along <= self._high[near, axis] + radius)
        rows, column = within.nonzero()
        numbers = near[column]
        normals = self._normals[numbers]
        height = (self._offsets[numbers] - np.einsum("ki,ki->k", normals[:, :2], xy[rows])) / normals[:, 2]
        lowest, highest = (np.broadcast_to(limit, len(xy))[rows] for limit in (low, high))
        level = np.flatnonzero((height >= lowest) & (height <= highest))
        rows, numbers, normals, height = rows[level], numbers[level], normals[level], height[level]
        across = np.column_stack([-np.sin(yaw), np.cos(yaw), np.zeros(len(yaw))])[rows]
        forward = cross(across, normals)
        forward /= np.linalg.norm(forward, axis=1, keepdims=True)
        rotations = np.stack([forward, cross(normals, forward), normals], axis=2)
        return Places(rows, numbers, np.column_stack([xy[rows], height]), rotations)

    def _spanning(
        self, of: IntArray, clipped: _Clipped, own: NDArray[np.bool_], hanging: IntArray
    ) -> tuple[IntArray, FloatArray]:
        """Points that span the contact polygons: corners on the surface, and ends of edges in the sole."""
        (inside, first, last), (row, corner) = clipped, own.nonzero()
        crossing = np.flatnonzero(inside)
        points = np.concatenate([self.footprint[corner], first[crossing], last[crossing]])
        rows = np.concatenate([hanging[row], of[crossing], of[crossing]])
        order = np.argsort(rows, kind="stable")
        return rows[order], points[order]


def _convex_piece(region: shapely.Geometry) -> shapely.Polygon:
    """A large convex piece of a region: it is cut along the edges of its corners inwards, one by one."""
    for _ in range(MOST_CORNERS):
        piece = max(shapely.get_parts(region), key=shapely.area)
        if piece.geom_type != "Polygon" or piece.is_empty:
            break
        ring = shapely.get_coordinates(orient(shapely.Polygon(piece.exterior)).exterior)[:-1]
        along = np.roll(ring, -1, axis=0) - ring
        before = np.roll(along, 1, axis=0)
        inwards = np.flatnonzero(before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0] < -_FLAT)
        if not len(inwards):
            return piece
        corner = int(inwards[0])
        cuts = []
        for way in (before[corner], along[corner]):
            way = _FAR * way / np.linalg.norm(way)
            left, at = np.array([-way[1], way[0]]), ring[corner]
            cuts.append(piece & shapely.Polygon([at - way, at + way, at + way + left, at - way + left]))
        region = max(cuts, key=lambda cut: max((part.area for part in shapely.get_parts(cut)), default=0.0))
    return shapely.Polygon()


class _Ranges:
    """Consecutive items in groups of given sizes."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self._size = np.array(sizes, dtype=np.int64)
        self._first = np.cumsum(self._size) - self._size

    def expand(self, groups: IntArray) -> tuple[IntArray, IntArray]:
        """Position in ``groups`` (n,) and number of each item of each of these groups, in order."""
        size = self._size[groups]
        owner = np.repeat(np.arange(len(groups)), size)
        return owner, np.arange(len(owner)) - np.repeat(np.cumsum(size) - size - self._first[groups], size)


class _Sole:
    """A convex polygon about the origin, and how edges of other polygons lie to it."""

    def __init__(self, corners: FloatArray) -> None:
        hull = convex_polygon(corners)
        angle = np.arctan2(hull[:, 1], hull[:, 0])
        hull, angle = np.roll(hull, -int(np.argmin(angle)), axis=0), np.sort(angle)
        self._walls, self._offsets = walls(hull)
        self.radius = float(np.linalg.norm(hull, axis=1).max())
        doubled = hull[:, 0] * np.roll(hull[:, 1], -1) - hull[:, 1] * np.roll(hull[:, 0], -1)
        self.area = float(0.5 * doubled.sum())
        self._corners, self._angles = hull, angle
        self._after = np.roll(np.arange(len(hull)), -1)
        self._swept = np.concatenate([[0.0], np.cumsum(0.5 * doubled)])

    def beyond(self, out: FloatArray, distance: FloatArray) -> FloatArray:
        """(p,) share of the area beyond a line, or two that are perpendicular.

        The lines have unit normals (p, 1 or 2, 2) and are at distances (p, 1 or 2) of the origin [m].
        """
        side = out @ self._corners.T - distance[..., None]
        after, there = side[..., self._after], side >= 0.0
        share = side / np.where(side == after, 1.0, side - after)
        enters = np.where(there, 0.0, np.where(there[..., self._after], share, 1.0)).max(axis=1)
        leaves = np.where(there[..., self._after], 1.0, np.where(there, share, 0.0)).min(axis=1)
        # Seen from where the lines meet, they sweep no area.
        corner = self._corners - np.einsum("pwi,pw->pi", out, distance)[:, None]
        edge = self._corners[self._after] - self._corners
        swept = corner[..., 0] * edge[:, 1] - corner[..., 1] * edge[:, 0]
        return 0.5 * (swept * np.maximum(leaves - enters, 0.0)).sum(axis=1) / self.area

    def clip(self, start: FloatArray, end: FloatArray) -> _Clipped:
        """Cut edges (p, 2) to what of them is inside (Cyrus and Beck)."""
        edge = end - start
        rise = self._walls @ edge.T
        room = self._offsets[:, None] - self._walls @ start.T
        level = np.abs(rise) < 1e-300
        share = room / np.where(level, 1.0, rise)
        enters = np.where(~level & (rise < 0.0), share, 0.0).max(axis=0).clip(0.0)
        leaves = np.where(~level & (rise > 0.0), share, 1.0).min(axis=0).clip(max=1.0)
        inside = (enters < leaves) & ~(level & (room < 0.0)).any(axis=0)
        return inside, start + enters[:, None] * edge, start + leaves[:, None] * edge

    def fan(self, start: FloatArray, end: FloatArray, clipped: _Clipped) -> FloatArray:
        """(p,) signed area of the sole within the triangle of each edge and the origin [m^2].

        Their sum over the edges of a polygon is the area that it shares with the sole.
        """
        begin, stop = self._swept_to(start), self._swept_to(end)
        area = self._wedge(begin, stop)
        some = clipped[0]
        first, last = clipped[1][some], clipped[2][some]
        enters, leaves = self._swept_to(first), self._swept_to(last)
        area[some] = self._wedge(begin[:, some], enters) + self._wedge(leaves, stop[:, some])
        area[some] += 0.5 * (first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0])
        return area

    def _wedge(self, begin: FloatArray, stop: FloatArray) -> FloatArray:
        """(p,) signed area between two directions (2, p) less than half a turn apart [m^2]."""
        turn = stop[0] - begin[0]
        full = (turn < -np.pi).astype(np.float64) - (turn > np.pi)
        return stop[1] - begin[1] + self.area * full

    def _swept_to(self, points: FloatArray) -> FloatArray:
        """(2, p) angles of points in [-pi, pi], and the area from the first corner's on to there [m^2]."""
        angle = np.arctan2(points[:, 1], points[:, 0])
        past = np.searchsorted(self._angles, angle, side="right") - 1
        before = past < 0  # on the last edge, a turn earlier
        wall = np.where(before, len(self._angles) - 1, past)
        out = np.einsum("pi,pi->p", self._walls[wall], points)
        reach = self._offsets[wall] / np.where(out == 0.0, 1.0, out)  # 0 only of the origin itself
        corner = self._corners[wall]
        rest = 0.5 * reach * (corner[:, 0] * points[:, 1] - corner[:, 1] * points[:, 0])
        return np.stack([angle, self._swept[wall] + rest - self.area * before])


def _distance(start: FloatArray, end: FloatArray) -> FloatArray:
    """(p,) distance of the origin to edges [m]."""
    edge = end - start
    along = -np.einsum("pi,pi->p", start, edge) / np.maximum(np.einsum("pi,pi->p", edge, edge), 1e-300)
    nearest = start + np.clip(along, 0.0, 1.0)[:, None] * edge
    return np.hypot(nearest[:, 0], nearest[:, 1])


def _any(groups: IntArray, flags: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """(count,) whether any of the flags of each group is set."""
    return np.bincount(groups[flags], minlength=count) > 0


def _crossings(groups: IntArray, start: FloatArray, end: FloatArray, count: int) -> IntArray:
    """(count,) edges (p, 2) of each group that a ray from the origin along x crosses."""
    straddles = (start[:, 1] > 0.0) != (end[:, 1] > 0.0)
    start, end = start[straddles], end[straddles]
    crossing = start[:, 0] - start[:, 1] / (end[:, 1] - start[:, 1]) * (end[:, 0] - start[:, 0])
    return np.bincount(groups[straddles][crossing > 0.0], minlength=count)


def _around_origin(of: IntArray, points: FloatArray, rows: IntArray) -> NDArray[np.bool_]:
    """(n,) whether the hull of the points of each row has the origin inside."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    order = np.lexsort((angle, of))
    of, angle = of[order], angle[order]
    first = np.searchsorted(of, rows)
    last = np.searchsorted(of, rows, side="right") - 1
    some = last > first
    gap = np.diff(angle, append=0.0)
    gap[last[some]] = angle[first[some]] - angle[last[some]] + 2.0 * np.pi
    inside = np.zeros(len(rows), dtype=bool)
    if some.any():
        inside[some] = np.maximum.reduceat(gap, first[some]) < np.pi - 1e-9
    return inside
