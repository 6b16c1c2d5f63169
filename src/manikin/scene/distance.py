"""Signed distances between the body, itself and the scene, with gradients."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.errors import SceneError
from manikin.numerics.spatial import FloatArray
from manikin.scene.collision import Measured, Meter, collision_parts, pair_meter, part_meter
from manikin.scene.distance_bounds import KnownDistances, PairBounds, PlacedShapes, PlacementReader
from manikin.scene.scene import Scene
from manikin.scene.triangles import IntArray

Pair = tuple[str, str]
Ignored = frozenset[Pair]
NOTHING: Ignored = frozenset()

STRIDE = 4
"""Samples from one broad phase to the next; between them, shapes move too little for most pairs."""
SLACK = 1e-5
"""More than a measured distance may be wrong by [m]: ten times Coal's tolerance."""
WORTHWHILE = 20
"""Pairs that may be near, more than before, from which on a broad phase costs less than measuring them."""
WINDOW = 200
"""Neighbouring samples whose lower bounds one measured distance raises."""
KEPT_PATHS = 64
"""Paths of pairs that are kept along a motion; of 2000 samples they take 25 MB."""


class BodyGeometry(Protocol):
    """Required of a body: kinematics, shapes named ``"segment/shape"``, pairs to check."""

    @property
    def pinocchio(self) -> pin.Model:
        """Kinematic model."""

    @property
    def geometry(self) -> pin.GeometryModel:
        """Collision shapes."""


@dataclass(frozen=True, eq=False)
class ProximityResult:
    """Signed distances of the pairs that are close.

    Attributes:
        distance: (k,) [m], negative in penetration.
        gradient: (k, nv) with respect to the configuration's tangent space.
        pairs: (body shape, obstacle or other body shape) of each row; an obstacle of several pieces may have
            several.
        on_body, on_other: (k, 3) nearest points of both in the world [m].
        normal: (k, 3) unit vector from the body shape to the other.
    """

    distance: FloatArray
    gradient: FloatArray
    pairs: tuple[Pair, ...]
    on_body: FloatArray
    on_other: FloatArray
    normal: FloatArray

    def __len__(self) -> int:
        return len(self.distance)


@dataclass(frozen=True, eq=False)
class ProximitySamples:
    """Close pairs of many configurations, ordered by sample (k,), otherwise as :class:`ProximityResult`."""

    sample: NDArray[np.int64]
    distance: FloatArray
    gradient: FloatArray
    pairs: tuple[Pair, ...]


@dataclass(frozen=True)
class Clearance:
    """The smallest distance found.

    Attributes:
        distance: [m], negative in penetration; infinite when there is no pair.
        pair: (body shape, obstacle or other body shape), or None without pairs.
        sample: Index of the configuration, 0 for a single one.
    """

    distance: float
    pair: Pair | None
    sample: int = 0


class BodyPairs:
    """Pairs of a body's shapes with something else, and what follows from their distances.

    Attributes:
        pairs: (body shape, obstacle or other body shape) of every pair checked.
    """

    pairs: tuple[Pair, ...]
    _sensitivity: FloatArray  # (pairs, nv)

    def __init__(self, body: BodyGeometry) -> None:
        self._model, self._shapes = body.pinocchio, body.geometry
        self._data = self._model.createData()
        self._geometry_data = pin.GeometryData(self._shapes)
        self._masks: dict[Ignored, NDArray[np.bool_]] = {}

    @property
    def nv(self) -> int:
        """Dimension of the gradients."""
        return int(self._model.nv)

    def _jacobian(self, q: FloatArray) -> FloatArray:
        """(6, nv) joint Jacobian at a configuration, to which the shapes are moved."""
        jacobian = pin.computeJointJacobians(self._model, self._data, checked_configuration(self._model, q))
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._geometry_data)
        return jacobian

    def _result(
        self, rows: NDArray[np.int64], jacobian: FloatArray, distance: FloatArray,
        vectors: tuple[FloatArray, FloatArray, FloatArray],
    ) -> ProximityResult:  # fmt: skip
        """Distances (k,) of pairs with their normals and nearest points (k, 3), and their gradients."""
        normal, on_body, on_other = vectors
        wrench = np.hstack([normal, np.cross(on_body, normal)])
        gradient = (wrench @ jacobian) * self._sensitivity[rows]
        names = tuple(self.pairs[row] for row in rows)
        return ProximityResult(distance, gradient, names, on_body, on_other, normal)

    def _considered(self, ignore: Ignored) -> NDArray[np.bool_]:
        if ignore not in self._masks:
            self._masks[ignore] = considered(self.pairs, ignore)
        return self._masks[ignore]


