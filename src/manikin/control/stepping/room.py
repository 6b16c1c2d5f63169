"""Whether the scene leaves room for a step, and the posture in which the body then stands."""

from collections.abc import Iterable
from functools import cached_property

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact
from manikin.control.balance_recovery.standing import Standing, sole_at
from manikin.control.balance_recovery.support_area import SupportArea
from manikin.control.stepping.placement import StepGoal
from manikin.errors import ContactError
from manikin.posture import Placement, PostureProblem, com_target, generate_posture, touching_pairs
from manikin.scene import Proximity, Scene
from manikin.spatial import FloatArray

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

        Args:
            goals: Best first.
            soles: Both feet before the step.
            q: (nq,) present configuration.
            clearance: Height of the foot half way [m].
        """
        self.refusal = "no step can be reached in time"
        before = {contact.effector: contact for contact in soles}
        for number, goal in enumerate(goals):
            if number == TRIED:
                break
            moved = sole_at(self._body, goal.foot, goal.rotation, goal.position, self._friction)
            stays = next(contact for name, contact in before.items() if name != goal.foot)
            if not self.free(moved):
                self.refusal = f"no room for the {goal.foot.replace('_', ' ')}"
                continue
            half = 0.5 * (before[goal.foot].position + goal.position) + np.array([0.0, 0.0, clearance])
            if self._passes(stays, goal, half, q) and self._stands(stays, moved, q):
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
        above = around + ABOVE * contact.normal
        return all(self._scene.nearest(point)[1] > ABOVE - LEVEL for point in above)

    def standing(self, soles: tuple[Contact, ...], q: FloatArray) -> Standing:
        """Posture on given soles with the centre of mass over their middle, near a configuration (nq,)."""
        area = SupportArea.of(soles)
        found = generate_posture(self._problem(soles, area, q), q)
        state = Configuration(self._body, found.q)
        return Standing(tuple(soles), area, found.q[7:].copy(), state.com.copy())

    def _problem(self, soles: tuple[Contact, ...], area: SupportArea, q: FloatArray) -> PostureProblem:
        reference = self._home.copy()
        reference[:7] = q[:7]
        return PostureProblem(
            self._body, tuple(soles), com=com_target(*area.centre), reference=reference,
        )  # fmt: skip

    def _stands(self, stays: Contact, moved: Contact, q: FloatArray) -> bool:
        soles = (stays, moved)
        found = generate_posture(self._problem(soles, SupportArea.of(soles), q), q)
        return found.succeeded and self._clear(found.q, soles)

    def _passes(self, stays: Contact, goal: StepGoal, half: FloatArray, q: FloatArray) -> bool:
        """Whether the body is free with its foot half way."""
        middle = 0.5 * (stays.position + half)[:2]
        problem = PostureProblem(
            self._body, (stays,), placements={goal.foot: Placement(half, goal.rotation)},
            com=com_target(*middle), com_weight=1.0, reference=q,
        )  # fmt: skip
        found = generate_posture(problem, q)
        return found.succeeded and self._clear(found.q, (stays,))

    def _clear(self, q: FloatArray, soles: tuple[Contact, ...]) -> bool:
        touching = [
            (contact.effector, self._scene.supporting_surface(contact, LEVEL).obstacle) for contact in soles
        ]
        ignored = touching_pairs(self._body, touching)
        return self._proximity.minimum(q, ignored).distance > 0.0
