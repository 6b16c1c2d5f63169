"""Steps of a walk: where feet stand along the path of the body, and when, with the path on their clock."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import PchipInterpolator

from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number, frozen_array
from manikin.walking.foot_room import FOOT_ROOM, FootRoom
from manikin.walking.footprints import FEET, Footprint, Footprints
from manikin.walking.path.walk_obstacles import WalkObstacle
from manikin.walking.path.walking_path import SAMPLING, SampledWalk

SIDE = {"left_foot": 1.0, "right_foot": -1.0}
"""On which side of the body a foot is, along its y axis."""

LEAD = 0.8
"""Time of standing before and after a walk, in which the weight shifts [s]."""

_REACHED = 1e-6

_ROUNDS, _CLOSER = 6, 1.5
"""Rounds of shorter steps where a foot has no room, and the factor of their frequency in each."""

_AROUND = 0.3
"""Steps become shorter gradually within this time on the path, before and after those without room [s]."""

_SHORTER = (0.0, 0.2, 0.4)
_ASIDE = (0.0, 0.02, -0.02, 0.04, -0.04, 0.07, -0.07, 0.1, -0.1)
_TURNED = tuple(np.radians((0.0, 10.0, -10.0, 20.0, -20.0)))
_TRIED = np.array(list(itertools.product(_SHORTER, _ASIDE, _TURNED)))
"""(k, 3) places that are tried for a foot without room: steps back along the way, to the left [m], turned
[rad]; the nearest one is taken."""
_EFFORT = np.abs(_TRIED / [1.0, 0.25, 1.0]).sum(axis=1)


@dataclass(frozen=True)
class StepRule:
    """Where and when feet that roll are set down, of a person of 1.75 m.

    Step length and frequency grow together: their quotient, the walk ratio, is about the same at all speeds
    ([Murakami2017]_, who find it larger below 1 m/s). It is that of 43 people's cadence, ``107.3 v^0.477``
    per minute (Fukuchi et al. 2018), to 3 % from 0.5 to 1.8 m/s. The other numbers are our choice, within
    hips that turn about 40 degrees out and less in.

    Attributes:
        walk_ratio: Step length over step frequency [m s].
        back_ratio: Share of it of steps backwards, which are shorter and more frequent [-].
        longest_step: Steps are shorter than this at any speed [m].
        side_step: Way of the body in a close-and-open pair of steps to the side [m].
        turn_step: Turn of the body in a step [rad].
        width: Between the soles' middles in walking, across the heading [m]; ``standing_width`` is the same
            at the start and the end.
        narrowest: Least distance of a landing foot from a parallel one, across their mean heading [m]; feet
            do not cross. Turned feet keep what their soles, of ``sole_length`` [m], need beyond that.
        sole_width: Of the soles, beside obstacles [m].
        widest: Largest such distance [m]; ``longest`` is that along their mean heading.
        splay: How far each foot is turned outwards from the heading [rad].
        toes_in: A landing foot is turned inwards from the other one by at most this [rad], outwards by
            ``toes_out``.
        single: Least time on one foot [s].
        double: Least time on both feet between steps [s]; ``standing`` is that before the first step and
            after the last one.
        lengthened: Share of a step that all others make up for, to save it; a larger one makes one more step.
        double_share: Share of a step that is spent on both feet at rest [-]; it falls by ``double_fall`` for
            each m/s, to ``double_least``.
    """

    walk_ratio: float = 0.32
    back_ratio: float = 0.65
    longest_step: float = 0.9
    side_step: float = 0.25
    turn_step: float = np.radians(25.0)
    width: float = 0.14
    standing_width: float = 0.18
    narrowest: float = 0.13
    sole_length: float = 0.28
    sole_width: float = 0.12
    widest: float = 0.5
    longest: float = 1.1
    splay: float = np.radians(4.0)
    toes_in: float = np.radians(12.0)
    toes_out: float = np.radians(40.0)
    single: float = 0.36
    double: float = 0.1
    double_share: float = 0.4
    double_fall: float = 0.12
    double_least: float = 0.2
    standing: float = 0.25
    lengthened: float = 0.5

    def __post_init__(self) -> None:
        for name in ("walk_ratio", "back_ratio", "longest_step", "side_step", "turn_step", "narrowest",
                     "sole_length", "sole_width", "longest", "single", "double", "standing"):  # fmt: skip
            finite_number(getattr(self, name), f"step rule {name}", above=0.0)
        for name in ("width", "standing_width", "widest"):
            finite_number(getattr(self, name), f"step rule {name} [m]", at_least=self.narrowest)
        for name in ("splay", "toes_in", "toes_out"):
            finite_number(getattr(self, name), f"step rule {name} [rad]", at_least=0.0, at_most=np.pi / 2)
        for name in ("double_share", "double_least"):
            finite_number(getattr(self, name), f"step rule {name}", above=0.0, at_most=0.9)
        finite_number(self.double_fall, "step rule double_fall [s/m]", at_least=0.0)

    def scaled(self, stature: float) -> "StepRule":
        """The rule of a body of another stature [m]: lengths grow with it, times with its square root."""
        length = finite_number(stature, "stature [m]", above=0.0) / 1.75
        time = np.sqrt(length)
        factors = dict.fromkeys(("longest_step", "side_step", "width", "standing_width", "narrowest",
                                 "sole_length", "sole_width", "widest", "longest"), length)  # fmt: skip
        factors |= dict.fromkeys(("single", "double", "standing"), time)
        scaled = {name: getattr(self, name) * factor for name, factor in factors.items()}
        return replace(self, walk_ratio=self.walk_ratio * length * time, **scaled)

    def frequency(self, velocity: FloatArray) -> FloatArray:
        """(...) steps per second at (..., 3) forward, left [m/s] and angular velocities [rad/s]."""
        speed = np.abs(velocity[..., 0])
        ratio = np.where(velocity[..., 0] < 0.0, self.back_ratio, 1.0) * self.walk_ratio
        ahead = np.maximum(speed / ratio, (speed / self.longest_step) ** 2)
        aside, turning = 2.0 * velocity[..., 1] / self.side_step, velocity[..., 2] / self.turn_step
        return np.sqrt(ahead + aside**2 + turning**2)


@dataclass(frozen=True, eq=False)
class SteppedPath(SampledWalk):
    """A path on the clock of the feet that walk it, which cannot always follow as fast as it goes.

    Attributes:
        path: The path on its own clock.
        footprints: Where and when feet stand; their clock begins at 0.
        clock: (k, 2) instants of the feet and of the path that belong together [s].
    """

    path: SampledWalk
    footprints: Footprints
    clock: FloatArray

    def __post_init__(self) -> None:
        clock = frozen_array(self.clock, "clock of a stepped path [s]", (len(self.clock), 2))
        vars(self).update(clock=clock, _own=PchipInterpolator(*clock.T, extrapolate=False))

    @property
    def duration(self) -> float:  # type: ignore[override]
        """Duration with the time of standing before and after [s]."""
        return self.footprints.end

    @property
    def failure(self) -> str | None:  # type: ignore[override]
        """That of the path."""
        return self.path.failure

    def place_at(self, time: ArrayLike) -> FloatArray:
        """(..., 3) x, y [m] and heading [rad] at (...) instants [s]."""
        return self.path.place_at(self._path_time(time, 0))

    def motion_at(self, time: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """(..., 3) velocities and (..., 3) accelerations of the body at (...) instants [s]."""
        velocity, acceleration = self.path.motion_at(self._path_time(time, 0))
        rate, change = (self._path_time(time, order)[..., None] for order in (1, 2))
        return velocity * rate, acceleration * rate**2 + velocity * change

    def _path_time(self, time: ArrayLike, order: int) -> FloatArray:
        """(...) instants of the path, or their derivatives, 0 where the body stands before and after."""
        feet, own = np.asarray(time, dtype=np.float64), vars(self)["_own"]
        inside = (feet >= self.clock[0, 0]) & (feet <= self.clock[-1, 0])
        found = np.asarray(own(np.clip(feet, *self.clock[[0, -1], 0]), order))
        return found if order == 0 else np.where(inside, found, 0.0)


def step_along(
    path: SampledWalk, rule: StepRule | None = None, *, ends: Mapping[str, FloatArray] | None = None,
    height: float = 0.0, obstacles: Sequence[WalkObstacle] = (),
) -> SteppedPath:  # fmt: skip
    """Alternate steps along a path, from both feet side by side to both feet side by side.

    Each stretch from rest to rest is cut into steps by their frequency. A foot is set down where the body is
    at the next cut, as the body passes it there; in moves to the side it comes no nearer to the other foot
    than side by side, so that legs do not cross: feet close and open. Further steps follow until both feet
    stand. They land half a step before the body passes; a body that is faster than its feet waits for them.

    Where a sole, or what it sweeps on its way, has less than :data:`~manikin.walking.foot_room.FOOT_ROOM` to
    an obstacle, it is set down a little elsewhere: shorter, to the side, or turned. Where that is not enough,
    steps become shorter there, so that feet keep nearer to the way of the body. Where it never is, the place
    with the most room is kept: what a whole body meets is measured elsewhere.

    Args:
        path: Path of the middle between the feet.
        rule: Where and when feet are set down.
        ends: (3,) x, y [m], yaw [rad] where each foot stands at the end; beside the goal if omitted.
        height: Height of the floor [m].
        obstacles: What stands on the floor.

    Raises:
        InputError: If the path is no solution, or the rule's limits keep the feet from the goal.
    """
    rule = rule or StepRule()
    if not path.succeeded:
        raise InputError(f"walking path {path.failure}; valid: a path that succeeded")
    room = FootRoom(obstacles, rule.sole_length, rule.sole_width)
    stretches = [_Cuts(path, rule, *ends) for ends in path.stretches]
    feet = {foot: _beside(foot, stretches[0].place(0.0), rule.standing_width, rule.splay) for foot in FEET}
    held = {foot: [(0.0, place)] for foot, place in feet.items()}
    leaves: dict[str, list[float]] = {foot: [] for foot in FEET}
    now, clock = LEAD, list[tuple[float, float]]()
    for number, cuts in enumerate(stretches):
        last = number == len(stretches) - 1
        cuts, steps = _roomy_steps(cuts, room, feet, ends if last else None)
        times = _Times(cuts, rule, now, [item.number for item in steps])
        for step, lift, land in zip(steps, times.lifts, times.lands, strict=True):
            leaves[step.foot].append(lift)
            held[step.foot].append((land, step.place))
            feet[step.foot] = step.place
        clock += times.clock
        now = times.finish + (0.0 if last else stretches[number + 1].begin - cuts.end)
    supports = [
        Footprint(foot, [*place[:2], height], float(place[2]), begin, leave)
        for foot in FEET
        for (begin, place), leave in zip(held[foot], [*leaves[foot], now + LEAD], strict=True)
    ]
    return SteppedPath(path, Footprints(supports), np.array(clock))


@dataclass(frozen=True, eq=False)
class _Placed:
    """A step: its number among the cuts, from 1, the foot, (3,) where it is set down, what room it lacks."""

    number: int
    foot: str
    place: FloatArray
    lack: float


class _Cuts:
    """A stretch of a path from rest to rest over the number of steps done."""

    def __init__(
        self, path: SampledWalk, rule: StepRule, begin: float, end: float,
        closer: Sequence[tuple[float, float]] = (),
    ) -> None:  # fmt: skip
        """Count the steps; between each pair of instants in ``closer`` [s] they are shorter."""
        self.path, self.rule, self.begin, self.end, self.closer = path, rule, begin, end, tuple(closer)
        self._time = np.linspace(begin, end, int(np.ceil((end - begin) / SAMPLING)) + 1)
        frequency = rule.frequency(path.motion_at(self._time)[0])
        for first, last in self.closer:
            away = np.maximum(first - self._time, self._time - last) / _AROUND
            frequency *= 1.0 + (_CLOSER - 1.0) * np.clip(1.0 - away, 0.0, 1.0)
        done = cumulative_trapezoid(frequency, self._time, initial=0.0)
        self.count = max(1, int(np.ceil(done[-1] - rule.lengthened)))
        # Where the body rests nothing is done; a little keeps the inverse unique.
        done += 1e-9 * (self._time - begin)
        self._done = done * (self.count / done[-1])

    def time(self, done: float) -> float:
        """When so many steps are done, on the clock of the path [s]."""
        return float(np.interp(done, self._done, self._time))

    def place(self, done: float) -> FloatArray:
        """(3,) x, y [m] and heading [rad] of the body when so many steps are done."""
        return self.path.place_at(self.time(min(done, float(self.count))))

    def ends(self) -> dict[str, FloatArray]:
        """(3,) x, y [m], yaw [rad] of each foot that stands at the end."""
        goal = self.place(self.count)
        return {foot: _beside(foot, goal, self.rule.standing_width, self.rule.splay) for foot in FEET}

    def double_share(self, number: int) -> float:
        """Share of a step that is spent on both feet [-]."""
        way = np.hypot(*(self.place(number) - self.place(number - 1))[:2])
        taken = self.time(min(number, self.count)) - self.time(min(number, self.count) - 1)
        rule = self.rule
        return max(rule.double_share - rule.double_fall * float(way) / taken, rule.double_least)


def _roomy_steps(
    cuts: _Cuts, room: FootRoom, stands: Mapping[str, FloatArray], ends: Mapping[str, FloatArray] | None
) -> tuple[_Cuts, list[_Placed]]:
    """Steps of a stretch with as much room as there is, and the cuts on which they are."""
    found: list[tuple[float, _Cuts, list[_Placed]]] = []
    for _ in range(_ROUNDS):
        steps = list(_steps(cuts, room, stands, ends or cuts.ends()))
        short = [step for step in steps if step.lack > 0.0]
        found.append((sum(step.lack for step in short), cuts, steps))
        if not short:
            break
        tight = [(cuts.time(max(step.number - 2.0, 0.0)), cuts.time(step.number)) for step in short]
        cuts = _Cuts(cuts.path, cuts.rule, cuts.begin, cuts.end, (*cuts.closer, *_merged(tight)))
    return min(found, key=lambda item: item[0])[1:]


def _merged(intervals: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals as their union."""
    merged: list[tuple[float, float]] = []
    for first, last in sorted(intervals):
        if merged and first <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(last, merged[-1][1])
        else:
            merged.append((first, last))
    return merged


