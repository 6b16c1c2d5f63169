"""Footprints of a walk: placed along the path of the body, or read from a whole-body walk."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from manikin.body import Configuration
from manikin.contact.from_motion import LevelSupport, level_supports
from manikin.errors import InputError
from manikin.numerics.spatial import FloatArray, finite_number
from manikin.walking.footprints import FEET, Footprint, Footprints
from manikin.walking.gait.follow_path import Walk
from manikin.walking.path.walking_path import WalkingPath

SIDE = {"left_foot": 1.0, "right_foot": -1.0}
"""On which side of the body a foot is, along its y axis."""

_REACHED = 1e-6


@dataclass(frozen=True)
class StepRule:
    """Where and when feet are set down, of a person of 1.75 m.

    Step length and frequency grow together: their quotient, the walk ratio, is the same at all speeds, about
    0.0065 m per step and minute ([Murakami2017]_, who find it larger below 1 m/s).
    The other numbers are our choice, within hips that turn about 40 degrees out and less in.

    Attributes:
        walk_ratio: Step length over step frequency [m s].
        longest_step: Steps are shorter than this at any speed [m]; no plan was found for steps of 0.6 m.
        side_step: Way of the body in a close-and-open pair of steps to the side [m].
        turn_step: Turn of the body in a step [rad].
        width: Between the soles' middles in walking, across the heading [m]; ``standing_width`` is the same
            at the start and the end.
        narrowest: Least distance of a landing foot from a parallel one, across their mean heading [m]; feet
            do not cross. Turned feet keep what their soles, of ``sole_length`` [m], need beyond that.
        widest: Largest such distance [m]; ``longest`` is that along their mean heading.
        splay: How far each foot is turned outwards from the heading [rad].
        toes_in: A landing foot is turned inwards from the other one by at most this [rad], outwards by
            ``toes_out``.
        single: Least time on one foot [s].
        double: Least time on both feet between steps [s]; ``standing`` is that at the start and the end.
        lengthened: Share of a step that all others make up for, to save it; a larger one makes one more step.
        double_share: Share of a step that is spent on both feet [-].
    """

    walk_ratio: float = 0.0065 * 60.0
    longest_step: float = 0.5
    side_step: float = 0.25
    turn_step: float = np.radians(25.0)
    width: float = 0.15
    standing_width: float = 0.2
    narrowest: float = 0.15
    sole_length: float = 0.28
    widest: float = 0.5
    longest: float = 0.7
    splay: float = 0.0
    toes_in: float = np.radians(12.0)
    toes_out: float = np.radians(40.0)
    single: float = 0.4
    double: float = 0.1
    double_share: float = 0.25
    standing: float = 0.3
    lengthened: float = 0.1

    def __post_init__(self) -> None:
        for name in ("walk_ratio", "longest_step", "side_step", "turn_step", "narrowest", "sole_length",
                     "longest", "single", "double", "standing"):  # fmt: skip
            finite_number(getattr(self, name), f"step rule {name}", above=0.0)
        for name in ("width", "standing_width", "widest"):
            finite_number(getattr(self, name), f"step rule {name} [m]", at_least=self.narrowest)
        for name in ("splay", "toes_in", "toes_out"):
            finite_number(getattr(self, name), f"step rule {name} [rad]", at_least=0.0, at_most=np.pi / 2)
        finite_number(self.double_share, "step rule double_share", above=0.0, at_most=0.9)

    @classmethod
    def of_people(cls, speed: float) -> "StepRule":
        """Steps of people on feet that roll, at a speed over the floor [m/s].

        The walk ratio is that of 43 people's cadence of ``107.3 v^0.477`` per minute (Fukuchi et al. 2018),
        to 3 % from 0.5 to 1.8 m/s. Both feet are on the floor for 30 % of the time when slow, and for 21 % at
        1.5 m/s: a foot that has landed carries little at first.
        """
        share = float(np.clip(0.48 - 0.18 * finite_number(speed, "speed [m/s]", at_least=0.0), 0.2, 0.3))
        return cls(
            walk_ratio=0.32, longest_step=0.9, longest=1.1, width=0.14, narrowest=0.13, standing_width=0.18,
            splay=float(np.radians(4.0)), single=0.36, double_share=share, standing=0.25, lengthened=0.5,
        )  # fmt: skip

    def scaled(self, stature: float) -> "StepRule":
        """The rule of a body of another stature [m]: lengths grow with it, times with its square root."""
        length = finite_number(stature, "stature [m]", above=0.0) / 1.75
        time = np.sqrt(length)
        factors = dict.fromkeys(("longest_step", "side_step", "width", "standing_width", "narrowest",
                                 "sole_length", "widest", "longest"), length)  # fmt: skip
        factors |= dict.fromkeys(("single", "double", "standing"), time)
        scaled = {name: getattr(self, name) * factor for name, factor in factors.items()}
        return replace(self, walk_ratio=self.walk_ratio * length * time, **scaled)

    def frequency(self, velocity: FloatArray) -> FloatArray:
        """(...) steps per second at (..., 3) forward, left [m/s] and angular velocities [rad/s]."""
        speed = np.abs(velocity[..., 0])
        ahead = np.maximum(speed / self.walk_ratio, (speed / self.longest_step) ** 2)
        aside, turning = 2.0 * velocity[..., 1] / self.side_step, velocity[..., 2] / self.turn_step
        return np.sqrt(ahead + aside**2 + turning**2)


def place_footprints(
    path: WalkingPath, rule: StepRule | None = None, *, first: str | None = None, height: float = 0.0
) -> Footprints:
    """Alternate footprints along a path, from both feet side by side to both feet side by side.

    The body's path is cut into steps by its step frequency. A foot is set down where the body is at the next
    cut, as the body passes it there; in moves to the side it comes no nearer to the other foot than side by
    side, so that legs do not cross: feet close and open. Further steps follow until both feet stand at the
    goal. They land half a step before the body passes.

    Args:
        path: Path of the middle between the feet.
        rule: Where and when feet are set down.
        first: Foot of the first step; that on the side to which the body moves or turns, if omitted.
        height: Height of the floor [m].

    Raises:
        InputError: If the path is no solution, the foot has no such name, or the rule's limits keep the feet
            from the goal.
    """
    rule = rule or StepRule()
    if not path.succeeded:
        raise InputError(f"walking path {path.failure}; valid: a path that succeeded")
    if first is not None and first not in FEET:
        raise InputError(f"first is {first!r}; valid: {', '.join(FEET)}")
    cuts = _Cuts(path, rule)
    stands = {foot: _beside(foot, cuts.place(0.0), rule.standing_width, rule.splay) for foot in FEET}
    steps = list(_steps(cuts, rule, first or _leading(cuts), stands))
    return _timed(stands, steps, cuts, rule, height)


class _Cuts:
    """The path over the number of steps done."""

    def __init__(self, path: WalkingPath, rule: StepRule) -> None:
        self.path = path
        done = cumulative_trapezoid(rule.frequency(path.velocity), path.time, initial=0.0)
        self.count = max(1, int(np.ceil(done[-1] - rule.lengthened)))
        # Where the body rests nothing is done; a little keeps the inverse unique.
        done += 1e-9 * path.time
        self._done = done * (self.count / done[-1])

    def time(self, done: float) -> float:
        """When so many steps are done [s]."""
        return float(np.interp(done, self._done, self.path.time))

    def place(self, done: float) -> FloatArray:
        """(3,) x, y [m] and heading [rad] of the body when so many steps are done."""
        return self.path.place_at(self.time(min(done, float(self.count))))


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
    cuts: _Cuts, rule: StepRule, first: str, stands: dict[str, FloatArray]
) -> Iterator[tuple[str, FloatArray]]:
    """Foot and place of each step from where the feet stand, until both stand at the goal."""
    goal = cuts.place(cuts.count)
    ends = {foot: _beside(foot, goal, rule.standing_width, rule.splay) for foot in FEET}
    feet = dict(stands)
    order = itertools.cycle((first, *(foot for foot in FEET if foot != first)))
    for number, foot in enumerate(order, start=1):
        if all(np.abs(feet[each] - ends[each]).max() < _REACHED for each in FEET):
            return
        if number > 4 * cuts.count + 20:
            raise InputError("step rule keeps the feet from the goal; valid: wider limits or shorter steps")
        width = rule.width if number < cuts.count else rule.standing_width
        other = next(feet[each] for each in FEET if each != foot)
        wanted = _beside(foot, cuts.place(number), width, rule.splay)
        placed = within_reach(wanted, other, SIDE[foot], rule)
        if np.abs(placed - feet[foot]).max() > _REACHED:
            feet[foot] = placed
            yield foot, placed


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


def _timed(
    stands: dict[str, FloatArray], steps: list[tuple[str, FloatArray]], cuts: _Cuts, rule: StepRule,
    height: float,
) -> Footprints:  # fmt: skip
    """Times of lift-off and touch-down: half a step before the body passes, none shorter than the rule's."""
    passed, end = [cuts.time(number + 0.5) for number in range(cuts.count)], cuts.path.duration
    usual = float(np.median(np.diff(passed))) if len(passed) > 1 else rule.single + rule.double
    while len(passed) < len(steps):
        passed.append(max(end, passed[-1] + usual) if len(passed) == cuts.count else passed[-1] + usual)
    half = rule.double_share * usual / 2
    lifts, lands = [], []
    for number, middle in enumerate(passed[: len(steps)]):
        lift = max(rule.standing, middle - half - (1.0 - rule.double_share) * usual)
        if number:
            lift = max(lands[-1] + rule.double, passed[number - 1] + half)
        lifts.append(lift)
        lands.append(max(lift + rule.single, middle - half))
    finish = max(end, (lands[-1] if lands else 0.0) + rule.standing)
    supports = []
    for foot in FEET:
        own = [row for row in zip(lifts, lands, steps, strict=True) if row[2][0] == foot]
        begins = [(0.0, stands[foot]), *((land, place) for _, land, (_, place) in own)]
        ends = [*(lift for lift, _, _ in own), finish]
        for (begin, (x, y, yaw)), leave in zip(begins, ends, strict=True):
            supports.append(Footprint(foot, [x, y, height], yaw, begin, leave))
    return Footprints(supports)


