"""The controller that keeps a pushed body on its feet without a planned motion ([Kudoh2002]_ 2).

Until the reaction delay is over, muscles hold the posture as springs and dampers do.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import end_segments
from manikin.control import edge_forces
from manikin.control.build_qp import JointBounds, force_variables
from manikin.control.dynamics import Dynamics, DynamicsState
from manikin.control.edge_forces import ContactForceBasis, contact_geometry, segment_key
from manikin.control.recovery import recovery_problem
from manikin.control.recovery import standing as mechanics
from manikin.control.recovery import strategy as strategies
from manikin.control.recovery.recovery_problem import ROOT, ArmSwing, Objectives, RecoveryProblem
from manikin.control.recovery.standing import ClosedLoop, FeltPush, JointGroups, LinearMap, Standing
from manikin.control.recovery.strategy import ComLaw, RecoverySettings, Strategy, StrategySwitch
from manikin.control.reference import EffectorReference
from manikin.errors import InputError
from manikin.numerics.qp import QPSolution, WarmQPSolver
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array

LEG_STIFFNESS = 3.0
"""Stiffness of hips and knees before they react, at least, in ``m g h`` per radian."""


def held_posture(
    state: DynamicsState, standing: Standing, groups: JointGroups, settings: RecoverySettings,
    resting: FloatArray,
) -> FloatArray:  # fmt: skip
    """(nv - 6,) joint torques that hold the posture of a way to stand, whatever the ground can give [N.m].

    Springs have the gains of :attr:`RecoverySettings.stiffness` on the inertia of what hangs on a joint; hips
    and knees :data:`LEG_STIFFNESS` at least, ankles :attr:`RecoverySettings.ankle_stiffness`. They act on the
    state at the end of the period ("stable PD", Tan et al. 2011), beside the torques at rest (nv - 6,) [N.m].
    """
    period, joints = settings.period, groups.joints
    inertia = np.diag(state.mass_matrix)[6:]
    toppling = state.mass * GRAVITY * standing.height
    stiffness = settings.stiffness.stiffness * inertia
    legs = np.concatenate((joints["hip"], joints["knee"]))
    stiffness[legs] = np.maximum(stiffness[legs], LEG_STIFFNESS * toppling)
    stiffness[joints["ankle"]] = 0.5 * settings.ankle_stiffness * toppling
    damping = 2.0 * np.sqrt(stiffness * inertia)
    pull = np.zeros(len(state.v))
    pull[6:] = stiffness * (standing.posture - (state.q[7:] + period * state.v[6:])) - damping * state.v[6:]
    matrix = state.mass_matrix.copy()
    matrix[np.arange(6, len(pull)), np.arange(6, len(pull))] += period * damping
    return resting + pull[6:] - period * damping * np.linalg.solve(matrix, pull)[6:]


SETTLING = 20.0
"""Rate at which the controller damps what the feet move all the same [1/s]."""

ALIKE = 0.02
"""Angles of two legs that differ by less are equal [rad]."""


@dataclass(frozen=True, eq=False)
class RecoveryOutput:
    """Decision of one step.

    Attributes:
        tau: (nv - 6,) joint torques to hold until the next step [N.m].
        strategy: Strategy that gave them.
        gain_share: Share of the largest posture gains that was used; 0 with another strategy.
        wrenches: Expected force [N] and moment about the sole's centre [N.m] (6,) of each foot that carries.
        fallback: Empty when the program was solved; otherwise what was done instead.
        state: Dynamics at the measured state.
        problem: The program; None before the control reacts.
        standing: About which the balance was kept.
    """

    tau: FloatArray
    strategy: Strategy
    gain_share: float
    wrenches: dict[str, FloatArray]
    fallback: str
    state: DynamicsState
    problem: RecoveryProblem | None
    standing: Standing


class BalanceRecovery:
    """Keeps a standing body upright; holds the choice of strategy and the solver's start."""

    def __init__(
        self, body: BodyModel, q: ArrayLike, settings: RecoverySettings | None = None, *,
        support: Sequence[str] | None = None, friction: float = 0.7, joint_damping: ArrayLike | None = None,
    ) -> None:  # fmt: skip
        """Prepare the controller for a posture on both feet or on one.

        Args:
            body: A body with two legs.
            q: (nq,) the posture to keep, soles on one level plane.
            settings: Weights, gains and limits; the defaults when omitted.
            support: Effectors of the feet that carry; both when omitted.
            friction: Of the soles.
            joint_damping: (nv - 6,) passive damping of the controlled body's joints [N.m.s/rad].

        Raises:
            BodyError: If the body does not stand on two legs.
            InputError: If its soles are not level, or the support is not of its feet.
        """
        self.body, self.settings = body, settings or RecoverySettings()
        self.groups, self.friction, joints = mechanics.joint_groups(body), friction, body.nv - 6
        damping = np.zeros(joints) if joint_damping is None else joint_damping
        self._damping = frozen_array(damping, "joint_damping [N.m.s/rad]", (joints,))
        feet = self.groups.feet if support is None else tuple(support)
        for name in feet:
            if name not in self.groups.feet:
                raise InputError(f"support has {name!r}; valid: {', '.join(self.groups.feet)}")
        strength = self.settings.strength
        self._torque_limits = strength * body.torque_lower, strength * body.torque_upper
        self._dynamics = Dynamics(body, _frames(body, self.groups.feet))
        self._solvers = {name: WarmQPSolver() for name in ("full", "relaxed", "loose")}
        self._previous = self._resting = np.zeros(joints)
        self._arms = ArmSwing(body, self.groups)
        self.stand(Standing.of(body, q, feet, friction))
        rotation, position = Configuration(body, q).effector_placement(ROOT)
        upright = EffectorReference(rotation, position, np.zeros(6), np.zeros(6))
        self._ahead = rotation[:2, 0] / np.linalg.norm(rotation[:2, 0])
        self._objectives = Objectives(self.settings, self.groups, self._arms, upright)
        self.step(np.array(q, dtype=np.float64), np.zeros(body.nv))

    def stand(self, standing: Standing) -> None:
        """Keep the balance about another way to stand from now on."""
        self._time, self._turned = 0.0, np.zeros(2)
        self._arms.reset()
        self.standing = standing
        self._calm = standing.area.shrunk(self.settings.posture_area)
        self._geometry = tuple(contact_geometry(self.body, contact, 0.0) for contact in standing.soles)
        self._switch = StrategySwitch(self.settings)
        # Left and right knee flexion and ankle flexion ([Kudoh2002]_ 2.49-2.50).
        joints = [(f"left_{name}", f"right_{name}") for name in ("knee_flexion", "ankle_dorsiflexion")]
        known = [pair for pair in joints if len(standing.soles) > 1 and {*pair} <= {*self.body.joint_names}]
        pairs = [(self.body.joint_index(left), self.body.joint_index(right)) for left, right in known]
        posture = standing.posture
        self._alike = [(left, right) for left, right in pairs if abs(posture[left] - posture[right]) < ALIKE]

    def evaluate(self, q: FloatArray, v: FloatArray) -> DynamicsState:
        """Dynamics at a configuration (nq,) and velocity (nv,)."""
        return self._dynamics.evaluate(q, v)

    def problem_at(self, state: DynamicsState) -> RecoveryProblem:
        """The program of a step at a state, with nothing pushing and an objective of no use."""
        felt = FeltPush.none(self.body.nv)
        loop = mechanics.close_loop(state, self.standing.feet, felt)
        rows = mechanics.zmp_rows(self.standing.area, loop, state.com, self.settings.sole_inset)
        law = strategies.com_law(state, self.standing.com, self.standing.area, self.settings, self._turned)
        objective = self._objectives.balancing(state, self.standing.posture, law, self._time)
        contacts, none = self._contacts(state), LinearMap.none(loop.size)
        return recovery_problem.build_recovery_qp(
            state, loop, contacts, felt, self._bounds(state), rows, none, objective
        )

    def step(
        self, q: FloatArray, v: FloatArray, push: FeltPush | None = None, *, reacting: bool = True,
        swing: tuple[str, EffectorReference] | None = None,
    ) -> RecoveryOutput:  # fmt: skip
        """Decide the joint torques of the next period.

        Args:
            q: (nq,) measured configuration.
            v: (nv,) measured velocity.
            push: Push that is felt.
            reacting: Whether the reaction delay is over.
            swing: Effector of a foot that steps, and where it should be now.
        """
        state = self._dynamics.evaluate(q, v)
        if not reacting:
            tau = held_posture(state, self.standing, self.groups, self.settings, self._resting)
            self._previous = np.clip(tau, *self._torque_limits)
            return RecoveryOutput(self._previous, Strategy.STIFF, 0.0, {}, "", state, None, self.standing)
        felt = push if push is not None else FeltPush.none(self.body.nv)
        loop = mechanics.close_loop(state, self.standing.feet, felt, settling=SETTLING)
        law = self._law(state, may_turn=swing is None)
        strategy = self._switch.choose(state.com, law.settled, self.standing.area)
        rows = mechanics.zmp_rows(self.standing.area, loop, state.com, self.settings.sole_inset)
        share, leaving, objective = 0.0, False, None
        if swing is not None:
            strategy = Strategy.STEP
            objective = self._objectives.stepping(state, self.standing.posture, law, *swing)
        elif strategy is Strategy.POSTURE:
            control = self._posture_control(state, loop)
            if control is not None:
                objective = self._objectives.held(state, self.standing.posture, control.joints)
                share, leaving = control.share, not control.inside
                self._arms.reset()
        if objective is None:
            strategy = Strategy.PROGRAM
            objective = self._objectives.balancing(state, self.standing.posture, law, self._time)
        contacts = self._contacts(state)
        alike = recovery_problem.leg_symmetry(loop, state.q[7:], self._alike, ALIKE)
        # The ground carries at least a share of the weight; not in the thesis.
        least = self.settings.least_load * state.mass * GRAVITY
        loaded = LinearMap(-loop.force.matrix[2:], least - loop.force.offset[2:])
        problem = recovery_problem.build_recovery_qp(
            state, loop, contacts, felt, self._bounds(state), LinearMap.none(loop.size) if leaving else rows,
            alike.joined(loaded), objective, pulling=leaving,
        )  # fmt: skip
        solution, fallback = self._solve(problem)
        tau = self._previous
        if solution is not None:  # with what overcomes the passive damping
            tau = np.clip(problem.torque(solution.x) + self._damping * state.v[6:], *self._torque_limits)
        self._resting = self._previous = tau
        wrenches = dict(zip(self.standing.feet, _wrenches(contacts, solution, loop.size), strict=True))
        return RecoveryOutput(tau, strategy, share, wrenches, fallback, state, problem, self.standing)

    def _law(self, state: DynamicsState, *, may_turn: bool) -> ComLaw:
        """The law of the centre of mass one period later, with what has been turned meanwhile."""
        self._time += self.settings.period
        self._turned = self._turned + self.settings.period * strategies.fall_momentum(state)
        area, home = self.standing.area, self.standing.com
        law = strategies.com_law(state, home, area, self.settings, self._turned, may_turn=may_turn)
        if law.need > 0.0:
            self._arms.begin(self._time, law.settled - area.centre, law.reach, self._ahead)
        return law

    def _posture_control(self, state: DynamicsState, loop: ClosedLoop) -> strategies.PostureControl | None:
        """Posture control with the ZMP well inside; None where it would leave."""
        calm, settings = mechanics.zmp_rows(self._calm, loop, state.com, 0.0), self.settings
        stiff = settings.posture.stiffness * (self.standing.posture - state.q[7:])
        damped = -settings.posture.damping * state.v[6:]
        return strategies.posture_control(loop, calm, stiff, damped, always=settings.posture_control_only)

    def _contacts(self, state: DynamicsState) -> list[ContactForceBasis]:
        share, soles = self.settings.friction_share, zip(self.standing.soles, self._geometry, strict=True)
        model = edge_forces.inside_the_cone(self.settings.friction_model)
        build = partial(edge_forces.contact_force_basis, friction_share=share, friction_model=model)
        return [build(contact, geometry, state) for contact, geometry in soles]

    def _bounds(self, state: DynamicsState) -> JointBounds:
        limits, horizon = self.settings, self.settings.joint_limit_horizon
        return JointBounds.of(self.body, state, horizon, limits.max_joint_acceleration, limits.strength)

    def _solve(self, problem: RecoveryProblem) -> tuple[QPSolution | None, str]:
        solution = self._solvers["full"].solve(problem.program)
        if solution.solved:
            return solution, ""
        relaxed = self._solvers["relaxed"].solve(problem.relaxed())
        if relaxed.solved:
            return relaxed, f"without stops: {solution.status}"
        loose = self._solvers["loose"].solve(problem.loose())
        if loose.solved:
            return loose, f"as on any ground: {solution.status}, then {relaxed.status}"
        return None, f"previous torques: {solution.status}, {relaxed.status}, {loose.status}"


def _wrenches(contacts: list[ContactForceBasis], solution: QPSolution | None, start: int) -> FloatArray:
    """(k, 6) wrench of each foot in a solution, zero without one."""
    if solution is None:
        return np.zeros((len(contacts), 6))
    parts = zip(contacts, force_variables(contacts, start), strict=True)
    return np.array([basis.wrench @ solution.x[part] for basis, part in parts])


def _frames(body: BodyModel, feet: Sequence[str]) -> dict[str, int]:
    """Frames of feet and pelvis, and of the segments of the soles."""
    effectors = {name: body.effector_frame(name) for name in (*feet, ROOT)}
    segments = {name for foot in feet for name in end_segments(body, foot)}
    return effectors | {segment_key(name): body.segment_frame(name) for name in sorted(segments)}
