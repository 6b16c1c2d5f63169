"""Targets of a whole-body motion at its samples: effectors, toes, and pairs that may touch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from manikin.body import BodyModel
from manikin.body.limbs import ends_before_tip, hanging_segment, hangs
from manikin.contact import CarriedLoad, Contact, ContactKind, ContactSchedule, SolePart
from manikin.kinematics.posture_terms import SINKING
from manikin.numerics.spatial import FloatArray
from manikin.planning.whole_body.foot_roll import Rolls
from manikin.planning.whole_body.sliding_touchdown import SITTING_DOWN, Ignored, SlidingTouchdown, with_pairs
from manikin.planning.whole_body.swing_planner import (
    PlannedSwing,
    carries_elsewhere,
    rolls_on_point,
    touch_pairs,
)
from manikin.scene import Scene
from manikin.scene.distance import ProximitySamples, considered


@dataclass(frozen=True, eq=False)
class EffectorTarget:
    """Placement of an effector at each sample, with its importance.

    Attributes:
        position: (n, 3) in the world [m].
        rotation: (n, 3, 3) effector-to-world.
        weight: (n,) importance of the position: 1 in contact, less in flight, 0 where free.
        rotation_weight: (n,) importance of the orientation, likewise.
        along: (n, 3, 3) applied to the position error before it is weighted: the identity, or
            less than it along the surface of a contact that is still settling.
        pivot: (n, 3) point of the effector's frame that is held instead of its origin where its last number,
            a radius, is not zero: there the effector rolls about its y axis on a round edge [m].
    """

    position: FloatArray
    rotation: FloatArray
    weight: FloatArray
    rotation_weight: FloatArray
    along: FloatArray
    pivot: FloatArray

    @classmethod
    def free(cls, n: int) -> "EffectorTarget":
        """Target without importance at n samples, in arrays to be filled."""
        identity = np.tile(np.eye(3), (n, 1, 1))
        return cls(np.zeros((n, 3)), identity, np.zeros(n), np.ones(n), identity.copy(), np.zeros((n, 3)))

    def put(self, rows: NDArray[np.bool_], contact: Contact) -> None:
        """Place the effector at a contact in some rows."""
        self.position[rows], self.rotation[rows] = contact.position, contact.rotation_contact_to_world
        self.pivot[rows] = contact.pivot if contact.rolls else 0.0


@dataclass(frozen=True, eq=False)
class FitTargets:
    """Targets of the whole-body fit at its samples.

    Attributes:
        time: (n,) [s].
        schedule: Contacts in time.
        effectors: Target of each controlled effector.
        com: (n, 3) centre of mass [m].
        com_weight: (n,) importance of the centre of mass: 1 where it is required, less where the
            trajectory only shows the way.
        com_acceleration: (n, 3) its acceleration [m/s^2].
        margin: (n,) balance margin of the planned centre of mass [N.m].
        reference: (n, nq) preferred configuration.
        reference_scale: (nv,), or (n, nv) by sample, deviation of the tangent [m, rad] that costs one unit;
            infinite entries are free.
        ignored: Pairs whose distance does not count, per sample.
        meeting: What is met at speed, per sample, or None without.
        turning: (n, 3) rate of the angular momentum about the centre of mass [N.m]; None for that of a point
            mass, zero.
        reference_second: (n, nq) second derivatives of the reference, from which accelerations count; None
            where any acceleration costs.
        loads: What is carried at each sample besides the body, or None for nothing.
        strength: Whether joint torques beyond the strength cost.
        ends: (nq,) postures in which the body rests at the start and at the end; None where it only comes to
            rest.
        settles: Whether it comes to rest at the end without acceleration: another part goes on from there.
        kept: Distances of pairs that may touch and still keep some.
    """

    time: FloatArray
    schedule: ContactSchedule
    effectors: Mapping[str, EffectorTarget]
    com: FloatArray
    com_weight: FloatArray
    com_acceleration: FloatArray
    margin: FloatArray
    reference: FloatArray
    reference_scale: FloatArray
    ignored: tuple[Ignored, ...]
    meeting: SlidingTouchdown | None = None
    turning: FloatArray | None = None
    reference_second: FloatArray | None = None
    loads: tuple[CarriedLoad | None, ...] | None = None
    strength: bool = True
    ends: tuple[FloatArray | None, FloatArray | None] = (None, None)
    settles: bool = False
    kept: "KeptDistances" = field(default_factory=lambda: KeptDistances(()))


def effector_targets(
    schedule: ContactSchedule, swings: Sequence[PlannedSwing], time: FloatArray
) -> dict[str, EffectorTarget]:
    """Placement of every effector of the schedule at every time; free where it has no task."""
    phases = schedule.phase_at(time)
    targets = {}
    for name in schedule.sequence.effectors:
        target = targets[name] = EffectorTarget.free(len(time))
        weight, rotation_weight = target.weight, target.rotation_weight
        settling = schedule.settling(time, name)
        for index, phase in enumerate(schedule.sequence):
            if name in phase.stance:
                # A contact holds to the end of its last instant, where the next phase may know nothing of it.
                contact, rows = phase.stance[name], (phases == index) | (time == schedule.instants[index + 1])
                target.put(rows, contact)
                weight[rows] = np.where(settling[rows], ALMOST, 1.0)
                if contact.kind is ContactKind.GRASP:
                    rotation_weight[rows] = GRASP_ROTATION_WEIGHT if contact.oriented else 0.0
                elif rolls_on_point(contact):
                    rotation_weight[rows] = POINT_ROTATION_WEIGHT
                if np.any(settling):
                    share = settled_share(schedule, index, contact, time[rows])
                    target.along[rows] = settling_map(contact, share)
                    rotation_weight[rows] = share
        for item in swings:
            if item.swing.effector == name:
                start, end = item.interval
                _place(item, time, target)
                rows = (time >= start) & (time < end)
                share = (time[rows] - start) / (end - start)
                place, turn, leave = (
                    0.25 if end - start < LONG_FLIGHT else min(0.25, longest / (end - start))
                    for longest in (POSITION_RAMP, ROTATION_RAMP, LEAVING_RAMP)
                )
                hold = item.swing.end or item.swing.start
                on_point = hold is not None and rolls_on_point(hold)
                middle = POINT_FLIGHT_WEIGHT if on_point else FLIGHT_POSITION_WEIGHT
                weight[rows] = flight_weight(share, middle, place, place)
                rotation_weight[rows] = flight_weight(share, FLIGHT_ROTATION_WEIGHT, leave, turn)
                if item.method == "reach":
                    held = share if item.swing.start is None else 1.0 - share
                    weight[rows] = _reach_weight(held, place)
                    rotation_weight[rows] = GRASP_ROTATION_WEIGHT * held
                if on_point:
                    rotation_weight[rows] = POINT_ROTATION_WEIGHT * flight_weight(share, 0.25, leave, turn)
                elif hold is not None and hold.kind is ContactKind.GRASP and not hold.oriented:
                    rotation_weight[rows] = 0.0
    return targets


def _place(item: PlannedSwing, time: FloatArray, target: EffectorTarget) -> None:
    """Write the effector's placement during a flight, and while it rolls before and after it."""
    start, end = item.interval if item.roll is None else item.roll.instants[[0, 3]].tolist()
    rows = (time >= start) & (time < end)
    if not rows.any():
        return
    state = item.curve.evaluate(time[rows])
    placed = state.position, state.rotation
    if item.roll is not None:
        placed = item.roll.pose(*placed, time[rows])
    target.position[rows], target.rotation[rows] = placed


