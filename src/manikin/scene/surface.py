"""Planar faces of the scene that an effector can be put on.

Bars, rails and rungs that a hand can close round are lines, and surfaces for a palm. What a hand can close
round is a matter of the cross-section. For handrails the ADA Standards (2010, 505.5 and 505.7) ask for a
perimeter of at most 160 mm, at most 57 mm across and 38 mm of free room for the fingers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Geometry

from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, axes_of_normal, frozen_array, skew, unit
from manikin.scene.mesh import Mesh, as_trimesh
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Obstacle, Plane

ENDLESS_HALF_SIZE = 1000.0
"""Half the side of the square polygon of an endless plane [m]."""
CAP_CORNERS = 32
"""Corners of the polygon that stands for a cylinder's cap."""
SMALLEST_AREA = 1e-4
"""Smaller polygons are no surface, because they hold no contact [m^2]."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A flat polygon of one or more obstacles, seen from its free side.

    Attributes:
        obstacles: Names of the obstacles that it belongs to; coplanar ones that touch are one surface. After
            them those close below, which are touched with it.
        polygon: (k, 3) corners in the world [m], counter-clockwise about the normal, perhaps not convex.
        normal: (3,) unit normal, out of the obstacle.
        holes: (h, 3) corners of each hole [m], clockwise about the normal.
    """

    obstacles: tuple[str, ...]
    polygon: FloatArray
    normal: FloatArray
    holes: tuple[FloatArray, ...] = ()

    @cached_property
    def rotation(self) -> FloatArray:
        """(3, 3) surface-to-world rotation with z along the normal."""
        rotation = axes_of_normal(self.normal)
        rotation.setflags(write=False)
        return rotation

    @cached_property
    def edges(self) -> tuple[FloatArray, FloatArray]:
        """(e, 3) starts and ends of the edges of the polygon and its holes [m], surface on their left."""
        rings = (self.polygon, *self.holes)
        return np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])

    @cached_property
    def walls(self) -> tuple[FloatArray, FloatArray] | None:
        """Outward normals (e, 3) and offsets (e,) [m] of its edges in the world; None if it is not convex."""
        corners = self.polygon
        out = np.cross(np.roll(corners, -1, axis=0) - corners, self.normal)
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        offsets = np.einsum("ei,ei->e", out, corners)
        slack = 1e-9 * max(1.0, float(np.abs(corners).max()))
        convex = not self.holes and bool((corners @ out.T <= offsets + slack).all())
        return (out, offsets) if convex else None

    @property
    def area(self) -> float:
        """[m^2]; without the holes."""
        start, end = self._flat_edges
        return float(0.5 * np.sum(start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]))

    @property
    def centre(self) -> FloatArray:
        """(3,) mean of the corners [m]."""
        return self.polygon.mean(axis=0)

    def height(self, points: FloatArray) -> FloatArray:
        """(k,) signed distance of (k, 3) points to the surface's plane, positive on its free side [m]."""
        return (points - self.polygon[0]) @ self.normal

    def outside(self, points: FloatArray) -> FloatArray:
        """(k,) distance in the plane from each projected point to the polygon [m]; 0 inside."""
        start, end = self._flat_edges
        flat, edge = self._flat(points), end - start
        to_point = flat[:, None] - start
        along = np.einsum("kei,ei->ke", to_point, edge) / np.einsum("ei,ei->e", edge, edge)
        nearest = to_point - np.clip(along, 0.0, 1.0)[..., None] * edge
        gap = np.sqrt(np.einsum("kei,kei->ke", nearest, nearest).min(axis=1))
        return np.where(inside_edges(flat, start, end), 0.0, gap)

    def nearest_inside(self, point: FloatArray, inset: float) -> FloatArray | None:
        """(3,) place nearest to a point (3,), at a distance from all edges [m]; None without."""
        frame = PlaneFrame(self.polygon[0], self.rotation)
        room = frame.flat(self.polygon, self.holes).buffer(-inset)
        if room.is_empty:
            return None
        ends = shapely.shortest_line(room, shapely.Point(self._flat(point))).coords
        return frame.origin + self.rotation[:, :2] @ ends[0]

    def holds(self, points: FloatArray) -> NDArray[np.bool_]:
        """(k,) whether (k, 3) points [m], seen along the normal, are inside."""
        return inside_edges(self._flat(points), *self._flat_edges)

    @cached_property
    def _flat_edges(self) -> tuple[FloatArray, FloatArray]:
        start, end = self.edges
        return self._flat(start), self._flat(end)

    def distance(self, points: FloatArray) -> FloatArray:
        """(k,) distance of (k, 3) points to the polygon in space [m]."""
        return np.hypot(self.height(points), self.outside(points))

    def _flat(self, points: FloatArray) -> FloatArray:
        return (np.asarray(points) - self.polygon[0]) @ self.rotation[:, :2]


