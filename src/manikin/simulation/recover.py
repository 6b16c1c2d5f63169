"""Push a standing body in the physics engine and let it keep its balance."""

import math
import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import end_segments
from manikin.control.dynamics import DynamicsState
from manikin.control.recovery import BalanceRecovery, FeltPush, RecoverySettings, joint_groups
from manikin.control.stepping import SteppingRecovery, StepSettings
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.scene import Scene
from manikin.simulation.compile import compile_model
from manikin.simulation.engine import PhysicsOptions, quiet_engine
from manikin.simulation.execute import CONTACT_TIME, JOINT_DAMPING
from manikin.simulation.recovery import Recovery, at_rest, judge, trunk_lean
from manikin.simulation.recovery_record import RecoveryRecorder
from manikin.simulation.world import Push, World

STANDING = 0.1
"""Time to stand before the run begins, unrecorded [s]; free feet sink in by a fraction of a millimetre."""

FALLEN = 0.6
"""A centre of mass lower than this share of its height in the posture has fallen."""

STRONGEST = 5000.0
"""Largest force of a push [N]: some seven body weights, and far beyond what can be held."""

UPRIGHT = 0.3
"""A posture whose trunk leans by more than this is not one to be pushed in [rad]."""


class Feet(StrEnum):
    """How the feet are on the ground."""

    HELD = "held"
    """Welded to it, as in the thesis: they never leave it ([Kudoh2002]_ 2.2)."""
    FREE = "free"
    """In unilateral contact with friction."""


@dataclass(frozen=True, eq=False)
class RecoveryTask:
    """A posture and what disturbs it.

    Attributes:
        pushes: In the run's time.
        feet: How they are on the ground.
        duration: Of the run [s].
        q: (nq,) the posture; the body's standing one when None.
        friction: Of the soles.
        support: Effectors of the feet that carry; both when None.
        steps: How many steps may be taken; feet that are held take none.
        until_at_rest: Once pushes and reaction delay are over, a body that has stood at rest for this time
            ends the run [s]; it saves most of the time where only the verdict is wanted. None for a run to
            its end, which alone shows all that follows, such as swung arms that come back.
    """

    pushes: tuple[Push, ...]
    feet: Feet = Feet.HELD
    duration: float = 3.5
    q: ArrayLike | None = None
    friction: float = 0.7
    support: tuple[str, ...] | None = None
    steps: int = 0
    until_at_rest: float | None = None


def push_near_com(
    body: BodyModel,
    force: ArrayLike,
    start: float,
    duration: float,
    *,
    frequency: float = 0.0,
    q: ArrayLike | None = None,
) -> Push:
    """Push that acts near the centre of mass ([Kudoh2002]_ 3.2).

    It acts on the trunk's segment at whose height the centre of mass is in the posture, at that point.

    Args:
        body: The body.
        force: (3,) in the world, at its largest [N].
        start: [s].
        duration: [s].
        frequency: Of the sine that begins with the push [Hz]; 0 for a constant force.
        q: (nq,) the posture; the body's standing one when omitted.

    Raises:
        InputError: If the force is not finite or beyond :data:`STRONGEST`, or a time is not usable.
    """
    strength = np.asarray(force, dtype=np.float64)
    if strength.shape != (3,) or not np.all(np.isfinite(strength)):
        raise InputError(f"push force is {strength.tolist()} N; valid: three finite numbers")
    if np.linalg.norm(strength) > STRONGEST:
        raise InputError(f"push force is {np.linalg.norm(strength):g} N; valid: at most {STRONGEST:g} N")
    begin = finite_number(start, "push start [s]", at_least=0.0)
    lasting = finite_number(duration, "push duration [s]", above=0.0)
    wave = finite_number(frequency, "push frequency [Hz]", at_least=0.0)
    state = Configuration(body, body.standing_posture() if q is None else q)
    segment = _segment_at(body, state)
    rotation, position = state.segment_placement(segment)
    return Push(segment, strength, begin, lasting, rotation.T @ (state.com - position), wave)