def toe_angles(body: BodyModel, rolls: Rolls, time: FloatArray) -> dict[int, FloatArray]:
    """Angle (n,) of each joint of toes that stay flat while their foot rolls [rad], by joint index."""
    found: dict[int, FloatArray] = {}
    for name, roll in rolls:
        toes = hanging_segment(body, body.effector(name).segment)
        if toes is not None:
            rows = (time >= roll.instants[0]) & (time < roll.instants[2 if roll.touch < 0.0 else 3])
            angle = found.setdefault(body.joint_index(toes.hinges[0].name), np.zeros(len(time)))
            angle[rows] = roll.toe_extension(time[rows])
    return found


FLAT_TOES = 2.0e-3
"""Deviation of toes from lying flat, or straight, that costs one unit [rad]."""


def lay_toes_flat(
    angles: Mapping[int, FloatArray], reference: FloatArray, scale: FloatArray | None = None
) -> None:
    """Set angles (n,) [rad] of joints in reference configurations (n, nq), and their scales (n, nv)."""
    for joint, values in angles.items():
        reference[:, 7 + joint] = values
        if scale is not None:
            scale[:, 6 + joint] = FLAT_TOES


def flat_share(body: BodyModel, schedule: ContactSchedule, time: FloatArray) -> dict[int, FloatArray]:
    """Importance (n,) of straight toes, by joint index: 1 while their sole is held.

    What a foot stands on does not count as an obstacle: nothing else keeps its toes out of it.
    """
    found: dict[int, FloatArray] = {}
    for name in schedule.sequence.effectors:
        toes = hanging_segment(body, body.effector(name).segment)
        if toes is None:
            continue
        held, before = np.zeros(len(time)), SolePart.FULL
        for phase, (start, end) in zip(schedule.sequence, pairwise(schedule.instants), strict=True):
            part, after = before, phase.stance[name].part if name in phase.stance else SolePart.FULL
            before = after
            if name in phase.stance and after is SolePart.FULL:
                coming = 1.0 - np.clip((start - time - STRAIGHT) / STRAIGHTENING, 0.0, 1.0)
                if part is SolePart.TOES:  # bent until the heel is down
                    coming = 1.0 - np.clip((start - time) / STRAIGHT, 0.0, 1.0)
                leaving = 1.0 - np.clip((time - end) / STRAIGHT, 0.0, 1.0)
                held = np.maximum(held, np.minimum(coming, leaving))
        found |= dict.fromkeys((body.joint_index(hinge.name) for hinge in toes.hinges), held)
    return found


