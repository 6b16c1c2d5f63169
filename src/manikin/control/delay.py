"""Torques that act later than they are asked for: what is on its way, and how late it is.

The delay is found from the torques that the joints feel: the mean of the last period is a mix of two
neighbouring commands, whose age and shares say how late torques act.
"""

from collections import deque
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from manikin.numerics.spatial import FloatArray

LONGEST = 0.1
"""Longest delay that is looked for [s]."""

MEMORY = 0.2
"""Time over which the torques that are felt are compared with those asked for; older ones fade [s]."""

CREEP = 0.4
"""The believed delay changes by at most this many periods per step, so that time always goes on."""

TELLING = 9.0
"""Another delay is believed where the torques felt are nearer to it by this many times their variance."""


class PendingDecisions:
    """Accelerations decided on, each of which acts for a period, later by the delay.

    Attributes:
        delay: From a decision until it acts [s].
    """

    def __init__(self, nv: int, delay: float, period: float) -> None:
        """Prepare for a delay and a control period [s]; nothing is on its way yet."""
        self.delay, self._period, self._nothing = delay, period, np.zeros(nv)
        self._decided = deque[FloatArray](maxlen=round(max(LONGEST, delay) / period) + 2)

    def append(self, acceleration: FloatArray) -> None:
        """Add the acceleration (nv,) decided on now, at the beginning of a period."""
        self._decided.append(acceleration)

    def acted(self) -> FloatArray:
        """(nv,) mean acceleration decided on of what has acted during the last period."""
        some = self._between(-self._period, 0.0)
        return sum((time * decided for time, decided in some), self._nothing) / self._period

    def coming(self) -> Iterator[tuple[float, FloatArray]]:
        """What acts from now on until a decision made now does, as durations [s] and accelerations."""
        return self._between(0.0, self.delay)

    def _between(self, start: float, end: float) -> Iterator[tuple[float, FloatArray]]:
        """What acts between two times from now [s], the earliest first."""
        for age, decided in zip(range(len(self._decided), 0, -1), self._decided, strict=True):
            begins = self.delay - age * self._period
            time = min(end, begins + self._period) - max(start, begins)
            if time > 0.0:
                yield time, decided


class DelayEstimator:
    """Finds the delay of torques from those that are felt, by least squares.

    Attributes:
        delay: As believed now [s].
    """

    def __init__(self, delay: float, period: float) -> None:
        """Believe in a delay until the torques that are felt tell another one; both times in s."""
        self.delay, self._period = delay, period
        count = round(max(LONGEST, delay) / period) + 1
        self._commands = deque[FloatArray](maxlen=count + 1)
        self._products, self._samples = np.zeros((count, 3)), 0.0
        self._keeps = float(np.exp(-period / MEMORY))

    def commanded(self, torque: FloatArray) -> None:
        """Note the torques (nv - 6,) asked for from now on [N.m]; the first ones as if they always were."""
        if not self._commands:
            self._commands.extend([torque] * len(self._products))
        self._commands.append(torque)

    def felt(self, torque: FloatArray) -> None:
        """Compare the mean torques (nv - 6,) of the last period [N.m] with those that were asked for."""
        if not self._commands:
            return
        # For each whole number of periods |a|^2, a.b and |b|^2: a is the torque felt less the later of two
        # commands, b the earlier less the later one.
        rows = [
            ((away := torque - later) @ away, away @ (change := earlier - later), change @ change)
            for later, earlier in pairwise(reversed(self._commands))
        ]
        self._products = self._keeps * self._products + np.array(rows)
        self._samples = self._keeps * self._samples + len(torque)
        mixed, changes = self._products[:, 1:].T
        shares = np.clip(np.divide(mixed, changes, out=np.zeros_like(mixed), where=changes > 0.0), 0.0, 1.0)
        off = self._off(np.arange(len(shares)), shares)
        best, now = int(np.argmin(off)), min(self.delay / self._period, len(off) - 1e-9)
        if self._off(int(now), now % 1.0) - off[best] > TELLING * off[best] / self._samples:
            away = best + float(shares[best]) - now
            self.delay += self._period * min(max(away, -CREEP), CREEP)

    def _off(self, whole: int | NDArray[np.intp], share: float | FloatArray) -> FloatArray:
        """Squared distance of the torques felt from those asked for, at whole periods and shares of one."""
        square, mixed, changes = self._products[whole].T
        return np.asarray(square - 2.0 * share * mixed + share**2 * changes)
