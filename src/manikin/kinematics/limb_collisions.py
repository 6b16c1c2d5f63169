"""Whether one limb of a body touches the scene or the rest of the body.

Before a candidate is aligned and tested exactly, balls along the limb at its sample are compared with the
boxes, capsules and balls around it, all candidates at once. Each of these is a box of half sizes ``h``
widened by a radius ``r``, whose distance from a point ``p`` in its frame is, with ``e = |p| - h``,
``|max(e, 0)| + min(max_i e_i, 0) - r``. Other shapes are left to the exact test.
"""

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel, Limb, Shape, ShapeKind
from manikin.body.limbs import moving_segments
from manikin.contact import ContactKind
from manikin.kinematics.limb_kinematics import LimbKinematics
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.spatial import FloatArray
from manikin.scene import Scene, segment_of
from manikin.scene.collision import collision_parts, local_box
from manikin.scene.triangles import IntArray

_SURE = 1e-6  # depth beyond that from which on two ways to measure it agree [m]
TOUCH = 0.002  # depth to which a limb may be in an obstacle, so that what it rests on is no collision [m]
YIELD = 0.8
"""Depth to which a hand and its wrist may be in what the hand touches, as a share of the forearm's radius:
the wrist of our shapes is thicker than the hand, so that a palm flat on a wall has it in the wall."""


