"""Whether one limb of a body touches the scene or the rest of the body."""

from typing import Any

import numpy as np
import pinocchio as pin

from manikin.body import BodyModel, Limb
from manikin.scene import Scene, segment_of
from manikin.scene.collision import collision_parts
from manikin.spatial import FloatArray

TOUCH = 0.002
"""Depth to which a limb may be in an obstacle, so that what it rests on is no collision [m]."""


class LimbCollisions:
    """Collision test of one limb, and what hangs on it, with the scene and the rest of the body.

    A yes or no, found in one call of the engine; distances are those of
    :class:`manikin.scene.Proximity`. A limb wholly inside a mesh that is not convex is not noticed: it
    would have to pass the mesh's surface to get there, where the limb is held. One instance works on
    buffers of its own: use one per thread.
    """

    def __init__(self, body: BodyModel, limb: Limb, scene: Scene, touch: float = TOUCH) -> None:
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
        for number in range(len(outer)):
            self._placed.collisionRequests[number].security_margin = -touch
        self._names = [(names[a], names[b].rsplit("#", 1)[0]) for a, b in outer]
        self._names += [(names[a], names[b]) for a, b in inner]

    def first(self, q: FloatArray) -> tuple[str, str] | None:
        """Names of the first pair that collides at a configuration (nq,), or None.

        Returns:
            (shape of the body, obstacle or shape of the body).
        """
        hit = pin.computeCollisions(self._model, self._data, self._shapes, self._placed, q, True)
        if not hit:
            return None
        results = self._placed.collisionResults
        number = next(number for number, result in enumerate(results) if result.isCollision())
        return self._names[number]


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
