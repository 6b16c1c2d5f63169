"""The inverse-dynamics quadratic program of one control step ([Qiu2012]_ 6.3).

Unknowns are the generalised acceleration and the contact forces; the joint torques follow from them by the
equation of motion, which splits into six equalities (nothing acts on the root) and the torque limits.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np

from manikin.body import BodyModel
from manikin.control.dynamics import DynamicsState
from manikin.control.edge_forces import ContactForceBasis
from manikin.control.partings import Parting
from manikin.control.reference import ReferenceSample
from manikin.control.tasks import AccelerationTask
from manikin.numerics.qp import QuadraticProgram
from manikin.numerics.spatial import FloatArray

RANK = 1e-6
"""Singular values of a contact's force map smaller than this share of the largest count as zero."""


@dataclass(frozen=True, eq=False)
class JointBounds:
    """Limits of the joints at one control step, (nv - 6,) each.

    Attributes:
        torque_lower: Most negative torque of the muscles [N.m].
        torque_upper: Largest one [N.m].
        acceleration_lower: [rad/s^2].
        acceleration_upper: [rad/s^2].
    """

    torque_lower: FloatArray
    torque_upper: FloatArray
    acceleration_lower: FloatArray
    acceleration_upper: FloatArray

    @classmethod
    def of(
        cls, body: BodyModel, state: DynamicsState, horizon: float, largest: float, strength: float = 1.0,
        planned: ReferenceSample | None = None,
    ) -> "JointBounds":  # fmt: skip
        """Limits of a body at a state, torques and speeds times ``strength``, over a horizon [s].

        Args:
            planned: Planned state, from which the body is expected to be as far at the end of the horizon as
                it is drifting now; without one it is expected to go on at its speed.
        """
        angle, speed = state.q[7:], state.v[6:]
        if planned is None or planned.later is None:
            coming = angle + horizon * speed, speed, np.zeros_like(speed)
        else:
            drift = speed - planned.v[6:]
            away = angle - planned.q[7:] + horizon * drift
            coming = planned.later[0] + away, planned.later[1] + drift, planned.a[6:]
        accelerations = joint_acceleration_bounds(
            *coming, body.lower, body.upper, strength * body.velocity_limit, horizon, largest
        )
        return cls(strength * body.torque_lower, strength * body.torque_upper, *accelerations)


@dataclass(frozen=True, eq=False)
class LoadedContact:
    """A contact's force map with the limits that hold now.

    Attributes:
        basis: The force map.
        cap: Largest normal force now [N].
        least: Smallest one [N].
        grasp_share: Share of a grasp's limits that it may use now, in [0, 1].
        wished: (3,) force that it should feel now [N], or None.
        wish_weight: Of the squared error of that force [1/N^2].
        planned: (6,) wrench about the effector frame's origin that it should be near to, or None.
        planned_weight: Of the squared distances of the force variables from those that make it up [1/N^2].
    """

    basis: ContactForceBasis
    cap: float
    grasp_share: float = 1.0
    wished: FloatArray | None = None
    wish_weight: float = 0.0
    least: float = 0.0
    planned: FloatArray | None = None
    planned_weight: float = 0.0


