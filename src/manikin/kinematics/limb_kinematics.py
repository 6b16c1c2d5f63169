"""Forward kinematics of one limb at many joint angles at once, and the reach volume sampled with it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from manikin.body.limbs import limb_hinges, limb_origin, limb_slots, parent_segment
from manikin.body.model import BodyModel
from manikin.body.natural_range import NaturalRange
from manikin.body.segments import Limb
from manikin.errors import BodyError
from manikin.numerics.spatial import FloatArray, area_normals, cross, frozen_array, skew

MIN_COUNT = 100
"""Fewest samples from which a hull is made; 10,000 are a fair picture ([Tonneau2015]_ 4.3.4)."""

GIVE = 0.03
"""Distance from what no joint moves at which a surface is still within its reach [m]; our choice."""

_CORNERS = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class ReachVolume:
    """Convex hull of the positions of an effector, in the frame of the segment the limb is fixed to.

    Attributes:
        segment: Name of the segment that carries it: the parent of the limb's first segment.
        vertices: (n, 3) corners [m].
        faces: (m, 3) triangles, counter-clockwise seen from outside.
        A: (m, 3) unit normals of the faces, outward.
        b: (m,) offsets [m]: inside is ``A x <= b``.
    """

    limb: Limb
    segment: str
    vertices: FloatArray
    faces: NDArray[np.int64]
    A: FloatArray
    b: FloatArray

    def residual(self, points: ArrayLike) -> FloatArray:
        """(...) residual radius ``min(b - A s)`` of (..., 3) points ([Tonneau2015]_ algorithm 1) [m]."""
        points = np.asarray(points, dtype=np.float64)
        rows = points.reshape(-1, 3)
        # Blocks that stay in the cache: pages for one large table cost more than the products.
        parts = [np.min(self.b - rows[k : k + 64] @ self.A.T, axis=-1) for k in range(0, len(rows), 64)]
        return np.concatenate([np.zeros(0), *parts]).reshape(points.shape[:-1])

    @cached_property
    def inscribed_sphere(self) -> tuple[FloatArray, float]:
        """Centre (3,) and radius [m] of the largest sphere inside, the Chebyshev sphere (4.1.2)."""
        return inscribed_ball(self.A, self.b)


def inscribed_ball(normals: FloatArray, offsets: FloatArray) -> tuple[FloatArray, float]:
    """Centre (3,) and radius of the largest ball inside ``normals x <= offsets``, unit normals (m, 3)."""
    table = np.column_stack([normals, np.ones(len(offsets))])
    bounds = [(None, None)] * 3 + [(0.0, None)]
    ball = linprog([0.0, 0.0, 0.0, -1.0], A_ub=table, b_ub=offsets, bounds=bounds).x
    return frozen_array(ball[:3], "centre"), float(ball[3])


def hull_of(limb: Limb, segment: str, points: FloatArray) -> ReachVolume:
    """Convex hull of points (n, 3) of the carrying segment [m]; BodyError if they lie in a plane."""
    if np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-9) < 3:
        raise BodyError(
            f"limb {limb.name!r} reaches points of a plane only; valid: an effector that moves in space"
        )
    hull = ConvexHull(points)
    used, numbers = np.unique(hull.simplices, return_inverse=True)
    vertices, faces = points[used], numbers.reshape(hull.simplices.shape)
    inward = np.einsum("fi,fi->f", area_normals(vertices[faces]), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    faces.setflags(write=False)
    A, b = frozen_array(hull.equations[:, :3], "A"), frozen_array(-hull.equations[:, 3], "b")
    return ReachVolume(limb, segment, frozen_array(vertices, "vertices"), faces, A, b)


def rigid_reach(limb: Limb, segment: str, position: FloatArray, rotation: FloatArray) -> ReachVolume:
    """Reach of a limb without joints: a cube of :data:`GIVE` on each side of its effector.

    Its position (3,) [m] and its rotation (3, 3) are those in the segment that carries it.
    """
    return hull_of(limb, segment, position + GIVE * _CORNERS @ rotation.T)


def reach_volume(
    body: BodyModel, limb: Limb, rng: np.random.Generator, count: int = 10_000, *, natural: bool = False
) -> ReachVolume:
    """Sample the reach of a limb within its joint ranges ([Tonneau2015]_ 4.3.4).

    Args:
        count: Number of samples, at least :data:`MIN_COUNT`; a limb without joints needs none.
        natural: Whether hips and shoulders of the human keep to their learnt volumes (4.3.3).

    Raises:
        BodyError: If the count is too small or the effector moves in a plane only.
    """
    if count < MIN_COUNT:
        raise BodyError(f"reach volume count is {count}; valid: at least {MIN_COUNT}")
    chain, segment, origin = LimbKinematics(body, limb), parent_segment(body, limb), limb_origin(body, limb)
    if not len(chain):
        return rigid_reach(limb, segment, origin + chain.tip, chain.tip_rotation)
    source = NaturalRange(body, limb) if natural else chain
    return hull_of(limb, segment, chain.place(source.random_angles(rng, count)).positions + origin)


_IDENTITY = np.eye(3)
_BLOCK = 1024  # samples whose temporary arrays fit in the cache


@dataclass(frozen=True, eq=False)
class EffectorPlacements:
    """The effector of a limb at n samples, in the limb's frame.

    Attributes:
        positions: (n, 3) [m].
        rotations: (n, 3, 3) from the effector's axes to the limb frame's.
        jacobians: (n, 3, k) velocity of the effector per joint speed [m/rad].
        axes: (n, 3, k) unit axes of the joints: its angular velocity per joint speed.
    """

    positions: FloatArray
    rotations: FloatArray
    jacobians: FloatArray
    axes: FloatArray


class LimbKinematics:
    """A limb as a chain of hinges on fixed offsets, in the limb's frame.

    Attributes:
        slots: (k,) indices of its hinges in the configuration vector.
        lower, upper: (k,) ends of the ranges [rad].
        torque_lower, torque_upper: (k,) most negative and largest torques [N.m].
        axes: (k, 3) unit axes of the hinges, each in the axes of the one before it.
        offsets: (k, 3) translations before each hinge [m].
        tip: (3,) translation from the last hinge to the effector [m]; from the limb's origin without any.
        tip_rotation: (3, 3) from the effector's axes to those of the last hinge.
    """

    def __init__(self, body: BodyModel, limb: Limb) -> None:
        self.limb = limb
        self.slots = limb_slots(body, limb)
        hinges = limb_hinges(body, limb)
        self._hinges = [len(body.segment(name).hinges) for name in limb.segments]
        self.lower, self.upper, self.torque_lower, self.torque_upper = (
            frozen_array([getattr(hinge, name) for hinge in hinges], name)
            for name in ("lower", "upper", "torque_lower", "torque_upper")
        )
        self.axes = frozen_array(np.reshape([hinge.axis for hinge in hinges], (-1, 3)), "axes")
        offsets, self._origins, tip = _offsets(body, limb)
        self.offsets, self.tip = frozen_array(offsets, "offsets"), frozen_array(tip, "tip")
        self.tip_rotation = frozen_array(body.effector(limb.effector).rotation, "tip_rotation")
        self._crosses = skew(self.axes)
        self._squares = self._crosses @ self._crosses

    def __len__(self) -> int:
        """Number of hinges."""
        return len(self.axes)

    def random_angles(self, rng: np.random.Generator, count: int) -> FloatArray:
        """(count, k) angles, uniform within the joint ranges [rad]."""
        return rng.uniform(self.lower, self.upper, (count, len(self)))

    def place(self, angles: ArrayLike) -> EffectorPlacements:
        """Place the effector at many joint angles (n, k) [rad]; BodyError if they are of another shape."""
        q = np.asarray(angles, dtype=np.float64)
        if q.ndim != 2 or q.shape[1] != len(self):
            raise BodyError(f"limb {self.limb.name!r} angles have shape {q.shape}; valid: (n, {len(self)})")
        n, k = q.shape
        out = EffectorPlacements(*(np.empty(shape) for shape in ((n, 3), (n, 3, 3), (n, 3, k), (n, 3, k))))
        for start in range(0, n, _BLOCK):
            rows = slice(start, start + _BLOCK)
            frames, places = self._frames(q[rows])
            turn, before = frames[:, -1], frames[:, :-1]
            axes = (before @ self.axes[..., None])[..., 0]
            point = turn @ self.tip
            if len(self):
                point += places[:, -1]
            out.positions[rows], out.rotations[rows] = point, turn @ self.tip_rotation
            out.axes[rows] = axes.transpose(0, 2, 1)
            out.jacobians[rows] = cross(axes, point[:, None] - places).transpose(0, 2, 1)
        return out

    def segment_placements(self, angles: FloatArray) -> Iterator[tuple[str, FloatArray, FloatArray]]:
        """Name, axes (n, 3, 3) and origin (n, 3) of moving segments in the frame of the limb."""
        if not len(self):
            return
        frames, places = self._frames(np.asarray(angles, dtype=np.float64))
        last = 0
        for name, count, origin in zip(self.limb.segments, self._hinges, self._origins, strict=True):
            before = places[:, last - 1] if last else 0.0
            yield (
                name,
                frames[:, last + count],
                places[:, last] if count else before + frames[:, last] @ origin,
            )
            last += count

    def _frames(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Axes before each hinge and after the last (n, k + 1, 3, 3), and places of the hinges (n, k, 3).

        Turn by turn: ``I + sin a [k] + (1 - cos a) [k]^2`` about each unit axis ``k``.
        """
        turns = np.sin(q)[..., None, None] * self._crosses
        turns += (1.0 - np.cos(q))[..., None, None] * self._squares
        turns += _IDENTITY
        frames = np.empty((len(q), len(self) + 1, 3, 3))
        frames[:, 0] = _IDENTITY
        for hinge in range(len(self)):
            np.matmul(frames[:, hinge], turns[:, hinge], out=frames[:, hinge + 1])
        return frames, np.cumsum((frames[:, :-1] @ self.offsets[..., None])[..., 0], axis=1)


def _offsets(body: BodyModel, limb: Limb) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Translations [m] from each hinge (the limb's origin before the first) to the next (k, 3).

    Also from the hinge before it to each segment's origin (3,), and from the last hinge to the effector (3,).
    """
    offsets: list[FloatArray] = []
    origins: list[FloatArray] = []
    offset = np.zeros(3)
    for number, name in enumerate(limb.segments):
        segment = body.segment(name)
        offset = offset + (segment.origin if number else 0.0)  # the limb's frame is at the first one's origin
        origins.append(offset)
        for _ in segment.hinges:
            offsets.append(offset)
            offset = np.zeros(3)
    return np.reshape(offsets, (-1, 3)), origins, offset + body.effector(limb.effector).translation