class Proximity(BodyPairs):
    """Distances of every body shape to every obstacle and to other body shapes.

    Distances are exact for primitives and convex mesh pieces, negative by the penetration depth. Closed mesh
    pieces that are not convex give exact clearances and a depth sampled on the body shape; open ones have no
    inside, and where a shape crosses them the depth is that of the worst triangle.

    One instance works on buffers of its own: use one per thread. Results do not depend on earlier queries.
    """

    def __init__(self, body: BodyGeometry, scene: Scene, *, self_collision: bool = True) -> None:
        """Prepare the pairs, those of self-collision as :func:`self_pairs` gives them."""
        super().__init__(body)
        self._reader = PlacementReader(self._geometry_data.oMg)
        objects = list(self._shapes.geometryObjects)
        self._count = len(objects)
        parts = tuple(part for obstacle in scene for part in collision_parts(obstacle))
        outer = [(shape, self._count + part) for part in range(len(parts)) for shape in range(self._count)]
        inner = self_pairs(body) if self_collision else []
        first, second = np.array(outer + inner, dtype=np.int64).reshape(-1, 2).T
        self._bounds = PairBounds(self._shapes, parts, first, second)
        self._first, self._second = first.tolist(), second.tolist()
        self._geometries, self._parts = [item.geometry for item in objects], parts
        # Made when a pair is first measured: most pairs never come near.
        self._meters: list[Meter | None] = [None] * len(self._first)
        names = [item.name for item in objects] + [part.obstacle for part in parts]
        both = zip(self._first, self._second, strict=True)
        self.pairs: tuple[Pair, ...] = tuple((names[a], names[b]) for a, b in both)
        moves = moves_by_shape(self._model, self._shapes, len(parts))
        self._sensitivity = moves[second] - moves[first]
        self._fixed = {
            self._count + number: coal.Transform3s(part.rotation, part.translation)
            for number, part in enumerate(parts)
        }
        self._moving = [coal.Transform3s() for _ in range(self._count)]
        meshes = [isinstance(part.geometry, coal.BVHModelBase) for part in parts]
        self._jumps = [other >= self._count and meshes[other - self._count] for other in self._second]
        self._known, self._last_near = KnownDistances(), 0

    def evaluate(self, q: FloatArray, activation: float = 0.1, ignore: Ignored = NOTHING) -> ProximityResult:
        """Measure every pair closer than ``activation``, in the order of :attr:`pairs`.

        The gradient of a distance is ``n^T (J_2 - J_1)``, with ``n`` from the body shape to
        the other and the Jacobians taken at the nearest points.

        Args:
            q: (nq,) configuration; SceneError if it is not a finite vector.
            activation: [m]; farther pairs are left out.
            ignore: (segment, obstacle) or (segment, segment) pairs to leave out, in any order; a full shape
                name may stand for its segment.
        """
        jacobian = self._jacobian(q)
        placements = self._placements()
        near, measured = self._near(placements, activation, self._considered(ignore))
        kept = [row for row, item in enumerate(measured) if item[0] < activation]
        distance = np.array([measured[row][0] for row in kept])
        vectors = (np.array([measured[row][part] for row in kept]).reshape(-1, 3) for part in (1, 2, 3))
        normal, on_body, on_other = vectors
        return self._result(near[kept], jacobian, distance, (normal, on_body, on_other))

    def evaluate_over(
        self, q_samples: FloatArray, activation: float = 0.1, ignore: Ignored | Sequence[Ignored] = NOTHING
    ) -> ProximitySamples:
        """Measure every close pair of (n, nq) configurations, see :meth:`evaluate_placed`.

        SceneError if the number of ignore sets is not n, or a sample is not a finite vector.
        """
        return self.evaluate_placed(self.place(q_samples), activation, ignore)

    def evaluate_placed(
        self, placed: PlacedShapes, activation: float = 0.1, ignore: Ignored | Sequence[Ignored] = NOTHING,
        known: KnownDistances | None = None,
    ) -> ProximitySamples:  # fmt: skip
        """Measure every close pair of many configurations whose kinematics are known.

        A pair that was found far is measured again only when its shapes have moved so much that it may be
        near; the result is the same as if it were measured at every sample.

        Args:
            placed: Shapes and Jacobians of n configurations.
            activation: [m]; farther pairs are left out.
            ignore: One set for all samples, or n sets.
            known: Distances of an earlier evaluation of a similar motion; those of this one are kept there.
        """
        rotations, translations = _split(placed.placements)
        corners = self._bounds.corners(rotations, translations)
        lower = None if known is None else known.lower(self._bounds, corners)
        if lower is None:
            lower = np.full((len(corners), len(self.pairs)), -np.inf)
            lower[::STRIDE] = self._bounds.lower(rotations[::STRIDE], translations[::STRIDE])
        considered = self._considered_over(ignore, len(corners))
        doubtful = considered & (lower < activation) & (lower > -np.inf)
        self._bounds.tighten(lower, doubtful, rotations, translations)
        moved = self._bounds.moved(corners[:-1], corners[1:])
        rows: list[tuple[int, int, float]] = []
        vectors: list[float] = []
        for sample, now in enumerate(lower):
            if sample > 0:
                np.maximum(now, lower[sample - 1] - moved[sample - 1], out=now)
            pairs = np.flatnonzero((now < activation) & considered[sample]).tolist()
            measured = self._measure(pairs, rotations[sample], translations[sample], activation)
            for pair, (distance, normal, on_body, _) in zip(pairs, measured, strict=True):
                now[pair] = distance - SLACK
                if distance < activation:
                    rows.append((sample, pair, distance))
                    vectors += normal.tolist() + on_body.tolist()
        if known is not None:
            known.keep(corners, lower)
        numbers, pair = (np.array([row[part] for row in rows], dtype=np.int64) for part in (0, 1))
        normals, points = np.array(vectors).reshape(-1, 2, 3).transpose(1, 0, 2)
        wrench = np.hstack([normals, np.cross(points, normals)])
        gradient = (wrench[:, None, :] @ placed.jacobians[numbers])[:, 0] * self._sensitivity[pair]
        names = tuple(self.pairs[item] for item in pair)
        return ProximitySamples(numbers, np.array([row[2] for row in rows]), gradient, names)

    def minimum(self, q: FloatArray, ignore: Ignored = NOTHING) -> Clearance:
        """Smallest signed distance of all pairs at ``q``; see :meth:`evaluate` for ``ignore``."""
        placements = self._placements_at(checked_configuration(self._model, q))
        lower = np.where(self._considered(ignore), self._lower(placements), np.inf)
        best = Clearance(np.inf, None)
        for index in np.argsort(lower, kind="stable").tolist():
            if lower[index] == np.inf or lower[index] > max(best.distance, 0.0):
                break
            distance = self._measure([index], *_split(placements), -np.inf)[0][0]
            if distance < best.distance:
                best = Clearance(distance, self.pairs[index])
        return best

    def minimum_over(
        self, q_samples: FloatArray, ignore: Ignored | Sequence[Ignored] = NOTHING, tolerance: float = 1e-6
    ) -> Clearance:
        """Smallest signed distance over (n, nq) configurations, see :meth:`MotionDistances.minimum`."""
        return self.along(q_samples).minimum(ignore, tolerance)

    def along(self, q_samples: FloatArray) -> "MotionDistances":
        """Distances along a motion of (n, nq) configurations. Raises as :meth:`evaluate_over`."""
        return MotionDistances(self, q_samples)

    def place(self, q_samples: FloatArray) -> PlacedShapes:
        """Shapes and Jacobians of configurations (n, nq); SceneError if one is not a finite vector."""
        jacobians = np.empty((len(q_samples), 6, self.nv))
        placements = np.empty((len(q_samples), self._count, 4, 4))
        for sample, q in enumerate(q_samples):
            jacobians[sample] = self._jacobian(q)
            self._reader.read(placements[sample])
        return PlacedShapes(placements, jacobians)

    def _placements_at(self, q: FloatArray) -> FloatArray:
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._geometry_data, q)
        return self._placements()

    def _placements(self) -> FloatArray:
        """(shapes, 4, 4) shape-to-world transforms, as last updated."""
        out = np.empty((self._count, 4, 4))
        self._reader.read(out)
        return out

    def _near(
        self, placements: FloatArray, activation: float, considered: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int64], list[Measured]]:
        """Pairs that may be near, and what is measured of them.

        As a search moves little from query to query, what was known of the pairs mostly tells which are far.
        """
        corners = self._bounds.corners(*_split(placements[None]))
        known = self._known.lower(self._bounds, corners)
        lower = self._lower(placements) if known is None else known[0]
        near = np.flatnonzero((lower < activation) & considered)
        if known is not None and len(near) > self._last_near + WORTHWHILE:
            lower = np.maximum(lower, self._lower(placements))
            near = np.flatnonzero((lower < activation) & considered)
        measured = self._measure(near.tolist(), *_split(placements), activation)
        lower[near] = np.array([item[0] for item in measured]) - SLACK
        self._known.keep(corners, lower[None])
        self._last_near = len(near)
        return near, measured

    def _lower(self, placements: FloatArray) -> FloatArray:
        return self._bounds.lower(*_split(placements[None]))[0]

    def _considered_over(self, ignore: Ignored | Sequence[Ignored], number: int) -> NDArray[np.bool_]:
        if isinstance(ignore, (frozenset, set)):
            return np.broadcast_to(self._considered(frozenset(ignore)), (number, len(self.pairs)))
        if len(ignore) != number:
            problem = f"ignore has {len(ignore)} sets for {number} samples"
            raise SceneError(f"{problem}; valid: one set, or one each")
        return np.array([self._considered(frozenset(item)) for item in ignore])

    def _measure(
        self, indices: list[int], rotations: FloatArray, translations: FloatArray, within: float
    ) -> list[Measured]:
        """Distance and, where it is below ``within``, normal and nearest points of each pair.

        The vectors are buffers that the next measurement of the same pair overwrites.
        """
        transforms = dict(self._fixed)
        measured = []
        for index in indices:
            shape, other = self._first[index], self._second[index]
            for key in (shape, other):
                if key not in transforms:
                    # The shape's own transform: making new ones takes longer than many a distance.
                    transforms[key] = self._moving[key]
                    transforms[key].setTransform(rotations[key], translations[key])
            meter = self._meters[index] or self._meter(index)
            measured.append(meter(transforms[shape], transforms[other], within))
        return measured

    def _meter(self, index: int) -> Meter:
        """Measuring function of a pair, made for the first time."""
        first, other = self._geometries[self._first[index]], self._second[index]
        inner = other < self._count
        meter = self._meters[index] = (
            pair_meter(first, self._geometries[other]) if inner
            else part_meter(first, self._parts[other - self._count])
        )  # fmt: skip
        return meter


