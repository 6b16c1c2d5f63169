"""One contact between an effector and the scene (sole, point or grasp), and the contact model of a stance."""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from manikin.errors import ContactError
from manikin.numerics.polytope import chord, convex_polygon, polygon_area
from manikin.numerics.spatial import (
    GRAVITY,
    FloatArray,
    PlanarTransform,
    check_rotation,
    finite_number,
    frozen_array,
    rotation_from_normal,
    rotation_from_yaw,
)
from manikin.runtime.display import Displayed

FrictionModel = Literal["outer", "inner", "cone"]
"""Pyramid that stands for the circular friction cone.

- ``outer``: four sides that touch the cone from outside ([Qiu2012]_ 4.18-4.19). It bounds each
  tangential component by ``mu f_n``, and holds tangential forces of up to ``sqrt(2) mu f_n``.
- ``inner``: four sides inside the cone, the edges on it (``mu / sqrt(2)`` along each axis). It loses up to
  29.3 % of the friction.
- ``cone``: eight sides inside the cone, the edges on it. It loses up to 7.6 % (``1 - cos(pi / 8)``) of the
  friction, nothing along the contact's x and y axes.
"""

FRICTION_MODELS: tuple[FrictionModel, ...] = get_args(FrictionModel)

MOST_CORNERS = 8
"""Most corners of what of a sole touches."""

LEAST_TOES = 0.6
"""Least share of the area before the hinge of the toes that lies on the surface where a foot rises."""

BODY_WEIGHTS_CAP = 3.0
"""Cap on the sum of normal forces of a stance where nothing else is given [body weights]."""


def default_normal_force_cap(mass: float) -> float:
    """Cap on the sum of normal forces of a body of a mass [kg] where nothing else is given [N]."""
    return BODY_WEIGHTS_CAP * mass * GRAVITY


def friction_model(value: object) -> FrictionModel:
    """The friction model of a name, ``pyramid`` being the older word for ``outer``; else ContactError."""
    for name in FRICTION_MODELS:
        if value == name or (value == "pyramid" and name == "outer"):
            return name
    raise ContactError(f"friction_model is {value!r}; valid: {', '.join(map(repr, FRICTION_MODELS))}")


@dataclass(frozen=True)
class ContactModel:
    """Friction cone and normal-force cap that the contacts of a stance share.

    Values that differ between contacts are with each :class:`~manikin.contact.Contact`.

    Attributes:
        friction: Friction model.
        normal_force_cap: Largest sum of the normal forces of all soles and points [N]; closes the wrench
            polytope ([Qiu2012]_ 4.26, summed along the normals so that walls are bounded too). None leaves it
            to the contacts' own caps.
    """

    friction: FrictionModel = "outer"
    normal_force_cap: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "friction", friction_model(self.friction))
        cap = _optional_limit(self.normal_force_cap, "stance normal_force_cap [N]")
        object.__setattr__(self, "normal_force_cap", cap)

    @classmethod
    def of_body(cls, mass: float, friction: FrictionModel = "outer") -> "ContactModel":
        """Model with the default cap of a body of a mass [kg]."""
        return cls(friction, default_normal_force_cap(mass))


class ContactKind(StrEnum):
    """Kind of contact: the forces that it can give."""

    SOLE = "sole"
    """Unilateral, frictional, over a rectangle or what of it touches: corner points carrying forces."""
    POINT = "point"
    """Unilateral, frictional, at one point."""
    GRASP = "grasp"
    """Bilateral, bounded in force (and moment) along each world axis."""


class SolePart(StrEnum):
    """Which part of a sole touches; what does not touch may tilt about the part that does."""

    FULL = "full"
    """All of it."""
    HEEL = "heel"
    """Its rear edge, about which the foot tilts after it has landed."""
    TOES = "toes"
    """The part before the hinge of the toes, about which the foot tilts before it leaves."""
    FRONT = "front"
    """Its round front edge, on which it rolls: buttocks under a trunk that leans."""


