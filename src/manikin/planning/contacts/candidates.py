"""Samples of a limb whose effector is near a surface of the scene: steps 1 and 2 of a request."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from manikin.body import Configuration, Limb, limb_placement
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.spatial import FloatArray
from manikin.scene import Surface
from manikin.scene.surface import walls_of

IntArray = NDArray[np.int64]

_ROUNDING = np.float32(1e-6)  # of a cosine in single precision


@dataclass(frozen=True, eq=False)
class Situation:
    """Place of a limb and what it is asked for.

    Attributes:
        rotation: (3, 3) from the limb's frame to the world's.
        origin: (3,) of the limb's frame in the world [m].
        reaction: (3,) unit direction in the world in which the scene shall push the limb.
    """

    state: Configuration
    limb: Limb
    rotation: FloatArray
    origin: FloatArray
    reaction: FloatArray

    @staticmethod
    def of(state: Configuration, limb: Limb, reaction: FloatArray) -> "Situation":
        """Situation of a limb of a placed body."""
        return Situation(state, limb, *limb_placement(state, limb), reaction)

    def to_world(self, points: FloatArray) -> FloatArray:
        """Map (n, 3) points of the limb's frame to the world [m]."""
        return points @ self.rotation.T + self.origin


@dataclass(frozen=True, eq=False)
class Candidates:
    """Samples near surfaces, one row per sample and surface.

    Attributes:
        samples: (n,) rows of the limb's samples.
        surfaces: (n,) indices of the surfaces.
        points: (n, 3) effector positions projected on their surface, in the world [m].
        normals: (n, 3) unit normals of the surfaces in the world.
        products: (n, 3, 3) ``J J^T`` in the limb's frame [m^2].
        manipulability: (n,) [m^3].
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
    """

    samples: IntArray
    surfaces: IntArray
    points: FloatArray
    normals: FloatArray
    products: FloatArray
    manipulability: FloatArray
    rotations: FloatArray

    def __len__(self) -> int:
        return len(self.samples)

    def on(self, surfaces: IntArray) -> "Candidates":
        """Those on some surfaces, by their indices."""
        rows = np.flatnonzero(np.isin(self.surfaces, surfaces))
        return Candidates(**{item.name: getattr(self, item.name)[rows] for item in fields(self)})


