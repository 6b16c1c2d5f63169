"""Recorded markers as a motion of our human.

A person's lengths and the first postures follow from joint centres (:mod:`manikin.mocap.marker_centres`).
On some frames of these postures every marker of a known segment is placed on our human where it is seen on
average; postures that follow the markers and places of the markers are then improved in turn, and at last all
frames follow the markers themselves.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from manikin.body import BodyModel
from manikin.errors import InputError
from manikin.mocap.follow import follow, improved
from manikin.mocap.marker_centres import check_sides, landmarks, marker_centres, pelvis_axes
from manikin.mocap.marker_guides import placing_targets
from manikin.mocap.marker_sets import MarkerSet, marker_set
from manikin.mocap.markers import MarkerRecording
from manikin.mocap.proportions import human_of, middle
from manikin.mocap.reconstruction import Reconstruction
from manikin.mocap.segment_placements import SegmentPlacements
from manikin.mocap.targets import Targets
from manikin.spatial import FloatArray

PLACING_FRAMES = 40
"""Frames on which markers are placed."""

ROUNDS = 2
"""Times that postures and places are improved in turn."""

LEAST_SEEN = 0.5
"""Share of the markers followed that the first and the last frame see."""

COMPLETE = 0.9
"""Markers are placed on frames that see this share of what the best frame sees."""


def centres_of_markers(recording: MarkerRecording) -> dict[str, FloatArray]:
    """(n, 3) joint centres [m] by segment, NaN where one is not known.

    Raises:
        InputError: If the pelvis is not marked, or left and right are swapped.
    """
    return _Marked(recording).centres


def reconstruct_markers(
    recording: MarkerRecording, body: BodyModel | None, sex: str, mass: float | None
) -> Reconstruction:
    """Motion of our human that follows markers; see :func:`manikin.mocap.reconstruct.reconstruct`.

    Short gaps are filled (:mod:`manikin.mocap.gaps`); in longer ones a marker does not count. Frames at the
    ends that see less than half of the markers are left out. Segments without markers stay as in standing.
    """
    marked = _Marked(recording)
    subject = recording.subject
    if body is None:
        body = human_of(marked.centres, sex, subject.mass if mass is None else mass, subject.stature)
    placed = _placed(marked, body)
    filled, seen = placed.positions, ~np.isnan(placed.positions[..., 0])
    enough = np.flatnonzero(seen.mean(axis=1) >= LEAST_SEEN)
    first, stop = int(enough[0]), int(enough[-1]) + 1
    if stop - first < 2:
        raise InputError(
            f"recording {recording.name!r} sees half of its markers in one frame only; valid: in two at least"
        )
    starts = _starts(body, marked)[first:stop]
    wanted = Targets(placed.names, placed.segments, placed.points, filled[first:stop], placed.weights)
    q, residual = follow(body, wanted, starts, recording.rate)
    recorded = recording.chosen(placed.names).positions[first:stop]
    time = np.arange(stop - first) / recording.rate
    followed = {*placed.names}
    return Reconstruction(
        body, time, q, Targets(placed.names, placed.segments, placed.points, recorded, placed.weights),
        np.where(np.isnan(recorded[..., 0]), np.nan, residual), first,
        tuple(name for name in recording.marker_names if name not in followed),
        tuple(s.name for s in body.segments if s.hinges and not _told(body, s.name, {*placed.segments})),
    )  # fmt: skip


class _Marked:
    """What the markers of a recording tell by their names."""

    def __init__(self, recording: MarkerRecording) -> None:
        where = f"recording {recording.name!r}"
        if not recording.seen.any():
            raise InputError(f"{where} sees no marker in any frame; valid: markers that are seen")
        self.recording = recording.with_gaps_filled()
        self.set: MarkerSet = marker_set(self.recording)
        self.marks = landmarks(self.recording, self.set)
        self.pelvis = pelvis_axes(self.marks, where)
        check_sides(self.marks, self.pelvis, where)
        self.centres = marker_centres(self.marks, self.pelvis, recording.subject, where)


def _placed(marked: _Marked, body: BodyModel) -> Targets:
    """The markers that can be followed, at their places on the body, in all frames."""
    recording = marked.recording
    wanted, pelvis = placing_targets(recording, marked.set, body, marked.marks, marked.centres, marked.pelvis)
    names = tuple(marked.set.segments)
    positions = recording.chosen(names).positions
    frames = _frames(np.isnan(wanted.positions[..., 0]), np.isnan(positions[..., 0]))
    names, positions = _seen_in(frames, names, positions)
    segments = tuple(marked.set.segments[name] for name in names)
    first = _present(wanted, frames)
    q, _ = follow(body, first, _starts(body, marked, pelvis)[frames])
    for number in range(ROUNDS + 1):
        points = _local(body, q, segments, positions[frames])
        placed = Targets(names, segments, points, positions, np.ones(len(names)))
        if number < ROUNDS:
            here = Targets(names, segments, points, positions[frames], placed.weights)
            q = improved(body, here, q)
    return placed


def _frames(unknown: NDArray[np.bool_], unseen: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Frames that see most targets and markers, spread evenly."""
    known = (~unknown).sum(axis=1) + (~unseen).sum(axis=1)
    good = np.flatnonzero((known >= COMPLETE * known.max()) & ~unknown.all(axis=1))
    return good[np.unique(np.linspace(0, len(good) - 1, min(PLACING_FRAMES, len(good))).astype(int))]


def _seen_in(
    frames: NDArray[np.int64], names: tuple[str, ...], positions: FloatArray
) -> tuple[tuple[str, ...], FloatArray]:
    kept = np.flatnonzero(~np.isnan(positions[frames][..., 0]).all(axis=0))
    return tuple(names[k] for k in kept), positions[:, kept]


def _present(targets: Targets, frames: NDArray[np.int64]) -> Targets:
    """Targets in some frames, without those that are not seen there."""
    positions = targets.positions[frames]
    kept = np.flatnonzero(~np.isnan(positions[..., 0]).all(axis=0))
    return Targets(
        tuple(targets.names[k] for k in kept), tuple(targets.segments[k] for k in kept),
        targets.points[kept], positions[:, kept], targets.weights[kept],
    )  # fmt: skip


def _local(body: BodyModel, q: FloatArray, segments: tuple[str, ...], places: FloatArray) -> FloatArray:
    """(k, 3) medians of places in the frames of their segments [m]."""
    placed = SegmentPlacements(body, segments).of(q)
    away = places.transpose(1, 2, 0) - placed.roots - placed.shifts
    return np.nanmedian(np.einsum("kjin,kjn->kin", placed.turns, away), axis=2)


def _starts(body: BodyModel, marked: _Marked, pelvis: FloatArray | None = None) -> FloatArray:
    """(n, nq) standing postures put where the pelvis is, or was last seen."""
    turns, hips = marked.pelvis if pelvis is None else pelvis, middle(marked.centres, "thigh")
    known = np.flatnonzero(~np.isnan(turns[:, 0, 0]) & ~np.isnan(hips[:, 0]))
    nearest = known[np.searchsorted(0.5 * (known[1:] + known[:-1]), np.arange(len(turns)))]
    q = np.tile(body.standing_posture(), (len(turns), 1))
    q[:, :3] = hips[nearest]
    q[:, 3:7] = Rotation.from_matrix(turns[nearest]).as_quat()
    return q


def _told(body: BodyModel, segment: str, marked: set[str]) -> bool:
    """Whether a segment, or one that it carries, has a marker."""
    children = [one.name for one in body.segments if one.parent == segment]
    return segment in marked or any(_told(body, child, marked) for child in children)
