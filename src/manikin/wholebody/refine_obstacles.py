"""Obstacles in the refinement: what may touch, and how far an effector in flight keeps off its supports.

An effector may touch what it holds, and that alone.  In flight it begins and ends at distance zero from
its supports; in between it has to keep off them like everything else.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.body import BodyModel
from manikin.body.limb import end_segments
from manikin.contact import ContactKind, ContactSchedule
from manikin.scene import Scene
from manikin.scene.distance import ProximitySamples, segment_of
from manikin.spatial import FloatArray
from manikin.wholebody.flights import touch_pairs
from manikin.wholebody.meeting import Ignored

RISE = 0.3
"""Share of a flight in which the wanted clearance to what was left, or is to be reached, rises or falls."""

HELD_SHARE = 0.4
"""Share of the wanted clearance that an effector in contact has to keep from other obstacles."""

GRASPED = -0.05
"""Distance at which a hand that holds on to something begins to be pushed off it [m]."""


@dataclass(frozen=True, eq=False)
class _Side:
    """One end of a flight.

    Attributes:
        pairs: Segments and the obstacle that they leave or reach.
        away: (n,) 0 at the contact, 1 far from it; 1 outside the flight.
        grasped: Whether the hand has its fingers around the obstacle.
    """

    pairs: Ignored
    away: FloatArray
    grasped: bool


class RefineObstacles:
    """What may be near what, at samples of a motion.

    Args:
        body: The body.
        scene: The obstacles.
        schedule: Contacts in time.
        time: (n,) [s].
        padded: Obstacles that any part of the body may touch.

    Attributes:
        ignored: Pairs of segment and obstacle that may touch at each sample, because they are in contact.

    Raises:
        ContactError: If a contact lies on no obstacle.
    """

    def __init__(
        self,
        body: BodyModel,
        scene: Scene,
        schedule: ContactSchedule,
        time: FloatArray,
        padded: Sequence[str] = (),
    ) -> None:
        leaning = frozenset((segment.name, name) for segment in body.segments for name in padded)
        held = [
            leaning.union(*(touch_pairs(body, scene, contact) for contact in phase.stance))
            for phase in schedule.sequence
        ]
        self.ignored: tuple[Ignored, ...] = tuple(held[phase] for phase in schedule.phase_at(time))
        self._obstacles = [obstacle.name for obstacle in scene]
        self._ends = {name: end_segments(body, name) for name in schedule.sequence.effectors}
        self._sides = list[_Side]()
        self._near = {
            name: np.where(schedule.support(time, (name,))[:, 0], 0.0, 1.0)
            for name in schedule.sequence.effectors
        }
        for swing in schedule.sequence.swings():
            start, end = schedule.swing_interval(swing)
            rows = (time >= start) & (time < end)
            for contact, gone in ((swing.start, time - start), (swing.end, end - time)):
                if contact is not None:
                    share = np.clip(gone / (RISE * (end - start)), 0.0, 1.0)
                    away = np.where(rows, share**2 * (3.0 - 2.0 * share), 1.0)
                    self._near[swing.effector] = np.minimum(self._near[swing.effector], away)
                    grasped = contact.kind is ContactKind.GRASP
                    self._sides.append(_Side(touch_pairs(body, scene, contact), away, grasped))

    def touching(self) -> tuple[Ignored, ...]:
        """Pairs that may go into each other at each sample: those in contact, and a hand about a grasp."""
        return self._with([side for side in self._sides if side.grasped])

    def during_flights(self) -> tuple[Ignored, ...]:
        """Pairs that do not count as clearance at each sample: in contact, leaving it or reaching it."""
        return self._with(self._sides)

    def _with(self, sides: list[_Side]) -> tuple[Ignored, ...]:
        known: dict[tuple[Ignored, tuple[bool, ...]], Ignored] = {}
        found = []
        for sample, held in enumerate(self.ignored):
            near = tuple(bool(side.away[sample] < 1.0) for side in sides)
            if (held, near) not in known:
                pairs = (side.pairs for side, close in zip(sides, near, strict=True) if close)
                known[held, near] = held.union(*pairs)
            found.append(known[held, near])
        return tuple(found)

    def wanted(self, found: ProximitySamples, safe: float, touching: float) -> FloatArray:
        """(k,) wanted distance of close pairs [m].

        Where an effector is held its distance to other obstacles is given as well, and less of it is wanted:
        a push that ended with the contact would tear it off.

        Args:
            found: The pairs.
            safe: Wanted far from contacts [m].
            touching: Wanted where a flight begins or ends [m].
        """
        wanted = np.full(len(found.distance), safe)
        named = np.array([(segment_of(shape), segment_of(other)) for shape, other in found.pairs])
        for name, ends in self._ends.items():
            rows = np.isin(named[:, 0], ends) & np.isin(named[:, 1], self._obstacles)
            share = np.maximum(self._near[name][found.sample[rows]], HELD_SHARE)
            wanted[rows] = np.minimum(wanted[rows], share * safe)
        for side in self._sides:
            rows = np.zeros(len(wanted), dtype=bool)
            for segment, obstacle in side.pairs:
                rows |= (named[:, 0] == segment) & (named[:, 1] == obstacle)
            share = side.away[found.sample[rows]]
            inside = GRASPED if side.grasped else touching
            wanted[rows] = np.minimum(wanted[rows], share * safe + (1.0 - share) * inside)
        return wanted