class SurfaceTable:
    """The surfaces of a scene as arrays, so that all are tested at once.

    Attributes:
        normals: (m, 3) their unit normals.
        offsets: (m,) of their planes along the normals [m].
        group: (m,) number of the direction that a surface has for its normal.
        frames: (g, 3, 3) of each direction the normal and two axes in its planes.
        extents: (m, 3, 2) least and largest coordinates of the polygons along the axes of their frames [m].
        side_low: (m, 2) smallest coordinates of the polygons along these axes [m].
        side_high: (m, 2) largest ones.
        filled: (m,) whether a polygon is all of the rectangle between them, as the faces of boxes are.
    """

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        self.surfaces = tuple(surfaces)
        self.normals = np.array([item.normal for item in surfaces]).reshape(-1, 3)
        self.offsets = np.array([item.polygon[0] @ item.normal for item in surfaces])
        self._low = np.array([item.polygon.min(axis=0) for item in surfaces]).reshape(-1, 3)
        self._high = np.array([item.polygon.max(axis=0) for item in surfaces]).reshape(-1, 3)
        self._convex, self._walls, self._wall_offsets = walls_of(surfaces)
        # Of normals the faces of boxes have few; sideways the surfaces are bounded.
        _, first, group = np.unique(np.round(self.normals, 9), axis=0, return_index=True, return_inverse=True)
        self.group: IntArray = group.ravel()
        sides = np.array([self.surfaces[number].rotation[:, :2].T for number in first]).reshape(-1, 2, 3)
        self.frames = np.concatenate([self.normals[first][:, None], sides], axis=1)
        shadows = [
            item.polygon @ sides[number].T for item, number in zip(self.surfaces, self.group, strict=True)
        ]
        self.side_low = np.array([item.min(axis=0) for item in shadows]).reshape(-1, 2)
        self.side_high = np.array([item.max(axis=0) for item in shadows]).reshape(-1, 2)
        level = np.repeat(self.offsets[:, None, None], 2, axis=2)
        sideways = np.stack([self.side_low, self.side_high], axis=2)
        self.extents = np.concatenate([level, sideways], axis=1)
        areas = np.array([item.area for item in self.surfaces])
        self.filled: NDArray[np.bool_] = areas >= np.prod(self.side_high - self.side_low, axis=1) * (1 - 1e-9)

    def within_reach(self, situation: Situation, samples: LimbSamples, tolerance: float) -> IntArray:
        """Surfaces that may meet the reach of a limb, give or take a tolerance [m] (step 1); none is missed.

        The box of the polygon must meet the ball of the reach, and, along the normal and the sides of
        the polygon, the extents of the hull.
        """
        hull, radius = samples.hull
        away = np.clip(situation.origin, self._low, self._high) - situation.origin
        near = np.flatnonzero(np.einsum("mi,mi->m", away, away) <= (radius + tolerance) ** 2)
        # Extents of the hull along the normals, then the sides, of their directions, from the limb's origin.
        for axis in range(3):
            along = self.frames[self.group[near], axis]
            extents, offset = (along @ situation.rotation) @ hull.T, along @ situation.origin
            low, high = self.extents[near, axis].T - offset
            near = near[(high >= extents.min(axis=1) - tolerance) & (low <= extents.max(axis=1) + tolerance)]
        return near

    def over(self, points: FloatArray, numbers: IntArray) -> NDArray[np.bool_]:
        """(n,) whether world points (n, 3) [m] project into the polygons of their surfaces, (n,) indices."""
        beyond = np.einsum("nei,ni->ne", self._walls[numbers], points) - self._wall_offsets[numbers]
        inside = (beyond <= 0.0).all(axis=1)
        loose = np.flatnonzero(~self._convex[numbers])
        for number in set(numbers[loose].tolist()):
            mine = loose[numbers[loose] == number]
            inside[mine] = self.surfaces[number].holds(points[mine])
        return inside

    def carries(
        self, points: FloatArray, turns: FloatArray, numbers: IntArray, footprint: FloatArray
    ) -> NDArray[np.bool_]:
        """(n,) whether the whole footprint (c, 3) [m] of placed effectors projects into their polygons.

        The effectors are at points (n, 3) of the world [m], turned by (n, 3, 3), on surfaces of (n,) indices.
        """
        if self.filled[numbers].all():
            sides = self.frames[self.group[numbers], 1:]
            places = (sides @ points[..., None]) + (sides @ turns) @ footprint.T
            inside = places >= self.side_low[numbers][..., None]
            inside &= places <= self.side_high[numbers][..., None]
            return np.logical_and.reduce(inside.reshape(len(points), 2 * len(footprint)), axis=1)
        corners = points[:, None] + footprint @ turns.transpose(0, 2, 1)
        each = self.over(corners.reshape(-1, 3), np.repeat(numbers, len(footprint)))
        return np.logical_and.reduce(each.reshape(len(points), len(footprint)), axis=1)

    def carries_one(self, corners: FloatArray, number: int) -> bool:
        """Whether all (c, 3) corners of one footprint in the world project into a polygon [m]."""
        if self._convex[number]:
            return bool((corners @ self._walls[number].T <= self._wall_offsets[number]).all())
        return bool(self.surfaces[number].holds(corners).all())


