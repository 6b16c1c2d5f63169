"""The zero moment point along a motion, against the support polygon of each phase."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.balance.criteria import support_height, zero_moment_point
from manikin.balance.polygon import convex_polygon, signed_distance
from manikin.contact import ContactKind, ContactSchedule, Stance
from manikin.motion import Motion
from manikin.spatial import FloatArray, cross, frozen_array

COPLANAR = 0.005
"""Contact points this far from a common plane still lie in it [m]."""

STEEPEST = np.cos(np.deg2rad(60.0))
"""Vertical part of the normal below which a common plane is a wall."""

LEAST_LOAD = 20.0
"""Force along the normal below which there is no zero moment point [N]."""


@dataclass(frozen=True, eq=False)
class SupportPlane:
    """The plane on which the ZMP of a stance is looked for.

    Attributes:
        origin: (3,) a point of it [m].
        axes: (3, 3) columns: two directions in the plane, then its normal, upward.
        polygon: (k, 2) support polygon in the plane, counter-clockwise [m].
        decisive: Whether a ZMP in the polygon is what balance asks (friction aside): all
            contacts press on this one plane, and nothing is grasped. Otherwise the plane is
            level, at the mean height of the supports, and the ZMP is shown for comparison.
    """

    origin: FloatArray
    axes: FloatArray
    polygon: FloatArray
    decisive: bool

    @property
    def corners_in_world(self) -> FloatArray:
        """(k, 3) corners of the support polygon [m]."""
        return self.origin + self.polygon @ self.axes[:, :2].T

    def zero_moment_point(self, wrench: FloatArray) -> FloatArray:
        """(n, 2) point of the plane about which the contacts' moment is along its normal [m].

        Args:
            wrench: (n, 6) force and moment about the world origin [N, N.m].

        Returns:
            In the plane's axes; not a number where the force along the normal is below
            :data:`LEAST_LOAD`.
        """
        force = wrench[:, :3] @ self.axes
        moment = (wrench[:, 3:] - cross(self.origin, wrench[:, :3])) @ self.axes
        found = zero_moment_point(np.hstack([force, moment]))
        found[force[:, 2] < LEAST_LOAD] = np.nan
        return found


@dataclass(frozen=True, eq=False)
class ZmpPath:
    """The ZMP of a motion.

    Attributes:
        time: (n,) [s].
        point: (n, 3) in the world [m]; not a number where nothing presses.
        distance: (n,) to the edge of the support polygon, negative outside [m]. On a line of
            contacts (a heel's or a toe's edge) there is no inside and 0 is best.
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


def support_plane(stance: Stance) -> SupportPlane | None:
    """Plane of a stance's soles and points; None when it holds on to grasps or walls alone."""
    pressing = [contact for contact in stance if contact.kind is not ContactKind.GRASP]
    if not any(contact.normal[2] > STEEPEST for contact in pressing):
        return None
    points = np.vstack([contact.points_in_world for contact in pressing])
    normal = _common_normal(points, np.mean([contact.normal for contact in pressing], axis=0))
    centre = points.mean(axis=0)
    flat = np.abs((points - centre) @ normal).max() <= COPLANAR
    along = all(contact.normal @ normal > 0.5 for contact in pressing)
    decisive = bool(flat and along and normal[2] > STEEPEST and len(pressing) == len(stance))
    if not decisive:
        normal, centre = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, support_height(stance)])
    axes = _axes(normal)
    polygon = convex_polygon(((points - centre) @ axes)[:, :2])
    return SupportPlane(
        frozen_array(centre, "origin"), frozen_array(axes, "axes"), frozen_array(polygon, "polygon"), decisive
    )


def zmp_path(schedule: ContactSchedule, time: FloatArray, wrench: FloatArray) -> ZmpPath:
    """Follow the ZMP of a motion through the support polygons of its schedule.

    Args:
        schedule: The stances and when they are held.
        time: (n,) [s].
        wrench: (n, 6) of all contacts on the body about the world origin [N, N.m].
    """
    planes = tuple(support_plane(phase.stance) for phase in schedule.sequence)
    phase = np.asarray(schedule.phase_at(time))
    point, distance = np.full((len(time), 3), np.nan), np.full(len(time), np.nan)
    for index, plane in enumerate(planes):
        rows = phase == index
        if plane is None or not np.any(rows):
            continue
        found = plane.zero_moment_point(wrench[rows])
        point[rows] = plane.origin + found @ plane.axes[:, :2].T
        distance[rows] = signed_distance(found, plane.polygon)
    distance[np.isnan(point[:, 0])] = np.nan
    return ZmpPath(time, point, distance, phase, planes)


def contact_wrench(motion: Motion, schedule: ContactSchedule, switching: float = 0.1) -> FloatArray:
    """(n, 6) wrench of all contacts on the body about the world origin [N, N.m].

    Args:
        motion: Its contact moments are about the planned contacts' origins.
        schedule: The planned contacts.
        switching: After lift-off the moments stay about the contact left for this long [s].
    """
    total = np.zeros((len(motion.time), 6))
    for column, name in enumerate(motion.contact_names):
        place = _contact_origins(schedule, name, motion.time - switching, motion.time)
        force = motion.contact_force[:, column, :3]
        total[:, :3] += force
        total[:, 3:] += motion.contact_force[:, column, 3:] + cross(place, force)
    return total


def _contact_origins(
    schedule: ContactSchedule, effector: str, shortly_before: FloatArray, now: FloatArray
) -> FloatArray:
    """(n, 3) origin of the contact held now, or left shortly before, or else made next, or last."""
    stances = [phase.stance for phase in schedule.sequence]
    held = [next((c for c in stance if c.effector == effector), None) for stance in stances]
    pairs = np.column_stack([schedule.phase_at(shortly_before), schedule.phase_at(now)])
    places = np.zeros((len(now), 3))
    for before, current in np.unique(pairs, axis=0):
        candidates = (held[current], held[before], *held[current:], *held[current::-1])
        contact = next((c for c in candidates if c is not None), None)
        if contact is not None:
            places[np.all(pairs == (before, current), axis=1)] = contact.position
    return places


def _common_normal(points: FloatArray, mean_normal: FloatArray) -> FloatArray:
    """Unit normal of the plane through the points; of points on a line, the contacts' mean normal."""
    _, sizes, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if len(sizes) < 3 or sizes[1] <= 2 * COPLANAR:
        return mean_normal / max(float(np.linalg.norm(mean_normal)), 1e-12)
    normal = directions[2]
    return normal if normal @ mean_normal >= 0.0 else -normal


def _axes(normal: FloatArray) -> FloatArray:
    """(3, 3) rotation whose columns are: nearly x, nearly y, ``normal`` (which is not horizontal)."""
    first = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    first /= np.linalg.norm(first)
    return np.column_stack([first, cross(normal, first), normal])
