"""The objective of the whole-body fit at its samples, with its Gauss-Newton terms.

    sum_s |x_effector(q_s) - target_s|^2 + |c(q_s) - c_s|^2 + [d_safe - d(q_s)]_+^2
        + |q_s - q_reference|^2 + joint ranges and speeds + |a_s|^2 + |hdot(q_s, v_s, a_s) - hdot_s|^2,

each residual divided by the scale at which it matters (:class:`FitScales`).
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import expit

from manikin.body import BodyModel
from manikin.motion.configuration_spline import by_raw_spline
from manikin.motion.dynamics import MomentumRate, MotionSampler, MotionSamples
from manikin.numerics.banded import BlockBandedSystem, SampledBasis
from manikin.numerics.spatial import FloatArray, rotation_vector, rotation_vector_jacobian, skew
from manikin.planning.whole_body.fit_scales import FitScales, MotionScales
from manikin.planning.whole_body.fit_strength import HeldForces, excess_torque
from manikin.planning.whole_body.fit_targets import EffectorTarget, FitTargets
from manikin.scene import Proximity
from manikin.scene.distance import PlacedShapes, ProximitySamples
from manikin.scene.distance_bounds import KnownDistances

LEAST_ROLL = 2.0e-3
"""Angle below which a contact that rolls is pushed forward [rad]."""


@dataclass(eq=False)
class FitLinearisation:
    """Residuals of all samples with their Gauss-Newton terms.

    Attributes:
        sample_cost: (n,) half the squared residuals at each sample.
        task_residual: (n, m) scaled residuals of effectors and centre of mass.
        task_jacobian: (n, m, nq) their derivatives by the raw coordinates.
        hessian: (n, nq, nq) Gauss-Newton matrices by order of the spline's derivative.
        gradient: (n, nq) gradients by order.
        diagonal: (n, nq) diagonals of the matrices and gradients, for orders without other terms.
        momentum: Scaled residual (n, 6) of the momentum's rate with its derivatives.
        excess: Greatest share of the strength beyond the wanted one; None where strength does not count.
    """

    sample_cost: FloatArray
    task_residual: FloatArray
    task_jacobian: FloatArray
    hessian: dict[int, FloatArray] = field(default_factory=dict)
    gradient: dict[int, FloatArray] = field(default_factory=dict)
    diagonal: dict[int, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    momentum: MomentumRate | None = None
    excess: float | None = None

    @property
    def cost(self) -> float:
        """Half the sum of all squared residuals."""
        return float(self.sample_cost.sum())

    def add(self, order: int, jacobian: FloatArray, residual: FloatArray) -> None:
        """Add residuals (n, m) with derivatives (n, m, k) by the raw derivative of ``order``.

        The derivatives are by the first ``k`` coordinates; for the first residuals of an order, by all.
        """
        transposed = jacobian.transpose(0, 2, 1)
        hessian, gradient = transposed @ jacobian, (transposed @ residual[:, :, None])[:, :, 0]
        if order in self.hessian:
            count = gradient.shape[1]
            self.hessian[order][:, :count, :count] += hessian
            self.gradient[order][:, :count] += gradient
        else:
            self.hessian[order], self.gradient[order] = hessian, gradient
        self.sample_cost += 0.5 * np.sum(residual**2, axis=1)

    def add_diagonal(self, order: int, weight: FloatArray, residual: FloatArray) -> None:
        """Add residuals (n, nq), one per coordinate, with derivative ``weight`` (n, nq)."""
        if order in self.hessian:
            diagonal = np.einsum("nii->ni", self.hessian[order])
            diagonal += weight**2
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


class MotionObjective:
    """Evaluates and linearises the objective of a spline's control points.

    Args:
        proximity: Distances of the body to the scene and to itself, or None to ignore them.
        basis: The spline's basis at the targets' times.
    """

    def __init__(
        self, body: BodyModel, proximity: Proximity | None, targets: FitTargets, basis: SampledBasis
    ) -> None:
        self._body, self._proximity, self.targets, self.basis = body, proximity, targets, basis
        self._sampler = MotionSampler(body, tuple(targets.effectors), basis, targets.loads)
        self._known = KnownDistances()
        meeting = targets.meeting
        self._ignored = targets.ignored if meeting is None else meeting.without(targets.ignored)
        self._ignored = targets.kept.without(self._ignored)
        self._last: tuple[FloatArray, MotionSamples] | None = None
        self._forces: HeldForces | None = None
        with np.errstate(divide="ignore"):
            self._reference_weight = np.atleast_2d(1.0 / targets.reference_scale)
        self.task_rows = 6 * len(targets.effectors) + 3
        held = [_held_rows(target) for target in targets.effectors.values()]
        exact = np.hstack([*held, np.repeat(targets.com_weight[:, None] >= 1.0, 3, axis=1)])
        self.exact_rows = exact & basis.starts[:, None]
        """(n, task_rows) whether a task is a constraint: contacts and centre of mass, at every knot.

        A span adds one control point: more constrained samples ask for more than the spline can give; nothing
        is left to ask for in a posture that is given."""
        for sample, posture in zip((0, -1), targets.ends, strict=True):
            self.exact_rows[sample] &= posture is None

    def linearise(self, points: FloatArray, scales: MotionScales, shift: FloatArray) -> FitLinearisation:
        """Evaluate every term.

        Args:
            points: (k, nq) control points.
            shift: (n, task_rows) constants added to the scaled task residuals (multipliers).
        """
        motion = self._sampled(points)
        raw, residual, jacobian = motion.raw, *self._tasks(motion, scales)
        out = FitLinearisation(np.zeros(len(motion.com)), residual, jacobian)
        out.add(0, jacobian, residual + shift)
        self._add_clearance(out, motion, scales)
        self._add_reference(out, motion)
        self._add_radial(out, raw[0], motion.tangent)
        self._add_ranges(out, raw[0], scales)
        self._add_rates(out, raw[1], scales)
        self._add_accelerations(out, raw[2], scales)
        self._add_dynamics(out, motion, scales)
        return out

    def share_forces(self, points: FloatArray) -> None:
        """Hold the contact forces of a motion with control points (k, nq) where strength counts."""
        if self.targets.strength:
            states = self._sampled(points).states
            self._forces = HeldForces.of(self._body, self.targets.schedule, self.targets.time, states)

    def clearance_beside(self, points: FloatArray, time: float) -> float:
        """Least distance of what counts at the samples beside an instant [m]; infinite if all is far."""
        after = int(np.clip(np.searchsorted(self.targets.time, time), 1, len(self.targets.time) - 1))
        if self._proximity is None:
            return np.inf
        shapes, rows = self._sampled(points).shapes, slice(after - 1, after + 1)
        both = PlacedShapes(shapes.placements[rows], shapes.jacobians[rows])
        ignored = self._ignored if isinstance(self._ignored, frozenset) else self._ignored[rows]
        return float(self._proximity.evaluate_placed(both, ignore=ignored).distance.min(initial=np.inf))

    def _sampled(self, points: FloatArray) -> MotionSamples:
        """The spline at its samples; those of the last one, when only the scales have changed since."""
        if self._last is None or not np.array_equal(self._last[0], points):
            self._last = points.copy(), self._sampler.sample(points)
        return self._last[1]

    def _tasks(self, motion: MotionSamples, scales: MotionScales) -> tuple[FloatArray, FloatArray]:
        """Residuals of the effectors' and the centre of mass's places, with their derivatives."""
        n, nv = motion.com_jacobian.shape[0], motion.com_jacobian.shape[2]
        jacobian, residual = np.zeros((n, self.task_rows, nv)), np.zeros((n, self.task_rows))
        for number, target in enumerate(self.targets.effectors.values()):
            rows, by_joints = slice(6 * number, 6 * number + 6), self._sampler.frame_jacobian(motion, number)
            jacobian[:, rows], residual[:, rows] = _effector_rows(
                target, motion.frames[:, number], by_joints, scales
            )
        weight = self._com_weight(scales)
        jacobian[:, -3:] = weight[:, None, None] * motion.com_jacobian
        residual[:, -3:] = weight[:, None] * (motion.com - self.targets.com)
        return residual, to_raw(jacobian, motion.tangent)

    def _com_weight(self, scales: MotionScales) -> FloatArray:
        """(n,) weight of the centre of mass's error [1/m]."""
        assert isinstance(scales, FitScales)
        return self.targets.com_weight / scales.com

    def _add_clearance(self, out: FitLinearisation, motion: MotionSamples, scales: MotionScales) -> None:
        if self._proximity is None:
            return
        reach = scales.safe_distance + 4.0 * scales.softness
        found = self._proximity.evaluate_placed(motion.shapes, reach, self._ignored, self._known)
        if len(found.distance) == 0:
            return
        meeting = self.targets.meeting
        met = np.zeros(len(found.distance), dtype=np.bool_) if meeting is None else meeting.rows(found)
        # A softened hinge: it also holds back what is about to come too close.
        missing = (self._wanted_distance(found, scales) - found.distance) / scales.softness
        value = scales.softness * np.logaddexp(0.0, missing) / scales.clearance
        rows = -expit(missing)[:, None] * found.gradient / scales.clearance
        if meeting is not None and np.any(met):
            weight = meeting.importance(found, met) / scales.position
            value = np.where(met, weight * found.distance, value)
            rows = np.where(met[:, None], weight[:, None] * found.gradient, rows)
        jacobian, residual = _padded(found.sample, rows, value, len(motion.com))
        out.add(0, to_raw(jacobian, motion.tangent), residual)

    def _wanted_distance(self, found: ProximitySamples, scales: MotionScales) -> FloatArray:
        """Wanted clearance of close pairs [m]."""
        return self.targets.kept.wanted(found, scales.safe_distance)

    def _add_reference(self, out: FitLinearisation, motion: MotionSamples) -> None:
        """Deviation from the reference posture; the pelvis' place does not count."""
        q, reference, weight = motion.states.q, self.targets.reference, self._reference_weight
        relative = Rotation.from_quat(reference[:, 3:7]).inv() * Rotation.from_quat(q[:, 3:7])
        turn, attitude = relative.as_rotvec(), weight[:, 3:6]
        by_raw = rotation_vector_jacobian(turn) @ motion.tangent[:, 3:6]
        out.add(0, attitude[:, :, None] * by_raw, attitude * turn)
        diagonal, residual = np.zeros_like(q), np.zeros_like(q)
        diagonal[:, 7:] = weight[:, 6:]
        residual[:, 7:] = weight[:, 6:] * (q[:, 7:] - reference[:, 7:])
        out.add_diagonal(0, diagonal, residual)

    def _add_radial(self, out: FitLinearisation, raw: FloatArray, tangent: FloatArray) -> None:
        """Keep the raw quaternions near unit length, where the spline is well conditioned."""
        # Deviation from that length that costs one unit.
        size, scale = np.linalg.norm(raw[:, 3:7], axis=1), 0.05
        out.add(0, tangent[:, 6:] / scale, (size - 1.0)[:, None] / scale)

    def _add_ranges(self, out: FitLinearisation, raw: FloatArray, scales: MotionScales) -> None:
        buffer = np.minimum(scales.joint_buffer, 0.25 * (self._body.upper - self._body.lower))
        lower, upper = self._body.lower + buffer, self._body.upper - buffer
        outside = np.minimum(raw[:, 7:] - lower, 0.0) + np.maximum(raw[:, 7:] - upper, 0.0)
        self._add_excess(out, 0, slice(7, None), outside, scales.joint_limit)

    def _add_rates(self, out: FitLinearisation, rate: FloatArray, scales: MotionScales) -> None:
        limit = scales.velocity_share * self._body.velocity_limit
        excess = np.sign(rate[:, 7:]) * np.maximum(np.abs(rate[:, 7:]) - limit, 0.0)
        excess[[0, -1]] = 0.0  # at both ends the body rests instead
        self._add_excess(out, 1, slice(7, None), excess, scales.joint_velocity)
        ends = np.zeros_like(rate)
        ends[[0, -1]] = 1.0
        out.add_diagonal(1, ends / scales.rest, ends * rate / scales.rest)

    def _add_excess(
        self, out: FitLinearisation, order: int, columns: slice | list[int], excess: FloatArray, scale: float
    ) -> None:
        """Residuals (n, c) of some coordinates, which cost nothing where they are zero."""
        weight, residual = np.zeros_like(self.targets.reference), np.zeros_like(self.targets.reference)
        weight[:, columns], residual[:, columns] = (excess != 0.0) / scale, excess / scale
        out.add_diagonal(order, weight, residual)

    def _add_accelerations(self, out: FitLinearisation, second: FloatArray, scales: MotionScales) -> None:
        if self.targets.reference_second is not None:
            second = second - self.targets.reference_second
        weight = np.full_like(second, 1.0 / scales.acceleration)
        weight[:, :7] = 1.0 / scales.pelvis_acceleration
        if self.targets.settles:
            weight[-1] = 0.1 / scales.rest  # 0.01 m/s^2, rad/s^2 cost as much as a speed of 1 mm/s
        out.add_diagonal(2, weight, weight * second)

    def _add_dynamics(self, out: FitLinearisation, motion: MotionSamples, scales: MotionScales) -> None:
        """Rate of the centroidal momentum against what the planned trajectory needs."""
        assert isinstance(scales, FitScales)
        targets, momentum = self.targets, motion.momentum
        scale = np.full((len(targets.time), 6), scales.force)
        # Importance of the linear momentum's rate where the centre of mass only shows the way.
        scale[:, :3] /= np.maximum(targets.com_weight, 0.25)[:, None]
        # Planned margins below this do not make the scale of the moments any finer [N.m].
        scale[:, 3:] = scales.moment_share * np.maximum(targets.margin, 10.0)[:, None]
        residual = momentum.value.copy()
        residual[:, :3] -= self._body.mass * targets.com_acceleration
        for sample, load in enumerate(targets.loads or ()):
            if load is not None:
                residual[sample, :3] -= load.mass * targets.com_acceleration[sample]
        if targets.turning is not None:
            residual[:, 3:] -= targets.turning
        first, second, third = (jacobian / scale[:, :, None] for jacobian in momentum.jacobians)
        out.momentum = MomentumRate(residual / scale, (first, second, third))
        self._add_strength(out, motion, scales)
        out.sample_cost += 0.5 * np.sum(out.momentum.value**2, axis=1)

    def _add_strength(self, out: FitLinearisation, motion: MotionSamples, scales: MotionScales) -> bool:
        """Give the momentum's rate a row for each torque beyond the strength where forces are held, if so."""
        if self._forces is None:
            return False
        assert out.momentum is not None
        found = excess_torque(
            self._body, motion.states, motion.shapes.jacobians, self._forces, scales.strength_share
        )
        by_raw = by_raw_spline(found.by_state, motion.states, motion.raw, motion.tangent)
        rows = (by / scales.torque_share for by in by_raw)
        first, second, third = (
            np.concatenate(pair, axis=1) for pair in zip(out.momentum.jacobians, rows, strict=True)
        )
        value = np.hstack([out.momentum.value, found.value / scales.torque_share])
        out.momentum, out.excess = (
            MomentumRate(value, (first, second, third)),
            float(found.value.max(initial=0.0)),
        )
        return True


