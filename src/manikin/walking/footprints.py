"""Footprints of a walk in time, and the stances they make."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from manikin.contact import Contact, ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array

FEET = ("left_foot", "right_foot")
"""Effectors that walk."""

SIMULTANEOUS = 1e-6
"""Touch-downs and lift-offs closer than this are one event [s]."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """One support of a foot.

    Attributes:
        effector: ``"left_foot"`` or ``"right_foot"``.
        position: (3,) centre of the sole in the world [m].
        yaw: Heading of the toes, counter-clockwise from the world's x [rad].
        lands: Touch-down [s]; the start of the walk for a foot that stands there.
        leaves: Lift-off [s]; the end of the walk for a foot that stays.

    Raises:
        InputError: If a value is not usable.
    """

    effector: str
    position: FloatArray
    yaw: float
    lands: float
    leaves: float

    def __init__(self, effector: str, position: ArrayLike, yaw: float, lands: float, leaves: float) -> None:
        if effector not in FEET:
            raise InputError(f"footprint effector is {effector!r}; valid: {', '.join(FEET)}")
        lands = finite_number(lands, f"footprint of {effector} lands [s]")
        vars(self).update(
            effector=effector,
            position=frozen_array(position, f"footprint of {effector} position [m]", (3,)),
            yaw=finite_number(yaw, f"footprint of {effector} yaw [rad]"),
            lands=lands,
            leaves=finite_number(leaves, f"footprint of {effector} leaves [s]", above=lands),
        )

    def placed(self, place: ArrayLike, height: float = 0.0) -> Footprint:
        """The same in a frame that stands at ``place``: x, y [m] and yaw [rad], at a height [m]."""
        x, y, turn = (float(value) for value in frozen_array(place, "place [m, m, rad]", (3,)))
        c, s = np.cos(turn), np.sin(turn)
        ahead, left, above = self.position
        position = [x + c * ahead - s * left, y + s * ahead + c * left, above + height]
        return Footprint(self.effector, position, self.yaw + turn, self.lands, self.leaves)


@dataclass(frozen=True, eq=False)
class Footprints:
    """All supports of both feet in a walk that begins and ends on both.

    Attributes:
        steps: In order of touch-down, those at the start first.

    Raises:
        InputError: If a foot lands before it left, both fly at once, or the walk does not begin and end on
            both feet.
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
    def duration(self) -> float:
        """Duration of the walk [s]."""
        return self.end - self.start

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

    def schedule(
        self, *, length: float, width: float, friction: float, normal_force_cap: float
    ) -> ContactSchedule:
        """Stances of the walk with full soles, at the times of the walk.

        Args:
            length: Length of the soles [m].
            width: Width of the soles [m].
            friction: Coulomb coefficient [-].
            normal_force_cap: Largest sum of the normal forces of each stance [N].
        """
        made: dict[Footprint, Contact] = {
            step: sole(step.effector, step.position, step.yaw, length=length, width=width, friction=friction)
            for step in self.steps
        }
        phases = [
            Phase(Stance([made[step] for step in held.values()], normal_force_cap), seconds, seconds)
            for held, seconds in self.phases()
        ]
        instants = np.cumsum([0.0, *(phase.min_duration for phase in phases)])
        return ContactSchedule(StanceSequence(phases), instants)

    def followed_by(self, other: Footprints) -> Footprints:
        """Another walk after this one, which begins on the footprints on which this one ends.

        Raises:
            InputError: If it begins elsewhere.
        """
        last, first = self.last(), other.first()
        shift = self.end - other.start
        for foot in FEET:
            gap = float(np.abs(last[foot].position - first[foot].position).max())
            turn = abs(float(np.angle(np.exp(1j * (last[foot].yaw - first[foot].yaw)))))
            if max(gap, turn) > 1e-6:
                raise InputError(
                    f"footprints that follow begin {gap:.3g} m and {turn:.3g} rad from where {foot} stands; "
                    "valid: on the same places"
                )
        joined = [step for step in self.steps if step is not last[step.effector]]
        for foot in FEET:
            step = last[foot]
            leaves = first[foot].leaves + shift
            joined.append(Footprint(foot, step.position, step.yaw, step.lands, leaves))
        for step in other.steps:
            if step is not first[step.effector]:
                joined.append(
                    Footprint(step.effector, step.position, step.yaw, step.lands + shift, step.leaves + shift)
                )
        return Footprints(joined)

    def _check(self, foot: str) -> None:
        steps = self.of(foot)
        if not steps:
            raise InputError(f"footprints have none of {foot}; valid: at least one of each foot")
        for before, after in itertools.pairwise(steps):
            if after.lands <= before.leaves + SIMULTANEOUS:
                raise InputError(
                    f"footprints let {foot} land at {after.lands:.3f} s before it has left at "
                    f"{before.leaves:.3f} s; valid: in the air in between"
                )
        if abs(steps[0].lands - self.start) > SIMULTANEOUS or abs(steps[-1].leaves - self.end) > SIMULTANEOUS:
            raise InputError(f"footprints begin or end with {foot} in the air; valid: on both feet")

    def _intervals(self) -> Iterator[tuple[float, float, dict[str, Footprint]]]:
        events = sorted({time for step in self.steps for time in (step.lands, step.leaves)})
        distinct = [events[0]]
        distinct += [time for time in events[1:] if time > distinct[-1] + SIMULTANEOUS]
        for begin, end in itertools.pairwise(distinct):
            middle = (begin + end) / 2
            yield begin, end, {s.effector: s for s in self.steps if s.lands <= middle < s.leaves}
