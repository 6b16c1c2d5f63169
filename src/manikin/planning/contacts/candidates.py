"""Samples of a limb whose effector is near a surface of the scene: steps 1 and 2 of a request."""

from dataclasses import dataclass, fields

import numpy as np

from manikin.body import Configuration, Limb, limb_placement
from manikin.kinematics.limb_samples import SINGLE, LimbSamples
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
    count, size = leaves.rows.shape
    axes = frames @ situation.rotation  # (m, 3, 3): the normal and two sides, in the limb's frame
    low, high = np.moveaxis(table.extents[numbers] - (frames @ situation.origin)[..., None], 2, 0)
    # Leaves in single precision, which their bounds allow for; the sides only of what is near a plane.
    rough, middle, half = (item.astype(np.float32) for item in (axes, 0.5 * (low + high), 0.5 * (high - low)))
    normals, *sides = np.ascontiguousarray(rough.transpose(1, 0, 2))
    near = np.abs(normals @ leaves.centres - middle[:, :1]) <= leaves.radii + np.float32(tolerance)
    near &= normals @ leaves.axes >= np.cos(np.minimum(leaves.spreads + max_tilt, np.pi)) - _ROUNDING
    owner, leaf = np.divmod(near.ravel().nonzero()[0], count)
    for number, side in enumerate(sides, 1):
        away = (side @ leaves.centres).ravel().take(owner * count + leaf) - middle[:, number].take(owner)
        kept = (np.abs(away) <= half[:, number].take(owner) + leaves.radii.take(leaf)).nonzero()[0]
        owner, leaf = owner.take(kept), leaf.take(kept)
    away = np.einsum("pi,pik->pk", normals.take(owner, axis=0), leaves.positions.take(leaf, axis=0))
    away -= middle[:, 0].take(owner)[:, None]
    pair, place = np.divmod((np.abs(away) <= tolerance + SINGLE).ravel().nonzero()[0], size)
    rows, owner = leaves.rows.ravel().take(leaf.take(pair) * size + place), owner.take(pair)
    # Samples in double precision.
    heads, upward = axes[:, 0].take(owner, axis=0), samples.upward.take(rows, axis=0)
    kept = (np.einsum("pi,pi->p", heads, upward) >= np.cos(max_tilt)).nonzero()[0]
    rows, owner = rows.take(kept), owner.take(kept)
    at = np.einsum("pai,pi->pa", axes.take(owner, axis=0), samples.positions.take(rows, axis=0))
    height = at[:, 0] - low[:, 0].take(owner)
    inside = (np.abs(height) <= tolerance) & (at[:, 1:] >= low[:, 1:].take(owner, axis=0)).all(axis=1)
    found = (inside & (at[:, 1:] <= high[:, 1:].take(owner, axis=0)).all(axis=1)).nonzero()[0]
    return rows.take(found), owner.take(found), height.take(found)
