"""Samples of a limb that are so deep in something that no small move of the joints frees them.

Before a candidate is aligned and tested exactly, balls along the limb at its sample are compared with the
boxes, capsules and balls around it, all candidates at once. Each of these is a box of half sizes ``h``
widened by a radius ``r``, whose distance from a point ``p`` in its frame is, with ``e = |p| - h``,
``|max(e, 0)| + min(max_i e_i, 0) - r``. Other shapes are left to the exact test.
"""

from dataclasses import dataclass

import coal
import numpy as np

from manikin.body import BodyModel, LimbKinematics, ShapeKind
from manikin.contact_planning.candidates import IntArray, Situation
from manikin.contact_planning.collisions import LimbCollisions
from manikin.contact_planning.samples import LimbSamples
from manikin.spatial import FloatArray

_ALONG = np.array([0.0, 0.5])
"""Where the balls are on a capsule's axis, from its middle, over its length: not near the joint before."""


class DeepSamples:
    """Tells which samples of one limb have a ball deep in something.

    The balls are on the axes of the limb's capsules, but for those of the segment that makes contact and
    those that give way in what they touch.

    Attributes:
        shapes: Names of these capsules.
    """

    def __init__(
        self, body: BodyModel, chain: LimbKinematics, samples: LimbSamples, collisions: LimbCollisions
    ) -> None:
        """Place the balls of all samples.

        Args:
            body: The body.
            chain: Its limb.
            samples: Samples of the limb.
            collisions: Its exact collision test, whose pairs these are.
        """
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
        self._half = np.array([np.zeros(3) if item is None else item[0] for item in round_boxes])[
            self._others
        ]
        both = np.array([0.0 if item is None else item[1] for item in round_boxes])
        # Number of the pair of each ball with each other shape, and the sum of their radii.
        self._pair = np.full((len(self._others), len(numbers)), -1, dtype=np.int64)
        self._reach = np.full(self._pair.shape, -np.inf)
        for pair, row in zip(mine.tolist(), column.tolist(), strict=True):
            own = np.array(numbers) == first[pair]
            self._pair[row, own] = pair
            self._reach[row, own] = both[second[pair]] + radii[own]

    def around(self, situation: Situation) -> "Surroundings":
        """What the balls may be in, in the limb's frame; the collision test was begun with the situation."""
        active = np.append(self._collisions.active, False)[self._pair]
        near = np.flatnonzero(active.any(axis=1))
        turns, places = self._collisions.placements(self._others[near])
        turns = turns.transpose(0, 2, 1) @ situation.rotation
        places = (turns @ ((places - situation.origin) @ situation.rotation)[:, :, None])[:, :, 0]
        reach = np.where(active[near], self._reach[near], -np.inf)
        return Surroundings(turns, places, self._half[near], reach, self._pair[near])

    def pairs(self, around: "Surroundings", rows: IntArray, depth: float) -> IntArray:
        """(n,) number of a pair in which a sample is deeper than ``depth`` [m], or -1.

        Args:
            around: See :meth:`around`.
            rows: (n,) samples.
            depth: [m].
        """
        found = np.full(len(rows), -1, dtype=np.int64)
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
        found[row] = around.pair[other, ball]
        return found


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
    centres: list[FloatArray] = []
    radii: list[float] = []
    names: list[str] = []
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
    if isinstance(geometry, coal.Sphere):
        return np.zeros(3), float(geometry.radius)
    return None
