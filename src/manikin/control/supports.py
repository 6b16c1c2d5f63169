"""Which supports carry load at a time: planned switching, late and early touch-downs."""

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import groupby
from operator import itemgetter

import numpy as np

from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart
from manikin.control.settings import SupportSettings
from manikin.numerics.spatial import FloatArray, frozen_array

_FIRST_SHARE = 0.05
"""Load share at touch-down, and of a foot that lands early until its planned landing."""

EARLY_SHARE = 0.15
"""Share of a long flight before its end in which a touch counts as the landing."""

LONG_FLIGHT = 1.0
"""Flights longer than this come down, and rise, slowly [s]."""

TIP_HOVER = 0.25
"""Share of the height at which soles are waited for at which tips are."""

TIP_RELEASE = 0.008
"""Time for which a tip that does not touch counts as touching [s]."""

_LIFTING_SHARE = 0.6
"""Share of the early window in which the hovering height is reached."""

_NO_LIFT = frozen_array(np.zeros(3), "lift")


class SupportMode(StrEnum):
    """What an effector is doing."""

    SWING = "swing"
    """It flies, on its planned path."""
    LANDING = "landing"
    """Its support is planned but it does not touch yet; it carries nothing."""
    STANCE = "stance"
    """It touches and carries load."""


@dataclass(frozen=True, eq=False)
class SupportState:
    """State of one effector at one control step.

    Attributes:
        mode: Swing, landing or stance.
        contact: The planned contact in landing and stance; None in flight.
        load_share: Share of the contact's force limits that it may use after its touch-down, rising to 1.
        unload_share: Share of the load before its unloading that it may still carry, 0 at lift-off.
        press: How far below the planned contact a landing effector is sent [m]; negative above.
        press_rate: How fast it is sent down [m/s].
        settling: Whether it may still slide to its place.
        lift: (3,) offset of a flying effector from its planned path [m].
        lift_rate: (3,) rate of that offset [m/s].
        follow: Share of the feedback gains with which a flying effector follows its path.
        planned: Whether the time is one of planned support, not of an early touch.
        fades: Parts of the sole beyond which load limits rise after a change of what touches, or fall before
            one, and how far, in [0, 1].
    """

    effector: str
    mode: SupportMode
    contact: Contact | None
    load_share: float = 0.0
    unload_share: float = 1.0
    press: float = 0.0
    press_rate: float = 0.0
    settling: bool = False
    lift: FloatArray = field(default_factory=lambda: _NO_LIFT)
    lift_rate: FloatArray = field(default_factory=lambda: _NO_LIFT)
    follow: float = 1.0
    planned: bool = True
    fades: tuple[tuple[SolePart, float], ...] = ()


@dataclass(frozen=True, eq=False)
class SupportInterval:
    """One planned support of one effector.

    Attributes:
        start: Planned touch-down [s]; -inf when held from the beginning.
        end: Planned lift-off [s]; inf when held to the end.
        early: First time at which a touch counts as this touch-down [s].
        late: Last time at which a touch counts as not having left it yet [s].
        parts: Contact from each time on, in order; the same place throughout, but other parts of a sole.
    """

    start: float
    end: float
    early: float
    late: float
    parts: tuple[tuple[float, Contact], ...]

    @property
    def contact(self) -> Contact:
        """The contact at touch-down."""
        return self.parts[0][1]

    def contact_at(self, time: float) -> Contact:
        """Part of the contact that is planned at a time [s]; before the first, the first."""
        return self.parts[self._part_at(time)][1]

    def _part_at(self, time: float) -> int:
        """Number of the part that is planned at a time [s]; before the first, the first."""
        return max(bisect_right(self.parts, time + 1e-9, key=itemgetter(0)) - 1, 0)

    def part_before(self, time: float) -> tuple[SolePart, float] | None:
        """Part that touched before the one of a time [s], and when it changed; None without."""
        number = self._part_at(time)
        now = self.parts[number][1].part
        for k in range(number, 0, -1):
            if (part := self.parts[k - 1][1].part) is not now:
                return part, self.parts[k][0]
        return None

    def part_after(self, time: float) -> tuple[SolePart, float] | None:
        """Part that touches after the one of a time [s], and when it changes; None without."""
        number = self._part_at(time)
        now = self.parts[number][1].part
        later = ((contact.part, start) for start, contact in self.parts[number + 1 :])
        return next(((part, start) for part, start in later if part is not now), None)


def support_intervals(
    schedule: ContactSchedule, effector: str, early_window: float
) -> tuple[SupportInterval, ...]:
    """Collect the planned supports of one effector in order of time.

    ``early_window`` is the largest advance of a touch-down [s]: more, up to a third, for a long flight.
    """
    intervals: list[SupportInterval] = []
    phases, previous_end = list(schedule.sequence), -math.inf
    for held, run in groupby(range(len(phases)), key=lambda number: effector in phases[number].stance):
        if not held:
            continue
        numbers = list(run)
        first, index = numbers[0], numbers[-1] + 1
        start = -math.inf if first == 0 else float(schedule.instants[first])
        end = math.inf if index == len(phases) else float(schedule.instants[index])
        flight = start - previous_end
        window = max(early_window, EARLY_SHARE * flight) if LONG_FLIGHT < flight < math.inf else early_window
        early = max(start - window, start - flight / 3) if first else start
        if intervals:  # a long flight rises as slowly as it comes down
            intervals[-1] = replace(intervals[-1], late=previous_end + window)
        parts = tuple((float(schedule.instants[k]), phases[k].stance[effector]) for k in numbers)
        intervals.append(SupportInterval(start, end, early, end + early_window, parts))
        previous_end = end
    return tuple(intervals)


