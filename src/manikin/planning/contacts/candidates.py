"""Samples of a limb whose effector is near a surface of the scene: steps 1 and 2 of a request."""

from dataclasses import dataclass, fields

import numpy as np

from manikin.body import Configuration, Limb, limb_placement
from manikin.kinematics.limb_samples import LimbSamples
from manikin.numerics.spatial import FloatArray
from manikin.scene.surface_table import SurfaceTable
from manikin.scene.triangles import IntArray

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
