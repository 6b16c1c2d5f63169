"""Slow motions made by inverse kinematics, to be executed."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import make_interp_spline

from manikin.body import BodyModel, human
from manikin.contact import Contact, ContactSchedule, Phase, Stance, StanceSequence, sole
from manikin.motion import Motion

FEET = ("left_foot", "right_foot")


@dataclass(frozen=True, eq=False)
class Plan:
    """A motion with its contacts."""

    body: BodyModel
    motion: Motion
    schedule: ContactSchedule


def smooth(share):
    """Quintic from 0 to 1 with no speed and acceleration at its ends."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


class Kinematics:
    """Damped least squares on CoM, feet, pelvis orientation and posture."""

    def __init__(self, body: BodyModel) -> None:
        self.body, self.model = body, body.pinocchio
        self.data = self.model.createData()
        self.rest = body.standing_posture()
        self.frames = [body.effector_frame(name) for name in FEET]
        self.pelvis = body.effector_frame("pelvis")
        self.feet = self.placements(self.rest)
        self.com = pin.centerOfMass(self.model, self.data, self.rest).copy()

    def placements(self, q):
        pin.framesForwardKinematics(self.model, self.data, q)
        return [pin.SE3(self.data.oMf[frame]) for frame in self.frames]

    def solve(self, q, com, feet, iterations=60):
        model, data, nv = self.model, self.data, self.model.nv
        posture = np.diag(np.r_[np.zeros(6), np.full(nv - 6, 0.1)])
        for _ in range(iterations):
            pin.computeJointJacobians(model, data, q)
            pin.framesForwardKinematics(model, data, q)
            rows = [10 * pin.jacobianCenterOfMass(model, data, q)]
            errors = [10 * (com - data.com[0])]
            for frame, wanted in zip(self.frames, feet, strict=True):
                rows.append(10 * pin.getFrameJacobian(model, data, frame, pin.LOCAL))
                errors.append(10 * pin.log6(data.oMf[frame].actInv(wanted)).vector)
            rows.append(0.2 * pin.getFrameJacobian(model, data, self.pelvis, pin.LOCAL)[3:])
            errors.append(0.2 * pin.log3(data.oMf[self.pelvis].rotation.T))
            rows.append(posture)
            errors.append(posture @ pin.difference(model, q, self.rest))
            matrix, error = np.concatenate(rows), np.concatenate(errors)
            step = np.linalg.solve(matrix.T @ matrix + 1e-6 * np.eye(nv), matrix.T @ error)
            step *= min(1.0, 0.2 / np.abs(step).max())
            q = pin.integrate(model, q, step)
            if np.abs(step).max() < 1e-7:
                break
        return q


def moving(body, duration, com_at, feet_at):
    """Motion at 1 kHz through postures solved every 20 ms."""
    kinematics = Kinematics(body)
    model, knots = body.pinocchio, np.linspace(0.0, duration, round(duration / 0.02) + 1)
    q, tangent = kinematics.rest, []
    for time in knots:
        q = kinematics.solve(q, com_at(time, kinematics), feet_at(time, kinematics))
        tangent.append(pin.difference(model, kinematics.rest, q))
    rest = [(1, np.zeros(model.nv)), (2, np.zeros(model.nv))]
    spline = make_interp_spline(knots, np.array(tangent), k=5, bc_type=(rest, rest))
    time = np.arange(round(duration * 1000) + 1) * 1e-3
    qs = np.array([pin.integrate(model, kinematics.rest, row) for row in spline(time)])
    difference = np.array([pin.difference(model, a, b) for a, b in pairwise(qs)])
    v = np.zeros((len(time), model.nv))
    v[1:-1] = 0.5e3 * (difference[1:] + difference[:-1])
    a = np.gradient(v, 1e-3, axis=0)
    com = np.array([pin.centerOfMass(model, kinematics.data, q).copy() for q in qs])
    return time, qs, v, a, com