STRAIGHT, STRAIGHTENING = 0.1, 0.2
"""Time before a landing in which toes are straight already, and after a lift-off until they may bend; and
time before that in which they become straight [s]."""


def settled_share(schedule: ContactSchedule, phase: int, contact: Contact, time: FloatArray) -> FloatArray:
    """(n,) how far a contact of a phase has settled at each time: 0 at its touch-down, 1 at its place."""
    first = phase
    while first > 0 and contact.effector in schedule.sequence[first - 1].stance:
        first -= 1
    if contact.settle == 0.0:
        return np.ones(len(time))
    share = np.clip((time - schedule.instants[first]) / contact.settle, 0.0, 1.0)
    return share**2 * (3.0 - 2.0 * share)


def settling_map(contact: Contact, share: FloatArray) -> FloatArray:
    """(n, 3, 3) map of a settling contact's position error: soon whole along the normal, later across it."""
    normal = np.outer(contact.normal, contact.normal)
    # How much sooner a settling contact is down on its surface than at its place.
    down = np.clip(10.0 * share, LEAST_SETTLED, 1.0)[:, None, None]
    return down * normal + np.maximum(share, LEAST_SETTLED)[:, None, None] * (np.eye(3) - normal)


LEAST_SETTLED = 0.01
"""Importance of the place along the surface at the touch-down of a contact that settles."""

ALMOST = 1.0 - 1e-9
"""Weight of what matters fully but is not required exactly."""

FLIGHT_POSITION_WEIGHT, FLIGHT_ROTATION_WEIGHT, POINT_FLIGHT_WEIGHT = 0.1, 0.05, 0.3
"""Importance of an effector's position in the middle of a flight, and of its orientation there: a hint, so
that the ankle may follow the shank; and of the position of what touches in a point, as a knee, for which no
orientation keeps what is beside it off the ground."""

GRASP_ROTATION_WEIGHT, POINT_ROTATION_WEIGHT = 0.03, 0.2
"""Importance of a grasping hand's orientation: a hint, for a grasp holds a point; and of the orientation of a
point contact, whose segment does not end in a point: what is upright lands and stays without rolling."""

POSITION_RAMP, ROTATION_RAMP, LEAVING_RAMP, LONG_FLIGHT = 0.2, 0.12, 0.04, 1.0
"""Longest time near the ends of a flight in which the position matters more, before a landing in which the
orientation does, and after a lift-off, where the foot may roll off at once; the ends of a flight shorter than
the last are a quarter of it each [s]."""


def _reach_weight(share: FloatArray, ramp: float) -> FloatArray:
    """Importance from a free end (0) to the contact (1): none, then that of a flight, then full."""
    blend = np.clip(share / 0.75, 0.0, 1.0)
    rising = blend**2 * (3.0 - 2.0 * blend)
    return rising * flight_weight(np.maximum(share, 0.5), FLIGHT_POSITION_WEIGHT, ramp, ramp)


def flight_weight(share: FloatArray, middle: float, leaving: float, landing: float) -> FloatArray:
    """Importance during a flight: full at its ends, so that contacts are left and met well."""
    blend = np.clip(np.minimum(share / leaving, (1.0 - share) / landing), 0.0, 1.0)
    inside = ALMOST - (1.0 - middle) * blend**2 * (3.0 - 2.0 * blend)
    return np.where(blend > 0.0, inside, 1.0)


NEAR_CONTACT, NEAR_CHANGE = 0.35, 0.1
"""Time before its first contact in which an effector that was free may come close to it, and that before and
after a contact of a limb that carries with another effector besides, which comes straight down [s]."""


