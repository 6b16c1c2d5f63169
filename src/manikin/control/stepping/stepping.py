"""Balance recovery with steps: where there is room for a foot, and how it gets there."""

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact
from manikin.control.dynamics import DynamicsState
from manikin.control.recovery.recovery_controller import BalanceRecovery, RecoveryOutput
from manikin.control.recovery.standing import FeltPush, Standing, SupportArea, sole_at
from manikin.control.recovery.strategy import Strategy, capture_point
from manikin.control.reference import EffectorReference
from manikin.control.stepping.step_placement import StepGoal, StepSettings, capture_after, step_goals
from manikin.errors import ContactError
from manikin.kinematics import Placement, PostureProblem, com_target, generate_posture, touching_pairs
from manikin.numerics.signals import least_jerk
from manikin.numerics.spatial import GRAVITY, FloatArray
from manikin.scene import Proximity, Scene

PRESSING = 0.15
"""Speed with which a foot that has come to its goal without touching goes on down [m/s]."""


class SwingFoot:
    """A foot on its way; its goal can be moved while it flies.

    Attributes:
        foot: Effector.
        rotation: (3, 3) sole to world, kept all the way.
        start: Time of the lift-off [s].
        duration: Until the landing [s].
        goal: (3,) of the middle of the sole on landing [m].
        clearance: Height half way [m].
    """

    def __init__(
        self, foot: str, rotation: FloatArray, position: FloatArray, goal: FloatArray, start: float,
        duration: float, clearance: float,
    ) -> None:  # fmt: skip
        """Lift a foot off at a position (3,) [m]."""
        self.foot, self.rotation, self.goal = foot, rotation, goal.copy()
        self.start, self.duration, self.clearance = start, duration, clearance
        self._time, self._ground = start, float(position[2])
        # Position, velocity and acceleration along the ground at that time.
        self._level = np.array([position[:2], np.zeros(2), np.zeros(2)])

    def share(self, time: float) -> float:
        """Share of the way in time, in [0, 1]."""
        return float(np.clip((time - self.start) / self.duration, 0.0, 1.0))

    def sample(self, time: float) -> EffectorReference:
        """Go on to a time [s], not before the last one, and return where the foot should be."""
        remaining = self.start + self.duration - self._time
        self._level = _ahead(self._level, self.goal[:2], remaining, time - self._time)
        self._time = time
        height, climb, lift = self._height(time)
        twist, acceleration = np.zeros(6), np.zeros(6)
        twist[:3], acceleration[:3] = [*self._level[1], climb], [*self._level[2], lift]
        return EffectorReference(self.rotation, np.array([*self._level[0], height]), twist, acceleration)

    def _height(self, time: float) -> tuple[float, float, float]:
        """Height [m] and its two derivatives: up and down with a level start, end and top."""
        end, x = self.start + self.duration, self.share(time)
        if time >= end:
            return self.goal[2] - PRESSING * (time - end), -PRESSING, 0.0
        bump, slope = 16.0 * x**2 * (1.0 - x) ** 2, 32.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        bend = 32.0 * (1.0 - 6.0 * x + 6.0 * x**2)
        rise = self.goal[2] - self._ground
        ramp, ramp_slope, ramp_bend = least_jerk(x)
        return (
            self._ground + self.clearance * bump + rise * ramp,
            (self.clearance * slope + rise * ramp_slope) / self.duration,
            (self.clearance * bend + rise * ramp_bend) / self.duration**2,
        )


def _ahead(state: FloatArray, goal: FloatArray, remaining: float, time: float) -> FloatArray:
    """(3, 2) position, velocity, acceleration after a time [s] on the quintic to rest at a goal (2,)."""
    if remaining <= time + 1e-9:
        return np.array([goal, np.zeros(2), np.zeros(2)])
    (position, velocity, acceleration), t, x = state, remaining, time
    missing = goal - position - velocity * t - 0.5 * acceleration * t**2
    known = np.array([missing, -velocity - acceleration * t, -acceleration])
    powers = np.array([[t**3, t**4, t**5], [3 * t**2, 4 * t**3, 5 * t**4], [6 * t, 12 * t**2, 20 * t**3]])
    third, fourth, fifth = np.linalg.solve(powers, known)
    return np.array([
        position + velocity * x + 0.5 * acceleration * x**2 + third * x**3 + fourth * x**4 + fifth * x**5,
        velocity + acceleration * x + 3 * third * x**2 + 4 * fourth * x**3 + 5 * fifth * x**4,
        acceleration + 6 * third * x + 12 * fourth * x**2 + 20 * fifth * x**3,
    ])  # fmt: skip


LEVEL = 0.003
"""Soles of a new stance may lie at heights that differ by this [m]; a step onto another level is none."""

ABOVE = 0.03
"""Height over a sole at which its place is looked at for what stands there [m]."""

