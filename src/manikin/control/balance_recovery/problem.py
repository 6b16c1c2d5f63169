"""The quadratic program of one step of the recovery ([Kudoh2002]_ 2.54-2.64).

Unknowns are the accelerations ``phi''`` of the closed loops and the forces at the corners of the soles. The
thesis has the former alone: without the latter, which pull no foot down (``f_z > 0``) and keep to friction,
joint torques cannot be limited, since two feet on the ground share their load in many ways.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from manikin.control.balance_recovery.closed_loop import ClosedLoop, FeltPush, LinearMap
from manikin.control.build_qp import QuadraticProgram
from manikin.control.contact_forces import ContactForceBasis
from manikin.control.dynamics import DynamicsState
from manikin.control.tasks import AccelerationTask
from manikin.spatial import FloatArray

FORCE_WEIGHT = 1e-5
"""Regularisation of the forces at the corners [1/N^2]: shares the load between the feet."""


@dataclass(frozen=True, eq=False)
class JointBounds:
    """Limits of the joints at one step, (nv - 6,) each.

    Attributes:
        torque_lower: [N.m].
        torque_upper: [N.m].
        acceleration_lower: [rad/s^2].
        acceleration_upper: [rad/s^2].
    """

    torque_lower: FloatArray
    torque_upper: FloatArray
    acceleration_lower: FloatArray
    acceleration_upper: FloatArray


@dataclass(frozen=True, eq=False)
class Objective:
    """What one step minimises.

    ``sum weight (theta'' - wanted)^2 + com_weight (s'' - law)^2 - upward s''_z``, half of each square.

    Attributes:
        weight: (nv - 6,) diagonal of ``C_theta`` ([Kudoh2002]_ 2.27).
        wanted: (nv - 6,) joint accelerations from which the objective is measured [rad/s^2].
        law: (3,) wanted acceleration of the centre of mass [m/s^2].
        com_weight: (3,) of its squared error; 0 leaves it free.
        upward: Slope of the upward acceleration.
        tasks: Further squares, of generalised accelerations.
    """

    weight: FloatArray
    wanted: FloatArray
    law: FloatArray
    com_weight: FloatArray = field(default_factory=lambda: np.zeros(3))
    upward: float = 0.0
    tasks: tuple[AccelerationTask, ...] = ()


@dataclass(frozen=True, eq=False)
class RecoveryProblem:
    """The quadratic program of one step with the meaning of its variables.

    Attributes:
        program: On ``x = [phi'' (k,), forces at the corners]``.
        loop: Maps of ``phi''``.
        torque: (nv - 6,) joint torques, linear in ``x`` [N.m].
        relaxable: First and last (exclusive) row that may be left out when there is no solution: the stops
            of the joints and the symmetry of the legs.
    """

    program: QuadraticProgram
    loop: ClosedLoop
    torque: LinearMap
    relaxable: tuple[int, int]

    def relaxed(self) -> QuadraticProgram:
        """Return the program without the stops of the joints and the symmetry of the legs."""
        lower, upper = self.program.rows_lower.copy(), self.program.rows_upper.copy()
        rows = slice(*self.relaxable)
        lower[rows], upper[rows] = -np.inf, np.inf
        return replace(self.program, rows_lower=lower, rows_upper=upper)

    def loose(self) -> QuadraticProgram:
        """Return the program with the torque limits alone: the ground may pull, the ZMP may be anywhere."""
        program = self.relaxed()
        first, _ = self.relaxable
        lower, upper = program.rows_lower.copy(), program.rows_upper.copy()
        after_torques = 6 + len(self.torque.offset)
        lower[after_torques:first], upper[after_torques:first] = -np.inf, np.inf
        lowest = np.full_like(program.lower, -np.inf)
        return replace(program, rows_lower=lower, rows_upper=upper, lower=lowest)


def build_recovery_qp(
    state: DynamicsState,
    loop: ClosedLoop,
    contacts: Sequence[ContactForceBasis],
    push: FeltPush,
    bounds: JointBounds,
    zmp: LinearMap,
    symmetry: LinearMap,
    objective: Objective,
    *,
    pulling: bool = False,
) -> RecoveryProblem:
    """Build the program of one step.

    Args:
        state: Current dynamics.
        loop: Maps of the accelerations.
        contacts: Force maps of the feet.
        push: What pushes besides the ground.
        bounds: Torque limits and the stops of the joints ([Kudoh2002]_ 2.55-2.56).
        zmp: Rows that are not positive when the ZMP is inside (2.57-2.60).
        symmetry: Rows that are not positive when the legs grow no less alike (2.63-2.64).
        objective: What is minimised.
        pulling: Whether the ground may pull as well.
    """
    k, joints = loop.size, len(state.v) - 6
    generalised = np.concatenate([basis.generalised for basis in contacts], axis=1)
    basis, drift = loop.acceleration.matrix, loop.acceleration.offset
    motion = np.concatenate((state.mass_matrix @ basis, -generalised), axis=1)
    still = state.mass_matrix @ drift + state.bias - push.generalised
    torque = LinearMap(motion[6:], still[6:])
    size, forces = k + generalised.shape[1], generalised.shape[1]

    rows = np.zeros((6 + 2 * joints + len(symmetry.offset) + len(zmp.offset), size))
    lower, upper = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
    rows[:6], lower[:6], upper[:6] = motion[:6], -still[:6], -still[:6]
    part = slice(6, 6 + joints)
    rows[part] = torque.matrix
    lower[part], upper[part] = bounds.torque_lower - torque.offset, bounds.torque_upper - torque.offset
    part = slice(part.stop, part.stop + len(zmp.offset))
    rows[part, :k], upper[part] = zmp.matrix, -zmp.offset
    first = part.stop
    part = slice(first, first + joints)
    rows[part, :k] = loop.joints.matrix
    lower[part] = bounds.acceleration_lower - loop.joints.offset
    upper[part] = bounds.acceleration_upper - loop.joints.offset
    part = slice(part.stop, part.stop + len(symmetry.offset))
    rows[part, :k], upper[part] = symmetry.matrix, -symmetry.offset

    least = -np.inf if pulling else 0.0
    variable_lower = np.concatenate((np.full(k, -np.inf), np.full(forces, least)))
    hessian, gradient = _cost(loop, objective, size)
    program = QuadraticProgram(
        hessian, gradient, rows, lower, upper, variable_lower, np.full(size, np.inf), 6
    )
    return RecoveryProblem(program, loop, torque, (first, len(rows)))


def leg_symmetry(
    loop: ClosedLoop, angles: FloatArray, pairs: Sequence[tuple[int, int]], tolerance: float
) -> LinearMap:
    """Rows that let no pair of joints grow less alike ([Kudoh2002]_ 2.49-2.53).

    Where the right angle is the larger one its acceleration is at most the left one's, and the other way
    round (the print has lost the signs of one of the two branches).

    Args:
        loop: Maps of the accelerations.
        angles: (nv - 6,) [rad].
        pairs: Left and right hinge indices.
        tolerance: Angles that differ by less count as equal, which leaves the pair free [rad].
    """
    rows, offsets = [], []
    for left, right in pairs:
        gap = angles[right] - angles[left]
        if abs(gap) > tolerance:
            sign = np.sign(gap)
            rows.append(sign * (loop.joints.matrix[right] - loop.joints.matrix[left]))
            offsets.append(sign * (loop.joints.offset[right] - loop.joints.offset[left]))
    return LinearMap(np.array(rows).reshape(-1, loop.size), np.array(offsets))


def _cost(loop: ClosedLoop, objective: Objective, size: int) -> tuple[FloatArray, FloatArray]:
    k = loop.size
    weighted = loop.joints.matrix * objective.weight[:, None]
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    hessian[:k, :k] = weighted.T @ loop.joints.matrix
    gradient[:k] = (loop.joints.offset - objective.wanted) @ weighted
    pulled = loop.com.matrix * objective.com_weight[:, None]
    hessian[:k, :k] += pulled.T @ loop.com.matrix
    gradient[:k] += (loop.com.offset - objective.law) @ pulled
    gradient[:k] -= objective.upward * loop.com.matrix[2]
    for task in objective.tasks:
        moved = task.matrix @ loop.acceleration.matrix
        weighted = moved * task.weight[:, None]
        hessian[:k, :k] += weighted.T @ moved
        gradient[:k] += (task.matrix @ loop.acceleration.offset - task.target) @ weighted
    hessian[np.arange(k, size), np.arange(k, size)] = FORCE_WEIGHT
    return hessian, gradient
