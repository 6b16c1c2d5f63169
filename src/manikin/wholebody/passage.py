"""How low a motion takes the body, and how near the head comes to the scene.

People who pass under a beam were measured so ([Qiu2012]_ 3.2.3): by the lowest height of the
centre of mass; the clearance of the head is our own addition.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactKind, ContactSchedule, Stance
from manikin.motion import Motion
from manikin.scene import Proximity, Scene
from manikin.scene.scene import FLOOR
from manikin.wholebody.flights import hangs

HEAD = "head"
"""Effector on top of the body."""


@dataclass(frozen=True)
class Passage:
    """What a motion shows of how the body made itself small.

    Attributes:
        lowest_com_m: Least height of the centre of mass above the lowest limb in contact, before the
            body sits down where it does [m]; None without a limb in contact.
        head_clearance_m: Least signed distance of the head and neck to the scene, except its floor and
            what may be leaned on, over the whole motion [m]; None without obstacles or a head.
    """

    lowest_com_m: float | None
    head_clearance_m: float | None

    def summary(self) -> dict[str, float | None]:
        """Its part of the blocks ``wholebody`` and ``execution`` of the summary."""
        return asdict(self)


def measure_passage(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, motion: Motion, padded: Sequence[str] = ()
) -> Passage:
    """Measure a planned or an executed motion.

    Args:
        body: The body.
        scene: The obstacles.
        schedule: The planned contacts.
        motion: The motion; what lies beyond the schedule counts as its last phase.
        padded: Obstacles that any part of the body may lean on.
    """
    return Passage(_lowest_com(body, schedule, motion), _head_clearance(body, scene, motion, padded))


def _lowest_com(body: BodyModel, schedule: ContactSchedule, motion: Motion) -> float | None:
    phases = schedule.phase_at(motion.time)
    heights = []
    for index, phase in enumerate(schedule.sequence):
        if any(not hangs(body, name) for name in phase.stance.effectors):
            break
        level, rows = _level(phase.stance), phases == index
        if level is not None and np.any(rows):
            heights.append(float(motion.com[rows, 2].min()) - level)
    return min(heights, default=None)


def _level(stance: Stance) -> float | None:
    """Height of the lowest contact that is no grasp [m]."""
    places = [float(item.position[2]) for item in stance if item.kind is not ContactKind.GRASP]
    return min(places, default=None)


def _head_clearance(body: BodyModel, scene: Scene, motion: Motion, padded: Sequence[str]) -> float | None:
    obstacles = [item for item in scene if item.name != FLOOR and item.name not in padded]
    if not obstacles or HEAD not in body.effectors:
        return None
    above = head_segments(body)
    hard = Scene(obstacles, floor_height=None)
    ignored = frozenset(
        (segment.name, item.name) for segment in body.segments if segment.name not in above for item in hard
    )
    proximity = Proximity(body, hard, self_collision=False)
    return float(proximity.minimum_over(motion.q, ignored, tolerance=1e-5).distance)


def head_segments(body: BodyModel) -> tuple[str, ...]:
    """Names of the segments above the shoulders: the head's, and those below it that carry nothing else."""
    segments = {segment.name: segment for segment in body.segments}
    found = [body.effector(HEAD).segment]
    while True:
        parent = segments[found[-1]].parent
        if parent is None or sum(item.parent == parent for item in body.segments) != 1:
            return tuple(found)
        found.append(parent)
