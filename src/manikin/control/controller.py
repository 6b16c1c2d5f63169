"""Weighted multi-task control of a planned motion ([Qiu2012]_ 6.3)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from manikin.body import BodyModel, with_root
from manikin.body.limbs import hanging_segment, limb_hinges, moving_segments
from manikin.body.segments import HANDS
from manikin.contact import Contact, ContactKind, ContactSchedule, FrictionModel, SolePart
from manikin.control import edge_forces, tasks
from manikin.control.build_qp import ControlProblem, JointBounds, LoadedContact, build_qp
from manikin.control.capture_step import ShiftedPlan
from manikin.control.delay import DelayEstimator, PendingDecisions
from manikin.control.dynamics import Dynamics, DynamicsState
from manikin.control.edge_forces import ContactGeometry, contact_geometry, segment_key
from manikin.control.estimate import StateEstimator, StateNoise
from manikin.control.partings import SelfWatch
from manikin.control.plan_return import Deviation, PlanClock, deviation_from_plan, returning_acceleration
from manikin.control.reference import Reference, ReferenceSample
from manikin.control.settings import ControlSettings
from manikin.control.supports import SupportMode, SupportState, SupportSwitch
from manikin.control.tasks import AccelerationTask, ForceWish, landing_reference, lifted, swing_task
from manikin.motion import Motion
from manikin.numerics.qp import QPSolution, WarmQPSolver
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array

YIELDING = 0.2
"""Stiffness with which a hand that should feel a force is held at its place, relative to a stance's."""

PRESSED = 0.02
"""Least normal force of each contact of a human on knees and wrists alone, from its landing until it is about
to leave, relative to the weight: of three points none can be spared, and one that is let go ends balance."""

RAISED = 0.006
"""Points this far above the lowest one of a contact that settles may carry load, twice as far none [m]."""

ROUNDING = 1e-6
"""Points that lie no farther apart along a sole are on one line across it [m]."""

RAISED_TOES, BOUNCED = 0.001, 0.05
"""The same of the tips of toes [m], and their angle from the plan from which they have bounced off [rad]."""


@dataclass(frozen=True, eq=False)
class ControlOutput:
    """Decision of one control step.

    Attributes:
        tau: (nv - 6,) joint torques to hold until the next step [N.m].
        acceleration: (nv,) generalised acceleration expected from them.
        wrenches: Expected force [N] and moment [N.m] (6,) of each effector of the schedule,
            about the effector frame's origin, in world axes.
        supports: State of each effector of the schedule.
        fallback: Empty when the program was solved; otherwise which fallback was taken and
            why: ``"without joint bounds: ..."`` or ``"previous torques: ..."``.
        state: Dynamics at the measured state.
        reference: Planned state.
        problem: The program that was solved (or not).
        iterations: Iterations of the solver.
        waited: How long the plan has waited for the body so far [s]: its own time is that much less.
    """

    tau: FloatArray
    acceleration: FloatArray
    wrenches: dict[str, FloatArray]
    supports: dict[str, SupportState]
    fallback: str
    state: DynamicsState
    reference: ReferenceSample
    problem: ControlProblem
    iterations: int
    waited: float = 0.0