@dataclass(frozen=True, eq=False)
class ControlProblem:
    """The quadratic program of one control step with the meaning of its variables.

    Attributes:
        program: The program on ``x = [acceleration (nv,), forces of each contact]``.
        state: Dynamics it was built from.
        tasks: The tasks of its cost.
        contacts: The contacts whose forces are unknowns, in order.
        variables: Indices of the force variables of each contact.
        joint_map: (nv - 6, n) with ``torque = joint_map @ x + joint_offset``.
        joint_offset: (nv - 6,) [N.m].
        partings: Number of rows, the last of the program, that keep parts of the body apart.
    """

    program: QuadraticProgram
    state: DynamicsState
    tasks: tuple[AccelerationTask, ...]
    contacts: tuple[LoadedContact, ...]
    variables: tuple[slice, ...]
    joint_map: FloatArray
    joint_offset: FloatArray
    partings: int = 0

    def relaxed(self) -> QuadraticProgram:
        """The program without the bounds of joint accelerations and with parts that may touch."""
        program = self.program.without_bounds(6, len(self.state.v))
        rows_lower = program.rows_lower.copy()
        rows_lower[len(rows_lower) - self.partings :] = -np.inf
        return replace(program, rows_lower=rows_lower)

    def acceleration(self, x: FloatArray) -> FloatArray:
        """(nv,) generalised acceleration in the solution ``x``."""
        return x[: len(self.state.v)]

    def torque(self, x: FloatArray) -> FloatArray:
        """(nv - 6,) joint torques in the solution ``x`` [N.m]."""
        return self.joint_map @ x + self.joint_offset

    def wrenches(self, x: FloatArray) -> dict[str, FloatArray]:
        """Force and moment about the effector frame of each contact in ``x``, by effector."""
        return {basis.contact.effector: basis.wrench @ part for basis, part in self._forces(x)}

    def normal_forces(self, x: FloatArray) -> dict[str, float]:
        """Normal force of each contact in ``x`` by effector [N]; 0 for a grasp."""
        return {basis.contact.effector: float(basis.normal @ part) for basis, part in self._forces(x)}

    def _forces(self, x: FloatArray) -> Iterator[tuple[ContactForceBasis, FloatArray]]:
        pairs = zip(self.contacts, self.variables, strict=True)
        return ((loaded.basis, x[part]) for loaded, part in pairs)


def force_variables(bases: Sequence[ContactForceBasis], start: int) -> list[slice]:
    """Indices of the force variables of each contact; those of the first one begin at ``start``."""
    ends = accumulate((len(basis.normal) for basis in bases), initial=start)
    return [slice(first, end) for first, end in pairwise(ends)]


def build_qp(
    state: DynamicsState, tasks: Sequence[AccelerationTask], contacts: Sequence[LoadedContact],
    bounds: JointBounds, damping: FloatArray, *, period: float, acceleration_weight: float,
    force_weight: float, sum_cap: float | None = None, partings: Sequence[Parting] = (),
    inertia: FloatArray | None = None,
) -> ControlProblem:  # fmt: skip
    """Build the program of one control step.

    Args:
        contacts: Those that may carry load.
        damping: (nv - 6,) passive damping of the joints [N.m.s/rad]; the muscles overcome it as it is at the
            middle of the hold, ``damping * (v + a period / 2)``.
        period: Time over which the torques will be held [s].
        acceleration_weight: Regularisation of the accelerations.
        force_weight: Regularisation of the force variables.
        sum_cap: Largest sum of the normal forces [N], or None.
        partings: Parts of the body that keep apart.
        inertia: (nv - 6,) inertia about the joints beside that of the body [kg.m^2]; None without.
    """
    nv, bases = len(state.v), [loaded.basis for loaded in contacts]
    variables = force_variables(bases, nv)
    size = variables[-1].stop if variables else nv
    caps, cap_limits, least = _normal_force_rows(contacts, variables, size, sum_cap)
    rows = np.zeros((nv + len(caps) + len(partings), size))  # the equation of motion comes first
    rows[:nv, :nv] = state.mass_matrix
    lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
    lower[6:nv], upper[6:nv] = bounds.acceleration_lower, bounds.acceleration_upper
    for loaded, part in zip(contacts, variables, strict=True):
        basis = loaded.basis
        np.negative(basis.generalised, out=rows[:nv, part])
        share = 1.0 if basis.normal[0] > 0 else loaded.grasp_share
        lower[part], upper[part] = basis.lower * share, basis.upper * share
    joint_map = rows[6:nv]
    joint_map[:, 6:nv].flat[:: nv - 5] += 0.5 * period * damping
    if inertia is not None:
        joint_map[:, 6:nv].flat[:: nv - 5] += inertia
    joint_offset = state.bias[6:] + damping * state.v[6:]
    rows[nv : nv + len(caps)] = caps
    for row, parting in enumerate(partings, nv + len(caps)):
        rows[row, :nv] = parting.gradient
    slowest = np.array([parting.least for parting in partings])
    rows_lower = np.concatenate((-state.bias[:6], bounds.torque_lower - joint_offset, least, slowest))
    free = np.full(len(slowest), np.inf)
    rows_upper = np.concatenate((-state.bias[:6], bounds.torque_upper - joint_offset, cap_limits, free))
    hessian, gradient = _cost(tasks, nv, size, acceleration_weight, force_weight)
    for loaded, part in zip(contacts, variables, strict=True):
        if loaded.planned is not None:
            smallest = np.linalg.lstsq(loaded.basis.wrench, loaded.planned, rcond=RANK)[0]
            np.einsum("ii->i", hessian[part, part])[:] += loaded.planned_weight
            gradient[part] -= loaded.planned_weight * smallest
        if loaded.wished is not None:  # weight |force - wished|^2 / 2
            forces = loaded.basis.wrench[:3]
            hessian[part, part] += loaded.wish_weight * forces.T @ forces
            gradient[part] -= loaded.wish_weight * forces.T @ loaded.wished
    program = QuadraticProgram(hessian, gradient, rows, rows_lower, rows_upper, lower, upper, 6)
    return ControlProblem(
        program,
        state,
        tuple(tasks),
        tuple(contacts),
        tuple(variables),
        joint_map,
        joint_offset,
        len(partings),
    )