def _leading(cuts: _Cuts) -> str:
    """The foot on the side to which the first step goes, or the left one."""
    before, after = cuts.place(0.0), cuts.place(1.0)
    x, y = after[:2] - before[:2]
    aside = -np.sin(before[2]) * x + np.cos(before[2]) * y
    return "right_foot" if aside + 0.1 * (after[2] - before[2]) < -0.02 else "left_foot"


def _beside(foot: str, place: FloatArray, width: float, splay: float) -> FloatArray:
    x, y, heading = place
    half = SIDE[foot] * width / 2
    yaw = heading + SIDE[foot] * splay
    return np.array([x - np.sin(heading) * half, y + np.cos(heading) * half, yaw])


def _steps(
    cuts: _Cuts, room: FootRoom, stands: Mapping[str, FloatArray], ends: Mapping[str, FloatArray]
) -> Iterator[_Placed]:
    """Steps from where the feet stand, until both are where they end."""
    feet, first, rule = dict(stands), _leading(cuts), cuts.rule
    # Where feet have to stand near an obstacle, steps from there and to there have no more room.
    given = {foot: min(room.at(stands[foot]), room.at(ends[foot])) for foot in FEET}
    order = itertools.cycle((first, *(foot for foot in FEET if foot != first)))
    for number, foot in enumerate(order, start=1):
        if all(np.abs(feet[each] - ends[each]).max() < _REACHED for each in FEET):
            return
        if number > 4 * cuts.count + 20:
            raise InputError("step rule keeps the feet from the goal; valid: wider limits or shorter steps")
        other = next(feet[each] for each in FEET if each != foot)
        passed = _beside(foot, cuts.place(number), rule.width, rule.splay)
        wanted = passed if number < cuts.count else ends[foot]
        placed = within_reach(wanted, other, SIDE[foot], rule)
        least = min(FOOT_ROOM, given[foot] - _REACHED)
        left = float(room.beside(feet[foot], placed[None])[0])
        if left < least and number < cuts.count:
            tried = _tried(cuts, number, foot, other)
            rooms = room.beside(feet[foot], tried)
            best = int(np.argmin(np.where(rooms < least, 100.0 - rooms, _EFFORT)))
            placed, left = tried[best], float(rooms[best])
        if np.abs(placed - feet[foot]).max() > _REACHED:
            feet[foot] = placed
            yield _Placed(number, foot, placed, max(least - left, 0.0))


