"""Supports corrected by the vertical force that the motion needs, as for runners and jumpers.

A foot that is slow and near a surface need not be on it: in a jump it turns round where it is highest.
Supports give the centre of mass all the acceleration it has beside gravity: none is made in a free fall.

Fast feet stop and start within a tenth of a second, which a low-pass of positions spreads; the centre of mass
is slower. A support of a foot that ends (begins) within a fall therefore ends where the fall begins (begins
where it ends); one that lasts all through a fall is left as it is. Where the body is carried but no support
was found, the feet before and after carry, the later one from where it is the slower one; between two falls
the lowest foot carries, if it is low. Where the same foot is on both sides, and the lowest as well, the gap
stays: the foot stepped on the spot. In a walk the body never falls, so that only gaps change.

Feet of sprinters never come to rest in low-passed positions, so that no surface is known: it is then at the
median height of the lowest foot in the times between falls, if these agree (:func:`surface_of_a_run`).

Within half a period of the cutoff from an end of the recording the force is not known, and the value at that
distance is taken.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from manikin.numerics.signals import mask_runs
from manikin.numerics.spatial import GRAVITY, FloatArray
from manikin.recordings.reconstruction.proportions import Reconstruction
from manikin.recordings.supports.body_supports import Places, Support, median_place, support_in
from manikin.recordings.supports.support_levels import CUTOFF as SUPPORT_LEVELS_CUTOFF
from manikin.recordings.supports.support_levels import RecordedSole, com_path, track

FREE = 0.8
"""Downward acceleration over gravity from which, as a median, nothing carries: a tenth of a second of free
fall has about as much left after the low-pass."""


def while_carried(supports: Sequence[Support], found: Reconstruction, start: float) -> Iterator[Support]:
    """Those supports in which the centre of mass does not fall freely; frames begin at ``start`` [s]."""
    falls = -vertical_acceleration(found, SUPPORT_LEVELS_CUTOFF) / GRAVITY
    for one in supports:
        if float(np.median(falls[slice(*one.frames(start, found.rate, len(falls)))])) < FREE:
            yield one


def vertical_acceleration(found: Reconstruction, cutoff: float) -> FloatArray:
    """(n,) upward acceleration of the centre of mass, low-passed with a cutoff in Hz [m/s^2]."""
    height = track(com_path(found.body, found.q), found.rate, cutoff).positions[:, 2]
    return np.gradient(np.gradient(height, 1.0 / found.rate), 1.0 / found.rate)


CUTOFF = 10.0
"""Cutoff of the low-pass of the centre of mass and of the feet [Hz]."""

FALLING = 0.2
"""Vertical force per body weight below which nothing carries. A half-sine of a force whose mean over the step
is the weight has, low-passed at :data:`CUTOFF`, 0.09 to 0.31 of the weight left at its ends, for stances of
0.3 to 0.17 s and flights of 0.05 to 0.13 s."""

SHORTEST_FALL = 0.03
"""Shorter falls are noise [s]."""

AT_END = 0.05
"""Time from either end of the recording in which the force is not known [s]: half a period of the cutoff."""

TOGETHER = 0.03
"""Time within which both feet leave or land together [s]."""

AWAY, NEAR = 0.10, 0.02
"""Height above where a foot stood, or above a surface, up to which it can be what carries; the second beside
an end of the recording, where the fall that would bound the support is not seen [m]."""

SHORTEST, SHORTEST_KEPT = 0.08, 0.04
"""Shorter times between two falls are noise, and less of a support beside a fall is none [s]."""


def by_the_force(
    supports: Sequence[Support], found: Reconstruction,
    soles: Mapping[str, tuple[FloatArray, FloatArray]], surfaces: Sequence[float], start: float = 0.0,
) -> tuple[tuple[Support, ...], tuple[float, ...]]:  # fmt: skip
    """Supports of feet cut at falls and extended to where the body is carried, and heights of surfaces [m].

    Missing supports are added; those of other effectors do not change. Of each foot are given (n, 3) heel and
    (n, 3) toes [m], of the surfaces on which feet stand the heights [m], of the first frame the instant
    ``start`` [s].
    """
    n, rate = len(found.time), found.rate
    if rate <= 2.0 * CUTOFF:
        return tuple(supports), tuple(surfaces)
    force = 1.0 + vertical_acceleration(found, CUTOFF) / GRAVITY
    edge = min(round(AT_END * rate), (n - 1) // 2)
    force[:edge], force[n - edge :] = force[edge], force[n - edge - 1]
    falls = np.zeros(n, dtype=bool)
    for first, stop in mask_runs(force < FALLING):
        falls[first:stop] = stop - first >= SHORTEST_FALL * rate
    feet = {name: RecordedSole.of(both, rate, CUTOFF) for name, both in soles.items()}
    surfaces = tuple(surfaces) or surface_of_a_run(list(feet.values()), falls)
    if not surfaces:
        return tuple(supports), ()
    table = _Table(feet, list(supports), np.array(surfaces), rate, start, n)
    table.cut(falls)
    table.fill(falls)
    return tuple(table.supports), surfaces


FEWEST_STEPS, LEVEL = 2, 0.15
"""Times between two falls that make a run, and range of the heights of the lowest foot in them [m]."""


def surface_of_a_run(feet: Sequence[RecordedSole], falls: NDArray[np.bool_]) -> tuple[float, ...]:
    """Height of the surface under a runner whose feet never rest [m]; none if there is no level run.

    It is the median of the lowest heights of the lower foot in each time between two of the falls (n,).
    """
    lowest = np.min([foot.lowest for foot in feet], axis=0)
    between = [span for span in mask_runs(~falls) if span[0] > 0 and span[1] < len(falls)]
    heights = [float(lowest[first:stop].min()) for first, stop in between]
    level = len(heights) >= FEWEST_STEPS and np.ptp(heights) < LEVEL
    return (float(np.median(heights)),) if level else ()


@dataclass(eq=False)
class _Table:
    """Supports, by the frames from and up to which they last."""

    feet: Mapping[str, RecordedSole]
    supports: list[Support]
    surfaces: FloatArray
    rate: float
    start: float
    frames: int

    def span(self, one: Support) -> tuple[int, int]:
        """First frame of a support and the one after its last."""
        return one.frames(self.start, self.rate, self.frames)

    def during(self, one: Support, first: int, stop: int) -> Support:
        """A support of a foot in other frames."""
        span = self.span(one)
        begins = one.first_contact if first == span[0] else self._lower(one.effector, first)
        ends = one.last_contact if stop == span[1] else self._lower(one.effector, stop - 1)
        return self._made(one.effector, first, stop, (one.place, begins, ends))

    def _lower(self, name: str, frame: int) -> FloatArray:
        """(3,) lower end of a foot."""
        heel, toes = (end.positions[frame] for end in (self.feet[name].heel, self.feet[name].toes))
        return heel if heel[2] < toes[2] else toes

    def _made(self, name: str, first: int, stop: int, places: Places) -> Support:
        return support_in(name, (first, stop), self.frames, self.rate, self.start, places)

    def cut(self, falls: NDArray[np.bool_]) -> None:
        """Supports of feet end where a fall begins, and begin where it ends."""
        kept = []
        for one in self.supports:
            first, stop = span = self.span(one)
            for begin, end in mask_runs(falls) if one.effector in self.feet else ():
                first = end if begin <= first < end else first
                stop = begin if begin < stop <= end else stop
            if (first, stop) == span:
                kept.append(one)
            elif stop - first >= SHORTEST_KEPT * self.rate:
                kept.append(self.during(one, first, stop))
        self.supports = kept

    def fill(self, falls: NDArray[np.bool_]) -> None:
        """Where the body is carried and nothing was found, the feet beside carry, or the lowest one."""
        for first, stop, begin, end in list(self._gaps(~falls)):
            before = self._beside(first, 1) if begin == first else []
            after = self._beside(stop, 0) if end == stop else []
            if self._names(before) & self._names(after):
                self._add(begin, end, self._names(before) | self._names(after))
                continue
            until, since = end, begin
            if before and after:
                until = since = self._change(before, after, begin, end)
            for one in before:
                self._until(one, until)
            for one in after:
                self._since(one, since)
            if (first < begin or first == 0) and (end < stop or stop == self.frames):
                self._add(begin, end)

    def _names(self, numbers: Sequence[int]) -> set[str]:
        """Effectors of supports."""
        return {self.supports[one].effector for one in numbers}

    def _gaps(self, carried: NDArray[np.bool_]) -> Iterator[tuple[int, int, int, int]]:
        """First frame and the one after the last of a time without support, and of what is carried in it."""
        free = np.ones(self.frames, dtype=bool)
        for one in self.supports:
            free[slice(*self.span(one))] = False
        for first, stop in mask_runs(free):
            for begin, end in mask_runs(carried[first:stop]):
                yield first, stop, first + begin, first + end

    def _beside(self, frame: int, edge: int) -> list[int]:
        """Indices of the supports of feet that end (edge 1) or begin (0) at a frame, or nearly so."""
        away = [(frame - self.span(one)[edge]) * (1 if edge else -1) for one in self.supports]
        near = [number for number, frames in enumerate(away) if 0 <= frames <= TOGETHER * self.rate]
        return [number for number in near if self.supports[number].effector in self.feet]

    def _until(self, number: int, end: int) -> None:
        """A support lasts up to a frame, or as long as its foot is low."""
        first, stop = self.span(self.supports[number])
        high = self._high(number, stop, end)
        self.supports[number] = self.during(self.supports[number], first, high[0] if high else end)

    def _since(self, number: int, begin: int) -> None:
        """A support lasts from a frame on, or from where its foot is low."""
        first, stop = self.span(self.supports[number])
        high = self._high(number, begin, first)
        self.supports[number] = self.during(self.supports[number], high[-1] + 1 if high else begin, stop)

    def _change(self, before: Sequence[int], after: Sequence[int], begin: int, end: int) -> int:
        """Frame between two supports from which the foot of the later one is the slower one."""
        early, late = (
            np.min([self.feet[name].speed[begin:end] for name in self._names(ones)], axis=0)
            for ones in (before, after)
        )
        slower = np.flatnonzero(late < early)
        return begin + int(slower[0]) if len(slower) else end

    def _high(self, number: int, first: int, stop: int) -> list[int]:
        """Frames beside a support in which its foot is higher above where it stands than it may be."""
        one = self.supports[number]
        lowest = self.feet[one.effector].lowest
        above = lowest - np.median(lowest[slice(*self.span(one))])
        most = NEAR if first == 0 or stop == self.frames else AWAY
        return [first + k for k in np.flatnonzero(above[first:stop] > most).tolist()]

    def _add(self, begin: int, end: int, others: Collection[str] = ()) -> None:
        """A support of the lowest foot, unless it is one of the others."""
        name = min(self.feet, key=lambda one: float(np.median(self.feet[one].lowest[begin:end])))
        foot = self.feet[name]
        low = foot.lowest[begin:end]
        height = float(self.surfaces[np.argmin(np.abs(self.surfaces - low.min()))])
        if name in others or abs(low.min() - height) > AWAY or np.median(low) - height > AWAY:
            return
        near = begin + np.flatnonzero(low < low.min() + NEAR)
        begin, end = int(near[0]) if begin == 0 else begin, int(near[-1]) + 1 if end == self.frames else end
        if end - begin >= SHORTEST * self.rate:
            middle = 0.5 * (foot.heel.positions + foot.toes.positions)
            place = np.append(median_place(middle[begin:end])[:2], height)
            places = place, self._lower(name, begin), self._lower(name, end - 1)
            self.supports.append(self._made(name, begin, end, places))