@dataclass(frozen=True, eq=False, repr=False)
class Contact(Displayed):
    """Pose, points and limits of an effector's contact with the scene ([Qiu2012]_ 4.2.1).

    Use :func:`sole`, :func:`point` or :func:`grasp` to make one.

    Attributes:
        effector: Name of the body's effector (``"left_foot"``).
        kind: Sole, point or grasp.
        position: (3,) origin of the contact frame in the world [m]; a sole's is its centre.
        rotation_contact_to_world: (3, 3); its z column is the normal, from the scene into
            the body; a sole's x column points to the toes.
        points: (k, 3) points of the contact frame that carry force [m].
        friction: Coulomb coefficient; 0 for a grasp, which has its own limits.
        normal_force_cap: Largest normal force of this contact [N], or None.
        torsion_limit: Largest moment about the normal [N.m], or None when only the friction of the corner
            points limits it ([Qiu2012]_ 4.21, safe form).
        max_force: Grasp force limit per world axis [N].
        max_moment: Grasp moment limit per world axis [N.m].
        part: Part of the sole that touches; position and rotation are always those of the full sole
            lying flat, :attr:`points` only those that touch.
        oriented: Whether a grasping hand should have the rotation (a sole always does).
        settle: Time after the touch-down in which the effector may still slide to its place [s].
        edge_radius: Of the round front edge on which the effector rolls about its y axis [m], or 0.
    """

    effector: str
    kind: ContactKind
    position: FloatArray
    rotation_contact_to_world: FloatArray
    points: FloatArray
    friction: float = 0.0
    normal_force_cap: float | None = None
    torsion_limit: float | None = None
    max_force: float = 0.0
    max_moment: float = 0.0
    part: SolePart = SolePart.FULL
    oriented: bool = False
    settle: float = 0.0
    edge_radius: float = 0.0

    @property
    def rolls(self) -> bool:
        """Whether the effector may turn about the contact's y axis as much as it likes."""
        return self.part is SolePart.FRONT

    @property
    def pivot(self) -> FloatArray:
        """(3,) middle of the line about which it turns then, in the effector's frame [m]."""
        return np.array([float(self.points[:, 0].max()), 0.0, self.edge_radius])

    def rolled_away(self, rotation: FloatArray, position: FloatArray) -> tuple[float, float]:
        """Distance of an effector's pivot from where it has rolled [m], and its wrong tilt [rad].

        Of its rotation (3, 3) to the world and its position (3,) [m].
        """
        frame, along = self.rotation_contact_to_world, rotation[:, 0]
        pitch = np.arctan2(-along @ frame[:, 2], along @ frame[:, 0])
        rolled = self.position + frame @ self.pivot + self.edge_radius * pitch * frame[:, 0]
        off = position + rotation @ self.pivot - rolled
        side = float(np.clip(rotation[:, 1] @ frame[:, 1], -1.0, 1.0))
        return float(np.linalg.norm(off)), float(np.hypot(np.arccos(side), min(pitch, 0.0)))

    @cached_property
    def hangs_over(self) -> bool:
        """Whether it is a full sole of which only a part is on its surface: no rectangle about its frame."""
        if self.kind is not ContactKind.SOLE or self.part is not SolePart.FULL:
            return False
        size = np.abs(self.points)
        return len(size) != 4 or bool(np.abs(size - size[0]).max() > 1e-12)

    @cached_property
    def outline(self) -> FloatArray:
        """(k, 2) hull of the points in the contact frame, counter-clockwise [m]."""
        return frozen_array(convex_polygon(self.points[:, :2]), "outline [m]")

    def toe_outline(self, hinge: float) -> FloatArray:
        """(k, 2) part of the outline before the hinge of the toes, which crosses the x axis there [m]."""
        ends, outline = chord(self.outline, hinge), self.outline
        line = np.zeros((0, 2)) if ends is None else np.array([[hinge, y] for y in ends])
        return np.vstack([outline[outline[:, 0] > hinge], line])

    def rises_on_toes(self, hinge: float) -> bool:
        """Whether it is a full sole whose toes, before the hinge [m], lie on the surface."""
        if self.kind is not ContactKind.SOLE or self.part is not SolePart.FULL:
            return False
        if not self.hangs_over:
            return True
        toes = self.toe_outline(hinge)
        if len(toes) < 3:
            return False
        area = polygon_area(convex_polygon(toes))
        # Where the heel is cut off, the toes are whole.
        tip = max(0.5 * self.length, float(toes[:, 0].max()))
        return area >= LEAST_TOES * (tip - hinge) * self.width

    @cached_property
    def centre(self) -> FloatArray:
        """(3,) middle of the points in the contact frame [m]; the origin for a full sole."""
        return frozen_array(0.5 * (self.points.min(axis=0) + self.points.max(axis=0)), "centre [m]")

    @property
    def normal(self) -> FloatArray:
        """(3,) unit normal in the world, from the scene into the body."""
        return self.rotation_contact_to_world[:, 2]

    @property
    def points_in_world(self) -> FloatArray:
        """(k, 3) force-carrying points in the world [m]."""
        return self.position + self.points @ self.rotation_contact_to_world.T

    @property
    def yaw(self) -> float:
        """Heading of the contact's x axis about the world vertical [rad]."""
        forward = self.rotation_contact_to_world[:, 0]
        return float(np.arctan2(forward[1], forward[0]))

    @cached_property
    def length(self) -> float:
        """Extent of the points along the contact's x axis [m]."""
        return float(np.ptp(self.points[:, 0]))

    @cached_property
    def width(self) -> float:
        """Extent of the points along the contact's y axis [m]."""
        return float(np.ptp(self.points[:, 1]))

    def same_place(self, other: "Contact", tolerance: float = 1e-9) -> bool:
        """Whether ``other`` is the same effector at the same pose, whatever its limits."""
        turn = self.rotation_contact_to_world - other.rotation_contact_to_world
        apart = max(np.abs(self.position - other.position).max(), np.abs(turn).max())
        return self.effector == other.effector and bool(apart <= tolerance)

    def moved(self, transform: PlanarTransform) -> "Contact":
        """The contact as seen from another frame of the world."""
        position = frozen_array(transform.points(self.position), "contact position")
        rotation = frozen_array(transform.rotations(self.rotation_contact_to_world), "contact rotation")
        return replace(self, position=position, rotation_contact_to_world=rotation)