def _tried(cuts: _Cuts, number: int, foot: str, other: FloatArray) -> FloatArray:
    """(k, 3) places of a foot near to where the body passes it, beside the other foot at ``other`` (3,)."""
    rule, tried = cuts.rule, []
    for back, aside, turned in _TRIED.tolist():
        x, y, heading = cuts.place(number - back)
        moved = np.array([x - aside * np.sin(heading), y + aside * np.cos(heading), heading])
        passed = _beside(foot, moved, rule.width, rule.splay)
        passed[2] += turned
        tried.append(within_reach(passed, other, SIDE[foot], rule))
    return np.array(tried)


def within_reach(wanted: FloatArray, other: FloatArray, side: float, rule: StepRule) -> FloatArray:
    """(3,) x, y [m], yaw [rad] nearest to the wanted ones that the hips allow a foot beside the other one.

    The other foot stands at ``other`` (3,); the side of the foot is from :data:`SIDE`.
    """
    outwards = np.clip(side * (wanted[2] - other[2]), -rule.toes_in, rule.toes_out)
    yaw = other[2] + side * outwards
    mean = (yaw + other[2]) / 2
    ahead, left = np.array([np.cos(mean), np.sin(mean)]), np.array([-np.sin(mean), np.cos(mean)])
    offset = wanted[:2] - other[:2]
    along = float(np.clip(offset @ ahead, -rule.longest, rule.longest))
    least = rule.narrowest + rule.sole_length * np.sin(abs(outwards) / 2)
    across = float(np.clip(side * (offset @ left), least, max(least, rule.widest)))
    return np.array([*(other[:2] + along * ahead + side * across * left), yaw])


