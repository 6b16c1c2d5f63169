"""Distances of a body's shapes to obstacles and to each other in many postures at once.

Spheres and capsules are segments with a radius: their distance to a convex obstacle is the least value of a
convex function along the segment, found by ternary search, which is exact outside and inside. Boxes are
tested for a separating axis, which finds every overlap and gives no more than the distance outside.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import cached_property, partial

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel
from manikin.body.segments import Shape, ShapeKind
from manikin.numerics.spatial import FloatArray
from manikin.scene.mesh import Mesh
from manikin.scene.obstacle import Box, Capsule, Cylinder, HalfSpace, Plane, Sphere
from manikin.verification.solids import REACH, Solid, box_distance, segment_segment, segment_triangle

_ROUNDS = 46
_PRISM = 48
_SIGNS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False)
class Placed:
    """Shapes of one kind, one row for each posture and shape.

    Attributes:
        posture: (n,) number of the posture.
        shape: (n,) number of the shape among all shapes of the body.
        position: (n, 3) centres in the world [m].
        rotation: (n, 3, 3) from the shape's axes to the world's.
        size: (n, 3) side lengths of boxes; of capsules and spheres 0, 0 and the length along z [m].
        radius: (n,) of capsules and spheres [m]; 0 for boxes.
    """

    posture: np.ndarray
    shape: np.ndarray
    position: FloatArray
    rotation: FloatArray
    size: FloatArray
    radius: FloatArray

    def rows(self, chosen: np.ndarray) -> "Placed":
        """Some of the rows."""
        return Placed(*(getattr(self, field.name)[chosen] for field in fields(self)))

    @cached_property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """(n, 3) ends of the segments of capsules [m]."""
        half = 0.5 * self.size[:, 2, None] * self.rotation[:, :, 2]
        return self.position - half, self.position + half

    @cached_property
    def corners(self) -> FloatArray:
        """(n, 8, 3) corners of boxes [m]."""
        return self.position[:, None] + np.einsum("nij,nkj->nki", self.rotation, _SIGNS * self.size[:, None])

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """(n, 3) lower and upper corners of boxes around them with the world's axes [m]."""
        half = 0.5 * np.einsum("nij,nj->ni", np.abs(self.rotation), self.size) + self.radius[:, None]
        return self.position - half, self.position + half


class BodySolids:
    """Collision shapes of a body, placed by the forward kinematics of its postures."""

    def __init__(self, body: BodyModel) -> None:
        self.body = body
        pairs = [(segment.name, shape) for segment in body.segments for shape in segment.shapes]
        self.segments = tuple(name for name, _ in pairs)
        self.names = tuple(f"{name}/{shape.name}" for name, shape in pairs)
        self.shapes: tuple[Shape, ...] = tuple(shape for _, shape in pairs)
        self._data = body.pinocchio.createData()

    def placed(self, postures: FloatArray) -> tuple[Placed, Placed]:
        """Round shapes and boxes in postures (p, nq)."""
        places, turns = [], []
        frames = [self.body.segment_frame(name) for name in self.segments]
        for q in postures:
            pin.framesForwardKinematics(self.body.pinocchio, self._data, q)
            for frame, shape in zip(frames, self.shapes, strict=True):
                carrier = self._data.oMf[frame]
                places.append(carrier.translation + carrier.rotation @ shape.translation)
                turns.append(carrier.rotation @ shape.rotation)
        count = len(self.shapes)
        sizes = np.array([_extent(shape) for shape in self.shapes]).reshape(count, 3)
        radii = np.array([0.0 if s.kind is ShapeKind.BOX else float(s.size[0]) for s in self.shapes])
        every = Placed(
            np.repeat(np.arange(len(postures)), count), np.tile(np.arange(count), len(postures)),
            np.array(places).reshape(-1, 3), np.array(turns).reshape(-1, 3, 3),
            np.tile(sizes, (len(postures), 1)), np.tile(radii, len(postures)),
        )  # fmt: skip
        return every.rows(every.radius > 0.0), every.rows(every.radius == 0.0)

    def to_obstacle(self, postures: FloatArray, solid: Solid) -> FloatArray:
        """(p, s) clearance of each shape in each posture to an obstacle [m]; infinite beyond the reach."""
        result = np.full((len(postures), len(self.shapes)), np.inf)
        low, high = solid.bounds
        measures = (_rounds_to_solid, _boxes_to_solid)
        for shapes, measure in zip(self.placed(postures), measures, strict=True):
            lowest, highest = shapes.bounds
            near = np.flatnonzero(np.all((lowest - REACH <= high) & (highest + REACH >= low), axis=1))
            if len(near):
                chosen = shapes.rows(near)
                result[chosen.posture, chosen.shape] = measure(chosen, solid)
        return result

    def to_itself(self, postures: FloatArray) -> FloatArray:
        """(p, c) clearance of each of the body's collision pairs in each posture [m]."""
        index = {name: number for number, name in enumerate(self.names)}
        is_box = [shape.kind is ShapeKind.BOX for shape in self.shapes]
        result = np.full((len(postures), len(self.body.collision_pairs)), np.inf)
        rounds, boxes = self.placed(postures)
        row = np.zeros((len(postures), len(self.shapes)), dtype=np.int64)
        for shapes in (rounds, boxes):
            row[shapes.posture, shapes.shape] = np.arange(len(shapes.shape))
        # By kind, with the box last where there is one: number of the pair, first and second shape.
        pairs: dict[int, list[tuple[int, int, int]]] = {0: [], 1: [], 2: []}
        for number, names in enumerate(self.body.collision_pairs):
            a, b = sorted((index[name] for name in names), key=is_box.__getitem__)
            pairs[is_box[a] + is_box[b]].append((number, a, b))
        for kind, numbers in pairs.items():
            if numbers:
                which, a, b = np.array(numbers).T
                first = (boxes if kind == 2 else rounds).rows(row[:, a].ravel())
                second = (boxes if kind else rounds).rows(row[:, b].ravel())
                result[:, which] = _between(first, second, kind).reshape(len(postures), -1)
        return result


