"""Positions and speeds of points of a recorded body, and the heights of the surfaces on which feet rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from manikin.body import BodyModel
from manikin.body.limbs import with_knees_and_elbows
from manikin.errors import InputError
from manikin.motion.motion import point_paths
from manikin.numerics.signals import low_passed, mask_runs
from manikin.numerics.spatial import FloatArray, frozen_array

JOINTS = ("left_knee", "right_knee", "left_elbow", "right_elbow")
"""Effectors of :func:`manikin.body.limbs.with_knees_and_elbows`."""


def effector_places(body: BodyModel, q: FloatArray, names: Sequence[str]) -> FloatArray:
    """(k, n, 3) effectors, or else origins of segments, in postures (n, nq) in the world [m].

    A human has its knees and elbows as effectors, too. BodyError if the body has none of a name.
    """
    if set(names) & set(JOINTS) - set(body.effectors):
        body = with_knees_and_elbows(body)
    return point_paths(body, q, names)


def com_path(body: BodyModel, q: FloatArray) -> FloatArray:
    """(n, 3) centre of mass in postures (n, nq) [m]."""
    data = body.pinocchio.createData()
    return np.array([pin.centerOfMass(body.pinocchio, data, posture).copy() for posture in q])


CUTOFF = 5.0
"""Cutoff of the low-pass of positions, of second order, forward and backward ([Qiu2012]_ 3.2.1) [Hz]."""

REST = 0.12
"""Speed below which a point rests [m/s]."""

TOUCH_SHARE, LIFT_SHARE = 0.10, 0.20
"""Shares of the highest speed of its swing below which a point has touched down, above which lifted off: the
least errors against force plates, whichever laboratory is left out (``docs/laboratories.md``)."""

NEVER_AT_REST = (2.0 * REST, 4.0 * REST, 8.0 * REST, 16.0 * REST)
"""Speeds at which soles are looked at in turn where none ever rests, as in running [m/s]."""

SHIFT_SPEED, SHIFT_WAY = 0.6, 0.08
"""Highest speed and longest way of a shift, in contrast to a swing [m/s, m]."""

LEVELS_APART, GAP = 0.08, 0.03
"""Heights of rest within less than the first belong to the same surface; a gap between neighbouring ones from
which they may belong to two [m]."""

LEVEL = 0.04
"""Difference between heights of heel and toes up to which a foot is as level as another time [m]."""

RAISED, STEEP, UPRIGHT = 0.15, 0.4, 0.9
"""Rise of a heel over the sole's length from which a foot turns about its ball; of a sole from which it
stands on its ball, the toes bent, as in squatting, and on the tips of its toes, as in crawling and lying."""

BALL = 0.75
"""Share of the sole that is behind the ball of the foot."""

SHORTEST_REST = 0.1
"""Time for which a foot rests on a surface that is found from it [s]."""


@dataclass(frozen=True, eq=False)
class Track:
    """One point of an effector through a recording: (n, 3) low-passed places [m], (n,) speeds, rate [Hz]."""

    positions: FloatArray
    speed: FloatArray
    rate: float

    @property
    def resting(self) -> NDArray[np.bool_]:
        """(n,) whether the point is slower than :data:`REST`."""
        return self.speed < REST

    def rests(self, limit: float) -> NDArray[np.bool_]:
        """(n,) whether the point is slower than a limit [m/s], or than it touches down after its swing."""
        peaks = self.peak_speed()
        return self.speed < np.maximum(limit, np.where(np.isfinite(peaks), TOUCH_SHARE * peaks, 0.0))

    def peak_speed(self, rest: float = REST, shift: float = SHIFT_WAY) -> FloatArray:
        """(n,) the highest speed of the swing between two rests [m/s]; infinite where there is none.

        A point that leaves its rest, at a speed below ``rest`` [m/s], slowly and rests again within ``shift``
        [m] has shifted, not swung: toes do while the heel lifts, and hands that slide along what they hold. A
        swing that the recording cuts counts with at least the median of the whole ones.
        """
        peaks, last = np.full(len(self.speed), np.inf), len(self.speed)
        moves = mask_runs(self.speed >= rest)
        swings = [(first, stop, float(self.speed[first:stop].max())) for first, stop in moves]
        swings = [one for one in swings if not self._shifts(*one, shift)]
        whole = [peak for first, stop, peak in swings if first > 0 and stop < last]
        for first, stop, peak in swings:
            usual = float(np.median(whole)) if whole and (first == 0 or stop == last) else 0.0
            peaks[first:stop] = max(peak, usual)
        return peaks

    def slow_and_fast(
        self, rest: float = REST, shift: float = SHIFT_WAY
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(n,) whether the point is slow enough to have touched down, and fast enough to have lifted off.

        Arguments are those of :meth:`peak_speed`.
        """
        peaks = self.peak_speed(rest, shift)
        slow = self.speed < np.maximum(REST, TOUCH_SHARE * peaks)
        return slow, self.speed > np.maximum(REST, LIFT_SHARE * peaks)

    def _shifts(self, first: int, stop: int, peak: float, shift: float) -> bool:
        last = len(self.speed)
        way = self.positions[min(stop, last - 1)] - self.positions[max(first - 1, 0)]
        most = shift if first > 0 and stop < last else SHIFT_WAY
        return peak < SHIFT_SPEED and float(np.linalg.norm(way)) < most


