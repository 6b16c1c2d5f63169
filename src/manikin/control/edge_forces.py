"""Contact forces as non-negative combinations of the edges of friction pyramids."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manikin.balance.friction import edges_in_world
from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment, hinge_line
from manikin.contact import Contact, ContactKind, FrictionModel, SolePart
from manikin.control.dynamics import DynamicsState, FrameState
from manikin.numerics.polytope import chord, inset_polygon
from manikin.numerics.spatial import FloatArray, skew
from manikin.scene.surface import bar_radius

MOST_ROLLED = 0.03
"""Farthest way of a sole on a round bar that counts [m]: beyond that it has slipped; our choice."""

ROUND = 0.02
"""Length of what of a sole touches up to which it carries at a line: that of a rod is 14 mm [m]."""


@dataclass(frozen=True, eq=False)
class ContactGeometry:
    """Force-carrying points of one effector, on its segment and on what hangs from it.

    A foot carries force at its heel corners and at the ends of the line of its toe hinge; the tips belong to
    the toes, so that a load there is paid for by the toe hinge.

    Attributes:
        effector: Name of the effector.
        patches: Segments and (k, 3) points in their frames [m], the effector's own segment first.
    """

    effector: str
    patches: tuple[tuple[str, FloatArray], ...]

    @cached_property
    def point_count(self) -> int:
        """Number of points of all patches."""
        return sum(len(points) for _, points in self.patches)


def contact_geometry(body: BodyModel, contact: Contact, inset: float) -> ContactGeometry:
    """Find the points of the body that carry the forces of a contact, ``inset`` [m] from the sole's edge."""
    effector = body.effector(contact.effector)
    toes = hanging_segment(body, effector.segment)

    def on_segment(points: FloatArray) -> FloatArray:
        return effector.translation + points @ effector.rotation.T

    none, line = np.zeros((0, 3)), hinge_line(body, contact.effector)
    if contact.part is not SolePart.FULL:
        points = contact.points.copy()
        points[:, 1] -= inset * np.sign(points[:, 1])
        points[:, 2] += contact.edge_radius  # the force on a round edge goes through its axis
        if contact.part is SolePart.TOES:
            points[points[:, 0] >= points[:, 0].max(), 0] -= inset
        on_toes = contact.part is SolePart.TOES and toes is not None
        heel, tips = (none, points) if on_toes else (points, none)
    elif contact.kind is not ContactKind.SOLE:
        heel, tips = contact.points, none
    elif contact.hangs_over or contact.length <= ROUND or (line is not None and 2.0 * line >= contact.length):
        polygon = inset_polygon(contact.outline, inset)
        if contact.length <= ROUND:  # on a rod: a line, about which the foot could turn
            middle, side = contact.centre, 0.5 * contact.width - inset
            polygon = np.array([[middle[0], middle[1] + side], [middle[0], middle[1] - side]])
        heel, tips = _parts(polygon, np.inf if line is None else line)
    else:
        half_length, half_width = 0.5 * contact.length - inset, 0.5 * contact.width - inset
        heel, tips = _rectangle((-half_length, half_length), half_width), none
        if line is not None:
            line = float(np.clip(line, -half_length + 0.01, half_length - 0.01))
            heel, tips = _rectangle((-half_length, line), half_width), _rectangle((half_length,), half_width)
    patches = [(effector.segment, on_segment(heel))] if len(heel) else []
    if toes is not None and len(tips):
        patches.append((toes.name, on_segment(tips) - toes.origin))
    return ContactGeometry(contact.effector, tuple(patches))


def on_bar(
    contact: Contact, geometry: ContactGeometry, body: BodyModel, frame: FrameState
) -> ContactGeometry:
    """The points of a sole on a round bar, on which it rolls, at the current placement of the effector.

    At a tilt ``t`` it touches a bar of radius ``r`` at ``r t`` from where it lay flat. With points that stay
    where they are, a load ``F`` turns it on by ``r F t``, which is more than an ankle is held with.
    """
    if contact.kind is not ContactKind.SOLE or contact.part is not SolePart.FULL or contact.length > ROUND:
        return geometry
    line = contact.position + contact.rotation_contact_to_world @ contact.centre
    axis = line - bar_radius(contact.length) * contact.normal
    rolled = float(frame.rotation[:, 0] @ (axis - frame.position) - contact.centre[0])
    away = np.clip(rolled, -MOST_ROLLED, MOST_ROLLED) * body.effector(contact.effector).rotation[:, 0]
    patches = tuple((segment, points + away) for segment, points in geometry.patches)
    return ContactGeometry(geometry.effector, patches)


def _parts(polygon: FloatArray, line: float) -> tuple[FloatArray, FloatArray]:
    """Corners (k, 3) of what of a polygon (n, 2) is behind a line across the sole, and those before it.

    The ends of the line are of the first, as long as anything is behind it.
    """
    behind, ahead = polygon[polygon[:, 0] <= line], polygon[polygon[:, 0] > line]
    if len(behind) and len(ahead) and (ends := chord(polygon, line)) is not None:
        behind = np.vstack([behind, [[line, y] for y in ends]])
    heel, tips = (np.column_stack([part, np.zeros(len(part))]) for part in (behind, ahead))
    return heel, tips