def walls_of(surfaces: Sequence[Surface]) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
    """Which (m,) surfaces are convex, and their walls (m, e, 3) and offsets (m, e) [m], else endless."""
    found = [item.walls for item in surfaces]
    most = max((len(item[1]) for item in found if item is not None), default=1)
    out, offsets = np.zeros((len(found), most, 3)), np.full((len(found), most), np.inf)
    for number, item in enumerate(found):
        if item is not None:
            out[number, : len(item[1])], offsets[number, : len(item[1])] = item
    return np.array([item is not None for item in found], dtype=bool), out, offsets


def inside_edges(points: FloatArray, start: FloatArray, end: FloatArray) -> NDArray[np.bool_]:
    """(...,) whether points (..., 2) are inside closed rings of edges (..., e, 2), by the even-odd rule."""
    x, y = points[..., None, 0], points[..., None, 1]
    straddles = (start[..., 1] > y) != (end[..., 1] > y)
    rise = end[..., 1] - start[..., 1]
    rise = np.where(rise == 0.0, 1.0, rise)
    crossing = start[..., 0] + (y - start[..., 1]) / rise * (end[..., 0] - start[..., 0])
    return np.sum(straddles & (x < crossing), axis=-1) % 2 == 1


def faces_of(obstacle: Obstacle) -> tuple[Surface, ...]:
    """Flat faces of one obstacle: box faces, cylinder caps, planes, coplanar mesh facets."""
    shape = obstacle.shape
    if isinstance(shape, Box):
        return _box_faces(obstacle, shape)
    if isinstance(shape, Cylinder):
        return _caps(obstacle, shape)
    if isinstance(shape, (Plane, HalfSpace)):
        return _endless(obstacle, shape)
    return _facets(obstacle, shape) if isinstance(shape, Mesh) else ()


def _surface(obstacle: Obstacle, polygon: FloatArray, normal: FloatArray) -> Surface:
    return _in_world(obstacle.name, obstacle.to_world(polygon), obstacle.rotation @ normal)


def _in_world(name: str, polygon: FloatArray | list[FloatArray], normal: FloatArray) -> Surface:
    unit = frozen_array(normal / np.linalg.norm(normal), "normal", (3,))
    return Surface((name,), frozen_array(polygon, "polygon", (None, 3)), unit)


def _corners(first: FloatArray, second: FloatArray) -> FloatArray:
    """(4, 3) corners of a rectangle about the origin by its half sides."""
    return np.array([first + second, second - first, -first - second, first - second])


def _box_faces(obstacle: Obstacle, box: Box) -> tuple[Surface, ...]:
    half = box.size / 2
    faces = []
    for axis in (2, 0, 1):
        first, second = np.eye(3)[(axis + 1) % 3] * half, np.eye(3)[(axis + 2) % 3] * half
        for sign in (1.0, -1.0):
            normal = sign * np.eye(3)[axis]
            corners = [first + second, sign * (second - first), -first - second, sign * (first - second)]
            faces.append(_surface(obstacle, normal * half + np.array(corners), normal))
    return tuple(faces)