class MotionDistances:
    """Smallest distances along a motion. What one query measures, the next ones know.

    Every (sample, pair) has a lower bound, from covering spheres at first; measuring one of them raises the
    bounds of its pair at other samples, because a distance changes no faster than the shape moves. The depth
    in a mesh that is not convex may jump: it raises none. Measures with the buffers of its ``proximity``.

    Attributes:
        pairs: (body shape, obstacle or other body shape) of every pair.
    """

    pairs: tuple[Pair, ...]

    def __init__(self, proximity: Proximity, q_samples: FloatArray) -> None:
        self._proximity, self._bounds, self.pairs = proximity, proximity._bounds, proximity.pairs
        placements = np.empty((len(q_samples), proximity._count, 4, 4))
        for sample, q in enumerate(q_samples):
            placements[sample] = proximity._placements_at(checked_configuration(proximity._model, q))
        self._rotations, self._translations = _split(placements)
        lower = self._bounds.lower(self._rotations, self._translations)
        self._lower = np.where(lower > 0.0, lower, -np.inf)
        self._measured = np.zeros(lower.shape, dtype=np.bool_)
        self._paths: dict[int, FloatArray] = {}

    def minimum(
        self, ignore: Ignored | Sequence[Ignored] = NOTHING, tolerance: float = 1e-6,
        rows: IntArray | None = None,
    ) -> Clearance:  # fmt: skip
        """Smallest signed distance, exact to ``tolerance`` [m], at all samples or at ``rows`` (k,) of them.

        Only what could still be the minimum is measured, best first.

        Args:
            ignore: As for :meth:`Proximity.evaluate_over`, one set for each of all samples where many.

        Returns:
            With the number of the sample in the whole motion.
        """
        considered = self._proximity._considered_over(ignore, len(self._lower))
        samples = np.arange(len(self._lower)) if rows is None else np.asarray(rows, dtype=np.int64)
        considered, measured = considered[samples], self._measured[samples]
        lower, best = np.where(considered, self._lower[samples], np.inf), Clearance(np.inf, None)
        known = np.where(measured, lower, np.inf)
        if np.isfinite(known).any():
            row, pair = divmod(int(np.argmin(known)), known.shape[1])
            best = Clearance(float(known[row, pair]), self.pairs[pair], int(samples[row]))
        lower[measured] = np.inf
        least = lower.min(axis=0, initial=np.inf).tolist()
        queue = [(bound, pair) for pair, bound in enumerate(least) if bound < np.inf]
        heapq.heapify(queue)
        while queue and queue[0][0] < best.distance - tolerance:
            _, pair = heapq.heappop(queue)
            column = lower[:, pair]
            row = int(np.argmin(column))
            sample = int(samples[row])
            distance = self._measure(sample, pair)
            if distance < best.distance:
                best = Clearance(distance, self.pairs[pair], sample)
            np.maximum(column, self._lower[samples, pair], out=column)
            column[row] = np.inf
            heapq.heappush(queue, (float(column.min()), pair))
        return best

    def _measure(self, sample: int, pair: int) -> float:
        """Distance of a pair at a sample [m]; raises the bounds of the pair."""
        place = self._rotations[sample], self._translations[sample]
        distance = float(self._proximity._measure([pair], *place, -np.inf)[0][0])
        if distance >= 0.0 or not self._proximity._jumps[pair]:
            # Far from the sample the shape has moved too much for the bound to say anything.
            near = slice(max(0, sample - WINDOW), sample + WINDOW + 1)
            path = self._path(pair)
            steps = path[near] - path[sample]
            bound = distance - np.sqrt(np.einsum("nci,nci->nc", steps, steps).max(axis=1))
            lower = self._lower[near, pair]
            np.maximum(lower, bound, out=lower, where=~self._measured[near, pair])
        self._lower[sample, pair], self._measured[sample, pair] = distance, True
        return distance

    def _path(self, pair: int) -> FloatArray:
        if pair not in self._paths:
            if len(self._paths) >= KEPT_PATHS:
                self._paths.clear()
            self._paths[pair] = self._bounds.path(pair, self._rotations, self._translations)
        return self._paths[pair]