class LimbCollisions:
    """Collision test of one limb, and what hangs on it, with the scene and the rest of the body.

    A yes or no, found in one call of the engine; distances are those of
    :class:`manikin.scene.Proximity`. A limb wholly inside a mesh that is not convex is not noticed: it
    would have to pass the mesh's surface to get there, where the limb is held. One instance works on
    buffers of its own: use one per thread.

    Attributes:
        shapes: All geometries, those of the body first.
        pairs: (p, 2) numbers of the limb's shape and of the other one of each pair.
        names: What the shapes of each pair are called: that of the body, and the obstacle or other shape.
        active: (p,) which pairs may touch where the body was begun.
        soft: Segments that give way in what the limb touches.
    """

    def __init__(self, body: BodyModel, limb: Limb, scene: Scene) -> None:
        self._model, self._data = body.pinocchio, body.pinocchio.createData()
        parts = [part for obstacle in scene for part in collision_parts(obstacle)]
        self._shapes: Any = body.geometry.copy()
        for number, part in enumerate(parts):
            place = pin.SE3(np.array(part.rotation), np.array(part.translation))
            name = f"{part.obstacle}#{number}"
            self._shapes.addGeometryObject(pin.GeometryObject(name, 0, 0, place, part.geometry))
        self.shapes = list(self._shapes.geometryObjects)
        names = [item.name for item in self.shapes]
        self._count = count = len(names) - len(parts)
        moving = moving_segments(body, limb)
        own = [number for number, name in enumerate(names[:count]) if segment_of(name) in moving]
        outer = [(shape, part) for shape in own for part in range(count, len(names))]
        inner = [(names.index(a), names.index(b)) for a, b in body.collision_pairs]
        inner = [pair for pair in inner if (pair[0] in own) != (pair[1] in own) or set(pair) <= set(own)]
        pairs = outer + [(a, b) if a in own else (b, a) for a, b in inner]
        self.pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        self.names = [(names[a], names[b].rsplit("#", 1)[0] if b >= count else names[b]) for a, b in pairs]
        self._shapes.removeAllCollisionPairs()
        for pair in pairs:
            self._shapes.addCollisionPair(pin.CollisionPair(*pair))
        self._placed = pin.GeometryData(self._shapes)
        # References: making one takes longer.
        self._results, self._frames = list(self._placed.collisionResults), list(self._placed.oMg)
        self._tested = list(zip(self.names, self._results, strict=True))
        self.active: NDArray[np.bool_] = np.ones(len(pairs), dtype=bool)
        self._begun = np.zeros(0)
        self.soft, self._depth = yielding(body, limb)
        self._touched: tuple[str, ...] = ()
        self._yielding: dict[str, list[int]] = {}
        # Triangles of an open surface have no inside into which anything could sink.
        sheets = [isinstance(part.geometry, coal.BVHModelBase) for part in parts]
        self._thin = {number for number, (_, part) in enumerate(outer) if sheets[part - count]}
        for number, (shape, obstacle) in enumerate(self.names[: len(outer)]):
            if number not in self._thin:
                self._placed.collisionRequests[number].security_margin = -TOUCH
            if segment_of(shape) in self.soft:
                self._yielding.setdefault(obstacle, []).append(number)
        # A shape of the limb is within a ball around the limb's origin whatever the joints do.
        reaches, firsts = _reaches(body, limb), {first for first, _ in pairs}
        self._reach = np.array([reaches[names[first]] for first, _ in pairs])
        self._fixed = [number for number in range(count) if number not in firsts]
        self._radii = np.array([_radius(self.shapes[number]) for number in self._fixed])
        self._rotations = np.array([part.rotation for part in parts]).reshape(-1, 3, 3)
        self._places, self._low, self._high = (
            np.array([getattr(part, name) for part in parts]).reshape(-1, 3)
            for name in ("translation", "low", "high")
        )
        self._gaps = np.full(len(names), -np.inf)  # what belongs to the limb is always near
        self._root, self._held = _root_ball(body, limb), [part.obstacle for part in parts]
        solids = [isinstance(part.geometry, (coal.Box, coal.Halfspace)) for part in parts]
        self._solid = np.array(solids, dtype=bool)

    def stuck(self, origin: FloatArray) -> tuple[str, str] | None:
        """Shape of the limb, and box, that collide wherever its joints are; None where none is known.

        The origin (3,) of the limb's frame has a ball of its first shape about it that no joint moves [m].
        """
        name, radius = self._root
        local = np.einsum("nji,nj->ni", self._rotations, origin - self._places)
        beyond = np.maximum(self._low - local, local - self._high)
        outside = np.sqrt((np.maximum(beyond, 0.0) ** 2).sum(axis=1))
        depth = radius - outside - np.minimum(beyond.max(axis=1), 0.0)
        deep = np.flatnonzero(self._solid & (depth > TOUCH + _SURE))
        return (name, self._held[int(deep[0])]) if len(deep) else None

    def begin(self, q: FloatArray, origin: FloatArray) -> None:
        """Leave out what the limb cannot reach wherever its joints are, until the body is elsewhere.

        The body is at (nq,) with the origin of the limb's frame at (3,) [m].
        """
        if np.array_equal(q, self._begun):
            return
        self._begun = np.array(q)
        self._touch(())
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._placed, np.asarray(q))
        near = self._near(origin)
        for number in np.flatnonzero(near & ~self.active).tolist():
            self._placed.activateCollisionPair(number)
        for number in np.flatnonzero(self.active & ~near).tolist():
            self._placed.deactivateCollisionPair(number)
        self.active = near
        self._tested = [(self.names[number], self._results[number]) for number in np.flatnonzero(near)]

    def placements(self, numbers: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Axes (n, 3, 3) and origins (n, 3) of some shapes in the world, as the body began [m]."""
        frames = [self._frames[number] for number in numbers.tolist()]
        turns = np.array([item.rotation for item in frames]).reshape(-1, 3, 3)
        return turns, np.array([item.translation for item in frames]).reshape(-1, 3)

    def first(self, q: FloatArray, touched: tuple[str, ...] = ()) -> tuple[str, str] | None:
        """Shape of the body, and obstacle or other shape, of the first pair that collides, or None.

        Args:
            q: (nq,) configuration; all but the limb as where it was begun, if it was.
            touched: Names of the obstacles on which the limb has its contact.
        """
        self._touch(touched)
        if not pin.computeCollisions(self._model, self._data, self._shapes, self._placed, q, True):
            return None
        return next(names for names, result in self._tested if result.isCollision())

    def _touch(self, touched: tuple[str, ...]) -> None:
        """Let what yields sink into obstacles, and none into those before; on thin ones it is not tested."""
        if touched == self._touched:
            return
        for obstacles, depth, tested in (
            (self._touched, TOUCH, True), (touched, max(self._depth, TOUCH), False)
        ):  # fmt: skip
            for number in (pair for name in obstacles for pair in self._yielding.get(name, ())):
                if number not in self._thin:
                    self._placed.collisionRequests[number].security_margin = -depth
                elif tested and self.active[number]:
                    self._placed.activateCollisionPair(number)
                elif not tested:
                    self._placed.deactivateCollisionPair(number)
        self._touched = touched

    def _near(self, origin: FloatArray) -> NDArray[np.bool_]:
        """(p,) whether a pair may touch when the origin of the limb's frame is at (3,) and the rest stays."""
        frames = [self._frames[number] for number in self._fixed]
        away = np.array([item.translation for item in frames]).reshape(-1, 3) - origin
        self._gaps[self._fixed] = np.sqrt(np.einsum("ni,ni->n", away, away)) - self._radii
        local = np.einsum("nji,nj->ni", self._rotations, origin - self._places)
        outside = np.maximum(np.maximum(self._low - local, local - self._high), 0.0)
        self._gaps[self._count :] = np.sqrt(np.einsum("ni,ni->n", outside, outside))
        return self._gaps[self.pairs[:, 1]] <= self._reach


def _reaches(body: BodyModel, limb: Limb) -> dict[str, float]:
    """Largest distance of each of the limb's shapes from the limb's origin, by the shape's name [m]."""
    along = {limb.segments[0]: 0.0}
    for segment in body.segments:
        if segment.parent in along and segment.name not in along:
            along[segment.name] = along[segment.parent] + float(np.linalg.norm(segment.origin))
    return {
        f"{name}/{shape.name}": length + float(np.linalg.norm(shape.translation)) + _extent(shape)
        for name, length in along.items() for shape in body.segment(name).shapes
    }  # fmt: skip


def _root_ball(body: BodyModel, limb: Limb) -> tuple[str, float]:
    """Capsule of the limb's first segment, and radius of a ball in it about the segment's joint [m].

    The radius is negative where there is none, or it may give way.
    """
    segment, balls = body.segment(limb.segments[0]), [("", -np.inf)]
    if segment.parent is not None and segment.name not in yielding(body, limb)[0]:
        for shape in (item for item in segment.shapes if item.kind is ShapeKind.CAPSULE):
            half = 0.5 * float(shape.size[1]) * shape.rotation[:, 2]
            away = min(float(np.linalg.norm(shape.translation + sign * half)) for sign in (1.0, -1.0))
            balls.append((f"{segment.name}/{shape.name}", float(shape.size[0]) - away))
    return max(balls, key=lambda item: item[1])


def _extent(shape: Shape) -> float:
    """Radius of the ball around the centre of a shape [m]."""
    if shape.kind is ShapeKind.BOX:
        return 0.5 * float(np.linalg.norm(shape.size))
    return float(shape.size[0]) + (0.5 * float(shape.size[1]) if len(shape.size) > 1 else 0.0)


def _radius(item: pin.GeometryObject) -> float:
    """Radius of a ball around the origin of a geometry [m]."""
    low, high = local_box(item.geometry)
    return float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high))))


