"""Friction pyramids: their edges, and the wrenches a frictional contact generates."""

from typing import Literal

import numpy as np

from manikin.contact import Contact
from manikin.errors import ContactError
from manikin.spatial import FloatArray

FrictionModel = Literal["pyramid", "inner"]
"""``pyramid`` bounds each tangential component by mu ([Qiu2012]_ 4.18-4.19), outside the
cone by up to sqrt 2; ``inner`` uses mu / sqrt 2 and stays inside the cone."""

EDGE_SIGNS: FloatArray = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
EDGE_SIGNS.setflags(write=False)


def pyramid_friction(contact: Contact, friction_model: FrictionModel) -> float:
    """Slope of the friction pyramid's sides.

    Raises:
        ContactError: If the model is unknown.
    """
    if friction_model == "pyramid":
        return contact.friction
    if friction_model == "inner":
        return contact.friction / np.sqrt(2.0)
    raise ContactError(f"friction_model is {friction_model!r}; valid: 'pyramid', 'inner'")


def edge_wrenches(contact: Contact, friction_model: FrictionModel = "pyramid") -> FloatArray:
    """Wrenches of the pyramid edges at the contact's points, unit normal force each.

    The cone over them is the set of wrenches a sole or point can apply ([Qiu2012]_ 4.25).

    Returns:
        (4 k, 6) in the contact frame, moments about its origin.
    """
    mu = pyramid_friction(contact, friction_model)
    wrenches = np.empty((len(contact.points), 4, 6))
    wrenches[..., :2], wrenches[..., 2] = mu * EDGE_SIGNS, 1.0
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


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross product along the last axis; several times faster than numpy's on small arrays."""
    if a.ndim == b.ndim == 1:
        (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
        return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = ay * bz - az * by
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product
