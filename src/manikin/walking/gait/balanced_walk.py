"""Walks in balance: the library's cycle on given footprints, over feet that roll.

The centre of pressure of each foot goes from heel to toes, and the load from one foot to the next; together
they give the ZMP. The centre of mass follows from it: of all solutions of the pendulum's equation
``c - (z / (g + z'')) c'' = zmp + moment of L'``, which is stiff in both directions of time, the bounded one,
as a banded system (Kajita et al. 2003 find it by preview control). The legs follow in closed form, and all
else from the library's cycle at the speed and phase of the footprints. The angular momentum ``L`` of that
whole-body motion, and the height that its legs allow, go back into the equation until both agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import pinocchio as pin
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solve_banded

from manikin.balance import wrench_polytopes
from manikin.balance.motion_margin import motion_margin
from manikin.body import BodyModel, Configuration
from manikin.contact import ContactSchedule, SolePart
from manikin.errors import InputError
from manikin.kinematics.leg_kinematics import LegKinematics
from manikin.motion import Motion
from manikin.numerics.signals import least_jerk, low_passed
from manikin.numerics.spatial import GRAVITY, FloatArray, cross, finite_number, quaternions, rotations
from manikin.scene import Scene
from manikin.walking.footprints import FEET, Footprints
from manikin.walking.gait.blend import Gait
from manikin.walking.gait.drawn_arms import DrawnArms
from manikin.walking.gait.motion_library import MotionLibrary, load_library
from manikin.walking.gait.rolling_steps import RollingFoot, RollRule, rolling_schedule
from manikin.walking.stepper import LEAD, SteppedPath

STEP = 0.005
"""Time between two samples [s], that of control."""

SHIFT = 0.7
"""Longest time in which the load goes from one foot to the other [s]."""

DROP = 0.095
"""How far the centre of mass is lower between the feet than over one, over the squared step [1/m]."""

STANDING_KNEE, LEAST_KNEE = float(np.radians(18.0)), float(np.radians(15.0))
"""Bend of the knees over which the centre of mass stands, and least bend in the walk [rad]: a leg that is
straighter cannot follow the height of the centre of mass."""

STYLE_CUTOFF, HEIGHT_CUTOFF, MOMENTUM_CUTOFF = 6.0, 5.0, 15.0
"""Low-pass filters of the library's angles, the height, and the angular momentum [Hz]."""

PASSES, PLACED = 6, 1e-5
"""Rounds of whole-body motion and centre of mass; error of the latter at which a round ends [m]."""

LOOKS = 3
"""Rounds after which arms are looked at, and drawn in where they are too near to something."""

_PADDING = 50


@dataclass(frozen=True, eq=False)
class BalancedWalk:
    """A walk that is to be executed.

    Attributes:
        body: Who walks.
        schedule: What touches when.
        motion: The whole body, with its contact forces, torques and margin.
        missed: Largest distance of an ankle from where its foot should be [m].
        excess: Largest angle by which a hinge is beyond its range before it is cut off [rad].
        zmp_error: (n,) distance of the motion's own ZMP from the wanted one [m].
    """

    body: BodyModel
    schedule: ContactSchedule
    motion: Motion
    missed: float
    excess: float
    zmp_error: FloatArray

    @cached_property
    def torque_share(self) -> FloatArray:
        """(n, h) joint torques over their limits, loads as planned [-]."""
        tau = self.motion.tau[:, 6:]
        return np.maximum(tau / self.body.torque_upper, tau / self.body.torque_lower)


def balanced_walk(
    body: BodyModel, stepped: SteppedPath, *, friction: float = 0.8, end: FloatArray | None = None,
    rule: RollRule | None = None, library: MotionLibrary | None = None, scene: Scene | None = None,
) -> BalancedWalk:  # fmt: skip
    """Walk on footprints along the path that they were placed on, in balance.

    Arms that would come too near to what stands in the scene are drawn in there; footprints and path are as
    they are, so that what the body meets is to be measured.

    Args:
        body: A human.
        stepped: Path of the middle between the feet, and where and when these stand.
        friction: Coulomb coefficient of the soles, for the contacts of the schedule.
        end: (nq,) posture on both feet with which the walk ends; standing as the library's when omitted.
        rule: How feet roll; as people's when omitted.
        library: Cycles; those that come with this package if omitted.
        scene: What stands there.

    Raises:
        InputError: If the footprints have no step.
        BodyError: If the body is no human.
    """
    if stepped.footprints.count == 0:
        raise InputError("footprints have no step; valid: at least one")
    friction = finite_number(friction, "friction of the soles", above=0.0)
    plan = _Plan(body, stepped, end, rule or RollRule(), library or load_library())
    arms = None if scene is None else DrawnArms(body, scene, plan.time)
    for done in range(PASSES):
        plan.improve()
        if arms is not None and done < LOOKS and arms.look(plan.q):
            plan.draw_in(arms)
    return plan.result(friction)