TRIED = 40
"""Places that are examined before a step is given up."""


class StepCheck:
    """Looks for places of a scene where a foot can be put down."""

    def __init__(self, body: BodyModel, scene: Scene, friction: float) -> None:
        """Measure one body in one scene."""
        self._body, self._scene, self._friction = body, scene, friction
        self._home = body.standing_posture()
        self.refusal = ""

    @cached_property
    def _proximity(self) -> Proximity:
        return Proximity(self._body, self._scene, self_collision=False)

    def first(
        self, goals: Iterable[StepGoal], soles: tuple[Contact, Contact], q: FloatArray, clearance: float
    ) -> StepGoal | None:
        """First goal at which the foot lies on a surface and the body, there and half way, in nothing.

        Soles and configuration (nq,) are those before the step; half way the foot has a clearance [m].
        """
        self.refusal = "no step can be reached in time"
        for goal in itertools.islice(goals, TRIED):
            moved = sole_at(self._body, goal.foot, goal.rotation, goal.position, self._friction)
            stays, before = soles if soles[1].effector == goal.foot else soles[::-1]
            if not self.free(moved):
                self.refusal = f"no room for the {goal.foot.replace('_', ' ')}"
                continue
            half = 0.5 * (before.position + goal.position) + np.array([0.0, 0.0, clearance])
            if self._passes(stays, goal, half, q) and self._stands((stays, moved), q):
                self.refusal = ""
                return goal
            self.refusal = f"something is in the way of the {goal.foot.replace('_', ' ')}"
        return None

    def free(self, contact: Contact) -> bool:
        """Whether a sole would lie on a surface with all its corners, and nothing stands on that place."""
        try:
            self._scene.supporting_surface(contact, LEVEL)
        except ContactError:
            return False
        corners = contact.points_in_world
        around = np.concatenate((corners, 0.5 * (corners + np.roll(corners, 1, axis=0)), [contact.position]))
        return all(self._scene.nearest(point)[1] > ABOVE - LEVEL for point in around + ABOVE * contact.normal)

    def standing(self, soles: tuple[Contact, ...], q: FloatArray) -> Standing:
        """Posture on given soles with the centre of mass over their middle, near a configuration (nq,)."""
        q = generate_posture(self._problem(soles, q), q).q
        return Standing(soles, SupportArea.of(soles), q[7:].copy(), Configuration(self._body, q).com.copy())

    def _problem(self, soles: tuple[Contact, ...], q: FloatArray) -> PostureProblem:
        reference, com = np.concatenate((q[:7], self._home[7:])), com_target(*SupportArea.of(soles).centre)
        return PostureProblem(self._body, soles, com=com, reference=reference)

    def _stands(self, soles: tuple[Contact, ...], q: FloatArray) -> bool:
        result = generate_posture(self._problem(soles, q), q)
        return result.succeeded and self._clear(result.q, soles)

    def _passes(self, stays: Contact, goal: StepGoal, half: FloatArray, q: FloatArray) -> bool:
        """Whether the body is free with its foot half way."""
        placements, com = {goal.foot: Placement(half, goal.rotation)}, 0.5 * (stays.position + half)[:2]
        problem = PostureProblem(
            self._body, (stays,), placements=placements, com=com_target(*com), com_weight=1.0, reference=q
        )
        result = generate_posture(problem, q)
        return result.succeeded and self._clear(result.q, (stays,))

    def _clear(self, q: FloatArray, soles: tuple[Contact, ...]) -> bool:
        grounds = ((item.effector, self._scene.supporting_surface(item, LEVEL).obstacles) for item in soles)
        ignored = touching_pairs(self._body, [(foot, name) for foot, names in grounds for name in names])
        return self._proximity.minimum(q, ignored).distance > 0.0


LANDED_FROM = 0.5
"""A touch before this share of the way in time is that of the lift-off."""

LOOK_AGAIN = 0.05
"""Where no step was found the next one is sought after this time [s]."""


@dataclass(frozen=True, eq=False)
class StepTaken:
    """A step of the recovery.

    Attributes:
        foot: Effector.
        lifted: Time of the lift-off [s].
        landed: Time of the landing [s].
        start: (3,) place it left [m].
        goal: (3,) place that was aimed at in the end [m].
        position: (3,) place it came to [m].
    """

    foot: str
    lifted: float
    landed: float
    start: FloatArray
    goal: FloatArray
    position: FloatArray

    def summary(self) -> dict[str, Any]:
        """The step as JSON."""
        return {
            "foot": self.foot, "lifted_s": self.lifted, "landed_s": self.landed,
            "length_m": float(np.linalg.norm(self.position - self.start)),
            "from_m": self.start.tolist(), "goal_m": self.goal.tolist(), "to_m": self.position.tolist(),
        }  # fmt: skip


