"""Postures that guide the whole-body fit, and the style that they keep where the task leaves freedom.

At the key instants and every fraction of a second between them the posture generator finds a collision-free
posture on the contacts, the swings and the centre of mass.  Like the key postures of [Qiu2012]_ 7.2.3 they
tell, before the motion is fitted, whether it can be done, and they are what the fitted motion stays near.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from operator import itemgetter
from types import MappingProxyType

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from manikin.body import BodyModel
from manikin.body.configuration import Configuration, difference, interpolate
from manikin.body.limbs import end_segments
from manikin.contact import Contact, ContactKind, ContactSchedule, SolePart
from manikin.errors import InputError
from manikin.kinematics import (
    Placement,
    PostureProblem,
    PostureResult,
    Preferences,
    SolverSettings,
    generate_posture,
)
from manikin.motion.configuration_spline import align_quaternions
from manikin.numerics.spatial import FloatArray, rotation_from_quaternion
from manikin.planning.com import CentroidalTrajectory
from manikin.planning.whole_body.fit_targets import EffectorTarget, settled_share
from manikin.planning.whole_body.sliding_touchdown import Ignored
from manikin.planning.whole_body.swing_planner import rolls_on_point
from manikin.scene import Proximity
from manikin.scene.distance import segment_of


@dataclass(frozen=True, eq=False)
class Guide:
    """Guide postures.

    Attributes:
        time: (k,) [s].
        configurations: (k, nq), quaternions in one half-space.
        failures: Time [s] and reason of the postures that could not be found exactly; their best attempts are
            used.
        rates: (k, nq) derivatives, between which it is smooth in time; None where it is linear.
    """

    time: FloatArray
    configurations: FloatArray
    failures: tuple[tuple[float, str], ...]
    rates: FloatArray | None = None

    def at(self, time: FloatArray) -> FloatArray:
        """(n, nq) interpolation; quaternions are normalised."""
        if self.rates is None:
            rows = np.stack([np.interp(time, self.time, column) for column in self.configurations.T], axis=1)
        else:
            rows = CubicHermiteSpline(self.time, self.configurations, self.rates)(
                np.clip(time, self.time[0], self.time[-1])
            )
        rows[:, 3:7] /= np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
        return rows

    def resting(self, instants: FloatArray) -> "Guide":
        """The same, smooth and without overshoot (PCHIP), at rest at some of its times [s].

        On a line in time a body would stop dead at each rest.
        """
        rates = PchipInterpolator(self.time, self.configurations).derivative()(self.time)
        rates[np.isin(self.time, instants)] = 0.0
        return replace(self, rates=rates)

    def retimed(self, before: FloatArray, after: FloatArray) -> "Guide":
        """The same at other times: ``before`` (k,) becomes ``after`` (k,), linear in between [s]."""
        return replace(self, time=np.interp(self.time, before, after))._smooth_again()

    def through(self, instant: float, posture: FloatArray) -> "Guide":
        """The same with another posture (nq,) at one of its times [s]."""
        rows = np.isclose(self.time, instant)[:, None]
        postures = align_quaternions(np.where(rows, posture, self.configurations))
        return replace(self, configurations=postures)._smooth_again()

    def _smooth_again(self) -> "Guide":
        """The same with rates of its own times and postures, at rest where it was."""
        return self if self.rates is None else self.resting(self.time[~self.rates.any(axis=1)])

    @classmethod
    def joined(cls, parts: "Sequence[Guide]") -> "Guide":
        """Guides one after the other."""
        postures = align_quaternions(np.concatenate([part.configurations for part in parts]))
        failures = tuple(failure for part in parts for failure in part.failures)
        return cls(np.concatenate([part.time for part in parts]), postures, failures)


def plan_guide(
    body: BodyModel, proximity: Proximity, schedule: ContactSchedule, time: FloatArray,
    effectors: dict[str, EffectorTarget], com: FloatArray, ignored: tuple[Ignored, ...],
    reference: FloatArray, clearance: float, manner: "PostureStyle", exact: Sequence[int], restarts: bool,
) -> Guide:  # fmt: skip
    """Find a posture at each time, each one starting from the one before.

    Args:
        time: (k,) [s].
        effectors: Targets at these times.
        com: (k, 3) centre of mass [m]; NaN leaves it free.
        ignored: Pairs that may touch, per time.
        reference: (k, nq) preferred postures, the first of which starts the search.
        clearance: Wanted distance to everything [m].
        manner: What the postures should look like.
        exact: Joints that keep to the reference whatever the posture before.
        restarts: Whether a posture that is not found from the one before is sought from others as well.
    """
    crawls = any(rolls_on_point(contact) for phase in schedule.sequence for contact in phase.stance)
    preferences = manner.preferences
    creeping = replace(preferences, pelvis=0.0, trunk=0.0, head=0.0, arms=0.0)
    q, exactly = reference[0], [7 + joint for joint in exact]
    found, failures, touched = list[FloatArray](), list[tuple[float, str]](), dict[str, FloatArray]()
    settings = SolverSettings(tolerance=1e-4, clearance_tolerance=2e-3, explain=False, restarts=restarts)
    for k, instant in enumerate(time.tolist()):
        contacts, placements = _requirements(body, schedule, instant, effectors, k, q, touched)
        # Half way to the posture before: neighbouring postures must not jump.
        wanted = np.array(reference[k])
        if k > 0:
            wanted[7:] = 0.5 * (reference[k][7:] + q[7:])
            wanted[exactly] = reference[k][exactly]
        lies = crawls and rotation_from_quaternion(reference[k : k + 1, 3:7])[0, 2, 2] < LYING
        distance, likes = (NEAR * clearance, creeping) if lies else (clearance, preferences)
        problem = PostureProblem(
            body, contacts, placements, com=com[k], proximity=proximity, clearance=distance,
            self_clearance=distance, ignore=ignored[k] | fixed_pairs(body, proximity, contacts),
            reference=wanted, preferences=likes,
        )  # fmt: skip
        flying = [name for name in placements if effectors[name].weight[k] < 1.0]
        # In flight an effector need not pass exactly where its curve does: weight of its place [1/m^2].
        loose = placements | {name: replace(placements[name], position_weight=100.0) for name in flying}
        near = replace(problem, clearance=NEAR * distance)
        ways = (problem, near, replace(near, placements=loose))[: 3 if flying else 2]
        # How far apart two postures are is not told by joints that follow the reference in any of them.
        before = np.array(q)
        before[exactly] = reference[k][exactly]
        result = _guide_posture(ways, before, settings, reference[k], manner)
        if not result.succeeded:
            failures.append((instant, result.failure or "posture not found"))
        q = result.q
        found.append(q)
    return Guide(np.asarray(time), align_quaternions(np.array(found)), tuple(failures))


def _guide_posture(
    ways: Sequence[PostureProblem], before: FloatArray, settings: SolverSettings, preferred: FloatArray,
    manner: "PostureStyle",
) -> PostureResult:  # fmt: skip
    """First posture that is near to the preferred one and to the one before, or else the nearest.

    It is sought by several problems, each from the posture before and from the preferred one: from a trunk
    that is bent the next one is found bent, whether it has to be or not. No part of the body goes through
    anything on the way from the posture before, if that can be had.
    """
    body, shares = ways[0].body, np.linspace(0.0, 1.0, 5)[1:-1]

    def order(result: PostureResult) -> tuple[bool, bool, float]:
        between = np.array([interpolate(body, before, result.q, share) for share in shares])
        assert ways[0].proximity is not None
        depth = ways[0].proximity.minimum_over(between, ways[0].ignore).distance
        apart = sum(manner.strain(body, near, result.q) for near in (preferred, before))
        return not result.succeeded, depth < -THROUGH, apart

    found = list[tuple[tuple[bool, bool, float], PostureResult]]()
    for problem, start in product(ways, (before, preferred)):
        result = generate_posture(problem, start, settings=settings)
        found.append((order(result), result))
        if found[-1][0] < (False, False, FAR + NEXT):
            return result
    return min(found, key=itemgetter(0))[1]


FAR, NEXT, THROUGH = 3.0, 1.0, 5.0e-3
"""Distances from the preferred posture and from the one before, in scales of the manner, beyond whose sum
another one is sought; depth to which a part of the body may go into something half way from one posture to
the next [m]; our choice."""

LYING, NEAR = 0.7, 0.5
"""Cosine of the pelvis' tilt from which on a body creeps, without upright trunk, level head and hanging arms,
and near to the ground: share of the wanted distance that its guide postures keep then; our choice."""


def fixed_pairs(body: BodyModel, proximity: Proximity, contacts: Sequence[Contact]) -> Ignored:
    """Pairs whose distance the contacts decide: whole soles with obstacles, and with each other.

    No posture changes it. Contacts are chosen with less of it than postures keep elsewhere; where it is asked
    for all the same, the search bends the rest of the body in vain.
    """
    soles = [c for c in contacts if c.kind is ContactKind.SOLE and c.part is SolePart.FULL]
    still = {segment for sole in soles for segment in end_segments(body, sole.effector)}
    moving = {segment.name for segment in body.segments} - still
    pairs = {(segment_of(first), segment_of(second)) for first, second in proximity.pairs}
    return frozenset(pair for pair in pairs if still.intersection(pair) and moving.isdisjoint(pair))


def _requirements(
    body: BodyModel, schedule: ContactSchedule, time: float, effectors: dict[str, EffectorTarget], k: int,
    q: FloatArray, touched: dict[str, FloatArray],
) -> tuple[tuple[Contact, ...], dict[str, Placement]]:  # fmt: skip
    """Contacts, and places of flying effectors and of contacts that settle, on their way from their touch.

    Args:
        q: (nq,) posture before.
        touched: Where each of the latter touched, kept from posture to posture [m].
    """
    phase, placements = int(schedule.phase_at(time)), dict[str, Placement]()
    settling = {name for name in schedule.sequence.effectors if schedule.settling(time, name)[0]}
    stance = schedule.sequence[phase].stance
    held = tuple(
        contact for contact in stance
        if (contact.part is SolePart.FULL or contact.rolls) and contact.effector not in settling
    )  # fmt: skip
    busy = settling.union(contact.effector for contact in held)
    for name, target in effectors.items():
        # Targets of less importance than this are left to the fit.
        if name not in busy and target.weight[k] >= 0.05:
            turn = target.rotation[k] if target.rotation_weight[k] > 0.5 else None
            placements[name] = Placement(target.position[k], turn)
    for contact in stance:
        name = contact.effector
        if name in settling:
            if name not in touched:
                touched[name] = Configuration(body, q).effector_placement(name)[1]
            start, share = touched[name], settled_share(schedule, phase, contact, np.array([time]))[0]
            # Weight of the orientation of a settling contact [1/rad^2].
            place = start + float(share) * (contact.position - start)
            placements[name] = Placement(place, contact.rotation_contact_to_world, rotation_weight=10.0)
    return held, placements


@dataclass(frozen=True, eq=False)
class PostureStyle:
    """Preferred posture and how firmly each joint keeps to it; all numbers are our choice.

    Attributes:
        angles: Joint angles that differ from the standing posture, by a part of the joint's name [rad].
        scales: Deviation of a joint from its preferred angle that costs one unit, by a part of
            the joint's name [rad].
        trunk_scale: The same of the pelvis' orientation [rad].
        arm_swing: Flexion of a shoulder per metre that the other side's foot is ahead [rad/m].
        moment_factor: How much more angular momentum than usual the limbs may carry without the
            trunk or the arms making up for it (:attr:`FitScales.moment_share` times this).
        preferences: Of the guide postures.
    """

    name: str
    angles: Mapping[str, float]
    scales: Mapping[str, float]
    trunk_scale: float = 0.3
    arm_swing: float = 0.0
    moment_factor: float = 1.0
    preferences: Preferences = field(default_factory=Preferences)

    def posture(self, body: BodyModel) -> FloatArray:
        """(nq,) standing posture with the preferred angles."""
        q = np.array(body.standing_posture())
        for index, name in enumerate(body.joint_names):
            for key, angle in self.angles.items():
                if key in name:
                    q[7 + index] = angle
        return q

    def scale(self, body: BodyModel) -> FloatArray:
        """(nv,) deviations of the tangent that cost one unit [rad]; infinite for the pelvis' place."""
        scale = np.full(body.nv, np.inf)
        scale[3:6] = self.trunk_scale
        for index, name in enumerate(body.joint_names):
            scale[6 + index] = next((s for key, s in self.scales.items() if key in name), 0.5)
        return scale

    def strain(self, body: BodyModel, preferred: FloatArray, q: FloatArray) -> float:
        """Distance of a posture (nq,) from a preferred one, attitude and joints in units of :meth:`scale`."""
        return float(np.linalg.norm((difference(body, preferred, q) / self.scale(body))[3:]))


