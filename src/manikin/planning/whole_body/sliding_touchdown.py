"""A contact that is made at speed and slides to its place: its shapes on the surface meanwhile.

Buttocks reach a seat with one side first and slide and roll to their place.  Until they are there the
contact's own frame is above the surface, and only the distance of the shapes says whether they touch.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import hangs
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.swing_planner import touch_pairs
from manikin.scene import Proximity, Scene
from manikin.scene.distance import ProximitySamples, considered

Ignored = frozenset[tuple[str, str]]
"""Pairs of segment and obstacle (or segment) whose distance does not count."""

SITTING_DOWN = 0.15
"""Time before a seat is touched in which the trunk may come close to it [s]."""


def with_pairs(
    held: Sequence[Ignored], more: Sequence[tuple[Ignored, NDArray[np.bool_]]]
) -> tuple[Ignored, ...]:
    """The pairs held at each of n samples, with further ones where these count (n,)."""

    @cache
    def union(own: Ignored, *near: bool) -> Ignored:
        return own.union(*(pairs for (pairs, _), counts in zip(more, near, strict=True) if counts))

    near = np.array([counts for _, counts in more]).reshape(-1, len(held)).T.tolist()
    return tuple(union(own, *counts) for own, counts in zip(held, near, strict=True))


@dataclass(frozen=True, eq=False)
class SlidingTouchdown:
    """Shapes that meet obstacles at speed.

    Attributes:
        pairs: Pairs of segment and obstacle that may touch but not go into each other.
        near: (n,) whether they are about to touch, or do and have not settled yet, at each sample.
        sliding: (n,) whether one of their shapes has to touch.
    """

    pairs: Ignored
    near: NDArray[np.bool_]
    sliding: NDArray[np.bool_]

    def without(self, ignored: Sequence[Ignored]) -> tuple[Ignored, ...]:
        """The pairs that are ignored at each sample, but for those that meet there."""
        return tuple(
            found - self.pairs if near else found for found, near in zip(ignored, self.near, strict=True)
        )

    def rows(self, found: ProximitySamples) -> NDArray[np.bool_]:
        """(k,) whether a close pair is one that meets."""
        distinct = list(dict.fromkeys(found.pairs))
        apart = dict(zip(distinct, considered(distinct, self.pairs), strict=True))
        return ~np.array([apart[pair] for pair in found.pairs], dtype=np.bool_) & self.near[found.sample]

    def importance(self, found: ProximitySamples, rows: NDArray[np.bool_]) -> FloatArray:
        """(k,) how much it matters that distances of ``rows`` are zero: of what is inside, and the closest.

        Where a contact rolls from one shape to the other, the importance passes gradually between them.
        """
        sample, distance = found.sample[rows], found.distance[rows]
        least = np.full(len(self.near), np.inf)
        np.minimum.at(least, sample, distance)
        # Difference of two distances at which the farther shape matters little [m].
        share = np.exp((least[sample] - distance) / 3.0e-3)
        total = np.zeros(len(self.near))
        np.add.at(total, sample, share)
        touching = np.where(self.sliding[sample], np.sqrt(share / total[sample]), 0.0)
        importance = np.zeros(len(found.distance))
        importance[rows] = np.where(distance < 0.0, 1.0, touching)
        return importance


def sliding_touchdown_at(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray
) -> SlidingTouchdown | None:
    """Contacts made at speed at times (n,) [s], from shortly before the touch until they have settled.

    None where every contact is made at rest, and none of the trunk is left.
    """
    pairs: Ignored = frozenset()
    near, sliding = np.zeros(len(time), dtype=np.bool_), np.zeros(len(time), dtype=np.bool_)
    for index, phase in enumerate(schedule.sequence):
        for contact in phase.stance:
            new = index > 0 and contact.effector not in schedule.sequence[index - 1].stance
            if contact.settle > 0.0 and new:
                start = float(schedule.instants[index])
                pairs |= touch_pairs(body, scene, contact)
                near |= (time >= start - SITTING_DOWN) & (time < start + contact.settle)
                sliding |= schedule.settling(time, contact.effector)
    for swing in schedule.sequence.swings():
        for contact, before in ((swing.start, True), (swing.end, False)):
            if contact is not None and contact.settle == 0.0 and not hangs(body, contact.effector):
                # A trunk that leaves a seat, or is about to sit, may brush over it.
                start, end = schedule.swing_interval(swing)
                pairs |= touch_pairs(body, scene, contact)
                near |= (time >= (start if before else end - SITTING_DOWN)) & (time < end)
    return SlidingTouchdown(pairs, near, sliding) if pairs else None


def sliding_touchdown_errors(
    proximity: Proximity, meeting: SlidingTouchdown | None, motion: Motion
) -> FloatArray:
    """(n,) depth of what meets at speed in its surface, or its distance where it should touch [m]."""
    errors = np.zeros(len(motion.time))
    if meeting is None:
        return errors
    samples, reach = np.flatnonzero(meeting.near), 0.1  # distances beyond are not measured [m]
    others = frozenset(compress(proximity.pairs, considered(proximity.pairs, meeting.pairs)))
    found = proximity.evaluate_over(motion.q[samples], reach, others)
    least = np.full(len(samples), reach)
    np.minimum.at(least, found.sample, found.distance)
    errors[samples] = np.where(meeting.sliding[samples], np.abs(least), np.maximum(-least, 0.0))
    return errors