class SteppingRecovery:
    """Keeps the balance on the ground there is, and steps where that cannot be enough."""

    def __init__(
        self, body: BodyModel, balance: BalanceRecovery, scene: Scene, settings: StepSettings | None = None
    ) -> None:
        """Bind to a controller of the balance on given feet and a scene in which feet can be put down."""
        self.body, self.balance = body, balance
        self.settings = settings or StepSettings()
        self.check = StepCheck(body, scene, balance.friction)
        self.steps: list[StepTaken] = []
        self.refused = ""
        self._home = balance.standing
        self._frequency = float(np.sqrt(GRAVITY / self._home.height))
        self._swing: SwingFoot | None = None
        self._from: Contact | None = None
        self._look_again = -np.inf

    def step(
        self, time: float, q: FloatArray, v: FloatArray, push: FeltPush | None, *, reacting: bool,
        touching: Mapping[str, bool],
    ) -> RecoveryOutput:  # fmt: skip
        """Decide the joint torques of the next period; see :meth:`BalanceRecovery.step`.

        Args:
            time: Of the run [s].
            touching: Whether each foot touches the ground.
        """
        swing = self._swing
        if swing is not None and touching.get(swing.foot, False) and swing.share(time) > LANDED_FROM:
            self._land(time, q, swing)
            swing = None
        if swing is None:
            output = self.balance.step(q, v, push, reacting=reacting)
            if output.strategy not in (Strategy.STIFF, Strategy.STEP) and self._must_step(time, output.state):
                self._lift(time, output.state)
            return output
        output = self.balance.step(q, v, push, reacting=reacting, swing=(swing.foot, swing.sample(time)))
        self._aim(time, output.state, swing)
        return output

    def _must_step(self, time: float, state: DynamicsState) -> bool:
        standing = self.balance.standing
        if len(self.steps) >= self.settings.most or len(standing.soles) != 2 or time < self._look_again:
            return False
        room = float(standing.area.inside(self._capture(state)))
        return room < (self.settings.again if self.steps else -self.settings.beyond)

    def _capture(self, state: DynamicsState) -> FloatArray:
        return capture_point(state.com, state.momentum[:3] / state.mass, self._home.height)

    def _lift(self, time: float, state: DynamicsState) -> None:
        """Begin the first step that the scene allows."""
        soles = {contact.effector: contact for contact in self.balance.standing.soles}
        left, right = (soles[name] for name in self.balance.groups.feet)
        left_over = self.settings.most - len(self.steps)
        goals = step_goals((left, right), self._capture(state), self._frequency, self.settings, left_over)
        goal = self.check.first(goals, (left, right), state.q, self.settings.clearance)
        if goal is None:
            self.refused = self.refused or self.check.refusal
            self._look_again = time + LOOK_AGAIN
            return
        self.refused = ""
        self._from = soles[goal.foot]
        stays = right if goal.foot == left.effector else left
        over = np.array([*stays.position[:2], self._home.com[2]])  # the centre of mass stays as high
        self.balance.stand(Standing((stays,), SupportArea.of([stays]), self._home.posture, over))
        start, rise = self._from.position, self.settings.clearance
        self._swing = SwingFoot(goal.foot, goal.rotation, start, goal.position, time, goal.duration, rise)
        self._goal = goal

    def _aim(self, time: float, state: DynamicsState, swing: SwingFoot) -> None:
        """Follow the capture point with the goal while there is time, where the foot has room."""
        remaining, standing = swing.start + swing.duration - time, self.balance.standing
        if remaining < self.settings.aim_until:
            return
        capture, inset = self._capture(state), self.settings.inset
        landing = capture_after(capture, standing.area, self._frequency, remaining, inset)
        goal = np.array([*(self._goal.position[:2] + landing - self._goal.capture), self._goal.position[2]])
        moved = sole_at(self.body, swing.foot, swing.rotation, goal, self.balance.friction)
        near = np.linalg.norm(goal - standing.soles[0].position) <= self.settings.reach
        if near and self.check.free(moved):
            swing.goal = goal

    def _land(self, time: float, q: FloatArray, swing: SwingFoot) -> None:
        """Both feet carry from now on, where they are."""
        assert self._from is not None
        stays = self.balance.standing.soles[0]
        _, position = Configuration(self.body, q).effector_placement(swing.foot)
        middle = np.array([*position[:2], stays.position[2]])
        landed = sole_at(self.body, swing.foot, swing.rotation, middle, self.balance.friction)
        start, goal = self._from.position, swing.goal.copy()
        self.steps.append(StepTaken(swing.foot, swing.start, time, start, goal, middle))
        order = self.balance.groups.feet.index
        soles = tuple(sorted((stays, landed), key=lambda contact: order(contact.effector)))
        self.balance.stand(self.check.standing(soles, q))
        self._swing = None