class _Times:
    """When the feet of a stretch leave and land, and the clock of the path beside theirs.

    Attributes:
        lifts: Of each step [s].
        lands: The same.
        clock: Instants of the feet and of the path that belong together [s].
        finish: When the stretch is over [s].
    """

    def __init__(self, cuts: _Cuts, rule: StepRule, begin: float, numbers: Sequence[int]) -> None:
        """Give each step the time between two passes of the body, or the least one of the rule.

        Args:
            begin: When the body begins to move [s].
            numbers: Of the steps, among the cuts.
        """
        passed = np.array([cuts.time(number - 0.5) for number in range(1, cuts.count + 1)])
        usual = float(np.median(np.diff(passed))) if len(passed) > 1 else 0.0
        self.clock, self.lifts, self.lands = [(begin, cuts.begin)], list[float](), list[float]()
        middle, half, left = begin, 0.0, cuts.begin
        for number in numbers:
            share, late = cuts.double_share(number), number > cuts.count
            way = usual * (number - cuts.count) if late else passed[number - 1] - left
            left = cuts.end if late else passed[number - 1]
            least = max(rule.single + rule.double, rule.single / (1.0 - share))
            taken = max(way if self.lands else usual, least)
            swing = (1.0 - share) * taken
            if self.lands:
                middle, lift = middle + taken, middle + half
            else:
                middle = max(begin + way, begin + rule.standing + swing + 0.5 * share * taken)
                lift = middle - 0.5 * share * taken - swing
            half = 0.5 * share * taken
            self.lifts.append(lift)
            self.lands.append(max(middle - half, lift + rule.single))
            if not late:
                self.clock.append((middle, left))
        rest = max(cuts.end - self.clock[-1][1], 0.1)
        self.clock.append((self.clock[-1][0] + rest, cuts.end))
        self.finish = max(self.clock[-1][0], (self.lands[-1] if self.lands else begin) + rule.standing)
