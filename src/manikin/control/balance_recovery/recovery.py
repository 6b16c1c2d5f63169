"""The controller that keeps a pushed body on its feet without a motion given beforehand ([Kudoh2002]_ 2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body import BodyModel, Configuration
from manikin.body.limb import end_segments
from manikin.contact import Contact
from manikin.control.balance_recovery.closed_loop import ClosedLoop, FeltPush, LinearMap, close_loop
from manikin.control.balance_recovery.com_law import ComLaw, com_law
from manikin.control.balance_recovery.joint_groups import joint_groups
from manikin.control.balance_recovery.posture_control import PostureControl, posture_control
from manikin.control.balance_recovery.problem import (
    JointBounds,
    Objective,
    RecoveryProblem,
    build_recovery_qp,
    leg_symmetry,
)
from manikin.control.balance_recovery.settings import RecoverySettings
from manikin.control.balance_recovery.standing import Standing
from manikin.control.balance_recovery.strategy import Strategy, StrategySwitch
from manikin.control.balance_recovery.support_area import SupportArea, load_row, zmp_rows
from manikin.control.build_qp import joint_acceleration_bounds
from manikin.control.contact_forces import (
    ContactForceBasis,
    contact_force_basis,
    contact_geometry,
    segment_key,
)
from manikin.control.dynamics import Dynamics, DynamicsState
from manikin.control.reference import EffectorReference
from manikin.control.settings import Impedance
from manikin.control.solver import QPSolution, make_solver
from manikin.control.tasks import orientation_task, swing_task
from manikin.spatial import GRAVITY, FloatArray, frozen_array

FIRM = 100.0
"""Weight of joints that hold an angle, against 1 of those that need not."""

SETTLING = 20.0
"""Rate at which the controller damps what the feet move all the same [1/s]."""

LEG_STIFFNESS = 3.0
"""Stiffness of hips and knees before they react, at least, in ``m g h`` per radian."""

ROOT = "pelvis"
"""Effector that is kept upright while a foot steps."""

STEPPING_JOINTS = 0.1
"""Weight of the joints while a foot steps."""

ALIKE = 0.02
"""Angles of two legs that differ by less are equal [rad]."""


@dataclass(frozen=True, eq=False)
class RecoveryOutput:
    """What one step decided, and why.

    Attributes:
        tau: (nv - 6,) joint torques to hold until the next step [N.m].
        strategy: What decided them.
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
        self,
        body: BodyModel,
        q: ArrayLike,
        settings: RecoverySettings | None = None,
        *,
        support: Sequence[str] | None = None,
        friction: float = 0.7,
        joint_damping: ArrayLike | None = None,
    ) -> None:
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
        self.groups = joint_groups(body)
        self.friction = friction
        joints = body.nv - 6
        damping = np.zeros(joints) if joint_damping is None else joint_damping
        self._damping = frozen_array(damping, "joint_damping [N.m.s/rad]", (joints,))
        feet = self.groups.feet if support is None else tuple(support)
        for name in feet:
            if name not in self.groups.feet:
                raise InputError(f"support has {name!r}; valid: {', '.join(self.groups.feet)}")
        self._dynamics = Dynamics(body, _frames(body, self.groups.feet))
        self._locked = self.groups.locked(self.settings.locked)
        self._solvers = {name: make_solver(self.settings.solver) for name in ("full", "relaxed", "loose")}
        self._previous = self._resting = np.zeros(joints)
        self.stand(Standing.of(body, q, feet, friction))
        rotation, position = Configuration(body, q).effector_placement(ROOT)
        self._upright = EffectorReference(rotation, position, np.zeros(6), np.zeros(6))
        self.step(np.array(q, dtype=np.float64), np.zeros(body.nv))

    def stand(self, standing: Standing) -> None:
        """Keep the balance about another way to stand from now on."""
        self.standing = standing
        self._geometry = tuple(contact_geometry(self.body, contact, 0.0) for contact in standing.soles)
        self._switch = StrategySwitch(self.settings)
        self._alike = [
            (left, right)
            for left, right in _leg_joints(self.body)
            if len(standing.soles) > 1 and abs(standing.posture[left] - standing.posture[right]) < ALIKE
        ]

    @property
    def posture(self) -> FloatArray:
        """(nv - 6,) joint angles that are kept [rad]."""
        return self.standing.posture

    @property
    def com(self) -> FloatArray:
        """(3,) centre of mass that is kept [m]."""
        return self.standing.com

    @property
    def soles(self) -> tuple[Contact, ...]:
        """Soles that carry."""
        return self.standing.soles

    @property
    def area(self) -> SupportArea:
        """Where the ZMP may be."""
        return self.standing.area

    @property
    def locked(self) -> NDArray[np.int64]:
        """Hinges that hold the posture whatever happens."""
        return self._locked

    def evaluate(self, q: FloatArray, v: FloatArray) -> DynamicsState:
        """Dynamics at a configuration (nq,) and velocity (nv,)."""
        return self._dynamics.evaluate(q, v)

    def problem_at(self, state: DynamicsState) -> RecoveryProblem:
        """The program of a step at a state, with nothing pushing and an objective of no use."""
        felt = FeltPush.none(self.body.nv)
        loop = close_loop(state, self.standing.feet, felt)
        rows = zmp_rows(self.area, loop, state.com, self.settings.sole_inset)
        law = com_law(state, self.com, self.area, self.settings)
        objective = self._balancing(state, law)
        return build_recovery_qp(
            state, loop, self._contacts(state), felt, self._bounds(state), rows,
            LinearMap.none(loop.size), objective,
        )  # fmt: skip

    def step(
        self,
        q: FloatArray,
        v: FloatArray,
        push: FeltPush | None = None,
        *,
        reacting: bool = True,
        swing: tuple[str, EffectorReference] | None = None,
    ) -> RecoveryOutput:
        """Decide the joint torques of the next period.

        Args:
            q: (nq,) measured configuration.
            v: (nv,) measured velocity.
            push: What pushes the body and is felt.
            reacting: Whether the reaction delay is over.
            swing: Effector of a foot that is on its way to another place, and where it should be now.
        """
        state = self._dynamics.evaluate(q, v)
        if not reacting:
            return self._output(state, Strategy.STIFF, self._stiff(state))
        felt = push if push is not None else FeltPush.none(self.body.nv)
        loop = close_loop(state, self.standing.feet, felt, settling=SETTLING)
        law = com_law(state, self.com, self.area, self.settings, turning=swing is None)
        strategy = self._switch.choose(state.com, law.settled, self.area)
        rows = zmp_rows(self.area, loop, state.com, self.settings.sole_inset)
        share, leaving = 0.0, False
        objective: Objective | None = None
        if swing is not None:
            strategy, objective = Strategy.STEP, self._stepping(state, law, *swing)
        elif strategy is Strategy.POSTURE:
            found = self._posture_control(state, loop)
            if found is not None:
                objective = self._held(state, found.joints)
                share, leaving = found.share, not found.inside
        if objective is None:
            strategy, objective = Strategy.PROGRAM, self._balancing(state, law)
        contacts = self._contacts(state)
        problem = build_recovery_qp(
            state, loop, contacts, felt, self._bounds(state), LinearMap.none(loop.size) if leaving else rows,
            self._wished(state, loop), objective, pulling=leaving,
        )  # fmt: skip
        solution, fallback = self._solve(problem)
        tau = self._previous if solution is None else self._torque(problem, solution, state)
        self._resting = tau
        wrenches = dict(zip(self.standing.feet, _wrenches(contacts, solution, loop.size), strict=True))
        return self._output(state, strategy, tau, problem, share, wrenches, fallback)

    def _output(
        self,
        state: DynamicsState,
        strategy: Strategy,
        tau: FloatArray,
        problem: RecoveryProblem | None = None,
        share: float = 0.0,
        wrenches: dict[str, FloatArray] | None = None,
        fallback: str = "",
    ) -> RecoveryOutput:
        self._previous = tau
        return RecoveryOutput(tau, strategy, share, wrenches or {}, fallback, state, problem, self.standing)

    def _posture_control(self, state: DynamicsState, loop: ClosedLoop) -> PostureControl | None:
        """Posture control with the ZMP well inside; None where it would leave and the program may be chosen."""
        calm = zmp_rows(self.area.shrunk(self.settings.posture_area), loop, state.com, 0.0)
        pull = self._pull(self.settings.posture, state)
        return posture_control(loop, calm, pull, always=self.settings.posture_control_only)

    # --- objectives --------------------------------------------------------------------------

    def _pull(self, gains: Impedance, state: DynamicsState) -> FloatArray:
        """(nv - 6,) joint accelerations back to the posture."""
        return gains.stiffness * (self.posture - state.q[7:]) - gains.damping * state.v[6:]

    def _held(self, state: DynamicsState, wanted: FloatArray) -> Objective:
        """Joint accelerations as wanted, and of locked joints what holds them."""
        weight = np.full(len(wanted), FIRM)
        return Objective(weight, self._with_locked(state, wanted, weight), np.zeros(3))

    def _stiff(self, state: DynamicsState) -> FloatArray:
        """Torques of muscles that do not react yet: springs and dampers about the posture.

        A spring has the gains of :attr:`RecoverySettings.stiffness` on the inertia of what hangs on its
        joint; hips and knees have :data:`LEG_STIFFNESS` at least, ankles a share of their own. The springs
        act on the state at the end of the period, so that stiff ones on light segments do not swing up
        ("stable PD", Tan et al. 2011).
        """
        settings, joints, period = self.settings, self.groups.joints, self.settings.period
        inertia = np.diag(state.mass_matrix)[6:]
        toppling = state.mass * GRAVITY * self.standing.height
        stiffness = settings.stiffness.stiffness * inertia
        legs = np.concatenate((joints["hip"], joints["knee"]))
        stiffness[legs] = np.maximum(stiffness[legs], LEG_STIFFNESS * toppling)
        stiffness[joints["ankle"]] = 0.5 * settings.ankle_stiffness * toppling
        damping = 2.0 * np.sqrt(stiffness * inertia)
        pull = np.zeros(len(state.v))
        pull[6:] = stiffness * (self.posture - state.q[7:] - period * state.v[6:]) - damping * state.v[6:]
        matrix = state.mass_matrix.copy()
        matrix[np.arange(6, len(pull)), np.arange(6, len(pull))] += period * damping
        spring = pull[6:] - period * damping * np.linalg.solve(matrix, pull)[6:]
        limit = settings.strength * self.body.torque_limit
        return np.clip(self._resting + spring, -limit, limit)

    def _balancing(self, state: DynamicsState, law: ComLaw) -> Objective:
        """The objective of the quadratic program (2.54) with the law of the centre of mass."""
        settings = self.settings
        weight = np.ones(len(self.posture))
        weight[self.groups.joints["arm"]] = settings.arm_weight
        gains = settings.unwinding
        damping = gains.damping + (1.0 - law.need) * settings.stopping
        wanted = self._pull(Impedance(gains.stiffness, damping), state)
        wanted = self._with_locked(state, wanted, weight)
        pull = np.array([settings.com_weight, settings.com_weight, settings.height_weight])
        return Objective(weight, wanted, law.acceleration, pull, settings.upward)

    def _stepping(self, state: DynamicsState, law: ComLaw, foot: str, wanted: EffectorReference) -> Objective:
        """A foot follows its way, the trunk stays upright and the centre of mass keeps its law."""
        settings = self.settings
        weight = np.full(len(self.posture), STEPPING_JOINTS)
        joints = self._with_locked(state, self._pull(settings.posture, state), weight)
        pull = np.array([settings.com_weight, settings.com_weight, settings.height_weight])
        tasks = [
            swing_task(foot, state.frames[foot], wanted, settings.swing, settings.swing_weight),
            orientation_task(
                ROOT, state.frames[ROOT], self._upright, settings.posture, settings.swing_weight
            ),
        ]
        return Objective(weight, joints, law.acceleration, pull, tasks=tuple(tasks))

    def _with_locked(self, state: DynamicsState, wanted: FloatArray, weight: FloatArray) -> FloatArray:
        """Wanted accelerations with those that hold the locked joints; their weights are set."""
        result = wanted.copy()
        result[self._locked] = self._pull(self.settings.stiffness, state)[self._locked]
        weight[self._locked] = FIRM * 10.0
        return result

    def _wished(self, state: DynamicsState, loop: ClosedLoop) -> LinearMap:
        """Rows that hold where they can: alike legs and a loaded ground."""
        alike = leg_symmetry(loop, state.q[7:], self._alike, ALIKE)
        return alike.joined(load_row(loop, self.settings.least_load * state.mass * GRAVITY))

    # --- limits ------------------------------------------------------------------------------

    def _contacts(self, state: DynamicsState) -> list[ContactForceBasis]:
        share = self.settings.friction_share
        return [
            contact_force_basis(contact, geometry, state, friction_share=share)
            for contact, geometry in zip(self.soles, self._geometry, strict=True)
        ]

    def _bounds(self, state: DynamicsState) -> JointBounds:
        body, settings = self.body, self.settings
        lower, upper = joint_acceleration_bounds(
            state.q[7:], state.v[6:], body.lower, body.upper, settings.strength * body.velocity_limit,
            settings.joint_limit_horizon, settings.max_joint_acceleration,
        )  # fmt: skip
        most = settings.strength * body.torque_limit
        return JointBounds(-most, most, lower, upper)

    # --- solution ----------------------------------------------------------------------------

    def _torque(self, problem: RecoveryProblem, solution: QPSolution, state: DynamicsState) -> FloatArray:
        """Torques of the solution, with what overcomes the passive damping."""
        limit = self.settings.strength * self.body.torque_limit
        return np.clip(problem.torque(solution.x) + self._damping * state.v[6:], -limit, limit)

    def _solve(self, problem: RecoveryProblem) -> tuple[QPSolution | None, str]:
        solution = self._solvers["full"].solve(problem.program)
        if solution.found:
            return solution, ""
        relaxed = self._solvers["relaxed"].solve(problem.relaxed())
        if relaxed.found:
            return relaxed, f"without stops: {solution.status}"
        loose = self._solvers["loose"].solve(problem.loose())
        if loose.found:
            return loose, f"as on any ground: {solution.status}, then {relaxed.status}"
        return None, f"previous torques: {solution.status}, {relaxed.status}, {loose.status}"


