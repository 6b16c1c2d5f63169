"""A curve for every flight of a motion: smooth curves first, the Bi-RRT where they fail.

Key postures of a contact plan get further postures along such curves.  Joined by lines they drag an effector
through what it leaves, reaches or passes, and an optimisation that pushes it out may as well swing the limb
aside as bend it, or be caught on the wrong side.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from manikin.body import BodyModel, Configuration
from manikin.body.limbs import end_segments, hangs
from manikin.contact import Contact, ContactKind, ContactSchedule, Stance, Swing
from manikin.kinematics import Placement, PostureProblem, SolverSettings, generate_posture, touching_pairs
from manikin.numerics.spatial import FloatArray
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body.birrt import Feasible
from manikin.planning.whole_body.fit_scales import RefineScales
from manikin.planning.whole_body.foot_roll import FootRoll, foot_roll
from manikin.planning.whole_body.refine_input import KeyPath
from manikin.planning.whole_body.swing import HEIGHTS, LATERALS, SwingLimits, plan_swing
from manikin.planning.whole_body.swing_curve import SwingCurve
from manikin.planning.whole_body.swing_path import EffectorClearance, FlightClearance, Nearness, Pose
from manikin.planning.whole_body.swing_search import ClearFlight, PostureCheck, search_swing
from manikin.scene import Proximity, Scene

SHARES, BETWEEN = (0.25, 0.5, 0.75), (0.125, 0.375, 0.625, 0.875)
"""Shares of a flight at which a posture is looked for, and those at which one is where the way between two of
them is not clear; our choice."""

KEPT = (0.75, 0.25)
"""Shares of the wanted distance that they keep from everything that is not touched, tried in turn."""

WATCHED = 25
"""Instants of a flight at which the path with and without one of them is measured."""

ROOM = 0.01
"""Distance that such a way keeps in addition, so that rounding its corners stays clear [m]."""


RANDOM_POINTS = 600
"""Random points of a search."""


def with_mid_flights(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, path: KeyPath, padded: Sequence[str] = (), *,
    dense: bool = False,
) -> KeyPath:  # fmt: skip
    """Add postures along a clear curve inside each flight from a contact to another one.

    Args:
        path: Key configurations at least at both ends of each flight.
        padded: Obstacles that any part of the body may lean on.
        dense: Whether more are added where the way between two is not clear; they are not eased, so that a
            body that does not rest in between may be too weak for them.

    Returns:
        The path with the postures that were found, but for those with which the body would go deeper into
        itself or an obstacle on the way to them.
    """
    proximity = Proximity(body, scene)
    # Spacing of the instants at which a curve is checked [s]: it is a beginning, not the motion.
    limits = SwingLimits(clearance=RefineScales.of(body).safe_distance, time_step=0.02)
    for swing in schedule.sequence.swings():
        flight = _clear_flight(body, scene, schedule, path, swing, limits)
        if flight is None:
            continue
        curve, is_clear = flight
        standing, ends = standing_during(schedule, swing), filter(None, (swing.start, swing.end))
        touched, beside = (
            leaning_pairs(body, padded).union(*(touch_pairs(body, scene, item) for item in contacts))
            for contacts in (standing, (*standing, *ends))
        )
        during = np.linspace(*schedule.swing_interval(swing), WATCHED)
        clear = proximity.minimum_over(path.at(during), beside).distance
        for share in (*SHARES, *BETWEEN) if dense else SHARES:
            time = curve.start_time + share * curve.duration
            guess = path.at(np.array([time]))[0]
            passes = share in BETWEEN and is_clear(time, Pose.in_posture(body, guess, swing.effector))
            if passes and proximity.minimum_over(guess[None], (beside,)).distance > 0.0:
                continue
            stance, effector = schedule.stance_at(time), swing.effector
            kept = KEPT if dense else KEPT[:1]
            q = _posture_on(body, proximity, curve.at(time), effector, stance, guess, touched, kept)
            if q is None:
                continue
            longer = path.through(time, q)
            then = proximity.minimum_over(longer.at(during), beside).distance
            if then >= min(clear, 0.0):
                path, clear = longer, then
    return path


def _posture_on(
    body: BodyModel, proximity: Proximity, pose: Pose, effector: str, stance: Stance, guess: FloatArray,
    touched: frozenset[tuple[str, str]], shares: Sequence[float],
) -> FloatArray | None:  # fmt: skip
    """(nq,) posture with an effector in flight near a pose on its curve, or None."""
    com, distance = Configuration(body, guess).com, RefineScales.of(body).safe_distance
    for kept in shares:
        problem = PostureProblem(
            body, tuple(stance), {effector: Placement(pose.position, pose.rotation, 0.3)},
            # The effector's attitude and a centre of mass between those at both ends are wished.
            com=np.array([com[0], com[1], np.nan]), com_weight=30.0,
            proximity=proximity, clearance=kept * distance, ignore=touched, reference=guess,
        )  # fmt: skip
        # A flight without such a posture needs no reason, and a guess no exact contacts.
        found = generate_posture(problem, guess, settings=SolverSettings(tolerance=1e-3, explain=False))
        if found.succeeded:
            return found.q
    return None


def _clear_flight(
    body: BodyModel, scene: Scene, schedule: ContactSchedule, path: KeyPath, swing: Swing, limits: SwingLimits
) -> tuple[SwingCurve, ClearFlight] | None:
    """A curve of the effector that keeps off everything, and the test of a path; None where none is needed.

    None too where there is no such curve.
    """
    if swing.start is None or swing.end is None or not hangs(body, swing.effector):
        return None
    interval = schedule.swing_interval(swing)
    # A flight that is clear already at these instants needs no curve.
    times = np.linspace(*interval, 13)
    given = path.at(times)
    coms = np.array([Configuration(body, q).com for q in given])

    def com(_: Contact, time: FloatArray) -> FloatArray:
        return np.stack([np.interp(time, times, column) for column in coms.T], axis=-1)

    clearance = EffectorClearance(body, scene, swing.effector, standing_during(schedule, swing), com)
    ends = Pose.of(swing.start), Pose.of(swing.end)
    # Distance that a given path has to gain per metre from a contact to count as clear.
    is_clear = ClearFlight(clearance, ends, interval, replace(limits, departure=0.1))
    between = zip(times[1:-1].tolist(), given[1:-1], strict=True)
    if all(is_clear(time, Pose.in_posture(body, q, swing.effector)) for time, q in between):
        return None
    plan = plan_swing(
        *ends, *interval, clearance, limits=limits, start_normal=swing.start.normal,
        end_normal=swing.end.normal,
    )  # fmt: skip
    if plan.succeeded:
        return plan.curve, is_clear

    def check(extra: float) -> Feasible:
        room = ClearFlight(clearance, ends, interval, limits, extra)
        return lambda pose, time, _: room(time, pose) or None

    # The Bi-RRT asks for a clear effector only; its draws are always the same, and its flights slower.
    rng, slower = np.random.default_rng(0), replace(limits, speed=2.0, angular_speed=5.0)
    found = search_swing(
        *ends, *interval, check(0.0), rng, roomy=check(ROOM), limits=slower, iterations=RANDOM_POINTS
    )  # fmt: skip
    return None if found.curve is None else (found.curve, is_clear)


REACHING_TIME = 0.7
"""A free hand begins to reach for its grasp this long before [s], and is put away as slowly."""

PASSED, IN_LINE, LEVEL = 0.1, 0.06, 0.6
"""Flights shorter than this along the level pass by nothing; what stands this near to the straight way may be
passed on either side; standing limbs this much higher or lower than a lift-off are not passed by [m]."""

HINGE_TIMES = 9
"""Instants of a flight at which the hinges of standing limbs are looked up."""

ROLLING_HEIGHTS = (0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, *HEIGHTS[1:])
"""Apex heights of the point about which a rolling foot tilts: the ankle is lifted by the tilt already [m]."""


@dataclass(frozen=True, eq=False)
class PlannedSwing:
    """A flight and the curve found for it.

    Attributes:
        method: ``"smooth"``, ``"bi-rrt"``, or ``"reach"`` for an effector that is free at one end.
        failure: None, or what the best attempt does not keep.
        roll: How the foot pitches; the curve is then that of the point it tilts about.
        searched: Whether the Bi-RRT has been asked.
    """

    swing: Swing
    curve: SwingCurve
    method: str
    failure: str | None = None
    roll: FootRoll | None = None
    searched: bool = False

    @property
    def interval(self) -> tuple[float, float]:
        """First and last instant of the curve [s]: the whole flight unless one end is free."""
        return self.curve.start_time, self.curve.end_time


class FlightPlanner:
    """Plans the flights of one motion.

    Args:
        reference: (time) -> (nq,) preferred posture, for the posture checks.
    """

    def __init__(
        self, body: BodyModel, scene: Scene, trajectory: CentroidalTrajectory, limits: SwingLimits,
        rng: np.random.Generator, reference: Callable[[float], FloatArray],
    ) -> None:  # fmt: skip
        self._body, self._scene, self._trajectory = body, scene, trajectory
        self._limits, self._rng, self._reference = limits, rng, reference
        self.schedule, self._proximity = trajectory.schedule, Proximity(body, scene)
        self._touching = cache(partial(touch_pairs, body, scene))
        self.plan = cache(self._planned)

    @cached_property
    def flights(self) -> tuple[Swing, ...]:
        """Every flight from a contact or to one; the trunk is not flown.

        A foot whose knee carries in between is put away and reached with, on its own each. Its knee has no
        curve: under a thigh that stands on it there is no way straight up.
        """
        found: list[Swing] = []
        for swing in self.schedule.sequence.swings():
            if not hangs(self._body, swing.effector):
                continue
            if not carries_elsewhere(self._body, self.schedule, swing):
                found.append(swing)
                continue
            ends = replace(swing, end=None), replace(swing, start=None)
            contacts = (swing.start, swing.end)
            found += [
                part
                for part, contact in zip(ends, contacts, strict=True)
                if contact is not None and not rolls_on_point(contact)
            ]
        return tuple(found)

    def _planned(self, swing: Swing) -> PlannedSwing:
        """Find a smooth curve, or else search one."""
        if swing.start is None or swing.end is None:
            return self._reach(swing)
        start, end = self.schedule.swing_interval(swing)
        roll = foot_roll(self._body, self.schedule, swing)
        ends, clearance, limits = self._way(swing, roll)
        heights, pitch = (HEIGHTS, self._pitch(swing, start)) if roll is None else (ROLLING_HEIGHTS, 0.0)
        plan = plan_swing(
            *ends, start, end, clearance, limits=limits, start_normal=swing.start.normal,
            end_normal=swing.end.normal, pitch=pitch, heights=heights, laterals=self._laterals(swing),
        )  # fmt: skip
        smooth = PlannedSwing(swing, plan.curve, "smooth", plan.failure, roll)
        # One that is a little nearer or faster than wanted may do: the fit has the last word.
        return smooth if plan.succeeded or plan.clearance >= 0.0 else self.search(swing, smooth)

    def _way(
        self, swing: Swing, roll: FootRoll | None
    ) -> tuple[tuple[Pose, Pose], FlightClearance, SwingLimits]:
        """Poses at both ends of a flight, the clearance of a pose, and limits; of the pivot of a roll."""
        assert swing.start is not None
        assert swing.end is not None
        if roll is not None:
            # Relative to a level foot: people lift their toes by 1.5 cm, and the foot turns before it rises.
            gained = 0.6 * self._limits.clearance, 0.4 * self._limits.departure
            limits = replace(self._limits, clearance=gained[0], departure=gained[1])
            return roll.pivots, self._rolling_clearance(swing, roll), limits
        # A knee or wrist turns about its point as it goes.
        factor = 2.0 if rolls_on_point(swing.start) else 1.0
        limits = replace(self._limits, clearance=factor * self._limits.clearance)
        return (Pose.of(swing.start), Pose.of(swing.end)), self._clearance(swing), limits

    def _reach(self, swing: Swing) -> PlannedSwing:
        """Curve between a contact, where alone it must be kept, and the effector in the preferred posture."""
        start, end = self.schedule.swing_interval(swing)
        near, longest, changes = swing, REACHING_TIME, carries_elsewhere(self._body, self.schedule, swing)
        if changes:
            # A limb that changes from one contact to another need not rise above both ends. It is put away in
            # one half of the phase in which it flies and reached with in the other, past what stands then.
            phase = swing.last_phase if swing.start is None else swing.first_phase
            near = replace(swing, first_phase=phase, last_phase=phase)
            longest = min(longest, 0.5 * float(np.diff(self.schedule.instants[phase : phase + 2])[0]))
        if swing.start is None:
            start = max(start, end - longest)
        else:
            end = min(end, start + longest)
        contact = swing.end or swing.start
        assert contact is not None
        first, last = (
            Pose.of(held) if held else Pose.in_posture(self._body, self._reference(time), swing.effector)
            for held, time in ((swing.start, start), (swing.end, end))
        )
        plan = plan_swing(
            first, last, start, end, self._clearance(near), limits=self._limits, refine=0,
            start_normal=contact.normal, end_normal=contact.normal, heights=(0.0,) * changes + HEIGHTS,
        )  # fmt: skip
        return PlannedSwing(swing, plan.curve, "reach")

    def _rolling_clearance(self, swing: Swing, roll: FootRoll) -> FlightClearance:
        """Clearance of the foot from the pose of the point about which it tilts."""
        distance = self._clearance(swing, roll.toe_extension)

        def clearance(
            time: FloatArray, position: FloatArray, rotation: FloatArray, within: ArrayLike = np.inf
        ) -> Nearness:
            # The foot moves as its pivot does: so does its gradient.
            return distance(time, *roll.pose(position, rotation, time), within)

        return clearance

    def search(self, swing: Swing, fallback: PlannedSwing) -> PlannedSwing:
        """Search a curve with the Bi-RRT; ``fallback`` when there is none, with whose roll it is.

        A foot that lies flat at its ends must have postures on its way; a roll is kept clear alone.
        """
        times, roll = self.schedule.swing_interval(swing), fallback.roll
        ends, clearance, limits = self._way(swing, roll)
        limits = limits if roll is not None else self._limits

        def check(extra: float) -> Feasible:
            screen = ClearFlight(clearance, ends, times, limits, extra)
            if roll is not None:
                return lambda pose, time, _: screen(time, pose) or None
            return PostureCheck(swing.effector, partial(self._problem, swing), screen, rotation_weight=0.3)

        found = search_swing(
            *ends, *times, check(0.0), self._rng, roomy=check(ROOM), limits=limits, iterations=RANDOM_POINTS
        )
        if found.curve is None:
            reason = f"{fallback.failure or 'the smooth curve failed'}; Bi-RRT: {found.failure}"
            return replace(fallback, failure=reason, searched=True)
        return PlannedSwing(swing, found.curve, "bi-rrt", roll=roll, searched=True)

    def _laterals(self, swing: Swing) -> tuple[float, ...]:
        """Offsets with which the limb does not pass round the far side of one that stands beside its way."""
        assert swing.start is not None
        assert swing.end is not None
        along = (swing.end.position - swing.start.position)[:2]
        length = float(np.linalg.norm(along))
        if length < PASSED:
            return LATERALS
        along, most, least = along / length, np.inf, -np.inf
        for contact in standing_during(self.schedule, swing):
            away = contact.position - swing.start.position
            far, left = float(along @ away[:2]), float(along[0] * away[1] - along[1] * away[0])
            beside = 0.0 < far < length and abs(left) > IN_LINE and abs(away[2]) < LEVEL
            if beside and hangs(self._body, contact.effector):
                most = min(most, left) if left > 0.0 else most
                least = max(least, left) if left < 0.0 else least
        return tuple(lateral for lateral in LATERALS if lateral == 0.0 or least < 2.0 * lateral < most)

    def _pitch(self, swing: Swing, lift_off: float) -> float:
        """Turn the toes down where the foot is left far behind: a level foot has no posture there [rad].

        A knee or wrist is left as it is: it turns as it likes.
        """
        assert swing.start is not None
        if rolls_on_point(swing.start):
            return 0.0
        yaw, away = swing.start.yaw, self._trajectory.position(lift_off) - swing.start.position
        behind = float(np.cos(yaw) * away[0] + np.sin(yaw) * away[1])
        # Toes turn down [rad/m] where the foot is further behind the centre of mass than 0.08 m.
        return float(np.clip(3.0 * (behind - 0.08), 0.0, 0.9))

    def _clearance(
        self, swing: Swing, bend: Callable[[FloatArray], FloatArray] | None = None
    ) -> EffectorClearance:
        standing = standing_during(self.schedule, swing)
        towards = self._towards(swing, standing)
        return EffectorClearance(self._body, self._scene, swing.effector, standing, towards, bend)

    def _towards(
        self, swing: Swing, standing: Sequence[Contact]
    ) -> Callable[[Contact, FloatArray], FloatArray]:
        """Where the limbs above standing contacts point to: to the centre of mass, as legs of who walks do.

        A thigh that kneels and a limb on its tip point to where they are hinged in the preferred posture.
        """
        pointed = {contact.effector for contact in standing if rolls_on_point(contact)}
        times = np.linspace(*self.schedule.swing_interval(swing), HINGE_TIMES if pointed else 0)
        states = [Configuration(self._body, self._reference(time)) for time in times.tolist()]
        hinges = dict[str, FloatArray]()
        for name in pointed:
            above = self._body.segment(self._body.effector(name).segment).parent
            if above is not None:
                hinges[name] = np.array([state.segment_placement(above)[1] for state in states])

        def towards(contact: Contact, time: FloatArray) -> FloatArray:
            places = hinges.get(contact.effector)
            if places is None:
                return self._trajectory.position(time)
            return np.stack([np.interp(time, times, column) for column in places.T], axis=-1)

        return towards

    def _problem(self, swing: Swing, time: float) -> PostureProblem:
        others = tuple(item for item in self.schedule.stance_at(time) if item.effector != swing.effector)
        touching = [*others, *(contact for contact in (swing.start, swing.end) if contact is not None)]
        return PostureProblem(
            self._body, others, com=self._trajectory.position(time), proximity=self._proximity,
            ignore=frozenset().union(*(self._touching(item) for item in touching)),
            reference=self._reference(time),
        )  # fmt: skip


def rolls_on_point(contact: Contact) -> bool:
    """Whether a contact leaves its effector free to turn: a knee, a wrist or a tip, but no flat palm."""
    return contact.kind is ContactKind.POINT and not contact.effector.endswith("hand")


def carries_elsewhere(body: BodyModel, schedule: ContactSchedule, swing: Swing) -> bool:
    """Whether another effector of the same limb is in contact during a flight."""
    phases = schedule.sequence.phases[swing.first_phase : swing.last_phase + 1]
    model, others = body.pinocchio, {name for phase in phases for name in phase.stance.effectors}
    own = model.frames[body.effector_frame(swing.effector)].parentJoint
    joints = [model.frames[body.effector_frame(name)].parentJoint for name in others if hangs(body, name)]
    return any(own in model.supports[joint] or joint in model.supports[own] for joint in joints)


def standing_during(schedule: ContactSchedule, swing: Swing) -> tuple[Contact, ...]:
    """Every contact held at some time of a flight."""
    phases = (schedule.sequence[index] for index in range(swing.first_phase, swing.last_phase + 1))
    held = (contact for phase in phases for contact in phase.stance)
    return tuple({(contact.effector, contact.position.tobytes()): contact for contact in held}.values())


def leaning_pairs(body: BodyModel, padded: Sequence[str]) -> frozenset[tuple[str, str]]:
    """Pairs of every segment with every obstacle that any part of the body may lean on."""
    return frozenset((segment.name, name) for segment in body.segments for name in padded)


def touch_pairs(body: BodyModel, scene: Scene, contact: Contact) -> frozenset[tuple[str, str]]:
    """Pairs of segment and obstacle that a contact brings together; thighs lie on a seat as buttocks do.

    What slides to its place touches with its own segment alone.
    """
    touched = scene.touched_obstacles(contact, tolerance=0.02)
    if contact.settle > 0.0:
        return frozenset(product(end_segments(body, contact.effector), touched))
    return touching_pairs(body, [(contact.effector, obstacle) for obstacle in touched])
