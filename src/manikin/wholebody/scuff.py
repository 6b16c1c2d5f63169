"""How deep feet and hands in flight go into what they have left or come to hold.

These pairs do not count as clearance, for a flight begins and ends at distance zero; what is
left out there is measured here.
"""

from collections.abc import Sequence

import numpy as np

from manikin.body import BodyModel
from manikin.body.limb import end_segments
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.scene import Proximity
from manikin.scene.distance import segment_of
from manikin.wholebody.targets import Ignored


def deepest_scuff(
    body: BodyModel,
    proximity: Proximity,
    schedule: ContactSchedule,
    motion: Motion,
    ignored: Sequence[Ignored],
) -> tuple[float, float]:
    """Measure every flight at every sample.

    Args:
        body: The body.
        proximity: Distances to the scene.
        schedule: Contacts in time.
        motion: The planned motion, densely sampled.
        ignored: Pairs of segment and obstacle that may touch, per sample; what every segment may
            touch is padded, and not measured.

    Returns:
        Largest depth [m], zero where nothing goes in, and its time [s].
    """
    deepest, worst = 0.0, float(motion.time[0])
    for swing in schedule.sequence.swings():
        start, end = schedule.swing_interval(swing)
        rows = np.flatnonzero((motion.time >= start) & (motion.time < end))
        ends = frozenset(end_segments(body, swing.effector))
        obstacles = _supports(body, ends, [ignored[row] for row in rows.tolist()])
        if not obstacles:
            continue
        others = frozenset(
            (shape, other) for shape, other in proximity.pairs
            if segment_of(shape) not in ends or segment_of(other) not in obstacles
        )  # fmt: skip
        found = proximity.minimum_over(motion.q[rows], others, tolerance=1e-5)
        if -found.distance > deepest:
            deepest, worst = -float(found.distance), float(motion.time[rows[found.sample]])
    return deepest, worst


def _supports(body: BodyModel, ends: frozenset[str], ignored: Sequence[Ignored]) -> frozenset[str]:
    """Obstacles that the segments may touch at some time, those apart that every segment may touch."""
    pairs = frozenset[tuple[str, str]]().union(*ignored)
    near = {obstacle for segment, obstacle in pairs if segment in ends}
    padded = {name for name in near if all((segment.name, name) in pairs for segment in body.segments)}
    return frozenset(near - padded)
