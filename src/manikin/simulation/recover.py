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
from manikin.control.recovery import BalanceRecovery, FeltPush, RecoverySettings
from manikin.control.stepping import SteppingRecovery, StepSettings
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.runtime.quiet_engine import quiet_engine
from manikin.scene import Scene
from manikin.simulation.compile import compile_model
from manikin.simulation.execute import JOINT_DAMPING, body_physics
from manikin.simulation.push_force import Push
from manikin.simulation.recovery import Recovery, at_rest, judge, trunk_lean
from manikin.simulation.recovery_record import RecoveryRecorder
from manikin.simulation.world import World

STANDING = 0.1
"""Time to stand before the run begins, unrecorded [s]; free feet sink in by a fraction of a millimetre."""

FALLEN = 0.6
"""Share of the height of the centre of mass in the posture below which the body has fallen [-]."""

UPRIGHT = 0.3
"""Largest lean of the trunk in a posture to be pushed in [rad]."""


class Feet(StrEnum):
    """How the feet are on the ground."""

    HELD = "held"
    """Welded to it, as in the thesis: they never leave it ([Kudoh2002]_ 2.2)."""
    FREE = "free"
    """In unilateral contact with friction."""


@dataclass(frozen=True, eq=False)
class RecoveryTask:
    """A posture and the pushes that disturb it.

    Attributes:
        pushes: Pushes in the run's time.
        feet: How the feet are on the ground.
        duration: Duration of the run [s].
        q: (nq,) the posture; the body's standing one when None.
        friction: Coulomb coefficient of the soles [-].
        support: Effectors of the feet that carry; both when None.
        steps: Largest number of steps; feet that are held take none.
        until_at_rest: Once pushes and reaction delay are over, a body that has stood at rest for this time
            ends the run [s]: enough for the verdict. None for a run to its end, with all that follows.
    """

    pushes: tuple[Push, ...]
    feet: Feet = Feet.HELD
    duration: float = 3.5
    q: ArrayLike | None = None
    friction: float = 0.7
    support: tuple[str, ...] | None = None
    steps: int = 0
    until_at_rest: float | None = None


def recover(
    body: BodyModel, task: RecoveryTask, settings: RecoverySettings | None = None, *,
    scene: Scene | None = None, progress: Callable[[float], None] | None = None,
) -> Recovery:  # fmt: skip
    """Push a standing body and see whether it stays on its feet.

    Args:
        body: A body with two legs.
        task: Its posture and the pushes.
        settings: Settings of the controller; the defaults when omitted.
        scene: Scene around the body; a floor under its soles when omitted.
        progress: Called with the share done, in [0, 1].

    Returns:
        The outcome; a fall is a result, not an error.

    Raises:
        InputError: If the body lies or leans, its soles are not level, or a number is not usable.
        BodyError: If it does not stand on two legs.
    """
    run = _RecoveryRun(body, task, settings or RecoverySettings(), scene)
    with quiet_engine():
        return run.run(progress)


