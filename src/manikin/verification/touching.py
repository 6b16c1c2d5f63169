"""Requirements of single contacts: they lie on the scene, on enough of the sole, and not inside a solid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind
from manikin.numerics.spatial import FloatArray
from manikin.runtime.requirement import Requirement, Worst
from manikin.verification.plan_file import nominal_size
from manikin.verification.solids import Solid

ON_SURFACE = 2e-3
"""Largest distance of a contact from the surface that it lies on [m]."""

ALIGNED_DEG = 2.0
"""Largest angle between a sole's normal and that of its surface [deg]."""

POINT_ALIGNED_DEG = 10.0
"""The same of a contact at a point, of an effector that is round [deg]."""

LEAST_SHARE = 0.6
"""Least part of a sole that has to touch."""

LEAST_ACROSS = 0.7
"""Least part of a sole's width that has to touch where it stands on a rung."""

MIDDLE = 0.25
"""Largest distance of a rung from the middle of the sole on it, by the sole's length."""

HIDDEN = 2e-3
"""Depth in a solid up to which what lies above a contact counts as free [m]."""

GRASP_REACH = 0.06
"""Largest distance of a grasping palm's middle from the surface that its fingers close round [m]."""

GRASP_DEPTH = 0.03
"""Largest depth of it inside what is grasped [m]."""

_SEEN = np.deg2rad(60.0)
_RAISED = 0.01
_SPACING = 0.015


@dataclass(frozen=True)
class Rules:
    """What a scenario allows of contacts.

    Attributes:
        friction: Coulomb coefficient of soles and points.
        grasp_force: Largest force of a grasp along each axis [N].
        forefoot: Whether the front of a sole alone may touch, as a climber's does.
        rungs: Whether a sole may stand on a rung: by the middle of its length, with most of its width.
    """

    friction: float
    grasp_force: float
    forefoot: bool = False
    rungs: bool = False


