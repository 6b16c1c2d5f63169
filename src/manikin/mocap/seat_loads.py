"""When the seat of a recorded person is loaded, by plates under the feet alone."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manikin.mocap.plate_forces import PlateForces
from manikin.mocap.recorded_dynamics import RecordedDynamics
from manikin.mocap.recorded_supports import Support
from manikin.spatial import GRAVITY, FloatArray

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