def _effector_rows(
    target: EffectorTarget, place: FloatArray, by_joints: FloatArray, scales: MotionScales
) -> tuple[FloatArray, FloatArray]:
    """Scaled residuals (n, 6) of an effector at its places (n, 4, 4) and their derivatives (n, 6, nv)."""
    along = (target.weight / scales.position)[:, None, None] * target.along
    error = _missed(target, place)
    jacobian, residual = np.zeros_like(by_joints), np.zeros((len(error), 6))
    rolls, frame, moved = target.pivot[:, 2] > 0.0, target.rotation, by_joints[:, :3]
    if rolls.any():
        arm = (place[:, :3, :3] @ target.pivot[:, :, None])[:, :, 0]
        cosine, sine, by_turn = _pitch(target, place)
        pitched = (by_turn / (cosine**2 + sine**2)[:, None])[:, None] @ by_joints[:, 3:]
        moved = moved - skew(arm) @ by_joints[:, 3:]
        moved = moved - (target.pivot[:, 2, None] * frame[:, :, 0])[:, :, None] * pitched
    jacobian[:, :3] = along @ moved
    residual[:, :3] = (along @ error[:, :, None])[:, :, 0]
    relative = place[:, :3, :3] @ frame.transpose(0, 2, 1)
    turn = rotation_vector(relative)
    weight = np.where(target.weight > 0.0, target.rotation_weight / scales.rotation, 0.0)
    # Turning the world axes is a left perturbation: log(exp(w) E) = log(E exp(E^T w)).
    by_turn = rotation_vector_jacobian(turn) @ relative.transpose(0, 2, 1)
    jacobian[:, 3:] = weight[:, None, None] * by_turn @ by_joints[:, 3:]
    residual[:, 3:] = weight[:, None] * turn
    if rolls.any():  # what rolls may turn about y, but not back from where it lies
        own = frame.transpose(0, 2, 1)[rolls]
        jacobian[rolls, 3:] = own @ jacobian[rolls, 3:]
        residual[rolls, 3:] = (own @ residual[rolls, 3:, None])[:, :, 0]
        back = np.minimum(residual[rolls, 4] - weight[rolls] * LEAST_ROLL, 0.0)
        jacobian[rolls, 4] *= (back < 0.0)[:, None]
        residual[rolls, 4] = back
    return jacobian, residual