class ContactRows:
    """Measures contacts one by one, each place once."""

    def __init__(self, body: BodyModel, solids: Sequence[Solid], rules: Rules) -> None:
        self._body, self._solids, self._rules = body, solids, rules
        self._touched: dict[int, frozenset[str]] = {}
        self._kept: list[Contact] = []
        share = 0.0 if rules.forefoot else LEAST_SHARE
        angle, between = "angle between a point's normal and the surface", "between contact and surface"
        self._angle = Worst("max_contact_angle_deg", f"angle {between}", ALIGNED_DEG, 1e-9)
        self._point_angle = Worst("max_point_angle_deg", angle, POINT_ALIGNED_DEG, 1e-9)
        self._distance = Worst("max_contact_distance_m", f"distance {between}", ON_SURFACE, 1e-9)
        self._grasp = Worst("max_grasp_distance_m", "distance between palm and what it grasps", GRASP_REACH)
        self._hidden = Worst("max_hidden_depth_m", "depth inside a solid", HIDDEN, 1e-9)
        self._beyond = Worst("max_beyond_sole_m", "distance of contact points beyond the sole", 1e-3, 1e-9)
        self._share = Worst("min_sole_share", "part of the sole in contact", share, 1e-6)
        self._across = Worst("min_rung_share", "part of the sole's width on a rung", LEAST_ACROSS, 1e-6)
        self._friction = Worst("max_friction", "coefficient of friction", rules.friction, 1e-9)
        self._force = Worst("max_grasp_force_N", "force limit of a grasp", rules.grasp_force, 1e-9)

    def measure(self, contacts: Mapping[str, Contact], where: str) -> None:
        """Measure the contacts of a stage that were not yet."""
        for name, contact in contacts.items():
            if id(contact) not in self._touched:
                self._kept.append(contact)  # so that no other contact gets its id
                self._touched[id(contact)] = self._measured(contact, f"{name}, {where}")

    def touched(self, contact: Contact) -> frozenset[str]:
        """Names of the obstacles on which a measured contact lies."""
        return self._touched[id(contact)]

    @property
    def rows(self) -> list[Requirement | None]:
        """The requirements in the order of their attributes: those whose failure explains others first."""
        return [item.row for item in vars(self).values() if isinstance(item, Worst)]

    def _measured(self, contact: Contact, where: str) -> frozenset[str]:
        if contact.kind is ContactKind.GRASP:
            return self._grasped(contact, where)
        self._friction.take(contact.friction, where)
        self._hidden.take(*self._deepest(contact, where))
        hull = None
        if contact.kind is ContactKind.SOLE:
            hull, size = outline(contact.points), nominal_size(self._body, contact.effector)
            self._beyond.take(float(np.abs(contact.points[:, 2]).max()), where)
            if size is not None:
                beyond = np.abs(contact.points[:, :2]) - 0.5 * np.array(size)
                self._beyond.take(float(beyond.max()), where)
                if hull is None and not contact.rolls:
                    self._share.take(0.0, where)
        else:
            self._beyond.take(float(np.abs(contact.points).max()), where)
        return self._at_points(contact, where) if hull is None else self._lying(contact, hull, where)

    def _lying(self, contact: Contact, hull: FloatArray, where: str) -> frozenset[str]:
        """A polygon on flat pieces of the scene, which may be several in one plane."""
        local = polygon_samples(hull)
        samples = contact.position + local @ contact.rotation_contact_to_world.T
        corners = contact.points_in_world
        middle = contact.position + contact.centre @ contact.rotation_contact_to_world.T
        best, nearest, off = np.full(len(samples) + len(corners), np.inf), np.inf, np.pi
        touched = set()
        for solid in self._solids:
            distance, _ = solid.support(np.vstack([samples, corners]), contact.normal, _SEEN)
            best = np.minimum(best, distance)
            if distance.min() <= ON_SURFACE:
                touched.add(solid.name)
            height, angle = (float(value[0]) for value in solid.support(middle[None], contact.normal, _SEEN))
            if height < nearest - 1e-4 or (height < nearest + 1e-4 and angle < off):
                nearest, off = min(nearest, height), angle
        if nearest < 0.05:
            self._angle.take(float(np.rad2deg(off)), where)
        # The corners carry force; between them a sole may bridge a gap, which is no part of what touches.
        self._distance.take(float(best[len(samples) :].max()), where)
        weight = np.linalg.norm(local - hull.mean(axis=0), axis=1)
        lying = float(weight @ (best[: len(samples)] <= ON_SURFACE) / weight.sum())
        size = nominal_size(self._body, contact.effector)
        if size is not None:
            share, on = lying * area(hull) / (size[0] * size[1]), np.vstack([local, contact.points])
            on = on[best <= ON_SURFACE]
            middle = 0.5 * (on.min(axis=0) + on.max(axis=0)) if len(on) else np.full(3, np.inf)
            if self._rules.rungs and share < LEAST_SHARE and abs(middle[0]) <= MIDDLE * size[0]:
                self._across.take(float(np.ptp(on[:, 1])) / size[1], where)
            else:
                self._share.take(share, where)
        return frozenset(touched)

    def _at_points(self, contact: Contact, where: str) -> frozenset[str]:
        """Points, or an edge, on any surface."""
        touched = set()
        for point in contact.points_in_world:
            distances = [(float(solid.distance(point[None])[0]), solid) for solid in self._solids]
            near, nearest = min(distances, key=lambda item: abs(item[0]), default=(np.inf, None))
            self._distance.take(abs(near), where)
            if nearest is not None and abs(near) <= ON_SURFACE:
                touched |= {solid.name for distance, solid in distances if abs(distance) <= ON_SURFACE}
                away = nearest.distance((point + _RAISED * contact.normal)[None])[0]
                rise = np.clip((away - near) / _RAISED, -1.0, 1.0)
                self._point_angle.take(float(np.rad2deg(np.arccos(rise))), where)
        return frozenset(touched)

    def _grasped(self, contact: Contact, where: str) -> frozenset[str]:
        self._force.take(contact.max_force, where)
        distances = {solid.name: float(solid.distance(contact.position[None])[0]) for solid in self._solids}
        self._grasp.take(max(0.0, min(distances.values(), default=np.inf)), where)
        self._hidden.take(max(0.0, -min(distances.values(), default=0.0) - GRASP_DEPTH), where)
        return frozenset(name for name, distance in distances.items() if distance <= GRASP_REACH)

    def _deepest(self, contact: Contact, where: str) -> tuple[float, str]:
        """Greatest depth in a solid of what lies just above a contact [m], and where."""
        local, hull = contact.points, outline(contact.points)
        if hull is not None:
            middle = hull.mean(axis=0)
            share = 1.0 - 2e-3 / max(np.abs(hull - middle).max(), 2e-3)
            local = middle + share * (polygon_samples(hull) - middle)
        above = local + np.array([0.0, 0.0, _RAISED])
        points = contact.position + above @ contact.rotation_contact_to_world.T
        deepest, place = 0.0, where
        for solid in self._solids:
            depth = -float(solid.distance(points).min())
            if depth > deepest:
                deepest, place = depth, f"{where}, in {solid.name}"
        return deepest, place


def outline(points: FloatArray) -> FloatArray | None:
    """(k, 3) corners of the convex outline of points (n, 3) of a contact's plane; None of fewer than 3."""
    if len(points) < 3:
        return None
    try:
        hull = ConvexHull(points[:, :2])
    except QhullError:
        return None
    corners = points[hull.vertices]
    corners[:, 2] = points[:, 2].mean()
    return corners


def area(corners: FloatArray) -> float:
    """Area of a polygon (k, 3) in a contact's plane [m^2]."""
    x, y = corners[:, 0], corners[:, 1]
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def polygon_samples(corners: FloatArray) -> FloatArray:
    """(n, 3) points of a convex polygon (k, 3): on rings from its edge to its middle."""
    edge = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / _SPACING)))
        edge.append(start + np.arange(count)[:, None] / count * (end - start))
    ring, middle = np.concatenate(edge), corners.mean(axis=0)
    size = np.linalg.norm(ring - middle, axis=1).max()
    rings = np.linspace(0.0, 1.0, max(2, int(np.ceil(size / (2.0 * _SPACING))) + 1))
    return np.concatenate([middle + share * (ring - middle) for share in rings])
