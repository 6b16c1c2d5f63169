"""ZMP of stances whose soles and points lie in one plane, level or tilted."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.criteria import zero_moment_point
from manikin.balance.polygon import convex_polygon, signed_distance
from manikin.contact import ContactKind, Stance
from manikin.spatial import FloatArray, rotation_from_normal, skew

FLATNESS = 1e-3
"""Contact points this far from a plane, and normals this far from its own, lie in it [m], [1]."""


@dataclass(frozen=True, eq=False)
class SupportPlane:
    """Plane that carries every contact of a stance.

    Attributes:
        origin: (3,) a point of the plane [m].
        rotation_plane_to_world: (3, 3); its z column is the normal.
        polygon: (k, 2) support polygon in the plane's own x and y, counter-clockwise [m].
    """

    origin: FloatArray
    rotation_plane_to_world: FloatArray
    polygon: FloatArray

    def zero_moment_point(self, wrench: ArrayLike) -> FloatArray:
        """Point of the plane about which the contacts' moment is along its normal.

        Args:
            wrench: (..., 6) pseudo-wrench about the world origin [N, N.m].

        Returns:
            (..., 2) in the plane's own x and y [m].
        """
        w = np.asarray(wrench, dtype=np.float64)
        force, moment = w[..., :3], w[..., 3:] - w[..., :3] @ skew(self.origin).T
        turn = self.rotation_plane_to_world
        return zero_moment_point(np.concatenate([force @ turn, moment @ turn], axis=-1))

    def zmp_distance(self, wrench: ArrayLike) -> FloatArray:
        """Distance of the ZMP to the edge of the support polygon, negative outside, (...) [m]."""
        return signed_distance(self.zero_moment_point(wrench), self.polygon)


def support_plane(stance: Stance) -> SupportPlane | None:
    """Plane of a stance's contacts; None when they lie in several planes or one is a grasp."""
    if not len(stance) or any(contact.kind is ContactKind.GRASP for contact in stance):
        return None
    points = np.vstack([contact.points_in_world for contact in stance])
    normal, origin = stance.contacts[0].normal, points.mean(axis=0)
    tilt = max(float(np.abs(contact.normal - normal).max()) for contact in stance)
    if tilt > FLATNESS or float(np.abs((points - origin) @ normal).max()) > FLATNESS:
        return None
    turn = rotation_from_normal(normal)
    return SupportPlane(origin, turn, convex_polygon(((points - origin) @ turn)[:, :2]))


def least_zmp_distance(samples: Iterable[tuple[Stance, FloatArray]]) -> float | None:
    """Least distance of the ZMP to the edge of the support polygon over the stances in one plane.

    Args:
        samples: Stances with the pseudo-wrenches (n, 6) about the world origin while they are held.

    Returns:
        [m], negative outside; None when no stance has its contacts in one plane.
    """
    found = []
    for stance, wrench in samples:
        plane = support_plane(stance)
        if plane is not None and len(wrench):
            found.append(float(plane.zmp_distance(wrench).min()))
    return min(found, default=None)
