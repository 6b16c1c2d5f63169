"""ZMP of stances whose soles and points lie in one plane, level or tilted.

Also here. The zero moment point along a motion, against the support polygon of each phase. The impulse that a
body on its way can take, predicted from what it is doing.

A push changes the momentum of the body by its impulse `J`. With the frequency ``w = sqrt(g / h)`` of a linear
inverted pendulum of height `h`, the capture point ``c = s + s' / w`` jumps by ``J / (m w)``, and its
deviation ``e`` from the plan then obeys

    ``e' = w (e - d)``

where ``d`` is how far the ZMP goes beyond its planned place. It can go no farther than to the edge of the
support polygon, which is ``D`` away in the direction of the push. Hence, with less and less known:

``plan``
    ``e`` stays bounded if and only if it begins below ``integral_0^inf w exp(-w t) D(t) dt``, the mean of the
    room that the plan leaves from now on, what comes soon counting most. This sees the next lift-off and the
    next landing.
``capture``
    A plan that could be stopped at once leaves the room between the capture point and the edge:
    ``e < D_c``. Negative where the capture point is already outside, as in the middle of a stride.
``margin``
    All that is known is the margin `r` of the wrench polytope [N.m], the least over all directions: a moment
    `r` more moves the ZMP by about ``r / (m g)``, and ``J = m w r / (m g) = r w / g``.

In each case ``J = m w e``. Two corrections hold for all: a force that lasts `T` does its first part of the
work early, and its last part, which is seen by a ZMP that has long moved, counts with ``exp(-w T)``, so that
``J`` may be ``w T / (1 - exp(-w T))`` larger; and a push at the height `z` over the ground instead of `h`
also turns the body, and stopping the turning costs room, so that ``J`` is ``h / z`` of it.

Left out are: arms and trunk that turn, and so take more than the ZMP can; a plan that waits; friction,
joint strength, what a swinging arm or a bowing head meets; a foot that lands elsewhere; and the part of the
polygon that is lost when the body also moves sideways.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.balance.criteria import support_height, zero_moment_point
from manikin.contact import ContactKind, ContactSchedule, Stance
from manikin.errors import InputError
from manikin.motion import Motion
from manikin.numerics.polygon import convex_polygon, signed_distance
from manikin.numerics.spatial import (
    GRAVITY,
    FloatArray,
    cross,
    finite_number,
    frozen_array,
    rotation_from_normal,
    skew,
)

COPLANAR = 0.005
"""Contact points this far from a common plane still lie in it [m]."""

STEEPEST = np.cos(np.deg2rad(60.0))
"""Vertical part of the normal below which a common plane is a wall."""

LEAST_LOAD = 20.0
"""Force along the normal below which there is no zero moment point [N]."""


@dataclass(frozen=True, eq=False)
class ContactPlane:
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
    planes: tuple[ContactPlane | None, ...]

    @property
    def decisive(self) -> NDArray[np.bool_]:
        """(n,) where the ZMP decides about balance, see :class:`ContactPlane`."""
        table = np.array([plane is not None and plane.decisive for plane in self.planes])
        return table[self.phase] & np.isfinite(self.distance)


def contact_plane(stance: Stance) -> ContactPlane | None:
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
    return ContactPlane(
        frozen_array(centre, "origin"), frozen_array(axes, "axes"), frozen_array(polygon, "polygon"), decisive
    )


def zmp_path(schedule: ContactSchedule, time: FloatArray, wrench: FloatArray) -> ZmpPath:
    """Follow the ZMP of a motion through the support polygons of its schedule.

    Args:
        schedule: The stances and when they are held.
        time: (n,) [s].
        wrench: (n, 6) of all contacts on the body about the world origin [N, N.m].
    """
    planes = tuple(contact_plane(phase.stance) for phase in schedule.sequence)
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


HORIZON = 5.0
"""Room this many time constants ``1 / w`` ahead counts; of what comes later, less than 1 % would."""

STEP = 0.01
"""Steps in which the room ahead is looked at [s]."""


@dataclass(frozen=True)
class ImpulsePrediction:
    """Impulses that a body can take in one direction at one time [N.s]; see the module for what they mean.

    Attributes:
        plan: From the room that the plan leaves from then on.
        capture: From the capture point's distance to the edge of the support polygon.
        margin: From the wrench margin, the same in all directions.
        frequency: ``w`` [1/s].
    """

    plan: float
    capture: float
    margin: float
    frequency: float


def predict_impulse(
    motion: Motion,
    schedule: ContactSchedule,
    mass: float,
    time: float,
    direction: ArrayLike,
    *,
    duration: float = 0.0,
    height: float | None = None,
) -> ImpulsePrediction:
    """Predict the impulse that a body can take at a time of its motion, as a point mass would.

    Args:
        motion: What it does, with contact forces.
        schedule: Its contacts in time.
        mass: [kg].
        time: When the push begins [s].
        direction: (2,) level direction of the push; its length does not matter.
        duration: Of the push [s].
        height: In the world at which it acts [m]; that of the centre of mass when omitted.

    Raises:
        InputError: If a number is not usable, or nothing carries the body at that time.
    """
    finite_number(mass, "mass [kg]", above=0.0)
    finite_number(duration, "push duration [s]", at_least=0.0)
    finite_number(time, "push time [s]", at_least=float(motion.time[0]), at_most=float(motion.time[-1]))
    way = frozen_array(direction, "push direction", (2,))
    if not np.any(way):
        raise InputError("push direction is [0, 0]; valid: a direction")
    way = way / np.linalg.norm(way)
    planes = tuple(contact_plane(phase.stance) for phase in schedule.sequence)
    plane = planes[int(schedule.phase_at(time))]
    if plane is None:
        raise InputError(f"nothing carries the body at {time:g} s; valid: a time with a foot on the ground")

    com = np.array([np.interp(time, motion.time, column) for column in motion.com.T])
    ground = float(plane.origin[2])
    frequency = float(np.sqrt(GRAVITY / (com[2] - ground)))
    velocity = np.gradient(motion.com, motion.time, axis=0)
    speed = np.array([np.interp(time, motion.time, column) for column in velocity.T])
    captured = _room(plane, com[:2] + speed[:2] / frequency, way)
    ahead = _discounted_room(motion, schedule, planes, time, way, frequency)
    margin = float(np.interp(time, motion.time, motion.margin))

    lasting = frequency * duration
    gain = 1.0 if lasting == 0.0 else lasting / (1.0 - np.exp(-lasting))
    if height is not None:
        gain *= (com[2] - ground) / finite_number(height - ground, "height of the push [m]", above=0.0)
    impulse = float(gain) * mass * frequency
    return ImpulsePrediction(
        plan=impulse * ahead,
        capture=impulse * captured,
        margin=impulse * margin / (mass * GRAVITY),
        frequency=frequency,
    )


def _discounted_room(
    motion: Motion,
    schedule: ContactSchedule,
    planes: tuple[ContactPlane | None, ...],
    time: float,
    way: FloatArray,
    frequency: float,
) -> float:
    """``integral w exp(-w t) D(t) dt`` from ``time`` on [m]; after its end the motion stands still."""
    since = np.arange(0.0, HORIZON / frequency, STEP)
    rows = np.searchsorted(motion.time, np.minimum(time + since, motion.time[-1]))
    used, back = np.unique(rows, return_inverse=True)
    wrench = contact_wrench(motion, schedule)[used]
    phases = schedule.phase_at(motion.time[used])
    room = np.zeros(len(used))
    for number, (phase, row) in enumerate(zip(phases, wrench, strict=True)):
        plane = planes[int(phase)]
        if plane is not None:
            point = plane.zero_moment_point(row[None])[0]
            if np.all(np.isfinite(point)):
                room[number] = _room(plane, (plane.origin + plane.axes[:, :2] @ point)[:2], way)
    weight = np.exp(-frequency * since)
    return float(weight @ room[back] / weight.sum())


def _room(plane: ContactPlane, point: FloatArray, way: FloatArray) -> float:
    """How far a point (2,) of the ground is from the edge of the polygon along a direction [m].

    Seen from above. Negative outside: the way back to where the direction's edge is.
    """
    corners = plane.corners_in_world[:, :2]
    if len(corners) < 3:
        return float(max((corners - point) @ way, default=0.0)) if len(corners) else 0.0
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack((along[:, 1], -along[:, 0]))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    facing = normals @ way
    ahead = facing > 1e-9
    offsets = np.sum(normals * (corners - point), axis=1)
    return float(np.min(offsets[ahead] / facing[ahead]))


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
