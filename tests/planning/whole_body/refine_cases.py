"""Inputs of the refinement: quasi-static key postures on guessed, equal times, joined by interpolation.

That is what a contact planner gives ([Tonneau2015]_ 7.2): each key has its contacts and keeps clear, nothing
between the keys does, and the centre of mass stays between the feet even where only one of them stands.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from manikin.body import BodyModel, human
from manikin.contact import Contact, ContactSchedule, Phase, Stance, StanceSequence, grasp, sole
from manikin.kinematics import Placement, PostureProblem, generate_posture
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.swing_planner import touch_pairs
from manikin.scene import Box, Obstacle, Proximity, Scene

WALL = 0.6
"""Distance of the climbed wall [m]."""


class Case(NamedTuple):
    """Arguments of ``refine_motion``."""

    body: BodyModel
    scene: Scene
    time: FloatArray
    q: FloatArray
    schedule: ContactSchedule


class KeyMaker:
    """Collects stances and key postures."""

    def __init__(self, body: BodyModel, scene: Scene, reference: FloatArray | None, duration: float) -> None:
        self.body, self.scene, self.reference, self.duration = body, scene, reference, duration
        self.proximity = Proximity(body, scene)
        self.times, self.keys, self.stances = list[float](), list[FloatArray](), list[list[Contact]]()

    def stand(self, contacts: Sequence[Contact], com: FloatArray) -> None:
        """Both stand and arrive in one posture."""
        self._add(float(len(self.stances)), self._posture(contacts, com, {}))
        self.stances.append(list(contacts))

    def fly(self, contacts: Sequence[Contact], com: FloatArray, effector: str, place: Placement) -> None:
        """Leave from the last posture and lift the effector in the middle."""
        self._add(float(len(self.stances)), self.keys[-1])
        self._add(len(self.stances) + 0.5, self._posture(contacts, com, {effector: place}))
        self.stances.append(list(contacts))

    def case(self, cap: float) -> Case:
        self._add(float(len(self.stances)), self.keys[-1])
        sequence = StanceSequence([Phase(Stance(contacts, cap)) for contacts in self.stances])
        instants = self.duration * np.arange(len(self.stances) + 1)
        time = self.duration * np.array(self.times)
        return Case(self.body, self.scene, time, np.array(self.keys), ContactSchedule(sequence, instants))

    def _add(self, time: float, q: FloatArray) -> None:
        self.times.append(time)
        self.keys.append(q)

    def _posture(
        self, contacts: Sequence[Contact], com: FloatArray, placements: dict[str, Placement]
    ) -> FloatArray:
        touching = (touch_pairs(self.body, self.scene, contact) for contact in contacts)
        problem = PostureProblem(
            self.body, tuple(contacts), placements, com=com, com_weight=30.0,
            proximity=self.proximity, clearance=0.01,
            ignore=frozenset[tuple[str, str]]().union(*touching), reference=self.reference,
        )  # fmt: skip
        result = generate_posture(problem, self.keys[-1] if self.keys else None)
        assert result.succeeded, result.failure
        return result.q


@cache
def crouch(steps: int, duration: float = 0.6, height: float = 1.25) -> Case:
    """Walk under a floating slab, ``steps`` steps of 0.3 m and one to close up."""
    slab = Obstacle("slab", Box((0.5, 1.6, 0.1)), translation=(0.75, 0.0, height + 0.05))
    body = human(1.75, 79.0, "male", strength=2.0)  # steps of 0.6 s in a deep crouch are beyond the mean man
    maker = KeyMaker(body, Scene([slab]), None, duration)
    at = {"left_foot": 0.0, "right_foot": 0.0}

    def foot(name: str, x: float) -> Contact:
        y = 0.1 if name == "left_foot" else -0.1
        return sole(name, (x, y, 0.0), length=0.28, width=0.12, friction=0.7)

    def middle(*x: float) -> FloatArray:
        return np.array([np.mean(x), 0.0, np.nan])

    maker.stand([foot(*item) for item in at.items()], middle(*at.values()))
    for number in range(steps + 1):
        mover, other = ("left_foot", "right_foot")[:: 1 if number % 2 == 0 else -1]
        target = 0.3 * min(number + 1, steps)
        x = 0.5 * (at[mover] + target)
        place = Placement(foot(mover, x).position + np.array([0.0, 0.0, 0.06]), np.eye(3))
        maker.fly([foot(other, at[other])], middle(x, at[other]), mover, place)
        at[mover] = target
        maker.stand([foot(*item) for item in at.items()], middle(*at.values()))
    return maker.case(1500.0)


def wall() -> Scene:
    """A wall with ledges for the feet and holds for the hands, each 0.22 m above the last."""
    parts = [Obstacle("wall", Box((0.2, 2.0, 4.0)), translation=(WALL + 0.1, 0.0, 2.0))]
    for number in range(1, 13):
        for name, side in (("left", 1.0), ("right", -1.0)):
            z = 0.22 * number - 0.02
            if number <= 4:
                ledge = Box((0.28, 0.2, 0.04))
                parts.append(
                    Obstacle(f"{name}_ledge{number}", ledge, translation=(WALL - 0.14, 0.17 * side, z))
                )
            else:
                hold = Box((0.20, 0.06, 0.04))
                parts.append(
                    Obstacle(f"{name}_hold{number}", hold, translation=(WALL - 0.10, 0.26 * side, z))
                )
    return Scene(parts)


def on_wall(effector: str, number: int) -> Contact:
    """Contact of a foot on a ledge or a hand on a hold."""
    side, z = 1.0 if effector.startswith("left") else -1.0, 0.22 * number
    if effector.endswith("foot"):
        return sole(effector, (WALL - 0.2, 0.17 * side, z), length=0.14, width=0.08, friction=0.7)
    return grasp(effector, (WALL - 0.2, 0.26 * side, z), max_force=150.0, max_moment=10.0)


@cache
def climb(moves: int, duration: float = 0.8) -> Case:
    """Climb the wall: left hand, right foot, right hand, left foot, again and again."""
    body = human(1.75, 79.0, "male", strength=2.0)  # 0.8 s a move is beyond the mean man
    bent = {"hip_flexion": 0.3, "knee_flexion": 0.4, "elbow_flexion": 1.2, "shoulder_flexion": 2.0}
    reference = body.posture({f"{side}_{name}": bent[name] for side in ("left", "right") for name in bent})
    maker = KeyMaker(body, wall(), reference, duration)
    at = {"left_foot": 1, "right_foot": 1, "left_hand": 7, "right_hand": 7}
    com = np.array([WALL - 0.3, 0.0, np.nan])
    maker.stand([on_wall(*item) for item in at.items()], com)
    order = ("left_hand", "right_foot", "right_hand", "left_foot")
    for number in range(moves):
        mover = order[number % 4]
        start, end = on_wall(mover, at[mover]).position, on_wall(mover, at[mover] + 1).position
        place = Placement(0.5 * (start + end) + np.array([-0.12, 0.0, 0.05]))
        maker.fly([on_wall(*item) for item in at.items() if item[0] != mover], com, mover, place)
        at[mover] += 1
        maker.stand([on_wall(*item) for item in at.items()], com)
    return maker.case(2000.0)
