"""Obstacles as Coal geometries (exact primitives, convex and triangle pieces), and distances of pairs."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import coal
import numpy as np
import trimesh
from numpy.typing import NDArray

import manikin.runtime.coal_workarounds  # noqa: F401  (before the first distance)
from manikin.numerics.spatial import FloatArray, axes_of_normal
from manikin.scene.mesh import Mesh, MeshPiece, as_trimesh
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Obstacle, Plane, Shape, Sphere, extents
from manikin.scene.triangles import IntArray, coal_triangles, coal_vertices, triangle_geometry


@dataclass(frozen=True, eq=False)
class CollisionPart:
    """One Coal geometry of an obstacle.

    A convex mesh piece has a signed distance as exact as a primitive's. A closed piece that is not convex
    carries ``surface`` so that depth differs from clearance; an open piece is a surface without inside.

    Attributes:
        obstacle: Name of the obstacle.
        geometry: In the part's frame.
        rotation, translation: (3, 3) part-to-world rotation; (3,) [m].
        low, high: (3,) corners in the part's frame [m], infinite where endless.
        surface: The closed, non-convex surface, or None.
    """

    obstacle: str
    geometry: coal.CollisionGeometry
    rotation: FloatArray
    translation: FloatArray
    low: FloatArray
    high: FloatArray
    surface: "ClosedSurface | None" = None

    @property
    def world_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner (3,) of a box around the part with the world's axes [m]."""
        if not np.isfinite([self.low, self.high]).all():
            return np.full(3, -np.inf), np.full(3, np.inf)
        centre = self.translation + 0.5 * self.rotation @ (self.low + self.high)
        half = 0.5 * np.abs(self.rotation) @ (self.high - self.low)
        return centre - half, centre + half

    def meets(self, geometry: Any, place: coal.Transform3s, request: coal.CollisionRequest) -> bool:
        """Whether the part collides with another geometry at a place in the world."""
        here, result = coal.Transform3s(self.rotation, self.translation), coal.CollisionResult()
        coal.collide(geometry, place, self.geometry, here, request, result)
        return bool(result.isCollision())


def collision_parts(obstacle: Obstacle) -> tuple[CollisionPart, ...]:
    """Split an obstacle into Coal geometries: one per primitive, one per connected mesh piece."""
    shape = obstacle.shape
    if isinstance(shape, Mesh):
        return tuple(_mesh_part(obstacle, piece) for piece in _merged_open_pieces(shape))
    if isinstance(shape, (Plane, HalfSpace)):
        return (_endless_part(obstacle, shape),)
    if isinstance(shape, Box):
        geometry = coal.Box(*shape.size)
    elif isinstance(shape, Sphere):
        geometry = coal.Sphere(shape.radius)
    else:
        kind = coal.Cylinder if isinstance(shape, Cylinder) else coal.Capsule
        geometry = kind(shape.radius, shape.length)
    place = obstacle.rotation, obstacle.translation
    return (CollisionPart(obstacle.name, geometry, *place, *extents(shape)),)