def find_candidates(
    table: SurfaceTable, numbers: IntArray, situation: Situation, samples: LimbSamples, *, tolerance: float,
    max_tilt: float, footprint: FloatArray,
) -> Candidates:  # fmt: skip
    """Select the samples in contact (step 2, [Tonneau2015]_ 4.3): near the plane and over the polygon.

    Args:
        numbers: Indices of the surfaces of the table that are within reach.
        tolerance: Largest distance of an effector to the plane, on either side [m].
        max_tilt: Largest angle between the effector's z axis and the normal [rad]; what is
            tilted more cannot be aligned by small moves of the joints.
        footprint: (c, 3) points of the effector's frame that must lie over the polygon [m].
    """
    rows, owner, gap = _near_planes(table, numbers, situation, samples, tolerance, max_tilt)
    order = np.argsort(rows * len(numbers) + owner)  # no two are the same
    rows, owner, gap = rows.take(order), owner.take(order), gap.take(order)
    normals = (table.normals[numbers] @ situation.rotation).take(owner, axis=0)
    normals *= gap[:, None]
    points = situation.to_world(samples.positions.take(rows, axis=0) - normals)
    loose = (~table.filled[numbers]).take(owner).nonzero()[0]
    if len(loose):
        kept = np.ones(len(owner), dtype=bool)
        kept[loose] = table.over(points.take(loose, axis=0), numbers[owner[loose]])
        inside = kept.nonzero()[0]
        rows, owner, points = rows.take(inside), owner.take(inside), points.take(inside, axis=0)
    if len(footprint) > 1:
        turns = situation.rotation @ samples.rotations.take(rows, axis=0)
        inside = table.carries(points, turns, numbers[owner], footprint).nonzero()[0]
        rows, owner, points = rows.take(inside), owner.take(inside), points.take(inside, axis=0)
    surfaces = numbers.take(owner)
    return Candidates(
        rows, surfaces, points, table.normals.take(surfaces, axis=0), samples.products.take(rows, axis=0),
        samples.manipulability.take(rows), samples.rotations.take(rows, axis=0),
    )  # fmt: skip


def _near_planes(
    table: SurfaceTable, numbers: IntArray, situation: Situation, samples: LimbSamples, tolerance: float,
    max_tilt: float,
) -> tuple[IntArray, IntArray, FloatArray]:  # fmt: skip
    """Rows of samples upright over planes, within the bounds of their polygons; whole leaves first.

    With them go the positions of their surfaces in ``numbers``, and the heights over the planes [m].
    """
    leaves, frames = samples.leaves, table.frames[table.group[numbers]]
    axes = frames @ situation.rotation  # (m, 3, 3): the normal and two sides, in the limb's frame
    ends = table.extents[numbers] - (frames @ situation.origin)[..., None]
    ends[:, 0] += [-tolerance, tolerance]
    middle, half = ends.mean(axis=2), 0.5 * (ends[..., 1] - ends[..., 0])
    # Leaves in single precision, which their bounds allow for, samples in double.
    rough = axes.astype(np.float32)
    at = (rough.reshape(-1, 3) @ leaves.centres).reshape(len(numbers), 3, len(leaves.rows))
    at -= middle.astype(np.float32)[..., None]
    within = np.abs(at, out=at) <= half.astype(np.float32)[..., None] + leaves.radii
    near = rough[:, 0] @ leaves.axes >= np.cos(np.minimum(leaves.spreads + max_tilt, np.pi)) - _ROUNDING
    near &= within[:, 0] & within[:, 1] & within[:, 2]
    owner, leaf = np.divmod(near.ravel().nonzero()[0], len(leaves.rows))
    parts, heads, axis = leaves.positions[leaf], leaves.upward[leaf], axes[owner, 0][..., None]
    height = parts[:, 0] * axis[:, 0] + parts[:, 1] * axis[:, 1] + parts[:, 2] * axis[:, 2]
    height -= table.offsets[numbers[owner], None] - (frames[:, 0] @ situation.origin)[owner, None]
    upright = heads[:, 0] * axis[:, 0] + heads[:, 1] * axis[:, 1] + heads[:, 2] * axis[:, 2]
    pair, place = ((upright >= np.cos(max_tilt)) & (np.abs(height) <= tolerance)).nonzero()
    rows, owner, height = leaves.rows[leaf[pair], place], owner[pair], height[pair, place]
    at = np.einsum("pai,pi->pa", axes[owner, 1:], samples.positions.take(rows, axis=0))
    beside = (at >= ends[owner, 1:, 0]) & (at <= ends[owner, 1:, 1])
    inside = (beside[:, 0] & beside[:, 1]).nonzero()[0]
    return rows[inside], owner[inside], height[inside]