def sole(
    effector: str, position: ArrayLike, yaw: float = 0.0, *, length: float, width: float, friction: float,
    normal: ArrayLike | None = None, rotation: ArrayLike | None = None,
    normal_force_cap: float | None = None, torsion_limit: float | None = None, settle: float = 0.0,
    polygon: ArrayLike | None = None,
) -> Contact:  # fmt: skip
    """Make a rectangular sole, or one that hangs over an edge: corner points with friction pyramids.

    Args:
        effector: Name of the effector, such as ``"left_foot"``.
        position: (3,) centre of the sole in the world [m].
        yaw: Heading of the toes [rad], counter-clockwise from world x (about ``normal``).
        length: Along the heading [m].
        width: Across the heading [m].
        friction: Coulomb coefficient, > 0.
        normal: (3,) surface normal; up when omitted.
        rotation: (3, 3) contact-to-world rotation; replaces ``yaw`` and ``normal``.
        normal_force_cap: Largest normal force on this sole [N].
        torsion_limit: Largest moment about the normal [N.m].
        settle: Time after the touch-down in which it may still slide to its place [s].
        polygon: (k, 2) convex corners of what of the rectangle touches, in the contact frame [m];
            all of it when omitted.

    Raises:
        ContactError: If a value is not finite or out of its range.
    """
    where = f"sole '{effector}'"
    half_length = finite_number(length, f"{where} length", above=0.0, error=ContactError) / 2
    half_width = finite_number(width, f"{where} width", above=0.0, error=ContactError) / 2
    signs = ((1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0))
    corners = [[a * half_length, b * half_width, 0.0] for a, b in signs]
    if polygon is not None:
        half = np.array([half_length, half_width])
        part = _part_of_sole(polygon, half, where)
        whole = np.abs(part[:, :2]) >= half - 1e-9
        corners = corners if len(part) == 4 and whole.all() else part
    made = _frictional(
        ContactKind.SOLE, effector, position, corners, yaw, friction, normal, rotation, normal_force_cap
    )
    torsion = _optional_limit(torsion_limit, f"{where} torsion_limit [N.m]")
    settle = finite_number(settle, f"{where} settle [s]", at_least=0.0, error=ContactError)
    return replace(made, torsion_limit=torsion, settle=settle)