def track(positions: FloatArray, rate: float, cutoff: float = CUTOFF) -> Track:
    """Low-pass four or more positions (n, 3) of a point [m] and take their speed by central differences.

    Each of the two passes halves the power at the cutoff, below half the frames per second [Hz].
    """
    if len(positions) < 4:
        raise InputError(f"{len(positions)} positions of an effector; valid: at least 4")
    if not 0.0 < cutoff < 0.5 * rate:
        raise InputError(f"cutoff is {cutoff:g} Hz; valid: above 0, below half the rate, {0.5 * rate:g} Hz")
    return _moving(low_passed(positions, cutoff, rate), rate)


def _moving(positions: FloatArray, rate: float) -> Track:
    speed = np.linalg.norm(np.gradient(positions, 1.0 / rate, axis=0), axis=1)
    return Track(frozen_array(positions, "track positions"), frozen_array(speed, "track speed"), rate)


@dataclass(frozen=True, eq=False)
class RecordedSole:
    """Heel and toes of a foot through a recording."""

    heel: Track
    toes: Track

    @classmethod
    def of(cls, ends: Sequence[FloatArray], rate: float, cutoff: float = CUTOFF) -> "RecordedSole":
        """Of (n, 3) heel and (n, 3) toes [m], by :func:`track`."""
        return cls(*(track(end, rate, cutoff) for end in ends))

    @cached_property
    def ball(self) -> Track:
        """The ball, :data:`BALL` of the way from the heel to the toes: a rising foot turns about it."""
        return _moving((1.0 - BALL) * self.heel.positions + BALL * self.toes.positions, self.heel.rate)

    @property
    def lowest(self) -> FloatArray:
        """(n,) height of the lower end [m]."""
        return np.minimum(self.heel.positions[:, 2], self.toes.positions[:, 2])

    @cached_property
    def speed(self) -> FloatArray:
        """(n,) of that point of the sole, from its heel to its toes, that is slowest [m/s]."""
        ends = self.heel.positions, self.toes.positions
        begin, end = (np.gradient(positions, 1.0 / self.heel.rate, axis=0) for positions in ends)
        way = end - begin
        share = np.clip(-np.sum(begin * way, axis=1) / np.maximum(np.sum(way**2, axis=1), 1e-12), 0.0, 1.0)
        return np.linalg.norm(begin + share[:, None] * way, axis=1)

    @cached_property
    def heel_rise(self) -> FloatArray:
        """(n,) how far the heel is above the toes over the length of the sole."""
        way = self.heel.positions - self.toes.positions
        return way[:, 2] / np.maximum(np.linalg.norm(way, axis=1), 1e-9)

    @property
    def steep(self) -> NDArray[np.bool_]:
        """(n,) whether the sole stands on its ball, the toes bent, see :data:`STEEP`."""
        return np.abs(self.heel_rise) > STEEP

    def height(self, lying: NDArray[np.bool_]) -> FloatArray:
        """(n,) of the middle, of the ball of a steep sole, or of the lower end of an upright one [m].

        An upright sole stands on its ball unless the person lies or crawls, ``lying`` (n,).
        """
        heel, toes = self.heel.positions[:, 2], self.toes.positions[:, 2]
        upright = (np.abs(self.heel_rise) > UPRIGHT) & lying
        raised = np.where(upright, self.lowest, (1.0 - BALL) * heel + BALL * toes)
        return np.where(self.steep, raised, 0.5 * (heel + toes))


