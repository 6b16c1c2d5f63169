"""Markers that are not where their name says: found by their speed and by how far they are off the body.

A marker jumps to a reflection, is exchanged with another one, or stays where it was lost. Its path then has
a step that no motion makes, and once the body follows all other markers it is far from its place on its
segment. Both are needed: a body that does not fit is off without steps, a gap or an impact makes a step and
nothing is off. Spikes, frozen markers and those that are displaced for longer are taken out, so that short
gaps are filled and in longer ones the marker does not count. Two markers each of which is at the other's
place are exchanged. What is judged is where a marker was recorded, never a filled gap; soft tissue, which
moves by some centimetres, is left as it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.kinematics.point_targets import PointTargets, PostureCost
from manikin.kinematics.tracking import search
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray
from manikin.recordings.readers.markers import LONGEST_GAP, MarkerRecording

FASTEST = 30.0
"""No marker on a person is faster [m/s]: feet of sprinters and hands that throw reach 20 to 25."""

STEP, FAR, TIMES_USUAL, MOSTLY = 0.02, 0.035, 3.0, 0.7
"""Step of a marker off its smooth path from which on a new piece of it begins [m]; distance from its place
beyond its median, and multiple of the median, above which a sample is off; share of a piece that is off."""

SWAPPED, EXCHANGED_SHARE = 0.03, 0.35
"""Distance of both from their places above which two markers may be swapped [m], and the share of these
distances that is left once they are exchanged."""

FROZEN_FRAMES, FROZEN_TIME, FROZEN_PATH = 3, 0.05, 0.03
"""Frames and time [s] for which a marker stays exactly where it is while its place moves that far [m]."""

MOST_OFF, ROUNDS, WORST = 0.5, 8, 0.6
"""Share of the markers seen from which on a frame says nothing; rounds in which markers are taken out of
frames, and of each frame those that are off by more than this share of the farthest."""


@dataclass(frozen=True)
class Repair:
    """Frames, from ``first`` up to, not with, ``stop``, in which a marker or joint was not in its place.

    Attributes:
        kind: ``"spike"``, ``"displaced"`` for longer than a gap that is filled, ``"frozen"``, ``"swap"``,
            ``"gap"`` or, of a joint of a skeleton that does not come back at once, ``"jump"``.
        distance: The largest from its place on the body, or of the joint farthest from one that jumps [m];
            None in a gap.
        outcome: ``"filled"``, ``"left out"``, ``"exchanged"`` or ``"as recorded"``.
        other: The marker that it was swapped with, or empty.
    """

    marker: str
    kind: str
    first: int
    stop: int
    distance: float | None
    outcome: str
    other: str = ""


def without_jumps(recording: MarkerRecording, names: Sequence[str]) -> MarkerRecording:
    """The recording without samples of named markers that can only be reached faster than a person moves.

    Of each marker's pieces between jumps those are kept that can follow each other and last longest.
    InputError if more than half of the markers seen jump at once for longer than a gap that can be filled.
    """
    places = [recording.marker_index(name) for name in names]
    jumped = np.zeros((len(recording), len(names)), dtype=bool)
    for number, place in enumerate(places):
        frames = np.flatnonzero(recording.seen[:, place])
        jumped[frames, number] = ~_longest_chain(recording.positions[frames, place], frames / recording.rate)
    if not jumped.any():
        return recording
    lost = jumped.sum(axis=1) > MOST_OFF * recording.seen[:, places].sum(axis=1)
    for first, stop in mask_runs(lost):
        if stop - first > LONGEST_GAP * recording.rate:
            wrong = f"{int(jumped[first:stop].any(axis=0).sum())} of {len(names)} markers jump away in frames"
            valid = "valid: frames without them, as with --frames"
            raise InputError(f"recording {recording.name!r}: {wrong} {first} to {stop - 1}; {valid}")
    positions = np.array(recording.positions)
    positions[:, places] = np.where(jumped[..., None], np.nan, positions[:, places])
    return replace(recording, positions=positions)


def _longest_chain(positions: FloatArray, time: FloatArray) -> NDArray[np.bool_]:
    """(n,) samples kept of (n, 3) positions [m]: pieces without jump, each reachable from the one before."""
    if len(time) < 2:
        return np.ones(len(time), dtype=bool)
    fast = np.linalg.norm(np.diff(positions, axis=0), axis=1) > FASTEST * np.diff(time)
    if not fast.any():
        return np.ones(len(time), dtype=bool)
    begins = np.append(0, np.flatnonzero(fast) + 1)
    ends = np.append(begins[1:], len(time)) - 1
    total, before = (ends - begins + 1).astype(np.float64), np.full(len(begins), -1)
    for number in range(1, len(begins)):
        away = np.linalg.norm(positions[begins[number]] - positions[ends[:number]], axis=1)
        reached = away <= FASTEST * (time[begins[number]] - time[ends[:number]])
        if reached.any():
            before[number] = int(np.argmax(np.where(reached, total[:number], -1.0)))
            total[number] += total[before[number]]
    kept, number = np.zeros(len(time), dtype=bool), int(np.argmax(total))
    while number >= 0:
        kept[begins[number] : ends[number] + 1] = True
        number = int(before[number])
    return kept


class Cleaning:
    """A recording beside the body that followed it, and what of it is to be repaired.

    Attributes:
        off: (n, k) samples that are far from their places.
        frozen: (n, k) samples of markers that stay while their places move.
        swaps: Pairs of markers with the (n,) frames in which they are exchanged.
    """

    def __init__(
        self, recording: MarkerRecording, calm: MarkerRecording, body: BodyModel, targets: PointTargets,
        q: FloatArray, first: int,
    ) -> None:  # fmt: skip
        """Judge a recording.

        Args:
            recording: As it was read.
            calm: The same without jumps, which the body followed.
            body: The body that followed it.
            targets: Points followed, by name.
            q: (n, nq) postures found.
            first: Frame of the recording at the first posture.
        """
        self._names, self._rate = targets.names, recording.rate
        frames, places = slice(first, first + len(q)), [recording.marker_index(n) for n in targets.names]
        self._frames, self._places, self._recording = frames, places, recording
        self._observed = recording.positions[frames, places]
        self._cost = PostureCost(body, targets)
        self._q = np.array(q)
        self._expected = self._cost.points(self._q)
        distance = self._distance()
        calm_seen = calm.seen[frames, places]
        usual = np.nanmedian(np.where(calm_seen, distance, np.nan), axis=0)
        self._limit = np.maximum(usual + FAR, TIMES_USUAL * usual)
        self._pieces = _pieces(self._observed)
        self._steps = self._pieces.max(axis=0) > 0
        self.frozen = self._find_frozen()
        self._take_out(np.isnan(distance) | ~calm_seen | self.frozen)
        distance = self._distance()
        self.swaps = self._find_swaps(distance, usual)
        swapped = np.zeros_like(self.frozen)
        for one, other, rows in self.swaps:
            swapped[rows, one] = swapped[rows, other] = True
        self.off = self._off_pieces((distance > self._limit) & ~swapped, ~(swapped | self.frozen))
        self._final = distance

    @property
    def needed(self) -> bool:
        """Whether anything is to be repaired."""
        return bool(self.off.any() or self.frozen.any() or self.swaps)

    def repaired(self) -> MarkerRecording:
        """The recording with swaps exchanged and other samples that are off taken out."""
        observed = np.array(self._observed)
        for one, other, rows in self.swaps:
            observed[rows, one], observed[rows, other] = (
                self._observed[rows, other],
                self._observed[rows, one],
            )
        observed[self.off | self.frozen] = np.nan
        positions = np.array(self._recording.positions)
        positions[self._frames, self._places] = observed
        return replace(self._recording, positions=positions)

    def repairs(self, cleaned: MarkerRecording) -> tuple[Repair, ...]:
        """What was done, in the order of time; ``cleaned`` has its gaps filled."""
        start, found = self._frames.start, list[Repair]()
        for one, other, rows in self.swaps:
            mask = np.zeros(len(self._q), dtype=bool)
            mask[rows] = True
            for first, stop in mask_runs(mask):
                away = float(np.nanmax(self._final[first:stop, [one, other]]))
                found.append(
                    Repair(
                        self._names[one], "swap", start + first, start + stop, away, "exchanged",
                        self._names[other],
                    )
                )  # fmt: skip
        for kind, mask in (("", self.off), ("frozen", self.frozen)):
            for number in np.flatnonzero(mask.any(axis=0)):
                for first, stop in mask_runs(mask[:, number]):
                    away = float(np.nanmax(self._final[first:stop, number]))
                    known = ~np.isnan(
                        cleaned.positions[start + first : start + stop, self._places[number], 0]
                    )
                    outcome = "filled" if known.all() else "left out"
                    short = stop - first <= int(LONGEST_GAP * self._rate + 1e-6)
                    named = kind or ("spike" if short else "displaced")
                    found.append(
                        Repair(self._names[number], named, start + first, start + stop, away, outcome)
                    )
        return tuple(sorted(found, key=lambda one: (one.first, one.marker)))

    def _distance(self) -> FloatArray:
        """(n, k) of the markers as recorded from their places [m]; NaN where one was not seen."""
        return np.linalg.norm(self._observed - self._expected, axis=2)

    def _take_out(self, taken: NDArray[np.bool_]) -> None:
        """Postures of frames with markers off after a step, without the farthest, until none is left."""
        near = np.flatnonzero(~((self._distance() > self._limit) & self._steps & ~taken).any(axis=1))
        for _ in range(ROUNDS):
            distance = np.where(taken | ~self._steps, np.nan, self._distance())
            far = distance > self._limit
            rows = np.flatnonzero(far.any(axis=1))
            if not rows.size:
                return
            worst = np.nanmax(distance[rows], axis=1, keepdims=True)
            taken[rows] |= far[rows] & (distance[rows] > WORST * worst)
            rows = rows[(~taken[rows]).sum(axis=1) >= 3]
            if not rows.size:
                return
            nearest = near[np.abs(near[None] - rows[:, None]).argmin(axis=1)] if near.size else rows
            wanted = np.where(taken[rows][..., None], np.nan, self._observed[rows])
            starts = self._q[nearest]
            self._q[rows] = search(self._cost, starts, wanted, starts)[0]
            self._expected[rows] = self._cost.points(self._q[rows])

    def _off_pieces(self, far: NDArray[np.bool_], judged: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n, k) samples of pieces that are mostly far, unless that is most of what a frame sees."""
        off = np.zeros_like(far)
        for number in np.flatnonzero(self._steps & far.any(axis=0)):
            piece, kept = self._pieces[:, number], judged[:, number] & (self._pieces[:, number] >= 0)
            counts = np.bincount(piece[kept], minlength=int(piece.max()) + 1)
            hits = np.bincount(piece[kept], weights=far[kept, number], minlength=len(counts))
            off[:, number] = kept & (hits > MOSTLY * np.maximum(counts, 1))[piece]
        fails = off.sum(axis=1) > MOST_OFF * (self._pieces >= 0).sum(axis=1)
        return off & ~fails[:, None]

    def _find_frozen(self) -> NDArray[np.bool_]:
        """(n, k) runs of exactly equal positions in which the place on the body moves."""
        found = np.zeros(self._observed.shape[:2], dtype=bool)
        same = np.all(np.diff(self._observed, axis=0) == 0.0, axis=2)
        for number in np.flatnonzero(same.any(axis=0)):
            for first, stop in mask_runs(same[:, number]):
                place = self._expected[first : stop + 1, number]
                long = stop + 1 - first >= max(FROZEN_FRAMES, FROZEN_TIME * self._rate)
                if long and np.linalg.norm(np.ptp(place, axis=0)) > FROZEN_PATH:
                    # The first of equal samples was seen, unless the marker was never seen before.
                    found[first + (first > 0) : stop + 1, number] = True
        return found

    def _find_swaps(
        self, distance: FloatArray, usual: FloatArray
    ) -> list[tuple[int, int, NDArray[np.int64]]]:
        """Pairs of markers and the frames in which each is at the other's place."""
        with np.errstate(invalid="ignore"):
            apart = (distance > np.maximum(SWAPPED, 2.0 * usual)) & ~self.frozen & self._steps
        found = []
        for one, other in _pairs(apart):
            rows = np.flatnonzero(apart[:, one] & apart[:, other])
            crossed = [
                np.linalg.norm(self._observed[rows, a] - self._expected[rows, b], axis=1)
                for a, b in ((one, other), (other, one))
            ]
            before = distance[rows, one] + distance[rows, other]
            kept = rows[crossed[0] + crossed[1] < EXCHANGED_SHARE * before]
            if kept.size:
                found.append((one, other, kept))
                apart[kept, one] = apart[kept, other] = False
        return found