def _part_of_sole(polygon: ArrayLike, half: FloatArray, where: str) -> FloatArray:
    """(k, 3) corners of what of a sole touches, counter-clockwise, checked against its half sizes (2,)."""
    given = frozen_array(polygon, f"{where} polygon [m]", (None, 2), ContactError)
    hull = convex_polygon(given)
    beyond = float((np.abs(given) - half).max(initial=0.0))
    if beyond > 1e-6:
        raise ContactError(
            f"{where} polygon goes {beyond * 1000:.1f} mm beyond the sole; valid: corners in its rectangle"
        )
    if len(hull) != len(given) or not 3 <= len(hull) <= MOST_CORNERS:
        raise ContactError(
            f"{where} polygon has {len(given)} corners, {len(hull)} on its hull; "
            f"valid: 3 to {MOST_CORNERS} corners of a convex polygon"
        )
    return np.column_stack([hull, np.zeros(len(hull))])


def point(
    effector: str, position: ArrayLike, *, friction: float, normal: ArrayLike | None = None,
    rotation: ArrayLike | None = None, normal_force_cap: float | None = None,
) -> Contact:  # fmt: skip
    """Make a frictional point contact at a position (3,) [m]; other arguments as of :func:`sole`."""
    points = [[0.0, 0.0, 0.0]]
    return _frictional(
        ContactKind.POINT, effector, position, points, 0.0, friction, normal, rotation, normal_force_cap
    )


def grasp(
    effector: str, position: ArrayLike, *, max_force: float, max_moment: float = 0.0,
    rotation: ArrayLike | None = None,
) -> Contact:  # fmt: skip
    """Make a grasp: force and moment bounded along each world axis ([Qiu2012]_ 4.22).

    Args:
        effector: Name of the effector, such as ``"right_hand"``.
        position: (3,) in the world [m].
        max_force: Largest force along each world axis [N], > 0.
        max_moment: Largest moment along each world axis [N.m]; 0 makes a pure point grasp.
        rotation: (3, 3) contact-to-world rotation that the hand should have; free when omitted.

    Raises:
        ContactError: If a value is out of its range.
    """
    where, turn = f"grasp '{effector}'", np.eye(3) if rotation is None else rotation
    return Contact(
        effector, ContactKind.GRASP,
        frozen_array(position, f"{where} position", (3,), ContactError),
        check_rotation(turn, f"{where} rotation", ContactError),
        frozen_array(np.zeros((1, 3)), "points"),
        max_force=finite_number(max_force, f"{where} max_force [N]", above=0.0, error=ContactError),
        max_moment=finite_number(max_moment, f"{where} max_moment [N.m]", at_least=0.0, error=ContactError),
        oriented=rotation is not None,
    )  # fmt: skip


def rolling_front(contact: Contact, radius: float) -> Contact:
    """The front edge of a whole sole, of a radius [m] > 0, on which it rolls; ContactError for any other."""
    if contact.kind is not ContactKind.SOLE or contact.part is not SolePart.FULL or contact.hangs_over:
        raise ContactError(f"front of '{contact.effector}' is taken from what is no whole sole")
    name = f"sole '{contact.effector}' edge radius [m]"
    radius = finite_number(radius, name, above=0.0, error=ContactError)
    front = contact.points[contact.points[:, 0] > 0.0]
    points = frozen_array(front, "points of a front [m]", (2, 3))
    return replace(contact, points=points, part=SolePart.FRONT, torsion_limit=None, edge_radius=radius)