@dataclass(frozen=True)
class RestSurface:
    """What feet stand on, at the median of the heights at which soles rest on it [m].

    Its levels, lowest first, are more than one where the recorded floor drifts.
    """

    height: float
    levels: tuple[float, ...]


def surfaces_under(feet: Sequence[RecordedSole], lying: NDArray[np.bool_]) -> tuple[RestSurface, ...]:
    """Surfaces on which feet stand, lowest first.

    A foot that rests while another one moves carries the body, so it rests on a surface; so does the lowest
    one, and any that rests as level as on those. A foot that hangs still in the air is on none. Where no sole
    ever rests, as in running, slow ones are taken. While the person lies or crawls, ``lying`` (n,), feet show
    the lowest surface only.
    """
    rests: list[_Rest] = []
    for limit in (REST, *NEVER_AT_REST):
        rests = rests or _rests(feet, limit, lying)
    if not rests:
        return ()
    groups = _by_surface(sorted(rests, key=lambda rest: rest.height))
    sure = [rest for place, group in enumerate(groups) for rest in group if place == 0 or rest.alone]
    kept = [group for group in groups if any(rest in sure or _as_level(rest, sure) for rest in group)]
    return tuple(_surface([rest.height for rest in group]) for group in kept)


def _rests(feet: Sequence[RecordedSole], limit: float, lying: NDArray[np.bool_]) -> list["_Rest"]:
    """Times in which both ends of a sole are slower than a limit [m/s]."""
    resting = [sole.heel.rests(limit) & sole.toes.rests(limit) for sole in feet]
    found = []
    for number, sole in enumerate(feet):
        others = [~other for place, other in enumerate(resting) if place != number]
        shortest, height = SHORTEST_REST * sole.heel.rate, sole.height(lying)
        tilt = sole.toes.positions[:, 2] - sole.heel.positions[:, 2]
        for first, stop in mask_runs(resting[number]):
            if stop - first >= shortest:
                here = slice(first, stop)
                down, level, rise = (float(np.median(each[here])) for each in (lying, height, tilt))
                alone = not down and any(np.sum(moving[here]) >= shortest for moving in others)
                found.append(_Rest(number, level, rise, alone, bool(down)))
    return found


def _surface(heights: Sequence[float]) -> RestSurface:
    """Surface of heights of rest, lowest first, with a level for each :data:`LEVELS_APART` or less."""
    levels = [[heights[0]]]
    for height in heights[1:]:
        if height - levels[-1][0] > LEVELS_APART:
            levels.append([])
        levels[-1].append(height)
    return RestSurface(float(np.median(heights)), tuple(float(np.median(level)) for level in levels))


def _by_surface(rests: "list[_Rest]") -> "list[list[_Rest]]":
    """Rests in order of height by surface: those too far apart for one are split at their widest gap.

    What has no gap is one surface: recorded floors drift by more than :data:`LEVELS_APART`.
    """
    gaps = [after.height - before.height for before, after in pairwise(rests)]
    if rests[-1].height - rests[0].height <= LEVELS_APART or max(gaps) <= GAP:
        return [rests]
    widest = int(np.argmax(gaps)) + 1
    return [*_by_surface(rests[:widest]), *_by_surface(rests[widest:])]


@dataclass(frozen=True)
class _Rest:
    """A time for which a sole rests: its height, its toes above its heel, whether alone, whether lying."""

    foot: int
    height: float
    tilt: float
    alone: bool
    lying: bool


def _as_level(rest: _Rest, sure: list[_Rest]) -> bool:
    """Whether a foot is as level as where the same one surely stands."""
    tilts = [one.tilt for one in sure if one.foot == rest.foot]
    return bool(tilts) and not rest.lying and abs(rest.tilt - float(np.median(tilts))) < LEVEL
