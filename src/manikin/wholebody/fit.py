"""Fit one smooth whole-body spline to contacts, swings and a centre-of-mass path.

All samples of the motion are solved together: Gauss-Newton on

    sum_s |x_effector(q_s) - target_s|^2 + |c(q_s) - c_s|^2 + [d_safe - d(q_s)]_+^2
        + joint limits + |q_s - q_reference|^2 + |a_s|^2 + |Ldot(q_s, v_s, a_s)|^2,

each residual divided by the scale at which it matters, over the control points of a clamped
quintic spline.  Unlike a posture-by-posture solution ([Qiu2012]_ 6.2) the result is smooth by
construction and its angular momentum is kept small, as the point-mass plan assumes.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
from scipy.special import expit

from manikin.body import BodyModel
from manikin.scene import Proximity
from manikin.spatial import FloatArray, skew
from manikin.wholebody.banded import BlockBandedSystem, SampledBasis
from manikin.wholebody.configuration_spline import (
    ConfigurationSpline,
    states_from_raw,
    tangent_map,
    turn_derivatives,
)
from manikin.wholebody.targets import EffectorTarget, FitTargets

LEAST_DAMPING = 1.0
"""Smallest Levenberg damping of a control point."""

LEAST_MARGIN = 10.0
"""Planned margins below this do not make the scale of the moments any finer [N.m]."""

MOST_DAMPING = 1.0e6
"""Largest one."""


@dataclass(frozen=True)
class FitScales:
    """Size at which each residual costs one unit, and the iteration's limits.

    Attributes:
        position: Effector position [m].
        rotation: Effector orientation [rad].
        com: Centre of mass [m].
        clearance: Missing clearance [m].
        safe_distance: Wanted clearance [m].
        softness: Width of the bend of the softened clearance penalty [m].
        joint_limit: Violation of a joint range, or of its buffer [rad].
        joint_buffer: Distance kept from the joint ranges [rad].
        joint_velocity: Violation of the velocity limits [rad/s].
        velocity_share: Share of the velocity limits that may be used.
        acceleration: Joint acceleration [rad/s^2].
        pelvis_acceleration: Linear [m/s^2] and angular [rad/s^2] pelvis acceleration.
        force: Rate of linear momentum, against the planned one [N].
        moment_share: Rate of angular momentum about the centre of mass that costs one unit, as
            a share of the planned margin: where balance is scarce, the body turns less.
        rest: Velocity at both ends [m/s, rad/s].
        max_iterations: Upper bound of Gauss-Newton steps.
        decrease: Relative decrease of the objective below which the iteration stops.
        stages: Factors by which the tasks' scales are loosened, one solution after the other.
        iterations_per_round: Steps between two updates of the multipliers.
        multiplier_rounds: Most updates of the multipliers of contacts and centre of mass.
        tolerance: Largest error of the contacts at convergence [m]; three times that for the
            centre of mass.
    """

    position: float = 1.0e-3
    rotation: float = 4.0e-3
    com: float = 3.0e-3
    clearance: float = 1.0e-3
    safe_distance: float = 0.028
    softness: float = 0.006
    joint_limit: float = 3.0e-3
    joint_buffer: float = 0.03
    joint_velocity: float = 0.1
    velocity_share: float = 0.9
    acceleration: float = 8.0
    pelvis_acceleration: float = 4.0
    force: float = 20.0
    moment_share: float = 0.15
    rest: float = 1.0e-3
    max_iterations: int = 30
    decrease: float = 0.03
    stages: tuple[float, ...] = (3.0, 1.0, 0.3)
    iterations_per_round: int = 3
    multiplier_rounds: int = 12
    tolerance: float = 3.0e-4

    def loosened(self, factor: float) -> "FitScales":
        """Return the same scales with contacts and centre of mass ``factor`` times looser."""
        return replace(
            self,
            position=self.position * factor,
            rotation=self.rotation * factor,
            com=self.com * factor,
        )


@dataclass(frozen=True, eq=False)
class FitResult:
    """The fitted spline and how well it meets its targets at the samples.

    Attributes:
        spline: The motion.
        iterations: Gauss-Newton steps taken.
        support_error: Largest position error of a controlled effector [m].
        com_error: Largest centre-of-mass error [m].
        clearance: Smallest counted distance [m] (infinite when nothing is near).
        closest: Names of the pair with that distance.
        cost: Final value of the objective.
    """

    spline: ConfigurationSpline
    iterations: int
    support_error: float
    com_error: float
    clearance: float
    closest: tuple[str, str]
    cost: float


@dataclass(eq=False)
class _Linearised:
    """Residuals of all samples with their Gauss-Newton terms, by derivative order."""

    sample_cost: FloatArray
    task_residual: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    hessian: dict[int, FloatArray] = field(default_factory=dict)
    gradient: dict[int, FloatArray] = field(default_factory=dict)
    momentum_jacobians: tuple[FloatArray, FloatArray, FloatArray] | None = None
    momentum_residual: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    support_error: float = 0.0
    com_error: float = 0.0
    clearance: float = np.inf
    closest: tuple[str, str] = ("", "")

    @property
    def cost(self) -> float:
        """Half the sum of all squared residuals."""
        return float(self.sample_cost.sum())


@dataclass(frozen=True, eq=False)
class _MomentumRate:
    """Rate of the centroidal momentum (n, 6) [N, N.m], its derivatives by q, v and a (n, 6, nv)."""

    value: FloatArray
    by_q: FloatArray
    by_v: FloatArray
    by_a: FloatArray
    pelvis_velocity: FloatArray


class MotionFit:
    """Gauss-Newton fit of a whole-body spline.

    Args:
        body: The body.
        proximity: Distances of the body to the scene and to itself, or None to ignore them.
        targets: What to do.
        knots: Clamped knots of the spline [s].
        degree: Its degree.
        scales: Residual scales.
    """

    def __init__(
        self,
        body: BodyModel,
        proximity: Proximity | None,
        targets: FitTargets,
        knots: FloatArray,
        degree: int = 5,
        scales: FitScales | None = None,
    ) -> None:
        self._body = body
        self._model: pin.Model = body.pinocchio
        self._data = self._model.createData()
        self._proximity = proximity
        self._targets = targets
        self._final = scales or FitScales()
        self._scales = self._final
        held = [np.repeat(target.weight[:, None] >= 1.0, 6, axis=1) for target in targets.effectors.values()]
        self._exact_rows = np.hstack([*held, np.ones((len(targets.time), 3), dtype=bool)])
        self._multiplier = np.zeros((len(targets.time), 6 * len(targets.effectors) + 3))
        self._knots, self._degree = knots, degree
        self._basis = SampledBasis.at(targets.time, knots, degree)
        self._damping = np.ones(self._basis.size)
        self._system = BlockBandedSystem(self._basis, body.nq)
        self._frames = {name: body.effector_frame(name) for name in targets.effectors}
        # Weights make the sum over samples an integral over time, normalised by one sample.
        self._reference_weight = _inverse_square(targets.reference_scale)

    def initial_spline(self, time: FloatArray, configurations: FloatArray) -> ConfigurationSpline:
        """Least-squares spline through linearly interpolated configurations (k, nq) at ``time``."""
        raw = np.stack([np.interp(self._targets.time, time, column) for column in configurations.T], axis=1)
        weight = 1e-4
        system = BlockBandedSystem(self._basis, 1)
        ones = np.ones((len(raw), 1, 1))
        system.add(ones, np.zeros((len(raw), 1)))
        system.add(weight * ones, np.zeros((len(raw), 1)), order=1)
        points = []
        for column in raw.T:
            system._right[:] = 0.0
            system.add(None, -column[:, None])
            points.append(system.solve(1e-9)[:, 0])
        return ConfigurationSpline(self._knots, np.stack(points, axis=1), self._degree)

    def solve(self, start: ConfigurationSpline) -> FitResult:
        """Solve from ``start``: first with loose tasks, so that the posture stays natural, then exactly.

        The last scales stay soft; the method of multipliers makes contacts and centre of mass
        exact without the stiff valleys of a large penalty.
        """
        points = np.array(start.control_points)
        iterations = 0
        state = _Linearised(np.zeros(0))
        for factor in self._final.stages:
            self._scales = self._final.loosened(factor)
            points, state, taken = self._descend(points, self._scales.max_iterations)
            iterations += taken
        for _ in range(self._final.multiplier_rounds):
            self._multiplier = self._multiplier + self._exact_rows * state.task_residual
            points, state, taken = self._descend(points, self._final.iterations_per_round)
            iterations += taken
            if state.support_error < self._final.tolerance and state.com_error < 3.0 * self._final.tolerance:
                break
        spline = ConfigurationSpline(self._knots, points, self._degree)
        return FitResult(
            spline, iterations, state.support_error, state.com_error, state.clearance, state.closest,
            state.cost,
        )  # fmt: skip

    def _descend(self, points: FloatArray, most: int) -> tuple[FloatArray, _Linearised, int]:
        """Damped Gauss-Newton at the current scales; the damping is kept from call to call.

        Each control point has its own damping: where the objective around it rises, as at a
        leg that is almost straight, it grows, and the rest of the motion is not held up.
        """
        current = self._linearise(points)
        taken = 0
        for taken in range(1, most + 1):  # noqa: B007
            step = self._step(current, self._damping)
            # A step of more than a radian leaves the region where the model holds.
            trial_points = points + step * min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-12))
            trial = self._linearise(trial_points)
            self._adapt_damping(current, trial)
            if trial.cost < current.cost:
                decrease = (current.cost - trial.cost) / current.cost
                points, current = trial_points, trial
                if decrease < self._scales.decrease:
                    break
        return points, current, taken

    def _adapt_damping(self, before: _Linearised, after: _Linearised) -> None:
        old, new = (self._basis.gather(state.sample_cost) for state in (before, after))
        factor = np.where(new > 1.02 * old + 0.1, 8.0, np.where(new < old, 0.4, 1.0))
        self._damping = np.clip(self._damping * factor, LEAST_DAMPING, MOST_DAMPING)

    def _step(self, state: _Linearised, damping: FloatArray) -> FloatArray:
        self._system.reset()
        for order, gradient in state.gradient.items():
            self._system.add(state.hessian[order], gradient, order)
        if state.momentum_jacobians is not None:
            self._system.add_coupled(state.momentum_jacobians, state.momentum_residual)
        return self._system.solve(damping)

    def _linearise(self, points: FloatArray) -> _Linearised:
        raw, rate, second = (self._basis.evaluate(points, order) for order in range(3))
        states = states_from_raw(raw, rate, second)
        tangent = tangent_map(raw)
        out = _Linearised(np.zeros(len(raw)))
        task_jacobian, task_residual, momentum, offset, turn_jacobian = self._kinematics(states, out)
        task_residual = np.concatenate([task_residual, self._reference_residual(offset)], axis=1)
        task_jacobian = np.concatenate([task_jacobian, self._reference_jacobian(turn_jacobian)], axis=1)
        jacobian = _to_raw(task_jacobian, tangent)
        self._accumulate(out, 0, jacobian, task_residual)
        self._add_radial_and_limits(out, raw, tangent)
        self._add_rates(out, rate)
        self._add_accelerations(out, second)
        self._add_momentum_rate(out, momentum, (raw, rate, second), tangent)
        return out

    def _add_momentum_rate(
        self,
        out: _Linearised,
        momentum: "_MomentumRate",
        raw: tuple[FloatArray, FloatArray, FloatArray],
        tangent: FloatArray,
    ) -> None:
        """Rate of the centroidal momentum against what the planned trajectory needs."""
        turn = turn_derivatives(*(part[:, 3:7] for part in raw))
        omega, alpha = momentum.by_v[:, :, 3:6], momentum.by_a[:, :, 3:6]
        # With the world velocity of the pelvis held, its velocity in the pelvis frame turns.
        omega = omega + momentum.by_a[:, :, :3] @ skew(momentum.pelvis_velocity)
        jacobians = [np.zeros((*momentum.by_q.shape[:2], self._body.nq)) for _ in range(3)]
        for jacobian, joints in zip(jacobians, (momentum.by_q, momentum.by_v, momentum.by_a), strict=True):
            jacobian[:, :, 7:] = joints[:, :, 6:]
        # The whole body turns with the pelvis, and the momentum with it.
        mass = self._body.mass
        turning = momentum.value.copy()
        turning[:, :3] -= mass * raw[2][:, :3]
        rotation = tangent[:, :3, :3].transpose(0, 2, 1)
        turned = [-skew(part) @ rotation @ tangent[:, 3:6, 3:7] for part in (turning[:, :3], turning[:, 3:])]
        jacobians[0][:, :, 3:7] = (
            np.concatenate(turned, axis=1) + omega @ turn.omega_by_value + alpha @ turn.alpha_by_value
        )
        jacobians[1][:, :, 3:7] = omega @ turn.omega_by_rate + alpha @ turn.alpha_by_rate
        jacobians[2][:, :, 3:7] = alpha @ turn.alpha_by_second
        jacobians[2][:, :3, :3] = mass * np.eye(3)
        scale = np.repeat([[self._scales.force, 1.0]], 3, axis=1) * np.ones((len(turning), 1))
        scale[:, 3:] = self._scales.moment_share * np.maximum(self._targets.margin, LEAST_MARGIN)[:, None]
        wanted = np.hstack([mass * self._targets.com_acceleration, np.zeros((len(turning), 3))])
        out.momentum_jacobians = tuple(jacobian / scale[:, :, None] for jacobian in jacobians)
        out.momentum_residual = (momentum.value - wanted) / scale
        out.sample_cost += 0.5 * np.sum(out.momentum_residual**2, axis=1)

    def _kinematics(self, states, out: _Linearised):  # noqa: ANN001, ANN202
        n, nv = len(states.q), self._model.nv
        targets, scales = self._targets, self._scales
        rows = 6 * len(self._frames) + 3
        jacobian, residual = np.zeros((n, rows, nv)), np.zeros((n, rows))
        momentum, by_q, by_v, by_a = np.zeros((n, 6)), *np.zeros((3, n, 6, nv))
        offset, turn_jacobian = np.zeros((n, nv)), np.zeros((n, 3, 3))
        near: list[tuple[int, FloatArray, FloatArray]] = []
        for s in range(n):
            q = states.q[s]
            _, rate_by_q, rate_by_v, rate_by_a = pin.computeCentroidalDynamicsDerivatives(
                self._model, self._data, q, states.v[s], states.a[s]
            )
            momentum[s] = self._data.dhg.vector
            by_q[s], by_v[s], by_a[s] = rate_by_q, rate_by_v, rate_by_a
            pin.computeJointJacobians(self._model, self._data, q)
            pin.updateFramePlacements(self._model, self._data)
            row = 0
            for name, frame in self._frames.items():
                target = targets.effectors[name]
                if target.weight[s] > 0.0:
                    self._effector_rows(
                        s, frame, target, jacobian[s, row : row + 6], residual[s, row : row + 6], out
                    )
                row += 6
            jacobian[s, row:] = pin.jacobianCenterOfMass(self._model, self._data, q) / scales.com
            error = self._data.com[0] - targets.com[s]
            residual[s, row:] = error / scales.com
            out.com_error = max(out.com_error, float(np.linalg.norm(error)))
            offset[s], turn_jacobian[s] = self._deviation(s, q)
            if self._proximity is not None:
                found = self._clearance_rows(s, q, out)
                if found is not None:
                    near.append((s, *found))
        out.task_residual = residual.copy()
        residual = residual + self._multiplier
        if near:
            jacobian, residual = _append_ragged(jacobian, residual, near)
        return (
            jacobian,
            residual,
            _MomentumRate(momentum, by_q, by_v, by_a, states.v[:, :3]),
            offset,
            turn_jacobian,
        )

    def _effector_rows(
        self,
        s: int,
        frame: int,
        target: EffectorTarget,
        jacobian: FloatArray,
        residual: FloatArray,
        out: _Linearised,
    ) -> None:
        scales = self._scales
        placement = self._data.oMf[frame]
        full = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
        error = placement.translation - target.position[s]
        weight = target.weight[s] / scales.position
        jacobian[:3] = weight * full[:3]
        residual[:3] = weight * error
        if target.weight[s] >= 1.0:
            out.support_error = max(out.support_error, float(np.linalg.norm(error)))
        if target.rotation is not None:
            relative = placement.rotation @ target.rotation[s].T
            importance = target.rotation_weight[s] / scales.rotation
            jacobian[3:] = importance * pin.Jlog3(relative) @ relative.T @ full[3:]
            residual[3:] = importance * pin.log3(relative)

    def _clearance_rows(
        self, s: int, q: FloatArray, out: _Linearised
    ) -> tuple[FloatArray, FloatArray] | None:
        scales = self._scales
        reach = scales.safe_distance + 4.0 * scales.softness
        assert self._proximity is not None
        found = self._proximity.evaluate(q, activation=reach, ignore=self._targets.ignored[s])
        if len(found.distance) == 0:
            return None
        worst = int(np.argmin(found.distance))
        if found.distance[worst] < out.clearance:
            out.clearance, out.closest = float(found.distance[worst]), found.pairs[worst]
        # A softened hinge: it also holds back what is about to come too close.
        missing = (scales.safe_distance - found.distance) / scales.softness
        slope = expit(missing)
        value = scales.softness * np.logaddexp(0.0, missing)
        return -slope[:, None] * found.gradient / scales.clearance, value / scales.clearance

    def _reference_residual(self, offset: FloatArray) -> FloatArray:
        return offset * np.sqrt(self._reference_weight)

    def _reference_jacobian(self, turn_jacobian: FloatArray) -> FloatArray:
        root = np.sqrt(self._reference_weight)
        jacobian = np.tile(np.diag(root), (len(turn_jacobian), 1, 1))
        jacobian[:, 3:6, 3:6] = root[3:6, None] * turn_jacobian
        return jacobian

    def _deviation(self, s: int, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Deviation (nv,) from the reference posture and the derivative of its turn."""
        reference = self._targets.reference[s]
        relative = (pin.Quaternion(reference[3:7]).inverse() * pin.Quaternion(q[3:7])).matrix()
        deviation = np.concatenate([q[:3] - reference[:3], pin.log3(relative), q[7:] - reference[7:]])
        return deviation, pin.Jlog3(relative)

    def _accumulate(self, out: _Linearised, order: int, jacobian: FloatArray, residual: FloatArray) -> None:
        transposed = jacobian.transpose(0, 2, 1)
        self._add(out, order, transposed @ jacobian, (transposed @ residual[:, :, None])[:, :, 0])
        out.sample_cost += 0.5 * np.sum(residual**2, axis=1)

    def _add_diagonal(self, out: _Linearised, order: int, weight: FloatArray, residual: FloatArray) -> None:
        """Add residuals ``weight * (x - x0)`` given as weights and weighted residuals (n, nq)."""
        n, nq = weight.shape
        hessian = np.zeros((n, nq, nq))
        hessian[:, np.arange(nq), np.arange(nq)] = weight**2
        self._add(out, order, hessian, weight * residual)
        out.sample_cost += 0.5 * np.sum(residual**2, axis=1)

    @staticmethod
    def _add(out: _Linearised, order: int, hessian: FloatArray, gradient: FloatArray) -> None:
        if order in out.hessian:
            out.hessian[order] += hessian
            out.gradient[order] += gradient
        else:
            out.hessian[order], out.gradient[order] = hessian, gradient

    def _add_radial_and_limits(self, out: _Linearised, raw: FloatArray, tangent: FloatArray) -> None:
        radial = np.zeros((len(raw), 1, raw.shape[1]))
        radial[:, 0, :7] = tangent[:, 6]
        size = np.linalg.norm(raw[:, 3:7], axis=1)
        self._accumulate(out, 0, radial / 0.05, (size - 1.0)[:, None] / 0.05)
        buffer = np.minimum(self._scales.joint_buffer, 0.25 * (self._body.upper - self._body.lower))
        lower, upper = self._body.lower + buffer, self._body.upper - buffer
        angles = raw[:, 7:]
        outside = np.minimum(angles - lower, 0.0) + np.maximum(angles - upper, 0.0)
        weight, residual = np.zeros_like(raw), np.zeros_like(raw)
        weight[:, 7:] = (outside != 0.0) / self._scales.joint_limit
        residual[:, 7:] = outside / self._scales.joint_limit
        self._add_diagonal(out, 0, weight, residual)

    def _add_rates(self, out: _Linearised, rate: FloatArray) -> None:
        scales = self._scales
        limit = scales.velocity_share * self._body.velocity_limit
        excess = np.sign(rate[:, 7:]) * np.maximum(np.abs(rate[:, 7:]) - limit, 0.0)
        weight, residual = np.zeros_like(rate), np.zeros_like(rate)
        weight[:, 7:] = (excess != 0.0) / scales.joint_velocity
        residual[:, 7:] = excess / scales.joint_velocity
        for end in (0, -1):
            weight[end], residual[end] = 1.0 / scales.rest, rate[end] / scales.rest
        self._add_diagonal(out, 1, weight, residual)

    def _add_accelerations(self, out: _Linearised, second: FloatArray) -> None:
        weight = np.full_like(second, 1.0 / self._scales.acceleration)
        weight[:, :7] = 1.0 / self._scales.pelvis_acceleration
        self._add_diagonal(out, 2, weight, weight * second)


def _to_raw(jacobian: FloatArray, tangent: FloatArray) -> FloatArray:
    """Map tangent Jacobians (n, m, nv) to raw coordinates (n, m, nq)."""
    return np.concatenate([jacobian[:, :, :6] @ tangent[:, :6, :], jacobian[:, :, 6:]], axis=2)


def _append_ragged(
    jacobian: FloatArray, residual: FloatArray, near: list[tuple[int, FloatArray, FloatArray]]
) -> tuple[FloatArray, FloatArray]:
    """Append a varying number of rows per sample, padded with zeros."""
    most = max(len(values) for _, _, values in near)
    extra_jacobian = np.zeros((len(jacobian), most, jacobian.shape[2]))
    extra_residual = np.zeros((len(residual), most))
    for s, rows, values in near:
        extra_jacobian[s, : len(values)] = rows
        extra_residual[s, : len(values)] = values
    return np.concatenate([jacobian, extra_jacobian], axis=1), np.concatenate(
        [residual, extra_residual], axis=1
    )


def _inverse_square(scale: FloatArray) -> FloatArray:
    with np.errstate(divide="ignore"):
        return np.where(np.isinf(scale), 0.0, 1.0 / np.square(scale))
