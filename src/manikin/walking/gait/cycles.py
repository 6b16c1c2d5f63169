"""Walking cycles in a recorded motion: when feet touch the floor, and from which toe-off to which to cut."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.kinematics.leg_kinematics import LegKinematics
from manikin.numerics.signals import SHARES, low_passed
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.marker_sets import SIDES
from manikin.walking.gait.stance_foot import Sole, borders

SLOW, SLOW_SHARE = 0.3, 0.15
"""A point slower than this [m/s], or than this share of its fastest [-], may stand on the floor."""

SHORTEST_GAP, SHORTEST_CONTACT = 0.08, 0.06
"""Shortest swing and stance of a foot [s]."""

SHORTEST_CYCLE, LONGEST_CYCLE = 0.45, 2.0
"""Accepted durations of cycles [s]."""


@dataclass(frozen=True, eq=False)
class FootEvents:
    """Instants of toe-off and of landing of a foot, in order [s]."""

    off: FloatArray
    on: FloatArray


@dataclass(frozen=True)
class CycleCut:
    """A cycle in a recording.

    Attributes:
        start: Toe-off of ``foot`` [s].
        end: Its next toe-off [s].
        foot: ``"left"`` or ``"right"``.
        landing: Landing of that foot [s].
        other_off: Toe-off of the other foot [s].
        other_landing: Landing of the other foot before that [s]; before the start in walks, after it in runs.
    """

    start: float
    end: float
    foot: str
    landing: float
    other_off: float
    other_landing: float

    @property
    def period(self) -> float:
        """Duration of the cycle [s]."""
        return self.end - self.start


def foot_events(body: BodyModel, q: FloatArray, rate: float) -> dict[str, FootEvents]:
    """Toe-offs and landings of both feet of a human in (n, nq) postures at a rate [Hz].

    A foot stands while its heel or the ball of the foot is slow and low.
    """
    events = {}
    for side, (heel, ball) in sole_points(body, q).items():
        contact = _stands(heel, rate) | _stands(ball, rate)
        contact = _without_short(contact, False, round(SHORTEST_GAP * rate))
        contact = _without_short(contact, True, round(SHORTEST_CONTACT * rate))
        change = np.diff(contact.astype(np.int8))
        events[side] = FootEvents(*((np.flatnonzero(change == sign) + 1) / rate for sign in (-1, 1)))
    return events


def sole_points(body: BodyModel, q: FloatArray) -> dict[str, tuple[FloatArray, FloatArray]]:
    """(n, 3) positions of each foot's heel and ball, on the sole [m], by side."""
    pelvis, sole = Rotation.from_quat(q[:, 3:7]).as_matrix(), Sole.of_body(body)
    points = {}
    for side, foot, ankle in zip(SIDES, *LegKinematics(body).feet(pelvis, q[:, :3], q[:, 7:]), strict=True):
        below = ankle - sole.depth * foot[:, :, 2]
        points[side] = (below + sole.heel * foot[:, :, 0], below + sole.ball * foot[:, :, 0])
    return points


def cycle_cuts(events: Mapping[str, FootEvents], begin: float, end: float) -> list[CycleCut]:
    """Cycles of either foot of which at least half lies in a window from ``begin`` to ``end`` [s].

    Of a window shorter than the cycle, half must be covered. Where a foot makes one step only, as in a single
    sidestep, the cycle ends when the other foot has followed.
    """
    cuts = [cut for foot in SIDES for cut in (*_whole(events, foot), *_single(events, foot))]
    return [
        cut
        for cut in cuts
        if SHORTEST_CYCLE <= cut.period <= LONGEST_CYCLE
        and min(cut.end, end) - max(cut.start, begin) >= 0.5 * min(cut.period, end - begin)
    ]


def _whole(events: Mapping[str, FootEvents], foot: str) -> Iterator[CycleCut]:
    """From one toe-off to the next, with one toe-off of the other foot between."""
    this, other = events[foot], events[SIDES[1 - SIDES.index(foot)]]
    for start, end in pairwise(this.off):
        landings = this.on[(this.on > start) & (this.on < end)]
        offs = other.off[(other.off > start) & (other.off < end)]
        if len(landings) and len(offs) == 1:
            yield _cut(start, end, foot, landings[-1], offs[0], other)


def _single(events: Mapping[str, FootEvents], foot: str) -> Iterator[CycleCut]:
    """One step of this foot from rest, followed by one of the other; the next would begin at once."""
    this, other = events[foot], events[SIDES[1 - SIDES.index(foot)]]
    if len(this.off) != 1 or not len(other.off):
        return
    landings = this.on[this.on > this.off[0]]
    offs = other.off[other.off > this.off[0]]
    if len(landings) and len(offs):
        ends = other.on[(other.on > offs[0]) & (other.on > landings[0])]
        if len(ends):
            yield _cut(this.off[0], ends[0], foot, landings[0], offs[0], other)


def _cut(
    start: float, end: float, foot: str, landing: float, other_off: float, other: FootEvents
) -> CycleCut:
    before = other.on[(other.on < other_off) & (other.on > other_off - (end - start))]
    # A recording that begins in the other foot's stance: both feet are taken to swing equally long.
    landed = before[-1] if len(before) else landing + other_off - end
    return CycleCut(float(start), float(end), foot, float(landing), float(other_off), float(landed))


def _stands(point: FloatArray, rate: float) -> NDArray[np.bool_]:
    smooth = low_passed(point, min(10.0 / (0.5 * rate), 0.95), SHARES, padding=9)
    speed = np.linalg.norm(np.gradient(smooth, 1.0 / rate, axis=0), axis=1)
    slow = speed < max(SLOW, SLOW_SHARE * float(np.percentile(speed, 95)))
    return slow & (smooth[:, 2] < np.percentile(smooth[:, 2], 5) + 0.06)


def _without_short(values: NDArray[np.bool_], kind: bool, least: int) -> NDArray[np.bool_]:
    """Runs of ``kind`` shorter than this many frames, apart from those at the ends, become the other kind."""
    kept = values.copy()
    for first, last in pairwise(borders(values)):
        if values[first] == kind and last - first < least and first > 0 and last < len(values):
            kept[first:last] = not kind
    return kept
