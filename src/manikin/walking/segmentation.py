"""Where a walk is holonomic and where it is not ([Truong2010]_ 4.2).

People mostly walk where they look: then the motion is *nonholonomic*. Steps to the side or obliquely are
*holonomic*. Function 1 of the thesis tells them apart by both shoulders: a frame is nonholonomic if one of
them moves within 15 degrees of the body's heading. So the inner shoulder of a turn may stand or go back.

On-line that is all, known one half step of the tangent later. Off-line, three things are added: the paths are
low-passed, short holonomic intervals between nonholonomic ones are examined as noise, and single steps that
are straight to the eye are told apart from flat diagonal steps.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.errors import InputError
from manikin.numerics.signals import SHARES, low_passed, mask_runs
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.recordings.readers.marker_sets import SIDES, joint_of
from manikin.recordings.readers.skeleton_recording import Recording
from manikin.walking.path.walking_path import SampledWalk

BREADTH = 0.36
"""Between the shoulder joints of a walker who has a path only [m]."""

STILL = 1e-9
"""Speed below which nothing is said about a direction [m/s]."""

LEAST_DISTANCE = 1e-3
"""Between the shoulders, seen from above; below it the body has no heading [m]."""


@dataclass(frozen=True, eq=False)
class ShoulderPaths:
    """Both shoulders on the ground plane, at an even rate; in the world, y is to the left of x.

    InputError if there are fewer than three frames, the paths differ in length, or the shoulders meet.

    Attributes:
        left: (n, 2) left shoulder [m]; ``right`` is the other one.
        rate: Frames per second [Hz].
    """

    left: FloatArray
    right: FloatArray
    rate: float

    def __post_init__(self) -> None:
        finite_number(self.rate, "shoulder paths rate [Hz]", above=0.0)
        left = frozen_array(self.left, "left shoulder [m]", (None, 2))
        right = frozen_array(self.right, "right shoulder [m]", (len(left), 2))
        if len(left) < 3:
            raise InputError(f"shoulder paths have {len(left)} frames; valid: at least 3")
        close = np.flatnonzero(np.hypot(*(left - right).T) < LEAST_DISTANCE)
        if close.size:
            valid = f"at least {LEAST_DISTANCE} m apart, seen from above"
            raise InputError(f"shoulders meet at frame {close[0]}; valid: {valid}")
        object.__setattr__(self, "left", left)
        object.__setattr__(self, "right", right)

    @classmethod
    def of_recording(cls, recording: Recording) -> Self:
        """Shoulder joints of a recorded person; InputError if there are none, or fewer than three frames."""
        left, right = (recording.positions[:, joint_of(recording, f"{side}_upper_arm"), :2] for side in SIDES)
        return cls(left, right, recording.rate)

    @classmethod
    def of_walk(cls, path: SampledWalk) -> Self:
        """Shoulders on both sides of a path, see :meth:`of_places`."""
        return cls.of_places(path.place, (len(path.time) - 1) / path.duration)

    @classmethod
    def of_places(cls, place: ArrayLike, rate: float) -> Self:
        """Shoulders on both sides of three places (n, 3) x, y [m], heading [rad] or more, at a rate [Hz]."""
        places = frozen_array(place, "places [m, m, rad]", (None, 3))
        left = 0.5 * BREADTH * np.column_stack([-np.sin(places[:, 2]), np.cos(places[:, 2])])
        return cls(places[:, :2] + left, places[:, :2] - left, rate)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.left)

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants, 0 at the first frame [s]."""
        return frozen_array(np.arange(len(self)) / self.rate, "time")

    @cached_property
    def middle(self) -> FloatArray:
        """(n, 2) midpoint of the shoulders [m] ([Truong2010]_ 4.4 and 4.5)."""
        return frozen_array((self.left + self.right) / 2, "middle of the shoulders")

    @cached_property
    def heading(self) -> FloatArray:
        """(n,) direction in which the body looks, continuous [rad] ([Truong2010]_ 4.2 and 4.3)."""
        return frozen_array(np.unwrap(heading_of(self.points)), "heading")

    @property
    def points(self) -> FloatArray:
        """(n, 2, 2) left and right shoulder [m]."""
        return np.stack([self.left, self.right], axis=1)

    def velocities(self, frames: int = 1) -> FloatArray:
        """(n, 2, 2) of the left and the right shoulder, by central differences [m/s] ([Truong2010]_ 4.6).

        They are over some frames to either side. Near the ends the missing neighbour is the end itself.
        """
        index = np.arange(len(self))
        before, after = np.maximum(index - frames, 0), np.minimum(index + frames, len(self) - 1)
        return (self.points[after] - self.points[before]) * (self.rate / (after - before))[:, None, None]

    def low_passed(self, cutoff: float) -> "ShoulderPaths":
        """The paths without fast changes: Butterworth of second order, forward and backward.

        The cutoff is a share of half the rate [-]. [Truong2010]_ 4.3.4 filters with a "normalized cutoff
        frequency 0.5 Hz"; read as a share of the Nyquist frequency, 25 Hz at its 100 Hz. It gives no order.
        """
        padding = max(9, int(np.ceil(2.0 / cutoff)))
        left, right = (low_passed(path, cutoff, SHARES, padding) for path in (self.left, self.right))
        return ShoulderPaths(left, right, self.rate)


