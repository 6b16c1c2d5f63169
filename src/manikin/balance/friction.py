"""Friction cones: their edges and sides, and the wrenches a frictional contact generates."""

import numpy as np

from manikin.contact import Contact, FrictionModel
from manikin.contact.model import friction_model as checked
from manikin.spatial import FloatArray, cross

_CORNERS: FloatArray = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])

_CONE_SIDES = 8
"""Edges along x and y, where no friction is lost, and between them."""

_CONE_ANGLES: FloatArray = 2.0 * np.pi * np.arange(_CONE_SIDES) / _CONE_SIDES
_CONE_EDGES: FloatArray = np.column_stack([np.cos(_CONE_ANGLES), np.sin(_CONE_ANGLES)])
for _table in (_CORNERS, _CONE_EDGES):
    _table.setflags(write=False)


def pyramid_friction(contact: Contact, friction_model: FrictionModel) -> float:
    """Largest tangential force along the contact's x or y axis per unit normal force.

    Raises:
        ContactError: If the model is unknown.
    """
    return contact.friction / np.sqrt(2.0) if checked(friction_model) == "inner" else contact.friction


def pyramid_edges(contact: Contact, friction_model: FrictionModel = "outer") -> FloatArray:
    """Forces along the pyramid's edges with unit normal force, in the contact frame.

    Returns:
        (k, 3): 4 edges, 8 of the friction model ``cone``.

    Raises:
        ContactError: If the model is unknown.
    """
    if checked(friction_model) == "cone":
        tangential = contact.friction * _CONE_EDGES
    else:
        tangential = pyramid_friction(contact, friction_model) * _CORNERS
    return np.column_stack([tangential, np.ones(len(tangential))])


def pyramid_sides(contact: Contact, friction_model: FrictionModel = "outer") -> FloatArray:
    """Rows ``[n_x, n_y, -slope]`` of the pyramid's sides: a force ``f`` is inside where ``sides @ f <= 0``.

    Returns:
        (k, 3) in the contact frame; ``(n_x, n_y)`` is of unit length.

    Raises:
        ContactError: If the model is unknown.
    """
    if checked(friction_model) == "cone":
        angles, slope = _CONE_ANGLES + np.pi / _CONE_SIDES, contact.friction * np.cos(np.pi / _CONE_SIDES)
        normals = np.column_stack([np.cos(angles), np.sin(angles)])
    else:
        slope = pyramid_friction(contact, friction_model)
        normals = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    return np.column_stack([normals, np.full(len(normals), -slope)])


def edge_wrenches(contact: Contact, friction_model: FrictionModel = "outer") -> FloatArray:
    """Wrenches of the pyramid edges at the contact's points, unit normal force each.

    The cone over them is the set of wrenches a sole or point can apply ([Qiu2012]_ 4.25).

    Returns:
        (n, 6) in the contact frame, moments about its origin, point by point.
    """
    edges = pyramid_edges(contact, friction_model)
    wrenches = np.empty((len(contact.points), len(edges), 6))
    wrenches[..., :3] = edges
    wrenches[..., 3:] = cross(contact.points[:, None, :], wrenches[..., :3])
    return wrenches.reshape(-1, 6)


def contact_to_world(contact: Contact, wrenches: FloatArray, reference: FloatArray) -> FloatArray:
    """Wrenches in world axes, moments about ``reference``.

    Args:
        contact: Gives frame and position.
        wrenches: (n, 6) in the contact frame, moments about its origin.
        reference: (3,) in the world [m].
    """
    rotation = contact.rotation_contact_to_world
    force = wrenches[:, :3] @ rotation.T
    moment = wrenches[:, 3:] @ rotation.T + cross((contact.position - reference)[None], force)
    return np.hstack([force, moment])