@dataclass(frozen=True, eq=False)
class ClosedSurface:
    """A watertight surface of vertices (n, 3) [m] and faces (m, 3), also as a Coal triangle mesh."""

    vertices: FloatArray
    faces: IntArray
    geometry: coal.CollisionGeometry

    def signed(self, point: FloatArray) -> tuple[float, FloatArray]:
        """Signed distance of a point [m], negative inside, and the nearest surface point.

        The sign is that of the angle-weighted normal of the nearest face, edge or vertex,
        which is exact on a closed surface (Baerentzen and Aanaes 2005).
        """
        result = coal.DistanceResult()
        place = coal.Transform3s(np.eye(3), point)
        # The mesh comes first: in the other order Coal loses the triangle's index.
        coal.distance(self.geometry, _HERE, _POINT, place, _REQUEST, result)
        nearest = result.getNearestPoint1()
        away = point - nearest
        distance = float(np.linalg.norm(away))
        return (distance if away @ self._normal_at(int(result.b1), nearest) >= 0.0 else -distance), nearest

    def _normal_at(self, face: int, point: FloatArray) -> FloatArray:
        """Angle-weighted normal of the face, its edge or its corner on which a point lies."""
        a, b, c = self.vertices[self.faces[face]]
        first, second, away = b - a, c - a, point - a
        gram = np.array([[first @ first, first @ second], [first @ second, second @ second]])
        weights = np.linalg.solve(gram, np.array([away @ first, away @ second]))
        shares = np.array([1.0 - weights.sum(), *weights])
        zero = shares < 1e-6
        of_faces, of_edges, of_vertices = self._normals
        if not zero.any():
            return of_faces[face]
        if zero.sum() == 1:
            return of_edges[face, int(np.argmax(zero))]
        return of_vertices[self.faces[face, int(np.argmax(shares))]]

    @cached_property
    def _normals(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of faces (m, 3), of the edges opposite to their corners (m, 3, 3) and of vertices (n, 3)."""
        mesh = as_trimesh(self.vertices, self.faces)
        of_faces = np.asarray(mesh.face_normals)
        edges = np.sort(self.faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        _, index = np.unique(edges, axis=0, return_inverse=True)
        sums = np.zeros((index.max() + 1, 3))
        np.add.at(sums, index.reshape(-1), np.repeat(of_faces, 3, axis=0))
        return of_faces, sums[index.reshape(-1)].reshape(-1, 3, 3), np.asarray(mesh.vertex_normals)


_MEETS = coal.CollisionRequest()
_REQUEST = coal.DistanceRequest()
_POINT = coal.Sphere(1e-9)
_HERE = coal.Transform3s.Identity()


def convex_geometry(vertices: FloatArray) -> coal.CollisionGeometry:
    """Coal convex polytope: the hull of the vertices."""
    hull = trimesh.convex.convex_hull(vertices)
    geometry = coal.Convex(coal_vertices(hull.vertices), coal_triangles(np.asarray(hull.faces)))
    geometry.computeLocalAABB()
    return geometry


def _endless_part(obstacle: Obstacle, shape: Plane | HalfSpace) -> CollisionPart:
    """Part whose frame has z along the normal, so that its bounds are tight."""
    normal, solid = shape.normal, isinstance(shape, HalfSpace)
    geometry = (coal.Halfspace if solid else coal.Plane)(np.array([0.0, 0.0, 1.0]), 0.0)
    turn = obstacle.rotation @ axes_of_normal(normal)
    origin = obstacle.translation + obstacle.rotation @ (normal * shape.offset)
    low, high = np.array([-np.inf, -np.inf, -np.inf if solid else 0.0]), np.array([np.inf, np.inf, 0.0])
    return CollisionPart(obstacle.name, geometry, turn, origin, low, high)


def _mesh_part(obstacle: Obstacle, piece: MeshPiece) -> CollisionPart:
    surface = None
    if piece.convex:
        geometry = convex_geometry(piece.vertices)
    else:
        geometry = triangle_geometry(piece.vertices, piece.faces)
        surface = ClosedSurface(piece.vertices, piece.faces, geometry) if piece.closed else None
    low, high = piece.vertices.min(axis=0), piece.vertices.max(axis=0)
    return CollisionPart(obstacle.name, geometry, obstacle.rotation, obstacle.translation, low, high, surface)


def _merged_open_pieces(mesh: Mesh) -> list[MeshPiece]:
    """All closed pieces, and the open ones as one surface: fewer geometries, same distance."""
    closed = [piece for piece in mesh.pieces if piece.closed]
    loose = [piece for piece in mesh.pieces if not piece.closed]
    if not loose:
        return closed
    starts = np.cumsum([0, *(len(piece.vertices) for piece in loose[:-1])])
    vertices = np.vstack([piece.vertices for piece in loose])
    faces = np.vstack([piece.faces + start for piece, start in zip(loose, starts, strict=True)])
    return [*closed, MeshPiece(vertices, faces, closed=False, convex=False)]


def shape_of(geometry: coal.CollisionGeometry) -> tuple[Shape, FloatArray]:
    """Shape (or the box around it) of a Coal geometry and its (3,) centre in the geometry's frame."""
    centre = np.zeros(3)
    if isinstance(geometry, coal.Sphere):
        return Sphere(geometry.radius), centre
    if isinstance(geometry, coal.Capsule):
        return Capsule(geometry.radius, 2 * geometry.halfLength), centre
    if isinstance(geometry, coal.Cylinder):
        return Cylinder(geometry.radius, 2 * geometry.halfLength), centre
    if isinstance(geometry, coal.Box):
        return Box(2 * geometry.halfSide), centre
    low, high = local_box(geometry)
    return Box(np.maximum(high - low, 1e-6)), (low + high) / 2


def column_is_free(
    scene: Iterable[Obstacle], places: FloatArray, column: tuple[float, float, float]
) -> NDArray[np.bool_]:
    """(k,) whether a vertical capsule above each place (k, 3) meets nothing of some obstacles.

    The column has a radius, and a lowest and a highest end above the place [m].
    """
    return column_is_clear((part for item in scene for part in collision_parts(item)), places, column)


def column_is_clear(
    parts: Iterable[CollisionPart], places: FloatArray, column: tuple[float, float, float]
) -> NDArray[np.bool_]:
    """As :func:`column_is_free`, of some parts of obstacles."""
    radius, bottom, top = column
    length = max(top - bottom - 2.0 * radius, 1e-3)
    shape, middle = coal.Capsule(radius, length), np.array([0.0, 0.0, 0.5 * (bottom + top)])
    free = np.ones(len(places), dtype=bool)
    side = int(np.argmax(np.ptp(places[:, :2], axis=0))) if len(places) else 0
    order = np.argsort(places[:, side], kind="stable")
    along = places[order, side]
    for part in parts:
        # The distance of the capsule's axis to the box about the part is that of their extents along the
        # sides of the box where the axis is along one of them, and no less than it elsewhere.
        half, (low, high) = 0.5 * length * np.abs(part.rotation[2]), part.world_bounds
        first, last = low[side] - radius, high[side] + radius
        rows = order[np.searchsorted(along, first) : np.searchsorted(along, last, "right")]
        other = places[rows, 1 - side]
        rows = rows[free[rows] & (other >= low[1 - side] - radius) & (other <= high[1 - side] + radius)]
        centres = (places[rows] + (middle - part.translation)) @ part.rotation
        gaps = np.maximum(np.maximum(part.low - half - centres, centres - half - part.high), 0.0)
        near = rows[np.einsum("ki,ki->k", gaps, gaps) <= radius**2]
        upright = np.count_nonzero(half > 1e-9 * length) == 1
        if isinstance(part.geometry, coal.Halfspace) or (isinstance(part.geometry, coal.Box) and upright):
            free[near] = False
            continue
        for row in near.tolist():
            free[row] = not part.meets(shape, coal.Transform3s(np.eye(3), places[row] + middle), _MEETS)
    return free


def local_box(geometry: coal.CollisionGeometry) -> tuple[FloatArray, FloatArray]:
    """Lower and upper corner (3,) of the box around a Coal geometry in its own frame [m]."""
    geometry.computeLocalAABB()
    return geometry.aabb_local.min_, geometry.aabb_local.max_


Measured = tuple[float, FloatArray, FloatArray, FloatArray]
"""Distance [m], unit normal from the first to the second, nearest point on each."""

_BEYOND: FloatArray = np.full(3, np.nan)
_BEYOND.setflags(write=False)


Meter = Callable[[coal.Transform3s, coal.Transform3s, float], Measured]
"""Measures one pair at its two geometry-to-world placements.

It gives the distance, negative in penetration; the normal; and the nearest points. From the given distance
[m] on the vectors may be NaN, as reading them takes longer than many a distance.
"""

_FINE = 1e-8
_SAFE = 1e-6
_FAILED = 1e6  # [m]; Coal leaves the largest number where its iteration breaks down


class PairMeter:
    """Measures one pair with Coal; answers depend only on the two placements.

    Coal's own tolerance of 1e-6 m makes distances that are too rough to differentiate, so 1e-8 is asked for
    first. On cylinders that makes the iteration fail now and then, so they, and failures, keep Coal's own.
    """

    def __init__(self, first: coal.CollisionGeometry, second: coal.CollisionGeometry) -> None:
        self._geometries = first, second  # Coal's functor does not keep them alive
        self._compute = coal.ComputeDistance(first, second)
        round_edged = any(isinstance(item, coal.Cylinder) for item in (first, second))
        self._request = _request(_SAFE if round_edged else _FINE)
        self._result = coal.DistanceResult()

    def __call__(self, place: coal.Transform3s, other: coal.Transform3s, within: float) -> Measured:
        """See :data:`Meter`."""
        result = self._result
        result.clear()
        distance = self._compute(place, other, self._request, result)
        if not abs(distance) < _FAILED:
            result.clear()
            distance = self._compute(place, other, _request(_SAFE), result)
        if distance >= within:
            return distance, _BEYOND, _BEYOND, _BEYOND
        normal = result.normal
        if not math.isfinite(normal[0]):
            normal = direction(other.getTranslation() - place.getTranslation())
        return distance, normal, result.getNearestPoint1(), result.getNearestPoint2()


class BallCylinderMeter:
    """A ball and a cylinder, in closed form.

    Coal pushes a ball whose centre is inside the cylinder out through the side, even just below a cap, so its
    depth is too large and jumps at the cap.
    """

    def __init__(self, ball: coal.Sphere, cylinder: coal.Cylinder) -> None:
        self._ball_radius = float(ball.radius)
        self._radius, self._half_length = float(cylinder.radius), float(cylinder.halfLength)

    def __call__(self, place: coal.Transform3s, other: coal.Transform3s, within: float) -> Measured:  # noqa: ARG002
        """See :data:`Meter`."""
        rotation, origin = other.getRotation(), other.getTranslation()
        centre = place.getTranslation()
        nearest, outward, height = self._nearest(rotation.T @ (centre - origin))
        normal = -(rotation @ outward)
        on_ball, on_cylinder = centre + self._ball_radius * normal, rotation @ nearest + origin
        return height - self._ball_radius, normal, on_ball, on_cylinder

    def _nearest(self, point: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Surface point nearest to a point, unit vector from it outward, and signed distance."""
        across = float(np.hypot(point[0], point[1]))
        radial = np.array([point[0], point[1], 0.0]) / across if across > 1e-12 else np.array([1.0, 0.0, 0.0])
        axial = np.array([0.0, 0.0, 1.0 if point[2] >= 0.0 else -1.0])
        beyond_side, beyond_cap = across - self._radius, abs(point[2]) - self._half_length
        if (height := max(beyond_side, beyond_cap)) <= 0.0:
            outward = radial if beyond_side >= beyond_cap else axial
            return point - height * outward, outward, height
        gap = max(beyond_side, 0.0) * radial + max(beyond_cap, 0.0) * axial
        height = float(np.linalg.norm(gap))
        return point - gap, gap / height, height


def pair_meter(first: coal.CollisionGeometry, second: coal.CollisionGeometry) -> Meter:
    """Measuring function of two geometries."""
    if isinstance(first, coal.Sphere) and isinstance(second, coal.Cylinder):
        return BallCylinderMeter(first, second)
    if isinstance(first, coal.Cylinder) and isinstance(second, coal.Sphere):
        meter = BallCylinderMeter(second, first)

        def swapped(place: coal.Transform3s, other: coal.Transform3s, within: float) -> Measured:
            distance, normal, on_second, on_first = meter(other, place, within)
            return distance, -normal, on_first, on_second

        return swapped
    return PairMeter(first, second)


def _request(tolerance: float) -> coal.DistanceRequest:
    request = coal.DistanceRequest()
    request.gjk_tolerance = request.epa_tolerance = tolerance
    request.gjk_max_iterations = request.epa_max_iterations = 512
    return request


def direction(vector: FloatArray) -> FloatArray:
    """Unit vector (3,); up where it has no length, which leaves a usable way out."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])


class ClosedMeshMeter:
    """Signed distance between a body shape and a closed mesh that is not convex.

    Coal's triangle meshes are hollow: they report a positive distance inside and, where surfaces cross, the
    depth of one triangle. Where a shape touches or is inside the surface, this takes the deepest of sampled
    points instead: a capsule's or ball's axis points widened by the radius, a grid of a box.
    """

    def __init__(self, geometry: coal.CollisionGeometry, surface: ClosedSurface) -> None:
        self._outside = PairMeter(geometry, surface.geometry)
        self._surface = surface
        self._low, self._high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        self._points, self._radius = _sample(geometry)

    def __call__(self, place: coal.Transform3s, other: coal.Transform3s, within: float) -> Measured:  # noqa: ARG002
        """See :data:`Meter`."""
        outside = self._outside(place, other, math.inf)
        rotation, translation = other.getRotation(), other.getTranslation()
        points = self._points @ place.getRotation().T + place.getTranslation()
        points = (points - translation) @ rotation
        boxed = np.all((points[0] >= self._low) & (points[0] <= self._high))
        if outside[0] > 0.0 and not (boxed and self._surface.signed(points[0])[0] < 0.0):
            return outside
        measured = [self._surface.signed(point) for point in points]
        lowest = int(np.argmin([height for height, _ in measured]))
        height, nearest = measured[lowest]
        if abs(height) < 1e-9 or height - self._radius > 0.0:
            return (min(outside[0], 0.0), *outside[1:])
        normal = rotation @ ((nearest - points[lowest]) / height)
        point = rotation @ points[lowest] + translation
        on_surface = rotation @ nearest + translation
        return height - self._radius, normal, point + self._radius * normal, on_surface


def part_meter(geometry: coal.CollisionGeometry, part: CollisionPart) -> Meter:
    """Measuring function of a body shape and a part of an obstacle."""
    if part.surface is None:
        return pair_meter(geometry, part.geometry)
    return ClosedMeshMeter(geometry, part.surface)


def _sample(geometry: coal.CollisionGeometry) -> tuple[FloatArray, float]:
    """(k, 3) points, the middle one first, and the radius by which they are widened [m]."""
    shape, centre = shape_of(geometry)
    if isinstance(shape, Sphere):
        return centre[None], shape.radius
    if isinstance(shape, Capsule):
        heights = _spread(shape.length)
        axis = np.column_stack([np.zeros((len(heights), 2)), heights])
        return axis + centre, shape.radius
    size = 2 * extents(shape)[1]
    axes = np.meshgrid(*(_spread(side, most=7) for side in size), indexing="ij")
    grid = np.stack(axes, axis=-1).reshape(-1, 3)
    return grid[np.argsort(np.linalg.norm(grid, axis=1), kind="stable")] + centre, 0.0


def _spread(length: float, most: int = 41) -> FloatArray:
    """Odd number of points over ``[-length/2, length/2]`` [m], at most 0.02 apart, the middle one first."""
    number = int(min(most, 2 * np.ceil(length / 0.02 / 2) + 1))
    points = np.linspace(-length / 2, length / 2, number)
    return points[np.argsort(np.abs(points), kind="stable")]
