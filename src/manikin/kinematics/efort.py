"""How well a limb can press along a direction: EFORT ([Tonneau2015]_ 5.2).

All functions take the translation's ``J J^T`` (3, 3) of each limb configuration, as the Jacobian of
one limb is 3 by the number of its joints (the thesis prints l by n in 5.2), and directions of unit
length, which 5.11 needs and does not say.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Limb
from manikin.body.limbs import limb_hinges, moving_segments
from manikin.errors import InputError
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array

MOST_RATIO = 1e6
"""Ratio at which EFORT takes a limb that needs no torque, which has an infinite one [N per N.m]."""


def unit_direction(direction: ArrayLike, name: str = "task direction") -> FloatArray:
    """(3,) direction of length 1.

    Raises:
        InputError: If it is zero or not finite.
    """
    vector = frozen_array(direction, name, (3,))
    length = float(np.linalg.norm(vector))
    if length < 1e-12:
        raise InputError(f"{name} is {vector.tolist()}; valid: a direction that is not zero")
    return frozen_array(vector / length, name)


def force_transmission_ratio(products: FloatArray, v: FloatArray) -> FloatArray:
    """(n,) ``f_T = (v^T J J^T v)^(-1/2)``, the force along unit ``v`` (3,) of unit torque (5.11) [N per N.m].

    From (n, 3, 3) ``J J^T`` [m^2] in the same frame; infinite where the limb carries it without torque.
    """
    squares = np.maximum(products.reshape(-1, 9) @ (v[:, None] * v).ravel(), 0.0)
    with np.errstate(divide="ignore"):
        return 1.0 / np.sqrt(squares)


def efort(products: FloatArray, direction: ArrayLike, normals: FloatArray) -> FloatArray:
    """EFORT: ``alpha = f_T (v . n)`` (5.12).

    The ratio is infinite where the limb carries the direction without torque, above all where it has no
    joints, as a pelvis on a seat: nothing but the surface bounds such a force.  It then counts as
    :data:`MOST_RATIO`, more than any limb that has to work, and what is left is to order contacts by
    how much the surface faces the direction, ``v . n``.

    Args:
        products: (n, 3, 3) ``J J^T`` [m^2].
        direction: (3,) ``v``: where the scene shall push this limb, see :class:`Task`.
        normals: (n, 3) unit normals of the surfaces, out of the scene, in the same frame.

    Returns:
        (n,) finite, negative where the surface would have to pull. What holds on and pulls has ``-alpha``
        (5.13).
    """
    v = unit_direction(direction)
    return np.minimum(force_transmission_ratio(products, v), MOST_RATIO) * (normals @ v)


def usable_efort(body: BodyModel, limb: Limb) -> float:
    """Least EFORT of a contact that is of use: where the limb, at all its strength, carries its own weight.

    EFORT is the force along the task per norm of the joint torques, and the torques of a limb have at most
    the norm ``T`` of its joints' strengths, so that ``alpha T`` bounds the force along the task.  Where that
    is less than the weight ``m g`` of the limb and what hangs on it, the contact takes nothing off the
    rest of the body: ``alpha < m g / T``.  Our own derivation; the thesis takes any contact.

    For a limb without joints the body's whole weight ``M g`` on the surface takes the place of the torques:
    ``v . n < m / M``, at the ratio :data:`MOST_RATIO`.

    Returns:
        [N per N.m], > 0.
    """
    weight = GRAVITY * sum(body.segment(name).mass for name in moving_segments(body, limb))
    hinges = limb_hinges(body, limb)
    if not hinges:
        return MOST_RATIO * weight / (GRAVITY * body.mass)
    return weight / float(np.linalg.norm([max(-hinge.torque_lower, hinge.torque_upper) for hinge in hinges]))


@dataclass(frozen=True, eq=False)
class Task:
    """Direction of what is to be done, and the limbs that act on an object.

    The thesis has one direction for all limbs, which makes every contact of hands that push a cupboard
    score negative: its side faces the hands and thus against the push. EFORT asks where the scene
    pushes the *limb*, so each limb has its own direction: along the task for those that move the
    body or brace it, against it for those that act on an object.

    Attributes:
        direction: (3,) unit direction in the world: of the body's motion, or of the force on an object.
        acting: Names of the limbs that act on an object.
    """

    direction: FloatArray
    acting: frozenset[str] = frozenset()

    def __init__(
        self, direction: ArrayLike, acting: frozenset[str] | set[str] | tuple[str, ...] = ()
    ) -> None:
        object.__setattr__(self, "direction", unit_direction(direction))
        object.__setattr__(self, "acting", frozenset(acting))

    def reaction_on(self, limb: str) -> FloatArray:
        """(3,) unit direction in which the scene shall push a limb; EFORT's ``v``."""
        return -self.direction if limb in self.acting else self.direction
