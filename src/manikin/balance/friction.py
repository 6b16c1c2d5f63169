"""Friction cones, the wrenches of a frictional contact, and the limits of a contact as named inequalities.

All rows act on ``[force; moment]`` in the contact frame (x forward, y left, z the normal),
moments about its origin; they are of unit length, with alpha = 1 m.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache

import numpy as np

from manikin.contact import Contact, ContactKind, FrictionModel
from manikin.contact.contact import friction_model as checked
from manikin.numerics.facet_enumeration import fan_of_generators
from manikin.numerics.polytope import convex_polygon, walls
from manikin.numerics.spatial import FloatArray, cross


class LimitKind(StrEnum):
    """Kinds of limits by what gives way."""

    SLIPPING = "slipping"
    TIPPING = "tipping"
    TURNING = "turning"
    LIFTING = "lifting"
    NORMAL_FORCE_CAP = "normal force cap"
    GRASP_FORCE = "grasp force"
    GRASP_MOMENT = "grasp moment"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True, eq=False)
class ContactLimits:
    """Unit rows ``A w <= b``, (k, 6) and (k,) [N, N.m], of one contact.

    Each has its kind and a phrase: how the contact moves when it gives way.
    """

    A: FloatArray
    b: FloatArray
    kinds: tuple[LimitKind, ...]
    phrases: tuple[str, ...]


Row = tuple[list[float], float, LimitKind, str]


def contact_limits(contact: Contact, friction_model: FrictionModel = "outer") -> ContactLimits:
    """Limits of a sole, point or grasp.

    A sole without ``torsion_limit`` has the 16 rows equivalent to four corner points with friction pyramids:
    friction, CoP, and the yaw moment those forces allow (closed form of the sole's wrench cone, our own
    derivation, checked against the corner forces); under the friction model ``cone`` the rows of the yaw
    moment are those facets of the cone over the corner forces that bound it. With a ``torsion_limit`` the yaw
    rows are the safe eight-row form ``|n tau| + mu |s tau| + mu |t tau| <= limit`` ([Qiu2012]_ 4.21
    corrected), beside friction on the whole force (4.20) and CoP (4.14).

    A part of a sole is taken about the middle of its points; an edge resists no moment about itself.
    ContactError if the friction model is unknown.
    """
    if contact.kind is ContactKind.GRASP:
        rows = _grasp_rows(contact)
    else:
        rows = _friction_rows(contact, friction_model)
        if contact.kind is ContactKind.SOLE:
            rows += _pressure_rows(contact) + _turning_rows(contact, friction_model)
        if contact.normal_force_cap is not None:
            cap = contact.normal_force_cap
            phrase = f"normal force cap of {cap:g} N"
            rows.append(([0, 0, 1, 0, 0, 0], cap, LimitKind.NORMAL_FORCE_CAP, phrase))
    normals, bounds, kinds, phrases = zip(*rows, strict=True)
    A, b = np.array(normals, dtype=np.float64), np.array(bounds)
    length = np.linalg.norm(A, axis=1)
    return ContactLimits(A / length[:, None], b / length, kinds, phrases)


def _friction_rows(contact: Contact, friction_model: FrictionModel) -> list[Row]:
    """A force at its limit along +x cannot keep the contact from moving along -x."""
    rows: list[Row] = []
    for side in pyramid_sides(contact, friction_model).tolist():
        axis = int(abs(side[1]) > abs(side[0]))
        along = ("-" if side[axis] > 0.0 else "+") + "xy"[axis]
        rows.append(([*side, 0.0, 0.0, 0.0], 0.0, LimitKind.SLIPPING, f"slipping along {along}"))
    return rows


def _pressure_rows(contact: Contact) -> list[Row]:
    """CoP inside the rectangle ([Qiu2012]_ 4.14) or polygon: x = -tau_y / f_z, y = tau_x / f_z."""
    if _is_polygon(contact):
        return _polygon_rows(contact)
    x, y, tip = contact.length / 2, contact.width / 2, LimitKind.TIPPING
    sides = {"left": ("outer", "inner"), "right": ("inner", "outer")}
    left, right = sides.get(contact.effector.split("_")[0], ("left", "right"))
    over, end = "tipping over its {} edge", "edge"
    ahead, behind = over.format("front"), over.format("rear")
    if x == 0.0:
        ahead, behind, end = "rolling forward over its edge", "rolling backward over its edge", "end"
    return [
        ([0, 0, -x, 0, -1, 0], 0.0, tip, ahead),
        ([0, 0, -x, 0, 1, 0], 0.0, tip, behind),
        ([0, 0, -y, 1, 0, 0], 0.0, tip, f"tipping over its {left} {end}"),
        ([0, 0, -y, -1, 0, 0], 0.0, tip, f"tipping over its {right} {end}"),
    ]


def _is_polygon(contact: Contact) -> bool:
    """Whether a sole touches with something other than a rectangle along its axes, or an edge."""
    local = np.abs(contact.points - contact.centre)[:, :2]
    return contact.kind is ContactKind.SOLE and bool(np.abs(local - local.max(axis=0)).max() > 1e-9)


def _polygon_rows(contact: Contact) -> list[Row]:
    """CoP inside the hull of the points, about their middle."""
    corners = convex_polygon((contact.points - contact.centre)[:, :2])
    rows: list[Row] = []
    for (x, y), corner in zip(walls(corners)[0].tolist(), corners, strict=True):
        across = abs(y) > abs(x)
        side = ("left" if y > 0.0 else "right") if across else ("front" if x > 0.0 else "rear")
        phrase = f"tipping over the {side} edge of what of it touches"
        rows.append(([0, 0, -float(corner @ [x, y]), y, -x, 0], 0.0, LimitKind.TIPPING, phrase))
    return rows


def _turning_rows(contact: Contact, friction_model: FrictionModel) -> list[Row]:
    mu, limit = pyramid_friction(contact, friction_model), contact.torsion_limit or 0.0
    x, y = contact.length / 2, contact.width / 2
    signs = [(a, b, c) for c in (1.0, -1.0) for a in (1.0, -1.0) for b in (1.0, -1.0)]
    rows: list[list[float]]
    if contact.torsion_limit is not None:
        rows = [[0, 0, 0, a * mu, b * mu, c] for a, b, c in signs]
    elif friction_model == "cone" or _is_polygon(contact):
        centred = replace(contact, points=contact.points - contact.centre)
        rows = _yaw_facets(centred, friction_model).tolist()
    else:
        rows = [[a * y, b * x, -mu * (x + y), c * a * mu, c * b * mu, c] for a, b, c in signs]
    words = {True: "turning clockwise on its sole", False: "turning counter-clockwise on its sole"}
    return [(row, limit, LimitKind.TURNING, words[row[5] > 0.0]) for row in rows]


def _yaw_facets(sole: Contact, friction_model: FrictionModel) -> FloatArray:
    """(k, 6) facets of the cone over the corner forces that bound the yaw moment.

    The other ones are those of friction and pressure: a sum of corner forces has any force in the
    friction cone together with any centre of pressure in the rectangle or polygon.
    """
    edges = edge_wrenches(sole, friction_model)
    size = np.hypot(sole.length, sole.width)
    edges[:, 3:] /= size
    fan = fan_of_generators(edges, np.ones((len(edges), 1)), np.ones(1, dtype=np.bool_))
    H, h, _ = fan.facet_rows(1.0)
    rows = H[(np.abs(h) < 1e-9) & (np.abs(H[:, 5]) > 1e-9)]
    rows[:, 3:] /= size
    return rows / np.abs(rows[:, 5:])


def _grasp_rows(contact: Contact) -> list[Row]:
    """Box per axis ([Qiu2012]_ 4.22); the axes are the world's."""
    rows: list[Row] = []
    for axis, name in enumerate("xyz"):
        for sign, text in ((1.0, "+"), (-1.0, "-")):
            row = np.zeros(6)
            row[axis] = sign
            phrase = f"grasp force limit of {contact.max_force:g} N along {text}{name}"
            rows.append((row.tolist(), contact.max_force, LimitKind.GRASP_FORCE, phrase))
            phrase = f"grasp moment limit of {contact.max_moment:g} N.m about {text}{name}"
            rows.append((np.roll(row, 3).tolist(), contact.max_moment, LimitKind.GRASP_MOMENT, phrase))
    return rows