def _pitch(target: EffectorTarget, place: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n,) cosine and sine of the pitch against a target and (n, 3) its derivative by a turn, all scaled."""
    along, forward, up = place[:, :3, 0], target.rotation[:, :, 0], target.rotation[:, :, 2]
    cosine, sine = np.sum(along * forward, axis=1), -np.sum(along * up, axis=1)
    turn = -cosine[:, None] * np.cross(along, up) - sine[:, None] * np.cross(along, forward)
    return cosine, sine, turn


def _missed(target: EffectorTarget, place: FloatArray) -> FloatArray:
    """(n, 3) way of an effector at places (n, 4, 4) from its target; of what rolls, that of its pivot [m]."""
    error = place[:, :3, 3] - target.position
    if not target.pivot.any():
        return error
    frame, pivot = target.rotation, target.pivot
    cosine, sine, _ = _pitch(target, place)
    rolled = pivot + np.arctan2(sine, cosine)[:, None] * pivot[:, 2:] * [1.0, 0.0, 0.0]
    return error + (place[:, :3, :3] @ pivot[:, :, None] - frame @ rolled[:, :, None])[:, :, 0]


def _held_rows(target: EffectorTarget) -> NDArray[np.bool_]:
    """(n, 6) whether position and orientation have to be met exactly; a grasp holds its position only."""
    position = target.weight >= 1.0
    rows = (position, position & (target.rotation_weight >= 1.0))
    held = np.repeat(np.stack(rows, axis=1), 3, axis=1)
    held[:, 4] &= target.pivot[:, 2] == 0.0
    return held


def to_raw(jacobian: FloatArray, tangent: FloatArray) -> FloatArray:
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
