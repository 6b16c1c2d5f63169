"""Distances between spheres that contain the body and the scene ([Qiu2012]_ 6.2.2, Appendix F)."""

from collections.abc import Mapping, Sequence

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
from manikin.scene.mesh import IntArray
from manikin.scene.obstacle import HalfSpace, Obstacle, Plane
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
        self,
        body: BodyGeometry,
        scene: Scene,
        *,
        self_collision: bool = True,
        count: int | Mapping[str, int] | None = None,
    ) -> None:
        """Cover the body and the scene.

        Args:
            body: As for :class:`manikin.scene.Proximity`.
            scene: Obstacles.
            self_collision: Whether to check the body against itself.
            count: Spheres of every shape and obstacle, or by name of a shape or obstacle;
                4 per body shape and 20 per obstacle for those not named.

        Raises:
            SceneError: If a count is not a whole number >= 1.
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
        self._spheres = _Spheres(list(self.body_covers.values()))
        self._targets = _Targets(flats, solids, [self.obstacle_covers[item.name] for item in solids])
        self._column_starts: IntArray = np.concatenate(
            [self._targets.starts, self._targets.size + self._spheres.starts]
        )
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
        centres, gaps, least = self._gaps()
        rows = np.flatnonzero((least < activation) & self._considered(ignore))
        ends = [self._closest(int(row), centres, gaps) for row in rows]
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
        """Body centres, gaps of every body sphere to every target, and the least per pair."""
        matrices = np.array([item.homogeneous for item in self._geometry_data.oMg])
        centres = self._spheres.placed(matrices)
        radii = self._spheres.radii
        gaps = np.hstack([self._targets.gaps(centres, radii), _sphere_gaps(centres, radii, centres, radii)])
        least = np.minimum.reduceat(
            np.minimum.reduceat(gaps, self._spheres.starts, axis=0), self._column_starts, axis=1
        )
        return centres, gaps, least[self._first, self._second]

    def _closest(self, row: int, centres: FloatArray, gaps: FloatArray) -> tuple[FloatArray, ...]:
        """Normal from the body sphere to the target and the nearest point on each."""
        mine = self._spheres.block(int(self._first[row]))
        second = int(self._second[row])
        inner = second - len(self._targets.starts)
        if inner < 0:
            theirs = self._targets.block(second)
        else:
            own = self._spheres.block(inner)
            theirs = slice(self._targets.size + own.start, self._targets.size + own.stop)
        block = gaps[mine, theirs]
        at, to = np.unravel_index(int(np.argmin(block)), block.shape)
        sphere, target = mine.start + int(at), theirs.start + int(to)
        centre, radius = centres[sphere], self._spheres.radii[sphere]
        if inner < 0:
            normal, on_other = self._targets.toward(target, centre)
        else:
            other = target - self._targets.size
            normal = direction(centres[other] - centre)
            on_other = centres[other] - self._spheres.radii[other] * normal
        return normal, centre + radius * normal, on_other


class _Groups:
    """Consecutive blocks of given sizes."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self._ends: IntArray = np.cumsum(np.array(sizes, dtype=np.int64))
        self.starts: IntArray = self._ends - np.array(sizes, dtype=np.int64)
        self.size = int(sum(sizes))

    def block(self, number: int) -> slice:
        return slice(int(self.starts[number]), int(self._ends[number]))


class _Spheres(_Groups):
    """The body's spheres, grouped by shape."""

    def __init__(self, covers: Sequence[SphereCover]) -> None:
        sizes = [len(item) for item in covers]
        super().__init__(sizes)
        self._local = np.vstack([item.centres for item in covers])
        self._owner = np.repeat(np.arange(len(covers)), sizes)
        self.radii = np.concatenate([item.radii for item in covers])

    def placed(self, matrices: FloatArray) -> FloatArray:
        """(k, 3) centres in the world, of (shapes, 4, 4) transforms."""
        owner = matrices[self._owner]
        return np.einsum("kij,kj->ki", owner[:, :3, :3], self._local) + owner[:, :3, 3]


class _Targets(_Groups):
    """Fixed targets: one column per plane or half-space, then one per obstacle sphere."""

    def __init__(
        self, flats: Sequence[Obstacle], solids: Sequence[Obstacle], covers: Sequence[SphereCover]
    ) -> None:
        super().__init__([1] * len(flats) + [len(item) for item in covers])
        self._flat_count = len(flats)
        self._two_sided = np.array([isinstance(item.shape, Plane) for item in flats], dtype=bool)
        planes = [item.world_plane for item in flats]
        self._normals = np.array([normal for normal, _ in planes]).reshape(-1, 3)
        self._offsets = np.array([offset for _, offset in planes])
        placed = [item.to_world(cover.centres) for item, cover in zip(solids, covers, strict=True)]
        self._centres = np.vstack([np.zeros((0, 3)), *placed])
        self._radii = np.concatenate([np.zeros(0), *(cover.radii for cover in covers)])

    def gaps(self, centres: FloatArray, radii: FloatArray) -> FloatArray:
        """(k, size) gaps of body spheres."""
        height = centres @ self._normals.T - self._offsets
        height = np.where(self._two_sided, np.abs(height), height) - radii[:, None]
        return np.hstack([height, _sphere_gaps(centres, radii, self._centres, self._radii)])

    def toward(self, target: int, centre: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Direction from a centre to the target, and the target's nearest point."""
        if target >= self._flat_count:
            sphere = target - self._flat_count
            normal = direction(self._centres[sphere] - centre)
            return normal, self._centres[sphere] - self._radii[sphere] * normal
        height = float(self._normals[target] @ centre - self._offsets[target])
        side = -1.0 if self._two_sided[target] and height < 0.0 else 1.0
        return -side * self._normals[target], centre - height * self._normals[target]


def _sphere_gaps(
    centres: FloatArray, radii: FloatArray, others: FloatArray, other_radii: FloatArray
) -> FloatArray:
    """(k, m) distances between spheres (F.1), coordinate by coordinate: no (k, m, 3) array."""
    squared = np.subtract.outer(centres[:, 0], others[:, 0]) ** 2
    squared += np.subtract.outer(centres[:, 1], others[:, 1]) ** 2
    squared += np.subtract.outer(centres[:, 2], others[:, 2]) ** 2
    gaps = np.sqrt(squared, out=squared)
    gaps -= np.add.outer(radii, other_radii)
    return gaps


def _shape_cover(geometry: coal.CollisionGeometry, count: int) -> SphereCover:
    shape, centre = shape_of(geometry)
    spheres = cover(shape, count=count)
    return SphereCover(spheres.centres + centre, spheres.radii, spheres.overshoot)


def _count(count: int | Mapping[str, int] | None, name: str, default: int) -> int:
    if isinstance(count, Mapping):
        return count.get(name, default)
    return default if count is None else count