def _wrenches(contacts: list[ContactForceBasis], solution: QPSolution | None, start: int) -> FloatArray:
    """(k, 6) wrench of each foot in a solution, zero without one."""
    if solution is None:
        return np.zeros((len(contacts), 6))
    ends = np.cumsum([start, *(basis.wrench.shape[1] for basis in contacts)])
    return np.array(
        [b.wrench @ solution.x[i:j] for b, i, j in zip(contacts, ends[:-1], ends[1:], strict=True)]
    )


def _frames(body: BodyModel, feet: Sequence[str]) -> dict[str, int]:
    """Frames of feet and pelvis, and of the segments of the soles."""
    found = {name: body.effector_frame(name) for name in (*feet, ROOT)}
    segments = {name for foot in feet for name in end_segments(body, foot)}
    return found | {segment_key(name): body.segment_frame(name) for name in sorted(segments)}


def _leg_joints(body: BodyModel) -> list[tuple[int, int]]:
    """Left and right knee flexion and ankle flexion ([Kudoh2002]_ 2.49-2.50)."""
    names = [
        ("left_knee_flexion", "right_knee_flexion"),
        ("left_ankle_dorsiflexion", "right_ankle_dorsiflexion"),
    ]
    return [
        (body.joint_index(left), body.joint_index(right))
        for left, right in names
        if left in body.joint_names and right in body.joint_names
    ]
