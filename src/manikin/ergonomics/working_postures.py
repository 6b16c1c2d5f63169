"""Working postures and movements by EN 1005-4 ([EN1005-4]_): trunk, upper arms, head, neck, other joints.

The angle of each part falls into a zone, and a table says whether the zone is acceptable, conditionally
acceptable or not acceptable: as a static posture, for movements below two a minute, and for more frequent
ones. How often a job repeats a motion is not in the motion: where it is not known, both are told.

The printed standard was not at hand: zones and levels were taken from what quotes it, a guide of the German
accident insurers ([DGUV209-069]_), the help of an ergonomics program ([DELMIA]_), a study ([JOMT2020]_) and
two open programs, held against what is known of the standard here. :data:`SOURCES` says how many of them
give the zones of a part; the docs page on ergonomics says it by level, and where they differ. No second
source confirms rare movements of the trunk and the neck, the upper arm backwards, and the line of sight; none
at all twisting of the neck and the ends of other joints.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from manikin.body import BodyModel
from manikin.body.segments import SIDES
from manikin.ergonomics.body_parts import Bearing, Flags
from manikin.ergonomics.postural_angles import PosturalAngles
from manikin.ergonomics.rula_reba import Circumstances, Scores, band, degrees
from manikin.ergonomics.sight import NORMAL_LINE
from manikin.ergonomics.static_postures import STATIC, UPRIGHT, holds
from manikin.numerics.spatial import FloatArray

VERDICTS = {1: "acceptable", 2: "conditionally acceptable", 3: "not acceptable"}
"""Meaning of the levels."""

FREQUENT = 2.0
"""Movements a minute from which on they are frequent."""
VERY_FREQUENT = 10.0
"""Movements of a moderately raised upper arm a minute from which on they are not acceptable."""
MODERATE, FAR = 20.0, 60.0
"""Borders of the first three zones of trunk and upper arm [deg]."""
SEEN = 10.0
"""Beyond this bending to the side and twisting can be seen [deg].

So can, which is ours, that an upper arm is backwards or across the body, where the standard says 0: its zero
is an arm that hangs freely, whose elbow is some degrees behind the shoulder.
"""
SIGHT_BELOW = 40.0
"""Angle below the horizontal down to which a line of sight is acceptable [deg]."""
NECK_TWISTED = 45.0
"""Beyond this the neck is twisted [deg]."""
AT_END, SHORT = 0.9, 30.0
"""A joint is near the end of its range beyond this share of it; ends nearer to 0 than ``SHORT`` [deg], as of
a straight knee, do not count; ours."""
APART = 0.5
"""A part moves anew when it was in its first zone for this time [s]; ours."""
WATCHED = 60.0
"""A motion that lasts for this time shows how often a part moves [s]; ours."""

TABLE: Mapping[str, Scores] = {
    part: np.array(rows, dtype=np.int64)
    for part, rows in {
        "trunk": [[1, 1, 1], [2, 1, 3], [3, 2, 3], [2, 2, 3]],
        "trunk_aside": [[1, 1, 1], [3, 2, 3]],
        "upper_arm": [[1, 1, 1], [2, 1, 2], [3, 2, 3], [3, 2, 3]],
        "head": [[1, 1, 1], [3, 2, 3]],
        "neck_aside": [[1, 1, 1], [3, 2, 3]],
        "joints": [[1, 1, 1], [3, 2, 3]],
    }.items()
}
"""Level by part, zone, and how: static, rare, frequent.

Zones of the trunk: up to 20 degrees forward, up to 60, beyond, backwards; of an upper arm: raised up to 20,
up to 60, beyond, backwards or across the body. Of the others: near the middle, and beyond.
"""

SOURCES: Mapping[str, int] = {
    "trunk": 2, "trunk_aside": 2, "upper_arm": 2, "head": 1, "neck_aside": 1, "joints": 0,
}  # fmt: skip
"""Number of sources at hand that give the zones of a part, two standing for two or more.