def _pieces(observed: FloatArray) -> NDArray[np.int64]:
    """(n, k) piece of its marker's path in which each sample is, from 0; -1 where it was not seen.

    A step from one sample to the next is that of a smooth path if it is the mean of the velocities before
    and after it, times its duration; the error of that is of the third order in the duration.
    """
    found = np.full(observed.shape[:2], -1, dtype=np.int64)
    for number in range(observed.shape[1]):
        frames = np.flatnonzero(~np.isnan(observed[:, number, 0]))
        if not frames.size:
            continue
        found[frames, number] = 0
        if len(frames) > 3:
            time = np.diff(frames)[:, None]
            velocity = np.diff(observed[frames, number], axis=0) / time
            around = np.concatenate([velocity[:1], velocity, velocity[-1:]])
            around[0], around[-1] = velocity[1], velocity[-2]
            off_path = time * (velocity - 0.5 * (around[:-2] + around[2:]))
            found[frames[1:], number] = np.cumsum(np.linalg.norm(off_path, axis=1) > STEP)
    return found


def _pairs(apart: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Pairs of columns that are ever true together."""
    both = np.triu(apart.T.astype(np.int64) @ apart.astype(np.int64), 1)
    return [(one, other) for one, other in np.argwhere(both).tolist()]


def gaps_of(recording: MarkerRecording, filled: MarkerRecording, names: Sequence[str]) -> tuple[Repair, ...]:
    """Gaps in which some markers were not seen, and whether they are filled."""
    found = []
    for gap in (gap for gap in recording.gaps if gap.marker in names):
        known = ~np.isnan(filled.marker(gap.marker)[gap.first : gap.stop, 0])
        outcome = "filled" if known.all() else "left out"
        found.append(Repair(gap.marker, "gap", gap.first, gap.stop, None, outcome))
    return tuple(found)
