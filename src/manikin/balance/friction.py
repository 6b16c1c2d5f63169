"""Edges of friction pyramids and the wrenches they generate."""

from typing import Literal

import numpy as np

from manikin.contact import Contact
from manikin.errors import ContactError
from manikin.spatial import FloatArray

FrictionModel = Literal["pyramid", "inner"]
"""``pyramid`` bounds each tangential component by mu ([Qiu2012]_ 4.18-4.19, outside the
cone by up to sqrt 2); ``inner`` uses mu / sqrt 2, inside the cone."""


def pyramid_edges(friction: float, friction_model: FrictionModel = "pyramid") -> FloatArray:
    """(4, 3) edges of the friction pyramid in the contact frame, unit normal force.

    Raises:
        ContactError: If the model is unknown.
    """
    if friction_model not in ("pyramid", "inner"):
        raise ContactError(f"friction_model is {friction_model!r}; valid: 'pyramid', 'inner'")
    mu = friction if friction_model == "pyramid" else friction / np.sqrt(2.0)
    return np.array([[mu, mu, 1.0], [-mu, mu, 1.0], [-mu, -mu, 1.0], [mu, -mu, 1.0]])


def edge_wrenches(contact: Contact, friction_model: FrictionModel, reference: FloatArray) -> FloatArray:
    """(4 k, 6) wrenches of the pyramid edges at the k points, unit normal force each.

    World axes, moments about ``reference``.
    """
    forces = pyramid_edges(contact.friction, friction_model) @ contact.rotation_contact_to_world.T
    arms = contact.points_in_world - reference
    k = len(arms)
    forces = np.broadcast_to(forces, (k, 4, 3))
    return np.concatenate([forces, np.cross(arms[:, None, :], forces)], axis=-1).reshape(4 * k, 6)
