"""Cycles of several people as if one had walked them all: each one's habits are taken out."""

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


def as_one_person(
    body: BodyModel, cycles: Sequence[MotionLibrary], persons: Sequence[str]
) -> list[MotionLibrary]:
    """Cycles with the mean postures of the person who has most of them, equal on both sides.

    People hold arms, back and head in their own ways, and skeletons are fitted to them in different ways;
    blends of neighbouring cycles of two people would change with the speed from one habit to another. The
    mean angle of a hinge in a cycle is taken as a function of the velocity, the same for all, plus an offset
    of the person. What is equal on both sides is an even function of lateral and angular
    velocity, what is opposite an odd one; each is fitted by linear least squares. Only offsets are taken
    out, and only of mean angles; the movement stays the person's own.

    Args:
        body: The reference body.
        cycles: One cycle each.
        persons: Who made it.
    """
    everyone = sorted(set(persons))
    main = Counter(persons).most_common(1)[0][0]
    velocities = np.concatenate([cycle.velocities for cycle in cycles])
    means = np.concatenate([cycle.coefficients[:, 0] for cycle in cycles])
    reflected = np.concatenate([cycle.mirrored(body).coefficients[:, 0] for cycle in cycles])
    even, odd = _trends(velocities)
    equal = _offsets(even, persons, [one for one in everyone if one != main], 0.5 * (means + reflected))
    opposite = _offsets(odd, persons, everyone, 0.5 * (means - reflected))
    found = []
    for cycle, person in zip(cycles, persons, strict=True):
        coefficients = np.array(cycle.coefficients)
        offset = equal.get(person, 0.0) + opposite[person]
        coefficients[:, 0, _FIRST:] -= offset[_FIRST:]
        found.append(replace(cycle, coefficients=coefficients))
    return found


def _offsets(
    trend: FloatArray, persons: Sequence[str], chosen: Sequence[str], means: FloatArray
) -> dict[str, FloatArray]:
    """(s,) offsets of the chosen persons from what the trend explains of (n, s) means."""
    who = np.array([[float(person == one) for one in chosen] for person in persons])
    table = np.hstack([trend, who.reshape(len(persons), len(chosen))])
    doubt = np.full(table.shape[1], DOUBT)
    doubt[: trend.shape[1]] = TREND_DOUBT
    solution = np.linalg.solve(table.T @ table + np.diag(doubt), table.T @ means)
    return dict(zip(chosen, solution[trend.shape[1] :], strict=True))


def _trends(velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Even (n, 9) and odd (n, 3) functions of (n, 3) velocities."""
    forward, left, angular = velocities.T
    speed = np.hypot(forward, left)
    running = 0.5 * (1.0 + np.tanh((speed - RUNNING) / (2.0 * RUNNING_WIDTH)))
    even = np.column_stack([
        np.ones_like(speed), forward, speed, forward**2, left**2, angular**2, np.abs(angular), np.abs(left),
        running,
    ])  # fmt: skip
    return even, np.column_stack([left, angular, angular * speed])