def ignored_pairs(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray
) -> tuple[Ignored, ...]:
    """Segments that may touch an obstacle at each time: those on, leaving or reaching a support."""
    sequence, landing = schedule.sequence, list[tuple[Ignored, NDArray[np.bool_]]]()
    per_phase = [
        frozenset[tuple[str, str]]().union(*(touch_pairs(body, scene, contact) for contact in phase.stance))
        for phase in sequence
    ]
    for swing in sequence.swings():
        hanging, (begin, end) = hangs(body, swing.effector), schedule.swing_interval(swing)
        flies = (swing.end is None and not hanging) or (hanging and None not in (swing.start, swing.end))
        early = NEAR_CONTACT if hanging else SITTING_DOWN
        if hanging and carries_elsewhere(body, schedule, swing):
            flies, early = False, NEAR_CHANGE
        if hanging and swing.start is not None and not flies:
            rows = (time >= begin) & (time < begin + early)
            landing.append((touch_pairs(body, scene, swing.start), rows))
        if swing.end is not None and not flies:
            landing.append((touch_pairs(body, scene, swing.end), (time >= end - early) & (time < end)))
        if not flies:
            continue
        for contact in filter(None, (swing.start, swing.end)):
            for index in range(swing.first_phase, swing.last_phase + 1):
                per_phase[index] |= touch_pairs(body, scene, contact)
    return with_pairs([per_phase[index] for index in schedule.phase_at(time)], landing)


LOW, TOUCHING, RISING = 4.0e-3, 8.0e-3, 0.3
"""Distance that a foot in flight keeps at least from what it leaves and reaches, and depth that is allowed at
the contact itself, where places alone decide [m]; share of the flight in which one becomes the other."""


@dataclass(frozen=True, eq=False)
class KeptDistances:
    """Distances that pairs keep although they may touch: feet in flight, and what is held at a point.

    Attributes:
        entries: For each group of pairs of segment and obstacle that share one, the distance (n,) that is
            wanted at each sample [m]; infinite where none is.
    """

    entries: tuple[tuple[Ignored, FloatArray], ...]

    @classmethod
    def of(
        cls, body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray,
        padded: Ignored = frozenset(),
    ) -> "KeptDistances":  # fmt: skip
        """Those of flights between soles, and of :meth:`of_points`, at times (n,) [s]."""
        ends = list(cls.of_points(body, scene, schedule, time, padded).entries)
        for swing in schedule.sequence.swings():
            if swing.start is None or swing.end is None or not hangs(body, swing.effector):
                continue
            if {swing.start.kind, swing.end.kind} != {ContactKind.SOLE}:
                continue
            if carries_elsewhere(body, schedule, swing):  # its knee carries; it keeps off like anything else
                continue
            start, end = schedule.swing_interval(swing)
            for contact, gone in ((swing.start, time - start), (swing.end, end - time)):
                share = np.clip(gone / (RISING * (end - start)), 0.0, 1.0)
                wanted = share**2 * (3.0 - 2.0 * share) * (LOW + TOUCHING) - TOUCHING
                wanted[(time < start) | (time >= end)] = np.inf
                ends.append((touch_pairs(body, scene, contact), wanted))
        return cls(tuple(ends))

    @classmethod
    def of_points(
        cls, body: BodyModel, scene: Scene, schedule: ContactSchedule, time: FloatArray,
        padded: Ignored = frozenset(),
    ) -> "KeptDistances":  # fmt: skip
        """Those of contacts at a point while they are held, such as the heel of a hand below its palm.

        The segments that touch go at most 4 mm into what they touch. It is asked of those that end before
        their point; a palm that touches with its middle would have to lie flat. Nothing is kept of ``padded``
        pairs.
        """
        held, phases = dict[Ignored, FloatArray](), schedule.phase_at(time)
        for number, phase in enumerate(schedule.sequence):
            for contact in phase.stance:
                if contact.kind is ContactKind.POINT and ends_before_tip(body, contact.effector):
                    pairs = touch_pairs(body, scene, contact) - padded
                    wanted = held.setdefault(pairs, np.full(len(time), np.inf))
                    wanted[phases == number] = SINKING
        return cls(tuple((pairs, wanted) for pairs, wanted in held.items() if pairs))

    def without(self, ignored: Sequence[Ignored]) -> tuple[Ignored, ...]:
        """The pairs that are ignored at each sample, but for those that keep a distance there."""
        if not self.entries:
            return tuple(ignored)

        @cache
        def apart(found: Ignored, *counting: bool) -> Ignored:
            return found.difference(*(self.entries[k][0] for k, counts in enumerate(counting) if counts))

        counting = np.isfinite([wanted for _, wanted in self.entries]).T.tolist()
        return tuple(apart(found, *row) for found, row in zip(ignored, counting, strict=True))

    def wanted(self, found: ProximitySamples, safe: ArrayLike) -> FloatArray:
        """(k,) wanted distances of close pairs, ``safe``, one or (k,), of all others [m]."""
        wanted, distinct = np.full(len(found.distance), safe), list(dict.fromkeys(found.pairs))
        numbers = {pair: number for number, pair in enumerate(distinct)}
        number = np.array([numbers[pair] for pair in found.pairs], dtype=np.int64)
        for pairs, distance in self.entries:
            rows = ~considered(distinct, pairs)[number]
            wanted[rows] = np.minimum(wanted[rows], distance[found.sample[rows]])
        return wanted
