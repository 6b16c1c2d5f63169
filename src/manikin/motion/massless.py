"""Where the massless feet of a point mass are: on their contacts, and between them in flight."""

import numpy as np

from manikin.contact import ContactSchedule
from manikin.spatial import FloatArray

LIFT = 0.08
"""Largest distance from the surfaces in flight [m]."""


def foot_positions(schedule: ContactSchedule, times: FloatArray) -> dict[str, FloatArray]:
    """(n, 3) position of every effector of a schedule [m].

    In flight a foot follows the straight line to its next contact with the smootherstep of time,
    lifted along the mean of both normals by ``LIFT sin^2(pi u)``; it has no mass, so any path will
    do. Before its first contact and after its last one it waits there.

    Args:
        schedule: Contacts in time.
        times: (n,) [s].
    """
    positions = {}
    swings = schedule.sequence.swings()
    for name in schedule.sequence.effectors:
        found = np.empty((len(times), 3))
        for number, phase in enumerate(schedule.sequence):
            if name in phase.stance:
                found[schedule.phase_at(times) == number] = phase.stance[name].position
        for swing in (item for item in swings if item.effector == name):
            inside = (schedule.phase_at(times) >= swing.first_phase) & (
                schedule.phase_at(times) <= swing.last_phase
            )
            first, last = swing.start or swing.end, swing.end or swing.start
            if first is None or last is None:
                continue
            begin, end = schedule.swing_interval(swing)
            u = np.clip((times[inside] - begin) / (end - begin), 0.0, 1.0)[:, None]
            path = first.position + u**3 * (u * (6.0 * u - 15.0) + 10.0) * (last.position - first.position)
            normal = (first.normal + last.normal) / 2.0
            still = swing.start is None or swing.end is None
            found[inside] = path + (0.0 if still else LIFT) * np.sin(np.pi * u) ** 2 * normal
        positions[name] = found
    return positions
