"""What the hands do during a motion on given contacts, and what it takes over from the motion before it.

Palms come to the sides of an object, take it along a course, or let go of it. On a course the object is
rigid: both palms keep their places on it. It moves up first where it is taken off a surface, and down last
where it is put on one. Timing is that of minimum jerk (Flash and Hogan 1985, J Neurosci 5:1688), at rest at
both ends.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from manikin.body import BodyModel
from manikin.numerics.spatial import FloatArray, rotation_from_yaw
from manikin.planning.whole_body.fit_targets import ALMOST, EffectorTarget
from manikin.planning.whole_body.swing_path import Pose
from manikin.scene.distance import Ignored

ASIDE = 0.08
"""Way along which a palm comes straight to a face, and leaves it [m]; our choice."""
AHEAD = 0.6
"""Share of the time in which the first part of a course is done, vertical or level; the other takes the last
share of that size; our choice."""
HAND = 0.1
"""From the front of a forearm to the middle of the palm [m]; our choice."""
FREE = 0.35
"""Share of the time in which a palm on its way to a face may be anywhere; our choice."""


@dataclass(frozen=True, eq=False)
class HeldObject:
    """A box between two palms, upright.

    Attributes:
        name: Of the obstacle.
        size: (3,) along its axes [m].
        mass: [kg].
    """

    name: str
    size: FloatArray
    mass: float

    def facing(self, yaw: float, heading: float) -> tuple[float, FloatArray]:
        """How the box lies before a body: the direction of its depth, the nearest to a heading, and sizes.

        Args:
            yaw: Of its x axis [rad].
            heading: Of the body [rad].

        Returns:
            The direction [rad], and (3,) its depth, breadth and height [m].
        """
        quarters = round((heading - yaw) / (0.5 * np.pi))
        sizes = self.size if quarters % 2 == 0 else self.size[[1, 0, 2]]
        return yaw + quarters * 0.5 * np.pi, sizes

    @staticmethod
    def holds(sizes: FloatArray) -> dict[str, Pose]:
        """Places of both palms on the sides of a box, in its frame: x ahead, fingers ahead, z up.

        They are half way along a box that is not deeper than two hands, so that the forearms stay behind it.

        Args:
            sizes: (3,) depth, breadth and height as :meth:`facing` has them [m].
        """
        found, back = {}, -max(0.0, 0.5 * float(sizes[0]) - HAND)
        for hand, side in (("left_hand", 1.0), ("right_hand", -1.0)):
            # An effector's x is along the fingers, its z out of the back of the hand.
            flat = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, side], [0.0, -side, 0.0]])
            found[hand] = Pose(np.array([back, 0.5 * side * float(sizes[1]), 0.0]), flat)
        return found


class CourseKind(StrEnum):
    """What palms do along a course."""

    TAKE = "take"
    """They come to their places on what is at rest."""
    MOVE = "move"
    """They move with what they hold."""
    LEAVE = "leave"
    """They leave what is at rest."""


@dataclass(frozen=True, eq=False)
class HandCourse:
    """Course of the object, or point, at which palms are.

    Attributes:
        kind: What the palms do.
        holds: Place of each palm in the object's frame, by effector.
        start, end: (4,) position [m] and direction ahead [rad] of the object at both ends.
        rises_first: Whether it moves up before it moves level, and not level before it moves down.
        turns: Whether the orientation of the palms matters.
    """

    kind: CourseKind
    holds: Mapping[str, Pose]
    start: FloatArray
    end: FloatArray
    rises_first: bool = True
    turns: bool = True

    def object_at(self, share: FloatArray) -> FloatArray:
        """(n, 4) position [m] and direction ahead [rad] of the object at shares of the time (n,)."""
        first, last = minimum_jerk(share / AHEAD), minimum_jerk((share - 1.0 + AHEAD) / AHEAD)
        height, level = (first, last) if self.rises_first else (last, first)
        done = np.stack([level, level, height, level], axis=1)
        return self.start + done * (self.end - self.start)

    def targets(self, share: FloatArray) -> dict[str, EffectorTarget]:
        """Target of each palm at shares of the time (n,)."""
        place, found = self.object_at(share), {}
        turn = np.array([rotation_from_yaw(angle) for angle in place[:, 3]])
        away = np.zeros(len(share))
        weight = np.full(len(share), ALMOST)
        if self.kind is not CourseKind.MOVE:
            near = share if self.kind is CourseKind.TAKE else 1.0 - share
            weight = ALMOST * minimum_jerk((near - FREE) / (1.0 - FREE)) ** 2
            away = ASIDE * (1.0 - minimum_jerk((near - FREE) / (1.0 - FREE)))
        for hand, hold in self.holds.items():
            target = found[hand] = EffectorTarget.free(len(share))
            target.rotation[:] = turn @ hold.rotation
            target.position[:] = (
                place[:, :3] + turn @ hold.position + away[:, None] * target.rotation[:, :, 2]
            )
            target.weight[:], target.rotation_weight[:] = weight, weight * self.turns
        return found


def minimum_jerk(share: FloatArray) -> FloatArray:
    """(n,) share of a way that is done at shares of its time, from rest to rest, still before and after."""
    time = np.clip(share, 0.0, 1.0)
    return time**3 * (10.0 - 15.0 * time + 6.0 * time**2)


@dataclass(frozen=True, eq=False)
class Handling:
    """What the hands do during a motion, and what it takes over from the motion before it.

    Attributes:
        begin: (nq,) posture in which the motion begins at rest; None for any.
        settles: Whether it comes to rest without acceleration, as another motion goes on from there.
        held: Angles of joints that stay [rad], by name.
        course: Of the hands; None where they are free.
        touches: Pairs of a segment and an obstacle that may touch.
    """

    begin: FloatArray | None = None
    settles: bool = False
    held: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    course: HandCourse | None = None
    touches: Ignored = frozenset()

    def angles(self, body: BodyModel) -> dict[int, float]:
        """Angle of each joint that stays, by its index [rad]."""
        return {body.joint_index(name): angle for name, angle in self.held.items()}

    def applied(self, body: BodyModel, q: FloatArray) -> FloatArray:
        """(..., nq) postures with the joints that stay at their angles."""
        posture = np.array(q)
        for joint, angle in self.angles(body).items():
            posture[..., 7 + joint] = angle
        return posture

    def targets(self, time: FloatArray, begin: float, end: float) -> dict[str, EffectorTarget]:
        """Target of each palm at times (n,) of a motion between two times [s]."""
        return {} if self.course is None else self.course.targets((time - begin) / (end - begin))


FREE_HANDS = Handling()
"""No task of the hands, and nothing taken over."""
ARMS = ("shoulder", "elbow", "forearm", "wrist")
"""Parts of the names of the joints of an arm."""


def held_arms(body: BodyModel, q: FloatArray) -> dict[str, float]:
    """Angles of all joints of both arms in a posture (nq,), by name [rad]."""
    return {
        name: float(angle)
        for name, angle in zip(body.joint_names, q[7:], strict=True)
        if any(part in name for part in ARMS)
    }
