"""One recorded motion of markers: their places at an even rate, force plates and events beside them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from manikin.display import Displayed
from manikin.errors import InputError
from manikin.mocap.force_plate import ForcePlate
from manikin.mocap.gaps import LONGEST_GAP, Gap, filled, gaps_of
from manikin.mocap.subject import UNKNOWN, Subject
from manikin.spatial import FloatArray, finite_number, frozen_array


@dataclass(frozen=True)
class Event:
    """Something marked in a recording by who made it, such as ``"Foot Strike"`` of ``"Left"``.

    Attributes:
        label: What happens.
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
        name: Where it comes from, for messages.
        marker_names: (m,) unique names.
        positions: (n, m, 3) [m]; NaN where a marker was not seen.
        rate: Frames per second [Hz].
        start: Instant of the first frame on the recording's clock [s].
        plates: Force plates, on the same clock.
        events: In the order of time.
        subject: What the file says about the person.
    """

    name: str
    marker_names: tuple[str, ...]
    positions: FloatArray
    rate: float
    start: float = 0.0
    plates: tuple[ForcePlate, ...] = ()
    events: tuple[Event, ...] = ()
    subject: Subject = UNKNOWN

    def __post_init__(self) -> None:
        where = f"recording {self.name!r}"
        finite_number(self.rate, f"{where} rate [Hz]", above=0.0)
        finite_number(self.start, f"{where} start [s]")
        if len(set(self.marker_names)) != len(self.marker_names):
            raise InputError(f"{where} has a marker name twice; valid: unique names")
        positions = np.array(self.positions, dtype=np.float64)
        if positions.ndim != 3 or positions.shape[1:] != (len(self.marker_names), 3) or not len(positions):
            raise InputError(
                f"{where} positions have shape {positions.shape}; "
                f"valid: (n, {len(self.marker_names)}, 3) with at least one frame"
            )
        if np.any(np.isinf(positions)):
            raise InputError(f"{where} has an infinite position; valid: finite numbers, NaN for gaps")
        positions[np.any(np.isnan(positions), axis=2)] = np.nan
        positions.setflags(write=False)
        object.__setattr__(self, "positions", positions)
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
        return gaps_of(self.seen, self.marker_names)

    def marker(self, name: str) -> FloatArray:
        """(n, 3) places of one marker [m].

        Raises:
            InputError: If there is none of that name.
        """
        return self.positions[:, self.marker_index(name)]

    def marker_index(self, name: str) -> int:
        """Place of a marker among the markers.

        Raises:
            InputError: If there is none of that name.
        """
        try:
            return self.marker_names.index(name)
        except ValueError:
            raise InputError(
                f"recording {self.name!r} has no marker {name!r}; valid: {', '.join(self.marker_names)}"
            ) from None

    def chosen(self, names: Sequence[str]) -> "MarkerRecording":
        """The same recording with these markers only, in this order.

        Raises:
            InputError: If one is not there or twice.
        """
        places = [self.marker_index(name) for name in names]
        return replace(self, marker_names=tuple(names), positions=self.positions[:, places])

    def cut(self, start: int, stop: int) -> "MarkerRecording":
        """The frames from ``start`` up to, not with, ``stop``, the plates' samples and events in between.

        Raises:
            InputError: If no frame, or of a plate no sample, is left.
        """
        first, last, _ = slice(start, stop).indices(len(self))
        begin, end = self.start + first / self.rate, self.start + last / self.rate
        return replace(
            self,
            positions=self.positions[first:last],
            start=begin,
            plates=tuple(plate.cut(begin, end) for plate in self.plates),
            events=tuple(event for event in self.events if begin <= event.time < end),
        )

    def with_gaps_filled(self, longest: float = LONGEST_GAP) -> "MarkerRecording":
        """The same with short gaps filled by interpolation, see :func:`manikin.mocap.gaps.filled`.

        :attr:`gaps` of the result are those that are left: longer ones, and those at the ends.

        Args:
            longest: Longest gap that is filled [s].
        """
        finite_number(longest, "longest gap [s]", at_least=0.0)
        return replace(self, positions=filled(self.positions, int(longest * self.rate + 1e-6)))


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