_CORNERS: FloatArray = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])

_CONE_SIDES = 8  # edges along x and y, where no friction is lost, and between them

_CONE_ANGLES: FloatArray = 2.0 * np.pi * np.arange(_CONE_SIDES) / _CONE_SIDES
_CONE_EDGES: FloatArray = np.column_stack([np.cos(_CONE_ANGLES), np.sin(_CONE_ANGLES)])


def pyramid_friction(contact: Contact, friction_model: FrictionModel) -> float:
    """Largest tangential force along the contact's x or y axis per unit normal force."""
    return contact.friction / np.sqrt(2.0) if checked(friction_model) == "inner" else contact.friction


def pyramid_edges(contact: Contact, friction_model: FrictionModel = "outer") -> FloatArray:
    """(k, 3) forces along the pyramid's edges, 4 or with ``cone`` 8, of unit normal force, contact frame."""
    directions = _CONE_EDGES if checked(friction_model) == "cone" else _CORNERS
    tangential = pyramid_friction(contact, friction_model) * directions
    return np.column_stack([tangential, np.ones(len(tangential))])


@lru_cache(maxsize=256)
def edges_in_world(
    contact: Contact, friction_model: FrictionModel = "outer", share: float = 1.0
) -> FloatArray:
    """(k, 3) forces along the pyramid's edges in world axes, with unit normal force; read-only.

    Edges of ``inner`` and ``cone`` lie on the friction cone, or inside it where a share of the friction is
    made use of: their tangential part is ``share mu`` long.
    """
    local = pyramid_edges(contact, friction_model) * [share, share, 1.0]
    edges = local @ contact.rotation_contact_to_world.T
    edges.setflags(write=False)
    return edges