def joint_acceleration_bounds(
    angle: FloatArray, speed: FloatArray, usual: FloatArray, lower: FloatArray, upper: FloatArray,
    speed_limit: FloatArray, horizon: float, largest: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Accelerations that keep angles and speeds admissible over ``horizon``.

    With ``d`` more than the usual acceleration, ``angle + d T^2 / 2`` must be within the range and ``speed +
    d T`` within the speed limit; near the end of its range a joint meets a stiff, damped stop.

    Args:
        angle: (n,) at the end of the horizon, with the usual acceleration [rad].
        speed: (n,) there [rad/s].
        usual: (n,) acceleration now with which they come about [rad/s^2].
        horizon: ``T`` [s].
        largest: Largest acceleration, to which the bounds are cut [rad/s^2].
    """
    half_square = 0.5 * horizon**2
    least = usual + np.maximum((lower - angle) / half_square, (-speed_limit - speed) / horizon)
    greatest = usual + np.minimum((upper - angle) / half_square, (speed_limit - speed) / horizon)
    least = np.minimum(np.maximum(least, -largest), 0.9 * largest)
    return least, np.maximum(np.minimum(np.maximum(greatest, -0.9 * largest), largest), least)


def _cost(
    tasks: Sequence[AccelerationTask], nv: int, size: int, acceleration_weight: float, force_weight: float
) -> tuple[FloatArray, FloatArray]:
    matrix = np.concatenate([task.matrix for task in tasks])
    target = np.concatenate([task.target for task in tasks])
    weighted = matrix * np.concatenate([task.weight for task in tasks])[:, None]
    hessian = np.zeros((size, size))
    hessian[:nv, :nv] = weighted.T @ matrix
    diagonal = np.full(size, force_weight)
    diagonal[:nv] = acceleration_weight
    hessian.flat[:: size + 1] += diagonal
    gradient = np.zeros(size)
    gradient[:nv] = -target @ weighted
    return hessian, gradient


def _normal_force_rows(
    contacts: Sequence[LoadedContact], variables: Sequence[slice], size: int, sum_cap: float | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows of the normal forces of contacts and of their sum, with their largest and smallest values [N]."""
    rows, limits, least = [], [], []
    for loaded, part in zip(contacts, variables, strict=True):
        if loaded.basis.normal[0] > 0:
            row = np.zeros(size)
            row[part] = loaded.basis.normal
            rows.append(row)
            limits.append(loaded.cap)
            least.append(loaded.least if loaded.least > 0.0 else -np.inf)
    if sum_cap is not None and rows:
        rows.append(np.sum(rows, axis=0))
        limits.append(sum_cap)
        least.append(-np.inf)
    return np.array(rows).reshape(-1, size), np.array(limits), np.array(least)