def _segment_at(body: BodyModel, state: Configuration) -> str:
    """Segment of the trunk whose centre is nearest to the centre of mass."""
    trunk = joint_groups(body).segments["trunk"]
    return min(
        trunk, key=lambda name: float(np.linalg.norm(state.point(name, body.segment(name).com) - state.com))
    )


def recover(
    body: BodyModel,
    task: RecoveryTask,
    settings: RecoverySettings | None = None,
    *,
    scene: Scene | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recovery:
    """Push a standing body and see whether it stays on its feet.

    Args:
        body: A body with two legs.
        task: Its posture and the pushes.
        settings: Of the controller; the defaults when omitted.
        scene: What is around it; a floor under its soles when omitted.
        progress: Called with the share done, in [0, 1].

    Returns:
        What happened; a fall is a result, not an error.

    Raises:
        InputError: If the body lies or leans, its soles are not level, or a number is not usable.
        BodyError: If it does not stand on two legs.
    """
    run = _Run(body, task, settings or RecoverySettings(), scene)
    with quiet_engine():
        return run.run(progress)


class _Run:
    """One recovery, from its setting up to its verdict."""

    def __init__(
        self, body: BodyModel, task: RecoveryTask, settings: RecoverySettings, scene: Scene | None
    ) -> None:
        self.body, self.task, self.settings = body, task, settings
        finite_number(task.duration, "duration [s]", above=0.0, at_most=60.0)
        if task.until_at_rest is not None:
            finite_number(task.until_at_rest, "until_at_rest [s]", above=0.0)
        self.q = np.array(body.standing_posture() if task.q is None else task.q, dtype=np.float64)
        physics = PhysicsOptions(
            friction=task.friction, joint_damping=JOINT_DAMPING, contact_time_constant=CONTACT_TIME
        )
        damping = np.full(body.nv - 6, JOINT_DAMPING)
        welded = task.feet is Feet.HELD
        if welded and task.steps:
            raise InputError(f"{task.steps} steps of held feet; valid: free feet, or no step")
        self.controller = BalanceRecovery(
            body, self.q, settings, support=task.support, friction=task.friction, joint_damping=damping,
        )  # fmt: skip
        _check_standing(self.controller, self.q)
        held = None
        if welded:
            held = {c.effector: (c.rotation_contact_to_world, c.position) for c in self.controller.soles}
        ground = scene or Scene([], floor_height=self.controller.area.height)
        self.world = World(compile_model(body, ground, physics, held))
        for push in task.pushes:
            self.world.apply_push(
                push.segment, push.force, push.start, push.duration, point=push.point,
                frequency=push.frequency,
            )  # fmt: skip
        self.substeps = max(1, round(settings.period / physics.timestep))
        feet = [name for foot in self.controller.groups.feet for name in end_segments(body, foot)]
        self.world.plan_touches([(feet, obstacle.name) for obstacle in ground])
        self.recorder = RecoveryRecorder(body, self.controller)
        self.grounds = tuple(ground.names)
        self.placed = Configuration(body)
        self.stepping = SteppingRecovery(
            body, self.controller, ground, replace(StepSettings(), most=task.steps)
        )  # fmt: skip
        ends = [push.start + max(push.duration, settings.delay) for push in task.pushes]
        self.rest_from = self.disturbed_until = max(ends, default=0.0)

    def run(self, progress: Callable[[float], None] | None) -> Recovery:
        began, control = clock.perf_counter(), 0.0
        period = self.substeps * self.world.model.options.timestep
        settle, count = round(STANDING / period), math.ceil(self.task.duration / period)
        self.world.reset(self.q, None, -settle * period)
        lowest = FALLEN * (self.controller.com[2] - self.controller.area.height)
        fallen = ""
        for number in range(-settle, count + 1):
            time = number * period
            before = clock.perf_counter()
            q, v = self.world.q, self.world.v
            output = self.stepping.step(
                time, q, v, self._felt(q, time), reacting=self._reacts(time), touching=self._touching()
            )
            control += clock.perf_counter() - before
            if number == 0:
                self.world.forget()
            self.world.advance(output.tau, 1)
            sensed = self.world.sense()
            self.world.advance(output.tau, self.substeps - 1)
            wrench, carried = self.world.mean_wrench(), self.world.carried()
            if number >= 0:
                self.recorder.add(time, output, sensed, wrench, carried, held=self.task.feet is Feet.HELD)
            fallen = self._fallen(output.state, lowest, time)
            if fallen or self._stands_for_good(output.state, time):
                break
            if progress is not None and number >= 0:
                progress(number / count)
        trace = self.recorder.trace(1e3 * control / (number + settle + 1))
        return judge(
            self.body, self.controller, trace, self.task.pushes, str(self.task.feet), fallen,
            self.world.touches, clock.perf_counter() - began, tuple(self.stepping.steps),
            self.stepping.refused,
        )  # fmt: skip

    def _touching(self) -> dict[str, bool]:
        """Whether each foot touches anything of the scene."""
        return {
            foot: any(self.world.touching(end_segments(self.body, foot), name) for name in self.grounds)
            for foot in self.controller.groups.feet
        }

    def _reacts(self, time: float) -> bool:
        """Not from the beginning of the first push until the delay is over."""
        start = min((push.start for push in self.task.pushes), default=np.inf)
        return not start - 1e-9 <= time < start + self.settings.delay - 1e-9

    def _felt(self, q: FloatArray, time: float) -> FeltPush:
        """What pushes now, as the skin feels it."""
        acting = [push for push in self.task.pushes if push.active(time)]
        felt = FeltPush.none(self.body.nv)
        if not acting:
            return felt
        state = self.placed.update(q)
        wrench, generalised = np.zeros(6), np.zeros(self.body.nv)
        for push in acting:
            offset = self.body.segment(push.segment).com if push.point is None else push.point
            force, point = push.at(time), state.point(push.segment, offset)
            wrench += np.concatenate((force, np.cross(point, force)))
            generalised += state.point_jacobian(push.segment, offset).T @ force
        return FeltPush(wrench, generalised)

    def _stands_for_good(self, state: DynamicsState, time: float) -> bool:
        """Whether the body has rested for as long as ends the run."""
        wanted = self.task.until_at_rest
        if wanted is None or time < self.disturbed_until:
            return False
        velocity = state.momentum[:3] / state.mass
        if not at_rest(self.placed, self.controller, state.q, state.com, velocity):
            self.rest_from = time + self.substeps * self.world.model.options.timestep
        return time - self.rest_from >= wanted - 1e-9

    def _fallen(self, state: DynamicsState, lowest: float, time: float) -> str:
        if self.world.divergence or not np.all(np.isfinite(state.com)):
            return f"the simulation diverged ({self.world.divergence}) at {time:.3f} s"
        if state.com[2] - self.controller.area.height < lowest:
            return f"fell: the centre of mass is {state.com[2]:.2f} m high at {time:.3f} s"
        return ""


def _check_standing(controller: BalanceRecovery, q: FloatArray) -> None:
    """Refuse a body that lies, leans or is about to fall over."""
    place = controller.com[:2]
    if controller.area.reach(place) >= 1.0:
        raise InputError(
            f"the body does not stand: its centre of mass is over {np.round(place, 3).tolist()}, "
            "outside its soles; valid: a posture that stands on both feet"
        )
    lean = trunk_lean(Configuration(controller.body, q), controller.groups)
    if lean > UPRIGHT:
        raise InputError(
            f"the body does not stand upright: its trunk leans by {math.degrees(lean):.0f} deg; "
            f"valid: at most {math.degrees(UPRIGHT):.0f} deg"
        )