class _RecoveryRun:
    """One recovery, from its set-up to its verdict."""

    def __init__(
        self, body: BodyModel, task: RecoveryTask, settings: RecoverySettings, scene: Scene | None
    ) -> None:
        self.body, self.task, self.settings = body, task, settings
        finite_number(task.duration, "duration [s]", above=0.0, at_most=60.0)
        if task.until_at_rest is not None:
            finite_number(task.until_at_rest, "until_at_rest [s]", above=0.0)
        self.q = np.array(body.standing_posture() if task.q is None else task.q, dtype=np.float64)
        physics = replace(body_physics(body), friction=task.friction)
        damping = np.full(body.nv - 6, JOINT_DAMPING)
        welded = task.feet is Feet.HELD
        if welded and task.steps:
            raise InputError(f"{task.steps} steps of held feet; valid: free feet, or no step")
        self.controller = BalanceRecovery(
            body, self.q, settings, support=task.support, friction=task.friction, joint_damping=damping,
        )  # fmt: skip
        _check_standing(self.controller, self.q)
        standing = self.controller.standing
        held = {c.effector: (c.rotation_contact_to_world, c.position) for c in standing.soles}
        ground = scene or Scene([], floor_height=standing.area.height)
        self.world = World(compile_model(body, ground, physics, held if welded else None))
        for push in task.pushes:
            self.world.apply_push(push)
        self.substeps = max(1, round(settings.period / physics.timestep))
        self.period = self.substeps * physics.timestep
        feet = [name for foot in self.controller.groups.feet for name in end_segments(body, foot)]
        self.world.plan_touches([(feet, obstacle.name) for obstacle in ground])
        self.recorder = RecoveryRecorder(body, self.controller)
        self.grounds = tuple(ground.names)
        self.placed = Configuration(body)
        self.stepping = SteppingRecovery(body, self.controller, ground, StepSettings(most=task.steps))
        ends = [push.start + max(push.duration, settings.delay) for push in task.pushes]
        self.rest_from = self.disturbed_until = max(ends, default=0.0)
        self.pushed_from = min((push.start for push in task.pushes), default=np.inf)

    def run(self, progress: Callable[[float], None] | None) -> Recovery:
        began, control, period = clock.perf_counter(), 0.0, self.period
        settle, count = round(STANDING / period), math.ceil(self.task.duration / period)
        self.world.reset(self.q, None, -settle * period)
        lowest, fallen = FALLEN * self.controller.standing.height, ""
        for number in range(-settle, count + 1):
            time = number * period
            before, q = clock.perf_counter(), self.world.q
            # Not from the beginning of the first push until the delay is over.
            waits = self.pushed_from - 1e-9 <= time < self.pushed_from + self.settings.delay - 1e-9
            output = self.stepping.step(
                time, q, self.world.v, self._felt(q, time), reacting=not waits, touching=self._touching()
            )
            control += clock.perf_counter() - before
            if number == 0:
                self.world.forget()
            self.world.advance(output.tau, 1)
            sensed = self.world.sense()
            self.world.advance(output.tau, self.substeps - 1)
            (wrench,), (carried,) = self.world.loads([self.world.take()])
            if number >= 0:
                self.recorder.add(time, output, sensed, wrench, carried, held=self.task.feet is Feet.HELD)
            fallen = self._fallen(output.state, lowest, time)
            if fallen or self._stands_for_good(output.state, time):
                break
            if progress is not None and number >= 0:
                progress(number / count)
        trace = self.recorder.trace(1e3 * control / (number + settle + 1))
        return judge(
            self.controller, trace, self.task.pushes, str(self.task.feet), fallen, self.world.touches,
            clock.perf_counter() - began, tuple(self.stepping.steps), self.stepping.refused,
        )  # fmt: skip

    def _touching(self) -> dict[str, bool]:
        """Whether each foot touches anything of the scene."""
        return {
            foot: any(self.world.touching(end_segments(self.body, foot), name) for name in self.grounds)
            for foot in self.controller.groups.feet
        }

    def _felt(self, q: FloatArray, time: float) -> FeltPush:
        """Wrench and generalised force of the pushes that act now, as the skin feels them."""
        acting = [push for push in self.task.pushes if push.active(time)]
        if not acting:
            return FeltPush.none(self.body.nv)
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
        if not at_rest(self.placed, self.controller, state.q, state.com, state.momentum[:3] / state.mass):
            self.rest_from = time + self.period
        return time - self.rest_from >= wanted - 1e-9

    def _fallen(self, state: DynamicsState, lowest: float, time: float) -> str:
        if self.world.divergence or not np.all(np.isfinite(state.com)):
            return f"the simulation diverged ({self.world.divergence}) at {time:.3f} s"
        if state.com[2] - self.controller.standing.area.height < lowest:
            return f"fell: the centre of mass is {state.com[2]:.2f} m high at {time:.3f} s"
        return ""


def _check_standing(controller: BalanceRecovery, q: FloatArray) -> None:
    """Refuse a body that lies, leans or is about to fall over."""
    standing = controller.standing
    if standing.area.reach(standing.com[:2]) >= 1.0:
        told = f"its centre of mass is over {np.round(standing.com[:2], 3).tolist()}, outside its soles"
        raise InputError(f"the body does not stand: {told}; valid: a posture that stands on both feet")
    lean = trunk_lean(Configuration(controller.body, q), controller.groups)
    if lean > UPRIGHT:
        own, most = math.degrees(lean), math.degrees(UPRIGHT)
        told = f"its trunk leans by {own:.0f} deg; valid: at most {most:.0f} deg"
        raise InputError(f"the body does not stand upright: {told}")