def yielding(body: BodyModel, limb: Limb) -> tuple[tuple[str, ...], float]:
    """Segments that give way in what the limb touches, and how deep [m].

    The hand and the forearm, and what corresponds to them: a limb's last two segments where nothing
    hangs on them. None where the limb ends in a sole, or in the middle of another as a knee does.
    """
    last = limb.segments[-2:]
    hanging = any(segment.parent == last[-1] for segment in body.segments)
    if hanging or limb.kind is ContactKind.SOLE or len(last) < 2:
        return (), 0.0
    shapes = body.segment(last[0]).shapes
    radii = [float(shape.size[0]) for shape in shapes if shape.kind is ShapeKind.CAPSULE]
    return last, YIELD * max(radii, default=0.0)


_ALONG = np.array([0.0, 0.5])  # shares of a capsule's axis with a ball, from its middle on


class DeepSamples:
    """Tells which samples of one limb have a ball deep in something.

    The balls are on the axes of the limb's capsules, whose names are its ``shapes``, but for those of the
    segment that makes contact and those that give way in what they touch.
    """

    def __init__(
        self, body: BodyModel, chain: LimbKinematics, samples: LimbSamples, collisions: LimbCollisions
    ) -> None:
        """Place the balls of all samples; the pairs are those of the limb's exact collision test."""
        self._collisions = collisions
        self._centres, radii, shapes = _balls(body, chain, samples.angles, collisions.soft)
        self.shapes = frozenset(shapes)
        round_boxes = [_round_box(item.geometry) for item in collisions.shapes]
        known = np.array([item is not None for item in round_boxes], dtype=bool)
        names = [item.name for item in collisions.shapes]
        first, second = collisions.pairs.T
        numbers = [names.index(name) for name in shapes]
        mine = np.flatnonzero(np.isin(first, numbers) & known[second] & ~np.isin(second, numbers))
        self._others, column = np.unique(second[mine], return_inverse=True)
        solid = [item or (np.zeros(3), 0.0) for item in round_boxes]
        self._half = np.array([half for half, _ in solid])[self._others]
        # Number of the pair of each ball with each other shape, and the sum of their radii.
        self._pair = np.full((len(self._others), len(numbers)), -1, dtype=np.int64)
        self._reach = np.full(self._pair.shape, -np.inf)
        for pair, row in zip(mine.tolist(), column.tolist(), strict=True):
            own = np.array(numbers) == first[pair]
            self._pair[row, own] = pair
            self._reach[row, own] = solid[second[pair]][1] + radii[own]

    def around(self, rotation: FloatArray, origin: FloatArray) -> "Surroundings":
        """What the balls may be in, in the limb's frame, with which the collision test was begun.

        The frame has a rotation (3, 3) to the world and an origin (3,) there [m].
        """
        active = np.append(self._collisions.active, False)[self._pair]
        near = np.flatnonzero(active.any(axis=1))
        turns, places = self._collisions.placements(self._others[near])
        turns = turns.transpose(0, 2, 1) @ rotation
        places = (turns @ ((places - origin) @ rotation)[:, :, None])[:, :, 0]
        reach = np.where(active[near], self._reach[near], -np.inf)
        return Surroundings(turns, places, self._half[near], reach, self._pair[near])

    def pairs(self, around: "Surroundings", rows: IntArray, depth: float) -> IntArray:
        """(n,) number of a pair in which each of (n,) samples is deeper than ``depth`` [m], or -1."""
        numbers = np.full(len(rows), -1, dtype=np.int64)
        others, balls = around.reach.shape
        beyond = around.turns.reshape(-1, 3) @ self._centres[rows].reshape(-1, 3).T
        beyond = beyond.reshape(others, 3, len(rows), balls) - around.places[:, :, None, None]
        np.abs(beyond, out=beyond)
        beyond -= around.half[:, :, None, None]
        largest = np.maximum(np.maximum(beyond[:, 0], beyond[:, 1]), beyond[:, 2])
        np.maximum(beyond, 0.0, out=beyond)
        beyond *= beyond
        squared = beyond[:, 0] + beyond[:, 1] + beyond[:, 2]
        # A ball is deep if its centre is nearer than this, or, where it is negative, further inside.
        least = (around.reach - depth)[:, None]
        deep = (squared < np.maximum(least, 0.0) ** 2) | (largest < np.minimum(least, 0.0))
        other, row, ball = deep.nonzero()
        numbers[row] = around.pair[other, ball]
        return numbers


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Boxes widened by a radius around a limb, ``m`` of them, for ``b`` balls.

    Attributes:
        turns: (m, 3, 3) from the limb's frame to that of the box.
        places: (m, 3) of their centres, seen from the limb's frame in the axes of the box [m].
        half: (m, 3) half sizes [m].
        reach: (m, b) sum of the radii; minus infinity where a ball and a box may touch [m].
        pair: (m, b) number of their pair.
    """

    turns: FloatArray
    places: FloatArray
    half: FloatArray
    reach: FloatArray
    pair: IntArray


def _balls(
    body: BodyModel, chain: LimbKinematics, angles: FloatArray, soft: tuple[str, ...]
) -> tuple[FloatArray, FloatArray, list[str]]:
    """Centres (n, b, 3) in the limb's frame, radii (b,) and shapes of balls along a limb at angles (n, k)."""
    centres, radii, names = list[FloatArray](), list[float](), list[str]()
    for name, turns, places in chain.segment_placements(angles):
        if name in soft or name == chain.limb.segments[-1]:
            continue
        for shape in body.segment(name).shapes:
            if shape.kind is ShapeKind.CAPSULE:
                for share in _ALONG:
                    offset = shape.translation + share * shape.size[1] * shape.rotation[:, 2]
                    centres.append(places + turns @ offset)
                    radii.append(float(shape.size[0]))
                    names.append(f"{name}/{shape.name}")
    placed = np.stack(centres, axis=1) if centres else np.zeros((len(angles), 0, 3))
    return placed, np.array(radii), names


def _round_box(geometry: coal.CollisionGeometry) -> tuple[FloatArray, float] | None:
    """Half sizes and radius of a box, capsule or ball; None for anything else."""
    if isinstance(geometry, coal.Box):
        return np.array(geometry.halfSide), 0.0
    if isinstance(geometry, coal.Capsule):
        return np.array([0.0, 0.0, geometry.halfLength]), float(geometry.radius)
    return (np.zeros(3), float(geometry.radius)) if isinstance(geometry, coal.Sphere) else None
