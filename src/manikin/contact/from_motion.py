"""Contacts read back from the support mask of a motion.

The mask says in which samples each effector touches. Where and with what it touches follows from the
postures, which the caller knows; here are the phases, stances and poses that follow from both.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.contact.contact import Contact, point, sole
from manikin.contact.stance import ContactSchedule, Phase, Stance, StanceSequence
from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import FloatArray


def schedule_of_support(
    time: FloatArray, support: NDArray[np.bool_ | np.int8], contact: Callable[[int, int], Contact],
    normal_force_cap: float,
) -> ContactSchedule:  # fmt: skip
    """Phases of a motion, from each change of its supports to the next, each with its exact duration.

    Args:
        time: (n,) increasing [s]; the last sample ends the last phase.
        support: (n, k) whether each effector touches, or a number other than 0 for what of it touches.
        contact: Contact of the effector in a column of ``support`` in a row where it touches.
        normal_force_cap: Largest sum of normal forces of each stance [N].
    """
    changes = 1 + np.flatnonzero(np.any(np.diff(support[:-1], axis=0), axis=1))
    rows = [0, *changes.tolist(), len(time) - 1]
    phases = []
    for row, duration in zip(rows, np.diff(time[rows]).tolist(), strict=False):
        held = [contact(column, row) for column in np.flatnonzero(support[row]).tolist()]
        phases.append(Phase(Stance(held, normal_force_cap), duration, duration))
    return ContactSchedule(StanceSequence(phases), time[rows])


def stance_at(
    placements: Mapping[str, tuple[FloatArray, FloatArray]], sizes: Mapping[str, tuple[float, float]],
    friction: float, normal_force_cap: float,
) -> Stance:  # fmt: skip
    """Stance of the effectors that touch in one sample, at their poses.

    Args:
        placements: Rotation (3, 3) to the world and position (3,) [m] of each effector that touches.
        sizes: Length and width of those that touch with a rectangle [m]; the others touch with a point.
        friction: Coulomb coefficient of every contact.
        normal_force_cap: Largest sum of normal forces [N].
    """
    contacts = [
        sole(name, position, rotation=turn, length=sizes[name][0], width=sizes[name][1], friction=friction)
        if name in sizes
        else point(name, position, rotation=turn, friction=friction)
        for name, (turn, position) in placements.items()
    ]
    return Stance(contacts, normal_force_cap)


@dataclass(frozen=True)
class LevelSupport:
    """One support of an effector, level and at rest where the effector is in the middle of it.

    Attributes:
        first: First sample in which it touches.
        middle: The sample whose pose is taken.
        stop: The sample after the last.
        x, y: Of the effector in the world [m].
        yaw: Heading of its x axis about the vertical [rad].
    """

    first: int
    middle: int
    stop: int
    x: float
    y: float
    yaw: float


def level_supports(
    support: NDArray[np.bool_], placement: Callable[[int], tuple[FloatArray, FloatArray]]
) -> Iterator[LevelSupport]:
    """Supports of one effector in order.

    Args:
        support: (n,) whether it touches.
        placement: Rotation (3, 3) to the world and position (3,) [m] of the effector in a sample.
    """
    for first, stop in mask_runs(support):
        middle = (first + stop) // 2
        rotation, (x, y, _) = placement(middle)
        heading = math.atan2(rotation[1, 0], rotation[0, 0])
        yield LevelSupport(first, middle, stop, float(x), float(y), heading)