def heading_of(points: FloatArray) -> FloatArray:
    """(...) direction square to the line of the (..., 2, 2) shoulders, forward, in (-pi/2, 3 pi/2] [rad].

    [Truong2010]_ 4.2 and 4.3, with the arctangent of two arguments that the print leaves out.
    """
    across = points[..., 1, :] - points[..., 0, :]
    return np.arctan2(across[..., 1], across[..., 0]) + np.pi / 2


def deviations(points: FloatArray, velocities: FloatArray) -> FloatArray:
    """(..., 2) body heading less direction of each shoulder's motion, within pi of zero [rad]; NaN at rest.

    Left and right shoulder are (..., 2, 2) [m], their velocities (..., 2, 2) [m/s].
    """
    tangent = np.arctan2(velocities[..., 1], velocities[..., 0])
    difference = heading_of(points)[..., None] - tangent
    wrapped = np.arctan2(np.sin(difference), np.cos(difference))
    return np.where(np.hypot(velocities[..., 0], velocities[..., 1]) > STILL, wrapped, np.nan)


HOLONOMIC = "holonomic"
NONHOLONOMIC = "nonholonomic"
STANDING = "standing"
KINDS = (HOLONOMIC, NONHOLONOMIC, STANDING)
"""Kinds of frames and of segments."""

Labels = NDArray[np.str_]


