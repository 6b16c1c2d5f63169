"""The objective of the whole-body fit at its samples, with its Gauss-Newton terms.

    sum_s |x_effector(q_s) - target_s|^2 + |c(q_s) - c_s|^2 + [d_safe - d(q_s)]_+^2
        + |q_s - q_reference|^2 + joint ranges and speeds + |a_s|^2 + |hdot(q_s, v_s, a_s) - hdot_s|^2,

each residual divided by the scale at which it matters (:class:`FitScales`).
"""

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.special import expit

from manikin.body import BodyModel
from manikin.scene import Proximity
from manikin.spatial import FloatArray
from manikin.wholebody.banded import BlockBandedSystem, SampledBasis
from manikin.wholebody.configuration_spline import StateSamples, states_from_raw, tangent_map
from manikin.wholebody.fit_scales import FitScales
from manikin.wholebody.momentum_rate import MomentumRate, MomentumRateSamples
from manikin.wholebody.targets import EffectorTarget, FitTargets

LEAST_MARGIN = 10.0
"""Planned margins below this do not make the scale of the moments any finer [N.m]."""

LEAST_FORCE_WEIGHT = 0.25
"""Importance of the linear momentum's rate where the centre of mass only shows the way."""

_RADIAL_SCALE = 0.05
"""Deviation of a raw quaternion's length from one that costs one unit."""


@dataclass(eq=False)
class Linearised:
    """Residuals of all samples with their Gauss-Newton terms.

    Attributes:
        sample_cost: (n,) half the squared residuals at each sample.
        hessian: (n, nq, nq) Gauss-Newton matrices by order of the spline's derivative.
        gradient: (n, nq) gradients by order.
        diagonal: (n, nq) diagonals of the matrices and gradients, for orders without other terms.
        task_residual: (n, m) scaled residuals of effectors and centre of mass.
        task_jacobian: (n, m, nq) their derivatives by the raw coordinates.
        momentum: Scaled residual (n, 6) of the momentum's rate with its derivatives.
        support_error: Largest error of an effector in contact [m].
        com_error: Largest error of the centre of mass [m].
        clearance: Least distance among the close pairs [m].
        closest: Names of that pair.
    """

    sample_cost: FloatArray
    hessian: dict[int, FloatArray] = field(default_factory=dict)
    gradient: dict[int, FloatArray] = field(default_factory=dict)
    diagonal: dict[int, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    task_residual: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    task_jacobian: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 0)))
    momentum: MomentumRate | None = None
    support_error: float = 0.0
    com_error: float = 0.0
    clearance: float = np.inf
    closest: tuple[str, str] = ("", "")

    @property
    def cost(self) -> float:
        """Half the sum of all squared residuals."""
        return float(self.sample_cost.sum())

    def add(self, order: int, jacobian: FloatArray, residual: FloatArray) -> None:
        """Add residuals (n, m) with derivatives (n, m, nq) by the raw derivative of ``order``."""
        transposed = jacobian.transpose(0, 2, 1)
        self._add_terms(order, transposed @ jacobian, (transposed @ residual[:, :, None])[:, :, 0])
        self.sample_cost += 0.5 * np.sum(residual**2, axis=1)

    def add_diagonal(self, order: int, weight: FloatArray, residual: FloatArray) -> None:
        """Add residuals (n, nq), one per coordinate, with derivative ``weight`` (n, nq)."""
        if order in self.hessian:
            index = np.arange(weight.shape[1])
            self.hessian[order][:, index, index] += weight**2
            self.gradient[order] += weight * residual
        else:
            before, gradient = self.diagonal.get(order, (0.0, 0.0))
            self.diagonal[order] = (before + weight**2, gradient + weight * residual)
        self.sample_cost += 0.5 * np.sum(residual**2, axis=1)

    def shift_tasks(self, before: FloatArray, after: FloatArray) -> None:
        """Replace the constants (n, m) that are added to the task residuals."""
        old, new = self.task_residual + before, self.task_residual + after
        self.sample_cost += 0.5 * np.sum(new**2 - old**2, axis=1)
        self.gradient[0] += np.einsum("nmq,nm->nq", self.task_jacobian, new - old)

    def assemble(self, system: BlockBandedSystem) -> None:
        """Put every term into the normal equations."""
        system.reset()
        for order, gradient in self.gradient.items():
            system.add(self.hessian[order], gradient, order)
        for order, (weight, gradient) in self.diagonal.items():
            system.add_diagonal(weight, gradient, order)
        if self.momentum is not None:
            system.add_coupled(self.momentum.jacobians, self.momentum.value)

    def _add_terms(self, order: int, hessian: FloatArray, gradient: FloatArray) -> None:
        if order in self.hessian:
            self.hessian[order] += hessian
            self.gradient[order] += gradient
        else:
            self.hessian[order], self.gradient[order] = hessian, gradient


