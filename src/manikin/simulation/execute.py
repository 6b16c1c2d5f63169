"""Execute a planned motion: the controller drives the body in the physics engine."""

import math
import time as clock
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import end_segments, with_round_tips
from manikin.contact import ContactKind, ContactSchedule
from manikin.control import Controller, ControlOutput, ControlSettings, ForceWish
from manikin.control.supports import SupportInterval, support_intervals
from manikin.errors import InputError
from manikin.kinematics import touching_pairs
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.scene import Proximity, Scene
from manikin.simulation.compile import PhysicsOptions, compile_model, is_narrow, lacking_inertia
from manikin.simulation.execution import Execution, push_outcome
from manikin.simulation.push_force import Push
from manikin.simulation.recorder import ROUNDING, SWITCHING, Recorder
from manikin.simulation.uncertainty import TrueWorld
from manikin.simulation.world import Grip, World

JOINT_DAMPING = 0.1
"""Passive damping of every joint in the default physics [N.m.s/rad]. Relaxed human joints have about 0.1 to
2; the engine's contact solver does not see damping, so that a light segment under load (toes: 1.6e-4 kg.m^2)
sinks and chatters where damping times time step exceeds its inertia. The controller overcomes the damping."""

LEAST_INERTIA = 1.4e-5
"""Least inertia of what a hinge moves in the default physics, over the body's mass and the squared height of
its centre of mass standing: 1e-3 kg.m^2 for a man, which toes alone lack (1.6e-4). They chattered where a
heel rose under load, at 75 rad/s and 10 mm into the floor. The controller knows of it only where it watches
toes; our choice."""

CONTACT_TIME = 3e-3
"""Time constant of the contacts in the default physics [s]: a stiff floor, three time steps. Halves sinking
and creeping of loaded feet against the engine's usual 5 ms or more."""

GRASPING = 0.4
"""Time before and after a grasp in which the hand may touch what it holds on to [s]."""

FALL_DISTANCE = 0.3
"""A body whose CoM is this far from its plan has fallen [m]."""

SETTLING = 0.2
"""Time to stand in the first posture before the motion begins, unrecorded [s]; the feet sink in by the
fraction of a millimetre that the contact needs to carry."""

SUNK = 2e-4
"""Depth at which what carries a body begins that is at speed and cannot settle [m]: of contacts that do not
touch, the engine knows nothing in its first step, and a foot is pushed down at 1 m/s by the torques of its
load."""

_AT_REST = 1e-2
"""A motion whose first, or last, speeds are smaller than this begins, or ends, at rest [m/s, rad/s]."""


@dataclass(frozen=True, eq=False)
class _Hold:
    """One planned support with the obstacles under it, and the segments that may lie on them."""

    lying: tuple[str, ...]
    interval: SupportInterval
    obstacles: tuple[str, ...]


def body_physics(body: BodyModel) -> PhysicsOptions:
    """Physics of every simulation of a body: stiff contacts, passive damping, and a least inertia."""
    height = float(Configuration(body).com[2])
    return PhysicsOptions(
        joint_damping=JOINT_DAMPING, least_inertia=LEAST_INERTIA * body.mass * height**2,
        contact_time_constant=CONTACT_TIME,
    )  # fmt: skip


def default_physics(body: BodyModel, schedule: ContactSchedule) -> PhysicsOptions:
    """Physics of an execution: :func:`body_physics` with the friction of the planned contacts.

    Each segment that makes contact has the least friction of its own contacts, everything else the least of
    all: feet do not slip because a seat is smooth. One that slides to its place has that friction alone.
    """
    contacts = [c for phase in schedule.sequence for c in phase.stance if c.kind is not ContactKind.GRASP]
    sliding = {body.effector(c.effector).segment: c.friction for c in contacts if c.settle > 0.0}
    options = replace(body_physics(body), segment_friction=tuple(sorted(sliding.items())))
    firm: dict[str, float] = {}
    for contact in contacts:
        if contact.settle == 0.0:
            for segment in end_segments(body, contact.effector):
                firm[segment] = min(firm.get(segment, np.inf), contact.friction)
    if not firm:
        return options
    least = min(firm.values())
    rougher = tuple(sorted((name, value) for name, value in firm.items() if value > least))
    return replace(options, friction=least, contact_friction=rougher)


