"""How hard a standing body can be pushed, by direction."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.display import Displayed
from manikin.errors import InputError
from manikin.simulation.push_search import HeldImpulse
from manikin.spatial import FloatArray


def equal_directions(count: int) -> tuple[float, ...]:
    """Directions all around, the first one forward [deg].

    Raises:
        InputError: If there are none, or more than one per degree.
    """
    if not 1 <= count <= 360:
        raise InputError(f"number of directions is {count}; valid: 1 to 360")
    return tuple(360.0 * number / count for number in range(count))


@dataclass(frozen=True, eq=False, repr=False)
class PushMap(Displayed):
    """The largest impulses held, by direction; every direction is searched, none follows from symmetry.

    Attributes:
        conditions: Plain values that say who was pushed and how, for files and figures.
        directions: (n,) of the force, counter-clockwise from the body's forward axis, ascending [deg].
        found: What was found for each direction; None where it has not been searched yet.
        bound: (n,) upper bound of the impulse held without a step, from the pendulum with a flywheel
            [N.s]; None where there is none, as of feet that are held.
    """

    conditions: Mapping[str, Any]
    directions: tuple[float, ...]
    found: tuple[HeldImpulse | None, ...]
    bound: tuple[float, ...] | None = None

    @classmethod
    def empty(
        cls, conditions: Mapping[str, Any], directions: Sequence[float], bound: Sequence[float] | None = None
    ) -> "PushMap":
        """A map of which nothing is known but its bound."""
        bounds = None if bound is None else tuple(bound)
        return cls(conditions, tuple(directions), (None,) * len(directions), bounds)

    @property
    def missing(self) -> tuple[int, ...]:
        """Indices of the directions that have not been searched yet."""
        return tuple(number for number, found in enumerate(self.found) if found is None)

    @property
    def held(self) -> FloatArray:
        """(n,) largest impulse held [N.s]; NaN where it is not known or the body does not stand."""
        return np.array([np.nan if f is None or f.held is None else f.held for f in self.found])

    @property
    def beyond(self) -> FloatArray:
        """(n,) smallest impulse not held [N.s]; NaN where it is not known or there is none."""
        return np.array([np.nan if f is None or f.beyond is None else f.beyond for f in self.found])

    def with_found(self, number: int, found: HeldImpulse) -> "PushMap":
        """The same map with one direction more."""
        return replace(self, found=(*self.found[:number], found, *self.found[number + 1 :]))

    def surely_held(self, direction_deg: float) -> float:
        """Impulse held from any direction [N.s]: the smaller one of the two neighbours, to be safe."""
        return float(np.min(self.held[list(self._neighbours(direction_deg))]))

    def surely_beyond(self, direction_deg: float) -> float:
        """Impulse not held from any direction [N.s]: the larger one of the two neighbours."""
        return float(np.max(self.beyond[list(self._neighbours(direction_deg))]))

    def _neighbours(self, direction_deg: float) -> tuple[int, int]:
        after = int(np.searchsorted(self.directions, direction_deg % 360.0, side="right"))
        return (after - 1) % len(self.directions), after % len(self.directions)

    def as_dict(self) -> dict[str, Any]:
        """Plain values; the inverse of :meth:`from_dict`.

        ``trials`` is null for a direction that has not been searched yet.
        """
        return {
            **self.conditions, "directions_deg": list(self.directions),
            "impulse_Ns": [None if f is None else f.held for f in self.found],
            "beyond_Ns": [None if f is None else f.beyond for f in self.found],
            "trials": [None if f is None else f.trials for f in self.found],
            "bound_Ns": None if self.bound is None else list(self.bound),
        }  # fmt: skip

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "PushMap":
        """Map of plain values.

        Raises:
            KeyError: If a key is missing.
            ValueError: If the lists are not equally long.
        """
        rest = dict(data)
        directions, bound = tuple(rest.pop("directions_deg")), rest.pop("bound_Ns")
        rows = zip(directions, *(rest.pop(key) for key in ("impulse_Ns", "beyond_Ns", "trials")), strict=True)
        found = tuple(None if trials is None else HeldImpulse(held, beyond, trials)
                      for _, held, beyond, trials in rows)  # fmt: skip
        if bound is not None and len(bound) != len(directions):
            raise ValueError(f"{len(bound)} bounds of {len(directions)} directions")
        return cls(rest, directions, found, None if bound is None else tuple(bound))