def _split(placements: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations (..., 3, 3) and translations (..., 3) of transforms (..., 4, 4)."""
    return placements[..., :3, :3], placements[..., :3, 3]


def segment_of(shape_name: str) -> str:
    """Segment that carries the shape ``"segment/shape"``."""
    return shape_name.split("/", 1)[0]


def checked_configuration(model: pin.Model, q: FloatArray) -> FloatArray:
    """Return ``q``, or raise a SceneError if it is not a finite vector of the model's size.

    A NaN would otherwise pass for "nothing is near".
    """
    q = np.asarray(q, dtype=np.float64)
    if q.shape != (model.nq,):
        raise SceneError(f"configuration has shape {q.shape}; valid: ({model.nq},)")
    if not np.isfinite(q).all():
        raise SceneError(f"configuration has {q[~np.isfinite(q)][0]} in it; valid: finite numbers")
    return q


def considered(pairs: Sequence[Pair], ignore: Ignored) -> NDArray[np.bool_]:
    """(pairs,) False where a pair, by shape or segment and in either order, is in ``ignore``."""
    return np.array([ignore.isdisjoint(_names_of(pair)) for pair in pairs], dtype=bool)


@lru_cache(maxsize=100_000)
def _names_of(pair: Pair) -> Ignored:
    """The pair by shapes and segments, in both orders."""
    first, second = ((name, segment_of(name)) for name in pair)
    return frozenset(names for a in first for b in second for names in ((a, b), (b, a)))


def self_pairs(body: BodyGeometry) -> list[tuple[int, int]]:
    """Indices of the body shapes to check against each other, SceneError if a pair names none of the body.

    They are its ``collision_pairs``, of shape names or geometry indices, or else those of the geometry.
    """
    given = getattr(body, "collision_pairs", None)
    if given is None:
        given = [(int(pair.first), int(pair.second)) for pair in body.geometry.collisionPairs]
    indices = {item.name: number for number, item in enumerate(body.geometry.geometryObjects)}
    return [(_shape_index(a, indices), _shape_index(b, indices)) for a, b in given]


def _shape_index(key: str | int, indices: dict[str, int]) -> int:
    number = indices.get(key, -1) if isinstance(key, str) else int(key)
    if not 0 <= number < len(indices):
        valid = ", ".join(indices) if isinstance(key, str) else f"0 to {len(indices) - 1}"
        raise SceneError(f"collision pair names shape {key!r}; valid: {valid}")
    return number


def moves_by_shape(model: pin.Model, shapes: pin.GeometryModel, parts: int) -> FloatArray:
    """(shapes + parts, nv) 1 where a velocity coordinate moves the shape; parts never move."""
    joints = [item.parentJoint for item in shapes.geometryObjects] + [0] * parts
    return moves_by_joint(model)[joints]


def moves_by_joint(model: pin.Model) -> FloatArray:
    """(joints, nv) 1 where a velocity coordinate moves the joint; the world, joint 0, never moves."""
    table = np.zeros((model.njoints, model.nv))
    for joint in range(1, model.njoints):
        start, width = model.idx_vs[joint], model.nvs[joint]
        table[joint] = table[model.parents[joint]]
        table[joint, start : start + width] = 1.0
    return table
