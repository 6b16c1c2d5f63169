"""The objective of the refinement ([Tonneau2015]_ 7.3, after ITOMP and [Mordatch2012]_).

    sum_s |q''_s|^2 + obstacles(q_s) + physics(q_s, q'_s, q''_s, c_s) + c_s (|e(q_s)|^2 + |e'(q_s, q'_s)|^2)
        + c_s / alpha(q_s) + joint ranges and speeds,

each residual divided by the scale at which it matters (:class:`RefineScales`); the waypoints of ITOMP are
here the control points of one spline, and every derivative is analytic.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.balance.motion_forces import load_shares
from manikin.body import BodyModel
from manikin.body.limbs import hanging_segment
from manikin.contact import ContactKind, ContactSchedule
from manikin.kinematics.efort import Task
from manikin.motion.configuration_spline import turn_derivatives
from manikin.motion.dynamics import MomentumRate, MotionSamples
from manikin.numerics.banded import SampledBasis
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.contact_variables import Variables
from manikin.planning.whole_body.fit_objective import FitLinearisation, MotionObjective, to_raw
from manikin.planning.whole_body.fit_scales import MotionScales, RefineScales
from manikin.planning.whole_body.fit_targets import FitTargets, lay_toes_flat, toe_angles
from manikin.planning.whole_body.foot_roll import rolls_through
from manikin.planning.whole_body.refine_contacts import (
    LEAST,
    LimbDirections,
    contact_targets,
    contact_variables,
    effector_speed,
    efort_with_derivative,
    limb_directions,
)
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.refine_measures import RefineObstacles
from manikin.planning.whole_body.refine_physics import MarginCost, RefinedForces, WrenchCost, needed_wrench
from manikin.scene import Proximity, Scene
from manikin.scene.distance import ProximitySamples, moves_by_joint


@dataclass(frozen=True, eq=False, kw_only=True)
class RefineTargets(FitTargets):
    """Targets of the refinement at its samples: those of the whole-body fit, without a centre of mass.

    Attributes:
        variables: (n,) contact variable of each effector of the sequence.
        load: (n, effectors) readiness of each to carry load, in the order of ``effectors``.
        obstacles: What may touch, and how far flights keep off.
    """

    variables: dict[str, FloatArray]
    load: FloatArray
    limbs: dict[str, LimbDirections]
    obstacles: RefineObstacles


def refine_targets(
    body: BodyModel, scene: Scene, path: KeyPath, schedule: ContactSchedule, time: FloatArray,
    scales: RefineScales, task: Task | None, padded: tuple[str, ...] = (), chosen: Variables | None = None,
) -> RefineTargets:  # fmt: skip
    """Lay out what is to be done at ``time`` (n,) [s]; see :func:`.refine_motion`.

    Variables that were chosen for the phases take the place of the sequence's own, 1 while in contact: a
    force then costs ``f^2 / c``, see :mod:`~manikin.planning.whole_body.contact_variables`.
    """
    variables = contact_variables(schedule, time)
    load = load_shares(schedule, time, schedule.sequence.effectors)
    phases = schedule.phase_at(time)
    for number, own in enumerate(chosen or ()):
        for column, name in enumerate(schedule.sequence.effectors):
            if name in schedule.sequence[number].stance:
                variables[name][phases == number] *= own[name]
                load[phases == number, column] *= np.sqrt(own[name])
    obstacles, n = RefineObstacles(body, scene, schedule, time, padded), len(time)
    reference, guide = path.at(time), np.full((n, body.nv), scales.guide)
    guide[:, :3] = np.inf
    for joint in sole_toes(body, schedule):
        reference[:, 7 + joint], guide[:, 6 + joint] = 0.0, scales.toes
    rolls = rolls_through(body, schedule, lambda when: path.at(np.array([when]))[0])
    lay_toes_flat(toe_angles(body, rolls, time), reference, guide)
    return RefineTargets(
        time, schedule, contact_targets(schedule, time, variables, scales.position / scales.approach, rolls),
        com=np.zeros((n, 3)), com_weight=np.zeros(n), com_acceleration=np.zeros((n, 3)), margin=np.zeros(n),
        reference=reference, reference_scale=guide, ignored=obstacles.ignored, kept=obstacles.points,
        variables=variables, load=load, limbs=limb_directions(body, path, schedule, time, task),
        obstacles=obstacles,
    )  # fmt: skip


def sole_toes(body: BodyModel, schedule: ContactSchedule) -> tuple[int, ...]:
    """Joints of the toes of what stands on soles: flat ones do not go into the ground."""
    found = set[int]()
    for phase in schedule.sequence:
        for contact in phase.stance:
            hanging = hanging_segment(body, body.effector(contact.effector).segment)
            if contact.kind is ContactKind.SOLE and hanging is not None:
                found.update(body.joint_index(hinge.name) for hinge in hanging.hinges)
    return tuple(sorted(found))


SWITCHING = 0.06
"""Time after a touch-down and before a lift-off in which what stands on tips alone has to be in balance
without that contact [s]: the tip may be late, and the controller takes the load off before."""


def _relied_on(schedule: ContactSchedule) -> list[tuple[float, float]]:
    """First and last time [s] at which the stance of each phase has to do, at most half of its neighbours."""
    stances = [phase.stance for phase in schedule.sequence]
    early, late = schedule.instants[:-1].copy(), schedule.instants[1:].copy()
    for number, (before, after) in enumerate(itertools.pairwise(stances)):
        if any(item.kind is not ContactKind.POINT for item in (*before, *after)):
            continue
        if set(before.effectors) < set(after.effectors):
            late[number] += min(SWITCHING, 0.5 * schedule.durations[number + 1])
        if set(after.effectors) < set(before.effectors):
            early[number + 1] -= min(SWITCHING, 0.5 * schedule.durations[number])
    return list(zip(early.tolist(), late.tolist(), strict=True))


class RefineObjective(MotionObjective):
    """Evaluates and linearises the objective of a spline's control points.

    Args:
        proximity: Distances of the body to the scene and to itself, or None to ignore them.
        basis: The spline's basis at the targets' times.
        rooms: Wrench polytope of each phase.
    """

    def __init__(
        self, body: BodyModel, proximity: Proximity | None, targets: RefineTargets, basis: SampledBasis,
        rooms: tuple[MarginCost, ...],
    ) -> None:  # fmt: skip
        super().__init__(body, proximity, targets, basis)
        self._refine, self._names = targets, tuple(targets.effectors)
        schedule, time, model = targets.schedule, targets.time, body.pinocchio
        data = model.createData()
        com = np.array([pin.centerOfMass(model, data, row).copy() for row in targets.reference])
        # At a key instant the stances on both sides of it have to do.
        self._stances = list[tuple[NDArray[np.intp], RefinedForces, MarginCost, Callable[[float], float]]]()
        for phase, room, (start, end) in zip(schedule.sequence, rooms, _relied_on(schedule), strict=True):
            rows = np.flatnonzero((time >= start) & (time <= end))
            if not len(rows):  # of a part of the motion
                continue
            wanted = cache(partial(room.wanted, com=com[rows].mean(axis=0)))
            self._stances.append((rows, RefinedForces(phase.stance, self._names), room, wanted))
        # The end of the names of knee joints.
        knees = "knee_flexion", "_knee"
        self._knees = [7 + k for k, name in enumerate(body.joint_names) if name.endswith(knees)]
        moves = moves_by_joint(model)
        self._chains = {
            name: np.flatnonzero(moves[model.frames[body.effector_frame(name)].parentJoint])
            for name in self._names
        }

    def linearise(self, points: FloatArray, scales: MotionScales, shift: FloatArray) -> FitLinearisation:
        """Evaluate every term at :class:`RefineScales`; see :meth:`MotionObjective.linearise`."""
        assert isinstance(scales, RefineScales)
        out = super().linearise(points, scales, shift)
        motion = self._sampled(points)
        self._add_contact_motion(out, motion, scales)
        self._add_place(out, motion, scales)
        return out

    def _wanted_distance(self, found: ProximitySamples, scales: MotionScales) -> FloatArray:
        assert isinstance(scales, RefineScales)
        wanted = self._refine.obstacles.wanted(found, scales.safe_distance, -scales.touching)
        return self._refine.kept.wanted(found, wanted)

    def _add_ranges(self, out: FitLinearisation, raw: FloatArray, scales: MotionScales) -> None:
        """Joint ranges, and knees that stay bent."""
        assert isinstance(scales, RefineScales)
        super()._add_ranges(out, raw, scales)
        missing = np.minimum(raw[:, self._knees] - scales.knee_flexion, 0.0)
        self._add_excess(out, 0, self._knees, missing, scales.straight)

    def _com_weight(self, scales: MotionScales) -> FloatArray:
        del scales
        return self.targets.com_weight  # zero: there is no planned centre of mass

    def _add_dynamics(self, out: FitLinearisation, motion: MotionSamples, scales: MotionScales) -> None:
        """Physics violation and balance, which depend on the wrench that the whole body needs."""
        assert isinstance(scales, RefineScales)
        wrench, com_jacobian = needed_wrench(motion, self._body.mass)
        cost = self.wrench_cost(wrench.value, motion.com, scales)
        out.sample_cost += cost.value
        # The lengths of the rows change little with the CoM; the gradient alone has it.
        out.gradient[0] += np.einsum("nc,ncq->nq", cost.by_com, com_jacobian)
        # With the curvature L L^T, the rows L^T db and the residual L^-1 gradient have its gradient
        # and its Gauss-Newton matrix.
        size = np.abs(cost.curvature).max(axis=(1, 2))
        # Added to the curvature of the wrench's cost, relative to its largest element, to factorise it.
        root = np.linalg.cholesky(cost.curvature + (1e-12 * size)[:, None, None] * np.eye(6))
        residual = np.linalg.solve(root, cost.gradient[:, :, None])[:, :, 0]
        first, second, third = (root.transpose(0, 2, 1) @ part for part in wrench.jacobians)
        out.momentum = MomentumRate(residual, (first, second, third))
        if self._add_strength(out, motion, scales):
            out.sample_cost += 0.5 * np.sum(out.momentum.value[:, 6:] ** 2, axis=1)

    def wrench_cost(self, wrench: FloatArray, com: FloatArray, scales: RefineScales) -> WrenchCost:
        """Physics violation and missing balance of wrenches (n, 6) about the world origin, CoM (n, 3)."""
        n = len(wrench)
        total = WrenchCost(np.zeros(n), np.zeros((n, 6)), np.zeros((n, 6, 6)), np.zeros((n, 3)))
        penalty = scales.margin_violation, scales.margin_softness
        force = scales.force * (self._body.mass * 9.81)
        for rows, forces, room, wanted in self._stances:
            load = self._refine.load[rows]
            share = forces.share(wrench[rows], load, tolerance=scales.missing_wrench, force=force)
            margin = room.cost(wrench[rows], com[rows], wanted(scales.margin), *penalty)
            for out, one, other in zip(total, share.cost, margin, strict=True):
                out[rows] += one + other
        return total

    def _add_contact_motion(self, out: FitLinearisation, motion: MotionSamples, scales: RefineScales) -> None:
        """Speeds of effectors in contact, and the EFORT of their limbs."""
        turn = turn_derivatives(*(part[:, 3:7] for part in motion.raw))
        for number, name in enumerate(self._names):
            jacobian, chain = self._sampler.frame_jacobian(motion, number), self._chains[name]
            share = np.sqrt(self._refine.variables[name])
            weight = (share / scales.slide)[:, None]
            speed, by_value, by_rate = effector_speed(motion, jacobian, chain, turn)
            residual = weight * speed
            out.add(1, weight[:, :, None] * by_rate, residual)
            # Its change with the posture is small where the speed is; the gradient alone has it.
            out.gradient[0] += np.einsum("nc,ncq->nq", weight * residual, by_value)
            if name in self._refine.limbs:
                alpha, slope = efort_with_derivative(self._refine.limbs[name], jacobian, chain)
                clamped = np.maximum(alpha, LEAST)
                cost = share * clamped**-0.5 / scales.efort
                slope = np.where(alpha > LEAST, -0.5 * cost / clamped, 0.0)[:, None] * slope
                out.add(0, to_raw(slope[:, None, :], motion.tangent), cost[:, None])

    def _add_place(self, out: FitLinearisation, motion: MotionSamples, scales: RefineScales) -> None:
        """Carry the pelvis about where the input does, and begin and end there."""
        raw, reference = motion.raw[0], self.targets.reference
        weight = np.zeros_like(raw)
        weight[:, :3] = 1.0 / scales.guide_position
        weight[[0, -1]] = 1.0 / scales.end_angle
        weight[[0, -1], :3] = 1.0 / scales.end_position
        out.add_diagonal(0, weight, weight * (raw - reference))
