"""Sampled configurations of a limb, made once and asked often ([Tonneau2015]_ 5.1.4, 5.3.1)."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel, Limb, are_mirrored
from manikin.body.limbs import REFLECTION, limb_origin, limb_slots, parent_segment
from manikin.body.natural_range import NaturalRange
from manikin.errors import BodyError
from manikin.kinematics.efort import MOST_RATIO
from manikin.kinematics.limb_kinematics import LimbKinematics, ReachVolume, hull_of, rigid_reach
from manikin.numerics.spatial import FloatArray, finite_number, unit

THRESHOLD = 0.05  # least manipulability, as a share of the largest seen; our choice, open in the thesis
_FEWEST_KEPT = 0.02


@dataclass(frozen=True, eq=False)
class LimbSamples:
    """Random configurations of one limb, in the limb's frame.

    Attributes:
        segment: Name of the segment that carries it.
        origin: (3,) origin of the limb's frame in that segment [m].
        angles: (n, k) joint angles [rad].
        positions: (n, 3) effector positions [m].
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
        products: (n, 3, 3) ``J J^T`` of the effector's translation [m^2].
        threshold: Manipulability [m^3] that every sample has at least.
        natural: Whether hips and shoulders keep to learnt volumes; contacts made of the samples do then too.
    """

    limb: Limb
    segment: str
    origin: FloatArray
    angles: FloatArray
    positions: FloatArray
    rotations: FloatArray
    products: FloatArray
    threshold: float
    natural: bool = False

    def __post_init__(self) -> None:
        for name in ("origin", "angles", "positions", "rotations", "products"):
            getattr(self, name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.angles)

    @cached_property
    def manipulability(self) -> FloatArray:
        """(n,) ``sqrt(det(J J^T))`` [m^3] (5.6, where the print lacks the determinant)."""
        return manipulability(self.products)

    @cached_property
    def upward(self) -> FloatArray:
        """(n, 3) z axes of the effector, the normals it would fit, in the limb's frame."""
        return np.ascontiguousarray(self.rotations[:, :, 2])

    @cached_property
    def largest_ratio(self) -> float:
        """Largest force transmission ratio of a sample in any direction (5.11) [N per N.m]."""
        least = float(np.linalg.eigvalsh(self.products)[:, 0].min())
        return min(1.0 / math.sqrt(least), MOST_RATIO) if least > 0.0 else MOST_RATIO

    @cached_property
    def leaves(self) -> "SampleLeaves":
        """The samples in small groups that are near each other, for the look-up of those at a surface."""
        return SampleLeaves.of(self.positions, self.upward)

    @cached_property
    def hull(self) -> tuple[FloatArray, float]:
        """Corners (h, 3) of the reach in the limb's frame, and the largest distance of one [m]."""
        corners = self.reach.vertices - self.origin
        return corners, float(np.linalg.norm(corners, axis=1).max())

    @cached_property
    def reach(self) -> ReachVolume:
        """Convex hull of the positions in the frame of the carrying segment; without joints a small cube."""
        if not self.angles.shape[1]:
            return rigid_reach(self.limb, self.segment, self.positions[0] + self.origin, self.rotations[0])
        return hull_of(self.limb, self.segment, self.positions + self.origin)


SINGLE = 1e-4  # what rounding to single precision takes at most, 1,000 m away [m, 1]
_LEAF = 16  # largest number of samples in a leaf


@dataclass(frozen=True, eq=False)
class SampleLeaves:
    """Samples in l groups of k that are alike in position and direction, the ends of a k-d tree.

    Attributes:
        rows: (l, k) rows of the samples.
        positions: (l, 3, k) of the effector in single precision [m]; NaN for what only fills a group up.
        centres: (3, l) middle of the box about the positions [m], in single precision.
        radii: (l,) of a ball about it that holds them with what is lost by that [m].
        axes: (3, l) unit direction in the middle of the z axes.
        spreads: (l,) largest angle of a z axis to it [rad].
    """

    rows: NDArray[np.int64]
    positions: NDArray[np.float32]
    centres: NDArray[np.float32]
    radii: NDArray[np.float32]
    axes: NDArray[np.float32]
    spreads: NDArray[np.float32]

    @staticmethod
    def of(positions: FloatArray, upward: FloatArray) -> "SampleLeaves":
        """Halve the samples again and again across the widest of the six coordinates."""
        radius = 0.5 * float(np.ptp(positions, axis=0).max(initial=0.0))
        features = np.concatenate([positions, radius * upward], axis=1)
        levels = max(0, int(np.ceil(np.log2(len(positions) / _LEAF))))
        whole = int(np.ceil(len(positions) / 2**levels)) * 2**levels
        rows = np.arange(whole)[None]  # what is beyond the samples stands for one of them and is no sample
        for _ in range(levels):
            values = features[rows % len(positions)]
            widest = np.argmax(np.ptp(values, axis=1), axis=1)
            along = np.take_along_axis(values, widest[:, None, None], axis=2)[..., 0]
            order = np.argsort(along, axis=1, kind="stable")
            rows = np.take_along_axis(rows, order, axis=1).reshape(2 * len(rows), -1)
        real, rows = rows < len(positions), rows % len(positions)
        places, directions = positions[rows], upward[rows]
        centres = 0.5 * (places.min(axis=1) + places.max(axis=1))
        radii = np.sqrt(((places - centres[:, None]) ** 2).sum(axis=2).max(axis=1)) + SINGLE
        axes = unit(directions.mean(axis=1), 1e-12)
        cosines = np.einsum("lki,li->lk", directions, axes).min(axis=1)
        spreads = np.arccos(np.clip(cosines, -1.0, 1.0)) + SINGLE
        places[~real] = np.nan
        rough = [np.asarray(item.T, np.float32, order="C") for item in (centres, radii, axes, spreads)]
        return SampleLeaves(rows, np.asarray(places.transpose(0, 2, 1), np.float32, order="C"), *rough)