def _degrees(**angles: float) -> Mapping[str, float]:
    """Angles [deg] as read-only radians."""
    return MappingProxyType({name: np.deg2rad(angle) for name, angle in angles.items()})


READY = PostureStyle(
    "ready", _degrees(shoulder_flexion=8.0, shoulder_abduction=18.0, elbow_flexion=25.0),
    MappingProxyType({
        "toe": 0.01, "hip": 1.0, "knee": 1.5, "ankle": 1.0, "lumbar": 0.35, "thorax": 0.35, "neck": 0.25,
        "shoulder": 0.25, "elbow": 0.25, "wrist": 0.1,
    }),
    preferences=Preferences(arms=0.3),
)  # fmt: skip
"""Arms that hang, elbows bent by 25 degrees, and come up where balance or a thigh asks for it."""

WALKING = PostureStyle(
    "walking", _degrees(shoulder_flexion=3.0, elbow_flexion=22.0),
    MappingProxyType({
        "toe": 0.01, "hip": 1.0, "knee": 1.5, "ankle": 1.0, "lumbar": 0.12, "thorax": 0.12, "neck": 0.1,
        "shoulder": 0.12, "elbow": 0.15, "wrist": 0.1,
    }),
    trunk_scale=0.15, arm_swing=0.7, moment_factor=1.6,
    preferences=Preferences(
        hinges=MappingProxyType({"shoulder": 0.5, **Preferences().hinges}),
        pelvis=2.0, trunk=2.0, head=1.0, arms=0.0,
    ),
)  # fmt: skip
"""An upright trunk and hanging arms that swing against the legs."""