class Controller:
    """Follows a planned motion by one quadratic program per control step.

    Keeps four things between steps: the state of the supports, the time of the plan, the solver's starting
    point and the distances between parts of the body. All are functions of the steps made so far, so that
    equal runs give equal bits.

    Attributes:
        clock: Time of the plan.
        shift: Where the plan goes on, of a walker whose steps may be moved.
    """

    def __init__(
        self, body: BodyModel, motion: Motion, schedule: ContactSchedule,
        settings: ControlSettings | None = None, *, joint_damping: ArrayLike | None = None,
        joint_inertia: ArrayLike | None = None, wishes: Sequence[ForceWish] = (),
    ) -> None:  # fmt: skip
        """Prepare the controller.

        Args:
            body: Whose motion it is.
            motion: What to follow.
            settings: Weights, gains and limits; the defaults when omitted.
            joint_damping: (nv - 6,) passive damping of the joints [N.m.s/rad]; none when omitted.
            joint_inertia: (nv - 6,) inertia about the joints beside that of the body [kg.m^2].
            wishes: Forces that effectors in contact should feel, at most one of each.

        Raises:
            InputError: If the motion or the schedule does not belong to the body.
        """
        body, self._root = with_root(body)
        self.body, self.schedule, self.settings = body, schedule, settings or ControlSettings()
        planned = schedule.sequence[0].stance.friction_model
        self._friction_model: FrictionModel = edge_forces.inside_the_cone(planned)
        joints = body.nv - 6
        damping = np.zeros(joints) if joint_damping is None else joint_damping
        self._damping = frozen_array(damping, "joint_damping [N.m.s/rad]", (joints,))
        inertia = np.zeros(joints) if joint_inertia is None else joint_inertia
        self._inertia = frozen_array(inertia, "joint_inertia [kg.m^2]", (joints,))
        self._wishes = {wish.effector: wish for wish in wishes}
        self._switch = SupportSwitch(schedule, self.settings.supports)
        every = [contact for phase in schedule.sequence for contact in phase.stance]
        contacts = {_touching_points(item): item for item in every}
        inset = self.settings.supports.sole_inset
        self._geometry = {key: contact_geometry(body, item, inset) for key, item in contacts.items()}
        self._along = {key: edge_forces.points_along(body, item) for key, item in self._geometry.items()}
        self._points = {contact.effector for contact in every if contact.kind is ContactKind.POINT}
        self._toes = {name: _hanging_joints(body, name) for name in self._switch.effectors}
        hanging = {joint for some in self._toes.values() for joint in some}
        carriers = {name for phase in schedule.sequence if phase.load for name in phase.load.masses}
        self._arms = _free_arms(body, carriers.union(self._switch.effectors))
        hanging.update(self._arms)
        self._others = [joint for joint in range(joints) if joint not in hanging]
        named = dict.fromkeys((*self._switch.effectors, self._root, *sorted(carriers)))
        frames = {name: body.effector_frame(name) for name in named}
        names = (name for geometry in self._geometry.values() for name, _ in geometry.patches)
        segments = {segment_key(name): body.segment_frame(name) for name in names}
        self._dynamics = Dynamics(body, segments | frames)
        self._watch = SelfWatch(body, motion)
        horizon = self.settings.joint_limit_horizon
        self.reference = Reference(body, motion, frames, self.settings.period, horizon)
        self._solver, self._spare_solver = WarmQPSolver(), WarmQPSolver()
        self.clock = PlanClock(self.settings.period, self.settings.returning)
        stepping = self.settings.stepping
        self.shift = None if stepping is None else ShiftedPlan(schedule, stepping, self.settings.period)
        self._previous = np.zeros(joints)
        noise, period, delay = self.settings.noise, self.settings.period, self.settings.delay
        self._pending, self._late = PendingDecisions(body.nv, delay, period), DelayEstimator(delay, period)
        self._estimator = StateEstimator(body, noise, period) if noise != StateNoise() else None
        self._carried: dict[str, float] = {}

    def step(
        self, time: float, q: FloatArray, v: FloatArray, touching: Mapping[str, bool] | None = None,
        felt: FloatArray | None = None,
    ) -> ControlOutput:  # fmt: skip
        """Decide the joint torques of the next period.

        Args:
            time: Current time of the motion [s].
            q: (nq,) measured configuration.
            v: (nv,) measured velocity.
            touching: Whether each effector is felt to touch; the schedule is trusted where it says nothing.
            felt: (nv - 6,) mean joint torques of the last period [N.m], by which the delay is found; the
                believed one is trusted without them.
        """
        clock, waited, rate = self.clock, self.clock.waited, self.clock.rate
        if felt is not None:
            self._late.felt(felt)
            self._pending.delay = self._late.delay
        time = clock.at(time) + self._pending.delay
        supports = self._switch.update(time, touching)
        disturbance = np.zeros(len(v))
        if self._estimator is not None:
            q, v = self._estimator.update(q, v, self._pending.acted())
            disturbance = self._estimator.disturbance
        state = self._dynamics.evaluate(*self._foreseen(q, v, disturbance), self.carried_at(time))
        if self._estimator is not None:
            state = replace(state, bias=state.bias - state.mass_matrix @ disturbance)
        # Where the plan is at its own time, which passes now, and how far the body is from it.
        reference, deviation = self.reference.sample(time, rate, rate), None
        if self.shift is not None:
            reference = self.shift.moved(time, state, reference, supports, waits=rate < 1.0)
        if self.settings.returning is not None:
            deviation = deviation_from_plan(state, reference, supports)
            clock.advance(clock.next_rate(deviation))
            if clock.rate != rate:
                later = self.reference.sample(time, rate, clock.rate)
                reference = later if self.shift is None else self.shift.applied(later)
        problem = self.problem(state, reference, supports, time, deviation)
        solution, fallback = self._solve(problem)
        x, iterations = np.zeros(len(problem.program.gradient)), 0
        if solution is not None:
            x, iterations = solution.x, solution.iterations
            self._previous = problem.torque(x)
            for name, load in problem.normal_forces(x).items():  # what it carries until its unloading begins
                if supports[name].unload_share >= 1.0:
                    self._carried[name] = load
        self._pending.append(problem.acceleration(x) - disturbance)
        self._late.commanded(self._previous)
        return ControlOutput(
            self._previous, problem.acceleration(x).copy(), problem.wrenches(x), supports, fallback, state,
            reference, problem, iterations, waited,
        )  # fmt: skip

    def _foreseen(
        self, q: FloatArray, v: FloatArray, disturbance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The state when the torques that are decided on now act, by the accelerations decided on."""
        way, rate = np.zeros(len(v)), v
        for time, decided in self._pending.coming():
            way = way + time * rate + 0.5 * time**2 * (decided + disturbance)
            rate = rate + time * (decided + disturbance)
        return (q, v) if rate is v else (pin.integrate(self.body.pinocchio, q, way), rate)

    def carried_at(self, time: float) -> Mapping[str, float]:
        """Point masses [kg] that effectors carry at a time of the plan [s]."""
        load = self.schedule.phase_held(time).load
        return {} if load is None else load.masses

    def problem(
        self, state: DynamicsState, reference: ReferenceSample, supports: Mapping[str, SupportState],
        time: float = -np.inf, deviation: Deviation | None = None,
    ) -> ControlProblem:  # fmt: skip
        """Build the program of one step, without solving it; wished forces are those of the time [s]."""
        settings = self.settings
        on = [(s, s.contact) for s in supports.values() if s.mode is SupportMode.STANCE and s.contact]
        pressed = self.body.stature is not None and {c.kind for _, c in on} == {ContactKind.POINT}
        loaded = [self._loaded(*one, state, reference, time, pressed=pressed) for one in on]
        horizon, largest = settings.joint_limit_horizon, settings.max_joint_acceleration
        bounds = JointBounds.of(self.body, state, horizon, largest, planned=reference)
        return build_qp(
            state, self.tasks(state, reference, supports, deviation), loaded, bounds, self._damping,
            period=settings.period, acceleration_weight=settings.weights.acceleration,
            force_weight=settings.weights.force, sum_cap=self.schedule.stance_at(time).normal_force_cap,
            partings=self._watch.partings(state, reference, horizon, settings.period),
            inertia=self._inertia,
        )  # fmt: skip

    def geometry(self, contact: Contact) -> ContactGeometry:
        """Points of the body that carry the forces of a contact of the schedule."""
        return self._geometry[_touching_points(contact)]

    def tasks(
        self, state: DynamicsState, reference: ReferenceSample, supports: Mapping[str, SupportState],
        deviation: Deviation | None = None,
    ) -> list[AccelerationTask]:  # fmt: skip
        """List the weighted tasks of one step."""
        gains, weights, root = self.settings.impedances, self.settings.weights, self._root
        wanted = [self._com_task(state, reference, deviation)]
        if not self._rests(supports):
            frame, planned = state.frames[root], reference.effectors[root]
            wanted.append(tasks.orientation_task(root, frame, planned, gains.pelvis, weights.pelvis))
        wanted += [self._effector_task(support, state, reference) for support in supports.values()]
        parts = ("posture", gains.posture, self._others), ("arms", gains.arms, self._arms)
        for part, gain, joints in parts:
            if joints:
                wanted.append(tasks.posture_task(part, state, reference, gain, weights.posture, joints))
        for name, toes in self._toes.items():  # followed as their foot is
            gain = gains.posture if supports[name].mode is SupportMode.STANCE else gains.swing
            if self.settings.watch_toes and supports[name].mode is SupportMode.STANCE:
                away = np.abs(state.q[7:][toes] - reference.q[7:][toes])
                gain = self.settings.toes_back if away.max(initial=0.0) > BOUNCED else gain
            if toes:
                wanted.append(
                    tasks.posture_task(f"toes of {name}", state, reference, gain, weights.effectors, toes)
                )
        if (weight := weights.angular_momentum) > 0:
            wanted.append(tasks.angular_momentum_task(state, reference, gains.angular_momentum, weight))
        return wanted

    def _com_task(
        self, state: DynamicsState, reference: ReferenceSample, deviation: Deviation | None
    ) -> AccelerationTask:
        task = tasks.com_task(state, reference, self.settings.impedances.com, self.settings.weights.com)
        returning = self.settings.returning
        if returning is None or deviation is None or returning.share(deviation.size, deviation.speed) == 0.0:
            return task
        drift = state.momentum_drift[:3] / state.mass
        wanted = returning_acceleration(task.target + drift, state, reference, deviation, returning)
        return replace(task, target=wanted - drift)

    def _rests(self, supports: Mapping[str, SupportState]) -> bool:
        """Whether the pelvis itself is on a support, which then says how it is turned."""
        held = (name for name, support in supports.items() if support.mode is SupportMode.STANCE)
        segment = self.body.effector(self._root).segment
        return any(self.body.effector(name).segment == segment for name in held)

    def _effector_task(
        self, support: SupportState, state: DynamicsState, reference: ReferenceSample
    ) -> AccelerationTask:
        name, weight, gains = support.effector, self.settings.weights.effectors, self.settings.impedances
        frame, planned = state.frames[name], reference.effectors[name]
        part = support.contact is not None and support.contact.part is not SolePart.FULL
        if support.mode is SupportMode.STANCE and part:
            return tasks.rolling_task(name, frame, planned, support, gains.stance, weight)
        grasps = support.contact is not None and support.contact.kind is ContactKind.GRASP
        if support.mode is not SupportMode.SWING and (grasps or support.settling):
            # A hand turns in its grasp; what settles is on its way.
            if support.mode is SupportMode.LANDING and not grasps:
                planned = landing_reference(support, planned)
            # A hand that presses yields to what it presses on: stiff, it would take off some of the force.
            gain = gains.swing
            if name in self._wishes and grasps:
                gain = replace(gains.stance, stiffness=YIELDING * gains.stance.stiffness)
            return swing_task(name, frame, planned, gain, weight)
        if support.mode is SupportMode.STANCE:
            return tasks.stance_task(name, frame, support, gains.stance, weight)
        landing = support.mode is SupportMode.LANDING
        target = landing_reference(support, planned) if landing else lifted(planned, support)
        follow, point = 1.0 if landing else support.follow, name in self._points
        weight = self.settings.weights.flying
        return swing_task(name, frame, target, gains.swing, weight, follow, point=point)

    def _loaded(
        self, support: SupportState, contact: Contact, state: DynamicsState, reference: ReferenceSample,
        time: float, *, pressed: bool,
    ) -> LoadedContact:  # fmt: skip
        """A contact with the limits and the forces that are wanted of it at a time [s].

        What it is planned to carry counts where no other force is wished; ``pressed`` keeps it pressed from
        its landing until it is about to leave.
        """
        name, share = contact.effector, min(support.load_share, support.unload_share)
        geometry = edge_forces.on_bar(contact, self.geometry(contact), self.body, state.frames[name])
        cap = contact.normal_force_cap or self.settings.supports.default_cap * state.mass * GRAVITY
        cap *= support.load_share
        if support.unload_share < 1.0:
            cap = min(cap, support.unload_share * self._carried.get(support.effector, cap))
        basis = edge_forces.contact_force_basis(
            contact, geometry, state, sliding=support.settling,
            friction_share=self.settings.supports.friction_share, friction_model=self._friction_model,
        )  # fmt: skip
        if (upper := self._point_caps(support, contact, state, geometry, cap)) is not None:
            basis = replace(basis, upper=np.repeat(upper, len(basis.upper) // geometry.point_count))
        carries = pressed and support.planned and support.unload_share >= 1.0
        least = min(PRESSED * self.body.mass * GRAVITY, cap) if carries else 0.0
        wish = self._wishes.get(name)
        if wish is not None and time >= wish.start:
            return LoadedContact(basis, cap, share, wish.at(time), wish.weight, least)
        planned, weight = reference.wrenches.get(name), self.settings.weights.planned_force
        return LoadedContact(basis, cap, share, least=least, planned=planned, planned_weight=weight)

    def _point_caps(
        self, support: SupportState, contact: Contact, state: DynamicsState, geometry: ContactGeometry,
        cap: float,
    ) -> FloatArray | None:  # fmt: skip
        """(k,) largest value of the force variables of each point [N]; None without any."""
        upper = None
        if support.settling:
            upper = cap * self._low_shares(geometry, contact, state)
        elif self.settings.watch_toes and self._toes.get(support.effector):
            upper = cap * self._toe_shares(geometry, contact, state)
        if support.fades:
            fading = state.mass * GRAVITY * self._fading_shares(support, contact)
            upper = fading if upper is None else np.minimum(upper, fading)
        return upper

    @staticmethod
    def _low_shares(
        geometry: ContactGeometry, contact: Contact, state: DynamicsState, raised: float = RAISED
    ) -> FloatArray:
        """(k,) share of the load that each point may carry: those ``raised`` by a tilt [m] carry none."""
        patches = [(state.frames[segment_key(segment)], points) for segment, points in geometry.patches]
        places = ((frame.position + points @ frame.rotation.T) @ contact.normal for frame, points in patches)
        height = np.concatenate(list(places))
        return np.clip(2.0 - (height - height.min()) / raised, 0.0, 1.0)

    def _toe_shares(self, geometry: ContactGeometry, contact: Contact, state: DynamicsState) -> FloatArray:
        """(k,) shares of the load as of :meth:`_low_shares` of the tips of toes.

        Toes are light: those that bounce off as a foot lands would be thrown back by the torque for a load
        that they do not carry. What is behind their hinge, or next to it, keeps its share.
        """
        shares = self._low_shares(geometry, contact, state, RAISED_TOES)
        behind = len(geometry.patches[0][1]) if len(geometry.patches) > 1 else 0
        shares[:behind] = 1.0
        if contact.part is SolePart.TOES:
            along = self._along[_touching_points(contact)]
            shares[along <= along.min() + ROUNDING] = 1.0
        return shares

    def _fading_shares(self, support: SupportState, contact: Contact) -> FloatArray:
        """(k,) body weights that each point's variables may carry while the touching part changes."""
        along = self._along[_touching_points(contact)]
        shares = np.full(len(along), np.inf)
        for part, share in support.fades:
            if part is not SolePart.FULL:  # a heel is what lies behind the middle of its sole
                beyond = along >= 0 if part is SolePart.HEEL else along <= 0
                shares[beyond] = np.minimum(shares[beyond], share)
        return shares

    def _solve(self, problem: ControlProblem) -> tuple[QPSolution | None, str]:
        solution = self._solver.solve(problem.program)
        if solution.solved:
            return solution, ""
        relaxed = self._spare_solver.solve(problem.relaxed())
        if relaxed.solved:
            return relaxed, f"without joint bounds: {solution.status}"
        return None, f"previous torques: {solution.status}, then {relaxed.status}"


def _lies_flat(support: SupportState) -> bool:
    """Whether an effector carries with its whole sole."""
    part = None if support.contact is None else support.contact.part
    return support.mode is SupportMode.STANCE and part is SolePart.FULL


def _touching_points(contact: Contact) -> tuple[str, SolePart, bytes]:
    """What tells the points of contacts apart: a sole may hang over an edge at one place alone."""
    return contact.effector, contact.part, contact.points.tobytes()


def _free_arms(body: BodyModel, busy: set[str]) -> list[int]:
    """Joints of the arms of which no effector is in ``busy``."""
    taken = {body.effector(name).segment for name in busy}
    free = [
        limb for limb in body.limbs
        if limb.effector in HANDS and taken.isdisjoint(moving_segments(body, limb))
    ]  # fmt: skip
    return [body.joint_index(hinge.name) for limb in free for hinge in limb_hinges(body, limb)]


def _hanging_joints(body: BodyModel, effector: str) -> list[int]:
    toes = hanging_segment(body, body.effector(effector).segment)
    return [] if toes is None else [body.joint_index(hinge.name) for hinge in toes.hinges]
