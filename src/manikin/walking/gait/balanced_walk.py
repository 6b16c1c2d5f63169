"""Walks in balance: people's cycles on given footprints, with a centre of mass that their feet can carry."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.linalg import solve_banded

from manikin.body import BodyModel, Configuration
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
from manikin.kinematics.leg_kinematics import LegKinematics
from manikin.motion import Motion
from manikin.numerics.signals import least_jerk, low_passed
from manikin.numerics.spatial import GRAVITY, FloatArray, quaternions, rotation_from_yaw, rotations
from manikin.planning.whole_body.foot_roll import FootRoll
from manikin.planning.whole_body.swing_path import Pose
from manikin.walking.footprints import FEET, Footprint, Footprints
from manikin.walking.gait.blend import Gait
from manikin.walking.gait.motion_library import load_library

STEP = 0.005


@dataclass(frozen=True)
class RollRule:
    push_off: float = np.radians(45.0)
    touch: float = np.radians(16.0)
    full_step: float = 0.6
    heel_rise: float = 0.48
    flat: float = 0.16
    lift: float = 0.045
    aside: float = 0.02
    toes_back: float = 0.85
    landing_rate: float = 0.5
    lead_in: float = 0.8
    drop: float = 0.095
    knee: float = np.radians(18.0)
    least_knee: float = np.radians(15.0)


@dataclass(frozen=True, eq=False)
class _Support:
    step: Footprint
    flat: float
    up: float
    roll_in: float
    roll_out: float


def _supports(prints: Footprints, foot: str, rule: RollRule) -> list[_Support]:
    steps, out = prints.of(foot), []
    for k, step in enumerate(steps):
        ahead = np.array([np.cos(step.yaw), np.sin(step.yaw)])
        long = step.leaves - step.lands
        before = 0.0 if k == 0 else float((step.position - steps[k - 1].position)[:2] @ ahead) / 2
        after = 0.0 if k == len(steps) - 1 else float((steps[k + 1].position - step.position)[:2] @ ahead) / 2
        rin, rout = (float(np.clip(x / rule.full_step, 0.0, 1.0)) for x in (before, after))
        flat = step.lands + (min(rule.flat * long, 0.11) if rin > 0.1 else 0.0)
        usual = min(long, 0.8)
        up = step.leaves - (rule.heel_rise * usual if rout > 0.1 else 0.0)
        out.append(_Support(step, flat, max(up, flat + 0.05), rin if rin > 0.1 else 0.0, rout if rout > 0.1 else 0.0))
    return out


class _Foot:
    """Path of one foot, and contacts."""

    def __init__(self, body: BodyModel, prints: Footprints, foot: str, rule: RollRule, time: FloatArray) -> None:
        self.body, self.name, self.rule = body, foot, rule
        self.supports = _supports(prints, foot, rule)
        self.hinge = toe_hinge(body, foot)
        n = len(time)
        self.position, self.rotation, self.toes = np.empty((n, 3)), np.empty((n, 3, 3)), np.zeros(n)
        heel = np.array([-0.5 * body.sole_length, 0.0, 0.0])
        first = self.supports[0].step
        self.position[:] = first.position
        self.rotation[:] = rotation_from_yaw(first.yaw)
        for a, b in pairwise(self.supports):
            start, end = (Pose(np.array(s.step.position), rotation_from_yaw(s.step.yaw)) for s in (a, b))
            roll = FootRoll(
                np.array([a.up, a.step.leaves, b.step.lands, b.flat]), start, end, self.hinge, heel,
                a.roll_out * rule.push_off, -b.roll_in * rule.touch,
                rule.toes_back, rule.landing_rate,
            )
            rows = time >= a.up
            t = time[rows]
            share = np.clip((t - a.step.leaves) / (b.step.lands - a.step.leaves), 0.0, 1.0)
            s = least_jerk(share)[0]
            p, q = roll.pivots
            place = p.position + s[:, None] * (q.position - p.position)
            bump = 64.0 * (share * (1.0 - share)) ** 3
            place[:, 2] += rule.lift * bump
            side = 1.0 if foot == FEET[0] else -1.0
            place[:, :2] += (side * rule.aside * bump)[:, None] * np.array([-np.sin(a.step.yaw), np.cos(a.step.yaw)])
            turn = np.angle(np.exp(1j * (b.step.yaw - a.step.yaw)))
            yaw = a.step.yaw + s * turn
            upright = rotations(yaw, 0.0 * yaw, 0.0 * yaw)
            self.position[rows], self.rotation[rows] = roll.pose(place, upright, t)
            self.toes[rows] = roll.toe_extension(t)
        self.cop = self._cop(time)

    def _cop(self, time: FloatArray) -> FloatArray:
        cop, hx, half = np.zeros((len(time), 2)), float(self.hinge[0]), 0.5 * self.body.sole_length
        for k, s in enumerate(self.supports):
            lands, leaves = s.step.lands, s.step.leaves
            knots = []
            if k == 0:
                knots += [(lands - 5.0, 0.0), (lands, 0.0)]
            elif s.roll_in:
                knots += [(lands, -half + 0.02), (s.flat, -0.5 * half), ((0.5 * (s.flat + s.up)), 0.0)]
            else:
                knots += [(lands, 0.0)]
            if s.roll_out:
                knots += [(s.up - 0.2, 0.02)] if k == 0 else []
                knots += [(s.up, hx + 0.01), (leaves, hx + 0.03)]
            else:
                knots += [(max(leaves, knots[-1][0] + 0.3), 0.0)]
            knots = sorted(knots)
            t, x = np.array(knots).T
            keep = np.append(True, np.diff(t) > 1e-6)
            rows = time >= (lands if k else -np.inf)
            along = PchipInterpolator(t[keep], x[keep])(np.clip(time[rows], t[0], t[-1]))
            ahead = np.array([np.cos(s.step.yaw), np.sin(s.step.yaw)])
            cop[rows] = s.step.position[:2] + along[:, None] * ahead
        return cop

    def contact(self, s: _Support, part: SolePart, friction: float) -> Contact:
        made = sole(self.name, s.step.position, s.step.yaw, length=self.body.sole_length,
                    width=self.body.sole_width, friction=friction)
        return sole_part(made, part, float(self.hinge[0]))

    def part_at(self, t: float) -> tuple[int, SolePart] | None:
        for k, s in enumerate(self.supports):
            if (k == 0 or s.step.lands <= t) and (k == len(self.supports) - 1 or t < s.step.leaves):
                if t < s.flat and s.roll_in:
                    return k, SolePart.HEEL
                if t >= s.up and s.roll_out:
                    return k, SolePart.TOES
                return k, SolePart.FULL
        return None

    def events(self) -> list[float]:
        return [x for s in self.supports for x in (s.step.lands, s.flat, s.up, s.step.leaves)]


def _schedule(body: BodyModel, feet: Sequence[_Foot], begin: float, end: float, friction: float) -> ContactSchedule:
    cuts = sorted({round(t, 6) for f in feet for t in f.events() if begin + 1e-3 < t < end - 1e-3})
    kept = [begin]
    for t in cuts:
        if t > kept[-1] + 1e-3:
            kept.append(t)
    kept.append(end)
    phases = []
    cap = default_normal_force_cap(body.mass)
    for a, b in pairwise(kept):
        held = []
        for f in feet:
            part = f.part_at(0.5 * (a + b))
            if part is not None:
                held.append(f.contact(f.supports[part[0]], part[1], friction))
        phases.append(Phase(Stance(held, cap), b - a, b - a))
    return ContactSchedule(StanceSequence(phases), np.array(kept))


def _shares(feet: Sequence[_Foot], time: FloatArray) -> FloatArray:
    """(2, n) of load; from one foot to the other while both stand."""
    prints = sorted((s.step for f in feet for s in f.supports), key=lambda s: (s.lands, s.leaves))
    left = np.full(len(time), 0.5)
    value = 0.5
    leaving = sorted((s for s in prints), key=lambda s: s.leaves)
    leaving = [s for s in leaving if s.leaves < leaving[-1].leaves - 1e-6]
    for s in leaving:
        landed = max((o.lands for o in prints if o.effector != s.effector and o.lands < s.leaves))
        begin = max(landed, s.leaves - 0.7)
        target = 0.0 if s.effector == FEET[0] else 1.0
        share = least_jerk(np.clip((time - begin) / (s.leaves - begin), 0.0, 1.0))[0]
        rows = time >= begin
        left[rows] = value + (target - value) * share[rows]
        value = target
    last = max(s.lands for s in prints)
    rows = time >= last
    left[rows] = value + (0.5 - value) * least_jerk(np.clip((time[rows] - last) / 0.6, 0.0, 1.0))[0]
    return np.array([left, 1.0 - left])


def _phase(feet: Sequence[_Foot], time: FloatArray, events: FloatArray) -> FloatArray:
    knots = []
    for number, f in enumerate(feet):
        for a, b in pairwise(f.supports):
            knots.append((a.step.leaves, number, 0))
            knots.append((b.step.lands, number, 1))
    knots.sort()
    times, phases, cycle = [], [], 0.0
    for t, number, kind in knots:
        landing, off, other = events[min(int(np.searchsorted(time, t)), len(time) - 1)]
        base = {(0, 0): 0.0, (0, 1): landing, (1, 0): off, (1, 1): other + 1.0}[number, kind]
        low = phases[-1] if phases else 0.9
        value = base + np.ceil(low - base - 0.3) if phases else base + (1.0 if base < 0.5 else 0.0)
        while phases and value < low - 1e-6:
            value += 1.0
        times.append(t)
        phases.append(value)
    t, p = np.array(times), np.maximum.accumulate(np.array(phases))
    keep = np.append(True, np.diff(t) > 1e-4)
    return PchipInterpolator(t[keep], p[keep])(np.clip(time, t[0], t[-1]))


def _height(prints: Footprints, time: FloatArray, high: float, rule: RollRule) -> FloatArray:
    steps = sorted((s for f in FEET for s in prints.of(f)), key=lambda s: s.lands)
    knots = [(time[0] - 1.0, high), (time[0], high)]
    lands = [s for s in steps if s.lands > prints.start + 1e-6]
    middles = []
    for s in lands:
        other = max((o for o in steps if o.effector != s.effector and o.lands < s.lands), key=lambda o: o.lands)
        step = float(np.linalg.norm((s.position - other.position)[:2]))
        step = np.sqrt(max(step**2 - 0.02, 0.0))
        off = other.leaves if other.leaves < prints.end - 1e-6 else s.lands + 0.15
        middles.append((0.5 * (s.lands + off), high - rule.drop * step**2, other.lands))
    for k, (t, z, _) in enumerate(middles):
        if k:
            knots.append((0.5 * (middles[k - 1][0] + t), high))
        else:
            knots.append((t - 0.5, high))
        knots.append((t, z))
    knots += [(middles[-1][0] + 0.45, high), (max(time[-1], middles[-1][0] + 0.5) + 1.0, high)]
    t, z = np.array(knots).T
    keep = np.append(True, np.diff(t) > 1e-3)
    return t[keep], z[keep]


def _smooth_height(knots, time):
    return low_passed(PchipInterpolator(*knots)(time)[:, None], 5.0, 1.0 / STEP, padding=50)[:, 0]


def _lowered(knots, time, need):
    """Knots lowered where a leg is too short."""
    t, z = knots[0], knots[1].copy()
    edges = np.concatenate([[-np.inf], 0.5 * (t[1:] + t[:-1]), [np.inf]])
    for k in range(len(t)):
        rows = (time >= edges[k]) & (time < edges[k + 1])
        if rows.any():
            z[k] -= need[rows].max()
    return t, z


def carried_com(zmp: FloatArray, z: FloatArray, moment: FloatArray, mass: float) -> FloatArray:
    """(n, 2) bounded path of the centre of mass over a given ZMP."""
    lift = np.gradient(np.gradient(z, STEP), STEP) + GRAVITY
    k = z / lift / STEP**2
    target = zmp.copy()
    target[:, 0] += moment[:, 1] / (mass * lift)
    target[:, 1] -= moment[:, 0] / (mass * lift)
    n = len(z)
    bands = np.zeros((3, n))
    bands[1] = 1.0 + 2.0 * k
    bands[0, 1:], bands[2, :-1] = -k[:-1], -k[1:]
    bands[1, [0, -1]] = 1.0
    bands[0, 1] = bands[2, -2] = 0.0
    return solve_banded((1, 1), bands, target)


@dataclass(frozen=True, eq=False)
class BalancedWalk:
    schedule: ContactSchedule
    motion: Motion
    zmp: FloatArray
    reach_error: float
    shares: FloatArray
    info: dict = field(default_factory=dict)


def balanced_walk(body: BodyModel, prints: Footprints, path, *, friction: float = 0.8,
                  rule: RollRule | None = None, passes: int = 6) -> BalancedWalk:
    rule = rule or RollRule()
    begin, end = prints.start - rule.lead_in, prints.end + rule.lead_in
    time = begin + STEP * np.arange(int(round((end - begin) / STEP)) + 1)
    feet = [_Foot(body, prints, name, rule, time) for name in FEET]
    schedule = _schedule(body, feet, float(time[0]), float(time[-1]), friction)
    shares = _shares(feet, time)
    zmp = sum(share[:, None] * foot.cop for share, foot in zip(shares, feet, strict=True))
    # the style
    gait, legs = Gait(load_library(), body), LegKinematics(body)
    within = np.clip(time, 0.0, path.duration)
    place, velocity = path.place_at(within), path.motion_at(within)[0].copy()
    velocity[(time <= 0) | (time >= path.duration)] = 0.0
    blend = gait.blend(velocity)
    events = np.einsum("nk,nke->ne", blend.weights, gait.library.events[blend.cycles])
    phase = _phase(feet, time, events)
    frames = gait.frames(blend, phase, place)
    rate = 1.0 / STEP
    angles = low_passed(frames.angles, 6.0, rate, padding=50)
    yaw = np.unwrap(np.arctan2(frames.pelvis[:, 1, 0], frames.pelvis[:, 0, 0]))
    pitch = -np.arcsin(frames.pelvis[:, 2, 0])
    roll = np.arctan2(frames.pelvis[:, 2, 1], frames.pelvis[:, 2, 2])
    yaw, pitch, roll = low_passed(np.column_stack([yaw, pitch, roll]), 6.0, rate, padding=50).T
    pelvis, turn = rotations(yaw, pitch, roll), quaternions(yaw, pitch, roll)
    arm = body.effector(FEET[0]).translation
    foot_rot = np.stack([f.rotation for f in feet])
    ankle = np.stack([f.position - np.einsum("nij,j->ni", f.rotation, body.effector(f.name).translation) for f in feet])
    toes = [body.joint_index(f"{side}_toe_extension") for side in ("left", "right")]
    model, data = body.pinocchio, body.pinocchio.createData()
    origin = low_passed(frames.place, 6.0, rate, padding=50)
    floor = float(prints.steps[0].position[2])
    # standing height
    stand = float(Configuration(body).com[2])
    legs_full = legs.thigh + legs.shank
    high = stand - (legs_full - float(legs.length_at(np.array(rule.knee)))) + floor
    knots = _height(prints, time, high, rule)
    longest = float(legs.length_at(np.array(rule.least_knee)))
    moment = np.zeros((len(time), 3))
    com = np.empty((len(time), 3))
    for _ in range(passes):
        z = _smooth_height(knots, time)
        want = np.column_stack([carried_com(zmp, z - floor, moment, body.mass), z])
        for iteration in range(6):
            a = legs.angles(pelvis, origin, foot_rot, ankle, angles)
            for number, joint in enumerate(toes):
                a[:, joint] = feet[number].toes
            q = np.hstack([origin, turn, np.clip(a, body.lower, body.upper)])
            for row, posture in enumerate(q):
                com[row] = pin.centerOfMass(model, data, posture)
            error = want - com
            if np.abs(error).max() < 1e-5:
                break
            origin = origin + error
        line = ankle - legs.hips(pelvis, origin)
        length = np.linalg.norm(line, axis=-1)
        need = np.maximum((length - longest) * length / -line[..., 2], 0.0).max(axis=0)
        knots = _lowered(knots, time, need)
        v = np.zeros((len(time), body.nv))
        steps = np.array([pin.difference(model, b, c) for b, c in zip(q[:-2], q[2:], strict=True)]) / (2 * STEP)
        v[1:-1] = steps
        momentum = np.empty((len(time), 3))
        for row in range(len(time)):
            pin.computeCentroidalMomentum(model, data, q[row], v[row])
            momentum[row] = data.hg.angular
        moment = np.gradient(low_passed(momentum, 8.0, rate, padding=50), STEP, axis=0)
    reached, at = legs.feet(pelvis, origin, q[:, 7:])
    missed = float(np.linalg.norm(at - ankle, axis=-1).max())
    excess = np.maximum(a - body.upper, body.lower - a).max(axis=0)
    accel = np.gradient(v, STEP, axis=0)
    n = len(time)
    tau = np.zeros((n, body.nv))
    lift = body.mass * (GRAVITY + np.gradient(np.gradient(want[:, 2], STEP), STEP))
    forces = np.zeros((n, 2, 6))
    motion = Motion(
        time=time, q=q, v=v, a=accel, tau=tau, com=com, angular_momentum=momentum,
        margin=np.zeros(n), support=schedule.support(time, FEET), contact_force=forces,
        contact_names=FEET, joint_names=body.joint_names,
    )
    return BalancedWalk(schedule, motion, zmp, missed, shares, {
        "excess": {body.joint_names[k]: round(float(np.degrees(x)), 2) for k, x in enumerate(excess) if x > 1e-4},
        "knots": knots, "need": need.max(), "com": np.abs(error).max(), "feet": feet, "lift": lift, "phase": phase, "want": want})