def _caps(obstacle: Obstacle, cylinder: Cylinder) -> tuple[Surface, ...]:
    angle = np.arange(CAP_CORNERS) * 2 * np.pi / CAP_CORNERS
    ring = cylinder.radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(CAP_CORNERS)])
    up = np.array([0.0, 0.0, 1.0])
    top = _surface(obstacle, ring + up * cylinder.length / 2, up)
    bottom = _surface(obstacle, ring[::-1] - up * cylinder.length / 2, -up)
    return top, bottom


def _endless(obstacle: Obstacle, shape: Plane | HalfSpace) -> tuple[Surface, ...]:
    normal = shape.normal
    first = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    first *= ENDLESS_HALF_SIZE / np.linalg.norm(first)
    second = np.cross(normal, first)
    corners = normal * shape.offset + _corners(first, second)
    front = _surface(obstacle, corners, normal)
    return (front,) if isinstance(shape, HalfSpace) else (front, _surface(obstacle, corners[::-1], -normal))


def _facets(obstacle: Obstacle, mesh: Mesh) -> tuple[Surface, ...]:
    """Coplanar triangles that touch, each group as one polygon or several, with its holes.

    Open pieces are seen from the side their triangles turn to.  The common face of two blocks that stand
    against each other may have triangles of either side.
    """
    surfaces: list[Surface] = []
    for piece in mesh.pieces:
        whole = as_trimesh(obstacle.to_world(piece.vertices), piece.faces)
        groups = [side for facet in whole.facets for side in _sides(np.asarray(facet), whole.face_normals)]
        grouped = np.concatenate(groups) if groups else np.zeros(0, dtype=np.int64)
        groups += [np.array([face]) for face in np.setdiff1d(np.arange(len(piece.faces)), grouped)]
        for group in groups:
            if whole.area_faces[group].sum() >= SMALLEST_AREA:
                normal = np.einsum("i,ij->j", whole.area_faces[group], whole.face_normals[group])
                triangles = whole.triangles[group]
                if len(group) == 1:
                    surfaces.append(_in_world(obstacle.name, triangles[0], normal))
                    continue
                frame = PlaneFrame.of(normal / np.linalg.norm(normal), triangles[0])
                union = shapely.union_all([frame.flat(ring) for ring in triangles], grid_size=GRID)
                surfaces += frame.surfaces(union, (obstacle.name,))
    return tuple(surfaces)


def _sides(group: NDArray[np.int64], normals: FloatArray) -> list[NDArray[np.int64]]:
    """Coplanar triangles parted by the side that they turn to."""
    turned = normals[group] @ normals[group[0]] > 0.0
    return [group] if turned.all() else [group[turned], group[~turned]]


GRID = 1e-9
"""Corners of surfaces that are joined or cut are rounded to this, in the plane of the surface [m]."""


@dataclass(frozen=True, eq=False)
class PlaneFrame:
    """A plane with coordinates, in which polygons are joined and cut.

    It has an origin (3,) [m] and a plane-to-world rotation (3, 3), z along the normal.
    """

    origin: FloatArray
    rotation: FloatArray

    @staticmethod
    def of(normal: FloatArray, ring: FloatArray) -> "PlaneFrame":
        """Plane through the first corner of a ring (k, 3) [m], with x along its first edge."""
        along = ring[1] - ring[0]
        along = along - (along @ normal) * normal
        along = along / np.linalg.norm(along)
        return PlaneFrame(ring[0], np.column_stack([along, skew(normal) @ along, normal]))

    def flat(self, ring: FloatArray, holes: Sequence[FloatArray] = ()) -> shapely.Polygon:
        """The shadow of a polygon (k, 3) and its holes [m] on the plane."""
        rings = [(corners - self.origin) @ self.rotation[:, :2] for corners in (ring, *holes)]
        return shapely.Polygon(rings[0], rings[1:])

    def surfaces(self, shape: Geometry, obstacles: tuple[str, ...]) -> list[Surface]:
        """Polygons of a flat shape as surfaces, without those too small to be touched."""
        found: list[Surface] = []
        for part in shapely.get_parts(shapely.orient_polygons(shape.simplify(GRID))):
            if isinstance(part, shapely.Polygon) and part.area >= SMALLEST_AREA:
                rings = [np.asarray(ring.coords)[:-1] for ring in (part.exterior, *part.interiors)]
                outer, *holes = (
                    frozen_array(self.origin + ring @ self.rotation[:, :2].T, "polygon", (None, 3))
                    for ring in rings
                )
                normal = frozen_array(self.rotation[:, 2], "normal", (3,))
                found.append(Surface(obstacles, outer, normal, tuple(holes)))
        return found