def pyramid_sides(contact: Contact, friction_model: FrictionModel = "outer") -> FloatArray:
    """(k, 3) sides ``[n_x, n_y, -slope]`` of the pyramid: a force ``f`` is inside where ``sides @ f <= 0``.

    Both are in the contact frame; ``(n_x, n_y)`` is of unit length.
    """
    if checked(friction_model) == "cone":
        angles, slope = _CONE_ANGLES + np.pi / _CONE_SIDES, contact.friction * np.cos(np.pi / _CONE_SIDES)
        normals = np.column_stack([np.cos(angles), np.sin(angles)])
    else:
        slope = pyramid_friction(contact, friction_model)
        normals = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    return np.column_stack([normals, np.full(len(normals), -slope)])


def edge_wrenches(contact: Contact, friction_model: FrictionModel = "outer") -> FloatArray:
    """(n, 6) wrenches of the pyramid edges point by point, unit normal force each, in the contact frame.

    The cone over them is the set of wrenches a sole or point can apply ([Qiu2012]_ 4.25).
    """
    edges = pyramid_edges(contact, friction_model)
    wrenches = np.empty((len(contact.points), len(edges), 6))
    wrenches[..., :3] = edges
    wrenches[..., 3:] = cross(contact.points[:, None, :], wrenches[..., :3])
    return wrenches.reshape(-1, 6)


def contact_to_world(contact: Contact, wrenches: FloatArray, reference: FloatArray) -> FloatArray:
    """(n, 6) wrenches of a contact's frame in world axes, moments about ``reference`` (3,) [m]."""
    rotation = contact.rotation_contact_to_world
    force = wrenches[:, :3] @ rotation.T
    moment = wrenches[:, 3:] @ rotation.T + cross((contact.position - reference)[None], force)
    return np.hstack([force, moment])
