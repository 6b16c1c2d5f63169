"""Where and when a foot is put down so that the body can come to rest over it.

While one foot carries, with the ZMP ``p`` held at the point of its sole that is nearest to the capture point
``c``, the capture point of a linear inverted pendulum runs away as ``c(t) = p + (c - p) exp(w t)``. A step of
the duration ``T`` captures the body when ``c(T)`` is over the hull of the old sole and the new one (Pratt et
al. 2006, Koolen et al. 2012).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from manikin.contact import Contact
from manikin.control.balance_recovery.support_area import SupportArea
from manikin.spatial import FloatArray, finite_number


@dataclass(frozen=True)
class StepSettings:
    """Limits of a step; those of quick steps of people, by measurements of others (Maki and McIlroy 1997).

    Attributes:
        most: Number of steps at most.
        beyond: A step is taken when the capture point is farther than this outside the soles [m].
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

ALONG = np.linspace(-0.15, 0.15, 7)
"""Middles of the foot that are tried, from the capture point on landing, forwards [m]."""

ACROSS = np.linspace(-0.2, 0.35, 12)
"""And outwards from where the foot is now [m]."""


def capture_after(
    capture: FloatArray, area: SupportArea, frequency: float, time: float, inset: float
) -> FloatArray:
    """(2,) capture point after a time on a support area, its ZMP as near to the capture point as it may be [m].

    Args:
        capture: (2,) now [m].
        area: That carries.
        frequency: Of the pendulum [1/s].
        time: [s].
        inset: Of the ZMP from the edge [m].
    """
    zmp = area.closest(capture, inset)
    return zmp + (capture - zmp) * np.exp(frequency * time)


def step_goals(
    soles: tuple[Contact, Contact], capture: FloatArray, frequency: float, settings: StepSettings
) -> Iterator[StepGoal]:
    """Steps that capture the body, the shortest in time first, then the shortest in space.

    Args:
        soles: Both feet on the ground, the left one first.
        capture: (2,) capture point [m].
        frequency: Of the pendulum [1/s].
        settings: Limits.
    """
    for duration in np.arange(settings.shortest, settings.longest + 1e-9, DURATION_STEP):
        found: list[tuple[float, StepGoal]] = []
        for moving, standing, outward in ((soles[0], soles[1], 1.0), (soles[1], soles[0], -1.0)):
            area = SupportArea.of([standing])
            landing = capture_after(capture, area, frequency, float(duration), settings.inset)
            for position in _places(moving, standing, outward, landing, float(duration), settings):
                new = SupportArea.of([standing, _moved(moving, position)])
                inside = float(new.inside(landing))
                if inside >= settings.inside:
                    rotation = moving.rotation_contact_to_world
                    length = float(np.linalg.norm(position - moving.position))
                    goal = StepGoal(moving.effector, position, rotation, float(duration), landing)
                    found.append((length - inside, goal))
        yield from (goal for _, goal in sorted(found, key=lambda item: item[0]))


def _places(
    moving: Contact, standing: Contact, outward: float, landing: FloatArray, duration: float,
    settings: StepSettings,
) -> Iterator[FloatArray]:  # fmt: skip
    """(3,) places for a foot that can be reached in time without crossing the legs."""
    axes = moving.rotation_contact_to_world[:2, :2]
    ahead = axes.T @ (landing - moving.position[:2])
    for along in ahead[0] + ALONG:
        for across in outward * ACROSS:
            move = axes @ np.array([along, across])
            position = moving.position + np.array([*move, 0.0])
            between = axes.T @ (position - standing.position)[:2]
            apart = outward * between[1] >= settings.apart
            near = float(np.linalg.norm(between)) <= settings.reach
            if apart and near and float(np.linalg.norm(move)) <= settings.speed * duration:
                yield position


def _moved(contact: Contact, position: FloatArray) -> Contact:
    return replace(contact, position=position)
