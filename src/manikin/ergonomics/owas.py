"""OWAS, the Ovako working posture analysing system ([Karhu1977]_): a code of four digits and its category.

Back, arms, legs and load get a digit each, and a table gives the action category of the four. The paper draws
the postures without numbers: what counts as bent, twisted, or at the level of the shoulder is our choice.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.ergonomics.body_parts import Bearing, parts_of
from manikin.ergonomics.postural_angles import PosturalAngles
from manikin.ergonomics.rula_reba import Scores, degrees, looked_up
from manikin.kinematics.point_targets import SegmentPlacements
from manikin.motion import Motion
from manikin.numerics.spatial import FloatArray

BENT = 20.0
"""From this on the back is bent, or twisted or bent to the side [deg]; ours."""
KNEE_BENT = 30.0
"""From this on a knee is bent [deg]; ours."""

LIGHT, HEAVY = 10.0, 20.0
"""Loads from which on the second and the third digit count [kg]: up to 10, up to 20, more."""

CATEGORIES = {
    1: "no action",
    2: "changes in the near future",
    3: "changes as soon as possible",
    4: "changes immediately",
}
"""What is to be done, by category."""

TABLE = np.array([
    [1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1],
    [1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 1, 1, 1, 1, 1, 1],
    [1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 3, 2, 2, 3, 1, 1, 1, 1, 1, 2],
    [2, 2, 3, 2, 2, 3, 2, 2, 3, 3, 3, 3, 3, 3, 3, 2, 2, 2, 2, 3, 3],
    [2, 2, 3, 2, 2, 3, 2, 3, 3, 3, 4, 4, 3, 4, 4, 3, 3, 4, 2, 3, 4],
    [3, 3, 4, 2, 2, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 2, 3, 4],
    [1, 1, 1, 1, 1, 1, 1, 1, 2, 3, 3, 3, 4, 4, 4, 1, 1, 1, 1, 1, 1],
    [2, 2, 3, 1, 1, 1, 1, 1, 2, 4, 4, 4, 4, 4, 4, 3, 3, 3, 1, 1, 1],
    [2, 2, 3, 1, 1, 1, 2, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 1, 1, 1],
    [2, 3, 3, 2, 2, 3, 2, 2, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 2, 3, 4],
    [3, 3, 4, 2, 3, 4, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 2, 3, 4],
    [4, 4, 4, 2, 3, 4, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 2, 3, 4],
]).reshape(4, 3, 7, 3)  # fmt: skip
"""Action category by back (4), arms (3), legs (7) and load (3)."""


@dataclass(frozen=True, eq=False)
class Owas:
    """Digits of every frame, (n,) each.

    Attributes:
        time: [s].
        back: 1 straight, 2 bent, 3 twisted or bent to the side, 4 bent and twisted.
        arms: 1 both below the shoulders, 2 one at their level or above, 3 both.
        legs: 1 sitting, 2 standing on straight legs, 3 on one straight leg, 4 on bent knees, 5 on one bent
            leg, 6 kneeling, 7 walking.
        load: 1 up to 10 kg, 2 up to 20 kg, 3 more.
    """

    time: FloatArray
    back: Scores
    arms: Scores
    legs: Scores
    load: Scores

    @property
    def category(self) -> Scores:
        """(n,) action category, 1 to 4."""
        return owas_category(self.back, self.arms, self.legs, self.load)

    def code(self, frame: int) -> str:
        """The four digits of a frame."""
        return "".join(str(int(part[frame])) for part in (self.back, self.arms, self.legs, self.load))

    def as_dict(self, weight: FloatArray) -> dict[str, Any]:
        """Plain values; frames stand for times (n,) [s]."""
        category, share = self.category, weight / weight.sum()
        worst = int(category.argmax())
        return {
            "max": int(category[worst]), "max_at_s": float(self.time[worst]), "code": self.code(worst),
            "action": CATEGORIES[int(category[worst])],
            "share_of_time": {str(level): float(share[category == level].sum()) for level in CATEGORIES},
        }  # fmt: skip


def owas_category(back: ArrayLike, arms: ArrayLike, legs: ArrayLike, load: ArrayLike) -> Scores:
    """(n,) action category of digits; of shape () for numbers.

    Raises:
        InputError: If a digit is not among those of its part.
    """
    return looked_up(TABLE, back=back, arms=arms, legs=legs, load=load)


def owas_load(load_kg: float) -> int:
    """Digit of a load."""
    return 1 + int(load_kg > LIGHT) + int(load_kg > HEAVY)


def owas_of(
    body: BodyModel, motion: Motion, angles: PosturalAngles, bearing: Bearing, load_kg: float
) -> Owas:
    """Digits of a motion from its angles and from what carries the weight."""
    n = len(motion.time)
    bent = np.abs(degrees(angles.trunk_flexion)) >= BENT
    turned = np.maximum(np.abs(degrees(angles.trunk_twist)), np.abs(degrees(angles.trunk_side_bend))) >= BENT
    raised = [_raised(body, motion, angles, side) for side in SIDES]
    back = 1 + bent.astype(np.int64) + 2 * turned
    arms = 1 + np.sum(raised, axis=0)
    load = np.full(n, owas_load(load_kg))
    return Owas(motion.time, back, arms, _legs(motion, angles.knees, bearing), load)


def _raised(body: BodyModel, motion: Motion, angles: PosturalAngles, side: str) -> Scores:
    """(n,) 1 where the elbow or the wrist is at the shoulder's level or above it."""
    upper, _, hand = parts_of(body).arms[side]
    height = SegmentPlacements(body, [upper, hand]).of(motion.q).shifts[:, 2]
    elbow_up = degrees(angles.arms[side].from_vertical) >= 90.0
    return (elbow_up | (height[1] >= height[0])).astype(np.int64)


def _legs(motion: Motion, knees: Mapping[str, FloatArray], bearing: Bearing) -> Scores:
    """Digit of the legs; the first that fits of kneeling, sitting, walking, standing."""
    flexion = np.array([degrees(knees[side]) for side in SIDES])
    both = np.all(flexion >= KNEE_BENT, axis=0)
    any_bent = np.any(flexion >= KNEE_BENT, axis=0)
    standing = np.where(any_bent, np.where(both, 4, 5), 2)
    on_one = np.where(flexion.min(axis=0) >= KNEE_BENT, 5, 3)
    legs = np.where(bearing.balanced, standing, np.where(both & bearing.both_legs, 4, on_one))
    kneeling = np.zeros(len(motion.time), dtype=bool)
    for number, name in enumerate(motion.contact_names):
        if name.endswith("knee"):
            kneeling |= motion.support[:, number]
    legs = np.where(bearing.walking, 7, legs)
    return np.where(kneeling, 6, np.where(bearing.seated, 1, legs)).astype(np.int64)
