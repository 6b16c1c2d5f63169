"""When a refined motion changes its contacts: phases that are slower than they have to be are shortened.

The times of a contact sequence are a guess at an easy pace; [Tonneau2015]_ retimes by the joints' speed
limits alone (4.4.2).  A phase whose joints stay far below their limits may be shorter; how much, balance and
strength decide, so the motion is refined again at each new timing, and a timing that breaks a requirement is
taken back.
"""

import numpy as np

from manikin.body import BodyModel
from manikin.contact import ContactSchedule
from manikin.motion import Motion
from manikin.spatial import FloatArray
from manikin.wholebody.refine_input import KeyPath, retime

SHORTER = 0.88
"""Least factor by which a phase gets shorter at once; with 0.75 more timings are taken back than kept."""

SHORTEST = 0.3
"""Duration below which no phase is shortened [s]; our choice."""

SETTLED = 0.97
"""Factor above which a phase counts as short enough."""

ROUNDS = 6
"""Most timings that are tried."""


def shortening(
    body: BodyModel, motion: Motion, schedule: ContactSchedule, share: float, settled: frozenset[int]
) -> FloatArray:
    """(phases,) factor on the duration of each phase, in [:data:`SHORTER`, 1].

    Args:
        body: The body.
        motion: Its motion at the present timing.
        schedule: Contacts in time.
        share: Of the velocity limits that the fastest joint of each phase should come up to.
        settled: Phases that stay as long as they are.
    """
    speed = (np.abs(motion.v[:, 6:]) / body.velocity_limit).max(axis=1, initial=0.0)
    phases = schedule.phase_at(motion.time)
    peaks = np.array([speed[phases == number].max(initial=0.0) for number in range(len(schedule.sequence))])
    factors = np.clip(peaks / share, SHORTER, 1.0)
    factors = np.maximum(factors, np.minimum(SHORTEST / schedule.durations, 1.0))
    factors[list(settled)] = 1.0
    return np.where(factors > SETTLED, 1.0, factors)


def shortened(
    path: KeyPath, schedule: ContactSchedule, factors: FloatArray
) -> tuple[KeyPath, ContactSchedule]:
    """Keys and contacts with every phase times its factor (phases,)."""
    after = schedule.instants[0] + np.concatenate([[0.0], np.cumsum(schedule.durations * factors)])
    return retime(path, schedule, schedule.instants, after)


def around(schedule: ContactSchedule, time: float) -> frozenset[int]:
    """The phase at a time [s] and those beside it."""
    number, last = int(schedule.phase_at(time)), len(schedule.sequence) - 1
    return frozenset(range(max(number - 1, 0), min(number + 1, last) + 1))
