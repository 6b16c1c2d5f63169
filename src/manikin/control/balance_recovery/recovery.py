"""The controller that keeps a pushed body on its feet without a motion given beforehand ([Kudoh2002]_ 2)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import Contact, sole
from manikin.control.balance_recovery.closed_loop import ClosedLoop, FeltPush, LinearMap, close_loop
from manikin.control.balance_recovery.com_law import ComLaw, com_law
from manikin.control.balance_recovery.joint_groups import joint_groups
from manikin.control.balance_recovery.posture_control import posture_control
from manikin.control.balance_recovery.problem import (
    JointBounds,
    Objective,
    RecoveryProblem,
    build_recovery_qp,
    leg_symmetry,
)
from manikin.control.balance_recovery.settings import RecoverySettings
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
from manikin.control.settings import Impedance
from manikin.control.solver import QPSolution, make_solver
from manikin.spatial import GRAVITY, FloatArray, frozen_array

FIRM = 100.0
"""Weight of joints that hold an angle, against 1 of those that need not."""

LOOSE = 1e-3
"""Weight of joints whose torque is given instead."""

SETTLING = 20.0
"""Rate at which the controller damps what the feet move all the same [1/s]."""

NEARLY = 0.5
"""Torques that should not change may change by this [N.m]."""

ALIKE = 0.02
"""Angles of two legs that differ by less are equal [rad]."""


@dataclass(frozen=True, eq=False)
class RecoveryOutput:
    """What one step decided, and why.

    Attributes:
        tau: (nv - 6,) joint torques to hold until the next step [N.m].
        strategy: What decided them.
        gain_share: Share of the largest posture gains that was used; 0 with another strategy.
        wrenches: (2, 6) expected force [N] and moment about the sole's centre [N.m] of each foot.
        fallback: Empty when the program was solved; otherwise what was done instead.
        state: Dynamics at the measured state.
        problem: The program.
    """

    tau: FloatArray
    strategy: Strategy
    gain_share: float
    wrenches: FloatArray
    fallback: str
    state: DynamicsState
    problem: RecoveryProblem


class BalanceRecovery:
    """Keeps a body that stands on both feet upright; holds the choice of strategy and the solver's start."""

    def __init__(
        self,
        body: BodyModel,
        q: ArrayLike,
        settings: RecoverySettings | None = None,
        *,
        friction: float = 0.7,
        joint_damping: ArrayLike | None = None,
    ) -> None:
        """Prepare the controller for a posture on both feet.

        Args:
            body: A body with two legs.
            q: (nq,) the posture to keep, soles on one level plane.
            settings: Weights, gains and limits; the defaults when omitted.
            friction: Of the soles.
            joint_damping: (nv - 6,) passive damping of the controlled body's joints [N.m.s/rad].

        Raises:
            BodyError: If the body does not stand on two legs.
            InputError: If its soles are not level.
        """
        self.body, self.settings = body, settings or RecoverySettings()
        self.groups = joint_groups(body)
        joints = body.nv - 6
        damping = np.zeros(joints) if joint_damping is None else joint_damping
        self._damping = frozen_array(damping, "joint_damping [N.m.s/rad]", (joints,))
        feet = {name: body.effector_frame(name) for name in self.groups.feet}
        first = Dynamics(body, feet).evaluate(np.array(q, dtype=np.float64), np.zeros(body.nv))
        self.posture, self.com = first.q[7:].copy(), first.com.copy()
        self.soles = tuple(_sole(body, name, first, friction) for name in self.groups.feet)
        self.area = SupportArea.of(self.soles)
        self._geometry = tuple(contact_geometry(body, contact, 0.0) for contact in self.soles)
        segments = {
            segment_key(name): body.segment_frame(name)
            for geometry in self._geometry
            for name in geometry.segments
        }
        self._dynamics = Dynamics(body, {**segments, **feet})
        self._pairs = _alike_joints(body)
        self._locked = self.groups.locked(self.settings.locked)
        self._switch = StrategySwitch(self.settings)
        self._solvers = {name: make_solver(self.settings.solver) for name in ("full", "relaxed")}
        self._previous = self._resting = np.zeros(joints)
        self.step(first.q, first.v)

    def step(
        self, q: FloatArray, v: FloatArray, push: FeltPush | None = None, *, reacting: bool = True
    ) -> RecoveryOutput:
        """Decide the joint torques of the next period.

        Args:
            q: (nq,) measured configuration.
            v: (nv,) measured velocity.
            push: What pushes the body and is felt.
            reacting: Whether the reaction delay is over.
        """
        state = self._dynamics.evaluate(q, v)
        felt = push if push is not None and reacting else FeltPush.none(self.body.nv)
        loop = close_loop(state, self.groups.feet, felt, settling=SETTLING)
        law = com_law(state, self.com, self.area, self.settings)
        strategy = self._switch.choose(state.com, law.settled, self.area) if reacting else Strategy.STIFF
        rows = zmp_rows(self.area, loop, state.com, self.settings.sole_inset)
        share = 0.0
        objective: Objective | None = None
        if strategy is Strategy.STIFF:
            objective = self._stiff(state)
        elif strategy is Strategy.POSTURE:
            calm = zmp_rows(self.area.shrunk(self.settings.posture_area), loop, state.com, 0.0)
            found = posture_control(loop, calm, self._pull(self.settings.posture, state))
            if found is not None:
                objective, share = self._held(state, found.joints), found.share
            elif self.settings.posture_control_only:
                objective = self._held(state, self._pull(self.settings.posture, state))
            else:
                strategy = Strategy.PROGRAM
        if objective is None:
            objective = self._balancing(state, law)
        contacts = self._contacts(state)
        problem = build_recovery_qp(
            state, loop, contacts, felt, self._bounds(state, strategy), rows,
            self._wished(state, loop), objective,
        )  # fmt: skip
        solution, fallback = self._solve(problem)
        tau = self._previous if solution is None else self._torque(problem, solution, state)
        self._previous = tau
        if strategy is not Strategy.STIFF:
            self._resting = tau
        wrenches = _wrenches(contacts, solution, loop.size)
        return RecoveryOutput(tau, strategy, share, wrenches, fallback, state, problem)

    # --- objectives --------------------------------------------------------------------------

    def _pull(self, gains: Impedance, state: DynamicsState) -> FloatArray:
        """(nv - 6,) joint accelerations back to the posture."""
        return gains.stiffness * (self.posture - state.q[7:]) - gains.damping * state.v[6:]

    def _held(self, state: DynamicsState, wanted: FloatArray) -> Objective:
        """Joint accelerations as wanted, and of locked joints what holds them."""
        weight = np.full(len(wanted), FIRM)
        return Objective(weight, self._with_locked(state, wanted, weight), np.zeros(3))

    def _stiff(self, state: DynamicsState) -> Objective:
        """Every joint but the ankles is held; these keep their torques, see :meth:`_bounds`."""
        weight = np.full(len(self.posture), FIRM)
        weight[self.groups.joints["ankle"]] = LOOSE
        return Objective(weight, self._pull(self.settings.stiffness, state), np.zeros(3))

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

    def _with_locked(self, state: DynamicsState, wanted: FloatArray, weight: FloatArray) -> FloatArray:
        """Wanted accelerations with those that hold the locked joints; their weights are set."""
        result = wanted.copy()
        result[self._locked] = self._pull(self.settings.stiffness, state)[self._locked]
        weight[self._locked] = FIRM * 10.0
        return result

    def _wished(self, state: DynamicsState, loop: ClosedLoop) -> LinearMap:
        """Rows that hold where they can: alike legs and a loaded ground."""
        alike = leg_symmetry(loop, state.q[7:], self._pairs, ALIKE)
        return alike.joined(load_row(loop, self.settings.least_load * state.mass * GRAVITY))

    # --- limits ------------------------------------------------------------------------------

    def _contacts(self, state: DynamicsState) -> list[ContactForceBasis]:
        share = self.settings.friction_share
        return [
            contact_force_basis(contact, geometry, state, friction_share=share)
            for contact, geometry in zip(self.soles, self._geometry, strict=True)
        ]

    def _bounds(self, state: DynamicsState, strategy: Strategy) -> JointBounds:
        body, settings = self.body, self.settings
        lower, upper = joint_acceleration_bounds(
            state.q[7:], state.v[6:], body.lower, body.upper, settings.strength * body.velocity_limit,
            settings.joint_limit_horizon, settings.max_joint_acceleration,
        )  # fmt: skip
        most = settings.strength * body.torque_limit
        least = -most
        if strategy is Strategy.STIFF:
            ankles = self.groups.joints["ankle"]
            most, least = most.copy(), least.copy()
            height = self.com[2] - self.area.height
            spring = 0.5 * settings.ankle_stiffness * state.mass * GRAVITY * height
            torque = self._resting[ankles] + spring * (self.posture - state.q[7:])[ankles]
            limit = most[ankles] - NEARLY
            torque = np.clip(torque, -limit, limit)
            least[ankles], most[ankles] = torque - NEARLY, torque + NEARLY
        return JointBounds(least, most, lower, upper)

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
        return None, f"previous torques: {solution.status}, then {relaxed.status}"


def _wrenches(contacts: list[ContactForceBasis], solution: QPSolution | None, start: int) -> FloatArray:
    """(2, 6) wrench of each foot in a solution, zero without one."""
    if solution is None:
        return np.zeros((len(contacts), 6))
    ends = np.cumsum([start, *(basis.wrench.shape[1] for basis in contacts)])
    return np.array(
        [b.wrench @ solution.x[i:j] for b, i, j in zip(contacts, ends[:-1], ends[1:], strict=True)]
    )


def _sole(body: BodyModel, name: str, state: DynamicsState, friction: float) -> Contact:
    frame = state.frames[name]
    return sole(
        name, frame.position, rotation=frame.rotation, length=float(body.sole_length or 0.0),
        width=float(body.sole_width or 0.0), friction=friction,
    )  # fmt: skip


def _alike_joints(body: BodyModel) -> list[tuple[int, int]]:
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
