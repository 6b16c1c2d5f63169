"""Where the effector of a limb can get to: the convex hull of many sampled places."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from manikin.body.limb_kinematics import LimbKinematics
from manikin.body.limbs import limb_origin, parent_segment
from manikin.body.model import BodyModel
from manikin.body.natural_range import NaturalRange
from manikin.body.segments import Limb
from manikin.errors import BodyError
from manikin.spatial import FloatArray, frozen_array

MIN_COUNT = 100
"""Fewest samples from which a hull is made; 10,000 are a fair picture ([Tonneau2015]_ 4.3.4)."""

GIVE = 0.03
"""Distance from what no joint moves at which a surface is still within its reach [m]; our choice."""

_CORNERS = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class ReachVolume:
    """Convex hull of the places of an effector, in the frame of the segment the limb is fixed to.

    Attributes:
        limb: The limb.
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
        """(...) distance of (..., 3) points to the nearest face, negative outside [m].

        The residual radius ``min(b - A s)`` of [Tonneau2015]_ algorithm 1.
        """
        return np.min(self.b - np.asarray(points, dtype=np.float64) @ self.A.T, axis=-1)

    def contains(self, points: ArrayLike, tolerance: float = 0.0) -> NDArray[np.bool_]:
        """(...) whether (..., 3) points are inside or at most ``tolerance`` [m] beyond a face."""
        return self.residual(points) >= -tolerance

    @cached_property
    def inscribed_sphere(self) -> tuple[FloatArray, float]:
        """Centre (3,) and radius [m] of the largest sphere inside, the Chebyshev sphere (4.1.2)."""
        table = np.column_stack([self.A, np.ones(len(self.b))])
        bounds = [(None, None)] * 3 + [(0.0, None)]
        found = linprog([0.0, 0.0, 0.0, -1.0], A_ub=table, b_ub=self.b, bounds=bounds)
        return frozen_array(found.x[:3], "centre"), float(found.x[3])


def hull_of(limb: Limb, segment: str, points: FloatArray) -> ReachVolume:
    """Convex hull of points (n, 3) in the frame of the carrying segment [m].

    Raises:
        BodyError: If the points lie in a plane, as those of a limb with one hinge do.
    """
    if np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-9) < 3:
        raise BodyError(
            f"limb {limb.name!r} reaches points of a plane only; valid: an effector that moves in space"
        )
    hull = ConvexHull(points)
    used, numbers = np.unique(hull.simplices, return_inverse=True)
    vertices, faces = points[used], numbers.reshape(hull.simplices.shape)
    corners = vertices[faces]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("fi,fi->f", turned, hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    faces.setflags(write=False)
    return ReachVolume(
        limb,
        segment,
        frozen_array(vertices, "vertices", (None, 3)),
        faces,
        frozen_array(hull.equations[:, :3], "A", (None, 3)),
        frozen_array(-hull.equations[:, 3], "b", (None,)),
    )


def rigid_reach(limb: Limb, segment: str, place: FloatArray, rotation: FloatArray) -> ReachVolume:
    """Reach of a limb without joints: a cube of :data:`GIVE` on each side of its effector.

    The effector moves with the trunk alone; a surface that meets the cube is near enough to be touched.

    Args:
        limb: The limb.
        segment: Name of the segment that carries it.
        place: (3,) of the effector in that segment [m].
        rotation: (3, 3) from the effector's axes to the segment's.
    """
    return hull_of(limb, segment, place + GIVE * _CORNERS @ rotation.T)


def reach_volume(
    body: BodyModel, limb: Limb, rng: np.random.Generator, count: int = 10_000, *, natural: bool = False
) -> ReachVolume:
    """Sample the reach of a limb within its joint ranges ([Tonneau2015]_ 4.3.4).

    Args:
        body: The body.
        limb: One of its limbs.
        rng: Source of randomness.
        count: Number of samples, at least :data:`MIN_COUNT`; a limb without joints needs none.
        natural: Whether hips and shoulders of the human keep to their learnt volumes (4.3.3).

    Raises:
        BodyError: If the count is too small or the effector moves in a plane only.
    """
    if count < MIN_COUNT:
        raise BodyError(f"reach volume count is {count}; valid: at least {MIN_COUNT}")
    chain = LimbKinematics(body, limb)
    segment = parent_segment(body, limb)
    if not len(chain):
        return rigid_reach(limb, segment, limb_origin(body, limb) + chain.tip, chain.tip_rotation)
    source = NaturalRange(body, limb) if natural else chain
    places = chain.place(source.random_angles(rng, count)).positions
    return hull_of(limb, segment, places + limb_origin(body, limb))