def walked_footprints(walk: Walk, rule: StepRule | None = None, *, height: float = 0.0) -> Footprints:
    """Footprints of a walk from the library of recorded ones, to be planned and executed on.

    Each is where the foot is in the middle of its support, relative to how far behind the path both feet
    stand at the start: the path is that of the middle between the feet, as for :func:`place_footprints`.
    Recorded feet turn in and come close to each other in a way that soles and legs of other sizes cannot:
    every footprint is moved to the nearest place that the rule allows beside the other foot, on a floor of a
    height [m]. Where one foot lands in the frame in which the other one leaves, both stand for one frame.
    InputError if the walk has a moment without a foot on the floor, or does not begin and end on both.
    """
    rule = StepRule() if rule is None else rule
    flying = walk.time[~walk.support.any(axis=1)]
    if flying.size:
        raise InputError(f"walk has no foot on the floor at {flying[0]:.2f} s; valid here: a slower one")
    held = sorted(
        (step for foot in range(len(walk.feet)) for step in _shifted_footprints(walk, foot)),
        key=lambda step: (step.lands, step.effector),
    )
    return Footprints(list(_reachable(_overlapping(held, walk), rule, height)))


def walked_supports(walk: Walk, foot: int) -> Iterator[LevelSupport]:
    """Supports of one foot of a walk, in order."""
    return level_supports(
        walk.support[:, foot],
        lambda row: Configuration(walk.body, walk.q[row]).effector_placement(walk.feet[foot]),
    )