def execute(
    body: BodyModel, scene: Scene, motion: Motion, schedule: ContactSchedule, *,
    settings: ControlSettings | None = None, physics: PhysicsOptions | None = None, hold: float = 1.0,
    pushes: Sequence[Push] = (), padded: Sequence[str] = (), wishes: Sequence[ForceWish] = (),
    truth: TrueWorld | None = None, progress: Callable[[float], None] | None = None,
) -> Execution:  # fmt: skip
    """Execute a planned motion and stand for a while after its end.

    Args:
        motion: Planned motion.
        settings: Settings of the controller; the defaults when omitted.
        physics: Settings of the engine; :func:`default_physics` when omitted.
        hold: Time to stand at the end [s]. With none, a motion that ends at speed lacks its last step.
        pushes: Forces that disturb the execution, in real time, from the motion's first sample on its own;
            from then on a touch of the body with itself is no failure.
        padded: Obstacles that any part of the body may lean on, such as a backrest.
        wishes: Forces that effectors in contact should feel.
        truth: The world, where it is not as body and scene say, which are what control believes; its pushes
            come beside those that are given.
        progress: Called with the share done, in [0, 1], after every control step.

    Returns:
        The outcome; a fall, a divergence or an unplanned touch is a result, not an error.

    Raises:
        InputError: If the control period is no multiple of the engine's time step, or the body another one.
        ContactError: If a support does not lie on a surface of the scene.
    """
    finite_number(hold, "hold [s]", at_least=0.0)
    job = _Run(body, scene, motion, schedule, settings, physics, pushes, padded, wishes, truth)
    return job.run(hold, progress)