@dataclass(frozen=True)
class SegmentationRule:
    """Thresholds of the segmentation; those that the thesis gives are the defaults.

    Attributes:
        tolerance: Angle between heading and a shoulder's motion below which a frame is nonholonomic [rad];
            15 degrees ([Truong2010]_ 4.2.1).
        half_step: From an instant to those that its tangent joins [s], at least one frame, as at the 100 Hz
            of the thesis. On-line, labels come this much later.
        standing_speed: Both shoulders slower than this stand [m/s]. Not in the thesis, whose walks begin at
            the first motion.
        cutoff: Of the low-pass of the paths, as a share of the Nyquist frequency [-]; 0.5 ([Truong2010]_
            4.3.4), None without it. It and what follows, but ``either_way``, count off-line only.
        noise: Holonomic intervals up to this duration may be noise [s], 0 for none; they are judged by
            deviations low-passed at ``1 / (2 noise)``. The thesis ([Truong2010]_ 4.2.2.1) names the filter,
            not its cutoff or how long noise lasts.
        boundary: Angle below which two headings are the same [rad]; 1 degree ([Truong2010]_ 4.2.2.2), None
            without this step.
        diagonal_step: Longest way from rest to rest that can be one flat diagonal step [m]: 0.5 m, the radius
            around the start in which the thesis found single steps ([Truong2010]_ 4.5.2, Fig. 4.23). Longer
            walks have the labels of Function 1, also where they drift aside and end with their first heading.
        either_way: Whether a shoulder that goes straight back counts as one that goes ahead. The thesis says
            so of turns on the spot only ([Truong2010]_ Fig. 4.3 d); its constraint (1.1) and its quotient
            (4.1), which has no quadrants, say so of any motion, so that to walk backward is nonholonomic.
    """

    tolerance: float = float(np.radians(15.0))
    half_step: float = 0.01
    standing_speed: float = 0.1
    cutoff: float | None = 0.5
    noise: float = 0.2
    boundary: float | None = float(np.radians(1.0))
    diagonal_step: float = 0.5
    either_way: bool = False

    def __post_init__(self) -> None:
        where = "segmentation rule"
        finite_number(self.tolerance, f"{where} tolerance [rad]", above=0.0, at_most=np.pi)
        for name in ("half_step [s]", "standing_speed [m/s]", "noise [s]", "diagonal_step [m]"):
            finite_number(getattr(self, name.split()[0]), f"{where} {name}", at_least=0.0)
        if self.cutoff is not None:
            finite_number(self.cutoff, f"{where} cutoff [-]", above=0.0, at_most=0.99)
        if self.boundary is not None:
            finite_number(self.boundary, f"{where} boundary [rad]", above=0.0, at_most=np.pi)

    def frames(self, rate: float) -> int:
        """Half step of the tangent at a rate [Hz], in frames, at least one."""
        return max(1, round(self.half_step * rate))

    def ahead(self, angles: FloatArray) -> NDArray[np.bool_]:
        """(...) whether one of the shoulders goes ahead, by (..., 2) deviations [rad]."""
        away = np.abs(angles)
        return np.any((np.minimum(away, np.pi - away) if self.either_way else away) < self.tolerance, axis=-1)


THESIS_RULE = SegmentationRule()


@dataclass(frozen=True)
class PathSegment:
    """A stretch of a walk of one kind.

    Attributes:
        kind: One of :data:`KINDS`.
        start: Instant of its first frame [s].
        end: Instant of the next segment's first frame, or of the last frame of all [s].
    """

    kind: str
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class PathSegments:
    """A walk cut into holonomic, nonholonomic and standing stretches.

    Attributes:
        paths: The shoulders that were judged, low-passed where the rule says so.
        labels: (n,) one of :data:`KINDS` per frame.
        deviations: (n, 2) heading less direction of the left and the right shoulder [rad]; NaN at rest.
        segments: Stretches in order, without gaps.
    """

    paths: ShoulderPaths
    labels: Labels
    deviations: FloatArray
    segments: tuple[PathSegment, ...]

    @property
    def pattern(self) -> str:
        """Kinds of the moving stretches in order: ``H-N-H`` is holonomic, nonholonomic, holonomic."""
        moving = (item.kind for item in self.segments if item.kind != STANDING)
        return "-".join(kind[0].upper() for kind, _ in itertools.groupby(moving))

    def share(self, kind: str) -> float:
        """Share of the frames that are of a kind of :data:`KINDS` [-]."""
        if kind not in KINDS:
            raise InputError(f"kind of a segment is {kind!r}; valid: {', '.join(KINDS)}")
        return float(np.mean(self.labels == kind))


def segment_path(
    paths: ShoulderPaths, rule: SegmentationRule = THESIS_RULE, *, online: bool = False
) -> PathSegments:
    """Cut a walk into segments ([Truong2010]_ Function 1 and 4.2.2).

    "At the boundary of forward walking and sideward step" the thesis ([Truong2010]_ 4.2.2.2) splits motions
    that are "smaller than the tolerance" throughout by their initial and final orientation, and draws two
    single motions. Here a motion from standing to standing is a diagonal step if it is no longer than
    :attr:`SegmentationRule.diagonal_step`, both headings are the same and the way between both places is not
    along them; otherwise it is nonholonomic, as any walk of several steps that keeps within the tolerance.
    Walks that are not recorded from rest to rest are left as they are.

    On-line, Function 1 alone knows a label half a step of the tangent after its frame.
    """
    if not online and rule.cutoff is not None:
        paths = paths.low_passed(rule.cutoff)
    velocities = paths.velocities(rule.frames(paths.rate))
    angles = deviations(paths.points, velocities)
    labels = _function_1(angles, velocities, rule)
    if not online:
        labels = _with_diagonal_steps(_without_noise(labels, angles, paths.rate, rule), paths, rule)
    labels.setflags(write=False)
    angles.setflags(write=False)
    times = [*paths.time.tolist(), float(paths.time[-1])]
    segments = (PathSegment(str(kind), times[first], times[stop]) for kind, first, stop in _runs(labels))
    return PathSegments(paths, labels, angles, tuple(segments))


