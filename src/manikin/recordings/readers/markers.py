"""Recorded markers at an even rate, their gaps, and the force plates and events recorded with them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from manikin.errors import InputError
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array, unit
from manikin.recordings.readers.skeleton_recording import FARTHEST, UNKNOWN, Subject
from manikin.runtime.display import Displayed

LONGEST_GAP, NEIGHBOURS = 0.1, 6
"""Longest gap that is filled when nothing else is said [s]: feet stay within about a centimetre; and frames
on either side of it that its filling looks at."""


@dataclass(frozen=True)
class Gap:
    """One run of frames without a marker, from ``first`` up to, not with, ``stop``."""

    marker: str
    first: int
    stop: int

    def __len__(self) -> int:
        """Number of frames without the marker."""
        return self.stop - self.first


LEAST_FORCE = 20.0
"""Normal force below which noise would define the centre of pressure [N]."""


@dataclass(frozen=True, eq=False)
class ForcePlate:
    """Wrenches that a plate applies to the person on it, at an even rate; the world is z up.

    Attributes:
        wrenches: (n, 6) force [N] and moment about the world's origin [N.m], world axes.
        origin: (3,) a point of its surface [m].
        rate: Samples per second [Hz].
        start: Instant of the first sample on the recording's clock [s].
        normal: (3,) unit normal of its surface, upward.
        corners: (4, 3) [m], one after the other; None where the file does not hold them.
    """

    name: str
    wrenches: FloatArray
    origin: FloatArray
    rate: float
    start: float = 0.0
    normal: FloatArray = (0.0, 0.0, 1.0)  # pyright: ignore[reportAssignmentType]
    corners: FloatArray | None = None

    def __post_init__(self) -> None:
        where = f"force plate {self.name!r}"
        finite_number(self.rate, f"{where} rate [Hz]", above=0.0)
        finite_number(self.start, f"{where} start [s]")
        shapes = {"wrenches": (None, 6), "origin": (3,), "normal": (3,), "corners": (4, 3)}
        for name, shape in shapes.items():
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, frozen_array(value, f"{where} {name}", shape))
        if not len(self.wrenches):
            raise InputError(f"{where} has no sample; valid: at least one")
        if abs(np.linalg.norm(self.normal) - 1.0) > 1e-6:
            raise InputError(f"{where} normal is {self.normal.tolist()}; valid: a unit vector")

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.wrenches)

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants on the recording's clock [s]."""
        return frozen_array(self.start + np.arange(len(self)) / self.rate, "time")

    @property
    def force(self) -> FloatArray:
        """(n, 3) [N]."""
        return self.wrenches[:, :3]

    @cached_property
    def pressed(self) -> NDArray[np.bool_]:
        """(n,) whether the normal force reaches :data:`LEAST_FORCE`."""
        return self.force @ self.normal >= LEAST_FORCE

    @cached_property
    def cop(self) -> FloatArray:
        """(n, 3) centre of pressure, the point of the surface about which the moment is normal to it [m].

        ``c = o + n x M_o / (n . F)`` with the moment ``M_o`` about the origin ``o``; NaN where the plate
        is not :attr:`pressed`.
        """
        moment = self.wrenches[:, 3:] - np.cross(self.origin, self.force)
        along = np.where(self.pressed, self.force @ self.normal, np.nan)
        places = self.origin + np.cross(self.normal, moment) / along[:, None]
        places.setflags(write=False)
        return places

    def below(self, points: FloatArray, overhang: float) -> bool:
        """Whether (..., 3) points are all above the plate, or at most ``overhang`` [m] beyond its edge.

        True where the corners are not known.
        """
        if self.corners is None:
            return True
        corners = self.corners[:, :2]
        sides = np.roll(corners, -1, axis=0) - corners
        turning = sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]
        inward = unit(np.sign(turning) * np.stack([-sides[:, 1], sides[:, 0]], axis=1))
        depth = np.sum((points[..., None, :2] - corners) * inward, axis=-1)
        return bool(depth.min() > -overhang)

    def cut(self, begin: float, end: float) -> "ForcePlate":
        """Samples at instants from ``begin`` up to, not with, ``end`` [s]; InputError if none is left."""
        # A thousandth of a sample absorbs what is lost in dividing by the rate.
        samples = np.ceil((np.array([begin, end]) - self.start) * self.rate - 1e-3)
        first, last = samples.clip(0, len(self)).astype(int).tolist()
        return replace(self, wrenches=self.wrenches[first:last], start=self.start + first / self.rate)


@dataclass(frozen=True)
class Event:
    """An event marked in a recording, such as ``"Foot Strike"`` of ``"Left"``.

    Attributes:
        context: Side or part that does it; empty where the file does not say.
        time: Instant on the recording's clock [s].
    """

    label: str
    context: str
    time: float


