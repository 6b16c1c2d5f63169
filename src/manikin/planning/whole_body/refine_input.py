"""Input of the refinement: key configurations joined by interpolation, their contacts, and their timing.

The times of a contact sequence are a guess at an easy pace; [Tonneau2015]_ retimes by the joints' speed
limits alone (4.4.2).  A phase whose joints stay far below their limits may be shorter; how much, balance and
strength decide, so the motion is refined again at each new timing, and a timing that breaks a requirement is
taken back.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from manikin.body import BodyModel
from manikin.contact import ContactSchedule, SolePart
from manikin.errors import ContactError, InputError
from manikin.motion import Motion
from manikin.motion.configuration_spline import align_quaternions
from manikin.numerics.spatial import FloatArray, frozen_array

PEAK = 1.6
"""Peak speed of a smooth motion through key configurations, relative to the mean between two of them."""


@dataclass(frozen=True, eq=False)
class KeyPath:
    """Key configurations in time, joined by linear interpolation; the pelvis' attitude by the shortest turn.

    Attributes:
        time: (n,) increasing [s].
        q: (n, nq) configurations, quaternions of unit length and in one half-space one after the other.
    """

    time: FloatArray
    q: FloatArray

    def __init__(self, time: ArrayLike, q: ArrayLike) -> None:
        """Check and keep a path.

        Raises:
            InputError: If there are fewer than two keys, their times do not increase, a number is not
                finite, or a quaternion is zero.
        """
        times = frozen_array(time, "key times [s]", (None,))
        if len(times) < 2:
            raise InputError(f"path has {len(times)} key configurations; valid: at least two")
        if not np.all(np.diff(times) > 0.0):
            raise InputError(f"key times are {times.tolist()}; valid: strictly increasing seconds")
        keys = np.array(frozen_array(q, "key configurations", (len(times), None)))
        length = np.linalg.norm(keys[:, 3:7], axis=1)
        if keys.shape[1] < 7 or np.any(length < 1e-6):
            raise InputError(
                f"key configuration {int(np.argmin(length))} has no attitude; "
                "valid: position, xyzw quaternion, joint angles"
            )
        keys[:, 3:7] /= length[:, None]
        object.__setattr__(self, "time", times)
        object.__setattr__(self, "q", frozen_array(align_quaternions(keys), "key configurations"))

    @property
    def duration(self) -> float:
        """Time from the first to the last key [s]."""
        return float(self.time[-1] - self.time[0])

    def at(self, time: FloatArray) -> FloatArray:
        """(n, nq) configurations at ``time`` (n,) [s], clamped to the path."""
        t = np.clip(time, self.time[0], self.time[-1])
        out = np.empty((len(t), self.q.shape[1]))
        for column in (*range(3), *range(7, self.q.shape[1])):
            out[:, column] = np.interp(t, self.time, self.q[:, column])
        out[:, 3:7] = Slerp(self.time, Rotation.from_quat(self.q[:, 3:7]))(t).as_quat()
        return align_quaternions(out)

    def through(self, time: float, q: FloatArray) -> "KeyPath":
        """The path with one more configuration (nq,) at a time [s], which replaces keys within 10 ms."""
        kept = np.abs(self.time - time) > 0.01
        at = int(np.searchsorted(self.time[kept], time))
        return KeyPath(np.insert(self.time[kept], at, time), np.insert(self.q[kept], at, q, axis=0))


def check_input(body: BodyModel, path: KeyPath, schedule: ContactSchedule) -> None:
    """Refuse keys, contacts and bodies that do not fit each other.

    Raises:
        InputError: If the configurations are not the body's or the times differ.
        ContactError: If the body has no such effector or another part of a sole than its toes is asked for.
    """
    if (count := path.q.shape[1]) != body.nq:
        raise InputError(f"key configurations have {count} columns; valid: {body.nq} of {body.name!r}")
    ends, wanted = (path.time[0], path.time[-1]), (schedule.instants[0], schedule.instants[-1])
    if np.abs(np.subtract(ends, wanted)).max() > 1e-6:
        raise InputError(
            f"keys last from {ends[0]:g} to {ends[1]:g} s, contacts from {wanted[0]:g} to {wanted[1]:g} s; "
            "valid: the same interval"
        )
    for number, phase in enumerate(schedule.sequence):
        for contact in phase.stance:
            name, part = contact.effector, contact.part
            if name not in body.effectors:
                raise ContactError(f"phase {number} holds {name!r}; valid: {', '.join(body.effectors)}")
            if part not in (SolePart.FULL, SolePart.TOES):
                raise ContactError(f"phase {number} holds the {part} of {name!r}; valid: full soles and toes")


def retime(
    path: KeyPath, schedule: ContactSchedule, before: FloatArray, after: FloatArray
) -> tuple[KeyPath, ContactSchedule]:
    """Keys and contacts at other times: ``before`` (k,) becomes ``after`` (k,), linear in between."""
    keys = KeyPath(np.interp(path.time, before, after), path.q)
    return keys, ContactSchedule(schedule.sequence, np.interp(schedule.instants, before, after))


def stretched(
    path: KeyPath, schedule: ContactSchedule, factors: FloatArray
) -> tuple[KeyPath, ContactSchedule]:
    """Keys and contacts with the duration of every phase times its factor (phases,)."""
    after = schedule.instants[0] + np.concatenate([[0.0], np.cumsum(schedule.durations * factors)])
    return retime(path, schedule, schedule.instants, after)


def stretched_for_speed(
    body: BodyModel, path: KeyPath, schedule: ContactSchedule, share: float
) -> tuple[KeyPath, ContactSchedule]:
    """Slow down where the joints would have to move faster than a share of their limits.

    ``dt = max_j |dq_j| / v_max_j`` ([Tonneau2015]_ 4.4.2; the thesis prints a difference of squares), times
    :data:`PEAK`, because a smooth motion is faster in the middle than on average.

    Args:
        share: Of the velocity limits that may be used.
    """
    nodes = np.union1d(path.time, schedule.instants)
    nodes = nodes[np.append(True, np.diff(nodes) > 1e-9)]
    moved = np.abs(np.diff(path.at(nodes)[:, 7:], axis=0))
    needed = PEAK * (moved / (share * body.velocity_limit)).max(axis=1, initial=0.0)
    lengths = np.maximum(np.diff(nodes), needed)
    return retime(path, schedule, nodes, nodes[0] + np.concatenate([[0.0], np.cumsum(lengths)]))


def stretched_around(
    path: KeyPath, schedule: ContactSchedule, time: float, factor: float, span: tuple[int, int] | None = None
) -> tuple[KeyPath, ContactSchedule]:
    """Slow down the phase at a time [s] by a factor, and half as much the ones beside it.

    Phases outside a span from one key instant to another stay as they are.
    """
    numbers = np.arange(len(schedule.sequence))
    first, last = span or (0, len(numbers))
    worst = min(int(schedule.phase_at(time)), last - 1)
    away = np.where((numbers < first) | (numbers >= last), len(numbers) + 1, np.abs(numbers - worst))
    return stretched(path, schedule, np.select([away == 0, away == 1], [factor, 0.5 * (1.0 + factor)], 1.0))


SHORTER, SETTLED = 0.88, 0.97
"""Least factor by which a phase gets shorter at once; with 0.75 more timings are taken back than kept. Factor
above which a phase counts as short enough."""

SHORTEST = 0.3
"""Duration below which no phase is shortened [s]; our choice."""

ROUNDS = 6
"""Most timings that are tried."""


def shortening(
    body: BodyModel, motion: Motion, schedule: ContactSchedule, share: float, settled: frozenset[int]
) -> FloatArray:
    """(phases,) factor on the duration of each phase, in [:data:`SHORTER`, 1].

    Args:
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


def around(schedule: ContactSchedule, time: float) -> frozenset[int]:
    """The phase at a time [s] and those beside it."""
    number, last = int(schedule.phase_at(time)), len(schedule.sequence) - 1
    return frozenset(range(max(number - 1, 0), min(number + 1, last) + 1))