CLOSE = PostureStyle(
    "close", _degrees(shoulder_flexion=25.0, shoulder_abduction=15.0, elbow_flexion=80.0),
    MappingProxyType({**READY.scales, "shoulder": 0.15, "elbow": 0.2}),
    preferences=Preferences(
        hinges=MappingProxyType({"shoulder": 0.5, "elbow": 0.3, **Preferences().hinges}), arms=0.3
    ),
)  # fmt: skip
"""Arms kept close to the body, as in a narrow place."""

CLIMBING = PostureStyle(
    "climbing",
    _degrees(
        shoulder_flexion=115.0, shoulder_abduction=20.0, elbow_flexion=70.0, hip_flexion=45.0,
        hip_abduction=25.0, hip_rotation=-20.0, knee_flexion=65.0,
    ),
    MappingProxyType({**READY.scales, "shoulder": 1.0, "elbow": 1.0, "wrist": 0.5}),
    preferences=Preferences(arms=0.0, grasp=0.0),
)  # fmt: skip
"""Raised arms and bent, spread legs of a person on a wall."""

LADDER = PostureStyle(
    "ladder",
    _degrees(
        shoulder_flexion=40.0, shoulder_abduction=10.0, elbow_flexion=75.0, hip_flexion=12.0,
        knee_flexion=20.0, ankle_dorsiflexion=8.0,
    ),
    MappingProxyType({**READY.scales, "shoulder": 0.35, "elbow": 0.35}),
)  # fmt: skip
"""Hands before the chest and slightly bent legs of a person on a ladder."""