def _extent(shape: Shape) -> FloatArray:
    if shape.kind is ShapeKind.BOX:
        return np.array(shape.size)
    return np.array([0.0, 0.0, float(shape.size[1]) if shape.kind is ShapeKind.CAPSULE else 0.0])


def _least_along(shapes: Placed, distance: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """(n,) least value along the segments of a function of (n, 3) points that is convex along each."""
    start, end = shapes.ends
    low, high = np.zeros(len(start)), np.ones(len(start))
    least = np.minimum(distance(start), distance(end))
    for _ in range(_ROUNDS):
        first, second = low + (high - low) / 3.0, high - (high - low) / 3.0
        near = distance(start + first[:, None] * (end - start))
        far = distance(start + second[:, None] * (end - start))
        least = np.minimum(least, np.minimum(near, far))
        low, high = np.where(near > far, first, low), np.where(near > far, high, second)
    return least


def _distance_to_boxes(boxes: Placed, points: FloatArray) -> FloatArray:
    local = np.einsum("nji,nj->ni", boxes.rotation, points - boxes.position)
    return box_distance(np.abs(local) - 0.5 * boxes.size)


def _rounds_to_solid(rounds: Placed, solid: Solid) -> FloatArray:
    if not isinstance(solid.obstacle.shape, Mesh):
        return _least_along(rounds, solid.distance) - rounds.radius
    start, end = rounds.ends
    result = np.full(len(start), np.inf)
    for number, near in _near_triangles(rounds, solid):
        result[number] = segment_triangle(start[number], end[number], solid.triangles.corners[near]).min()
    return np.where(solid.inside(rounds.position) & np.isfinite(result), -result, result) - rounds.radius


def _near_triangles(shapes: Placed, solid: Solid) -> Iterator[tuple[int, np.ndarray]]:
    """Numbers of the shapes that are near a mesh, with the indices of its triangles there."""
    for number, (low, high) in enumerate(zip(*shapes.bounds, strict=True)):
        near = solid.triangles.overlapping(low - REACH, high + REACH)
        if len(near):
            yield number, near


def _boxes_to_solid(boxes: Placed, solid: Solid) -> FloatArray:
    shape, place = solid.obstacle.shape, solid.obstacle
    if isinstance(shape, (HalfSpace, Plane)):
        normal, offset = place.world_plane
        height = boxes.corners @ normal - offset
        above = height.min(axis=1)
        return np.maximum(above, -height.max(axis=1)) if isinstance(shape, Plane) else above
    if isinstance(shape, Sphere):
        middle = np.broadcast_to(place.translation, boxes.position.shape)
        return _distance_to_boxes(boxes, middle) - shape.radius
    if isinstance(shape, Capsule):
        count, size = len(boxes.shape), [0.0, 0.0, shape.length]
        where = np.tile(place.translation, (count, 1)), np.tile(place.rotation, (count, 1, 1))
        axis = Placed(boxes.posture, boxes.shape, *where, np.tile(size, (count, 1)), np.zeros(count))
        return _least_along(axis, partial(_distance_to_boxes, boxes)) - shape.radius
    if isinstance(shape, Mesh):
        return _boxes_to_mesh(boxes, solid)
    corners, directions, edges = _polytope(solid)
    axes = [boxes.rotation.transpose(0, 2, 1), np.tile(directions, (len(boxes.shape), 1, 1))]
    axes += [np.cross(boxes.rotation[:, None, :, side], edges[None]) for side in range(3)]
    return separation(boxes.corners, np.tile(corners, (len(boxes.shape), 1, 1)), np.concatenate(axes, axis=1))


def _polytope(solid: Solid) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Corners, face normals and edge directions (k, 3) of a box, or of a prism around a cylinder."""
    shape, place, turn = solid.obstacle.shape, solid.obstacle, solid.obstacle.rotation.T
    if isinstance(shape, Box):
        return place.to_world(_SIGNS * shape.size), turn, turn
    if not isinstance(shape, Cylinder):
        raise TypeError(f"obstacle {solid.name!r} is neither box nor cylinder")
    angle = (np.arange(_PRISM) + 0.5) * 2.0 * np.pi / _PRISM
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    ring = shape.radius / np.cos(np.pi / _PRISM) * circle
    up = np.array([0.0, 0.0, 0.5 * shape.length])
    sides = np.roll(ring, -1, axis=0) - ring
    edges = np.vstack([sides[: _PRISM // 2] / np.linalg.norm(sides[0]), [0.0, 0.0, 1.0]])
    normals = np.vstack([np.cross(edges[:-1], [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]])
    return place.to_world(np.vstack([ring + up, ring - up])), normals @ turn, edges @ turn


def _boxes_to_mesh(boxes: Placed, solid: Solid) -> FloatArray:
    result = np.full(len(boxes.shape), np.inf)
    for number, near in _near_triangles(boxes, solid):
        corners = solid.triangles.corners[near]
        sides = np.roll(corners, -1, axis=1) - corners
        frame = np.broadcast_to(boxes.rotation[number].T, (len(near), 3, 3))
        crossed = np.cross(frame[:, :, None], sides[:, None]).reshape(len(near), 9, 3)
        axes = np.concatenate([frame, solid.triangles.normals[near][:, None], crossed], axis=1)
        own = np.broadcast_to(boxes.corners[number], (len(near), 8, 3))
        result[number] = separation(own, corners, axes).min()
    return np.where(solid.inside(boxes.position) & np.isfinite(result), -np.abs(result), result)


def separation(first: FloatArray, second: FloatArray, axes: FloatArray) -> FloatArray:
    """(n,) largest gap of convex shapes along given axes [m]: negative where they overlap along all.

    Args:
        first: (n, a, 3) corners.
        second: (n, b, 3) corners.
        axes: (n, k, 3) directions, of any length; those of almost none are left out.
    """
    length = np.linalg.norm(axes, axis=2)
    unit = axes / np.maximum(length, 1e-12)[..., None]
    a, b = np.einsum("nki,nai->nka", unit, first), np.einsum("nki,nbi->nkb", unit, second)
    gap = np.maximum(b.min(axis=2) - a.max(axis=2), a.min(axis=2) - b.max(axis=2))
    return np.where(length > 1e-9, gap, -np.inf).max(axis=1)


def _between(first: Placed, second: Placed, boxes: int) -> FloatArray:
    """Clearances (n,) of pairs of shapes with so many boxes among them, which stand last [m]."""
    if boxes == 0:
        return segment_segment(*first.ends, *second.ends) - first.radius - second.radius
    if boxes == 1:
        return _least_along(first, partial(_distance_to_boxes, second)) - first.radius
    own, other = first.rotation.transpose(0, 2, 1), second.rotation.transpose(0, 2, 1)
    crossed = np.cross(own[:, :, None], other[:, None]).reshape(len(own), 9, 3)
    return separation(first.corners, second.corners, np.concatenate([own, other, crossed], axis=1))


def worst(clearance: FloatArray, allowed: np.ndarray) -> tuple[float, tuple[int, ...]]:
    """Least clearance among allowed entries and its place; infinite where there is none."""
    if not clearance.size:
        return np.inf, (0, 0)
    masked = np.where(allowed, clearance, np.inf)
    place = np.unravel_index(int(np.argmin(masked)), masked.shape)
    return float(masked[place]), tuple(int(k) for k in place)
