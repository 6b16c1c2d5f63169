"""A sequence of contacts with a posture for every change, as the contact planner finds it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from manikin.body import BodyModel, Configuration
from manikin.contact import Contact, ContactModel, ContactSchedule, Phase, Stance, StanceSequence
from manikin.spatial import FloatArray, frozen_array

COM_ROOM = (0.06, 0.06, 0.03)
"""How far from that of its posture the centre of mass may be when a phase begins [m]; our choice."""


HINGE_PACE = 1.3
"""Mean speed of the hinge that turns most between two postures [rad/s]; our choice."""

COM_PACE = 0.4
"""Mean speed of the centre of mass between two postures [m/s]; our choice."""


@dataclass(frozen=True, eq=False)
class Stage:
    """The contacts of one phase and the posture with which it begins.

    Attributes:
        contacts: By effector.
        q: (nq,) posture that holds the contacts of this phase and of the one before.
        com: (3,) its centre of mass [m].
        min_duration: Shortest time that the phase should last [s].
        com_room: How far from there the centre of mass of a motion may be, along x, y and z [m].
        via: (nq,) posture in the middle of the phase, in which the limb that moves is off everything; None
            where the plan has none.
    """

    contacts: Mapping[str, Contact]
    q: FloatArray
    com: FloatArray
    min_duration: float
    com_room: tuple[float, float, float] = COM_ROOM
    via: FloatArray | None = None

    @classmethod
    def of(
        cls,
        body: BodyModel,
        contacts: Mapping[str, Contact],
        q: FloatArray,
        min_duration: float,
        com_room: tuple[float, float, float] = COM_ROOM,
        via: FloatArray | None = None,
    ) -> "Stage":
        """Stage with the centre of mass of its posture."""
        com = frozen_array(Configuration(body, q).com, "com [m]", (3,))
        kept = MappingProxyType(dict(contacts))
        between = None if via is None else frozen_array(via, "posture between", (body.nq,))
        return cls(kept, frozen_array(q, "posture", (body.nq,)), com, min_duration, com_room, between)

    @property
    def stance(self) -> Stance:
        """The contacts as a stance."""
        return Stance(list(self.contacts.values()))


@dataclass(frozen=True, eq=False)
class ContactPlan:
    """Stages from the start to the goal.

    Attributes:
        stages: At least one; one contact is made or broken from each to the next.
        goal: (nq,) posture with which the last one ends.
        goal_com: (3,) its centre of mass [m].
    """

    stages: tuple[Stage, ...]
    goal: FloatArray
    goal_com: FloatArray

    @classmethod
    def of(
        cls, body: BodyModel, stages: Sequence[Stage], goal: FloatArray, hinge_pace: float = HINGE_PACE
    ) -> "ContactPlan":
        """Plan with the centre of mass of its last posture.

        Args:
            body: The body.
            stages: From the start to the goal.
            goal: (nq,) posture with which the last one ends.
            hinge_pace: Mean speed of the hinge that turns most between two postures [rad/s].
        """
        com = frozen_array(Configuration(body, goal).com, "goal com [m]", (3,))
        ends = [(stage.q, stage.com) for stage in stages[1:]] + [(goal, com)]
        timed = [
            replace(stage, min_duration=max(stage.min_duration, _least_time(stage, q, there, hinge_pace)))
            for stage, (q, there) in zip(stages, ends, strict=True)
        ]
        return cls(tuple(timed), frozen_array(goal, "goal posture", (body.nq,)), com)

    def sequence(self, model: ContactModel | None = None) -> StanceSequence:
        """The stances in order, as the stages that follow take them.

        Args:
            model: Contact model of each; the default one without a cap when omitted.
        """
        stances = [Stance(list(stage.contacts.values()), model=model) for stage in self.stages]
        return StanceSequence(
            [Phase(stance, stage.min_duration) for stance, stage in zip(stances, self.stages, strict=True)]
        )

    def schedule(self, model: ContactModel) -> ContactSchedule:
        """The stances in time, each as short as it may be, from zero on.

        Args:
            model: Contact model of each.
        """
        durations = [stage.min_duration for stage in self.stages]
        return ContactSchedule(self.sequence(model), np.concatenate([[0.0], np.cumsum(durations)]))

    def keys(self, instants: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Key times (k,) [s] and configurations (k, nq): at every change, and in between where there is one.

        Args:
            instants: (n + 1,) times of the changes [s].
        """
        times, keys = [float(instants[0])], [self.stages[0].q]
        ends = [*(stage.q for stage in self.stages[1:]), self.goal]
        for number, (stage, end) in enumerate(zip(self.stages, ends, strict=True)):
            if stage.via is not None:
                times.append(0.5 * float(instants[number] + instants[number + 1]))
                keys.append(stage.via)
            times.append(float(instants[number + 1]))
            keys.append(end)
        return np.array(times), np.array(keys)

    @property
    def postures(self) -> FloatArray:
        """(n + 1, nq) the posture at every change and at the goal."""
        return np.array([*(stage.q for stage in self.stages), self.goal])

    @property
    def steps(self) -> int:
        """Number of contacts made."""
        return sum(len(set(after.contacts) - set(before.contacts)) for before, after in pairwise(self.stages))


def _least_time(stage: Stage, q: FloatArray, com: FloatArray, hinge_pace: float) -> float:
    """Time that the change to the next posture takes at an unhurried pace [s]."""
    between = stage.q[None] if stage.via is None else np.array([stage.q, stage.via])
    turn = float(np.abs(np.diff([*between[:, 7:], q[7:]], axis=0)).max(axis=1, initial=0.0).sum())
    return max(turn / hinge_pace, float(np.linalg.norm(com - stage.com)) / COM_PACE)
