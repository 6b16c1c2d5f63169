"""Footprints of a walk in time."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array

FEET = ("left_foot", "right_foot")
"""Effectors that walk."""

SIMULTANEOUS = 1e-6
"""Touch-downs and lift-offs closer than this are one event [s]."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """One support of a foot; InputError if a value is not usable.

    Attributes:
        effector: ``"left_foot"`` or ``"right_foot"``.
        position: (3,) centre of the sole in the world [m].
        yaw: Heading of the toes, counter-clockwise from the world's x [rad].
        lands: Touch-down [s]; the start of the walk for a foot that stands there.
        leaves: Lift-off [s]; the end of the walk for a foot that stays.
    """

    effector: str
    position: FloatArray
    yaw: float
    lands: float
    leaves: float

    def __init__(self, effector: str, position: ArrayLike, yaw: float, lands: float, leaves: float) -> None:
        if effector not in FEET:
            raise InputError(f"footprint effector is {effector!r}; valid: {', '.join(FEET)}")
        where = f"footprint of {effector}"
        lands = finite_number(lands, f"{where} lands [s]")
        vars(self).update(
            effector=effector, position=frozen_array(position, f"{where} position [m]", (3,)),
            yaw=finite_number(yaw, f"{where} yaw [rad]"), lands=lands,
            leaves=finite_number(leaves, f"{where} leaves [s]", above=lands),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Footprints:
    """All supports of both feet in a walk that begins and ends on both.

    InputError if a foot lands before it left, both fly at once, or the walk does not begin and end on both.

    Attributes:
        steps: In order of touch-down, those at the start first.
    """

    steps: tuple[Footprint, ...]

    def __init__(self, steps: Sequence[Footprint]) -> None:
        ordered = tuple(sorted(steps, key=lambda step: (step.lands, step.effector)))
        object.__setattr__(self, "steps", ordered)
        for foot in FEET:
            self._check(foot)
        for _, _, held in self._intervals():
            if not held:
                raise InputError("footprints leave both feet in the air; valid: one of them on the ground")

    @property
    def start(self) -> float:
        """Start of the walk [s]."""
        return self.steps[0].lands

    @property
    def end(self) -> float:
        """End of the walk [s]."""
        return max(step.leaves for step in self.steps)

    @property
    def count(self) -> int:
        """Number of steps, the two supports at the start not counted."""
        return len(self.steps) - len(FEET)

    def of(self, effector: str) -> tuple[Footprint, ...]:
        """Supports of one foot, in order."""
        return tuple(step for step in self.steps if step.effector == effector)

    def first(self) -> dict[str, Footprint]:
        """Support of each foot at the start."""
        return {foot: self.of(foot)[0] for foot in FEET}

    def last(self) -> dict[str, Footprint]:
        """Support of each foot at the end."""
        return {foot: self.of(foot)[-1] for foot in FEET}

    def phases(self) -> Iterator[tuple[dict[str, Footprint], float]]:
        """Double and single supports in order: footprints by foot, and duration [s]."""
        for begin, end, held in self._intervals():
            yield held, end - begin

    def _check(self, foot: str) -> None:
        steps = self.of(foot)
        if not steps:
            raise InputError(f"footprints have none of {foot}; valid: at least one of each foot")
        for before, after in itertools.pairwise(steps):
            if after.lands <= before.leaves + SIMULTANEOUS:
                wrong = f"land at {after.lands:.3f} s before it has left at {before.leaves:.3f} s"
                raise InputError(f"footprints let {foot} {wrong}; valid: in the air in between")
        if abs(steps[0].lands - self.start) > SIMULTANEOUS or abs(steps[-1].leaves - self.end) > SIMULTANEOUS:
            raise InputError(f"footprints begin or end with {foot} in the air; valid: on both feet")

    def _intervals(self) -> Iterator[tuple[float, float, dict[str, Footprint]]]:
        events = sorted({time for step in self.steps for time in (step.lands, step.leaves)})
        distinct = [events[0]]
        distinct += [time for time in events[1:] if time > distinct[-1] + SIMULTANEOUS]
        for begin, end in itertools.pairwise(distinct):
            middle = (begin + end) / 2
            yield begin, end, {s.effector: s for s in self.steps if s.lands <= middle < s.leaves}
