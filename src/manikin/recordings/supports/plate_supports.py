"""Supports that force plates measured, and the errors in time of those found from motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray, frozen_array
from manikin.recordings.readers.markers import ForcePlate
from manikin.recordings.supports.recorded_supports import RecordedSupports, Support

SHORTEST_LOAD = 0.2
"""Shorter loads of a plate are not taken for supports [s]."""

LONGEST_BREAK = 0.02
"""Shorter breaks of a load are noise about its least force [s]."""

SEEN_FOR = 0.1
"""Time after a plate's start, and before its end, whose centre of pressure identifies the foot [s]."""

REACH = 0.3
"""Distance of a foot's place from the centre of pressure within which it may be its foot [m]."""

OVERHANG = 0.05
"""How far a heel or toes may be beyond the edge of a plate that is to see them [m]."""


@dataclass(frozen=True, eq=False)
class PlateLoad:
    """A time for which a plate is loaded.

    Attributes:
        start: [s].
        end: [s].
        first_cop: (3,) mean centre of pressure of the first tenth of a second [m].
        last_cop: (3,) that of the last one [m].
        start_seen: Whether the load begins during the recording.
        end_seen: Whether it ends during the recording.
    """

    plate: str
    start: float
    end: float
    first_cop: FloatArray
    last_cop: FloatArray
    start_seen: bool
    end_seen: bool

    def __post_init__(self) -> None:
        for name in ("first_cop", "last_cop"):
            object.__setattr__(
                self, name, frozen_array(getattr(self, name), f"load of {self.plate} {name}", (3,))
            )


@dataclass(frozen=True)
class TimingError:
    """An extracted touch-down or lift-off beside that of a plate.

    Attributes:
        plate: Name of the plate.
        event: ``"touch-down"`` or ``"lift-off"``.
        time: That of the plate [s].
        error: Extracted minus plate [s].
    """

    plate: str
    effector: str
    event: str
    time: float
    error: float


def plate_loads(plate: ForcePlate) -> tuple[PlateLoad, ...]:
    """Times for which a plate is pressed, without breaks and loads that are too short."""
    pressed, found = plate.pressed.copy(), []
    for first, stop in mask_runs(~pressed):
        if stop - first < LONGEST_BREAK * plate.rate and first > 0 and stop < len(plate):
            pressed[first:stop] = True
    for first, stop in mask_runs(pressed):
        if stop - first < SHORTEST_LOAD * plate.rate:
            continue
        tenth = max(int(SEEN_FOR * plate.rate), 1)
        cop = plate.cop
        found.append(
            PlateLoad(
                plate.name, float(plate.time[first]), float(plate.time[min(stop, len(plate) - 1)]),
                np.nanmean(cop[first : first + tenth], axis=0), np.nanmean(cop[stop - tenth : stop], axis=0),
                first > 0, stop < len(plate),
            )
        )  # fmt: skip
    return tuple(found)


def timing_errors(found: RecordedSupports, plates: Sequence[ForcePlate]) -> tuple[TimingError, ...]:
    """Touch-downs and lift-offs compared with those of plates, in order of time.

    The foot is the one nearest to the centre of pressure then. Left out are events outside the recording, and
    those of a foot whose heel at touch-down, or toes at lift-off, are beyond the plate's edge.

    Args:
        found: On the clock of the plates.
        plates: Their loads are the reference.
    """
    errors = []
    for plate in plates:
        for load in plate_loads(plate):
            inside = [one for one in found.supports if one.start < load.end and load.start < one.end]
            first, last = _nearest(inside, load.first_cop), _nearest(inside, load.last_cop)
            lands = first and load.start_seen and first.start_seen and found.start < load.start
            if first and lands and plate.below(first.first_contact, OVERHANG):
                error = first.start - load.start
                errors.append(TimingError(plate.name, first.effector, "touch-down", load.start, error))
            lifts = last and load.end_seen and last.end_seen and load.end < found.end
            if last and lifts and plate.below(last.last_contact, OVERHANG):
                error = last.end - load.end
                errors.append(TimingError(plate.name, last.effector, "lift-off", load.end, error))
    return tuple(sorted(errors, key=lambda error: error.time))


def _nearest(supports: Sequence[Support], cop: FloatArray) -> Support | None:
    far = [float(np.linalg.norm(support.place[:2] - cop[:2])) for support in supports]
    return supports[int(np.argmin(far))] if far and min(far) < REACH else None