def _shifted_footprints(walk: Walk, foot: int) -> Iterator[Footprint]:
    """Footprints of one foot, shifted so that the walk begins with its feet about its path."""
    start = Configuration(walk.body, walk.q[0])
    feet = [start.effector_placement(name)[1][:2] for name in walk.feet]
    behind = np.mean(feet, axis=0) - walk.place[0, :2]
    for item in walked_supports(walk, foot):
        turn = np.exp(1j * (walk.place[item.middle, 2] - walk.place[0, 2])) * complex(*behind)
        lands, leaves = walk.time[[item.first, min(item.stop, len(walk.time) - 1)]].tolist()
        position = (item.x - turn.real, item.y - turn.imag, 0.0)
        yield Footprint(walk.feet[foot], position, item.yaw, lands, leaves)


def _overlapping(held: Sequence[Footprint], walk: Walk) -> Iterator[Footprint]:
    """The footprints, each foot leaving at least one frame after the next landing of the other one."""
    frame = float(walk.time[1] - walk.time[0])
    for step in held:
        landings = [s.lands for s in held if s.effector != step.effector and s.lands > step.lands]
        together = bool(landings) and abs(landings[0] - step.leaves) < frame / 2
        leaves = step.leaves + frame if together else step.leaves
        yield Footprint(step.effector, step.position, step.yaw, step.lands, leaves)


def _reachable(held: Iterator[Footprint], rule: StepRule, height: float) -> Iterator[Footprint]:
    """The footprints moved to where the rule allows a foot beside the other one, on the floor."""
    places: dict[str, FloatArray] = {}
    for step in held:
        place = np.append(step.position[:2], step.yaw)
        for other in (places[foot] for foot in SIDE if foot != step.effector and foot in places):
            place = within_reach(place, other, SIDE[step.effector], rule)
        places[step.effector] = place
        yield Footprint(step.effector, [*place[:2], height], float(place[2]), step.lands, step.leaves)
