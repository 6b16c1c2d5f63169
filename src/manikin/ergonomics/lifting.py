"""The revised NIOSH lifting equation: recommended weight, lifting index and composite index ([Waters1994]_).

    RWL = 23 kg x HM x VM x DM x AM x FM x CM,    LI = load / RWL,

in the manual's metric form. It holds for lifting and lowering with both hands, standing, for at most eight
hours a day. Multipliers come from the formulas at full precision; the frequency multiplier is interpolated
between the rows of its table, but not into a row of zero, beyond which the recommended weight is zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any

import numpy as np

from manikin.errors import InputError
from manikin.numerics.spatial import finite_number

LOAD_CONSTANT = 23.0
"""Recommended weight of the best lift [kg]."""

NEAREST, FARTHEST = 0.25, 0.63
"""Horizontal distance from which on it counts, and beyond which nothing may be lifted [m]."""
BEST_HEIGHT, HIGHEST = 0.75, 1.75
"""Height of the hands at the best lift, and beyond which nothing may be lifted [m]."""
LEAST_TRAVEL = 0.25
"""Vertical travel from which on it counts [m]."""
MOST_ASYMMETRY = np.deg2rad(135.0)
"""Turn to the side beyond which nothing may be lifted [rad]."""

LEAST_FREQUENCY, LONGEST = 0.2, 8.0
"""Frequency that rarer lifts count as [1/min], and the longest duration [h]."""

FREQUENCIES = (0.2, 0.5, *map(float, range(1, 16)))
"""Rows of the table of the frequency multiplier [1/min]."""

_SHORT = (1.0, 0.97, 0.94, 0.91, 0.88, 0.84, 0.80, 0.75, 0.70, 0.60, 0.52, 0.45, 0.41, 0.37)
_MODERATE = (0.95, 0.92, 0.88, 0.84, 0.79, 0.72, 0.60, 0.50, 0.42, 0.35, 0.30, 0.26)
_LONG = (0.85, 0.81, 0.75, 0.65, 0.55, 0.45, 0.35, 0.27, 0.22, 0.18)
FREQUENCY_TABLE = (
    (1.0, _SHORT, (*_SHORT, 0.34, 0.31, 0.28)),
    (2.0, _MODERATE, (*_MODERATE, 0.23, 0.21)),
    (8.0, _LONG, (*_LONG, 0.15, 0.13)),
)
"""Longest duration [h], and multipliers of hands below and from 75 cm on, by :data:`FREQUENCIES`; the rows
that are missing are zero."""

COUPLING = {"good": (1.0, 1.0), "fair": (0.95, 1.0), "poor": (0.90, 0.90)}
"""Coupling multipliers of hands below and from 75 cm on, by the hold on the load."""


@dataclass(frozen=True)
class HandPlace:
    """Where the middle between both hands is at one end of a lift.

    Attributes:
        horizontal: Distance from the middle between the ankles, along the floor [m].
        vertical: Height above the floor [m].
        asymmetry: Angle between the line from the ankles to the hands and straight ahead [rad].
    """

    horizontal: float
    vertical: float
    asymmetry: float = 0.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            finite_number(value, f"{name} of the hands", at_least=0.0)


@dataclass(frozen=True)
class Lift:
    """One lifting task.

    Attributes:
        load: [kg].
        origin: Of the hands where the lift begins.
        destination: Where it ends.
        frequency: [1/min].
        hours: Of lifting at a stretch, with the rests the manual asks for [h].
        coupling: A key of :data:`COUPLING`.
        control: Whether the load has to be placed with care, so that the destination counts as well.
    """

    load: float
    origin: HandPlace
    destination: HandPlace
    frequency: float = LEAST_FREQUENCY
    hours: float = 1.0
    coupling: str = "good"
    control: bool = True

    def __post_init__(self) -> None:
        finite_number(self.load, "load [kg]", at_least=0.0)
        finite_number(self.frequency, "lifts per minute", at_least=0.0)
        finite_number(self.hours, "hours of lifting", above=0.0, at_most=LONGEST)
        if self.coupling not in COUPLING:
            raise InputError(f"coupling is {self.coupling!r}; valid: {', '.join(COUPLING)}")


@dataclass(frozen=True)
class Multipliers:
    """The six multipliers at one end of a lift; all are 1 at best."""

    horizontal: float
    vertical: float
    distance: float
    asymmetry: float
    frequency: float
    coupling: float

    @property
    def weight(self) -> float:
        """Recommended weight limit [kg]."""
        return LOAD_CONSTANT * float(np.prod(list(vars(self).values())))


@dataclass(frozen=True)
class LiftingIndex:
    """Assessment of one lift.

    Attributes:
        lift: What was assessed.
        origin, destination: Multipliers at both ends.
    """

    lift: Lift
    origin: Multipliers
    destination: Multipliers

    @property
    def weight(self) -> float:
        """Recommended weight limit, the lower one of the ends that count [kg]."""
        ends = (self.origin, self.destination) if self.lift.control else (self.origin,)
        return min(end.weight for end in ends)

    @property
    def index(self) -> float:
        """Load over the recommended weight; infinite where nothing may be lifted."""
        return _over(self.lift.load, self.weight)

    def as_dict(self) -> dict[str, Any]:
        """Plain values; the index is None where nothing may be lifted."""
        lift = self.lift
        ends = {"origin": (lift.origin, self.origin), "destination": (lift.destination, self.destination)}
        return {
            "load_kg": lift.load, "recommended_kg": self.weight,
            "index": self.index if isfinite(self.index) else None, "lifts_per_minute": lift.frequency,
            "hours": lift.hours, "coupling": lift.coupling,
            **{name: _end(place, factors) for name, (place, factors) in ends.items()},
        }  # fmt: skip


def frequency_multiplier(frequency: float, hours: float, vertical: float) -> float:
    """Multiplier of lifts per minute, hours of lifting and the height of the hands at the origin [m].

    Raises:
        InputError: If the hours are more than eight.
    """
    finite_number(hours, "hours of lifting", above=0.0, at_most=LONGEST)
    low, high = next(columns for longest, *columns in FREQUENCY_TABLE if hours <= longest)
    values = low if vertical < BEST_HEIGHT else high
    rows = FREQUENCIES[: len(values)]
    if frequency > rows[-1]:
        return 0.0
    return float(np.interp(max(frequency, LEAST_FREQUENCY), rows, values))


def multipliers(lift: Lift, place: HandPlace) -> Multipliers:
    """Multipliers of a lift with the hands at one of its ends."""
    travel = max(abs(lift.destination.vertical - lift.origin.vertical), LEAST_TRAVEL)
    reachable = place.horizontal <= FARTHEST
    turned = place.asymmetry <= MOST_ASYMMETRY + 1e-9
    return Multipliers(
        horizontal=NEAREST / max(place.horizontal, NEAREST) if reachable else 0.0,
        vertical=1.0 - 0.3 * abs(place.vertical - BEST_HEIGHT) if place.vertical <= HIGHEST else 0.0,
        distance=0.82 + 0.045 / travel if travel <= HIGHEST else 0.0,
        asymmetry=1.0 - 0.0032 * np.rad2deg(place.asymmetry) if turned else 0.0,
        frequency=frequency_multiplier(lift.frequency, lift.hours, lift.origin.vertical),
        coupling=COUPLING[lift.coupling][int(place.vertical >= BEST_HEIGHT)],
    )


def lifting_index(lift: Lift) -> LiftingIndex:
    """Recommended weight limit and lifting index of one lift."""
    return LiftingIndex(lift, multipliers(lift, lift.origin), multipliers(lift, lift.destination))


def composite_index(lifts: Sequence[Lift]) -> float:
    """Composite lifting index of a job of several lifts ([Waters1994]_ 2.4).

    The lifts are taken in the order of their indices, the highest first; each further one adds its index
    without frequency times what the frequencies added up cost. The table's column is that of the height of
    the lift that is added, which the manual leaves open.

    Raises:
        InputError: If there is no lift.
    """
    if not lifts:
        raise InputError("a job has no lifts; valid: at least one")
    single = sorted(map(lifting_index, lifts), key=lambda one: (-one.index, -one.lift.frequency))
    total, frequency = single[0].index, single[0].lift.frequency
    for one in single[1:]:
        lift = one.lift
        free = lifting_index(replace(lift, frequency=LEAST_FREQUENCY, hours=1.0)).index
        height, together = lift.origin.vertical, frequency + lift.frequency
        before, after = (frequency_multiplier(f, lift.hours, height) for f in (frequency, together))
        if after == 0.0:
            return inf
        total, frequency = total + free * (1.0 / after - 1.0 / before), together
    return float(total)


def _over(load: float, weight: float) -> float:
    return load / weight if weight > 0.0 else (inf if load > 0.0 else 0.0)


def _end(place: HandPlace, factors: Multipliers) -> dict[str, Any]:
    return {
        "horizontal_m": place.horizontal, "vertical_m": place.vertical,
        "asymmetry_deg": float(np.rad2deg(place.asymmetry)), "recommended_kg": factors.weight,
        "multipliers": dict(vars(factors)),
    }  # fmt: skip
