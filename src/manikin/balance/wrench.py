"""The admissible pseudo-wrench space W_p of a stance and the pseudo-wrench itself."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from manikin.balance.friction import FrictionModel, edge_wrenches
from manikin.contact import Contact, ContactKind, Stance
from manikin.errors import ContactError
from manikin.polytope import Polytope, convex_hull
from manikin.spatial import GRAVITY_VECTOR, FloatArray, frozen_array


@dataclass(frozen=True, eq=False)
class WrenchPolytope(Polytope):
    """W_p: wrenches that the scene can apply to the body ([Qiu2012]_ 4.36).

    Attributes:
        H: (m, 6) unit rows over [force; moment], world axes, alpha = 1 m.
        h: (m,) offsets [N, N.m].
        stance: The contacts.
        reference: (3,) point of the moments [m].
        friction_model: ``"pyramid"`` or ``"inner"``.
    """

    stance: Stance
    reference: FloatArray
    friction_model: FrictionModel

    def __init__(
        self, H: ArrayLike, h: ArrayLike, stance: Stance, reference: ArrayLike, friction_model: FrictionModel
    ) -> None:
        super().__init__(H, h)
        object.__setattr__(self, "stance", stance)
        object.__setattr__(self, "reference", frozen_array(reference, "reference", (3,), ContactError))
        object.__setattr__(self, "friction_model", friction_model)


def pseudo_wrench(
    mass: float,
    com: ArrayLike,
    acceleration: ArrayLike,
    angular_momentum_rate: ArrayLike | None = None,
    reference: ArrayLike | None = None,
) -> FloatArray:
    """Wrench that the scene must apply: ``[m (a - g); (x - o) ^ m (a - g) + Ldot]``.

    [Qiu2012]_ 4.6 for the point mass, 4.51 with the rate of change of the angular momentum.

    Args:
        mass: [kg].
        com: (..., 3) [m].
        acceleration: (..., 3) of the CoM [m/s^2].
        angular_momentum_rate: (..., 3) about the CoM [N.m]; zero when omitted.
        reference: (3,) point ``o`` of the moments [m]; the world origin when omitted.

    Returns:
        (..., 6) [N, N.m].
    """
    force = mass * (np.asarray(acceleration, dtype=np.float64) - GRAVITY_VECTOR)
    arm = np.asarray(com, dtype=np.float64)
    if reference is not None:
        arm = arm - np.asarray(reference, dtype=np.float64)
    moment = np.cross(arm, force)
    if angular_momentum_rate is not None:
        moment = moment + np.asarray(angular_momentum_rate, dtype=np.float64)
    return np.concatenate(np.broadcast_arrays(force, moment), axis=-1)


def wrench_polytope(
    stance: Stance, *, friction_model: FrictionModel = "pyramid", reference: ArrayLike = (0.0, 0.0, 0.0)
) -> WrenchPolytope:
    """W_p of a stance.

    Raises:
        ContactError: If no cap closes the polytope.
    """
    origin = frozen_array(reference, "reference", (3,), ContactError)
    points = np.zeros((1, 6))
    coned = [c for c in stance if c.kind is not ContactKind.GRASP]
    if coned and stance.normal_force_cap is not None:
        edges = np.vstack([edge_wrenches(c, friction_model, origin) for c in coned])
        points = np.vstack([points, stance.normal_force_cap * edges])
    elif coned:
        for c in coned:
            if c.normal_force_cap is None:
                raise ContactError(
                    f"no cap bounds the normal force of {c.effector!r}; valid: give it normal_force_cap [N] "
                    "or give the stance one"
                )
            own = np.vstack([np.zeros((1, 6)), c.normal_force_cap * edge_wrenches(c, friction_model, origin)])
            points = (points[:, None] + own).reshape(-1, 6)
    for c in stance:
        if c.kind is ContactKind.GRASP:
            points = (points[:, None] + _grasp_corners(c, origin)).reshape(-1, 6)
    return WrenchPolytope(*convex_hull(points), stance, origin, friction_model)


def _grasp_corners(contact: Contact, reference: FloatArray) -> FloatArray:
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    force = contact.max_force * signs
    corners = np.hstack([force, np.cross(contact.position - reference, force)])
    if contact.max_moment == 0:
        return corners
    moments = np.hstack([np.zeros((8, 3)), contact.max_moment * signs])
    return (corners[:, None] + moments).reshape(-1, 6)