@dataclass(frozen=True, eq=False, repr=False)
class MarkerRecording(Displayed):
    """Markers at n instants; the world is z up.

    Attributes:
        marker_names: (m,) unique names.
        positions: (n, m, 3) [m]; NaN where a marker was not seen.
        rate: Frames per second [Hz].
        start: Instant of the first frame on the recording's clock [s], which is that of the plates.
        events: In the order of time.
        subject: What the file says about the person.
        remarks: What the file says wrongly, or what of it was not read; a line each.
        marker_map: Landmark or segment of markers whose names do not say it, by name; see
            :class:`~manikin.recordings.readers.marker_map.MarkerMap`.
    """

    name: str
    marker_names: tuple[str, ...]
    positions: FloatArray
    rate: float
    start: float = 0.0
    plates: tuple[ForcePlate, ...] = ()
    events: tuple[Event, ...] = ()
    subject: Subject = UNKNOWN
    remarks: tuple[str, ...] = ()
    marker_map: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"recording {self.name!r}"
        finite_number(self.rate, f"{where} rate [Hz]", above=0.0)
        finite_number(self.start, f"{where} start [s]")
        if len(set(self.marker_names)) != len(self.marker_names):
            raise InputError(f"{where} has a marker name twice; valid: unique names")
        positions = np.array(self.positions, dtype=np.float64)
        count, shape = len(self.marker_names), positions.shape
        if positions.ndim != 3 or shape[1:] != (count, 3) or not len(positions):
            valid = f"(n, {count}, 3) with at least one frame"
            raise InputError(f"{where} positions have shape {shape}; valid: {valid}")
        if np.any(np.isinf(positions)):
            raise InputError(f"{where} has an infinite position; valid: finite numbers, NaN for gaps")
        positions[np.any(np.isnan(positions), axis=2)] = np.nan
        if (far := np.argwhere(np.abs(positions) > FARTHEST)).size:
            frame, marker, axis = far[0]
            place = f"marker {self.marker_names[marker]!r} at {positions[frame, marker, axis]:.4g} m"
            valid = f"at most {FARTHEST:g} m from the origin, in the unit of the file"
            raise InputError(f"{where} has {place} in frame {frame}, counted from 0; valid: {valid}")
        positions.setflags(write=False)
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "marker_map", MappingProxyType(dict(self.marker_map)))
        object.__setattr__(self, "events", tuple(sorted(self.events, key=lambda event: event.time)))

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.positions)

    @property
    def duration(self) -> float:
        """From the first frame to the last [s]."""
        return (len(self) - 1) / self.rate

    @cached_property
    def time(self) -> FloatArray:
        """(n,) instants on the recording's clock [s]."""
        return frozen_array(self.start + np.arange(len(self)) / self.rate, "time")

    @cached_property
    def seen(self) -> NDArray[np.bool_]:
        """(n, m) whether each marker was seen."""
        return ~np.isnan(self.positions[..., 0])

    @cached_property
    def gaps(self) -> tuple[Gap, ...]:
        """Runs of frames in which a marker was not seen, marker by marker."""
        return tuple(
            Gap(self.marker_names[marker], first, stop)
            for marker in np.flatnonzero(~self.seen.all(axis=0)).tolist()
            for first, stop in mask_runs(~self.seen[:, marker])
        )

    def marker(self, name: str) -> FloatArray:
        """(n, 3) places of one marker [m]; InputError if there is none of that name."""
        return self.positions[:, self.marker_index(name)]

    def marker_index(self, name: str) -> int:
        """Place of a marker among the markers; InputError if there is none of that name."""
        if name in self.marker_names:
            return self.marker_names.index(name)
        known = ", ".join(self.marker_names)
        raise InputError(f"recording {self.name!r} has no marker {name!r}; valid: {known}")

    def chosen(self, names: Sequence[str]) -> "MarkerRecording":
        """Recording with some markers only, in a given order; InputError if one is not there or twice."""
        places = [self.marker_index(name) for name in names]
        return replace(self, marker_names=tuple(names), positions=self.positions[:, places])

    def cut(self, start: int, stop: int) -> "MarkerRecording":
        """The frames from ``start`` up to, not with, ``stop``, the plates' samples and events in between.

        InputError if no frame, or of a plate no sample, is left.
        """
        first, last, _ = slice(start, stop).indices(len(self))
        begin, end = self.start + first / self.rate, self.start + last / self.rate
        plates = tuple(plate.cut(begin, end) for plate in self.plates)
        events = tuple(event for event in self.events if begin <= event.time < end)
        return replace(self, positions=self.positions[first:last], start=begin, plates=plates, events=events)

    def with_gaps_filled(self, longest: float = LONGEST_GAP) -> "MarkerRecording":
        """Recording with gaps of up to ``longest`` [s] filled; its :attr:`gaps` are those that are left.

        A gap is filled by the cubic spline through the :data:`NEIGHBOURS` frames nearest to it on either side
        in which the marker was seen. One with fewer than two such frames on a side stays.
        """
        finite_number(longest, "longest gap [s]", at_least=0.0)
        positions = np.array(self.positions)
        for gap in self.gaps:
            marker, inside = self.marker_index(gap.marker), np.arange(gap.first, gap.stop)
            frames = np.flatnonzero(self.seen[:, marker])
            after = int(np.searchsorted(frames, gap.first))
            used = frames[max(after - NEIGHBOURS, 0) : after + NEIGHBOURS]
            if len(gap) <= int(longest * self.rate + 1e-6) and 2 <= after <= len(frames) - 2:
                positions[inside, marker] = CubicSpline(used, self.positions[used, marker])(inside)
        return replace(self, positions=positions)


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Names of which the second ``RKNE`` is ``RKNE_2``; those without a name are ``marker_7`` by place."""
    given, found = set(names), {}
    counts: dict[str, int] = {}
    for place, name in enumerate(names, start=1):
        stem = wanted = name or f"marker_{place}"
        while wanted in found or (wanted != name and wanted in given):
            counts[stem] = counts.get(stem, 1) + 1
            wanted = f"{stem}_{counts[stem]}"
        found[wanted] = place
    return tuple(found)


def without_unseen(positions: FloatArray) -> FloatArray:
    """Positions in which exact zeros are NaN: how many programs write a marker that was not seen."""
    return np.where(np.all(positions == 0.0, axis=-1, keepdims=True), np.nan, positions)