What has none is told, but does not count in the level of the whole posture.
"""

SUPPORTED = "only with full support"
"""Condition of static postures that a support makes acceptable."""
TIMED = "only with full support, or no longer than ISO 11226 allows"
"""Condition of static postures of moderate angles."""
NOT_LONG = "not where the machine is used for long"
"""Condition of rare movements; the standard gives no time."""
NOT_TOO_OFTEN = f"below {VERY_FREQUENT:g} movements a minute, {NOT_LONG}"
"""Condition of frequent movements of a moderately raised upper arm."""


@dataclass(frozen=True, eq=False)
class PartPostures:
    """One part of the body over time, (n,) each.

    Attributes:
        kind: Key of :data:`TABLE`.
        zone: Number of the zone, from 1 on.
        static: Whether the part is held for longer than four seconds.
        supported: Whether it is fully supported.
        movements: How often it leaves its first zone.
        rate: Movements a minute; None where it is not known how often the motion is made.
        joint: Of the joints, the one that is longest near the end of its range; None if there is none.
    """

    kind: str
    zone: Scores
    static: Flags
    supported: Flags
    movements: int
    rate: float | None
    joint: str | None = None

    @property
    def rare(self) -> Scores:
        """(n,) level where the part moves less than twice a minute."""
        return self._level(1)

    @property
    def frequent(self) -> Scores:
        """(n,) level where it moves twice a minute or more."""
        level = self._level(2)
        too_often = self.rate is not None and self.rate >= VERY_FREQUENT
        return np.where((level == 2) & ~self.static, 3, level) if too_often else level

    @property
    def level(self) -> Scores | None:
        """(n,) level at the rate; None where it is not known."""
        if self.rate is None:
            return None
        return self.frequent if self.rate >= FREQUENT else self.rare

    def condition(self, frame: int, *, frequent: bool) -> str:
        """On which a frame is acceptable, where its level is 2."""
        if not self.static[frame]:
            return NOT_TOO_OFTEN if frequent else NOT_LONG
        return TIMED if self.zone[frame] == 2 else SUPPORTED

    def _level(self, column: int) -> Scores:
        table = TABLE[self.kind][self.zone - 1]
        static = np.where(self.supported & (table[:, 0] == 2), 1, table[:, 0])
        return np.where(self.static, static, table[:, column])


@dataclass(frozen=True, eq=False)
class WorkingPostures:
    """Zones and levels of a motion by part.

    Attributes:
        time: (n,) [s].
        parts: ``"trunk"``, ``"trunk_aside"``, ``"left_arm"``, ``"right_arm"``, ``"head"``, ``"neck_aside"``
            and ``"joints"``.
    """

    time: FloatArray
    parts: Mapping[str, PartPostures]

    @property
    def counted(self) -> dict[str, PartPostures]:
        """Parts that count in the level of the whole posture, those with a source."""
        return {name: part for name, part in self.parts.items() if SOURCES[part.kind]}

    @property
    def rare(self) -> Scores:
        """(n,) of the worst part that counts, where no part moves twice a minute."""
        return np.max([part.rare for part in self.counted.values()], axis=0)

    @property
    def frequent(self) -> Scores:
        """(n,) of the worst part that counts, where all move twice a minute or more."""
        return np.max([part.frequent for part in self.counted.values()], axis=0)

    @property
    def level(self) -> Scores | None:
        """(n,) of the worst part that counts as often as each moves; None where it is not known."""
        counted = self.counted.values()
        levels = [level for part in counted if (level := part.level) is not None]
        return np.max(levels, axis=0) if len(levels) == len(counted) else None

    def as_dict(self, weight: FloatArray) -> dict[str, Any]:
        """Plain values; frames stand for times (n,) [s]."""
        share, parts = weight / weight.sum(), self.counted
        rare = {name: one.rare for name, one in parts.items()}
        frequent = {name: one.frequent for name, one in parts.items()}
        known = {name: one.level for name, one in parts.items() if one.level is not None}
        often = {name: (one.rate or 0.0) >= FREQUENT for name, one in parts.items()}
        return {
            "rare": self._worst(rare, dict.fromkeys(parts, False), share),
            "frequent": self._worst(frequent, dict.fromkeys(parts, True), share),
            "known": self._worst(known, often, share) if len(known) == len(parts) else None,
            "parts": {name: _part(one, share) for name, one in self.parts.items()},
        }  # fmt: skip

    def _worst(
        self, levels: Mapping[str, Scores], often: Mapping[str, bool], share: FloatArray
    ) -> dict[str, Any]:
        """The worst level; the part that is longest at it, and from when on; the time at each level."""
        overall = np.max(list(levels.values()), axis=0)
        level = int(overall.max())
        name = max(levels, key=lambda part: float(share[levels[part] == level].sum()))
        frame = int((levels[name] == level).argmax())
        condition = self.parts[name].condition(frame, frequent=often[name]) if level == 2 else ""
        return {
            "max": level, "verdict": VERDICTS[level], "part": name, "max_at_s": float(self.time[frame]),
            "condition": condition,
            "share_of_time": {str(one): float(share[overall == one].sum()) for one in VERDICTS},
        }  # fmt: skip


def _part(one: PartPostures, share: FloatArray) -> dict[str, Any]:
    zones = range(1, len(TABLE[one.kind]) + 1)
    return {
        "zone_share_of_time": {str(zone): float(share[one.zone == zone].sum()) for zone in zones},
        "static_share_of_time": float(share[one.static].sum()), "movements": one.movements,
        "movements_per_minute": one.rate, "rare": int(one.rare.max()), "frequent": int(one.frequent.max()),
        "known": None if one.level is None else int(one.level.max()), "joint": one.joint,
        "sources": SOURCES[one.kind],
    }  # fmt: skip


def working_postures(
    body: BodyModel, time: FloatArray, q: FloatArray, angles: PosturalAngles, bearing: Bearing,
    given: Circumstances,
) -> WorkingPostures:  # fmt: skip
    """Judge the postures and movements of a motion.

    The trunk of somebody seated is supported where it is said to be, an arm where its hand carries it. The
    line of sight is 15 degrees below straight ahead of the head ([MIL-STD-1472]_), so that its zone reaches
    from a head 15 degrees backwards to 25 degrees forward, where ISO 11226 has its first limit. A trunk up to
    5 degrees backwards is upright, as for ISO 11226 (ours).

    Args:
        body: A human.
        time: (n,) [s].
        q: (n, nq) configurations.
        angles: Their angles.
        bearing: What carries the weight and the arms.
        given: How often the motion is made (``cycles_per_minute``), support of the trunk.
    """
    none = np.zeros(len(time), dtype=bool)
    trunk, aside = degrees(angles.trunk_flexion), _beyond(angles.trunk_side_bend, angles.trunk_twist)
    sight = degrees(angles.head_inclination) + NORMAL_LINE
    side_bend, twist = (np.abs(degrees(one)) for one in (angles.neck_side_bend, angles.neck_twist))
    neck = np.maximum(side_bend - SEEN, twist - NECK_TWISTED)
    supported = bearing.seated if given.trunk_supported else none
    back = np.where(trunk < -UPRIGHT, 4, band(trunk, MODERATE, FAR))
    off_sight = 1 + ((sight > SIGHT_BELOW) | (sight < 0.0))
    judged = {
        "trunk": ("trunk", trunk, back, supported),
        "trunk_aside": ("trunk_aside", aside, band(aside, SEEN), none),
        "head": ("head", sight, off_sight, none),
        "neck_aside": ("neck_aside", neck, band(neck, 0.0), none),
    }
    for side in SIDES:
        arm = angles.arms[side]
        raised = degrees(arm.from_vertical)
        zone = arm_zone(raised, degrees(arm.ahead), degrees(arm.beside))
        judged[f"{side}_arm"] = ("upper_arm", raised, zone, bearing.arms[side])
    ends = joints_at_end(body, q)
    any_end = np.any(list(ends.values()), axis=0)
    judged["joints"] = ("joints", 100.0 * any_end, 1 + any_end.astype(np.int64), none)
    longest = max(ends, key=lambda joint: int(ends[joint].sum())) if any_end.any() else None
    parts = {}
    for name, (kind, signal, zone, carried) in judged.items():
        count = movements(time, zone > 1)
        steady, held_zone = _held(time, signal, zone)
        rate, joint = _rate(time, count, given), longest if kind == "joints" else None
        parts[name] = PartPostures(kind, held_zone, steady, carried, count, rate, joint)
    return WorkingPostures(time, parts)


def arm_zone(raised: FloatArray, ahead: FloatArray, beside: FloatArray) -> Scores:
    """(n,) zone of an upper arm by its angles from the vertical, forward, and outward [deg]."""
    wrong_way = np.minimum(ahead, beside) < -SEEN
    return np.where(wrong_way & (raised <= FAR), 4, band(raised, MODERATE, FAR))


def joints_at_end(body: BodyModel, q: FloatArray) -> dict[str, Flags]:
    """(n,) whether each joint of forearms, wrists and legs is near the end of its range, by its name."""
    found = {}
    for name in body.joint_names:
        if not any(part in name for part in ("elbow", "forearm", "wrist", "hip", "knee", "ankle")):
            continue
        angle, number = q[:, 7 + body.joint_index(name)], body.joint_index(name)
        lower, upper = float(body.lower[number]), float(body.upper[number])
        short = np.deg2rad(SHORT)
        above = angle > AT_END * upper if upper >= short else np.zeros(len(q), dtype=bool)
        below = angle < AT_END * lower if lower <= -short else np.zeros(len(q), dtype=bool)
        found[name] = above | below
    return found


def movements(time: FloatArray, out: Flags) -> int:
    """How often a part leaves its first zone, at times (n,) [s], being out of it or not (n,)."""
    count, since = 0, -np.inf
    for moment, beyond in zip(time.tolist(), out.tolist(), strict=True):
        if beyond:
            count += moment - since > APART
            since = moment
    return count


def _rate(time: FloatArray, count: int, given: Circumstances) -> float | None:
    """Movements a minute: by how often the motion is made, or as a long motion shows them."""
    minutes = float(time[-1] - time[0]) / 60.0
    if (cycles := given.cycles_per_minute) is not None:
        return count * cycles
    return count / minutes if 60.0 * minutes >= WATCHED else None


def _held(time: FloatArray, signal: FloatArray, zone: Scores) -> tuple[Flags, Scores]:
    """(n,) whether each frame is of a static posture, and the zones, of a static posture its commonest."""
    static, found = np.zeros(len(time), dtype=bool), zone.copy()
    for rows in holds(time, signal):
        if time[rows][-1] - time[rows][0] > STATIC:
            static[rows] = True
            found[rows] = np.bincount(zone[rows]).argmax()
    return static, found


def _beyond(*angles: FloatArray) -> FloatArray:
    """(n,) largest size of angles [deg]."""
    return np.max([np.abs(degrees(angle)) for angle in angles], axis=0)
