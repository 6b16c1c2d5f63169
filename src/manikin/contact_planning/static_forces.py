"""Contact forces that hold a posture at rest, by one linear program ([Bretl2008]_'s test, with grasps).

Unlike the wrench polytope it knows the posture, and with it the torques of the joints; it costs a few
milliseconds and shares no code with the polytope.
"""

import numpy as np
import pinocchio as pin
from scipy.optimize import linprog

from manikin.balance.contact_forces import ContactGenerators
from manikin.body import BodyModel, Configuration
from manikin.contact import Stance, default_normal_force_cap
from manikin.spatial import GRAVITY, FloatArray


def static_room(stance: Stance, mass: float, com: FloatArray, directions: int = 8) -> float:
    """How far the centre of mass may move in any direction on the ground while the contacts hold it at rest.

    One linear program for each direction; the room is exact in these directions.

    Args:
        stance: The contacts that carry the body; a sum of normal forces without a cap has the default one.
        mass: Of the body [kg].
        com: (3,) centre of mass [m].
        directions: Number of directions.

    Returns:
        Distance [m]; minus infinity where the contacts cannot hold the body as it is.
    """
    if not len(stance):
        return -np.inf
    generators, cap = ContactGenerators.of(stance), _cap(stance, mass)
    bounds = [(0.0, limit) for limit in generators.upper]
    about_origin = generators.about(np.zeros(3))
    weight = mass * GRAVITY
    room = np.inf
    for angle in 2.0 * np.pi * np.arange(directions) / directions:
        step = np.array([np.cos(angle), np.sin(angle), 0.0])
        column = np.concatenate([np.zeros(3), -np.cross(step, [0.0, 0.0, weight])])
        wanted = np.concatenate([[0.0, 0.0, weight], np.cross(com, [0.0, 0.0, weight])])
        found = linprog(
            np.append(np.zeros(len(bounds)), -1.0),
            A_ub=np.append(generators.normal, 0.0)[None], b_ub=[cap],
            A_eq=np.column_stack([about_origin, column]), b_eq=wanted,
            bounds=[*bounds, (0.0, 1e3)], method="highs",
        )  # fmt: skip
        if not found.success:
            return -np.inf
        room = min(room, float(found.x[-1]))
    return room


def static_torque_share(body: BodyModel, q: FloatArray, stance: Stance) -> float:
    """Smallest share of the joints' torque limits with which a posture is held at rest.

    Minimises the largest share of a torque limit over the contact forces, with
    ``tau = g(q) - sum J^T w`` and the six rows of the root in equilibrium.

    Args:
        body: The body.
        q: (nq,) posture that holds the contacts.
        stance: The contacts that carry it, with a cap as in :func:`static_room`.

    Returns:
        The share; infinite where the contacts cannot hold the posture.
    """
    if not len(stance):
        return np.inf
    generators, state = ContactGenerators.of(stance), Configuration(body, q)
    places = np.array([contact.position for contact in stance])[generators.contact]
    wrenches = generators.about(places).T
    model = body.pinocchio
    gravity = pin.computeGeneralizedGravity(model, model.createData(), np.asarray(q))
    jacobians = [state.effector_jacobian(contact.effector) for contact in stance]
    columns = np.column_stack(
        [jacobians[number].T @ wrench for number, wrench in zip(generators.contact, wrenches, strict=True)]
    )
    count = len(wrenches)
    above = np.column_stack([columns[6:], body.torque_lower])
    below = np.column_stack([-columns[6:], -body.torque_upper])
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack([above, below, np.append(generators.normal, 0.0)]),
        b_ub=np.concatenate([gravity[6:], -gravity[6:], [_cap(stance, body.mass)]]),
        A_eq=np.column_stack([columns[:6], np.zeros(6)]), b_eq=gravity[:6],
        bounds=[*((0.0, limit) for limit in generators.upper), (0.0, None)], method="highs",
    )  # fmt: skip
    return float(found.x[-1]) if found.success else np.inf


def _cap(stance: Stance, mass: float) -> float:
    """Largest sum of the normal forces [N]."""
    return stance.normal_force_cap or default_normal_force_cap(mass)