@dataclass
class _Memory:
    """What is remembered of one effector: its interval, its landing, its last touch [s]."""

    number: int = -1
    landed: float | None = None
    touched: float = -math.inf


class SupportSwitch:
    """State machine that turns the schedule and the felt touches into support states."""

    def __init__(self, schedule: ContactSchedule, settings: SupportSettings) -> None:
        """Start with every support of the first phase fully loaded."""
        self.effectors, self._settings, window = schedule.sequence.effectors, settings, settings.early_window
        self._intervals = {name: support_intervals(schedule, name, window) for name in self.effectors}
        self._memory = {name: _Memory() for name in self.effectors}

    def update(self, time: float, touching: Mapping[str, bool] | None = None) -> dict[str, SupportState]:
        """Advance to a time [s], not before the last one, and return the state of every effector.

        ``touching`` says whether each is felt to touch; the schedule is trusted where it says nothing.
        """
        return {name: self._update(name, time, (touching or {}).get(name)) for name in self.effectors}

    def _update(self, name: str, time: float, touching: bool | None) -> SupportState:
        memory, every = self._memory[name], enumerate(self._intervals[name])
        k, interval = next(((k, i) for k, i in every if i.early - 1e-9 <= time < i.end - 1e-9), (-1, None))
        if k != memory.number:
            memory = self._memory[name] = _Memory(k)
            if interval is not None and math.isinf(interval.start):
                memory.landed, memory.touched = interval.start, time
        if interval is None:
            return SupportState(name, SupportMode.SWING, None, follow=self._follow(name, time))
        planned = time >= interval.start - 1e-9
        settling = interval.contact.settle > 0.0 and time < interval.start + interval.contact.settle
        # What stands on three tips cannot count on a fourth that has bounced off.
        tip = interval.contact.kind is ContactKind.POINT
        release = TIP_RELEASE if tip else self._settings.release_time
        if planned if touching is None else touching:
            memory.touched = time
            memory.landed = time if memory.landed is None else memory.landed
        elif memory.landed is not None and time - memory.touched > release + 1e-9:
            memory.landed = None
        if memory.landed is not None:
            since = time - max(memory.landed, interval.start)
            falling = (interval.end - time) / self._settings.unload_time
            return SupportState(
                name, SupportMode.STANCE, interval.contact_at(time),
                load_share=self._load_share(interval.contact, since),
                unload_share=min(max(falling, 0.0), 1.0), planned=planned,
                fades=self._fades(interval, time), settling=settling,
            )  # fmt: skip
        if not planned:
            return self._hovering(name, interval, time)
        part, height, begun = interval.contact_at(time), 0.0, memory.touched
        if memory.touched < interval.start:
            height = self._hover(interval)
            begun = self._sets_out(interval)
        way, rate = self._settings.descent(part, time - begun)
        press = min(self._settings.press_depth, way - height)
        return SupportState(name, SupportMode.LANDING, part, press=press, press_rate=rate, settling=settling)

    def _load_share(self, contact: Contact, since: float) -> float:
        """Share of the force limits at a time since the touch-down [s]; toes are light, and would dig in."""
        if contact.settle > 0.0:  # a seat takes the weight as soon as it is touched
            return 1.0
        rolls = contact.part is SolePart.TOES
        rising = since / (self._settings.rolling_load_time if rolls else self._settings.load_time)
        return min(max(rising, _FIRST_SHARE), 1.0) ** (2 if rolls else 1)

    def _hovering(self, name: str, interval: SupportInterval, time: float) -> SupportState:
        """Lift the end of a flight smoothly, in the first part of the time in which it might touch.

        It sets out from there in time to land when it is planned to.
        """
        duration = _LIFTING_SHARE * (interval.start - interval.early)
        share, hover = min(max((time - interval.early) / duration, 0.0), 1.0), self._hover(interval)
        lift, rate = hover * share**2 * (3.0 - 2.0 * share), 6.0 * hover * share * (1.0 - share) / duration
        way, speed = self._settings.descent(interval.contact, time - self._sets_out(interval))
        normal = interval.contact.normal
        return SupportState(
            name, SupportMode.SWING, None, lift=(lift - way) * normal, lift_rate=(rate - speed) * normal
        )

    def _sets_out(self, interval: SupportInterval) -> float:
        """When an effector leaves the height at which its support is waited for [s]."""
        lead = self._settings.lead(interval.contact, self._hover(interval))
        return max(interval.start - lead, interval.early)

    def _hover(self, interval: SupportInterval) -> float:
        """Height at which a support is waited for [m]; a tip has no edge that would touch first."""
        if interval.contact.settle > 0.0:  # made at speed, it has to press in time
            return 0.0
        return (TIP_HOVER if interval.contact.kind is ContactKind.POINT else 1.0) * self._settings.hover

    def _fades(self, interval: SupportInterval, time: float) -> tuple[tuple[SolePart, float], ...]:
        """Load moves gradually to points that begin to touch, and off those that cease to."""
        if len(interval.parts) == 1:
            return ()
        fades, settings = [], self._settings
        if (before := interval.part_before(time)) is not None:
            share = (time - before[1]) / settings.rolling_load_time
            fades.append((before[0], min(max(share, 0.0), 1.0) ** 2))
        if (after := interval.part_after(time)) is not None:
            share = (after[1] - time) / settings.unload_time
            fades.append((after[0], min(max(share, 0.0), 1.0)))
        return tuple(item for item in fades if item[1] < 1.0)

    def _follow(self, name: str, time: float) -> float:
        """Feedback gains rise smoothly after a lift-off, where plan and reality differ in speed."""
        ends = [interval.end for interval in self._intervals[name] if interval.end <= time + 1e-9]
        return min(max((time - max(ends, default=-math.inf)) / self._settings.follow_time, 0.0), 1.0)
