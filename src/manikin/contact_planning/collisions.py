"""Whether one limb of a body touches the scene or the rest of the body."""

from typing import Any

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, Limb, ShapeKind
from manikin.contact import ContactKind
from manikin.scene import Scene, segment_of
from manikin.scene.collision import collision_parts
from manikin.spatial import FloatArray

TOUCH = 0.002
"""Depth to which a limb may be in an obstacle, so that what it rests on is no collision [m]."""
YIELD = 0.8
"""The same for a hand and its wrist in what the hand touches, as a share of the forearm's radius.

The wrist of our shapes is thicker than the hand, so that a palm flat on a wall has it in the wall.
"""


class LimbCollisions:
    """Collision test of one limb, and what hangs on it, with the scene and the rest of the body.

    A yes or no, found in one call of the engine; distances are those of
    :class:`manikin.scene.Proximity`. A limb wholly inside a mesh that is not convex is not noticed: it
    would have to pass the mesh's surface to get there, where the limb is held. One instance works on
    buffers of its own: use one per thread.
    """

    def __init__(self, body: BodyModel, limb: Limb, scene: Scene) -> None:
        self._model = body.pinocchio
        self._data = self._model.createData()
        self._shapes = _with_scene(body, scene)
        moving = _moving_segments(body, limb)
        count = len(body.geometry.geometryObjects)
        names = [item.name for item in self._shapes.geometryObjects]
        own = [number for number, name in enumerate(names[:count]) if segment_of(name) in moving]
        self._shapes.removeAllCollisionPairs()
        outer = [(shape, part) for shape in own for part in range(count, len(names))]
        inner = [(names.index(a), names.index(b)) for a, b in body.collision_pairs]
        inner = [pair for pair in inner if (pair[0] in own) != (pair[1] in own) or set(pair) <= set(own)]
        for pair in outer + inner:
            self._shapes.addCollisionPair(pin.CollisionPair(*pair))
        self._placed = pin.GeometryData(self._shapes)
        self._names = [(names[a], names[b].rsplit("#", 1)[0]) for a, b in outer]
        soft, self._depth = yielding(body, limb)
        self._yielding: dict[str, list[int]] = {}
        for number, (shape, obstacle) in enumerate(self._names):
            self._placed.collisionRequests[number].security_margin = -TOUCH
            if segment_of(shape) in soft:
                self._yielding.setdefault(obstacle, []).append(number)
        self._names += [(names[a], names[b]) for a, b in inner]
        self._touched: str | None = None

    def first(self, q: FloatArray, touched: str | None = None) -> tuple[str, str] | None:
        """Names of the first pair that collides at a configuration (nq,), or None.

        Args:
            q: The configuration.
            touched: Name of the obstacle on which the limb has its contact.

        Returns:
            (shape of the body, obstacle or shape of the body).
        """
        if touched != self._touched:
            self._set_margin(self._touched, TOUCH)
            self._set_margin(touched, max(self._depth, TOUCH))
            self._touched = touched
        if not pin.computeCollisions(self._model, self._data, self._shapes, self._placed, q, True):
            return None
        results = self._placed.collisionResults
        return next(name for name, result in zip(self._names, results, strict=True) if result.isCollision())

    def _set_margin(self, obstacle: str | None, depth: float) -> None:
        for number in self._yielding.get(obstacle or "", ()):
            self._placed.collisionRequests[number].security_margin = -depth


def _with_scene(body: BodyModel, scene: Scene) -> Any:
    """Copy of the body's geometry with the obstacles fixed to the world."""
    shapes = body.geometry.copy()
    for obstacle in scene:
        for number, part in enumerate(collision_parts(obstacle)):
            place = pin.SE3(np.array(part.rotation), np.array(part.translation))
            name = f"{obstacle.name}#{number}"
            shapes.addGeometryObject(pin.GeometryObject(name, 0, 0, place, part.geometry))
    return shapes


def _moving_segments(body: BodyModel, limb: Limb) -> set[str]:
    """Segments of the limb and what hangs on them."""
    moving = set(limb.segments)
    for segment in body.segments:
        if segment.parent in moving:
            moving.add(segment.name)
    return moving


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