HANGING = PostureStyle(
    "hanging", _degrees(shoulder_flexion=5.0, shoulder_abduction=12.0, elbow_flexion=25.0), CLOSE.scales,
    preferences=CLOSE.preferences,
)  # fmt: skip
"""Arms that hang, as of a person who comes near to something."""

MANNERS: Mapping[str, PostureStyle] = MappingProxyType(
    {manner.name: manner for manner in (READY, WALKING, CLOSE, HANGING, CLIMBING)}
)
"""Every manner by its name."""


def posture_style_of(name: str) -> PostureStyle:
    """Return the manner of a name; an :class:`~manikin.errors.InputError` where there is none."""
    if name not in MANNERS:
        raise InputError(f"manner is {name!r}; valid: {', '.join(MANNERS)}")
    return MANNERS[name]


def heading_of(schedule: ContactSchedule, time: FloatArray) -> FloatArray:
    """(n,) heading of the body [rad]: mean direction of the soles, interpolated over the phases."""
    feet = {name for name in schedule.sequence.effectors if name.endswith("foot")}
    middles = 0.5 * (schedule.instants[:-1] + schedule.instants[1:])
    headings = []
    for phase in schedule.sequence:
        directions = [c.rotation_contact_to_world[:2, 0] for c in phase.stance if c.effector in feet]
        mean = np.sum(directions, axis=0) if directions else np.array([1.0, 0.0])
        headings.append(np.arctan2(mean[1], mean[0]))
    return np.interp(time, middles, np.unwrap(headings))