class _Plan:
    """A walk on its way to agreement between its centre of mass and its whole body."""

    def __init__(
        self,
        body: BodyModel,
        stepped: SteppedPath,
        last: FloatArray | None,
        rule: RollRule,
        library: MotionLibrary,
    ) -> None:
        self.body, self.legs, footprints = body, LegKinematics(body), stepped.footprints
        self.time: FloatArray = STEP * np.arange(round(footprints.end / STEP) + 1, dtype=np.float64)
        self.floor = float(footprints.steps[0].position[2])
        self.feet = [RollingFoot(body, footprints, name, rule) for name in FEET]
        paths = [foot.path(self.time) for foot in self.feet]
        self.sole = np.stack([turn for _, turn, _ in paths])
        self.ankle = np.stack([
            place - turn @ foot.offset for foot, (place, turn, _) in zip(self.feet, paths, strict=True)
        ])  # fmt: skip
        self.toes = [(body.joint_index(f"{foot.name.removesuffix('_foot')}_toe_extension"), bend)
                     for foot, (_, _, bend) in zip(self.feet, paths, strict=True)]  # fmt: skip
        self.share = load_shares(footprints, self.time)
        self.pressure = np.stack([foot.pressure(self.time) for foot in self.feet])
        self.settled = least_jerk(np.clip(1.0 - (self.time[-1] - self.time) / LEAD, 0.0, 1.0))[0]
        self.last = None if last is None else Configuration(body, last)
        if self.last is not None:
            middle = np.einsum("k,ki->i", self.share[:, -1], self.pressure[:, -1])
            self.pressure[..., :2] += self.settled[:, None] * (self.last.com - middle)[:2]
        self.zmp = np.einsum("kn,kni->ni", self.share, self.pressure)
        self._style(stepped, Gait(library, body))
        straight = self.legs.thigh + self.legs.shank - float(self.legs.length_at(np.array(STANDING_KNEE)))
        high = self.floor + float(Configuration(body).com[2]) - straight
        self.height = HeightProfile(footprints, self.time, high)
        self.longest = float(self.legs.length_at(np.array(LEAST_KNEE)))
        ends = np.minimum(self.time - self.time[0], self.time[-1] - self.time)
        self.inner = least_jerk(np.clip(ends / 0.4 - 0.5, 0.0, 1.0))[0]
        waited = np.clip((self.time - self.time[0]) / LEAD, 0.0, 1.0)
        bump = 64.0 * (waited * (1.0 - waited)) ** 3
        self.bumps = np.column_stack([bump, bump[::-1]])
        self.shifted = np.zeros((len(self.time), 3))
        self.moment = np.zeros((len(self.time), 3))

    def _style(self, stepped: SteppedPath, gait: Gait) -> None:
        """Pelvis and hinges as in the library's cycle of the velocity, at the phase of the footprints."""
        velocity = stepped.motion_at(self.time)[0]
        blend = gait.blend(velocity)
        events = np.einsum("nk,nke->ne", blend.weights, gait.library.events[blend.cycles])
        frames = gait.frames(blend, gait_phase(self.feet, self.time, events), stepped.place_at(self.time))
        yaw, pitch, roll = _angles_of(frames.pelvis)
        yaw = np.unwrap(yaw)
        rows = np.column_stack([yaw, pitch, roll, frames.place, frames.angles])
        smooth = _smoothed(rows, STYLE_CUTOFF)
        if self.last is not None:
            pelvis = pin.XYZQUATToSE3(self.last.q[:7])
            end = np.concatenate([_angles_of(pelvis.rotation), pelvis.translation, self.last.q[7:]])
            end[0] = yaw[-1] + np.angle(np.exp(1j * (end[0] - yaw[-1])))
            smooth = smooth + self.settled[:, None] * (end - smooth)
        yaw, pitch, roll = smooth[:, 0], smooth[:, 1], smooth[:, 2]
        self.pelvis, self.turn = rotations(yaw, pitch, roll), quaternions(yaw, pitch, roll)
        self.origin, self.angles = smooth[:, 3:6], smooth[:, 6:]
        self.swinging = self.angles

    def draw_in(self, arms: DrawnArms) -> None:
        """Draw in the arms, but for the posture in which the walk has to end."""
        free = np.ones(len(self.time)) if self.last is None else 1.0 - self.settled
        self.angles = arms.applied(self.swinging, free)

    def improve(self) -> None:
        """One round: centre of mass over the ZMP, the body with it, and what that changes."""
        z = self.height.at(self.time)
        if self.last is not None:
            z = z + self.settled * (self.last.com[2] - z[-1])
        self.wanted = np.column_stack([self._from_rest_to_rest(z - self.floor), z])
        for _ in range(PASSES):
            self._pose()
            error = self.wanted - self.com
            if np.abs(error).max() < PLACED:
                break
            self.origin = self.origin + error
        line = self.ankle - self.legs.hips(self.pelvis, self.origin)
        length = np.linalg.norm(line, axis=-1)
        lower = np.maximum((length - self.longest) * length / -line[..., 2], 0.0).max(axis=0)
        self.height.lower(self.time, lower)
        momentum = self._momentum()
        self.moment = self.inner[:, None] * np.gradient(_smoothed(momentum, MOMENTUM_CUTOFF), STEP, axis=0)

    def _from_rest_to_rest(self, height: FloatArray) -> FloatArray:
        """(n, 2) centre of mass without speed at its ends [m].

        Before the first step the pressure goes aside and back, by as much as sets the body going in time, as
        that of people does; after the last one likewise.
        """
        mass, none = self.body.mass, np.zeros_like(self.moment)
        level = carried_com(self.zmp[:, :2], height, self.moment, mass)
        along = carried_com(self.bumps, height, none, mass)
        ends = [(first[1] - first[0]) for first in (level, along, level[::-1], along[::-1])]
        sway = np.linalg.solve(np.stack([ends[1], ends[3]]), -np.stack([ends[0], ends[2]]))
        self.shifted[:, :2] = self.bumps @ sway
        return level + along @ sway

    def _pose(self) -> None:
        """Postures of the pelvis where it is now, and their centre of mass."""
        body, model, data = self.body, self.body.pinocchio, self.body.pinocchio.createData()
        self.reached = self.legs.angles(self.pelvis, self.origin, self.sole, self.ankle, self.angles)
        for joint, bend in self.toes:
            self.reached[:, joint] = bend
        within = np.clip(self.reached, body.lower, body.upper)
        self.q = np.hstack([self.origin, self.turn, within])
        self.com = np.array([pin.centerOfMass(model, data, q) for q in self.q])

    def _momentum(self) -> FloatArray:
        """(n, 3) angular momentum about the centre of mass [kg.m^2/s]; sets the velocities."""
        model, data = self.body.pinocchio, self.body.pinocchio.createData()
        self.v = np.zeros((len(self.time), self.body.nv))
        pairs = zip(self.q[:-2], self.q[2:], strict=True)
        self.v[1:-1] = np.array([pin.difference(model, a, b) for a, b in pairs]) / (2.0 * STEP)
        found = np.empty((len(self.time), 3))
        for row, (q, v) in enumerate(zip(self.q, self.v, strict=True)):
            pin.computeCentroidalMomentum(model, data, q, v)
            found[row] = data.hg.angular
        return found

    def result(self, friction: float) -> BalancedWalk:
        """The walk as it is now, with its forces."""
        body, time = self.body, self.time
        schedule = rolling_schedule(body, self.feet, float(time[0]), float(time[-1]), friction)
        a = np.asarray(np.gradient(self.v, STEP, axis=0), dtype=np.float64)
        tau, forces, wrench, zmp_error = self._forces(a, schedule)
        stances = [phase.stance for phase in schedule.sequence]
        margin = motion_margin(
            stances, schedule.phase_at(time), wrench, self.com, polytopes=wrench_polytopes(stances)
        )
        motion = Motion(
            time=time, q=self.q, v=self.v, a=a, tau=tau, com=self.com, angular_momentum=self._momentum(),
            margin=margin.margin, support=schedule.support(time, FEET), contact_force=forces,
            contact_names=FEET, joint_names=body.joint_names,
        )  # fmt: skip
        _, at = self.legs.feet(self.pelvis, self.origin, self.q[:, 7:])
        missed = float(np.linalg.norm(at - self.ankle, axis=-1).max())
        excess = float(np.maximum(self.reached - body.upper, body.lower - self.reached).max())
        return BalancedWalk(body, schedule, motion, missed, max(excess, 0.0), zmp_error)

    def _forces(
        self, a: FloatArray, schedule: ContactSchedule
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Torques, contact forces, the wrench about the origin and the error of the ZMP of the motion.

        Each foot takes its share of the force at its centre of pressure, and of what moment is left.
        """
        body, n = self.body, len(self.time)
        model, data = body.pinocchio, body.pinocchio.createData()
        tau, forces, wrench = np.zeros((n, body.nv)), np.zeros((n, 2, 6)), np.empty((n, 6))
        whole = [(body.effector_frame(foot.name), body.segment_frame(_toes(foot.name))) for foot in self.feet]
        left = np.empty((n, 3))
        for row in range(n):
            needed = pin.rnea(model, data, self.q[row], self.v[row], a[row])
            root = pin.XYZQUATToSE3(self.q[row, :7]).rotation
            force = root @ needed[:3]
            moment = root @ needed[3:6] + cross(self.q[row, :3], force)
            wrench[row] = np.concatenate([force, moment])
            left[row] = moment - cross(self.zmp[row] + self.shifted[row], force)
            pin.computeJointJacobians(model, data, self.q[row])
            pin.updateFramePlacements(model, data)
            stance = schedule.stance_at(float(self.time[row]))
            for k, foot in enumerate(self.feet):
                share, point = self.share[k, row], self.pressure[k, row] + self.shifted[row]
                if share <= 0.0 or foot.name not in stance:
                    continue
                contact = stance[foot.name]
                pull, twist = share * force, share * left[row]
                forces[row, k] = np.concatenate([pull, cross(point - contact.position, pull) + twist])
                frame = whole[k][contact.part is SolePart.TOES]
                jacobian = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
                arm = point - data.oMf[frame].translation
                needed = needed - jacobian.T @ np.concatenate([pull, cross(arm, pull) + twist])
            tau[row, 6:] = needed[6:]
        return tau, forces, wrench, np.hypot(left[:, 0], left[:, 1]) / wrench[:, 2]


def carried_com(zmp: FloatArray, height: FloatArray, moment: FloatArray, mass: float) -> FloatArray:
    """(n, 2) bounded path of the centre of mass over a ZMP, at rest over it at both ends [m].

    Args:
        zmp: (n, 2) wanted [m], at even instants.
        height: (n,) of the centre of mass over the floor [m].
        moment: (n, 3) rate of the angular momentum about it [N.m].
        mass: Of the body [kg].
    """
    lift = np.gradient(np.gradient(height, STEP), STEP) + GRAVITY
    target = zmp + np.column_stack([moment[:, 1], -moment[:, 0]]) / (mass * lift)[:, None]
    stiff = height / lift / STEP**2
    bands = np.stack([-np.roll(stiff, 1), 1.0 + 2.0 * stiff, -np.roll(stiff, -1)])
    bands[1, [0, -1]] = 1.0
    # Row i of the system has its own coefficient beside the diagonal: bands are stored by columns.
    bands[0, 1], bands[2, -2] = 0.0, 0.0
    return solve_banded((1, 1), bands, target)


def load_shares(footprints: Footprints, time: FloatArray) -> FloatArray:
    """(2, n) shares of the load of the left and the right foot, half each before and after the walk."""
    left, now = np.full(len(time), 0.5), 0.5
    last = max(step.lands for step in footprints.steps)
    changes = [
        (max(other.lands for other in footprints.steps
             if other.effector != step.effector and other.lands < step.leaves),
         step.leaves, 0.0 if step.effector == FEET[0] else 1.0)
        for step in footprints.steps
        if step.leaves < footprints.end - STEP
    ]  # fmt: skip
    changes += [(landed, landed + SHIFT, 0.5) for landed, leaves, _ in changes
                if footprints.start < landed < leaves - 2.0 * SHIFT]  # fmt: skip
    for landed, leaves, then in [*sorted(changes, key=lambda item: item[1]), (last, last + SHIFT, 0.5)]:
        begin = max(landed, leaves - SHIFT) if landed > footprints.start else leaves - SHIFT
        rows = time >= begin
        share = np.clip((time[rows] - begin) / (leaves - begin), 0.0, 1.0)
        left[rows] = now + (then - now) * least_jerk(share)[0]
        now = then
    return np.array([left, 1.0 - left])


def gait_phase(feet: Sequence[RollingFoot], time: FloatArray, events: FloatArray) -> FloatArray:
    """(n,) shares of the library's cycle at which its feet leave and land when those of a walk do.

    Args:
        feet: Left and right.
        time: (n,) [s].
        events: (n, 3) shares at which the left foot lands, and the right one leaves and lands.
    """
    flights = sorted(
        (before.step.leaves, after.step.lands, number)
        for number, foot in enumerate(feet)
        for before, after in zip(foot.supports[:-1], foot.supports[1:], strict=True)
    )
    instants, shares, cycle, last = [], [], 0.0, -np.inf
    for leaves, lands, right in flights:
        landing, off, other = events[min(int(np.searchsorted(time, leaves)), len(time) - 1)].tolist()
        begin, end = (off, other + 1.0) if right else (0.0, landing)
        while cycle + begin <= last - 0.25:  # feet overlap by less than a quarter of a cycle
            cycle += 1.0
        instants += [leaves, lands]
        shares += [cycle + begin, cycle + end]
        last = cycle + end
    order = np.argsort(instants, kind="stable")
    knots, values = np.array(instants)[order], np.maximum.accumulate(np.array(shares)[order])
    distinct = np.append(True, np.diff(knots) > 1e-4)
    return PchipInterpolator(knots[distinct], values[distinct])(np.clip(time, knots[0], knots[-1]))


class HeightProfile:
    """Height of the centre of mass: low between two feet, high over one, lower where legs are too short."""

    def __init__(self, footprints: Footprints, time: FloatArray, high: float) -> None:
        """Begin with what steps of that length need; ``high`` is the height when standing [m]."""
        low: list[tuple[float, float]] = []
        for step in footprints.steps:
            others = [o for o in footprints.steps if o.effector != step.effector and o.lands < step.lands]
            if others:
                other = max(others, key=lambda item: item.lands)
                ahead = np.array([np.cos(step.yaw), np.sin(step.yaw)])
                long = float((step.position - other.position)[:2] @ ahead)
                off = min(other.leaves, step.lands + 0.3)
                low.append((0.5 * (step.lands + off), high - DROP * long**2))
        middle = [(0.5 * (a[0] + b[0]), high) for a, b in pairwise(low)]
        ends = [
            (float(time[0]), high),
            (low[0][0] - 0.5, high),
            (low[-1][0] + 0.5, high),
            (float(time[-1]), high),
        ]
        rows = np.array(sorted([*low, *middle, *ends]))
        distinct = np.append(True, np.diff(rows[:, 0]) > 1e-3)
        self.instants, self.heights = rows[distinct].T

    def at(self, time: FloatArray) -> FloatArray:
        """(n,) heights at even instants [m]."""
        return _smoothed(PchipInterpolator(self.instants, self.heights)(time)[:, None], HEIGHT_CUTOFF)[:, 0]

    def lower(self, time: FloatArray, by: FloatArray) -> None:
        """Go lower where (n,) heights are too large by so much [m]."""
        edges = np.concatenate([[-np.inf], 0.5 * (self.instants[1:] + self.instants[:-1]), [np.inf]])
        nearest = np.searchsorted(edges, time, side="right") - 1
        most = np.zeros(len(self.instants))
        np.maximum.at(most, nearest, by)
        self.heights = self.heights - most


def _angles_of(turn: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Yaw, pitch and roll (...) of rotations (..., 3, 3) [rad]."""
    yaw = np.arctan2(turn[..., 1, 0], turn[..., 0, 0])
    return yaw, -np.arcsin(turn[..., 2, 0]), np.arctan2(turn[..., 2, 1], turn[..., 2, 2])


def _toes(foot: str) -> str:
    return f"{foot.removesuffix('_foot')}_toes"


def _smoothed(values: FloatArray, cutoff: float) -> FloatArray:
    """The columns without what is faster than a frequency [Hz]."""
    return low_passed(values, cutoff, 1.0 / STEP, padding=_PADDING)