LARGEST_PERIMETER = 0.160
"""Perimeter of the thickest cross-section that a hand closes round [m]."""
LARGEST_ACROSS = 0.057
"""Largest dimension of that cross-section [m]."""
LEAST_ACROSS = 0.010
"""What is thinner cuts into a hand that carries a body [m]; our choice."""
FINGER_ROOM = 0.038
"""Free room that fingers need around a bar [m]."""
HAND_BREADTH = 0.085
"""Length of a bar that a hand covers [m]; our choice."""
STRIP_WIDTH = 0.06
"""Width of the faces that stand for the sides of a round bar [m]; a palm over one is put onto its middle."""
_SPACING = 0.02  # [m]; between places along a bar that are tested for room
_SIDES = 8


@dataclass(frozen=True, eq=False)
class GraspLine:
    """A straight piece of a bar that a hand can close round anywhere.

    Attributes:
        obstacle: Name of the obstacle.
        start, end: (3,) middles of the first and the last hand's place on the axis [m].
        radius: Distance of the bar's surface from its axis, the largest one of a box [m].
        round: Whether it is round, so that a palm may lie on it from any side.
    """

    obstacle: str
    start: FloatArray
    end: FloatArray
    radius: float
    round: bool

    @property
    def length(self) -> float:
        """[m]; 0 where there is room for one hand."""
        return float(np.linalg.norm(self.end - self.start))

    def nearest(self, points: FloatArray) -> FloatArray:
        """(..., 3) places on the axis nearest to points (..., 3) [m]."""
        along = self.end - self.start
        share = (points - self.start) @ along / max(float(along @ along), 1e-18)
        return self.start + np.clip(share, 0.0, 1.0)[..., None] * along

    def strips(self, axis: FloatArray) -> tuple[Surface, ...]:
        """Faces around a round bar of a direction (3,), in the middle of each of which a palm may lie."""
        reach = 0.5 * HAND_BREADTH * axis
        corners = np.array([self.start - reach, self.end + reach])
        sideways, upward, _ = axes_of_normal(axis).T
        half = 0.5 * STRIP_WIDTH
        found: list[Surface] = []
        for angle in 2.0 * np.pi * np.arange(_SIDES) / _SIDES:
            normal = np.cos(angle) * sideways + np.sin(angle) * upward
            across = np.cross(normal, axis)
            ring = [
                corners[end] + self.radius * normal + side * half * across
                for end, side in ((0, 1.0), (0, -1.0), (1, -1.0), (1, 1.0))
            ]
            polygon = frozen_array(np.array(ring), "polygon", (4, 3))
            found.append(Surface((self.obstacle,), polygon, frozen_array(normal, "normal", (3,))))
        return tuple(found)


def grasp_lines(
    obstacles: Sequence[Obstacle], distances: Callable[[FloatArray], Sequence[tuple[float, str]]]
) -> tuple[GraspLine, ...]:
    """Pieces of all bars of a scene around which fingers have room.

    ``distances`` are those of a (3,) world point to each obstacle [m], with their names.
    """
    found: list[GraspLine] = []
    for item in obstacles:
        bar = _bar(item)
        if bar is not None:
            first, last, radius, is_round = bar
            found += [
                GraspLine(item.name, frozen_array(start, "start"), frozen_array(end, "end"), radius, is_round)
                for start, end in _free(item.name, first, last, radius, distances)
            ]
    return tuple(found)


def grasp_strips(lines: Sequence[GraspLine], obstacles: Sequence[Obstacle]) -> tuple[Surface, ...]:
    """Faces around the round bars, for a palm; boxes have faces of their own."""
    axes = {item.name: item.rotation[:, 2] for item in obstacles}
    return tuple(strip for line in lines if line.round for strip in line.strips(axes[line.obstacle]))