def foot_lead(schedule: ContactSchedule, time: FloatArray) -> FloatArray:
    """(n,) how far the left foot is ahead of the right one along the heading [m]; 0 without both."""
    heading = heading_of(schedule, time)
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    left, right = (_foot_path(schedule, f"{side}_foot", time) for side in ("left", "right"))
    if left is None or right is None:
        return np.zeros(len(time))
    return np.sum(forward * (left - right), axis=1)


def _foot_path(schedule: ContactSchedule, effector: str, time: FloatArray) -> FloatArray | None:
    """(n, 2) where an effector is, seen from above; smoothly from one contact to the next."""
    held = [index for index, phase in enumerate(schedule.sequence) if effector in phase.stance]
    if not held:
        return None
    known = np.concatenate([schedule.instants[index : index + 2] for index in held])
    places = np.repeat([schedule.sequence[index].stance[effector].position[:2] for index in held], 2, axis=0)
    after = np.clip(np.searchsorted(known, time, side="right"), 1, len(known) - 1)
    start, end = known[after - 1], known[after]
    share = np.clip((time - start) / np.maximum(end - start, 1e-9), 0.0, 1.0)[:, None]
    blend = share**2 * (3.0 - 2.0 * share)
    return (1.0 - blend) * places[after - 1] + blend * places[after]


def reference_motion(
    body: BodyModel, trajectory: CentroidalTrajectory, time: FloatArray, manner: PostureStyle = READY
) -> FloatArray:
    """(n, nq) preferred posture carried along the centre of mass at times (n,) [s], facing as the feet do."""
    standing, model = manner.posture(body), body.pinocchio
    offset = pin.centerOfMass(model, model.createData(), standing) - standing[:3]
    com, out = trajectory.position(time), np.tile(standing, (len(time), 1))
    for row, yaw, centre in zip(out, heading_of(trajectory.schedule, time), com, strict=True):
        turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, float(yaw)))
        row[:3] = centre - turn.matrix() @ offset
        row[3:7] = (turn * pin.Quaternion(*standing[[6, 3, 4, 5]])).coeffs()
    flexion = manner.arm_swing * foot_lead(trajectory.schedule, time)
    for name, sign in (("left_shoulder_flexion", -1.0), ("right_shoulder_flexion", 1.0)):
        if name in body.joint_names:
            out[:, 7 + body.joint_index(name)] += sign * flexion
    return align_quaternions(out)
