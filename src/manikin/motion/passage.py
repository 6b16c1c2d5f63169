"""Passages under obstacles: how low a motion takes the centre of mass, and the room that it leaves.

People are measured by the lowest height of the centre of mass ([Qiu2012]_ 3.2.3); the head's room is ours.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.body.limbs import hangs
from manikin.contact import ContactKind, ContactSchedule
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.scene import Proximity, Scene
from manikin.scene.scene import FLOOR


@dataclass(frozen=True)
class Passage:
    """A motion, recorded, planned or executed, or its part below one thing that is passed.

    Heights of the centre of mass are above the floor: of a recording the lowest surface on which feet stood,
    of a planned motion the lowest limb in contact; NaN where it is not known.

    Attributes:
        start: [s].
        end: [s].
        com_lowest: Least height of the centre of mass [m].
        com_lowest_at: When [s].
        com_place: (x, y) where, in the world [m].
        com_highest: Largest height of the centre of mass [m].
        travelled: Level distance between the centre of mass at the start and at the end [m].
        tops: Height that counts of each part of the body: the least one, the largest one below a box [m].
        room: Least distance from the body to what is passed [m]; of a planned motion that of head and neck
            to the scene, our own addition; None if nothing is passed.
        below: From the lowest centre of mass to what is passed ([Qiu2012]_ Fig. 3.14) [m].
    """

    start: float
    end: float
    com_lowest: float
    com_lowest_at: float
    com_place: tuple[float, float]
    com_highest: float
    travelled: float
    tops: Mapping[str, float] = field(default_factory=dict)
    room: float | None = None
    below: float | None = None

    @classmethod
    def of(
        cls, time: FloatArray, com: FloatArray, floor: FloatArray | float, *,
        tops: Mapping[str, float] | None = None, room: float | None = None, overhead: float | None = None,
    ) -> "Passage":  # fmt: skip
        """Measure the path of a centre of mass (n, 3) in the world at instants (n,) [m, s].

        The floor (n,) is NaN where it is not known, ``overhead`` the height above it of what is passed [m].
        """
        height = com[:, 2] - floor
        lowest = int(np.argmin(np.where(np.isnan(height), np.inf, height)))
        x, y = com[lowest, :2].tolist()
        return cls(
            float(time[0]), float(time[-1]), float(height[lowest]), float(time[lowest]), (x, y),
            float(np.fmax.reduce(height)), float(np.hypot(*(com[-1] - com[0])[:2])), tops or {}, room,
            None if overhead is None else overhead - float(height[lowest]),
        )  # fmt: skip

    def summary(self) -> dict[str, float | None]:
        """Its part of the blocks ``wholebody`` and ``execution`` of a run's summary [m]."""
        lowest = None if np.isnan(self.com_lowest) else self.com_lowest
        return {"lowest_com_m": lowest, "head_clearance_m": self.room}

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready values of a passage of a recording, with units in the keys."""
        return {
            "start_s": self.start, "end_s": self.end, "com_lowest_m": self.com_lowest,
            "com_lowest_at_s": self.com_lowest_at, "com_place_m": list(self.com_place),
            "com_highest_m": self.com_highest, "travelled_m": self.travelled,
            "tops_m": dict(self.tops), "room_m": self.room, "com_below_m": self.below,
        }  # fmt: skip


HEAD = "head"
"""Effector on top of the body."""


def measure_passage(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, motion: Motion, padded: Sequence[str] = ()
) -> Passage:
    """Least height of the CoM above the lowest limb in contact, and clearance of head and neck.

    Heights count until the body sits down; the clearance of the whole motion, to the scene without its floor
    and what is padded, which may be leaned on. What lies beyond the schedule counts as its last phase.
    """
    levels = np.full(len(schedule.sequence), np.nan)
    for index, phase in enumerate(schedule.sequence):
        if any(not hangs(body, name) for name in phase.stance.effectors):
            break
        heights = [float(item.position[2]) for item in phase.stance if item.kind is not ContactKind.GRASP]
        levels[index] = min(heights, default=np.nan)
    obstacles, room = [item for item in scene if item.name != FLOOR and item.name not in padded], None
    if obstacles and HEAD in body.effectors:
        others = {segment.name for segment in body.segments}.difference(head_segments(body))
        ignored = frozenset((segment, item.name) for segment in others for item in obstacles)
        proximity = Proximity(body, Scene(obstacles, floor_height=None), self_collision=False)
        room = float(proximity.minimum_over(motion.q, ignored, tolerance=1e-5).distance)
    return Passage.of(motion.time, motion.com, levels[schedule.phase_at(motion.time)], room=room)


def head_segments(body: BodyModel) -> tuple[str, ...]:
    """Names of the segments above the shoulders: the head's, and those below it that carry nothing else."""
    found = [body.effector(HEAD).segment]
    while True:
        parent = body.segment(found[-1]).parent
        if parent is None or sum(item.parent == parent for item in body.segments) != 1:
            return tuple(found)
        found.append(parent)