SOLE_YIELD = 0.0015
"""Depth by which a sole yields to a round bar that it stands on [m]; our choice."""
LEVEL_BAR = float(np.sin(np.deg2rad(5.0)))
"""Rise of the axis of a bar that counts as level, over its length."""


def bar_tops(obstacles: Sequence[Obstacle]) -> tuple[Surface, ...]:
    """Strips along the tops of level round bars, on which only a sole that yields a little can lie."""
    found: list[Surface] = []
    for item in obstacles:
        shape, axis = item.shape, item.rotation[:, 2]
        if not isinstance(shape, (Cylinder, Capsule)) or abs(axis[2]) > LEVEL_BAR:
            continue
        up = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
        up /= np.linalg.norm(up)
        half = float(np.sqrt(SOLE_YIELD * (2.0 * shape.radius - SOLE_YIELD)))  # as bar_radius has it
        along, across = 0.5 * shape.length * axis, half * np.cross(up, axis)
        ring = item.translation + shape.radius * up + _corners(along, across)
        polygon = frozen_array(ring, "polygon", (4, 3))
        found.append(Surface((item.name,), polygon, frozen_array(up, "normal", (3,))))
    return tuple(found)


def bar_radius(width: float) -> float:
    """Radius of the round bar whose strip on top has a width [m], see :func:`bar_tops`."""
    return (0.25 * width**2 + SOLE_YIELD**2) / (2.0 * SOLE_YIELD)


def palm_places(lines: Sequence[GraspLine], numbers: NDArray[np.int64], points: FloatArray) -> FloatArray:
    """(n, 3) middles of palms' grips on the axes of round bars, nearest to points over their strips [m].

    ``numbers`` (n,) are those of the strips of :func:`grasp_strips`, ``points`` (n, 3) in their planes.
    """
    ends = np.array([(line.start, line.end) for line in lines if line.round])
    start, end = ends[numbers // _SIDES].transpose(1, 0, 2)
    axis = unit(end - start, 1e-12)
    length = np.linalg.norm(end - start, axis=1)
    along = np.clip(np.einsum("ni,ni->n", points - start, axis), 0.0, length)
    return start + along[:, None] * axis


def _bar(obstacle: Obstacle) -> tuple[FloatArray, FloatArray, float, bool] | None:
    """Ends of the axis, radius and roundness of an obstacle that a hand can close round, or None."""
    shape = obstacle.shape
    if isinstance(shape, Box):
        order = np.argsort(shape.size)
        thin, thick, length = shape.size[order]
        perimeter, across, least = 2.0 * (thin + thick), float(np.hypot(thin, thick)), thin
        direction = np.eye(3)[order[2]]
    elif isinstance(shape, (Cylinder, Capsule)):
        across = least = 2.0 * shape.radius
        perimeter, length = np.pi * across, shape.length
        direction = np.array([0.0, 0.0, 1.0])
    else:
        return None
    closes_round = perimeter <= LARGEST_PERIMETER * (1 + 1e-9) and across <= LARGEST_ACROSS
    if not closes_round or least < LEAST_ACROSS or length < HAND_BREADTH:
        return None
    half = 0.5 * (length - HAND_BREADTH) * direction
    start, end = obstacle.to_world(np.array([-half, half]))
    return start, end, 0.5 * across, not isinstance(shape, Box)


def _free(
    name: str, start: FloatArray, end: FloatArray, radius: float,
    distances: Callable[[FloatArray], Sequence[tuple[float, str]]],
) -> list[tuple[FloatArray, FloatArray]]:  # fmt: skip
    """Pieces between two ends around whose places nothing else is in the fingers' way."""
    count = 1 + int(np.ceil(float(np.linalg.norm(end - start)) / _SPACING))
    places = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
    room = radius + FINGER_ROOM
    free = [all(away >= room for away, other in distances(place) if other != name) for place in places]
    return [(places[first], places[stop - 1]) for first, stop in mask_runs(np.array(free))]
