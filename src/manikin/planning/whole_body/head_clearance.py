"""Passages under obstacles: the lowest centre of mass, and the clearance of head and neck.

People who pass under a beam are measured by the lowest height of the centre of mass ([Qiu2012]_ 3.2.3);
the clearance of the head is our own addition.
"""

from collections.abc import Sequence

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactKind, ContactSchedule
from manikin.motion import Motion
from manikin.motion.passage import Passage
from manikin.planning.whole_body.swing_planner import hangs
from manikin.scene import Proximity, Scene
from manikin.scene.scene import FLOOR

HEAD = "head"
"""Effector on top of the body."""


def measure_passage(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, motion: Motion, padded: Sequence[str] = ()
) -> Passage:
    """Least height of the CoM above the lowest limb in contact, and clearance of head and neck.

    Heights count until the body sits down, where it does; the clearance counts over the whole motion, to the
    scene without its floor and what may be leaned on.

    Args:
        motion: Planned or executed; what lies beyond the schedule counts as its last phase.
        padded: Obstacles that any part of the body may lean on.
    """
    levels = np.full(len(schedule.sequence), np.nan)
    for index, phase in enumerate(schedule.sequence):
        if any(not hangs(body, name) for name in phase.stance.effectors):
            break
        heights = [float(item.position[2]) for item in phase.stance if item.kind is not ContactKind.GRASP]
        levels[index] = min(heights, default=np.nan)
    floor, room = levels[schedule.phase_at(motion.time)], _head_clearance(body, scene, motion, padded)
    return Passage.of(motion.time, motion.com, floor, room=room)


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
