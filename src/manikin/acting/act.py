"""What is to be pushed or pulled, where to and how hard."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.contact import Contact, ContactKind
from manikin.contact_planning import Efort, Task
from manikin.contact_planning.efort import unit_direction
from manikin.errors import InputError
from manikin.spatial import GRAVITY, FloatArray, finite_number

HANDS = ("left_hand", "right_hand")
"""Effectors that act."""


class ActKind(StrEnum):
    """What the hands do."""

    PUSH = "push"
    """They press with their palms."""
    PULL = "pull"
    """They hold on and draw."""


@dataclass(frozen=True, eq=False)
class Act:
    """A force that the hands shall exert on an object.

    Attributes:
        kind: Push or pull.
        obstacle: Name of the object.
        direction: (3,) unit, level: where the force on the object points.
        force: Its size [N].
    """

    kind: ActKind
    obstacle: str
    direction: FloatArray
    force: float

    def __init__(self, kind: ActKind, obstacle: str, direction: ArrayLike, force: float) -> None:
        unit = unit_direction(direction, "act direction")
        if abs(unit[2]) > 1e-6:
            raise InputError(f"act direction is {np.round(unit, 4).tolist()}; valid: a level one, its z 0")
        object.__setattr__(self, "kind", ActKind(kind))
        object.__setattr__(self, "obstacle", obstacle)
        object.__setattr__(self, "direction", unit)
        object.__setattr__(self, "force", finite_number(force, "act force [N]", above=0.0))

    @property
    def facing(self) -> FloatArray:
        """(3,) where the body looks: at the object."""
        return self.direction if self.kind is ActKind.PUSH else -self.direction

    @property
    def touch(self) -> ContactKind:
        """How the hands touch."""
        return ContactKind.POINT if self.kind is ActKind.PUSH else ContactKind.GRASP

    def hand_task(self, arms: tuple[str, ...]) -> Task:
        """Task of the arms: the object's reaction pushes them against the act ([Tonneau2015]_ 5.2)."""
        return Task(self.direction, set(arms))

    def hand_heuristic(self) -> Efort:
        """EFORT (5.12) of hands that press; pulling EFORT (5.13) of hands that hold on."""
        return Efort(pulling=self.kind is ActKind.PULL)

    def foot_task(self, body: BodyModel) -> Task:
        """Task of the legs: the ground pushes them the way of the act, and carries the body.

        The thesis has the direction of the act alone, for which no level floor scores. Ours is that
        of the whole force that the feet need at rest, ``F d + m g``.
        """
        return Task(self.force * self.direction + np.array([0.0, 0.0, body.mass * GRAVITY]))

    def reaction(self, force: float | None = None) -> FloatArray:
        """(3,) force of the object on both hands [N], for the act's force or another one [N]."""
        return -(self.force if force is None else force) * self.direction

    def load(self, hands: tuple[Contact, ...], force: float | None = None) -> FloatArray:
        """(6,) force and moment about the world origin of the object on the hands, shared evenly."""
        pull = self.reaction(force)
        place = np.mean([hand.position for hand in hands], axis=0)
        return np.concatenate([pull, np.cross(place, pull)])