def make_motion(body, time, q, v, a, com, schedule):
    n, names = len(time), schedule.sequence.effectors
    return Motion(
        time=time, q=q, v=v, a=a, tau=np.zeros((n, body.nv)), com=com, angular_momentum=np.zeros((n, 3)),
        margin=np.zeros(n), support=schedule.support(time, names),
        contact_force=np.zeros((n, len(names), 6)), contact_names=names, joint_names=body.joint_names,
    )  # fmt: skip


def foot(body, name, placement, friction=0.7) -> Contact:
    return sole(
        name, placement.translation, rotation=placement.rotation, length=body.sole_length,
        width=body.sole_width, friction=friction, normal_force_cap=1500.0,
    )  # fmt: skip


def beginning(plan: Plan, end: float) -> Plan:
    """A motion up to a time [s], with what stands by then: for what is seen before its end."""
    motion, rows = plan.motion, plan.motion.time <= end + 1e-9
    samples = {
        name: values[rows] for name, values in motion.arrays().items() if len(values) == len(motion.time)
    }
    instants = plan.schedule.instants
    count = int(np.searchsorted(instants, end - 1e-9))
    schedule = ContactSchedule(StanceSequence(list(plan.schedule.sequence)[:count]), [*instants[:count], end])
    return Plan(plan.body, replace(motion, **samples), schedule)


@pytest.fixture(scope="session")
def cut() -> Callable[[Plan, float], Plan]:
    """See :func:`beginning`."""
    return beginning


@pytest.fixture(scope="session")
def body() -> BodyModel:
    return human()


@pytest.fixture(scope="session")
def stand(body) -> Callable[..., Plan]:
    """Both feet hold; the CoM follows ``offset(t)`` from where it stands (3,)."""

    def make(duration, offset=lambda _: np.zeros(3), friction=0.7, person=body) -> Plan:
        kinematics = Kinematics(person)
        contacts = [foot(person, *item, friction) for item in zip(FEET, kinematics.feet, strict=True)]
        schedule = ContactSchedule(StanceSequence([Phase(Stance(contacts))]), [0.0, duration])
        states = moving(person, duration, lambda t, k: k.com + offset(t), lambda _, k: k.feet)
        return Plan(person, make_motion(person, *states, schedule), schedule)

    return make


@pytest.fixture(scope="session")
def step(body) -> Callable[..., Plan]:
    """Shift over the left foot, move the right one by ``stride`` (3,), shift back."""

    @cache
    def make(shift=1.2, swing=0.8, stride=(0.0, 0.0, 0.0), height=0.08) -> Plan:
        kinematics = Kinematics(body)
        left, right = kinematics.feet
        landed = pin.SE3(right.rotation, right.translation + np.asarray(stride))
        lift, land, end = shift, shift + swing, 2 * shift + swing
        both = [foot(body, "left_foot", left), foot(body, "right_foot", right)]
        after = [both[0], foot(body, "right_foot", landed)]
        phases = [Phase(Stance(both)), Phase(Stance(both[:1])), Phase(Stance(after))]
        schedule = ContactSchedule(StanceSequence(phases), [0.0, lift, land, end])

        def com_at(time, k):
            over = np.array([*left.translation[:2], k.com[2] - 0.06])
            final = k.com + 0.5 * np.asarray(stride) - [0.0, 0.0, 0.03]
            return (
                k.com + smooth(time / lift) * (over - k.com) + smooth((time - land) / shift) * (final - over)
            )

        def feet_at(time, _):
            share = np.clip((time - lift) / swing, 0.0, 1.0)
            place = right.translation + smooth(share) * np.asarray(stride)
            place[2] += height * 64 * (share * (1 - share)) ** 3
            return [left, pin.SE3(right.rotation, place)]

        return Plan(body, make_motion(body, *moving(body, end, com_at, feet_at), schedule), schedule)

    return make
