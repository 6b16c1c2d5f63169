"""Feet that walk on given footprints: down on the heel, over the sole, off from the toes.

A foot has one place on the floor in each support. It lands on the edge of its heel, lies flat, rises about
the hinge of its toes and leaves; its centre of pressure goes the same way. How much it rolls follows from how
far it goes forward: a foot that goes back lands on its toes, one that goes aside flat, and both leave flat.
Angles and shares of the time are our own choice, near people's.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.interpolate import PchipInterpolator

from manikin.body import BodyModel
from manikin.body.limbs import toe_hinge
from manikin.contact import (
    Contact,
    ContactSchedule,
    Phase,
    SolePart,
    Stance,
    StanceSequence,
    default_normal_force_cap,
    sole,
    sole_part,
)
from manikin.errors import BodyError
from manikin.numerics.signals import least_jerk
from manikin.numerics.spatial import FloatArray, finite_number, rotation_from_yaw, rotations
from manikin.planning.whole_body.foot_roll import FootRoll
from manikin.planning.whole_body.swing_path import Pose
from manikin.walking.footprints import Footprint, Footprints
from manikin.walking.stepper import SIDE

LEAST_ROLL = 0.1
"""Steps forward that are shorter than this share of a full one begin and end flat."""


BACK_LIFT = 0.03
"""How much higher a foot is lifted that lands on its toes, which hang down before [m]."""


LIVELY = 1.2
"""Half of the acceleration with which a swing begins, over its mean speed and its time; 0 is least jerk.
A foot that begins suddenly and lands softly asks less of the hips in between."""


@dataclass(frozen=True)
class RollRule:
    """How feet roll, of a person of 1.75 m.

    Attributes:
        full_step: Step forward from which on feet roll in full [m]; they roll less in shorter ones.
        push_off: Pitch at lift-off after a full step, heel up [rad].
        touch: Pitch at landing on the heel after a full step, toes up [rad].
        flat: Share of a support after which the sole lies flat; ``latest_flat`` is the longest time [s].
        rise: Share of a support, of ``longest`` [s] at most, in which the heel is up at its end.
        lift: Height of the pivot in the middle of a swing [m].
        aside: How far a foot swings out around the other one [m].
        pressed_up: Where the pressure is when the heel rises, before the hinge of the toes [m];
            ``pressed_off`` is that at lift-off.
        slowest_flat: Least time for which a sole is flat [s].
    """

    full_step: float = 0.7
    push_off: float = 1.0
    touch: float = 0.2
    flat: float = 0.16
    latest_flat: float = 0.07
    rise: float = 0.48
    longest: float = 0.8
    lift: float = 0.065
    aside: float = 0.02
    pressed_up: float = 0.015
    pressed_off: float = 0.02
    slowest_flat: float = 0.05

    def __post_init__(self) -> None:
        for item in fields(self):
            finite_number(getattr(self, item.name), f"roll rule {item.name}", at_least=0.0)


@dataclass(frozen=True, eq=False)
class RollingSupport:
    """One support of a foot and how it rolls.

    Attributes:
        step: Where and when the foot stands.
        flat: When the sole lies flat [s].
        up: When the heel rises [s].
        roll_in: Share of the full pitch with which it lands on its heel, or, if negative, on its toes.
        roll_out: Share of the full pitch with which it leaves.
    """

    step: Footprint
    flat: float
    up: float
    roll_in: float
    roll_out: float

    def part_at(self, time: float) -> SolePart:
        """Part of the sole that touches at a time of the support [s]."""
        if time < self.flat and self.roll_in:
            return SolePart.HEEL if self.roll_in > 0.0 else SolePart.TOES
        return SolePart.TOES if time >= self.up and self.roll_out else SolePart.FULL


class RollingFoot:
    """One foot of a human on its footprints."""

    def __init__(self, body: BodyModel, footprints: Footprints, name: str, rule: RollRule) -> None:
        """Find when each support rolls; BodyError if the body has no soles with toes.

        Args:
            footprints: Of both feet.
            name: Effector of the foot.
        """
        hinge = toe_hinge(body, name)
        if body.sole_length is None or body.sole_width is None or hinge is None:
            raise BodyError(f"body {body.name!r} has no soles with toes; valid: a human")
        self.name, self.rule, self.hinge = name, rule, hinge
        self.length, self.width = body.sole_length, body.sole_width
        self.offset = body.effector(name).translation
        steps = footprints.of(name)
        forward = [0.0, *(_forward(a, b) for a, b in pairwise(steps)), 0.0]
        self.supports = tuple(
            self._support(step, before, after)
            for step, before, after in zip(steps, forward[:-1], forward[1:], strict=True)
        )

    def _support(self, step: Footprint, before: float, after: float) -> RollingSupport:
        """Support between strides of which the body goes forward ``before`` and ``after`` [m]."""
        rule, held = self.rule, step.leaves - step.lands
        shares = (min(max(way / rule.full_step, -1.0), 1.0) for way in (before, after))
        roll_in, roll_out = (share if abs(share) > LEAST_ROLL else 0.0 for share in shares)
        roll_out = max(roll_out, 0.0)
        flat = step.lands + (min(rule.flat * held, rule.latest_flat) if roll_in else 0.0)
        up = step.leaves - (rule.rise * min(held, rule.longest) if roll_out else 0.0)
        return RollingSupport(step, flat, max(up, flat + rule.slowest_flat), roll_in, roll_out)

    def support_at(self, time: float) -> RollingSupport | None:
        """The support that holds at a time [s]; the first and the last one go on for ever."""
        for k, item in enumerate(self.supports):
            begun = k == 0 or item.step.lands <= time
            if begun and (k == len(self.supports) - 1 or time < item.step.leaves):
                return item
        return None

    def contact_at(self, time: float, friction: float) -> Contact | None:
        """What of the sole touches at a time [s], or None in flight."""
        item = self.support_at(time)
        if item is None:
            return None
        size = {"length": self.length, "width": self.width}
        made = sole(self.name, item.step.position, item.step.yaw, **size, friction=friction)
        return sole_part(made, item.part_at(time), float(self.hinge[0]))

    @cached_property
    def events(self) -> list[float]:
        """Instants at which something else of the foot touches [s]."""
        return [t for item in self.supports for t in (item.step.lands, item.flat, item.up, item.step.leaves)]

    def path(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Soles at (n,) instants [s]: positions (n, 3), rotations (n, 3, 3) and toe extensions (n,) [rad]."""
        first = self.supports[0].step
        position = np.tile(first.position, (len(time), 1))
        rotation = np.tile(rotation_from_yaw(first.yaw), (len(time), 1, 1))
        toes = np.zeros(len(time))
        for before, after in pairwise(self.supports):
            rows = time >= before.up
            position[rows], rotation[rows], toes[rows] = self._flight(before, after, time[rows])
        return position, rotation, toes

    def _flight(
        self, before: RollingSupport, after: RollingSupport, time: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        rule, off, land = self.rule, before.step.leaves, after.step.lands
        start, stop = (
            Pose(np.array(item.step.position), rotation_from_yaw(item.step.yaw)) for item in (before, after)
        )
        heel = np.array([-0.5 * self.length, 0.0, 0.0])
        roll = FootRoll(
            np.array([before.up, off, land, after.flat]), start, stop, self.hinge, heel,
            before.roll_out * rule.push_off, -after.roll_in * rule.touch, toes_back=0.85, landing_rate=1.2,
        )  # fmt: skip
        share = np.clip((time - off) / (land - off), 0.0, 1.0)
        done, (begin, end) = least_jerk(share)[0], roll.pivots
        done += LIVELY * share**2 * (1.0 - share) ** 3
        raised = 64.0 * (share * (1.0 - share)) ** 3
        pivot = begin.position + done[:, None] * (end.position - begin.position)
        turn = float(np.angle(np.exp(1j * (after.step.yaw - before.step.yaw))))
        yaw = before.step.yaw + done * turn
        pivot[:, 2] += (rule.lift + (BACK_LIFT if after.roll_in < 0.0 else 0.0)) * raised
        aside = SIDE[self.name] * rule.aside * raised
        pivot[:, :2] += aside[:, None] * np.column_stack([-np.sin(yaw), np.cos(yaw)])
        level = np.zeros(len(time))
        return *roll.pose(pivot, rotations(yaw, level, level), time), roll.toe_extension(time)

    def pressure(self, time: FloatArray) -> FloatArray:
        """(n, 3) centre of pressure that the foot is to have at (n,) instants, kept in flight [m]."""
        found = np.empty((len(time), 3))
        for k, item in enumerate(self.supports):
            rows = time >= (item.step.lands if k else -np.inf)
            knots, along = self._pressed(item, first=k == 0)
            done = PchipInterpolator(knots, along)(np.clip(time[rows], knots[0], knots[-1]))
            ahead = np.array([np.cos(item.step.yaw), np.sin(item.step.yaw), 0.0])
            found[rows] = item.step.position + done[:, None] * ahead
        return found

    def _pressed(self, item: RollingSupport, *, first: bool) -> tuple[FloatArray, FloatArray]:
        """Instants [s] and places along the sole [m] through which its pressure goes."""
        half, line, rule = 0.5 * self.length, float(self.hinge[0]), self.rule
        knots = {item.step.lands: 0.0}
        if item.roll_in < 0.0:
            knots = {item.step.lands: line + rule.pressed_up, item.flat + 0.1: 0.0}
        elif item.roll_in:
            middle = 0.5 * (item.flat + item.up)
            knots = {item.step.lands: -0.85 * half, item.flat: -0.5 * half, middle: 0.0}
        if item.roll_out:
            if first:  # forward from standing
                knots[max(item.up - 0.2, item.step.lands + 0.01)] = 0.02
            knots |= {item.up: line + rule.pressed_up, item.step.leaves: line + rule.pressed_off}
        elif item.roll_in > 0.0:
            knots = {item.step.lands: -0.85 * half, item.flat: -0.5 * half, item.flat + 0.3: 0.0}
        else:
            knots[max(knots) + 0.3] = 0.0
        instants = np.array(sorted(knots))
        return instants, np.array([knots[t] for t in instants.tolist()])


def _forward(begin: Footprint, end: Footprint) -> float:
    """Half of a stride along the heading of the foot before it: what the body goes forward in a step [m]."""
    return float((end.position - begin.position)[:2] @ [np.cos(begin.yaw), np.sin(begin.yaw)]) / 2


def rolling_schedule(
    body: BodyModel, feet: Sequence[RollingFoot], begin: float, end: float, friction: float
) -> ContactSchedule:
    """Phases of the supports of both feet, from each change of what touches to the next.

    Args:
        feet: Of a human.
        begin: Start of the first phase [s].
        end: End of the last phase [s].
        friction: Coulomb coefficient of the soles.
    """
    cuts = [begin]
    for time in sorted({time for foot in feet for time in foot.events}):
        if cuts[-1] + 1e-3 < time < end - 1e-3:
            cuts.append(time)
    cuts.append(end)
    cap, phases = default_normal_force_cap(body.mass), []
    for first, last in pairwise(cuts):
        held = [foot.contact_at(0.5 * (first + last), friction) for foot in feet]
        stance = Stance([contact for contact in held if contact is not None], cap)
        phases.append(Phase(stance, last - first, last - first))
    return ContactSchedule(StanceSequence(phases), np.array(cuts))
