"""Push maps: how hard a standing body can be pushed, by direction, searched in several processes."""

import itertools
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from manikin.control.recovery import RecoverySettings
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray
from manikin.runtime.display import Displayed
from manikin.runtime.parallel import side_by_side
from manikin.simulation.push_search import DirectionSearch, HeldImpulse

USUAL = {
    "on both feet", "usual stance", "no step", "nothing locked", "with the program", "usual strength",
    "usual ankles",
}  # fmt: skip
"""Conditions that are not mentioned where all maps have them."""


def told_apart(maps: Sequence[Mapping[str, Any]]) -> tuple[str, list[str]]:
    """Words for the conditions that maps have in common, and for each map those that tell it from the others.

    The conditions are as in JSON. Usual common ones are left out; a map that differs in none has no words.
    """
    lists = [_words(conditions) for conditions in maps]
    differ = [len(set(words)) > 1 for words in zip(*lists, strict=True)]
    names = [", ".join(itertools.compress(words, differ)) for words in lists]
    common = [word for word, other in zip(lists[0], differ, strict=True) if not other and word not in USUAL]
    return ", ".join(common), names


def _words(conditions: Mapping[str, Any]) -> list[str]:
    """One text per condition, the same conditions in every list."""
    body, locked = conditions["body"], " and ".join(conditions["locked"])
    apart = conditions.get("feet_apart_m")  # not in maps that were searched before there was a choice
    strength, ankles, steps = (conditions[key] for key in ("strength", "ankle_stiffness", "steps"))
    return [
        "body of Kudoh" if body["model"] == "kudoh"
        else f"{body['sex']} of {body['stature_m']:g} m and {body['mass_kg']:g} kg",
        f"feet {conditions['feet']}",
        "on both feet" if conditions["support"] == "both" else f"on the {conditions['support']} foot",
        f"feet {apart:g} m apart" if apart else "usual stance",
        f"up to {steps} step{'s' * (steps > 1)}" if steps else "no step",
        f"{locked} locked" if locked else "nothing locked",
        "posture control only" if conditions["posture_control_only"] else "with the program",
        "usual strength" if strength == 1.0 else f"{strength:g} times the strength",
        "usual ankles" if ankles == RecoverySettings.ankle_stiffness else f"ankles of {ankles:g} m g h",
        f"reaction after {conditions['delay_s']:g} s",
        f"push of {conditions['duration_s']:g} s",
    ]  # fmt: skip


def search_directions(
    searches: Sequence[DirectionSearch], *, jobs: int = 1
) -> Generator[tuple[int, HeldImpulse]]:
    """Search directions, of one map or several, side by side.

    Each search depends on nothing but itself, so the result is the same for any number of jobs
    (:func:`manikin.runtime.parallel.side_by_side`).

    Returns:
        Index of each search and its result, in the order in which they end; closing it ends the rest.

    Raises:
        InputError: If ``jobs`` is less than 1, or a search refuses its push.
        ManikinError: If a process ends before its search.
    """
    if jobs < 1:
        raise InputError(f"jobs is {jobs}; valid: at least 1")
    return side_by_side(DirectionSearch.run, searches, jobs, "search")


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
        conditions: Plain values of the body and the pushes, for files and figures.
        directions: (n,) of the force, counter-clockwise from the body's forward axis, ascending [deg].
        found: Result of each direction; None where it has not been searched yet.
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
        """A map of directions that have not been searched yet."""
        found = (None,) * len(directions)
        return cls(conditions, tuple(directions), found, None if bound is None else tuple(bound))

    @property
    def missing(self) -> tuple[int, ...]:
        """Indices of the directions that have not been searched yet."""
        return tuple(number for number, found in enumerate(self.found) if found is None)

    @property
    def held(self) -> FloatArray:
        """(n,) largest impulse held [N.s]; NaN where it is not known or the body does not stand."""
        return np.array([None if f is None else f.held for f in self.found], dtype=np.float64)

    @property
    def beyond(self) -> FloatArray:
        """(n,) smallest impulse not held [N.s]; NaN where it is not known or there is none."""
        return np.array([None if f is None else f.beyond for f in self.found], dtype=np.float64)

    def with_found(self, number: int, found: HeldImpulse) -> "PushMap":
        """The map with the result of one direction more."""
        return replace(self, found=(*self.found[:number], found, *self.found[number + 1 :]))

    def surely_held(self, direction_deg: float) -> float:
        """Impulse held from any direction [N.s]: the smaller one of the two neighbouring directions."""
        return float(np.min(self.held[self._neighbours(direction_deg)]))

    def surely_beyond(self, direction_deg: float) -> float:
        """Impulse not held from any direction [N.s]: the larger one of the two neighbours."""
        return float(np.max(self.beyond[self._neighbours(direction_deg)]))

    def _neighbours(self, direction_deg: float) -> list[int]:
        after = int(np.searchsorted(self.directions, direction_deg % 360.0, side="right"))
        return [(after - 1) % len(self.directions), after % len(self.directions)]

    def as_dict(self) -> dict[str, Any]:
        """Plain values, the inverse of :meth:`from_dict`; ``trials`` is null where it is not searched yet."""
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