class _Run:
    """One execution, from its set-up to its report."""

    def __init__(
        self, body: BodyModel, scene: Scene, motion: Motion, schedule: ContactSchedule,
        settings: ControlSettings | None, physics: PhysicsOptions | None, pushes: Sequence[Push],
        padded: Sequence[str], wishes: Sequence[ForceWish], truth: TrueWorld | None,
    ) -> None:  # fmt: skip
        self.body, self.scene, self.plan, self.schedule, self.truth = body, scene, motion, schedule, truth
        settings = settings or ControlSettings()
        physics = physics or replace(default_physics(body, schedule), crossed=_crossed(scene, schedule))
        self.period = settings.period
        self.substeps, step = round(self.period / physics.timestep), physics.timestep
        if self.substeps < 1 or abs(self.substeps * step - self.period) > 1e-9:
            told = f"control period is {self.period:g} s and physics timestep {step:g} s"
            raise InputError(f"{told}; valid: a whole multiple")
        damping = np.full(body.nv - 6, physics.joint_damping)
        added = lacking_inertia(body, physics.least_inertia) if settings.watch_toes else {}
        inertia = np.array([added.get(name, 0.0) for name in body.joint_names])
        self.controller = Controller(
            body, motion, schedule, settings, joint_damping=damping, joint_inertia=inertia, wishes=wishes
        )
        self.holds: list[_Hold] = []
        for effector in schedule.sequence.effectors:
            lying = tuple(sorted({segment for segment, _ in touching_pairs(body, [(effector, "")])}))
            for interval in support_intervals(schedule, effector, SWITCHING):
                self.holds.append(_Hold(lying, interval, scene.touched_obstacles(interval.contact)))
        every = (contact for phase in schedule.sequence for contact in phase.stance)
        points = sorted({contact.effector for contact in every if contact.kind is ContactKind.POINT})
        self.pushes, true = tuple(pushes), (body, scene, physics)
        if truth is not None:
            self.pushes += truth.pushes
            true = truth.body, truth.scene, physics.with_friction(truth.friction)
        self.world = World(compile_model(with_round_tips(true[0], points), *true[1:]), padded)
        for push in self.pushes:
            self.world.apply_push(push)
        delay = 0 if truth is None else round(truth.delay / step)
        self._commands = deque[FloatArray](maxlen=delay + 1)
        self._felt: FloatArray | None = None
        strength = np.maximum(body.torque_upper, -body.torque_lower)
        self._strength = np.where(np.isfinite(strength), strength, 0.0)
        self._noise = np.random.default_rng(0 if truth is None else truth.seed)
        self._segments = {name: end_segments(body, name) for name in schedule.sequence.effectors}
        self.recorder = Recorder(schedule, self._segments)
        self.failure, self.failure_time = "", None
        self._leaning = [(tuple(segment.name for segment in body.segments), name) for name in padded]
        self._planned_now: tuple[int, ...] | None = None
        self._expected = [_expected(hold.interval) for hold in self.holds]
        every = (hold.interval for hold in self.holds)
        self._grasps = [item for item in every if item.contact.kind is ContactKind.GRASP]
        self._leaving = set[str]()
        self._hand_mass = cache(self.world.least_mass)

    def run(self, hold: float, progress: Callable[[float], None] | None) -> Execution:
        began, control, start = clock.perf_counter(), 0.0, float(self.plan.time[0])
        # None when the motion begins at speed.
        at_rest = float(np.abs(self.plan.v[0]).max()) < _AT_REST
        settle = round(SETTLING / self.period) if at_rest else 0
        posture = self._first_posture() if at_rest else self._sunk(self._first_posture())
        self.world.reset(posture, self.plan.v[0], start - settle * self.period)
        count = round((self.plan.duration + hold) / self.period) + 1
        if hold == 0.0 and np.abs(self.plan.v[-1]).max() >= _AT_REST:
            count = max(count - 1, 1)  # At its end, a motion that ends at speed would be stopped dead.
        number = -settle
        while number < count + round(self.controller.clock.waited / self.period):
            time = start + number * self.period
            plan_time = self.controller.clock.at(time)
            self._switch(plan_time)
            before = clock.perf_counter()
            output = self.controller.step(time, *self._told(), self._touching(plan_time), self._felt)
            control += clock.perf_counter() - before
            if number == 0:
                self.world.forget()
            self._advance(output.tau, self.substeps)
            steps = self.world.take()
            if number >= 0:
                self.recorder.record(output, steps)
                if self._failed(output):
                    break
            number += 1
            if number > 0 and progress is not None:
                progress(min(number / count, 1.0))
        return self._report(clock.perf_counter() - began, control)

    def _first_posture(self) -> FloatArray:
        """(nq,) true posture at the beginning, as far above the true scene as planned above the other."""
        planned, truth = self.plan.q[0], self.truth
        if truth is None:
            return planned
        q = np.array(planned)
        q[7:] = np.clip(q[7:] + truth.joints, self.body.lower, self.body.upper)
        near, there = (
            Proximity(body, scene, self_collision=False).minimum(posture).distance
            for body, scene, posture in ((self.body, self.scene, planned), (truth.body, truth.scene, q))
        )
        q[2] += max(near - there, 0.0) if np.isfinite(near) else 0.0
        return q

    def _sunk(self, q: FloatArray) -> FloatArray:
        """(nq,) posture moved along the mean normal of what carries it first, by :data:`SUNK`."""
        held = [item for item in self.schedule.sequence[0].stance if item.kind is not ContactKind.GRASP]
        if not held:
            return q
        moved = np.array(q)
        moved[:3] -= SUNK * np.mean([item.normal for item in held], axis=0)
        return moved

    def _told(self) -> tuple[FloatArray, FloatArray]:
        """Configuration and velocity as control is told them."""
        q, v = self.world.q, self.world.v
        return (q, v) if self.truth is None else self.truth.noise.told(self.body, q, v, self._noise)

    def _advance(self, tau: FloatArray, steps: int) -> None:
        """Command torques for a number of engine steps; they act after the true delay, and are felt."""
        if self.truth is None:
            self.world.advance(tau, steps)
            return
        acted = np.zeros(len(tau))
        for _ in range(steps):
            self._commands.append(tau)
            self.world.advance(self._commands[0], 1)
            acted += self._commands[0]
        noise = self.truth.torque_noise * self._strength * self._noise.standard_normal(len(tau))
        self._felt = acted / steps + noise

    def _switch(self, time: float) -> None:
        """Set the touches planned at a time of the plan, and hold on to grasps."""
        self.world.carry(self.controller.carried_at(time))
        now = tuple(k for k, (start, end) in enumerate(self._expected) if start <= time <= end)
        if now != self._planned_now:
            planned = [(self.holds[i].lying, name) for i in now for name in self.holds[i].obstacles]
            self.world.plan_touches(planned, self._leaning)
            self._planned_now = now
        if not (grasps := self._grasps):
            return
        held = {item.contact.effector: item.contact for item in grasps if item.start <= time < item.end}
        left = {item.contact.effector for item in grasps if item.end <= time < item.end + GRASPING}
        leaving = left - held.keys()
        for effector in {item.contact.effector for item in grasps} - held.keys():
            self.world.release(effector)
        for effector in leaving:  # its fingers are still about what it held
            self.world.collide(effector, False)
        for effector in self._leaving - leaving - held.keys():
            self.world.collide(effector, True)
        self._leaving = leaving
        for contact in held.values():
            mass = self._hand_mass(contact.effector)
            grip = Grip.of_mass(contact.effector, contact.position, contact.max_force, mass, CONTACT_TIME)
            self.world.grip(grip)
        for item in grasps:
            if item.start - GRASPING <= time < item.start and item.contact.effector not in held:
                self.world.collide(item.contact.effector, False)

    def _touching(self, time: float) -> dict[str, bool]:
        """Whether each effector touches the support it holds or is about to make."""
        felt: dict[str, bool] = {}
        for number in self._planned_now or ():
            item, contact = self.holds[number], self.holds[number].interval.contact
            if contact.kind is not ContactKind.GRASP and time < item.interval.end - 1e-9:
                segments = self._segments[contact.effector]
                felt[contact.effector] = any(self.world.touching(segments, name) for name in item.obstacles)
        return felt

    def _failed(self, output: ControlOutput) -> bool:
        time, state = self.world.time, output.state
        offset = math.dist(state.com, output.reference.com)
        if self.world.divergence or not math.isfinite(offset):
            self.failure = f"the simulation diverged ({self.world.divergence}) at {time:.3f} s"
        elif offset > FALL_DISTANCE:
            self.failure = f"fell: the CoM is {offset:.2f} m from its plan at {time:.3f} s"
        self.failure_time = time if self.failure else None
        return bool(self.failure)

    def _report(self, wall: float, control: float) -> Execution:
        recorder, world, fell = self.recorder, self.world, self.failure.startswith("fell")
        shift = self.controller.shift
        moved = 0.0 if shift is None else math.hypot(shift.body[0], shift.body[1])
        # An arm that swings in a recovery may brush the body.
        pushed = min((push.start for push in self.pushes), default=np.inf)
        segments = {segment.name for segment in self.body.segments}
        touches = tuple(t for t in world.touches if t.time < pushed or t.other not in segments)
        if not self.failure and touches:
            self.failure, self.failure_time = f"unplanned touch: {touches[0]}", touches[0].time
        balance = recorder.margins(self.body.mass, world)
        executed = recorder.motion(self.body.joint_names, balance.margin, world)
        com = recorder.com_errors()
        bound = com[: max(recorder.bound_samples(), 1)]
        peak = np.abs(executed.tau[:, 6:]).max(axis=0)
        error, effector, error_time = recorder.worst_effector()
        fallbacks = ((s.time, s.output.fallback) for s in recorder.samples if s.output.fallback)
        return Execution(
            motion=executed, fell=fell, failure=self.failure, failure_time_s=self.failure_time,
            com_rms_error_m=float(np.sqrt(np.mean(bound**2))), com_max_error_m=float(bound.max()),
            max_foot_error_m=error, worst_effector=effector, worst_effector_time_s=error_time,
            final_com_error_m=float(com[-1]), min_margin=float(executed.margin.min()),
            min_force_at_com_N=balance.min_force, min_zmp_distance_m=balance.min_zmp_distance,
            max_penetration_m=world.penetration, max_padding_compression_m=world.padding_compression,
            peak_torque_Nm=dict(zip(self.body.joint_names, peak.tolist(), strict=True)),
            max_limit_use=float(self.body.torque_share(executed.tau[:, 6:]).max(initial=0.0)),
            realtime_factor=len(recorder.samples) * self.period / wall, wall_s=wall,
            control_ms=1e3 * control / len(recorder.samples), touches=world.touches, counted_touches=touches,
            fallbacks=tuple(fallbacks), max_slip_m=recorder.max_slip(), friction=recorder.friction_use(),
            push=push_outcome(self.pushes, recorder, self.failure), moved_m=moved,
            schedule=recorder.delayed_schedule(), final_foot_error_m=recorder.last_effector_error(),
        )  # fmt: skip


def _crossed(scene: Scene, schedule: ContactSchedule) -> tuple[str, ...]:
    """Names of narrow boxes on which soles stand."""
    soles = {c for phase in schedule.sequence for c in phase.stance if c.kind is ContactKind.SOLE}
    touched = {name for contact in soles for name in scene.touched_obstacles(contact)}
    return tuple(item.name for item in scene if item.name in touched and is_narrow(item))


def _expected(interval: SupportInterval) -> tuple[float, float]:
    """When a touch is planned [s]; a hand may brush along what it is about to grasp or has let go."""
    if interval.contact.kind is not ContactKind.GRASP:
        return interval.early - ROUNDING, interval.late + ROUNDING
    return interval.start - GRASPING, interval.end + GRASPING
