"""Distances between spheres that contain the body and the scene ([Qiu2012]_ 6.2.2, Appendix F)."""

from collections.abc import Mapping

import coal
import numpy as np
import pinocchio as pin

from manikin.numerics.spatial import FloatArray
from manikin.scene.collision import direction, shape_of
from manikin.scene.covering import SphereCover, cover
from manikin.scene.distance import (
    NOTHING,
    BodyGeometry,
    BodyPairs,
    Clearance,
    Ignored,
    Pair,
    ProximityResult,
    checked_configuration,
    moves_by_shape,
    self_pairs,
)
from manikin.scene.obstacle import HalfSpace, Plane
from manikin.scene.scene import Scene

BODY_SPHERES = 4
"""Spheres per body shape when nothing else is said."""
OBSTACLE_SPHERES = 20
"""Spheres per obstacle when nothing else is said ([Qiu2012]_ Table 7.2 uses 10 to 21)."""


class SphereProximity(BodyPairs):
    """Distances of the closest two spheres of each pair.

    Its interface is that of :class:`manikin.scene.Proximity`; its gradient is continuous as long as the same
    two spheres are the closest. Each body shape and each obstacle is covered by spheres; planes and
    half-spaces are kept as they are. A distance is never larger than the true clearance, and negative where
    the shapes touch; how negative says nothing about their true depth. Use one instance per thread.

    Attributes:
        pairs: (body shape, obstacle or other body shape) of every pair checked.
        body_covers: Spheres of each body shape, in the shape's frame.
        obstacle_covers: Spheres of each obstacle with an end, in the obstacle's frame.
    """

    def __init__(
        self, body: BodyGeometry, scene: Scene, *, self_collision: bool = True,
        count: int | Mapping[str, int] | None = None,
    ) -> None:  # fmt: skip
        """Cover the body, as for :class:`manikin.scene.Proximity`, and the scene.

        Args:
            count: Spheres of every shape and obstacle, or by name of a shape or obstacle, whole numbers >= 1;
                4 per body shape and 20 per obstacle for those not named.
        """
        super().__init__(body)
        objects = list(self._shapes.geometryObjects)
        flats = [item for item in scene if isinstance(item.shape, (Plane, HalfSpace))]
        solids = [item for item in scene if not isinstance(item.shape, (Plane, HalfSpace))]
        self.body_covers: dict[str, SphereCover] = {
            item.name: _shape_cover(item.geometry, _count(count, item.name, BODY_SPHERES)) for item in objects
        }
        self.obstacle_covers: dict[str, SphereCover] = {
            item.name: cover(item.shape, count=_count(count, item.name, OBSTACLE_SPHERES)) for item in solids
        }
        own, theirs = list(self.body_covers.values()), list(self.obstacle_covers.values())
        # Rows are body spheres; columns one per plane or half-space, obstacle sphere, then body sphere.
        self._rows = np.cumsum([0, *map(len, own)])
        self._columns = np.cumsum([0, *[1] * len(flats), *map(len, theirs), *map(len, own)])
        self._two_sided = np.array([isinstance(item.shape, Plane) for item in flats], dtype=bool)
        planes = [item.world_plane for item in flats]
        self._normals = np.array([normal for normal, _ in planes]).reshape(-1, 3)
        self._offsets = np.array([offset for _, offset in planes])
        placed = [item.to_world(spheres.centres) for item, spheres in zip(solids, theirs, strict=True)]
        self._fixed = np.vstack([np.zeros((0, 3)), *placed])
        self._local = np.vstack([item.centres for item in own])
        self._owner = np.repeat(np.arange(len(own)), list(map(len, own)))
        self._own_radii = np.concatenate([item.radii for item in own])
        self._radii = np.concatenate([*(item.radii for item in theirs), self._own_radii])
        names = [item.name for item in objects]
        others = [item.name for item in (*flats, *solids)] + names
        columns = {item.name: column for column, item in enumerate((*flats, *solids))}
        outer = [(shape, columns[item.name]) for item in scene for shape in range(len(objects))]
        inner = self_pairs(body) if self_collision else []
        table = np.array(outer + [(a, len(others) - len(names) + b) for a, b in inner], dtype=np.int64)
        self._first, self._second = table.reshape(-1, 2).T
        self.pairs: tuple[Pair, ...] = tuple((names[a], others[b]) for a, b in table.reshape(-1, 2))
        moves = moves_by_shape(self._model, self._shapes, 0)
        fixed = np.zeros((len(flats) + len(solids), self._model.nv))
        self._sensitivity = np.vstack([fixed, moves])[self._second] - moves[self._first]

    def evaluate(self, q: FloatArray, activation: float = 0.1, ignore: Ignored = NOTHING) -> ProximityResult:
        """Measure the closest two spheres of every pair, as :meth:`manikin.scene.Proximity.evaluate`.

        The gradient is ``(J_i - J_j)^T D / |D|`` with ``D = p_i - p_j`` between the centres
        ([Qiu2012]_ F.4), and ``J_i^T D / |D|`` for an obstacle (F.5).
        """
        jacobian = self._jacobian(q)
        spheres, gaps, least = self._gaps()
        rows = np.flatnonzero((least < activation) & self._considered(ignore))
        ends = [self._closest(int(row), spheres, gaps) for row in rows]
        normal, on_body, on_other = (np.array([end[i] for end in ends]).reshape(-1, 3) for i in range(3))
        return self._result(rows, jacobian, least[rows], (normal, on_body, on_other))

    def minimum(self, q: FloatArray, ignore: Ignored = NOTHING) -> Clearance:
        """Smallest sphere distance of all pairs at ``q``."""
        q = checked_configuration(self._model, q)
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._geometry_data, q)
        least = np.where(self._considered(ignore), self._gaps()[2], np.inf)
        if not len(least) or np.isinf(least.min()):
            return Clearance(np.inf, None)
        row = int(np.argmin(least))
        return Clearance(float(least[row]), self.pairs[row])

    def _gaps(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Centres of all spheres, gaps of every body sphere to every target, and the least per pair."""
        owner = np.array([item.homogeneous for item in self._geometry_data.oMg])[self._owner]
        centres = np.einsum("kij,kj->ki", owner[:, :3, :3], self._local) + owner[:, :3, 3]
        height = centres @ self._normals.T - self._offsets
        height = np.where(self._two_sided, np.abs(height), height) - self._own_radii[:, None]
        spheres = np.vstack([self._fixed, centres])
        # Coordinate by coordinate (F.1): no array of all vectors between spheres.
        apart = np.sqrt(sum(np.subtract.outer(centres[:, i], spheres[:, i]) ** 2 for i in range(3)))
        gaps = np.hstack([height, apart - np.add.outer(self._own_radii, self._radii)])
        least = np.minimum.reduceat(gaps, self._rows[:-1], axis=0)
        least = np.minimum.reduceat(least, self._columns[:-1], axis=1)
        return spheres, gaps, least[self._first, self._second]

    def _closest(self, row: int, spheres: FloatArray, gaps: FloatArray) -> tuple[FloatArray, ...]:
        """Normal from the body sphere to the target and the nearest point on each."""
        first, second = self._first[row], self._second[row]
        rows, columns = slice(*self._rows[first : first + 2]), slice(*self._columns[second : second + 2])
        block = gaps[rows, columns]
        at, to = np.unravel_index(int(np.argmin(block)), block.shape)
        target = int(columns.start + to)
        own = len(self._fixed) + int(rows.start + at)
        centre, sphere = spheres[own], target - len(self._offsets)
        if sphere >= 0:
            normal = direction(spheres[sphere] - centre)
            on_other = spheres[sphere] - self._radii[sphere] * normal
        else:
            height = float(self._normals[target] @ centre - self._offsets[target])
            side = -1.0 if self._two_sided[target] and height < 0.0 else 1.0
            normal, on_other = -side * self._normals[target], centre - height * self._normals[target]
        return normal, centre + self._radii[own] * normal, on_other


def _shape_cover(geometry: coal.CollisionGeometry, count: int) -> SphereCover:
    shape, centre = shape_of(geometry)
    spheres = cover(shape, count=count)
    return SphereCover(spheres.centres + centre, spheres.radii, spheres.overshoot)


def _count(count: int | Mapping[str, int] | None, name: str, default: int) -> int:
    if isinstance(count, Mapping):
        return count.get(name, default)
    return default if count is None else count
