"""Static postures by ISO 11226 ([ISO11226]_): trunk, head and upper arms, with the times they may be held.

A posture is static where it is held for longer than four seconds; what moves is left to the other methods.
Each part is acceptable up to a first angle, for a limited time up to a second one, and not recommended
beyond; between both the longest acceptable time falls linearly. Twisting and bending to the side are not
recommended where they can clearly be seen, beyond 10 degrees (ours). The angles and times were taken from
implementations that quote the standard, not from its printed text. Its clauses on hands, elbows, knees and
support are not here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body.segments import SIDES
from manikin.ergonomics.body_parts import Flags
from manikin.ergonomics.postural_angles import PosturalAngles
from manikin.ergonomics.rula_reba import TURNED, Scores, degrees
from manikin.numerics.spatial import FloatArray

STATIC = 4.0
"""Time from which on a posture is static [s]."""
STEADY = 5.0
"""A posture is held as long as its angle stays this near to where it began [deg]; ours."""

VERDICTS = {0: "moving", 1: "acceptable", 2: "held for too long", 3: "not recommended"}
"""Meaning of the levels."""


@dataclass(frozen=True)
class HoldingLimit:
    """Angles of one part and the times for which they may be held.

    Attributes:
        least: Below this the posture is not recommended [deg].
        free: Up to this it is acceptable [deg].
        most: Beyond this it is not recommended [deg].
        longest, shortest: Longest acceptable times at ``free`` and at ``most`` [s].
    """

    least: float
    free: float
    most: float
    longest: float
    shortest: float

    def time(self, angle: FloatArray) -> FloatArray:
        """(n,) longest acceptable time of angles [deg], infinite, limited or 0 [s]."""
        between = np.interp(angle, [self.free, self.most], [self.longest, self.shortest])
        limited = np.where(angle <= self.free, np.inf, between)
        return np.where((angle < self.least) | (angle > self.most), 0.0, limited)


LIMITS: Mapping[str, HoldingLimit] = {
    "trunk": HoldingLimit(0.0, 20.0, 60.0, 240.0, 60.0),
    "head": HoldingLimit(0.0, 25.0, 85.0, 480.0, 60.0),
    "upper_arm": HoldingLimit(0.0, 20.0, 60.0, 180.0, 60.0),
}
"""Of the inclination of trunk and head and of the elevation of an upper arm, without support."""

UPRIGHT = 5.0
"""Trunk and head that lean backwards by no more than this are upright [deg]; ours, the standard says 0."""


@dataclass(frozen=True, eq=False)
class StaticPostures:
    """Verdicts by part, keys of :data:`VERDICTS`.

    Attributes:
        time: (n,) [s].
        parts: (n,) level of ``"trunk"``, ``"head"``, ``"left_arm"`` and ``"right_arm"``.
        held: (n,) how long each part has been still at the end of the hold that a frame is in [s].
    """

    time: FloatArray
    parts: Mapping[str, Scores]
    held: Mapping[str, FloatArray]

    @property
    def level(self) -> Scores:
        """(n,) of the worst part."""
        return np.max(list(self.parts.values()), axis=0)

    def as_dict(self, weight: FloatArray) -> dict[str, Any]:
        """Plain values; frames stand for times (n,) [s]."""
        share = weight / weight.sum()
        worst = max(self.parts, key=lambda part: int(self.parts[part].max()))
        frame = int(self.parts[worst].argmax())
        level = int(self.parts[worst][frame])
        return {
            "max": level, "max_at_s": float(self.time[frame]), "part": worst, "verdict": VERDICTS[level],
            "longest_hold_s": {part: float(held.max()) for part, held in self.held.items()},
            "share_of_time": {str(one): float(share[self.level == one].sum()) for one in VERDICTS},
        }  # fmt: skip


def static_postures(time: FloatArray, angles: PosturalAngles) -> StaticPostures:
    """Find the static postures of a motion and judge them."""
    trunk, head = degrees(angles.trunk_flexion), degrees(angles.head_inclination)
    turned_trunk = _turned(angles.trunk_twist, angles.trunk_side_bend)
    turned_head = _turned(angles.neck_twist, angles.neck_side_bend)
    lean = np.rad2deg(np.arccos(np.cos(angles.trunk_flexion) * np.cos(angles.trunk_side_bend)))
    found = {
        "trunk": _judged(time, "trunk", _upright(np.where(trunk < 0.0, -lean, lean)), turned_trunk),
        "head": _judged(time, "head", _upright(head), turned_head),
    }
    for side in SIDES:
        raised = degrees(angles.arms[side].from_vertical)
        found[f"{side}_arm"] = _judged(time, "upper_arm", raised, np.zeros(len(time), dtype=bool))
    return StaticPostures(
        time, {part: level for part, (level, _) in found.items()},
        {part: held for part, (_, held) in found.items()},
    )  # fmt: skip


def _turned(*angles: FloatArray) -> Flags:
    return np.any([np.abs(degrees(angle)) > TURNED for angle in angles], axis=0)


def _upright(angle: FloatArray) -> FloatArray:
    """The angle, 0 where it is upright."""
    return np.where(np.abs(angle) <= UPRIGHT, 0.0, angle)


def _judged(time: FloatArray, part: str, angle: FloatArray, turned: Flags) -> tuple[Scores, FloatArray]:
    """Level (n,) of one part and the lengths (n,) of its holds [s]."""
    limit, level, held = LIMITS[part], np.zeros(len(time), dtype=np.int64), np.zeros(len(time))
    for rows in holds(time, angle):
        length = float(time[rows][-1] - time[rows][0])
        held[rows] = length
        if length <= STATIC:
            continue
        longest = float(limit.time(np.median(angle[rows], keepdims=True))[0])
        bad = longest == 0.0 or bool(np.mean(turned[rows]) > 0.5)
        level[rows] = 3 if bad else 2 if length > longest else 1
    return level, held


def holds(time: FloatArray, angle: FloatArray) -> list[slice]:
    """Stretches of frames in which an angle (n,) [deg] stays within :data:`STEADY` of where each begins."""
    found, first = [], 0
    for frame in range(1, len(time) + 1):
        if frame == len(time) or abs(angle[frame] - angle[first]) > STEADY:
            found.append(slice(first, frame))
            first = frame
    return found