class MotionObjective:
    """Evaluates and linearises the objective of a spline's control points.

    Args:
        body: The body.
        proximity: Distances of the body to the scene and to itself, or None to ignore them.
        targets: What to do.
        basis: The spline's basis at the targets' times.
    """

    def __init__(
        self, body: BodyModel, proximity: Proximity | None, targets: FitTargets, basis: SampledBasis
    ) -> None:
        self._body, self._proximity, self._targets, self._basis = body, proximity, targets, basis
        self._model: pin.Model = body.pinocchio
        self._data = self._model.createData()
        self._frames = {name: body.effector_frame(name) for name in targets.effectors}
        with np.errstate(divide="ignore"):
            self._reference_weight = 1.0 / targets.reference_scale
        self.task_rows = 6 * len(self._frames) + 3
        held = [_held_rows(target) for target in targets.effectors.values()]
        self.exact_rows = np.hstack([*held, np.repeat(targets.com_weight[:, None] >= 1.0, 3, axis=1)])
        """(n, task_rows) whether a task has to be met exactly: contacts and centre of mass."""

    def linearise(self, points: FloatArray, scales: FitScales, shift: FloatArray) -> Linearised:
        """Evaluate every term.

        Args:
            points: (k, nq) control points.
            scales: Scales of the residuals.
            shift: (n, task_rows) constants added to the scaled task residuals (multipliers).
        """
        raw = (
            self._basis.evaluate(points), self._basis.evaluate(points, 1), self._basis.evaluate(points, 2)
        )  # fmt: skip
        states, tangent = states_from_raw(*raw), tangent_map(raw[0])
        out = Linearised(np.zeros(len(states.q)))
        momentum = self._add_kinematics(out, states, tangent, scales, shift)
        self._add_radial(out, raw[0], tangent)
        self._add_ranges(out, raw[0], scales)
        self._add_rates(out, raw[1], scales)
        self._add_accelerations(out, raw[2], scales)
        self._add_momentum_rate(out, momentum.by_raw(states, raw, tangent), scales)
        return out

    def _add_kinematics(
        self, out: Linearised, states: StateSamples, tangent: FloatArray, scales: FitScales, shift: FloatArray
    ) -> MomentumRateSamples:
        """Everything that needs the kinematics of each sample."""
        n, nv = len(states.q), self._model.nv
        jacobian, residual = np.zeros((n, self.task_rows, nv)), np.zeros((n, self.task_rows))
        momentum = MomentumRateSamples(self._model, n)
        for s in range(n):
            momentum.record(s, self._data, states)
            pin.updateFramePlacements(self._model, self._data)
            self._task_rows(s, states.q[s], jacobian[s], residual[s], scales, out)
        out.task_residual, out.task_jacobian = residual, _to_raw(jacobian, tangent)
        out.add(0, out.task_jacobian, residual + shift)
        self._add_clearance(out, states, tangent, scales)
        self._add_reference(out, states, tangent)
        return momentum

    def _task_rows(
        self, s: int, q: FloatArray, jacobian: FloatArray, residual: FloatArray, scales: FitScales,
        out: Linearised,
    ) -> None:  # fmt: skip
        for number, (name, frame) in enumerate(self._frames.items()):
            target, rows = self._targets.effectors[name], slice(6 * number, 6 * number + 6)
            if target.weight[s] > 0.0:
                self._effector_rows(s, frame, target, jacobian[rows], residual[rows], scales, out)
        weight = self._targets.com_weight[s]
        jacobian[-3:] = pin.jacobianCenterOfMass(self._model, self._data, q) * (weight / scales.com)
        error = self._data.com[0] - self._targets.com[s]
        residual[-3:] = error * (weight / scales.com)
        if weight >= 1.0:
            out.com_error = max(out.com_error, float(np.linalg.norm(error)))

    def _effector_rows(
        self, s: int, frame: int, target: EffectorTarget, jacobian: FloatArray, residual: FloatArray,
        scales: FitScales, out: Linearised,
    ) -> None:  # fmt: skip
        placement = self._data.oMf[frame]
        full = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
        error = placement.translation - target.position[s]
        weight = target.weight[s] / scales.position
        if target.along is None:
            jacobian[:3], residual[:3] = weight * full[:3], weight * error
        else:
            jacobian[:3] = weight * target.along[s] @ full[:3]
            residual[:3] = weight * target.along[s] @ error
        if target.weight[s] >= 1.0:
            out.support_error = max(out.support_error, float(np.linalg.norm(error)))
        if target.rotation is not None:
            relative = placement.rotation @ target.rotation[s].T
            weight = target.rotation_weight[s] / scales.rotation
            jacobian[3:] = weight * pin.Jlog3(relative) @ relative.T @ full[3:]
            residual[3:] = weight * pin.log3(relative)

    def _add_clearance(
        self, out: Linearised, states: StateSamples, tangent: FloatArray, scales: FitScales
    ) -> None:
        if self._proximity is None:
            return
        reach = scales.safe_distance + 4.0 * scales.softness
        found = self._proximity.evaluate_over(states.q, reach, self._targets.ignored)
        if len(found.distance) == 0:
            return
        worst = int(np.argmin(found.distance))
        out.clearance, out.closest = float(found.distance[worst]), found.pairs[worst]
        # A softened hinge: it also holds back what is about to come too close.
        missing = (scales.safe_distance - found.distance) / scales.softness
        value = scales.softness * np.logaddexp(0.0, missing) / scales.clearance
        rows = -expit(missing)[:, None] * found.gradient / scales.clearance
        jacobian, residual = _padded(found.sample, rows, value, len(states.q))
        out.add(0, _to_raw(jacobian, tangent), residual)

    def _add_reference(self, out: Linearised, states: StateSamples, tangent: FloatArray) -> None:
        """Deviation from the reference posture; the pelvis' place does not count."""
        n, weight = len(states.q), self._reference_weight
        turn, turn_jacobian = np.zeros((n, 3)), np.zeros((n, 3, 3))
        for s, reference in enumerate(self._targets.reference):
            relative = (pin.Quaternion(reference[3:7]).inverse() * pin.Quaternion(states.q[s, 3:7])).matrix()
            turn[s], turn_jacobian[s] = pin.log3(relative), pin.Jlog3(relative)
        rows = np.zeros((n, 3, states.q.shape[1]))
        rows[:, :, :7] = weight[3:6, None] * (turn_jacobian @ tangent[:, 3:6])
        out.add(0, rows, weight[3:6] * turn)
        diagonal, residual = np.zeros_like(states.q), np.zeros_like(states.q)
        diagonal[:, 7:] = weight[6:]
        residual[:, 7:] = weight[6:] * (states.q[:, 7:] - self._targets.reference[:, 7:])
        out.add_diagonal(0, diagonal, residual)

    def _add_radial(self, out: Linearised, raw: FloatArray, tangent: FloatArray) -> None:
        """Keep the raw quaternions near unit length, where the spline is well conditioned."""
        rows = np.zeros((len(raw), 1, raw.shape[1]))
        rows[:, 0, :7] = tangent[:, 6] / _RADIAL_SCALE
        size = np.linalg.norm(raw[:, 3:7], axis=1)
        out.add(0, rows, (size - 1.0)[:, None] / _RADIAL_SCALE)

    def _add_ranges(self, out: Linearised, raw: FloatArray, scales: FitScales) -> None:
        buffer = np.minimum(scales.joint_buffer, 0.25 * (self._body.upper - self._body.lower))
        lower, upper = self._body.lower + buffer, self._body.upper - buffer
        outside = np.minimum(raw[:, 7:] - lower, 0.0) + np.maximum(raw[:, 7:] - upper, 0.0)
        weight, residual = np.zeros_like(raw), np.zeros_like(raw)
        weight[:, 7:] = (outside != 0.0) / scales.joint_limit
        residual[:, 7:] = outside / scales.joint_limit
        out.add_diagonal(0, weight, residual)

    def _add_rates(self, out: Linearised, rate: FloatArray, scales: FitScales) -> None:
        limit = scales.velocity_share * self._body.velocity_limit
        excess = np.sign(rate[:, 7:]) * np.maximum(np.abs(rate[:, 7:]) - limit, 0.0)
        weight, residual = np.zeros_like(rate), np.zeros_like(rate)
        weight[:, 7:] = (excess != 0.0) / scales.joint_velocity
        residual[:, 7:] = excess / scales.joint_velocity
        for end in (0, -1):
            weight[end], residual[end] = 1.0 / scales.rest, rate[end] / scales.rest
        out.add_diagonal(1, weight, residual)

    @staticmethod
    def _add_accelerations(out: Linearised, second: FloatArray, scales: FitScales) -> None:
        weight = np.full_like(second, 1.0 / scales.acceleration)
        weight[:, :7] = 1.0 / scales.pelvis_acceleration
        out.add_diagonal(2, weight, weight * second)

    def _add_momentum_rate(self, out: Linearised, momentum: MomentumRate, scales: FitScales) -> None:
        """Rate of the centroidal momentum against what the planned trajectory needs."""
        targets = self._targets
        scale = np.full((len(targets.time), 6), scales.force)
        scale[:, :3] /= np.maximum(targets.com_weight, LEAST_FORCE_WEIGHT)[:, None]
        scale[:, 3:] = scales.moment_share * np.maximum(targets.margin, LEAST_MARGIN)[:, None]
        residual = momentum.value.copy()
        residual[:, :3] -= self._body.mass * targets.com_acceleration
        first, second, third = (jacobian / scale[:, :, None] for jacobian in momentum.jacobians)
        out.momentum = MomentumRate(residual / scale, (first, second, third))
        out.sample_cost += 0.5 * np.sum(out.momentum.value**2, axis=1)


def _held_rows(target: EffectorTarget) -> NDArray[np.bool_]:
    """(n, 6) whether position and orientation have to be met exactly; a grasp holds its position only."""
    position = target.weight >= 1.0
    rows = (position, position & (target.rotation_weight >= 1.0))
    return np.repeat(np.stack(rows, axis=1), 3, axis=1)


def _to_raw(jacobian: FloatArray, tangent: FloatArray) -> FloatArray:
    """Map tangent Jacobians (n, m, nv) to raw coordinates (n, m, nq)."""
    return np.concatenate([jacobian[:, :, :6] @ tangent[:, :6, :], jacobian[:, :, 6:]], axis=2)


def _padded(
    sample: NDArray[np.int64], rows: FloatArray, values: FloatArray, n: int
) -> tuple[FloatArray, FloatArray]:
    """Lay out rows (k, nv) and values (k,), ordered by sample, as (n, most, ...), padded with zeros."""
    start = np.searchsorted(sample, np.arange(n))
    place = np.arange(len(sample)) - start[sample]
    jacobian = np.zeros((n, int(place.max()) + 1, rows.shape[1]))
    residual = np.zeros(jacobian.shape[:2])
    jacobian[sample, place], residual[sample, place] = rows, values
    return jacobian, residual
