"""Capture steps of a pushed walker: its plan goes on beside where it was and comes back in further steps.

A body on one foot that was pushed off its plan cannot be brought back over a stiff distance: its foot is too
small. The deviation ``x`` of its centre of mass is taken over by the plan instead, and goes on as that of a
pendulum, ``x'' = w^2 (x - p)``, where ``p`` is how far the foot it stands on is beside its plan, and a little
that the pressure under it is moved against the deviation. When the other foot lands, the capture point ``x +
x' / w`` of the deviation is where

``landing = p + (x + x' / w - p) exp(w t)``

after the remaining time ``t``. The landing foot is moved there, and a little further, since it takes the load
gradually; from then on the deviation decays. On each foot that follows, the pressure leads the body back to
where it was planned, as far as a foot allows. How far a landing may be moved is bounded by the other foot and
by what stands on the floor, and near its landing a foot is not moved any more: what is left is caught by the
next step. The law for a point mass is that of Koolen et al. (2012); that the plan takes over
the deviation is our own.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from manikin.contact import Contact, ContactKind, ContactSchedule
from manikin.control.dynamics import DynamicsState
from manikin.control.reference import EffectorReference, ReferenceSample
from manikin.control.settings import ShiftSettings
from manikin.control.supports import SupportInterval, SupportMode, SupportState, support_intervals
from manikin.numerics.spatial import GRAVITY, FloatArray

CATCHES = 1.3
"""Pressure is moved by this share of a deviation ``x`` of the capture point, as far as a foot allows; beyond
1 a small one decays with ``(share - 1) w``."""

TRIED = 6
"""Places on the way from where a foot is to be moved to where it is, of which the first that is clear of
obstacles is taken."""

SETTLING = 4.0
"""Rate at which the deviation of a body that makes no more steps goes back [1/s]."""


class _Landing(NamedTuple):
    """Where a flying foot is to be moved.

    Attributes:
        target: (2,) offset at the landing [m].
        time: Of the landing [s].
        passes: When it passes the standing foot [s].
        outward: (2,) level unit vector away from the standing foot.
        beside: (2,) offset of that foot, or what obstacles leave of it: the flying one passes it no nearer
            than planned [m].
        soonest: Least time for the way outward [s].
    """

    target: FloatArray
    time: float
    passes: float
    outward: FloatArray
    beside: FloatArray
    soonest: float

    def pull(self, time: float, offset: FloatArray, rate: FloatArray, least: float) -> FloatArray:
        """(2,) acceleration of an offset (2,) [m] with a rate (2,) [m/s] that goes there as a cubic of time.

        ``least`` is the least time that is left [s].
        """
        bend = _cubic(self.target - offset, rate, max(self.time - time, least))
        if time >= self.passes:
            return bend
        target, beside, now, speed, pull = (
            float(vector @ self.outward) for vector in (self.target, self.beside, offset, rate, bend)
        )
        out = _cubic(max(target, beside) - now, speed, max(self.passes - time, self.soonest))
        return bend + (out - pull) * self.outward


class ShiftedPlan:
    """How far the plan of a walker is moved: its centre of mass and each foot, level [m].

    Attributes:
        feet: (2,) of each foot.
        body: (2,) of the centre of mass.
    """

    def __init__(self, schedule: ContactSchedule, settings: ShiftSettings, period: float) -> None:
        """Begin with the plan where it is.

        Args:
            schedule: Of the plan; nothing is ever moved unless it is of two soles.
            settings: When and how far steps are moved.
            period: Of control [s].
        """
        self._settings, self._period = settings, period
        names = schedule.sequence.effectors
        self._intervals = {name: support_intervals(schedule, name, 0.0) for name in names}
        every = [item.contact for items in self._intervals.values() for item in items]
        self._walks = len(names) == 2 and all(contact.kind is ContactKind.SOLE for contact in every)
        self.feet = {name: np.zeros(2) for name in names}
        self.body, self._speed, self._pull = np.zeros(2), np.zeros(2), np.zeros(2)
        self._rate = {name: np.zeros(2) for name in names}
        self._bend = {name: np.zeros(2) for name in names}
        self._target: dict[str, _Landing] = {}
        self.active, self._off = False, np.zeros((2, 2))
        self._offsets = self._now()

    def moved(
        self, time: float, state: DynamicsState, reference: ReferenceSample,
        supports: Mapping[str, SupportState], *, waits: bool = False,
    ) -> ReferenceSample:  # fmt: skip
        """The plan at its time [s], moved by what it is off now; one control period passes.

        Args:
            time: Of the plan [s].
            state: Of the body.
            reference: The plan where it was first.
            supports: Of every effector.
            waits: Whether the time of the plan stands still, or slows down to it.
        """
        if not self._walks:
            return reference
        off = state.com[:2] - reference.com[:2] - self.body
        rate = (state.momentum[:3] / state.mass - reference.com_velocity)[:2] - self._speed
        now = self._period / (self._settings.filtering + self._period)
        self._off += now * (np.array([off, rate]) - self._off)
        standing = [name for name, item in supports.items() if item.mode is SupportMode.STANCE]
        flying = [name for name, item in supports.items() if item.mode is SupportMode.SWING]
        if len(standing) == len(flying) == 1:
            self._take_over(time, standing[0], flying[0], state, reference)
        if not self.active:
            return reference
        self._offsets = self._now()
        shifted = self.applied(reference)
        self._move_feet(time, flying)
        rests = waits or (self._next_of_all(time) is None and len(standing) == len(self.feet))
        pivot, frequency = self._pivot(time, standing), self._frequency(state, reference)
        if len(standing) == 1 and (held := self._held(standing[0], time)) is not None:
            pivot = pivot + self._held_off(pivot, frequency, _axes(held.contact))
        self._move_body(pivot, frequency, rests=rests)
        return shifted

    def _frequency(self, state: DynamicsState, reference: ReferenceSample) -> float:
        ground = min(float(reference.effectors[name].position[2]) for name in self.feet)
        return float(np.sqrt(GRAVITY / max(float(state.com[2]) - ground, 0.2)))

    def _take_over(
        self, time: float, stance: str, swing: str, state: DynamicsState, reference: ReferenceSample
    ) -> None:
        """Let the plan go on from where the body is, and set down the flying foot where that is caught."""
        landing = next((item for item in self._intervals[swing] if item.start > time), None)
        if landing is None or landing.start - time < self._settings.latest:
            return
        frequency, pivot = self._frequency(state, reference), self.feet[stance]
        off, rate = self._off
        if np.linalg.norm(off + rate / frequency) > self._settings.threshold:
            self.body, self._speed, self.active = self.body + off, self._speed + rate, True
            self._off = np.zeros((2, 2))
        if not self.active:
            return
        held = next(item for item in self._intervals[stance] if item.start <= time < item.end)
        grown = np.exp(frequency * (landing.start - time))
        off = self.body + self._speed / frequency - pivot
        held_off = self._held_off(pivot, frequency, _axes(held.contact))
        caught = held_off + (off - held_off) * grown
        both = frequency * max(min(held.end, landing.start + 1.0) - landing.start, 1e-3)
        share = (1.0 - np.exp(-both)) / both
        target = self._bounded(pivot + caught / share, pivot, held.contact, landing.contact)
        now = reference.effectors[swing]
        target, beside = (self._clear(swing, each, now, landing.contact) for each in (target, pivot))
        lifted = max(item.end for item in self._intervals[swing] if item.end <= time + self._period)
        axes = _axes(held.contact)
        side = np.sign(float((landing.contact.position - held.contact.position)[:2] @ axes[:, 1])) or 1.0
        self._target[swing] = _Landing(
            target, landing.start, 0.5 * (lifted + landing.start), side * axes[:, 1], beside,
            self._settings.latest,
        )  # fmt: skip

    def _clear(self, swing: str, target: FloatArray, now: EffectorReference, landing: Contact) -> FloatArray:
        """The offset of a landing foot that keeps away from obstacles, the nearest on the way to it."""
        room, offset = self._settings.room, self.feet[swing]
        if room is None:
            return target
        offsets = target + np.linspace(0.0, 1.0, TRIED)[:, None] * (offset - target)
        places = np.column_stack([landing.position[:2] + offsets, np.full(TRIED, landing.yaw)])
        free = room.beside(np.append(now.position[:2] + offset, _yaw(now.rotation)), places)
        return offsets[np.argmax(free >= min(self._settings.nearest, free[-1]))]

    def _held_off(self, pivot: FloatArray, frequency: float, axes: FloatArray) -> FloatArray:
        """(2,) how far the pressure under a standing foot with axes (2, 2) is moved against the deviation."""
        off = (CATCHES * (self.body + self._speed / frequency) - pivot) @ axes
        most = np.array([self._settings.ankle, self._settings.ankle_across])
        return axes @ (off / max(1.0, float(np.max(np.abs(off) / most))))

    def _bounded(
        self, target: FloatArray, pivot: FloatArray, stance: Contact, landing: Contact
    ) -> FloatArray:
        """The offset of a landing foot that its distance from the standing one allows, nearest to another."""
        settings = self._settings
        axes = _axes(stance)
        planned = (landing.position - stance.position)[:2]
        ahead, left = (planned + target - pivot) @ axes
        side = 1.0 if float(planned @ axes[:, 1]) >= 0.0 else -1.0
        ahead = np.clip(ahead, -settings.longest, settings.longest)
        across = np.clip(side * left, settings.narrowest, settings.widest)
        return axes @ np.array([ahead, side * across]) - planned + pivot

    def _move_feet(self, time: float, flying: list[str]) -> None:
        """Let flying feet go on to where they are to land, at rest, as a cubic of the time."""
        step = self._period
        for name in self.feet:
            if name not in flying:
                self._rate[name], self._bend[name] = np.zeros(2), np.zeros(2)
                self._target.pop(name, None)
            elif (landing := self._target.get(name)) is not None:
                bend = landing.pull(time, self.feet[name], self._rate[name], step)
                self._bend[name] = bend
                self.feet[name] = self.feet[name] + step * self._rate[name] + 0.5 * step**2 * bend
                self._rate[name] = self._rate[name] + step * bend

    def _move_body(self, pivot: FloatArray, frequency: float, *, rests: bool) -> None:
        """Let the deviation go on as that of a pendulum on a pivot (2,), or go back to it in rest."""
        step, off = self._period, self.body - pivot
        if rests:
            self._pull = -(SETTLING**2) * off - 2.0 * SETTLING * self._speed
            self.body = self.body + step * self._speed
            self._speed = self._speed + step * self._pull
            return
        self._pull = frequency**2 * off
        grown, sheer = np.cosh(frequency * step), np.sinh(frequency * step)
        self.body = pivot + grown * off + sheer / frequency * self._speed
        self._speed = frequency * sheer * off + grown * self._speed

    def _pivot(self, time: float, standing: list[str]) -> FloatArray:
        """(2,) how far what the body stands on is beside its plan [m]: goes over from foot to foot."""
        if len(standing) == 1:
            return self.feet[standing[0]]
        held = {name: self._held(name, time) for name in self.feet}
        if any(item is None for item in held.values()):
            return np.mean(list(self.feet.values()), axis=0)
        first, last = sorted(held, key=lambda name: held[name].start)  # type: ignore[union-attr]
        begin, end = held[last].start, held[first].end  # type: ignore[union-attr]
        if not np.isfinite(end):
            return np.mean(list(self.feet.values()), axis=0)
        share = float(np.clip((time - begin) / max(end - begin, 1e-6), 0.0, 1.0))
        return (1.0 - share) * self.feet[first] + share * self.feet[last]

    def _held(self, name: str, time: float) -> SupportInterval | None:
        return next((item for item in self._intervals[name] if item.start <= time < item.end), None)

    def _next(self, name: str, time: float) -> SupportInterval | None:
        return next((item for item in self._intervals[name] if item.start > time), None)

    def _next_of_all(self, time: float) -> SupportInterval | None:
        return next((found for name in self.feet if (found := self._next(name, time)) is not None), None)

    def _now(self) -> tuple[FloatArray, dict[str, FloatArray]]:
        """(3, 2) offset, speed and acceleration of the body, and of each foot."""
        body = np.array([self.body, self._speed, self._pull])
        return body, {
            name: np.array([self.feet[name], self._rate[name], self._bend[name]]) for name in self.feet
        }

    def applied(self, reference: ReferenceSample) -> ReferenceSample:
        """The plan moved as it was last."""
        if not self.active:
            return reference
        body, feet = self._offsets
        effectors = dict(reference.effectors)
        for name, (offset, rate, bend) in feet.items():
            now = effectors[name]
            effectors[name] = EffectorReference(
                now.rotation, _plus(now.position, offset), _plus(now.twist, rate),
                _plus(now.acceleration, bend),
            )  # fmt: skip
        return replace(
            reference, q=_plus(reference.q, body[0]), com=_plus(reference.com, body[0]),
            com_velocity=_plus(reference.com_velocity, body[1]),
            com_acceleration=_plus(reference.com_acceleration, body[2]), effectors=effectors,
        )  # fmt: skip


def _cubic(way: FloatArray | float, rate: FloatArray | float, left: float) -> FloatArray:
    """Acceleration at the beginning of a cubic that goes a way and is at rest after a time [s]."""
    return np.asarray(6.0 * way / left**2 - 4.0 * rate / left)


def _axes(contact: Contact) -> FloatArray:
    """(2, 2) level axes of a sole, forward and left, in its columns."""
    return contact.rotation_contact_to_world[:2, :2]


def _yaw(rotation: FloatArray) -> float:
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def _plus(values: FloatArray, offset: FloatArray) -> FloatArray:
    """Values whose first two are moved by an offset (2,)."""
    moved = values.copy()
    moved[:2] += offset
    return moved
