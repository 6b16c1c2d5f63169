"""Cycles of several people as if one had walked them all: what a person always does differently is taken out."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manikin.body import BodyModel
from manikin.locomotion.library import ROOT, MotionLibrary
from manikin.spatial import FloatArray

RUNNING, RUNNING_WIDTH = 2.05, 0.15
"""Speed between walks and runs [m/s], and the width of the change; of the preferred transition in adults."""

DOUBT, TREND_DOUBT = 0.05, 0.01
"""Squared differences [rad^2] over offsets [rad^2]: how readily offsets, and trends, are believed."""

_FIRST = ROOT.index("roll")


def as_one_person(body: BodyModel, cycles: Sequence[MotionLibrary], persons: Sequence[str]) -> list[MotionLibrary]:
    """Cycles with the mean postures of the person who has most of them.

    People hold arms, back and head in their own ways, and skeletons are fitted to them in different ways;
    blends of neighbouring cycles of two people would change with the speed from one habit to another. The mean
    angle of a hinge in a cycle is taken as a function of the velocity, the same for all, plus an
    offset of the person: linear least squares over all cycles and their mirror images.
    Only the offset is taken out, and only of mean angles; the movement stays the person's own.

    Args:
        body: The reference body.
        cycles: One cycle each.
        persons: Who made it.
    """
    main = Counter(persons).most_common(1)[0][0]
    others = sorted(set(persons) - {main})
    everything = [*cycles, *(cycle.mirrored(body) for cycle in cycles)]
    velocities = np.concatenate([cycle.velocities for cycle in everything])
    means = np.concatenate([cycle.coefficients[:, 0] for cycle in everything])
    trend = _trend(velocities)
    who = np.array([[float(person == other) for other in others] for person in (*persons, *persons)])
    who = who.reshape(len(everything), len(others))
    table = np.hstack([trend, who])
    doubt = np.full(table.shape[1], DOUBT)
    doubt[: trend.shape[1]], doubt[0] = TREND_DOUBT, 0.0
    solution = np.linalg.solve(table.T @ table + np.diag(doubt), table.T @ means)
    offsets = dict(zip(others, solution[trend.shape[1] :], strict=True))
    found = []
    for cycle, person in zip(cycles, persons, strict=True):
        coefficients = np.array(cycle.coefficients)
        if person != main:
            coefficients[:, 0, _FIRST:] -= offsets[person][_FIRST:]
        found.append(replace(cycle, coefficients=coefficients))
    return found


def _trend(velocities: FloatArray) -> FloatArray:
    """(n, 12) functions of (n, 3) velocities."""
    forward, left, angular = velocities.T
    speed = np.hypot(forward, left)
    running = 0.5 * (1.0 + np.tanh((speed - RUNNING) / (2.0 * RUNNING_WIDTH)))
    return np.column_stack([
        np.ones_like(speed), forward, speed, forward**2, left**2, angular**2, np.abs(angular), np.abs(left),
        running, left, angular, angular * speed,
    ])  # fmt: skip
