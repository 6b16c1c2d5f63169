"""The force that a limb can really exert at a contact: strength of each joint and friction."""

import numpy as np
from scipy.optimize import linprog

from manikin.errors import InputError
from manikin.spatial import FloatArray

SIDES = 8
"""Of the pyramid inside the friction cone."""


def exertable_force(
    jacobian: FloatArray,
    torque_lower: FloatArray,
    torque_upper: FloatArray,
    direction: FloatArray,
    normal: FloatArray | None,
    friction: float = 0.7,
) -> float:
    """Largest force along a direction that the scene can exert on a limb at rest [N].

    ``max f . v`` over the forces ``f`` on the effector with ``-J^T f`` within the torque limits and,
    where the limb does not hold on, inside the friction cone about the normal. The weight of the limb itself
    is left out. This is what EFORT (5.12) stands for in the request, where all joints count alike
    and friction does not exist.

    Args:
        jacobian: (3, k) of the effector's translation [m/rad].
        torque_lower: (k,) most negative torques of the joints [N.m].
        torque_upper: (k,) largest ones [N.m].
        direction: (3,) unit vector ``v``, in the Jacobian's frame.
        normal: (3,) unit normal of the surface in the same frame, or None for a grasp.
        friction: Coulomb coefficient.

    Returns:
        At least 0; infinite where the limb carries the direction without torque.

    Raises:
        InputError: If the linear program fails for another reason.
    """
    table, bounds = [jacobian.T, -jacobian.T], [-torque_lower, torque_upper]
    if normal is not None:
        across = np.linalg.svd(normal[None])[2][1:]
        turns = 2.0 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
        sides = np.column_stack([np.cos(turns), np.sin(turns)]) @ across
        table.append(sides - friction * np.cos(np.pi / SIDES) * normal)
        bounds.append(np.zeros(SIDES))
    found = linprog(-direction, A_ub=np.vstack(table), b_ub=np.concatenate(bounds), bounds=[(None, None)] * 3)
    if found.status == 3:
        return float("inf")
    if found.status != 0:
        raise InputError(f"exertable force cannot be computed ({found.message}); valid: finite values")
    return float(-found.fun)
