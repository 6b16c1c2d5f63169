"""Where and when a foot is put down so that the body can come to rest over it.

While one foot carries, with the ZMP ``p`` at the point of its sole nearest to the capture point ``c``, that
of a linear inverted pendulum runs away as ``c(t) = p + (c - p) exp(w t)``. A step of the duration ``T``
captures the body when ``c(T)`` is over the hull of both soles (Pratt et al. 2006, Koolen et al. 2012).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from manikin.contact import Contact
from manikin.control.recovery.standing import SupportArea
from manikin.numerics.spatial import FloatArray, finite_number


@dataclass(frozen=True)
class StepSettings:
    """Limits of a step; the values are ours, of the order of quick human steps.

    Attributes:
        most: Number of steps at most.
        beyond: A step is taken when the capture point is farther than this outside the soles [m].
        again: And a further one when it is less than this inside the soles after the last one [m].
        shortest: Time from the decision to the landing at least [s].
        longest: And at most [s].
        speed: Mean speed of the foot at most [m/s].
        reach: Distance between the feet at most [m].
        apart: Sideways distance between the middles of two feet that are side by side at least [m].
        inside: How far the capture point shall be inside the new support area on landing [m].
        clearance: Height of the foot half way [m].
        inset: The ZMP is kept this far inside the edge of the foot that carries [m].
        aim_until: Time before the landing until which the goal follows the capture point [s].
    """

    most: int = 1
    beyond: float = 0.02
    again: float = 0.02
    shortest: float = 0.25
    longest: float = 0.6
    speed: float = 2.0
    reach: float = 0.75
    apart: float = 0.14
    inside: float = 0.04
    clearance: float = 0.06
    inset: float = 0.01
    aim_until: float = 0.1

    def __post_init__(self) -> None:
        for name in ("shortest", "longest", "speed", "reach", "apart", "clearance"):
            finite_number(getattr(self, name), f"step {name}", above=0.0)


@dataclass(frozen=True, eq=False)
class StepGoal:
    """Where a foot is to be put down.

    Attributes:
        foot: Effector.
        position: (3,) of the middle of its sole [m].
        rotation: (3, 3) sole to world.
        duration: From now to the landing [s].
        capture: (2,) expected capture point on landing [m].
    """

    foot: str
    position: FloatArray
    rotation: FloatArray
    duration: float
    capture: FloatArray


DURATION_STEP = 0.025
"""Durations of steps that are tried differ by this [s]."""

ALONG = np.linspace(-0.45, 0.15, 25)
"""Middles of the foot that are tried, from the capture point on landing, forwards [m]."""

ACROSS = np.linspace(-0.2, 0.35, 23)
"""And outwards from where the foot is now [m]."""

FIRST_OF_TWO = 60
"""First steps from which a second one is sought, those that leave the capture point least outside."""


def capture_after(
    capture: FloatArray, area: SupportArea, frequency: float, time: float, inset: float
) -> FloatArray:
    """(2,) capture point after a time [s], with the ZMP as near to it as the support area allows [m].

    ``capture`` (2,) is that now [m], ``frequency`` the pendulum's [1/s], the ZMP ``inset`` [m] from the edge.
    """
    zmp = area.closest(capture, inset)
    return zmp + (capture - zmp) * np.exp(frequency * time)


def step_goals(
    soles: tuple[Contact, Contact], capture: FloatArray, frequency: float, settings: StepSettings, steps: int
) -> Iterator[StepGoal]:
    """Steps that capture the body, the shortest in time first, then the shortest in space.

    Where no single step does and two may be taken, those follow from which a second one does. Both feet are
    on the ground, the left one first; capture point (2,) [m] and frequency [1/s] are those of the pendulum.
    """
    durations = np.arange(settings.shortest, settings.longest + 1e-9, DURATION_STEP).tolist()
    tried = [_reachable(soles, k, capture, frequency, time, settings) for time in durations for k in (0, 1)]
    captured = False
    for pair in zip(tried[::2], tried[1::2], strict=True):
        goals = [goal for places in pair for goal in places.captured(settings.inside)]
        captured = captured or bool(goals)
        yield from (goal for _, goal in sorted(goals, key=lambda item: item[0]))
    if captured or steps < 2:
        return
    leading = sorted((goal for places in tried for goal in places.nearest()), key=lambda item: item[0])
    for _, goal in leading[:FIRST_OF_TWO]:
        after = tuple(
            replace(sole, position=goal.position, rotation_contact_to_world=goal.rotation)
            if sole.effector == goal.foot else sole
            for sole in soles
        )  # fmt: skip
        if next(step_goals((after[0], after[1]), goal.capture, frequency, settings, 1), None) is not None:
            yield goal


@dataclass(frozen=True, eq=False)
class _Places:
    """Places for one foot after one time: (k, 2) middles, room around the capture point (k,), moves (k,)."""

    foot: str
    rotation: FloatArray
    height: float
    duration: float
    capture: FloatArray
    middles: FloatArray
    room: FloatArray
    moved: FloatArray

    def captured(self, inside: float) -> list[tuple[float, StepGoal]]:
        """Goals whose room is enough, with their cost."""
        enough = np.flatnonzero(self.room >= inside).tolist()
        return [(float(self.moved[k] - self.room[k]), self._goal(k)) for k in enough]

    def nearest(self) -> list[tuple[float, StepGoal]]:
        """At each distance across, the goal that leaves the capture point least outside, with how far."""
        last = {round(float(self.middles[k, 1]), 6): int(k) for k in np.argsort(self.room, kind="stable")}
        return [(-float(self.room[k]), self._goal(k)) for k in last.values()]

    def _goal(self, k: int) -> StepGoal:
        position = np.array([*self.middles[k], self.height])
        return StepGoal(self.foot, position, self.rotation, self.duration, self.capture)


def _reachable(
    soles: tuple[Contact, Contact], moving: int, capture: FloatArray, frequency: float, duration: float,
    settings: StepSettings,
) -> _Places:  # fmt: skip
    """Places that a foot can be put down on in time, parallel to the other one and without crossing it."""
    foot, stays, outward = soles[moving], soles[1 - moving], (1.0, -1.0)[moving]
    area, rotation = SupportArea.of([stays]), stays.rotation_contact_to_world
    landing, axes = capture_after(capture, area, frequency, duration, settings.inset), rotation[:2, :2]
    ahead = float(axes[:, 0] @ (landing - foot.position[:2]))
    steps = np.stack(np.meshgrid(ahead + ALONG, outward * ACROSS, indexing="ij"), axis=-1).reshape(-1, 2)
    middles = foot.position[:2] + steps @ axes.T
    between = (middles - stays.position[:2]) @ axes
    moved = np.linalg.norm(steps, axis=1)
    allowed = (
        (outward * between[:, 1] >= settings.apart)
        & (np.linalg.norm(between, axis=1) <= settings.reach)
        & (moved <= settings.speed * duration)
    )
    middles, moved, height = middles[allowed], moved[allowed], float(stays.position[2])
    room = _room(area, middles - stays.position[:2], landing)
    return _Places(foot.effector, rotation, height, duration, landing, middles, room, moved)


def _room(area: SupportArea, moves: FloatArray, point: FloatArray) -> FloatArray:
    """(k,) distance of a point (2,) to the nearest edge of the hull of an area and its copies, inside > 0.

    The hull with a copy moved by ``d`` has the area's edges, moved out where ``d`` does, and two along ``d``.
    """
    normals, offsets = area.half_planes()
    out = offsets + np.maximum(moves @ normals.T, 0.0) - normals @ point
    length = np.maximum(np.linalg.norm(moves, axis=1), 1e-12)
    beside = np.column_stack((-moves[:, 1], moves[:, 0])) / length[:, None]
    corners = beside @ area.corners.T
    along = np.stack((corners.max(axis=1) - beside @ point, beside @ point - corners.min(axis=1)), axis=1)
    return np.min(np.concatenate((out, along), axis=1), axis=1)