def _function_1(angles: FloatArray, velocities: FloatArray, rule: SegmentationRule) -> Labels:
    """(...) labels of (..., 2) deviations and (..., 2, 2) velocities."""
    standing = np.all(np.hypot(velocities[..., 0], velocities[..., 1]) < rule.standing_speed, axis=-1)
    return np.where(standing, STANDING, np.where(rule.ahead(angles), NONHOLONOMIC, HOLONOMIC))


def _without_noise(labels: Labels, angles: FloatArray, rate: float, rule: SegmentationRule) -> Labels:
    """Labels with short holonomic intervals made nonholonomic where the low-passed deviation is small."""
    noisy, cleaned = np.zeros(len(labels), dtype=bool), labels.copy()
    for first, stop in _between(labels, HOLONOMIC, NONHOLONOMIC):
        noisy[first:stop] = (stop - first) / rate <= rule.noise
    for first, stop in mask_runs((labels == NONHOLONOMIC) | noisy):
        if np.any(noisy[first:stop]):
            smooth = _smoothed(angles[first:stop], min(0.99, 1.0 / (rule.noise * rate)))
            cleaned[first:stop][noisy[first:stop] & rule.ahead(smooth)] = NONHOLONOMIC
    return cleaned


def _smoothed(angles: FloatArray, cutoff: float) -> FloatArray:
    """(n, 2) angles, low-passed as directions so that whole turns do not matter; NaN counts for nothing."""
    known = np.isfinite(angles)
    pointers = np.where(known, np.exp(1j * np.where(known, angles, 0.0)), 0.0)
    real, imaginary = (low_passed(part, cutoff, SHARES, padding=9) for part in (pointers.real, pointers.imag))
    return np.where(np.any(known, axis=0), np.arctan2(imaginary, real), np.nan)


def _with_diagonal_steps(labels: Labels, paths: ShoulderPaths, rule: SegmentationRule) -> Labels:
    """Labels with single steps made holonomic that keep the heading and go obliquely to it."""
    stepped = labels.copy()
    if rule.boundary is None:
        return stepped
    for first, stop in _between(labels, NONHOLONOMIC, STANDING):
        start = first - 1
        turned = paths.heading[stop] - paths.heading[start]
        way = paths.middle[stop] - paths.middle[start]
        aside = np.arctan2(way[1], way[0]) - paths.heading[start]
        oblique = abs(turned) < rule.boundary <= abs(np.arctan2(np.sin(aside), np.cos(aside)))
        if oblique and np.hypot(way[0], way[1]) <= rule.diagonal_step:
            stepped[first:stop] = HOLONOMIC
    return stepped


def _between(labels: Labels, kind: str, around: str) -> Iterator[tuple[int, int]]:
    """First frame and the one after the last of stretches of a kind between two of another kind."""
    runs = list(_runs(labels))
    for (before, *_), (own, first, stop), (after, *_) in zip(runs, runs[1:], runs[2:], strict=False):
        if before == after == around and own == kind:
            yield first, stop


def _runs(values: NDArray[np.generic]) -> Iterator[tuple[object, int, int]]:
    """Value, first index and the one after the last, of stretches of equal values."""
    changes = [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist(), len(values)]
    for first, stop in itertools.pairwise(changes):
        yield values[first].item(), first, stop
