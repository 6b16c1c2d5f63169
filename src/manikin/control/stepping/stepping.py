"""Balance recovery that takes a step when standing does not do."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact
from manikin.control.balance_recovery.closed_loop import FeltPush
from manikin.control.balance_recovery.com_law import capture_point
from manikin.control.balance_recovery.recovery import BalanceRecovery, RecoveryOutput
from manikin.control.balance_recovery.standing import Standing, sole_at
from manikin.control.balance_recovery.strategy import Strategy
from manikin.control.dynamics import DynamicsState
from manikin.control.stepping.placement import (
    StepSettings,
    capture_after,
    step_goals,
)
from manikin.control.stepping.room import StepCheck
from manikin.control.stepping.swing_foot import SwingFoot
from manikin.scene import Scene
from manikin.spatial import GRAVITY, FloatArray

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
        """Bind to a controller of the balance.

        Args:
            body: The body.
            balance: What keeps the balance on given feet.
            scene: Where feet can be put down.
            settings: Limits of steps; the defaults when omitted.
        """
        self.body, self.balance = body, balance
        self.settings = settings or StepSettings()
        self.check = StepCheck(body, scene, balance.friction)
        self.steps: list[StepTaken] = []
        self.refused = ""
        self._home = balance.standing
        self._swing: SwingFoot | None = None
        self._from: Contact | None = None
        self._look_again = -np.inf

    def step(
        self,
        time: float,
        q: FloatArray,
        v: FloatArray,
        push: FeltPush | None,
        *,
        reacting: bool,
        touching: Mapping[str, bool],
    ) -> RecoveryOutput:
        """Decide the joint torques of the next period.

        Args:
            time: Of the run [s].
            q: (nq,) measured configuration.
            v: (nv,) measured velocity.
            push: What pushes the body and is felt.
            reacting: Whether the reaction delay is over.
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
        reference = swing.sample(time)
        output = self.balance.step(q, v, push, reacting=reacting, swing=(swing.foot, reference))
        self._aim(time, output.state, swing)
        return output

    def _must_step(self, time: float, state: DynamicsState) -> bool:
        if len(self.steps) >= self.settings.most or len(self.balance.soles) != 2 or time < self._look_again:
            return False
        room = float(self.balance.area.inside(self._capture(state)))
        return room < (self.settings.again if self.steps else -self.settings.beyond)

    def _capture(self, state: DynamicsState) -> FloatArray:
        velocity = state.momentum[:3] / state.mass
        return capture_point(state.com, velocity, self._home.height)

    @property
    def _frequency(self) -> float:
        return float(np.sqrt(GRAVITY / self._home.height))

    def _lift(self, time: float, state: DynamicsState) -> None:
        """Begin the first step that the scene allows."""
        soles = {contact.effector: contact for contact in self.balance.soles}
        left, right = (soles[name] for name in self.balance.groups.feet)
        left_over = self.settings.most - len(self.steps)
        goals = step_goals(
            (left, right), self._capture(state), self._frequency, self.settings, left_over
        )  # fmt: skip
        goal = self.check.first(goals, (left, right), state.q, self.settings.clearance)
        if goal is None:
            self.refused = self.refused or self.check.refusal
            self._look_again = time + LOOK_AGAIN
            return
        self.refused = ""
        self._from = soles[goal.foot]
        stays = right if goal.foot == left.effector else left
        self.balance.stand(
            Standing((stays,), self.balance.area.of([stays]), self._home.posture, self._over(stays))
        )
        self._swing = SwingFoot.begin(
            goal.foot, goal.rotation, self._from.position, goal.position, time, goal.duration,
            self.settings.clearance,
        )  # fmt: skip
        self._goal = goal

    def _over(self, stays: Contact) -> FloatArray:
        """(3,) home of the centre of mass over a foot, as high as before [m]."""
        return np.array([*stays.position[:2], self._home.com[2]])

    def _aim(self, time: float, state: DynamicsState, swing: SwingFoot) -> None:
        """Follow the capture point with the goal while there is time."""
        remaining = swing.start + swing.duration - time
        if remaining < self.settings.aim_until:
            return
        landing = capture_after(
            self._capture(state), self.balance.area, self._frequency, remaining, self.settings.inset
        )
        wanted = self._goal.position[:2] + landing - self._goal.capture
        self._move_goal(swing, wanted)

    def _move_goal(self, swing: SwingFoot, wanted: FloatArray) -> None:
        """Move the goal where the foot has room; elsewhere it stays as it is."""
        goal = np.array([*wanted, self._goal.position[2]])
        stays = self.balance.soles[0]
        if np.linalg.norm(goal - stays.position) <= self.settings.reach and self.check.free(
            sole_at(self.body, swing.foot, swing.rotation, goal, self.balance.friction)
        ):
            swing.goal = goal

    def _land(self, time: float, q: FloatArray, swing: SwingFoot) -> None:
        """Both feet carry from now on, where they are."""
        assert self._from is not None
        state = Configuration(self.body, q)
        stays = self.balance.soles[0]
        _, position = state.effector_placement(swing.foot)
        place = np.array([*position[:2], stays.position[2]])
        landed = sole_at(self.body, swing.foot, swing.rotation, place, self.balance.friction)
        self.steps.append(
            StepTaken(swing.foot, swing.start, time, self._from.position, swing.goal.copy(), place)
        )
        order = {name: number for number, name in enumerate(self.balance.groups.feet)}
        soles = tuple(sorted((stays, landed), key=lambda contact: order[contact.effector]))
        self.balance.stand(self.check.standing(soles, q))
        self._swing = None
