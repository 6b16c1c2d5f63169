"""Where the hands are in the field of view: the angles at which the eyes would have to look at them.

The normal line of sight is 15 degrees below straight ahead of the head. About it, eyes alone see best within
15 degrees, and turn by 35 degrees to the sides, 40 up and 20 down at most ([MIL-STD-1472]_, visual field);
beyond, the head turns. What hides the view is not looked for.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.body.segments import SIDES, Segment
from manikin.ergonomics.body_parts import parts_of
from manikin.ergonomics.rula_reba import Scores, degrees
from manikin.errors import BodyError
from manikin.kinematics.point_targets import SegmentPlacements
from manikin.numerics.spatial import FloatArray

NORMAL_LINE = 15.0
"""Angle of the normal line of sight below straight ahead of the head [deg]."""
BEST = 15.0
"""Angle about it within which eyes see best, to every side [deg]."""
ASIDE, ABOVE, BELOW = 35.0, 40.0, 20.0
"""Angles by which eyes turn at most, to both sides, up and down [deg]."""
EYES_BELOW = 0.02
"""Height of the middle of the skull above the eyes [statures]: they are about 0.936 above the ground."""
ZONES = {0: "seen best", 1: "seen by turning the eyes", 2: "seen by turning the head"}
"""Meaning of the zones."""


@dataclass(frozen=True, eq=False)
class Sight:
    """Directions from the eyes to the hands, against the normal line of sight, by side.

    Attributes:
        aside: (n,) to the left positive [rad].
        above: (n,) upward positive [rad].
    """

    aside: Mapping[str, FloatArray]
    above: Mapping[str, FloatArray]

    @property
    def zones(self) -> dict[str, Scores]:
        """(n,) zone of each hand, a key of :data:`ZONES`."""
        return {side: sight_zone(self.aside[side], self.above[side]) for side in self.aside}

    def as_dict(self, weight: FloatArray) -> dict[str, Any]:
        """Share of the time of each hand in each zone; frames stand for times (n,) [s]."""
        share = weight / weight.sum()
        return {
            side: {str(one): float(share[zone == one].sum()) for one in ZONES}
            for side, zone in self.zones.items()
        }


def sight_zone(aside: FloatArray, above: FloatArray) -> Scores:
    """(n,) zone of directions [rad] against the normal line of sight, a key of :data:`ZONES`."""
    across, up = np.abs(degrees(aside)), degrees(above)
    best = (across <= BEST) & (np.abs(up) <= BEST)
    eyes = (across <= ASIDE) & (up <= ABOVE) & (up >= -BELOW)
    return np.where(best, 0, np.where(eyes, 1, 2)).astype(np.int64)


def eyes_of(body: BodyModel) -> tuple[Segment, FloatArray]:
    """The head, and the point (3,) in the middle between the eyes in its frame [m].

    Raises:
        BodyError: If the body is no human.
    """
    head = body.segment(parts_of(body).neck[-1])
    skull = next((shape for shape in head.shapes if shape.name == "skull"), None)
    if skull is None or body.stature is None:
        raise BodyError(f"body {body.name!r} has no skull; valid: a human")
    front = skull.size[0] + 0.5 * skull.size[1]
    return head, np.array(skull.translation) + np.array([front, 0.0, -EYES_BELOW * body.stature])


def sight_of(body: BodyModel, q: FloatArray) -> Sight:
    """Directions to both hands in postures (n, nq).

    Raises:
        BodyError: If the body is no human.
    """
    head, eyes = eyes_of(body)
    hands = {side: body.effector(f"{side}_hand") for side in SIDES}
    placed = SegmentPlacements(body, [head.name, *(hand.segment for hand in hands.values())]).of(q)
    turns, places = placed.turns.transpose(0, 3, 1, 2), placed.shifts.transpose(0, 2, 1)
    aside, above = {}, {}
    for number, (side, hand) in enumerate(hands.items(), 1):
        way = places[number] + turns[number] @ hand.translation - places[0] - turns[0] @ eyes
        x, y, z = np.einsum("nji,nj->in", turns[0], way)
        aside[side] = np.arctan2(y, x)
        above[side] = np.arctan2(z, np.hypot(x, y)) + np.deg2rad(NORMAL_LINE)
    return Sight(aside, above)