def points_along(body: BodyModel, geometry: ContactGeometry) -> FloatArray:
    """(k,) position of each force-carrying point along the effector's x axis, toes straight [m]."""
    effector = body.effector(geometry.effector)
    along = []
    for segment, points in geometry.patches:
        offset = np.zeros(3) if segment == effector.segment else body.segment(segment).origin
        along.append(((points + offset - effector.translation) @ effector.rotation)[:, 0])
    return np.concatenate(along)


def segment_key(segment: str) -> str:
    """Name of a segment among the frames of a :class:`DynamicsState`, apart from effectors."""
    return f"segment/{segment}"


def _rectangle(lengths: tuple[float, ...], half_width: float) -> FloatArray:
    return np.array([[x, y, 0.0] for x in lengths for y in (half_width, -half_width)])


@dataclass(frozen=True, eq=False)
class ContactForceBasis:
    """Linear map from the force variables of one effector to forces on the body.

    A sole or a point has a variable for each edge of the friction pyramid at each point, not negative, with
    unit normal force. A grasp has forces along the world axes and, where it can hold one, three moments.

    Attributes:
        contact: Its kind, planned place and limits.
        generalised: (nv, m) forces on the generalised coordinates per variable.
        wrench: (6, m) force and moment about the effector frame's origin per variable.
        normal: (m,) normal force per variable; zero for a grasp.
        lower: (m,) bound of each variable at full load [N, N.m].
        upper: (m,) the same.
    """

    contact: Contact
    generalised: FloatArray
    wrench: FloatArray
    normal: FloatArray
    lower: FloatArray
    upper: FloatArray


def inside_the_cone(asked: FrictionModel) -> FrictionModel:
    """Friction model of control: the one asked for, but ``inner`` for ``outer``: a foot must not slip."""
    return "cone" if asked == "cone" else "inner"


def contact_force_basis(
    contact: Contact, geometry: ContactGeometry, state: DynamicsState, *, sliding: bool = False,
    friction_share: float = 1.0, friction_model: FrictionModel = "inner",
) -> ContactForceBasis:  # fmt: skip
    """Build the force map of a contact at the current state.

    Args:
        contact: The contact; its planned rotation gives the normal and the friction its slope.
        geometry: Points of the body, from :func:`contact_geometry`.
        state: Current dynamics with a frame for each segment of the geometry and the effector.
        sliding: Whether the contact may slide; where it does, friction acts against the motion.
        friction_share: Share of the friction that is made use of.
        friction_model: Pyramid that stands for the friction cone.
    """
    if contact.kind is ContactKind.GRASP:
        return _grasp_basis(contact, state)
    edges = edges_in_world(contact, friction_model, friction_share)
    if sliding:
        edges = sliding_edges(contact, state.frames[contact.effector].twist[:3], edges)
    origin, count, start = state.frames[contact.effector].position, len(edges) * geometry.point_count, 0
    generalised, wrench = np.empty((len(state.v), count)), np.empty((6, count))
    for segment, points in geometry.patches:
        frame = state.frames[segment_key(segment)]
        end = start + len(edges) * len(points)
        wrench[:, start:end] = _edge_wrenches(edges, points @ frame.rotation.T)
        generalised[:, start:end] = frame.jacobian.T @ wrench[:, start:end]
        wrench[3:, start:end] += skew(frame.position - origin) @ wrench[:3, start:end]
        start = end
    upper = np.full(count, np.inf)
    return ContactForceBasis(contact, generalised, wrench, np.ones(count), np.zeros(count), upper)


def _edge_wrenches(edges: FloatArray, arms: FloatArray) -> FloatArray:
    """(6, e k) force and moment of each of the edges (e, 3) at each of the arms (k, 3)."""
    wrench = np.empty((6, len(arms), len(edges)))
    (x, y, z), (fx, fy, fz) = arms.T[:, :, None], edges.T
    wrench[:3] = edges.T[:, None]
    wrench[3:] = y * fz - z * fy, z * fx - x * fz, x * fy - y * fx
    return wrench.reshape(6, -1)


SLIDING_SPEED = 0.03
"""Slower than this a contact is not said to slide [m/s]."""


def sliding_edges(contact: Contact, velocity: FloatArray, edges: FloatArray) -> FloatArray:
    """(e, 3) edges of a contact at a velocity (3,) [m/s]: those given where it does not slide.

    Where it does, all are the kinetic friction with unit normal force, on the friction cone itself.
    """
    along = velocity - (velocity @ contact.normal) * contact.normal
    speed = float(np.linalg.norm(along))
    if speed < SLIDING_SPEED:
        return edges
    return np.tile(contact.normal - contact.friction / speed * along, (len(edges), 1))


def _grasp_basis(contact: Contact, state: DynamicsState) -> ContactForceBasis:
    size = 6 if contact.max_moment > 0 else 3
    wrench = np.eye(6)[:, :size]
    limit = np.array([contact.max_force] * 3 + [contact.max_moment] * (size - 3))
    jacobian = state.frames[contact.effector].jacobian
    return ContactForceBasis(contact, jacobian.T @ wrench, wrench, np.zeros(size), -limit, limit)