def sole_part(contact: Contact, part: SolePart, hinge: float) -> Contact:
    """Keep of a full sole only the points of one of its parts, at the same place.

    Forces at these points alone make the part's wrenches: two for the heel, so that it gives no
    moment about its edge. A torsion limit is dropped, as the friction of fewer points is less.

    Args:
        contact: A full sole; ContactError for any other contact.
        part: What touches.
        hinge: Where the hinge of the toes crosses the sole's x axis [m]; ContactError beyond it.
    """
    where = f"{part} of '{contact.effector}'"
    if contact.kind is not ContactKind.SOLE or contact.part is not SolePart.FULL:
        raise ContactError(f"{where} is taken from a {contact.part} {contact.kind}; valid: a full sole")
    if part is SolePart.FULL:
        return contact
    if contact.hangs_over and not (part is SolePart.TOES and contact.rises_on_toes(hinge)):
        raise ContactError(f"{where} is taken from a sole that hangs over an edge there; valid: a whole one")
    x, y = contact.length / 2, contact.width / 2
    back, front = (float(end(contact.points[:, 0])) for end in (np.min, np.max))
    line = finite_number(hinge, f"{where} hinge [m]", above=back, at_most=front, error=ContactError)
    corners = [[-x, -y, 0.0], [-x, y, 0.0]]
    if part is SolePart.TOES:
        corners = [[x, y, 0.0], [x, -y, 0.0], [line, -y, 0.0], [line, y, 0.0]]
        if contact.hangs_over:
            corners = [[*place, 0.0] for place in contact.toe_outline(line).tolist()]
    points = frozen_array(corners, f"{where} points", (None, 3))
    return replace(contact, points=points, part=part, torsion_limit=None)


def _frictional(
    kind: ContactKind, effector: str, position: ArrayLike, points: ArrayLike, yaw: float, friction: float,
    normal: ArrayLike | None, rotation: ArrayLike | None, normal_force_cap: float | None,
) -> Contact:  # fmt: skip
    where = f"{kind} '{effector}'"
    heading = finite_number(yaw, f"{where} yaw [rad]", error=ContactError)
    if rotation is not None:
        frame = check_rotation(rotation, f"{where} rotation", ContactError)
    elif normal is not None:
        frame = rotation_from_normal(normal, heading)
    else:
        frame = rotation_from_yaw(heading)
    return Contact(
        effector, kind,
        frozen_array(position, f"{where} position", (3,), ContactError),
        frozen_array(frame, f"{where} rotation", (3, 3), ContactError),
        frozen_array(points, f"{where} points", (None, 3), ContactError),
        finite_number(friction, f"{where} friction", above=0.0, error=ContactError),
        _optional_limit(normal_force_cap, f"{where} normal_force_cap [N]"),
    )  # fmt: skip


def _optional_limit(value: float | None, name: str) -> float | None:
    return None if value is None else finite_number(value, name, above=0.0, error=ContactError)


def soles_overlap(first: Contact, second: Contact, thickness: float = 0.03) -> bool:
    """Whether two soles would be in the same place (separating axes of their rectangles).

    Contacts that are no soles, and soles farther apart along the normal than ``thickness`` [m], do not.
    """
    if first.kind is not ContactKind.SOLE or second.kind is not ContactKind.SOLE:
        return False
    axes = (*first.rotation_contact_to_world[:, :2].T, *second.rotation_contact_to_world[:, :2].T)
    corners, others = first.points_in_world, second.points_in_world
    if np.abs((others - first.position) @ first.normal).min() > thickness:
        return False
    extents = ((corners @ axis, others @ axis) for axis in axes)
    return all(a.max() > b.min() and b.max() > a.min() for a, b in extents)