def manipulability(products: FloatArray) -> FloatArray:
    """(n,) ``w = sqrt(det(J J^T))`` of (n, 3, 3) products ([Tonneau2015]_ 5.6)."""
    a, b, c = products[:, :, 0], products[:, :, 1], products[:, :, 2]
    determinant = (
        a[:, 0] * (b[:, 1] * c[:, 2] - b[:, 2] * c[:, 1])
        - b[:, 0] * (a[:, 1] * c[:, 2] - a[:, 2] * c[:, 1])
        + c[:, 0] * (a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1])
    )
    return np.sqrt(np.maximum(determinant, 0.0))


def sample_limb(
    body: BodyModel, limb: Limb, rng: np.random.Generator, count: int = 10_000,
    threshold: float = THRESHOLD, *, natural: bool = False,
) -> LimbSamples:  # fmt: skip
    """Draw configurations of a limb within its range of motion and keep those far from singular.

    The ratio that EFORT builds on grows without bound towards singular configurations, so those with
    little manipulability are dropped (5.4.1).  A limb without joints has one configuration, which is kept.

    Args:
        count: Number of samples that are kept, > 0.
        threshold: Smallest manipulability kept, as a share of the largest among the first
            ``count`` samples, in [0, 1).
        natural: Whether hips and shoulders of the human keep to their learnt volumes (4.3.3) and not to the
            intervals of their hinges alone. Off unless asked for: the recordings hold no movement of the
            largest amplitude, and climbing needs more.

    Raises:
        BodyError: If a value is out of its range, or fewer than one sample in fifty passes.
    """
    if count < 4:
        raise BodyError(f"limb samples count is {count}; valid: at least 4")
    share = finite_number(threshold, "limb samples threshold", at_least=0.0, error=BodyError)
    if not len(limb_slots(body, limb)):
        count = 1  # without joints there is one configuration
    chain, volumes = LimbKinematics(body, limb), NaturalRange(body, limb)
    source = volumes if natural and volumes.learnt else chain
    parts: list[tuple[FloatArray, ...]] = []
    kept, drawn, least = 0, 0, None
    while kept < count:
        angles = source.random_angles(rng, count)
        placed = chain.place(angles)
        products = placed.jacobians @ placed.jacobians.transpose(0, 2, 1)
        part, values = (angles, placed.positions, placed.rotations, products), manipulability(products)
        least = share * float(values.max()) if least is None else least
        good = values >= least
        parts.append(tuple(values[good] for values in part))
        kept, drawn = kept + int(good.sum()), drawn + count
        if kept < _FEWEST_KEPT * drawn:
            raise BodyError(
                f"limb {limb.name!r}: {kept} of {drawn} samples have a manipulability of {share:g} of the "
                "largest; valid: a smaller threshold"
            )
    joined = [np.concatenate(arrays)[:count] for arrays in zip(*parts, strict=True)]
    segment, origin = parent_segment(body, limb), limb_origin(body, limb)
    return LimbSamples(limb, segment, origin, *joined, threshold=float(least or 0.0), natural=natural)


def mirrored_samples(body: BodyModel, samples: LimbSamples, limb: Limb) -> LimbSamples:
    """Samples of the limb on the other side, by reflection in the sagittal plane (5.3.1).

    Equal angles give ``M p``, ``M R M`` and ``M J J^T M`` with ``M = diag(1, -1, 1)``.

    Raises:
        BodyError: If the limb is not the mirror image of the one that was sampled.
    """
    if not are_mirrored(body, other := samples.limb, limb):
        valid = other.mirror or "none"
        raise BodyError(f"limb {limb.name!r} is no reflection of {other.name!r}; valid: {valid}")
    flip: NDArray[np.float64] = np.outer(REFLECTION, REFLECTION)
    return replace(
        samples, limb=limb, origin=samples.origin * REFLECTION, positions=samples.positions * REFLECTION,
        rotations=samples.rotations * flip, products=samples.products * flip,
    )  # fmt: skip


def sample_limbs(
    body: BodyModel, rng: np.random.Generator, count: int = 10_000, *, natural: bool = False
) -> dict[str, LimbSamples]:
    """Samples of every limb by its name; mirrored limbs share one set, reflected.

    The arguments are those of :func:`sample_limb`.
    """
    sampled: dict[str, LimbSamples] = {}
    for limb in body.limbs:
        twin = sampled.get(limb.mirror or "")
        if twin is not None and are_mirrored(body, twin.limb, limb):
            sampled[limb.name] = mirrored_samples(body, twin, limb)
        else:
            sampled[limb.name] = sample_limb(body, limb, rng, count, natural=natural)
    return sampled
