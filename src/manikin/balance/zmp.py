"""Zero moment point (ZMP) of stances whose soles and points lie in one plane, level or tilted."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.balance.criteria import support_height, support_polygon, zero_moment_point
from manikin.contact import ContactKind, ContactSchedule, Stance
from manikin.motion import Motion
from manikin.numerics.polytope import convex_polygon, signed_distance
from manikin.numerics.spatial import FloatArray, cross, rotation_from_normal, skew

FLATNESS = 1e-3
"""Contact points this far from a plane, and normals this far from its own, lie in it [m], [1]."""

STEEPEST = np.cos(np.deg2rad(60.0))
"""Vertical part of the normal below which a plane is a wall."""

LEAST_LOAD = 20.0
"""Force along the normal below which the ZMP is not defined [N]."""


@dataclass(frozen=True, eq=False)
class SupportPlane:
    """Plane in which the ZMP of a stance is measured.

    Attributes:
        origin: (3,) a point of the plane [m].
        rotation_plane_to_world: (3, 3); its z column is the normal.
        polygon: (k, 2) support polygon in the plane's own x and y, counter-clockwise [m].
        decisive: Whether balance requires the ZMP inside the polygon (friction aside): the plane carries all.
    """

    origin: FloatArray
    rotation_plane_to_world: FloatArray
    polygon: FloatArray
    decisive: bool = True

    def zero_moment_point(self, wrench: ArrayLike) -> FloatArray:
        """(..., 2) point, in the plane's x and y, about which the moment is along its normal [m].

        Wrenches (..., 6) are about the world origin [N, N.m].
        """
        w = np.asarray(wrench, dtype=np.float64)
        force, moment = w[..., :3], w[..., 3:] - w[..., :3] @ skew(self.origin).T
        turn = self.rotation_plane_to_world
        return zero_moment_point(np.concatenate([force @ turn, moment @ turn], axis=-1))

    def zmp_distance(self, wrench: ArrayLike) -> FloatArray:
        """Distance of the ZMP to the edge of the support polygon, negative outside, (...) [m]."""
        return signed_distance(self.zero_moment_point(wrench), self.polygon)

    def carries(self, wrench: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether the forces of (n, 6) wrenches along the normal reach :data:`LEAST_LOAD`."""
        return ~(wrench[:, :3] @ self.rotation_plane_to_world[:, 2] < LEAST_LOAD)

    def in_world(self, points: FloatArray) -> FloatArray:
        """(n, 3) places in the world of points (n, 2) of the plane [m]."""
        return self.origin + points @ self.rotation_plane_to_world[:, :2].T


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
    """Least distance of the ZMP to the edge of the support polygon [m], None without a stance in one plane.

    Samples are stances with the pseudo-wrenches (n, 6) about the world origin while they are held.
    """
    known = ((support_plane(stance), wrench) for stance, wrench in samples if len(wrench))
    distances = (float(plane.zmp_distance(wrench).min()) for plane, wrench in known if plane is not None)
    return min(distances, default=None)


def projection_plane(stance: Stance) -> SupportPlane | None:
    """Plane for showing the ZMP: the stance's own, or the level one at the mean height of its supports.

    None when grasps and walls alone hold the body.
    """
    pressing = [contact for contact in stance if contact.kind is not ContactKind.GRASP]
    if not any(contact.normal[2] > STEEPEST for contact in pressing):
        return None
    polygon, origin = support_polygon(stance), np.array([0.0, 0.0, support_height(stance)])
    return support_plane(stance) or SupportPlane(origin, np.eye(3), polygon, decisive=False)


@dataclass(frozen=True, eq=False)
class ZmpPath:
    """The ZMP of a motion.

    Attributes:
        time: (n,) [s].
        point: (n, 3) in the world [m]; not a number where less than :data:`LEAST_LOAD` presses.
        distance: (n,) to the edge of the support polygon, negative outside [m]; on a line of contacts 0 at
            best.
        phase: (n,) index of the phase.
        planes: One per phase; None for one without any support to press on.
    """

    time: FloatArray
    point: FloatArray
    distance: FloatArray
    phase: NDArray[np.int64]
    planes: tuple[SupportPlane | None, ...]

    @property
    def decisive(self) -> NDArray[np.bool_]:
        """(n,) where the ZMP decides about balance, see :class:`SupportPlane`."""
        table = np.array([plane is not None and plane.decisive for plane in self.planes])
        return table[self.phase] & np.isfinite(self.distance)


def zmp_path(schedule: ContactSchedule, time: FloatArray, wrench: FloatArray) -> ZmpPath:
    """Follow the ZMP of a motion through the support polygons of its schedule.

    Args:
        schedule: The stances and when they are held.
        time: (n,) [s].
        wrench: (n, 6) of all contacts on the body about the world origin [N, N.m].
    """
    planes = tuple(projection_plane(phase.stance) for phase in schedule.sequence)
    phase = np.asarray(schedule.phase_at(time))
    point, distance = np.full((len(time), 3), np.nan), np.full(len(time), np.nan)
    for index, plane in enumerate(planes):
        if plane is not None:
            rows = np.flatnonzero(phase == index)
            rows = rows[plane.carries(wrench[rows])]
            point[rows] = plane.in_world(plane.zero_moment_point(wrench[rows]))
            distance[rows] = plane.zmp_distance(wrench[rows])
    return ZmpPath(time, point, distance, phase, planes)


def contact_wrench(motion: Motion, schedule: ContactSchedule) -> FloatArray:
    """(n, 6) wrench of all contacts on the body about the world origin [N, N.m].

    Its moments are about the origins of the planned contacts, for 0.1 s after a lift-off the contact left.
    """
    total = np.zeros((len(motion.time), 6))
    for column, name in enumerate(motion.contact_names):
        origins = _contact_origins(schedule, name, motion.time - 0.1, motion.time)
        force = motion.contact_force[:, column, :3]
        total[:, :3] += force
        total[:, 3:] += motion.contact_force[:, column, 3:] + cross(origins, force)
    return total


def _contact_origins(
    schedule: ContactSchedule, effector: str, shortly_before: FloatArray, now: FloatArray
) -> FloatArray:
    """(n, 3) origin of the contact held now, or left shortly before, or else made next, or last."""
    stances = [phase.stance for phase in schedule.sequence]
    held = [next((c for c in stance if c.effector == effector), None) for stance in stances]
    pairs = np.column_stack([schedule.phase_at(shortly_before), schedule.phase_at(now)])
    origins = np.zeros((len(now), 3))
    for before, current in np.unique(pairs, axis=0):
        candidates = (held[current], held[before], *held[current:], *held[current::-1])
        contact = next((c for c in candidates if c is not None), None)
        if contact is not None:
            origins[np.all(pairs == (before, current), axis=1)] = contact.position
    return origins
