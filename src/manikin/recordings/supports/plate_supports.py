"""Supports that force plates saw, and how far extracted ones are from them in time.

Also here. When the seat of a recorded person is loaded, by plates under the feet alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import GRAVITY, FloatArray, frozen_array
from manikin.recordings.dynamics.plate_forces import PlateForces
from manikin.recordings.dynamics.recorded_dynamics import RecordedDynamics
from manikin.recordings.readers.markers import ForcePlate
from manikin.recordings.supports.recorded_supports import RecordedSupports, Support

LOADED = 0.1
"""Share of the body's weight from which a seat is loaded."""

LOOK = 0.5
"""Time about a change of the supports within which the load's own is looked for [s]."""


@dataclass(frozen=True)
class SeatChange:
    """A seat-off or a seat-on, extracted from the motion and seen by the plates.

    Attributes:
        event: ``"seat-off"`` or ``"seat-on"``.
        time: That of the plates [s].
        error: Extracted minus plates [s].
    """

    event: str
    time: float
    error: float


def seat_load(dynamics: RecordedDynamics, feet: PlateForces) -> FloatArray:
    """(n,) what of the vertical force the feet's plates do not carry, per body weight."""
    return (dynamics.vertical_force - feet.wrench[:, 2]) / (GRAVITY * dynamics.body.mass)


def seat_changes(
    seats: Sequence[Support], times: FloatArray, dynamics: RecordedDynamics, feet: PlateForces
) -> tuple[SeatChange, ...]:
    """Changes of extracted seats beside those of the load that the feet do not carry.

    Those that are not seen during the recording, or near which the load does not pass :data:`LOADED`, are
    left out; of several passages the nearest counts.

    Args:
        seats: Supports of the seat.
        times: (n,) instants of the motion on the clock of the supports [s].
        dynamics: The motion, with the person's mass.
        feet: Forces under both feet.
    """
    load = seat_load(dynamics, feet) > LOADED
    passages = {"seat-on": np.flatnonzero(~load[:-1] & load[1:]) + 1}
    passages["seat-off"] = np.flatnonzero(load[:-1] & ~load[1:]) + 1
    found = []
    for seat in seats:
        for event, instant, seen in (
            ("seat-on", seat.start, seat.start_seen), ("seat-off", seat.end, seat.end_seen)
        ):  # fmt: skip
            there = times[passages[event]]
            if seen and len(there) and np.abs(there - instant).min() < LOOK:
                nearest = float(there[np.argmin(np.abs(there - instant))])
                found.append(SeatChange(event, nearest, instant - nearest))
    return tuple(sorted(found, key=lambda change: change.time))


SHORTEST_LOAD = 0.2
"""Shorter loads of a plate are not taken for supports [s]."""

LONGEST_BREAK = 0.02
"""Shorter breaks of a load are noise about its least force [s]."""

SEEN_FOR = 0.1
"""Time after a plate's start, and before its end, whose centre of pressure tells the foot [s]."""

REACH = 0.3
"""Distance of a foot's place from the centre of pressure within which it may be its foot [m]."""

OVERHANG = 0.05
"""How far a heel or toes may be beyond the edge of a plate that is to see them [m]."""


@dataclass(frozen=True, eq=False)
class PlateLoad:
    """A time for which a plate is loaded.

    Attributes:
        plate: Its name.
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
        effector: What touched it.
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
                _mean(cop[first : first + tenth]), _mean(cop[stop - tenth : stop]),
                first > 0, stop < len(plate),
            )
        )  # fmt: skip
    return tuple(found)


def timing_errors(found: RecordedSupports, plates: Sequence[ForcePlate]) -> tuple[TimingError, ...]:
    """Touch-downs and lift-offs beside those of plates, in the order of time.

    The foot is the one whose place is nearest to the centre of pressure then. Not compared are events
    that are not within the recording, on the plate or of the foot, and those of a foot whose heel at
    touch-down, or toes at lift-off, are beyond the plate's edge: the plate does not see them.

    Args:
        found: On the clock of the plates.
        plates: Force plates.
    """
    errors = []
    for plate in plates:
        for load in plate_loads(plate):
            inside = [one for one in found.supports if one.start < load.end and load.start < one.end]
            first, last = _nearest(inside, load.first_cop), _nearest(inside, load.last_cop)
            lands = first and load.start_seen and first.start_seen and found.start < load.start
            if first and lands and _on(plate, first.first_contact):
                error = first.start - load.start
                errors.append(TimingError(plate.name, first.effector, "touch-down", load.start, error))
            lifts = last and load.end_seen and last.end_seen and load.end < found.end
            if last and lifts and _on(plate, last.last_contact):
                error = last.end - load.end
                errors.append(TimingError(plate.name, last.effector, "lift-off", load.end, error))
    return tuple(sorted(errors, key=lambda error: error.time))


def _mean(cop: FloatArray) -> FloatArray:
    return np.nanmean(cop, axis=0)


def _nearest(supports: Sequence[Support], cop: FloatArray) -> Support | None:
    far = [float(np.linalg.norm(support.place[:2] - cop[:2])) for support in supports]
    return supports[int(np.argmin(far))] if far and min(far) < REACH else None


def _on(plate: ForcePlate, point: FloatArray) -> bool:
    """Whether a point is above the plate, or close to its edge; true where its corners are not known."""
    if plate.corners is None:
        return True
    corners = plate.corners[:, :2]
    sides = np.roll(corners, -1, axis=0) - corners
    area = float(
        np.sum(corners[:, 0] * np.roll(corners[:, 1], -1) - corners[:, 1] * np.roll(corners[:, 0], -1))
    )
    inward = np.sign(area) * np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-9)
    return bool(np.all(np.sum((point[:2] - corners) * inward, axis=1) > -OVERHANG))
